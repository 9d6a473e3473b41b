"""Loads along the detached rod: force per length, term in the identity, parameters.

Each load says with which density it enters the one identity that holds at every equilibrium on a
flat wall (`identity` in `scene`): the work of separation at the tip is what the loads put in, the
integral of ``work`` along the detached length.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import casadi as ca

from ..base.checks import finite, non_negative, positive, turned
from ..base.errors import InvalidInput
from .dimension import ANGLE, LENGTH, NUMBER, TRACTION, Dimension, ScenePart, by_numbers
from .place import Numbers, Place
from .profiles import Distribution, as_profile


class Force(NamedTuple):
    """Force per length over T0: along the normal e, along the tangent t, and along x and y."""

    normal: Any = 0.0
    tangential: Any = 0.0
    x: Any = 0.0
    y: Any = 0.0


class Load(ScenePart, ABC):
    """A force per length on the detached rod."""

    #: Whether a rod that lies flat stays one at some pressure: what the load has across it is uniform.
    keeps_flat: ClassVar[bool] = False

    #: Whether it acts on each length of a rod that has stretched; a weight goes with the mass.
    on_stretched: ClassVar[bool] = True

    @abstractmethod
    def force(self, at: Place, q: Numbers) -> Force:
        """Return the force per length at a place, in units of T0."""

    @abstractmethod
    def work(self, at: Place, q: Numbers) -> Any:
        """Return the density of its term in the identity, in units of T0."""

    def breaks(self) -> tuple[str, ...]:
        """Names of the parameters that are material points at which the load ends."""
        return ()


@dataclass(frozen=True)
class Pressure(Load):
    """The pressure under the rod; its size is the ``pressure`` of a question.

    Parameters
    ----------
    profile : Distribution or callable, optional
        Its distribution: one of `peel_opt.profiles`, or a function of a `Place`.
    dead : float
        Share of it, 0 to 1, that keeps pointing up as the rod turns; the rest follows the rod.
    until : float, optional
        Arc length from the tip [m] up to which the fluid has come.
    """

    profile: Distribution | Callable[[Place], Any] | None = None
    dead: float = 0.0
    until: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "profile", as_profile(self.profile))
        object.__setattr__(self, "dead", non_negative("dead", self.dead))
        if self.dead > 1.0:
            raise InvalidInput(f"dead must be a share between 0 and 1, got {self.dead:g}.")
        if self.until is not None:
            object.__setattr__(self, "until", positive("until", self.until, "m"))

    @property
    def parameters(self) -> dict[str, Dimension]:  # type: ignore[override]
        """What its parameters measure."""
        own = {"dead": NUMBER} if self.dead else {}
        own |= {"until": LENGTH} if self.until is not None else {}
        return own | (self.profile.parameters if isinstance(self.profile, Distribution) else {})

    @property
    def keeps_flat(self) -> bool:  # type: ignore[override]
        """Whether it is the same everywhere on a rod that lies flat."""
        uniform = not isinstance(self.profile, Distribution) or self.profile.is_uniform_when_flat
        return uniform and self.until is None

    def numbers(self) -> dict[str, float]:
        """Return its parameters."""
        own = {"dead": self.dead} if self.dead else {}
        own |= {"until": self.until} if self.until is not None else {}
        return own | (self.profile.numbers() if isinstance(self.profile, Distribution) else {})

    @property
    def form(self) -> Hashable:
        """Its numbers by name, and the form of its profile."""
        return *by_numbers(self), self.profile.form if isinstance(self.profile, Distribution) else None

    def breaks(self) -> tuple[str, ...]:
        """Return the end of the fluid."""
        return ("until",) if self.until is not None else ()

    def size(self, at: Place, q: Numbers) -> Any:
        """Return p/T0 at a place."""
        if "until" in at.past:
            return 0.0
        factor = self.profile.factor(at, q) if isinstance(self.profile, Distribution) else 1.0
        return q["pressure"] * factor

    def force(self, at: Place, q: Numbers) -> Force:
        """Return p along e, and the dead part of it upwards."""
        p = self.size(at, q)
        if not self.dead:
            return Force(normal=p)
        return Force(normal=p * (1.0 - q["dead"]), y=p * q["dead"])

    def work(self, at: Place, q: Numbers) -> Any:
        """Return -p sin theta, dead or not."""
        return -self.size(at, q) * ca.sin(at.theta)


@dataclass(frozen=True)
class Weight(Load):
    """The weight of the rod.

    Parameters
    ----------
    w : float
        Weight per area [Pa]; negative where it hangs under the plate.
    tilt : float
        Inclination of the plate [rad]: w cos(tilt) pulls down on the plate, w sin(tilt) along +x.
    """

    w: float
    tilt: float = 0.0
    parameters: ClassVar[dict[str, Dimension]] = {"weight": TRACTION, "tilt": ANGLE}
    on_stretched: ClassVar[bool] = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "w", finite("w", self.w, "Pa"))
        object.__setattr__(self, "tilt", turned("tilt", self.tilt))

    @property
    def keeps_flat(self) -> bool:  # type: ignore[override]
        """The flat rod carries it at p = T0 + w."""
        return True

    form = property(by_numbers)

    def force(self, at: Place, q: Numbers) -> Force:
        """Return w down the plumb line."""
        return Force(x=q["weight"] * ca.sin(q["tilt"]), y=-q["weight"] * ca.cos(q["tilt"]))

    def work(self, at: Place, q: Numbers) -> Any:
        """Return the work it does from the attached to the detached place."""
        w, tilt = q["weight"], q["tilt"]
        return w * ca.cos(tilt) * ca.sin(at.theta) + w * ca.sin(tilt) * versine(at.theta)


@dataclass(frozen=True)
class SkinFriction(Load):
    """Friction of a fluid along the face of the rod, from tip to root where positive.

    Parameters
    ----------
    traction : float, optional
        Constant [Pa].
    share : float, optional
        Times the pressure at the tip.
    """

    traction: float | None = None
    share: float | None = None
    keeps_flat: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if (self.traction is None) == (self.share is None):
            raise InvalidInput(
                "skin friction takes one of traction= and share=.",
                remedy="SkinFriction(traction=10.0) or SkinFriction(share=0.1).",
            )
        for name, unit in (("traction", "Pa"), ("share", "")):
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, finite(name, value, unit))

    @property
    def parameters(self) -> dict[str, Dimension]:  # type: ignore[override]
        """Return what its one parameter measures."""
        return {"friction": TRACTION} if self.traction is not None else {"share": NUMBER}

    form = property(by_numbers)

    def numbers(self) -> dict[str, float]:
        """Return its one parameter."""
        return (
            {"friction": self.traction} if self.traction is not None else {"share": float(self.share or 0.0)}
        )

    def size(self, q: Numbers) -> Any:
        """Return the traction over T0."""
        return q["friction"] if self.traction is not None else q["share"] * q["pressure"]

    def force(self, at: Place, q: Numbers) -> Force:
        """Return the traction along the tangent."""
        return Force(tangential=self.size(q))

    def work(self, at: Place, q: Numbers) -> Any:
        """Return what it takes away, tau (1 - cos theta)."""
        return -self.size(q) * versine(at.theta)


@dataclass(frozen=True)
class Drag(Load):
    """A horizontal traction that keeps its direction as the rod turns.

    Parameters
    ----------
    traction : float
        [Pa], along +x where positive.
    """

    traction: float
    parameters: ClassVar[dict[str, Dimension]] = {"drag": TRACTION}
    keeps_flat: ClassVar[bool] = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "traction", finite("traction", self.traction, "Pa"))

    form = property(by_numbers)

    def force(self, at: Place, q: Numbers) -> Force:
        """Return the traction along x."""
        return Force(x=q["drag"])

    def work(self, at: Place, q: Numbers) -> Any:
        """Return the work on the way back, drag (1 - cos theta)."""
        return q["drag"] * versine(at.theta)


def versine(theta: Any) -> Any:
    """Return 1 - cos theta without cancellation."""
    return 2.0 * ca.sin(0.5 * theta) ** 2
