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
from typing import Any, Literal

import numpy as np
from numpy.polynomial import Polynomial

from ..base.arrays import floats
from ..base.checks import finite
from ..base.errors import InvalidInput, NoEquilibrium
from ..base.quadrature import Grid
from ..base.roots import graph_roots, turning_points, zeros
from ..model.series import UniformSeries

#: Intervals on which the Maxwell point is looked for below the fold.
_SCAN = 800


@dataclass(frozen=True)
class CriticalPoint:
    """A critical point of the effective potential; at a fold or at T it is an "inflection"."""

    alpha1: float
    potential: float
    kind: Literal["minimum", "maximum", "inflection"]


@dataclass(frozen=True, eq=False)
class EffectivePotential:
    """Effective potential at one beta0, as a function of alpha1 and lambda.

    Parameters
    ----------
    beta0, a1 : float
    curve : Lambda(alpha1)
    slope : its derivative
    moment : integral of x Lambda(x) from 0 to alpha1
    domain : extra pressures for which the curve is known; outside, the potential is NaN
    """

    beta0: float
    a1: float
    curve: Callable[[Any], Any]
    slope: Callable[[Any], Any]
    moment: Callable[[Any], Any]
    domain: tuple[float, float]

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
        return CriticalPoint(x, float(self(x, lam)), kind)

    def global_minimum(self, lam: float) -> CriticalPoint:
        """Deepest minimum at lambda, the state of the Maxwell convention."""
        minima = [point for point in self.critical_points(lam) if point.kind == "minimum"]
        if not minima:
            raise NoEquilibrium(
                f"the potential has no minimum at beta0 = {self.beta0:g}, lambda = {lam:g}.",
                remedy="Its curve may end before the detached state is reached; move lambda towards 0.",
            )
        return min(minima, key=lambda point: point.potential)

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

    def fold(self) -> tuple[float, float]:
        """(lambda, alpha1) of the fold F, (34)."""
        if self.beta0 == 0.0:
            return 0.0, 0.0
        below = [x for x in self._turns if x < 0.0]
        if not below:
            raise NoEquilibrium(
                f"the branch at beta0 = {self.beta0:g} has no fold for alpha1 in"
                f" [{self.domain[0]:.4g}, {self.domain[1]:.4g}], where it is known.",
                remedy="Ask for a smaller beta0, a higher order or a longer branch.",
            )
        return float(self.curve(below[-1])), below[-1]

    def maxwell(self) -> tuple[float, float]:
        """(lambda, alpha1) where the detached minimum is as deep as the adhered one, (36)."""
        if self.beta0 == 0.0:
            return 0.0, 0.0

        def depth(x: Any) -> Any:
            return 0.5 * x * x * self.curve(x) - self.moment(x)

        low, fold = self.domain[0], self.fold()[1]
        equal = zeros(depth, np.linspace(low, fold, _SCAN + 1))
        if not equal:
            raise NoEquilibrium(
                f"no Maxwell point at beta0 = {self.beta0:g}: the detached minimum stays above the adhered"
                f" one for alpha1 down to {low:.4g}, where the branch ends.",
                remedy="Ask for a smaller beta0, a higher order or a longer branch.",
            )
        return float(self.curve(equal[-1])), equal[-1]

    def delay(self) -> tuple[float, float]:
        """Point (0, alpha1) at which the rod lands when it holds on until the adhered minimum is lost."""
        if self.beta0 == 0.0:
            return 0.0, 0.0
        lower = self.alpha1(0.0)
        if not (lower < 0.0).any():
            raise NoEquilibrium(
                f"the branch at beta0 = {self.beta0:g} does not come back to lambda = 0 where it is known.",
                remedy="Ask for a smaller beta0, a higher order or a longer branch.",
            )
        return 0.0, float(lower[lower < 0.0][-1])


@dataclass(frozen=True, eq=False)
class QuarticPotential(EffectivePotential):
    """Potential (35) itself, with (34) and (36) in closed form and no end to the curve."""

    a2: float = math.nan

    def alpha1(self, lam: float) -> np.ndarray:
        """Both roots of the parabola at lambda, ascending, without alpha1 = 0."""
        half = 0.5 * self.a2 * self.beta0
        square = half * half - self.a1 * finite("lam", lam)
        if abs(square) <= 4 * np.finfo(float).eps * half * half:
            square = 0.0
        if square < 0.0 or (square == 0.0 and half == 0.0):
            return np.empty(0)
        lower = -half - math.copysign(math.sqrt(square), half)  # half may be negative under a fit
        upper = self.a1 * lam / lower
        return np.array(sorted({x for x in (lower, upper) if x != 0.0}))

    def fold(self) -> tuple[float, float]:
        """(lambda, alpha1) of (34)."""
        return (self.a2 * self.beta0) ** 2 / (4.0 * self.a1), -0.5 * self.a2 * self.beta0

    def maxwell(self) -> tuple[float, float]:
        """(lambda, alpha1) of (36)."""
        return 2.0 * (self.a2 * self.beta0) ** 2 / (9.0 * self.a1), -2.0 * self.a2 * self.beta0 / 3.0

    @classmethod
    def of(cls, a1: float, a2: float, beta0: float) -> QuarticPotential:
        """Return the potential of (33) with these coefficients."""
        curve = Polynomial([0.0, -a2 * beta0 / a1, -1.0 / a1])
        moment = (curve * Polynomial([0.0, 1.0])).integ()
        return cls(beta0, a1, curve, curve.deriv(), moment, (-math.inf, math.inf), a2)


def series_potential(series: UniformSeries, beta0: float, tol: float) -> EffectivePotential:
    """Return the potential of the uniform series on the part of its curve known to ``tol``."""
    over = series.secant(beta0, tol)
    over_slope = over.deriv()
    low, high = (float(x) for x in over.domain)
    grid = Grid.gauss(series.order + 1)  # exact for the degree 2 order + 1 of the integrand

    def curve(x: Any) -> Any:
        return x * over(x)

    def slope(x: Any) -> Any:
        return over(x) + x * over_slope(x)

    def moment(x: Any) -> Any:  # on [0, x], which keeps the relative accuracy near T
        x = np.asarray(x, float)
        return x * x * (curve(x[..., None] * grid.xi) @ (grid.weights * grid.xi))

    return EffectivePotential(beta0, series.leading[0], curve, slope, moment, (low, high))
