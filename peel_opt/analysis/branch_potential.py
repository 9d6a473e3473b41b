"""Effective potential of a traced branch, by quadrature and without a fit.

Between kinks the curve is a spline through the points of the branch and, where they are known, their
tangents.  The same splines through every second point say how far it is to be trusted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import factorial
from typing import Any, Protocol

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import BSpline, PPoly
from scipy.sparse import diags_array, vstack
from scipy.sparse.linalg import spsolve

from ..base.errors import InvalidInput
from ..continuation.points import Point
from ..model.equations import PI4
from ..model.series import uniform_series
from .potential import EffectivePotential

#: Highest degree of a spline through values and slopes; two less through values alone.
_DEGREE = 7

#: A point is left out that is nearer to its neighbour than this share of the gap beyond.
_CROWDED = 0.05

#: Continued straight, a branch without T may miss it by so many times its lambda there.
_MISSES = 1.5

#: Fewest values and slopes, with T.
_FEWEST = 7


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


@dataclass(frozen=True, eq=False)
class States:
    """States along a branch at one beta0, as a potential is made of.

    Parameters
    ----------
    beta0 : float
    alpha1, lam : ndarray, shape (n,)
    slope : ndarray, shape (n,), optional
        dlambda/dalpha1.
    error : ndarray, shape (n,), optional
        Distance of each state from the exact branch, in the metric of the arclength.
    kinks : ndarray of bool, shape (n,), optional
        Whether the curve has a kink at a state.
    bent : ndarray of bool, shape (n - 1,), optional
        Whether it has one between two states.
    """

    beta0: float
    alpha1: np.ndarray
    lam: np.ndarray
    slope: np.ndarray | None = None
    error: np.ndarray | None = None
    kinks: np.ndarray | None = None
    bent: np.ndarray | None = None


def branch_potential(branch: BranchLike) -> EffectivePotential:
    """Effective potential of a traced branch at one beta0, by quadrature and without a fit.

    The part of the branch around alpha1 = 0 on which alpha1 is monotone is interpolated by splines and
    integrated exactly: one spline between two kinks, where the rod reaches or leaves y = y0 under a law
    that has a kink there.  T itself, (0, 0), is added if it is missing.  The constant a1 in front
    is the exact one; it moves nothing.

    Parameters
    ----------
    branch : Branch
        At one beta0, or anything with its ``beta0``, ``lam`` and ``alpha1``.  A `Branch` has tangents
        too, which raise the order of the splines from 6 to 8, and says where its kinks are.

    Returns
    -------
    EffectivePotential
        What is read from it has an error: what leaving out every second point changes, and what the
        points themselves are off by.

    Raises
    ------
    InvalidInput
        If beta0 varies along the branch or too few points can be used.

    Examples
    --------
    >>> from peel_opt import trace
    >>> potential = branch_potential(trace(beta0=4.0, lam=(-1.0, 1.0), law="cohesive"))
    >>> lam, alpha1 = potential.maxwell()
    >>> round(lam, 9), potential.maxwell().error < 1e-9
    (-0.239053836, True)
    """
    lam, alpha1, beta0 = branch_arrays(branch)
    if np.ptp(beta0) > 1e-9 * beta0.max():
        raise InvalidInput(
            f"beta0 runs from {beta0.min():g} to {beta0.max():g} along this branch.",
            remedy="A potential is defined at one beta0; trace the branch at fixed beta0.",
        )
    held = getattr(branch, "held", None) if getattr(branch, "hold", "") == "beta0" else None
    states = States(
        float(beta0[0] if held is None else held),
        alpha1,
        lam,
        _slopes(branch),
        getattr(branch, "error", None),
        *_kinks(branch, len(lam)),
    )
    return states_potential(states)


def points_potential(beta0: float, points: Sequence[Point]) -> EffectivePotential:
    """Return the effective potential of points walked at fixed beta0, in order along the branch."""
    lam, alpha1 = np.array([(p.scalars.lam, p.scalars.alpha1) for p in points]).T
    slope = np.array([_slope(p.x[-4:], p.tangent[-4:]) for p in points])
    bent = _changes([p.problem.phases for p in points])
    return states_potential(States(beta0, alpha1, lam, slope, bent=bent))


def states_potential(states: States) -> EffectivePotential:
    """Return the effective potential of states in order along a branch at one beta0."""
    known = _around_T(states)
    x, y, slope = known.alpha1, known.lam, known.slope
    if len(x) + np.isfinite(slope).sum() < _FEWEST:
        raise InvalidInput(
            f"{len(x) - 1} points next to T are too few for a potential.", remedy="Trace with smaller steps."
        )
    across = PI4 * np.hypot(1.0, y / PI4) + (1.0 + states.beta0) * np.abs(np.nan_to_num(slope))
    noise = float((known.error * across).max()) + 4.0 * np.finfo(float).eps * PI4

    def made(kept: np.ndarray, others: tuple[EffectivePotential, ...]) -> EffectivePotential:
        rows = np.flatnonzero(kept)
        cells = np.flatnonzero(np.logical_or.reduceat(known.bent, rows[:-1]))
        cut = np.unique([0, *np.flatnonzero(known.kinks[rows]), *cells, *(cells + 1), len(rows) - 1])
        pieces = []
        for a, b in pairwise(cut):
            part = rows[a : b + 1]
            if a in cells:
                pieces.append(_bend(*(column[rows[max(a - 1, 0) : b + 1]] for column in (x, y, slope))))
            else:
                pieces.append(_spline(x[part], y[part], slope[part]))
        curve = _joined(pieces)
        return EffectivePotential(
            states.beta0,
            uniform_series(1).leading[0],
            curve,
            curve.derivative(),
            _moment(curve),
            (float(x[0]), float(x[-1])),
            kinks=tuple(float(piece.x[0]) for piece in pieces[1:]),
            noise=Polynomial([noise]),
            others=others,
        )

    always = known.kinks | (x == 0.0)
    always[[0, -1]] = True
    odd = np.arange(len(x)) % 2 == 1
    return made(np.full(len(x), True), (made(always | odd, ()), made(always | ~odd, ())))


def _around_T(states: States) -> States:
    """Return states by ascending alpha1: those with T among them on which alpha1 is monotone, none crowding."""
    alpha1 = states.alpha1
    start = int(np.argmin(np.abs(alpha1)))
    steps = np.sign(np.diff(alpha1))
    first, last = start, start
    direction = steps[start] if start < steps.size else steps[start - 1] if steps.size else 1.0
    while first > 0 and steps[first - 1] == direction:
        first -= 1
    while last < steps.size and steps[last] == direction:
        last += 1
    n = len(alpha1)
    slope = np.full(n, np.nan) if states.slope is None else states.slope.copy()
    # Where the curve turns back its slope is infinite, and near there of no use.
    slope[[i for i, inside in ((first, first > 0), (last, last < steps.size)) if inside]] = np.nan
    error = np.zeros(n) if states.error is None else np.asarray(states.error, float)
    kinks = np.zeros(n, bool) if states.kinks is None else states.kinks
    bent = np.zeros(n - 1, bool) if states.bent is None else states.bent
    rows, between = slice(first, last + 1), bent[first:last]
    table = np.array([alpha1, states.lam, slope, error, kinks])[:, rows]
    if direction < 0.0:
        table, between = table[:, ::-1], between[::-1]
    at_T = np.abs(table[0]) <= 1e-9 * np.abs(table[0]).max()
    if at_T.any():
        table[:2, at_T] = 0.0
        table[:, np.argmax(at_T)] = table[:, at_T].max(axis=1)
    else:
        _require_heading_for_T(table[0], table[1])
        place = int(np.searchsorted(table[0], 0.0))
        table = np.insert(table, place, [0.0, 0.0, np.nan, 0.0, 0.0], axis=1)
        between = np.insert(between, min(place, len(between)), False)
    x = table[0]
    kept = np.flatnonzero(_apart(x, (table[4] > 0.0) | (x == 0.0)))
    x, y, slope, error, at_kink = table[:, kept]
    between = np.logical_or.reduceat(between, kept[:-1])
    return States(states.beta0, x, y, slope, error, at_kink > 0.0, between)


def _require_heading_for_T(x: np.ndarray, y: np.ndarray) -> None:
    """Refuse a branch without T that, continued straight from its two nearest points, misses it by far."""
    if len(x) < 2:
        return
    near, next_to = np.argsort(np.abs(x))[:2]
    missed = y[near] - x[near] * (y[next_to] - y[near]) / (x[next_to] - x[near])
    if abs(missed) > _MISSES * abs(y[near]):
        raise InvalidInput(
            f"the branch does not come from T: at alpha1 = {x[near]:.4g} it has lambda = {y[near]:.6g}.",
            remedy="The potential is an integral from alpha1 = 0; trace from there, or under a law that"
            " weakens from the start.",
        )


def _apart(x: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Which points to keep, all that are wanted and the ends among them, so that none crowd.

    Divided by the distance of two points, what they are off by spoils the splines around them.
    """
    kept = np.full(len(x), True)
    before = 0
    for i in range(1, len(x) - 1):
        gap = x[i] - x[before]
        near_next = (wanted[i + 1] or i + 2 == len(x)) and x[i + 1] - x[i] < _CROWDED * gap
        if not wanted[i] and (gap < _CROWDED * (x[i + 1] - x[i]) or near_next):
            kept[i] = False
        else:
            before = i
    kept[1:][np.diff(x) == 0.0] = False  # T twice
    return kept


def _spline(x: np.ndarray, y: np.ndarray, slope: np.ndarray) -> PPoly:
    """Return the spline through values, and slopes where they are known, without knots at its ends."""
    known = np.isfinite(slope)
    nodes = np.sort(np.concatenate([x, x[known]]))
    degree = min(_DEGREE if known.any() else _DEGREE - 2, len(nodes) - 1)
    degree -= 1 - degree % 2
    half = (degree + 1) // 2
    knots = np.concatenate([[x[0]] * (degree + 1), nodes[half:-half], [x[-1]] * (degree + 1)])
    steps = degree / (knots[degree + 1 : -1] - knots[1 : -degree - 1])
    difference = diags_array([-steps, steps], offsets=[0, 1], shape=(len(nodes) - 1, len(nodes)))
    slopes = BSpline.design_matrix(x[known], knots[1:-1], degree - 1) @ difference
    rows = vstack([BSpline.design_matrix(x, knots, degree), slopes], format="csc")
    spline = BSpline(knots, spsolve(rows, np.concatenate([y, slope[known]])), degree)
    ends = np.unique(knots)
    return PPoly([spline(ends[:-1], nu=nu) / factorial(nu) for nu in range(degree, -1, -1)], ends)


def _bend(x: np.ndarray, y: np.ndarray, slope: np.ndarray) -> PPoly:
    """Return the last two points joined by two parabolas, which meet where the curve bends.

    Each has the value and the slope of its end.  They meet where the first goes on as it comes from the
    point before: a cubic would swing to both sides of a sudden bend, and turn where nothing turns.
    """
    width, rise = float(x[-1] - x[-2]), float(y[-1] - y[-2])
    left, right = float(slope[-2]), float(slope[-1])
    curvature = float((slope[-2] - slope[-3]) / (x[-2] - x[-3])) if len(x) > 2 else 0.0
    bent = right - left - width * curvature
    share = (left + right - 2.0 * rise / width) / bent if bent else 0.5
    at = width * (share if 0.01 < share < 0.99 else 0.5)
    middle = (2.0 * rise - at * left - (width - at) * right) / width
    first = [0.5 * (middle - left) / at, left, float(y[-2])]
    second = [0.5 * (right - middle) / (width - at), middle, float(y[-2]) + 0.5 * (left + middle) * at]
    return PPoly(np.array([first, second]).T, [x[-2], x[-2] + at, x[-1]])


def _joined(pieces: Sequence[PPoly]) -> PPoly:
    """Return pieces that follow each other as one."""
    most = max(len(piece.c) for piece in pieces)
    columns = [np.pad(piece.c, ((most - len(piece.c), 0), (0, 0))) for piece in pieces]
    return PPoly(np.hstack(columns), np.concatenate([pieces[0].x[:1], *(piece.x[1:] for piece in pieces)]))


def _moment(curve: PPoly) -> PPoly:
    """Integral of x times a curve, from 0."""
    none = np.zeros((1, curve.c.shape[1]))
    times_x = np.vstack([curve.c, none]) + np.vstack([none, curve.x[:-1] * curve.c])
    moment = PPoly(times_x, curve.x).antiderivative()
    moment.c[-1] -= moment(0.0)
    return moment


def _slopes(branch: BranchLike) -> np.ndarray | None:
    """dlambda/dalpha1 along a branch that carries its solutions."""
    solutions = getattr(branch, "solutions", None)
    if solutions is None:
        return None
    together = zip(solutions.unknowns, solutions.tangents, strict=True)
    return np.array([_slope(x[-4:], tangent[-4:]) for x, tangent in together])


def _slope(scalars: np.ndarray, rates: np.ndarray) -> float:
    (A, m, _, _), (dA, dm, _, dlam) = scalars, rates
    turned = m * dA + dm * A
    return float(dlam / turned) if turned else np.nan


def _kinks(branch: BranchLike, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return at which points of a branch its curve has kinks, and between which, as far as it says so."""
    at, between = np.zeros(count, bool), np.zeros(max(count - 1, 0), bool)
    at[[p.index for p in getattr(branch, "special_points", ()) if p.kind == "y=y0"]] = True
    solutions = getattr(branch, "solutions", None)
    if solutions is not None:
        between = _changes(solutions.phases)
        at &= np.append(between, False) | np.append(False, between)
        between &= ~(at[:-1] | at[1:])
    return at, between


def _changes(phases: Sequence[Any]) -> np.ndarray:
    """Whether one sequence of phases gives way to another between two points."""
    return np.array([here != there for here, there in pairwise(phases)], bool)


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
