"""Gauss-Legendre nodes on [0, 1] with integration and interpolation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre


@lru_cache(maxsize=64)
def gauss(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes and weights on [0, 1]."""
    t, w = legendre.leggauss(n)
    return 0.5 * (1.0 + t), 0.5 * w


def _to_series(n: int) -> np.ndarray:
    """Matrix from values at Gauss nodes to Legendre coefficients."""
    t, w = legendre.leggauss(n)
    # Discrete orthogonality of the Legendre polynomials at Gauss nodes: no inverse needed.
    return np.asarray((np.arange(n) + 0.5)[:, None] * (legendre.legvander(t, n - 1).T * w))


def integration_matrix(n: int, xi: Any) -> np.ndarray:
    """Matrix from values at ``n`` Gauss nodes to their integral from 0 to each ``xi``."""
    x = 2.0 * np.asarray(xi, float) - 1.0
    P = legendre.legvander(x, n)
    primitives = np.empty((len(x), n))
    primitives[:, 0] = 1.0 + x
    primitives[:, 1:] = (P[:, 2:] - P[:, : n - 1]) / (2.0 * np.arange(1, n) + 1.0)
    matrix: np.ndarray = 0.5 * primitives @ _to_series(n)
    return matrix


def values_matrix(n: int, xi: Any) -> np.ndarray:
    """Matrix from values at ``n`` Gauss nodes to those of their polynomial at each ``xi``."""
    matrix: np.ndarray = legendre.legvander(2.0 * np.asarray(xi, float) - 1.0, n - 1) @ _to_series(n)
    return matrix


@dataclass(frozen=True, eq=False)
class Grid:
    """Gauss-Legendre nodes on [0, 1] with the matrices that integrate the interpolant.

    Parameters
    ----------
    xi : nodes
    weights : integral over [0, 1]
    from_left : integral from 0 to each node
    to_right : integral from each node to 1
    analysis : values at the nodes to Legendre coefficients
    """

    xi: np.ndarray
    weights: np.ndarray
    from_left: np.ndarray
    to_right: np.ndarray
    analysis: np.ndarray

    @classmethod
    @lru_cache(maxsize=8)
    def gauss(cls, n: int) -> Grid:
        """Return the grid of ``n`` nodes; polynomials below degree n are integrated exactly."""
        xi, weights = gauss(n)
        from_left = integration_matrix(n, xi)
        return cls(xi, weights, from_left, weights - from_left, _to_series(n))

    def evaluate(self, values: np.ndarray, xi: Any) -> np.ndarray:
        """Interpolate values at the nodes (last axis) to ``xi``."""
        coefficients = np.moveaxis(values @ self.analysis.T, -1, 0)
        return np.asarray(legendre.legval(2.0 * np.asarray(xi, float) - 1.0, coefficients))
