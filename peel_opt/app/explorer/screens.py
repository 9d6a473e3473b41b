"""`live_screen` and `full_screen`: what a `State` looks like at once, and once it is solved and traced."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

from ...analysis.maxwell import TURN
from ...base.errors import PeelOptError
from ...equilibria.branch import Branch
from ...equilibria.result import Equilibrium
from ...equilibria.scene_trace import SceneTrace
from ...plots.diagram import AT_LENGTH, AT_PRESSURE, coordinates, diagram_panel, place
from ...plots.panels import Line, Panel
from ...plots.potential import named_panel
from ...plots.rod import adhered_panel, rod_panel
from .answers import Found, full_answer, quick_answer
from .curves import Curve, law_of, own_branch, traced, window
from .loops import lambda_loop, pressure_loop
from .potential import Landscape, landscape, off_by, too_far
from .quick_walks import quick_groups, quick_rod
from .scene_screens import quick_scene_screen, scene_screens
from .screen import Part, Screen
from .state import State
from .words import OFF_BRANCH, warnings_of, why_no_branch

#: Share of a picture's 50 ms that walks may take; what is left of a branch follows later.
BUDGET = 0.026

#: Size of the dot, as a share of the picture.
_DOT = 0.025


def live_screen(
    state: State, *, best: Curve | None = None, before: Equilibrium | None = None, budget: float = BUDGET
) -> Screen:
    """Return a picture that keeps up with a slider: some 10 ms once the program is warm.

    Parameters
    ----------
    state : State
    best : Curve, optional
        A diagram known already; used instead of a quick walk if it belongs to the state.
    before : Equilibrium, optional
        The answer of the picture before, followed where there is no time to walk to the new one.
    budget : float
        Seconds that walks may take.

    Returns
    -------
    Screen
        With ``full`` False.  Numerical trouble is a message in it; nothing is raised.
    """
    if state.rods_scene is not None:
        return quick_scene_screen(state, best, before)
    began = time.perf_counter()
    deadline = began + budget
    curve = _quick_curve(state, deadline)
    found = quick_answer(state, deadline, before)
    if best is not None and _belongs(best, state):
        curve = best
    beta0 = _beta0(state, found.equilibrium)
    local = curve if state.given == "groups" else _quick_local(state, found.equilibrium, deadline)
    return _screen(state, found, curve, _landscape(state, beta0, local), local, began, full=False)


def full_screen(state: State) -> Screen:
    """Return the picture solved and traced to the accuracy of the state.

    Returns
    -------
    Screen
        With ``full`` True.  Numerical trouble is a message in it; nothing is raised.
    """
    *_, (screen, _) = full_screens(state)
    return screen


def full_screens(state: State) -> Iterator[tuple[Screen, str]]:
    """Yield ever fuller pictures, each with what is computed next; the last is full, with "".

    Of the paper's scene there is one; that of another takes seconds, and its parts come as they are known.
    """
    if state.rods_scene is not None:
        yield from scene_screens(state)
    else:
        yield _solved(state), ""


def _solved(state: State) -> Screen:
    began = time.perf_counter()
    found = full_answer(state)
    trouble = ""
    curve = None
    try:
        curve = traced(state)
    except PeelOptError as error:
        trouble = f"The diagram is a quick walk, since the trace failed: {error}"
    if curve is None:
        curve = _quick_curve(state, time.perf_counter() + 5.0)
    local: Curve | None = curve
    if state.given != "groups":
        local = None
        eq = found.equilibrium
        if eq is not None and 0.0 < eq.beta0 < TURN:
            try:
                local = traced(_groups_of(state, eq)) or _quick_local(state, eq, time.perf_counter() + 1.0)
            except PeelOptError as error:
                trouble = f"{trouble} The potential is that of the normal form: {error}".strip()
    beta0 = _beta0(state, found.equilibrium)
    screen = _screen(state, found, curve, _landscape(state, beta0, local), local, began, full=True)
    return replace(screen, warnings=(*screen.warnings, trouble)) if trouble else screen


def _groups_of(state: State, eq: Equilibrium) -> State:
    """The problem at fixed beta0 to which a rod's state belongs, with a window that holds it."""
    return State(beta0=eq.beta0, lam=eq.lam, law=state.law, accuracy=state.accuracy)


def _quick_local(state: State, eq: Equilibrium | None, deadline: float) -> Curve | None:
    """Walk at the fixed beta0 of a rod's state, where there is a fold to walk round."""
    if eq is None or not 0.0 < eq.beta0 < TURN:
        return None
    span = window(eq.beta0, eq.lam)
    return quick_groups(law_of(state), eq.beta0, span, deadline)


def _quick_curve(state: State, deadline: float) -> Curve:
    """Walk the branch that the diagram shows, as far as there is time."""
    rod = state.rod
    if rod is None:
        return quick_groups(law_of(state), state.beta0, window(state.beta0, state.lam), deadline)
    return quick_rod(law_of(state), rod, deadline)


def _belongs(curve: Curve, state: State) -> bool:
    """Whether a curve is the diagram of a state, window included."""
    branch = curve.branch
    if isinstance(branch, SceneTrace) or branch.law != law_of(state).name:
        return False
    if state.given == "groups":
        inside = branch.lam.min() <= state.lam <= branch.lam.max()
        return branch.hold == "beta0" and branch.held == state.beta0 and bool(inside)
    return branch.rod == state.rod


def _beta0(state: State, eq: Equilibrium | None) -> float | None:
    if state.given == "groups":
        return state.beta0
    return None if eq is None else eq.beta0


@lru_cache(maxsize=128)
def _remembered(beta0: float, curve: Curve | None) -> Landscape:
    return landscape(beta0, curve)


def _landscape(state: State, beta0: float | None, local: Curve | None) -> tuple[Landscape, float] | None:
    """Return the potential and the time it took; of the normal form at the accuracy of a sketch."""
    if beta0 is None:
        return None
    began = time.perf_counter()
    # A walk that is not through has neither Maxwell point nor delay.
    known = local if local is not None and local.ended else None
    found = _remembered(beta0, known)
    return found, time.perf_counter() - began


def _screen(
    state: State,
    found: Found,
    curve: Curve,
    land: tuple[Landscape, float] | None,
    local: Curve | None,
    began: float,
    *,
    full: bool,
) -> Screen:
    """Put the panels together."""
    eq, own = found.equilibrium, state.rod
    here = _place(state, eq, curve.branch)
    diagram = _diagram(state, curve.branch).at(here)
    off_line = math.nan if here is None else diagram.distance(here)
    off_branch = off_line > _DOT
    if off_branch and full and eq is not None:
        beside = [Line("own", *coordinates(branch), "own branch") for branch in own_branch(state, eq)]
        diagram = replace(diagram, lines=(*beside, *diagram.lines))
    rod: Panel | None = None
    if eq is not None:
        rod = rod_panel(eq)
    elif state.label == "adhered":
        rod = adhered_panel(own, 1.0 if own is None else own.critical_length)
    part, potential, off, no_potential = None, None, math.nan, "no state, no β₀, no potential"
    if land is not None:
        lam = state.lam if state.given == "groups" else (eq.lam if eq else 0.0)
        alpha1 = 0.0 if state.label == "adhered" else (None if eq is None else eq.alpha1)
        potential = named_panel(land[0].potential, lam, land[0].named, alpha1)
        if alpha1 is not None:
            off = off_by(land[0], lam, alpha1)
        error = f"{off:.0e} in α₁ at the ball" if math.isfinite(off) else "-"
        part = Part("potential", land[0].source, land[1], error)
        if too_far(potential, off):
            potential = None
            no_potential = f"Not shown: the {land[0].source} misses the state by {off:.2g} in α₁."
            if land[0].source.startswith("normal form"):
                no_potential += " " + why_no_branch(land[0].potential.beta0, full)
    swept = lambda_loop(state, curve, _required(land)) if own is None else pressure_loop(state, curve)
    shown = land[0] if land and potential is not None else None
    potential_by = ""
    if shown is not None:
        potential_by = ", by quadrature" if shown.source.startswith("quadrature") else f", {shown.source}"
    warnings = warnings_of(state, eq, curve, shown, off, full)
    if off_branch:
        where = "Its own is dotted." if full else "Its own is drawn when the slider rests."
        warnings = (*(said for said in warnings if said != OFF_BRANCH), f"{OFF_BRANCH} {where}")
    return Screen(
        state,
        full,
        found,
        time.perf_counter() - began,
        rod=rod,
        curve=curve,
        diagram=diagram,
        reading=_reading(state),
        here=here,
        off_branch=off_line,
        swept=swept,
        convention=state.convention if own is None else "delay",
        potential=potential,
        potential_by=potential_by,
        potential_part=part,
        no_potential=no_potential,
        warnings=warnings,
    )


def _required(land: tuple[Landscape, float] | None) -> Landscape:
    assert land is not None  # beta0 is given
    return land[0]


def _reading(state: State) -> str:
    """Under which control the diagram reads stability."""
    return AT_LENGTH if state.given == "groups" else AT_PRESSURE


def _diagram(state: State, branch: Branch) -> Panel:
    """Return the picture of a branch, its stability read as far as it is known."""
    return _read(branch, _reading(state))


@lru_cache(maxsize=32)
def _read(branch: Branch, reading: str) -> Panel:
    known: dict[str, bool] = {"middle": False, "lower": True}
    if reading == AT_PRESSURE:
        if branch.index is not None:
            return diagram_panel(branch)
        # From T to the minimum pressure one motion grows, for every rod.
        known = {"middle": False, "lower": False}
    stable = [known.get(label) for label in branch.state.tolist()]
    return diagram_panel(branch, stable=stable, reading=reading)


def _place(state: State, eq: Equilibrium | None, branch: Branch) -> tuple[float, float] | None:
    """Where the state is on the diagram."""
    groups = state.given == "groups"
    if eq is not None:
        return place(branch, *((eq.lam, eq.alpha1) if groups else (eq.length, eq.pressure)))
    if state.label == "adhered":
        return place(branch, *((state.lam, 0.0) if groups else (0.0, state.pressure)))
    return None
