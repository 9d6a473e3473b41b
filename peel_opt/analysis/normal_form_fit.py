"""The coefficients of (33) by least squares on a branch, and how far to trust them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.checks import positive
from ..base.errors import InvalidInput
from ..base.threads import one_thread
from .branch_potential import BranchLike, branch_arrays


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


def fit_coefficients(
    branch: BranchLike | Sequence[BranchLike], window: float
) -> tuple[float, float, FitQuality]:
    """Return a1, a2 and their quality; see `NormalForm.fit`."""
    window = positive("window", window)
    branches: list[Any] = [branch] if hasattr(branch, "lam") else list(branch)
    arrays = [branch_arrays(b) for b in branches]
    a, covariance, points = _least_squares(arrays, window)
    try:
        drift = a - _least_squares(arrays, 0.5 * window)[0]
    except InvalidInput:
        drift = np.full(2, math.nan)
    rows: Any = tuple(tuple(float(c) for c in row) for row in covariance)
    return float(a[0]), float(a[1]), FitQuality(window, points, rows, (float(drift[0]), float(drift[1])))


def _stretches(lam: np.ndarray, alpha1: np.ndarray, window: float) -> np.ndarray:
    """Length of alpha1 within the window that each point stands for.

    A segment is shared between its ends; one that crosses the border of the window counts up
    to there, for the end inside.
    """
    inside = np.abs(lam) <= window
    length, rise = np.abs(np.diff(alpha1)), np.diff(lam)
    here, there = inside[:-1], inside[1:]
    border = np.where(np.where(here, lam[1:], lam[:-1]) > 0.0, window, -window)
    with np.errstate(divide="ignore", invalid="ignore"):
        up_to = (border - lam[:-1]) / rise
    first = np.where(here & there, 0.5, np.where(here, up_to, 0.0))
    second = np.where(here & there, 0.5, np.where(there, 1.0 - up_to, 0.0))
    weights = np.zeros_like(lam)
    weights[:-1] += first * length
    weights[1:] += second * length
    return weights


@one_thread
def _least_squares(
    arrays: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], window: float
) -> tuple[np.ndarray, np.ndarray, int]:
    weights = np.concatenate([_stretches(lam, alpha1, window) for lam, alpha1, _ in arrays])
    lam, alpha1, beta0 = (np.concatenate(column) for column in zip(*arrays, strict=True))
    inside = (np.abs(lam) <= window) & (alpha1 != 0.0) & (weights > 0.0)
    lam, alpha1, beta0, weights = lam[inside], alpha1[inside], beta0[inside], weights[inside]
    if lam.size < 3:
        raise InvalidInput(
            f"{lam.size} detached points have |lambda| <= {window:g}; a fit needs three.",
            remedy="Widen the window or trace with smaller steps.",
        )
    if not beta0.any():
        raise InvalidInput("a2 does not show at beta0 = 0.", remedy="Fit to branches with beta0 > 0 too.")
    root = np.sqrt(weights / weights.mean())
    X, y = np.column_stack([alpha1 * lam, beta0 * alpha1**2]) * root[:, None], -(alpha1**3) * root
    scale = np.linalg.norm(X, axis=0)
    a, _, rank, _ = np.linalg.lstsq(X / scale, y, rcond=1e-12)
    if rank < 2:
        raise InvalidInput(
            "the points in the window do not determine both a1 and a2.", remedy="Widen the window."
        )
    residual = y - X / scale @ a
    covariance = residual @ residual / (y.size - 2) * np.linalg.inv(X.T @ X)
    return a / scale, covariance, int(y.size)
