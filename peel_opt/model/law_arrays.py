"""A cohesive law at many separations at once, and every height its tip may have at a pressure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ..base.quadrature import gauss
from .bond import Affine, CohesiveLaw

#: Heights, over y0, between which the tip of a free rod is looked for, on either side of the plate.
LEAST, GREATEST, LOWEST = 1e-12, 2.0**20, -4.0

#: Points per decade of that, and evenly over the kinks.
PER_DECADE, EVENLY = 12, 200

#: Gauss points in each interval.
GAUSS = 8


def traction_of(law: CohesiveLaw, count: int) -> Callable[[np.ndarray], np.ndarray]:
    """Return tau(u), the traction over T0, as a function of ``count`` separations u = y/y0 at once."""
    drops = _drops_of(law, count)
    return lambda u: 1.0 - drops(u)


def tip_heights(law: CohesiveLaw, P: float) -> list[float]:
    """Return every u = y_tip/y0 other than zero with P u = Phi(u), in increasing order.

    By the first integrals of (12) the free tip of a rod at p/T0 = P has one of these heights.  Negative ones,
    of spurious states, belong to P > 1.
    """
    if law.is_affine:
        slope = law.initial_slope
        return [2.0 * (1.0 - P) / slope] if P != 1.0 and slope else []
    if P == 1.0:
        return []
    u = _grid(law, P)
    (nodes, weights), widths = gauss(GAUSS), np.diff(u)
    places = u[:-1, None] + widths[:, None] * nodes
    gone = widths * (_drops_of(law, places.size)(places.ravel()).reshape(places.shape) @ weights)
    # P - Phi(u)/u, as a mean of drops for the sake of the digits near u = 0.
    excess = np.cumsum(gone) / u[1:] - (1.0 - P)
    changes = np.flatnonzero((excess[1:] < 0.0) != (excess[:-1] < 0.0)) + 1

    from scipy.optimize import brentq  # which takes long to import

    def miss(height: float) -> float:
        return law.mean_drop(height) - (1.0 - P)

    found = []
    for a, b in ((float(u[i]), float(u[i + 1])) for i in changes):
        if miss(a) * miss(b) < 0.0:
            found.append(float(brentq(miss, a, b, xtol=1e-300, rtol=1e-14)))
        else:  # it lies at one of them
            found.append(min(a, b, key=lambda height: abs(miss(height))))
    return sorted(found)


def _grid(law: CohesiveLaw, P: float) -> np.ndarray:
    """Heights from zero on, down for P > 1."""
    last = max(law.kinks, default=2.0)
    decades = math.ceil(PER_DECADE * math.log10(GREATEST / LEAST))
    u = np.unique(
        [0.0, *np.geomspace(LEAST, GREATEST, decades), *np.linspace(0.0, 2.0 * last, EVENLY), *law.kinks]
    )
    return u if P < 1.0 else np.append(-u[u < -LOWEST], LOWEST)


def _drops_of(law: CohesiveLaw, count: int) -> Callable[[np.ndarray], np.ndarray]:
    """1 - tau of ``count`` separations, of each the value of the piece that holds it."""
    affine = [piece.drop for piece in law.pieces if isinstance(piece.drop, Affine)]
    if len(affine) == len(law.pieces):
        return lambda u: _chosen(law, u, [drop(u) for drop in affine])
    import casadi as ca

    u = ca.SX.sym("u")
    every = ca.Function("drops", [u], [ca.vertcat(*(piece.drop(u) for piece in law.pieces))]).map(count)
    # Arguments are handed over in place: converting them takes far longer than the law.
    given, values = np.empty(count), np.empty((count, len(law.pieces)))
    buffer, evaluate = every.buffer()
    buffer.set_arg(0, given.data)
    buffer.set_res(0, values.data)

    def drops(u: np.ndarray, owners: tuple[object, ...] = (every, buffer)) -> np.ndarray:
        given[:] = u
        evaluate()  # which its owners must outlive
        return _chosen(law, u, list(values.copy().T))

    return drops


def _chosen(law: CohesiveLaw, u: np.ndarray, values: Sequence[np.ndarray]) -> np.ndarray:
    """Of the values of all pieces those of the piece that holds each separation."""
    chosen = values[0]
    for kink, others in zip(law.kinks, values[1:], strict=True):
        chosen = np.where(u > kink, others, chosen)
    return chosen
