"""A place on the detached rod, where a load acts and the bond pulls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

#: The numbers of a scene by name, over their units of T0 and eta; floats or CasADi symbols.
#: "pressure" is p/T0 and "ratio" eta/y0.
Numbers = Mapping[str, Any]


@dataclass(frozen=True)
class Place:
    """A place on the rod: lengths in units of eta, angles in rad; floats, arrays or CasADi expressions.

    Parameters
    ----------
    s : arc length from the tip
    sbar : detached length
    theta : inclination; negative where the rod rises towards its tip
    x, y : position from the detachment point, x < 0 towards the tip
    slip : x - s + sbar, how far the material has moved along a flat wall since it was glued
    past : names of the material points, such as the end of an unbonded edge, that lie nearer to the tip
    strain : elongation of a rod that stretches; s counts its length before
    """

    s: Any
    sbar: Any
    theta: Any
    x: Any
    y: Any
    slip: Any
    past: frozenset[str] = frozenset()
    strain: Any = 0.0

    @property
    def xi(self) -> Any:
        """s/sbar, from 0 at the tip to 1."""
        return self.s / self.sbar
