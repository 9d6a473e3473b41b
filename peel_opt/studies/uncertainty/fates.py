"""What becomes of the samples that have no answer."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ...base.errors import InvalidInput, NoEquilibrium

#: By name, in words: below the least pressure, or shorter than any detached length, what is lifted closes;
#: from T0 on, or longer than any detached length that a pressure holds, it comes off.
FATES = {
    "re-adhere": "what is lifted closes",
    "break off": "the bond gives way",
    "grow stably": "no edge snaps",
    "make no rod": "an input is not in its range",
}


@dataclass(frozen=True, eq=False)
class Sampled:
    """A number at all samples.

    Parameters
    ----------
    values : ndarray, shape (points,)
        NaN where there is none.
    status : ndarray of str, shape (points,)
    error : float
        The largest of a number.
    fates : ndarray of str, shape (points,)
        One of `FATES` where there is none, empty where that is not known.
    """

    values: np.ndarray
    status: np.ndarray
    error: float
    fates: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype="<U12"))

    def __post_init__(self) -> None:
        if not self.fates.size:
            nothing = np.full(len(self.values), math.nan)
            object.__setattr__(self, "fates", fates_of(self.status, nothing, nothing, known=False))


def fates_of(status: np.ndarray, given: np.ndarray, nearest: np.ndarray, *, known: bool) -> np.ndarray:
    """Return what becomes of samples without an equilibrium, by the nearest given number that has one.

    Parameters
    ----------
    status : ndarray of str, shape (points,)
    given, nearest : ndarray, shape (points,)
        A pressure or a length, and the nearest one that has a state.
    known : bool
        Whether it is the unfolded states of a rod under law (8) that end there.
    """
    fates = np.full(status.shape, "", dtype="<U12")
    fates[status == InvalidInput.status] = "make no rod"
    if known:
        without = status == NoEquilibrium.status
        fates[without & (nearest > given)] = "re-adhere"
        fates[without & (nearest < given)] = "break off"
    return fates
