"""Rods shot from the clamped edge at a given pressure, and where they cross the height of the tip.

At the detachment point y = theta = theta' = 0, and with the height of the tip, which the pressure gives
by p y_tip = Phi(y_tip), N_x = p (y_tip - y) is known everywhere.  One number is left, the reaction
R = -N_y at the edge.  Units are eta and T0; s is measured from the edge.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np

from ..model.bond import Affine, CohesiveLaw
from ..model.law_arrays import traction_of

#: Runge-Kutta steps, as shares of the length on which the shape varies, and the most of them.
FINENESS, MOST_STEPS = 0.25, 4000

#: The first step, on the scale of the adhesive layer.
FIRST = 1e-3

#: Depth under the plate, in y0 or in depths of the tip, at which a rod is given up.
DEEPEST = 4.0

#: Rods are followed a little beyond the greatest length, so that crossings do not end at it.
MARGIN = 1.03

#: Halvings by which a crossing is located in a step.
HALVINGS = 40


@dataclass(frozen=True)
class EdgeShooting:
    """Rods clamped at the detachment point, under one law and pressure.

    Parameters
    ----------
    law : CohesiveLaw
    ratio : float
        eta/y0.
    P : float
        p/T0.
    tip : float
        y_tip/y0, one of `tip_heights`; zero where it is held to the plate.
    longest : float
        Greatest sbar/eta that is looked at.
    """

    law: CohesiveLaw
    ratio: float
    P: float
    tip: float
    longest: float

    @property
    def y_tip(self) -> float:
        """Height of the tip, over eta."""
        return self.tip / self.ratio

    @property
    def deepest(self) -> float:
        """Height, over eta, below which a rod is given up."""
        return -DEEPEST * max(1.0, -self.tip) / self.ratio

    @cached_property
    def greatest(self) -> float:
        """Bound of the reaction of a rod above the plate, the integral of tau - P cos(theta)."""
        return (float(self._tractions.max()) + abs(self.P)) * self.longest

    @cached_property
    def rate(self) -> float:
        """Rate at which shapes vary in the adhesive layer, times eta."""
        slopes = np.diff(self._tractions) / np.diff(self._heights)
        return float(max(self.ratio * np.abs(slopes).max(), 1e-3) ** 0.25)

    @cached_property
    def layer(self) -> float:
        """Height, over eta, above which the traction does not vary."""
        last = self.law.pieces[-1]
        ends = isinstance(last.drop, Affine) and not last.drop.slope
        return max(last.start, 0.0) / self.ratio if ends else math.inf

    @property
    def _heights(self) -> np.ndarray:
        return np.linspace(0.0, 2.0 * max(self.law.kinks, default=2.0), 101)

    @cached_property
    def _tractions(self) -> np.ndarray:
        return traction_of(self.law, 101)(self._heights)

    def slopes(self, z: np.ndarray, tau: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """(12) for (s, theta, theta', N_y, y), shape (5, n), in the pace at which the shape varies."""
        s, theta, turn, ny, y = z
        sine, cosine = np.sin(theta), np.cos(theta)
        nx = self.P * (self.y_tip - y)
        outside = np.maximum(y - self.layer, 0.0)
        pace = np.abs(turn) + np.sqrt(np.hypot(nx, ny)) + self.rate / (1.0 + self.rate * outside)
        pace += 1.0 / (s + FIRST / self.rate)
        slopes = np.empty_like(z)
        slopes[0], slopes[1], slopes[2] = 1.0, -turn, nx * sine - ny * cosine
        slopes[3], slopes[4] = tau(self.ratio * y) - self.P * cosine, -sine
        going = (s < MARGIN * self.longest) & (y > self.deepest)
        return slopes * (FINENESS * going / pace)

    def rods(self, reactions: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield (s, theta, theta', N_y, y) of rods, shape (5, n), and their slopes, step by step."""
        z, tau = np.zeros((5, len(reactions))), traction_of(self.law, len(reactions))
        z[3] = -reactions
        k1 = self.slopes(z, tau)
        yield z, k1
        for _ in range(MOST_STEPS):
            if not k1[0].any():
                break
            k2 = self.slopes(z + 0.5 * k1, tau)
            k3 = self.slopes(z + 0.5 * k2, tau)
            k4 = self.slopes(z + k3, tau)
            z = z + (k1 + 2.0 * (k2 + k3) + k4) / 6.0
            k1 = self.slopes(z, tau)
            yield z, k1

    def crossings(self, reactions: np.ndarray) -> Crossings:
        """Follow rods up to the greatest length and tell where they cross the height of the tip."""
        # The height of a tip on the plate is that of the edge, so that the first step is left out.
        steps = islice(self.rods(reactions), 1, None)
        z, slopes = next(steps)
        met = [(np.empty(0, dtype=int), *np.empty((4, 5, 0)))]
        for after, slopes_after in steps:
            rod = np.flatnonzero((z[4] < self.y_tip) != (after[4] < self.y_tip))
            if rod.size:
                met.append((rod, z[:, rod], after[:, rod], slopes[:, rod], slopes_after[:, rod]))
            z, slopes = after, slopes_after
        rod, *ends = (np.concatenate(parts, axis=-1) for parts in zip(*met, strict=True))
        s, theta, turn, ny, _ = self._at_tip(*ends)
        order = np.argsort(rod, kind="stable")
        count = np.bincount(rod, minlength=len(reactions))
        number = np.empty_like(rod)
        number[order] = np.arange(len(rod)) - np.repeat(np.cumsum(count) - count, count)
        table = np.full((3, len(reactions), int(count.max(initial=0))), np.nan, dtype=complex)
        w = np.abs(ny) - np.abs(np.sin(theta)) + 1j * math.sqrt(2.0) * turn
        table[:, rod, number] = s, theta, w / np.maximum(np.abs(w), 1e-300)
        return Crossings(reactions, table[0].real, table[1].real, table[2], z[0], z[4] <= self.deepest)

    def _at_tip(self, z0: np.ndarray, z1: np.ndarray, f0: np.ndarray, f1: np.ndarray) -> np.ndarray:
        """States at the height of the tip, on the cubics through the ends of steps; shape (5, n)."""

        def at(x: np.ndarray) -> np.ndarray:
            first = (1.0 - x) ** 2 * ((1.0 + 2.0 * x) * z0 + x * f0)
            return first + x**2 * ((3.0 - 2.0 * x) * z1 - (1.0 - x) * f1)

        low, high = np.zeros(z0.shape[1]), np.ones(z0.shape[1])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            before = (at(middle)[4] < self.y_tip) == (z0[4] < self.y_tip)
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return at(0.5 * (low + high))


@dataclass(frozen=True)
class Crossings:
    """Where rods cross the height of the tip, in the order of their reactions.

    Parameters
    ----------
    reactions : ndarray, shape (n,)
    s, theta : ndarray, shape (n, k)
        Of the k-th crossing; NaN where a rod has fewer.
    w : ndarray of complex, shape (n, k)
        |N_y| - |sin(theta)| + i sqrt(2) theta', over its modulus |N_y| + |sin(theta)|.
    ends : ndarray, shape (n,)
        s up to which the rod was followed.
    given_up : ndarray of bool, shape (n,)
        Whether that is because it is far under the plate.
    """

    reactions: np.ndarray
    s: np.ndarray
    theta: np.ndarray
    w: np.ndarray
    ends: np.ndarray
    given_up: np.ndarray

    def with_others(self, other: Crossings) -> Crossings:
        """Both, in the order of reactions."""
        order = np.argsort(np.concatenate([self.reactions, other.reactions]))
        width = max(self.s.shape[1], other.s.shape[1])

        def padded(values: np.ndarray) -> np.ndarray:
            if values.ndim == 1:
                return values
            return np.pad(values, ((0, 0), (0, width - values.shape[1])), constant_values=np.nan)

        return Crossings(
            *(
                np.concatenate([padded(a), padded(b)])[order]
                for a, b in zip(vars(self).values(), vars(other).values(), strict=True)
            )
        )
