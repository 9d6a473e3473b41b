"""Energies along a branch, honestly named.

Bending energy U and the work of separation Phi are functions of the shape.  The pressure's
work is not: a free end sweeps area, so the swept area S depends on the path, here the
branch.  Along it, in the plate's frame, every equilibrium satisfies

    dU + dPhi = p dS,

where a material point moves only while it is detached.  Everything is per unit width, in
units of T0 eta^2 for energies and eta^2 for areas.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import overload

import casadi as ca
import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.optimize import brentq

from ..base.arrays import Columns
from ..base.errors import InvalidInput, NotConverged
from ..base.quadrature import Grid, gauss
from ..base.threads import one_thread
from ..continuation.family import Family
from ..continuation.points import Point
from ..equilibria.branch import Branch, require_branch
from ..equilibria.branch_points import discretised, law_of, transcription_of, walked
from ..equilibria.result import Equilibrium
from ..model.bond import CohesiveLaw
from ..residual.closures import Closure
from ..residual.discretisation import Discretisation
from .energy_terms import EnergyTerms, energy_terms

#: Gauss points per phase; the balance is then met to 1e-10 wherever the branch is.
POINTS = 32


@dataclass(frozen=True, eq=False, repr=False)
class Energies(Columns):
    """Energies along a branch; arrays have shape (n,).

    Parameters
    ----------
    A : ndarray
        Minus the tip angle [rad], which runs along the branch.
    pressure_ratio : ndarray
    bending : ndarray
        U / (T0 eta^2).
    separation : ndarray
        Phi / (T0 eta^2).
    swept : ndarray
        S / eta^2, from the straight rod at the start of the branch on.
    swept_error : float
        Largest error of ``swept``, the sum over all intervals of how far two rules of integration part.
    imbalance : ndarray
        |dU + dPhi - p dS| over the sum of the magnitudes, at each point.
    """

    A: np.ndarray
    pressure_ratio: np.ndarray
    bending: np.ndarray
    separation: np.ndarray
    swept: np.ndarray
    swept_error: float
    imbalance: np.ndarray

    @property
    def gamma(self) -> np.ndarray:
        """Gamma = U + Phi - p S, zero for the straight rod; d Gamma = -S dp along the branch."""
        return self.bending + self.separation - self.pressure_ratio * self.swept

    def equal_area_pressure(self) -> float:
        """p/T0 at which Gamma returns to zero, on the folded part.

        The two areas between this pressure and the branch in the (p, S) plane are equal.  It
        belongs to the path along the branch; it is not where an energy changes its minimum.
        `equal_area_error` says how well it is known.

        Raises
        ------
        NotConverged
            If Gamma is not seen to return to zero on the branch.
        """
        return self._returned(np.arange(len(self.A)))

    def _returned(self, rows: np.ndarray) -> float:
        """`equal_area_pressure` by the splines through some of the points."""
        i, gamma = self._return(), self.gamma
        spline, P = (CubicSpline(self.A[rows], values[rows]) for values in (gamma, self.pressure_ratio))
        beyond = self.A[rows[rows > i][0]]
        return float(P(brentq(spline, self.A[i], beyond, xtol=1e-13)))

    def equal_area_error(self) -> float:
        """Error of `equal_area_pressure`, in p/T0.

        As dGamma = -S dp, an error of the swept area moves the pressure by p/S times itself.  To it comes
        the distance from what Gamma and its slope -S at the two neighbouring points give, or from what
        every second point gives, whichever is larger.

        Raises
        ------
        NotConverged
            As for `equal_area_pressure`.
        """
        i, found = self._return(), self.equal_area_pressure()
        near = np.array([i, i + 1])
        p, gamma, swept = self.pressure_ratio[near], self.gamma[near], self.swept[near]
        order = np.argsort(p)
        local = CubicHermiteSpline(p[order], gamma[order], -swept[order])
        every_second = np.unique([*range(i % 2, len(self.A), 2), len(self.A) - 1])
        others = brentq(local, *p, xtol=1e-15), self._returned(every_second)
        return found * self.swept_error / float(swept.min()) + max(abs(found - other) for other in others)

    def _return(self) -> int:
        """Index of the last point before Gamma returns to zero."""
        gamma = self.gamma
        turns = np.flatnonzero((gamma[1:-1] > 0.0) & (gamma[2:] <= 0.0))
        if not turns.size:
            raise NotConverged(
                "a return of Gamma to zero was not met on this branch.", remedy="Trace it to contact."
            )
        return int(turns[0]) + 1


@overload
def energies(subject: Branch) -> Energies: ...


@overload
def energies(subject: Equilibrium) -> EnergyTerms: ...


def energies(subject: Branch | Equilibrium) -> Energies | EnergyTerms:
    """Return the energies of a state, or those along a rod's branch that starts at the straight rod.

    Between its points a branch is solved at further tip angles, so that the swept area is
    integrated by Gauss's rule whatever the spacing.

    Parameters
    ----------
    subject : Branch or Equilibrium
        A branch of a rod from `peel_opt.trace`, or a state of a rod or a scene.

    Returns
    -------
    Energies or EnergyTerms

    Raises
    ------
    InvalidInput
        If the branch is not one of a single rod that starts at T, or the state comes from a file.
    NotConverged
        If it cannot be solved between its points, or again on a finer mesh.
    """
    if isinstance(subject, Equilibrium):
        return energy_terms(subject)
    return _along(subject)


@one_thread
def _along(branch: Branch) -> Energies:
    if isinstance(branch, Branch) and branch.scene is not None:
        raise InvalidInput(
            "energies are integrated along the branch of a rod, and this is that of a scene.",
            remedy="Take them state by state, as energies(branch[i]).",
        )
    if require_branch(branch).hold != "ratio" or branch.A[0] != 0.0 or branch.solutions is None:
        raise InvalidInput(
            "energies are counted from T on, along the branch of one rod.",
            remedy="Use trace(rod), under a law that is smooth at u = 0.",
        )
    family, rows = family_along(branch), []
    for i, tangent in enumerate(branch.solutions.tangents):
        problem, x = discretised(branch, i)
        rows.append(_rates(family.law, problem, x, tangent))
    U, Phi, dU, dPhi, dS, dA = np.array(rows).T
    P = branch.pressure_ratio
    areas, errors = _areas(branch, family, dS / dA)
    size = np.abs(dU) + np.abs(dPhi) + np.abs(P * dS)
    gap = np.abs(dU + dPhi - P * dS)
    imbalance = np.divide(gap, size, out=np.zeros_like(gap), where=size > 1e-9)
    swept = np.concatenate([[0.0], np.cumsum(areas)])
    return Energies(branch.A, P, U, Phi, swept, float(np.sum(errors)), imbalance)


def family_along(branch: Branch) -> Family:
    """Return the family of equilibria that a branch of a rod is a walk along."""
    return Family(law_of(branch), transcription_of(branch), Closure("ratio", branch.held))


def swept_rate(family: Family, here: Point, there: Point, A: float) -> tuple[float, Point]:
    """Return dS/dA where the tip has turned by A, between two neighbouring points, and the point there.

    Raises
    ------
    NotConverged
        If there is no solution.
    """
    ends = {p.scalars.A: p for p in (here, there)}
    point = ends.get(A) or family.at(here, there, Closure("amplitude", A))
    if point is None:
        raise NotConverged("the branch could not be solved between its points.", remedy="Trace more points.")
    *_, dS, dA = _rates(family.law, point.problem, point.x, point.tangent)
    return dS / dA, point


def _areas(branch: Branch, family: Family, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Area swept between neighbouring points, by Gauss's rule, and its distance from Simpson's."""
    nodes, weights = gauss(3)
    areas, errors = [], []
    for i, (here, there) in enumerate(pairwise(walked(branch))):
        a, b = float(branch.A[i]), float(branch.A[i + 1])
        inside = [swept_rate(family, here, there, a + (b - a) * node)[0] for node in nodes]
        area = (b - a) * float(weights @ inside)
        simpson = (b - a) / 6.0 * (rate[i] + 4.0 * inside[1] + rate[i + 1])
        areas.append(area)
        errors.append(abs(area - simpson))
    return np.array(areas), np.array(errors)


def _rates(law: CohesiveLaw, problem: Discretisation, x: np.ndarray, t: np.ndarray) -> list[float]:
    """U, Phi and the rates of U, Phi, S, A along a tangent."""
    nodes, weights = gauss(POINTS)
    fields, rates = (part.full() for part in _with_rates(problem)(x, t))
    s, d = problem.scalars(x), problem.scalars(t)
    lengths = problem.lengths(x)
    dl = problem.lengths(t) - np.eye(len(lengths))[-1]  # the last is 1 minus the others
    theta, turn, Y = (s.A * fields[:, i] for i in (0, 1, 4))
    dtheta, dturn, dY = (d.A * fields[:, i] + s.A * rates[:, i] for i in (0, 1, 4))
    phases = len(lengths)
    share = np.repeat(lengths, POINTS)
    dshare = np.repeat(dl, POINTS)
    w = np.tile(weights, phases)
    ratio = s.ratio
    u, du = ratio * s.sigma * Y, ratio * (d.sigma * Y + s.sigma * dY)
    work = np.array([law.separation_work(float(v)) for v in u])
    traction = np.array([law.traction(float(v)) for v in u])
    U = float(w @ (share * turn**2)) / (2.0 * s.sigma)
    dU = float(w @ (dshare * turn**2 + 2.0 * share * turn * dturn)) / (2.0 * s.sigma) - d.sigma / s.sigma * U
    Phi = s.sigma / ratio * float(w @ (share * work))
    dPhi = s.sigma / ratio * float(w @ (dshare * work + share * traction * du)) + d.sigma / s.sigma * Phi
    # Rates at fixed material points: subtract what the moving coordinates carry along.
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    dstarts = np.concatenate([[0.0], np.cumsum(dl)[:-1]])
    zeta = np.tile(nodes, phases)
    xi = np.repeat(starts, POINTS) + share * zeta
    carried = d.sigma * xi + s.sigma * (np.repeat(dstarts, POINTS) + dshare * zeta)
    spin = dtheta - carried * turn / s.sigma
    inside = np.kron(np.diag(lengths), Grid.gauss(POINTS).to_right)
    after = np.kron(np.triu(np.ones((phases, phases)), 1) * lengths, np.ones((POINTS, 1)) * weights)
    outward = s.sigma * (inside + after)
    vx, vy = outward @ (np.sin(theta) * spin), -outward @ (np.cos(theta) * spin)
    dS = s.sigma * float(w @ (share * (-np.sin(theta) * vx + np.cos(theta) * vy)))
    return [U, Phi, dU, dPhi, dS, d.A]


@lru_cache(maxsize=64)  # a branch is on a few meshes
def _with_rates(problem: Discretisation) -> ca.Function:
    """Compiled (x, t) -> fields at the Gauss nodes of every phase and their rates along t."""
    t = ca.MX.sym("t", problem.size)
    sample = problem.sample_expression(gauss(POINTS)[0])
    rate = ca.reshape(ca.jtimes(ca.vec(sample), problem.x, t), *sample.shape)
    return ca.Function("rates", [problem.x, t], [sample, rate])
