"""The spectral form of (12) for many states of one layout at once, under laws of straight pieces.

The structure is that of `spectral_fields`: a field is a constant matrix times a pointwise function of
the fields before it.  There it is compiled for one state; here NumPy goes through a stack of states.  In
both an outermost part without traction may be a `free_arc` instead of nodes.  With 16 nodes, for one
state in a stack of 64, residual, Jacobian and its inverse take

    one phase                         22 + 7 us compiled, 12 + 7 us here
    a free arc and a cohesive phase   30 + 9 us compiled, 17 + 8 us here

Both are held together by tests.  Every product is one of its own for each state, and everything else
goes element by element: what comes out for a state does not depend, in any bit, on those beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np

from ..model.bond import Affine, Piece
from ..model.equations import SCALARS, Scalars, identity
from ..model.stretch import shared_kink
from .closures import EQUATIONS
from .discretisation import Phases
from .free_arc import FreeArc
from .linear import IMAGINARY
from .spectral import Spectral

#: Where the scalars stand among the unknowns of a state.
TAIL = slice(-len(SCALARS), None)

#: Steps of the scalars, one after the other, along the imaginary axis.
STEPS = 1j * IMAGINARY * np.eye(len(SCALARS))[:, :, None]

#: Angle below which derivatives by the amplitude are taken from their series, and terms of these.
SMALL, TERMS = 0.3, 6


@dataclass(frozen=True, eq=False)
class _Fields:
    """What residual and Jacobian share; along the first axis the states, along the second the nodes.

    ``sine``, ``cosine`` are those of A Theta; ``slope`` is sin(A Theta)/A and ``versine`` (1 - cos)/A.
    K, Theta and rise go on at the plate.
    """

    arc: FreeArc | None
    h: np.ndarray
    K: np.ndarray
    Theta: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray
    slope: np.ndarray
    versine: np.ndarray
    rise: np.ndarray
    load: np.ndarray
    ny: np.ndarray

    @property
    def Y_tip(self) -> np.ndarray:
        return -self.rise[:, -1]


class Stack:
    """(12) for many states at once: a phase with nodes, and a free arc above it or none.

    The unknowns of a state are Theta'' at the nodes, the share of the length that is free where some is,
    and the four scalars; there are two equations fewer.

    Parameters
    ----------
    settings : Spectral
    phases : tuple of Piece
        Such as `serves` is true of.
    """

    def __init__(self, settings: Spectral, phases: Phases) -> None:
        if not serves(phases):
            raise ValueError("such phases cannot be stacked")
        self.settings, self.phases = settings, phases
        self.nodes, self.free = settings.nodes * settings.elements, len(phases) - 1
        #: Unknowns that the shape depends on beside the scalars.
        self.shape = self.nodes + self.free
        self.size = self.shape + 4
        #: Which equation is the identity.
        self.identity_row = self.nodes + 1
        #: The phase with nodes by itself.
        self._problem = settings.discretise(phases[-1:])
        self._matrix = np.vstack(self._problem.chain(self._problem.zeta))
        self._twice = self._matrix @ self._matrix[: self.nodes]
        drop = phases[-1].drop
        assert isinstance(drop, Affine)
        self._softening = drop.slope
        self._kink = shared_kink(*phases) if self.free else math.nan

    # --- reading ----------------------------------------------------------------------------------

    def scalars(self, x: np.ndarray) -> Scalars:
        """The four scalars of states, each an array."""
        return Scalars(*np.ascontiguousarray(x[:, TAIL].T))

    def shares(self, x: np.ndarray) -> np.ndarray:
        """Share of the length that is free."""
        return x[:, self.nodes] if self.free else np.zeros(len(x))

    def shapes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Theta and Theta' at the nodes and at the plate, and the height u of the tip."""
        f = self._fields(x)
        return f.Theta, f.K, self.scalars(x).height(f.Y_tip)

    def ends(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Y at the tip and Theta at the plate."""
        f = self._fields(x)
        return f.Y_tip, f.Theta[:, -1]

    def spread(self, x: np.ndarray) -> np.ndarray:
        """Unknowns of the same states as ``settings.discretise(phases)`` has them."""
        if not self.free:
            return x
        return np.concatenate([FreeArc(self.shares(x), self.scalars(x)).bend(self._problem.zeta), x], axis=1)

    def spread_rates(self, x: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Return directions of change of states as those of what `spread` makes of them."""
        if not self.free:
            return rates
        arc = FreeArc(self.shares(x), self.scalars(x))
        return np.concatenate([arc.bend_rate(self._problem.zeta, rates[:, self.nodes :]), rates], axis=1)

    def gathered(self, x: np.ndarray) -> np.ndarray:
        """Return the unknowns here of states that are `spread`."""
        return x[:, -self.size :]

    def heights(self, x: np.ndarray) -> np.ndarray:
        """u at the tip and at the nodes, shape (states, 1 + nodes)."""
        f, s = self._fields(x), self.scalars(x)
        Y = f.Y_tip[:, None] + np.concatenate([np.zeros((len(x), 1)), f.rise[:, : self.nodes]], axis=1)
        height: np.ndarray = s.height(1.0)[:, None] * Y
        return height

    @cached_property
    def finer(self) -> Stack:
        """The same on the next finer mesh."""
        return stack_of(self.settings.refined(), self.phases)

    def prolonged(self, x: np.ndarray, to: Stack | None = None) -> np.ndarray:
        """Return the same states on another mesh, the next finer one by default."""
        return self._problem.prolonged(x, (to or self.finer)._problem)

    def restricted(self, residual: np.ndarray) -> np.ndarray:
        """Return a residual on the next finer mesh as the equations of this one."""
        return self._problem.restricted(residual, self.finer._problem)

    # --- equations --------------------------------------------------------------------------------

    def equations(self, x: np.ndarray, kinds: Sequence[str], given: np.ndarray) -> np.ndarray:
        """Residual of every state with the closures of a question below it, shape (states, size)."""
        return self._closed(x, self._fields(x), _closing(kinds, given))

    def linearise(
        self, x: np.ndarray, kinds: Sequence[str], given: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """`equations` and their Jacobian, shape (states, size, size)."""
        f, closing = self._fields(x), _closing(kinds, given)
        jacobian = np.zeros((len(x), self.size, self.size))
        self._jacobian(x, f, jacobian[:, : -len(closing)])
        for row, equation in enumerate(closing, start=self.size - len(closing)):
            jacobian[:, row, TAIL] = gradient(equation, x)
        return self._closed(x, f, closing), jacobian

    def _closed(
        self, x: np.ndarray, f: _Fields, closing: Sequence[Callable[[Scalars], np.ndarray]]
    ) -> np.ndarray:
        """(12a) at the nodes, K(1) = 0, the identity at the tip, y = y0 at the switch, the closures."""
        s = self.scalars(x)
        bend = f.ny * f.cosine + s.alpha[:, None] * f.rise[:, : self.nodes] * f.sine
        rows = [f.K[:, -1], identity(f.Y_tip, s, self.phases[0])]
        if f.arc is not None:  # u = y/y0 where it ends
            rows.append(s.height(f.Y_tip + f.arc.end[:, 2]) - self._kink)
        rows += [equation(s) for equation in closing]
        return np.concatenate([x[:, : self.nodes] - bend, np.stack(rows, axis=1)], axis=1)

    def _fields(self, x: np.ndarray) -> _Fields:
        n, s = self.nodes, self.scalars(x)
        A, alpha = s.A[:, None], s.alpha[:, None]
        h = 1.0 - self.shares(x)[:, None]
        arc = FreeArc(self.shares(x), s) if self.free else None
        Theta0, K0, rise0, ny0 = (-1.0, 0.0, 0.0, 0.0) if arc is None else arc.end.T[:, :, None]
        K = K0 + _applied(self._matrix, h * x[:, :n])
        Theta = Theta0 + _applied(self._matrix, h * K[:, :n])
        angle = A * Theta[:, :n]
        sine, cosine = np.sin(angle), np.cos(angle)
        straight = angle == 0.0
        safe = np.where(straight, 1.0, angle)
        slope = Theta[:, :n] * np.where(straight, 1.0, sine / safe)
        # (1 - cos)/A = 2 A (sin(A Theta/2)/A)^2, without cancellation.
        half = Theta[:, :n] * np.where(straight, 0.5, np.sin(0.5 * angle) / safe)
        versine = 2.0 * A * half * half
        rise = rise0 + _applied(self._matrix, h * slope)
        load = s.m[:, None] - alpha * versine
        load += (self._softening * s.beta1)[:, None] * (rise[:, :n] - rise[:, -1:])
        ny = ny0 + _applied(self._matrix[:n], h * load)
        return _Fields(arc, h, K, Theta, sine, cosine, slope, versine, rise, load, ny)

    def _rate(
        self, f: _Fields, values: np.ndarray, change: np.ndarray, begin: np.ndarray | None
    ) -> np.ndarray:
        """Gradient of an integral, given that of the field at the nodes and that of where it begins."""
        if begin is None:
            return self._matrix @ change
        inside = f.h[:, :, None] * change
        inside[:, :, self.nodes] -= values
        rate = self._matrix @ inside
        rate[:, :, self.nodes :] += begin[:, None, : rate.shape[2] - self.nodes]
        return rate

    def _jacobian(self, x: np.ndarray, f: _Fields, out: np.ndarray) -> None:
        """Write the gradient of the residual into ``out``, shape (states, size - 2, size)."""
        n, shape, s = self.nodes, self.shape, self.scalars(x)
        begin: Sequence[np.ndarray | None] = (None,) * 4
        if f.arc is not None:
            begin = tuple(np.moveaxis(f.arc.rates(), 1, 0))
        A, m, alpha = (v[:, None] for v in (s.A, s.m, s.alpha))
        Theta, rise = f.Theta[:, :n], f.rise[:, :n]
        if self.free:
            change = np.zeros((len(x), n, self.size))
            change[:, :, :n] = np.eye(n)
            dK = self._rate(f, x[:, :n], change, begin[1])
            dTheta = self._rate(f, f.K[:, :n], dK[:, :n], begin[0])
        else:
            # Nothing but the nodes counts, and it does so linearly.
            dK, dTheta = (np.zeros((1, n + 1, self.size)) for _ in range(2))
            dK[0, :, :n], dTheta[0, :, :n] = self._matrix, self._twice
        angle, square = A * Theta, Theta * Theta

        change = f.cosine[:, :, None] * dTheta[:, :n]
        change[:, :, shape] += square * _slope_by_amplitude(angle, f.sine, f.cosine)
        drise = self._rate(f, f.slope, change, begin[2])

        change = (self._softening * s.beta1)[:, None, None] * (drise[:, :n] - drise[:, -1:])
        change -= (alpha * f.sine)[:, :, None] * dTheta[:, :n]
        by_A = square * _versine_by_amplitude(angle, f.sine, f.cosine)
        change[:, :, shape] -= m * f.versine + alpha * by_A
        change[:, :, shape + 1] += 1.0 - A * f.versine
        by_sigma = 3.0 * s.sigma[:, None] ** 2
        change[:, :, shape + 2] -= by_sigma * f.versine
        change[:, :, shape + 3] += self._softening * (rise - f.rise[:, -1:])
        dny = self._rate(f, f.load, change, begin[3])[:, :n]

        rows = out[:, :n]
        np.multiply(-f.cosine[:, :, None], dny, out=rows)
        rows -= (alpha * f.sine)[:, :, None] * drise[:, :n]
        turn = alpha * rise * f.cosine - f.sine * f.ny
        rows -= (A * turn)[:, :, None] * dTheta[:, :n]
        rows[:, :, shape] -= Theta * turn + m * rise * f.sine
        rows[:, :, shape + 1] -= A * rise * f.sine
        rows[:, :, shape + 2] -= by_sigma * rise * f.sine
        diagonal = np.arange(n)
        rows[:, diagonal, diagonal] += 1.0

        out[:, n] = dK[:, -1]
        out[:, n + 1] = -_by_height(s, f.Y_tip, self.phases[0])[:, None] * drise[:, -1]
        out[:, n + 1, TAIL] += gradient(lambda s: identity(f.Y_tip, s, self.phases[0]), x)
        if f.arc is not None:
            Y = f.Y_tip + f.arc.end[:, 2]
            out[:, n + 2] = -s.height(1.0)[:, None] * drise[:, -1]
            assert begin[2] is not None
            out[:, n + 2, n:] += s.height(1.0)[:, None] * begin[2]
            out[:, n + 2, TAIL] += gradient(lambda s: s.height(Y), x)


def serves(phases: Phases) -> bool:
    """Whether states of these phases can be stacked: one that softens evenly, with a free arc or without."""
    *outer, last = phases
    softens = last.is_first and isinstance(last.drop, Affine) and last.drop.offset == 0.0
    return softens and last.lost is not None and (not outer or (len(outer) == 1 and _lets_go(outer[0])))


def _lets_go(piece: Piece) -> bool:
    """Whether there is no traction."""
    return piece.drop == Affine(1.0, 0.0) and piece.lost is not None


@lru_cache(maxsize=16)
def stack_of(settings: Spectral, phases: Phases) -> Stack:
    """Return the stack of a mesh and a layout, remembered."""
    return Stack(settings, phases)


def gradient(read: Callable[[Scalars], Any], x: np.ndarray) -> np.ndarray:
    """Gradient of a number by the four scalars, by complex steps, shape (states, 4)."""
    # All four steps at once: along the first axis of every scalar.
    moved = x[:, TAIL].T[:, None, :] + STEPS
    slopes = np.empty(moved.shape[1:])
    slopes[:] = np.imag(read(Scalars(*moved)))
    return np.ascontiguousarray(slopes.T) / IMAGINARY


def _by_height(s: Scalars, Y_tip: np.ndarray, piece: Piece) -> np.ndarray:
    """Derivative of the identity by the scaled height of the tip."""
    return np.imag(identity(Y_tip + 1j * IMAGINARY, s, piece)) / IMAGINARY


def _closing(kinds: Sequence[str], given: np.ndarray) -> list[Callable[[Scalars], np.ndarray]]:
    """Closures of these kinds as functions of the scalars; ``given`` has a column for each."""

    def equation(kind: str, number: np.ndarray, scalars: Scalars) -> np.ndarray:
        value: np.ndarray = EQUATIONS[kind](scalars, number)
        return value

    return [partial(equation, kind, number) for kind, number in zip(kinds, given.T, strict=True)]


def _applied(matrix: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return a matrix times the values of every state, one product for each."""
    return (matrix @ values[:, :, None])[:, :, 0]


def _slope_by_amplitude(x: np.ndarray, sine: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """(cos x - sin(x)/x) / x, the derivative of sin(A Theta)/A by A over Theta^2, at x = A Theta."""
    small = np.abs(x) < SMALL
    safe = np.where(small, 1.0, x)
    return np.where(small, -x * _series(x, 2), (cosine - sine / safe) / safe)


def _versine_by_amplitude(x: np.ndarray, sine: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """(x sin x - (1 - cos x)) / x^2, the derivative of (1 - cos(A Theta))/A by A over Theta^2."""
    small = np.abs(x) < SMALL
    safe = np.where(small, 1.0, x)
    return np.where(small, _series(x, 1), (safe * sine - (1.0 - cosine)) / (safe * safe))


def _series(x: np.ndarray, first: int) -> np.ndarray:
    """Sum over k of (-1)^k x^(2k) (1/n! - 1/(n + 1)!), n = first + 2k."""
    q, total = x * x, np.zeros_like(x)
    for k in reversed(range(TERMS)):
        n = first + 2 * k
        total = (1.0 / math.factorial(n) - 1.0 / math.factorial(n + 1)) - q * total
    return total
