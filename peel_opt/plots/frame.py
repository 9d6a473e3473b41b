"""What surrounds a rod in a picture: the frame, the plate, the range of the adhesion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation

from . import style
from .words import AxisUnit

#: A picture flatter than this, height over width, gets a larger vertical scale ...
FLATTEST = 0.15
#: ... which makes it at most this high.
STRETCHED = 0.36

#: Length of the longest arrow and least depth of the plate, over the width of the picture.
ARROW_SHARE = 0.12
PLATE_SHARE = 0.035

FIGURE_WIDTH = 6.4  # inches


@dataclass(frozen=True)
class Scene:
    """The measures of a picture, in the coordinates of its axes."""

    left: float
    right: float
    lowest: float
    height: float
    stretch: float
    #: y0, None if there is none; `shows_range` tells if it lies within the frame.
    y0: float | None
    shows_range: bool

    @property
    def width(self) -> float:
        """From the far end of the rod to the end of the attached part drawn."""
        return self.right - self.left

    @property
    def arrow(self) -> float:
        """Length of the longest arrow, on the horizontal scale."""
        return ARROW_SHARE * self.width

    @property
    def plate_depth(self) -> float:
        """Least depth of the plate, on the vertical scale."""
        return PLATE_SHARE * self.width / self.stretch


def stage(x: np.ndarray, y: np.ndarray, y0: float | None) -> Scene:
    """Choose frame and vertical scale for shapes through the points (x, y)."""
    left, reach = float(x.min()), max(float(x.max()), 0.0)
    span = reach - left
    right = max(0.32 * span, reach + 0.12 * span)
    top = float(np.abs(y).max())
    shows_range = y0 is not None and y0 <= max(1.4 * top, min(4.0 * top, 0.3 * (right - left)))
    if shows_range and y0 is not None:
        top = max(top, y0)
    return Scene(left, right, min(float(y.min()), 0.0), top, _stretch(top / (right - left)), y0, shows_range)


def _stretch(flatness: float) -> float:
    """Return 1, or the largest of 2, 5, 10, 20 ... that does not make the picture too high."""
    if flatness >= FLATTEST or flatness == 0.0:
        return 1.0
    factor = STRETCHED / flatness
    decade = 10.0 ** math.floor(math.log10(factor))
    return max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= factor)


def own_axes(scene: Scene) -> Axes:
    """Return axes in a figure of their own, as high as the scene needs; pyplot never knows it."""
    high = (scene.height * scene.stretch + 2.5 * scene.arrow) / scene.width
    figure = Figure(
        figsize=(FIGURE_WIDTH, min(max(FIGURE_WIDTH * high + 1.9, 3.2), 8.0)), layout="constrained"
    )
    axes: Axes = figure.add_subplot()
    return axes


def dress(ax: Axes, scene: Scene, unit: AxisUnit, corners: np.ndarray) -> None:
    """Draw plate and y0, and set limits, scale and labels so that all ``corners`` are inside."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    pad = 0.03 * scene.width
    left, right = min(low[0], scene.left) - pad, scene.right
    bottom = min(-scene.plate_depth, low[1] - 0.5 * pad / scene.stretch)
    top = max(high[1], scene.height) + pad / scene.stretch

    plate = Rectangle(
        (left - 10 * scene.width, bottom - 10 * scene.height),
        30 * scene.width,
        10 * scene.height - bottom,
        facecolor="#F4F4F4",
        edgecolor="#C8C8C8",
        hatch="////",
        linewidth=0.0,
        zorder=0,
    )
    plate.set_gid("plate")
    ax.add_patch(plate)
    ax.axhline(0.0, color=style.PLATE, linewidth=0.8, zorder=1)
    if scene.y0 is not None:
        _mark_range(ax, scene, scene.y0)

    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    ax.set_aspect(scene.stretch, adjustable="box")
    # No heights where only arrows reach into the plate.
    ticks = MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]).tick_values(scene.lowest, top)
    least = scene.lowest - 1e-6 * scene.height
    ax.set_yticks([t for t in ticks if least <= t <= top])
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_xlabel(unit.axis("x"))
    scale = f"\nvertical scale × {scene.stretch:g}" if scene.stretch != 1.0 else ""
    ax.set_ylabel(unit.axis("y") + scale)


def _mark_range(ax: Axes, scene: Scene, y0: float) -> None:
    """Draw the line y = y0 with its name in the right margin; an arrow says that it lies above."""
    if scene.shows_range:
        line = ax.axhline(y0, color=style.RANGE, linewidth=1.2, linestyle=(0, (1, 1.5)), zorder=1)
        line.set_gid("y0")
    label = ax.annotate(
        "$y_0$" if scene.shows_range else r"$y_0\!\uparrow$",
        xy=(1.0, y0 if scene.shows_range else 1.0),
        xycoords=ax.get_yaxis_transform() if scene.shows_range else "axes fraction",
        xytext=(4.0, 0.0),
        textcoords="offset points",
        va="center" if scene.shows_range else "top",
        color=style.RANGE,
        fontsize=style.SMALL + 1.0,
        annotation_clip=False,
    )
    label.set_gid("y0-label")


def add_legend(ax: Axes, columns: int) -> None:
    """Explain the picture under the label of the x-axis, where nothing of it can be.

    Without a layout engine that makes room there, the legend would be cut off; it then stands
    where it hides least.
    """
    figure = ax.get_figure()
    if figure is None:
        return
    look = {"fontsize": style.SMALL, "handlelength": 2.2, "columnspacing": 1.4}
    if figure.get_layout_engine() is None:
        ax.legend(loc="best", framealpha=1.0, edgecolor="none", **look)
        return
    drop = ScaledTranslation(0.0, -38.0 / 72.0, figure.dpi_scale_trans)
    ax.legend(
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        bbox_transform=ax.transAxes + drop,
        borderaxespad=0.0,
        ncol=columns,
        frameon=False,
        **look,
    )
