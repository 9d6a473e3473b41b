"""Several equilibria of one question, and where they were looked for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from .result import Equilibrium


@dataclass(frozen=True)
class Searched:
    """Where states off the primary branch were looked for.

    Parameters
    ----------
    pressure_ratios : tuple of float
        p/T0 from and to; the given one twice.
    length_ratios : tuple of float
        sbar/eta from and to; the given one twice.  Given the pressure, all states between them are
        found that have such a reaction and no part lower than 4 y0 (4 y_tip, if that is lower) under
        the plate.  States that are longer may be listed too.
    edge_reactions : tuple of float, optional
        Given the pressure: reactions of the plate at the detachment point, over T0 eta, from and to.
        No rod above the plate with such a length has another.
    tip_angles : tuple of float, optional
        Given the length: from and to [rad].  There the search is as fine as its grid.
    """

    pressure_ratios: tuple[float, float]
    length_ratios: tuple[float, float]
    edge_reactions: tuple[float, float] | None = None
    tip_angles: tuple[float, float] | None = None

    def short_of(self, sigma: float) -> Searched:
        """Return what is left to claim of a scan at a pressure if a state of that length is not listed."""
        if self.edge_reactions is None:
            return self
        return replace(self, length_ratios=(self.length_ratios[0], min(self.length_ratios[1], sigma)))


class States(list[Equilibrium]):
    """Equilibria of one question, and where they were looked for.

    Parameters
    ----------
    states : iterable of Equilibrium
    searched : Searched or None
        Bounds of the search off the primary branch; None where only the branch was followed: at a
        length under laws other than the linear one and law (8).
    """

    def __init__(self, states: Iterable[Equilibrium] = (), searched: Searched | None = None) -> None:
        super().__init__(states)
        self.searched = searched
