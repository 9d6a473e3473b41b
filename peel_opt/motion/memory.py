"""What the bond holds at the nodes of a rod, and what it remembers of how far each has been open.

Under damage a point that has been open to m is held, below m, along the straight line from (m, tau(m)) to
the origin, and what lies between that line and the law is lost: D(m) = Phi(m) - tau(m) m / 2.  Without
rebond it is held as ever until it has been fully open, and not at all after that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..model.bond import CohesiveLaw
from .tractions import Traction


@dataclass(frozen=True)
class Memory:
    """The bond of one rod; heights and tractions over eta and T0.

    Parameters
    ----------
    law : CohesiveLaw
    ratio : float
        eta/y0.
    bond : str
        One of `BONDS`.
    """

    law: CohesiveLaw
    ratio: float
    bond: str = "reversible"

    @cached_property
    def _pieces(self) -> list[Traction]:
        return [Traction(piece) for piece in self.law.pieces]

    @property
    def range(self) -> float:
        """Height from which there is no traction any more; infinite for a law that never lets go."""
        last = self.law.pieces[-1]
        return last.start / self.ratio if last.lets_go else np.inf

    def pull(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Traction, and its derivative by y, of a bond that was never open."""
        traction, slope = self._on_pieces(y, Traction.pull)
        return traction, slope * self.ratio

    def work(self, y: np.ndarray) -> np.ndarray:
        """Work of separation of a bond that was never open, over T0 eta."""
        return self._on_pieces(y, Traction.__call__)[-1] / self.ratio

    def _on_pieces(
        self, y: np.ndarray, read: Callable[[Traction, np.ndarray], tuple[np.ndarray, ...]]
    ) -> tuple[np.ndarray, ...]:
        """Read each height off the piece of the law that it is on."""
        u = y * self.ratio
        values = read(self._pieces[0], u)
        for kink, piece in zip(self.law.kinks, self._pieces[1:], strict=True):
            above = u > kink
            if above.any():
                beyond = read(piece, np.maximum(u, kink))
                values = tuple(np.where(above, b, a) for a, b in zip(values, beyond, strict=True))
        return values

    def holding(self, y: np.ndarray, open_to: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the traction and its derivative by y, at nodes that have been open to ``open_to``."""
        traction, slope = self.pull(y)
        if self.bond == "damage":
            back = y < open_to
            secant = self.pull(open_to)[0] / np.where(back, open_to, 1.0)
            return np.where(back, secant * y, traction), np.where(back, secant, slope)
        if self.bond == "no_rebond":
            intact = open_to < self.range
            return traction * intact, slope * intact
        return traction, slope

    def stored(self, y: np.ndarray, open_to: np.ndarray) -> np.ndarray:
        """Energy per area that the bond gives back on the way down."""
        if self.bond == "damage":
            top = np.maximum(y, open_to)
            triangle: np.ndarray = 0.5 * self.pull(top)[0] * y * y / np.where(top > 0.0, top, 1.0)
            return triangle
        if self.bond == "no_rebond":
            return np.where(open_to < self.range, self.work(y), 0.0)
        return self.work(y)

    def lost(self, open_to: np.ndarray) -> np.ndarray:
        """Energy per area that damage has taken."""
        if self.bond == "damage":
            lost: np.ndarray = self.work(open_to) - 0.5 * self.pull(open_to)[0] * open_to
            return lost
        if self.bond == "no_rebond":
            return np.where(open_to < self.range, 0.0, self.work(np.minimum(open_to, self.range)))
        return np.zeros_like(open_to)
