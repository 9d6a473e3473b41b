"""The uniform series as a curve lambda(alpha1, beta0) with slopes, and its shapes as unknowns.

The series sums Theta'' at Gauss nodes, which are the unknowns of the spectral form with as
many nodes: shape and certificate are read from it like those of any other answer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import EPS
from ..base.quadrature import Grid
from .hierarchy import NODES, Modes
from .series import UniformSeries, uniform_series

#: Degrees beyond the order, computed to know what was cut off.
GUARD = 3

#: Stands for an alpha or alpha1 of zero, so that a term can be divided by it.
TINY = 1e-30


class Value(NamedTuple):
    """Lambda at (alpha1, beta0) and its derivatives."""

    lam: float
    by_alpha1: float
    by_beta0: float


@dataclass(frozen=True, eq=False)
class _Terms:
    """All terms c (beta0 + alpha1)^p alpha1^q of lambda, degree by degree.

    Parameters
    ----------
    coefficients, p, q : ndarray
    weights : ndarray, shape (3, summed)
        1, p and q: from terms to the sum and its two derivatives.
    starts : ndarray
        First term of every degree.
    summed : int
        Terms up to the order; those of the guard degrees follow.
    """

    coefficients: np.ndarray
    p: np.ndarray
    q: np.ndarray
    weights: np.ndarray
    starts: np.ndarray
    summed: int

    @classmethod
    def of(cls, modes: Modes, order: int) -> _Terms:
        """Sort the coefficients of an order and its guard degrees."""
        j, k = (index[1:] for index in np.tril_indices(order + GUARD + 1))
        p, q = j - k, j + k
        starts = np.cumsum([0, *range(2, order + GUARD + 1)])
        summed = int(starts[order])
        weights = np.stack([np.ones(summed), p[:summed], q[:summed]])
        return cls(modes.lam[j, k], p, q, weights, starts, summed)

    @np.errstate(under="ignore")  # close to T high powers vanish, and should
    def terms(self, alpha: float, alpha1: float) -> np.ndarray:
        """Evaluate all terms."""
        degree = len(self.starts)
        terms: np.ndarray = (
            self.coefficients * _powers(alpha, degree)[self.p] * _powers(alpha1, 2 * degree)[self.q]
        )
        return terms


def _powers(x: Any, highest: int) -> np.ndarray:
    """x^0 ... x^highest along a first axis."""
    powers = np.empty((highest + 1, *getattr(x, "shape", ())))
    powers[:] = x
    powers[0] = 1.0
    return np.multiply.accumulate(powers)


@dataclass(frozen=True, eq=False)
class SeriesCurve:
    """The series of one order as a function to solve with."""

    series: UniformSeries

    @cached_property
    def _shapes(self) -> tuple[np.ndarray, ...]:
        """Powers of alpha and alpha1, and of every mode T(0) and T'' at the nodes."""
        grid = Grid.gauss(NODES)
        j, k = np.tril_indices(self.series.order + 1)
        curls = self.series.modes.T2[j, k]
        return j - k, j + k, curls @ (grid.weights * grid.xi), curls  # as T(1) = T'(1) = 0

    @cached_property
    def _table(self) -> _Terms:
        return _Terms.of(self.series.modes, self.series.order)

    def __call__(self, alpha1: float, beta0: float) -> Value:
        """Sum lambda and its derivatives."""
        table = self._table
        # Each term knows its powers: division by the base takes one off.
        alpha, shift = (beta0 + alpha1) or TINY, alpha1 or TINY
        terms = table.terms(alpha, shift)[: table.summed]
        lam, by_alpha, by_shift = (table.weights @ terms).tolist()
        return Value(lam, by_shift / shift + by_alpha / alpha, by_alpha / alpha)

    def error(self, alpha1: float, beta0: float) -> float:
        """Error of lambda; infinite where the series does not converge.

        The rule is that of `UniformSeries.truncation_error`, here also at beta0 = 0.
        """
        table = self._table
        terms = table.terms((beta0 + alpha1) or TINY, alpha1 or TINY)
        size = np.abs(np.add.reduceat(terms, table.starts))
        last, left_out = float(size[-2 * GUARD : -GUARD].sum()), float(size[-GUARD:].sum())
        rounding = 64.0 * EPS * float(np.abs(terms).sum())
        if left_out <= rounding:
            return 2.0 * left_out + rounding
        return 2.0 * left_out / (1.0 - left_out / last) + rounding if left_out < last else math.inf

    def unknowns(self, alpha1: float, sigma: float, lam: float) -> np.ndarray:
        """Theta'' at the nodes and the four scalars of a point of the curve."""
        curl, m = self._shape(alpha1, sigma)
        return np.concatenate([m * curl, [alpha1 / m, m, sigma, lam]])

    def unknowns_of(self, alpha1: np.ndarray, sigma: float) -> np.ndarray:
        """`unknowns` of many points at one beta0, shape (points, NODES + 4)."""
        curl, m = self._shape(alpha1, sigma)
        lam = self.series.curve(alpha1, sigma**3)
        return np.column_stack([m[:, None] * curl, alpha1 / m, m, np.full_like(m, sigma), lam])

    @np.errstate(under="ignore")
    def _shape(self, alpha1: Any, sigma: float) -> tuple[Any, Any]:
        """Theta'' over m at the nodes, and m."""
        p, q, tips, curls = self._shapes
        order = self.series.order
        weights = (_powers(sigma**3 + alpha1, order)[p] * _powers(alpha1, 2 * order)[q]).T
        # theta(0) = alpha1 T(0) = -A, so that m = alpha1/A = -1/T(0).
        return weights @ curls, -1.0 / (weights @ tips)


@lru_cache(maxsize=4)
def curve(order: int) -> SeriesCurve:
    """Return the series of this order, computed once."""
    return SeriesCurve(uniform_series(order))
