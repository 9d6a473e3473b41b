"""Cohesive laws: traction, work of separation, kinks.

A law is a shape tau(u), the traction over T0 against the separation u = y/y0, with
tau(0) = 1.  The rod owns T0 and y0.  Between its kinks a law is smooth; each smooth stretch
is a `Piece`, and an equilibrium gives every piece it visits a phase of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InvalidInput

if TYPE_CHECKING:
    from .elastica import Scalars

Shape = Callable[[Any], Any]


@dataclass(frozen=True)
class Affine:
    """The drop 1 - tau = offset + slope u, for which no digit is lost at any amplitude."""

    offset: float
    slope: float

    def __call__(self, u: Any) -> Any:
        """Return offset + slope u."""
        return self.offset + self.slope * u


@dataclass(frozen=True)
class Piece:
    """One smooth stretch of a law, ``start`` <= u <= ``stop``; smooth also beyond both."""

    start: float
    stop: float
    drop: Shape

    def pull(self, Y: Any, scalars: Scalars) -> Any:
        """(beta0 / A) (1 - tau(u)), what the bond has lost, over the amplitude."""
        if isinstance(self.drop, Affine):
            pull = self.drop.slope * scalars.beta1 * Y if self.drop.slope else 0.0
            return pull + (self.drop.offset * scalars.beta0 / scalars.A if self.drop.offset else 0.0)
        return scalars.beta0 / scalars.A * self.drop(scalars.height(Y))


@dataclass(frozen=True)
class _Complement:
    """u -> 1 - shape(u); a class, so that laws stay comparable and picklable."""

    shape: Shape

    def __call__(self, u: Any) -> Any:
        return 1.0 - self.shape(u)


@dataclass(frozen=True)
class _Blend:
    """(1 - h) first + h second."""

    first: Shape
    second: Shape
    h: float

    def __call__(self, u: Any) -> Any:
        return (1.0 - self.h) * self.first(u) + self.h * self.second(u)


@dataclass(frozen=True)
class CohesiveLaw:
    """A vertical cohesive law of the user's own.

    Parameters
    ----------
    tau : callable or sequence of callables
        Traction over T0 as a function of u = y/y0, tau(0) = 1.  It must accept CasADi
        expressions: arithmetic, ``casadi.exp`` and the like.  With kinks, one callable for
        each of the ``len(kinks) + 1`` pieces, each smooth a little beyond its own piece;
        a single callable serves all pieces.
    kinks : sequence of float, optional
        The u where tau is not smooth, increasing.
    name : str, optional
    drop : callable or sequence of callables, optional
        1 - tau without cancellation near u = 0 (``-casadi.expm1(-u)`` rather than
        ``1 - casadi.exp(-u)``).  Without it digits are lost as p -> T0.
    work : callable, optional
        Integral of tau from 0 to u.  Without it, by quadrature.

    Raises
    ------
    InvalidInput
        If tau(0) is not 1, kinks are not increasing and positive, or values are not finite.
    """

    tau: Shape | Sequence[Shape]
    kinks: tuple[float, ...] = ()
    name: str = "custom"
    drop: Shape | Sequence[Shape] | None = None
    work: Callable[[float], float] | None = None
    pieces: tuple[Piece, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        kinks = tuple(float(k) for k in self.kinks)
        if any(not math.isfinite(k) or k <= 0 for k in kinks) or list(kinks) != sorted(set(kinks)):
            raise InvalidInput(f"kinks of a law must be finite, positive and increasing, got {kinks}.")
        object.__setattr__(self, "kinks", kinks)
        shapes = self._per_piece("tau", self.tau)
        drops: tuple[Shape, ...] = tuple(_Complement(shape) for shape in shapes)
        if self.drop is not None:
            drops = self._per_piece("drop", self.drop)
        object.__setattr__(self, "tau", shapes)
        object.__setattr__(self, "drop", drops)
        edges = (-math.inf, *kinks, math.inf)
        pieces = tuple(Piece(a, b, d) for a, b, d in zip(edges[:-1], edges[1:], drops, strict=True))
        object.__setattr__(self, "pieces", pieces)
        self._validate()

    def _per_piece(self, name: str, shape: Shape | Sequence[Shape]) -> tuple[Shape, ...]:
        count = len(self.kinks) + 1
        shapes = (shape,) * count if callable(shape) else tuple(shape)
        if len(shapes) != count or not all(callable(s) for s in shapes):
            raise InvalidInput(
                f"{name} of a law with {count - 1} kinks needs one callable or {count}, got {shape!r}."
            )
        return shapes

    def _validate(self) -> None:
        first = float(self.tau[0](0.0))  # type: ignore[index]
        if not abs(first - 1.0) < 1e-12:
            raise InvalidInput(
                f"tau(0) of law {self.name!r} must be 1, got {first:g}.",
                remedy="Divide by the strength; the rod owns T0.",
            )
        probe = np.unique([*np.linspace(0.0, 2.0 * max(self.kinks, default=1.0), 9), *self.kinks])
        for u in probe:
            piece = self.pieces[self.piece_at(u)]
            traction, drop = self.traction(u), float(piece.drop(u))
            if not (math.isfinite(traction) and abs(traction + drop - 1.0) < 1e-9):
                raise InvalidInput(
                    f"law {self.name!r} at u = {u:g}: tau = {traction:g}, drop = {drop:g};"
                    " both must be finite and add up to 1."
                )

    def piece_at(self, u: float) -> int:
        """Index of the piece that holds ``u``; a kink belongs to the piece below it."""
        return int(np.searchsorted(self.kinks, u, side="left"))

    def traction(self, u: float) -> float:
        """tau(u), the traction over T0 at separation u = y/y0."""
        return float(self.tau[self.piece_at(u)](float(u)))  # type: ignore[index]

    def separation_work(self, u: float) -> float:
        """Integral of tau from 0 to ``u``, the work of separation over T0 y0."""
        if self.work is not None:
            return float(self.work(float(u)))
        from scipy.integrate import quad

        edges = [0.0, *(k for k in self.kinks if 0 < k < u), float(u)]
        return math.fsum(
            quad(self.tau[i], a, b, epsabs=1e-14, epsrel=1e-13)[0]  # type: ignore[index]
            for i, (a, b) in enumerate(pairwise(edges))
        )

    def mean_traction(self, u: float) -> float:
        """Work of separation over u: by the first integral of (12), P = p/T0 at tip height u."""
        if u == 0.0:
            return 1.0
        return self.separation_work(u) / u

    def tip_height(self, pressure_ratio: float) -> float:
        """Height u > 0 of the tip under p/T0 = ``pressure_ratio``, from p y = Phi(y).

        Raises
        ------
        NoEquilibrium
            If no height has this mean traction (p >= T0, or below what the law can carry).
        """
        from scipy.optimize import brentq

        from .errors import NoEquilibrium

        def excess(u: float) -> float:
            return self.mean_traction(u) - pressure_ratio

        low, high = 1e-12, 1.0
        while excess(high) > 0.0 and high < 1e12:
            low, high = high, 2.0 * high
        if pressure_ratio >= 1.0 or excess(high) > 0.0:
            raise NoEquilibrium(f"no tip height has p/T0 = {pressure_ratio:g} under law {self.name!r}.")
        return float(brentq(excess, low, high, xtol=1e-15, rtol=1e-14))

    @property
    def initial_slope(self) -> float:
        """-d tau/du at u = 0; T lies at beta1 = pi^4 / slope, nowhere if it is zero."""
        drop = self.pieces[0].drop
        if isinstance(drop, Affine):
            return drop.slope
        import casadi as ca

        u = ca.SX.sym("u")
        return float(ca.Function("slope", [u], [ca.jacobian(drop(u), u)])(0.0))

    def blend(self, other: CohesiveLaw, h: float) -> CohesiveLaw:
        """Return the law (1 - h) self + h other, with the kinks of both."""
        kinks = tuple(sorted({*self.kinks, *other.kinks}))
        edges = (0.0, *kinks)

        def mixed(part: str) -> tuple[Shape, ...]:
            middles = [0.5 * (a + b) for a, b in zip(edges, (*kinks, edges[-1] + 2.0), strict=True)]
            return tuple(
                _Blend(getattr(self, part)[self.piece_at(u)], getattr(other, part)[other.piece_at(u)], h)
                for u in middles
            )

        return CohesiveLaw(mixed("tau"), kinks, name=f"{self.name}~{other.name}", drop=mixed("drop"))


def _linear_work(u: float) -> float:
    return u - 0.5 * u * u


def _cohesive_work(u: float) -> float:
    return _linear_work(min(u, 1.0))


_OPENING = Affine(0.0, 1.0)
_FREE = Affine(1.0, 0.0)

#: Fig 2b: the traction keeps falling past y0, where it pushes.  Exact while y <= y0.
LINEAR = CohesiveLaw(Affine(1.0, -1.0), name="linear", drop=_OPENING, work=_linear_work)

#: Law (8) for y >= 0: linear decrease to zero at y0, nothing beyond.
COHESIVE = CohesiveLaw(
    (Affine(1.0, -1.0), Affine(0.0, 0.0)),
    (1.0,),
    name="cohesive",
    drop=(_OPENING, _FREE),
    work=_cohesive_work,
)


def exponential() -> CohesiveLaw:
    """tau = exp(-u): no kink, the same initial slope as law (8), work 1 - exp(-u)."""
    import casadi as ca

    return CohesiveLaw(
        lambda u: ca.exp(-u), name="exponential", drop=lambda u: -ca.expm1(-u), work=lambda u: -math.expm1(-u)
    )


def trapezoidal(plateau: float) -> CohesiveLaw:
    """tau = 1 up to u = ``plateau`` < 1, then a straight line to 0 at u = 1.

    With no slope at u = 0 there is no transition T: the critical length is infinite.
    """
    from .checks import positive

    if not positive("plateau", plateau) < 1.0:
        raise InvalidInput(f"plateau must lie between 0 and 1, got {plateau:g}.")
    slope = 1.0 / (1.0 - plateau)
    return CohesiveLaw(
        (Affine(1.0, 0.0), Affine(slope, -slope), Affine(0.0, 0.0)),
        (plateau, 1.0),
        name=f"trapezoidal({plateau:g})",
        drop=(Affine(0.0, 0.0), Affine(-plateau * slope, slope), _FREE),
    )
