"""A question in dimensionless form, and how its state is found along the primary branch."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..base.checks import positive
from ..base.errors import AmbiguousState, NoEquilibrium, NotCertified, NotConverged, OutOfRange, PeelOptError
from ..base.threads import one_thread
from ..continuation.ends import beside_folds, sharpened
from ..continuation.goal import ENDLESS, Goal
from ..continuation.isobars import states_near
from ..continuation.landing import UNFINISHED
from ..continuation.points import Point
from ..continuation.primary import Candidate, PrimaryBranch, primary_branch, softens
from ..model.bond import COHESIVE, LINEAR
from ..model.labels import UNFOLDED, fits
from ..model.rod import RATIOS, require_ratio
from ..residual.closures import READINGS, Closure
from .certify import report
from .closed_form import closed_form
from .methods import Answer, Method, answer
from .posed import Posed
from .result import Equilibrium

#: Share of its size by which an answer may differ, beyond its error, from that of the walk.
FAITHFUL = 0.05

#: Share of ``near`` within which an answer counts as near.
NEARBY = 0.1

#: Distance of two answers, as a share of ``near``, within which they are one.
SAME = 1e-7


@dataclass(frozen=True)
class Question:
    """A question in dimensionless form.

    Parameters
    ----------
    posed : Posed
    target : Closure
        What the walk along the branch looks for.
    unit : callable
        From a value of the given number to what the caller gave.
    words : str
        The given number, for messages.
    state : str or None
    near : float or None
        Value of the answer, dimensionless, to which the state should be nearest.
    symbol : str
        The unit of what the caller gave; empty where it has none.
    """

    posed: Posed
    target: Closure
    unit: Callable[[float], float]
    words: str
    state: str | None
    near: float | None
    symbol: str = ""

    @property
    def goal(self) -> Goal:
        """How far along the branch the states that are meant may lie."""
        return Goal(self.target, anywhere=self.state == "folded" or self.near is not None)

    def named(self, value: float) -> str:
        """Return a value of the given number with its unit."""
        return f"{value:.8g} {self.symbol}".rstrip()

    def fits(self, label: str) -> bool:
        """Whether a state with this label is meant."""
        if self.state is None:
            return self.near is not None or label in UNFOLDED
        return fits(label, self.state)


@one_thread
def solve(question: Question, method: Method, tol: float) -> Equilibrium:
    """Find the state a question means, solve for it and certify the answer."""
    tol = positive("tol", tol)
    began, posed = time.perf_counter(), question.posed
    if method.series and question.near is None and question.state != "folded":
        _path_closure(question)
        summed = _summed(question, method, tol)
        if summed is not None:
            return replace(summed, stats=replace(summed.stats, seconds=time.perf_counter() - began))
        if method.transcription is not None:
            method = replace(method, series=())
    chosen, spacing, walked = _select(question)
    solved = answer(posed, chosen.landed, method, tol)
    result = report(posed, chosen.state, solved, tol)
    own = posed.read(chosen.profile.scalars)
    jumped = abs(result.answer - own) > min(0.25 * spacing, FAITHFUL * (1.0 + abs(own)) + result.error)
    if jumped:
        raise NotConverged(
            f"{question.words}: {result.stats.method} left the {chosen.state} state it was started at.",
            remedy="Try method='spectral' or a finer mesh; near a fold, a given number further from it.",
        )
    stats = replace(result.stats, path_points=walked, seconds=time.perf_counter() - began)
    result = replace(result, stats=stats, flags=result.flags + _distance(question, result.answer))
    if not result.certified:
        raise NotCertified(
            f"{question.words}: found {posed.asked} = {result.answer:.8g}, but its error"
            f" {result.error:.1e} or its certificate {result.certificate:.1e} exceeds tol = {tol:.1e}"
            f" (condition of the question {stats.condition:.1e}).",
            remedy="Give a larger tol or a finer method; near a fold the question itself loses digits.",
            candidates=(result,),
        )
    return result


def _distance(question: Question, answer: float) -> tuple[str, ...]:
    """Flag an answer that was asked for by value and is not near it."""
    if question.near is None or abs(answer - question.near) <= NEARBY * (abs(question.near) + NEARBY):
        return ()
    return (f"far from near={question.near:.4g}",)


def _summed(question: Question, method: Method, tol: float) -> Equilibrium | None:
    """Answer in closed form, without a walk; None where that is out of reach."""
    posed = question.posed
    for order in method.series:
        state = question.state or "unfolded"
        try:
            found = closed_form(posed, state, (order,), tol)
        except NotConverged:
            continue
        solved = Answer(found.problem, found.x, found.error, found.stats)
        result = report(posed, found.state, solved, tol)
        if result.certified and question.fits(found.state):
            return result
    return None


def _path_closure(question: Question) -> Closure:
    """Return what stays fixed along the branch to walk: a rod's ratio, or beta0 = 0."""
    first = question.posed.given[0]
    if first.kind == "ratio":
        require_ratio(first.value)
        return first
    if first.value == 0.0:
        return first
    return Closure("ratio", question.posed.ratio)


def _select(question: Question) -> tuple[Candidate, float, int]:
    """Walk as far as the question needs and pick the state it means.

    Returns the state, how far its answer is from that of the next one, and the length of
    the walk in points.
    """
    closure, posed = _path_closure(question), question.posed
    branch = primary_branch(posed.effective_law, closure, -1 if question.state == "spurious" else 1)
    question.goal.walk(branch)
    found = branch.candidates(question.target)
    if question.near is not None:
        found = found + _off_the_branch(closure, question)
    fitting = [c for c in found if question.fits(c.state)]
    if not fitting and not softens(branch.family.law):
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
        values = [posed.read(c.profile.scalars) for c in fitting]
        listed = ", ".join(f"{posed.asked} = {v:.6g}" for v in values)
        raise AmbiguousState(
            f"{question.words}: {len(fitting)} {question.state} states fit: {listed}.",
            remedy="Pick one with near=.",
            candidates=tuple(values),
        )
    else:
        chosen = min(fitting, key=lambda c: c.estimate(lambda s: s.alpha1))  # the lowest pressure
    own = posed.read(chosen.profile.scalars)
    others = np.array([c.estimate(posed.read) for c in found if c is not chosen])
    apart = np.abs(others - own)
    # What coincides with the chosen state is the same state, met on another walk.
    spacing = float(np.min(apart[apart > 1e-4 * (1.0 + abs(own))], initial=np.inf))
    return chosen, spacing, len(branch.points)


def _off_the_branch(closure: Closure, question: Question) -> list[Candidate]:
    """States that are not on the detached primary branch, near the answer sought."""
    if question.near is None or question.target.kind != "length":
        return []
    law, beta0 = question.posed.effective_law, question.target.value**3
    P = question.near if question.posed.asked == "pressure_ratio" else 1.0 + question.near / beta0
    if P < 1.0:
        return states_near(law, closure.value, question.target.value, P)
    beyond = primary_branch(law, closure, -1)
    question.goal.walk(beyond)
    return beyond.candidates(question.target)


def _nearest_candidate(candidates: list[Candidate], question: Question) -> Candidate:
    """Pick the state whose answer is nearest to the one sought, solving only where it is close."""
    assert question.near is not None
    near, read = question.near, question.posed.read
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
    known = softens(branch.family.law) and question.goal.passed(branch)
    if not found and branch.family.law.branch_ends:
        branch.extend(lambda _: False)
        found = branch.candidates(question.target)
    if branch.ended in UNFINISHED:
        in_range = RATIOS[0] <= _ratio(branch) <= RATIOS[1]
        # What is left of a branch of these laws is known to go on the way it went.
        simple = branch.family.law in (LINEAR, COHESIVE)
        if not (simple or known) or _heads_for(branch, question.target) or not in_range:
            return _not_followed(branch, question, in_range)
    nearest, posed = _nearest(branch, question), question.posed
    message = f"no {question.state or 'unfolded'} equilibrium at {question.words}."
    if nearest is not None:
        message += f" The nearest that does exist: {question.posed.given_name} = {question.named(nearest)}."
    if found:
        listed = (f"{c.state} ({posed.asked} about {c.estimate(posed.read):.4g})" for c in found)
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
    if question.posed.asked == "alpha1" and branch.side > 0:
        # The caller keeps beta0, so what exists is read off the branch at this beta0.
        branch = primary_branch(branch.family.law, question.posed.given[0])
        branch.extend(lambda _: bool(branch.folds) or len(branch.points) > ENDLESS)
        asked, values = question.posed.given[1].value, [p.scalars.lam for p in branch.points]
    else:
        asked, read = question.target.value, READINGS[question.target.kind]
        values = [read(p.scalars) for p in _of_the_state(branch, question)]
    if not values:
        return None
    return question.unit(round(float(min(values, key=lambda v: abs(v - asked))), 12))


def _of_the_state(branch: PrimaryBranch, question: Question) -> list[Point]:
    """Points of the states that are meant, ends included; folds as a finer mesh has them."""
    wanted: dict[int, Point] = {}
    for here, there in pairwise(branch.points):
        if question.fits(branch.state_at(0.5 * (here.arclength + there.arclength))):
            wanted |= {id(here): here, id(there): there}
    for located in branch.folds:
        fold = sharpened(branch, located) if id(located.point) in wanted else None
        if fold is not None:
            wanted[id(located.point)] = fold.fold
    return list(wanted.values())
