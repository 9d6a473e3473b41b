"""The measures of the picture of a rod: its frame, its vertical scale, the length of an arrow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .panels import Axis, Ground
from .words import AxisUnit

#: A picture flatter than this, height over width, gets a larger vertical scale ...
FLATTEST = 0.15
#: ... which makes it at most this high.
STRETCHED = 0.36

#: Length of the longest arrow and least depth of the plate, over the width of the picture.
ARROW_SHARE = 0.12
PLATE_SHARE = 0.035


@dataclass(frozen=True)
class Frame:
    """The measures of a picture, in the coordinates of its axes.

    Parameters
    ----------
    left, right : float
        The far end of the rod, and the end of the attached part drawn.
    lowest, height : float
        Of the rod.
    stretch : float
        How many times the vertical scale is the horizontal one.
    y0 : float or None
        None if there is none; ``shows_range`` tells if it lies within the frame.
    shows_range : bool
    """

    left: float
    right: float
    lowest: float
    height: float
    stretch: float
    y0: float | None
    shows_range: bool

    @property
    def width(self) -> float:
        """From left to right."""
        return self.right - self.left

    @property
    def arrow(self) -> float:
        """Length of the longest arrow, on the horizontal scale."""
        return ARROW_SHARE * self.width

    @property
    def ground(self) -> Ground:
        """The plate, and the range of the adhesion."""
        return Ground(self.stretch, self.y0, self.shows_range, (self.lowest, self.height))

    def axes(self, unit: AxisUnit, corners: np.ndarray) -> tuple[Axis, Axis]:
        """Return both axes, such that all ``corners``, (n, 2), are inside."""
        low, high = corners.min(axis=0), corners.max(axis=0)
        pad, depth = 0.03 * self.width, PLATE_SHARE * self.width / self.stretch
        bottom = min(-depth, low[1] - 0.5 * pad / self.stretch)
        top = max(high[1], self.height) + pad / self.stretch
        scale = f"\nvertical scale × {self.stretch:g}" if self.stretch != 1.0 else ""
        return (
            Axis(unit.axis("x"), float(min(low[0], self.left) - pad), float(self.right)),
            Axis(unit.axis("y") + scale, float(bottom), float(top)),
        )


def stage(x: np.ndarray, y: np.ndarray, y0: float | None) -> Frame:
    """Choose frame and vertical scale for shapes through the points (x, y)."""
    left, reach = float(x.min()), max(float(x.max()), 0.0)
    span = reach - left
    right = max(0.32 * span, reach + 0.12 * span)
    top = float(np.abs(y).max())
    shows_range = y0 is not None and y0 <= max(1.4 * top, min(4.0 * top, 0.3 * (right - left)))
    if shows_range and y0 is not None:
        top = max(top, y0)
    return Frame(left, right, min(float(y.min()), 0.0), top, _stretch(top / (right - left)), y0, shows_range)


def _stretch(flatness: float) -> float:
    """Return 1, or the largest of 2, 5, 10, 20 ... that does not make the picture too high."""
    if flatness >= FLATTEST or flatness == 0.0:
        return 1.0
    factor = STRETCHED / flatness
    decade = 10.0 ** math.floor(math.log10(factor))
    return max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= factor)
