"""What the four panels have in common as Bokeh figures: lines by look, marks, the dot, the legend."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from bokeh.models import (
    ColumnDataSource,
    HoverTool,
    Label,
    Legend,
    LegendItem,
    Range1d,
)
from bokeh.plotting import figure

from . import look
from .panels import Axis, Line, Mark

#: A range is kept while what it shows fills at least this share of it, so that pictures stand still.
_STEADY = 0.72


class Panel:
    """A figure, its lines by look, its marks and the dot that is the state.

    Parameters
    ----------
    title : str
    looks : iterable of str
        Of the lines it may have to draw, from the bottom to the top.
    name : str
        For tests and style sheets.
    """

    def __init__(self, title: str, looks: Iterable[str], name: str) -> None:
        self.figure: Any = figure(
            title=title,
            frame_width=look.FRAME_WIDTH,
            frame_height=look.FRAME_HEIGHT,
            min_border_left=look.LEFT,
            min_border_right=14,
            min_border_bottom=50,
            x_range=Range1d(0.0, 1.0),
            y_range=Range1d(0.0, 1.0),
            tools="pan,box_zoom,wheel_zoom,reset,save",
            active_drag=None,
            name=name,
        )
        fig = self.figure
        fig.toolbar.logo = None
        fig.toolbar.autohide = True
        fig.toolbar_inner = True
        fig.outline_line_color = None
        fig.grid.grid_line_color = "#ECECEC"
        fig.title.text_font_size, fig.title.text_color = "13.5px", look.INK
        for axis in fig.axis:
            axis.axis_label_text_font_size, axis.axis_label_text_font_style = "14px", "normal"
            axis.axis_label_text_color = axis.major_label_text_color = look.INK
            axis.major_label_text_font_size = "12.5px"
            axis.minor_tick_line_color = None
        self.lines: dict[str, ColumnDataSource] = {}
        self.items: dict[str, LegendItem] = {}
        for each in looks:
            stroke = look.STROKES[each]
            source = self.lines[each] = ColumnDataSource({"x": [], "y": []})
            drawn = fig.line(
                "x",
                "y",
                source=source,
                line_color=stroke.colour,
                line_width=stroke.width,
                line_dash=stroke.dash,
            )
            self.items[each] = LegendItem(label=each, renderers=[drawn], visible=False)
        self.legend = Legend(
            items=list(self.items.values()),
            location="left",
            orientation="horizontal",
            label_text_font_size="12px",
            label_standoff=3,
            glyph_width=20,
            glyph_height=10,
            spacing=6,
            padding=0,
            margin=1,
            border_line_color=None,
            background_fill_alpha=0.0,
        )
        fig.add_layout(self.legend, "above")
        self.marks = ColumnDataSource(
            {name: [] for name in ("x", "y", "letter", "meaning", "colour", "shape")}
        )
        drawn = fig.scatter(
            "x",
            "y",
            source=self.marks,
            marker="shape",
            size=10,
            fill_color="colour",
            line_color="white",
        )
        fig.text(
            "x",
            "y",
            "letter",
            source=self.marks,
            x_offset=7,
            y_offset=-5,
            text_color="colour",
            text_font_size="14px",
            text_font_style="bold",
        )
        fig.add_tools(HoverTool(renderers=[drawn], tooltips=[("", "@letter: @meaning")]))
        self.here = ColumnDataSource({"x": [], "y": []})
        fig.scatter(
            "x", "y", source=self.here, size=15, fill_color=look.HERE, line_color=look.INK, line_width=1.8
        )
        self.absent = Label(
            x=0.5 * look.FRAME_WIDTH,
            y=0.5 * look.FRAME_HEIGHT,
            x_units="screen",
            y_units="screen",
            text="",
            text_align="center",
            text_baseline="middle",
            text_color=look.FAINT,
            text_font_size="14px",
        )
        fig.add_layout(self.absent)

    def draw(self, x: Axis, y: Axis, lines: Iterable[Line], marks: Iterable[Mark] = ()) -> None:
        """Show lines and marks; pieces of one look become one line with gaps."""
        self.absent.text = ""
        fig = self.figure
        fig.xaxis.axis_label, fig.yaxis.axis_label = x.label, y.label
        pieces: dict[str, list[Line]] = {name: [] for name in self.lines}
        for line in lines:
            pieces[line.look].append(line)
        for name, drawn in pieces.items():
            _set(self.lines[name], {"x": _joined(p.x for p in drawn), "y": _joined(p.y for p in drawn)})
            label = next((p.label for p in drawn if p.label), "")
            item = self.items[name]
            item.visible = bool(label)
            if label:
                item.label = {"value": label}
        listed = list(marks)
        looks = [look.MARKS.get(mark.look, (look.INK, "circle")) for mark in listed]
        columns = {
            "x": [mark.x for mark in listed],
            "y": [mark.y for mark in listed],
            "letter": [mark.letter for mark in listed],
            "meaning": [mark.meaning for mark in listed],
            "colour": [colour for colour, _ in looks],
            "shape": [shape for _, shape in looks],
        }
        _set(self.marks, columns)

    def place(self, here: tuple[float, float] | None) -> None:
        """Put the dot where the state is."""
        _set(self.here, {"x": [], "y": []} if here is None else {"x": [here[0]], "y": [here[1]]})

    def title(self, text: str) -> None:
        """Name the picture."""
        self.figure.title.text = text

    def span(self, x: Axis, y: Axis) -> None:
        """Show these ranges, unless what is shown holds and fills well enough."""
        for shown, axis in ((self.figure.x_range, x), (self.figure.y_range, y)):
            _fit(shown, axis.low, axis.high)

    def empty(self, title: str, text: str) -> None:
        """Show a title and a few words, and axes of nothing."""
        self.clear(text)
        self.title(title)
        fig = self.figure
        fig.xaxis.axis_label = fig.yaxis.axis_label = ""
        for shown in (fig.x_range, fig.y_range):
            shown.update(start=0.0, end=1.0, reset_start=0.0, reset_end=1.0)

    def clear(self, text: str) -> None:
        """Show nothing but a few words."""
        for source in (*self.lines.values(), self.here):
            source.data = {"x": [], "y": []}
        self.marks.data = {name: [] for name in self.marks.data}
        for item in self.items.values():
            item.visible = False
        self.absent.text = text


def _set(source: ColumnDataSource, data: dict[str, Any]) -> None:
    """Send data to the browser unless it has them already."""
    old = source.data
    if old.keys() == data.keys() and all(_same(old[name], column) for name, column in data.items()):
        return
    source.data = data


def _same(old: Any, new: Any) -> bool:
    if len(old) != len(new):
        return False
    if isinstance(new, np.ndarray):
        return bool(np.array_equal(old, new, equal_nan=True))
    return list(old) == list(new)


def _joined(parts: Iterable[Any]) -> np.ndarray:
    """Put pieces after each other with gaps between."""
    pieces: list[Any] = []
    for part in parts:
        pieces += [part, [np.nan]] if len(part) else []
    return np.concatenate(pieces[:-1]) if pieces else np.empty(0)


def _fit(shown: Range1d, low: float, high: float) -> None:
    start, end = float(shown.start), float(shown.end)
    inside = start <= low + 1e-9 * (high - low) and high - 1e-9 * (high - low) <= end
    if inside and high - low >= _STEADY * (end - start):
        return
    shown.start, shown.end = low, high
    # What the reset tool goes back to.
    shown.reset_start, shown.reset_end = low, high
