"""The four panels as plain numbers and words, free of any drawing library."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Axis:
    """A label with its unit, and the range to show."""

    label: str
    low: float
    high: float


@dataclass(frozen=True)
class Line:
    """A polyline of one look.

    Parameters
    ----------
    look : str
        Diagram: "stable", "unstable", "unknown" (stability not computed), "spurious", "straight",
        "straight-unstable".  Potential: "current", "fold", "maxwell", "delay".  Loop: "up", "down",
        "between" (not visited).  Rod: "rod", "beyond" (the law does not hold there).
    x, y : ndarray, shape (n,)
    label : str
        For the legend; empty if another line speaks for it.
    """

    look: str
    x: np.ndarray
    y: np.ndarray
    label: str = ""


@dataclass(frozen=True)
class Mark:
    """A named point: a letter at (x, y), and what it means in words.

    Looks are the kinds of special points, "fold", "maxwell" and "delay" in the potential, and for
    jumps "peels-up", "peels-down", "readheres-up" and "readheres-down", by where they point.
    """

    look: str
    letter: str
    x: float
    y: float
    meaning: str


@dataclass(frozen=True)
class Arrows:
    """Arrows from (x0, y0) to (x1, y1), all of shape (n,), in the coordinates of the axes."""

    look: str
    x0: np.ndarray
    y0: np.ndarray
    x1: np.ndarray
    y1: np.ndarray
    label: str


@dataclass(frozen=True)
class Spot:
    """A place on the diagram that can be picked: where it is drawn, and what it gives.

    Parameters
    ----------
    x, y : float
    value : float
        Given number: lambda, length or pressure.
    near : float
        The answer there, to pick the state by.
    label : str
    """

    x: float
    y: float
    value: float
    near: float
    label: str


@dataclass(frozen=True)
class RodPanel:
    """The rod in its true shape, in units of ``x.label``.

    Parameters
    ----------
    x, y : Axis
    stretch : float
        How many times the vertical scale is the horizontal one; 1 for the true shape.
    lines : tuple of Line
        "rod" where the law holds, "beyond" where it does not (y > y0 under the linear law).
    arrows : tuple of Arrows
        "pressure", "adhesion" and, where the linear law pushes, "repulsion".
    y0 : float or None
        Height of the end of the bond; None where there is none.
    shows_y0 : bool
        Whether it is within the picture.
    """

    x: Axis
    y: Axis
    stretch: float
    lines: tuple[Line, ...]
    arrows: tuple[Arrows, ...]
    y0: float | None
    shows_y0: bool


@dataclass(frozen=True)
class DiagramPanel:
    """The bifurcation diagram, its special points, and where the state is."""

    x: Axis
    y: Axis
    lines: tuple[Line, ...]
    marks: tuple[Mark, ...]
    spots: tuple[Spot, ...]
    here: tuple[float, float] | None
    stability: str  # which reading of it solid and dashed follow

    def nearest_spot(self, x: float, y: float) -> Spot | None:
        """The place of a branch nearest to a click, in shares of the picture; None far from all."""
        if not self.spots or not (math.isfinite(x) and math.isfinite(y)):
            return None
        width, height = self.x.high - self.x.low, self.y.high - self.y.low
        return min(self.spots, key=lambda s: math.hypot((s.x - x) / width, (s.y - y) / height))


@dataclass(frozen=True)
class PotentialPanel:
    """The effective potential (35) at the current lambda and at those of fold, Maxwell and delay.

    ``ball`` is where the state lies on it; None if there is none.
    """

    x: Axis
    y: Axis
    lines: tuple[Line, ...]
    marks: tuple[Mark, ...]
    ball: tuple[float, float] | None
    source: str


@dataclass(frozen=True)
class Frame:
    """One moment of the sweep: where it is on the loop, and the state (label, value, near)."""

    x: float
    y: float
    value: float
    near: float | None
    label: str


@dataclass(frozen=True)
class LoopPanel:
    """The hysteresis loop, its jumps, and the frames in which a sweep visits it."""

    x: Axis
    y: Axis
    lines: tuple[Line, ...]
    marks: tuple[Mark, ...]
    frames: tuple[Frame, ...]
    swept: str  # "lam" or "pressure"
    here: tuple[float, float] | None
    area: str
    note: str


@dataclass(frozen=True)
class Part:
    """What one part of the picture cost, and how far to trust it.

    ``error`` is the estimate in words, with what it is the error of; ``seconds`` the time of the
    computation, also where its result was remembered from before.
    """

    name: str
    method: str
    seconds: float
    error: str


@dataclass(frozen=True)
class AnswerText:
    """The answered state in numbers and words."""

    headline: str
    numbers: tuple[tuple[str, str], ...]
    label: str
    law: str
    certified: bool
    error: float
    certificate: float
