"""The fitted branch, and how far the uncertainty of the fit moves it sideways."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...model.labels import fits
from .chart import ChartStates
from .pairs import BranchSpline, Pairs, scales
from .start import branch_of

if TYPE_CHECKING:
    from .result import Calibration


def fitted_curve(fit: Calibration) -> BranchSpline:
    """Return the whole branch of the fitted rod."""
    branch = branch_of(fit.problem.chart.law, fit.rod.ratio)
    walked = ChartStates.at_points([p for p in branch.points if p.scalars.m != 0.0])
    return BranchSpline.through(fit.problem.chart.at(walked, scales(fit.fitted.q)[1], walked.A, halvings=1))


def band(fit: Calibration) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the branch of the fitted rod and the standard deviation across it.

    A curve that moves is seen to move across itself only: the part of the change of (sbar, p)
    along the curve is left out, each measured in its own range.

    Returns
    -------
    curve : ndarray, shape (n, 2)
        Length [m] and pressure [Pa], over the parts of the branch that were observed.
    sideways : ndarray, shape (n, 2), or None
        One standard deviation as a vector across the curve; None where it is not finite.
    """
    whole, scale = fitted_curve(fit), scales(fit.fitted.q)[0]
    wanted = {o.state for o in fit.observations}
    lines = np.flatnonzero([any(fits(label, state) for state in wanted) for label in whole.labels])
    ends = whole.polyline[0]
    states = whole.states(np.unique(np.concatenate([ends[lines], ends[lines + 1]])))
    curve = states.numbers * scale
    ranges = np.ptp(curve, axis=0)
    if len(curve) < 3 or not np.all(np.isfinite(fit.log_covariance)) or np.any(ranges == 0.0):
        return curve, None
    # Each point as if it were measured, with standard deviations of the whole range.
    points = Pairs(curve, np.tile(ranges, (len(curve), 1)), ("unfolded",) * len(curve))
    pulls = points.pulls(states, scale)
    tangent = states.by_A * scale / ranges
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    change = np.einsum("ij,ijk->ik", normal, pulls.by_q[:, :, fit.problem.free])
    sd = np.sqrt(np.einsum("ij,jk,ik->i", change, fit.log_covariance, change))
    return curve, normal * sd[:, None] * ranges
