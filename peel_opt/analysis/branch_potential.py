"""Effective potential of a traced branch, by quadrature and without a fit.

Between kinks the curve is a spline through the points of the branch and, where they are known, their
tangents.  The same splines through every second point say how far it is to be trusted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.polynomial import Polynomial

from ..base.errors import InvalidInput
from ..continuation.points import Point
from ..model.groups import PI4
from ..model.series import uniform_series
from ..residual.linear import rate
from .curve_pieces import bend, joined, moment, spline
from .potential import EffectivePotential

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
class BranchStates:
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
    if len(getattr(branch, "pieces", (slice(None),))) > 1:
        raise InvalidInput(
            "this branch leaves its window of lambda and comes back, with a gap between.",
            remedy="Trace it with a window that holds T and the fold.",
        )
    if np.ptp(beta0) > 1e-9 * beta0.max():
        raise InvalidInput(
            f"beta0 runs from {beta0.min():g} to {beta0.max():g} along this branch.",
            remedy="A potential is defined at one beta0; trace the branch at fixed beta0.",
        )
    held = getattr(branch, "held", None) if getattr(branch, "hold", "") == "beta0" else None
    states = BranchStates(
        float(beta0[0] if held is None else held),
        alpha1,
        lam,
        _slopes(branch),
        getattr(branch, "error", None),
        *_kinks(branch, len(lam)),
    )
    return states_potential(states)


def points_potential(
    beta0: float, points: Sequence[Point], kinks: Sequence[Point] = (), errors: np.ndarray | None = None
) -> EffectivePotential:
    """Return the effective potential of points walked at fixed beta0, in order along the branch.

    ``kinks`` are those among the points at which the curve has one; ``errors`` are theirs, in the metric
    of the arclength.
    """
    lam, alpha1 = np.array([(p.scalars.lam, p.scalars.alpha1) for p in points]).T
    slope = np.array([_slope(p.tail, p.rates) for p in points])
    at = np.array([any(p is kink for kink in kinks) for p in points], bool)
    bent = _changes([p.problem.phases for p in points]) & ~(at[:-1] | at[1:])
    return states_potential(BranchStates(beta0, alpha1, lam, slope, errors, at, bent))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SplinePotential(EffectivePotential):
    """The effective potential of splines through states."""

    states: BranchStates

    @cached_property
    def others(self) -> tuple[EffectivePotential, ...]:
        """The same through every second state, and through those between; kinks, T and ends in both."""
        states = self.states
        assert states.kinks is not None
        always = states.kinks | (states.alpha1 == 0.0)
        always[[0, -1]] = True
        odd = np.arange(len(always)) % 2 == 1
        return tuple(_through(states, np.flatnonzero(always | kept)) for kept in (odd, ~odd))

    @property
    def is_cut(self) -> bool:
        """A branch goes on where its states end, or where alpha1 turns back."""
        return True


def states_potential(states: BranchStates) -> SplinePotential:
    """Return the effective potential of states in order along a branch at one beta0."""
    known = _around_T(states)
    assert known.slope is not None
    values = len(known.alpha1)
    if values + np.isfinite(known.slope).sum() < _FEWEST:
        raise InvalidInput(
            f"{values - 1} points next to T are too few for a potential.", remedy="Trace with smaller steps."
        )
    return _through(known, np.arange(values))


def _through(states: BranchStates, rows: np.ndarray) -> SplinePotential:
    """Return the potential through some of the states around T."""
    x, y, slope, kinks, bent = states.alpha1, states.lam, states.slope, states.kinks, states.bent
    assert slope is not None and kinks is not None and bent is not None and states.error is not None  # noqa: PT018
    across = PI4 * np.hypot(1.0, y / PI4) + (1.0 + states.beta0) * np.abs(np.nan_to_num(slope))
    noise = float((states.error * across).max()) + 4.0 * np.finfo(float).eps * PI4
    cells = np.flatnonzero(np.logical_or.reduceat(bent, rows[:-1]))
    cut = np.unique([0, *np.flatnonzero(kinks[rows]), *cells, *(cells + 1), len(rows) - 1])
    pieces = []
    for a, b in pairwise(cut):
        make, first = (bend, max(a - 1, 0)) if a in cells else (spline, a)
        pieces.append(make(*(column[rows[first : b + 1]] for column in (x, y, slope))))
    curve = joined(pieces)
    return SplinePotential(
        states.beta0,
        uniform_series(1).leading[0],
        curve,
        curve.derivative(),
        moment(curve),
        (float(x[0]), float(x[-1])),
        kinks=tuple(float(piece.x[0]) for piece in pieces[1:]),
        noise=Polynomial([noise]),
        states=states,
    )


def _around_T(states: BranchStates) -> BranchStates:
    """Return states by ascending alpha1: those around T on which alpha1 is monotone, none crowding."""
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
    return BranchStates(states.beta0, x, y, slope, error, at_kink > 0.0, between)


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


def _slopes(branch: BranchLike) -> np.ndarray | None:
    """dlambda/dalpha1 along a branch that carries its solutions."""
    solutions = getattr(branch, "solutions", None)
    if solutions is None:
        return None
    return np.array([_slope(*pair) for pair in zip(solutions.scalars, solutions.rates, strict=True)])


def _slope(scalars: np.ndarray, rates: np.ndarray) -> float:
    turned = rate(lambda s: s.alpha1, scalars, rates)
    return rate(lambda s: s.lam, scalars, rates) / turned if turned else np.nan


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
