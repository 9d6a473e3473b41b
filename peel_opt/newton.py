"""Newton on the discretised (12) bordered by the equations of a question."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from .transcription.base import Discretisation

#: Values of the extra equations and their gradient, shapes (k,) and (k, 4).
#: The gradient is with respect to the four scalars.
Rows = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

#: Systems below this size are solved dense.
DENSE_LIMIT = 150


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
    solve: Callable[[np.ndarray], np.ndarray] | None


def factorised(jacobian: object, border: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Return the solver of the square system [jacobian; border on the four scalars]."""
    n = jacobian.size2()  # type: ignore[attr-defined]
    if n <= DENSE_LIMIT:
        from scipy.linalg import lu_factor, lu_solve

        matrix = np.zeros((n, n))
        matrix[: n - len(border)] = jacobian.full()  # type: ignore[attr-defined]
        matrix[n - len(border) :, -4:] = border
        factors = lu_factor(matrix, check_finite=False)
        return lambda b: lu_solve(factors, b, check_finite=False)
    rows = sp.csc_matrix((len(border), n), dtype=float)
    rows = sp.hstack([sp.csc_matrix((len(border), n - 4)), sp.csc_matrix(border)])
    lu = splu(sp.vstack([jacobian.sparse(), rows]).tocsc())  # type: ignore[attr-defined]
    return lu.solve


def correct(
    problem: Discretisation, x: np.ndarray, rows: Rows, *, tol: float = 1e-11, max_iterations: int = 12
) -> Correction:
    """Solve R(x) = 0 together with ``rows`` from the guess ``x``.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray, shape (n,)
    rows : callable
        Two further equations on the scalars.
    tol : float
        Largest update, relative to the size of its block, at which to stop.
    max_iterations : int

    Returns
    -------
    Correction
        ``converged`` is False if the updates did not shrink; nothing is raised.
    """
    scale = _block_scale(problem, x)
    step, solve, update = np.inf, None, np.zeros_like(x)
    for iteration in range(1, max_iterations + 1):
        residual, jacobian = problem.linearised(x)
        values, border = rows(x[-4:])
        right = -np.concatenate([residual.full().ravel(), values])
        if not np.all(np.isfinite(right)):
            return Correction(x, False, iteration, np.inf, update, None)
        try:
            solve = factorised(jacobian, border)
            update = solve(right)
        except (np.linalg.LinAlgError, RuntimeError, ValueError):
            return Correction(x, False, iteration, np.inf, update, None)
        previous, step = step, float(np.max(np.abs(update) / scale))
        if not np.isfinite(step) or step > 1e3:
            return Correction(x, False, iteration, step, update, None)
        x = x + update
        if step < tol or (step < 1e4 * tol and step > 0.5 * previous):
            # Converged, or as far as rounding lets it.
            return Correction(x, True, iteration, step, update, solve)
    return Correction(x, False, max_iterations, step, update, solve)


def _block_scale(problem: Discretisation, x: np.ndarray) -> np.ndarray:
    """Size of each unknown's block: its fields together, every scalar for itself."""
    scale = 1.0 + np.abs(x)
    fields = slice(0, problem.field_count)
    scale[fields] = 1.0 + np.max(np.abs(x[fields]), initial=0.0)
    return scale
