"""Newton on the discretised (12) bordered by the equations of a question."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lu_factor, lu_solve
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
    rows = np.zeros((len(border), n))
    rows[:, -4:] = border
    if n <= DENSE_LIMIT:
        return _dense_solver(np.vstack([jacobian.full(), rows]))  # type: ignore[attr-defined]
    lu = splu(sp.vstack([jacobian.sparse(), sp.csc_matrix(rows)]).tocsc())  # type: ignore[attr-defined]
    return lu.solve


def _dense_solver(matrix: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    factors = lu_factor(matrix, check_finite=False)
    return lambda b: lu_solve(factors, b, check_finite=False)


#: From unknowns to the equations and the solver of their Jacobian.
Linearisation = Callable[[np.ndarray], tuple[np.ndarray, Callable[[], Callable[[np.ndarray], np.ndarray]]]]


def correct(problem: Discretisation, x: np.ndarray, rows: Rows) -> Correction:
    """Solve R(x) = 0 together with ``rows`` from the guess ``x``.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray, shape (n,)
    rows : callable
        Two further equations on the scalars.

    Returns
    -------
    Correction
        ``converged`` is False if the updates did not shrink; nothing is raised.
    """

    def linearise(x: np.ndarray) -> tuple[np.ndarray, Callable[[], Callable[[np.ndarray], np.ndarray]]]:
        residual, jacobian = problem.linearised(x)
        values, border = rows(x[-4:])
        return np.concatenate([residual.full().ravel(), values]), lambda: factorised(jacobian, border)

    return newton(linearise, x, _block_scale(problem, x))


def correct_contact(problem: Discretisation, x: np.ndarray, rows: Rows) -> Correction:
    """Solve for the state whose tip touches the plate: m = 0 and Y(0) = 0, with one of ``rows``.

    By the first integrals of (12), y_tip (alpha1 + Phi-terms) = K(1)^2/2 - n_y(1) sin theta(1):
    where the left side vanishes to second order, the gradient of theta(1) = 0 follows from the
    other equations.  It is left out; kept, it would make the system singular.
    """

    def linearise(x: np.ndarray) -> tuple[np.ndarray, Callable[[], Callable[[np.ndarray], np.ndarray]]]:
        residual, jacobian = (part.full() for part in problem.linearised(x))
        tip, tip_gradient = (part.full() for part in problem.tip_height(x))
        values, border = rows(x[-4:])
        keep = np.arange(len(residual)) != problem.angle_row
        extra = np.zeros((len(border) + 1, len(x)))
        extra[:-1, -4:] = border
        extra[-1, -3] = 1.0
        matrix = np.vstack([jacobian[keep], tip_gradient, extra])
        equations = np.concatenate([residual[keep].ravel(), tip.ravel(), values, x[-3:-2]])
        return equations, lambda: _dense_solver(matrix)

    return newton(linearise, x, _block_scale(problem, x))


def newton(
    linearise: Linearisation,
    x: np.ndarray,
    scale: np.ndarray,
    *,
    tol: float = 1e-11,
    max_iterations: int = 12,
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
    """
    step, solve, update = np.inf, None, np.zeros_like(x)
    for iteration in range(1, max_iterations + 1):
        equations, factorise = linearise(x)
        if not np.all(np.isfinite(equations)):
            return Correction(x, False, iteration, np.inf, update, None)
        try:
            solve = factorise()
            update = solve(-equations)
        except (np.linalg.LinAlgError, RuntimeError, ValueError):
            return Correction(x, False, iteration, np.inf, update, None)
        previous, step = step, float(np.max(np.abs(update) / scale))
        if not np.isfinite(step) or step > 1e3:
            return Correction(x, False, iteration, step, update, None)
        x = x + update
        if step < tol or (step < 1e4 * tol and step > 0.5 * previous):
            return Correction(x, True, iteration, step, update, solve)
    return Correction(x, False, max_iterations, step, update, solve)


def _block_scale(problem: Discretisation, x: np.ndarray) -> np.ndarray:
    """Size of each unknown's block: its fields together, every scalar for itself."""
    scale = 1.0 + np.abs(x)
    fields = slice(0, problem.field_count)
    scale[fields] = 1.0 + np.max(np.abs(x[fields]), initial=0.0)
    return scale
