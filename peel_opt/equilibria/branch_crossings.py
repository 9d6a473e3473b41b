"""Where a branch has a given value: its crossings, each landed on and certified as any other answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..base.arrays import EPS
from ..base.checks import finite
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged
from ..continuation.family import Family
from ..continuation.points import Point
from ..model.bond import CohesiveLaw
from ..model.labels import STATES, fits, known_state
from ..model.scene import Scene
from ..residual.closures import READINGS, Closure, closure_for
from ..residual.newton import SolvedState, correct
from .ask import length_given_pressure, pressure_given_length, require_certified, solve_from
from .branch_points import NO_SCENE, discretised, equilibrium_at, law_of, tip_is_free, transcription_of
from .methods import METHODS
from .question import LENGTH, PRESSURE, Measure, Question, answering
from .result import Equilibrium
from .scenes import SCENE_STATES

if TYPE_CHECKING:
    from .branch import Branch

#: What may be given, by name: a measure with its unit, or a column of the branch.
WITH_UNIT = {"pressure": PRESSURE, "length": LENGTH}
PLAIN = ("pressure_ratio", "length_ratio", "lam", "alpha1", "tip_angle")

#: Units in the last place within which a point has a value that was read off it and comes back.
SAME = 16.0

#: Relative distance beyond two neighbouring points by which a state between them may lie: their own errors.
SLACK = 1e-6


class AtValue(NamedTuple):
    """A number that is given of a branch.

    Parameters
    ----------
    name : str
        As it was given.
    value : float
        In the unit of that.
    column : str
        The column of the branch that has it without a unit.
    plain : float
        Its value there.
    """

    name: str
    value: float
    column: str
    plain: float

    @classmethod
    def of(cls, branch: Branch, numbers: Mapping[str, Any]) -> AtValue:
        """Return the only one of the numbers that is not None, which may be a text with a unit.

        Raises
        ------
        InvalidInput
            If there is none or several, or it has a unit and the branch none.
        """
        named = {name: value for name, value in numbers.items() if value is not None}
        if len(named) != 1:
            raise InvalidInput(
                f"give one number, got {', '.join(named) or 'none'}.",
                remedy=f"One of {', '.join((*WITH_UNIT, *PLAIN))}.",
            )
        ((name, raw),) = named.items()
        if name not in WITH_UNIT:
            value = finite(name, raw, "rad" if name == "tip_angle" else "")
            return cls(name, value, name, value)
        rod, measure = branch.rod, WITH_UNIT[name]
        if rod is None:
            raise InvalidInput(
                f"the branch has no rod, hence no {name} with a unit.", remedy=f"Give {measure.attribute}."
            )
        value = finite(name, raw, measure.unit_of(rod))
        return cls(name, value, measure.attribute, measure.to_ratio(rod, value))

    @property
    def closure(self) -> Closure:
        """The equation that it adds to those of the branch."""
        if self.column == "length_ratio":
            return Closure("length", self.plain)
        return closure_for(self.column, self.plain)

    def rate(self, point: Point) -> float:
        """Return its derivative along the branch, of either sign."""
        return point.rate(READINGS.get(self.closure.kind, lambda s: s.A))

    def misses(self, branch: Branch) -> np.ndarray:
        """By how much each point misses it; zero where that is rounding."""
        values = np.asarray(getattr(branch, self.column), dtype=float)
        misses = values - self.plain
        misses[np.abs(misses) <= SAME * EPS * max(abs(self.plain), 1e-300)] = 0.0
        return misses

    def nearest(self, branch: Branch) -> float:
        """Return the value nearest to it that a point has, without a unit."""
        values = np.asarray(getattr(branch, self.column), dtype=float)
        return float(values[np.nanargmin(np.abs(values - self.plain))])

    def in_its_unit(self, branch: Branch, plain: float, measure: Measure | None = None) -> float:
        """Return a value without a unit as this number is given, or as a measure is."""
        measure = WITH_UNIT.get(self.name) if measure is None else measure
        return plain if measure is None or branch.rod is None else measure.from_ratio(branch.rod, plain)


def states_at(
    branch: Branch,
    numbers: Mapping[str, Any],
    state: str | None,
    near: Any,
    tol: float,
) -> list[Equilibrium]:
    """Return the states of a branch at a given number; see `Branch.at`.

    Parameters
    ----------
    branch : Branch
    numbers : mapping
        Of what may be given, by name; None where it is not.
    state, near, tol
        As in `Branch.at`.
    """
    given = AtValue.of(branch, numbers)
    if state is not None and state not in branch.state:
        known_state(state, among=tuple(dict.fromkeys((*STATES, *branch.state.tolist()))))
    found = list(_at_crossings(branch, given, tol))
    fitting = [eq for eq in found if state is None or fits(eq.state, state)]
    if not fitting:
        raise _nothing(branch, given, state, found)
    return fitting if near is None else [_nearest(fitting, near)]


def rows_across(branch: Branch, given: AtValue) -> Iterator[tuple[int, int]]:
    """Yield rows between which a branch crosses a value, and twice the same row where it has it."""
    misses = given.misses(branch)
    for piece in branch.pieces:
        rows = np.arange(len(branch))[piece].tolist()
        for i, j in zip(rows, [*rows[1:], None], strict=True):
            if misses[i] == 0.0:
                yield i, i
            elif j is not None and misses[i] * misses[j] < 0.0:
                yield i, j


def label_between(branch: Branch, i: int, j: int) -> str:
    """Return the label of the states between two neighbouring rows; it changes at special points."""
    special = {p.index for p in branch.special_points}
    return str(branch.state[j if i in special else i])


def _nothing(
    branch: Branch, given: AtValue, state: str | None, found: Sequence[Equilibrium]
) -> NoEquilibrium:
    """Say what exists instead."""
    unit = ""
    if branch.rod is not None and given.name in WITH_UNIT:
        unit = f" {WITH_UNIT[given.name].unit_of(branch.rod)}".rstrip()
    wanted = f"{state} " if state else ""
    message = f"the branch has no {wanted}point at {given.name} = {given.value:.8g}{unit}."
    if found:
        others = ", ".join(dict.fromkeys(eq.state for eq in found))
        return NoEquilibrium(message, remedy=f"There it is {others}.")
    nearest = given.in_its_unit(branch, given.nearest(branch))
    return NoEquilibrium(message, remedy=f"The nearest it has is {nearest:.8g}{unit}.", nearest=nearest)


def _nearest(states: Sequence[Equilibrium], near: Any) -> Equilibrium:
    """Return the state whose answer is nearest to a value in its unit, or to that of another state."""
    asks = answering(states[0].answered, states[0].given)
    rod, measure = states[0].rod, asks.asked
    if isinstance(near, Equilibrium):
        wanted = float(getattr(near, measure.attribute))
    elif rod is None:
        wanted = finite("near", near)
    else:
        wanted = measure.to_ratio(rod, finite("near", near, measure.unit_of(rod)))
    return min(states, key=lambda eq: abs(eq.answer - wanted))


def _at_crossings(branch: Branch, given: AtValue, tol: float) -> Iterator[Equilibrium]:
    """Solve for each state at which a branch has a value.

    Raises
    ------
    NotConverged, NotCertified
        If a crossing cannot be landed on, or solved for to ``tol``.
    """
    if branch.scene is not None:
        yield from _of_scene(branch, given, tol)
        return
    law, mesh = law_of(branch), transcription_of(branch)
    family = Family(law, mesh, closure_for(branch.hold, branch.held), tip_free=tip_is_free(branch))
    for i, j, here, there in _brackets(branch, family, given):
        if there is None:
            solved = correct(here.problem, here.x, (*family.closures, given.closure))
            if not solved.converged:  # at a fold of what is given, two states are one
                yield equilibrium_at(branch, i)
                continue
            start, state = (here.problem, solved), str(branch.state[i])
        else:
            landed = family.solve_between(here, there, given.closure)
            if landed is None:
                raise NotConverged(
                    f"could not land on {given.name} = {given.value:.8g}.",
                    remedy="Ask for a value off a fold, or for one of the points of the branch.",
                )
            start, state = landed, label_between(branch, i, j)
        state_there = SolvedState(*start, (*family.closures, given.closure))
        question = _posed(branch, given, law, state_there)
        yield require_certified(question, solve_from(state_there, question, state, METHODS["auto"], tol))


def _of_scene(branch: Branch, given: AtValue, tol: float) -> Iterator[Equilibrium]:
    """Solve for the length at a pressure or the pressure at a length, where the branch of a scene has it."""
    if given.column not in ("pressure_ratio", "length_ratio"):
        raise InvalidInput(
            f"the branch of a scene is not solved at {given.name}.", remedy="Give pressure or length."
        )
    if not isinstance(branch.scene, Scene):
        raise InvalidInput(NO_SCENE, remedy="Trace the scene again.")
    assert branch.rod is not None
    known, free = ("pressure", "length")[:: 1 if given.column == "pressure_ratio" else -1]
    solved = {"pressure": length_given_pressure, "length": pressure_given_length}[known]
    value = WITH_UNIT[known].from_ratio(branch.rod, given.plain)
    misses, along = given.misses(branch), getattr(branch, free)
    for i, j in rows_across(branch, given):
        low, high = sorted((float(along[i]), float(along[j])))
        share = misses[i] / (misses[i] - misses[j]) if i != j else 0.0
        near, label = float(along[i] + share * (along[j] - along[i])), label_between(branch, i, j)
        state = label if label in SCENE_STATES else None
        found = solved(branch.scene, value, state=state, near=near, tol=tol)
        # Folds are points of the branch: between others the number goes one way.
        if not low - SLACK * abs(low) <= getattr(found, free) <= high + SLACK * abs(high):
            raise NotConverged(
                f"at {given.name} = {given.value:.8g} another state was met than the branch has there.",
                remedy="Trace it with more points.",
            )
        yield found


def _posed(branch: Branch, given: AtValue, law: CohesiveLaw, there: SolvedState) -> Question:
    """Return the question that a state answers: of a rod its pressure or length, else alpha1 in groups."""
    s = there.profile.scalars
    if branch.rod is None:
        beta0 = branch.held if branch.hold == "beta0" else s.beta0
        lam = given.value if given.name == "lam" else s.lam
        exact = {"beta0": beta0, "lam": lam} if {branch.hold, given.name} == {"beta0", "lam"} else {}
        return replace(Question.at_groups(law, beta0, lam), exact=exact)
    if given.column not in (measure.attribute for measure in WITH_UNIT.values()):
        return Question.at(branch.rod, law, "length", s.sigma)
    name = given.column.removesuffix("_ratio")
    value = given.in_its_unit(branch, given.plain, WITH_UNIT[name])
    exact = {given.column: given.plain, name: given.value if given.name == name else value}
    return replace(Question.at(branch.rod, law, name, given.plain), exact=exact)


def _brackets(
    branch: Branch, family: Family, given: AtValue
) -> Iterator[tuple[int, int, Point, Point | None]]:
    """Yield points of a branch on both sides of each crossing, after their rows, or one that has the value.

    Folds of pressure and length are points of a rod's branch, and those of lambda of one at fixed beta0.  Of
    other numbers a fold between two rows that are both beyond the value may be on its other side.
    """
    misses, across = given.misses(branch), dict(rows_across(branch, given))
    size = np.abs(misses)
    for piece in branch.pieces:
        rows = np.arange(len(branch))[piece].tolist()
        for k, i in enumerate(rows):
            if across.get(i) == i:
                yield i, i, _point(branch, i), None
            if k + 1 == len(rows):
                continue
            j = rows[k + 1]
            if across.get(i) == j:
                yield i, j, *_facing(branch, i, j)
            elif misses[i] * misses[j] > 0.0 and _turns(size, rows, k):
                here, there = _facing(branch, i, j)
                if given.rate(here) * given.rate(there) >= 0.0:
                    continue
                fold, _ = family.turning_point(here, there, given.rate)
                if fold.miss(given.closure) * here.miss(given.closure) < 0.0:
                    yield i, j, here, fold
                    yield i, j, fold, there


def _turns(size: np.ndarray, rows: Sequence[int], k: int) -> bool:
    """Whether one of two neighbouring rows comes nearer to a value than those around them."""
    around = size[[rows[n] for n in range(max(k - 1, 0), min(k + 3, len(rows)))]]
    least = int(np.argmin(around)) + max(k - 1, 0)
    return least in (k, k + 1)


def _point(branch: Branch, i: int) -> Point:
    assert branch.solutions is not None  # or there is no law, and nothing to land with
    problem, x = discretised(branch, i)
    return Point(problem, x, branch.solutions.tangents[i], float(branch.arclength[i]), 0)


def _facing(branch: Branch, i: int, j: int) -> tuple[Point, Point]:
    """Return two neighbouring points with the directions that lead from the first to the second."""
    here, there = _point(branch, i), _point(branch, j)
    way = there.place - here.place
    turned = [p if p.direction @ way >= 0.0 else p.turned(p.arclength) for p in (here, there)]
    return turned[0], turned[1]
