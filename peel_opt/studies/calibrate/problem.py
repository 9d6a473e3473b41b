"""A fit as nonlinear least squares in three logarithms at most: log k, log T0 and log y0.

Given the rod, every observation finds its own state: a pair its foot on the branch, a picture the tip angle
and the origin that suit its points best.  What is left is a function of the rod alone, whose gradient does
not see that the states move (they are at a minimum).  It is minimised twice: first along the whole curve of
each rod tried, so that no state can be missed, then with the exact states of each rod tried, from those of
the last.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...base.errors import NotConverged
from ...base.progress import progress
from ...model.rod import RATIOS
from .chart import Chart, ChartStates
from .data import Observation
from .fitted import Fitted, coordinates
from .linear import LinearModel, Seen, loss, squared
from .pairs import HARD, SOFT, BranchSpline, Pairs, Pulls, scales
from .pictures import SeenShape, best_picture

#: How far a foot is looked for on the expansion about a state, in A.
SPAN = 0.3


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

    @property
    def _size(self) -> int:
        """Number of residuals."""
        return sum(len(o.measured) for o in self.observations)

    # --- the states of one rod ------------------------------------------------------------

    def pairs(self, hard: float = HARD) -> Pairs:
        """Return the pairs as arrays, exact numbers with this weight."""
        return Pairs.of([self.observations[i] for i in self.rows[0]], hard)

    def picture(self, i: int, fitted: Fitted, hard: float = HARD) -> SeenShape:
        """Return one picture at its state."""
        state = fitted.states.take(np.array([i]))
        scale, origin = scales(fitted.q)[0], float(fitted.origins[i])
        return SeenShape.at(self.observations[i], state, origin, scale, hard, self.delta)

    def seen(self, fitted: Fitted) -> list[Seen]:
        """Return every observation at its state, in their order."""
        rows, shapes = self.rows
        found: dict[int, Seen] = {i: self.picture(i, fitted) for i in shapes}
        pulls = self.pairs().pulls(fitted.states.take(rows), scales(fitted.q)[0])
        for place, i in enumerate(rows):
            own, measured = pulls.by_own[place][:, None], self.observations[i].measured
            found[i] = Seen(pulls.r[place], pulls.by_q[place], own, measured)
        return [found[i] for i in range(len(self.observations))]

    def at_T(self, fitted: Fitted) -> np.ndarray:
        """Which observations are pairs whose state is held at T."""
        held = np.zeros(len(self.observations), bool)
        rows, scale = self.rows[0], scales(fitted.q)[0]
        held[rows] = self.pairs().pulls(fitted.states.take(rows), scale).at_T
        return held

    def linear_model(self, fitted: Fitted) -> LinearModel:
        """Return the fit to first order."""
        return LinearModel.of(self.seen(fitted), self.free, self.delta)

    # --- minimising ------------------------------------------------------------------------

    def along_curves(
        self, start: Fitted, nodes: ChartStates, hard: float = SOFT
    ) -> tuple[Fitted, ChartStates]:
        """Minimise over rods whose whole curve is followed; also return the nodes of the last.

        Good to what interpolation between the nodes is good to, and exact numbers are soft.
        """
        rows, pairs = self.rows[0], self.pairs(hard)

        def evaluate(q: np.ndarray) -> tuple[Pulls, ChartStates]:
            nonlocal nodes
            scale, log_r = scales(q)
            if not len(rows):
                return pairs.pulls(start.states.take(rows), scale), start.states.take(rows)
            nodes = self.chart.at(nodes, log_r, nodes.A, halvings=1)
            curve = BranchSpline.through(nodes)
            if len(curve.nodes) < 2:  # nothing of the last curve leads to this rod
                nowhere = start.states.take(rows)
                nowhere = nowhere.lost(nowhere.A, log_r)
                return pairs.pulls(nowhere, scale), nowhere
            A, _ = curve.nearest(pairs, scale)
            known = np.where(np.isfinite(A), A, 0.0)
            known = pairs.feet(curve.expand, known, scale)
            states = curve.states(known)
            pulls = pairs.pulls(states, scale)
            pulls.r[~np.isfinite(A)] = np.nan
            return pulls, states

        found = self._descend(start, evaluate, hard, tol=1e-6)
        if not len(rows):
            return found, nodes
        states = found.states.take(rows)
        exact = self.chart.at(BranchSpline.through(nodes).beside(states.A), scales(found.q)[1], states.A)
        return replace(found, states=found.states.put(rows, exact)), nodes

    def exactly(self, start: Fitted) -> Fitted | None:
        """Minimise from states nearby over exact ones; None where there are none."""
        latest = start.states.take(self.rows[0])
        latest = self.chart.at(latest, scales(start.q)[1], latest.A)
        if not np.all(np.isfinite(latest.numbers)):
            return None

        def evaluate(q: np.ndarray) -> tuple[Pulls, ChartStates]:
            """Solve for states at the feet on expansions about the latest ones; find the feet anew there."""
            nonlocal latest
            _, near = self._expanded(latest, q)
            exact = self.chart.at(latest, scales(q)[1], near.A)
            if np.all(np.isfinite(exact.numbers)):
                latest = exact
            return self._expanded(exact, q)

        return self._descend(start, evaluate, HARD, tol=1e-12)

    def _expanded(self, states: ChartStates, q: np.ndarray) -> tuple[Pulls, ChartStates]:
        """Return the pairs at a rod nearby, their feet on the expansions of some states."""
        pairs, (scale, log_r) = self.pairs(), scales(q)
        A = pairs.feet(lambda A: states.expanded(A, log_r), states.A, scale, SPAN)
        there = states.moved(A, log_r)
        return pairs.pulls(there, scale), there

    def _descend(
        self,
        start: Fitted,
        evaluate: Callable[[np.ndarray], tuple[Pulls, ChartStates]],
        hard: float,
        tol: float,
    ) -> Fitted:
        """Minimise the loss over the rod in the directions that are free."""
        from scipy.optimize import least_squares

        basis, low, high = coordinates(start, self.free)
        rows, shapes = self.rows
        at, last = start, (np.array([math.nan]), np.empty(0), np.empty(0))

        def residuals(z: np.ndarray) -> np.ndarray:
            nonlocal at, last
            if np.array_equal(z, last[0]):
                return last[1]
            self.watch()
            q = start.q + basis @ (z - 1.0)
            r, by_q = [np.full(self._size, np.nan)], []
            if RATIOS[0] * (1.0 - 1e-9) <= math.exp(scales(q)[1]) <= RATIOS[1] * (1.0 + 1e-9):
                pulls, states = evaluate(q)
                r, by_q = [pulls.r.ravel()], [pulls.projected.reshape(-1, 3)]
                here = replace(at, q=q, states=at.states.put(rows, states))
                for i in shapes:
                    one, (scale, log_r) = np.array([i]), scales(q)
                    near = here.states.take(one), float(here.origins[i])
                    seen = self.observations[i]
                    picture = best_picture(seen, self.chart, log_r, scale, near, hard, self.delta)
                    origins = here.origins.copy()
                    origins[i] = picture.origin
                    here = replace(here, states=here.states.put(one, picture.state), origins=origins)
                    r.append(picture.r)
                    by_q.append(picture.projected)
                if np.all(np.isfinite(np.concatenate(r))):
                    at, last = here, (z.copy(), np.concatenate(r), np.vstack(by_q) @ basis)
            return np.concatenate(r)

        def jacobian(z: np.ndarray) -> np.ndarray:
            residuals(z)
            return last[2]

        begin = np.ones(basis.shape[1])
        first = residuals(begin)
        if not np.all(np.isfinite(first)):
            raise NotConverged("the rod to start from has no state like one of those observed.")
        if not basis.shape[1]:
            return replace(at, deviance=self._cost(first), iterations=1)
        solved = least_squares(
            residuals,
            begin,
            jacobian,
            bounds=(low, high),
            x_scale="jac",
            loss="linear" if self.delta is None else self._robust,
            ftol=tol,
            xtol=tol,
            gtol=1e-15,
            max_nfev=200,
        )
        final = residuals(solved.x)
        return replace(at, deviance=self._cost(final), iterations=int(solved.nfev))

    def _cost(self, r: np.ndarray) -> float:
        return float(loss(squared(r), self.delta)[0].sum())

    def _robust(self, squares: np.ndarray) -> np.ndarray:
        """Loss of each row and its derivatives, where what counts is the sum over the two rows of an item."""
        assert self.delta is not None
        cost, weight = np.repeat(loss(squares.reshape(-1, 2).sum(axis=1), self.delta), 2, axis=1)
        return np.stack([0.5 * cost, weight, -0.5 * weight**3 / self.delta**2])


@contextmanager
def watched(problem: Problem) -> Iterator[Problem]:
    """Return a problem whose steps are counted on a terminal from the first second on."""
    with progress("step of the calibration") as step:
        yield replace(problem, watch=step)
