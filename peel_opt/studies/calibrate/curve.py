"""The branch of one rod as a smooth curve: the state nearest to a pair, and how sure the fitted one is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...continuation.primary import PrimaryBranch, primary_branch
from ...model.bond import CohesiveLaw
from ...model.labels import fits
from ...residual.closures import Closure
from .chart import HIGHEST, ChartStates
from .pairs import Pairs, scales

if TYPE_CHECKING:
    from .result import Calibration

#: Straight lines by which a piece of the curve between two solved states is looked through.
LINES = 8


def branch_of(law: CohesiveLaw, ratio: float) -> PrimaryBranch:
    """Return the whole branch of a rod, from T to contact."""
    branch = primary_branch(law, Closure("ratio", ratio))
    branch.extend(lambda last: last.scalars.A > HIGHEST)
    return branch


@dataclass(frozen=True, eq=False)
class BranchSpline:
    """The branch of one rod as a smooth curve through solved states, quintic between them.

    Parameters
    ----------
    nodes : ChartStates
        In order of A, the first at T.
    """

    nodes: ChartStates

    @classmethod
    def through(cls, nodes: ChartStates) -> BranchSpline:
        """Return the curve through those of some states that exist."""
        return cls(nodes.take(np.flatnonzero(np.all(np.isfinite(nodes.numbers), axis=1))))

    def expand(self, A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers and their derivatives at some tip angles."""
        places = self.nodes.A
        i = np.clip(np.searchsorted(places, A, side="right") - 1, 0, len(places) - 2)
        width = (places[i + 1] - places[i])[:, None]
        t = (A - places[i])[:, None] / width
        return tuple(
            sum(k * c * t**p for c, k, p in _powers([part[i] for part in self._quintics], d)) / width**d
            for d in range(3)
        )

    def beside(self, A: np.ndarray) -> ChartStates:
        """Return the nodes nearest to some tip angles."""
        places = self.nodes.A
        return self.nodes.take(np.argmin(np.abs(places - A[:, None]), axis=1))

    def states(self, A: np.ndarray) -> ChartStates:
        """Return states with the numbers of the curve at some tip angles, and unknowns of nodes nearby."""
        near = self.beside(A)
        numbers, by_A, by_AA = self.expand(A)
        by_r = np.column_stack([np.interp(A, self.nodes.A, column) for column in self.nodes.by_r.T])
        return replace(near, A=A, numbers=numbers, by_A=by_A, by_AA=by_AA, by_r=by_r)

    @cached_property
    def _quintics(self) -> list[np.ndarray]:
        """Coefficients of each piece in t on [0, 1], from values and two derivatives at its ends."""
        n = self.nodes
        h = np.diff(n.A)[:, None]
        a, da, dda = n.numbers[:-1], n.by_A[:-1] * h, 0.5 * n.by_AA[:-1] * h**2
        left = n.numbers[1:] - a - da - dda
        slope = n.by_A[1:] * h - da - 2.0 * dda
        bend = n.by_AA[1:] * h**2 - 2.0 * dda
        return [
            a,
            da,
            dda,
            10.0 * left - 4.0 * slope + 0.5 * bend,
            -15.0 * left + 7.0 * slope - bend,
            6.0 * left - 3.0 * slope + 0.5 * bend,
        ]

    @cached_property
    def polyline(self) -> tuple[np.ndarray, np.ndarray]:
        """Tip angles and numbers of a polyline close to the curve."""
        ends = self.nodes.A
        inner = ends[:-1, None] + np.diff(ends)[:, None] * np.arange(LINES) / LINES
        A = np.append(inner.ravel(), ends[-1])
        return A, self.expand(A)[0]

    @cached_property
    def labels(self) -> np.ndarray:
        """Name of the state on each line of the polyline, as the primary branch has it."""
        steps = np.diff(self.polyline[1], axis=0)
        number = np.arange(len(steps))
        minimum = np.argmax(steps[:, 1] > 0.0) if np.any(steps[:, 1] > 0.0) else len(steps)
        turned = np.flatnonzero(np.diff(np.sign(steps[:, 0])))
        bend = turned[0] + 1 if len(turned) else len(steps)
        return np.where(number >= minimum, "folded", np.where(number >= bend, "lower", "middle"))

    def nearest(self, pairs: Pairs, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where on its part of the polyline each pair is nearest, and its squared distance.

        Both are nan where the rod has no such part.
        """
        A, numbers = self.polyline
        steps, turns = np.diff(numbers, axis=0), np.diff(A)
        found, cost = np.full(len(pairs), np.nan), np.full(len(pairs), np.nan)
        for state in set(pairs.states):
            rows = np.flatnonzero([s == state for s in pairs.states])
            lines = np.flatnonzero([fits(label, state) for label in self.labels])
            if len(lines):
                points, unit = pairs.values[rows] / scale, scale / pairs.sds[rows]
                own, share, gap = nearest(points, numbers[lines], steps[lines], unit)
                found[rows] = A[lines[own]] + share * turns[lines[own]]
                cost[rows] = gap**2
        return found, cost


def _powers(coefficients: list[np.ndarray], d: int) -> list[tuple[np.ndarray, float, int]]:
    """Coefficients, factors and powers of the d-th derivative of a polynomial."""
    return [(c, float(math.perm(k, d)), k - d) for k, c in enumerate(coefficients) if k >= d]


def nearest(
    points: np.ndarray, begin: np.ndarray, step: np.ndarray, unit: float | np.ndarray = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the nearest of some lines to each point, where on it that is, and how far.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
    begin, step : ndarray, shape (lines, 2)
        Where each line begins, and from there to its end.
    unit : float or ndarray, shape (n, 2)
        By which distances from each point are multiplied; 0 for a coordinate that does not count.

    Returns
    -------
    tuple of ndarray, shape (n,)
        Number of the line, share of the way along it, and distance; infinite without lines.
    """
    if not len(begin):
        return np.zeros(len(points), int), np.zeros(len(points)), np.full(len(points), np.inf)
    unit = np.broadcast_to(unit, points.shape)[:, None]
    away, along = (points[:, None] - begin) * unit, step * unit
    share = (away * along).sum(axis=2) / np.maximum((along**2).sum(axis=2), 1e-300)
    share = np.clip(share, 0.0, 1.0)
    gaps = np.linalg.norm(away - share[..., None] * along, axis=2)
    line, rows = np.argmin(gaps, axis=1), np.arange(len(points))
    return line, share[rows, line], gaps[rows, line]


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
    by_q = np.array([seen.by_q for seen in points.seen(states, scale)])
    tangent = states.by_A * scale / ranges
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    change = np.einsum("ij,ijk->ik", normal, by_q[:, :, fit.problem.free])
    sd = np.sqrt(np.einsum("ij,jk,ik->i", change, fit.log_covariance, change))
    return curve, normal * sd[:, None] * ranges
