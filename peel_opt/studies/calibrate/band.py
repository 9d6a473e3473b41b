"""The fitted branch, and how far the uncertainty of the fit moves it sideways."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ...continuation.family import Family
from ...continuation.points import Point
from ...residual.closures import Closure
from ...residual.discretisation import Profile
from .blocks import Signature, block
from .data import Observation
from .problem import Placed, Problem
from .sensitivity import follow
from .start import branch_of, fits

if TYPE_CHECKING:
    from .result import Calibration


#: Points on each stretch between two points of the walked branch.
STEPS = 5


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
    rod = fit.rod
    branch = branch_of(rod.ratio)
    wanted = {o.state for o in fit.observations}
    profiles = [
        profile
        for here, there in pairwise(branch.points)
        if any(fits(branch.state_at(0.5 * (here.arclength + there.arclength)), state) for state in wanted)
        for profile in _between(branch.family, here, there)
    ]
    points = [profile.scalars for profile in profiles]
    curve = np.array([[rod.length(s.sigma), rod.pressure(s.pressure_ratio)] for s in points])
    ranges = np.ptp(curve, axis=0)
    if len(points) < 3 or not np.all(np.isfinite(fit.log_covariance)) or np.any(ranges == 0.0):
        return curve, None
    # Each point as if it were measured, with standard deviations of one eta and one T0.
    seen = [Observation("point", s.sigma, s.pressure_ratio, 1.0, 1.0, "unfolded") for s in points]
    problem = Problem(seen, rod.ratio, fit.problem.free, None)
    blocks = problem.pose(np.zeros(3), [Placed(profile) for profile in profiles])
    root = np.linalg.cholesky(fit.log_covariance + 1e-30 * np.eye(len(fit.free)))
    sideways = [
        _across(signature, u, d, fit.problem.free, root, ranges / (rod.eta, rod.adhesion_strength))
        for signature, u, d in zip(blocks.signatures, blocks.state.unknowns, blocks.state.data, strict=True)
    ]
    return curve, np.array(sideways) * (rod.eta, rod.adhesion_strength)


def _between(family: Family, here: Point, there: Point) -> Iterator[Profile]:
    """Solve along a stretch of branch, at equal steps of the tip angle."""
    a, b = here.scalars.A, there.scalars.A
    for share in (np.arange(STEPS) + 0.5) / STEPS:
        given = Closure("amplitude", float((1.0 - share) * a + share * b))
        landed = family.land(here, there, given)
        if landed is not None:
            problem, result = landed
            yield problem.profile(result.x)


def _across(
    signature: Signature, u: np.ndarray, d: np.ndarray, free: np.ndarray, root: np.ndarray, ranges: np.ndarray
) -> np.ndarray:
    """One standard deviation of (sigma, P) across the curve, as a vector."""
    part = block(signature)
    _, g_u, g_q, _, r_u, r_q = part.evaluate(u, np.zeros(3), d)
    along, own = follow(part, u, g_u, g_q)
    # The tip angle is monotone along the branch: the normal keeps to one side of it.
    forward = own[:, 0] * np.sign(own[part.problem.size - 4, 0])
    tangent = (r_u @ forward) / ranges
    normal = np.array([-tangent[1], tangent[0]]) / np.linalg.norm(tangent)
    change = ((r_q + r_u @ along)[:, free] / ranges[:, None]) @ root
    return normal * float(np.linalg.norm(normal @ change)) * ranges
