"""A picture as plain numbers and words, made from a result once and drawn by any pen.

Labels are written as Matplotlib sets them, mathematics between dollars; `peel_opt.plots.words.plain`
gives them to a pen that has none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

#: Least distance of the state from the edge, as a share of the picture.
_PAD = 0.06


@dataclass(frozen=True)
class Axis:
    """A label with its unit, the range to show, and whether it is logarithmic."""

    label: str
    low: float
    high: float
    log: bool = False


@dataclass(frozen=True)
class Line:
    """A polyline of one look.

    Parameters
    ----------
    look : str
        A key of `peel_opt.plots.style.STROKES`, or "family i/n" and "curve i/n" for the i-th of n.
    x, y : ndarray, shape (n,)
    label : str
        For the legend; empty if another line speaks for it.
    full : str
        What a legend with room says in place of the label.
    """

    look: str
    x: np.ndarray
    y: np.ndarray
    label: str = ""
    full: str = ""


@dataclass(frozen=True)
class Mark:
    """A named point.

    Parameters
    ----------
    look : str
        A key of `peel_opt.plots.style.MARKS`.
    x, y : float
    meaning : str
    letter : str
        Beside the point; empty for none.
    number : int
        Counts the points of a letter, from 1; 0 where there is one only.
    away : tuple of float
        Direction in which the letter stands, a unit vector on the paper.
    of : str
        Look of the line whose colour it takes; empty for its own.
    listed : bool
        Whether the legend explains it.
    """

    look: str
    x: float
    y: float
    meaning: str
    letter: str = ""
    number: int = 0
    away: tuple[float, float] = (0.7, 0.7)
    of: str = ""
    listed: bool = True

    @property
    def text(self) -> str:
        """The letter with its number."""
        return f"{self.letter}$_{self.number}$" if self.number else self.letter


@dataclass(frozen=True)
class Arrows:
    """Arrows from (x0, y0) to (x1, y1), all of shape (n,), in the coordinates of the axes."""

    look: str
    x0: np.ndarray
    y0: np.ndarray
    x1: np.ndarray
    y1: np.ndarray
    label: str
    full: str = ""


@dataclass(frozen=True)
class Ground:
    """The plate under a rod, and the height of the end of the bond.

    Parameters
    ----------
    stretch : float
        How many times the vertical scale is the horizontal one; 1 for the true shape.
    y0 : float or None
        In the coordinates of the axes; None where there is none.
    shows_y0 : bool
        Whether it is within the picture.
    ticks : tuple of float
        Lowest and highest height that is worth a tick.
    solid : tuple of ndarray or None
        Outline (x, y) of what lies behind a wall that is not flat.
    """

    stretch: float
    y0: float | None
    shows_y0: bool
    ticks: tuple[float, float]
    solid: tuple[np.ndarray, np.ndarray] | None = None


@dataclass(frozen=True)
class Panel:
    """A picture.

    Parameters
    ----------
    x, y : Axis
    lines : tuple of Line
        From the bottom to the top.
    marks : tuple of Mark
    arrows : tuple of Arrows
    title : str
    warnings : tuple of str
        What to beware of, above the picture.
    here : tuple of float or None
        Where the state is that a page shows in all its pictures.
    ground : Ground or None
        Under a rod, whose scales are tied to each other.
    """

    x: Axis
    y: Axis
    lines: tuple[Line, ...]
    marks: tuple[Mark, ...] = ()
    arrows: tuple[Arrows, ...] = ()
    title: str = ""
    warnings: tuple[str, ...] = ()
    here: tuple[float, float] | None = None
    ground: Ground | None = None

    def at(self, here: tuple[float, float] | None) -> Panel:
        """Return the picture with the state in it, and in view."""
        if here is None:
            return self
        axes = [
            Axis(axis.label, *_holding(axis, value))
            for axis, value in zip((self.x, self.y), here, strict=True)
        ]
        return replace(self, x=axes[0], y=axes[1], here=here)

    def distance(self, place: tuple[float, float]) -> float:
        """Return how far a place is from the lines, in shares of the picture."""
        scale = np.array([self.x.high - self.x.low, self.y.high - self.y.low])
        nearest = np.inf
        for line in self.lines:
            corners = (np.column_stack([line.x, line.y]) - place) / scale
            # What is not finite, such as beta0 = 0 over T0, is not drawn.
            corners = corners[np.isfinite(corners).all(axis=1)]
            start, along = corners[:-1], np.diff(corners, axis=0)
            size = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
            share = np.clip(-(start * along).sum(axis=1) / size, 0.0, 1.0)
            feet = np.hypot(*(start + share[:, None] * along).T)
            nearest = min(nearest, feet.min(initial=np.inf))
        return float(nearest)


def _holding(axis: Axis, value: float) -> tuple[float, float]:
    """The range of an axis, with a value well inside."""
    pad = _PAD * (axis.high - axis.low)
    return min(axis.low, value - pad), max(axis.high, value + pad)


def room(values: np.ndarray, share: float) -> tuple[float, float]:
    """Return the range of some values with room around it, a share of its size."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    pad = share * (high - low or 1.0)
    return low - pad, high + pad
