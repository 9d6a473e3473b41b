"""`solve`: the one number of a scene that is left free, with all others given."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.checks import finite, positive
from ..base.errors import (
    AmbiguousState,
    InvalidInput,
    NoEquilibrium,
    NotCertified,
    NotConverged,
    PeelOptError,
)
from ..base.threads import one_thread
from ..continuation.primary import Candidate
from ..continuation.scene_family import SceneBranch, lies_down, scene_branches
from ..model.bond import CohesiveLaw
from ..model.dimension import DOMAINS, FORCE
from ..model.labels import OBSERVABLE, fits, known_state
from ..model.loads import Pressure
from ..model.mixed_bonds import Bond
from ..model.scene import Scene
from ..model.tip_gap import excess_over_gaps, last_pressure
from ..model.tips import Middle, TipLoad
from ..residual import programme
from ..residual.accuracy import HEIGHT_NOISE, response_to
from ..residual.closures import READINGS, Closure
from ..residual.discretisation import Transcription
from ..residual.linear import Linearised
from ..residual.meshes import SCENES
from ..residual.newton import Correction, correct
from ..residual.programme import Ipopt
from ..residual.scene_phases import scene_layout
from ..residual.scene_spectral import (
    SceneDiscretisation,
    SceneProfile,
    SceneSolution,
    SceneTranscription,
)
from .methods import METHODS, Method, as_method
from .result import Equilibrium, Stats, verdict
from .scene_question import COMMON, SceneQuestion, posed
from .select import far_from

#: How the answered number is called in a result.
ANSWERED = {"pressure": "pressure_ratio", "length": "length_ratio"}

#: All states of a scene that may be asked for.
SCENE_STATES = ("lifted", *OBSERVABLE, "other")

#: How often the mesh of an answer may be refined.
MOST_REFINEMENTS = 5

#: States from the last to the first that a question without state= means: the one that goes on from
#: the attached rod, then the unfolded one of least pressure.
DEFAULT = ("lifted", "unfolded")

#: Points of a branch below which it says nothing of what there is.
FEWEST = 3

#: Detached length over eta from which on a rod is all arm: its tip is as far from its front as it is long.
LONG_ARM = 300.0

#: Ends of a branch beyond which it may go on.
GIVEN_UP = {"short", "touched", "stalled", "limit", "long", "suction", "unbounded"}


@one_thread
def solve(
    scene: Scene,
    *,
    free: str,
    state: str | None = None,
    near: float | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    throw: bool = True,
    **given: float,
) -> Equilibrium:
    """Solve for any one number of a scene.

    Parameters
    ----------
    scene : Scene
    free : str
        "length", "pressure", or a number that the scene names: "force", "moment", "friction",
        "weight", "drag", "unbonded", "natural_curvature", "curvature" and so on; what the scene itself
        says of that number does not count then.
    state : str, optional
        "lifted", "unfolded", "middle", "lower", "folded" or "other".  Default: the lifted state where
        there is one, that goes on from the attached rod; else the unfolded state of lowest pressure.
    near : float, optional
        Pick the state whose free number is nearest, in the units of the rod.
    method : str, Method or Transcription
        "auto", which is "spectral", "collocation", "shooting" (multiple shooting by IPOPT), or one of them
        configured, whose mesh is then not refined.  All start from a state of the spectral form.
    tol : float
        Largest error of the answer over its unit of T0 and eta, and largest certificate.
    throw : bool
        If False, a failure comes back as an `Equilibrium` whose ``status`` and ``message`` tell.
    **given : float
        ``pressure`` [Pa] and ``length`` [m], but for the one that is free; without a pressure there is none.

    Returns
    -------
    Equilibrium
        ``numbers`` has all numbers of the scene, the free one among them, in the units of the rod.

    Raises
    ------
    InvalidInput
        If the scene does not name the free number, or what is given is too little or too much.
    NoEquilibrium
        If the branch of the scene, followed to its ends, has no such state.
    AmbiguousState
        If several states fit and ``near`` is not given.
    NotConverged, NotCertified
        If the answer is out of reach.
    """
    try:
        return _solve(scene, free, state, near, scene_method(method), positive("tol", tol), given)
    except PeelOptError as error:
        if throw:
            raise
        rod = scene.rod if isinstance(scene, Scene) else None
        return Equilibrium.nothing(rod, ANSWERED.get(free, free), tol, error.status, str(error))


def _solve(
    scene: Scene,
    free: str,
    state: str | None,
    near: float | None,
    method: Method,
    tol: float,
    given: dict[str, float],
) -> Equilibrium:
    began = time.perf_counter()
    state = known_state(state, among=SCENE_STATES)
    question = posed(scene, free, given)
    unit = "" if scene.rod.dimensionless else question.dimension.unit
    wanted = None if near is None else finite("near", near, unit) / question.dimension.size(scene.rod)
    if (denied := _without_a_gap(question)) is not None:
        raise denied
    branches = scene_branches(question.family(SCENES))
    chosen, profile = _chosen(question, branches, state, wanted)
    walked = sum(len(branch.points) for branch in branches)
    found = answered(question, profile, chosen, tol, walked, began, method)
    return require_certified(question, replace(found, flags=found.flags + far_from(wanted, found.answer)))


def require_certified(question: SceneQuestion, found: Equilibrium) -> Equilibrium:
    """Return an answer that is certified.

    Raises
    ------
    NotCertified
        If it is not.
    """
    if found.certified:
        return found
    raise NotCertified(
        f"{question.words}: found {question.free} = {question.named(found.answer)}, but its error"
        f" {found.error:.1e} or its certificate {found.certificate:.1e} exceeds tol = {found.tol:.1e}.",
        remedy="Give a larger tol; near a fold the question itself loses digits.",
        candidates=(found,),
    )


def refuse_options(*, law: object) -> None:
    """Raise where a question about a scene names a law, which the scene has."""
    if law != "auto":
        raise InvalidInput(
            "law cannot be given here: a scene has its own law: give it as Scene(..., law=...).",
            remedy="Leave out law=.",
        )


def scene_method(method: str | Method | Transcription) -> Method:
    """Return the method a caller named or configured for a scene.

    Raises
    ------
    InvalidInput
        If it is the series.
    """
    chosen = as_method(method)
    if chosen.transcription is None:
        raise InvalidInput(
            "method cannot be given here as 'series': the closed form is that of the plain rod.",
            remedy="Choose spectral, collocation or shooting.",
        )
    return chosen


def plain_law(scene: Scene) -> str | CohesiveLaw:
    """Return the law of a scene that is the paper's, as a question about its rod takes it."""
    return scene.bond.law if isinstance(scene.law, Bond) else scene.law


@one_thread
def states_of_scene(scene: Scene, given: str, value: float, tol: float, method: Method) -> list[Equilibrium]:
    """Return all states on the branches of a scene at a pressure or a length, labelled.

    One that is not certified to ``tol`` is among them, with its status.

    Raises
    ------
    NotConverged
        If no way into the scene was found, or a state between two points of a branch was lost.
    """
    (free,) = COMMON.keys() - {given}
    question = posed(scene, free, {given: value})
    found: list[Equilibrium] = []
    if _without_a_gap(question) is not None:
        return found
    for branch in scene_branches(question.family(SCENES)):
        for candidate in branch.candidates(question.target):
            began, profile = time.perf_counter(), candidate.profile
            assert isinstance(profile, SceneProfile)
            walked = len(branch.points)
            found.append(answered(question, profile, candidate.state, tol, walked, began, method))
    return found


def _chosen(
    question: SceneQuestion, branches: Sequence[SceneBranch], state: str | None, near: float | None
) -> tuple[str, SceneProfile]:
    """Pick the state that is meant and land on it."""
    found = [c for branch in branches for c in branch.candidates(question.target)]
    meant = [c for c in found if state is None or fits(c.state, state)]
    if near is None:
        meant = _by_default(meant, state, question)
    if state in (None, "lifted") and near is None and not any(c.state == "lifted" for c in meant):
        _require_no_smaller(question, branches)
    if not meant:
        raise _nothing(question, branches, state, [c.state for c in found])
    landed: list[tuple[str, SceneProfile, float]] = []
    lost: PeelOptError | None = None
    low, high = DOMAINS.get(question.free, (-math.inf, math.inf))
    for candidate in meant:
        try:
            profile = candidate.profile
        except NotConverged as error:
            lost = error
            continue
        assert isinstance(profile, SceneProfile)
        problem = candidate.solution.problem
        assert isinstance(problem, SceneDiscretisation)
        value = question.read(problem, candidate.solution.correction.x)
        if low <= value <= high:
            landed.append((candidate.state, profile, value))
    if not landed:
        raise lost or _nothing(question, branches, state, [c.state for c in found])
    if near is not None:
        label, profile, _ = min(landed, key=lambda found: abs(found[2] - near))
        return label, profile
    if len(landed) > 1:
        values = ", ".join(f"{label}: {question.free} = {question.named(v)}" for label, _, v in landed)
        raise AmbiguousState(
            f"{question.words}: {len(landed)} states fit: {values}.",
            remedy="Pick one with near=.",
            candidates=tuple(v * question.dimension.size(question.scene.rod) for _, _, v in landed),
        )
    return landed[0][0], landed[0][1]


def _by_default(candidates: list[Candidate], state: str | None, question: SceneQuestion) -> list[Candidate]:
    """Of all candidates, those that a question without state= means; where another number is free, all."""
    if state is not None or question.number is not None:
        return candidates
    for wanted in DEFAULT:
        if named := [c for c in candidates if fits(c.state, wanted)]:
            return [min(named, key=lambda c: c.estimate(lambda s: s.alpha1))]
    return []


def _require_no_smaller(question: SceneQuestion, branches: Sequence[SceneBranch]) -> None:
    """Raise where a lifted state may be smaller than those that a branch was followed to.

    Raises
    ------
    NotConverged
    """
    if question.number is not None or not question.scene.lifts:
        return
    read = READINGS[question.target.kind]
    for branch in branches:
        if not branch.points or not 0.0 < question.target.value < read(branch.points[0].scalars):
            continue
        if branch.ends[0] == "unloaded":
            raise NotConverged(
                f"{question.words}: what lifts the rod lifts a longer one without any pressure, and one so"
                " short only against suction, which was not followed.",
                remedy="Ask for a larger one.",
            )
        raise NotConverged(
            f"{question.words}: the lifted state is smaller than those that were followed"
            f" (tip angle below {branch.points[0].scalars.A:.1e} rad).",
            remedy="Ask for one of the states beyond the snap with state=, or for a larger one.",
        )


def _nothing(
    question: SceneQuestion, branches: Sequence[SceneBranch], state: str | None, others: list[str]
) -> PeelOptError:
    """Say what exists instead, or that the branch could not be followed far enough to know."""
    wanted = f"{state or 'lifted or unfolded'} equilibrium"
    there = f" States that do exist there: {', '.join(others)}." if others else ""
    points = [p for branch in branches for p in branch.points]
    torn = bool(points) and all(_torn(branch, question.target) for branch in branches)
    there += " All of them need suction: what is done to the tip tears the rod off." if torn else ""
    if (
        points
        and "T" in {branch.ends[0] for branch in branches}
        and _beside_the_transition(question, branches)
    ):
        return NotConverged(
            f"{question.words}: nearer to the transition than states of a scene are followed.",
            remedy="Give a number further from it.",
        )
    if not points:
        return NotConverged(
            f"{question.words}: no state of the scene could be followed.",
            remedy="Check the units of its numbers.",
        )
    read = READINGS[question.target.kind]
    meant = DEFAULT if state is None else (state,)
    values = [
        read(p.scalars)
        for branch in branches
        for p in branch.points
        if state == "other" or any(fits(branch.state_at(p.arclength), each) for each in meant)
    ] or [read(p.scalars) for p in points]
    nearest = min(values, key=lambda v: abs(v - question.target.value))
    unit = COMMON[question.target.kind].size(question.scene.rod)
    best = f" The nearest that it has: {question.target.kind} = {nearest * unit:.8g}."
    if any(_may_go_on(branch, question.target) for branch in branches):
        reached = points[-1].scalars
        return NotConverged(
            f"{question.words}: no {wanted} was met on the branch of the scene as far as it was followed"
            f" (p/T0 = {reached.pressure_ratio:.4g}, sbar/eta = {reached.sigma:.4g}).{best}{there}",
            remedy="Ask for a smaller load on the tip; solve(free=) tells which the rod bears."
            if torn
            else "Ask for a number nearer to where the rod begins to lift.",
            nearest=nearest * unit,
        )
    return NoEquilibrium(
        f"no {wanted} of this scene at {question.words}, on the branch that goes on from the attached rod."
        f"{best}{there}",
        nearest=nearest * unit,
    )


def _torn(branch: SceneBranch, target: Closure) -> bool:
    """Whether a pressure is asked for, and every state of a rod with a load on its tip needs suction."""
    if target.kind != "pressure" or target.value < 0.0 or not isinstance(branch.family.scene.tip, TipLoad):
        return False
    return bool(branch.points) and max(p.scalars.pressure_ratio for p in branch.points) < 0.0


def _without_a_gap(question: SceneQuestion) -> NoEquilibrium | None:
    """Say that the identity leaves the tip no gap at the pressure that is given; None where it does."""
    scene, P = question.scene, question.given.get("pressure")
    bounds = None if P is None or question.number else excess_over_gaps(scene, P)
    if bounds is None or bounds[0] <= 0.0 <= bounds[1]:
        return None
    unit, traction = FORCE.unit_of(scene.rod), COMMON["pressure"]
    nearest = last_pressure(scene, P) * traction.size(scene.rod)  # type: ignore[arg-type]
    put_in, side = ("more", "Below") if bounds[0] > 0.0 else ("less", "Above")
    missed = max(bounds[0], -bounds[1]) * FORCE.size(scene.rod)
    return NoEquilibrium(
        f"no equilibrium of this scene at {question.words}, of any length: at every gap of the tip pressure"
        f" and bending together put in {put_in} than the bond takes, by {missed:.6g} {unit} at least."
        f" {side} {nearest:.8g} {traction.unit_of(scene.rod)} a gap exists.",
        nearest=nearest,
    )


def _may_go_on(branch: SceneBranch, target: Closure) -> bool:
    """Whether what is asked for may lie beyond an end at which a branch was left.

    The middle of a strip that does not stretch rises as the strip gets longer, and p y is what the bond
    takes at most: under a uniform pressure a higher one is not met again.  What is torn off by its tip unless
    it is sucked to its wall needs less and less suction as it gets longer, but always some.
    """
    scene = branch.family.scene
    ends = GIVEN_UP & set(branch.ends)
    if branch.ends[0] == "unloaded" and target.value < READINGS[target.kind](branch.points[0].scalars):
        return True  # under suction
    if _torn(branch, target):
        ends -= {"limit"} if branch.points[-1].scalars.sigma > LONG_ARM else set()
    if target.kind == "pressure":  # beyond what was followed it only grows
        ends -= {"unbounded", *_rising(branch, target.value)}
    strip = isinstance(scene.tip, Middle) and scene.tip.slack and scene.stretch is None
    if strip and scene.loads == (Pressure(),) and target.kind == "pressure" and branch.points:
        ends -= {"long"} if target.value > branch.points[-1].scalars.pressure_ratio else set()
    return bool(ends) or len(branch.points) < FEWEST


def _rising(branch: SceneBranch, pressure_ratio: float) -> set[str]:
    """Return the ends, at a short length or a touch, to which the pressure rises from one that is larger."""
    P = [p.scalars.pressure_ratio for p in branch.points]
    if len(P) < FEWEST:
        return set()
    rises = ((branch.ends[0], P[0], P[1]), (branch.ends[1], P[-1], P[-2]))
    return {
        end for end, last, before in rises if end in ("short", "touched") and last > before > pressure_ratio
    }


def _beside_the_transition(question: SceneQuestion, branches: Sequence[SceneBranch]) -> bool:
    """Whether what is given lies where the branch from T, which is not followed to its end, has yet to go."""
    first = branches[0].points[0]
    reach = 10.0 * abs(first.rate(READINGS[question.target.kind]) / first.turn.A * first.scalars.A)
    return abs(READINGS[question.target.kind](first.scalars) - question.target.value) <= reach


def answered(
    question: SceneQuestion,
    profile: SceneProfile,
    state: str,
    tol: float,
    walked: int,
    began: float,
    method: Method = METHODS["auto"],
) -> Equilibrium:
    """Solve on finer and finer meshes until error and certificate meet the tolerance.

    A mesh that was given stays, and one refinement tells its error.
    """
    mesh, given = method.transcription, question.closures
    assert mesh is not None
    problem, first, evaluations = _corrected(question.transcription(mesh), profile, given, method.ipopt)
    refinements, iterations, before = 0, first.iterations, 0.0
    while True:
        refinements += 1
        fine, second, looks = _corrected(problem.settings.refined(), problem.profile(first.x), given)
        iterations, evaluations = iterations + second.iterations, evaluations + looks
        kept, solved = (fine, second) if method.adaptive else (problem, first)
        at = Linearised.at(kept, solved.x, *given)
        own = response_to(at, solved.update, question.weights(kept, solved.x), question.read(kept, solved.x))
        difference = _difference(question, (problem, first.x), (fine, second.x), own.leverage)
        # No refinement gains more than the order: a smaller difference is luck.
        difference = max(difference, before / problem.settings.most_gain)
        seen = 0.1 * before / difference if difference > 0.0 else 0.0
        gain = max(problem.settings.gain_at(problem, first.x), seen)
        if difference <= own.rounding:  # what two meshes agree on needs no gain, which is noise there
            left = difference
        elif method.adaptive:
            left = difference / (gain - 1.0) if gain > 1.0 else math.inf
        else:
            left = difference / (1.0 - 1.0 / gain) if gain > 1.0 else math.inf
        error = left + own.rounding
        problem, first, before = fine, second, difference
        missed = kept.certificate(solved.x)
        done = error <= tol and missed <= tol
        ended = refinements == MOST_REFINEMENTS or difference <= own.rounding
        if done or ended or not method.adaptive:
            break
    stats = Stats(
        method=f"{kept.settings.mesh!r}",
        seconds=time.perf_counter() - began,
        iterations=iterations,
        evaluations=evaluations,
        unknowns=kept.size,
        refinements=refinements,
        path_points=walked,
        condition=own.condition,
    )
    return report(question, kept, solved.x, state, error, missed, tol, stats)


def _corrected(
    transcription: SceneTranscription,
    profile: SceneProfile,
    given: tuple[Closure, ...],
    ipopt: Ipopt | None = None,
) -> tuple[SceneDiscretisation, Correction, int]:
    """Solve from a profile: by Newton's method, or by IPOPT and what Newton's has left to do.

    The third is how often the equations were evaluated.
    """
    plan = scene_layout(profile)
    problem = transcription.discretise(plan.phases)
    start, before, looks = problem.pack(profile.rephased(plan.breaks)), 0, 0
    if ipopt is not None:
        solved = programme.solve(problem, start, given, ipopt)
        if not solved.solved:
            raise NotConverged(
                f"IPOPT stopped with {solved.status} after {solved.iterations} iterations"
                f" on {transcription.mesh!r} with {problem.size} unknowns of the scene.",
                remedy="Try a finer mesh, or method='spectral'.",
            )
        start, before, looks = solved.x, solved.iterations, solved.evaluations
    result = correct(problem, start, given)
    if not result.converged:
        raise NotConverged(
            f"Newton's method did not converge on {problem.size} unknowns of the scene"
            f" (last relative update {result.step:.1e}).",
            remedy="Move the given number a little.",
        )
    every = looks + result.iterations
    return problem, replace(result, iterations=result.iterations + before), every


def _difference(
    question: SceneQuestion,
    coarse: tuple[SceneDiscretisation, np.ndarray],
    fine: tuple[SceneDiscretisation, np.ndarray],
    leverage: np.ndarray,
) -> float:
    """Return how far two meshes are apart in the answer, the largest that any scalar speaks of."""
    apart = np.abs(fine[1][fine[0].tail] - coarse[1][coarse[0].tail])
    own = abs(question.read(*fine) - question.read(*coarse))
    return max(own, float((leverage * apart).max()))


def report(
    question: SceneQuestion,
    problem: SceneDiscretisation,
    x: np.ndarray,
    state: str,
    error: float,
    missed: float,
    tol: float,
    stats: Stats,
) -> Equilibrium:
    """Turn a solution into an `Equilibrium` with its certificate and flags."""
    scene, s, rod = question.scene, problem.scalars(x), question.scene.rod
    source = SceneSolution(problem, x, scene.bond.law)
    shape, q = source.shape(), problem.found(x)
    opened = problem.profile(x).heights()
    gaps = source.gaps()
    reaction = -float(shape.Ny[-1])
    pull = problem.pull_ahead(x) if scene.layer is not None else 0.0
    mirrored = isinstance(scene.tip, Middle)  # and a strip may meet its other half
    present = {
        "y > y0": bool(opened.max() > scene.bond.holds_to + HEIGHT_NOISE),
        "p < 0": s.pressure_ratio < -HEIGHT_NOISE,
        "y < 0": bool(gaps.min() < -HEIGHT_NOISE * np.abs(gaps).max()),
        "overhang": np.abs(shape.theta).max() > 0.5 * np.pi,
        "tip on plate": isinstance(scene.tip, TipLoad) and lies_down(problem.profile(x)),
        "self-contact": shape.crosses_itself() or (mirrored and shape.x.min() < shape.x[0] - HEIGHT_NOISE),
        "edge pulled": reaction < 0.0 and not scene.line_energy,
        "fails ahead": pull > 1.0,
        "tip pulled": q.get("reaction", 0.0) < 0.0,
    }
    measured = scene.dimensions | dict.fromkeys(scene.reactions, FORCE)
    numbers = {name: q[name] * kind.size(rod) for name, kind in measured.items()}
    if scene.layer is not None:
        rigid = scene.layer.rigid_length(s.sigma, reaction / s.sigma**2, q)
        numbers |= {"pull_ahead": rod.pressure(pull), "rigid_length": rod.length(rigid)}
    return Equilibrium(
        rod=rod,
        law=scene.bond.name,
        beta0=s.beta0,
        lam=s.lam,
        alpha1=s.alpha1,
        answered=ANSWERED.get(question.free, question.free),
        error=error,
        certificate=missed,
        tol=tol,
        state=state,
        status=verdict(error, missed, tol),
        flags=tuple(name for name, is_so in present.items() if is_so),
        stats=stats,
        source=source,
        given={f"{name}_ratio": value for name, value in question.given.items()},
        scene=scene,
        numbers=numbers,
        unit=question.dimension.size(rod),
    )
