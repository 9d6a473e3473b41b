"""Constraints of a design as blocks of unknowns: the residual of (12) with the material free.

Every requirement brings its own discretised rod.  An equilibrium is R(x) = 0 with the rod's
ratio and what was given; a readhesion pressure is a fold, with its null vector as unknowns too:

    R(x) = 0,   R_x(x) v = 0,   dr(v) = dP(v) = 0,   v_A = 1.

The Maxwell length is a smooth function of eta/y0 alone and enters as a spline of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ...analysis.design_relations import LEAST_RATIO, maxwell_length
from ...base.errors import NoEquilibrium, NotConverged, PeelOptError
from ...continuation.primary import primary_branch
from ...equilibria.ask import length_given_pressure, pressure_given_length
from ...model.bond import COHESIVE
from ...model.equations import PI4, Scalars
from ...model.rod import Rod
from ...residual.closures import Closure, rows
from ...residual.discretisation import Discretisation
from ...residual.newton import factorised
from ...residual.programme import unknown_scale
from ...residual.shape import Solution
from ...residual.transcriptions import Spectral
from .targets import Requirement

#: Meshes of the programme; what it finds is asked for again by the public calls.  A fold has twice
#: the unknowns and one derivative more; on 16 nodes its pressure is good to 1e-9.
MESH, FOLD_MESH = Spectral(nodes=24), Spectral(nodes=16)

#: Smallest tip angle: the branch ends at T, where p = T0 and every flaw grows.
LEAST_AMPLITUDE = 1e-4

#: eta/y0 of the spline through the Maxwell points.
MAXWELL_RATIOS = (0.4997, 3000.0)
MAXWELL_KNOTS = 400


@dataclass(frozen=True)
class Structure:
    """What blocks with the same equations have in common.

    Parameters
    ----------
    quantity : str
        That of a `Requirement`.
    problem : Discretisation or None
        None where the quantity is a function of the material alone.
    """

    quantity: str
    problem: Discretisation | None

    @property
    def size(self) -> int:
        """Number of unknowns."""
        if self.problem is None:
            return 0
        return self.problem.size * (2 if self.quantity == "readhesion_pressure" else 1)

    def expressions(self, w: Any, logs: Any, log_given: Any) -> tuple[Any, Any]:
        """Return the constraints that vanish, and the logarithm of the quantity.

        Parameters
        ----------
        w : casadi.MX, shape (size,)
        logs : casadi.MX, shape (3,)
            log k, log T0, log y0.
        log_given : casadi.MX
            Logarithm of the length or pressure given.
        """
        log_eta = (logs[0] - logs[1]) / 3.0
        if self.quantity == "strength":
            return ca.MX(0, 1), logs[1]
        if self.quantity == "maxwell_length":
            return ca.MX(0, 1), log_eta + _log_maxwell(log_eta - logs[2])
        assert self.problem is not None
        n = self.problem.size
        x = w[:n]
        s = Scalars(*ca.vertsplit(x[n - 4 :]))
        ratio = ca.log(s.beta1) - 4.0 * ca.log(s.sigma) - (log_eta - logs[2])
        log_pressure, log_length = logs[1] + ca.log(s.pressure_ratio), log_eta + ca.log(s.sigma)
        if self.quantity == "readhesion_pressure":
            return ca.vertcat(_fold(self.problem)(x, w[n:]), ratio), log_pressure
        residual = _residual(self.problem)(x)
        if self.quantity == "pressure":
            return ca.vertcat(residual, ratio, log_length - log_given), log_pressure
        return ca.vertcat(residual, ratio, log_pressure - log_given), log_length


@dataclass(frozen=True, eq=False)
class Block:
    """A requirement, its unknowns at the start, and how large they are.

    Parameters
    ----------
    requirement : Requirement
    problem : Discretisation or None
    start, scale : ndarray
        Of all unknowns of the block.
    value : float
        Of the quantity at the start [SI].
    """

    requirement: Requirement
    problem: Discretisation | None
    start: np.ndarray
    scale: np.ndarray
    value: float

    @property
    def structure(self) -> Structure:
        """The equations."""
        return Structure(self.requirement.quantity, self.problem)

    @property
    def least(self) -> np.ndarray:
        """Lower bounds of the unknowns, which keep the logarithms defined."""
        lower = np.full(len(self.start), -math.inf)
        if self.problem is not None:
            n = self.problem.size
            lower[n - 4], lower[n - 2], lower[n - 1] = LEAST_AMPLITUDE, 1e-6, -PI4 * (1.0 - 1e-9)
        return lower


@lru_cache(maxsize=64)
def _residual(problem: Discretisation) -> ca.Function:
    return ca.Function("residual", [problem.x], [problem.expression])


@lru_cache(maxsize=64)
def _fold(problem: Discretisation) -> ca.Function:
    """(x, v) -> R, R_x v, and the derivatives of r and P along v, and v_A - 1."""
    n, x = problem.size, problem.x
    v = ca.MX.sym("v", n)
    s = Scalars(*ca.vertsplit(x[n - 4 :]))
    fixed = ca.vertcat(ca.log(s.beta1) - 4.0 * ca.log(s.sigma), s.alpha1 / s.beta0)
    along = ca.jtimes(ca.vertcat(problem.expression, fixed), x, v)
    return ca.Function("fold", [x, v], [ca.vertcat(problem.expression, along, v[n - 4] - 1.0)])


@lru_cache(maxsize=1)
def _maxwell_spline() -> tuple[ca.Function, float]:
    """log(sbar_M/eta) over log(eta/y0 - the least), in which its vertical tangent is smooth."""
    low, high = (math.log(r - LEAST_RATIO) for r in MAXWELL_RATIOS)
    knots = np.linspace(low, high, MAXWELL_KNOTS)
    ratios = LEAST_RATIO + np.exp(knots)
    values = np.log(maxwell_length(ratios, "branch") / ratios)
    return ca.interpolant("maxwell", "bspline", [knots.tolist()], values.tolist()), low


def _log_maxwell(log_ratio: Any) -> Any:
    spline, low = _maxwell_spline()
    least = math.exp(low)
    return spline(ca.log(ca.fmax(ca.exp(log_ratio) - LEAST_RATIO, least)))


def block_at(rod: Rod, requirement: Requirement) -> Block | None:
    """Return a requirement with its quantity solved for at a rod; None if it has none there."""
    maker: Callable[[Rod, Requirement], Block] = {
        "pressure": _equilibrium,
        "length": _equilibrium,
        "readhesion_pressure": _minimum,
        "maxwell_length": _scalar,
        "strength": _scalar,
    }[requirement.quantity]
    try:
        return maker(rod, requirement)
    except PeelOptError:
        return None


def _equilibrium(rod: Rod, requirement: Requirement) -> Block:
    asked = requirement.quantity
    ask = pressure_given_length if asked == "pressure" else length_given_pressure
    eq = ask(rod, requirement.given, tol=1e-6)
    assert isinstance(eq.source, Solution)
    own = eq.source.problem
    problem = MESH.discretise(own.phases)
    x = problem.pack(own.profile(eq.source.x))
    return Block(requirement, problem, x, unknown_scale(problem, x), float(getattr(eq, asked)))


def _minimum(rod: Rod, requirement: Requirement) -> Block:
    closure = Closure("ratio", rod.ratio)
    branch = primary_branch(COHESIVE, closure)
    fold = branch.reach("LP-pressure")
    if fold is None:
        raise NotConverged("the minimum pressure was not reached.")
    problem = FOLD_MESH.discretise(fold.point.problem.phases)
    x = problem.pack(fold.point.profile)
    _, ratio_row = rows(closure)(x[-4:])
    right = np.zeros(problem.size)
    right[-1] = 1.0
    border = np.vstack([ratio_row, [1.0, 0.0, 0.0, 0.0]])
    v = factorised(problem.linearise(x)[1], border).solve(right)
    scale = np.concatenate([unknown_scale(problem, x), unknown_scale(problem, v)])
    value = rod.pressure(fold.point.scalars.pressure_ratio)
    return Block(requirement, problem, np.concatenate([x, v]), scale, value)


def _scalar(rod: Rod, requirement: Requirement) -> Block:
    value = rod.adhesion_strength
    if requirement.quantity == "maxwell_length":
        low, high = MAXWELL_RATIOS
        if not low <= rod.ratio <= high:
            raise NoEquilibrium("no Maxwell length.")
        value = maxwell_length(rod.ratio, "branch") * rod.adhesion_range
    return Block(requirement, None, np.empty(0), np.empty(0), value)
