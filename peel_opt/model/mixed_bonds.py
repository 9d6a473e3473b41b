"""Bonds that resist sliding as well as opening, each from one potential.

u is the slip of the material along a flat wall, g the gap, both over y0; Phi(g, u) is the work of
separation over T0 y0, and the tractions are its derivatives.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any, ClassVar

from ..base.checks import non_negative, positive
from ..base.errors import InvalidInput
from .bond import COHESIVE, LINEAR, CohesiveLaw, Piece
from .dimension import NUMBER, SPRING, Dimension, ScenePart, by_numbers
from .place import Numbers


class Bond(ScenePart, ABC):
    """What holds the rod to its wall.

    A bond visits the pieces of ``law`` one after the other, as its `opening` passes their kinks.
    """

    law: CohesiveLaw
    slips: ClassVar[bool] = True

    @property
    def name(self) -> str:
        """What a result calls its law."""
        return self.law.name

    @property
    def holds_to(self) -> float:
        """Largest opening the bond is meant for."""
        return self.law.holds_to

    def opening(self, g: Any, u: Any, q: Numbers) -> Any:
        """Return what decides on the piece of the law; for most the gap alone."""
        return g

    @abstractmethod
    def tractions(self, piece: Piece, g: Any, u: Any, q: Numbers) -> tuple[Any, Any]:
        """Return 1 less the normal traction, and the shear traction, over T0, on a piece of the law."""

    @abstractmethod
    def potential(self, g: float, u: float, q: Numbers) -> float:
        """Return the work of separation over T0 y0."""


@dataclass(frozen=True)
class Opening(Bond):
    """A vertical bond: any `CohesiveLaw` in the gap alone."""

    law: CohesiveLaw
    slips: ClassVar[bool] = False

    def tractions(self, piece: Piece, g: Any, u: Any, q: Numbers) -> tuple[Any, Any]:
        """Return the drop, and no shear."""
        return piece.drop(g), 0.0

    def potential(self, g: float, u: float, q: Numbers) -> float:
        """Return the work of separation of the law."""
        return self.law.separation_work(g)


@dataclass(frozen=True)
class LineBond(Bond):
    """No cohesive zone: the rod is held by the line energy of its front alone."""

    slips: ClassVar[bool] = False
    name: ClassVar[str] = "none"
    holds_to: ClassVar[float] = math.inf

    @property
    def law(self) -> CohesiveLaw:  # type: ignore[override]
        """A law without kinks, whose one stretch is all of the rod."""
        return LINEAR

    def tractions(self, piece: Piece, g: Any, u: Any, q: Numbers) -> tuple[Any, Any]:
        """Return what it has lost, all of it."""
        return 1.0, 0.0

    def potential(self, g: float, u: float, q: Numbers) -> float:
        """Return zero."""
        return 0.0


#: The bond that is a line.
LINE = LineBond()


#: Gap over y0 below which a displacement has no direction: that close to the front the slip is a ten
#: millionth of it, and both are what rounding and the tolerance of a solver have left.
LEAST_GAP = 1e-8


@dataclass(frozen=True)
class EffectiveOpening(Bond):
    """Traction along the displacement, of a size that follows from sqrt(gap^2 + zeta^2 slip^2).

    Parameters
    ----------
    zeta : float
        zeta^2 is the ratio of shear to normal traction at equal slip and gap.
    law : CohesiveLaw
        The law in that effective opening; law (8) by default.
    """

    zeta: float
    law: CohesiveLaw = field(default=COHESIVE)
    parameters: ClassVar[dict[str, Dimension]] = {"zeta": NUMBER}

    def __post_init__(self) -> None:
        object.__setattr__(self, "zeta", non_negative("zeta", self.zeta))
        _require_law(self.law)

    @property
    def form(self) -> Hashable:
        """The law and its numbers by name."""
        return *by_numbers(self), self.law

    def opening(self, g: Any, u: Any, q: Numbers) -> Any:
        """Return the effective opening over y0."""
        return (g**2 + (q["zeta"] * u) ** 2) ** 0.5

    def tractions(self, piece: Piece, g: Any, u: Any, q: Numbers) -> tuple[Any, Any]:
        """Return the two components of tau(delta) along the displacement."""
        # u falls off faster than g towards the front, where both vanish and rounding would choose the
        # direction.  Smooth through g = 0, which walks may pass: states under the wall are spurious.
        slope = u * g / (g**2 + LEAST_GAP**2)
        z2 = q["zeta"] ** 2
        along = (1.0 + z2 * slope**2) ** -0.5
        tau = 1.0 - piece.drop(self.opening(g, u, q))
        return 1.0 - tau * along, tau * along * z2 * slope

    def potential(self, g: float, u: float, q: Numbers) -> float:
        """Return the work of separation at the effective opening."""
        return self.law.separation_work(float(self.opening(g, u, q)))


@dataclass(frozen=True)
class ShearSprings(Bond):
    """Law (8) in the gap with springs against sliding.

    Parameters
    ----------
    stiffness : float
        Kt [Pa/m].
    softening : bool
        The springs soften with the gap and are gone at y0.  Without it they stay as they are, and the
        bond is one only up to y0: states that open wider are flagged.
    """

    stiffness: float
    softening: bool = True
    parameters: ClassVar[dict[str, Dimension]] = {"shear_stiffness": SPRING}

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", positive("stiffness", self.stiffness, "Pa/m"))

    @property
    def law(self) -> CohesiveLaw:  # type: ignore[override]
        """Law (8)."""
        return COHESIVE

    @property
    def holds_to(self) -> float:
        """Springs that do not soften are no bond beyond y0."""
        return self.law.holds_to if self.softening else 1.0

    @property
    def form(self) -> Hashable:
        """Whether the springs soften."""
        return type(self), self.softening

    def tractions(self, piece: Piece, g: Any, u: Any, q: Numbers) -> tuple[Any, Any]:
        """Return the derivatives of Phi = Phi_n(g) + Kt u^2 (1 - g)^2 / 2, with Kt y0/T0."""
        Kt = q["shear_stiffness"] / q["ratio"]
        if not self.softening:
            return piece.drop(g), Kt * u
        left = 1.0 - g if piece.is_first else 0.0
        return piece.drop(g) + Kt * u**2 * left, Kt * u * left**2

    def potential(self, g: float, u: float, q: Numbers) -> float:
        """Return the work of separation and what the springs hold."""
        Kt = q["shear_stiffness"] / q["ratio"]
        left = (max(1.0 - g, 0.0) if self.softening else 1.0) ** 2
        return float(self.law.separation_work(g) + 0.5 * Kt * u**2 * left)


def _require_law(law: object) -> None:
    if not isinstance(law, CohesiveLaw):
        raise InvalidInput(f"law must be a CohesiveLaw, got {law!r:.60}.")
