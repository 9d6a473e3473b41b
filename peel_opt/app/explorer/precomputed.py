"""Which states a page shows that was computed beforehand: places along the branches of a few relatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...base.errors import InvalidInput, NoEquilibrium
from ...base.units import display
from ...model.rod import RATIOS
from ...plots.diagram import coordinates
from .curves import traced
from .loops import OFF_FOLD
from .scene_screens import traced_scene
from .screen import Screen
from .screens import full_screen
from .setups import SETUPS
from .state import State

#: Relatives of a state: its beta0 and its eta/y0, times these.
BETA0_FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
RATIO_FACTORS = (0.5, 1.0, 2.0)
SCENE_FACTORS = (0.5, 1.0, 1.5)

#: What stands for relatives of beta0 = 0, which has none.
FROM_ZERO = (0.0, 1.0, 2.0, 4.0)

#: Detached states of a rod; the others are spurious.
_LABELS = ("lifted", "middle", "lower", "folded")

#: An answer farther than this from where its branch was, in shares of the picture, is another one.
ELSEWHERE = 0.02


class SliderPlace(NamedTuple):
    """A state to be solved, and where its branch has it: (x, y) in the coordinates of the diagram."""

    state: State
    x: float
    y: float


class Relative(NamedTuple):
    """One choice of the page: what tells it from the others, whether it was asked for, under which heading.

    Relatives of what was asked for have no heading.
    """

    name: str
    state: State
    asked: bool
    heading: str = ""


def relatives(state: State, values: Sequence[float] | None = None) -> tuple[Relative, ...]:
    """Return the problems to choose from: other beta0 in the groups, other eta/y0 of a rod.

    Of a scene its first number is another.

    Parameters
    ----------
    state : State
    values : sequence of float, optional
        The beta0, eta/y0 or number of the scene wanted; without them a few around that of ``state``, which
        is always one of them.  A rod in SI units keeps k and T0, and y0 changes.

    Returns
    -------
    tuple of Relative

    Raises
    ------
    InvalidInput, OutOfRange
        If a value cannot be meant.
    """
    # Solved and traced to the same accuracy, whatever an explorer was doing when it was left.
    state = state.changed(accuracy="standard")
    own = _own(state)
    wanted = _around(state, own) if values is None else [float(v) for v in values]
    if not all(math.isfinite(v) for v in wanted):
        raise InvalidInput(f"the values to choose from must be finite, got {wanted}.")
    others = [v for v in wanted if not math.isclose(v, own, rel_tol=1e-12)]
    return tuple(_relative(state, own, v) for v in sorted([own, *others]))


def beginnings(state: State, known: Mapping[str, Mapping[str, State]]) -> tuple[Relative, ...]:
    """Return problems to begin with, under their headings, as relatives are: to the accuracy "standard"."""
    return tuple(
        Relative(name, replace(each, convention=state.convention, accuracy="standard"), False, heading)
        for heading, group in known.items()
        for name, each in group.items()
    )


def _own(state: State) -> float:
    """Return the number that tells a state from its relatives."""
    if state.rods_scene is not None:
        return float(getattr(state, SETUPS[state.scene].numbers[0].name))
    return state.beta0 if state.given == "groups" else state.effective_ratio


def _around(state: State, own: float) -> list[float]:
    if state.rods_scene is not None:
        return [factor * own for factor in SCENE_FACTORS]
    if state.given != "groups":
        return [v for f in RATIO_FACTORS if RATIOS[0] <= (v := f * own) <= RATIOS[1]]
    return [f * own for f in BETA0_FACTORS] if own else list(FROM_ZERO)


def _relative(state: State, own: float, value: float) -> Relative:
    if (rod := state.rod) is not None and state.rods_scene is not None:
        first = SETUPS[state.scene].numbers[0]
        moved = state if value == own else state.changed(**{first.name: value})
        return Relative(first.worded(rod, value), moved, value == own)
    field, number, name = "beta0" if state.given == "groups" else "ratio", value, f"{value:.4g}"
    if state.units == "SI":
        field, number = "y0", state.y0 * own / value
        name += f" ({display(number, 'm', 3)})"
    return Relative(name, state if value == own else state.changed(**{field: number}), value == own)


def places(state: State, count: int) -> tuple[SliderPlace, ...]:
    """Return places spread along the branch that leaves T, as it is drawn, ``count`` at most.

    A rod is asked for its length given the pressure: well posed at all of them but the minimum pressure,
    as lambda is but at the fold; there the place is a little after it.

    Raises
    ------
    NoEquilibrium
        If the branch has no detached state within what is drawn.
    PeelOptError
        If the branch cannot be traced.
    """
    curve = traced(state) if state.rods_scene is None else traced_scene(state)
    assert curve is not None  # only a sketch is not traced
    branch = curve.branch
    x, y = coordinates(branch)
    rows = np.flatnonzero(np.isin(branch.state, _LABELS) & (np.abs(branch.alpha1) > 1e-9))
    if not len(rows):
        raise NoEquilibrium(f"no detached state is found along the branch at {state.words}.")
    scene = state.rods_scene is not None
    if not scene and abs(branch.alpha1[rows[0]]) > abs(branch.alpha1[rows[-1]]):
        rows = rows[::-1]
    along = _along(x[rows], y[rows])
    wanted = np.linspace(0.0, along[-1], count)
    groups = state.rod is None
    given, answer = (branch.lam, branch.alpha1) if groups else (branch.pressure, branch.length)
    folds = {p.index for p in branch.special("LP-lambda" if groups else "LP-pressure")}
    asked = state if groups else state.changed(given="pressure")
    found = []
    for i in np.unique(np.abs(along[:, None] - wanted).argmin(axis=0)):
        row, after = int(rows[i]), int(rows[min(i + 1, len(rows) - 1)])
        value, label = float(given[row]), str(branch.state[row])
        if row in folds:
            value += OFF_FOLD * float(given[after] - given[row])
            label = str(branch.state[after])
        # At a given lambda or pressure the unfolded ones of a plate are unique; without a search for others.
        near = float(answer[row]) if scene or label == "folded" else None
        found.append(
            SliderPlace(asked.at(value).changed(label=label, near=near), float(x[row]), float(y[row]))
        )
    return tuple(found)


def _along(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Length along a line as it is drawn, both axes filling the picture."""
    u, v = (np.diff(w) / (np.ptp(w) or 1.0) for w in (x, y))
    return np.concatenate([[0.0], np.cumsum(np.hypot(u, v))])


def with_own(found: tuple[SliderPlace, ...], state: State) -> tuple[tuple[SliderPlace, ...], int, bool]:
    """Let the state itself take the place nearest to it.

    Returns the places, the number of that nearest to it (the first where there is no such state), and
    whether the state is among them: not if it does not exist, is straight or spurious, or belongs to
    another branch.
    """
    screen = full_screen(state)
    here = None if screen.diagram is None else screen.diagram.here
    if here is None:
        return found, 0, False
    x, y = (np.array([getattr(p, name) for p in found]) for name in ("x", "y"))
    u, v = (x - here[0]) / (np.ptp(x) or 1.0), (y - here[1]) / (np.ptp(y) or 1.0)
    nearest = int(np.hypot(u, v).argmin())
    eq = screen.equilibrium
    if eq is None or eq.state not in _LABELS or screen.off_branch > ELSEWHERE:
        return found, nearest, False
    return (*found[:nearest], SliderPlace(state, *here), *found[nearest + 1 :]), nearest, True


def solved(place: SliderPlace) -> Screen | None:
    """Return the full picture of a place; None where its answer is not found, or lies elsewhere."""
    screen = full_screen(place.state)
    panel = screen.diagram
    here = None if panel is None else panel.here
    if screen.equilibrium is None or panel is None or here is None:
        return None
    off = math.hypot(
        (here[0] - place.x) / (panel.x.high - panel.x.low), (here[1] - place.y) / (panel.y.high - panel.y.low)
    )
    return screen if off < ELSEWHERE else None
