"""The pen for the page: `Panel` as Bokeh figures.

A pen says what it would set on which model, so that the page sets it and an exported page takes it down.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from bokeh.models import (
    BasicTickFormatter,
    BoxAnnotation,
    Column,
    ColumnDataSource,
    GlobalInlineStyleSheet,
    HoverTool,
    InlineStyleSheet,
    Label,
    Legend,
    LegendItem,
    Model,
    Range1d,
    Span,
)
from bokeh.plotting import figure

from ...plots import motion_panels as motions
from ...plots import scene as scenes
from ...plots import style
from ...plots.panels import Arrows, Line, Mark, Panel
from ...plots.words import plain
from . import look
from .film import Film
from .help import CAPTIONS, PURPOSE, WRITTEN_CAPTIONS, WRITTEN_PURPOSE, caption, header
from .screen import Screen
from .texts import film_headline, headline, text_box, wrapped

#: What to set: models with their properties.
Updates = list[tuple[Model, dict[str, Any]]]

#: Pixels to a point.
_PIXELS = 4.0 / 3.0

#: From a named point to the middle of its letter [pixels].
_LETTER_GAP = 13.0

#: A range is kept while what it shows fills at least this share of it, so that pictures stand still.
_STEADY = 0.72

#: What the figures show, by their names.
NAMES = {
    "rod": "shape of the rod",
    "diagram": "bifurcation diagram",
    "potential": "effective potential",
    "loop": "hysteresis loop",
    "motion": "front and tip against time",
    "ledger": "ledger of energies",
}

#: What stands in place of the rod, and whether it is still looked for.
NO_ROD = {False: "no such state: see below", True: "being solved"}

_MARKS = ("x", "y", "letter", "meaning", "colour", "face", "shape", "size", "dx", "dy")
_ARROWS = ("x0", "y0", "x1", "y1", "angle")
_PLATE = ("fill_color", "fill_alpha", "hatch_pattern", "hatch_color", "hatch_weight")


class Picture:
    """One figure: lines and arrows by look, marks, the dot that is the state, a legend.

    Parameters
    ----------
    name : str
        For tests and style sheets.
    looks, arrows : sequence of str
        Looks that it may have to draw, from the bottom to the top.
    ground : bool
        Whether it shows a rod, over a plate.
    """

    def __init__(
        self, name: str, looks: Sequence[str], arrows: Sequence[str] = (), *, ground: bool = False
    ) -> None:
        self.figure: Any = _figure(name)
        self.lines = {each: ColumnDataSource({"x": [], "y": []}) for each in looks}
        self.arrows = {each: ColumnDataSource({key: [] for key in _ARROWS}) for each in arrows}
        self.marks = ColumnDataSource(_marks(()))
        self.here = ColumnDataSource({"x": [], "y": []})
        self.items: dict[str, LegendItem] = {}
        self.ground: tuple[Span, Label] | None = None
        self.plate: BoxAnnotation | None = None
        self.solid = ColumnDataSource({"x": [], "y": []})
        if ground:
            self.ground, self.plate = self._lay()
        self._add_lines()
        self._add_arrows()
        self.legend = _legend(list(self.items.values()))
        self.figure.add_layout(self.legend, "above")
        self._add_marks()
        self.absent = Label(
            x=0.5 * look.FRAME_WIDTH,
            y=0.5 * look.FRAME_HEIGHT,
            x_units="screen",
            y_units="screen",
            text="",
            text_align="center",
            text_baseline="middle",
            text_color=look.FAINT,
            text_font_size="13px",
        )
        self.figure.add_layout(self.absent)

    # --- what it is made of ----------------------------------------------------------------

    def _lay(self) -> tuple[tuple[Span, Label], BoxAnnotation]:
        """Put the plate under the picture; return the line y = y0 with its name, and the plate."""
        fig = self.figure
        fig.x_range.update(start=-1.05, end=0.35)
        fig.y_range.update(start=-0.18, end=0.65)
        fig.grid.grid_line_color = None
        plate = BoxAnnotation(
            top=0.0,
            fill_color="#EFEFEF",
            fill_alpha=1.0,
            hatch_pattern="/",
            hatch_color="#C4C4C4",
            hatch_weight=1.0,
            line_color="#8A8A8A",
            level="underlay",
        )
        line = Span(
            dimension="width",
            location=0.0,
            line_color=style.RANGE,
            line_width=1.8,
            line_dash=[2, 3],
            visible=False,
        )
        name = Label(
            x=look.FRAME_WIDTH - 24,
            y=0.0,
            x_units="screen",
            text="y₀",
            text_color=style.RANGE,
            text_font_size="15px",
            text_font_style="bold",
            y_offset=2,
            visible=False,
        )
        for layer in (plate, line, name):
            fig.add_layout(layer)
        fig.patch(
            "x",
            "y",
            source=self.solid,
            level="underlay",
            line_color=None,
            **{name: getattr(plate, name) for name in _PLATE},
        )
        return (line, name), plate

    def _add_lines(self) -> None:
        for each, source in self.lines.items():
            stroke = style.STROKES[each]
            drawn = self.figure.line(
                "x",
                "y",
                source=source,
                line_color=stroke.colour,
                line_width=_PIXELS * stroke.width,
                line_dash=[max(round(_PIXELS * length), 1) for length in stroke.dash] or "solid",
            )
            self.items[each] = LegendItem(label=each, renderers=[drawn], visible=False)

    def _add_arrows(self) -> None:
        for each, source in self.arrows.items():
            stroke = style.STROKES[each]
            shaft = self.figure.segment(
                "x0",
                "y0",
                "x1",
                "y1",
                source=source,
                line_color=stroke.colour,
                line_width=_PIXELS * stroke.width,
            )
            self.figure.scatter(
                "x1",
                "y1",
                source=source,
                marker="triangle",
                angle="angle",
                size=8,
                fill_color="white" if stroke.hollow else stroke.colour,
                line_color=stroke.colour if stroke.hollow else None,
            )
            self.items[each] = LegendItem(label=each, renderers=[shaft], visible=False)

    def _add_marks(self) -> None:
        fig = self.figure
        drawn = fig.scatter(
            "x",
            "y",
            source=self.marks,
            marker="shape",
            size="size",
            fill_color="face",
            line_color="colour",
            line_width=1.5,
        )
        fig.text(
            "x",
            "y",
            "letter",
            source=self.marks,
            x_offset="dx",
            y_offset="dy",
            text_align="center",
            text_baseline="middle",
            text_color="colour",
            text_font_size="14px",
            text_font_style="bold",
        )
        fig.add_tools(HoverTool(renderers=[drawn], tooltips=[("", "@meaning")]))
        fig.scatter(
            "x", "y", source=self.here, size=15, fill_color=style.HERE, line_color=look.INK, line_width=1.8
        )

    # --- what it shows ---------------------------------------------------------------------

    def updates(self, heading: str, panel: Panel | None, absent: str = "") -> Updates:
        """Return what shows a picture under a heading; a few words where there is none."""
        fig, lines, arrows = self.figure, panel.lines if panel else (), panel.arrows if panel else ()
        here = panel.here if panel else None
        # Axes of nothing would be wrong ones.
        found: Updates = [(each, {"visible": panel is not None}) for each in (*fig.axis, *fig.grid)]
        found += [
            (fig.title, {"text": _in_two_lines(heading)}),
            (fig.xaxis[0], {"axis_label": plain(panel.x.label) if panel else ""}),
            (fig.yaxis[0], {"axis_label": plain(panel.y.label) if panel else ""}),
            (self.absent, {"text": "" if panel else wrapped(absent)}),
            (self.marks, {"data": _marks(panel.marks if panel else ())}),
            (self.here, {"data": _point(here)}),
        ]
        labels = dict.fromkeys(self.items, "")
        for each, source in self.lines.items():
            pieces = [line for line in lines if line.look == each]
            labels[each] = next((line.label for line in pieces if line.label), "")
            found.append((source, {"data": _joined(pieces)}))
        for each, pointing in self.arrows.items():
            drawn = [group for group in arrows if group.look == each]
            labels[each] = drawn[0].label if drawn else ""
            stretch = panel.ground.stretch if panel and panel.ground else 1.0
            found.append((pointing, {"data": _pointing(drawn, stretch)}))
        for each, item in self.items.items():
            shown = {"label": {"value": plain(labels[each])}} if labels[each] else {}
            found.append((item, {"visible": bool(labels[each]), **shown}))
        return found + (self._empty() if panel is None else self._spans(panel))

    def place(self, here: tuple[float, float] | None) -> Updates:
        """Return what puts the dot where the state is."""
        return [(self.here, {"data": _point(here)})]

    def _empty(self) -> Updates:
        if self.ground is not None:
            none = (self.solid, {"data": {"x": np.empty(0), "y": np.empty(0)}})
            return [*((each, {"visible": False}) for each in self.ground), none]
        ends = {"start": 0.0, "end": 1.0, "reset_start": 0.0, "reset_end": 1.0}
        return [(shown, ends) for shown in (self.figure.x_range, self.figure.y_range)]

    def _spans(self, panel: Panel) -> Updates:
        """Return what shows the ranges of a picture."""
        x, y = self.figure.x_range, self.figure.y_range
        if self.ground is None or self.plate is None or panel.ground is None:
            return [*_fit(x, panel.x.low, panel.x.high), *_fit(y, panel.y.low, panel.y.high)]
        # Both scales as the stretch says; what is left over is shown on both sides, and above.
        stretch, wide, high = panel.ground.stretch, look.FRAME_WIDTH, look.FRAME_HEIGHT
        pixel = max((panel.x.high - panel.x.low) / wide, stretch * (panel.y.high - panel.y.low) / high)
        middle, low = 0.5 * (panel.x.low + panel.x.high), panel.y.low
        line, name = self.ground
        shows, y0 = panel.ground.shows_y0, panel.ground.y0
        x_solid, y_solid = panel.ground.solid or (np.empty(0), np.empty(0))
        return [
            (self.plate, {"visible": panel.ground.solid is None}),
            (self.solid, {"data": {"x": x_solid, "y": y_solid}}),
            *_fit(x, middle - 0.5 * pixel * wide, middle + 0.5 * pixel * wide, steady=False),
            *_fit(y, low, low + pixel * high / stretch, steady=False),
            (line, {"visible": shows, **({"location": y0} if shows else {})}),
            (name, {"visible": shows, **({"y": y0} if shows else {})}),
        ]


class FourPanels:
    """Rod, diagram, potential and loop under a headline.

    Parameters
    ----------
    live : bool
        Whether there is a server behind them: two more panels then take the place of potential and loop
        while a motion is shown, and the loop can be swept.
    """

    def __init__(self, *, live: bool) -> None:
        self.live = live
        self.rod = Picture(
            "rod",
            scenes.LINES,
            scenes.ARROWS,
            ground=True,
        )
        spurious = ("spurious", "spurious-unstable", "spurious-stable")
        known = ("own", "unknown", "branch", "unstable", "stable", "orbit")
        self.diagram = Picture("diagram", ("straight", "straight-unstable", *spurious, *known))
        self.potential = Picture("potential", ("fold", "maxwell", "delay", "current"))
        # Short labels, so that the frame stays in line with those above it.
        self.potential.figure.yaxis.formatter = BasicTickFormatter(power_limit_high=4, precision=1)
        self.loop = Picture("loop", ("between", "down", "up"))
        pictures = {"motion": motions.LENGTHS, "ledger": motions.LEDGER} if live else {}
        self.film = tuple(Picture(name, looks) for name, looks in pictures.items())
        self.headline = text_box("headline", "status")
        self.headline.styles = {**self.headline.styles, "min-height": "42px"}  # panels stay where they are
        self.progress = text_box("progress", "status")
        self.progress.stylesheets = [InlineStyleSheet(css=look.PROGRESS)]
        captions = CAPTIONS if live else WRITTEN_CAPTIONS
        self.boxes = {
            each.figure.name: Column(
                each.figure, caption(each.figure.name, captions[each.figure.name]), spacing=0
            )
            for each in self.every
        }
        apply(self.filming(on=False))
        self.grid = Column(
            *self.boxes.values(),
            name="panels",
            styles={"background": look.PAPER},  # of the saved picture too
            stylesheets=[InlineStyleSheet(css=look.PANELS)],
        )

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """The panels of a state, in reading order."""
        return self.rod, self.diagram, self.potential, self.loop

    @property
    def every(self) -> tuple[Picture, ...]:
        """These, and those of a motion."""
        return (*self.pictures, *self.film)

    @property
    def named(self) -> dict[str, Any]:
        """The figures by what they show, in reading order."""
        return {NAMES[picture.figure.name]: picture.figure for picture in self.every}

    def page(self, controls: Column, trust: Model, notes: Model, player: Sequence[Model] = ()) -> Column:
        """Return the whole page: controls, panels with what is said below them, how far to trust them.

        ``player`` stands above the panels.
        """
        controls.stylesheets = [InlineStyleSheet(css=look.CONTROLS)]
        main = Column(
            self.headline,
            self.progress,
            *player,
            self.grid,
            notes,
            spacing=0,
            sizing_mode="stretch_width",
            stylesheets=[InlineStyleSheet(css=look.MAIN)],
        )
        return Column(
            header(PURPOSE if self.live else WRITTEN_PURPOSE),
            controls,
            main,
            trust,
            name="page",
            sizing_mode="stretch_width",
            stylesheets=[GlobalInlineStyleSheet(css=look.GLOBAL), InlineStyleSheet(css=look.PAGE)],
        )

    def updates(self, screen: Screen) -> Updates:
        """Return what shows a screen."""
        return [
            *self.moving(screen),
            *self.diagram.updates(screen.headings["diagram"], screen.diagram, screen.no_diagram),
            *self.loop.updates(screen.headings["loop"], screen.loop, screen.no_loop),
        ]

    def filming(self, *, on: bool) -> Updates:
        """Return what puts the pictures of a motion in place of potential and loop, or back."""
        own = [picture.figure.name for picture in self.film]
        return [
            (box, {"visible": (name in own) == on})
            for name, box in self.boxes.items()
            if name not in ("rod", "diagram")
        ]

    def film_begins(self, film: Film, diagram: Panel | None) -> Updates:
        """Return what shows a film: its pictures, and the motion in the diagram where that is its rod's."""
        lengths, ledger = self.film
        panels = film.panels
        return [
            *self.filming(on=True),
            *lengths.updates("Front and tip", panels.lengths),
            *ledger.updates("Where the work goes", panels.ledger),
            *self.diagram.updates("Bifurcation diagram, and the motion across it", diagram, "not traced"),
            (self.headline, {"text": film_headline(film)}),
        ]

    def film_at(self, film: Film, t: float, place: tuple[float, float] | None) -> Updates:
        """Return what shows a moment of a film; ``place`` is where it is in the diagram."""
        lengths, ledger = self.film
        front, work = film.panels.here(t)
        return [
            *self.rod.updates("Rod in motion", film.panels.rod(t)),
            *self.diagram.place(place),
            *lengths.place(front),
            *ledger.place(work),
        ]

    def moving(self, screen: Screen) -> Updates:
        """Return what changes with every frame of a sweep."""
        return [
            *self.rod.updates("Rod", screen.rod, NO_ROD[screen.solving]),
            *self.potential.updates(screen.headings["potential"], screen.potential, screen.no_potential),
            (self.headline, {"text": headline(screen)}),
        ]


def apply(updates: Updates) -> None:
    """Set what differs; what the browser has already is not sent again."""
    for model, attributes in updates:
        data = attributes.get("data")
        if data is not None and isinstance(model, ColumnDataSource):
            old = model.data
            if old.keys() == data.keys() and all(_same(old[key], column) for key, column in data.items()):
                continue
        model.update(**attributes)


def _in_two_lines(heading: str) -> str:
    """Return a heading that fits into a narrow panel; all have as many lines, so that frames are in line."""
    name, _, more = heading.partition(", ")
    return f"{name}\n{more or ' '}"


def _figure(name: str) -> Any:
    fig: Any = figure(
        title="",
        frame_width=look.FRAME_WIDTH,
        frame_height=look.FRAME_HEIGHT,
        min_border_left=look.LEFT,
        min_border_right=look.RIGHT,
        min_border_bottom=50,
        x_range=Range1d(0.0, 1.0),
        y_range=Range1d(0.0, 1.0),
        tools="pan,box_zoom,wheel_zoom,reset,save",
        active_drag=None,
        name=name,
    )
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
    return fig


def _legend(items: list[LegendItem]) -> Legend:
    return Legend(
        items=items,
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


def _point(here: tuple[float, float] | None) -> dict[str, list[float]]:
    return {"x": [], "y": []} if here is None else {"x": [here[0]], "y": [here[1]]}


def _marks(marks: Iterable[Mark]) -> dict[str, list[Any]]:
    rows = []
    for mark in marks:
        marker = style.marker(mark.look)
        colour = style.STROKES[mark.of].colour if mark.of else marker.colour
        letter, meaning = plain(mark.text), plain(mark.meaning)
        rows.append(
            (
                mark.x,
                mark.y,
                letter,
                f"{letter}: {meaning}" if letter else meaning,
                colour,
                "white" if marker.hollow else colour,
                marker.bokeh,
                1.4 * marker.size,
                _LETTER_GAP * mark.away[0],
                -_LETTER_GAP * mark.away[1],  # down the screen
            )
        )
    # BokehJS looks at the colour of a first letter even where there is none: a place that is nowhere has one.
    nowhere = (math.nan, math.nan, "", "", style.ROD, style.ROD, "circle", 0.0, 0.0, 0.0)
    columns = zip(*(rows or [nowhere]), strict=True)
    return {key: list(column) for key, column in zip(_MARKS, columns, strict=True)}


def _joined(pieces: Iterable[Line]) -> dict[str, np.ndarray]:
    """Pieces of one look as one line with gaps between."""
    parts = [np.stack([piece.x, piece.y]) for piece in pieces if len(piece.x)]
    if not parts:
        return {"x": np.empty(0), "y": np.empty(0)}
    gap = np.full((2, 1), np.nan)
    x, y = np.concatenate([each for part in parts for each in (part, gap)][:-1], axis=1)
    return {"x": x, "y": y}


def _pointing(drawn: Sequence[Arrows], stretch: float) -> dict[str, Any]:
    if not drawn:
        return {key: np.empty(0) for key in _ARROWS}
    (group,) = drawn
    turned = np.arctan2(stretch * (group.y1 - group.y0), group.x1 - group.x0) - 0.5 * math.pi
    return {"x0": group.x0, "y0": group.y0, "x1": group.x1, "y1": group.y1, "angle": turned}


def _fit(shown: Range1d, low: float, high: float, *, steady: bool = True) -> Updates:
    """Return what shows a range, unless what is shown holds it and it fills well enough."""
    start, end = float(shown.start), float(shown.end)
    inside = start <= low + 1e-9 * (high - low) and high - 1e-9 * (high - low) <= end
    if steady and inside and high - low >= _STEADY * (end - start):
        return [(shown, {"start": start, "end": end})]
    # The reset tool goes back there too.
    return [(shown, {"start": low, "end": high, "reset_start": low, "reset_end": high})]


def _same(old: Any, new: Any) -> bool:
    if len(old) != len(new):
        return False
    if isinstance(new, np.ndarray):
        return bool(np.array_equal(old, new, equal_nan=True))
    return list(old) == list(new)
