"""The pen for paper: draws a `Panel` with Matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox, ScaledTranslation

from . import style
from .axes import axes_or, own_figure
from .legible import legible, paper
from .panels import Arrows, Ground, Line, Mark, Panel

FIGURE_WIDTH = 6.4  # inches

#: From a named point to its letter, points.
_LETTER_GAP = 8.0

#: Least share of the height of its cell that is left to a picture above its legend.
_LEAST_SHARE = 0.4

#: Room for the words around the picture of a rod, and how high that may be, inches.
_WORDS, _LOWEST, _HIGHEST = 1.9, 3.2, 8.0


def draw_panel(
    panel: Panel,
    ax: Axes | None = None,
    *,
    height: float = 4.8,
    legend: bool = True,
    columns: int = 2,
) -> Axes:
    """Draw a picture into axes, or into a figure of its own, and return the axes.

    Parameters
    ----------
    panel : Panel
    ax : Axes, optional
    height : float
        Of a figure of its own [inches]; a rod's follows from its shape.
    legend : bool
        Whether to explain lines and marks, below the picture.
    columns : int
        Of the legend.
    """
    ax = axes_or(ax, lambda: _own_axes(panel, height))
    if panel.ground is not None:
        _lay(ax, panel, panel.ground)
    for order, line in enumerate(panel.lines):
        _line(ax, line, 3.0 + 0.01 * order)
    for mark in panel.marks:
        _mark(ax, mark)
    for arrows in panel.arrows:
        _arrows(ax, arrows)
    if panel.here is not None:
        look: dict[str, Any] = {"color": style.HERE, "markeredgecolor": style.ROD, "markersize": 9}
        (dot,) = ax.plot(*panel.here, "o", **look, zorder=8)
        dot.set_gid("here")
    if panel.x.log:
        ax.set_xscale("log")
    if panel.y.log:
        ax.set_yscale("log")
    ax.set_xlim(panel.x.low, panel.x.high)
    ax.set_ylim(panel.y.low, panel.y.high)
    ax.set_xlabel(panel.x.label)
    ax.set_ylabel(panel.y.label)
    ax.spines[["top", "right"]].set_visible(False)
    _caption(ax, panel)
    return finish(ax, columns=columns, legend=legend)


def finish(ax: Axes, *, columns: int = 2, legend: bool = True, title: str = "") -> Axes:
    """Make a picture legible on its paper, explain it where it needs that, and return its axes.

    Parameters
    ----------
    ax : Axes
    columns : int
        Of the legend.
    legend : bool
        Whether what has a label is explained.
    title : str
        Of the legend.
    """
    legible(ax)
    if legend and ax.get_legend_handles_labels()[0]:
        _legend_below(ax, columns, title)
    return ax


def entitle(ax: Axes, title: str) -> None:
    """Put another title above a picture, over what it says to beware of."""
    notes = [text for text in ax.texts if text.get_gid() == "flags"]
    lines = sum(note.get_text().count("\n") + 1 for note in notes)
    ax.set_title(title, loc="left", fontsize=style.SMALL, pad=_title_pad(lines))


def _title_pad(lines: int) -> float:
    """Distance of a title above lines of warnings, points."""
    return 6.0 + 1.35 * style.SMALL * lines


def _legend_below(ax: Axes, columns: int, title: str) -> None:
    """Explain the picture under the label of the x-axis, where nothing of it can be."""
    figure = ax.get_figure()
    if figure is None:
        return
    drop = ScaledTranslation(0.0, -38.0 / 72.0, figure.dpi_scale_trans)
    legend = ax.legend(
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        bbox_transform=ax.transAxes + drop,
        borderaxespad=0.0,
        ncol=columns,
        frameon=False,
        fontsize=style.SMALL,
        title=title or None,
        title_fontsize=style.SMALL,
        handlelength=2.2,
        columnspacing=1.4,
    )
    place = ax.get_subplotspec()
    if figure.get_layout_engine() is None and place is not None:
        room = figure.bbox.x1 - ax.get_window_extent().x0
        if columns > 1 and legend.get_window_extent().width > room:
            _legend_below(ax, columns - 1, title)
            return
        _make_room(ax, legend, place.get_position(figure))  # type: ignore[arg-type]


def _make_room(ax: Axes, legend: Legend, cell: Bbox) -> None:
    """Raise the foot of axes that no layout engine places, so that the legend stands in their own cell."""
    figure = legend.get_figure()
    assert figure is not None
    share = legend.get_window_extent().height / figure.bbox.height
    foot = cell.y0 + min(share, (1.0 - _LEAST_SHARE) * cell.height)
    ax.set_position((cell.x0, foot, cell.width, cell.y1 - foot))
    ax.set_in_layout(True)  # which set_position ends, and tight_layout needs


def dashes(stroke: style.Stroke) -> Any:
    """Return the dashes of a stroke as Matplotlib takes them, in widths of the line."""
    return (0, tuple(length / stroke.width for length in stroke.dash)) if stroke.dash else "-"


def _own_axes(panel: Panel, height: float) -> Axes:
    """Return axes in a figure of their own, for a rod as high as its shape needs."""
    if panel.ground is not None:
        wide, high = panel.x.high - panel.x.low, panel.ground.stretch * (panel.y.high - panel.y.low)
        height = min(max(FIGURE_WIDTH * high / wide + _WORDS, _LOWEST), _HIGHEST)
    axes: Axes = own_figure(FIGURE_WIDTH, height).add_subplot()
    return axes


def _unique(ax: Axes, label: str) -> str:
    """Return a label, hidden from the legend where it is in it already, or is empty."""
    return f"_{label}" if not label or label in ax.get_legend_handles_labels()[1] else label


def _line(ax: Axes, line: Line, order: float) -> None:
    stroke = style.stroke(line.look)
    dots: dict[str, Any] = {}
    if stroke.dots:
        face = "white" if stroke.dots == "open" else stroke.colour
        dots = {"marker": "o", "markersize": 4.5 if stroke.dots == "open" else 2.0, "markerfacecolor": face}
    (drawn,) = ax.plot(
        line.x,
        line.y,
        color=stroke.colour,
        linewidth=stroke.width,
        linestyle=dashes(stroke),
        dash_capstyle="butt",
        solid_capstyle="butt",
        label=_unique(ax, line.full or line.label),
        zorder=order,
        **dots,
    )
    drawn.set_gid(line.look.partition(" ")[0])


def _arrows(ax: Axes, arrows: Arrows) -> None:
    stroke = style.stroke(arrows.look)
    drawn = ax.quiver(
        arrows.x0,
        arrows.y0,
        arrows.x1 - arrows.x0,
        arrows.y1 - arrows.y0,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        facecolor=paper(ax) if stroke.hollow else stroke.colour,
        edgecolor=stroke.colour,
        linewidth=0.8 if stroke.hollow else 0.0,
        path_effects=[withStroke(linewidth=2.4, foreground=paper(ax))] if stroke.hollow else None,
        zorder=5 if stroke.hollow else 2.5,
        **style.ARROW,
    )
    drawn.set_gid(arrows.look)
    # A quiver has no entry of its own in a legend.
    ax.add_line(
        Line2D(
            [],
            [],
            linestyle="none",
            marker=r"$\Rightarrow$" if stroke.hollow else r"$\rightarrow$",
            markersize=13.0,
            markeredgewidth=0.2,
            color=stroke.colour,
            label=arrows.full or arrows.label,
        )
    )


def _mark(ax: Axes, mark: Mark) -> None:
    look = style.marker(mark.look)
    colour = style.stroke(mark.of).colour if mark.of else look.colour
    named = f"{mark.letter}: {mark.meaning}" if mark.letter else mark.meaning
    (drawn,) = ax.plot(
        [mark.x],
        [mark.y],
        linestyle="none",
        marker=look.matplotlib,
        markersize=look.size,
        markerfacecolor="white" if look.hollow else colour,
        markeredgecolor=colour if look.hollow or not mark.letter else "white",
        markeredgewidth=1.3 if look.hollow else 0.6,
        label=_unique(ax, named if mark.listed and not mark.of else ""),
        zorder=6,
        clip_on=False,
    )
    drawn.set_gid(f"mark:{mark.letter or mark.look}")
    if mark.of and mark.listed:
        # In no line's colour, since it stands for those on all of them.
        face = "white" if look.hollow else look.colour
        shape: dict[str, Any] = {"marker": look.matplotlib, "markersize": look.size, "markerfacecolor": face}
        ax.add_line(Line2D([], [], linestyle="none", color=look.colour, label=named, **shape))
    if not mark.letter:
        return
    dx, dy = mark.away
    text = ax.annotate(
        mark.text,
        xy=(mark.x, mark.y),
        xytext=(_LETTER_GAP * dx, _LETTER_GAP * dy),
        textcoords="offset points",
        ha="center" if abs(dx) < 0.4 else ("left" if dx > 0 else "right"),
        va="center" if abs(dy) < 0.4 else ("bottom" if dy > 0 else "top"),
        fontsize=style.SMALL + 1.0,
        color=colour,
        zorder=7,
    )
    text.set_gid(f"letter:{mark.look}")


def _lay(ax: Axes, panel: Panel, ground: Ground) -> None:
    """Draw plate and y0, and tie the scales to each other."""
    wide, high = panel.x.high - panel.x.low, panel.y.high - panel.y.low
    look: dict[str, Any] = {"facecolor": "#F4F4F4", "edgecolor": "#C8C8C8", "hatch": "////"}
    look |= {"linewidth": 0.0, "zorder": 0}
    plate: Patch
    if ground.solid is None:
        corner = panel.x.low - 10.0 * wide, panel.y.low - 10.0 * high
        plate = Rectangle(corner, 30.0 * wide, 10.0 * high - panel.y.low, **look)
        ax.axhline(0.0, color=style.PLATE, linewidth=0.8, zorder=1)
    else:
        plate = Polygon(np.column_stack(ground.solid), closed=True, **look)
    plate.set_gid("plate")
    ax.add_patch(plate)
    if ground.y0 is not None:
        _mark_range(ax, ground.y0, ground.shows_y0)
    ax.set_aspect(ground.stretch, adjustable="box")
    # No heights where only arrows reach into the plate.
    lowest, highest = ground.ticks
    ticks = MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]).tick_values(lowest, panel.y.high)
    least = lowest - 1e-6 * highest
    ax.set_yticks([t for t in ticks if least <= t <= panel.y.high])


def _mark_range(ax: Axes, y0: float, shown: bool) -> None:
    """Draw the line y = y0 with its name in the right margin; an arrow says that it lies above."""
    if shown:
        line = ax.axhline(y0, color=style.RANGE, linewidth=1.2, linestyle=(0, (1, 1.5)), zorder=1)
        line.set_gid("y0")
    label = ax.annotate(
        "$y_0$" if shown else r"$y_0\!\uparrow$",
        xy=(1.0, y0 if shown else 1.0),
        xycoords=ax.get_yaxis_transform() if shown else "axes fraction",
        xytext=(4.0, 0.0),
        textcoords="offset points",
        va="center" if shown else "top",
        color=style.RANGE,
        fontsize=style.SMALL + 1.0,
        annotation_clip=False,
    )
    label.set_gid("y0-label")


def _caption(ax: Axes, panel: Panel) -> None:
    """Put the title above the picture, and under it in another colour what to beware of."""
    if panel.title:
        pad = _title_pad(len(panel.warnings))
        ax.set_title(panel.title, loc="left", fontsize=style.SMALL, pad=pad)
    if panel.warnings:
        note = ax.annotate(
            "\n".join(panel.warnings),
            xy=(0.0, 1.0),
            xycoords="axes fraction",
            xytext=(0.0, 5.0),
            textcoords="offset points",
            va="bottom",
            fontsize=style.SMALL,
            color=style.WARNING,
        )
        note.set_gid("flags")
