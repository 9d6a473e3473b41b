"""The wall of a moving rod: a circle that passes along +x through where the tip lay, or a plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class Above(NamedTuple):
    """Where places are above a wall.

    Parameters
    ----------
    gap : ndarray
        Distance from the wall, over eta.
    nx, ny : ndarray
        Normal of the wall at the nearest point, away from it.
    turning : ndarray
        Angle by which the normal turns as a place moves along the wall by 1.
    """

    gap: np.ndarray
    nx: np.ndarray
    ny: np.ndarray
    turning: np.ndarray


@dataclass(frozen=True)
class Arc:
    """A wall by its curvature, times eta: negative where the rod lies outside."""

    curvature: float

    def __bool__(self) -> bool:
        return self.curvature != 0.0

    def at(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the places x, y of the wall at arc lengths from where the tip lay."""
        kw = self.curvature
        if not kw:
            return s, np.zeros_like(s)
        return np.sin(kw * s) / kw, 2.0 * np.sin(0.5 * kw * s) ** 2 / kw

    def normal(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return x and y of the normal of the wall at these places along it."""
        if not self.curvature:
            return np.zeros_like(s), np.ones_like(s)
        return -np.sin(self.curvature * s), np.cos(self.curvature * s)

    def carried(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return x and y of how places move with a wall that slides along itself by 1: e_x on a plate."""
        return 1.0 - self.curvature * y, self.curvature * x

    def above(self, x: np.ndarray, y: np.ndarray) -> Above:
        """Return where places are above the wall, without cancellation as its curvature vanishes."""
        kw = self.curvature
        if not kw:
            return Above(y, np.zeros_like(y), np.ones_like(y), np.zeros_like(y))
        excess = 2.0 * y - kw * (x * x + y * y)
        away = np.sqrt(1.0 - kw * excess)
        return Above(excess / (1.0 + away), -kw * x / away, (1.0 - kw * y) / away, kw / away)

    def angle(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the direction of the wall at the point nearest to places."""
        kw = self.curvature
        angle: np.ndarray = np.arctan2(kw * x, 1.0 - kw * y)
        return angle

    def place(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the arc length of the wall from where the tip lay to the point nearest to places."""
        return self.angle(x, y) / self.curvature if self.curvature else x
