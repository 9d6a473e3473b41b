"""Where a rod would jump if the volume under it were given and not the pressure.

With a pump that gives a volume the area S that the rod has swept is held, and p is what it takes.  Along a
branch dU + dPhi = p dS, and S turns where dS vanishes: a limit point of the volume, as "LP-pressure" is one
of the pressure and "LP-length" one of a shield that holds the rod down beyond a place.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from ..base.quadrature import gauss
from ..base.threads import one_thread
from ..continuation.points import Point
from ..equilibria.branch import Branch
from ..equilibria.branch_points import walked
from .energies import energies, family_along, swept_rate

#: Tip angle [rad] to which a limit point is found; the area at it is then known to its square.
WITHIN = 1e-9

#: Where the rate of the area is looked at between two points of a branch, beside their places.
BETWEEN = (0.25, 0.5, 0.75)


@dataclass(frozen=True)
class VolumeLimit:
    """An equilibrium at which the swept area turns along a branch.

    Parameters
    ----------
    kind : {"maximum", "minimum"}
        Of the area, walked from T on.
    swept : float
        Area S over which the pressure has worked since the rod lay flat [m^2], a volume per width.
    pressure, length : float
        p [Pa] and sbar [m].
    tip_angle : float
        theta at the tip [rad].
    error : float
        Largest error of ``swept``, in its unit.
    index : int
        Of the last point of the branch before it.
    """

    kind: str
    swept: float
    pressure: float
    length: float
    tip_angle: float
    error: float
    index: int


@one_thread
def volume_limits(branch: Branch) -> tuple[VolumeLimit, ...]:
    """Return the limit points of a rod under a given volume, in order along its branch.

    A rod with none of them is carried by a pump from lying flat through its least pressure to contact,
    without a jump.  A free end seals no volume: an experiment needs a chamber that is sealed along the sides.

    Parameters
    ----------
    branch : Branch
        Of a rod, from `peel_opt.trace`.

    Returns
    -------
    tuple of VolumeLimit
        Of two that lie closer together than a quarter of the spacing of the branch neither may be seen.

    Raises
    ------
    InvalidInput
        If the branch is not one of a single rod that starts at T.
    NotConverged
        If it cannot be solved between its points.

    Notes
    -----
    Where a rod jumps to from here is not told by its branch.  No work is done while the area is held, and
    U + Phi falls; where the branch has the same area again it is higher.  The area that a free end sweeps
    depends on the way, and there is no loop in it to be read off equilibria.

    Examples
    --------
    >>> from peel_opt import Rod, trace
    >>> [(limit.kind, round(limit.tip_angle, 2)) for limit in volume_limits(trace(Rod.from_ratio(0.5)))]
    [('maximum', -2.8), ('minimum', -2.88)]
    """
    balance, family = energies(branch), family_along(branch)
    found = []
    for i, (here, there) in enumerate(pairwise(walked(branch))):

        def rate(A: float, here: Point = here, there: Point = there) -> float:
            return swept_rate(family, here, there, A)[0]

        ends = float(branch.A[i]), float(branch.A[i + 1])
        for low, high, falls in _turns(rate, *ends):
            A = float(brentq(rate, low, high, xtol=WITHIN))
            area, apart = _area(rate, ends[0], A)
            _, point = swept_rate(family, here, there, A)
            eta = 1.0 if branch.rod is None else branch.rod.eta
            T0 = 1.0 if branch.rod is None else branch.rod.adhesion_strength
            found.append(
                VolumeLimit(
                    "maximum" if falls else "minimum",
                    swept=float(balance.swept[i] + area) * eta**2,
                    pressure=point.scalars.pressure_ratio * T0,
                    length=point.scalars.sigma * eta,
                    tip_angle=-A,
                    error=(balance.swept_error + apart) * eta**2,
                    index=i,
                )
            )
    return tuple(found)


def _turns(rate: Callable[[float], float], a: float, b: float) -> Iterator[tuple[float, float, bool]]:
    """Yield the angles between which a rate changes its sign, and whether it falls."""
    angles = [a, *(a + share * (b - a) for share in BETWEEN), b]
    values = [rate(A) for A in angles]
    for low, high, before, after in zip(angles, angles[1:], values, values[1:], strict=False):
        if before * after < 0.0:
            yield low, high, before > 0.0


def _area(rate: Callable[[float], float], a: float, b: float) -> tuple[float, float]:
    """Return the area swept from one angle to another by Gauss's rule, and how far one of fewer points is."""
    if math.isclose(a, b, rel_tol=0.0, abs_tol=WITHIN):
        return 0.0, WITHIN * abs(rate(a))
    fine, coarse = (
        (b - a) * float(weights @ np.array([rate(a + (b - a) * node) for node in nodes]))
        for nodes, weights in (gauss(3), gauss(2))
    )
    return fine, abs(fine - coarse)
