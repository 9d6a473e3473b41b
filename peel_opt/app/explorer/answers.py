"""Answers for the explorer: quick ones along the quick walk, full ones by the public questions."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ...analysis.maxwell import TURN
from ...base.errors import NotCertified, NotConverged, PeelOptError
from ...continuation.family import Family
from ...equilibria.ask import require_certified, solve_from, solve_question
from ...equilibria.methods import Method
from ...equilibria.question import Question
from ...equilibria.result import Equilibrium
from ...equilibria.select import SelectionWalk
from ...model.labels import fits
from ...residual.meshes import DRAFT, MOVING, SKETCH
from ...residual.newton import SolvedState
from ...residual.shape import Solution
from .quick_walks import quick_branch
from .state import METHODS, State

#: One mesh, its error from a second: what the lower accuracies solve with.
MESHES = {"sketch": SKETCH, "draft": DRAFT}

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
ONE = threading.Lock()


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
    with ONE:
        return _full_answer(state)


def _full_answer(state: State) -> Found:
    named, tol = METHODS[state.accuracy]
    mesh = MESHES.get(state.accuracy)

    def ask(method: str | Method) -> Equilibrium:
        return solve_question(state.question, method, tol)

    if mesh is not None:
        rough = found_by(state, lambda: ask(Method(mesh, adaptive=False)))
        if rough.equilibrium is not None or rough.nearest is not None:
            return rough
        # Near a fold a coarse mesh leaves the branch: the card's own method has the last word.
    return found_by(state, lambda: ask(named))


def quick_answer(state: State, deadline: float, before: Equilibrium | None = None) -> Found:
    """Answer on one mesh, along quick walks and with what they have been walked so far.

    Parameters
    ----------
    state : State
    deadline : float
        Of ``time.perf_counter``, after which nothing is walked on.
    before : Equilibrium, optional
        The answer of the picture before, from which Newton starts where the walks end too early.
    """
    method = Method(MESHES.get(state.accuracy, MOVING), adaptive=False)
    tol = max(METHODS[state.accuracy][1], MOVING_TOL)

    def ask() -> Equilibrium:
        question = state.question
        # Below the turn the branch at the state's own beta0, which is drawn, holds the states that are
        # not folded; a click may mean one of these.
        beside = state.rod is None and state.beta0 < TURN and state.label != "folded" and state.near is None
        search = SelectionWalk(quick_branch, question.given[0] if beside else None, deadline)
        try:
            return solve_question(question, method, tol, search)
        except NotConverged:
            start = None if before is None else _followed(state, question, before)
            if before is None or start is None:
                raise
            return require_certified(question, solve_from(start, question, before.state, method, tol))

    return found_by(state, ask)


def found_by(state: State, ask: Callable[[], Equilibrium]) -> Found:
    """Ask, and say what the question came to; numerical trouble is a message."""
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


def _followed(state: State, question: Question, before: Equilibrium) -> SolvedState | None:
    """Solve from the picture before; None unless it is the same state, a little moved."""
    if before.scene is not None or not isinstance(before.source, Solution):
        return None
    if not fits(before.state, state.label):
        return None
    start = before.source.problem.profile(before.source.x)
    moved = Family(question.effective_law, MOVING, question.given[0]).solve(start, question.given[1])
    if moved is None:
        return None
    reached = SolvedState(*moved, question.given)
    return reached if is_beside(start.scalars.A, reached.profile.scalars.A) else None


def is_beside(before: float, A: float) -> bool:
    """Whether a state of a tip angle may be the one of the picture before, a little moved."""
    return abs(A - before) <= NEIGHBOUR * (1.0 + abs(before))
