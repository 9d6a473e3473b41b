"""Sizes of the page, and its style sheets; colours and dashes are those of `peel_opt.plots.style`."""

from __future__ import annotations

INK, FAINT, PAPER = "#1A1A1A", "#5A5A5A", "#FFFFFF"

#: Sizes of the page at 1280 x 800, in pixels: controls, frames of the panels, room for labels.
SIDE, FRAME_WIDTH, FRAME_HEIGHT, LEFT = 272, 398, 234, 76

FONT = "13px"


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
