"""Zeros and turning points of functions of one variable, none missed between given points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Function = Callable[[Any], Any]

#: Intervals on which extrema of a curve are looked for.
_SCAN = 800

#: Evaluations after which a regula falsi ends: a smooth function takes less than ten.
_MOST_FALSI = 40


def zeros(function: Function, points: np.ndarray) -> list[float]:
    """Zeros of a function between points at which its sign changes; a zero point ends its step."""
    from scipy.optimize import brentq  # which takes long to import

    values = np.asarray(function(points))
    changes = np.flatnonzero((values[:-1] != 0.0) & (values[:-1] * values[1:] <= 0.0))
    return [brentq(function, points[i], points[i + 1], xtol=1e-18, maxiter=200) for i in changes]


def between(
    function: Callable[[float], float], ends: tuple[float, float], values: tuple[float, float], least: float
) -> float:
    """A place between two ends where a function of opposite signs there is as small as ``least``, or nearly.

    Regula falsi, pulled over where one end stays (the Illinois method); a few evaluations where the
    function is smooth, and the ends need not be evaluated again.
    """
    (low, high), (a, b), stayed, where = ends, values, 0, ends[0]
    for _ in range(_MOST_FALSI):
        where = low + (high - low) * a / (a - b) if a != b else 0.5 * (low + high)
        value = function(where)
        if abs(value) <= least:
            break
        if value * a > 0.0:
            low, a, b, stayed = where, value, b * (0.5 if stayed > 0 else 1.0), 1
        else:
            high, b, a, stayed = where, value, a * (0.5 if stayed < 0 else 1.0), -1
    return where


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
