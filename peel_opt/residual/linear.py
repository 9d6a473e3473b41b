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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, Self

import casadi as ca
import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ..base.threads import one_thread
from ..model.bond import Piece
from ..model.equations import Scalars, identity_terms, symbolic
from .closures import TERMS, Closing, chart, derivatives, equations, parameters, symbols
from .compiled import Compiled, Pattern, is_dense, keep
from .discretisation import Discretisation

if TYPE_CHECKING:
    import scipy.sparse as sp

#: Step along the imaginary axis.  No difference is taken, so that it may be as small as this.
IMAGINARY = 1e-30


#: Size of a term that is a product of some ten factors, next to that of a sum of as many terms, of which the
#: units of rounding are said: the roundings of a product are relative, and of independent signs.
PRODUCTS = 0.5


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
        self.factors, self.pivots, info = one_thread.run(dgetrf, matrix, overwrite_a=True)
        if info != 0:
            raise np.linalg.LinAlgError("singular Jacobian")

    def solve(self, right: np.ndarray, *, transposed: bool = False) -> np.ndarray:
        """Solve for one right side, or one in each column."""
        solved: np.ndarray = one_thread.run(dgetrs, self.factors, self.pivots, right, trans=int(transposed))[
            0
        ]
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
        from scipy.sparse.linalg import splu  # which takes long to import, and small systems are dense

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
class ClosedSystem:
    """The residual and the closures of a question, compiled into one square system."""

    equations: Compiled
    system: Compiled
    pattern: Pattern | None

    def linearise(self, x: np.ndarray, given: np.ndarray) -> tuple[np.ndarray, np.ndarray | sp.csc_matrix]:
        """Return the equations and their Jacobian."""
        equations, jacobian = self.system(x, given)
        return equations, jacobian if self.pattern is None else self.pattern.matrix(jacobian)


def closed_system(problem: Discretisation, kinds: tuple[str, ...]) -> ClosedSystem:
    """Return a discretised problem with closures of these kinds, compiled; remembered by structure."""
    keep(problem)
    found: ClosedSystem | None = problem.closed.get(kinds)
    if found is None:
        found = problem.closed[kinds] = _closed_system(problem, kinds)
    return found


def _closed_system(problem: Discretisation, kinds: tuple[str, ...]) -> ClosedSystem:
    (s, scalars), numbers = symbolic(problem.form), symbols(kinds)
    closing = ca.Function("closing", [s, numbers], [equations(kinds, scalars, numbers)])
    x, given = problem.x, ca.MX.sym("given", numbers.numel())
    values = closing(x[problem.tail], given)
    residual, jacobian = problem.linearised(x)
    jacobian = ca.vertcat(jacobian, ca.jacobian(values, x))
    dense = is_dense(jacobian.sparsity())
    if dense:
        jacobian = ca.densify(jacobian)
    system = ca.Function("system", [x, given], [ca.vertcat(residual, values), jacobian])
    together = ca.Function("together", [x, given], [ca.vertcat(problem.expression, values)])
    pattern = None if dense else Pattern.of(system.sparsity_out(1))
    return ClosedSystem(Compiled(together), Compiled(system), pattern)


@dataclass(frozen=True, eq=False)
class Linearised:
    """A closed problem linearised at one place.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray, shape (n,)
    closing : tuple of Closure and Plane
        As many equations on the scalars as make the system square.
    near : Linearised, optional
        The same problem linearised so near that its Jacobian and its factors serve here.
    """

    problem: Discretisation
    x: np.ndarray
    closing: tuple[Closing, ...]
    near: Linearised | None = None

    @classmethod
    def at(cls, problem: Discretisation, x: np.ndarray, *closing: Closing) -> Self:
        """Linearise a problem with its closures at ``x``."""
        return cls(problem, x, closing)

    @property
    def tail(self) -> np.ndarray:
        """The scalars."""
        return self.x[self.problem.tail]

    @cached_property
    def _evaluated(self) -> tuple[np.ndarray, np.ndarray | sp.csc_matrix]:
        system = closed_system(self.problem, tuple(closure.kind for closure in self.closing))
        return system.linearise(self.x, parameters(self.closing))

    @property
    def equations(self) -> np.ndarray:
        """Residual, and what the closures miss."""
        return self._evaluated[0]

    @property
    def matrix(self) -> np.ndarray | sp.csc_matrix:
        """J; sparse in large systems that are mostly zeros."""
        return self._evaluated[1] if self.near is None else self.near.matrix

    @property
    def jacobian(self) -> np.ndarray | sp.csc_matrix:
        """R_x."""
        return self.matrix[: -len(self.closing)]

    @property
    def border(self) -> np.ndarray:
        """Derivatives of the closures by the scalars, shape (closures, scalars)."""
        border = self.matrix[-len(self.closing) :, self.problem.tail]
        return border if isinstance(border, np.ndarray) else border.toarray()

    @cached_property
    def by_given(self) -> np.ndarray:
        """Derivatives of the closures by their given numbers, shape (closures, numbers)."""
        return derivatives(self.closing, self.tail, self.problem.form)[1]

    @cached_property
    def factors(self) -> Factors:
        """Factors of J.

        Raises
        ------
        numpy.linalg.LinAlgError, RuntimeError
            If it is singular.
        """
        if self.near is not None:
            return self.near.factors
        matrix = self.matrix
        return (
            DenseFactors(matrix.copy(order="F")) if isinstance(matrix, np.ndarray) else SparseFactors(matrix)
        )

    @property
    def sizes(self) -> np.ndarray:
        """Size of the terms of every equation: |J| |x|, or that of the terms themselves where they are known.

        |J| |x| counts a term as often as its degree, as if each power of a scalar were a sum of its own.
        """
        moduli, x, problem = abs(self.matrix), np.abs(self.x), self.problem
        sizes: np.ndarray = moduli @ x
        s, given = problem.scalars(self.x), (closure.parameters for closure in self.closing)
        count_closures_once(sizes, s, [closure.kind for closure in self.closing], list(given))
        if problem.identity_row is not None:
            shape = slice(0, problem.tail.start)
            through_shape = float((moduli[problem.identity_row, shape] @ x[shape]).item())
            count_identity_once(sizes, s, problem.identity_row, problem.phases[0], through_shape)
        return sizes

    def sign(self) -> int:
        """Sign of det J; along a branch it changes only where another one crosses it."""
        return self.factors.sign()

    @cached_property
    def of_scalars(self) -> np.ndarray:
        """How each scalar moves with a residue of each equation, shape (n, scalars)."""
        return self.adjoint(np.eye(len(self.tail)))

    def scalars_by_given(self) -> np.ndarray:
        """d(scalars)/d(given), shape (scalars, numbers)."""
        moves: np.ndarray = -self.of_scalars[-len(self.closing) :].T @ self.by_given
        return moves

    def response(self) -> np.ndarray:
        """dx/d(given), shape (n, numbers)."""
        right = np.zeros((self.problem.size, self.by_given.shape[1]), order="F")
        right[-len(self.closing) :] = -self.by_given
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


def count_closures_once(sizes: np.ndarray, s: Scalars, kinds: Sequence[str], given: Sequence[Any]) -> None:
    """Put the sizes of the terms themselves in those of the last equations, the closures, where known.

    ``sizes`` has shape (..., equations), the scalars and the numbers of each closure that of its first axes.
    """
    for row, (kind, numbers) in enumerate(zip(kinds, given, strict=True), start=-len(kinds)):
        if kind in TERMS:
            sizes[..., row] = PRODUCTS * TERMS[kind](s, *numbers)


def count_identity_once(sizes: np.ndarray, s: Scalars, row: int, tip: Piece, through_shape: Any) -> None:
    """Put the sizes of the terms themselves in that of the identity, where they are known.

    ``through_shape`` is the part of |J| |x| that the height of the tip, a sum over the shape, brings with it.
    """
    terms = identity_terms(s, tip)
    if terms is not None:
        sizes[..., row] = PRODUCTS * terms + through_shape


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
    values = scalars.tolist()
    moved = ([*values[:k], complex(values[k], IMAGINARY), *values[k + 1 :]] for k in range(len(values)))
    return np.array([complex(read(form.of_unknowns(*each))).imag / IMAGINARY for each in moved])
