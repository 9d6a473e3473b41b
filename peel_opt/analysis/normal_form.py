"""Normal forms of the transition, (33) to (36): the paper's, the exact one, the series, a fit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from ..base.arrays import floats
from ..base.checks import BETA0, finite, non_negative, positive, whole
from ..base.errors import OutOfRange
from ..base.quadrature import Grid
from ..base.units import in_si, told_apart
from ..model.series import UniformSeries, uniform_series
from .branch_potential import BranchLike
from .normal_form_fit import FitQuality, fit_coefficients
from .potential import EffectivePotential, Level


@dataclass(frozen=True)
class NormalForm:
    """A normal form of the transition; make it with one of the class methods.

    Parameters
    ----------
    a1, a2 : coefficients of (33); for the uniform series those of its first order
    kind : "paper", "exact", "uniform" or "fit"
    series : the series behind "uniform"
    tol : relative accuracy at which "uniform" ends its curve
    quality : what is known about the coefficients of "fit"

    Examples
    --------
    >>> lam, alpha1 = NormalForm.paper().maxwell(4.0)
    >>> round(lam, 4), round(alpha1, 3)
    (-0.2363, -1.856)
    """

    a1: float
    a2: float
    kind: str
    series: UniformSeries | None = None
    tol: float = 1e-6
    quality: FitQuality | None = None

    @classmethod
    def paper(cls) -> NormalForm:
        """Return the form with the coefficients printed with (33)."""
        return cls(-7.29, 0.696, "paper")

    @classmethod
    def exact(cls) -> NormalForm:
        """Return the form that is exact for beta0 -> 0 at fixed p/T0."""
        return cls(*uniform_series(1).leading, "exact")

    @classmethod
    def uniform(cls, order: int = 12, tol: float = 1e-6) -> NormalForm:
        """Return the uniform series as a form, on the part of its curve known to ``tol``.

        Order 12 has the Maxwell point up to beta0 = 24, order 40 up to 33.
        """
        series = uniform_series(whole("order", order, 1, 10**9))
        return cls(*series.leading, "uniform", series, positive("tol", tol))

    @classmethod
    def fit(cls, branch: BranchLike | Sequence[BranchLike], window: float = 1.0) -> NormalForm:
        """Fit (33) by least squares to the detached states with abs(lambda) <= ``window``.

        Points count by the stretch of alpha1 they stand for, so that it does not matter where
        a tracer took small steps.

        Parameters
        ----------
        branch : Branch or sequence of them
            Points in order along each branch.
        window : float
            Of lambda; -7.29 and 0.696 come out of the branch at beta0 = 4 for a window of 1.

        Raises
        ------
        InvalidInput
            If fewer than three points lie in the window, or a2 cannot be told because beta0 = 0.
        """
        a1, a2, quality = fit_coefficients(branch, window)
        return cls(a1, a2, "fit", quality=quality)

    def at(self, beta0: float) -> EffectivePotential:
        """Return the effective potential at one beta0, with all its points of interest."""
        value = non_negative("beta0", beta0)
        if value > BETA0[1]:
            mine, last = told_apart(value, BETA0[1])
            raise OutOfRange(f"beta0 = {mine} is above {last}.")
        return _potential(self, value)

    def lam(self, alpha1: Any, beta0: float) -> np.ndarray:
        """Curve Lambda(alpha1) of the detached branch."""
        return self.at(beta0).curve(floats("alpha1", alpha1))

    def potential(self, alpha1: Any, beta0: float, lam: Any) -> np.ndarray:
        """U_e(alpha1; beta0, lambda), (35); NaN where a series does not reach.

        The convention is to integrate (33) as it stands.  Multiplied by p/T0 > 0 the same
        equation has lambda_M = 0.8693 lambda_F instead of 0.8889 lambda_F.
        """
        return self.at(beta0)(alpha1, lam)

    def derivative(self, alpha1: Any, beta0: float, lam: Any) -> np.ndarray:
        """Left side of (33), dU_e/dalpha1."""
        return self.at(beta0).derivative(alpha1, lam)

    def alpha1(self, beta0: float, lam: float) -> np.ndarray:
        """Extra pressures of the detached states continuous from alpha1 = 0, ascending, 0 left out."""
        return self.at(beta0).alpha1(lam)

    def fold(self, beta0: Any) -> tuple[Any, Any]:
        """(lambda, alpha1) of the fold, (34); beta0 may be an array."""
        return self._each("fold", beta0)

    def maxwell(self, beta0: Any) -> tuple[Any, Any]:
        """(lambda, alpha1) of the Maxwell point, (36), by equal depth; beta0 may be an array."""
        return self._each("maxwell", beta0)

    def delay(self, beta0: Any) -> tuple[Any, Any]:
        """(0, alpha1): the adhered state is lost at lambda = 0 and the rod lands here."""
        return self._each("delay", beta0)

    def _each(self, point: Literal["fold", "maxwell", "delay"], beta0: Any) -> tuple[Any, Any]:
        beta0 = in_si("beta0", beta0)
        if np.ndim(beta0) == 0:
            pair: tuple[float, float] = getattr(self.at(beta0), point)()
            return pair
        values = np.array([getattr(self.at(b), point)() for b in np.ravel(beta0).tolist()]).reshape(-1, 2)
        return values[:, 0].reshape(np.shape(beta0)), values[:, 1].reshape(np.shape(beta0))


@lru_cache(maxsize=256)
def _potential(form: NormalForm, beta0: float) -> EffectivePotential:
    if form.series is None:
        return QuarticPotential.of(form.a1, form.a2, beta0)
    return _series_potential(form.series, beta0, form.tol)


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


def _series_potential(series: UniformSeries, beta0: float, tol: float) -> EffectivePotential:
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
