"""Answers for the explorer: quick ones along the quick walk, full ones by the public questions."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ...analysis.maxwell import TURN
from ...base.errors import NoEquilibrium, NotCertified, NotConverged, PeelOptError
from ...continuation.family import Family
from ...continuation.goal import Goal
from ...continuation.primary import Candidate
from ...equilibria.ask import ask_rod, equilibrium
from ...equilibria.certify import certify
from ...equilibria.methods import Method, solve_to_tolerance
from ...equilibria.question import ASKS, Question
from ...equilibria.result import Equilibrium
from ...model.labels import fits
from ...residual.closures import Closure
from ...residual.discretisation import Profile
from ...residual.shape import Solution
from ...residual.transcriptions import Spectral
from .curves import law_of, window
from .quick_walks import QuickBranch, gone, quick_branch, walked
from .state import METHODS, State
from .state_cards import named_law

#: One mesh, its error from a second: what the lower accuracies and all moving pictures solve with.
MESHES = {"sketch": Spectral(nodes=6), "draft": Spectral(nodes=8)}
MOVING = Spectral(nodes=14)

#: Largest error of an answer while a slider moves.
MOVING_TOL = 1e-4

#: Height below the plate, as a share of the largest, that a coarse mesh leaves near the edge.
UNDERSHOOT = 1e-3

#: Relative change of the tip angle within which the state of the picture before is followed.
NEIGHBOUR = 0.25

#: How far beyond the nearest value that exists a state is looked for, so that it is off the fold.
INSIDE = 1e-4

#: One full answer at a time: MUMPS, which IPOPT solves with, is not thread-safe, and the primary
#: branches that all answers share grow while they are read.
_ONE = threading.Lock()


@dataclass(frozen=True, eq=False)
class Found:
    """What a question came to.

    Parameters
    ----------
    equilibrium : Equilibrium or None
        None where there is none, and for the adhered rod.
    message : str
        Why there is none, or what is the matter with it.
    nearest : State or None
        The nearest state that does exist.
    seconds : float
    """

    equilibrium: Equilibrium | None
    message: str
    nearest: State | None
    seconds: float


def full_answer(state: State) -> Found:
    """Answer by the method and to the tolerance that the accuracy names; one at a time."""
    with _ONE:
        return _full_answer(state)


def _full_answer(state: State) -> Found:
    named, tol = METHODS[state.accuracy]
    mesh = MESHES.get(state.accuracy)

    def ask(method: str | Method) -> Equilibrium:
        options = {
            "law": named_law(state),
            "state": None if state.label == "unfolded" else state.label,
            "near": state.near,
            "method": method,
            "tol": tol,
        }
        rod = state.rod
        if rod is None:
            return equilibrium(beta0=state.beta0, lam=state.lam, **options)  # type: ignore[arg-type]
        return ask_rod(rod, state.given, state.value, **options)  # type: ignore[arg-type]

    if mesh is not None:
        rough = _found(state, lambda: ask(Method(mesh, adaptive=False)))
        if rough.equilibrium is not None or rough.nearest is not None:
            return rough
        # Near a fold a coarse mesh leaves the branch: the card's own method has the last word.
    return _found(state, lambda: ask(named))


def quick_answer(
    state: State, walks: tuple[QuickBranch, ...], deadline: float, before: Equilibrium | None = None
) -> Found:
    """Answer along quick walks, with what they have been walked so far.

    Parameters
    ----------
    walks : tuple of QuickBranch
        Of the diagram: the rod's, or both sides at fixed beta0.
    before : Equilibrium, optional
        The answer of the picture before, from which Newton starts where the walks end too early.
    """

    def ask() -> Equilibrium:
        try:
            return _along(state, walks, deadline)
        except NotConverged:
            followed = None if before is None else _followed(state, before)
            if followed is None:
                raise
            return followed

    return _found(state, ask)


def _found(state: State, ask: Callable[[], Equilibrium]) -> Found:
    began = time.perf_counter()
    if state.label == "adhered":
        return Found(None, "The adhered rod is straight; every law holds it up to p = T₀.", None, 0.0)
    try:
        found = _without_undershoot(ask())
        return Found(found, "", None, time.perf_counter() - began)
    except NotCertified as error:
        best = _without_undershoot(error.candidates[0]) if error.candidates else None
        return Found(best, str(error), None, time.perf_counter() - began)
    except PeelOptError as error:
        return Found(None, str(error), _nearest(state, error.nearest), time.perf_counter() - began)


def _without_undershoot(eq: Equilibrium) -> Equilibrium:
    """Take back "y < 0" where only the coarse mesh is below the plate."""
    if "y < 0" not in eq.flags or eq.y.min() < -UNDERSHOOT * abs(eq.y).max():
        return eq
    return replace(eq, flags=tuple(flag for flag in eq.flags if flag != "y < 0"))


def _nearest(state: State, value: float | None) -> State | None:
    """Return the state at the nearest value that exists, a little off the fold that bounds it."""
    if value is None:
        return None
    away = math.copysign(INSIDE * max(abs(value), INSIDE), value - state.value)
    try:
        return state.at(value + away)
    except PeelOptError:
        return None


def _question(state: State) -> Question:
    # None: law (8), or linear where the two agree.
    rod, law = state.rod, law_of(state) if state.law == "linear" else None
    label = None if state.label == "unfolded" else state.label
    if rod is None:
        return replace(Question.at_groups(law, state.beta0, state.lam), state=label, near=state.near)
    asks = ASKS[state.given]
    posed = Question.at(rod, law, state.given, asks.given.to_ratio(rod, state.value))
    near = None if state.near is None else asks.asked.to_ratio(rod, state.near)
    return replace(posed, state=label, near=near)


def _target(state: State, question: Question) -> Closure:
    """What is looked for along the walks.

    Beyond the turn the branch from T at a given beta0 does not hold all states: the rod's does.
    """
    return question.target if question.rod is None and state.beta0 >= TURN else question.given[1]


def _along(state: State, walks: tuple[QuickBranch, ...], deadline: float) -> Equilibrium:
    """Pick the state on the walks and solve for it."""
    law, question = law_of(state), _question(state)
    target = _target(state, question)
    if state.rod is None and target.kind == "length":
        walks = (walked(law, state.effective_ratio, deadline),)
        if state.label == "spurious" or (question.near is not None and question.near > 0.0):
            beyond, goal = quick_branch(law, "ratio", state.effective_ratio, -1), Goal(target)
            beyond.extend(lambda _: goal.passed(beyond) or time.perf_counter() > deadline)
            walks = (*walks, beyond)
    found = [candidate for walk in walks for candidate in walk.candidates(target)]
    chosen = _chosen(question, found)
    if chosen is None:
        raise _none(state, target, walks, found)
    return _solved(state, question, chosen.profile, chosen.state)


def _followed(state: State, before: Equilibrium) -> Equilibrium | None:
    """Solve from the picture before; None unless it is the same state, a little moved."""
    if not isinstance(before.source, Solution) or not fits(before.state, state.label):
        return None
    question, start = _question(state), before.source.problem.profile(before.source.x)
    moved = Family(question.effective_law, MOVING, question.given[0]).solve(start, question.given[1])
    if moved is None:
        return None
    profile = moved[0].profile(moved[1].x)
    if abs(profile.scalars.A - start.scalars.A) > NEIGHBOUR * (1.0 + abs(start.scalars.A)):
        return None
    try:
        return _solved(state, question, profile, before.state)
    except PeelOptError:
        return None


def _solved(state: State, question: Question, profile: Profile, label: str) -> Equilibrium:
    """Solve on one mesh from a solution, with the error from a second."""
    mesh, tol = MESHES.get(state.accuracy, MOVING), max(METHODS[state.accuracy][1], MOVING_TOL)
    method = Method(mesh, adaptive=False)
    solved = solve_to_tolerance(question, profile, method, tol)
    result = certify(question, label, solved, tol)
    if abs(result.answer - question.read(profile.scalars)) > 0.1 * (1.0 + abs(result.answer)):
        raise NotConverged("the quick solve left the branch.", remedy="Let the slider rest.")
    if not result.certified:
        raise NotCertified(
            f"a quick solve on one coarse mesh: error {result.error:.1e}, above {tol:.0e}.",
            remedy="Let the slider rest.",
            candidates=(result,),
        )
    return result


def _chosen(question: Question, found: list[Candidate]) -> Candidate | None:
    near, fitting = question.near, [c for c in found if question.fits(c.state)]
    if not fitting:
        return None
    if near is not None:
        return min(fitting, key=lambda c: abs(c.estimate(question.read) - near))
    # The lowest pressure, as everywhere in this package.
    return min(fitting, key=lambda c: c.estimate(lambda s: s.alpha1))


def _through(state: State, target: Closure, walk: QuickBranch) -> bool:
    """Whether all of a walk is known on which a state could be."""
    if walk.ended:
        return True
    if walk.family.closure.kind == "length":
        return gone(walk, window(state.beta0, state.lam))
    if Goal(target, anywhere=state.label == "folded").passed(walk):
        return True
    # Nobody asks a rod for p < 0; groups may have their state there.
    return walk.side > 0 and state.rod is not None and walk.points[-1].scalars.pressure_ratio <= 0.0


def _none(
    state: State, target: Closure, walks: tuple[QuickBranch, ...], found: list[Candidate]
) -> PeelOptError:
    """Say what exists instead, or that the walks have not come far enough to know."""
    rod = state.rod
    short = next((walk for walk in walks if not _through(state, target, walk)), None)
    if short is not None:
        last = short.points[-1].scalars
        on_rod = short.family.closure.kind == "ratio"
        where = f"p/T₀ = {last.pressure_ratio:.3g}" if on_rod else f"λ = {last.lam:.3g}"
        return NotConverged(
            f"the branch has been walked to {where} so far, and no such state met.",
            remedy="Let the slider rest.",
        )
    words = f"no {state.label} equilibrium at {state.words}."
    if found:
        words += f" There are: {', '.join(dict.fromkeys(c.state for c in found))}."
    if rod is None and target.kind != "lam":
        return NoEquilibrium(words)  # what exists at this beta0 the full answer tells
    numbers = {"lam": "lam", "length": "sigma", "pressure": "pressure_ratio"}
    values = [
        float(getattr(point.scalars, numbers[target.kind]))
        for walk in walks
        for point in walk.points
        if fits(walk.state_at(point.arclength), state.label)
    ]
    if not values:
        return NoEquilibrium(words)
    nearest = min(values, key=lambda v: abs(v - target.value))
    if rod is not None:
        nearest = rod.length(nearest) if state.given == "length" else rod.pressure(nearest)
    return NoEquilibrium(f"{words} The nearest that does exist: {state.at(nearest).words}.", nearest=nearest)
