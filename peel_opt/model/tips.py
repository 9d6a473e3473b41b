"""What is done to the free end of the rod."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from ..base.checks import finite
from .dimension import ANGLE, FORCE, MOMENT, Dimension
from .place import Numbers


@dataclass(frozen=True)
class TipLoad:
    """A force and a moment on the tip; the paper's free end without them.

    Parameters
    ----------
    force : float
        F [N/m], pulling at ``angle`` from the plate: F (-cos angle, sin angle).
    angle : float
        Peel angle phi [rad]: pi/2 pulls straight up, pi back over the glued part.
    moment : float
        M [N], anticlockwise: a lifting one is negative.
    """

    force: float = 0.0
    angle: float = 0.0
    moment: float = 0.0
    parameters: ClassVar[dict[str, Dimension]] = {"force": FORCE, "angle": ANGLE, "moment": MOMENT}

    form: ClassVar[str] = "load"

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", finite("force", self.force, "N/m"))
        object.__setattr__(self, "angle", finite("angle", self.angle, "rad"))
        object.__setattr__(self, "moment", finite("moment", self.moment, "N"))

    def numbers(self) -> dict[str, float]:
        """Return force, angle and moment."""
        return {"force": self.force, "angle": self.angle, "moment": self.moment}

    @property
    def keeps_flat(self) -> bool:
        """Whether a flat rod stays one: pulled in line, without a moment."""
        return self.force == 0.0 or self.angle == 0.0

    def pull(self, q: Numbers) -> tuple[Any, Any]:
        """Return the force (x, y) over T0 eta."""
        return -q["force"] * ca.cos(q["angle"]), q["force"] * ca.sin(q["angle"])

    def work(self, theta_tip: Any, q: Numbers) -> Any:
        """Return its term in the identity, F (cos(theta + phi) - cos phi)."""
        phi, half = q["angle"], 0.5 * theta_tip
        return -2.0 * q["force"] * ca.sin(half + phi) * ca.sin(half)


@dataclass(frozen=True)
class Contact:
    """The tip rests on the wall without friction: no gap, no moment, an unknown reaction along its normal."""

    form: ClassVar[str] = "contact"
    parameters: ClassVar[dict[str, Dimension]] = {}

    def numbers(self) -> dict[str, float]:
        """Return no parameters."""
        return {}


#: The paper's tip.
FREE = TipLoad()
