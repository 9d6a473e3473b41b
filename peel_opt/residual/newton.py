"""Newton on the discretised (12) bordered by the equations of a question."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse.linalg import splu

from ..base.threads import one_thread
from ..model.equations import Scalars
from .closures import Closing, equations, parameters, symbols
from .compiled import Compiled, Pattern, is_dense
from .discretisation import Discretisation
from .kept import keep

#: Values of the extra equations and their gradient, shapes (k,) and (k, 4).
#: The gradient is with respect to the four scalars.
Rows = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

#: Solves a factorised system for one or more right sides.
Solver = Callable[[np.ndarray], np.ndarray]

#: From unknowns to the equations and the means to factorise their Jacobian.
Linearisation = Callable[[np.ndarray], tuple[np.ndarray, Callable[[], Solver]]]

#: Updates below this size leave the Jacobian as it is: with the factors kept, the next update
#: is still smaller by about this factor, at a fifth of the price.
CHORD = 1e-5

#: Factors are renewed when an update is not smaller than this share of the one before.
CONTRACTION = 0.1


@dataclass(frozen=True, eq=False)
class Factors:
    """A factorised square matrix: solves with it, and tells the sign of its determinant."""

    solve: Solver
    sign: Callable[[], int]


@dataclass(frozen=True, eq=False)
class Correction:
    """Outcome of a Newton correction.

    ``step`` is the size of the last update relative to the unknowns, ``update`` that update
    itself: once converged, what rounding leaves.
    """

    x: np.ndarray
    converged: bool
    iterations: int
    step: float
    update: np.ndarray
    solve: Solver | None


def factorised(jacobian: np.ndarray | sp.spmatrix | ca.DM, border: np.ndarray) -> Factors:
    """Factorise the square system [jacobian; border on the four scalars].

    The Jacobian may be a NumPy array, a SciPy matrix or a CasADi one.
    """
    if isinstance(jacobian, ca.DM):
        jacobian = jacobian.full() if is_dense(jacobian.sparsity()) else jacobian.sparse()
    n = jacobian.shape[1]
    if isinstance(jacobian, np.ndarray):
        matrix = np.zeros((n, n), order="F")
        matrix[: n - len(border)] = jacobian
        matrix[n - len(border) :, -4:] = border
        return _dense_factors(matrix)
    rows = sp.csc_matrix(np.pad(border, ((0, 0), (n - 4, 0))))
    return _sparse_factors(sp.vstack([jacobian, rows]).tocsc())


def _dense_factors(matrix: np.ndarray) -> Factors:
    """Factorise a matrix that nobody needs any more; SciPy's own wrappers cost more than a small solve."""
    with one_thread:
        factors, pivots, info = dgetrf(matrix, overwrite_a=True)
    if info != 0:
        raise np.linalg.LinAlgError("singular Jacobian")

    def solve(right: np.ndarray) -> np.ndarray:
        with one_thread:
            return dgetrs(factors, pivots, right)[0]

    def sign() -> int:
        swaps = np.count_nonzero(pivots != np.arange(len(pivots)))
        negative = np.count_nonzero(factors.diagonal() < 0.0)
        return -1 if (swaps + negative) % 2 else 1

    return Factors(solve, sign)


def _sparse_factors(matrix: sp.csc_matrix) -> Factors:
    factors = splu(matrix)

    def sign() -> int:
        negative = np.count_nonzero(factors.U.diagonal() < 0.0)
        odd = _is_odd(factors.perm_r) ^ _is_odd(factors.perm_c)
        return -1 if (negative + odd) % 2 else 1

    return Factors(factors.solve, sign)


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


def correct(problem: Discretisation, x: np.ndarray, rows: Rows | Sequence[Closing]) -> Correction:
    """Solve R(x) = 0 together with ``rows`` from the guess ``x``.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray, shape (n,)
    rows : callable or two closures
        Two further equations on the scalars.  As closures they are compiled with the residual.

    Returns
    -------
    Correction
        ``converged`` is False if the updates did not shrink; nothing is raised.
    """
    if not callable(rows):
        closed = closed_system(problem, tuple(closure.kind for closure in rows))
        given = parameters(rows)
        return newton(
            lambda x: closed.linearise(x, given),
            x,
            _block_scale(problem, x),
            equations=lambda x: closed.equations(x, given)[0],
        )

    def linearise(x: np.ndarray) -> tuple[np.ndarray, Callable[[], Solver]]:
        residual, jacobian = problem.linearise(x)
        values, border = rows(x[-4:])
        return np.concatenate([residual, values]), lambda: factorised(jacobian, border).solve

    def equations(x: np.ndarray) -> np.ndarray:
        return np.concatenate([problem.residual(x), rows(x[-4:])[0]])

    return newton(linearise, x, _block_scale(problem, x), equations=equations)


@dataclass(frozen=True, eq=False)
class ClosedSystem:
    """The residual and the closures of a question, compiled into one square system."""

    equations: Compiled
    system: Compiled
    pattern: Pattern | None

    def linearise(self, x: np.ndarray, given: np.ndarray) -> tuple[np.ndarray, Callable[[], Solver]]:
        """Return the equations, and the means to factorise their Jacobian."""
        equations, jacobian = self.system(x, given)
        if self.pattern is None:
            return equations, lambda: _dense_factors(jacobian).solve
        matrix = self.pattern.matrix(jacobian)
        return equations, lambda: _sparse_factors(matrix).solve


def closed_system(problem: Discretisation, kinds: tuple[str, ...]) -> ClosedSystem:
    """Return a discretised problem with closures of these kinds, compiled; remembered by structure."""
    keep(problem)
    found: ClosedSystem | None = problem.closed.get(kinds)
    if found is None:
        found = problem.closed[kinds] = _closed_system(problem, kinds)
    return found


def _closed_system(problem: Discretisation, kinds: tuple[str, ...]) -> ClosedSystem:
    s, numbers = ca.SX.sym("s", 4), symbols(kinds)
    closing = ca.Function("closing", [s, numbers], [equations(kinds, Scalars(*ca.vertsplit(s)), numbers)])
    x, given = problem.x, ca.MX.sym("given", numbers.numel())
    values = closing(x[-4:], given)
    residual, jacobian = problem.linearised(x)
    jacobian = ca.vertcat(jacobian, ca.jacobian(values, x))
    dense = is_dense(jacobian.sparsity())
    if dense:
        jacobian = ca.densify(jacobian)
    system = ca.Function("system", [x, given], [ca.vertcat(residual, values), jacobian])
    together = ca.Function("together", [x, given], [ca.vertcat(problem.expression, values)])
    pattern = None if dense else Pattern.of(system.sparsity_out(1))
    return ClosedSystem(Compiled(together), Compiled(system), pattern)


def newton(
    linearise: Linearisation,
    x: np.ndarray,
    scale: np.ndarray,
    *,
    tol: float = 1e-11,
    max_iterations: int = 12,
    equations: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Correction:
    """Newton's method for a square system.

    Parameters
    ----------
    linearise : callable
    x : ndarray, shape (n,)
    scale : ndarray, shape (n,)
        Sizes by which updates are measured.
    tol : float
        Largest scaled update at which to stop; also where rounding lets it get no smaller.
    max_iterations : int
    equations : callable, optional
        The equations alone.  With them, the last updates reuse the factors at hand.
    """
    previous, step, update = np.inf, np.inf, np.zeros_like(x)
    solve: Solver | None = None
    for iteration in range(1, max_iterations + 1):
        chord = equations is not None and step < min(CHORD, CONTRACTION * previous)
        try:
            if chord:
                assert equations is not None
                values = equations(x)
            else:
                values, factorise = linearise(x)
            if not float(np.abs(values).max()) < math.inf:  # also where it is not a number
                return Correction(x, False, iteration, np.inf, update, None)
            if not chord:
                solve = factorise()
            assert solve is not None
            update = solve(-values)
        except (np.linalg.LinAlgError, RuntimeError, ValueError):
            return Correction(x, False, iteration, np.inf, update, None)
        previous, step = step, float((np.abs(update) / scale).max())
        if not step <= 1e3:  # also where it is not a number
            return Correction(x, False, iteration, step, update, None)
        x = x + update
        if step < tol or (not chord and step < 1e4 * tol and step > 0.5 * previous):
            return Correction(x, True, iteration, step, update, solve)
    return Correction(x, False, max_iterations, step, update, solve)


def _block_scale(problem: Discretisation, x: np.ndarray) -> np.ndarray:
    """Size of each unknown's block: its fields together, every scalar for itself."""
    scale = 1.0 + np.abs(x)
    fields = slice(0, problem.field_count)
    scale[fields] = 1.0 + np.max(np.abs(x[fields]), initial=0.0)
    return scale
