"""How an answered number responds to the equations: what rounding does, and what a mesh may do.

Each equation of a discretised problem is a sum of terms, and its value cannot be known better
than to a few units in the last place of the largest of them.  The row of the inverse Jacobian
that belongs to the answered number says what such a residue does to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.arrays import EPS
from ..base.threads import one_thread
from ..model.equations import LowPressure, Scalars
from ..model.groups import PI4
from .closures import Closure
from .discretisation import Discretisation
from .linear import Linearised, gradient
from .shooting import ShootingDiscretisation

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
        What rounding does to the answer, and what Newton's method has left.
    unsettled : float
        The second of these alone.
    condition : float
        Largest derivative of the answer with respect to a given number other than the rod's.
    leverage : ndarray, shape (4,)
        How much further the same residues of the equations move the answer than each scalar.
    """

    rounding: float
    unsettled: float
    condition: float
    leverage: np.ndarray


def response(at: Linearised, update: np.ndarray, read: Callable[[Scalars], float]) -> Response:
    """Return how the answered number of a solution responds to the equations.

    Parameters
    ----------
    at : Linearised
        The solution, closed by what is given.
    update : ndarray, shape (n,)
        The last of Newton's method.
    read : callable
        The answered number.
    """
    weights = np.zeros(at.problem.size)
    weights[at.problem.tail] = gradient(read, at.tail, at.problem.form)
    return response_to(at, update, weights, read(at.problem.scalars(at.x)))


def response_to(at: Linearised, update: np.ndarray, weights: np.ndarray, value: float) -> Response:
    """Return how a number of a solution responds to the equations.

    Parameters
    ----------
    at : Linearised
        The solution, closed by what is given.
    update : ndarray, shape (n,)
        The last of Newton's method.
    weights : ndarray, shape (n,)
        Gradient of the number by all unknowns.
    value : float
        The number itself.
    """
    problem, given = at.problem, [closure for closure in at.closing if isinstance(closure, Closure)]
    scalars = np.eye(problem.size)[:, problem.tail]
    with one_thread:
        responses = at.factors.solve(np.column_stack([weights, scalars]), transposed=True)
        sizes = at.sizes
    own = responses[:, 0]
    by_given = np.abs(own[-len(given) :] @ at.by_given)
    # p/T0 enters as 1 - p/T0, but where it is small, and lambda as pi^4 + lambda: their rounding is
    # that of the larger.
    terms = {"pressure": 0.0 if problem.form is LowPressure else 1.0, "lam": PI4}
    given_sizes = np.array([max(abs(c.value), terms.get(c.kind, 0.0)) for c in given])
    residues = np.linalg.norm(own * sizes * units_lost(problem, len(sizes)))  # of independent signs
    digits = abs(value) + float(by_given @ given_sizes)
    unsettled = 4.0 * abs(float(weights @ update))
    asked = [d for d, c in zip(by_given, given, strict=True) if c.kind != "ratio"]
    norms = np.linalg.norm(responses, axis=0)
    return Response(
        rounding=unsettled + EPS * (float(residues) + 2.0 * digits),
        unsettled=unsettled,
        condition=float(max(asked)),
        leverage=norms[0] / norms[1:],
    )


def units_lost(problem: Discretisation, count: int) -> np.ndarray:
    """Units in the last place of its terms that each of ``count`` equations of this problem may lose."""
    units = np.full(count, UNITS)
    if isinstance(problem, ShootingDiscretisation):
        units[problem.defects] = UNITS_OF_STAGES
    return units
