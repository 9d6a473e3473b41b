"""Effective potential of a traced branch, by quadrature and without a fit."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from scipy.interpolate import make_interp_spline

from ..base.errors import InvalidInput
from ..model.series import uniform_series
from .potential import EffectivePotential


class BranchLike(Protocol):
    """Detached states: arrays of lambda and alpha1, and beta0 as a number or an array."""

    @property
    def lam(self) -> np.ndarray:
        """Values beta1 - pi^4."""

    @property
    def alpha1(self) -> np.ndarray:
        """Extra pressures."""

    @property
    def beta0(self) -> Any:
        """(sbar/eta)^3."""


def branch_potential(branch: BranchLike) -> EffectivePotential:
    """Effective potential of a traced branch at one beta0, by quadrature and without a fit.

    The part of the branch around alpha1 = 0 on which alpha1 is monotone is interpolated by a
    quintic spline and integrated exactly.  T itself, (0, 0), is added if it is missing.  The
    constant a1 in front is the exact one; it moves nothing.

    Parameters
    ----------
    branch : Branch
        At one beta0, or anything with its ``beta0``, ``lam`` and ``alpha1``.

    Returns
    -------
    EffectivePotential

    Raises
    ------
    InvalidInput
        If beta0 varies along the branch or fewer than six points can be used.
    """
    lam, alpha1, beta0 = branch_arrays(branch)
    if np.ptp(beta0) > 1e-9 * beta0.max():
        raise InvalidInput(
            f"beta0 runs from {beta0.min():g} to {beta0.max():g} along this branch.",
            remedy="A potential is defined at one beta0; trace the branch at fixed beta0.",
        )
    start = int(np.argmin(np.abs(alpha1)))
    steps = np.sign(np.diff(alpha1))
    first, last = start, start
    direction = steps[start] if start < steps.size else steps[start - 1]
    while first > 0 and steps[first - 1] == direction:
        first -= 1
    while last < steps.size and steps[last] == direction:
        last += 1
    x, y = alpha1[first : last + 1], lam[first : last + 1]
    near = 1e-9 * np.abs(x).max()
    away = np.abs(x) > near
    x, y = np.append(x[away], 0.0), np.append(y[away], 0.0)
    if x.size < 6:
        raise InvalidInput(
            f"{x.size - 1} points next to T are too few for a potential.", remedy="Trace with smaller steps."
        )
    order = np.argsort(x)
    spline = make_interp_spline(x[order], y[order], k=5)
    once = spline.antiderivative()
    twice = once.antiderivative()

    def moment(t: Any) -> Any:  # by parts; the constants of integration drop out
        return t * once(t) - (twice(t) - twice(0.0))

    domain = (float(x.min()), float(x.max()))
    return EffectivePotential(
        float(beta0[0]), uniform_series(1).leading[0], spline, spline.derivative(), moment, domain
    )


def branch_arrays(branch: BranchLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return lambda, alpha1 and beta0 of a branch as checked arrays of one length."""
    if not all(hasattr(branch, name) for name in ("lam", "alpha1", "beta0")):
        raise InvalidInput(f"a branch has lam, alpha1 and beta0, which {branch!r:.60} has not.")
    lam, alpha1 = np.asarray(branch.lam, float), np.asarray(branch.alpha1, float)
    if lam.ndim != 1 or lam.shape != alpha1.shape or lam.size == 0:
        raise InvalidInput(
            f"a branch needs arrays lam and alpha1 of one length, got shapes {lam.shape} and {alpha1.shape}."
        )
    beta0 = np.broadcast_to(np.asarray(branch.beta0, float), lam.shape)
    good = np.isfinite(lam) & np.isfinite(alpha1) & np.isfinite(beta0)
    if not good.all():
        raise InvalidInput(f"{np.count_nonzero(~good)} of {lam.size} points of the branch are not finite.")
    if (beta0 < 0.0).any():
        raise InvalidInput(f"beta0 must be zero or positive along a branch, got {beta0.min():g}.")
    return lam, alpha1, beta0
