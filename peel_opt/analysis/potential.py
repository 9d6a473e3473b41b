"""The effective potential at one beta0, from any curve of detached states.

Detached states lambda = Lambda(alpha1) and the straight rod alpha1 = 0 together solve

    a1 alpha1 (lambda - Lambda(alpha1)) = 0,

and the effective potential (35) is the integral of the left side from 0 to alpha1.  Where
Lambda comes from makes no difference to its critical points, fold, Maxwell point and barriers:
the parabola of (33), a series, or a traced branch.

The potential is a convention, not an energy: the load does work that depends on the path, and
the equation may be multiplied by any factor f(alpha1) > 0, which moves no equilibrium.  It does
move lambda_M.  With the exact coefficients lambda_M/lambda_F is 8/9 = 0.8889 for f = 1, at every
beta0; with f = p/T0 it is 0.8693, with f = T0/p 0.9057.  Only that it lies between the fold and
zero holds whatever the factor.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ..base.arrays import floats
from ..base.checks import finite
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged
from ..base.quadrature import Grid
from ..base.roots import graph_roots, turning_points, zeros

#: Intervals on which the Maxwell point is looked for below the fold.
_SCAN = 800


class Level(tuple[float, float]):
    """A named point of the curve: (lambda, alpha1), which unpacks as these two, with their errors.

    Parameters
    ----------
    lam, alpha1 : float
    name : {"fold", "maxwell", "delay"}
    potential : EffectivePotential, optional
        That it was read from; without one the point is exact.
    """

    name: Literal["fold", "maxwell", "delay"]
    potential: EffectivePotential | None

    def __new__(
        cls,
        lam: float,
        alpha1: float,
        name: Literal["fold", "maxwell", "delay"],
        potential: EffectivePotential | None = None,
    ) -> Level:
        """Make the pair."""
        level = super().__new__(cls, (lam, alpha1))
        level.name, level.potential = name, potential
        return level

    def __getnewargs__(self) -> tuple[float, float, str, EffectivePotential | None]:  # for pickle and copy
        return self[0], self[1], self.name, self.potential

    @property
    def lam(self) -> float:
        """Value beta1 - pi^4."""
        return self[0]

    @property
    def alpha1(self) -> float:
        """Extra pressure."""
        return self[1]

    @cached_property
    def _errors(self) -> tuple[float, float]:
        return (0.0, 0.0) if self.potential is None else self.potential.level_errors(self)

    @property
    def error(self) -> float:
        """Of lambda; NaN on a normal form, which does not know how far it is from the equations."""
        return self._errors[0]

    @property
    def alpha1_error(self) -> float:
        """Of alpha1; much larger at a fold, where the curve is flat."""
        return self._errors[1]


@dataclass(frozen=True)
class CriticalPoint:
    """A critical point of the effective potential; at a fold or at T it is an "inflection".

    Parameters
    ----------
    alpha1, potential : float
    kind : {"minimum", "maximum", "inflection"}
    error : float
        Of alpha1; NaN on a normal form, 0 for the straight rod.
    potential_error : float
    """

    alpha1: float
    potential: float
    kind: Literal["minimum", "maximum", "inflection"]
    error: float = math.nan
    potential_error: float = math.nan


@dataclass(frozen=True, eq=False, repr=False)
class EffectivePotential:
    """Effective potential at one beta0, as a function of alpha1 and lambda.

    Parameters
    ----------
    beta0, a1 : float
    curve : Lambda(alpha1)
    slope : its derivative
    moment : integral of x Lambda(x) from 0 to alpha1
    domain : extra pressures for which the curve is known; outside, the potential is NaN
    kinks : extra pressures at which the slope of the curve is not smooth
    noise : error of the states behind the curve, in lambda, as a function of alpha1; unknown without

    Notes
    -----
    What is read from a potential has an error: the most by which ``others`` differ, and the noise.
    """

    beta0: float
    a1: float
    curve: Callable[[Any], Any]
    slope: Callable[[Any], Any]
    moment: Callable[[Any], Any]
    domain: tuple[float, float]
    kinks: tuple[float, ...] = ()
    noise: Callable[[Any], Any] | None = None

    @property
    def others(self) -> tuple[EffectivePotential, ...]:
        """The same potential from fewer states."""
        return ()

    @property
    def is_cut(self) -> bool:
        """Whether the curve goes on below its domain."""
        return False

    def __repr__(self) -> str:
        return (
            f"{type(self).__name__} at beta0 = {self.beta0:.9g}, alpha1 from {self.domain[0]:.6g} to"
            f" {self.domain[1]:.6g}, error of lambda up to {self.error:.1e}"
        )

    def __call__(self, alpha1: Any, lam: Any) -> np.ndarray:
        """U_e(alpha1; beta0, lambda), (35)."""
        alpha1 = floats("alpha1", alpha1)
        known = (alpha1 >= self.domain[0]) & (alpha1 <= self.domain[1])
        x = np.where(known, alpha1, 0.0)
        U = self.a1 * (0.5 * floats("lam", lam) * x * x - self.moment(x))
        return np.where(known, U + 0.0, np.nan)

    def derivative(self, alpha1: Any, lam: Any) -> np.ndarray:
        """Left side of the normal form, dU_e/dalpha1."""
        alpha1 = floats("alpha1", alpha1)
        return self.a1 * alpha1 * (floats("lam", lam) - self.curve(alpha1))

    @property
    def _turns(self) -> list[float]:
        return turning_points(self.slope, self.domain)

    def alpha1(self, lam: float) -> np.ndarray:
        """Extra pressures of the detached states at lambda, ascending, without alpha1 = 0."""
        lam = finite("lam", lam)
        if self.beta0 == 0.0 == lam:
            return np.empty(0)
        return graph_roots(self.curve, self.slope, self.domain, lam)

    # --- errors -----------------------------------------------------------------------------

    def curve_error(self, alpha1: Any) -> np.ndarray:
        """Error of Lambda(alpha1); NaN on a normal form."""
        if self.noise is None:
            return np.full(np.shape(alpha1), np.nan)
        curve = self.curve(alpha1)
        apart = [np.abs(other.curve(alpha1) - curve) for other in self.others]
        return np.max([np.zeros(np.shape(alpha1)), *apart], axis=0) + self.noise(alpha1)

    @cached_property
    def error(self) -> float:
        """Largest error of lambda on the part of the curve that is known; NaN on a normal form."""
        if self.noise is None:
            return math.nan
        return float(self.curve_error(np.linspace(*self.domain, _SCAN + 1)).max())

    def _apart(self, read: Callable[[EffectivePotential], Any], found: Any) -> np.ndarray:
        """Most by which ``others`` differ in a reading; infinite where one of them has none."""
        try:
            apart = [np.abs(np.subtract(read(other), found)) for other in self.others]
        except (NoEquilibrium, NotConverged):
            return np.full(np.shape(found), np.inf)
        return np.max([np.zeros(np.shape(found)), *apart], axis=0)

    def _moved(self, x: float) -> float:
        """How far the noise moves a state at ``x`` along the curve."""
        if x == 0.0:
            return 0.0
        step = 1e-4 * x
        bend = abs(float(self.slope(x + step) - self.slope(x - step))) / 2e-4
        return self._noise(x) / max(abs(float(self.slope(x))), bend)

    def _noise(self, x: float) -> float:
        return math.nan if self.noise is None else float(self.noise(x))

    def level_errors(self, level: Level) -> tuple[float, float]:
        """Return the errors of lambda and of alpha1 of a named point of this potential."""
        if self.noise is None:
            return math.nan, math.nan
        apart = self._apart(lambda other: getattr(other, level.name)(), level)
        return float(apart[0]) + self._lifted(level), float(apart[1]) + self._moved(level.alpha1)

    def _lifted(self, level: Level) -> float:
        """How far the noise moves lambda of a named point; that of the landing is 0, exactly."""
        return 0.0 if level.name == "delay" else self._noise(level.alpha1)

    # --- what is read from it ---------------------------------------------------------------

    def critical_points(self, lam: float) -> tuple[CriticalPoint, ...]:
        """All critical points at lambda, the straight rod alpha1 = 0 among them, ascending."""
        points = [self._critical(float(x), lam) for x in self.alpha1(lam)]
        return tuple(sorted([*points, self._critical(0.0, lam)], key=lambda point: point.alpha1))

    def _critical(self, x: float, lam: float) -> CriticalPoint:
        # U'' is |a1| x Lambda'(x) at a detached state and -|a1| lambda at the straight one.
        curvature = -lam if x == 0.0 else x * float(self.slope(x))
        if x == 0.0 and lam == 0.0 and self.beta0 == 0.0:
            curvature = 1.0  # quartic
        kind: Literal["minimum", "maximum", "inflection"] = "inflection"
        if abs(curvature) > 1e-12 * (abs(lam) + x * x):
            kind = "minimum" if curvature > 0.0 else "maximum"
        if x == 0.0:
            return CriticalPoint(0.0, 0.0, kind, 0.0, 0.0)
        depth = float(self(x, lam))
        if self.noise is None:
            return CriticalPoint(x, depth, kind)

        def same(other: EffectivePotential) -> tuple[float, float]:
            there = other.alpha1(lam)
            if not there.size:
                raise NoEquilibrium("no such state.")
            at = float(there[np.argmin(np.abs(there - x))])
            return at, float(other(at, lam))

        apart = self._apart(same, (x, depth))
        lifted = 0.5 * abs(self.a1) * x * x * self._noise(x)
        return CriticalPoint(x, depth, kind, float(apart[0]) + self._moved(x), float(apart[1]) + lifted)

    def area(self, lost: Level, peeled: Level) -> tuple[float, float]:
        """Integral of alpha1 dlambda along the curve between two of its named points, and its error.

        By parts it is [alpha1 lambda] less the integral of Lambda.  Errors of Lambda move the second, and
        those of lambda at both ends the first; moved along the curve, an end changes nothing more.  The
        weights of quadrature through a spline are positive, so that errors of its points add up to no more
        than their largest over the width.
        """
        area = self._area(lost.alpha1, peeled.alpha1)
        if self.noise is None:
            return area, math.nan

        def again(other: EffectivePotential) -> float:
            ends = [getattr(other, level.name)() for level in (lost, peeled)]
            return other._area(*(end.alpha1 for end in ends))

        between = abs(lost.alpha1 - peeled.alpha1) * max(self._noise(lost.alpha1), self._noise(peeled.alpha1))
        ends = sum(abs(end.alpha1) * self._lifted(end) for end in (lost, peeled))
        return area, float(self._apart(again, area)) + between + ends

    def _area(self, lost: float, peeled: float) -> float:
        inside = [x for x in self.kinks if min(lost, peeled) < x < max(lost, peeled)]
        edges = np.unique([*np.linspace(lost, peeled, 65), *inside])
        cell = Grid.gauss(8)
        x = edges[:-1, None] + np.diff(edges)[:, None] * cell.xi
        return abs(float((x * self.slope(x) @ cell.weights) @ np.diff(edges)))

    def barrier(self, lam: float, state: Literal["adhered", "detached"] = "adhered") -> float:
        """Height of the potential between the adhered and the detached minimum, above ``state``."""
        if state not in ("adhered", "detached"):
            raise InvalidInput(f"state must be 'adhered' or 'detached', got {state!r}.")
        points = [point for point in self.critical_points(lam) if point.alpha1 <= 0.0]
        kinds = [point.kind for point in points]
        if kinds != ["minimum", "maximum", "minimum"]:
            raise NoEquilibrium(
                f"no barrier at beta0 = {self.beta0:g}, lambda = {lam:g}:"
                " there are two minima between the fold and lambda = 0 only.",
            )
        return points[1].potential - points[0 if state == "detached" else 2].potential

    def fold(self) -> Level:
        """(lambda, alpha1) of the fold F, (34)."""
        if self.beta0 == 0.0:
            return Level(0.0, 0.0, "fold")
        below = [x for x in self._turns if x < 0.0]
        if not below:
            raise self._missing(
                f"the branch at beta0 = {self.beta0:g} has no fold for alpha1 in"
                f" [{self.domain[0]:.4g}, {self.domain[1]:.4g}], where it is known."
            )
        return Level(float(self.curve(below[-1])), below[-1], "fold", self)

    def maxwell(self) -> Level:
        """(lambda, alpha1) where the detached minimum is as deep as the adhered one, (36)."""
        if self.beta0 == 0.0:
            return Level(0.0, 0.0, "maxwell")

        def depth(x: Any) -> Any:
            return 0.5 * x * x * self.curve(x) - self.moment(x)

        low, fold = self.domain[0], self.fold().alpha1
        equal = zeros(depth, np.linspace(low, fold, _SCAN + 1))
        if not equal:
            raise self._missing(
                f"no Maxwell point at beta0 = {self.beta0:g} as far as the branch is known: the detached"
                f" minimum stays above the adhered one for alpha1 down to {low:.4g}."
            )
        return Level(float(self.curve(equal[-1])), equal[-1], "maxwell", self)

    def delay(self) -> Level:
        """Point (0, alpha1) at which the rod lands when it holds on until the adhered minimum is lost."""
        if self.beta0 == 0.0:
            return Level(0.0, 0.0, "delay")
        lower = self.alpha1(0.0)
        if not (lower < 0.0).any():
            raise self._missing(
                f"the branch at beta0 = {self.beta0:g} does not come back to lambda = 0 where it is known."
            )
        return Level(0.0, float(lower[lower < 0.0][-1]), "delay", self)

    def _missing(self, message: str) -> NoEquilibrium | NotConverged:
        """Return the error of a point that is not on the curve, or not on the part that is known."""
        if self.is_cut:
            return NotConverged(message, remedy="Trace the branch further, up to where alpha1 turns back.")
        return NoEquilibrium(message, remedy="Ask for a smaller beta0, a higher order or a longer branch.")
