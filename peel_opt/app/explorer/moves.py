"""What somebody does to a state, whichever widgets they do it with."""

from __future__ import annotations

from dataclasses import replace

from ...equilibria.result import Equilibrium
from ...model.rod import RATIOS
from .curves import Curve, window
from .panels import Frame, LoopPanel, Spot
from .state import State

#: Farthest beta0 of a slider; more can be typed.
FARTHEST_BETA0 = 60.0


def chosen(state: State, field: str, value: str) -> State:
    """Return the state after a choice."""
    if field == "units":
        return state.switched(value)
    if field == "given":
        return state.asking(value)
    return state.changed(**{field: value})


def slid(state: State, field: str, value: float, eq: Equilibrium | None) -> State:
    """Return the state after a slider moved; it stays near ``eq`` where several have its label."""
    if field == "ratio":
        # Sliders move its logarithm, and 10**log10(3000) is more than 3000.
        value = min(max(value, RATIOS[0]), RATIOS[1])
    near = None
    if state.label in ("folded", "spurious") and eq is not None:
        near = {"groups": eq.alpha1, "length": eq.pressure, "pressure": eq.length}[state.given]
    return state.changed(**{field: value, "near": near})


def picked(state: State, spot: Spot) -> State:
    """Return the state at a place of the diagram."""
    near = None if spot.label == "adhered" else spot.near
    return state.at(spot.value).changed(label=spot.label if spot.label != "other" else "unfolded", near=near)


def framed(state: State, loop: LoopPanel, frame: Frame) -> State:
    """Return the state of a moment of the sweep round a loop."""
    if loop.swept == "pressure":
        state = replace(state, given="pressure", near=None, label="unfolded")
    return state.at(frame.value).changed(label=frame.label, near=frame.near)


def span(state: State, field: str, curve: Curve | None) -> tuple[float, float]:
    """Return the range of a slider, in the unit of the field; it holds the state's value."""
    value = float(getattr(state, field))
    low, high = _span(state, field, curve)
    return min(low, value), max(high, value)


def _span(state: State, field: str, curve: Curve | None) -> tuple[float, float]:
    if field == "beta0":
        return 0.0, FARTHEST_BETA0
    if field == "lam":
        return window(state.beta0)
    if field == "ratio":
        return RATIOS
    rod = state.rod
    assert rod is not None  # it has a length and a pressure
    if field == "pressure":
        return 0.0, rod.adhesion_strength
    if curve is not None and curve.hold == "ratio" and curve.held == rod.ratio:
        low, high = (rod.length(float(v)) for v in (curve.length_ratio.min(), curve.length_ratio.max()))
        return 0.94 * low, 1.06 * high
    return 0.5 * rod.critical_length, 2.0 * rod.critical_length
