"""What tells one cohesive law from another: its kinks, and what it gives on every stretch and far out.

A law of a user's own is code, which no file holds.  Its name is not enough to know it by.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from .bond import CohesiveLaw

#: A law is told from others up to so many times its last kink, or 3 y0.
FAR = 1e3

#: Two laws are the same if their samples agree so far: other machines round otherwise.
RELATIVE, ABSOLUTE = 1e-9, 1e-12


def separations(law: CohesiveLaw) -> list[float]:
    """Where a law is sampled."""
    last = max(law.kinks, default=0.0)
    inside = [np.linspace(a, b, 17) for a, b in pairwise((0.0, *law.kinks))]
    # Answers depend on the tail as well, however far out it begins and however slowly it ends.
    far = last + np.geomspace(1e-3, FAR * max(last, 3.0), 61)
    places: list[float] = np.concatenate([np.linspace(0.0, 3.0, 61), *inside, far]).tolist()
    return places


def texts(law: CohesiveLaw) -> list[str]:
    """Return a law as texts that tell it from any other to the last bit."""
    found = [kink.hex() for kink in law.kinks]
    for u in separations(law):
        functions = (law.traction, _drop_at(law, u), law.work)
        found += [_sampled(function, u).hex() for function in functions if function is not None]
    return found


def samples(law: CohesiveLaw) -> tuple[float, ...]:
    """Return a law as numbers that tell it from another up to rounding: its kinks and its drops."""
    return (*law.kinks, *(_sampled(_drop_at(law, u), u) for u in separations(law)))


def agree(law: CohesiveLaw, stored: Sequence[float]) -> bool:
    """Whether a law is the one that `samples` were taken of."""
    own = samples(law)
    return len(own) == len(stored) and bool(
        np.allclose(own, stored, rtol=RELATIVE, atol=ABSOLUTE, equal_nan=True)
    )


def _drop_at(law: CohesiveLaw, u: float) -> Callable[[float], Any]:
    return law.pieces[law.piece_at(u)].drop


def _sampled(function: Callable[[float], Any], u: float) -> float:
    try:
        return float(function(u))
    except Exception:
        # No state may ever get so far out, so that this alone is no reason to refuse a law.
        return math.nan
