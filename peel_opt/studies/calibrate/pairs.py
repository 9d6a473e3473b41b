"""Pairs of length and pressure beside the branch of a rod: the nearest state of each, and how far.

Given the rod, what a pair leaves open is its place on the branch, one tip angle.  It is the foot of the
pair on the curve (sbar, p), in standard deviations, for any loss that grows with the distance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...model.dimension import LENGTH, RATIO_POWERS, TRACTION
from ...model.rod import MATERIAL, Rod
from .chart import HIGHEST, ChartStates
from .covariance import Seen
from .data import Observation

#: d(log eta, log T0, log r)/d(log k, log T0, log y0).
GROUPS = np.stack([LENGTH.powers, TRACTION.powers, RATIO_POWERS])

#: Relative standard deviation that stands for none: exact numbers are met to that.
EXACT = 1e-7

#: Steps of Newton's method towards a foot, its longest step in A, and the one that ends it.
MOST_STEPS, LONGEST, SHORT = 40, 0.3, 1e-13

#: sbar/eta and p/T0 at some tip angles with their derivatives, each of shape (n, 2).
Expansion = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


def scales(q: np.ndarray) -> tuple[np.ndarray, float]:
    """Return (eta, T0) in SI units and log r of a rod's logarithms."""
    log_eta, log_T0, log_r = GROUPS @ q
    return np.exp([log_eta, log_T0]), float(log_r)


def logarithms(rod: Rod) -> np.ndarray:
    """Return log k, log T0 and log y0."""
    return np.log([getattr(rod, name) for name in MATERIAL])


@dataclass(frozen=True, eq=False)
class Pairs:
    """Measured lengths and pressures as arrays of shape (n, 2), in SI units.

    Parameters
    ----------
    values, sds : ndarray
    states : tuple of str
    measured : tuple of ndarray of bool, shape (2,)
        What was neither given exactly nor unknown; all of it if nothing is said.
    """

    values: np.ndarray
    sds: np.ndarray
    states: tuple[str | None, ...]
    measured: tuple[np.ndarray, ...] = ()

    @classmethod
    def of(cls, observations: Sequence[Observation]) -> Pairs:
        """Return the numbers of observations; an unknown one costs nothing, an exact one may not move."""
        values, sds = np.ones((len(observations), 2)), np.full((len(observations), 2), np.inf)
        for i, observation in enumerate(observations):
            for j, name in enumerate(("length", "pressure")):
                value, sd = getattr(observation, name), getattr(observation, f"{name}_sd")
                if value is not None:
                    values[i, j] = value
                    sds[i, j] = EXACT * value if sd is None else sd
        measured = tuple(o.measured[:2] for o in observations)
        return cls(values, sds, tuple(o.state for o in observations), measured)

    def __len__(self) -> int:
        return len(self.values)

    def residuals(self, numbers: np.ndarray, scale: np.ndarray) -> np.ndarray:
        """Fitted less measured, in standard deviations."""
        return (numbers * scale - self.values) / self.sds

    def feet(self, at: Expansion, A: np.ndarray, scale: np.ndarray, furthest: float = HIGHEST) -> np.ndarray:
        """Return the tip angles of the nearest states, from some nearby and at most ``furthest`` from them.

        Newton's method for the derivative of the squared distance, every pair by itself; a step that
        leads further away is cut.
        """
        low, high = np.maximum(A - furthest, 0.0), np.minimum(A + furthest, HIGHEST)
        reach, unit = np.full(len(A), LONGEST), scale / self.sds
        expanded = at(A)
        r = self.residuals(expanded[0], scale)
        for _ in range(MOST_STEPS):
            along, bend = expanded[1] * unit, expanded[2] * unit
            slope, square = (r * along).sum(axis=1), (along**2).sum(axis=1)
            curve = square + (r * bend).sum(axis=1)
            step = np.clip(-slope / np.where(curve > 0.0, curve, square), -reach, reach)
            trial = np.clip(A + step, low, high)
            if not np.any(np.abs(trial - A) > SHORT):
                break
            there = at(trial)
            gap = self.residuals(there[0], scale)
            better = (gap**2).sum(axis=1) <= (r**2).sum(axis=1)
            A, r = np.where(better, trial, A), np.where(better[:, None], gap, r)
            a, b, c = (np.where(better[:, None], *both) for both in zip(there, expanded, strict=True))
            expanded = a, b, c
            reach = np.where(better, LONGEST, 0.25 * np.abs(step))
        return A

    def seen(self, states: ChartStates, scale: np.ndarray) -> list[Seen]:
        """Return the residuals of the pairs at their states, with derivatives; A is a pair's own unknown."""
        unit = scale / self.sds
        along = states.by_A * unit
        r = self.residuals(states.numbers, scale)
        by_groups = np.zeros((len(self), 2, 3))
        by_groups[:, 0, 0], by_groups[:, 1, 1] = (states.numbers * unit).T
        by_groups[:, :, 2] = states.by_r * unit
        # No state lies beyond T: one that is held there has no place of its own.
        held = (states.A <= 0.0) & ((r * along).sum(axis=1) >= 0.0)
        own = np.where(held[:, None], 0.0, along)[:, :, None]
        measured = self.measured or (np.ones(2, bool),) * len(self)
        return list(map(Seen, r, by_groups @ GROUPS, own, measured, held))
