"""Screens of a rod in a scene: the state at once where the picture before leads to it, the branch at rest.

The branch of a scene takes seconds.  While a slider moves nothing is walked: Newton's method takes the
state of the picture before to the new numbers.  At rest the branch is walked, and then answers, is
drawn, and is swept, each as soon as it is known.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ...analysis.scene_loop import sweep_scene
from ...base.errors import NotConverged, PeelOptError
from ...continuation.scene_family import SceneBranch
from ...equilibria.methods import Method
from ...equilibria.result import Equilibrium
from ...equilibria.scene_question import posed
from ...equilibria.scene_trace import SceneTrace, trace_scene
from ...equilibria.scenes import answered, require_certified, solve
from ...model.labels import OBSERVABLE, fits
from ...model.scene import Scene
from ...plots.diagram import AT_PRESSURE, coordinates, diagram_panel, place
from ...plots.loop import pressure_panel
from ...plots.panels import Axis, Line, Panel, room
from ...plots.rod import rod_panel
from ...residual.closures import READINGS
from ...residual.meshes import MOVING
from ...residual.scene_spectral import SceneProfile, SceneSolution
from .answers import MOVING_TOL, ONE, Found, found_by, is_beside
from .curves import Curve
from .loops import NOT_COMPUTED, SWEEP, LoopSweep
from .quick_walks import DENSE
from .screen import Screen
from .state import METHODS, State
from .words import flags_said

#: Least number of points and largest error of a traced branch, by accuracy.
TRACED = {"sketch": (30, 1e-3), "draft": (30, 1e-4), "standard": (40, 1e-5), "reference": (56, 1e-8)}

#: Pressure over the one at which the rod snaps or leaves T, up to which its folded states are drawn.
ABOVE = 1.05

#: Room around a branch, as a share of it.
_MARGIN = 0.1

NO_POTENTIAL = "The effective potential (35) is that of the paper's scene: a uniform pressure, a flat plate."
LATER = "It is computed when the slider rests."
NOTHING_YET = Found(None, "", None, 0.0)


def quick_scene_screen(state: State, best: Curve | None, before: Equilibrium | None) -> Screen:
    """Return what can be had at once of a scene: nothing is walked.

    Parameters
    ----------
    state : State
    best : Curve or None
        The branch that was drawn last: the answer is looked up on it if it is that of the scene, and it
        stays in the picture, dotted, if it is not.
    before : Equilibrium or None
        The answer of the picture before, which is followed.
    """
    began = time.perf_counter()
    own = best is not None and _belongs(best, state)
    tol = max(METHODS[state.accuracy][1], MOVING_TOL)
    if own:
        found = found_by(state, lambda: _solved(state, "spectral", tol))
    elif before is not None and (start := _start(state, before)) is not None:
        found = found_by(state, lambda: _followed(state, start, before, tol))
        if found.equilibrium is None:  # which says nothing: the branch will tell
            found = NOTHING_YET
    else:
        found = NOTHING_YET
    return _screen(state, found, best if own else None, began, aside=None if own else best)


def scene_screens(state: State) -> Iterator[tuple[Screen, str]]:
    """Yield ever fuller screens of a scene, each with what is computed next; the last with "".

    Numerical trouble is a message in them; nothing is raised.
    """
    began = time.perf_counter()
    named, tol = METHODS[state.accuracy]
    with ONE:
        found = found_by(state, lambda: _solved(state, named, tol))
    yield _screen(state, found, None, began), "tracing its branch"
    try:
        curve = _traced(_scene(state), *TRACED[state.accuracy])
    except PeelOptError as error:
        yield _screen(state, found, None, began, no_diagram=str(error), full=True), ""
        return
    yield _screen(state, found, curve, began), "its stability"
    known = _with_stability(curve)
    yield _screen(state, found, known, began), "its loop"
    loop = _swept(_scene(state), TRACED[state.accuracy][1])
    yield _screen(state, found, known, began, loop=loop, full=True), ""


def traced_scene(state: State) -> Curve:
    """Return the branch of a scene, drawn up to where a folded rod bears more than what made it fold.

    Raises
    ------
    PeelOptError
        If the branch cannot be entered, or is not accurate where it begins.
    """
    return _with_stability(_traced(_scene(state), *TRACED[state.accuracy]))


# --- answers ------------------------------------------------------------------------------------


def _scene(state: State) -> Scene:
    scene = state.rods_scene
    assert scene is not None  # the paper's is shown otherwise
    return scene


def _solved(state: State, method: str, tol: float) -> Equilibrium:
    asks = state.asks
    given: dict[str, Any] = {asks.given.name: state.value}
    label = None if state.label == "unfolded" else state.label
    return solve(
        _scene(state), free=asks.asked.name, state=label, near=state.near, method=method, tol=tol, **given
    )


def _start(state: State, before: Equilibrium) -> SceneProfile | None:
    """Return the state before as one of the scene as it is now; None where it cannot lead there."""
    scene, source = _scene(state), before.source
    if not isinstance(source, SceneSolution) or not isinstance(before.scene, Scene):
        return None
    meant = ("lifted", *OBSERVABLE) if state.label == "unfolded" else (state.label,)
    if before.scene.form != scene.form or not any(fits(before.state, each) for each in meant):
        return None
    if before.state == "folded" and state.label == "unfolded":
        return None
    profile = source.problem.profile(source.x)
    assert isinstance(profile, SceneProfile)
    return replace(profile, scene=scene, numbers=profile.numbers | scene.numbers)


def _followed(state: State, start: SceneProfile, before: Equilibrium, tol: float) -> Equilibrium:
    """Solve from the state before.

    Raises
    ------
    NotConverged
        If that does not lead to the same state, a little moved.
    NotCertified
        If the answer is not accurate enough.
    """
    began, asks = time.perf_counter(), state.asks
    question = posed(_scene(state), asks.asked.name, {asks.given.name: state.value})
    method = Method(MOVING, adaptive=False)
    found = answered(question, start, before.state, tol, 0, began, method)
    assert isinstance(found.source, SceneSolution)
    if not is_beside(start.scalars.A, found.source.problem.scalars(found.source.x).A):
        raise NotConverged("the state before does not lead to this one.")
    return require_certified(question, found)


# --- branch and loop ----------------------------------------------------------------------------


def _belongs(curve: Curve, state: State) -> bool:
    return isinstance(curve.branch, SceneTrace) and curve.branch.scene == state.rods_scene


@lru_cache(maxsize=32)
def _traced(scene: Scene, points: int, tol: float) -> Curve:
    began = time.perf_counter()
    branch = trace_scene(scene, points, tol, until=_drawn_to)
    # Of the states under suction, from which some are lifted, the last is where the picture begins.
    suction = np.flatnonzero(branch.pressure_ratio < 0.0)
    before = suction[suction < np.argmax(branch.pressure_ratio)]
    branch = branch[int(before[-1]) :] if len(before) else branch
    return Curve(branch, f"trace of {len(branch)} points", time.perf_counter() - began)


def _drawn_to(walked: SceneBranch) -> float:
    """Arclength at which a folded rod bears more than what made it fold, or the most that it can."""
    snap, load = walked.snap, walked.family.loading
    top = load(snap.point if snap else walked.points[0])
    turns = (f.point.arclength for f in walked.folds if f.kind == "LP-pressure" and f is not snap)
    least, end = next(turns, math.inf), next(turns, math.inf)
    folded = (p for p in walked.points if p.arclength > least)
    beyond = (p.arclength for p in folded if not 0.0 <= load(p) <= ABOVE * top)
    return min(next(beyond, math.inf), end)


@lru_cache(maxsize=32)
def _with_stability(curve: Curve) -> Curve:
    began = time.perf_counter()
    branch = curve.branch.with_stability()
    return replace(curve, branch=branch, seconds=curve.seconds + time.perf_counter() - began)


@lru_cache(maxsize=32)
def _swept(scene: Scene, tol: float) -> LoopSweep | str:
    """The loop, or why there is none, which takes as long to find out."""
    try:
        loop = sweep_scene(scene, SWEEP, tol)
    except PeelOptError as error:
        return f"Not shown: {error}"
    return LoopSweep(loop, pressure_panel(loop), NOT_COMPUTED)


# --- panels -------------------------------------------------------------------------------------


def _screen(
    state: State,
    found: Found,
    curve: Curve | None,
    began: float,
    *,
    loop: LoopSweep | str = LATER,
    no_diagram: str = LATER,
    full: bool = False,
    aside: Curve | None = None,
) -> Screen:
    """Put the panels together; ``aside`` is the branch of another scene, which is dotted."""
    eq = found.equilibrium
    shown = curve or aside
    diagram, here = None, None
    if shown is not None and shown.branch.rod == state.rod:
        here = None if eq is None else place(shown.branch, eq.length, eq.pressure)
        diagram = (_read(shown) if curve is not None else _before(shown)).at(here)
    warnings = list(flags_said(eq))
    if curve is not None and curve.branch.ended == "unresolved":
        warnings.append("The branch was followed only this far.")
    return Screen(
        state,
        full,
        found,
        time.perf_counter() - began,
        rod=None if eq is None else rod_panel(eq),
        curve=curve,
        diagram=diagram,
        reading=AT_PRESSURE,
        here=here,
        off_branch=math.nan if here is None or diagram is None else diagram.distance(here),
        swept=loop,
        no_potential=NO_POTENTIAL,
        warnings=tuple(warnings),
        no_diagram=no_diagram,
        solving=found is NOTHING_YET,
    )


@lru_cache(maxsize=32)
def _read(curve: Curve) -> Panel:
    """The branch, its stability read where it is computed already."""
    branch, panel = curve.branch, diagram_panel(curve.branch)
    assert isinstance(branch, SceneTrace)
    first, *others = (_smooth(line, branch) for line in panel.lines)
    begins = int(np.argmax(first.y >= 0.0))  # not under suction
    lines = (replace(first, x=first.x[begins:], y=first.y[begins:]), *others)
    up = Axis(panel.y.label, *room(np.concatenate([line.y for line in lines]), _MARGIN))
    return replace(panel, lines=lines, y=up)


def _smooth(line: Line, branch: SceneTrace) -> Line:
    """Return a piece of the branch as cubics through its points and their tangents."""
    across, up = coordinates(branch)
    first = int(np.flatnonzero((across == line.x[0]) & (up == line.y[0]))[0])
    rows = slice(first, first + len(line.x))
    s, points = branch.arclength[rows], branch.points[rows]
    if len(points) < 2:
        return line
    fine = np.unique(np.concatenate([np.linspace(a, b, DENSE) for a, b in pairwise(s)]))
    drawn = []
    for values, measure in ((line.x, "length"), (line.y, "pressure")):
        read = READINGS[measure]
        size = np.ptp(values) / (np.ptp([read(p.scalars) for p in points]) or 1.0)
        rates = [size * p.rate(read) for p in points]
        drawn.append(CubicHermiteSpline(s, values, rates)(fine))
    return replace(line, x=drawn[0], y=drawn[1])


@lru_cache(maxsize=32)
def _before(curve: Curve) -> Panel:
    """The branch of a scene that is shown no more, dotted, until its own takes its place."""
    panel = _read(curve) if isinstance(curve.branch, SceneTrace) else diagram_panel(curve.branch)
    first, *others = panel.lines
    lines = [Line("own", first.x, first.y, "of the scene before")]
    return replace(panel, lines=(*lines, *(Line("own", each.x, each.y) for each in others)), marks=())
