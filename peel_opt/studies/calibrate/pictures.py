"""A picture of the rod beside its states: the one that suits its numbers and points best."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .chart import HIGHEST, Chart, ChartStates
from .data import Observation
from .linear import Seen, pseudo_huber
from .pairs import GROUPS, Pairs
from .shapes import misses

#: Steps towards the best state, and the step in standard deviations at which it is there.
MOST_STEPS, THERE = 40, 1e-8

#: Longest step in A.
LONGEST = 0.3


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture at a state: what it misses in standard deviations, length and pressure first.

    Parameters
    ----------
    state : ChartStates
        Of length 1.
    origin : float
        x of the detachment point [m].
    r, items : ndarray, shape (rows,)
        Residuals, and the item each belongs to: the two numbers, then every point.
    by_q : ndarray, shape (rows, 3)
    by_own : ndarray, shape (rows, own)
        By A, and by the origin in eta where it is free.
    weights : ndarray, shape (rows,)
        What the loss leaves of each row.
    cost : float
        Sum of the losses.
    beyond_tip : int
        Points that have the tip itself as their foot.
    """

    state: ChartStates
    origin: float
    r: np.ndarray
    items: np.ndarray
    by_q: np.ndarray
    by_own: np.ndarray
    weights: np.ndarray
    cost: float
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
    ) -> Picture:
        """Compare a picture with a state of the rod that has this eta and T0, ``scale``."""
        assert observation.points is not None
        numbers = Pairs.of([observation], hard).pulls(state, scale)
        points = misses(observation, state, float(scale[0]), origin)
        r = np.concatenate([numbers.r[0], points.r])
        items = np.concatenate([[0, 0], 1 + np.repeat(np.arange(len(observation.points)), 2)])
        by_q = np.vstack([numbers.by_q[0], points.by_groups @ GROUPS])
        # The origin in eta: both unknowns then are of the size of one.
        by_own = np.zeros((len(r), 1 + observation.free_origin))
        by_own[:2, 0], by_own[2:, 0] = numbers.by_own[0], points.by_own[:, 0]
        by_own[2:, 1:] = points.by_own[:, 1:] * scale[0]
        if not observation.free_origin:
            by_own = by_own[:, :1]
        squares = np.bincount(items, r**2)
        loss, weight = (squares, np.ones_like(squares)) if delta is None else pseudo_huber(squares, delta)
        cost = float(loss.sum())
        return cls(state, origin, r, items, by_q, by_own, weight[items], cost, points.beyond_tip)

    def _by(self, columns: np.ndarray) -> np.ndarray:
        """What own unknowns give back when all rows move along some columns, shape (own, columns)."""
        root = np.sqrt(self.weights)[:, None]
        sizes = np.linalg.norm(root * self.by_own, axis=0)
        sizes[sizes == 0.0] = 1.0
        return np.linalg.lstsq(root * self.by_own / sizes, root * columns, rcond=1e-12)[0] / sizes[:, None]

    @property
    def projected(self) -> np.ndarray:
        """Derivatives by q with the picture's own unknowns eliminated."""
        return self.by_q - self.by_own @ self._by(self.by_q)

    @property
    def step(self) -> np.ndarray:
        """Step of Gauss and Newton in the own unknowns."""
        return -self._by(self.r[:, None])[:, 0]

    def seen(self, measured: np.ndarray) -> Seen:
        """Return it as one of several observations; ``measured`` says which of its numbers were."""
        points = np.ones(len(self.r) - 2, bool)
        return Seen(self.r, self.by_q, self.by_own, self.items, np.concatenate([measured, points]))


def best_picture(
    observation: Observation,
    chart: Chart,
    log_r: float,
    scale: np.ndarray,
    near: tuple[ChartStates, float],
    hard: float,
    delta: float | None,
) -> Picture:
    """Return a picture at the state and the origin that suit it best, from some nearby.

    Steps of Gauss and Newton, halved where they lead to something worse.
    """
    state, origin = near
    A, share, best = float(state.A[0]), 1.0, None
    for _ in range(MOST_STEPS):
        state = chart.at(state, log_r, np.array([A]))
        here = Picture.at(observation, state, origin, scale, hard, delta)
        if best is None or here.cost <= best.cost:
            best, share = here, min(1.0, 2.0 * share)
        else:
            share *= 0.25
        step = best.step
        if not math.isfinite(best.cost) or np.linalg.norm(best.by_own @ step) * share < THERE:
            break
        state, origin = best.state, best.origin
        A = min(max(float(state.A[0]) + float(np.clip(share * step[0], -LONGEST, LONGEST)), 0.0), HIGHEST)
        if observation.free_origin:
            origin += share * float(step[1] * scale[0])
    assert best is not None
    return best
