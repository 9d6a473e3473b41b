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

import casadi as ca
import numpy as np

from ..base.errors import AtFold, NotConverged
from ..base.threads import one_thread
from ..model.equations import Scalars
from ..residual.arclength import chart
from ..residual.closures import Closure, rows, sensitivity_to_given
from ..residual.discretisation import Discretisation, Phases, Profile, Transcription
from ..residual.newton import correct, factorised
from ..residual.rounding import response
from ..residual.shape import Solution
from ..residual.transcriptions import Spectral

#: Relative difference of two gradients, one mesh apart, at which refinement stops.
AGREED = 1e-11

#: How often a mesh may be refined.
MOST_REFINEMENTS = 4

#: Rounding of one solve of the linearised system, relative to the larger derivative.
SOLVE_ROUNDING = 1e-12

#: Relative error from which on a gradient counts as unknown.
UNKNOWN = 0.1

#: The value that each closure has at a solution.
HELD: dict[str, Callable[[Scalars], float]] = {
    "ratio": lambda s: s.ratio,
    "length": lambda s: s.sigma,
    "pressure": lambda s: s.pressure_ratio,
    "lam": lambda s: s.lam,
}


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
def gradient(source: Solution, kinds: tuple[str, str], read: Callable[[Scalars], float]) -> Gradient:
    """Differentiate a number of a solution with respect to two given ones.

    Parameters
    ----------
    source : Solution
        On any mesh, by any method.
    kinds : tuple of str
        The closures that stay given, keys of `HELD`.  At beta0 = 0 the first derivative, there
        with respect to "length", is the one with respect to beta0.
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
    given = tuple(Closure(kind, float(HELD[kind](scalars))) for kind in kinds)
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
    x = correction.x
    here, along = _responses(problem, x, given)
    gradient = _read_gradient(read, x[-4:])
    unit, weight = _unit(x, along)
    own = response(problem, correction, given, lambda s: weight @ np.array([s.A, s.m, s.sigma, s.lam]))
    moved = x + own.rounding * unit
    there, _ = _responses(problem, moved, given)
    exact = gradient @ here[-4:]
    change = np.abs(_read_gradient(read, moved[-4:]) @ there[-4:] - exact)
    return _Plane(transcription, problem.profile(x), problem.scalars(x), exact, change)


def _responses(
    problem: Discretisation, x: np.ndarray, given: tuple[Closure, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """dx/d(given), shape (n, 2), and the direction of the branch along which the first stays."""
    _, jacobian = problem.linearise(x)
    _, border = rows(*given)(x[-4:])
    right = np.zeros((len(x), 2), order="F")
    right[-2:] = -sensitivity_to_given(given, x[-4:])
    if given[0].kind == "length" and given[0].value == 0.0:
        right[:, 0] = 0.0
        right[:-2, 0] = -strength_column(problem, x)
    try:
        found = factorised(jacobian, border).solve(right)
    except (np.linalg.LinAlgError, RuntimeError):
        raise _at_fold(given) from None
    return found, found[:, 1]


def strength_column(problem: Discretisation, x: np.ndarray) -> np.ndarray:
    """dR/dbeta0 at beta0 = 0, where sigma = beta0^(1/3) has no derivative.

    The spectral residual of the linear law is affine in beta0, so a difference is exact.
    """
    ahead, behind = x.copy(), x.copy()
    ahead[-2], behind[-2] = 1.0, -1.0  # beta0 = 1 and -1
    return 0.5 * (problem.residual(ahead) - problem.residual(behind))


def _unit(x: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scale a direction to length 1 in the chart; with the weights that read this length off scalars."""
    _, metric = chart(x[-4:])
    unit = along / np.linalg.norm(metric @ along[-4:])
    return unit, (metric @ unit[-4:]) @ metric


def _read_gradient(read: Callable[[Scalars], float], scalars: np.ndarray) -> np.ndarray:
    """Gradient of a number with respect to the four scalars."""
    s = ca.SX.sym("s", 4)
    expression = read(Scalars(*ca.vertsplit(s)))
    return ca.Function("read", [s], [ca.densify(ca.gradient(expression, s))])(scalars).full().ravel()


def _turns(problem: Discretisation, x: np.ndarray, given: tuple[Closure, ...]) -> bool:
    """Whether the second given number hardly moves along the branch at this guess."""
    try:
        _, along = _responses(problem, x, given)
    except AtFold:
        return True
    _, metric = chart(x[-4:])
    return bool(np.linalg.norm(metric @ along[-4:]) > 1e6)


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
