"""The choice between states: a question is looked for along the primary branch, and one state is meant."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..base.errors import AmbiguousState, NoEquilibrium, NotConverged, OutOfRange, PeelOptError
from ..continuation.ends import beside_folds, sharpened
from ..continuation.goal import ENDLESS, Goal
from ..continuation.isobar_walk import states_near
from ..continuation.landing import UNFINISHED
from ..continuation.points import Point
from ..continuation.primary import Candidate, PrimaryBranch, primary_branch
from ..model.bond import CohesiveLaw
from ..model.labels import UNFOLDED
from ..model.rod import RATIOS
from ..residual.closures import READINGS, Closure
from .question import PRESSURE, Question

#: How a message goes on that names the states that exist in the place of the one asked for.
OTHERS = " States that do exist there: "

#: Distance of two answers, as a share of ``near``, within which they are one.
SAME = 1e-7


#: Share of ``near`` within which an answer counts as near.
NEARBY = 0.1


@dataclass(frozen=True)
class SelectionWalk:
    """Along which branches the state that a question means is looked for, and how long.

    Parameters
    ----------
    branch : callable
        From a law, a closure and a side to the branch, walked as far as it may be.
    path : Closure, optional
        What stays fixed along it where that is not `Question.path`: of the paper's groups, their beta0.
    deadline : float
        Of ``time.perf_counter``, after which no branch is walked on, here or later by who asks again.
        What had not been come to is not said not to exist.  Off the branch nothing is looked for then.
    """

    branch: Callable[[CohesiveLaw, Closure, int], PrimaryBranch] = primary_branch
    path: Closure | None = None
    deadline: float = math.inf

    def goal(self, question: Question) -> Goal:
        """How far along the branch the states that are meant may lie."""
        target = question.target if self.path is None else question.given[1]
        return replace(question.goal, target=target, deadline=self.deadline)


#: As far as it takes.
THROUGH = SelectionWalk()


class Selected(NamedTuple):
    """The state that a question means.

    Parameters
    ----------
    candidate : Candidate
    spacing : float
        How far its answer is from that of the next state.
    walked : int
        Points of the branch that was followed.
    """

    candidate: Candidate
    spacing: float
    walked: int


def select(question: Question, search: SelectionWalk = THROUGH) -> Selected:
    """Follow the branch as far as the question needs and pick the state it means.

    Raises
    ------
    NoEquilibrium, AmbiguousState, OutOfRange, NotConverged
        If there is none, there are several, or what is left of the branch is not known.
    """
    closure, goal = search.path or question.path, search.goal(question)
    branch = search.branch(question.effective_law, closure, -1 if question.state == "spurious" else 1)
    goal.walk(branch)
    found = branch.candidates(goal.target)
    if question.near is not None:
        found = found + _off_the_branch(closure, question, search)
    fitting = [c for c in found if question.fits(c.state)]
    if not fitting and not branch.family.law.softens:
        goal.walk(branch, _never)  # its first fold in pressure need not be the minimum
        found = branch.candidates(goal.target)
        fitting = [c for c in found if question.fits(c.state)]
    if not fitting:
        fitting = [c for c in beside_folds(branch, goal.target) if question.fits(c.state)]
        found = found + fitting
    if not fitting:
        raise _nothing_fits(branch, question, search, found)
    if question.near is not None:
        chosen = _nearest_candidate(fitting, question)
        if _unseen(branch, question, search) and far_from(
            question.near, question.read(chosen.profile.scalars)
        ):
            raise _cut_short(branch, question)
    elif goal.cut_short(branch):
        raise _cut_short(branch, question)
    elif branch.ended in UNFINISHED and not goal.passed(branch):
        raise _not_followed(branch, question, True)  # the state meant may lie beyond
    elif len(fitting) > 1 and not any(c.state in UNFOLDED for c in fitting):
        values = [question.read(c.profile.scalars) for c in fitting]
        listed = ", ".join(f"{question.asked} = {v:.6g}" for v in values)
        raise AmbiguousState(
            f"{question.words}: {len(fitting)} {question.state} states fit: {listed}.",
            remedy="Pick one with near=.",
            candidates=tuple(values),
        )
    else:
        chosen = min(fitting, key=lambda c: c.estimate(lambda s: s.alpha1))  # the lowest pressure
    own = question.read(chosen.profile.scalars)
    others = np.array([c.estimate(question.read) for c in found if c is not chosen])
    apart = np.abs(others - own)
    # What coincides with the chosen state is the same state, met on another walk.
    spacing = float(np.min(apart[apart > 1e-4 * (1.0 + abs(own))], initial=np.inf))
    return Selected(chosen, spacing, len(branch.points))


def far_from(near: float | None, answer: float) -> tuple[str, ...]:
    """Flag an answer that is not near the one sought, if one is."""
    if near is None or abs(answer - near) <= NEARBY * (abs(near) + NEARBY):
        return ()
    return (f"far from near={near:.4g}",)


def _never() -> bool:
    return False


def _unseen(branch: PrimaryBranch, question: Question, search: SelectionWalk) -> bool:
    """Whether the state that is meant may lie where there was no time to look."""
    anywhere = question.near is not None and question.state is None
    return (anywhere and math.isfinite(search.deadline)) or search.goal(question).cut_short(branch)


def _off_the_branch(closure: Closure, question: Question, search: SelectionWalk) -> list[Candidate]:
    """States that are not on the detached primary branch, near the answer sought."""
    goal = search.goal(question)
    if question.near is None or goal.target.kind != "length":
        return []
    law, beta0 = question.effective_law, goal.target.value**3
    P = question.near if question.asks.asked is PRESSURE else 1.0 + question.near / beta0
    if P < 1.0:
        in_time = math.isinf(search.deadline)
        return states_near(law, closure.value, goal.target.value, P) if in_time else []
    beyond = search.branch(law, closure, -1)
    goal.walk(beyond)
    return beyond.candidates(goal.target)


def _nearest_candidate(candidates: list[Candidate], question: Question) -> Candidate:
    """Pick the state whose answer is nearest to the one sought, solving only where it is close."""
    assert question.near is not None
    near, read = question.near, question.read
    guessed = [abs(c.estimate(read) - near) for c in candidates]
    margin = 2.0 * min(guessed) + 0.02 * (1.0 + abs(near))
    reached: list[tuple[float, Candidate]] = []
    lost: list[tuple[Candidate, NotConverged]] = []
    for candidate, distance in zip(candidates, guessed, strict=True):
        if distance > margin:
            continue
        try:
            reached.append((abs(read(candidate.profile.scalars) - near), candidate))
        except NotConverged as error:
            lost.append((candidate, error))
    nearest = min((distance for distance, _ in reached), default=math.inf)
    for candidate, reason in lost:
        met = any(candidate.holds(other) for _, other in reached)
        if not met and candidate.least_distance(read, near) < nearest:
            raise reason  # it might be the one that is meant
    # A state of the primary branch may be met on another walk too: its own label comes first.
    same = nearest + SAME * (1.0 + abs(near))
    return next(candidate for distance, candidate in reached if distance <= same)


def _nothing_fits(
    branch: PrimaryBranch, question: Question, search: SelectionWalk, found: list[Candidate]
) -> PeelOptError:
    """Say what exists instead, or that the branch could not be followed far enough to know."""
    goal = search.goal(question)
    known = branch.family.law.softens and goal.passed(branch)
    if not found and branch.family.law.branch_ends:
        goal.walk(branch, _never)
        found = branch.candidates(goal.target)
    if _unseen(branch, question, search):
        return _cut_short(branch, question)
    if branch.ended in UNFINISHED:
        in_range = RATIOS[0] <= _ratio(branch) <= RATIOS[1]
        # What is left of a branch of these laws is known to go on the way it went.
        known = known or branch.family.law.falls_straight
        if not known or _heads_for(branch, goal.target) or not in_range:
            return _not_followed(branch, question, in_range)
    nearest = _nearest(branch, question, search)
    message = f"no {question.state or 'unfolded'} equilibrium at {question.words}."
    if nearest is not None:
        other, given = question.beside_what_is_asked(nearest), question.asks.given.name
        message += (
            f" The nearest that does exist: {given} = {other}."
            if other
            else f" It is an end of theirs: they come as near to this {given} as one likes."
        )
    if found:
        listed = (f"{c.state} ({question.asked} about {c.estimate(question.read):.4g})" for c in found)
        message += f"{OTHERS}{', '.join(listed)}."
    remedy = "Ask for one of them with state=." if found else ""
    return NoEquilibrium(message, remedy=remedy, nearest=nearest)


def _heads_for(branch: PrimaryBranch, target: Closure) -> bool:
    """Whether the last points of a walk come nearer to what is looked for."""
    read = READINGS[target.kind]
    before, last = (read(p.scalars) - target.value for p in branch.points[-2:])
    return before * last > 0.0 and abs(last) < abs(before)


def _ratio(branch: PrimaryBranch) -> float:
    """eta/y0 where a walk ended; infinite at beta0 = 0."""
    last = branch.points[-1].scalars
    return float(last.ratio) if last.sigma > 0.0 else math.inf


def _reached(branch: PrimaryBranch) -> str:
    """Where a walk is, in words."""
    last = branch.points[-1].scalars
    reached = f"lambda = {last.lam:.4g}"
    return f"{reached}, p/T0 = {last.pressure_ratio:.4g}" if last.sigma > 0.0 else reached


def _cut_short(branch: PrimaryBranch, question: Question) -> NotConverged:
    """Say how far a walk came in its time."""
    return NotConverged(
        f"{question.words}: the branch has been walked to {_reached(branch)} so far, and no such state met.",
        remedy="Give it more time.",
    )


def _not_followed(branch: PrimaryBranch, question: Question, in_range: bool) -> PeelOptError:
    """Say where a walk ended that did not come to the end of its branch."""
    message = f"{question.words}: not met on the branch as far as it could be followed ({_reached(branch)})."
    if in_range or not branch.family.law.branch_ends:
        return NotConverged(message, remedy="Give a number nearer to the transition.")
    return OutOfRange(
        f"{message} Its eta/y0 = {_ratio(branch):.4g} is outside [{RATIOS[0]:g}, {RATIOS[1]:g}].",
        remedy="Give groups of a rod within that range.",
    )


def _nearest(branch: PrimaryBranch, question: Question, search: SelectionWalk) -> float | None:
    """Value of the given number, nearest to the one asked, that the wanted states have."""
    if question.rod is None:
        # The caller keeps beta0, so what exists is read off the branch at this beta0.
        branch = search.branch(branch.family.law, question.given[0], branch.side)
        search.goal(question).walk(branch, lambda: _turned(branch))
        if not (branch.ended or _turned(branch)):
            return None
    asked, read = question.given[1].value, question.asks.given.read
    values = [read(p.scalars) for p in _of_the_state(branch, question)]
    if not values:
        return None
    # Of what lies far beyond them, all are as far to the last digit.
    within = min(max(asked, min(values)), max(values))
    return question.in_units(round(float(min(values, key=lambda v: abs(v - within))), 12))


def _turned(branch: PrimaryBranch) -> bool:
    """Whether a branch has come to its fold, or never will."""
    return bool(branch.folds) or len(branch.points) > ENDLESS


def _of_the_state(branch: PrimaryBranch, question: Question) -> list[Point]:
    """Points of the states that are meant; folds and the contact, their ends, as a finer mesh has them."""
    wanted: dict[int, Point] = {}
    for here, there in pairwise(branch.points):
        if question.fits(branch.state_at(0.5 * (here.arclength + there.arclength))):
            wanted |= {id(here): here, id(there): there}
    for located in [*branch.folds, *([branch.contact] if branch.contact else [])]:
        finer = sharpened(branch, located) if id(located.point) in wanted else None
        if finer is not None:
            wanted[id(located.point)] = finer.end
    return list(wanted.values())
