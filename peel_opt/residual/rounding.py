"""How an answered number responds to the equations: what rounding does, and what a mesh may do.

Each equation of a discretised problem is a sum of terms, and its value cannot be known better
than to a few units in the last place of the largest of them.  The row of the inverse Jacobian
that belongs to the answered number says what such a residue does to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse.linalg import splu

from ..base.threads import one_thread
from ..model.equations import PI4, Scalars
from .closures import Closure, rows, sensitivity_to_given
from .discretisation import Discretisation
from .newton import Correction
from .shooting import ShootingDiscretisation

EPS = float(np.finfo(float).eps)

#: Units in the last place of its terms that an equation may lose: a sum of a few dozen terms,
#: and an integrator whose stages are not seen among the terms.  Over 2000 random cases a
#: quarter of the first and two thirds of the second were lost.
UNITS, UNITS_OF_STAGES = 4.0, 14.0


@dataclass(frozen=True, eq=False)
class Response:
    """How an answer responds to the equations of its discrete problem.

    Parameters
    ----------
    rounding : float
        What rounding does to the answer.
    condition : float
        Largest derivative of the answer with respect to a given number other than the rod's.
    leverage : ndarray, shape (4,)
        How much further the same residues of the equations move the answer than each scalar.
    """

    rounding: float
    condition: float
    leverage: np.ndarray


def response(
    problem: Discretisation,
    correction: Correction,
    given: tuple[Closure, ...],
    read: Callable[[Scalars], float],
) -> Response:
    """Return how the answered number of a solution responds to the equations."""
    x = correction.x
    gradient = scalar_gradient(read, x[-4:])
    wanted = np.zeros((problem.size, 5))
    wanted[-4:, 0], wanted[-4:, 1:] = gradient, np.eye(4)
    _, jacobian = problem.linearise(x)
    _, border = rows(*given)(x[-4:])
    with one_thread:
        responses, sizes = adjoint(jacobian, border, wanted, x)
    own = responses[:, 0]
    by_given = np.abs(own[-len(given) :] @ sensitivity_to_given(given, x[-4:]))
    # p/T0 enters as 1 - p/T0 and lambda as pi^4 + lambda: their rounding is that of the larger.
    terms = {"pressure": 1.0, "lam": PI4}
    given_sizes = np.array([max(abs(c.value), terms.get(c.kind, 0.0)) for c in given])
    residues = np.linalg.norm(own * sizes * units_lost(problem, len(sizes)))  # of independent signs
    digits = abs(read(problem.scalars(x))) + float(by_given @ given_sizes)
    update = abs(float(gradient @ correction.update[-4:]))
    asked = [d for d, c in zip(by_given, given, strict=True) if c.kind != "ratio"]
    norms = np.linalg.norm(responses, axis=0)
    return Response(
        rounding=4.0 * update + EPS * (float(residues) + 2.0 * digits),
        condition=float(max(asked)),
        leverage=norms[0] / norms[1:],
    )


def units_lost(problem: Discretisation, count: int) -> np.ndarray:
    """Units in the last place of its terms that each of ``count`` equations of this problem may lose."""
    units = np.full(count, UNITS)
    if isinstance(problem, ShootingDiscretisation):
        units[problem.defects] = UNITS_OF_STAGES
    return units


def adjoint(
    jacobian: np.ndarray | sp.csc_matrix, border: np.ndarray, gradient: np.ndarray, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Solve with the transposed Jacobian; also the size of the terms of every equation.

    ``gradient`` has shape (n,), or (n, k) for k answers.
    """
    if isinstance(jacobian, np.ndarray):
        matrix = np.zeros((len(x), len(x)))
        matrix[: -len(border)] = jacobian
        matrix[-len(border) :, -4:] = border
        factors, pivots, info = dgetrf(matrix)
        if info != 0:
            raise np.linalg.LinAlgError("singular Jacobian")
        # One right side at a time: LAPACK spreads several over threads, however small the matrix.
        solved = [dgetrs(factors, pivots, column, trans=1)[0] for column in np.atleast_2d(gradient.T)]
        return np.reshape(np.transpose(solved), gradient.shape), np.abs(matrix) @ np.abs(x)
    wide = sp.csc_matrix(np.pad(border, ((0, 0), (len(x) - 4, 0))))
    sparse = sp.vstack([jacobian, wide]).tocsc()
    return splu(sparse).solve(gradient, "T"), abs(sparse) @ np.abs(x)


def scalar_gradient(read: Callable[[Scalars], float], scalars: np.ndarray) -> np.ndarray:
    """Gradient of the answered number, by complex steps."""
    h = 1e-30
    return np.array([read(Scalars(*(scalars + 1j * h * e))).imag / h for e in np.eye(4)])
