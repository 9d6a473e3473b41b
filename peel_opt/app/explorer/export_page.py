"""The page that is written to a file: four panels, a slider, a choice of problems, a caption."""

from __future__ import annotations

import html

from bokeh.document import Document
from bokeh.models import (
    Button,
    Column,
    CustomJS,
    Div,
    GlobalInlineStyleSheet,
    InlineStyleSheet,
    RadioButtonGroup,
    Row,
    Slider,
    Toggle,
)

from . import look
from .downloads import picture
from .four_panels import FourPanels
from .playback import Recorder
from .screen import Scene
from .spoken import spoken
from .texts import notes, text_box

#: Time from one picture to the next while it plays [ms].
FRAME = 120

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


class ExportPage:
    """A page that is filled picture by picture and then finished."""

    def __init__(self) -> None:
        self.panels = FourPanels()
        self.notes = text_box("notes", "status", self.panels.width)
        self.trust = text_box("trust", "status", look.SIDE - 8)
        figures = [panel.figure for panel in self.panels.all]
        self.recorder = Recorder([*figures, self.panels.headline, self.notes, self.trust])
        self._spans: list[tuple[int, int]] = []
        self._names: list[str] = []
        self._places: list[tuple[float, float]] = []
        self._start: tuple[int, int, Scene] | None = None
        self._scenes: dict[int, Scene] = {}

    def take(self, scene: Scene) -> int:
        """Show a scene that has an answer, take it down, and return its number."""
        self._draw(scene)
        here = scene.diagram.here
        assert here is not None
        self._places.append(here)
        number = self.recorder.take()
        self._scenes[number] = scene
        return number

    def close(self, name: str, start: int | None) -> None:
        """End a problem; the page opens at picture ``start`` of the one that has it."""
        first = sum(count for _, count in self._spans)
        count = len(self.recorder) - first
        if count:
            self._spans.append((first, count))
            self._names.append(name)
            if start is not None or self._start is None:
                at = first if start is None else start
                self._start = len(self._spans) - 1, at - first, self._scenes[at]
        self._scenes.clear()

    def _draw(self, scene: Scene) -> None:
        self.panels.show(scene)
        self.notes.text = notes(scene, ())
        rows = "".join(
            f'<tr><td style="vertical-align:top; padding-right:8px">{html.escape(part.name)}</td>'
            f"<td>{html.escape(part.error)}, {html.escape(part.method)}</td></tr>"
            for part in scene.parts
        )
        self.trust.text = f'<b>Error of this picture</b><table style="border-spacing:0 2px">{rows}</table>'

    def finish(self, choice: str, caption: str) -> Document:
        """Return the document; ``choice`` names what the buttons choose."""
        assert self._start is not None
        problem, at, scene = self._start
        self._draw(scene)
        count = self._spans[problem][1]
        player = self.recorder.player()
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
