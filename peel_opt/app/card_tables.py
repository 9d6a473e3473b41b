"""The tables of a problem card and what may stand in them."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from ..base.checks import parse
from ..base.errors import InvalidInput
from ..base.units import DRAG, LENGTH, MASS, NUMBER, PRESSURE, STIFFNESS, WORK, Kind
from ..model.rod import Rod, Sheet


def _read(value: object, info: ValidationInfo, *, kind: Kind, signed: bool = False) -> float:
    return parse(str(info.field_name), value, kind, signed=signed)


def _read_tol(value: object) -> float:
    tol = parse("tol", value, NUMBER)
    if not tol < 1.0:
        raise InvalidInput(f"tol must lie between 0 and 1, got {tol:g}.")
    return tol


# The kind stands beside the reader, for the page and the templates that are made from the tables.
Pressure = Annotated[float, PRESSURE, BeforeValidator(partial(_read, kind=PRESSURE))]
Length = Annotated[float, LENGTH, BeforeValidator(partial(_read, kind=LENGTH))]
Stiffness = Annotated[float, STIFFNESS, BeforeValidator(partial(_read, kind=STIFFNESS))]
Work = Annotated[float, WORK, BeforeValidator(partial(_read, kind=WORK))]
Mass = Annotated[float, MASS, BeforeValidator(partial(_read, kind=MASS))]
Drag = Annotated[float, DRAG, BeforeValidator(partial(_read, kind=DRAG))]
Number = Annotated[float, NUMBER, BeforeValidator(partial(_read, kind=NUMBER))]
Tolerance = Annotated[float, NUMBER, BeforeValidator(_read_tol)]
SignedNumber = Annotated[float, NUMBER, BeforeValidator(partial(_read, kind=NUMBER, signed=True))]


def one_line(text: str) -> str:
    """Return a text of a card without line breaks and what else would act on a terminal."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


class CardTable(BaseModel):
    """A table of a card: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def own_units(rod: Rod, unit: str) -> dict[str, float]:
    """Return the units that a rod brings to what has an SI unit, by their names."""
    T0, eta, G = rod.adhesion_strength, rod.eta, rod.work_of_separation
    force = {"T0 eta": T0 * eta, "G": G}
    brought = {
        "m": {"eta": eta, "y0": rod.adhesion_range},
        "Pa": {"T0": T0},
        "N/m": force,
        "J/m^2": force,
        "N": {"T0 eta^2": T0 * eta * eta},
        "1/m": {"1/eta": 1.0 / eta},
    }
    return brought.get(unit, {})


class RodTable(CardTable):
    """``[rod]``: k, T0 and y0, given or derived, in SI units, and mass and drag; or eta/y0 alone."""

    bending_stiffness: Stiffness | None = Field(
        None, description="k per unit width; or the next three, k = E h^3 / (12 (1 - nu^2))"
    )
    youngs_modulus: Pressure | None = Field(None, description="E of the sheet")
    thickness: Length | None = Field(None, description="h of the sheet")
    poisson_ratio: SignedNumber | None = Field(None, description="nu of the sheet")
    adhesion_strength: Pressure | None = Field(
        None, description="T0, the largest traction of the bond; two of T0, y0 and G say the third"
    )
    adhesion_range: Length | None = Field(None, description="y0, the opening at which the bond lets go")
    work_of_separation: Work | None = Field(None, description="G = T0 y0 / 2, the area under the traction")
    mass_per_area: Mass | None = Field(
        None, description="of the rod and what it carries along; for motions, if it is known"
    )
    drag: Drag | None = Field(
        None, description="force per area and speed; for motions, which take their time from it"
    )
    ratio: Number | None = Field(
        None, description="eta/y0 alone, eta = (k/T0)^(1/3): lengths are in eta then, pressures in T0"
    )

    @classmethod
    def of(cls, numbers: dict[str, float]) -> Self:
        """Return the table of numbers [SI] outside any card.

        Raises
        ------
        InvalidInput
            If they make no rod.
        """
        try:
            return cls(**numbers)
        except ValidationError as error:
            raise error.errors()[0]["ctx"]["error"] from error

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
        self.rod()  # whose numbers have limits
        return self

    def rod(self) -> Rod:
        """Return the rod: k = E h^3 / (12 (1 - nu^2)) and G = T0 y0 / 2 fill what is not given."""
        if self.ratio is not None:
            return Rod.from_ratio(self.ratio)
        sheet = None
        k, T0, y0, G = (
            self.bending_stiffness,
            self.adhesion_strength,
            self.adhesion_range,
            self.work_of_separation,
        )
        if self.youngs_modulus and self.thickness and self.poisson_ratio is not None:
            sheet = Sheet(self.youngs_modulus, self.thickness, self.poisson_ratio)
            k = sheet.bending_stiffness
        if G and T0:
            y0 = 2.0 * G / T0
        elif G and y0:
            T0 = 2.0 * G / y0
        assert k is not None
        assert T0 is not None
        assert y0 is not None
        return Rod(k, T0, y0, sheet=sheet)

    def resistance(self) -> dict[str, float]:
        """Return what is known of mass and drag, by the names that `peel_opt.snap` gives them."""
        named = {"mass": self.mass_per_area, "drag": self.drag}
        return {name: value for name, value in named.items() if value is not None}


class GroupsTable(CardTable):
    """``[groups]``: the paper's beta0 and either beta1 or lam = beta1 - pi^4."""

    beta0: SignedNumber = Field(description="T0 sbar^3/k, zero or positive")
    beta1: Number | None = Field(None, description="T0 sbar^4/(k y0)")
    lam: SignedNumber | None = Field(None, description="beta1 - pi^4; one of the two")

    @model_validator(mode="after")
    def _determines_a_problem(self) -> Self:
        if self.beta0 < 0.0:
            raise InvalidInput(f"beta0 must be zero or positive, got {self.beta0:g}.")
        if (self.beta1 is None) == (self.lam is None):
            raise InvalidInput("give either beta1 or lam, and not both.")
        return self
