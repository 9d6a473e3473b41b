"""The shape of a solution, sampled densely in the paper's scaled variables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, singledispatch

import numpy as np
from numpy.polynomial import chebyshev as cheb

from ..base.arrays import Columns
from ..model.bond import CohesiveLaw
from .discretisation import Discretisation, chebyshev

#: Points per phase: a plot sees no corners, a spline through them no error above 1e-6.
DENSE_POINTS = 101

#: Segments of the pieces that a polyline is cut into where it is asked whether it crosses itself.
PIECE = 10

#: Points per phase from which x is integrated.
QUADRATURE_POINTS = 65


@dataclass(frozen=True, eq=False, repr=False)
class Shape(Columns):
    """Fields of (12) along 0 <= xi <= 1, from the free tip to the detachment point.

    All arrays have shape (n,).  Lengths are in units of sbar, forces in k/sbar^2, and the
    origin of x is the detachment point.
    """

    xi: np.ndarray
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    curvature: np.ndarray
    Nx: np.ndarray
    Ny: np.ndarray

    def crosses_itself(self) -> bool:
        """Whether the detached part, a polyline here, intersects itself."""
        if np.ptp(self.theta) <= np.pi:
            return False  # it takes more than half a turn
        p = np.stack([self.x, self.y], axis=-1)
        # Only pieces whose boxes meet, with more than half a turn from one to the other, need a look.
        first = np.arange(0, len(p) - 1, PIECE)
        ends = np.minimum(first + PIECE, len(p) - 1)
        low, high = (
            extreme(extreme.reduceat(p[:-1], first), p[ends]) for extreme in (np.minimum, np.maximum)
        )
        turn = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.theta)))])
        meet = np.all((low[:, None] <= high[None]) & (low[None] <= high[:, None]), axis=2)
        meet &= turn[ends][None] - turn[first][:, None] > np.pi
        inside = np.arange(PIECE)
        for i, j in zip(*np.nonzero(np.triu(meet)), strict=True):
            a, b = (first[k] + inside[: ends[k] - first[k]] for k in (i, j))
            if _cross(p, a, b):
                return True
        return False


def _cross(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> bool:
    """Whether segments of a polyline, by their first points, meet others that are no neighbours of theirs."""
    d, e = (p[k + 1] - p[k] for k in (a, b))
    offset = p[b][None, :, :] - p[a][:, None, :]
    cross = d[:, None, 0] * e[None, :, 1] - d[:, None, 1] * e[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (offset[..., 0] * e[None, :, 1] - offset[..., 1] * e[None, :, 0]) / cross
        u = (offset[..., 0] * d[:, None, 1] - offset[..., 1] * d[:, None, 0]) / cross
    hit = (t > 0) & (t < 1) & (u > 0) & (u < 1)
    return bool(np.any(hit & (np.abs(np.subtract.outer(a, b)) > 1)))


@dataclass(frozen=True, eq=False)
class Solution:
    """A discrete solution: what shape, stability and energies are computed from when asked for."""

    problem: Discretisation
    x: np.ndarray
    law: CohesiveLaw

    def shape(self) -> Shape:
        """Sample it densely."""
        return sample_shape(self.problem, self.x)


@lru_cache(maxsize=1)
def _integrals() -> np.ndarray:
    """Matrix from values at the quadrature points of a phase of length 1 to integrals up to dense ones."""
    nodes, _ = chebyshev(QUADRATURE_POINTS)
    series = cheb.chebfit(2.0 * nodes - 1.0, np.eye(QUADRATURE_POINTS), QUADRATURE_POINTS - 1)
    dense = np.linspace(-1.0, 1.0, DENSE_POINTS)
    integrals: np.ndarray = 0.5 * cheb.chebval(dense, cheb.chebint(series, lbnd=-1)).T
    return integrals


@singledispatch
def sample_shape(problem: Discretisation, unknowns: np.ndarray) -> Shape:
    """Sample a solution at ``DENSE_POINTS`` points per phase, kinks included once."""
    problem, unknowns = problem.without_points(unknowns)
    dense = np.linspace(0.0, 1.0, DENSE_POINTS)
    nodes, _ = chebyshev(QUADRATURE_POINTS)
    both = np.concatenate([dense, nodes])
    A, lengths = problem.scalars(unknowns).A, problem.lengths(unknowns)
    values = A * problem.sampler(both)(unknowns)[0].reshape(len(lengths), len(both), 5)
    starts = np.cumsum(lengths) - lengths
    # x within each phase, and up to its end.
    x = lengths[:, None] * (np.cos(values[:, DENSE_POINTS:, 0]) @ _integrals().T)
    ends = np.cumsum(x[:, -1])
    kept = np.ones(x.shape, dtype=bool)
    kept[1:, 0] = False
    theta, curvature, Nx, Ny, y = np.ascontiguousarray(values[:, :DENSE_POINTS][kept].T)
    xi, x = starts[:, None] + lengths[:, None] * dense, x + (ends - x[:, -1])[:, None]
    # theta(1) = y(1) = x(1) = 0 are conditions, not results.
    return Shape(xi[kept], x[kept] - ends[-1], y, theta, curvature, Nx, Ny)
