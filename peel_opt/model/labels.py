"""What states, special points and flags are called, and what that means in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..base.errors import InvalidInput

#: The states between the transition T and the minimum pressure.
UNFOLDED = ("middle", "lower")

#: Detached states that a rod on a rigid plate can take, as they are asked for and observed; "unfolded"
#: means either of the two.
OBSERVABLE = ("unfolded", *UNFOLDED, "folded")

#: All that may be asked for.  An answer off the primary branch is "other".
STATES = (*OBSERVABLE, "spurious")


#: Status of an answer that may be used.
CERTIFIED = "certified"


def counted(statuses: np.ndarray, of: str = "") -> str:
    """Return how many of some answers may be used, and why the others may not.

    Examples
    --------
    >>> counted(np.array(["certified", "no-equilibrium"]), " points")
    '1 of 2 points certified, 1 no-equilibrium'
    """
    counts = Counter(statuses.ravel().tolist())
    others = [f"{number} {status}" for status, number in sorted(counts.items()) if status != CERTIFIED]
    return ", ".join([f"{counts[CERTIFIED]} of {statuses.size}{of} {CERTIFIED}", *others])


def fits(label: str, state: str | None) -> bool:
    """Whether a state with a label is one of those that are meant by ``state``; by None is none."""
    return label == state or (state == "unfolded" and label in UNFOLDED)


def known_state(state: str | None, *, among: Sequence[str] = STATES, place: str = "") -> str | None:
    """Return the label a caller asked for.

    Raises
    ------
    InvalidInput
        If it is none of those that may be asked for; ``place`` says where it stands, as in "row 3: ".
    """
    if state is not None and (not isinstance(state, str) or state not in among):
        raise InvalidInput(f"{place}unknown state {state!r}.", remedy=f"Choose one of {', '.join(among)}.")
    return state


class SpecialKind(NamedTuple):
    """A kind of special point: the letter beside its mark in a diagram, and what it is."""

    letter: str
    words: str


#: Kinds of special points.  In the paper T is the transition and F the fold.
SPECIAL_KINDS = {
    "BP": SpecialKind("T", "branch point of the straight rod"),
    "LP-lambda": SpecialKind("F", "fold in lambda"),
    "LP-length": SpecialKind("F", "fold in length"),
    "LP-pressure": SpecialKind("P", "fold in pressure"),
    "LP-ratio": SpecialKind("R", "fold in eta/y0"),
    "y=y0": SpecialKind("Y", "rod reaches or leaves y = y0"),
    "contact": SpecialKind("C", "tip touches the plate"),
    "self-contact": SpecialKind("S", "rod meets itself"),
}


def special_kind(kind: str) -> SpecialKind:
    """Return letter and words of a kind of special point; one that is not listed speaks for itself."""
    return SPECIAL_KINDS.get(kind, SpecialKind("S", kind))


#: What the flags of an equilibrium mean to somebody who looks at its picture.
FLAGS = {
    "y > y0": "y > y0: outside the range of the law",
    "p < 0": "p < 0: the pressure pushes towards the plate",
    "y < 0": "y < 0: the rod passes through the plate",
    "alpha1 > 0": "alpha1 > 0: spurious branch",
    "overhang": "the rod is folded back over itself (|theta| > 90°)",
    "tip on plate": "the tip is held down to the plate",
    "self-contact": "the rod crosses itself: contact is not modelled",
    "edge pulled": "the wall would have to pull at the detachment point",
    "tip pulled": "the wall would have to pull at the tip that rests on it",
    "fails ahead": "the layer is pulled beyond its strength ahead of the front",
}

#: Flags that make a state unphysical under the law it was computed with.
DISQUALIFYING = tuple(flag for flag in FLAGS if flag != "overhang")
