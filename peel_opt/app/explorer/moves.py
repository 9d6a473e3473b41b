"""What somebody does to a state, whichever widgets they do it with."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ...analysis.pressure_loop import PressureLoop
from ...equilibria.question import rod_questions
from ...equilibria.result import Equilibrium
from ...model.labels import UNFOLDED
from ...model.rod import RATIOS, Rod
from ...plots.diagram import coordinates
from ...plots.words import AxisUnit, length_unit, pressure_unit
from .curves import Curve, window
from .loops import LoopFrame, LoopSweep
from .presets import begun
from .screen import Screen
from .setups import SCENE_NUMBERS
from .state import CHOICES, State

#: Units of the numbers of a rod.
SI_UNITS = {"k": "N m", "T0": "Pa", "y0": "m"}

#: Farthest beta0 of a slider; more can be typed.
FARTHEST_BETA0 = 60.0


def chosen(state: State, field: str, value: str, eq: Equilibrium | None) -> State:
    """Return the state after a choice; another question is asked about ``eq``, the same state."""
    if field == "begin":
        return begun(value, state) or state
    if field == "units":
        return in_units(state, value, eq)
    if field == "given":
        return asked(state, value, eq)
    if field == "scene":
        return state.staged(value)
    return state.changed(**{field: value})


def in_units(state: State, units: str, eq: Equilibrium | None) -> State:
    """Return the state in other units; ``eq`` is its answer in these, too."""
    if eq is None or units == state.units or not eq.beta0:
        return state.switched(units)
    if state.given == "groups":
        state = asked(state, "length", eq)
    other = state.switched(units)
    measure, rod = other.asks.asked, other.rod
    assert rod is not None  # in SI units there is one, and one that is left is a rod's
    near = None if state.near is None else measure.from_ratio(rod, getattr(eq, measure.attribute))
    return other.changed(law=state.law, label=state.label, near=near)


def asked(state: State, given: str, eq: Equilibrium | None) -> State:
    """Return the state with another question, whose answer ``eq`` is too."""
    other = state.asking(given)
    if eq is None or given == state.given:
        return other
    # Within y0 both laws have this state, and each problem keeps its own.
    law = other.law if eq.law == "linear" and "y > y0" not in eq.flags else state.law
    if given == "groups":
        values = {"beta0": eq.beta0, "lam": eq.lam, "near": eq.alpha1}
    else:
        rod = other.rod if state.given != "groups" else None
        unit = Rod.from_ratio(eq.ratio) if rod is None else rod
        values = {
            name: asks.given.from_ratio(unit, getattr(eq, asks.given.attribute))
            for name, asks in rod_questions().items()
        }
        values["near"] = values[other.asks.asked.name]
        if rod is None:
            values["ratio"] = unit.ratio
    label = eq.state if eq.state in CHOICES["label"] else "unfolded"
    if given == "pressure" and label in UNFOLDED:
        label = "unfolded"  # of which there is one at each pressure
    return other.changed(law=law, **values, label=label)


def typed(state: State, field: str, text: str) -> State:
    """Return the state with a number as somebody typed it; a bare one is in the unit of the label."""
    try:
        value = float(text)
    except ValueError:
        return state.typed(field, text)
    if field in SCENE_NUMBERS and (rod := state.rod) is not None:
        return state.changed(**{field: value * SCENE_NUMBERS[field].unit(rod).size})
    if state.units == "SI" and field in SI_UNITS:
        return state.typed(field, f"{text} {SI_UNITS[field]}")
    if state.units == "SI" and field in rod_questions():
        return state.changed(**{field: value * units(Rod(state.k, state.T0, state.y0))[field].size})
    return state.typed(field, text)


def slid(state: State, field: str, value: float, eq: Equilibrium | None) -> State:
    """Return the state after a slider moved; it stays near ``eq`` where several have its label."""
    if field == "ratio":
        # Sliders move its logarithm, and 10**log10(3000) is more than 3000.
        value = min(max(value, RATIOS[0]), RATIOS[1])
    near = None
    if state.label in ("folded", "spurious", "other") and eq is not None:
        near = getattr(eq, state.asks.asked.name)
    return state.changed(**{field: value, "near": near})


def picked(screen: Screen, x: float, y: float) -> State | None:
    """Return the state of the branch nearest to a click on the diagram; None where there is none."""
    if not (math.isfinite(x) and math.isfinite(y)):
        return None
    state, panel = screen.state, screen.diagram
    if panel is None or screen.curve is None:
        return None
    branch = screen.curve.branch
    # T itself is no detached state.
    rows = np.flatnonzero(np.abs(branch.alpha1) > 1e-9 * (1.0 + branch.beta0))
    if not len(rows):
        return None
    across, up = (column[rows] for column in coordinates(branch))
    wide, high = panel.x.high - panel.x.low, panel.y.high - panel.y.low
    row = int(rows[np.nanargmin(np.hypot((across - x) / wide, (up - y) / high))])
    value, near = (float(getattr(branch, name)[row]) for name in (state.field, state.asks.asked.name))
    return state.at(value).changed(label=str(branch.state[row]), near=near)


def framed(state: State, sweep: LoopSweep, frame: LoopFrame) -> State:
    """Return the state of a moment of the sweep round a loop."""
    if isinstance(sweep.loop, PressureLoop):
        state = replace(state, given="pressure", near=None, label="unfolded")
    return state.at(frame.value).changed(label=frame.label, near=frame.near)


def units(rod: Rod) -> dict[str, AxisUnit]:
    """Units of length and pressure in which the numbers of a rod are shown and typed."""
    return {
        "length": length_unit(rod, rod.critical_length),
        "pressure": pressure_unit(rod, rod.adhesion_strength),
    }


def span(state: State, field: str, curve: Curve | None) -> tuple[float, float]:
    """Return the range of a slider, in the unit of the field; it holds the state's value."""
    value = float(getattr(state, field))
    low, high = _span(state, field, curve)
    return min(low, value), max(high, value)


def _span(state: State, field: str, curve: Curve | None) -> tuple[float, float]:
    if field in ("beta0", "ratio"):
        return RATIOS if field == "ratio" else (0.0, FARTHEST_BETA0)
    if field == "lam":
        return window(state.beta0)
    rod = state.rod
    assert rod is not None  # it has a length and a pressure
    if field in SCENE_NUMBERS:
        size = SCENE_NUMBERS[field].dimension.size(rod)
        return SCENE_NUMBERS[field].low * size, SCENE_NUMBERS[field].high * size
    if field == "pressure":
        return 0.0, rod.adhesion_strength
    if curve is not None and curve.branch.rod == rod:
        return 0.94 * float(curve.branch.length.min()), 1.06 * float(curve.branch.length.max())
    return 0.5 * rod.critical_length, 2.0 * rod.critical_length
