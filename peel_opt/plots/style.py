"""Colours that survive colour blindness and grey printing, and the widths that go with them."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np

#: Okabe and Ito's palette, by what it is used for.
ROD = "#000000"
PRESSURE = "#D55E00"
ADHESION = "#0072B2"
RANGE = "#009E73"
WARNING = "#A3327C"  # their reddish purple, darkened so that text in it can be read on white
PLATE = "#9A9A9A"

#: Sequential, of monotone lightness; its last, pale part is left out.
FAMILY_COLOURMAP = "viridis"
FAMILY_RANGE = (0.0, 0.82)

ROD_WIDTH = 2.4  # points
SMALL = 9.0  # font size of titles and legends, points

#: Width and head of an arrow; in widths of the axes, so that small panels have small heads.
ARROW: dict[str, Any] = {
    "units": "width",
    "width": 0.0030,
    "headwidth": 4.5,
    "headlength": 6.0,
    "headaxislength": 5.2,
}


def family_colours(count: int) -> np.ndarray:
    """Return ``count`` colours from dark to light, (count, 4)."""
    return np.asarray(mpl.colormaps[FAMILY_COLOURMAP](np.linspace(*FAMILY_RANGE, count)))
