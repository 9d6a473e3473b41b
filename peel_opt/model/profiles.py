"""How a pressure is distributed over the rod: factors of its value at the tip, or of its scale.

Three different scenes hide behind "the pressure falls along the rod": `linear` stretches with the
detached length, `exponential` is fixed to the material, and a function of ``place.x`` to the plate.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from ..base.checks import finite, positive
from ..base.errors import InvalidInput
from .dimension import LENGTH, NUMBER, Dimension, ScenePart, by_numbers
from .place import Numbers, Place


class Distribution(ScenePart, ABC):
    """A factor of the pressure, with its parameters."""

    @property
    def is_uniform_when_flat(self) -> bool:
        """Whether it pushes alike on all of a rod that lies flat, which then is an equilibrium at some p0."""
        return False

    @abstractmethod
    def factor(self, at: Place, q: Numbers) -> Any:
        """Return p over p0."""


@dataclass(frozen=True)
class Linear(Distribution):
    """p = p0 (1 + c s/sbar): it stretches with the detached length."""

    c: float
    parameters: ClassVar[dict[str, Dimension]] = {"gradient": NUMBER}

    form = property(by_numbers)

    def factor(self, at: Place, q: Numbers) -> Any:
        """Return 1 + c s/sbar."""
        return 1.0 + q["gradient"] * at.xi


@dataclass(frozen=True)
class Exponential(Distribution):
    """p = p0 exp(-s/l): it decays from the tip, in the material."""

    length: float
    parameters: ClassVar[dict[str, Dimension]] = {"decay": LENGTH}

    form = property(by_numbers)

    def factor(self, at: Place, q: Numbers) -> Any:
        """Return exp(-s/l)."""
        return ca.exp(-at.s / q["decay"])


@dataclass(frozen=True)
class Mixed(Distribution):
    """p = p0 (1 - c + c sin^2 theta)."""

    c: float
    parameters: ClassVar[dict[str, Dimension]] = {"mix": NUMBER}

    form = property(by_numbers)

    @property
    def is_uniform_when_flat(self) -> bool:
        """It is 1 - c there, and nothing for a stream."""
        return self.c < 1.0

    def factor(self, at: Place, q: Numbers) -> Any:
        """Return 1 - c + c sin^2 theta."""
        return 1.0 - q["mix"] * ca.cos(at.theta) ** 2


@dataclass(frozen=True)
class Jet(Distribution):
    """p = p0 cos^2 theta."""

    @property
    def is_uniform_when_flat(self) -> bool:
        """It is 1 there."""
        return True

    def factor(self, at: Place, q: Numbers) -> Any:
        """Return cos^2 theta."""
        return ca.cos(at.theta) ** 2


@dataclass(frozen=True)
class Height(Distribution):
    """p = p0 (y/h)^2."""

    height: float
    parameters: ClassVar[dict[str, Dimension]] = {"layer": LENGTH}

    form = property(by_numbers)

    def factor(self, at: Place, q: Numbers) -> Any:
        """Return (y/h)^2."""
        return (at.y / q["layer"]) ** 2


@dataclass(frozen=True)
class Given(Distribution):
    """A function of a `Place` of the reader's own."""

    function: Callable[[Place], Any]

    @property
    def form(self) -> Hashable:
        """The function."""
        return self.function

    @property
    def is_uniform_when_flat(self) -> bool:
        """Whether what it says of a flat rod names no place."""
        s, sbar = ca.SX.sym("s"), ca.SX.sym("sbar")
        flat = ca.SX(self.function(Place(s, sbar, 0.0, s - sbar, 0.0, 0.0)))
        return bool(flat.is_constant()) and float(flat) > 0.0

    def factor(self, at: Place, q: Numbers) -> Any:
        """Return what the function says."""
        return self.function(at)


def linear(c: float) -> Distribution:
    """Return p = p0 (1 + c s/sbar), linear along the detached length, which it stretches with.

    Parameters
    ----------
    c : float
        Above -1; p0 is the pressure at the tip, p0 (1 + c) that at the detachment point.
    """
    c = finite("c", c)
    if c <= -1.0:
        raise InvalidInput(f"c must be above -1, or the load sucks, got {c:g}.")
    return Linear(c)


def exponential(length: float) -> Distribution:
    """Return p = p0 exp(-s/l): a pressure that dies out from the tip over a length [m] of the material."""
    return Exponential(positive("length", length, "m"))


def stream() -> Distribution:
    """Return p = p0 sin^2 theta, the normal part of a stream along the plate.

    It vanishes on a rod that lies flat: only a flap that is lifted already feels it.
    """
    return Mixed(1.0)


def mixed(c: float) -> Distribution:
    """Return p = p0 (1 - c + c sin^2 theta), between a uniform pressure (0) and a stream (1)."""
    c = finite("c", c)
    if not 0.0 <= c <= 1.0:
        raise InvalidInput(f"c must lie between 0 and 1, got {c:g}.")
    return Mixed(c)


def jet() -> Distribution:
    """Return p = p0 cos^2 theta, a pressure that weakens as the rod turns out of it."""
    return Jet()


def height(h: float) -> Distribution:
    """Return p = p0 (y/h)^2, the dynamic pressure of a shear layer of height h [m]."""
    return Height(positive("h", h, "m"))


def as_profile(profile: object) -> Distribution | None:
    """Return a profile, one made of a function of a `Place`, or None."""
    if profile is None or isinstance(profile, Distribution):
        return profile
    if callable(profile):
        return Given(_checked(profile))
    raise InvalidInput(
        f"profile must be one of peel_opt.profiles or a function of a place, got {profile!r:.60}.",
        remedy="Try po.profiles.linear(0.1), or lambda place: 1 + 0.1 * place.xi.",
    )


def _checked(function: Callable[[Place], Any]) -> Callable[[Place], Any]:
    """Return a function of a place if CasADi can take it, or say what is wrong with it."""
    symbols = Place(*(ca.SX.sym(name) for name in ("s", "sbar", "theta", "x", "y", "slip")))
    numbers = Place(0.5, 1.0, -0.1, -0.5, 0.05, 0.0)
    try:
        expression, value = function(symbols), function(numbers)
        is_number = isinstance(expression, ca.SX | int | float) and math.isfinite(float(value))
    except Exception as error:
        raise InvalidInput(
            f"the profile cannot be evaluated: {error!r:.120}.",
            remedy="It is called with CasADi expressions: write casadi.exp, casadi.if_else and the like.",
        ) from error
    if not is_number:
        raise InvalidInput(f"a profile must return one finite number, got {expression!r:.60}.")
    return function
