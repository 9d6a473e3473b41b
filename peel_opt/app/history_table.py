"""``[history]`` of a problem card: the pressure on a rod as it changes in time."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from ..base.checks import parse
from ..base.errors import InvalidInput
from ..base.units import LENGTH, NUMBER, PRESSURE, TIME
from ..model.rod import Rod
from .card_tables import CardTable, own_units


class HistoryTable(CardTable):
    """``[history]``: times and the pressures at them, joined by straight lines, and what the bond does.

    What else acts under a [scene] is held.

    Times have a unit where the drag on the rod is known; else they are numbers, in c eta/T0.  Pressures are
    strings with units, the rod's own T0 among them, or numbers in SI units; for a rod known by its ratio
    they are in T0.
    """

    times: Annotated[tuple[Any, ...], TIME] = Field(
        description="increasing, two at least; numbers in c eta/T0 where [rod] has no drag"
    )
    pressures: Annotated[tuple[Any, ...], PRESSURE] = Field(
        description="at those times, joined by straight lines"
    )
    bond: Literal["reversible", "damage", "no_rebond"] | None = Field(
        None, description="what the bond does once it has let go; reversible if not given"
    )
    law: Literal["auto", "linear", "cohesive"] | None = Field(
        None, description="of the bond; auto is law (8), or that of the [scene]"
    )
    rod_length: Annotated[Any, LENGTH] = Field(
        None, description="of the rod; one that is long enough if not given"
    )

    @model_validator(mode="after")
    def _has_pairs(self) -> Self:
        if len(self.times) != len(self.pressures) or len(self.times) < 2:
            raise InvalidInput(
                f"times and pressures go in pairs, two at least, got {len(self.times)} and"
                f" {len(self.pressures)}."
            )
        return self

    def asked(self, rod: Rod, drag: float | None = None) -> dict[str, Any]:
        """Return what `peel_opt.history` takes beside the rod and its drag [Pa s/m].

        Raises
        ------
        InvalidInput
            If a value has the wrong unit or sign.
        """
        si = not rod.dimensionless
        of_time = TIME if si and drag is not None else NUMBER
        of_load, of_length = (PRESSURE, LENGTH) if si else (NUMBER, NUMBER)
        units = own_units(rod, PRESSURE.si)
        # A history begins at 0, and a rod may be let down to no pressure at all.
        times = [parse(f"times no. {i}", raw, of_time, signed=True) for i, raw in enumerate(self.times, 1)]
        pressures = [
            parse(f"pressures no. {i}", raw, of_load, own=units, signed=True)
            for i, raw in enumerate(self.pressures, 1)
        ]
        asked: dict[str, Any] = {"pressure": (times, pressures)}
        named = {"bond": self.bond, "law": self.law}
        asked |= {name: value for name, value in named.items() if value is not None}
        if self.rod_length is not None:
            asked["rod_length"] = parse(
                "rod_length", self.rod_length, of_length, own=own_units(rod, LENGTH.si)
            )
        return asked
