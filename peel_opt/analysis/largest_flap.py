"""The longest flap that any pressure can open, when the bond does not heal.

Where the bond is short-ranged, so that T0 is large and only its work G counts, it has a closed form.  With
lam = l (p/k)^(1/3) the tip of a flap stands at (k/p)^(1/3) Y(lam), and the drive p y_tip at length l is
(k/l^2) lam^2 Y(lam): no pressure drives a flap longer than sqrt(M k/G), with M the maximum of lam^2 Y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..base.errors import NotConverged
from ..base.threads import one_thread
from ..continuation.special import Located
from ..continuation.unhealed import UnhealedBranch, unhealed_branch
from ..equilibria.question import known_law
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.rod import RATIOS, Rod, require_rod
from ..residual.closures import Closure
from ..residual.free_arc import curve
from ..residual.meshes import AT_FOLDS

#: Stretch lam within which the maximum lies.
FROM, TO = 2.5, 2.9

#: Rounding of a located fold, relative.
FOLD_ROUNDING = 1e-12


@dataclass(frozen=True)
class LargestFlap:
    """The longest flap that a rod whose bond does not heal can have.

    Parameters
    ----------
    length, length_ratio : float
        Detached length [m], and sbar/eta.
    pressure, pressure_ratio : float
        The pressure [Pa] at which it is reached, and p/T0.
    tip_angle : float
        [rad]
    error : float
        Absolute error of ``length_ratio``.
    certificate : float
        As of an `Equilibrium`: |p - G/y_tip| / T0 or the angle at the plate [rad].
    sharp_length, sharp_pressure : float
        What they are [m, Pa] where only the work of separation counts, in closed form.
    """

    length: float
    length_ratio: float
    pressure: float
    pressure_ratio: float
    tip_angle: float
    error: float
    certificate: float
    sharp_length: float
    sharp_pressure: float


@one_thread
def largest_flap(rod: Rod, *, law: str | CohesiveLaw = "auto") -> LargestFlap:
    """Longest flap that any pressure opens, when the bond stays open once it has opened.

    A flap that has snapped grows on as the pressure is taken back, up to this length and no further,
    whatever the pressure does then; one that snapped beyond it is frozen where it stopped.

    Parameters
    ----------
    rod : Rod
    law : str or CohesiveLaw
        One that lets go at a finite opening; default law (8).

    Returns
    -------
    LargestFlap

    Raises
    ------
    NoEquilibrium
        If the rod is so flexible beside the range of its bond that no equilibrium opens it fully.
    NotConverged
        If the flaps could not be followed so far.

    Examples
    --------
    >>> flap = largest_flap(Rod.from_ratio(1.0))
    >>> round(flap.length_ratio, 8), round(flap.pressure_ratio, 8)
    (5.61803223, 0.13745056)
    """
    bond, closure = known_law(law) or COHESIVE, Closure("ratio", require_rod(rod, RATIOS).ratio)
    branches = [unhealed_branch(bond, closure, mesh) for mesh in AT_FOLDS]
    coarse, fine = (_longest(branch) for branch in branches)
    s, before = fine.point.scalars, coarse.point.scalars
    sharp_length, sharp_pressure = _sharp(rod, bond)
    return LargestFlap(
        length=rod.length(s.sigma),
        length_ratio=s.sigma,
        pressure=rod.pressure(s.pressure_ratio),
        pressure_ratio=s.pressure_ratio,
        tip_angle=-s.A,
        error=abs(s.sigma - before.sigma) + FOLD_ROUNDING * s.sigma,
        certificate=branches[-1].family.certificate(fine.point),
        sharp_length=sharp_length,
        sharp_pressure=sharp_pressure,
    )


def _longest(branch: UnhealedBranch) -> Located:
    if branch.fold is None:
        last = branch.points[-1].scalars
        raise NotConverged(
            f"no greatest length up to p/T0 = {last.pressure_ratio:.4g}, sbar/eta = {last.sigma:.4g}.",
            remedy="Ask for a rod of larger eta/y0.",
        )
    return branch.fold


def _sharp(rod: Rod, law: CohesiveLaw) -> tuple[float, float]:
    """Return length and pressure of the longest flap where only the work of separation counts."""
    work = law.pieces[-1].work_done * rod.adhesion_strength * rod.adhesion_range
    stretch, most = greatest_drive()
    length = math.sqrt(most * rod.bending_stiffness / work)
    return length, rod.bending_stiffness * (stretch / length) ** 3


@lru_cache(maxsize=1)
def greatest_drive() -> tuple[float, float]:
    """Return the stretch lam at which lam^2 Y(lam) is greatest, and its value there.

    Examples
    --------
    >>> [round(value, 6) for value in greatest_drive()]
    [2.681138, 13.07554]
    """
    from scipy.optimize import minimize_scalar

    def drive(stretch: float) -> float:
        phi, X, Y = (float(v[0]) for v in curve(np.array([stretch]), TO))
        return stretch**2 * (X * math.sin(phi) - Y * math.cos(phi))

    found = minimize_scalar(lambda c: -drive(c), bounds=(FROM, TO), method="bounded", options={"xatol": 1e-9})
    return float(found.x), drive(float(found.x))
