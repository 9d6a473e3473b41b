"""The Maxwell point of a rod, solved for, and how it moves with eta/y0.

On the branch lambda = Lambda(alpha1; beta0) from T past its fold the Maxwell point is

    F = integral of (lambda_M - Lambda) alpha1 dalpha1 = 0  from 0 to alpha1_M,  Lambda(alpha1_M) = lambda_M.

The end of the integral does not contribute to dF (envelope theorem), so that

    dlambda_M/dbeta0 = 2/alpha1_M^2  integral of (dLambda/dbeta0) alpha1 dalpha1,

with dLambda/dbeta0 at fixed alpha1 by the implicit function theorem at Gauss nodes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..base.errors import NoEquilibrium, NotConverged
from ..base.quadrature import Grid
from ..base.threads import one_thread
from ..continuation.primary import PrimaryBranch
from ..model.groups import PI4
from ..model.rod import require_ratio
from ..residual.closures import Closure
from ..residual.linear import Linearised
from ..residual.newton import correct
from .branch_potential import points_potential
from .design_relations import LEAST_RATIO, maxwell_length
from .maxwell import walk_round_the_fold
from .surface import Gradient

#: Numbers of Gauss nodes in alpha1, taken until two results agree; near the corner of the branch
#: at the end of the curve the last of them do not.
NODES = (20, 30, 45, 68)

#: Relative difference at which two results agree.
AGREED = 1e-11

#: eta/y0 from which on the interpolated curve has a point to start from.
NEAR_END = 0.4997

#: Newton steps in alpha1_M and beta0; both start within 1e-6.
MOST_STEPS = 8

#: Relative step at which they end, and what is left to rounding.
SMALLEST_STEP = 1e-13


@dataclass(frozen=True)
class _MaxwellPoint:
    """lambda_M and its derivative by beta0."""

    lam: float
    by_beta0: float


@one_thread
def maxwell_gradient(ratio: float) -> Gradient:
    """Return sigma_M = sbar_M/eta of a rod with its derivative by r = eta/y0.

    Raises
    ------
    NoEquilibrium
        If there is no Maxwell point at this ratio.
    OutOfRange
        For eta/y0 above 1e5.
    NotConverged
        If the branch cannot be followed there.
    """
    if ratio <= LEAST_RATIO:
        raise NoEquilibrium(
            f"at eta/y0 = {ratio:.6g} there is no Maxwell point: the branch at fixed beta0 has no fold.",
            remedy=f"It exists for eta/y0 above {LEAST_RATIO:g}.",
            nearest=LEAST_RATIO,
        )
    require_ratio(ratio, (LEAST_RATIO, 1e5))
    start = maxwell_length(ratio, "branch") / ratio
    if not start > 0.0 and ratio < NEAR_END:
        raise NotConverged(
            f"at eta/y0 = {ratio:.6g} the Maxwell point is too close to the end of its curve, at"
            f" {LEAST_RATIO:g}, where it moves infinitely fast.",
            remedy=f"Stay above eta/y0 = {NEAR_END:g}.",
        )
    if not math.isfinite(start):
        start = maxwell_length(ratio, "exact") / ratio
    beta0 = start**3
    for _ in range(MOST_STEPS):
        coarse, fine = _agreeing(beta0)
        slope = _log_ratio_slope(beta0, fine)
        step = (math.log((PI4 + fine.lam) / ratio) - 4.0 / 3.0 * math.log(beta0)) / slope
        beta0 -= step
        if abs(step) < SMALLEST_STEP * beta0:
            break
    else:
        raise NotConverged(
            f"the Maxwell point at eta/y0 = {ratio:.6g} did not converge.",
            remedy=f"Stay further above eta/y0 = {LEAST_RATIO:g}.",
        )
    sigma = math.cbrt(beta0)
    derivative = sigma / (3.0 * beta0 * ratio * slope)
    change = abs(_log_ratio_slope(beta0, coarse) / slope - 1.0)
    error = abs(derivative) * (change + 100.0 * SMALLEST_STEP)
    # lambda_M itself moves the place where the derivative is taken.
    shift = abs(fine.lam - coarse.lam) / (PI4 + fine.lam) / abs(slope * beta0)
    return Gradient(
        sigma, np.array([derivative]), np.array([error + shift * abs(derivative)]), np.array([ratio])
    )


def _agreeing(beta0: float) -> tuple[_MaxwellPoint, _MaxwellPoint]:
    """Return two results of which the second has more nodes; their difference is its error."""
    coarse = _maxwell_point(beta0, NODES[0])
    for n in NODES[1:]:
        fine = _maxwell_point(beta0, n)
        if abs(fine.by_beta0 - coarse.by_beta0) < AGREED * abs(fine.by_beta0):
            break
        coarse, last = fine, coarse
    else:
        coarse = last
    return coarse, fine


def _log_ratio_slope(beta0: float, point: _MaxwellPoint) -> float:
    """d log r / d beta0 on the curve of Maxwell points, r = (pi^4 + lambda_M) / beta0^(4/3)."""
    return point.by_beta0 / (PI4 + point.lam) - 4.0 / (3.0 * beta0)


@lru_cache(maxsize=256)
def _maxwell_point(beta0: float, nodes: int) -> _MaxwellPoint:
    walk, last = _walk(beta0)
    grid = Grid.gauss(nodes)
    step = math.inf
    for _ in range(MOST_STEPS):
        end, slope, _ = _state(walk, last)
        inside = np.array([_state(walk, last * xi) for xi in grid.xi])
        moment = last * last * grid.weights @ (grid.xi[:, None] * inside)
        before, step = step, (0.5 * end * last * last - moment[0]) / (0.5 * slope * last * last)
        last -= step
        # At small beta0 rounding of lambda, which goes with beta0^2, lets it get no smaller.
        stalled = abs(step) > 0.5 * abs(before) and abs(step) < 1e-7 * abs(last)
        if abs(step) < 1e-11 * abs(last) or stalled:
            # The integral is stationary: lambda_M has twice the digits.
            return _MaxwellPoint(end - slope * step, 2.0 * float(moment[2]) / (last * last))
    raise NotConverged(f"the Maxwell point at beta0 = {beta0:.9g} did not converge.")


@lru_cache(maxsize=64)
def _walk(beta0: float) -> tuple[PrimaryBranch, float]:
    """The branch at one beta0, and its alpha1_M by quadrature over the points walked."""
    walk = walk_round_the_fold(beta0)
    return walk, points_potential(beta0, walk.points).maxwell().alpha1


def _state(walk: PrimaryBranch, alpha1: float) -> tuple[float, float, float]:
    """Lambda at one alpha1, with its derivatives by alpha1 and beta0."""
    nearest = min(walk.points, key=lambda p: abs(p.scalars.alpha1 - alpha1))
    problem = nearest.problem
    given = (walk.family.closure, Closure("alpha1", alpha1))
    solved = correct(problem, nearest.x, given)
    if not solved.converged:
        raise NotConverged(f"the branch was lost at alpha1 = {alpha1:.6g}.")
    x = solved.x
    lam = problem.column("lam")
    by_sigma, by_alpha1 = Linearised.at(problem, x, *given).response()[lam]
    return float(x[lam]), float(by_alpha1), float(by_sigma) / (3.0 * walk.family.closure.value**2)
