"""What is done to the end of the rod that is not glued."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from typing import Any, ClassVar

import casadi as ca

from ..base.checks import finite, non_negative, turned
from ..base.errors import InvalidInput
from .dimension import ANGLE, FORCE, LENGTH, MOMENT, Dimension, ScenePart, by_numbers
from .place import Numbers, Place


def across(angle: float) -> float:
    """Return the share of a force that is across the plate: its sine, and none at pi, which is rounded."""
    sine = math.sin(angle)
    return sine if abs(sine) > 4.0 * sys.float_info.epsilon else 0.0


@dataclass(frozen=True)
class TipLoad(ScenePart):
    """A force and a moment on the tip.

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

    form = property(by_numbers)
    reactions: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", finite("force", self.force, "N/m"))
        object.__setattr__(self, "angle", turned("angle", self.angle))
        object.__setattr__(self, "moment", finite("moment", self.moment, "N"))

    @property
    def keeps_flat(self) -> bool:
        """Whether a flat rod stays one: pulled in line, without a moment."""
        return self.force == 0.0 or not across(self.angle)

    def pull(self, q: Numbers) -> tuple[Any, Any]:
        """Return the force (x, y) over T0 eta."""
        return -q["force"] * ca.cos(q["angle"]), q["force"] * ca.sin(q["angle"])

    def work(self, theta_tip: Any, q: Numbers) -> Any:
        """Return its term in the identity, F (cos(theta + phi) - cos phi)."""
        phi, half = q["angle"], 0.5 * theta_tip
        return -2.0 * q["force"] * ca.sin(half + phi) * ca.sin(half)


@dataclass(frozen=True)
class Free(TipLoad):
    """The paper's free end: a tip without a load, and without numbers that could be one."""

    force: float = field(default=0.0, init=False, repr=False)
    angle: float = field(default=0.0, init=False, repr=False)
    moment: float = field(default=0.0, init=False, repr=False)
    parameters: ClassVar[dict[str, Dimension]] = {}


@dataclass(frozen=True)
class Contact(ScenePart):
    """The tip rests on the wall without friction: no gap, no moment, an unknown reaction along its normal.

    So lies a strip that curls into its wall.
    """

    reactions: ClassVar[tuple[str, ...]] = ("reaction",)

    def work(self, tip: Place, normal: tuple[Any, Any], q: Numbers) -> Any:
        """Return its term in the identity, -F sin(theta - psi), where psi is the angle of the wall."""
        nx, ny = normal
        return -q["reaction"] * (ca.sin(tip.theta) * ny + ca.cos(tip.theta) * nx)


@dataclass(frozen=True)
class Middle(ScenePart):
    """The middle of a symmetric strip: no inclination, no shear force, an axial force.

    Parameters
    ----------
    roller : float, optional
        The axial force N_x [N/m] there, compression positive, of a strip whose ends may slide in.
    slack : float, optional
        Length d [m] that the half strip has more than the wall under it; N_x follows.
    """

    roller: float | None = None
    slack: float | None = None

    def __post_init__(self) -> None:
        if (self.roller is None) == (self.slack is None):
            raise InvalidInput(
                "the middle of a strip takes one of roller= and slack=.",
                remedy="A strip that cannot stretch and has neither stays flat for ever, at any pressure.",
            )
        if self.roller is not None:
            object.__setattr__(self, "roller", finite("roller", self.roller, "N/m"))
        if self.slack is not None:
            object.__setattr__(self, "slack", non_negative("slack", self.slack, "m"))

    form = property(by_numbers)

    @property
    def reactions(self) -> tuple[str, ...]:
        """The axial force, where the slack is given."""
        return () if self.slack is None else ("thrust",)

    @property
    def parameters(self) -> dict[str, Dimension]:  # type: ignore[override]
        """What its number measures."""
        return {"roller": FORCE} if self.slack is None else {"slack": LENGTH}

    def numbers(self) -> dict[str, float]:
        """Return the axial force or the slack."""
        return {name: getattr(self, name) for name in self.parameters}


#: Whatever a rod may have where it is not glued.
Tip = TipLoad | Contact | Middle

#: The paper's tip.
FREE = Free()
