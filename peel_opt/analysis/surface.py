"""The surface of solutions near one of them: how a number moves with what is given.

(12) with (14) leaves two of its scalars open, so its solutions form a surface.  With the two
closures of a question, the implicit function theorem on the discretised residual,

    [R_x; E_x] dx = -[0; E_given] d(given),

gives the exact gradient of any number of the discrete solution.  The mesh is refined until two
gradients agree; what rounding leaves of the solution is carried along the branch, since near a
fold of the question it is what the gradient knows least about.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.errors import AtFold, NotConverged
from ..base.threads import one_thread
from ..equilibria.question import Measure
from ..model.equations import Scalars
from ..residual.accuracy import response
from ..residual.closures import Closure, chart
from ..residual.discretisation import Discretisation, Phases, Profile, Transcription
from ..residual.linear import Linearised
from ..residual.linear import gradient as by_scalars
from ..residual.newton import correct
from ..residual.shape import Solution
from ..residual.spectral import Spectral

#: Relative difference of two gradients, one mesh apart, at which refinement stops.
AGREED = 1e-11

#: How often a mesh may be refined.
MOST_REFINEMENTS = 4

#: Rounding of one solve of the linearised system, relative to the larger derivative.
SOLVE_ROUNDING = 1e-12

#: Relative error from which on a gradient counts as unknown.
UNKNOWN = 0.1


@dataclass(frozen=True, eq=False)
class Gradient:
    """A number and its derivatives with respect to the two given ones.

    Parameters
    ----------
    value : float
    derivatives, errors : ndarray, shape (2,)
        In the order of the closures; the errors are absolute.
    given : ndarray, shape (2,)
    """

    value: float
    derivatives: np.ndarray
    errors: np.ndarray
    given: np.ndarray


@dataclass(frozen=True, eq=False)
class _Plane:
    """Tangent plane at the solution on one mesh, and along the branch by the error of rounding."""

    transcription: Transcription
    profile: Profile
    scalars: Scalars
    gradient: np.ndarray
    noise: np.ndarray


@one_thread
def gradient(source: Solution, held: tuple[Measure, Measure], read: Callable[[Scalars], float]) -> Gradient:
    """Differentiate a number of a solution with respect to two given ones.

    Parameters
    ----------
    source : Solution
        On any mesh, by any method.
    held : tuple of Measure
        What stays given.  At beta0 = 0 the first derivative, there
        with respect to sbar/eta, is the one with respect to beta0.
    read : callable
        The number as a function of the scalars.

    Raises
    ------
    AtFold
        If the question folds there, to what the solution is known to.
    NotConverged
        If the solution is lost on a finer mesh.
    """
    problem, x = source.problem, source.x
    scalars = problem.scalars(x)
    given = tuple(Closure(measure.kind, float(measure.read(scalars))) for measure in held)
    mesh = problem.settings
    # A spectral form as small as it may be; at beta0 = 0 it is what is affine in beta0.
    if mesh is None or isinstance(mesh, Spectral) or scalars.sigma == 0.0:
        mesh = Spectral()
    plane = _plane(mesh, problem.phases, problem.profile(x), given, read)
    for _ in range(MOST_REFINEMENTS):
        coarse = plane
        plane = _plane(coarse.transcription.refined(), problem.phases, coarse.profile, given, read)
        size = float(np.max(np.abs(plane.gradient)))
        gap = np.abs(plane.gradient - coarse.gradient)
        errors = gap + plane.noise + SOLVE_ROUNDING * size
        if (gap <= np.maximum(AGREED * size, plane.noise)).all():
            break
    if not float(np.max(errors)) <= UNKNOWN * size:
        raise _at_fold(given)
    values = np.array([c.value for c in given])
    return Gradient(float(read(plane.scalars)), plane.gradient, errors, values)


def _plane(
    transcription: Transcription,
    phases: Phases,
    profile: Profile,
    given: tuple[Closure, ...],
    read: Callable[[Scalars], float],
) -> _Plane:
    """Solve again on a mesh and differentiate there."""
    problem = transcription.discretise(phases)
    start = problem.pack(profile)
    correction = correct(problem, start, given)
    if not correction.converged:
        if _turns(problem, start, given):
            raise _at_fold(given)
        raise NotConverged(
            f"the solution was lost on {transcription!r} while differentiating it.",
            remedy="Compute the equilibrium with a smaller tol; where the tip has come down on the plate,"
            " take a state short of that.",
        )
    x, tail = correction.x, problem.tail
    at = Linearised.at(problem, x, *given)
    exact = _moves(at, given, read)
    unit = at.tangent()
    along = (chart(at.tail)[1] @ unit[tail]) @ chart(at.tail)[1]
    own = response(at, correction.update, lambda s: along @ np.array(s.values))
    there = Linearised.at(problem, x + own.rounding * unit, *given)
    change = np.abs(_moves(there, given, read) - exact)
    return _Plane(transcription, problem.profile(x), problem.scalars(x), exact, change)


def _moves(at: Linearised, given: tuple[Closure, ...], read: Callable[[Scalars], float]) -> np.ndarray:
    """Derivatives of a number by those given, shape (2,)."""
    return by_scalars(read, at.tail) @ _responses(at, given)[at.problem.tail]


def _responses(at: Linearised, given: tuple[Closure, ...]) -> np.ndarray:
    """dx/d(given), shape (n, 2); at beta0 = 0 the first is by beta0."""
    try:
        moves = at.response()
        if given[0] == Closure("length", 0.0):
            right = np.append(-strength_column(at.problem, at.x), np.zeros(len(at.border)))
            moves[:, 0] = at.factors.solve(right)
    except (np.linalg.LinAlgError, RuntimeError):
        raise _at_fold(given) from None
    return moves


def strength_column(problem: Discretisation, x: np.ndarray) -> np.ndarray:
    """dR/dbeta0 at beta0 = 0, where sigma = beta0^(1/3) has no derivative.

    The spectral residual of the linear law is affine in beta0, so a difference is exact.
    """
    ahead, behind = x.copy(), x.copy()
    sigma = problem.column("sigma")
    ahead[sigma], behind[sigma] = 1.0, -1.0  # beta0 = 1 and -1
    return 0.5 * (problem.residual(ahead) - problem.residual(behind))


def _turns(problem: Discretisation, x: np.ndarray, given: tuple[Closure, ...]) -> bool:
    """Whether the second given number hardly moves along the branch at this guess."""
    at = Linearised.at(problem, x, *given)
    try:
        along = _responses(at, given)[problem.tail, 1]
    except AtFold:
        return True
    return bool(np.linalg.norm(chart(at.tail)[1] @ along) > 1e6)


def _at_fold(given: tuple[Closure, ...]) -> AtFold:
    turning = given[1]
    name = {"length": "detached length", "pressure": "pressure", "lam": "lambda"}[turning.kind]
    value = turning.value if math.isfinite(turning.value) else math.nan
    return AtFold(
        f"the {name} turns round at this equilibrium ({turning.kind} = {value:.10g}): the answer has no"
        " derivative with respect to it, nor to the material.",
        remedy="Differentiate what is smooth there: the extreme value itself, by"
        " sensitivities(rod, 'readhesion_pressure'), 'least_length' or 'longest_length'.",
    )
