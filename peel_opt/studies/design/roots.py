"""All designs along one free number that meet its single target: a scan, then brackets.

The scan is as fine near the given rod as it is wide over the bounds, and finer where the target is
nearly met or its state ends, so that two designs that lie close together are both seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from operator import itemgetter

import numpy as np
from scipy.optimize import brentq

from ...model.rod import RATIOS
from .material import Material

#: Designs looked at: over the bounds, and near the start besides.
SCAN, SCAN_NEARBY = 17, 13

#: How far from the start "near" is, as a logarithm.
NEARBY = math.log(10.0)

#: Times the steps beside a target that is nearly met are halved.
MOST_HALVINGS = 8


class _Lost(Exception):
    """The state ended inside a bracket."""


def within(material: Material, first: list[np.ndarray]) -> list[np.ndarray]:
    """Return values of one free number at which the branch can be walked, those in ``first`` before."""
    ends = _walkable(material, float(material.lower[0]), float(material.upper[0]))
    if ends is None:
        return first
    places = set(np.linspace(*ends, SCAN).tolist())
    for start in first:
        near = float(start[0]) + np.linspace(-NEARBY, NEARBY, SCAN_NEARBY)
        places |= {z for z in near.tolist() if ends[0] < z < ends[1]} - {float(start[0])}
    return first + [np.array([z]) for z in sorted(places)]


def _walkable(material: Material, low: float, high: float) -> tuple[float, float] | None:
    """Part of an interval of one logarithm where eta/y0 is in range."""
    constant, (slope,) = material.log_ratio
    if slope:
        a, b = sorted((math.log(r) - constant) / slope for r in RATIOS)
        inside = 1e-9 * (b - a)
        low, high = max(low, a + inside), min(high, b - inside)
    elif not material.in_range(np.array([low])):
        return None
    return (low, high) if low < high else None


def along_one(gap: Callable[[np.ndarray], float | None], places: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return where the gap of a target vanishes along one free number.

    Parameters
    ----------
    gap : callable
        From the logarithm of the number, shape (1,), to that of value over target; None where there
        is no such state.
    places : sequence of ndarray, shape (1,)
    """
    row = sorted(((float(z[0]), gap(z)) for z in places), key=itemgetter(0))
    for _ in range(MOST_HALVINGS):
        gaps = [None, *(g for _, g in row), None]
        finer = [
            0.5 * (row[i][0] + row[i + 1][0])
            for i in range(len(row) - 1)
            if _may_hide(*gaps[i : i + 4])  # the two, and their neighbours
        ]
        row = sorted(row + [(z, gap(np.array([z]))) for z in finer], key=itemgetter(0))

    def inside(z: float) -> float:
        found = gap(np.array([z]))
        if found is None:
            raise _Lost
        return found

    found = []
    for (a, here), (b, there) in pairwise(row):
        if here is not None and there is not None and here * there <= 0.0 and there != 0.0:
            try:
                found.append(np.array([brentq(inside, a, b, xtol=1e-13)]))
            except _Lost:
                continue
    return found


def _may_hide(before: float | None, left: float | None, right: float | None, after: float | None) -> bool:
    """Whether the target may be met between two samples that do not show it.

    That is beside a dip, and where the state comes to an end: at a fold its value turns steeply.
    """
    if left is None or right is None:
        return left is not right
    if left * right <= 0.0:
        return False
    lowest, beyond = (left, before) if abs(left) <= abs(right) else (right, after)
    return beyond is None or (lowest * beyond > 0.0 and abs(beyond) >= abs(lowest))
