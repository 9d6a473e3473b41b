"""Looks: colours that survive colour blindness and grey printing, widths, dashes and markers.

Both pens take theirs from here; lengths are in points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np

#: Okabe and Ito's palette, by what it is used for.
ROD = "#000000"
PRESSURE = "#D55E00"
ADHESION = "#0072B2"
RANGE = "#009E73"
WARNING = "#A3327C"  # their reddish purple, darkened so that text in it can be read on white
HERE = "#E69F00"  # the state, in every panel of a page
EQUAL = "#8C510A"  # where two minima are equally deep
SKY = "#56B4E9"
ROSE = "#CC79A7"
PLATE = "#9A9A9A"
SPURIOUS = "#A8A8A8"
STRAIGHT = "#6E6E6E"

#: Sequential, of monotone lightness; its last, pale part is left out.
FAMILY_COLOURMAP = "viridis"
FAMILY_RANGE = (0.0, 0.82)

ROD_WIDTH = 2.4
SMALL = 9.0  # font size of titles and legends

#: Width and head of an arrow; in widths of the axes, so that small panels have small heads.
ARROW: dict[str, Any] = {
    "units": "width",
    "width": 0.0030,
    "headwidth": 4.5,
    "headlength": 6.0,
    "headaxislength": 5.2,
}

#: Dashes: lengths of ink and gap; none for a solid line.
Dash = tuple[float, ...]

DASHED: Dash = (7.2, 3.3)


@dataclass(frozen=True)
class Stroke:
    """How lines, or arrows, of one look are drawn.

    Parameters
    ----------
    colour : str
    width : float
    dash : tuple of float
    dots : {"", "open", "full"}
        On paper, every point of the line, where these are states that were visited.
    hollow : bool
        Of arrows.
    """

    colour: str
    width: float = 1.5
    dash: Dash = ()
    dots: str = ""
    hollow: bool = False


STROKES: dict[str, Stroke] = {
    "rod": Stroke(ROD, ROD_WIDTH),
    "attached": Stroke(ROD, ROD_WIDTH),
    "rod-beyond-y0": Stroke(ROD, ROD_WIDTH, (5.3, 2.6)),
    "pressure": Stroke(PRESSURE, 1.2),
    "adhesion": Stroke(ADHESION, 1.2),
    "repulsion": Stroke(WARNING, 1.2, hollow=True),
    "weight": Stroke(STRAIGHT, 1.2),
    "friction": Stroke(RANGE, 1.2),
    "drag": Stroke(SKY, 1.2),
    "load": Stroke(ROSE, 1.2),
    "tip-force": Stroke(ROD, 1.6),
    "moment": Stroke(ROD, 1.6),
    "arc": Stroke(ROD, 1.6),
    "wall": Stroke(PLATE, 1.0),
    "range": Stroke(RANGE, 1.2, (1.2, 1.8)),
    "mirror": Stroke(SPURIOUS, ROD_WIDTH),
    "unbonded": Stroke(ROSE, ROD_WIDTH),
    "straight": Stroke(STRAIGHT, 1.3),
    "straight-unstable": Stroke(STRAIGHT, 1.1, DASHED),
    "spurious": Stroke(SPURIOUS, 1.4),
    "spurious-stable": Stroke(SPURIOUS, 1.4),
    "spurious-unstable": Stroke(SPURIOUS, 1.4, (5.6, 2.5)),
    "unknown": Stroke(ADHESION, 1.0, (1.5, 2.2)),
    "own": Stroke(ADHESION, 1.0, (1.5, 2.2)),
    "branch": Stroke(ADHESION, 2.0),
    "unstable": Stroke(ADHESION, 1.8, DASHED),
    "stable": Stroke(ADHESION, 2.0),
    "fold": Stroke(WARNING, 1.1, (1.5, 2.2)),
    "maxwell": Stroke(EQUAL, 1.1, (4.5, 2.2)),
    "delay": Stroke(PRESSURE, 1.1, (6.7, 2.2, 1.5, 2.2)),
    "current": Stroke(ROD, 2.1),
    "zero": Stroke(PLATE, 0.8),
    "orbit": Stroke(PRESSURE, 2.4),
    "front": Stroke(ROD, 1.6),
    "tip-x": Stroke(ADHESION, 1.6, (8.0, 2.6)),
    "tip-y": Stroke(PRESSURE, 1.6, (2.6, 2.6)),
    "work": Stroke(PRESSURE, 2.2),
    "drag-loss": Stroke(PLATE, 1.6, (8.0, 2.6)),
    "bond-loss": Stroke(WARNING, 1.6, (8.0, 2.6)),
    "kinetic": Stroke(SKY, 1.6),
    "bending": Stroke(ROD, 1.6),
    "separation": Stroke(ADHESION, 1.6),
    "between": Stroke(PLATE, 1.3, (5.2, 2.4)),
    "up": Stroke(PRESSURE, 2.0, dots="open"),
    "down": Stroke(ADHESION, 1.5, (6.0, 2.2), dots="full"),
}

#: Dashes of neighbouring curves of a family, which differ in grey too.
CURVE_DASHES: tuple[Dash, ...] = ((), (10.8, 2.7), (7.2, 2.2, 1.8, 2.2), (2.5, 1.8))


@dataclass(frozen=True)
class Marker:
    """How named points of one look are drawn: Matplotlib's marker and Bokeh's, the colour, the face."""

    matplotlib: str
    bokeh: str
    colour: str
    hollow: bool = False
    size: float = 6.0


#: By kind of special point, of critical point, and of jump by where it points.
MARKS: dict[str, Marker] = {
    "tip": Marker("o", "circle", ROD, hollow=True),
    "detachment": Marker("o", "circle", ROD),
    "glue": Marker("|", "dash", ROD, size=9.0),
    "member": Marker("o", "circle", ROD, size=4.5),
    "BP": Marker("o", "circle", ROD, hollow=True),
    "LP-lambda": Marker("s", "square", WARNING),
    "LP-length": Marker("s", "square", WARNING),
    "LP-pressure": Marker("D", "diamond", WARNING),
    "y=y0": Marker("^", "triangle", RANGE),
    "contact": Marker("X", "x", ROD, size=7.0),
    "fold": Marker("s", "square", WARNING),
    "maxwell": Marker("D", "diamond", EQUAL),
    "delay": Marker("^", "triangle", PRESSURE),  # as the jump that it is in a loop
    "minimum": Marker("o", "circle", ROD),
    "maximum": Marker("o", "circle", ROD, hollow=True),
    "event": Marker("D", "diamond", WARNING),
    "inflection": Marker("s", "square", ROD, hollow=True),
    "peels-up": Marker("^", "triangle", PRESSURE, size=8.0),
    "peels-down": Marker("v", "inverted_triangle", PRESSURE, size=8.0),
    "readheres-up": Marker("^", "triangle", ADHESION, size=8.0),
    "readheres-down": Marker("v", "inverted_triangle", ADHESION, size=8.0),
}
OTHER = Marker("v", "inverted_triangle", ROD)


def stroke(look: str) -> Stroke:
    """Return how a line of a look is drawn; "family 2/5" is the third shape of five, "curve 2/5" dashed."""
    kind, _, place = look.partition(" ")
    if not place:
        return STROKES[look]
    which, count = (int(number) for number in place.split("/"))
    shade = mpl.colors.to_hex(family_colours(count)[which])
    if kind == "family":
        return Stroke(shade, 2.0)
    return Stroke(shade, 1.8, CURVE_DASHES[which % len(CURVE_DASHES)])


def marker(look: str) -> Marker:
    """Return how a named point of a look is drawn."""
    return MARKS.get(look, OTHER)


def family_colours(count: int) -> np.ndarray:
    """Return ``count`` colours from dark to light, (count, 4)."""
    return np.asarray(mpl.colormaps[FAMILY_COLOURMAP](np.linspace(*FAMILY_RANGE, count)))
