"""Several equilibria of one question, and where they were looked for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from .result import Equilibrium


@dataclass(frozen=True)
class Searched:
    """Where states off the primary branch were looked for; there the search is as fine as its grid.

    Parameters
    ----------
    tip_angles : tuple of float
        From and to [rad].
    pressure_ratios : tuple of float
        p/T0 from and to; the given one twice.
    length_ratios : tuple of float
        sbar/eta from and to; the given one twice.
    """

    tip_angles: tuple[float, float]
    pressure_ratios: tuple[float, float]
    length_ratios: tuple[float, float]


class States(list[Equilibrium]):
    """Equilibria of one question, and where they were looked for.

    Parameters
    ----------
    states : iterable of Equilibrium
    searched : Searched or None
        Bounds of the search off the primary branch; None where only the branch was followed,
        under laws other than the linear one and law (8).
    """

    def __init__(self, states: Iterable[Equilibrium] = (), searched: Searched | None = None) -> None:
        super().__init__(states)
        self.searched = searched
