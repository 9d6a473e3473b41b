"""Normal forms of the transition, (33) to (36): the paper's, the exact one, the series, a fit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from .checks import non_negative, positive
from .effective_potential import (
    BranchLike,
    EffectivePotential,
    QuarticPotential,
    branch_arrays,
    series_potential,
)
from .errors import InvalidInput
from .hierarchy import UniformSeries, uniform_series


@dataclass(frozen=True)
class FitQuality:
    """How far the coefficients of a fit can be trusted.

    Parameters
    ----------
    window : points with abs(lambda) up to here were used
    points : how many
    covariance : of (a1, a2) in rows, from the residuals of (33)
    drift : what (a1, a2) lose when the window is halved; NaN with too few points left

    Notes
    -----
    The residuals are not noise but the terms (33) leaves out, so the drift is the better
    measure: at beta0 = 4 and a window of 1 it is some ten times the standard deviation of a1.
    """

    window: float
    points: int
    covariance: tuple[tuple[float, float], tuple[float, float]]
    drift: tuple[float, float]

    @property
    def uncertainty(self) -> tuple[float, float]:
        """Larger of standard deviation and drift, for a1 and for a2."""
        std = [math.sqrt(self.covariance[i][i]) for i in range(2)]
        return tuple(float(np.nanmax([s, abs(d)])) for s, d in zip(std, self.drift, strict=True))  # type: ignore[return-value]


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
        series = uniform_series(order)
        return cls(*series.leading, "uniform", series, positive("tol", tol))

    @classmethod
    def fit(cls, branch: BranchLike, window: float = 1.0) -> NormalForm:
        """Fit (33) by least squares to the points of a branch with abs(lambda) <= ``window``.

        Every point counts the same, so points crowded somewhere pull the fit there.

        Raises
        ------
        InvalidInput
            If fewer than three points lie in the window, or a2 cannot be told because beta0 = 0.
        """
        window = positive("window", window)
        a, covariance, points = _least_squares(branch, window)
        try:
            drift = a - _least_squares(branch, 0.5 * window)[0]
        except InvalidInput:
            drift = np.full(2, math.nan)
        rows = tuple(tuple(float(c) for c in row) for row in covariance)
        quality = FitQuality(window, points, rows, (float(drift[0]), float(drift[1])))  # type: ignore[arg-type]
        return cls(float(a[0]), float(a[1]), "fit", quality=quality)

    def at(self, beta0: float) -> EffectivePotential:
        """Return the effective potential at one beta0, with all its points of interest."""
        return _potential(self, non_negative("beta0", beta0))

    def lam(self, alpha1: Any, beta0: float) -> np.ndarray:
        """Curve Lambda(alpha1) of the detached branch."""
        return self.at(beta0).curve(np.asarray(alpha1, float))

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
        if np.ndim(beta0) == 0:
            pair: tuple[float, float] = getattr(self.at(beta0), point)()
            return pair
        values = np.array([getattr(self.at(float(b)), point)() for b in np.ravel(beta0)]).reshape(-1, 2)
        return values[:, 0].reshape(np.shape(beta0)), values[:, 1].reshape(np.shape(beta0))


def _least_squares(branch: BranchLike, window: float) -> tuple[np.ndarray, np.ndarray, int]:
    lam, alpha1, beta0 = branch_arrays(branch)
    inside = (np.abs(lam) <= window) & (alpha1 != 0.0)
    lam, alpha1, beta0 = lam[inside], alpha1[inside], beta0[inside]
    if lam.size < 3:
        raise InvalidInput(
            f"{lam.size} detached points have |lambda| <= {window:g}; a fit needs three.",
            remedy="Widen the window or trace with smaller steps.",
        )
    if not beta0.any():
        raise InvalidInput("a2 does not show at beta0 = 0.", remedy="Fit to branches with beta0 > 0 too.")
    X, y = np.column_stack([alpha1 * lam, beta0 * alpha1**2]), -(alpha1**3)
    scale = np.linalg.norm(X, axis=0)
    a, _, rank, _ = np.linalg.lstsq(X / scale, y, rcond=1e-12)
    if rank < 2:
        raise InvalidInput(
            "the points in the window do not determine both a1 and a2.", remedy="Widen the window."
        )
    residual = y - X / scale @ a
    covariance = residual @ residual / (y.size - 2) * np.linalg.inv(X.T @ X)
    return a / scale, covariance, int(y.size)


@lru_cache(maxsize=256)
def _potential(form: NormalForm, beta0: float) -> EffectivePotential:
    if form.series is None:
        return QuarticPotential.of(form.a1, form.a2, beta0)
    return series_potential(form.series, beta0, form.tol)
