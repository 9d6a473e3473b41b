"""What every transcription of (12) has in common: layout, compiled residual, profiles.

A transcription turns the boundary-value problem into a residual R(x) = 0.  Whatever the
method, the unknowns end in the lengths of all phases but the last and in the four scalars,

    x = (fields of the method, phase lengths, A, m, sigma, lambda),

and R has two equations fewer than x has entries: a question adds the other two.

Of the boundary conditions (14) Theta(1) = 0 is not among them where the tip is free.  By the two
first integrals of (12) it is equivalent to p y_tip = Phi(y_tip), once the other conditions hold,
and the latter can be divided by y_tip.  What is left is regular where the tip comes back to the
plate, where Theta(1) = 0 is not: states with the tip held there cross the branch.  The angle at
the plate is then what tells a solution from a number that only looks like one.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, Self

import casadi as ca
import numpy as np

from ..base.errors import InvalidInput
from ..model.bond import Piece
from ..model.equations import FIELDS, SCALARS, Scalars, identity, symbolic
from ..model.stretch import shared_kink
from .compiled import Compiled, Pattern, is_dense, keep

if TYPE_CHECKING:
    import scipy.sparse as sp

#: Pieces of the law from the free tip to the detachment point.
Phases = tuple[Piece, ...]

#: Share of a rod below which a phase has no length.
THIN = 1e-13

#: Points per phase of a profile: enough for a start, sparse enough to be free.
PROFILE_POINTS = 33


@lru_cache(maxsize=64)
def chebyshev(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Chebyshev points on [0, 1], both ends included, and their barycentric weights."""
    k = np.arange(points)
    zeta = 0.5 * (1.0 - np.cos(np.pi * k / (points - 1)))
    weights = (-1.0) ** k
    weights[[0, -1]] *= 0.5
    return zeta, weights


@dataclass(frozen=True, eq=False)
class Profile:
    """Fields of one solution, sampled so that any transcription can start from them.

    Parameters
    ----------
    lengths : ndarray, shape (phases,)
        Share of the detached length that each phase has, from the tip.
    values : ndarray, shape (phases, PROFILE_POINTS, 5)
        Theta, K, n_x, n_y, Y on the Chebyshev points of each phase.
    scalars : Scalars
        As floats.
    """

    lengths: np.ndarray
    values: np.ndarray
    scalars: Scalars

    @property
    def angle_at_plate(self) -> float:
        """theta where the rod lies on the plate [rad]."""
        return float(self.scalars.A * self.values[-1, -1, 0])

    def in_phase(self, phase: int, zeta: np.ndarray) -> np.ndarray:
        """Fields at local coordinates of one phase, shape (len(zeta), 5)."""
        nodes, weights = chebyshev(self.values.shape[1])
        gap = np.subtract.outer(np.asarray(zeta, dtype=float), nodes)
        hit = gap == 0.0
        gap[hit] = 1.0
        kernel = weights / gap
        on_node = hit.any(axis=1)
        kernel[on_node] = hit[on_node]
        return (kernel @ self.values[phase]) / kernel.sum(axis=1, keepdims=True)

    def at(self, xi: np.ndarray) -> np.ndarray:
        """Fields at coordinates 0 <= xi <= 1 from the tip, shape (len(xi), 5)."""
        edges = np.concatenate([[0.0], np.cumsum(self.lengths)])
        edges[-1] = 1.0
        owner = np.clip(np.searchsorted(edges, xi, side="right") - 1, 0, len(self.lengths) - 1)
        out = np.empty((len(xi), self.values.shape[2]))
        for phase in np.unique(owner):
            mine = owner == phase
            out[mine] = self.in_phase(phase, (xi[mine] - edges[phase]) / (edges[phase + 1] - edges[phase]))
        return out

    @property
    def ends(self) -> tuple[float, float]:
        """Y at the tip and Theta at the plate."""
        return float(self.values[0, 0, 4]), float(self.values[-1, -1, 0])

    def heights(self) -> np.ndarray:
        """u = y/y0 on the points of each phase, shape (phases, PROFILE_POINTS)."""
        return self.scalars.height(self.values[:, :, 4])

    def heights_at(self, xi: np.ndarray) -> np.ndarray:
        """u = y/y0 at coordinates 0 <= xi <= 1 from the tip."""
        return self.scalars.height(self.at(xi)[:, 4])

    def coordinates(self) -> np.ndarray:
        """xi of the points of each phase, shape (phases, PROFILE_POINTS)."""
        nodes, _ = chebyshev(self.values.shape[1])
        starts = np.concatenate([[0.0], np.cumsum(self.lengths)[:-1]])
        return starts[:, None] + self.lengths[:, None] * nodes

    def rephased(self, breaks: Sequence[float]) -> Profile:
        """Return the same fields cut into phases at 0 < breaks < 1."""
        edges = np.array([0.0, *breaks, 1.0])
        nodes, _ = chebyshev(PROFILE_POINTS)
        values = np.array([self.at(a + (b - a) * nodes) for a, b in pairwise(edges)])
        return replace(self, lengths=np.diff(edges), values=values)


def require_transcription(value: object) -> Transcription:
    """Return ``value`` if it is a transcription, or say what it is instead."""
    if not isinstance(value, Transcription):
        raise InvalidInput(
            f"transcription must be a Transcription, got {value!r:.60}.",
            remedy="Pass Spectral(), Collocation() or Shooting().",
        )
    return value


class Discretisation(ABC):
    """A transcription applied to a sequence of phases: the compiled residual and its readers."""

    #: The transcription, where a finer one of its kind may be wanted.
    settings: Transcription | None = None

    #: Equations that an integrator closes.
    defects = slice(0, 0)

    def __init__(self, phases: Phases, field_count: int, extra: int = 0) -> None:
        self.phases = phases
        self.field_count = field_count
        #: Number of unknowns.
        self.size = field_count + len(phases) - 1 + extra + len(SCALARS)
        self.x = ca.MX.sym("x", self.size)
        self._samplers: dict[bytes, Compiled] = {}
        #: Systems closed by questions, by the kinds of their closures.
        self.closed: dict[tuple[str, ...], Any] = {}
        #: Where the fields, the lengths of all phases but the last, further unknowns of a scene, and the
        #: scalars stand among the unknowns, and in whatever else has their shape.
        self.fields = slice(0, field_count)
        self.inner = slice(field_count, field_count + len(phases) - 1)
        self.extra = slice(self.inner.stop, self.size - len(SCALARS))
        self.tail = slice(self.extra.stop, self.size)
        #: Unknowns that are samples of one field each, and are measured together.
        self.blocks: tuple[slice, ...] = (self.fields,)

    @property
    def weight(self) -> int:
        """Numbers in its matrices, by which compiled problems are kept or dropped."""
        return 50 * self.size

    def release(self) -> None:
        """Drop what is compiled; it is compiled again when asked for."""
        for name in self._compiled:
            self.__dict__.pop(name, None)
        self._samplers.clear()
        self.closed.clear()

    #: Properties that hold compiled functions, or the expressions they are made of.
    _compiled: ClassVar[tuple[str, ...]] = (
        "expression",
        "linearised",
        "_linearise",
        "_residual",
        "tip_height",
        "_profile_sampler",
    )

    @property
    def form(self) -> type[Scalars]:
        """What stands for the scalars among the unknowns."""
        return Scalars

    @property
    def identity_row(self) -> int | None:
        """Which equation is the identity at a free tip; None where that is not known, or there is none."""
        return None

    def symbols(self) -> tuple[ca.MX, list[ca.MX], ca.MX]:
        """Field unknowns, phase lengths and scalars as CasADi expressions."""
        fields, inner, tail = (self.x[part] for part in (self.fields, self.inner, self.tail))
        free = ca.vertsplit(inner) if len(self.phases) > 1 else []
        return fields, [*free, 1 - sum(free)], tail

    @abstractmethod
    def residual_expression(self) -> ca.MX:
        """R(x), two entries fewer than x."""

    def edge_equation(self, angle: ca.MX, tip: ca.MX) -> ca.MX:
        """Theta(1) = 0, or the identity of the first integrals, from which it follows.

        Parameters
        ----------
        angle, tip : casadi.MX
            Theta(1) and Y(0).
        """
        piece = self.phases[0]
        if piece.lost is None:
            return angle
        Y, (s, scalars) = ca.SX.sym("Y"), symbolic()
        return ca.Function("identity", [Y, s], [identity(Y, scalars, piece)])(tip, self.x[self.tail])

    @abstractmethod
    def sample_expression(self, zeta: np.ndarray) -> ca.MX:
        """Fields at the same local coordinates in every phase, (phases * len(zeta)) x 5."""

    @abstractmethod
    def pack_fields(self, profile: Profile) -> np.ndarray:
        """Field unknowns of a profile that has these phases."""

    @cached_property
    def expression(self) -> ca.MX:
        """The residual expression, built once."""
        return self.residual_expression()

    def linearised_expressions(self) -> tuple[ca.MX, ca.MX]:
        """R(x) and dR/dx; a method that knows a cheaper way than automatic differentiation takes it."""
        return self.expression, ca.jacobian(self.expression, self.x)

    @cached_property
    def linearised(self) -> ca.Function:
        """Compiled x -> (R, dR/dx)."""
        keep(self)
        return ca.Function("linearised", [self.x], list(self.linearised_expressions()))

    @cached_property
    def _linearise(self) -> tuple[Compiled, Pattern | None]:
        residual, jacobian = self.linearised(self.x)
        if is_dense(jacobian.sparsity()):
            return Compiled(ca.Function("dense", [self.x], [residual, ca.densify(jacobian)])), None
        return Compiled(self.linearised), Pattern.of(self.linearised.sparsity_out(1))

    def linearise(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray | sp.csc_matrix]:
        """R and dR/dx as arrays; the latter sparse in large systems that are mostly zeros."""
        compiled, pattern = self._linearise
        residual, jacobian = compiled(x)
        return residual, jacobian if pattern is None else pattern.matrix(jacobian)

    @cached_property
    def _residual(self) -> Compiled:
        keep(self)
        return Compiled(ca.Function("residual", [self.x], [self.expression]))

    def residual(self, x: np.ndarray) -> np.ndarray:
        """R alone, for the price of a few products of a matrix and a vector."""
        return self._residual(x)[0]

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """R alone of a stack of unknowns, one a row."""
        return self._residual.many(x)[0]

    @cached_property
    def _profile_sampler(self) -> Compiled:
        keep(self)
        return self.sampler(chebyshev(PROFILE_POINTS)[0])

    def sampler(self, zeta: np.ndarray) -> Compiled:
        """Compiled x -> fields at local coordinates ``zeta`` of every phase, remembered."""
        key = np.asarray(zeta, dtype=float).tobytes()
        if key not in self._samplers:
            sampled = ca.densify(self.sample_expression(zeta))
            self._samplers[key] = Compiled(ca.Function("sample", [self.x], [sampled]))
        return self._samplers[key]

    def column(self, scalar: str) -> int:
        """Place of one scalar among the unknowns, by its name in `Scalars`."""
        return self.tail.start + SCALARS.index(scalar)

    def scalars(self, x: np.ndarray) -> Scalars:
        """The scalars of a solution, as floats."""
        return self.form.of_unknowns(*x[self.tail].tolist())

    def lengths(self, x: np.ndarray) -> np.ndarray:
        """Lengths of all phases, shares of 1."""
        if len(self.phases) == 1:
            return np.ones(1)
        free = x[self.inner]
        return np.append(free, 1.0 - free.sum())

    def without_points(self, x: np.ndarray) -> tuple[Discretisation, np.ndarray]:
        """Return the same solution without phases of no length, which it has at a corner of a branch."""
        keep = self.lengths(x) > THIN
        if keep.all() or self.settings is None:
            return self, x
        profile = self.profile(x)
        lengths = profile.lengths[keep] / profile.lengths[keep].sum()
        phases = tuple(piece for piece, kept in zip(self.phases, keep, strict=True) if kept)
        problem = self.settings.discretise(phases)
        return problem, problem.pack(replace(profile, lengths=lengths, values=profile.values[keep]))

    def profile(self, x: np.ndarray) -> Profile:
        """Sample a solution."""
        values = self._profile_sampler(x)[0].reshape(len(self.phases), PROFILE_POINTS, len(FIELDS))
        return Profile(self.lengths(x), values, self.scalars(x))

    def prolonged(self, x: np.ndarray, finer: Discretisation) -> np.ndarray:
        """Unknowns of the same solution on another mesh of the same phases."""
        return finer.pack(self.profile(x))

    def pack(self, profile: Profile) -> np.ndarray:
        """Unknowns that represent a profile with these phases."""
        tail = self.form.as_unknowns(profile.scalars)
        return np.concatenate([self.pack_fields(profile), profile.lengths[:-1], tail])


class Transcription(ABC):
    """A way to discretise (12), with its settings as fields."""

    @property
    def sure_gain(self) -> float:
        """Factor by which `refined` shrinks any error even before its order shows; 1 if none is sure."""
        return 1.0

    def gain_at(self, problem: Any, x: np.ndarray) -> float:
        """Factor by which `refined` is sure to shrink the error of this solution."""
        return self.sure_gain

    def whole_error(self, problem: Any, x: np.ndarray, difference: float) -> float:
        """Error of a solution so far from that on the refined mesh; infinite where no gain is sure."""
        gain = self.gain_at(problem, x)
        return difference * gain / (gain - 1.0) if gain > 1.0 else math.inf

    @property
    def most_gain(self) -> float:
        """Factor by which `refined` shrinks the error in the end; infinite where there is no order."""
        return math.inf

    @abstractmethod
    def discretise(self, phases: Phases) -> Discretisation:
        """Return the compiled problem for these phases; the same object for the same phases."""

    @abstractmethod
    def refined(self) -> Any:
        """Return the same method with a finer mesh."""


@dataclass(frozen=True)
class FixedOrder(Transcription):
    """A transcription on intervals, whose error falls with a power of their length.

    A subclass is a frozen dataclass that gives ``intervals`` a default.
    """

    intervals: int

    @property
    @abstractmethod
    def order(self) -> int:
        """Power of the length of an interval with which errors fall in the end."""

    @property
    def sure_gain(self) -> float:
        """Doubling the intervals gains about half the order from the start; half of that is sure."""
        return 1.0 + 2.0 ** (self.order / 2 - 1)

    @property
    def most_gain(self) -> float:
        """Doubling the intervals gains 2^order in the end."""
        return 2.0**self.order

    def refined(self) -> Self:
        """Twice as many intervals."""
        return replace(self, intervals=2 * self.intervals)


def held(phases: Phases) -> Phases:
    """Return the same phases for a rod whose tip may be held to the plate."""
    return tuple(replace(piece, lost=None) for piece in phases)


def switch_equations(phases: Phases, heights: Sequence[ca.MX]) -> list[ca.MX]:
    """y = y0 u_kink where one phase ends and the next begins.

    ``heights`` are u at the end of every phase but the last.
    """
    return [u - shared_kink(a, b) for u, a, b in zip(heights, phases[:-1], phases[1:], strict=True)]
