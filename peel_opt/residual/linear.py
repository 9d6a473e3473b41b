"""The bordered linear system of a closed problem, factorised once and read in many ways.

A discretised (12) has two equations fewer than unknowns (one fewer, where a null vector is among
them), and closures on the scalars add those.  Linearised at x, both together are

    J = [R_x; E_x],    J dx = -[r; e + E_given d(given)],

one square matrix whose factors tell how a solution moves with what is given (its response), how a
number moves with a residue of any equation (the adjoint), which way a branch goes on (the tangent,
along which all closures but the last hold), and by the sign of det J on which side of a branch
point it lies.  Where J loses its rank but for one closure, the tangent is the null vector.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, Self

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse.linalg import splu

from ..base.threads import one_thread
from ..model.equations import Scalars
from .closures import Closing, chart, derivatives
from .discretisation import Discretisation

#: Step along the imaginary axis.  No difference is taken, so that it may be as small as this.
IMAGINARY = 1e-30


class Factors(Protocol):
    """A factorised square matrix."""

    def solve(self, right: np.ndarray, *, transposed: bool = False) -> np.ndarray:
        """Solve for one right side, or one in each column."""

    def sign(self) -> int:
        """Sign of the determinant."""


class DenseFactors:
    """LU factors of a full matrix; SciPy's own wrappers cost more than a small solve.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
        In column order; it is overwritten.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is singular.
    """

    def __init__(self, matrix: np.ndarray) -> None:
        with one_thread:
            self.factors, self.pivots, info = dgetrf(matrix, overwrite_a=True)
        if info != 0:
            raise np.linalg.LinAlgError("singular Jacobian")

    def solve(self, right: np.ndarray, *, transposed: bool = False) -> np.ndarray:
        """Solve for one right side, or one in each column."""
        with one_thread:
            solved: np.ndarray = dgetrs(self.factors, self.pivots, right, trans=int(transposed))[0]
        return solved

    def sign(self) -> int:
        """Sign of the determinant."""
        swaps = np.count_nonzero(self.pivots != np.arange(len(self.pivots)))
        negative = np.count_nonzero(self.factors.diagonal() < 0.0)
        return -1 if (swaps + negative) % 2 else 1


class SparseFactors:
    """LU factors of a matrix that is mostly zeros.

    Raises
    ------
    RuntimeError
        If the matrix is singular.
    """

    def __init__(self, matrix: sp.csc_matrix) -> None:
        self.factors = splu(matrix)

    def solve(self, right: np.ndarray, *, transposed: bool = False) -> np.ndarray:
        """Solve for one right side, or one in each column."""
        solved: np.ndarray = self.factors.solve(right, "T" if transposed else "N")
        return solved

    def sign(self) -> int:
        """Sign of the determinant."""
        negative = np.count_nonzero(self.factors.U.diagonal() < 0.0)
        odd = _is_odd(self.factors.perm_r) ^ _is_odd(self.factors.perm_c)
        return -1 if (negative + odd) % 2 else 1


def _is_odd(permutation: np.ndarray) -> bool:
    """Whether a permutation takes an odd number of swaps."""
    order, seen, odd = permutation.tolist(), set(), False
    for start in range(len(order)):
        here = start
        while order[here] not in seen:
            seen.add(order[here])
            odd ^= order[here] != start
            here = order[here]
    return odd


@dataclass(frozen=True, eq=False)
class Linearised:
    """A closed problem linearised at one place.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray, shape (n,)
    closing : tuple of Closure and Plane
        As many equations on the scalars as make the system square.
    """

    problem: Discretisation
    x: np.ndarray
    closing: tuple[Closing, ...]

    @classmethod
    def at(cls, problem: Discretisation, x: np.ndarray, *closing: Closing) -> Self:
        """Linearise a problem with its closures at ``x``."""
        return cls(problem, x, closing)

    @property
    def tail(self) -> np.ndarray:
        """The scalars."""
        return self.x[self.problem.tail]

    @cached_property
    def jacobian(self) -> np.ndarray | sp.csc_matrix:
        """R_x."""
        return self.problem.linearise(self.x)[1]

    @cached_property
    def _closures(self) -> tuple[np.ndarray, np.ndarray]:
        return derivatives(self.closing, self.tail, self.problem.form)

    @property
    def border(self) -> np.ndarray:
        """Derivatives of the closures by the scalars, shape (closures, scalars)."""
        return self._closures[0]

    @property
    def by_given(self) -> np.ndarray:
        """Derivatives of the closures by their given numbers, shape (closures, numbers)."""
        return self._closures[1]

    @cached_property
    def factors(self) -> Factors:
        """Factors of J.

        Raises
        ------
        numpy.linalg.LinAlgError, RuntimeError
            If it is singular.
        """
        n, k = self.problem.size, len(self.border)
        if isinstance(self.jacobian, np.ndarray):
            matrix = np.zeros((n, n), order="F")
            matrix[: n - k] = self.jacobian
            matrix[n - k :, self.problem.tail] = self.border
            return DenseFactors(matrix)
        wide = np.zeros((k, n))
        wide[:, self.problem.tail] = self.border
        return SparseFactors(sp.vstack([self.jacobian, sp.csc_matrix(wide)]).tocsc())

    @property
    def sizes(self) -> np.ndarray:
        """Size of the terms of every equation, |J| |x|."""
        own: np.ndarray = abs(self.jacobian) @ np.abs(self.x)
        return np.append(own, np.abs(self.border) @ np.abs(self.tail))

    def sign(self) -> int:
        """Sign of det J; along a branch it changes only where another one crosses it."""
        return self.factors.sign()

    def response(self) -> np.ndarray:
        """dx/d(given), shape (n, numbers)."""
        right = np.zeros((self.problem.size, self.by_given.shape[1]), order="F")
        right[-len(self.border) :] = -self.by_given
        return self.factors.solve(right)

    def adjoint(self, weights: np.ndarray) -> np.ndarray:
        """How numbers of the scalars move with a residue of each equation.

        Parameters
        ----------
        weights : ndarray, shape (scalars,) or (scalars, m)
            Gradients of the numbers.

        Returns
        -------
        ndarray, shape (n,) or (n, m)
            The solution of J^T v = [0; weights].
        """
        right = np.zeros((self.problem.size, *weights.shape[1:]), order="F")
        right[self.problem.tail] = weights
        return self.factors.solve(right, transposed=True)

    def tangent(self) -> np.ndarray:
        """Direction in which all closures but the last hold and the last grows; of length 1 in the chart."""
        last = np.zeros(self.problem.size)
        last[-1] = 1.0
        along = self.factors.solve(last)
        return along / np.linalg.norm(chart(self.tail)[1] @ along[self.problem.tail])


def rate(
    read: Callable[[Scalars], float],
    scalars: np.ndarray,
    direction: np.ndarray,
    form: type[Scalars] = Scalars,
) -> float:
    """Derivative of a number of the scalars in a direction, by one step along the imaginary axis.

    Parameters
    ----------
    read : callable
        Arithmetic and powers of the scalars.
    scalars, direction : ndarray, shape (scalars,)
    """
    moved = form.of_unknowns(*(scalars + 1j * IMAGINARY * direction).tolist())
    return float(complex(read(moved)).imag / IMAGINARY)


def gradient(
    read: Callable[[Scalars], float], scalars: np.ndarray, form: type[Scalars] = Scalars
) -> np.ndarray:
    """Derivatives of a number by what stands for each of the scalars."""
    return np.array([rate(read, scalars, unit, form) for unit in np.eye(len(scalars))])
