"""Gauss-Legendre collocation on a mesh that follows the solution.

The five fields are unknown at the mesh points, so that every interval touches only its two
ends; inside an interval Theta'' at the stages is the only further unknown, because the other
fields follow from it by quadrature, one after the other.  That is 5 + s unknowns per interval
where lifting all stage values takes 5 + 5 s, and there is no inner iteration to eliminate them.

The breakpoints travel with the unknowns.  `pack` chooses them for the profile it is given, and
the equations zeta = round(zeta) to a fine quantum keep them there: their gradient is exact, the
update of a breakpoint is zero, and one compiled function serves every mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..base.checks import whole
from ..base.errors import InvalidInput
from ..base.quadrature import gauss, integration_matrix
from ..model.bond import Piece
from ..model.equations import Scalars, bending, rhs, sin_over, symbolic, vertical_load
from .discretisation import Discretisation, FixedOrder, Phases, Profile, switch_equations
from .mesh import QUANTUM, RESOLUTION, equidistributing, uniform
from .shooting import runge_kutta, tableau

MESHES = ("adapted", "uniform")


@dataclass(frozen=True)
class Collocation(FixedOrder):
    """Gauss-Legendre collocation.

    Parameters
    ----------
    intervals : int
        Intervals per phase.
    stages : int
        Gauss points per interval; the order at the mesh points is twice that.
    mesh : {"adapted", "uniform"}
        Intervals that share the error of the shape started from, or equal ones.

    Raises
    ------
    InvalidInput
        If a count is not positive or the mesh is unknown.
    """

    intervals: int = 10
    stages: int = 4
    mesh: str = "adapted"

    def __post_init__(self) -> None:
        if not isinstance(self.mesh, str) or self.mesh not in MESHES:
            raise InvalidInput(f"unknown mesh {self.mesh!r}.", remedy=f"Choose one of {', '.join(MESHES)}.")
        for name in ("intervals", "stages"):
            object.__setattr__(self, name, whole(name, getattr(self, name), 1))

    @property
    def order(self) -> int:
        """Order at the mesh points."""
        return 2 * self.stages

    def discretise(self, phases: Phases) -> CollocationDiscretisation:
        """Return the compiled problem for these phases."""
        return _discretise(self, phases)


class CollocationDiscretisation(Discretisation):
    """Fields at all mesh points, Theta'' at all stages, breakpoints of every phase."""

    settings: Collocation

    def __init__(self, settings: Collocation, phases: Phases) -> None:
        self.settings = settings
        self.total = settings.intervals * len(phases)
        inner = settings.intervals - 1
        super().__init__(phases, 5 * (self.total + 1) + settings.stages * self.total + inner * len(phases))
        self.points, self.weights = gauss(settings.stages)
        self.to_stages = integration_matrix(settings.stages, self.points)

    def _parts(self) -> tuple[ca.MX, ca.MX, list[ca.MX], list[ca.MX], ca.MX]:
        """States 5 x points, Theta'' stages x intervals, breaks and lengths of phases, scalars."""
        fields, lengths, tail = self.symbols()
        states = 5 * (self.total + 1)
        stages = states + self.settings.stages * self.total
        inner = self.settings.intervals - 1
        breaks = [fields[stages + j * inner : stages + (j + 1) * inner] for j in range(len(self.phases))]
        edges = [ca.vertcat(0, b, 1) for b in breaks]
        curl = ca.reshape(fields[states:stages], self.settings.stages, self.total)
        return ca.reshape(fields[:states], 5, self.total + 1), curl, edges, lengths, tail

    def _interval(self, piece: Piece) -> ca.Function:
        """(12a) at the stages and the state at the end, of (state, Theta'', length, scalars)."""
        state, curl = ca.SX.sym("state", 5), ca.SX.sym("curl", self.settings.stages)
        length, (s, scalars) = ca.SX.sym("length"), symbolic()
        Theta0, K0, nx0, ny0, Y0 = ca.vertsplit(state)

        def integrated(start: Any, slope: Any) -> tuple[Any, Any]:
            inside, end = ca.mtimes(self.to_stages, slope), ca.mtimes(self.weights[None], slope)
            return start + length * inside, start + length * end

        K, K1 = integrated(K0, curl)
        Theta, Theta1 = integrated(Theta0, K)
        slope = sin_over(scalars.A, Theta)
        Y, Y1 = integrated(Y0, slope)
        nx, nx1 = integrated(nx0, -scalars.alpha * slope)
        ny, ny1 = integrated(ny0, vertical_load(Theta, Y, scalars, piece))
        balance = curl - bending(Theta, nx, ny, scalars)
        end = ca.vertcat(Theta1, K1, nx1, ny1, Y1)
        return ca.Function("interval", [state, curl, length, s], [balance, end])

    def residual_expression(self) -> ca.MX:
        """Boundary conditions, balance and end of every interval, switches, the mesh."""
        states, curl, edges, lengths, tail = self._parts()
        m = self.settings.intervals
        equations = []
        for j, (piece, length) in enumerate(zip(self.phases, lengths, strict=True)):
            mine, after = slice(j * m, (j + 1) * m), slice(j * m + 1, (j + 1) * m + 1)
            steps = length * (edges[j][1:] - edges[j][:-1]).T
            inputs = (states[:, mine], curl[:, mine], steps, ca.repmat(tail, 1, m))
            balance, end = self._interval(piece).map(m)(*inputs)
            equations.append(ca.vec(ca.vertcat(balance, end - states[:, after])))
        Theta, K, nx, ny, Y = ca.vertsplit(states[:, 0])
        Theta_end, K_end, _, _, Y_end = ca.vertsplit(states[:, -1])
        scalars = Scalars(*ca.vertsplit(tail))
        heights = [scalars.height(states[4, j * m]) for j in range(1, len(self.phases))]
        switches = switch_equations(self.phases, heights)
        edge = self.edge_equation(Theta_end, Y)
        pinned = [b - QUANTUM * ca.floor(b / QUANTUM + 0.5) for b in (e[1:-1] for e in edges)]
        return ca.vertcat(Theta + 1, K, nx, ny, *equations, edge, K_end, Y_end, *switches, *pinned)

    def sample_expression(self, zeta: np.ndarray) -> ca.MX:
        """Integrate explicitly from the mesh point before: the stage polynomial is of lower order."""
        states, _, edges, lengths, tail = self._parts()
        m, where = self.settings.intervals, ca.DM(np.asarray(zeta, dtype=float)).T
        samples = []
        for j, (piece, length) in enumerate(zip(self.phases, lengths, strict=True)):
            advance = _advance(piece).map(where.numel())
            # One in the row of the interval that holds the point: which it is, the mesh decides.
            after = ca.repmat(edges[j][1:-1], 1, where.numel()) <= ca.repmat(where, m - 1, 1)
            ones = ca.MX.ones(1, where.numel())
            holds = ca.vertcat(ones, after) - ca.vertcat(after, 0 * ones)
            start = ca.mtimes(states[:, j * m : (j + 1) * m], holds)
            share = where - ca.mtimes(edges[j][:-1].T, holds)
            samples.append(advance(start, length * share, ca.repmat(tail, 1, where.numel())).T)
        return ca.vertcat(*samples)

    def _breaks(self, profile: Profile, phase: int) -> np.ndarray:
        if self.settings.mesh == "uniform":
            return uniform(self.settings.intervals)
        Theta, _, nx, ny, _ = profile.in_phase(phase, np.linspace(0.0, 1.0, RESOLUTION)).T
        curl = np.asarray(bending(Theta, nx, ny, profile.scalars)).ravel()
        return equidistributing(curl, self.settings.intervals)

    def pack_fields(self, profile: Profile) -> np.ndarray:
        """Fields at the mesh points, Theta'' at the stages and the mesh itself."""
        states, curls, meshes = [], [], []
        for j in range(len(self.phases)):
            breaks = self._breaks(profile, j)
            edges = np.concatenate([[0.0], breaks, [1.0]])
            at_stages = edges[:-1, None] + np.diff(edges)[:, None] * self.points
            Theta, _, nx, ny, _ = profile.in_phase(j, at_stages.ravel()).T
            states.append(profile.in_phase(j, edges[:-1]).ravel())
            curls.append(np.asarray(bending(Theta, nx, ny, profile.scalars)).ravel())
            meshes.append(breaks)
        states.append(profile.in_phase(len(self.phases) - 1, np.ones(1)).ravel())
        return np.concatenate([*states, *curls, *meshes])


def _advance(piece: Piece) -> ca.Function:
    """Integrate (state, length, scalars) by two steps of an explicit method of order 8."""
    state, length, (s, scalars) = ca.SX.sym("state", 5), ca.SX.sym("length"), symbolic()

    def slope(z: ca.SX) -> ca.SX:
        return ca.vertcat(*rhs(z, scalars, piece))

    end = runge_kutta(slope, state, length, tableau("dop853"), 2)
    return ca.Function("advance", [state, length, s], [end])


@lru_cache(maxsize=128)
def _discretise(settings: Collocation, phases: Phases) -> CollocationDiscretisation:
    return CollocationDiscretisation(settings, phases)
