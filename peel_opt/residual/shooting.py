"""Direct multiple shooting: states at the ends of intervals, an integrator in between.

All five fields of (12) are unknown at every node; the defect of each interval, the boundary
conditions (14) and Theta(0) = -1 are the constraints.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ..base.checks import whole
from ..base.errors import InvalidInput
from ..model.bond import Piece
from ..model.equations import Scalars, rhs, symbolic
from .discretisation import Discretisation, FixedOrder, Phases, Profile, switch_equations


@dataclass(frozen=True)
class Tableau:
    """Explicit Runge-Kutta method for an autonomous system."""

    a: np.ndarray
    b: np.ndarray


#: Orders of the integrators by name.
INTEGRATORS = {"midpoint": 2, "rk4": 4, "dopri5": 5, "dop853": 8}


@lru_cache
def tableau(name: str) -> Tableau:
    """Return an integrator; the two of Dormand and Prince are SciPy's, which takes long to import."""
    if name == "midpoint":
        return Tableau(np.array([[0.0, 0.0], [0.5, 0.0]]), np.array([0.0, 1.0]))
    if name == "rk4":
        return Tableau(np.diag([0.5, 0.5, 1.0], -1), np.array([1.0, 2.0, 2.0, 1.0]) / 6.0)
    from scipy import integrate

    theirs = {"dopri5": integrate.RK45, "dop853": integrate.DOP853}[name]
    return Tableau(np.asarray(theirs.A), np.asarray(theirs.B))


@dataclass(frozen=True)
class Shooting(FixedOrder):
    """Multiple shooting.

    Parameters
    ----------
    intervals : int
        Shooting intervals per phase.
    integrator : {"dop853", "dopri5", "rk4", "midpoint"}
        Orders 8, 5, 4, 2.
    steps : int
        Steps of the integrator inside an interval.

    Raises
    ------
    InvalidInput
        If a count is not positive or the integrator is unknown.
    """

    intervals: int = 12
    integrator: str = "dop853"
    steps: int = 1

    def __post_init__(self) -> None:
        if not isinstance(self.integrator, str) or self.integrator not in INTEGRATORS:
            raise InvalidInput(
                f"unknown integrator {self.integrator!r}.", remedy=f"Choose one of {', '.join(INTEGRATORS)}."
            )
        for name in ("intervals", "steps"):
            object.__setattr__(self, name, whole(name, getattr(self, name), 1))

    @property
    def order(self) -> int:
        """Order of the integrator."""
        return INTEGRATORS[self.integrator]

    def discretise(self, phases: Phases) -> ShootingDiscretisation:
        """Return the compiled problem for these phases."""
        return _discretise(self, phases)


class ShootingDiscretisation(Discretisation):
    """The five fields at every node, neighbouring phases sharing one."""

    settings: Shooting

    def __init__(self, settings: Shooting, phases: Phases) -> None:
        self.settings = settings
        self.nodes = settings.intervals * len(phases) + 1
        super().__init__(phases, 5 * self.nodes)
        # Those between four at the tip and three at the plate.
        self.defects = slice(4, 4 + 5 * (self.nodes - 1))

    def _advance(self, piece: Piece, steps: int) -> ca.Function:
        """Integrate (state, length, scalars) over one interval."""
        state, length, (s, scalars) = ca.SX.sym("state", 5), ca.SX.sym("length"), symbolic()

        def slope(z: ca.SX) -> ca.SX:
            return ca.vertcat(*rhs(z, scalars, piece))

        end = runge_kutta(slope, state, length, tableau(self.settings.integrator), steps)
        return ca.Function("advance", [state, length, s], [end])

    def _states(self) -> tuple[ca.MX, list[ca.MX], ca.MX]:
        fields, lengths, tail = self.symbols()
        return ca.reshape(fields, 5, self.nodes), lengths, tail

    def residual_expression(self) -> ca.MX:
        """Boundary conditions (14), Theta(0) = -1, defects, y = y0 at the switches."""
        states, lengths, tail = self._states()
        m = self.settings.intervals
        defects = []
        for j, (piece, length) in enumerate(zip(self.phases, lengths, strict=True)):
            advance = self._advance(piece, self.settings.steps).map(m)
            first = states[:, j * m : (j + 1) * m]
            arrived = advance(first, ca.repmat(length / m, 1, m), ca.repmat(tail, 1, m))
            defects.append(ca.vec(arrived - states[:, j * m + 1 : (j + 1) * m + 1]))
        Theta, K, nx, ny, Y = ca.vertsplit(states[:, 0])
        Theta_end, K_end, _, _, Y_end = ca.vertsplit(states[:, -1])
        scalars = Scalars(*ca.vertsplit(tail))
        heights = [scalars.height(states[4, j * m]) for j in range(1, len(self.phases))]
        switches = switch_equations(self.phases, heights)
        edge = self.edge_equation(Theta_end, Y)
        return ca.vertcat(Theta + 1, K, nx, ny, *defects, edge, K_end, Y_end, *switches)

    def sample_expression(self, zeta: np.ndarray) -> ca.MX:
        """Integrate from the node before each point, as accurately as the defects are."""
        states, lengths, tail = self._states()
        m, count = self.settings.intervals, len(zeta)
        interval = np.minimum((np.asarray(zeta) * m).astype(int), m - 1)
        share = np.asarray(zeta) - interval / m
        samples = []
        for j, (piece, length) in enumerate(zip(self.phases, lengths, strict=True)):
            advance = self._advance(piece, self.settings.steps).map(count)
            start = states[:, [int(j * m + i) for i in interval]]
            samples.append(advance(start, length * ca.DM(share).T, ca.repmat(tail, 1, count)).T)
        return ca.vertcat(*samples)

    def pack_fields(self, profile: Profile) -> np.ndarray:
        """Fields of a profile at the nodes."""
        zeta = np.linspace(0.0, 1.0, self.settings.intervals + 1)
        blocks = [profile.in_phase(j, zeta)[:-1] for j in range(len(self.phases))]
        last = profile.in_phase(len(self.phases) - 1, zeta[-1:])
        return np.concatenate([*blocks, last]).ravel()


def runge_kutta(
    slope: Callable[[ca.SX], ca.SX], state: ca.SX, length: ca.SX, tableau: Tableau, steps: int
) -> ca.SX:
    """Integrate an autonomous system over ``length`` in equal explicit steps."""
    h, still = length / steps, ca.SX.zeros(state.shape[0])
    for _ in range(steps):
        stages: list[ca.SX] = []
        for row in tableau.a:
            increment = sum((float(w) * k for w, k in zip(row, stages, strict=False) if w), still)
            stages.append(slope(state + h * increment))
        state = state + h * sum((float(w) * k for w, k in zip(tableau.b, stages, strict=True) if w), still)
    return state


@lru_cache(maxsize=128)
def _discretise(settings: Shooting, phases: Phases) -> ShootingDiscretisation:
    return ShootingDiscretisation(settings, phases)
