"""What a design is to achieve, and the public calls that say whether it does."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ...analysis.design_relations import maxwell_length, maxwell_note
from ...analysis.flaws import critical_flaw, readhesion_pressure
from ...analysis.maxwell_derivative import maxwell_gradient
from ...base.errors import InvalidInput, NoEquilibrium
from ...base.units import LENGTH, PRESSURE, Kind, display, parse
from ...equilibria.ask import length_given_pressure, pressure_given_length
from ...model.rod import Rod

#: The quantities a target may set: what each measures, and what has to be given with it.
QUANTITIES: dict[str, tuple[Kind, str]] = {
    "pressure": (PRESSURE, "length"),
    "length": (LENGTH, "pressure"),
    "critical_flaw": (LENGTH, "pressure"),
    "readhesion_pressure": (PRESSURE, ""),
    "maxwell_length": (LENGTH, ""),
}

#: The senses of a target, with words for messages.
SENSES = {"equal": "equal to", "at_least": "at least", "at_most": "at most"}


@dataclass(frozen=True)
class Achieved:
    """What a rod does, by the public call for it.

    Parameters
    ----------
    value, error : float
        In SI units, with the error the call gives.
    note : str
        What is to be said about the value.
    """

    value: float
    error: float
    note: str = ""


@dataclass(frozen=True)
class Requirement:
    """One constraint of the programme: a smooth quantity and its bound, in SI units.

    ``quantity`` is that of a target, or "strength" for T0 itself; ``given`` is 0 where nothing is.
    """

    quantity: str
    given: float
    sense: str
    value: float

    def is_value_of(self, target: Target) -> bool:
        """Whether it bounds the target's own quantity, and not another one that implies it."""
        return self == target.alternatives()[0]


@dataclass(frozen=True)
class Target:
    """A number a rod is to have.  Values are SI numbers or text with a unit, "5 kPa".

    Parameters
    ----------
    quantity : str
        "pressure" that holds a ``length``, "length" that a ``pressure`` holds, "critical_flaw"
        under a ``pressure``, "readhesion_pressure", or "maxwell_length".
    equal, at_least, at_most : float or str
        One of them.
    length, pressure : float or str, optional
        What the quantity is taken at.

    Raises
    ------
    InvalidInput
        If the quantity is unknown, or what belongs to it is missing, or something does not.

    Examples
    --------
    >>> Target("critical_flaw", at_least="1 mm", pressure="5 kPa")
    Target(critical_flaw at 5.0000 kPa at least 1.00000 mm)
    """

    quantity: str
    equal: float | str | None = None
    at_least: float | str | None = None
    at_most: float | str | None = None
    length: float | str | None = None
    pressure: float | str | None = None
    sense: str = field(init=False)
    value: float = field(init=False)
    given: float = field(init=False)

    def __post_init__(self) -> None:
        if not isinstance(self.quantity, str) or self.quantity not in QUANTITIES:
            raise InvalidInput(
                f"unknown target {self.quantity!r}.", remedy=f"Choose one of {', '.join(QUANTITIES)}."
            )
        kind, needed = QUANTITIES[self.quantity]
        senses = [sense for sense in SENSES if getattr(self, sense) is not None]
        if len(senses) != 1:
            raise InvalidInput(f"target {self.quantity} needs one of {', '.join(SENSES)}, got {len(senses)}.")
        for name in ("length", "pressure"):
            if (getattr(self, name) is not None) != (name == needed):
                words = f"needs {needed}=" if name == needed else f"takes no {name}="
                raise InvalidInput(f"target {self.quantity} {words}.")
        object.__setattr__(self, "sense", senses[0])
        object.__setattr__(self, "value", parse(self.quantity, getattr(self, senses[0]), kind))
        given = 0.0
        if needed:
            given = parse(needed, getattr(self, needed), {"length": LENGTH, "pressure": PRESSURE}[needed])
        object.__setattr__(self, "given", given)

    @property
    def unit(self) -> str:
        """SI unit of the quantity."""
        return QUANTITIES[self.quantity][0].si

    @property
    def label(self) -> str:
        """The quantity and where it is taken."""
        needed = QUANTITIES[self.quantity][1]
        if not needed:
            return self.quantity
        return f"{self.quantity} at {display(self.given, {'length': 'm', 'pressure': 'Pa'}[needed], 5)}"

    def __repr__(self) -> str:
        return f"Target({self.label} {SENSES[self.sense]} {self.shown(self.value)})"

    def alternatives(self) -> tuple[Requirement, ...]:
        """Return the constraints any one of which meets the target.

        A critical flaw is as long as one likes below the readhesion pressure, where every flaw
        heals, and as short as one likes from T0 on, where every one grows.
        """
        own = Requirement(self.quantity, self.given, self.sense, self.value)
        if self.quantity != "critical_flaw":
            return (own,)
        own = Requirement("length", self.given, self.sense, self.value)
        if self.sense == "at_least":
            return (own, Requirement("readhesion_pressure", 0.0, "at_least", self.given))
        if self.sense == "at_most":
            return (own, Requirement("strength", 0.0, "at_most", self.given))
        return (own,)

    def shown(self, value: float, note: str = "") -> str:
        """Write a value of the quantity; the note where it is none."""
        return display(value, self.unit, 6) if 0.0 < value < math.inf else note

    def shortfall(self, value: float) -> float:
        """How far a value misses the target, as a logarithm; 0 where it is met."""
        return shortfall(self.sense, value, self.value)

    def achieved(self, rod: Rod, tol: float) -> Achieved:
        """Ask the public function for the quantity.

        Raises
        ------
        NoEquilibrium
            If the rod has none.
        """
        if self.quantity == "readhesion_pressure":
            limit = readhesion_pressure(rod)
            return Achieved(limit.pressure, rod.pressure(limit.error))
        if self.quantity == "maxwell_length":
            return _maxwell(rod)
        if self.quantity == "pressure":
            eq = pressure_given_length(rod, self.given)
            return Achieved(eq.pressure, rod.pressure(eq.error), eq.state)
        if self.quantity == "critical_flaw":
            return self._critical_flaw(rod, tol)
        eq = length_given_pressure(rod, self.given)
        return Achieved(eq.length, rod.length(eq.error), eq.state)

    def _critical_flaw(self, rod: Rod, tol: float) -> Achieved:
        if self.given >= rod.adhesion_strength * (1.0 - tol):
            return Achieved(0.0, 0.0, "every flaw grows: the pressure is not below T0")
        least = readhesion_pressure(rod).pressure
        if self.sense == "at_least" and self.given <= least * (1.0 + tol):
            return Achieved(
                math.inf, 0.0, "every flaw heals: the pressure is not above the readhesion pressure"
            )
        eq = critical_flaw(rod, self.given)
        return Achieved(eq.length, rod.length(eq.error), eq.state)


def shortfall(sense: str, value: float, wanted: float) -> float:
    """How far a value misses a bound, as a logarithm; 0 where it is met."""
    gap = math.log(value / wanted) if 0.0 < value < math.inf else (math.inf if value > 0.0 else -math.inf)
    return {"equal": abs(gap), "at_least": max(-gap, 0.0), "at_most": max(gap, 0.0)}[sense]


def _maxwell(rod: Rod) -> Achieved:
    """By the interpolated curve; its error by solving for the Maxwell point itself."""
    ratio = maxwell_length(rod.ratio, "branch")
    if not math.isfinite(ratio):
        raise NoEquilibrium(
            f"no Maxwell length at eta/y0 = {rod.ratio:.4g}: {maxwell_note(rod.ratio, 'branch')}."
        )
    length = ratio * rod.adhesion_range
    return Achieved(length, abs(length - rod.length(maxwell_gradient(rod.ratio).value)) + 1e-12 * length)
