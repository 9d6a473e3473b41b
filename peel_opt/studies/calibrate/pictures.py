"""A picture of the rod beside its states: the one that suits its numbers and points best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .chart import HIGHEST, Chart, ChartStates
from .data import Observation
from .linear import Seen, given_back, loss, squared
from .pairs import GROUPS, Pairs
from .shapes import misses

#: Steps towards the best state, and the step in standard deviations at which it is there.
MOST_STEPS, THERE = 40, 1e-8

#: Longest step in A.
LONGEST = 0.3


@dataclass(frozen=True, eq=False)
class SeenShape(Seen):
    """A picture at a state: what it misses in standard deviations, length and pressure first.

    Its own unknowns are A, and where it is free the origin in eta.

    Parameters
    ----------
    state : ChartStates
        Of length 1.
    origin : float
        x of the detachment point [m].
    cost : ndarray, shape (items,)
        Loss of the two numbers, then of every point.
    weight : ndarray, shape (items,)
        What the loss leaves of the weight of each.
    beyond_tip : int
        Points that have the tip itself as their foot.
    """

    state: ChartStates
    origin: float
    cost: np.ndarray
    weight: np.ndarray
    beyond_tip: int

    @classmethod
    def at(
        cls,
        observation: Observation,
        state: ChartStates,
        origin: float,
        scale: np.ndarray,
        hard: float,
        delta: float | None,
    ) -> SeenShape:
        """Compare a picture with a state of the rod that has this eta and T0, ``scale``."""
        numbers = Pairs.of([observation], hard).pulls(state, scale)
        points = misses(observation, state, float(scale[0]), origin)
        r = np.concatenate([numbers.r[0], points.r])
        by_q = np.vstack([numbers.by_q[0], points.by_groups @ GROUPS])
        # The origin in eta: both unknowns then are of the size of one.
        own = np.column_stack([numbers.by_own[0], [0.0, 0.0]])
        by_own = np.vstack([own, points.by_own * (1.0, scale[0])])[:, : 1 + observation.free_origin]
        cost, weight = loss(squared(r), delta)
        return cls(r, by_q, by_own, observation.measured, state, origin, cost, weight, points.beyond_tip)

    def _given_back(self, columns: np.ndarray) -> np.ndarray:
        root = np.sqrt(np.repeat(self.weight, 2))[:, None]
        return given_back(root * self.by_own, root * columns)

    @property
    def projected(self) -> np.ndarray:
        """Derivatives by q with the picture's own unknowns eliminated."""
        return self.by_q - self.by_own @ self._given_back(self.by_q)

    @property
    def step(self) -> np.ndarray:
        """Step of Gauss and Newton in the own unknowns."""
        return -self._given_back(self.r[:, None])[:, 0]


def best_picture(
    observation: Observation,
    chart: Chart,
    log_r: float,
    scale: np.ndarray,
    near: tuple[ChartStates, float],
    hard: float,
    delta: float | None,
) -> SeenShape:
    """Return a picture at the state and the origin that suit it best, from some nearby.

    Steps of Gauss and Newton, halved where they lead to something worse.
    """
    state, origin = near
    A, share, best = float(state.A[0]), 1.0, None
    for _ in range(MOST_STEPS):
        state = chart.at(state, log_r, np.array([A]))
        here = SeenShape.at(observation, state, origin, scale, hard, delta)
        if best is None or here.cost.sum() <= best.cost.sum():
            best, share = here, min(1.0, 2.0 * share)
        else:
            share *= 0.25
        step = best.step
        if not np.all(np.isfinite(best.cost)) or np.linalg.norm(best.by_own @ step) * share < THERE:
            break
        state, origin = best.state, best.origin
        A = min(max(float(state.A[0]) + float(np.clip(share * step[0], -LONGEST, LONGEST)), 0.0), HIGHEST)
        if observation.free_origin:
            origin += share * float(step[1] * scale[0])
    assert best is not None
    return best
