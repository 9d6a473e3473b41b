"""Pairs of length and pressure beside the branch of a rod: the nearest state of each, and how far.

Given the rod, what a pair leaves open is its place on the branch, one tip angle.  It is the foot of the
pair on the curve (sbar, p), in standard deviations, for any loss that grows with the distance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...model.labels import fits
from ...model.rod import MATERIAL, Rod
from .chart import HIGHEST, ChartStates
from .data import Observation
from .polyline import nearest

#: d(log eta, log T0, log r)/d(log k, log T0, log y0).
GROUPS = np.array([[1.0, -1.0, 0.0], [0.0, 3.0, 0.0], [1.0, -1.0, -3.0]]) / 3.0

#: Weight of an exact number: one over the standard deviation it is given, relative.
HARD, SOFT = 1e7, 50.0

#: Straight lines by which a piece of the curve between two solved states is looked through.
LINES = 8

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
    """

    values: np.ndarray
    sds: np.ndarray
    states: tuple[str | None, ...]

    @classmethod
    def of(cls, observations: Sequence[Observation], hard: float = HARD) -> Pairs:
        """Return the numbers of observations; an unknown one costs nothing, an exact one ``1/hard``."""
        values, sds = np.ones((len(observations), 2)), np.full((len(observations), 2), np.inf)
        for i, observation in enumerate(observations):
            for j, name in enumerate(("length", "pressure")):
                value, sd = getattr(observation, name), getattr(observation, f"{name}_sd")
                if value is not None:
                    values[i, j] = value
                    sds[i, j] = value / hard if sd is None else sd
        return cls(values, sds, tuple(o.state for o in observations))

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

    def pulls(self, states: ChartStates, scale: np.ndarray) -> Pulls:
        """Return the residuals of the states expanded at their feet, with derivatives."""
        unit = scale / self.sds
        along = states.by_A * unit
        r = self.residuals(states.numbers, scale)
        by_groups = np.zeros((len(self), 2, 3))
        by_groups[:, 0, 0], by_groups[:, 1, 1] = (states.numbers * unit).T
        by_groups[:, :, 2] = states.by_r * unit
        # No state lies beyond T: one that is held there has no place of its own.
        held = (states.A <= 0.0) & ((r * along).sum(axis=1) >= 0.0)
        return Pulls(r, by_groups @ GROUPS, np.where(held[:, None], 0.0, along), held)


@dataclass(frozen=True, eq=False)
class Pulls:
    """Residuals of pairs and their derivatives by (log k, log T0, log y0) and by the pair's own A.

    Parameters
    ----------
    r : ndarray, shape (n, 2)
    by_q : ndarray, shape (n, 2, 3)
    by_own : ndarray, shape (n, 2)
        Zero where the state is held at T.
    at_T : ndarray of bool, shape (n,)
    """

    r: np.ndarray
    by_q: np.ndarray
    by_own: np.ndarray
    at_T: np.ndarray

    @cached_property
    def projected(self) -> np.ndarray:
        """Derivatives by q with the pair's own place eliminated, shape (n, 2, 3)."""
        square = (self.by_own**2).sum(axis=1)
        share = np.einsum("ij,ijk->ik", self.by_own, self.by_q) / np.where(square > 0.0, square, 1.0)[:, None]
        return self.by_q - self.by_own[:, :, None] * share[:, None]


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
