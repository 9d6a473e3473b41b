"""Gauss-Legendre nodes on [0, 1] with integration and interpolation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre


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
        x, w = legendre.leggauss(n)
        P = legendre.legvander(x, n)
        analysis = (np.arange(n) + 0.5)[:, None] * (P[:, :n].T * w)
        primitives = np.empty((n, n))
        primitives[:, 0] = 1.0 + x
        primitives[:, 1:] = (P[:, 2:] - P[:, : n - 1]) / (2.0 * np.arange(1, n) + 1.0)
        from_left = 0.5 * primitives @ analysis
        return cls(0.5 * (1.0 + x), 0.5 * w, from_left, 0.5 * w - from_left, analysis)

    def evaluate(self, values: np.ndarray, xi: Any) -> np.ndarray:
        """Interpolate values at the nodes (last axis) to ``xi``."""
        coefficients = np.moveaxis(values @ self.analysis.T, -1, 0)
        return legendre.legval(2.0 * np.asarray(xi, float) - 1.0, coefficients)
