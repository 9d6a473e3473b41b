"""An elastic layer under the rod: the bond gives before it softens, and the attached rod with it.

Law (8) is its limit, at three rates: the shape seen from the tip as 1/K, the length as K^(-1/4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from ..base.checks import positive
from .bond import COHESIVE, CohesiveLaw, Piece
from .dimension import LENGTH, SPRING, TRACTION, Dimension, by_numbers
from .mixed_bonds import Bond
from .place import Numbers


@dataclass(frozen=True)
class ElasticLayer(Bond):
    """A bilinear bond: traction K g up to T0, where the detached length ends, then softening to zero at y0.

    The attached rod is a beam on this foundation, without any load, that decays away from the front;
    pressure and other loads act on the detached length alone.  Answers have two numbers more:
    ``rigid_length``, the detached length under law (8) that theirs stands for, and ``pull_ahead``, the
    largest traction of the layer ahead of the front; above T0 it fails there ("fails ahead" in the flags).

    Parameters
    ----------
    stiffness : float
        K [Pa/m], above T0/y0.
    """

    stiffness: float
    parameters: ClassVar[dict[str, Dimension]] = {"layer_stiffness": SPRING}
    slips: ClassVar[bool] = False
    name: ClassVar[str] = "elastic layer"
    #: What its answers have more, and what that measures.
    readings: ClassVar[dict[str, Dimension]] = {"pull_ahead": TRACTION, "rigid_length": LENGTH}

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", positive("stiffness", self.stiffness, "Pa/m"))

    @property
    def law(self) -> CohesiveLaw:  # type: ignore[override]
        """Law (8), whose kink at y0 it shares."""
        return COHESIVE

    form = property(by_numbers)

    @staticmethod
    def yields_at(q: Numbers) -> Any:
        """Return T0/K, the gap at the front, over y0."""
        return q["ratio"] / q["layer_stiffness"]

    def tractions(self, piece: Piece, g: Any, u: Any, q: Numbers) -> tuple[Any, Any]:
        """Return the drop of the softening branch, which goes from T0 to zero, and no shear."""
        start = self.yields_at(q)
        return (g - start) / (1.0 - start) if piece.is_first else 1.0, 0.0

    def potential(self, g: float, u: float, q: Numbers) -> float:
        """Return the work of separation, that of the elastic stretch included."""
        start = float(self.yields_at(q))
        softened = min(g, 1.0) - start
        return 0.5 * start + softened - 0.5 * softened**2 / (1.0 - start)

    def rigid_length(self, length: float, reaction: float, q: Numbers) -> float:
        """Return the detached length of law (8) that one on the layer stands for, times 1/eta.

        The reaction R of law (8) is a lobe of compression of the width (4k/K)^(1/4) here, and
        sbar = s_p + (4k/K)^(1/4) + (p/R) (k/K)^(1/2) up to terms in K^(-3/4).
        """
        second = float(q["pressure"]) / reaction / math.sqrt(q["layer_stiffness"])
        return float(length + 1.0 / self.decay(q) + second)

    @staticmethod
    def decay(q: Numbers) -> Any:
        """Return (K/4k)^(1/4), at which the attached rod decays, times eta."""
        return (0.25 * q["layer_stiffness"]) ** 0.25
