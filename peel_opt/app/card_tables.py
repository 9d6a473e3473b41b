"""The tables of a problem card and what may stand in them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationInfo, model_validator

from ..base.errors import InvalidInput, PeelOptError
from ..base.units import LENGTH, NUMBER, PRESSURE, STIFFNESS, WORK, Kind, parse, unit_in
from ..equilibria.ask import ask_rod, equilibrium
from ..equilibria.methods import as_method
from ..equilibria.question import ASKS, Asks
from ..equilibria.result import Equilibrium
from ..model.labels import known_state
from ..model.rod import Rod


def _read(value: object, info: ValidationInfo, *, kind: Kind, signed: bool = False) -> float:
    return parse(str(info.field_name), value, kind, signed=signed)


def _read_tol(value: object) -> float:
    tol = parse("tol", value, NUMBER)
    if not tol < 1.0:
        raise InvalidInput(f"tol must lie between 0 and 1, got {tol:g}.")
    return tol


def _known_method(value: Any) -> Any:
    as_method(value)
    return value


Pressure = Annotated[float, BeforeValidator(partial(_read, kind=PRESSURE))]
Length = Annotated[float, BeforeValidator(partial(_read, kind=LENGTH))]
Stiffness = Annotated[float, BeforeValidator(partial(_read, kind=STIFFNESS))]
Work = Annotated[float, BeforeValidator(partial(_read, kind=WORK))]
Number = Annotated[float, BeforeValidator(partial(_read, kind=NUMBER))]
Tolerance = Annotated[float, BeforeValidator(_read_tol)]
SignedNumber = Annotated[float, BeforeValidator(partial(_read, kind=NUMBER, signed=True))]


def one_line(text: str) -> str:
    """Return a text of a card without line breaks and what else would act on a terminal."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


class CardTable(BaseModel):
    """A table of a card: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class RodTable(CardTable):
    """``[rod]``: k, T0 and y0, given or derived, in SI units; or eta/y0 alone."""

    bending_stiffness: Stiffness | None = None
    youngs_modulus: Pressure | None = None
    thickness: Length | None = None
    poisson_ratio: SignedNumber | None = None
    adhesion_strength: Pressure | None = None
    adhesion_range: Length | None = None
    work_of_separation: Work | None = None
    ratio: Number | None = None

    @model_validator(mode="after")
    def _determines_a_rod(self) -> Self:
        given = self.model_fields_set
        if "ratio" in given:
            if len(given) > 1:
                raise InvalidInput(f"give ratio alone, not with {', '.join(sorted(given - {'ratio'}))}.")
            return self
        strip = {"youngs_modulus", "thickness", "poisson_ratio"}
        stiffness = given & {"bending_stiffness", *strip}
        if stiffness not in ({"bending_stiffness"}, strip):
            raise InvalidInput(
                "give bending_stiffness, or youngs_modulus, thickness and poisson_ratio;"
                f" got {', '.join(sorted(stiffness)) or 'none'}."
            )
        bond = given & {"adhesion_strength", "adhesion_range", "work_of_separation"}
        if len(bond) != 2:
            raise InvalidInput(
                "give two of adhesion_strength, adhesion_range and work_of_separation;"
                f" got {', '.join(sorted(bond)) or 'none'}."
            )
        if self.poisson_ratio is not None and not -1.0 < self.poisson_ratio <= 0.5:
            raise InvalidInput(f"poisson_ratio must lie above -1 and up to 0.5, got {self.poisson_ratio:g}.")
        return self

    def rod(self) -> Rod:
        """Return the rod: k = E h^3 / (12 (1 - nu^2)) and G = T0 y0 / 2 fill what is not given."""
        if self.ratio is not None:
            return Rod.from_ratio(self.ratio)
        k, T0, y0, G = (
            self.bending_stiffness,
            self.adhesion_strength,
            self.adhesion_range,
            self.work_of_separation,
        )
        if self.youngs_modulus and self.thickness and self.poisson_ratio is not None:
            h = self.thickness
            # Multiplied out, a slip like 1e200 m becomes infinite, which the rod refuses.
            k = self.youngs_modulus * h * h * h / (12.0 * (1.0 - self.poisson_ratio**2))
        if G and T0:
            y0 = 2.0 * G / T0
        elif G and y0:
            T0 = 2.0 * G / y0
        assert k is not None
        assert T0 is not None
        assert y0 is not None
        return Rod(k, T0, y0)


class GroupsTable(CardTable):
    """``[groups]``: the paper's beta0 and either beta1 or lam = beta1 - pi^4."""

    beta0: SignedNumber
    beta1: Number | None = None
    lam: SignedNumber | None = None

    @model_validator(mode="after")
    def _determines_a_problem(self) -> Self:
        if self.beta0 < 0.0:
            raise InvalidInput(f"beta0 must be zero or positive, got {self.beta0:g}.")
        if (self.beta1 is None) == (self.lam is None):
            raise InvalidInput("give either beta1 or lam, and not both.")
        return self


class QuestionTable(CardTable):
    """``[[questions]]``: what is given, and which of the answers is meant.

    ``pressure``, ``length`` and ``near`` are strings with units, or numbers in SI units; for a
    rod known by its ratio alone, in units of its own T0 and eta.  ``near`` measures what is
    asked for: a pressure at a given length, a length at a given pressure, alpha1 in groups.
    """

    name: str = ""
    pressure: Any = None
    pressure_ratio: Number | None = None
    length: Any = None
    length_ratio: Number | None = None
    law: Literal["auto", "linear", "cohesive"] | None = None
    state: Annotated[str, BeforeValidator(known_state)] | None = None
    near: Any = None
    tol: Tolerance | None = None
    method: Annotated[str, BeforeValidator(_known_method)] | None = None

    @property
    def given(self) -> str:
        """Name of the given quantity; empty where it is the paper's groups."""
        names = ("pressure", "pressure_ratio", "length", "length_ratio")
        return "".join(name for name in names if getattr(self, name) is not None)

    @property
    def _asks(self) -> Asks:
        """What is given of a rod, with a unit or as a ratio, and what that asks for."""
        return ASKS[self.given.removesuffix("_ratio")]

    @property
    def asked(self) -> dict[str, Any]:
        """What is asked, whatever it is called and however it is answered."""
        return self.model_dump(exclude={"name", "tol", "method"}, exclude_none=True)

    @model_validator(mode="after")
    def _gives_one_quantity(self) -> Self:
        if self.given not in ("", *type(self).model_fields):
            raise InvalidInput("give one of pressure, pressure_ratio, length and length_ratio, not several.")
        return self

    def label(self, problem: Rod | GroupsTable) -> str:
        """Return the name, or what is asked in a few words."""
        if self.name:
            return one_line(self.name)
        if isinstance(problem, GroupsTable):
            second = f"beta1 = {problem.beta1:g}" if problem.lam is None else f"lambda = {problem.lam:g}"
            words = f"alpha1 at beta0 = {problem.beta0:g}, {second}"
        else:
            given, asked = self._asks
            symbol = f"{given.symbol} = " if self.given == given.attribute else ""
            value = getattr(self, self.given)
            words = f"{asked.name} at {symbol}{value if isinstance(value, str) else f'{value:g}'}"
        near = None if self.near is None else f"near {self.near}"
        details = (self.state, self.law and f"{self.law} law", near)
        # What was typed over several lines is one name all the same.
        return one_line(", ".join([words, *filter(None, details)]))

    def pose(self, problem: Rod | GroupsTable) -> partial[Equilibrium]:
        """Return the question as a call without arguments.

        Raises
        ------
        InvalidInput
            If a value has the wrong unit or sign, or none is given.
        """
        named = {name: getattr(self, name) for name in ("law", "state", "tol", "method")}
        options: dict[str, Any] = {name: value for name, value in named.items() if value is not None}
        if isinstance(problem, GroupsTable):
            if self.given:
                raise InvalidInput(f"{self.given} is fixed by [groups] already.")
            near = None if self.near is None else parse("near", self.near, NUMBER, signed=True)
            return partial(
                equilibrium, beta0=problem.beta0, beta1=problem.beta1, lam=problem.lam, near=near, **options
            )
        if not self.given:
            raise InvalidInput("give one of pressure, pressure_ratio, length and length_ratio.")
        value = self._in_units_of(problem, self.given)
        near = None if self.near is None else self._in_units_of(problem, "near")
        ask: Callable[..., Equilibrium] = ask_rod
        if unit := unit_in(getattr(self, self.given)):
            size = self._in_units_of(problem, self.given, f"1 {unit}")
            ask = partial(_with_nearest_in, unit, size, ask)
        return partial(ask, problem, self._asks.given.name, value, near=near, **options)

    def _in_units_of(self, rod: Rod, name: str, text: str = "") -> float:
        """Return a field, or another text in its place, in the units of the rod."""
        raw: Any = text or getattr(self, name)
        given, asked = self._asks
        measure = asked if name == "near" else given
        if name == measure.attribute:
            return measure.from_ratio(rod, raw)
        own_units = {"eta": rod.eta, "y0": rod.adhesion_range}, {"T0": rod.adhesion_strength}
        kind, own = {"m": (LENGTH, own_units[0]), "Pa": (PRESSURE, own_units[1])}[measure.unit]
        if rod.dimensionless:
            kind = NUMBER
        return parse(name, raw, kind, own=own, signed=name == "near")


def _with_nearest_in(
    unit: str, size: float, ask: Callable[..., Equilibrium], *given: Any, **options: Any
) -> Equilibrium:
    """Ask; an error that names the nearest value with an answer names it in the unit typed too."""
    try:
        return ask(*given, **options)
    except PeelOptError as error:
        if error.nearest is not None:
            error.args = (f"{error} That is {error.nearest / size:.8g} {unit}.",)
        raise
