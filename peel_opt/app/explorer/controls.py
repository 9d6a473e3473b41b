"""The column of controls: what is asked, about which rod, how accurately."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Sequence
from typing import Any

from bokeh.models import (
    Button,
    Column,
    CustomJSTickFormatter,
    Div,
    InlineStyleSheet,
    RadioButtonGroup,
    Row,
    Select,
    Slider,
    TextInput,
    Toggle,
)

from ...base.units import display
from ...equilibria.question import ASKS
from ...plots.diagram import WORDS as WORDS_OF
from ...plots.words import plain
from . import look
from .curves import Curve
from .moves import SI_UNITS, span, units
from .presets import name_of, presets
from .setups import SCENE_NUMBERS, SETUPS
from .state import CHOICES, State
from .texts import text_box

#: Symbols of the numbers of a rod that a slider gives.
WRITTEN = {"length": r"\bar s", "pressure": "p"}

#: What the buttons of each choice say.
WORDS: dict[str, tuple[str, ...]] = {
    "units": ("paper's groups", "rod in SI"),
    "given": ("β₀ and λ", "length", "pressure"),
    "law": ("linear (Fig 2b)", "law (8)"),
    "convention": ("delay", "Maxwell"),
    "accuracy": ("sketch", "draft", "standard", "reference"),
}
TITLES = {
    "units": "Units",
    "given": "Given",
    "law": "Adhesion law",
    "convention": "Convention of the loop",
    "accuracy": "Accuracy",
}

_STEPS = 600


def _style() -> list[InlineStyleSheet]:
    return [InlineStyleSheet(css=look.WIDGETS)]


class Refused:
    """What was typed into a field and could not be meant: it stays there, with the reason below.

    Parameters
    ----------
    name : str
    fields : sequence of TextInput
        Those that share the place of the reason.
    """

    def __init__(self, name: str, fields: Sequence[TextInput]) -> None:
        self.fields = fields
        self.said = text_box(f"refused-{name}", "alert")
        self.said.visible = False

    @property
    def stands(self) -> bool:
        """Whether a refused entry is shown."""
        return self.said.visible

    def show(self, field: TextInput, reason: str) -> None:
        """Say why what is in a field is refused."""
        self.clear()
        self.said.text = f'<span style="color:{look.REFUSED}">{html.escape(reason)}</span>'
        self.said.visible, field.css_classes = True, ["refused"]

    def clear(self) -> None:
        """Say nothing; the fields show the state again when they are next shown."""
        self.said.visible = False
        for field in self.fields:
            field.css_classes = []


class Number:
    """A slider with a field beside it into which the number can be typed.

    Parameters
    ----------
    name : str
        The field of `State`.
    title : str
    logarithmic : bool
    """

    def __init__(self, name: str, title: str, *, logarithmic: bool = False) -> None:
        self.name, self.logarithmic = name, logarithmic
        options: dict[str, Any] = {"show_value": False}
        if logarithmic:
            options["format"] = CustomJSTickFormatter(code="return (10 ** tick).toPrecision(3)")
        self.slider = Slider(
            start=0.0,
            end=1.0,
            value=0.5,
            step=0.01,
            title=title,
            sizing_mode="stretch_width",
            name=f"slider-{name}",
            stylesheets=_style(),
            **options,
        )
        self.field = TextInput(
            title=title,
            width=106,
            name=f"field-{name}",
            stylesheets=[InlineStyleSheet(css=look.WIDGETS + "label { position: absolute; left: -9999px; }")],
        )
        self.refused = Refused(name, (self.field,))
        self.box = Column(
            Row(self.slider, self.field, spacing=6, sizing_mode="stretch_width"),
            self.refused.said,
            spacing=0,
            sizing_mode="stretch_width",
        )

    def read(self) -> float:
        """The number the slider shows, in its own unit."""
        value = float(self.slider.value)
        return 10.0**value if self.logarithmic else value

    def show(self, value: float, low: float, high: float, text: str, title: str = "") -> None:
        """Show a number within its range; the range grows to hold it."""
        if self.logarithmic:
            value, low, high = (math.log10(v) for v in (value, low, high))
        low, high = min(low, value), max(high, value)
        slider = self.slider
        if (slider.start, slider.end) != (low, high):
            # Never a range that does not hold the value, not even between two messages.
            slider.update(start=min(low, slider.start, slider.value), end=max(high, slider.end, slider.value))
            slider.update(value=value)
            slider.update(start=low, end=high, step=(high - low) / _STEPS)
        if slider.value != value:
            slider.value = value
        if self.field.value != text and not self.refused.stands:
            self.field.value = text
        if title:
            slider.title = title


class Controls:
    """All widgets; ``changed`` is called with the name of what somebody touched and its new value.

    Parameters
    ----------
    on_choice : callable
        (field, value) of a button or menu.
    on_slider : callable
        (field, value, rested) of a slider, while it moves and when it rests.
    on_text : callable
        (field, text) of something typed.
    """

    def __init__(
        self,
        on_choice: Callable[[str, str], None],
        on_slider: Callable[[str, float, bool], None],
        on_text: Callable[[str, str], None],
    ) -> None:
        self._quiet = False
        self._units: dict[str, float] = {}
        self.groups: dict[str, RadioButtonGroup] = {}
        self.boxes = boxes = dict[str, Column]()
        for field, labels in WORDS.items():
            group = RadioButtonGroup(
                labels=list(labels), active=0, sizing_mode="stretch_width", name=field, stylesheets=_style()
            )
            group.on_change("active", self._chosen(field, on_choice))
            self.groups[field] = group
            boxes[field] = Column(_heading(TITLES[field]), group, spacing=0, sizing_mode="stretch_width")
        self.numbers = {
            "beta0": Number("beta0", "β₀ = (s̄/η)³"),
            "lam": Number("lam", "λ = β₁ − π⁴"),
            "ratio": Number("ratio", "η/y₀", logarithmic=True),
            "length": Number("length", "detached length s̄/η"),
            "pressure": Number("pressure", "pressure p/T₀"),
        } | {name: Number(name, each.words) for name, each in SCENE_NUMBERS.items()}
        for field, number in self.numbers.items():
            number.slider.on_change("value", self._slid(number, on_slider, rested=False))
            number.slider.on_change("value_throttled", self._slid(number, on_slider, rested=True))
            number.field.on_change("value", self._told(field, on_text))
        self.texts = {
            name: TextInput(
                title=f"{title} [{unit}]",
                sizing_mode="stretch_width",
                margin=5,
                name=f"field-{name}",
                stylesheets=_style(),
            )
            for (name, title), unit in zip(
                {"k": "k", "T0": "T₀", "y0": "y₀"}.items(), ("N m", "Pa", "m"), strict=True
            )
        }
        for field, text in self.texts.items():
            text.on_change("value", self._told(field, on_text))
        self.rod_box = Row(*self.texts.values(), spacing=0, sizing_mode="stretch_width")
        self.refused = Refused("rod", tuple(self.texts.values()))
        self.scene = Select(
            title="Scene",
            options=[(name, setup.words) for name, setup in SETUPS.items()],
            value="plate",
            sizing_mode="stretch_width",
            name="scene",
            stylesheets=_style(),
        )
        self.scene.on_change("value", self._told("scene", on_choice))
        self.label = Select(
            title="State",
            options=[],
            value="unfolded",
            sizing_mode="stretch_width",
            name="label",
            stylesheets=_style(),
        )
        self.label.on_change("value", self._told("label", on_choice))
        self.begin = Select(
            title="Begin with",
            options={"": [("", "…")], **{head: list(group) for head, group in presets().items() if group}},
            value="",
            sizing_mode="stretch_width",
            name="begin",
            stylesheets=_style(),
        )
        self.begin.on_change("value", self._told("begin", on_choice))
        self.play = Toggle(
            label="▶ Play sweep",
            sizing_mode="stretch_width",
            name="play",
            stylesheets=_style(),
        )
        self.snap = Button(
            label="▶ Let it snap",
            sizing_mode="stretch_width",
            name="snap",
            stylesheets=_style(),
        )
        self.buttons = {
            name: Button(
                label=label,
                sizing_mode="stretch_width",
                name=f"save-{name}",
                stylesheets=_style(),
                margin=(0, 2, 0, 3),
            )
            for name, label in {
                "png": "PNG",
                "svg": "SVG",
                "csv": "CSV",
                "card": "card",
                "link": "link",
            }.items()
        }
        self.spoken_sliders = {number.slider: number.field for number in self.numbers.values()}
        self.spoken_groups = {group: TITLES[field] for field, group in self.groups.items()}
        self.spoken_groups[self.play] = "Sweep"
        self.nearest = Button(
            label="Go to the nearest state",
            button_type="warning",
            sizing_mode="stretch_width",
            visible=False,
            name="nearest",
            stylesheets=_style(),
        )
        self.box = Column(
            self.begin,
            boxes["units"],
            boxes["given"],
            self.scene,
            self.rod_box,
            self.refused.said,
            *(number.box for number in self.numbers.values()),
            self.nearest,
            self.label,
            Row(self.play, self.snap, spacing=6, sizing_mode="stretch_width"),
            boxes["law"],
            boxes["convention"],
            boxes["accuracy"],
            Column(
                _heading("Take away"),
                Row(*self.buttons.values(), spacing=0, sizing_mode="stretch_width"),
                spacing=0,
                sizing_mode="stretch_width",
            ),
            width=look.SIDE,
            spacing=5,
        )

    # --- from the widgets -----------------------------------------------------------------

    def _chosen(self, field: str, on_choice: Callable[[str, str], None]) -> Callable[..., None]:
        def changed(_attribute: str, _old: int, new: int) -> None:
            if not self._quiet and new is not None:
                on_choice(field, CHOICES[field][new])

        return changed

    def _told(self, field: str, tell: Callable[[str, str], None]) -> Callable[..., None]:
        def changed(_attribute: str, _old: str, new: str) -> None:
            if not self._quiet:
                tell(field, new)

        return changed

    def _slid(
        self, number: Number, on_slider: Callable[[str, float, bool], None], *, rested: bool
    ) -> Callable[..., None]:
        def changed(_attribute: str, _old: float, _new: float) -> None:
            if not self._quiet:
                unit = self._units.get(number.name, 1.0)
                on_slider(number.name, number.read() * unit, rested)

        return changed

    # --- to the widgets -------------------------------------------------------------------

    def refuse(self, field: str, reason: str) -> None:
        """Leave what was typed into a field where it is, and say why it cannot be meant."""
        if field in self.texts:
            self.refused.show(self.texts[field], reason)
        else:
            self.numbers[field].refused.show(self.numbers[field].field, reason)

    def accept(self) -> None:
        """Take back what was refused: the fields show the state again."""
        for each in (self.refused, *(number.refused for number in self.numbers.values())):
            each.clear()

    def show(self, state: State, curve: Curve | None) -> None:
        """Show a state; ``curve`` gives the range of lengths."""
        self._quiet = True
        try:
            self._show(state, curve)
        finally:
            self._quiet = False

    def _show(self, state: State, curve: Curve | None) -> None:
        for field, group in self.groups.items():
            group.active = CHOICES[field].index(getattr(state, field))
        own = state.rods_scene is not None
        words = {"unfolded": "lifted or unfolded"} if own else {}
        self.label.options = [(value, words.get(value, value)) for value in state.labels]
        self.label.value = state.label
        self.scene.value = state.scene
        self.boxes["convention"].visible = not own
        self.begin.value = name_of(state)
        in_si, groups = state.units == "SI", state.given == "groups"
        visible = {
            "beta0": groups,
            "lam": groups,
            "ratio": not groups and not in_si,
            "length": state.given == "length",
            "pressure": state.given == "pressure",
        }
        visible |= {name: SCENE_NUMBERS[name] in SETUPS[state.scene].numbers for name in SCENE_NUMBERS}
        for name, number in self.numbers.items():
            number.box.visible = visible[name]
        self.rod_box.visible = in_si
        if in_si and not self.refused.stands:
            for name, text in self.texts.items():
                text.value = display(getattr(state, name), SI_UNITS[name], 4)
        if groups:
            for name in ("beta0", "lam"):
                value = getattr(state, name)
                self.numbers[name].show(value, *span(state, name, curve), f"{value:.7g}")
            return
        if not in_si:
            self.numbers["ratio"].show(state.ratio, *span(state, "ratio", curve), f"{state.ratio:.7g}")
        rod = state.rod
        assert rod is not None  # it has a length and a pressure
        for name, unit in units(rod).items():
            value, quantity = getattr(state, name), ASKS[name].given.dimension.unit
            low, high = (end / unit.size for end in span(state, name, curve))
            self._units[name] = unit.size
            text = display(value, quantity) if in_si else f"{value:.7g}"
            title = plain(f"{WORDS_OF[name]} {unit.axis(WRITTEN[name])}")
            self.numbers[name].show(value / unit.size, low, high, text, title)
        for each in SETUPS[state.scene].numbers:
            unit, value = each.unit(rod), getattr(state, each.name)
            low, high = (end / unit.size for end in span(state, each.name, curve))
            self._units[each.name] = unit.size
            text = each.text(rod, value)
            self.numbers[each.name].show(value / unit.size, low, high, text, each.title(rod))


def _heading(text: str) -> Any:
    return Div(text=text, styles={"font-size": "12px", "color": look.FAINT}, margin=(0, 0, 0, 5))
