"""The four panels in Matplotlib axes, in the look of the page."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from ...plots import style
from . import look
from .panels import Axis, DiagramPanel, Line, LoopPanel, Mark, PotentialPanel, RodPanel

#: Matplotlib's names of the shapes of special points.
SHAPES = {
    "circle": "o",
    "square": "s",
    "diamond": "D",
    "triangle": "^",
    "inverted_triangle": "v",
    "square_x": "X",
}

#: A line of the page, in pixels, is this many points wide.
_POINTS = 0.72


def draw_rod(ax: Axes, panel: RodPanel) -> Axes:
    """Draw a rod with its plate, y0 and the forces, in true shape or as ``panel.stretch`` says."""
    _begin(ax, "Rod", panel.x, panel.y)
    wide, high = panel.x.high - panel.x.low, panel.y.high - panel.y.low
    plate = Rectangle(
        (panel.x.low - 10 * wide, -10 * high),
        30 * wide,
        10 * high,
        facecolor="#F4F4F4",
        edgecolor="#C8C8C8",
        hatch="////",
        linewidth=0.0,
        zorder=0,
    )
    ax.add_patch(plate)
    ax.axhline(0.0, color=style.PLATE, linewidth=0.8, zorder=1)
    handles = _lines(ax, panel.lines)
    for arrows in panel.arrows:
        stroke = look.STROKES[arrows.look]
        ax.quiver(
            arrows.x0,
            arrows.y0,
            arrows.x1 - arrows.x0,
            arrows.y1 - arrows.y0,
            angles="xy",
            scale_units="xy",
            scale=1.0,
            color=stroke.colour,
            zorder=3,
            **style.ARROW,
        )
        handles.append(Line2D([], [], color=stroke.colour, linewidth=1.4, label=arrows.label))
    if panel.shows_y0 and panel.y0 is not None:
        ax.axhline(panel.y0, color=look.Y0, linewidth=1.2, linestyle=(0, (1, 1.5)), zorder=1)
        ax.annotate(
            "y₀",
            (1.0, panel.y0),
            xycoords=ax.get_yaxis_transform(),
            xytext=(3, 0),
            textcoords="offset points",
            color=look.Y0,
            va="center",
        )
    # Both scales as they must be, within the frame that there is.
    pixel = max(wide / ax.bbox.width, panel.stretch * high / ax.bbox.height)
    middle = 0.5 * (panel.x.low + panel.x.high)
    ax.set_xlim(middle - 0.5 * pixel * ax.bbox.width, middle + 0.5 * pixel * ax.bbox.width)
    ax.set_ylim(panel.y.low, panel.y.low + pixel * ax.bbox.height / panel.stretch)
    ax.grid(False)
    _legend(ax, handles)
    return ax


def draw_diagram(ax: Axes, panel: DiagramPanel) -> Axes:
    """Draw the bifurcation diagram with its special points and the state."""
    _begin(ax, f"Bifurcation diagram, stability {panel.stability}", panel.x, panel.y)
    return _curves(ax, panel.lines, panel.marks, panel.here)


def draw_potential(ax: Axes, panel: PotentialPanel) -> Axes:
    """Draw the effective potential and the ball."""
    _begin(ax, f"Potential (35), {panel.source}", panel.x, panel.y)
    return _curves(ax, panel.lines, panel.marks, panel.ball)


def draw_loop(ax: Axes, panel: LoopPanel) -> Axes:
    """Draw the hysteresis loop and where the state is on it."""
    _begin(ax, f"Hysteresis loop, {panel.area}", panel.x, panel.y)
    return _curves(ax, panel.lines, panel.marks, panel.here)


def draw_nothing(ax: Axes, title: str, text: str) -> Axes:
    """Draw a few words in place of a picture."""
    ax.clear()
    ax.set_title(title, loc="left", fontsize=style.SMALL, fontweight="bold", pad=20.0)
    ax.set_xticks([])
    ax.set_yticks([])
    ax.spines[["top", "right"]].set_visible(False)
    ax.text(
        0.5,
        0.5,
        textwrap.fill(text, 52),
        transform=ax.transAxes,
        ha="center",
        va="center",
        color=look.FAINT,
        fontsize=style.SMALL,
    )
    return ax


def _begin(ax: Axes, title: str, x: Axis, y: Axis) -> None:
    ax.clear()
    ax.set_title(title, loc="left", fontsize=style.SMALL, fontweight="bold", pad=20.0)
    ax.set_xlabel(x.label, fontsize=style.SMALL)
    ax.set_ylabel(y.label, fontsize=style.SMALL)
    ax.set_xlim(x.low, x.high)
    ax.set_ylim(y.low, y.high)
    ax.set_autoscale_on(False)
    ax.tick_params(labelsize=style.SMALL - 0.5)
    ax.ticklabel_format(axis="y", scilimits=(-3, 4))
    ax.yaxis.get_offset_text().set(fontsize=style.SMALL - 1.0, x=-0.14)  # not over the legend
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(True, color="#ECECEC", linewidth=0.8)
    ax.set_axisbelow(True)


def _curves(ax: Axes, lines: Iterable[Line], marks: Iterable[Mark], here: tuple[float, float] | None) -> Axes:
    _legend(ax, _lines(ax, lines))
    for mark in marks:
        colour, shape = look.MARKS.get(mark.look, (look.INK, "circle"))
        ax.plot(
            mark.x, mark.y, SHAPES[shape], color=colour, markersize=6.5, markeredgecolor="white", zorder=4
        )
        ax.annotate(
            mark.letter,
            (mark.x, mark.y),
            xytext=(5, 4),
            textcoords="offset points",
            color=colour,
            fontsize=style.SMALL + 0.5,
            fontweight="bold",
            zorder=4,
        )
    if here is not None:
        (dot,) = ax.plot(*here, "o", color=look.HERE, markersize=10.5, markeredgecolor=look.INK, zorder=5)
        dot.set_gid("here")
    return ax


def _lines(ax: Axes, lines: Iterable[Line]) -> list[Line2D]:
    """Draw lines; return those that the legend names, each look once."""
    named: dict[str, Line2D] = {}
    for line in lines:
        stroke = look.STROKES[line.look]
        dash: Any = stroke.dash
        if not isinstance(dash, str):
            dash = (0, tuple(d / stroke.width for d in dash))
        (drawn,) = ax.plot(
            np.asarray(line.x),
            np.asarray(line.y),
            color=stroke.colour,
            linewidth=_POINTS * stroke.width,
            linestyle=dash,
            label=line.label,
            zorder=2,
        )
        if line.label:
            named.setdefault(line.look, drawn)
    return list(named.values())


def _legend(ax: Axes, handles: list[Line2D]) -> None:
    """Name the lines in a row between title and frame."""
    ax.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(-0.01, 0.985),
        ncols=max(len(handles), 1),
        frameon=False,
        fontsize=style.SMALL - 0.5,
        handlelength=1.9,
        handletextpad=0.4,
        columnspacing=0.9,
        borderaxespad=0.2,
    )
