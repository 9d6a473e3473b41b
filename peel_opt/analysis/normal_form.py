"""Normal forms of the transition, (33) to (36): the paper's, the exact one, the series, a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from ..base.arrays import floats
from ..base.checks import BETA0, non_negative, positive, whole
from ..base.errors import OutOfRange
from ..base.units import in_si, told_apart
from ..model.series import UniformSeries, uniform_series
from .branch_potential import BranchLike
from .form_potentials import QuarticPotential, series_potential
from .normal_form_fit import FitQuality, fit_coefficients
from .potential import EffectivePotential


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
    return series_potential(form.series, beta0, form.tol)
