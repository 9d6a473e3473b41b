"""What the bond holds at the nodes of a rod, and what it remembers of how far each has been open.

Under damage a point that has been open to m is held, below m, along the straight line from (m, tau(m)) to
the origin, and what lies between that line and the law is lost: D(m) = Phi(m) - tau(m) m / 2.  Without
rebond it is held as ever until it has been fully open, and not at all after that.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..model.bond import CohesiveLaw
from .tractions import Held, Traction


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

    def held(self, y: np.ndarray) -> Held:
        """Traction, its derivative by y and the work of separation of a bond that was never open."""
        u = y * self.ratio
        traction, slope, work = self._pieces[0](u)
        for kink, piece in zip(self.law.kinks, self._pieces[1:], strict=True):
            above = u > kink
            if above.any():
                beyond = piece(np.maximum(u, kink))
                traction, slope, work = (
                    np.where(above, b, a) for a, b in zip((traction, slope, work), beyond, strict=True)
                )
        return Held(traction, slope * self.ratio, work / self.ratio)

    def holding(self, y: np.ndarray, open_to: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the traction and its derivative by y, at nodes that have been open to ``open_to``."""
        traction, slope, _ = self.held(y)
        if self.bond == "damage":
            back = y < open_to
            secant = self.held(open_to).traction / np.where(back, open_to, 1.0)
            return np.where(back, secant * y, traction), np.where(back, secant, slope)
        if self.bond == "no_rebond":
            intact = open_to < self.range
            return traction * intact, slope * intact
        return traction, slope

    def stored(self, y: np.ndarray, open_to: np.ndarray) -> np.ndarray:
        """Energy per area that the bond gives back on the way down."""
        work = self.held(y).work
        if self.bond == "damage":
            back = y < open_to
            top = np.maximum(y, open_to)
            traction = self.held(top).traction
            safe = np.where(top > 0.0, top, 1.0)
            return np.where(back, 0.5 * traction * y * y / safe, 0.5 * traction * top)
        if self.bond == "no_rebond":
            return np.where(open_to < self.range, work, 0.0)
        return work

    def lost(self, open_to: np.ndarray) -> np.ndarray:
        """Energy per area that damage has taken."""
        if self.bond == "damage":
            traction, _, work = self.held(open_to)
            return work - 0.5 * traction * open_to
        if self.bond == "no_rebond":
            gone = self.held(np.full(1, self.range)).work if np.isfinite(self.range) else np.zeros(1)
            return np.where(open_to < self.range, 0.0, gone)
        return np.zeros_like(open_to)
