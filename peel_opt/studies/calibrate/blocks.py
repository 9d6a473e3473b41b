"""One observation as a block of unknowns: (12), (14) as constraints, measurements as residuals.

The unknowns of a block are those of its transcription, u = (x, feet, origin), where the feet say
which points of the rod measured points belong to.  All observations share the logarithms q of
(k, T0, y0) over those of a reference rod, in whose T0 and eta everything here is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ...model.equations import Scalars, sin_over
from ...residual.closures import EQUATIONS
from ...residual.discretisation import Phases
from ...residual.spectral import SpectralDiscretisation, gauss
from ...residual.transcriptions import Spectral

#: Entries of a block's data before those of measured points: length, pressure, one over their
#: standard deviations, and the reference rod's eta/y0.
HEAD = 5


@dataclass(frozen=True)
class Signature:
    """What blocks with the same equations have in common.

    Parameters
    ----------
    phases : tuple of Piece
    nodes : int
        Of the spectral form, in each phase.
    length, pressure : {"exact", "measured", "unknown"}
        "exact" is a constraint, "measured" a residual.
    feet : tuple of int
        Measured points by the phase they belong to.
    at_tip, on_plate : int
        Measured points nearest to the tip itself, and to the attached part.
    free_origin : bool
        Whether the x of the detachment point is an unknown.
    """

    phases: Phases
    nodes: int
    length: str
    pressure: str
    feet: tuple[int, ...] = ()
    at_tip: int = 0
    on_plate: int = 0
    free_origin: bool = False

    @property
    def points(self) -> int:
        """Measured points of the shape."""
        return sum(self.feet) + self.at_tip + self.on_plate


class Block:
    """The compiled equations of one observation.

    Parameters
    ----------
    signature : Signature

    Attributes
    ----------
    unknowns, constraints, rows : int
        Sizes of u, of g(u, q) = 0 and of the weighted residuals r(u, q).
    items : ndarray of int, shape (rows,)
        Rows of one item, a pair or a measured point, are weighed together by a robust loss.
    """

    def __init__(self, signature: Signature) -> None:
        self.signature = signature
        problem = Spectral(signature.nodes).discretise(signature.phases)
        assert isinstance(problem, SpectralDiscretisation)
        self.problem = problem
        self.feet = sum(signature.feet)
        self.unknowns = problem.size + self.feet + signature.free_origin
        self.data = HEAD + 3 * signature.points
        self.u, self.q = ca.MX.sym("u", self.unknowns), ca.MX.sym("q", 3)
        self.d = ca.MX.sym("d", self.data)
        self._extra = self._questions()
        self._residual = ca.vertcat(self._measured_numbers(), self._measured_points())
        self.constraints = problem.size - 2 + int(self._extra.numel())
        self.rows = int(self._residual.numel())
        numbers = self.rows - 2 * signature.points
        points = 1 + np.repeat(np.arange(signature.points), 2)
        self.items = np.concatenate([np.zeros(numbers, int), points])

    # --- the model ----------------------------------------------------------------------

    @property
    def _scalars(self) -> Scalars:
        n = self.problem.size
        return Scalars(*ca.vertsplit(self.u[n - 4 : n]))

    @property
    def _eta(self) -> Any:
        """eta over that of the reference rod."""
        return ca.exp((self.q[0] - self.q[1]) / 3)

    def _questions(self) -> Any:
        """The rod's eta/y0, and what is known exactly."""
        s, d = self._scalars, self.d
        rows = [EQUATIONS["ratio"](s, d[4] * self._eta * ca.exp(-self.q[2]))]
        if self.signature.length == "exact":
            rows.append(EQUATIONS["length"](s, d[0] / self._eta))
        if self.signature.pressure == "exact":
            rows.append(EQUATIONS["pressure"](s, d[1] * ca.exp(-self.q[1])))
        return ca.vertcat(*rows)

    def _measured_numbers(self) -> Any:
        s, d = self._scalars, self.d
        rows = []
        if self.signature.length == "measured":
            rows.append((s.sigma * self._eta - d[0]) * d[2])
        if self.signature.pressure == "measured":
            rows.append((s.pressure_ratio * ca.exp(self.q[1]) - d[1]) * d[3])
        return ca.vertcat(*rows) if rows else ca.MX(0, 1)

    def _measured_points(self) -> Any:
        """Distances (x, y) of the measured points from their feet, over their standard deviation."""
        signature = self.signature
        if not signature.points:
            return ca.MX(0, 1)
        zeta = self.u[self.problem.size : self.problem.size + self.feet]
        per_phase = ca.vertsplit(zeta, [0, *np.cumsum(signature.feet).tolist()])
        xy = self._curve([*per_phase, ca.DM.zeros(signature.at_tip)])
        plate = signature.on_plate
        points = ca.reshape(self.d[HEAD:], 3, signature.points).T  # x, y, 1/sd
        origin = self.u[self.unknowns - 1] if signature.free_origin else 0.0
        along = points[:, 0] - origin
        on_rod = signature.points - plate
        # The attached part has every x >= 0.
        off = ca.horzcat(
            ca.vertcat(xy[:, 0] - along[:on_rod], ca.MX.zeros(plate)),
            ca.vertcat(xy[:, 1], ca.MX.zeros(plate)) - points[:, 1],
        )
        return ca.vec((off * ca.repmat(points[:, 2], 1, 2)).T)

    def _curve(self, feet: list[Any]) -> Any:
        """x and y, in the reference eta, at local coordinates of each phase; the last at the tip."""
        problem = self.problem
        x = self.u[: problem.size]
        sample = ca.Function("sample", [problem.x], [problem.sample_expression(problem.zeta)])
        s = self._scalars
        Theta = sample(x)[:, 0]
        slopes = ca.horzcat(ca.cos(s.A * Theta), s.A * sin_over(s.A, Theta))
        free = ca.vertsplit(x[problem.field_count : problem.size - 4]) if len(problem.phases) > 1 else []
        lengths = [*free, 1 - sum(free)]
        n = self.signature.nodes
        whole = ca.DM(gauss(n)[1]).T
        start, found = ca.MX.zeros(1, 2), []
        for j, zeta in enumerate(feet[:-1]):
            mine = slopes[j * n : (j + 1) * n, :]
            if zeta.numel():
                inside = ca.mtimes(_integrals(n, zeta), mine)
                found.append(ca.repmat(start, zeta.numel(), 1) + lengths[j] * inside)
            start = start + lengths[j] * ca.mtimes(whole, mine)
        found.append(ca.MX.zeros(feet[-1].numel(), 2))
        places = ca.vertcat(*found)
        return s.sigma * self._eta * (places - ca.repmat(start, places.size1(), 1))

    # --- compiled -----------------------------------------------------------------------

    @cached_property
    def linearised(self) -> ca.Function:
        """(u, q, d) -> (g, dg/du, dg/dq, r, dr/du, dr/dq)."""
        n = self.problem.size
        residual, jacobian = self.problem.linearised(self.u[:n])
        widened = ca.horzcat(jacobian, ca.MX(n - 2, self.unknowns - n))
        extra, r = self._extra, self._residual
        outputs = [
            ca.vertcat(residual, extra),
            ca.vertcat(widened, ca.jacobian(extra, self.u)),
            ca.vertcat(ca.MX(n - 2, 3), ca.jacobian(extra, self.q)),
            r,
            ca.jacobian(r, self.u),
            ca.jacobian(r, self.q),
        ]
        return ca.Function("block", [self.u, self.q, self.d], outputs)

    @cached_property
    def values(self) -> ca.Function:
        """(u, q, d) -> (g, r)."""
        n = self.problem.size
        expression = ca.Function("residual", [self.problem.x], [self.problem.expression])(self.u[:n])
        g = ca.vertcat(expression, self._extra)
        return ca.Function("values", [self.u, self.q, self.d], [g, self._residual])

    @cached_property
    def curvature(self) -> ca.Function:
        """(u, q, d, multipliers) -> Hessian of multipliers g with respect to (q, u)."""
        g, _ = self.values(self.u, self.q, self.d)
        multipliers = ca.MX.sym("multipliers", self.constraints)
        hessian, _ = ca.hessian(ca.dot(multipliers, g), ca.vertcat(self.q, self.u))
        return ca.Function("curvature", [self.u, self.q, self.d, multipliers], [hessian])

    def evaluate(self, u: np.ndarray, q: np.ndarray, d: np.ndarray) -> list[np.ndarray]:
        """Return what `linearised` does as full arrays, vectors flat."""
        g, g_u, g_q, r, r_u, r_q = (part.full() for part in self.linearised(u, q, d))
        return [g.ravel(), g_u, g_q, r.ravel(), r_u, r_q]


def _integrals(nodes: int, zeta: Any) -> Any:
    """Matrix from values at Gauss nodes to integrals from 0 to symbolic ``zeta``."""
    t, weights = np.polynomial.legendre.leggauss(nodes)
    degrees = np.arange(nodes)
    to_series = (degrees + 0.5)[:, None] * np.polynomial.legendre.legvander(t, nodes - 1).T * weights
    z = 2 * zeta - 1
    legendre = [ca.MX.ones(zeta.numel()), z]
    for k in range(1, nodes):
        legendre.append(((2 * k + 1) * z * legendre[k] - k * legendre[k - 1]) / (k + 1))
    columns = [z + 1] + [(legendre[k + 1] - legendre[k - 1]) / (2 * k + 1) for k in range(1, nodes)]
    return 0.5 * ca.mtimes(ca.horzcat(*columns), ca.DM(to_series))


@lru_cache(maxsize=128)
def block(signature: Signature) -> Block:
    """Return the block of a signature, compiled once."""
    return Block(signature)
