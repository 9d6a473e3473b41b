"""The loop of a rod in the pressure: it peels at T0 and re-adheres at the minimum pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from ..base.drawing import Pictured
from ..base.errors import NoEquilibrium, NotConverged
from ..base.quadrature import Grid
from ..base.records import Column
from ..continuation.goal import minimum_pressure
from ..continuation.primary import primary_branch
from ..equilibria.branch import Branch
from ..equilibria.branch_parts import SpecialPoint
from ..equilibria.trace import trace
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.rod import Rod, Units, require_rod
from ..residual.closures import Closure
from .loops import Jump, Loop, VisitedStates

#: Points of the branch: with half of them the area of a slender rod is known to three digits, else to six.
POINTS = 240

NOT_COMPUTED = (
    "Not computed here: the motion in a jump, which `peel_opt.snap` follows.  At p = T0 no detached"
    " equilibrium is near the straight rod; the folded one with which the way back begins has its tip on"
    " the plate.  For eta/y0 up to about 0.4 a snap just below T0 ends folded; from 0.5 on its tip lands,"
    " and a rod that comes to lie flat upside down does not close at the minimum pressure.  Above T0 the"
    " branch has no state, below the minimum pressure neither: the rod closes.  The unfolded states between,"
    " which meet the folded ones at the minimum pressure, are not visited."
)


@dataclass(frozen=True)
class PressureJump(Jump):
    """A jump between two states at one pressure.

    Parameters
    ----------
    direction, swept, before, after :
        As `Jump` has them.
    lam, alpha1 : float
        The paper's groups of the detached state of the two.
    """

    lam: float
    alpha1: float

    @property
    def pressure(self) -> float:
        """Pressure [Pa] at which it jumps."""
        return self.swept

    @property
    def length_before(self) -> float:
        """Detached length before the jump [m]; 0 for the adhered rod."""
        return self.before

    @property
    def length_after(self) -> float:
        """Detached length after it [m]."""
        return self.after


class PressureSweep(VisitedStates):
    """States in the order in which a sweep of the pressure visits them."""

    @property
    def pressure(self) -> np.ndarray:
        """Pressures [Pa]."""
        return self.swept

    @property
    def length(self) -> np.ndarray:
        """Detached lengths [m]."""
        return self.response


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PressureLoop(Loop[PressureSweep, PressureJump], Pictured):
    """The loop of a rod whose pressure is raised to T0 and lowered again.

    It is quasi-static, a sequence of equilibria, and the bond is reversible: where the rod comes back
    to the plate it holds with the same law.  On the way up the rod is adhered to T0, then folded;
    on the way down folded to the minimum pressure, adhered below it.  A scene that is lifted from the
    start is *lifted* instead of adhered, and peels at its snap.  Beside what every `Loop` has,
    with the area in the (pressure, length) plane [Pa m]:

    Parameters
    ----------
    rod : Rod
    between : PressureSweep
        The unfolded states at the pressures of the loop, by rising pressure; not visited.
    branch : Branch
    """

    rod: Rod
    between: PressureSweep
    branch: Branch

    @property
    def minimum_pressure(self) -> float:
        """Least pressure [Pa] of the branch, at which the rod re-adheres."""
        return self.jumps[1].pressure

    @property
    def legs(self) -> dict[str, PressureSweep]:
        """Both sweeps, and the unfolded states that the loop does not visit."""
        return super().legs | {"between": self.between}

    @property
    def plane(self) -> dict[str, Column]:
        """Pressure and length in the units of the rod, and in those of T0 and eta."""
        units, pressure, length = Units.of(self.rod), self.joined("pressure"), self.joined("length")
        own = {"pressure": Column(pressure, units.pressure), "length": Column(length, units.length)}
        ratios = {"pressure_ratio": Column(pressure / self.rod.adhesion_strength)}
        return own | ratios | {"length_ratio": Column(length / self.rod.eta)}

    def __repr__(self) -> str:
        T0, eta = self.rod.adhesion_strength, self.rod.eta
        jumps = [
            f"{jump.direction:<4} at p/T0 = {jump.pressure / T0:.9g}:"
            f" sbar/eta {jump.length_before / eta:.9g} to {jump.length_after / eta:.9g}"
            for jump in self.jumps
        ]
        area = f"{self.area / (T0 * eta):.{self.area_digits}g} T0 eta"
        return self.tree(f"PressureLoop of {self.rod!r}", jumps, area, self.not_computed)


def sweep_pressure(rod: Rod, points: int, tol: float, law: CohesiveLaw = COHESIVE) -> PressureLoop:
    """Sweep the pressure from below the minimum pressure to T0 and back; every state is solved for."""
    if not (law.branch_ends and law.initial_slope > 0.0):
        raise NoEquilibrium(
            f"law {law.name!r} has no loop in the pressure: no transition at T0, or no end at contact.",
            remedy="Such a loop needs a traction that falls from the start and never pushes.",
        )
    walk = primary_branch(law, Closure("ratio", rod.ratio))
    inner = swept_pressures(minimum_pressure(walk).point.scalars.pressure_ratio, points)
    asked = {"pressure_ratio": [float(value) for value in inner]}
    branch = trace(rod, law=law, tol=tol, points=POINTS, at=asked)
    return loop_of_branch(branch, inner)


def loop_of_branch(branch: Branch, inner: np.ndarray) -> PressureLoop:
    """Return the loop through the states of a rod's branch, followed to contact: nothing is solved for.

    Parameters
    ----------
    branch : Branch
        From T on.
    inner : ndarray, shape (n,)
        p/T0 between the minimum pressure and 1, ascending; the nearest point of the branch stands for each.

    Returns
    -------
    PressureLoop

    Raises
    ------
    NotConverged
        If the branch has no minimum pressure or does not end at contact.
    """
    rod = require_rod(branch.rod)
    T0, eta = rod.adhesion_strength, rod.eta
    P, turn, end = branch.pressure_ratio.copy(), _turn(branch).index, len(branch) - 1
    P[end] = 1.0  # the tip touches the plate, where p = Phi(y_tip)/y_tip is T0

    def rows(part: np.ndarray) -> list[int]:
        nearest = (int(part[np.argmin(np.abs(P[part] - value))]) for value in inner)
        return [row for row in dict.fromkeys(nearest) if row not in (turn, end, 0)]

    folded = np.array([turn, *rows(np.arange(turn, end + 1)), end])
    unfolded = np.array([*rows(np.arange(turn + 1)), 0])

    def solved(which: np.ndarray) -> PressureSweep:
        label = np.where(which == turn, "folded", branch.state[which])  # where both kinds meet
        return PressureSweep(P[which] * T0, branch.sigma[which] * eta, label, branch.error[which], which)

    area, area_error = folded_area(branch, turn)
    below = np.linspace(0.5 * P[turn], P[turn], max((len(inner) + 2) // 4, 2))
    ends = branch.sigma[[turn, end]] * eta
    up = PressureJump("up", T0, 0.0, float(ends[1]), float(branch.lam[end]), float(branch.alpha1[end]))
    down = PressureJump(
        "down",
        float(P[turn] * T0),
        float(ends[0]),
        0.0,
        float(branch.lam[turn]),
        float(branch.alpha1[turn]),
    )
    return PressureLoop(
        rod=rod,
        up=PressureSweep.adhered(np.array([*below, *P[folded[1:-1]], 1.0]) * T0).then(solved(folded[-1:])),
        down=solved(folded[::-1]).then(PressureSweep.adhered(below[::-1] * T0)),
        between=solved(unfolded),
        jumps=(up, down),
        area=area * T0 * eta,
        area_error=area_error * T0 * eta,
        not_computed=NOT_COMPUTED,
        branch=branch,
    )


def swept_pressures(least: float, points: int) -> np.ndarray:
    """Return p/T0 above the least: even in the logarithm, but closer together where the length turns."""
    inner: np.ndarray = least ** (1.0 - np.linspace(0.0, 1.0, points)[1:-1] ** 2)
    return inner


def _turn(branch: Branch) -> SpecialPoint:
    """Return the minimum pressure of a branch that has been followed to contact."""
    turns = branch.special("LP-pressure")
    if not turns or branch.ended != "contact":
        raise NotConverged(
            f"the branch of this rod ended without a minimum pressure or contact ({branch.ended}).",
            remedy="Give a larger tol, or another ratio eta/y0.",
        )
    return turns[0]


def folded_area(branch: Branch, turn: int) -> tuple[float, float]:
    """Integral of sbar/eta over p/T0 along the folded states, by splines in the tip angle, and its error."""
    s, P, sigma = (column[turn:] for column in (branch.A, branch.pressure_ratio, branch.sigma))
    area, error = area_along(s, P, sigma)
    return area, error + float(branch.error[turn:].max()) * float(np.abs(np.diff(sigma)).sum())


def area_along(s: np.ndarray, P: np.ndarray, sigma: np.ndarray) -> tuple[float, float]:
    """Integral of sigma dP along a curve by splines in a parameter ``s``, and its error.

    Branches have kinks where the height grazes y0, which no spline follows: the error is what a lower
    degree changes, or half as many points, whichever is more.
    """
    half = np.unique([*range(0, len(s), 2), len(s) - 1])
    area = _spline_area(s, P, sigma, 5)
    cruder = _spline_area(s, P, sigma, 3), _spline_area(s[half], P[half], sigma[half], 5)
    return area, max(abs(area - other) for other in cruder)


def _spline_area(s: np.ndarray, P: np.ndarray, sigma: np.ndarray, degree: int) -> float:
    """Integral of sigma dP over the parameter ``s``."""
    pressure, length = (make_interp_spline(s, values, k=degree) for values in (P, sigma))
    cell = Grid.gauss(8)
    x = s[:-1, None] + np.diff(s)[:, None] * cell.xi
    return float((length(x) * pressure.derivative()(x) @ cell.weights) @ np.diff(s))
