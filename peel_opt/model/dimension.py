"""What a number of a scene measures: powers of T0 and eta, and its SI unit."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

if TYPE_CHECKING:
    from .rod import Rod


@dataclass(frozen=True)
class Dimension:
    """A number is its size over T0^strength eta^length times that unit.

    Parameters
    ----------
    strength, length : int
        Powers of T0 and of eta.
    unit : str
        The SI unit, empty for a pure number.
    """

    strength: int
    length: int
    unit: str

    def size(self, rod: Rod) -> float:
        """Return T0^strength eta^length of a rod, in its own units."""
        return float(rod.adhesion_strength**self.strength * rod.eta**self.length)

    @property
    def powers(self) -> np.ndarray:
        """Powers of k, T0 and y0 in T0^strength eta^length, shape (3,)."""
        third = self.length / 3.0
        return np.array([third, self.strength - third, 0.0])

    def unit_of(self, rod: Rod) -> str:
        """Return the name of the unit that a rod's numbers of this kind are in."""
        if not rod.dimensionless:
            return self.unit
        powers = (("T0", self.strength), ("eta", self.length))
        return " ".join(name if n == 1 else f"{name}^{n}" for name, n in powers if n)


class ScenePart:
    """A part of a scene: a load, a wall, a tip or a bond, with numbers by name."""

    #: What its numbers measure, by the names under which `solve` frees them.
    parameters: ClassVar[dict[str, Dimension]] = {}

    @property
    def form(self) -> Hashable:
        """What scenes must share to share compiled equations: all of it, unless its class says otherwise."""
        return self

    def numbers(self) -> dict[str, float]:
        """Return its numbers in the units of the rod: its first fields, in the order of ``parameters``."""
        return dict(zip(self.parameters, vars(self).values(), strict=False))


def by_numbers(part: ScenePart) -> tuple[Any, ...]:
    """Return the form of a part whose equations take its numbers by name, and nothing else of it.

    Such parts share compiled equations.  A part is its own form unless its class says otherwise: what a
    reader's own class takes from its fields would be compiled in.
    """
    return type(part), tuple(part.parameters)


NUMBER = Dimension(0, 0, "")
ANGLE = Dimension(0, 0, "rad")
LENGTH = Dimension(0, 1, "m")
CURVATURE = Dimension(0, -1, "1/m")
TRACTION = Dimension(1, 0, "Pa")
FORCE = Dimension(1, 1, "N/m")
ENERGY = Dimension(1, 1, "J/m^2")
MOMENT = Dimension(1, 2, "N")
SPRING = Dimension(1, -1, "Pa/m")

#: Powers of k, T0 and y0 in eta/y0.
RATIO_POWERS = LENGTH.powers - np.array([0.0, 0.0, 1.0])

#: Between which values numbers of a scene have a meaning; all others have one anywhere.
DOMAINS = {
    "dead": (0.0, 1.0),
    "mix": (0.0, 1.0),
    "gradient": (-1.0, math.inf),
    "tilt": (-math.pi, math.pi),
    "angle": (-math.pi, math.pi),
    **dict.fromkeys(
        (
            "decay",
            "layer",
            "until",
            "unbonded",
            "line_energy",
            "zeta",
            "shear_stiffness",
            "layer_stiffness",
            "slack",
            "stretch",
        ),
        (0.0, math.inf),
    ),
    "glued_strain": (-1.0, math.inf),
}
