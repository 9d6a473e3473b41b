"""What a design is to achieve, and the public calls that say whether it does."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ...analysis.design_relations import maxwell_exponent, maxwell_length, maxwell_note
from ...analysis.flaws import readhesion_pressure
from ...analysis.maxwell_derivative import maxwell_gradient
from ...analysis.sensitivities import sensitivities
from ...base.checks import parse
from ...base.errors import InvalidInput, NoEquilibrium
from ...base.units import LENGTH, PRESSURE, Kind, display
from ...equilibria.ask import ask_about
from ...equilibria.question import ASKS
from ...equilibria.result import Equilibrium
from ...model.bond import CohesiveLaw
from ...model.rod import MATERIAL, Rod

#: The quantities a target may set: what each measures, and what has to be given with it.
QUANTITIES: dict[str, tuple[Kind, str]] = {
    "pressure": (PRESSURE, "length"),
    "length": (LENGTH, "pressure"),
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
    state : str
        Of the equilibrium, where it is one.
    """

    value: float
    error: float
    state: str = ""


@dataclass(frozen=True)
class Target:
    """A number a rod is to have.  Values are SI numbers or text with a unit, "5 kPa".

    Parameters
    ----------
    quantity : str
        "pressure" that holds a ``length``, "length" that a ``pressure`` holds,
        "readhesion_pressure", or "maxwell_length".
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
    >>> Target("length", at_least="1 mm", pressure="5 kPa")
    Target(length at 5.0000 kPa at least 1.00000 mm)
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
        return f"{self.quantity} at {display(self.given, ASKS[needed].given.dimension.unit, 5)}"

    def __repr__(self) -> str:
        return f"Target({self.label} {SENSES[self.sense]} {self.shown(self.value)})"

    def shown(self, value: float) -> str:
        """Write a value of the quantity."""
        return display(value, self.unit, 6)

    def gap(self, value: float) -> float:
        """Logarithm by which a value exceeds the target's; negative below."""
        return math.log(value / self.value)

    def shortfall(self, value: float) -> float:
        """How far a value misses the target, as a logarithm; 0 where it is met."""
        return self.missed(self.gap(value))

    def missed(self, gap: float) -> float:
        """What a gap leaves to be met."""
        return {"equal": abs(gap), "at_least": max(-gap, 0.0), "at_most": max(gap, 0.0)}[self.sense]

    def value_at(self, rod: Rod, law: str | CohesiveLaw) -> float:
        """Value [SI] of the quantity, by the quickest call that gives all its digits.

        Raises
        ------
        NoEquilibrium
            If the rod has none.
        """
        return _maxwell(rod) if self.quantity == "maxwell_length" else self.achieved(rod, law).value

    def elasticities(self, rod: Rod, law: str | CohesiveLaw) -> np.ndarray:
        """Return d log quantity by log k, log T0 and log y0, shape (3,).

        Raises
        ------
        AtFold
            If the state of the quantity comes to its end at this rod.
        """
        if self.quantity == "maxwell_length":
            by_eta = float(maxwell_exponent(rod.ratio, "branch"))
            return np.array([by_eta / 3.0, -by_eta / 3.0, 1.0 - by_eta])
        if self.quantity == "readhesion_pressure":
            found = sensitivities(rod, self.quantity, law=law)
        else:
            found = sensitivities(self._equilibrium(rod, law))
        return np.array([found.elasticities[name] for name in MATERIAL])

    def achieved(self, rod: Rod, law: str | CohesiveLaw) -> Achieved:
        """Ask the public call for the quantity, and for its error.

        Raises
        ------
        NoEquilibrium
            If the rod has none.
        """
        if self.quantity == "readhesion_pressure":
            limit = readhesion_pressure(rod, law=law)
            return Achieved(limit.pressure, rod.pressure(limit.error))
        if self.quantity == "maxwell_length":
            length = _maxwell(rod)
            solved = rod.length(maxwell_gradient(rod.ratio).value)  # the Maxwell point itself
            return Achieved(length, abs(length - solved) + 1e-12 * length)
        eq = self._equilibrium(rod, law)
        asked = ASKS[QUANTITIES[self.quantity][1]].asked
        return Achieved(getattr(eq, asked.name), asked.from_ratio(rod, eq.error), eq.state)

    def _equilibrium(self, rod: Rod, law: str | CohesiveLaw) -> Equilibrium:
        return ask_about(rod, QUANTITIES[self.quantity][1], self.given, law=law)


def _maxwell(rod: Rod) -> float:
    """sbar_M [m] on the interpolated curve."""
    ratio = maxwell_length(rod.ratio, "branch")
    if not math.isfinite(ratio):
        raise NoEquilibrium(
            f"no Maxwell length at eta/y0 = {rod.ratio:.4g}: {maxwell_note(rod.ratio, 'branch')}."
        )
    return float(ratio * rod.adhesion_range)
