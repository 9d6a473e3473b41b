"""The unknowns of a fit: three logarithms, the directions they may go in, the states that go with them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...model.rod import RATIOS, Rod
from .chart import ChartStates
from .pairs import GROUPS, scales

#: Largest change of a logarithm: no material number is looked for further than a factor 1e8 away.
FURTHEST = 18.4


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
