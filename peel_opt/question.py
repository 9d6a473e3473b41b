"""A question in dimensionless form, and how its state is found along the primary branch."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from .answer import ANSWERS, Method, answer
from .certify import report
from .checks import positive
from .closures import Closure
from .cohesion import COHESIVE, LINEAR, CohesiveLaw
from .continuation import Point
from .elastica import PI4
from .errors import AmbiguousState, NoEquilibrium, NotCertified, OutOfRange
from .phases import layout
from .primary import UNFOLDED, Candidate, PrimaryBranch, primary_branch
from .result import Equilibrium
from .rod import Rod
from .transcription.base import Profile

#: eta/y0 between which the walk along the primary branch is tested.
RATIOS = (0.005, 3000.0)

#: Points of a branch without an end (the linear law's) to look at when all states are wanted.
FAR = 200


@dataclass(frozen=True)
class Question:
    """A question in dimensionless form.

    Parameters
    ----------
    asked : {"pressure_ratio", "length_ratio", "alpha1"}
    given : tuple of Closure
        What closes the final solve.
    target : Closure
        What the walk along the branch looks for.
    unit : callable
        From a value of the given number to what the caller gave.
    words : str
        The given number, for messages.
    state : str or None
    near : float or None
        Value of the answer, dimensionless, to which the state should be nearest.
    """

    asked: str
    given: tuple[Closure, Closure]
    target: Closure
    unit: Callable[[float], float]
    words: str
    state: str | None
    near: float | None

    @property
    def given_name(self) -> str:
        """What the caller calls the given number."""
        return {"pressure_ratio": "length", "length_ratio": "pressure", "alpha1": "lambda"}[self.asked]

    def read(self, profile: Profile) -> float:
        """Return the answered number of a solution."""
        return float(ANSWERS[self.asked](profile.scalars))

    def fits(self, label: str) -> bool:
        """Whether a state with this label is meant."""
        if self.state is None:
            return self.near is not None or label in UNFOLDED
        return label == self.state or (self.state == "unfolded" and label in UNFOLDED)


def solve(
    rod: Rod | None, law: CohesiveLaw | None, question: Question, method: Method, tol: float
) -> Equilibrium:
    """Find the state a question means, solve for it and certify the answer.

    Parameters
    ----------
    law : CohesiveLaw or None
        None for "auto".
    """
    tol = positive("tol", tol)
    began = time.perf_counter()
    effective = COHESIVE if law is None else law
    chosen, walked = _select(effective, question)
    plan = layout(effective, chosen.profile)
    start = chosen.profile.rephased(plan.breaks)
    solved = answer(start, plan.phases, question.given, question.asked, method, tol)
    result = report(rod, law, question.asked, chosen.state, solved, tol)
    stats = replace(result.stats, path_points=walked, seconds=time.perf_counter() - began)
    result = replace(result, stats=stats)
    if not result.certified:
        raise NotCertified(
            f"{question.words}: found {question.asked} = {result.answer:.8g}, but its error"
            f" {result.error:.1e} or its certificate {result.certificate:.1e} exceeds tol = {tol:.1e}"
            f" (condition of the question {stats.condition:.1e}).",
            remedy="Give a larger tol or a finer method; near a fold the question itself loses digits.",
            candidates=(result,),
        )
    return result


def _path_closure(question: Question) -> Closure:
    """Return what stays fixed along the branch to walk: a rod's ratio, or beta0 = 0."""
    first, second = question.given
    if first.kind == "ratio":
        low, high = RATIOS
        if not low <= first.value <= high:
            raise OutOfRange(
                f"eta/y0 = {first.value:.4g} is outside [{low:g}, {high:g}].",
                remedy="Check that no two material numbers are swapped or in the wrong unit.",
            )
        return first
    if first.value == 0.0:
        return first
    return Closure("ratio", (PI4 + second.value) / first.value**4)


def _select(law: CohesiveLaw, question: Question) -> tuple[Candidate, int]:
    """Walk as far as the question needs and pick the state it means."""
    closure = _path_closure(question)
    branch = primary_branch(law, closure, -1 if question.state == "spurious" else 1)
    branch.extend(partial(_far_enough, branch, question))
    found = branch.candidates(question.target)
    if question.near is not None and question.asked == "alpha1" and branch.side > 0:
        beyond = primary_branch(law, closure, -1)
        beyond.extend(partial(_far_enough, beyond, question))
        found = found + beyond.candidates(question.target)
    fitting = [c for c in found if question.fits(c.state)]
    if not fitting:
        raise _nothing_fits(branch, question, found)
    values = [question.read(c.profile) for c in fitting]
    if question.near is not None:
        near = question.near
        chosen = min(zip(values, fitting, strict=True), key=lambda pair: abs(pair[0] - near))[1]
    elif len(fitting) > 1 and not any(c.state in UNFOLDED for c in fitting):
        listed = ", ".join(f"{question.asked} = {v:.6g}" for v in values)
        raise AmbiguousState(
            f"{question.words}: {len(fitting)} {question.state} states fit: {listed}.",
            remedy="Pick one with near=.",
            candidates=tuple(values),
        )
    else:
        chosen = min(fitting, key=lambda c: c.profile.scalars.alpha1)  # the lowest pressure
    return chosen, len(branch.points)


def _far_enough(branch: PrimaryBranch, question: Question, last: Point) -> bool:
    """Whether the walk has passed every state the question may mean."""
    s, target = last.scalars, question.target
    endless = branch.family.law is LINEAR  # p may fall for ever while the length grows
    if branch.side < 0 or target.kind == "lam":
        return len(branch.points) > 1 and (s.lam if target.kind == "lam" else s.sigma) > target.value
    if question.state == "folded" or question.near is not None:
        return endless and len(branch.points) > FAR
    if branch.fold("LP-pressure") is not None:
        return True
    if target.kind == "pressure":
        return s.pressure_ratio < target.value
    return s.pressure_ratio < 0.0 and s.sigma > target.value


def _nothing_fits(branch: PrimaryBranch, question: Question, found: list[Candidate]) -> NoEquilibrium:
    """Say what exists instead."""
    if not found and branch.family.law is not LINEAR:
        branch.extend(lambda _: False)
        found = branch.candidates(question.target)
    nearest = _nearest(branch, question)
    message = f"no {question.state or 'unfolded'} equilibrium at {question.words}."
    if nearest is not None:
        message += f" The nearest that does exist: {question.given_name} = {nearest:.8g}."
    if found:
        listed = (f"{c.state} ({question.asked} = {question.read(c.profile):.6g})" for c in found)
        message += f" States that do exist there: {', '.join(listed)}."
    remedy = "Ask for one of them with state=." if found else ""
    return NoEquilibrium(message, remedy=remedy, nearest=nearest)


def _nearest(branch: PrimaryBranch, question: Question) -> float | None:
    """Value of the given number, nearest to the one asked, that the wanted states have."""
    if question.asked == "alpha1" and branch.side > 0:
        # The caller keeps beta0, so what exists is read off the branch at this beta0.
        branch = primary_branch(branch.family.law, question.given[0])
        branch.extend(lambda _: bool(branch.folds) or len(branch.points) > FAR)
        asked, values = question.given[1].value, [p.scalars.lam for p in branch.points]
    else:
        kind, asked = question.target.kind, question.target.value
        wanted = [p.scalars for p in branch.points if question.fits(branch.state_at(p.arclength))]
        values = [s.pressure_ratio if kind == "pressure" else s.sigma for s in wanted]
    if not values:
        return None
    return question.unit(round(float(min(values, key=lambda v: abs(v - asked))), 12))
