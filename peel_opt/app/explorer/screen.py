"""`Scene`: the four linked panels of a `State`, what each cost, and what must be said about them."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from functools import lru_cache

from ...analysis.maxwell import TURN
from ...base.errors import PeelOptError
from ...equilibria.result import Equilibrium
from .answers import Found, full_answer, quick_answer
from .curves import Curve, law_of, own_branch, traced, window
from .diagram_panel import diagram_panel, is_drawn, units
from .loop_panel import lambda_loop, pressure_loop
from .panels import AnswerText, DiagramPanel, LoopPanel, Part, PotentialPanel, RodPanel
from .potential_panel import Landscape, landscape, off_by, potential_panel, too_far
from .quick_walks import QuickBranch, quick_groups, quick_rod
from .rod_panel import adhered_panel, rod_panel
from .state import State
from .words import OFF_BRANCH, answer_of, warnings_of, why_no_branch

#: Share of a picture's 50 ms that walks may take; what is left of a branch follows later.
BUDGET = 0.026


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything on the screen.

    Parameters
    ----------
    state : State
    full : bool
        Whether it was solved and traced to the accuracy asked for; otherwise it is what could be
        had while a slider moved.
    answer : AnswerText or None
    rod : RodPanel or None
        None where the state does not exist.
    diagram : DiagramPanel
    potential : PotentialPanel or None
    loop : LoopPanel or None
    message : str
        That the state does not exist, and what does; empty if all is well.
    warnings : tuple of str
        Where a picture leaves its range.
    nearest : State or None
        The nearest state that exists, where this one does not.
    no_loop, no_potential : str
        Why there is none.
    parts : tuple of Part
        What each panel cost and how far to trust it.
    seconds : float
        Time it took to compute all of it.
    equilibrium : Equilibrium or None
        The answer itself.
    curve : Curve
        The branch that the diagram shows.
    """

    state: State
    full: bool
    answer: AnswerText | None
    rod: RodPanel | None
    diagram: DiagramPanel
    potential: PotentialPanel | None
    loop: LoopPanel | None
    message: str
    warnings: tuple[str, ...]
    nearest: State | None
    no_loop: str
    no_potential: str
    parts: tuple[Part, ...]
    seconds: float
    equilibrium: Equilibrium | None
    curve: Curve


def live_scene(
    state: State, *, best: Curve | None = None, before: Equilibrium | None = None, budget: float = BUDGET
) -> Scene:
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
    Scene
        With ``full`` False.  Numerical trouble is a message in it; nothing is raised.
    """
    began = time.perf_counter()
    deadline = began + budget
    law = law_of(state)
    walks: tuple[QuickBranch, ...]
    if state.given == "groups":
        walks, curve = quick_groups(law, state.beta0, window(state.beta0, state.lam), deadline)
    else:
        walk, curve = quick_rod(law, state.effective_ratio, deadline)
        walks = (walk,)
    found = quick_answer(state, walks, deadline, before)
    if best is not None and _belongs(best, state):
        curve = best
    beta0 = _beta0(state, found.equilibrium)
    local = curve if state.given == "groups" else _quick_local(state, found.equilibrium, deadline)
    return _scene(state, found, curve, _landscape(state, beta0, local), local, began, full=False)


def full_scene(state: State) -> Scene:
    """Return the picture solved and traced to the accuracy of the state.

    Returns
    -------
    Scene
        With ``full`` True.  Numerical trouble is a message in it; nothing is raised.
    """
    began = time.perf_counter()
    found = full_answer(state)
    trouble = ""
    curve = None
    try:
        curve = traced(state)
    except PeelOptError as error:
        trouble = f"The diagram is a quick walk, since the trace failed: {error}"
    if curve is None:
        deadline = time.perf_counter() + 5.0
        if state.given == "groups":
            curve = quick_groups(law_of(state), state.beta0, window(state.beta0, state.lam), deadline)[1]
        else:
            curve = quick_rod(law_of(state), state.effective_ratio, deadline)[1]
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
    scene = _scene(state, found, curve, _landscape(state, beta0, local), local, began, full=True)
    return replace(scene, warnings=(*scene.warnings, trouble)) if trouble else scene


def _groups_of(state: State, eq: Equilibrium) -> State:
    """The problem at fixed beta0 to which a rod's state belongs, with a window that holds it."""
    return State(beta0=eq.beta0, lam=eq.lam, law=state.law, accuracy=state.accuracy)


def _quick_local(state: State, eq: Equilibrium | None, deadline: float) -> Curve | None:
    """Walk at the fixed beta0 of a rod's state, where there is a fold to walk round."""
    if eq is None or not 0.0 < eq.beta0 < TURN:
        return None
    span = window(eq.beta0, eq.lam)
    return quick_groups(law_of(state), eq.beta0, span, deadline)[1]


def _belongs(curve: Curve, state: State) -> bool:
    """Whether a curve is the diagram of a state, window included."""
    if curve.law != law_of(state).name:
        return False
    if state.given == "groups":
        inside = curve.lam.min() <= state.lam <= curve.lam.max()
        return curve.hold == "beta0" and curve.held == state.beta0 and inside
    return curve.hold == "ratio" and curve.held == state.effective_ratio


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


def _scene(
    state: State,
    found: Found,
    curve: Curve,
    land: tuple[Landscape, float] | None,
    local: Curve | None,
    began: float,
    *,
    full: bool,
) -> Scene:
    """Put the panels together."""
    eq = found.equilibrium
    here, on_loop = _places(state, eq)
    diagram = diagram_panel(state, curve, here)
    off_branch = here is not None and not is_drawn(diagram, here)
    if off_branch and full and eq is not None:
        diagram = diagram_panel(state, curve, here, own_branch(state, eq))
    rod: RodPanel | None = None
    if eq is not None:
        rod = rod_panel(eq)
    elif state.label == "adhered":
        own = state.rod
        rod = adhered_panel(own, 1.0 if own is None else own.critical_length)
    parts = [Part("state", eq.stats.method if eq else "none", found.seconds, _error_of(eq))]
    estimate = "about " if curve.method.startswith("quick") else ""
    parts.append(Part("diagram", curve.method, curve.seconds, f"{estimate}{curve.error:.0e} in arclength"))
    potential, off, no_potential = None, math.nan, "no state, no β₀, no potential"
    if land is not None:
        lam = state.lam if state.given == "groups" else (eq.lam if eq else 0.0)
        alpha1 = 0.0 if state.label == "adhered" else (None if eq is None else eq.alpha1)
        potential = potential_panel(land[0], lam, alpha1)
        if alpha1 is not None:
            off = off_by(land[0], lam, alpha1)
        error = f"{off:.0e} in α₁ at the ball" if math.isfinite(off) else "-"
        parts.append(Part("potential", land[0].source, land[1], error))
        if too_far(potential, off):
            potential = None
            no_potential = f"Not shown: the {land[0].source} misses the state by {off:.2g} in α₁."
            if land[0].source.startswith("normal form"):
                no_potential += " " + why_no_branch(land[0].potential.beta0, full)
    loop: LoopPanel | str
    if state.given == "groups":
        loop = lambda_loop(state, curve, _required(land), on_loop)
    else:
        loop = pressure_loop(state, curve, on_loop)
    shown = land[0] if land and potential is not None else None
    warnings = warnings_of(state, eq, curve, shown, off, full)
    if off_branch:
        where = "Its own is dotted." if full else "Its own is drawn when the slider rests."
        warnings = (*(said for said in warnings if said != OFF_BRANCH), f"{OFF_BRANCH} {where}")
    return Scene(
        state=state,
        full=full,
        answer=None if eq is None else answer_of(eq),
        rod=rod,
        diagram=diagram,
        potential=potential,
        loop=None if isinstance(loop, str) else loop,
        message=found.message,
        warnings=warnings,
        nearest=found.nearest,
        no_loop=loop if isinstance(loop, str) else "",
        no_potential=no_potential,
        parts=tuple(parts),
        seconds=time.perf_counter() - began,
        equilibrium=eq,
        curve=curve,
    )


def _required(land: tuple[Landscape, float] | None) -> Landscape:
    assert land is not None  # beta0 is given
    return land[0]


def _error_of(eq: Equilibrium | None) -> str:
    if eq is None:
        return "-"
    name = {"pressure_ratio": "p/T₀", "length_ratio": "s̄/η", "alpha1": "α₁"}[eq.answered]
    return f"{eq.error:.0e} in {name}"


def _places(
    state: State, eq: Equilibrium | None
) -> tuple[tuple[float, float] | None, tuple[float, float] | None]:
    """Where the state is on the diagram and on the loop."""
    rod = state.rod
    if rod is None:
        if state.label == "adhered":
            return (state.lam, 0.0), (state.lam, 0.0)
        return (None, None) if eq is None else ((eq.lam, eq.alpha1),) * 2
    length, _, pressure, _ = units(state)
    if state.label == "adhered":
        p = state.pressure / pressure
        return (0.0, p), (p, 0.0)
    if eq is None:
        return None, None
    s, p = eq.length / length, eq.pressure / pressure
    return (s, p), (p, s)
