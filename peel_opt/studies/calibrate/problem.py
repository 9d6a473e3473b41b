"""A fit as nonlinear least squares in three logarithms at most: log k, log T0 and log y0.

Given the rod, every observation finds its own state: a pair its foot on the branch, a picture the tip angle
and the origin that suit its points best.  What is left is a function of the rod alone, whose gradient does
not see that the states move (they are at a minimum).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ...base.errors import NotConverged
from ...base.progress import progress
from ...model.rod import RATIOS, Rod
from .chart import Chart, ChartStates
from .covariance import LinearModel, Seen, cost, robust_rows
from .data import Observation
from .pairs import GROUPS, Pairs, scales
from .shapes import SeenShape, best_picture

if TYPE_CHECKING:
    from .scene_problem import SceneProblem

#: How far a foot is looked for on the expansion about a state, in A.
SPAN = 0.3

#: Largest change of a logarithm: no material number is looked for further than a factor 1e8 away.
FURTHEST = 18.4

#: Relative tolerance of the sum of losses and of the rod.
TOLERANCE = 1e-12


@dataclass(frozen=True, eq=False)
class Fitted:
    """Numbers of a rod and the states of all observations that go with them.

    Parameters
    ----------
    q : ndarray, shape (3,)
        Logarithms of k, T0 and y0 in SI units.
    states : ChartStates
        In the order of the observations.
    origins : ndarray, shape (n,)
        x of the detachment point of each [m].
    directions : ndarray, shape (free, m)
        In which the free logarithms were free to move.
    deviance : float
        Sum of the losses; chi-square with least squares.
    iterations : int
        Rods that were tried.
    """

    q: np.ndarray
    states: ChartStates
    origins: np.ndarray
    directions: np.ndarray
    deviance: float = math.nan
    iterations: int = 0

    @property
    def rod(self) -> Rod:
        """The rod with these numbers."""
        return Rod(*np.exp(self.q).tolist())

    @property
    def held(self) -> bool:
        """Whether a combination of the free numbers was kept as it was."""
        return self.directions.shape[1] < len(self.directions)


def coordinates(start: Fitted, free: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions of q and how far each may be followed from 1, which is the start.

    Where nothing is held, log r itself is a coordinate, so that its limits are bounds.
    """
    loose = np.flatnonzero(free)
    basis = np.zeros((3, start.directions.shape[1]))
    basis[loose] = start.directions
    count = basis.shape[1]
    low, high = np.full(count, 1.0 - FURTHEST), np.full(count, 1.0 + FURTHEST)
    by_r = GROUPS[2] @ basis
    if not count or start.held or not np.any(by_r):
        return basis, low, high
    pivot = int(np.argmax(np.abs(by_r)))
    basis[:, pivot] /= by_r[pivot]
    others = [j for j in range(count) if j != pivot]
    basis[:, others] -= np.outer(basis[:, pivot], by_r[others])
    log_r = scales(start.q)[1]
    low[pivot] = max(low[pivot], 1.0 + math.log(RATIOS[0]) - log_r)
    high[pivot] = min(high[pivot], 1.0 + math.log(RATIOS[1]) - log_r)
    return basis, np.minimum(low, 1.0 - 1e-9), np.maximum(high, 1.0 + 1e-9)


def _unwatched() -> None:
    """Nobody looks on."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A fit without its answer.

    Parameters
    ----------
    observations : sequence of Observation
    free : ndarray of bool, shape (3,)
    delta : float or None
        Scale of the pseudo-Huber loss; None for least squares.
    chart : Chart
    watch : callable
        Called at every rod that is tried, and at every state that is solved again.
    """

    observations: Sequence[Observation]
    free: np.ndarray
    delta: float | None
    chart: Chart
    watch: Callable[[], object] = field(default=_unwatched, repr=False)

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Which observations are pairs, and which are pictures."""
        shapes = np.array([o.points is not None for o in self.observations])
        return np.flatnonzero(~shapes), np.flatnonzero(shapes)

    # --- the observations at the states of one rod ----------------------------------------

    @cached_property
    def pairs(self) -> Pairs:
        """The pairs as arrays."""
        return Pairs.of([self.observations[i] for i in self.rows[0]])

    def picture(self, i: int, fitted: Fitted) -> SeenShape:
        """Return one picture at its state."""
        state = fitted.states.take(np.array([i]))
        scale, origin = scales(fitted.q)[0], float(fitted.origins[i])
        return SeenShape.at(self.observations[i], state, origin, scale, self.delta)

    def seen(self, fitted: Fitted) -> list[Seen]:
        """Return every observation at its state, in their order."""
        rows, shapes = self.rows
        found: dict[int, Seen] = {i: self.picture(i, fitted) for i in shapes}
        pairs = self.pairs.seen(fitted.states.take(rows), scales(fitted.q)[0])
        found |= dict(zip(rows, pairs, strict=True))
        return [found[i] for i in range(len(self.observations))]

    def linear_model(self, fitted: Fitted) -> LinearModel:
        """Return the fit to first order."""
        return LinearModel.of(self.seen(fitted), self.free, self.delta)

    # --- minimising ------------------------------------------------------------------------

    def minimised(self, start: Fitted) -> Fitted | None:
        """Minimise the loss over the rod in the directions that are free; None where it has no states."""
        from scipy.optimize import least_squares

        rows = self.rows[0]
        basis, low, high = coordinates(start, self.free)
        at, last = start, (np.array([math.nan]), np.empty(0), np.empty(0))
        # Solved states, about which the pairs look for their feet, and how many have none at the latest.
        solved = start.states.take(rows)
        solved = self.chart.at(solved, scales(start.q)[1], solved.A)
        if not np.all(np.isfinite(solved.numbers)):
            return None
        astray = 0

        def residuals(z: np.ndarray) -> np.ndarray:
            nonlocal at, last, solved, astray
            if np.array_equal(z, last[0]):
                return last[1]
            self.watch()
            q = start.q + basis @ (z - 1.0)
            _, log_r = scales(q)
            if not RATIOS[0] * (1.0 - 1e-9) <= math.exp(log_r) <= RATIOS[1] * (1.0 + 1e-9):
                return np.full(size, np.nan)
            # Solved at the feet on the expansions about the last states; the feet are found anew there.
            # Where no state is found, as beyond the contact, the expansion leads on in its place.
            near = self._feet(solved, q)
            exact = self.chart.at(solved, log_r, near.A, halvings=1)
            there = np.all(np.isfinite(exact.numbers), axis=1)
            found, lost = np.flatnonzero(there), np.flatnonzero(~there)
            solved = solved.put(found, exact.take(found))
            states = self._feet(exact.put(lost, near.take(lost)), q)
            here = self._with_pictures(replace(at, q=q, states=at.states.put(rows, states)))
            seen = self.seen(here)
            r = np.concatenate([one.r for one in seen])
            if np.all(np.isfinite(r)):
                by_q = np.vstack([one.projected(self.delta) for one in seen])
                at, last, astray = here, (z.copy(), r, by_q @ basis), len(lost)
            return r

        def jacobian(z: np.ndarray) -> np.ndarray:
            residuals(z)
            return last[2]

        size, begin = sum(len(o.measured) for o in self.observations), np.ones(basis.shape[1])
        first = residuals(begin)
        if not np.all(np.isfinite(first)):
            raise NotConverged("the rod to start from has no state like one of those observed.")
        if not basis.shape[1]:
            return replace(at, deviance=cost(first, self.delta), iterations=1)
        best = least_squares(
            residuals,
            begin,
            jacobian,
            bounds=(low, high),
            x_scale="jac",
            loss="linear" if self.delta is None else partial(robust_rows, delta=self.delta),
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=1e-15,
            max_nfev=200,
        )
        final = residuals(best.x)
        if astray:
            return None
        return replace(at, deviance=cost(final, self.delta), iterations=int(best.nfev))

    def _feet(self, states: ChartStates, q: np.ndarray) -> ChartStates:
        """Return the pairs at a rod nearby, at their feet on the expansions of some states."""
        scale, log_r = scales(q)
        A = self.pairs.feet(lambda A: states.expanded(A, log_r), states.A, scale, SPAN)
        return states.moved(A, log_r)

    def _with_pictures(self, near: Fitted) -> Fitted:
        """Return the pictures at the states and origins that suit them best."""
        states, origins, (scale, log_r) = near.states, near.origins.copy(), scales(near.q)
        for i in self.rows[1]:
            one = np.array([i])
            begin = states.take(one), float(origins[i])
            picture = best_picture(self.observations[i], self.chart, log_r, scale, begin, self.delta)
            states, origins[i] = states.put(one, picture.state), picture.origin
        return replace(near, states=states, origins=origins)


Watched = TypeVar("Watched", Problem, "SceneProblem")


@contextmanager
def watched(problem: Watched) -> Iterator[Watched]:
    """Return a problem whose steps are counted on a terminal from the first second on."""
    with progress("step of the calibration") as step:
        yield replace(problem, watch=step)
