"""The page that is written to a file: four panels, a slider, a choice of problems, a caption."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from bokeh.document import Document
from bokeh.models import (
    Button,
    Column,
    ColumnDataSource,
    CustomJS,
    Div,
    InlineStyleSheet,
    Model,
    RadioButtonGroup,
    Row,
    Select,
    Slider,
    Toggle,
)

from . import look
from .downloads import picture
from .fit import fit
from .panels import FourPanels, Updates, apply
from .screen import Screen
from .spoken import spoken
from .texts import notes, text_box

#: Time from one picture to the next while it plays [ms].
FRAME = 120

#: A model, the name of an attribute, and that of a column where this is a table.
Slot = tuple[Model, str, str]

#: Shows the picture whose number the player holds: sets what differs from what is shown.
_SHOW = """
const columns = ({data}) => Object.fromEntries(data instanceof Map ? data : Object.entries(data))
const kept = (values, ends, k) => ends.length == 0 ? values[k]
    : Array.from(new Float32Array(values.buffer, values.byteOffset + 4*ends[k], ends[k + 1] - ends[k]))
const row = rows[player.data.number[0]], before = globalThis.peel_opt_shown ?? [], changes = new Map()
row.forEach((value, k) => {
    if (value < 0 || value === before[k]) return
    const [model, name, key, values, ends] = slots[k], found = changes.get(model) ?? {}
    if (key) (found[name] ??= columns(model))[key] = kept(values, ends, value)
    else found[name] = values[value]
    changes.set(model, found)
})
globalThis.peel_opt_shown = row
for (const [model, attributes] of changes) model.setv(attributes)
"""

#: Shows the place of the slider within the chosen problem.
_MOVED = """
const [first, count] = spans[problem.data.chosen[0]]
player.data = {number: [first + Math.min(Math.max(Math.round(slider.value), 1), count) - 1]}
"""

#: One of the relatives is chosen, or another problem to begin with; each takes the mark off the other.
_CHOICE = """
if (choice.active != null) { begin.value = ""; problem.data = {chosen: [choice.active]} }
"""
_BEGIN = """
if (begin.value != "") { choice.active = null; problem.data = {chosen: [Number(begin.value)]} }
"""

#: Goes to the state of a problem to begin with; among relatives keeps the share of the branch.
_CHOSEN = """
const which = problem.data.chosen[0], [first, count] = spans[which]
const share = (slider.value - 1) / Math.max(slider.end - 1, 1)
const value = which < relatives ? Math.min(1 + Math.round(share * (count - 1)), count) : opens[which] + 1
slider.setv({end: Math.max(count, 2), value})
player.data = {number: [first + value - 1]}
"""

#: Shows the place of the branch nearest to a click, in shares of the picture.
_TAPPED = """
const [first, count] = spans[problem.data.chosen[0]], {x_range, y_range} = figure
const off = ([x, y]) => Math.hypot(
    (x - cb_obj.x) / (x_range.end - x_range.start), (y - cb_obj.y) / (y_range.end - y_range.start))
let best = 0
for (let i = 1; i < count; i++) if (off(places[first + i]) < off(places[first + best])) best = i
slider.value = best + 1
"""

#: Goes along the branch, from its beginning where it is at the end.
_PLAYED = """
clearInterval(globalThis.peel_opt_timer)
play.label = play.active ? "■ Stop" : "▶ Play"
if (play.active) {
    const last = () => spans[problem.data.chosen[0]][1]
    if (slider.value >= last()) slider.value = 1
    globalThis.peel_opt_timer = setInterval(() => {
        if (slider.value >= last()) play.active = false
        else slider.value += 1
    }, FRAME)
}
""".replace("FRAME", str(FRAME))


class Chosen(NamedTuple):
    """The pictures of one choice, in order, the number of that at which it opens, and under which heading.

    Relatives of what was asked for, which has ``asked``, have no heading.
    """

    name: str
    screens: Sequence[Screen]
    opens: int
    asked: bool = False
    heading: str = ""


class Pictures:
    """The different values of each attribute of a model, or column of a table, and rows of their numbers."""

    def __init__(self) -> None:
        self._values: dict[Slot, dict[str, tuple[int, Any]]] = {}
        self._rows: list[dict[Slot, int]] = []

    def take(self, updates: Updates) -> None:
        """Take down a picture."""
        row = {}
        for model, attributes in updates:
            for name, value in attributes.items():
                for key, each in value.items() if name == "data" else [("", value)]:
                    kept = _single(each) if key else each
                    known = self._values.setdefault((model, name, key), {})
                    written = kept.tobytes().hex() if isinstance(kept, np.ndarray) else repr(kept)
                    row[model, name, key], _ = known.setdefault(written, (len(known), kept))
        self._rows.append(row)

    def player(self) -> ColumnDataSource:
        """Return a source that shows the picture whose number is put into its column "number"."""
        source = ColumnDataSource({"number": [0]}, name="player")
        slots = [
            [*slot, *_pooled([kept for _, kept in known.values()])] for slot, known in self._values.items()
        ]
        rows = [[row.get(slot, -1) for slot in self._values] for row in self._rows]
        code = CustomJS(args={"slots": slots, "rows": rows, "player": source}, code=_SHOW)
        source.js_on_change("data", code)
        return source


def _single(column: Any) -> Any:
    """Return a column with the digits of single precision, its words as they are."""
    values = np.asarray(column)
    return values.astype("<f4") if values.dtype.kind in "fiu" else list(column)


def _pooled(values: list[Any]) -> tuple[Any, list[int]]:
    """Return columns of numbers one after the other and where each ends; anything else as it is."""
    if not all(isinstance(value, np.ndarray) for value in values):
        return [list(v) if isinstance(v, np.ndarray) else v for v in values], []
    return np.concatenate(values), [0, *np.cumsum([len(value) for value in values]).tolist()]


def document(shown: Sequence[Chosen], choice: str, caption: str) -> Document:
    """Return the page of some choices, relatives first; ``choice`` names what the buttons choose among these.

    The caption is markup.
    """
    panels, pictures = FourPanels(live=False), Pictures()
    said = text_box("notes", "status")
    trust = text_box("trust", "status")

    def updates(screen: Screen) -> Updates:
        return [
            *panels.updates(screen),
            (said, {"text": notes(screen, ())}),
            (trust, {"text": _trust(screen)}),
        ]

    places: list[Any] = []
    spans: list[list[int]] = []
    for chosen in shown:
        spans.append([len(places), len(chosen.screens)])
        for screen in chosen.screens:
            found = updates(screen)
            apply(found)  # ranges are kept from one picture to the next
            pictures.take(found)
            places.append(screen.diagram.here if screen.diagram else None)
    opening = next((i for i, chosen in enumerate(shown) if chosen.asked), 0)
    at = shown[opening].opens
    first = shown[opening].screens[at]
    apply(updates(first))
    player, grid = pictures.player(), panels.grid
    style = InlineStyleSheet(css=look.WIDGETS)
    slider = Slider(
        start=1,
        end=max(spans[opening][1], 2),
        value=at + 1,
        step=1,
        title="place along the branch",
        name="place",
        sizing_mode="stretch_width",
        stylesheets=[style],
    )
    names = [chosen.name for chosen in shown if not chosen.heading]
    buttons = RadioButtonGroup(
        labels=names,
        active=opening if opening < len(names) else None,
        name="choice",
        orientation="horizontal" if sum(map(len, names)) < 24 else "vertical",
        sizing_mode="stretch_width",
        stylesheets=[style],
    )
    begin, problem = _beginning(shown), ColumnDataSource({"chosen": [opening]}, name="problem")
    play = Toggle(label="▶ Play", name="play", width=90, stylesheets=[style])
    saves = []
    for kind in ("png", "svg"):
        saves.append(Button(label=kind.upper(), name=f"save-{kind}", width=56, stylesheets=[style]))
        saves[-1].js_on_click(picture(grid, kind))
    shared = {"player": player, "slider": slider, "choice": buttons, "play": play, "spans": spans}
    shared |= {"figure": panels.diagram.figure, "places": places, "begin": begin, "problem": problem}
    shared |= {"relatives": len(names), "opens": [chosen.opens for chosen in shown]}
    tell = spoken({slider: None}, {buttons: choice, play: "Sweep"}, panels.named)
    for widget, changed, code in (
        (slider, "value", _MOVED),
        (buttons, "active", _CHOICE),
        (begin, "value", _BEGIN),
        (problem, "data", _CHOSEN),
        (play, "active", _PLAYED),
    ):
        widget.js_on_change(changed, CustomJS(args=shared, code=code), tell)
    panels.diagram.figure.js_on_event("tap", CustomJS(args=shared, code=_TAPPED))
    controls = Column(
        *([begin] if any(chosen.heading for chosen in shown) else []),
        Column(_text(choice), buttons, spacing=0, sizing_mode="stretch_width"),
        slider,
        Row(play, *saves, spacing=4),
        width=look.SIDE,
        spacing=8,
    )
    below = Column(trust, _text(caption), spacing=8, stylesheets=[InlineStyleSheet(css=look.TRUST)])
    doc = Document()
    doc.js_on_event("document_ready", tell, fit(panels.pictures))
    doc.title = f"peel_opt: {first.state.words}"
    doc.add_root(panels.page(controls, below, said))
    doc.add_root(player)
    doc.add_root(problem)
    return doc


def _beginning(shown: Sequence[Chosen]) -> Select:
    """Return what chooses a problem to begin with."""
    options: dict[str, list[tuple[str, str]]] = {"": [("", "…")]}
    for number, chosen in enumerate(shown):
        if chosen.heading:
            options.setdefault(chosen.heading, []).append((str(number), chosen.name))
    return Select(
        title="Begin with",
        options=options,
        value="",
        name="begin",
        sizing_mode="stretch_width",
        stylesheets=[InlineStyleSheet(css=look.WIDGETS)],
    )


def _trust(screen: Screen) -> str:
    """How far to trust a picture, part by part, as markup."""
    rows = "".join(
        f'<tr><td style="vertical-align:top; padding-right:8px">{html.escape(part.name)}</td>'
        f"<td>{html.escape(part.error)}, {html.escape(part.method)}</td></tr>"
        for part in screen.parts
    )
    return f'<b>Error of this picture</b><table style="border-spacing:0 2px">{rows}</table>'


def _text(markup: str) -> Div:
    return Div(
        text=markup,
        sizing_mode="stretch_width",
        styles={"font-size": "12px", "color": look.FAINT, "line-height": "1.35"},
    )
