"""Effective potentials of curves in closed form: the normal form (33), and the uniform series."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from ..base.checks import finite
from ..base.quadrature import Grid
from ..model.series import UniformSeries
from .potential import EffectivePotential, Level


@dataclass(frozen=True, eq=False, repr=False)
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

    def fold(self) -> Level:
        """(lambda, alpha1) of (34)."""
        bent = self.a2 * self.beta0
        return Level(bent * bent / (4.0 * self.a1), -0.5 * bent, "fold", self)

    def maxwell(self) -> Level:
        """(lambda, alpha1) of (36)."""
        bent = self.a2 * self.beta0
        return Level(2.0 * bent * bent / (9.0 * self.a1), -2.0 * bent / 3.0, "maxwell", self)

    @classmethod
    def of(cls, a1: float, a2: float, beta0: float) -> QuarticPotential:
        """Return the potential of (33) with these coefficients."""
        curve = Polynomial([0.0, -a2 * beta0 / a1, -1.0 / a1])
        moment = (curve * Polynomial([0.0, 1.0])).integ()
        return cls(beta0, a1, curve, curve.deriv(), moment, (-math.inf, math.inf), a2=a2)


@dataclass(frozen=True, eq=False)
class _SummedSeries:
    """The curve of the uniform series at one beta0, by its secant lambda/alpha1."""

    series: UniformSeries
    beta0: float
    over: Chebyshev
    over_slope: Chebyshev
    grid: Grid

    def curve(self, x: Any) -> Any:
        return x * self.over(x)

    def slope(self, x: Any) -> Any:
        return self.over(x) + x * self.over_slope(x)

    def moment(self, x: Any) -> Any:  # on [0, x], which keeps the relative accuracy near T
        x = np.asarray(x, float)
        return x * x * (self.curve(x[..., None] * self.grid.xi) @ (self.grid.weights * self.grid.xi))

    def error(self, x: Any) -> Any:
        return self.series.curve_error(x, self.beta0)


def series_potential(series: UniformSeries, beta0: float, tol: float) -> EffectivePotential:
    """Return the potential of the uniform series on the part of its curve known to ``tol``."""
    over = series.secant(beta0, tol)
    low, high = (float(x) for x in over.domain)
    grid = Grid.gauss(series.order + 1)  # exact for the degree 2 order + 1 of the integrand
    summed = _SummedSeries(series, beta0, over, over.deriv(), grid)
    return EffectivePotential(
        beta0,
        series.leading[0],
        summed.curve,
        summed.slope,
        summed.moment,
        (low, high),
        noise=summed.error,
    )
