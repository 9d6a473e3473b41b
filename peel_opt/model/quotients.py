"""What a law has lost, over the height: smooth at u = 0, where both vanish.

With the amplitude divided out the equations hold drop(u)/u and its mean, which no 0/0 may spoil:

    drop(u)/u      = integral of drop'(t u) dt over 0 <= t <= 1,
    mean drop(u)/u = integral of (1 - t) drop'(t u) dt.

Near u = 0 they are taken from the right sides, by Gauss quadrature, for any law that is smooth
there; elsewhere from the left.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..base.quadrature import Grid

Shape = Callable[[Any], Any]

#: Height below which the quotients are quadratures, and their nodes: exact to rounding for laws
#: that change over a thousandth of y0.
NEAR, NEAR_NODES = 1e-4, 4

#: Relative difference of the two forms at the height where they meet above which a law does not
#: count as smooth at u = 0.
SMOOTH = 1e-9

#: Octaves of the mean, and nodes in each: a law that changes over a share 1e-5 of the height is
#: integrated to rounding.
OCTAVES, OCTAVE_NODES = 20, 12


@lru_cache(maxsize=128)
def slope(drop: Shape) -> ca.Function:
    """Compiled u -> drop'(u)."""
    u = ca.SX.sym("u")
    return ca.Function("slope", [u], [ca.jacobian(ca.SX(drop(u)), u)])


@lru_cache(maxsize=128)
def is_smooth(drop: Shape) -> bool:
    """Whether drop(u)/u is smooth at u = 0."""
    try:
        direct = float(drop(NEAR)) / NEAR
        near = float(_near(drop, NEAR, np.ones(NEAR_NODES)))
    except (RuntimeError, TypeError, ValueError, ArithmeticError, NotImplementedError):
        return False
    return abs(near - direct) <= SMOOTH * (1.0 + abs(direct))


def over_height(drop: Shape, u: Any) -> Any:
    """drop(u)/u of a law that is smooth at u = 0, there too; also of CasADi expressions."""
    return _joined(u, lambda v: drop(v) / v, lambda v: _near(drop, v, np.ones(NEAR_NODES)))


def mean_over_height(drop: Shape, u: Any) -> Any:
    """Mean of the drop between 0 and u, over u, of a law that is smooth at u = 0."""
    remaining = 1.0 - Grid.gauss(NEAR_NODES).xi
    return _joined(u, lambda v: mean(drop, v) / v, lambda v: _near(drop, v, remaining))


def mean(function: Shape, u: Any, start: float = 0.0) -> Any:
    """Mean of a function between ``start`` and u, octave by octave from the start."""
    grid = Grid.gauss(OCTAVE_NODES)
    edges = np.concatenate([[0.0], 2.0 ** np.arange(-OCTAVES, 1)])
    total = 0.0
    for low, width in zip(edges[:-1], np.diff(edges), strict=True):
        for t, w in zip(low + width * grid.xi, width * grid.weights, strict=True):
            total = total + float(w) * function(start + float(t) * (u - start))
    return total


def _near(drop: Shape, u: Any, weight: np.ndarray) -> Any:
    """Integral of weight(t) drop'(t u) over 0 <= t <= 1."""
    grid, rate = Grid.gauss(NEAR_NODES), slope(drop)
    return sum(float(w) * rate(float(t) * u) for t, w in zip(grid.xi, grid.weights * weight, strict=True))


def _joined(u: Any, away: Shape, near: Shape) -> Any:
    """One expression for all heights, without 0/0 in the branch that is not taken."""
    small = ca.fabs(u) < NEAR
    return ca.if_else(small, near(ca.if_else(small, u, 0.0)), away(ca.if_else(small, 1.0, u)))
