"""``[[questions]]`` of a problem card: what is given, what is asked for, and which answer is meant."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from ..analysis.unbonded import FlawLimit, critical_flaw, safe_pressure
from ..base import units
from ..base.checks import parse
from ..base.errors import InvalidInput, OutOfRange, PeelOptError
from ..base.units import KINDS, NUMBER, told_apart, unit_in
from ..equilibria.ask import ask_about, equilibrium, length_given_pressure, pressure_given_length
from ..equilibria.methods import as_method
from ..equilibria.question import ASKS, LENGTH, PRESSURE, Asks, Measure
from ..equilibria.result import Equilibrium
from ..equilibria.scene_question import posed
from ..equilibria.scenes import SCENE_STATES, plain_law, refuse_options, scene_method, solve
from ..equilibria.select import OTHERS
from ..model.labels import STATES, known_state
from ..model.rod import Rod
from ..model.scene import Scene
from .card_tables import CardTable, GroupsTable, Number, Tolerance, one_line, own_units
from .scene_table import read_number

#: What the questions of a card are about.
Problem = Rod | Scene | GroupsTable

#: What answers one of them.
Answer = Equilibrium | FlawLimit

#: A question as a call without arguments.
Posed = partial[Equilibrium] | partial[FlawLimit]

#: All states that may be asked for, of a rod or of a scene.
_EVERY_STATE = tuple(dict.fromkeys((*SCENE_STATES, *STATES)))

#: The length without glue that snaps, as ``free`` calls it.
FLAW = "flaw"


def _known_method(value: Any) -> Any:
    as_method(value)
    return value


class QuestionTable(CardTable):
    """``[[questions]]``: what is given, and which of the answers is meant.

    ``pressure``, ``length``, ``flaw`` and ``near`` are strings with units, or numbers in SI units; for a
    rod known by its ratio alone, in units of its own T0 and eta.  ``near`` measures what is
    asked for: a pressure at a given length, a length at a given pressure, alpha1 in groups, and the
    number that is ``free``.
    """

    name: str = Field("", description="of the answer and its files; what is asked, in words, if not given")
    free: str | None = Field(
        None,
        description="the number of the scene that is asked for, such as force; flaw for the critical one",
    )
    pressure: Annotated[Any, units.PRESSURE] = Field(None, description="given; alone it asks for the length")
    pressure_ratio: Number | None = Field(None, description="the same as p/T0")
    length: Annotated[Any, units.LENGTH] = Field(
        None, description="detached length, given; alone it asks for the pressure"
    )
    length_ratio: Number | None = Field(None, description="the same as sbar/eta")
    flaw: Annotated[Any, units.LENGTH] = Field(
        None, description="length without glue, given; asks for the pressure that is safe"
    )
    law: Literal["auto", "linear", "cohesive"] | None = Field(
        None, description="of the bond; auto is law (8), which is the linear one up to y0"
    )
    state: Annotated[str, BeforeValidator(partial(known_state, among=_EVERY_STATE))] | None = Field(
        None, description=f"which of several states: {', '.join(_EVERY_STATE)}"
    )
    near: Any = Field(None, description="picks the state in which the number asked for is nearest to this")
    tol: Tolerance | None = Field(None, description="largest error of a certified answer; 1e-8 if not given")
    method: Annotated[str, BeforeValidator(_known_method)] | None = Field(
        None, description="auto, series, spectral, collocation or shooting; auto if not given"
    )

    @property
    def _given(self) -> dict[str, Measure]:
        """What is given, by its field: a length, a pressure, or a ratio of one."""
        fields = {name: ASKS[name.removesuffix("_ratio")].given for name in GIVEN}
        return {name: measure for name, measure in fields.items() if getattr(self, name) is not None}

    @property
    def given(self) -> str:
        """Name of the given quantity; empty where it is the paper's groups."""
        return next(iter(self._given), "")

    @property
    def _asks(self) -> Asks:
        """What is given of a rod, with a unit or as a ratio, and what that asks for."""
        return ASKS[self.given.removesuffix("_ratio")]

    @property
    def asked(self) -> dict[str, Any]:
        """What is asked, whatever it is called and however it is answered."""
        return self.model_dump(exclude={"name", "tol", "method"}, exclude_none=True)

    @property
    def is_of_a_flaw(self) -> bool:
        """Whether it asks for a critical flaw or a safe pressure, and not for one state."""
        return self.flaw is not None or self.free == FLAW

    @model_validator(mode="after")
    def _gives_what_it_needs(self) -> Self:
        given, measures = list(self._given), list(self._given.values())
        if len(set(measures)) < len(measures) or (len(given) > 1 and self.free is None):
            raise InvalidInput("give one of pressure, pressure_ratio, length and length_ratio, not several.")
        if self.flaw is not None and (given or self.free):
            raise InvalidInput(f"flaw asks for the pressure that is safe, beside no {[*given, 'free'][0]}.")
        if self.is_of_a_flaw:
            if self.free == FLAW and (len(given) != 1 or measures[0] is LENGTH):
                raise InvalidInput("free = 'flaw' asks for the critical one at a pressure: give that alone.")
            for name in ("state", "near", "tol", "method"):
                if getattr(self, name) is not None:
                    raise InvalidInput(f"{name} cannot be given beside a flaw: there is one snap.")
        return self

    def label(self, problem: Problem) -> str:
        """Return the name, or what is asked in a few words."""
        if self.name:
            return one_line(self.name)
        near = None if self.near is None else f"near {self.near}"
        details = (self.state, self.law and f"{self.law} law", near)
        # What was typed over several lines is one name all the same.
        return one_line(", ".join([self._words(problem), *filter(None, details)]))

    def _words(self, problem: Problem) -> str:
        """Return what is asked for, and at what."""
        if isinstance(problem, GroupsTable):
            second = f"beta1 = {problem.beta1:g}" if problem.lam is None else f"lambda = {problem.lam:g}"
            return f"alpha1 at beta0 = {problem.beta0:g}, {second}"
        if self.flaw is not None:
            return f"safe pressure for a flaw of {_shown(self.flaw)}"
        several = len(self._given) > 1
        at = []
        for name, measure in self._given.items():
            symbol = measure.symbol if name == measure.attribute else measure.name if several else ""
            at.append(f"{symbol} = {_shown(getattr(self, name))}".removeprefix(" = "))
        asked = {None: self._asks.asked.name if at else "", FLAW: "critical flaw"}.get(self.free, self.free)
        return " at ".join(filter(None, (str(asked), ", ".join(at) or "no pressure")))

    def pose(self, problem: Problem) -> Posed:
        """Return the question as a call without arguments.

        Raises
        ------
        InvalidInput
            If a value has the wrong unit or sign, or none is given.
        """
        if isinstance(problem, GroupsTable):
            return self._posed_in_groups(problem)
        if self.is_of_a_flaw:
            return self._posed_of_a_flaw(problem)
        if isinstance(problem, Scene):
            return self._posed_of_a_scene(problem)
        if self.free is not None:
            return self._posed_of_a_scene(Scene(problem, law="auto" if self.law is None else self.law))
        options = self._options(state=known_state(self.state))
        near = None if self.near is None else self._in_units_of(problem, "near")
        return self._posed_at(problem, partial(ask_about, problem, self._given_of_one), near=near, **options)

    @property
    def _given_of_one(self) -> str:
        """Name of the only thing given.

        Raises
        ------
        InvalidInput
        """
        if not self.given:
            raise InvalidInput("give one of pressure, pressure_ratio, length and length_ratio.")
        return self._asks.given.name

    def _options(self, **others: Any) -> dict[str, Any]:
        """Return the options that are given, with others in their place."""
        named = {name: getattr(self, name) for name in ("law", "state", "tol", "method")} | others
        return {name: value for name, value in named.items() if value is not None}

    def _posed_in_groups(self, groups: GroupsTable) -> Posed:
        if fixed := self.given or (self.flaw and "flaw") or (self.free and "free"):
            raise InvalidInput(f"{fixed} is fixed by [groups] already.")
        near = None if self.near is None else parse("near", self.near, NUMBER, signed=True)
        options = self._options(state=known_state(self.state))
        return partial(
            equilibrium, beta0=groups.beta0, beta1=groups.beta1, lam=groups.lam, near=near, **options
        )

    def _posed_of_a_flaw(self, problem: Rod | Scene) -> Posed:
        rod, law = problem, self.law or "auto"
        if isinstance(problem, Scene):
            if not replace(problem, unbonded=0.0).is_plain:
                raise InvalidInput(
                    "a flaw is asked of a uniform pressure under a rod on a flat plate; [scene] says more.",
                    remedy="Solve for its states with free = 'pressure' or free = 'unbonded'.",
                )
            refuse_options(law=law)
            rod, law = problem.rod, plain_law(problem)  # type: ignore[assignment]
        assert isinstance(rod, Rod)
        if self.flaw is not None:
            return partial(safe_pressure, rod, self._in_units_of(rod, FLAW), law=law)
        pressure = self._in_units_of(rod, self.given)
        if unit := unit_in(getattr(self, self.given)):
            size = self._in_units_of(rod, self.given, f"1 {unit}")
            return partial(_snapping, unit, size, rod, pressure, law=law)
        return partial(critical_flaw, rod, pressure, law=law)

    def _posed_of_a_scene(self, scene: Scene) -> Posed:
        refuse_options(law=self.law or "auto")
        scene_method(self.method or "auto")
        state = known_state(self.state, among=SCENE_STATES)
        options = self._options(state=state, law=None)
        if self.free is None:
            asks: dict[str, Callable[..., Equilibrium]] = {
                "pressure": length_given_pressure,
                "length": pressure_given_length,
            }
            ask = asks[self._given_of_one]
            near = None if self.near is None else self._in_units_of(scene, "near")
            return self._posed_at(scene, partial(ask, scene), near=near, **options)
        given: dict[str, Any] = {}
        for name, measure in self._given.items():
            given[measure.name] = self._in_units_of(scene, name)
        question = posed(scene, self.free, given)  # says what is missing
        near = None
        if self.near is not None:
            near = read_number(scene.rod, "near", self.near, question.dimension)
        return partial(solve, scene, free=self.free, near=near, **options, **given)

    def pressure_of(self, rod: Rod) -> float | None:
        """Return the pressure it gives [Pa]; None if it gives none."""
        names = (name for name, measure in self._given.items() if measure is PRESSURE)
        name = next(names, None)
        return None if name is None else self._in_units_of(rod, name)

    def _posed_at(self, subject: Rod | Scene, ask: Callable[..., Equilibrium], **options: Any) -> Posed:
        """Return a call with what is given; where that has a unit, errors speak in it."""
        value = self._in_units_of(subject, self.given)
        if unit := unit_in(getattr(self, self.given)):
            size = self._in_units_of(subject, self.given, f"1 {unit}")
            closes = self.law in (None, "auto", "cohesive") and self.state in (None, "unfolded")
            plain_rod = subject if closes and isinstance(subject, Rod) else None
            ask = partial(_in_words_of_the_trade, unit, size, self._asks.given, plain_rod, ask)
        return partial(ask, value, **options)

    def _in_units_of(self, subject: Rod | Scene, name: str, text: str = "") -> float:
        """Return a field, or another text in its place, in the units of the rod."""
        measure = self._asks.asked if name == "near" else LENGTH if name == FLAW else self._given[name]
        rod = subject.rod if isinstance(subject, Scene) else subject
        raw: Any = text or getattr(self, name)
        if name == measure.attribute:
            return measure.from_ratio(rod, raw)
        kind = NUMBER if rod.dimensionless else KINDS[measure.dimension.unit]
        # A scene may stand without a pressure, or under suction.
        signed = name == "near" or (measure is PRESSURE and isinstance(subject, Scene))
        return parse(name, raw, kind, own=own_units(rod, measure.dimension.unit), signed=signed)


#: Fields of what is given.
GIVEN = ("pressure", "pressure_ratio", "length", "length_ratio")


def _shown(value: object) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def _in_words_of_the_trade(
    unit: str,
    size: float,
    given: Measure,
    rod: Rod | None,
    ask: Callable[..., Equilibrium],
    value: float,
    **options: Any,
) -> Equilibrium:
    """Ask; an error that names the nearest value with an answer says what that is, in the unit typed.

    ``rod``: where an unfolded state of it under law (8) is asked for, whose ends are known by name.
    """
    try:
        return ask(value, **options)
    except PeelOptError as error:
        if error.nearest is None:
            raise
        same = math.isclose(error.nearest, value, rel_tol=1e-12)
        apart = (
            f"{error.nearest / size:.8g}" if same else told_apart(error.nearest / size, value / size, 8)[0]
        )
        nearest = f"{apart} {unit}"
        if rod is None:
            error.args = (f"{error} That is {nearest}.",)
            raise
        if given is PRESSURE:
            fails = value >= rod.adhesion_strength
            end = "From {} on the bond itself fails." if fails else "Below {} every lifted edge closes."
        else:
            end = "None is longer than {}." if value > error.nearest else "None is shorter than {}."
        _, others, named = str(error).partition(OTHERS)
        asked = f"no unfolded equilibrium at {given.name} {value / size:.8g} {unit}."
        error.args = (f"{asked} {end.format(nearest)}{others}{named}",)
        raise


def _snapping(unit: str, size: float, rod: Rod, pressure: float, **options: Any) -> FlawLimit:
    """Ask for the critical flaw; from the strength of the bond on, say so in the unit typed."""
    try:
        return critical_flaw(rod, pressure, **options)
    except OutOfRange as error:
        if pressure > 0.0:
            strength = f"{rod.adhesion_strength / size:.8g} {unit}"
            given = f"{pressure / size:.8g} {unit}"
            error.args = (f"no flaw is critical at {given}: from T0 = {strength} on every edge snaps.",)
        raise
