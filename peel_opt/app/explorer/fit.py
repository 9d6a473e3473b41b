"""Panels that grow and shrink with the window, at the proportions the rod is drawn for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bokeh.models import CustomJS

from . import look

if TYPE_CHECKING:
    from .panels import Picture

#: A frame keeps its proportions, so that ranges chosen for them keep the scales of x and y.
_FIT = """
const fit = () => {
    const wide = document.documentElement.clientWidth, beside = wide >= BESIDE
    const columns = wide >= TWO_COLUMNS ? 2 : 1, left = beside ? LEFT : NARROW_LEFT
    const room = (wide - (beside ? SIDE + 14 : 8)) / columns - left - RIGHT - 4
    // No larger than what shows all rows at once, where the window has a row for each.
    const high = (innerHeight - 140) / 2 - 148
    const seen = beside ? Math.max(0.85 * FRAME_WIDTH, high * FRAME_WIDTH / FRAME_HEIGHT) : room
    const frame_width = Math.max(Math.floor(Math.min(room, seen)), 120)
    const frame_height = Math.round(frame_width * FRAME_HEIGHT / FRAME_WIDTH)
    figures.forEach((figure, i) => {
        figure.setv({frame_width, frame_height, min_border_left: left})
        legends[i].ncols = frame_width < 0.9 * FRAME_WIDTH ? 2 : "auto"
        absent[i].setv({x: frame_width / 2, y: frame_height / 2})
    })
    for (const name of at_the_end) name.x = frame_width - 24
}
fit()
if (!globalThis.peel_opt_fits) {
    globalThis.peel_opt_fits = true
    addEventListener("resize", fit)
}
"""


def fit(pictures: Sequence[Picture]) -> CustomJS:
    """Return what gives some pictures the size that the window has for them, now and when it changes."""
    code = _FIT
    for name in (
        "TWO_COLUMNS",
        "BESIDE",
        "NARROW_LEFT",
        "LEFT",
        "RIGHT",
        "SIDE",
        "FRAME_WIDTH",
        "FRAME_HEIGHT",
    ):
        code = code.replace(name, str(getattr(look, name)))
    return CustomJS(
        args={
            "figures": [picture.figure for picture in pictures],
            "legends": [picture.legend for picture in pictures],
            "absent": [picture.absent for picture in pictures],
            "at_the_end": [picture.ground[1] for picture in pictures if picture.ground is not None],
        },
        code=code,
    )
