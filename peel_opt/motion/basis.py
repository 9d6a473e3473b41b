"""Polynomials for theta between tip, kinks of the bond and front, with what holds at the front built in."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from ..base.quadrature import Grid, integration_matrix
from ..residual.motions import continuous_basis

#: Gauss points of a phase beyond its degree.
MORE = 8


class Looked(NamedTuple):
    """Points of a phase, values and slopes there, and integrals from there to its end."""

    xi: np.ndarray
    value: np.ndarray
    slope: np.ndarray
    to_end: np.ndarray


@dataclass(frozen=True, eq=False)
class Basis:
    """Polynomials in phases of length 1, of a degree in each, and integrals from points to the front."""

    degrees: tuple[int, ...]

    @property
    def count(self) -> int:
        """Number of phases."""
        return len(self.degrees)

    @property
    def degree(self) -> int:
        """The highest, which sets the points of all phases."""
        return max(self.degrees)

    @cached_property
    def grid(self) -> Grid:
        """Points of a phase."""
        return Grid.gauss(self.degree + MORE)

    @cached_property
    def tables(self) -> tuple[np.ndarray, np.ndarray]:
        """Values and slopes at the points of all phases, with theta = theta' = 0 at the front."""
        return self.at(self.grid.xi)

    def at(self, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and slopes at local coordinates, the same in every phase."""
        with_end = np.append(xi, 1.0)
        value, slope = continuous_basis(self.degree, with_end, np.ones(self.count))
        bubbles = np.arange(self.degree - 1) < np.array(self.degrees)[:, None] - 1
        kept = np.append(np.ones(self.count, bool), bubbles)
        last, first = slope[-1], self.count + (self.count - 1) * (self.degree - 1)
        kept[first] = False  # the first bubble of the last phase takes the slope of the others off
        rows = np.arange(value.shape[0]) % len(with_end) != len(xi)
        share = last[kept] / last[first]
        return tuple(
            table[np.ix_(rows, kept)] - np.outer(table[rows, first], share) for table in (value, slope)
        )

    @lru_cache(maxsize=4)  # noqa: B019 - few of them live as long as the process
    def looked(self, many: int) -> Looked:
        """Return what shows the polynomials at so many Chebyshev points of every phase, ends included."""
        xi = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, many)))
        value, slope = self.at(xi)
        return Looked(xi, value, slope, self.grid.weights - integration_matrix(len(self.grid.xi), xi))

    @cached_property
    def size(self) -> int:
        """Number of coefficients of theta."""
        return self.tables[0].shape[1]

    @cached_property
    def outward(self) -> np.ndarray:
        """Integrals from each point to the front, per length of each phase, (count, points, points)."""
        n, grid = len(self.grid.xi), self.grid
        out = np.zeros((self.count, self.count * n, self.count * n))
        for j in range(self.count):
            here = slice(j * n, (j + 1) * n)
            out[j, here, here] = grid.to_right
            out[j, : j * n, here] = grid.weights
        return out

    def reaching(self, lengths: np.ndarray) -> np.ndarray:
        """Return the integrals from each point to the front, (points, points), for lengths of the phases."""
        points = self.outward.shape[1]
        flat = lengths @ self.outward.reshape(self.count, -1)
        return np.asarray(flat.reshape(*lengths.shape[:-1], points, points))

    def per_length(self, values: np.ndarray) -> np.ndarray:
        """Return `outward` of values at the points, (points, count)."""
        flat = values @ self._rows.T
        return np.swapaxes(flat.reshape(*values.shape[:-1], self.count, -1), -1, -2)

    def from_lengths(self, forces: np.ndarray) -> np.ndarray:
        """Return the transpose of `outward` of forces at the points, (count, points)."""
        return np.asarray((forces @ self._columns).reshape(*forces.shape[:-1], self.count, -1))

    @cached_property
    def _rows(self) -> np.ndarray:
        return self.outward.reshape(-1, self.outward.shape[2])

    @cached_property
    def _columns(self) -> np.ndarray:
        return np.swapaxes(self.outward, 0, 1).reshape(self.outward.shape[1], -1)

    @cached_property
    def whole(self) -> np.ndarray:
        """Integrals over each phase, per its length, (count, points)."""
        return np.kron(np.eye(self.count), self.grid.weights)

    @cached_property
    def bending(self) -> np.ndarray:
        """int theta_xi theta_xi of each phase, (count, size, size)."""
        slope = self.tables[1]
        return np.array([slope.T @ (weights[:, None] * slope) for weights in self.whole])

    def bent(self, fields: np.ndarray) -> np.ndarray:
        """Return `bending` of coefficients, (count, size)."""
        flat = fields @ self.bending.reshape(-1, self.size).T
        return np.asarray(flat.reshape(*fields.shape[:-1], self.count, -1))


@lru_cache(maxsize=64)
def basis(degrees: tuple[int, ...]) -> Basis:
    """Return the polynomials of these degrees."""
    return Basis(degrees)
