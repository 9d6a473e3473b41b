"""The controls of the window: buttons to choose, sliders to move, fields to type into."""

from __future__ import annotations

import math
from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.widgets import Button, RadioButtons, Slider, TextBox

from ...base.units import display
from ...plots import style
from . import look
from .curves import Curve
from .moves import span
from .state import CHOICES, State

#: Title of each choice, what its buttons say, and where they stand: left, bottom, width, height.
RADIOS: dict[str, tuple[str, tuple[str, ...], tuple[float, float, float, float]]] = {
    "units": ("Units", ("groups", "rod in SI"), (0.010, 0.875, 0.095, 0.062)),
    "given": ("Given", ("β₀ and λ", "length", "pressure"), (0.112, 0.845, 0.095, 0.092)),
    "law": ("Adhesion law", ("linear", "law (8)"), (0.010, 0.455, 0.095, 0.062)),
    "convention": ("Loop", ("delay", "Maxwell"), (0.112, 0.455, 0.095, 0.062)),
    "accuracy": ("Accuracy", CHOICES["accuracy"], (0.010, 0.287, 0.095, 0.122)),
    "label": ("State", CHOICES["label"], (0.112, 0.227, 0.095, 0.182)),
}

#: Names of the numbers that have a slider, and those of a rod that are typed, with their units.
SLIDERS = {"beta0": "β₀", "lam": "λ", "ratio": "η/y₀", "length": "s̄", "pressure": "p"}
TYPED = {"k": ("k", "N m"), "T0": ("T₀", "Pa"), "y0": ("y₀", "m")}


class Range:
    """A slider whose quantity and range may change, with a field to type the number into.

    Parameters
    ----------
    figure : Figure
    bottom : float
        Of the slider, in shares of the figure.
    on_slide, on_type : callable
        (field, value) and (field, text).
    """

    def __init__(
        self,
        figure: Figure,
        bottom: float,
        on_slide: Callable[[str, float], None],
        on_type: Callable[[str, str], None],
    ) -> None:
        self.field = ""
        self._on_slide, self._on_type = on_slide, on_type
        self.slider = Slider(
            figure.add_axes((0.022, bottom, 0.105, 0.024)), "", 0.0, 1.0, valinit=0.5, initcolor="none"
        )
        self.slider.label.set(position=(0.0, 1.15), ha="left", va="bottom", fontsize=style.SMALL)
        self.slider.valtext.set_visible(False)
        self.text = TextBox(figure.add_axes((0.139, bottom - 0.006, 0.072, 0.036)), "", textalignment="left")
        self.text.text_disp.set_fontsize(style.SMALL - 0.5)
        self.slider.on_changed(self._slid)
        self.text.on_submit(self._submitted)

    def _slid(self, value: float) -> None:
        self._on_slide(self.field, 10.0**value if self.field == "ratio" else float(value))

    def _submitted(self, text: str) -> None:
        self._on_type(self.field, text)

    def show(self, state: State, field: str, curve: Curve) -> None:
        """Show a number of a state and its range."""
        self.field = field
        value, (low, high) = float(getattr(state, field)), span(state, field, curve)
        in_si = state.units == "SI"
        text = display(value, "m" if field == "length" else "Pa") if in_si else f"{value:.7g}"
        if field == "ratio":
            value, low, high = (math.log10(v) for v in (value, low, high))
        slider, was = self.slider, self.slider.eventson
        slider.eventson = False
        slider.valmin, slider.valmax = low, high
        slider.ax.set_xlim(low, high)
        slider.set_val(value)
        slider.eventson = was
        unit = {"length": "/η", "pressure": "/T₀"}.get(field, "")
        slider.label.set_text(SLIDERS[field] + ("" if in_si else unit))
        _set(self.text, text)

    def visible(self, shown: bool) -> None:
        """Show or hide it; what is hidden hears nothing."""
        for widget in (self.slider, self.text):
            widget.ax.set_visible(shown)
            widget.active = shown


class WindowControls:
    """All controls of the window.

    Parameters
    ----------
    figure : Figure
    on_choice : callable
        (field, value) of a button.
    on_slide : callable
        (field, value) of a slider while it moves.
    on_type : callable
        (field, text) of something typed.
    """

    def __init__(
        self,
        figure: Figure,
        on_choice: Callable[[str, str], None],
        on_slide: Callable[[str, float], None],
        on_type: Callable[[str, str], None],
    ) -> None:
        self.quiet = False

        def heard(react: Callable[..., None]) -> Callable[..., None]:
            def changed(*values: object) -> None:
                if not self.quiet:
                    react(*values)

            return changed

        self.radios: dict[str, RadioButtons] = {}
        for field, (title, labels, place) in RADIOS.items():
            buttons = RadioButtons(
                _box(figure, place, title),
                labels,
                label_props={"fontsize": [style.SMALL] * len(labels)},
                radio_props={"s": [30] * len(labels)},
                activecolor=style.ADHESION,
            )
            values = dict(zip(labels, CHOICES[field], strict=True))
            buttons.on_clicked(heard(lambda label, f=field, v=values: on_choice(f, v[label])))
            self.radios[field] = buttons
        self.upper = Range(figure, 0.745, heard(on_slide), heard(on_type))
        self.lower = Range(figure, 0.660, heard(on_slide), heard(on_type))
        self.fields: dict[str, TextBox] = {}
        for i, (field, (name, _)) in enumerate(TYPED.items()):
            box = TextBox(
                figure.add_axes((0.026 + 0.0690 * i, 0.742, 0.047, 0.036)), f"{name} ", textalignment="left"
            )
            box.label.set_fontsize(style.SMALL)
            box.text_disp.set_fontsize(style.SMALL - 2.0)
            box.on_submit(heard(lambda text, f=field: on_type(f, text)))
            self.fields[field] = box
        self.play = _button(figure, (0.010, 0.575, 0.092, 0.040), "Play sweep")
        self.nearest = _button(figure, (0.112, 0.575, 0.095, 0.040), "Nearest state")
        # The window draws once for all that a change brings with it.
        for widget in (*self.radios.values(), self.upper.slider, self.lower.slider):
            widget.drawon = False

    def show(self, state: State, curve: Curve, *, nearest: bool, loop: bool) -> None:
        """Show a state; the buttons work where there is a nearest state, and a loop."""
        self.quiet = True
        try:
            for field, buttons in self.radios.items():
                at = CHOICES[field].index(getattr(state, field))
                if buttons.value_selected != RADIOS[field][1][at]:
                    buttons.set_active(at)
            in_si = state.units == "SI"
            self.upper.visible(not in_si)
            for field, box in self.fields.items():
                box.ax.set_visible(in_si)
                box.active = in_si
                _set(box, display(getattr(state, field), TYPED[field][1], 4))
            if not in_si:
                self.upper.show(state, "beta0" if state.given == "groups" else "ratio", curve)
            self.lower.show(state, "lam" if state.given == "groups" else state.given, curve)
            for button, works in ((self.nearest, nearest), (self.play, loop)):
                button.active = works
                button.label.set_color(look.INK if works else "#B0B0B0")
        finally:
            self.quiet = False


def _box(figure: Figure, place: tuple[float, float, float, float], title: str) -> Axes:
    axes = figure.add_axes(place)
    axes.set_title(title, loc="left", fontsize=style.SMALL, color=look.FAINT, pad=2.0)
    axes.spines[:].set_color("#D0D0D0")
    return axes


def _button(figure: Figure, place: tuple[float, float, float, float], text: str) -> Button:
    button = Button(figure.add_axes(place), text, color="#F4F4F4", hovercolor="#E4E4E4")
    button.label.set_fontsize(style.SMALL)
    return button


def _set(box: TextBox, text: str) -> None:
    """Put text into a field; `TextBox.set_val` would submit it and draw the whole figure."""
    if box.text != text:
        box.text_disp.set_text(text)
