"""The choice between states: a question is looked for along the primary branch, and one state is meant."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..base.errors import AmbiguousState, NoEquilibrium, NotConverged, OutOfRange, PeelOptError
from ..continuation.ends import beside_folds, sharpened
from ..continuation.goal import ENDLESS
from ..continuation.isobars import states_near
from ..continuation.landing import UNFINISHED
from ..continuation.points import Point
from ..continuation.primary import Candidate, PrimaryBranch, primary_branch
from ..model.labels import UNFOLDED
from ..model.rod import RATIOS
from ..residual.closures import READINGS, Closure
from .question import PRESSURE, Question

#: Distance of two answers, as a share of ``near``, within which they are one.
SAME = 1e-7


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


def select(question: Question) -> Selected:
    """Follow the branch as far as the question needs and pick the state it means.

    Raises
    ------
    NoEquilibrium, AmbiguousState, OutOfRange, NotConverged
        If there is none, there are several, or what is left of the branch is not known.
    """
    closure = question.path
    branch = primary_branch(question.effective_law, closure, -1 if question.state == "spurious" else 1)
    question.goal.walk(branch)
    found = branch.candidates(question.target)
    if question.near is not None:
        found = found + _off_the_branch(closure, question)
    fitting = [c for c in found if question.fits(c.state)]
    if not fitting and not branch.family.law.softens:
        branch.extend(lambda _: False)  # its first fold in pressure need not be the minimum
        found = branch.candidates(question.target)
        fitting = [c for c in found if question.fits(c.state)]
    if not fitting:
        fitting = [c for c in beside_folds(branch, question.target) if question.fits(c.state)]
        found = found + fitting
    if not fitting:
        raise _nothing_fits(branch, question, found)
    if question.near is not None:
        chosen = _nearest_candidate(fitting, question)
    elif branch.ended in UNFINISHED and not question.goal.passed(branch):
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


def _off_the_branch(closure: Closure, question: Question) -> list[Candidate]:
    """States that are not on the detached primary branch, near the answer sought."""
    if question.near is None or question.target.kind != "length":
        return []
    law, beta0 = question.effective_law, question.target.value**3
    P = question.near if question.asks.asked is PRESSURE else 1.0 + question.near / beta0
    if P < 1.0:
        return states_near(law, closure.value, question.target.value, P)
    beyond = primary_branch(law, closure, -1)
    question.goal.walk(beyond)
    return beyond.candidates(question.target)


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


def _nothing_fits(branch: PrimaryBranch, question: Question, found: list[Candidate]) -> PeelOptError:
    """Say what exists instead, or that the branch could not be followed far enough to know."""
    known = branch.family.law.softens and question.goal.passed(branch)
    if not found and branch.family.law.branch_ends:
        branch.extend(lambda _: False)
        found = branch.candidates(question.target)
    if branch.ended in UNFINISHED:
        in_range = RATIOS[0] <= _ratio(branch) <= RATIOS[1]
        # What is left of a branch of these laws is known to go on the way it went.
        known = known or branch.family.law.falls_straight
        if not known or _heads_for(branch, question.target) or not in_range:
            return _not_followed(branch, question, in_range)
    nearest = _nearest(branch, question)
    message = f"no {question.state or 'unfolded'} equilibrium at {question.words}."
    if nearest is not None:
        message += f" The nearest that does exist: {question.asks.given.name} = {question.named(nearest)}."
    if found:
        listed = (f"{c.state} ({question.asked} about {c.estimate(question.read):.4g})" for c in found)
        message += f" States that do exist there: {', '.join(listed)}."
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


def _not_followed(branch: PrimaryBranch, question: Question, in_range: bool) -> PeelOptError:
    """Say where a walk ended that did not come to the end of its branch."""
    last = branch.points[-1].scalars
    reached = f"lambda = {last.lam:.4g}"
    if last.sigma > 0.0:
        reached += f", p/T0 = {last.pressure_ratio:.4g}"
    message = f"{question.words}: not met on the branch as far as it could be followed ({reached})."
    if in_range or not branch.family.law.branch_ends:
        return NotConverged(message, remedy="Give a number nearer to the transition.")
    return OutOfRange(
        f"{message} Its eta/y0 = {_ratio(branch):.4g} is outside [{RATIOS[0]:g}, {RATIOS[1]:g}].",
        remedy="Give groups of a rod within that range.",
    )


def _nearest(branch: PrimaryBranch, question: Question) -> float | None:
    """Value of the given number, nearest to the one asked, that the wanted states have."""
    asked, read = question.given[1].value, question.asks.given.read
    if question.rod is None:
        # The caller keeps beta0, so what exists is read off the branch at this beta0.
        branch = primary_branch(branch.family.law, question.given[0], branch.side)
        branch.extend(lambda _: bool(branch.folds) or len(branch.points) > ENDLESS)
        values = [read(p.scalars) for p in branch.points]
    else:
        values = [read(p.scalars) for p in _of_the_state(branch, question)]
    if not values:
        return None
    return question.in_units(round(float(min(values, key=lambda v: abs(v - asked))), 12))


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
