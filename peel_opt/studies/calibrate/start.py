"""Where a fit starts: every observation on the branch of a rod, and rods worth starting from.

In logarithms of length and pressure a rod's branch is one curve for its eta/y0, shifted by
(eta, T0).  So a search over eta/y0 alone, with the best shift for each, sees all rods.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from ...base.errors import NotConverged
from ...continuation.points import Point
from ...model.bond import CohesiveLaw
from ...model.labels import fits
from ...model.rod import MATERIAL, Rod
from ...residual.shape import sample_shape
from .chart import HIGHEST, ChartStates
from .curve import branch_of, nearest
from .data import Observation
from .pairs import logarithms
from .problem import Fitted, Problem

#: Ratios eta/y0 that are tried.
GRID = np.geomspace(0.006, 2500.0, 29)

#: Distance in logarithms beyond which a pair counts less in the search: it may be an outlier.
SOFT = 0.1

#: How far past the least pressure the curve of a rod goes on, in A: other rods turn a little later.
MARGIN = 0.6


def begun(rod: Rod, problem: Problem) -> tuple[Fitted, ChartStates]:
    """Return a rod as the start of a fit, pictures at their best points, and the nodes of its curve.

    Raises
    ------
    NotConverged
        If the rod has no state like that of an observation.
    """
    branch = branch_of(problem.chart.law, rod.ratio)
    minimum = branch.fold("LP-pressure")
    folded = any(o.state == "folded" for o in problem.observations) or minimum is None
    last = HIGHEST if folded or minimum is None else minimum.point.scalars.A + MARGIN
    # At the contact itself the system is singular.
    points = [p for p in branch.points if p.scalars.m != 0.0 and last >= p.scalars.A] or branch.points[:1]
    points += branch.points[1:2] if len(points) < 2 else []
    nodes = ChartStates.at_points(points)
    nodes.A[0] = 0.0
    labels = [branch.state_at(p.arclength) for p in points]
    chosen = []
    for observation in problem.observations:
        like = [i for i, label in enumerate(labels) if fits(label, observation.state) and i > 0]
        if not like:
            raise NotConverged(
                f"{observation.name}: the rod with eta/y0 = {rod.ratio:.4g} has no {observation.state}"
                " state.",
                remedy="Give another state, or another rod to start from.",
            )
        if observation.points is None:
            chosen.append(like[0])  # the curve is searched for pairs, as a whole
        else:
            chosen.append(min(like, key=lambda i: _misfit(observation, points[i], rod)))
    origins = [_origin(o, points[i], rod) for o, i in zip(problem.observations, chosen, strict=True)]
    directions = np.eye(int(problem.free.sum()))
    return Fitted(logarithms(rod), nodes.take(np.array(chosen)), np.array(origins), directions), nodes


def _origin(observation: Observation, point: Point, rod: Rod) -> float:
    """x of the detachment point [m] as far as the tip tells it, the point furthest from the attached part."""
    if observation.points is None or not observation.free_origin:
        return 0.0
    shape = sample_shape(point.problem, point.x)
    return float(observation.points[:, 0].min() - shape.x.min() * rod.length(point.scalars.sigma))


def _place(point: Point) -> tuple[float, float]:
    """(log sigma, log P); the pressure of a branch that is lost may pass zero."""
    s = point.scalars
    return math.log(s.sigma), math.log(max(s.pressure_ratio, 1e-12))


def _misfit(observation: Observation, point: Point, rod: Rod) -> float:
    """Mean squared distance of measured points and numbers from a state, over its size squared."""
    assert observation.points is not None
    shape, length = sample_shape(point.problem, point.x), rod.length(point.scalars.sigma)
    x, y = observation.points[:, :2].T / length
    if observation.free_origin:
        # By the tip: the point furthest from the attached part.
        x = x - x.min() + shape.x.min()
    gaps = np.hypot(x[:, None] - shape.x, y[:, None] - shape.y).min(axis=1)
    pressure = rod.pressure(max(point.scalars.pressure_ratio, 1e-12))
    known = [(observation.length, length), (observation.pressure, pressure)]
    return float(np.mean(gaps**2)) + sum(math.log(v / there) ** 2 for v, there in known if v is not None)


def coarse_rods(
    observations: Sequence[Observation], known: Mapping[str, float], law: CohesiveLaw, count: int = 3
) -> list[tuple[float, Rod]]:
    """Return the rods that a search over all eta/y0 finds worth starting from, best first.

    Parameters
    ----------
    observations : sequence of Observation
    known : mapping
        The material numbers that are not looked for, in SI units.
    law : CohesiveLaw
    count : int
        At most so many.

    Returns
    -------
    list of (float, Rod)
        How far the observations are from the branch of each, and the rod.
    """
    pairs = np.array([_log_pair(o) for o in observations])
    folded = np.array([o.state == "folded" for o in observations])
    found = []
    for ratio in _ratios(known):
        curves = _curves(law, float(ratio))
        offset, directions = _shifts(float(ratio), known)
        trial = _best_shift(pairs, folded, curves, offset, directions)
        if trial is not None:
            cost, (log_eta, log_T0) = trial
            rod = Rod(math.exp(3.0 * log_eta + log_T0), math.exp(log_T0), math.exp(log_eta) / ratio)
            found.append((cost, rod))
    found.sort(key=lambda pair: pair[0])
    return found[:count]


def _ratios(known: Mapping[str, float]) -> np.ndarray:
    return GRID if len(known) < len(MATERIAL) else np.array([Rod(*(known[name] for name in MATERIAL)).ratio])


def _log_pair(observation: Observation) -> tuple[float, float]:
    """(log sbar, log p), nan where unknown; a shape's length is guessed from its chord."""
    length = observation.length
    if length is None and observation.points is not None:
        x, y = observation.points[:, 0], observation.points[:, 1]
        length = max(math.hypot(np.ptp(x), np.ptp(y)), 1e-300)
    pressure = observation.pressure
    return (math.log(length) if length else math.nan, math.log(pressure) if pressure else math.nan)


@lru_cache(maxsize=64)
def _curves(law: CohesiveLaw, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """(log sigma, log P) along the unfolded and the folded part."""
    try:
        branch = branch_of(law, ratio)
    except NotConverged:
        return np.empty((0, 2)), np.empty((0, 2))
    parts: tuple[list[tuple[float, float]], list[tuple[float, float]]] = ([], [])
    minimum = branch.fold("LP-pressure")
    for p in branch.points:
        past = minimum is not None and p.arclength >= minimum.point.arclength
        parts[past].append(_place(p))
    return np.array(parts[0]), np.array(parts[1]).reshape(-1, 2)


def _shifts(ratio: float, known: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Point and directions of the (log eta, log T0) that known numbers leave at one eta/y0."""
    # k = eta^3 T0, and y0 = eta over the ratio.
    powers = {"bending_stiffness": (3.0, 1.0), "adhesion_strength": (0.0, 1.0), "adhesion_range": (1.0, 0.0)}
    matrix = np.reshape([powers[name] for name in known], (-1, 2))
    values = [math.log(v * (ratio if name == "adhesion_range" else 1.0)) for name, v in known.items()]
    point = np.linalg.pinv(matrix) @ values
    return point, np.linalg.svd(matrix)[2][len(known) :]


def _best_shift(
    pairs: np.ndarray,
    folded: np.ndarray,
    curves: tuple[np.ndarray, np.ndarray],
    offset: np.ndarray,
    directions: np.ndarray,
) -> tuple[float, np.ndarray] | None:
    from scipy.optimize import least_squares

    chosen = curves[1] if folded.all() else curves[0]
    if not len(chosen) or (folded.any() and not len(curves[1])):
        return None

    def gaps(t: np.ndarray) -> np.ndarray:
        shifted = pairs - (offset + t @ directions)
        return np.where(folded, _gap(shifted, curves[1]), _gap(shifted, curves[0]))

    def cost(t: np.ndarray) -> float:
        return float(np.sum(np.sqrt(1.0 + (gaps(t) / SOFT) ** 2) - 1.0))

    if not len(directions):
        return cost(np.empty(0)), offset
    centre = np.nanmean(pairs, axis=0, where=np.isfinite(pairs))
    centre = np.where(np.isfinite(centre), centre, offset)
    # The centre of the data laid on places along the curve, as far as the known numbers let it.
    places = chosen[np.linspace(0, len(chosen) - 1, 8).astype(int)]
    starts = [directions @ (centre - place - offset) for place in places]
    best = min(starts, key=cost)
    solved = least_squares(lambda t: np.append(gaps(t), 1e-9 * t), best, loss="soft_l1", f_scale=SOFT)
    return cost(solved.x), offset + solved.x @ directions


def _gap(places: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Distance of each place from a polyline; an unknown coordinate costs nothing."""
    known = np.isfinite(places)
    return nearest(np.where(known, places, 0.0), curve[:-1], np.diff(curve, axis=0), known.astype(float))[2]
