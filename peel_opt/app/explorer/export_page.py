"""The page that is written to a file: four panels, a slider, a choice of problems, a caption."""

from __future__ import annotations

import html
import json
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.models import (
    Button,
    Column,
    ColumnDataSource,
    CustomJS,
    Div,
    GlobalInlineStyleSheet,
    InlineStyleSheet,
    Model,
    RadioButtonGroup,
    Row,
    Slider,
    Toggle,
)

from . import look
from .downloads import picture
from .panels import FourPanels, Updates, apply
from .screen import Screen
from .spoken import spoken
from .texts import notes, text_box

#: Time from one picture to the next while it plays [ms].
FRAME = 120

#: Shows the picture whose number the player holds: copies the columns that differ from what is shown.
_SHOW = """
const {slots, rows, values, columns, state} =
    (globalThis.peel_opt_pictures ??= {...JSON.parse(text), state: {shown: -1}})
const column = (entry) => entry.length == 2
    ? Array.from(new Float32Array(pool.buffer, pool.byteOffset + 4*entry[0], entry[1])) : entry[0]
const n = player.data.number[0], before = rows[state.shown] ?? [], changes = new Map()
rows[n].forEach((value, k) => {
    if (value < 0 || value === before[k]) return
    const [model, name] = slots[k], {table, plain} = values[value]
    const found = table === undefined
        ? plain : Object.fromEntries(Object.entries(table).map(([key, i]) => [key, column(columns[i])]))
    changes.set(model, {...changes.get(model), [name]: found})
})
state.shown = n
for (const [model, attributes] of changes) models[model].setv(attributes)
"""

#: Shows the place of the slider within the chosen problem.
_MOVED = """
const [first, count] = spans[choice.active]
player.data = {number: [first + Math.min(Math.max(Math.round(slider.value), 1), count) - 1]}
"""

#: Keeps the share of the branch when the problem changes.
_CHOSEN = """
const [first, count] = spans[choice.active]
const share = (slider.value - 1) / Math.max(slider.end - 1, 1)
const value = Math.min(1 + Math.round(share * (count - 1)), count)
slider.setv({end: Math.max(count, 2), value})
player.data = {number: [first + value - 1]}
"""

#: Shows the place of the branch nearest to a click, in shares of the picture.
_TAPPED = """
const [first, count] = spans[choice.active], {x_range, y_range} = figure
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
    const last = () => spans[choice.active][1]
    if (slider.value >= last()) slider.value = 1
    globalThis.peel_opt_timer = setInterval(() => {
        if (slider.value >= last()) play.active = false
        else slider.value += 1
    }, FRAME)
}
""".replace("FRAME", str(FRAME))


class Pictures:
    """What each picture sets, on all models: a row of numbers of values that all pictures share."""

    def __init__(self) -> None:
        self._slots: dict[tuple[Model, str], int] = {}
        self._values: dict[str, int] = {}
        self._columns: dict[bytes, int] = {}
        self._stored: list[list[Any]] = []
        self._pool = bytearray()
        self._rows: list[dict[int, int]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def take(self, updates: Updates) -> None:
        """Take down a picture."""
        row = {}
        for model, attributes in updates:
            for name, value in attributes.items():
                entry: dict[str, Any] = {"plain": value}
                if name == "data":
                    entry = {"table": {key: self._column(value[key]) for key in value}}
                number = self._values.setdefault(json.dumps(entry, allow_nan=False), len(self._values))
                row[self._slots.setdefault((model, name), len(self._slots))] = number
        self._rows.append(row)

    def _column(self, column: Any) -> int:
        """Return the number of a column; numbers go to the pool with the digits of single precision."""
        values = np.asarray(column)
        words = len(values) > 0 and values.dtype.kind not in "fiu"
        single = b"" if words else values.astype("<f4").tobytes()
        key = repr(list(column)).encode() if words else b"f" + single
        if key not in self._columns:
            self._columns[key] = len(self._stored)
            self._stored.append([list(column)] if words else [len(self._pool) // 4, len(single) // 4])
            self._pool += single
        return self._columns[key]

    def player(self) -> ColumnDataSource:
        """Return a source that shows the picture whose number is put into its column "number"."""
        models = list(dict.fromkeys(model for model, _ in self._slots))
        store = {
            "slots": [[models.index(model), name] for model, name in self._slots],
            "rows": [[row.get(k, -1) for k in range(len(self._slots))] for row in self._rows],
            "values": [json.loads(text) for text in self._values],
            "columns": self._stored,
        }
        # As one text: Bokeh would wrap every dictionary in it.
        text = json.dumps(store, separators=(",", ":"), ensure_ascii=False)
        source = ColumnDataSource({"number": [0]}, name="player")
        args = {"models": models, "text": text, "pool": np.frombuffer(bytes(self._pool), "<f4")}
        source.js_on_change("data", CustomJS(args={**args, "player": source}, code=_SHOW))
        return source


class ExportPage:
    """A page that is filled picture by picture and then finished."""

    def __init__(self) -> None:
        self.panels = FourPanels()
        self.notes = text_box("notes", "status", self.panels.width)
        self.trust = text_box("trust", "status", look.SIDE - 8)
        self.pictures = Pictures()
        self._spans: list[tuple[int, int]] = []
        self._names: list[str] = []
        self._places: list[tuple[float, float]] = []
        self._start: tuple[int, int, Screen] | None = None
        self._scenes: dict[int, Screen] = {}

    def take(self, scene: Screen) -> int:
        """Take down a scene that has an answer, and return its number."""
        updates = self._updates(scene)
        # Ranges are kept from one picture to the next.
        apply(updates)
        here = scene.diagram.here
        assert here is not None
        self._places.append(here)
        self.pictures.take(updates)
        number = len(self.pictures) - 1
        self._scenes[number] = scene
        return number

    def close(self, name: str, start: int | None) -> None:
        """End a problem; the page opens at picture ``start`` of the one that has it."""
        first = sum(count for _, count in self._spans)
        count = len(self.pictures) - first
        if count:
            self._spans.append((first, count))
            self._names.append(name)
            if start is not None or self._start is None:
                at = first if start is None else start
                self._start = len(self._spans) - 1, at - first, self._scenes[at]
        self._scenes.clear()

    def _updates(self, scene: Screen) -> Updates:
        rows = "".join(
            f'<tr><td style="vertical-align:top; padding-right:8px">{html.escape(part.name)}</td>'
            f"<td>{html.escape(part.error)}, {html.escape(part.method)}</td></tr>"
            for part in scene.parts
        )
        trust = f'<b>Error of this picture</b><table style="border-spacing:0 2px">{rows}</table>'
        return [
            *self.panels.updates(scene),
            (self.notes, {"text": notes(scene, ())}),
            (self.trust, {"text": trust}),
        ]

    def finish(self, choice: str, caption: str) -> Document:
        """Return the document; ``choice`` names what the buttons choose."""
        assert self._start is not None
        problem, at, scene = self._start
        apply(self._updates(scene))
        count = self._spans[problem][1]
        player = self.pictures.player()
        style = InlineStyleSheet(css=look.WIDGETS)
        slider = Slider(
            start=1,
            end=max(count, 2),
            value=at + 1,
            step=1,
            title="place along the branch",
            name="place",
            width=look.SIDE - 24,
            stylesheets=[style],
        )
        buttons = RadioButtonGroup(
            labels=self._names,
            active=problem,
            name="choice",
            orientation="horizontal" if len("".join(self._names)) < 24 else "vertical",
            width=look.SIDE - 8,
            stylesheets=[style],
        )
        play = Toggle(label="▶ Play", name="play", width=90, stylesheets=[style])
        grid = self.panels.grid()
        saves = [
            Button(label=kind.upper(), name=f"save-{kind}", width=56, stylesheets=[style])
            for kind in ("png", "svg")
        ]
        for button in saves:
            button.js_on_click(picture(grid, button.label.lower()))
        shared = {
            "player": player,
            "slider": slider,
            "choice": buttons,
            "spans": [list(span) for span in self._spans],
        }
        slider.js_on_change("value", CustomJS(args=shared, code=_MOVED))
        buttons.js_on_change("active", CustomJS(args=shared, code=_CHOSEN))
        play.js_on_change("active", CustomJS(args={**shared, "play": play}, code=_PLAYED))
        tapped = {**shared, "figure": self.panels.diagram.figure, "places": [list(p) for p in self._places]}
        self.panels.diagram.figure.js_on_event("tap", CustomJS(args=tapped, code=_TAPPED))
        tell = spoken({slider: None}, {buttons: choice, play: "Sweep"}, self.panels.named)
        for widget, changed in ((slider, "value"), (buttons, "active"), (play, "active")):
            widget.js_on_change(changed, tell)
        doc = Document()
        doc.js_on_event("document_ready", tell)
        doc.title = f"peel_opt: {scene.state.words}"
        doc.add_root(
            Row(
                Column(
                    _text(choice),
                    buttons,
                    slider,
                    Row(play, *saves, spacing=4),
                    self.trust,
                    _text(caption),
                    width=look.SIDE,
                    spacing=8,
                ),
                Column(self.panels.headline, grid, self.notes, spacing=0),
                spacing=6,
                margin=4,
                stylesheets=[GlobalInlineStyleSheet(css=look.GLOBAL)],
            )
        )
        doc.add_root(player)
        return doc


def _text(markup: str) -> Div:
    return Div(
        text=markup,
        width=look.SIDE - 12,
        styles={"font-size": "12px", "color": look.FAINT, "line-height": "1.35"},
    )
