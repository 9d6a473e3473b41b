"""Stability at fixed pressure, read off the small motions of the detached part.

With inertia replaced by viscous drag the same mu are rates of decay.  Counts of eigenvalues
depend on the inertia assumed; the sign of det K does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..base.errors import InvalidInput
from ..equilibria.branch import Branch
from ..equilibria.result import Equilibrium
from ..residual.motions import Spectrum
from ..residual.shape import Solution


@dataclass(frozen=True, eq=False)
class Stability:
    """Small motions about an equilibrium.

    Parameters
    ----------
    eigenvalues : ndarray of complex
        mu, smallest magnitude first, in units of k/(rho sbar^4): motions exp(i sqrt(mu) t).
    error : float
        Largest relative change of these when the discretisation is refined.
    index : int
        Number of negative real eigenvalues: directions in which the rod just falls away.  One
        within its error of zero does not count: the state is then `marginal`.
    flutter : bool
        Whether a complex pair makes an undamped inextensible rod oscillate with growing amplitude.
    growth : float
        Fastest growth rate under viscous drag alone, -min Re(mu); negative if all decay.
    determinant_sign : int
        Sign of det K, the same for any inertia: -1 if an odd number of real eigenvalues is negative,
        0 if one of them is within its error of zero, as at contact and at a fold in pressure.
    volume_index : int
        The same count as ``index`` when the swept volume is held instead of the pressure; None in a scene
        whose pressure is not uniform or not alone, which holds no volume.
    """

    eigenvalues: np.ndarray
    error: float
    index: int
    flutter: bool
    growth: float
    determinant_sign: int
    volume_index: int | None

    @classmethod
    def read(cls, found: Spectrum) -> Self:
        """Return what the eigenvalues of small motions say."""
        return cls(
            eigenvalues=found.lowest,
            error=found.error,
            index=found.index,
            flutter=found.flutter,
            growth=float(-np.min(found.mu.real)),
            determinant_sign=found.determinant_sign(),
            volume_index=found.volume_index(),
        )

    @property
    def marginal(self) -> bool:
        """Whether an eigenvalue is within its error of zero, so that its sign is not known."""
        return self.determinant_sign == 0

    @property
    def stable(self) -> bool:
        """Whether nothing grows at fixed pressure, with or without drag; not claimed if marginal."""
        return self.index == 0 and not self.flutter and not self.marginal

    def __repr__(self) -> str:
        volume = "" if self.volume_index is None else f" index {self.volume_index} at fixed volume;"
        if self.index or self.flutter:
            word = f"unstable (index {self.index}{', flutter' if self.flutter else ''})"
        else:
            word = "marginal" if self.marginal else "stable"
        return f"Stability({word} at fixed pressure;{volume} error {self.error:.0e})"


def stability(state: Equilibrium | Branch, i: int = -1) -> Stability:
    """Return the stability of an equilibrium, or of point ``i`` of a branch.

    Parameters
    ----------
    state : Equilibrium or Branch
        An equilibrium must carry its discrete solution: one that was just computed, not one
        read from a file.
    i : int

    Returns
    -------
    Stability

    Raises
    ------
    InvalidInput
        If there is no solution to linearise about.

    Examples
    --------
    >>> from peel_opt import Rod, length_given_pressure
    >>> stability(length_given_pressure(Rod.from_ratio(1.0), 0.5)).index
    1
    """
    if isinstance(state, Branch):
        return Stability.read(Spectrum(*state.solution_at(range(len(state))[i])))
    if not isinstance(state, Equilibrium):
        raise InvalidInput(f"a state must be an Equilibrium or a Branch, got {state!r:.60}.")
    return Stability.read(spectrum_of(state))


def spectrum_of(eq: Equilibrium) -> Spectrum:
    """Return the eigenvalues of small motions about an equilibrium.

    Raises
    ------
    InvalidInput
        If it is none, or carries no discrete solution.
    """
    if not isinstance(eq, Equilibrium):
        raise InvalidInput(f"a state must be an Equilibrium, got {eq!r:.60}.")
    if not isinstance(eq.source, Solution):
        raise InvalidInput(
            "this equilibrium carries no discrete solution to linearise about.",
            remedy="Compute it again; files and other processes keep the shape only.",
        )
    return Spectrum(eq.source.problem, eq.source.x, *eq.asked_at)


#: What the paper reads off its effective potential at a given length: minimum or maximum.
PAPER_LABELS = {"lower": "stable (minimum of U_e)", "middle": "unstable (maximum of U_e)"}


def control_table(eq: Equilibrium) -> dict[str, str]:
    """Return who would see a state: a line for each control of an experiment.

    "fixed length" is the paper's reading, by its effective potential and not by the motions
    of the rod; the potential knows the unfolded states only.

    Parameters
    ----------
    eq : Equilibrium
        As for `stability`.

    Returns
    -------
    dict of str
        "stable" or "unstable", and why, by the name of the control; "marginal" where the sign of
        an eigenvalue is not known.

    Raises
    ------
    InvalidInput
        As for `stability`.

    Examples
    --------
    >>> from peel_opt import Rod, length_given_pressure
    >>> table = control_table(length_given_pressure(Rod.from_ratio(1.0), 0.5))
    >>> table["fixed pressure"], table["fixed length (paper)"]
    ('unstable (index 1)', 'stable (minimum of U_e)')
    """
    if not isinstance(eq, Equilibrium):
        raise InvalidInput(f"a state must be an Equilibrium, got {eq!r:.60}.")
    found = stability(eq)
    flutter = ["flutter"] if found.flutter else []

    def word(index: int, otherwise: str = "stable") -> str:
        reasons = ([f"index {index}"] if index else []) + flutter
        return f"unstable ({', '.join(reasons)})" if reasons else otherwise

    doubt = found.error * (1.0 + abs(found.growth))
    return {
        "fixed pressure": word(found.index, "marginal" if found.marginal else "stable"),
        "fixed pressure, heavy drag": (
            "marginal" if abs(found.growth) <= doubt else "unstable" if found.growth > 0.0 else "stable"
        ),
        "fixed swept volume": "not covered" if found.volume_index is None else word(found.volume_index),
        "fixed length (paper)": PAPER_LABELS.get(eq.state, "not covered"),
    }
