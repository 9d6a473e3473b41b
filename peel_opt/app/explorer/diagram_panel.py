"""The bifurcation diagram: (lambda, alpha1) in the paper's groups, (length, pressure) for a rod."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from ...equilibria.branch import Branch
from ...model.labels import special_kind
from .curves import Curve
from .panels import Axis, DiagramPanel, Line, Mark, Spot
from .state import State
from .words import in_characters

LABELS = {
    "stable": "stable",
    "unstable": "unstable",
    "unknown": "stability not computed",
    "spurious": "spurious (y < 0)",
    "straight": "straight rod",
    "straight-unstable": "",
}

POTENTIAL = "at fixed length (35)"
PRESSURE = "at fixed pressure"

#: Size of the dot, as a share of the picture.
_DOT = 0.025

#: Room around what is drawn, as a share of it.
_MARGIN = 0.12


def units(state: State) -> tuple[float, str, float, str]:
    """Size and name of the units of length and pressure in which a rod's diagram is drawn."""
    from ...plots.words import length_unit, pressure_unit

    rod = state.rod
    assert rod is not None
    if rod.dimensionless:
        return 1.0, "s̄/η", 1.0, "p/T₀"
    length, pressure = length_unit(rod, rod.critical_length), pressure_unit(rod, rod.adhesion_strength)
    return length.size, f"detached length s̄ [{length.name}]", pressure.size, f"pressure p [{pressure.name}]"


def coordinates(state: State, curve: Curve | Branch) -> tuple[np.ndarray, np.ndarray]:
    """Return the two columns that the diagram shows."""
    rod = state.rod
    if rod is None:
        return curve.lam, curve.alpha1
    length, _, pressure, _ = units(state)
    return curve.length_ratio * rod.eta / length, curve.pressure_ratio * rod.adhesion_strength / pressure


def diagram_panel(
    state: State, curve: Curve, here: tuple[float, float] | None, beside: tuple[Branch, ...] = ()
) -> DiagramPanel:
    """Return the diagram of a curve with the state at ``here``, in the coordinates of the axes.

    ``beside`` is the branch of the state, where that is another one.
    """
    x, y = coordinates(state, curve)
    looks = _looks(state, curve)
    lines = [Line("unknown", *coordinates(state, own), "own branch") for own in beside]
    lines += [Line(look, x[rows], y[rows], LABELS[look]) for rows, look in _pieces(looks)]
    rod = state.rod
    if rod is None:
        across, up = "λ = β₁ − π⁴", "extra pressure α₁"
        left, right = float(x.min()), float(x.max())
        if here is not None:
            left, right = min(left, here[0]), max(right, here[0])
        for look, a, b in (("straight", left, min(0.0, right)), ("straight-unstable", max(0.0, left), right)):
            if a < b:
                lines.append(Line(look, np.array([a, b]), np.zeros(2), LABELS[look]))
        ends = (*x, left, right), (*y, 0.0)
        stability = POTENTIAL
    else:
        _, across, _, up = units(state)
        ends = (0.0, *x), (0.0, *y)
        stability = PRESSURE
    if here is not None:
        ends = (*ends[0], here[0]), (*ends[1], here[1])
    marks = []
    for special in curve.specials:
        letter, words = special_kind(special.kind)
        how = "" if special.status in ("located", "exact") else ", estimated"
        marks.append(
            Mark(
                special.kind, letter, float(x[special.row]), float(y[special.row]), in_characters(words) + how
            )
        )
    return DiagramPanel(
        Axis(across, *_span(ends[0])),
        Axis(up, *_span(ends[1])),
        tuple(lines),
        tuple(marks),
        _spots(state, curve, x, y),
        here,
        stability,
    )


def is_drawn(panel: DiagramPanel, here: tuple[float, float]) -> bool:
    """Whether a place is on a line of a diagram, as far as the dot shows."""
    scale = np.array([panel.x.high - panel.x.low, panel.y.high - panel.y.low])
    nearest = math.inf
    for line in panel.lines:
        corners = (np.column_stack([line.x, line.y]) - here) / scale
        a, along = corners[:-1], np.diff(corners, axis=0)
        size = np.maximum((along**2).sum(axis=1), 1e-300)
        foot = a + np.clip(-(a * along).sum(axis=1) / size, 0.0, 1.0)[:, None] * along
        nearest = min(nearest, *np.hypot(*foot.T)) if len(foot) else nearest
    return nearest < _DOT


def _span(values: tuple[float, ...]) -> tuple[float, float]:
    low, high = float(np.min(values)), float(np.max(values))
    room = _MARGIN * (high - low or 1.0)
    return low - room, high + room


def _looks(state: State, curve: Curve) -> np.ndarray:
    """Look of every point of a curve."""
    looks = np.full(len(curve.lam), "unknown", dtype=object)
    looks[curve.state == "spurious"] = "spurious"
    if state.rod is None:
        looks[curve.state == "lower"] = "stable"
        looks[curve.state == "middle"] = "unstable"
        return looks
    # From T to the minimum pressure one motion grows, for every rod.
    looks[(curve.state == "middle") | (curve.state == "lower")] = "unstable"
    if curve.index is not None:
        looks[curve.index == 0] = "stable"
        looks[curve.index > 0] = "unstable"
    return looks


def _pieces(looks: np.ndarray) -> list[tuple[slice, str]]:
    """Runs of one look; a stretch between two looks takes that of its end."""
    cuts = [0, *(i + 1 for i, (a, b) in enumerate(pairwise(looks)) if a != b), len(looks)]
    return [(slice(max(a - 1, 0), b), str(looks[a])) for a, b in pairwise(cuts) if b > a]


def _spots(state: State, curve: Curve, x: np.ndarray, y: np.ndarray) -> tuple[Spot, ...]:
    """Places that a click picks; T itself is no detached state."""
    rod = state.rod
    spots = []
    for i in range(len(x)):
        if abs(curve.alpha1[i]) <= 1e-9 * (1.0 + curve.beta0[i]):
            continue
        if rod is None:
            value, near = curve.lam[i], curve.alpha1[i]
        else:
            length, pressure = rod.length(curve.length_ratio[i]), rod.pressure(curve.pressure_ratio[i])
            value, near = (length, pressure) if state.given == "length" else (pressure, length)
        spots.append(Spot(float(x[i]), float(y[i]), float(value), float(near), str(curve.state[i])))
    return tuple(spots)
