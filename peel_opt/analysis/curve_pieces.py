"""Pieces of a curve y(x) through points and slopes, and what is integrated from them."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial

import numpy as np
from scipy.interpolate import BSpline, PPoly
from scipy.sparse import diags_array, vstack
from scipy.sparse.linalg import spsolve

#: Highest degree of a spline through values and slopes; two less through values alone.
_DEGREE = 7


def spline(x: np.ndarray, y: np.ndarray, slope: np.ndarray) -> PPoly:
    """Return the spline through values, and slopes where they are known, without knots at its ends."""
    known = np.isfinite(slope)
    nodes = np.sort(np.concatenate([x, x[known]]))
    degree = min(_DEGREE if known.any() else _DEGREE - 2, len(nodes) - 1)
    degree -= 1 - degree % 2
    half = (degree + 1) // 2
    knots = np.concatenate([[x[0]] * (degree + 1), nodes[half:-half], [x[-1]] * (degree + 1)])
    rows = BSpline.design_matrix(x, knots, degree)
    if known.any():
        steps = degree / (knots[degree + 1 : -1] - knots[1 : -degree - 1])
        difference = diags_array([-steps, steps], offsets=[0, 1], shape=(len(nodes) - 1, len(nodes)))
        rows = vstack([rows, BSpline.design_matrix(x[known], knots[1:-1], degree - 1) @ difference])
    curve = BSpline(knots, spsolve(rows.tocsc(), np.concatenate([y, slope[known]])), degree)
    ends = np.unique(knots)
    return PPoly([curve(ends[:-1], nu=nu) / factorial(nu) for nu in range(degree, -1, -1)], ends)


def bend(x: np.ndarray, y: np.ndarray, slope: np.ndarray) -> PPoly:
    """Return the last two points joined by two parabolas, which meet where the curve bends.

    Each has the value and the slope of its end.  They meet where the first goes on as it comes from the
    point before: a cubic would swing to both sides of a sudden bend, and turn where nothing turns.
    """
    width, rise = float(x[-1] - x[-2]), float(y[-1] - y[-2])
    left, right = float(slope[-2]), float(slope[-1])
    curvature = float((slope[-2] - slope[-3]) / (x[-2] - x[-3])) if len(x) > 2 else 0.0
    bent = right - left - width * curvature
    share = (left + right - 2.0 * rise / width) / bent if bent else 0.5
    at = width * (share if 0.01 < share < 0.99 else 0.5)
    middle = (2.0 * rise - at * left - (width - at) * right) / width
    first = [0.5 * (middle - left) / at, left, float(y[-2])]
    second = [0.5 * (right - middle) / (width - at), middle, float(y[-2]) + 0.5 * (left + middle) * at]
    return PPoly(np.array([first, second]).T, [x[-2], x[-2] + at, x[-1]])


def joined(pieces: Sequence[PPoly]) -> PPoly:
    """Return pieces that follow each other as one."""
    most = max(len(piece.c) for piece in pieces)
    columns = [np.pad(piece.c, ((most - len(piece.c), 0), (0, 0))) for piece in pieces]
    return PPoly(np.hstack(columns), np.concatenate([pieces[0].x[:1], *(piece.x[1:] for piece in pieces)]))


def moment(curve: PPoly) -> PPoly:
    """Integral of x times a curve, from 0."""
    none = np.zeros((1, curve.c.shape[1]))
    times_x = np.vstack([curve.c, none]) + np.vstack([none, curve.x[:-1] * curve.c])
    integral = PPoly(times_x, curve.x).antiderivative()
    integral.c[-1] -= integral(0.0)
    return integral
