"""The uniform series as a curve lambda(alpha1, beta0) with slopes, and its shapes as unknowns.

The series sums Theta'' at Gauss nodes, which are the unknowns of the spectral form with as
many nodes: shape and certificate are read from it like those of any other answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from .gauss import Grid
from .hierarchy import NODES, Modes
from .series import UniformSeries, uniform_series


class Value(NamedTuple):
    """Lambda at (alpha1, beta0) and its derivatives."""

    lam: float
    by_alpha1: float
    by_beta0: float


@dataclass(frozen=True, eq=False)
class Curve:
    """The series of one order as a function to solve with."""

    series: UniformSeries

    @property
    def _modes(self) -> Modes:
        return self.series._modes

    @cached_property
    def _shapes(self) -> tuple[np.ndarray, ...]:
        """Powers of alpha and alpha1, and of every mode T(0) and T'' at the nodes."""
        grid = Grid.gauss(NODES)
        j, k = np.tril_indices(self.series.order + 1)
        curls = self._modes.T2[j, k]
        return j - k, j + k, curls @ (grid.weights * grid.xi), curls  # as T(1) = T'(1) = 0

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients of (beta0 + alpha1)^p alpha1^q and the powers p, q."""
        j, k = (index[1:] for index in np.tril_indices(self.series.order + 1))
        return self._modes.lam[j, k], j - k, j + k

    def __call__(self, alpha1: float, beta0: float) -> Value:
        """Sum lambda and its derivatives."""
        coefficients, p, q = self._table
        n = self.series.order
        alpha = np.power(beta0 + alpha1, np.arange(n + 1))
        shift = np.power(alpha1, np.arange(2 * n + 1))
        by_alpha = coefficients * (p * alpha[p - 1]) * shift[q]  # p = 0 picks a power it then drops
        along = coefficients * alpha[p]
        lam, by_shift = float(along @ shift[q]), float(along @ (q * shift[q - 1]))
        by_beta0 = float(by_alpha.sum())
        return Value(lam, by_shift + by_beta0, by_beta0)

    def error(self, alpha1: float, beta0: float) -> float:
        """Error of lambda; infinite where the series does not converge."""
        return float(self.series._error(np.float64(alpha1), np.float64(beta0))[0])

    def unknowns(self, alpha1: float, sigma: float, lam: float) -> np.ndarray:
        """Theta'' at the nodes and the four scalars of a point of the curve."""
        p, q, tips, curls = self._shapes
        weights = np.power(sigma**3 + alpha1, p) * np.power(alpha1, q)
        curl = weights @ curls
        # theta(0) = alpha1 T(0) = -A, so that m = alpha1/A = -1/T(0).
        m = -1.0 / float(weights @ tips)
        return np.concatenate([m * curl, [alpha1 / m, m, sigma, lam]])


@lru_cache(maxsize=4)
def curve(order: int) -> Curve:
    """Return the series of this order, computed once."""
    return Curve(uniform_series(order))
