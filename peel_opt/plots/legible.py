"""Colours on the paper they are drawn on: what would be lost on a dark one is lightened."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

#: Relative luminance below which paper is dark, and above which a colour is that of white paper.
_DARK, _WHITE = 0.18, 0.85

#: Greatest difference of the channels of a grey.
_GREY = 0.05

#: Least contrast of what is drawn with its paper: that which WCAG 2 asks of text.
CONTRAST = 4.5

Colour = tuple[float, float, float]


def paper(ax: Axes) -> Colour:
    """Return the colour behind what is drawn into axes."""
    seen: np.ndarray = np.ones(3)
    figure = ax.get_figure()
    for layer in ([] if figure is None else [figure.get_facecolor()]) + [ax.get_facecolor()]:
        *colour, alpha = to_rgba(layer)
        seen = alpha * np.array(colour) + (1.0 - alpha) * seen
    return float(seen[0]), float(seen[1]), float(seen[2])


def contrast(one: object, other: object) -> float:
    """Return the contrast of two colours, 1 to 21, by the formula of WCAG 2."""
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


def legible(ax: Axes) -> None:
    """Lighten what is drawn into axes on dark paper until it can be seen; hollow faces become paper.

    On light paper nothing changes: the colours of `peel_opt.plots.style` are made for it.
    """
    ground = paper(ax)
    if _luminance(ground) > _DARK:
        return
    for line in ax.findobj(Line2D, include_self=False):
        if line in ax.lines:
            _relight_line(line, ground)
    for text in ax.texts:
        text.set_color(ink(text.get_color(), ground))
        _relight_frame(text, ground)
    for patch in ax.patches:
        _relight_patch(patch, ground)
    for drawn in ax.collections:
        _relight_collection(drawn, ground)


def ink(colour: object, ground: object) -> Colour:
    """Return a colour, lightened on this ground until its contrast is enough."""
    own: np.ndarray = np.array(to_rgb(colour))  # type: ignore[arg-type]
    if np.ptp(own) < _GREY and contrast(own, ground) < CONTRAST:
        own = 1.0 - own  # black ink on white paper is white ink on black paper
    shares = np.linspace(0.0, 1.0, 41)
    share = next((s for s in shares if contrast(own + s * (1.0 - own), ground) >= CONTRAST), 1.0)
    r, g, b = (own + share * (1.0 - own)).tolist()
    return r, g, b


def face(colour: object, ground: Colour) -> Colour:
    """Return the colour of a face: paper stays paper, a light tint of it becomes a dark one."""
    if _luminance(colour) < _WHITE:
        return ink(colour, ground)
    tint = 1.0 - np.array(to_rgb(colour))  # type: ignore[arg-type]
    r, g, b = np.clip(np.array(ground) + 2.0 * tint, 0.0, 1.0).tolist()
    return r, g, b


def _luminance(colour: object) -> float:
    channels: np.ndarray = np.array(to_rgb(colour))  # type: ignore[arg-type]
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def _relight_line(line: Line2D, ground: Colour) -> None:
    edge, inside = line.get_markeredgecolor(), line.get_markerfacecolor()
    line.set_color(ink(line.get_color(), ground))
    line.set_markeredgecolor(ink(edge, ground) if _luminance(edge) < _WHITE else ground)
    line.set_markerfacecolor(face(inside, ground))


def _relight_frame(text: Text, ground: Colour) -> None:
    frame = text.get_bbox_patch()
    if frame is not None:
        frame.set_facecolor(face(frame.get_facecolor(), ground))


def _relight_patch(patch: Patch, ground: Colour) -> None:
    alpha = to_rgba(patch.get_facecolor())[3]
    patch.set_facecolor((*face(patch.get_facecolor(), ground), alpha))
    edge = to_rgba(patch.get_edgecolor())
    if patch.get_hatch():
        # Hatching is a texture, not a line: it stays faint.
        patch.set_edgecolor((*ground, 1.0) if edge[3] == 0.0 else "0.35")
    elif edge[3]:
        patch.set_edgecolor(ink(edge, ground))


def _relight_collection(drawn: Collection, ground: Colour) -> None:
    if drawn.get_array() is not None:
        return  # colours that are values
    for read, write in (
        (drawn.get_facecolor, drawn.set_facecolor),
        (drawn.get_edgecolor, drawn.set_edgecolor),
    ):
        colours = np.atleast_2d(np.asarray(read(), float))
        if colours.size:
            write([(*face(c[:3], ground), c[3]) for c in colours])
