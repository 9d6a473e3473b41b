"""Colours, widths and sizes of the page; the colours are those of all pictures of this package."""

from __future__ import annotations

from dataclasses import dataclass

from ...plots import style

INK, FAINT, PAPER = "#1A1A1A", "#5A5A5A", "#FFFFFF"

#: Sizes of the page at 1280 x 800, in pixels: controls, frames of the panels, room for labels.
SIDE, FRAME_WIDTH, FRAME_HEIGHT, LEFT = 272, 398, 234, 76

FONT = "13px"


@dataclass(frozen=True)
class Stroke:
    """How lines of one look are drawn."""

    colour: str
    width: float = 2.0
    dash: str | list[int] = "solid"


DASHED = [7, 4]

STROKES: dict[str, Stroke] = {
    "stable": Stroke(style.ADHESION, 2.6),
    "unstable": Stroke(style.ADHESION, 2.0, DASHED),
    "unknown": Stroke(style.ADHESION, 1.2, [2, 3]),
    "spurious": Stroke("#A8A8A8", 1.6, DASHED),
    "straight": Stroke("#6E6E6E", 2.0),
    "straight-unstable": Stroke("#6E6E6E", 1.4, DASHED),
    "rod": Stroke(style.ROD, 3.6),
    "beyond": Stroke(style.ROD, 3.0, [5, 4]),
    "fold": Stroke(style.WARNING, 1.4, [2, 3]),
    "maxwell": Stroke(style.RANGE, 1.4, [6, 3]),
    "delay": Stroke(style.ADHESION, 1.4, [9, 3, 2, 3]),
    "current": Stroke(style.ROD, 2.8),
    "between": Stroke("#A8A8A8", 1.6, DASHED),
    "up": Stroke(style.PRESSURE, 2.6),
    "down": Stroke(style.ADHESION, 2.2, [8, 3]),
    "pressure": Stroke(style.PRESSURE, 1.5),
    "adhesion": Stroke(style.ADHESION, 1.5),
    "repulsion": Stroke(style.WARNING, 1.5),
}

#: Colour and shape of special points.
MARKS: dict[str, tuple[str, str]] = {
    "BP": (style.ROD, "circle"),
    "LP-lambda": (style.PRESSURE, "square"),
    "LP-length": (style.PRESSURE, "square"),
    "LP-pressure": (style.WARNING, "diamond"),
    "y=y0": (style.RANGE, "triangle"),
    "contact": (style.ROD, "square_x"),
    "self-contact": (style.ROD, "inverted_triangle"),
    "fold": (style.WARNING, "square"),
    "maxwell": (style.RANGE, "diamond"),
    "delay": (style.ADHESION, "triangle"),
    "peels-up": (style.PRESSURE, "triangle"),
    "peels-down": (style.PRESSURE, "inverted_triangle"),
    "readheres-up": (style.ADHESION, "triangle"),
    "readheres-down": (style.ADHESION, "inverted_triangle"),
}

#: The state, in every panel.
HERE = "#E69F00"
Y0 = style.RANGE

GLOBAL = """
body { margin: 0; background: #FFFFFF; font-family: system-ui, "DejaVu Sans", Arial, sans-serif; }
"""

#: Within the widgets: sizes that a projector shows, a focus that the keyboard shows.
WIDGETS = """
:host { font-size: 13px; color: #1A1A1A; }
.bk-input-group { font-size: 13px; }
.bk-btn { font-size: 12.5px; padding: 3px 6px; }
.bk-btn.bk-active { background: #1F4E79; color: #FFFFFF; border-color: #1F4E79; }
.bk-input { font-size: 12.5px; height: 26px; padding: 2px 4px; }
.bk-slider-title { font-size: 13px; }
:focus-visible { outline: 3px solid #E69F00; outline-offset: 1px; }
"""
