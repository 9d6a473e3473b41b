"""Cohesive laws: traction, work of separation, kinks.

A law is a shape tau(u), the traction over T0 against the separation u = y/y0, with
tau(0) = 1.  The rod owns T0 and y0.  Between its kinks a law is smooth; each smooth stretch
is a `Piece`, and an equilibrium gives every piece it visits a phase of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..base.checks import finite, positive
from ..base.errors import InvalidInput, NoEquilibrium
from .law_checks import JUMP, check_law

if TYPE_CHECKING:
    from .equations import Scalars

Shape = Callable[[Any], Any]

#: Separation above which the work keeps its digits; below it the mean of the drop does.
WIDE = 0.5

#: Octaves of u in which a law is looked at for a mean traction that pushes.
FARTHEST = 20

#: Largest kinks of a law, or ranges without one, up to which it is looked at for a traction that rises.
WIDEST = 4.0

#: Separation at which the search for a tip height ends.
HIGHEST = 2.0**60


@dataclass(frozen=True)
class Affine:
    """The drop 1 - tau = offset + slope u, for which no digit is lost at any amplitude."""

    offset: float
    slope: float
    plain: ClassVar[bool] = True

    def __call__(self, u: Any) -> Any:
        """Return offset + slope u."""
        return self.offset + self.slope * u


@dataclass(frozen=True)
class Piece:
    """One smooth stretch of a law, ``start`` <= u <= ``stop``; smooth also beyond both.

    ``lost`` is the integral of the drop from 0 to its beginning.  It is None where the tip is held
    to the plate, and the mean drop up to the tip says nothing about the pressure.  What has been
    opened ``for_good`` stays on its piece however low it comes down: the bond does not heal.
    """

    start: float
    stop: float
    drop: Shape
    lost: float | None = 0.0
    for_good: bool = False

    @property
    def is_first(self) -> bool:
        """Whether the piece begins at u = 0; it goes on below."""
        return self.start == -math.inf

    @property
    def vanishes_smoothly(self) -> bool:
        """Whether ``pull`` and ``mean_pull`` can be evaluated at amplitude zero."""
        from .quotients import is_smooth

        return self.is_first and (isinstance(self.drop, Affine) or is_smooth(self.drop))

    @cached_property
    def lets_go(self) -> bool:
        """Whether there is no traction on it."""
        return self.drop == Affine(1.0, 0.0)

    @property
    def work_done(self) -> float:
        """Work of separation up to where the piece begins, over T0 y0."""
        assert self.lost is not None
        return self.start - self.lost

    def pull(self, Y: Any, scalars: Scalars) -> Any:
        """(beta0 / A) (1 - tau(u)), what the bond has lost, over the amplitude."""
        if isinstance(self.drop, Affine):
            pull = self.drop.slope * scalars.beta1 * Y if self.drop.slope else 0.0
            return pull + (self.drop.offset * scalars.beta0 / scalars.A if self.drop.offset else 0.0)
        if self.vanishes_smoothly:
            from .quotients import over_height

            return scalars.beta1 * Y * over_height(self.drop, scalars.height(Y))
        return scalars.beta0 / scalars.A * self.drop(scalars.height(Y))

    def mean_pull(self, Y: Any, scalars: Scalars) -> Any:
        """(beta0 / A) (1 - Phi(u)/u), the mean of what the bond loses from 0 to u, over the amplitude."""
        from .quotients import mean, mean_over_height

        assert self.lost is not None
        u = scalars.height(Y)
        if isinstance(self.drop, Affine):
            half = Affine(self.drop.offset, 0.5 * self.drop.slope)  # u half(u) integrates the drop
            mean_pull = Piece(self.start, self.stop, half).pull(Y, scalars)
            if self.is_first:
                return mean_pull
            return mean_pull + (self.lost - self.start * half(self.start)) * scalars.beta0 / (scalars.A * u)
        if self.vanishes_smoothly:
            return scalars.beta1 * Y * mean_over_height(self.drop, u)
        if self.is_first:
            return scalars.beta0 / scalars.A * mean(self.drop, u)
        gone = self.lost + (u - self.start) * mean(self.drop, u, self.start)
        return scalars.beta0 / (scalars.A * u) * gone


@dataclass(frozen=True)
class _Complement:
    """u -> 1 - shape(u); a class, so that laws stay comparable and travel between processes."""

    shape: Shape

    def __call__(self, u: Any) -> Any:
        return 1.0 - self.shape(u)


@dataclass(frozen=True)
class _Blend:
    """(1 - h) first + h second."""

    first: Shape
    second: Shape
    h: float
    plain: ClassVar[bool] = True

    def __call__(self, u: Any) -> Any:
        return (1.0 - self.h) * self.first(u) + self.h * self.second(u)


def _blend(first: Shape, second: Shape, h: float) -> Shape:
    if isinstance(first, Affine) and isinstance(second, Affine):
        mix = (1.0 - h) * np.array([first.offset, first.slope]) + h * np.array([second.offset, second.slope])
        return Affine(float(mix[0]), float(mix[1]))
    return _Blend(first, second, h)


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
    holds_to : float
        Largest u the law is meant for; states that open wider are flagged "y > y0".

    Raises
    ------
    InvalidInput
        If tau(0) is not 1, kinks are not increasing and positive, values are not finite, CasADi
        cannot take the law, it has a kink that is not named, ``drop`` or ``work`` belong to
        another law, or ``name`` is that of a law of the package.
    """

    tau: Shape | Sequence[Shape]
    kinks: tuple[float, ...] = ()
    name: str = "custom"
    drop: Shape | Sequence[Shape] | None = None
    work: Callable[[float], float] | None = None
    holds_to: float = math.inf
    pieces: tuple[Piece, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "kinks", _checked_kinks(self.kinks))
        shapes = self._per_piece("tau", self.tau)
        drops: tuple[Shape, ...] = tuple(_Complement(shape) for shape in shapes)
        if self.drop is not None:
            drops = self._per_piece("drop", self.drop)
        object.__setattr__(self, "tau", shapes)
        object.__setattr__(self, "drop", drops)
        edges = (-math.inf, *self.kinks, math.inf)
        pieces = tuple(Piece(a, b, d) for a, b, d in zip(edges[:-1], edges[1:], drops, strict=True))
        object.__setattr__(self, "pieces", pieces)
        check_law(self)
        lost = [self._integral(drops, kink) for kink in (0.0, *self.kinks)]
        pieces = tuple(replace(piece, lost=gone) for piece, gone in zip(pieces, lost, strict=True))
        object.__setattr__(self, "pieces", pieces)

    def _per_piece(self, name: str, shape: Shape | Sequence[Shape]) -> tuple[Shape, ...]:
        count = len(self.kinks) + 1
        if callable(shape):
            return (shape,) * count
        shapes = tuple(shape) if isinstance(shape, Sequence) else ()
        if len(shapes) != count or not all(callable(s) for s in shapes):
            raise InvalidInput(
                f"{name} of a law with {count - 1} kinks needs one callable or {count}, got {shape!r}."
            )
        return shapes

    def piece_at(self, u: float) -> int:
        """Index of the piece that holds ``u``; a kink belongs to the piece below it."""
        return int(np.searchsorted(self.kinks, u, side="left"))

    def traction(self, u: float) -> float:
        """tau(u), the traction over T0 at separation u = y/y0."""
        return float(self.tau[self.piece_at(u)](float(u)))  # type: ignore[index]

    def separation_work(self, u: float) -> float:
        """Integral of tau from 0 to ``u``, the work of separation over T0 y0."""
        return self.integrated_work(u) if self.work is None else float(self.work(float(u)))

    def integrated_work(self, u: float) -> float:
        """Integral of tau from 0 to ``u``, by quadrature whatever ``work`` says."""
        shapes: tuple[Shape, ...] = self.tau  # type: ignore[assignment]
        return self._integral(shapes, u)

    def mean_drop(self, u: float) -> float:
        """1 - Phi(u)/u, which is 1 - p/T0 at tip height ``u``; no digits lost as u -> 0."""
        if u == 0.0:
            return 0.0
        if u > WIDE:
            return 1.0 - self.separation_work(u) / u
        return self._integral(tuple(piece.drop for piece in self.pieces), u) / u

    def mean_drops(self, u: np.ndarray) -> np.ndarray:
        """`mean_drop` at many heights at once, also below the plate, of a law of straight pieces."""
        gone = np.zeros_like(u)
        for piece in self.pieces:
            if not isinstance(piece.drop, Affine):
                raise ValueError(f"law {self.name!r} is not straight from kink to kink")
            begin = max(piece.start, 0.0)
            end = np.minimum(u, piece.stop) if piece.is_first else np.clip(u, begin, piece.stop)
            gone += (end - begin) * (piece.drop.offset + 0.5 * piece.drop.slope * (begin + end))
        mean: np.ndarray = gone / np.where(u == 0.0, 1.0, u)
        return mean

    def _integral(self, shapes: tuple[Shape, ...], u: float) -> float:
        """Integral from 0 to ``u`` of a function given piece by piece."""
        edges = [0.0, *(k for k in self.kinks if k < u), float(u)]
        return math.fsum(_integral(shapes[i], a, b) for i, (a, b) in enumerate(pairwise(edges)))

    def mean_traction(self, u: float) -> float:
        """Phi(u)/u: by the first integrals of (12), P = p/T0 at tip height u."""
        return self.separation_work(u) / u if u > WIDE else 1.0 - self.mean_drop(u)

    def tip_height(self, pressure_ratio: float) -> float:
        """Height u > 0 of the tip under p/T0 = ``pressure_ratio``, from p y = Phi(y).

        Raises
        ------
        NoEquilibrium
            If no height has this mean traction (p >= T0, or below what the law can carry).
        """
        from scipy.optimize import brentq

        P = finite("pressure_ratio", pressure_ratio)
        high = 1.0
        while self.mean_traction(high) > P and high < HIGHEST:
            high *= 2.0
        if P >= 1.0 or high >= HIGHEST:
            raise NoEquilibrium(f"no tip height was met that has p/T0 = {P:g} under law {self.name!r}.")

        def excess(u: float) -> float:
            return P * u - self.separation_work(u) if u > WIDE else u * (self.mean_drop(u) - (1.0 - P))

        low = 0.5 * high if high > 1.0 else 1e-300
        return float(brentq(excess, low, high, xtol=1e-300, rtol=1e-14))

    @cached_property
    def is_affine(self) -> bool:
        """Whether tau = 1 - c u at every height: the one law that beta0 = 0 leaves something of."""
        drop = self.pieces[0].drop
        return len(self.pieces) == 1 and isinstance(drop, Affine) and drop.offset == 0.0

    @cached_property
    def falls_straight(self) -> bool:
        """Whether tau = 1 - u as long as it pulls, as the paper's laws: the linear law, and law (8).

        Such a rod has the series while it stays within y0, one minimum of the pressure and no other,
        and beyond what was followed of it its branch is known to go on as it went.
        """
        drops = tuple(piece.drop for piece in self.pieces)
        cut = self.kinks == (1.0,) and drops[1:] == (Affine(1.0, 0.0),)
        return drops[0] == Affine(0.0, 1.0) and (cut or not self.kinks)

    @cached_property
    def is_linear(self) -> bool:
        """Whether tau = 1 - u at every height, so that it pushes beyond y0."""
        return self.falls_straight and not self.kinks

    @cached_property
    def softens(self) -> bool:
        """Whether the traction never rises: then the pressure falls to one minimum and rises."""
        places = np.unique([*np.linspace(0.0, WIDEST * max(self.kinks, default=1.0), 400), *self.kinks])
        traction = np.array([self.traction(float(u)) for u in places])
        return bool(np.all(np.diff(traction) <= 1e-12))

    @cached_property
    def branch_ends(self) -> bool:
        """Whether p stays positive at every height, so that a rod's branch ends with its tip on the plate.

        The linear law pushes where it should let go: its branch may run through p = 0 for ever.
        """
        return all(self.separation_work(2.0**k) > 0.0 for k in range(FARTHEST))

    @cached_property
    def jumps(self) -> tuple[float, ...]:
        """The kinks at which the traction itself jumps, not its slope alone."""
        below, above = self.pieces[:-1], self.pieces[1:]
        rises = [
            float(b.drop(k)) - float(a.drop(k)) for k, a, b in zip(self.kinks, below, above, strict=True)
        ]
        return tuple(k for k, rise in zip(self.kinks, rises, strict=True) if abs(rise) > JUMP)

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
        """Return the law (1 - h) self + h other, 0 <= h <= 1, with the kinks of both."""
        if not 0.0 <= finite("h", h) <= 1.0:
            raise InvalidInput(f"h must lie between 0 and 1, got {h:g}.")
        kinks = tuple(sorted({*self.kinks, *other.kinks}))
        inside = [0.5 * (a + b) for a, b in pairwise((0.0, *kinks))] + [max(kinks, default=0.0) + 1.0]

        def mixed(first: CohesiveLaw, second: CohesiveLaw, part: str) -> tuple[Shape, ...]:
            pairs = ((getattr(law, part)[law.piece_at(u)] for law in (first, second)) for u in inside)
            return tuple(_blend(a, b, h) for a, b in pairs)

        name = f"{self.name}~{other.name}"
        return CohesiveLaw(mixed(self, other, "tau"), kinks, name=name, drop=mixed(self, other, "drop"))


def _integral(shape: Shape, a: float, b: float) -> float:
    if isinstance(shape, Affine):
        return (b - a) * (shape.offset + 0.5 * shape.slope * (a + b))
    from scipy.integrate import quad

    # Octave by octave, so that a traction that dies out early is not overlooked.
    octaves = [2.0**k for k in range(60) if a < 2.0**k < b]
    # Full output: where rounding ends it before the tolerance is met, nothing is printed.
    pieces = (
        quad(lambda u: float(shape(u)), low, high, epsabs=1e-15 * low, epsrel=1e-13, full_output=1)[0]
        for low, high in pairwise((a, *octaves, b))
    )
    return math.fsum(pieces)


def _checked_kinks(kinks: object) -> tuple[float, ...]:
    if not isinstance(kinks, Iterable) or isinstance(kinks, str):
        raise InvalidInput(f"kinks of a law must be a sequence of numbers, got {kinks!r}.")
    checked = tuple(positive("kinks of a law", k) for k in kinks)
    if list(checked) != sorted(set(checked)):
        raise InvalidInput(f"kinks of a law must be increasing, got {checked}.")
    return checked


def named(law: CohesiveLaw, name: str) -> CohesiveLaw:
    """Give a law of the package its name, which no other law may bear."""
    object.__setattr__(law, "name", name)
    return law


#: Fig 2b: the traction keeps falling past y0, where it pushes.  Exact while y <= y0.
LINEAR = named(CohesiveLaw(Affine(1.0, -1.0), drop=Affine(0.0, 1.0), holds_to=1.0), "linear")

#: Law (8) for y >= 0: linear decrease to zero at y0, nothing beyond.
COHESIVE = named(
    CohesiveLaw((Affine(1.0, -1.0), Affine(0.0, 0.0)), (1.0,), drop=(Affine(0.0, 1.0), Affine(1.0, 0.0))),
    "cohesive",
)


def as_asked(law: CohesiveLaw) -> str | CohesiveLaw:
    """Return a law as the public calls take it: law (8) as "auto", named linear where the two agree."""
    return "auto" if law == COHESIVE else law
