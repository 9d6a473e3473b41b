"""Walls: the gap between the rod and the wall it was glued to.

The wall passes through the detachment point with the tangent along +x.  Adhesion pulls along the
normal of the *wall* at its nearest point: only so is the moment about a circle's centre conserved.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from ..base.checks import finite
from .dimension import CURVATURE, Dimension, ScenePart, by_numbers
from .place import Numbers, Place


class Wall(ScenePart, ABC):
    """A planar curve that the rod is glued to."""

    @abstractmethod
    def curvature_of(self, q: Numbers) -> Any:
        """Return the curvature at the detachment point, times eta."""

    @abstractmethod
    def gap(self, at: Place, q: Numbers) -> tuple[Any, Any, Any]:
        """Return the gap over eta, and the unit normal (x, y) of the wall, away from it."""


@dataclass(frozen=True)
class Flat(Wall):
    """The paper's plate."""

    def curvature_of(self, q: Numbers) -> Any:
        """Return zero."""
        return 0.0

    def gap(self, at: Place, q: Numbers) -> tuple[Any, Any, Any]:
        """Return y, and the vertical."""
        return at.y, 0.0, 1.0


@dataclass(frozen=True)
class Circle(Wall):
    """A circle through the detachment point.

    Parameters
    ----------
    curvature : float
        [1/m]; negative where the rod sits outside (a cylinder), positive inside (an artery).
    """

    curvature: float
    parameters: ClassVar[dict[str, Dimension]] = {"curvature": CURVATURE}

    def __post_init__(self) -> None:
        object.__setattr__(self, "curvature", finite("curvature", self.curvature, "1/m"))

    form = property(by_numbers)

    def curvature_of(self, q: Numbers) -> Any:
        """Return the curvature times eta."""
        return q["curvature"]

    def gap(self, at: Place, q: Numbers) -> tuple[Any, Any, Any]:
        """Return the distance from the circle, without cancellation as the curvature vanishes.

        With D = (1 - |kw rho|^2)/kw = 2 y - kw (x^2 + y^2), it is D / (1 + |kw rho|), where rho is
        the position from the centre (0, 1/kw).
        """
        kw = q["curvature"]
        excess = 2.0 * at.y - kw * (at.x**2 + at.y**2)
        distance = (1.0 - kw * excess) ** 0.5
        return excess / (1.0 + distance), -kw * at.x / distance, (1.0 - kw * at.y) / distance


#: The paper's wall.
PLATE = Flat()
