"""Values with their gradients, carried through integrals and pointwise functions as whole matrices.

Every field of a discretised rod is a constant matrix times a pointwise function of the fields before
it.  Carried along with its gradient by all unknowns, each costs one matrix product and a few scalings
of rows, where automatic differentiation sends every column through separately.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from .compiled import product, scaled


@dataclass(frozen=True, eq=False)
class Traced:
    """Values, shape (n, 1), and their gradient by all unknowns, shape (n, unknowns)."""

    values: Any
    gradient: Any

    def __getitem__(self, rows: slice | int) -> Traced:
        """Return some rows."""
        return Traced(self.values[rows], self.gradient[rows, :])

    def __add__(self, other: Traced) -> Traced:
        """Add another field, or one row to each of a field."""
        return self._with(other, 1.0)

    def __sub__(self, other: Traced) -> Traced:
        """Subtract another field, or one row from each of a field."""
        return self._with(other, -1.0)

    def _with(self, other: Traced, sign: float) -> Traced:
        count = self.values.shape[0] // other.values.shape[0]
        values, gradient = (ca.repmat(part, count, 1) for part in (other.values, other.gradient))
        return Traced(self.values + sign * values, self.gradient + sign * gradient)

    def times(self, factor: Traced) -> Traced:
        """Return the product with one number, or with a field."""
        count = self.values.shape[0] // factor.values.shape[0]
        scale, rate = ca.repmat(factor.values, count, 1), ca.repmat(factor.gradient, count, 1)
        return Traced(self.values * scale, scaled(scale, self.gradient) + scaled(self.values, rate))


def stacked(parts: Sequence[Traced]) -> Traced:
    """Return fields one below the other."""
    return Traced(ca.vertcat(*(p.values for p in parts)), ca.vertcat(*(p.gradient for p in parts)))


def integrated(matrix: np.ndarray, lengths: Traced, field: Traced) -> Traced:
    """Return integrals of a field, a constant matrix times its values and the lengths of its phases."""
    inside = field.times(lengths)
    return Traced(ca.mtimes(matrix, inside.values), product(matrix, ca.densify(inside.gradient)))


def pointwise(
    function: Callable[[Sequence[Any], ca.SX], Sequence[Any]],
    fields: Sequence[Traced],
    scalars: Traced,
    given: Any,
) -> list[Traced]:
    """Apply a function of fields at each of their points, and of the scalars, with its derivatives.

    Parameters
    ----------
    function : callable
        From the fields at one point, and all scalars with the given numbers below them, to some numbers.
    fields : sequence of Traced, shapes (n, 1)
    scalars : Traced
        Unknown numbers that every point depends on.
    given : casadi expression
        Known numbers.
    """
    points, count = fields[0].values.shape[0], len(fields)
    known = ca.vertcat(scalars.values, given)
    q, s = ca.SX.sym("q", count), ca.SX.sym("s", known.shape[0])
    unknown = scalars.values.shape[0]
    values = ca.vertcat(*function(ca.vertsplit(q), s))
    rates = ca.densify(ca.jacobian(values, ca.vertcat(q, s[:unknown])))
    at_one = ca.Function("at_one", [q, s], [values.T, ca.vec(rates.T).T])
    mapped = at_one.map(points, "unroll") if points > 1 else at_one
    every, slopes = mapped(ca.horzcat(*(f.values for f in fields)).T, ca.repmat(known, 1, points))
    outputs = values.shape[0]
    every, slopes = (
        ca.reshape(every, outputs, points),
        ca.reshape(slopes, outputs * (count + unknown), points),
    )
    found = []
    for k in range(outputs):
        rows = slopes[k * (count + unknown) : (k + 1) * (count + unknown), :].T
        gradient = ca.mtimes(rows[:, count:], scalars.gradient)
        for j, field in enumerate(fields):
            gradient = gradient + scaled(rows[:, j], field.gradient)
        found.append(Traced(every[k, :].T, gradient))
    return found
