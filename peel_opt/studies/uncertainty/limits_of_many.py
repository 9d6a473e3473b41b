"""Numbers of the rod alone over many rods: they depend on r = eta/y0 alone, in units of T0 and eta."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np

from ...analysis.design_relations import maxwell_length
from ...analysis.flaws import PressureLimit, readhesion_pressure
from ...analysis.maxwell_derivative import maxwell_gradient
from ...base.arrays import EPS
from ...base.errors import InvalidInput, NoEquilibrium, PeelOptError
from ...model.labels import CERTIFIED
from ...model.rod import MATERIAL, Rod
from .fates import Sampled

LIMITS = ("readhesion_pressure", "maxwell_length")

#: A number of the rod in closed form, equation (20).
CRITICAL_LENGTH = "critical_length"

#: Degrees at which a number of r alone is interpolated over the sampled range.
DEGREES = (8, 16, 32)

#: Relative error of sbar_M/eta that is left far from the end of the curve of Maxwell points: of the
#: splines through them, and of the points solved for with which they are compared.
MAXWELL_ERROR = 2e-11


def limits_of(
    name: str, points: Mapping[str, np.ndarray], tol: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return one of `LIMITS` over many rods, with its status and largest error.

    Parameters
    ----------
    name : str
    points : mapping of str to ndarray, shape (points,)
        The material numbers of the rods [SI].
    tol : float
        By which two interpolants of p_min/T0 may differ.
    """
    k, T0, y0 = (points[material] for material in MATERIAL)
    status = np.full(k.shape, CERTIFIED, dtype="<U24")
    status[(k <= 0.0) | (T0 <= 0.0) | (y0 <= 0.0)] = InvalidInput.status
    sound = status == CERTIFIED
    values = np.full(k.shape, math.nan)
    eta = np.cbrt(k[sound] / T0[sound])
    if name == "maxwell_length":
        ratios = eta / y0[sound]
        values[sound] = y0[sound] * maxwell_length(ratios, "branch")
        status[sound & ~np.isfinite(values)] = NoEquilibrium.status
        least = float(np.min(ratios, initial=math.inf, where=np.isfinite(values[sound])))
        return values, status, _maxwell_error(least) * float(np.nanmax(values, initial=0.0))
    found, status[sound], error = interpolated(_least_pressure, eta / y0[sound], tol)
    values[sound] = T0[sound] * found
    return values, status, error * float(np.max(T0[sound], initial=0.0))


def critical_lengths(rods: Mapping[str, np.ndarray]) -> Sampled:
    """Return the detached lengths at T of many rods, pi (k y0 / T0)^(1/4)."""
    k, T0, y0 = (rods[material] for material in MATERIAL)
    status = np.full(k.shape, CERTIFIED, dtype="<U24")
    sound = (k > 0.0) & (T0 > 0.0) & (y0 > 0.0)
    status[~sound] = InvalidInput.status
    values = np.full(k.shape, math.nan)
    values[sound] = math.pi * (k[sound] * y0[sound] / T0[sound]) ** 0.25
    return Sampled(values, status, 4.0 * EPS * float(np.nanmax(values, initial=0.0)))


def _maxwell_error(least: float) -> float:
    """Relative error of the splines of sbar_M/eta at all ratios from ``least`` on.

    It is measured there, as it falls with the ratio: the curve ends in a turn below.
    """
    if not math.isfinite(least):
        return 0.0
    solved = least * maxwell_gradient(least).value
    return abs(float(maxwell_length(least, "branch")) / solved - 1.0) + MAXWELL_ERROR


def interpolated(
    limit: Callable[[float], PressureLimit], ratios: np.ndarray, tol: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return a p/T0 that depends on r = eta/y0 alone at many ratios, its status and largest error.

    Chebyshev interpolants in log r of growing degree, until the last two agree to ``tol`` at
    every ratio; where none does, each ratio is computed by itself and NaN marks what fails.
    """
    x = np.log(ratios)
    status = np.full(ratios.shape, CERTIFIED, dtype="<U24")
    before, error = None, 0.0

    def at(place: float) -> float:
        nonlocal error
        found = limit(math.exp(place))
        error = max(error, found.error)
        return found.pressure_ratio

    try:
        for degree in DEGREES:
            if degree >= ratios.size or np.ptp(x) == 0.0:
                break
            middle, half = 0.5 * (x.max() + x.min()), 0.5 * np.ptp(x)
            # Each degree has the nodes of the one before among its own.
            nodes = middle + half * np.cos(math.pi * np.arange(degree + 1) / degree)
            values = np.polynomial.Chebyshev.fit(nodes, [at(place) for place in nodes.tolist()], degree)(x)
            if before is not None and (gap := float(np.max(np.abs(values - before)))) <= tol:
                return values, status, gap + error
            before = values
    except PeelOptError:
        pass  # some ratio of the range has no such number
    values = np.full(ratios.shape, math.nan)
    for i, place in enumerate(x.tolist()):
        try:
            values[i] = at(place)
        except PeelOptError as failure:
            status[i] = failure.status
    return values, status, error


@lru_cache(maxsize=4096)
def _least_pressure(ratio: float) -> PressureLimit:
    return readhesion_pressure(Rod.from_ratio(ratio))
