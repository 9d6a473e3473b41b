"""Zeros and turning points of functions of one variable, none missed between given points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import brentq

Function = Callable[[Any], Any]

#: Intervals on which extrema of a curve are looked for.
_SCAN = 800


def zeros(function: Function, points: np.ndarray) -> list[float]:
    """Zeros of a function between points at which its sign changes; a zero point ends its step."""
    values = np.asarray(function(points))
    changes = np.flatnonzero((values[:-1] != 0.0) & (values[:-1] * values[1:] <= 0.0))
    return [brentq(function, points[i], points[i + 1], xtol=1e-18, maxiter=200) for i in changes]


def turning_points(slope: Function, domain: tuple[float, float]) -> list[float]:
    """Points inside the domain where a curve with this slope turns, ascending."""
    return zeros(slope, np.linspace(domain[0], domain[1], _SCAN + 1))


def graph_roots(curve: Function, slope: Function, domain: tuple[float, float], level: float) -> np.ndarray:
    """Where a curve through (0, 0) takes the value ``level``, ascending, without the point (0, 0).

    On each monotone piece at most one root is looked for, so that none is missed or counted
    twice near a fold.
    """
    turns = turning_points(slope, domain)
    roots = zeros(lambda x: curve(x) - level, np.array([domain[0], *turns, domain[1]]))
    if level == 0.0:  # the piece that holds the origin has no other root
        roots = [x for x in roots if any(min(x, 0.0) < turn < max(x, 0.0) for turn in turns)]
    return np.array(roots)
