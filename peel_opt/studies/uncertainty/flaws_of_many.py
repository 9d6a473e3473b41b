"""Snaps of edges without glue over many rods: two numbers, r = eta/y0 and what is given, say all.

Smooth functions of both are interpolated by polynomials of growing degree, through those samples that tell
most of all others (approximate Fekete points), until they are right at further ones.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.polynomial import chebyshev

from ...analysis.nearby_snaps import NearbySnaps
from ...analysis.sensitivities import sensitivities
from ...analysis.unbonded import critical_flaw, safe_pressure
from ...base.errors import InvalidInput, NoEquilibrium, OutOfRange, PeelOptError
from ...base.progress import Progress, progress
from ...equilibria.scenes import solve
from ...model.labels import CERTIFIED
from ...model.rod import MATERIAL, RATIOS, Rod
from ...model.scene import Scene
from .fates import Sampled, fates_of

#: What is asked, with what is given for it.
SNAPS_AT = {"critical_flaw": "pressure", "safe_pressure": "flaw"}

#: Total degrees of the polynomials; samples at which they are checked, and by how much of its standard
#: deviation the number may be off there.
DEGREES, CHECKED, OFF = (3, 5, 8, 12), 7, 1e-3

#: How many times larger the error elsewhere is taken to be, and width of a box that is a line.
SAFE, LINE = 3.0, 1e-9


def nominal_snap(rod: Rod, name: str, given: float) -> tuple[float, dict[str, float]]:
    """Return one of `SNAPS_AT` of a rod, with its derivatives by k, T0, y0 and what is given.

    At a snap what loads the edge does not move with the detached length, so that its derivatives are those at
    that length (envelope theorem).
    """
    if name == "critical_flaw":
        found = critical_flaw(rod, given)
        scene, value = Scene(rod, unbonded=found.flaw), found.flaw
        state = solve(scene, free="unbonded", length=found.length, near=found.flaw, pressure=found.pressure)
    else:
        found = safe_pressure(rod, given)
        scene, value = Scene(rod, unbonded=found.flaw), found.pressure
        state = solve(scene, free="pressure", length=found.length, near=found.pressure)
    slopes = sensitivities(state).derivatives
    named = {"unbonded": "flaw"}
    return value, {named.get(key, key): slope for key, slope in slopes.items() if key != "length"}


def snapping(name: str, rods: Mapping[str, np.ndarray], given: np.ndarray, told: Progress = None) -> Sampled:
    """Return `snaps_of` with what becomes of the samples that have none."""
    values, status, error = snaps_of(name, rods, given, told)
    fates = fates_of(status, given, given, known=False)
    nothing, T0 = ~np.isfinite(values) & (fates == ""), rods["adhesion_strength"]
    if name == "critical_flaw":
        fates[nothing & (given >= T0)] = "break off"
        fates[nothing & (given <= 0.0)] = "re-adhere"
    fates[nothing & (status == NoEquilibrium.status)] = "grow stably"
    return Sampled(values, status, error, fates)


def snaps_of(
    name: str, rods: Mapping[str, np.ndarray], given: np.ndarray, told: Progress = None
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return one of `SNAPS_AT` over many rods, with its status and largest error.

    Parameters
    ----------
    name : str
    rods : mapping of str to ndarray, shape (points,)
        k, T0 and y0 [SI].
    given : ndarray, shape (points,)
        The pressure, or the flaw, of each [SI].
    told : Progress
    """
    k, T0, y0 = (rods[material] for material in MATERIAL)
    status = np.full(k.shape, CERTIFIED, dtype="<U24")
    makes = (k > 0.0) & (T0 > 0.0) & (y0 > 0.0)
    eta = np.cbrt(np.where(makes, k, 1.0) / np.where(makes, T0, 1.0))
    ratio = eta / np.where(makes, y0, 1.0)
    unit, asked = (np.where(makes, T0, 1.0), eta)[:: 1 if name == "critical_flaw" else -1]
    plain = given / unit
    inside = (ratio >= RATIOS[0]) & (ratio <= RATIOS[1]) & (plain > 0.0)
    inside &= (plain < 1.0) | (name != "critical_flaw")
    status[~inside] = OutOfRange.status
    status[~makes] = InvalidInput.status
    sound = status == CERTIFIED
    values = np.full(k.shape, math.nan)
    found, status[sound], error = _interpolated(name, ratio[sound], plain[sound], told)
    values[sound] = asked[sound] * found
    return values, status, error * float(np.nanmax(np.abs(values), initial=0.0))


def _interpolated(
    name: str, ratio: np.ndarray, plain: np.ndarray, told: Progress
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return p/T0 or a/eta at many places, the status, and the largest error relative to it.

    Where no polynomial is right, because some place of the box has no snap, each is solved for by itself.
    """
    status = np.full(ratio.shape, CERTIFIED, dtype="<U24")
    if not ratio.size:
        return np.zeros(0), status, 0.0
    flaw = name == "safe_pressure"
    snaps = NearbySnaps(flaw)
    inward, outward = (np.log, _share) if flaw else (_logit, np.exp)
    places = np.stack([np.log(ratio), inward(plain)], axis=1)
    box = _Box(places)

    known: dict[int, float] = {}

    def at(rows: np.ndarray) -> np.ndarray:
        for i in rows[np.argsort(box.distances[rows])].tolist():  # each is near one that is known
            if i not in known:
                value, _ = snaps.at(float(ratio[i]), float(plain[i]))
                known[i] = float(_logit(np.array(value)) if flaw else np.log(value))
        return np.array([known[i] for i in rows.tolist()])

    try:
        for degree in DEGREES:
            if 2 * box.size(degree) > len(places):
                break
            basis = box.basis(degree)
            nodes, checked = box.telling(basis)
            found = basis @ np.linalg.lstsq(basis[nodes], at(nodes))[0]
            missed = float(np.max(np.abs(found[checked] - at(checked))))
            if missed <= OFF * float(found.std()):
                return outward(found), status, SAFE * missed
    except PeelOptError:
        pass  # some sample has no snap
    values, error = np.full(ratio.shape, math.nan), 0.0
    with progress("edge", len(places), told) as step:
        for i in np.argsort(box.distances):
            try:
                values[i], own = snaps.at(float(ratio[i]), float(plain[i]))
                error = max(error, own / values[i])
            except PeelOptError as failure:
                status[i] = failure.status
            step()
    return values, status, error


class _Box:
    """A box around places in the plane, along their principal axes.

    Parameters
    ----------
    places : ndarray, shape (n, 2)
    """

    def __init__(self, places: np.ndarray) -> None:
        centre = places.mean(axis=0)
        axes = np.linalg.svd(places - centre, full_matrices=True)[2]
        along = (places - centre) @ axes.T
        half = 0.5 * np.ptp(along, axis=0)
        #: Directions in which it has a width.
        self.count = int(np.sum(half > LINE * max(1.0, float(half.max()))))
        middle = 0.5 * (along.max(axis=0) + along.min(axis=0))
        #: The places in its own coordinates, from -1 to 1, and how far out they are.
        self.inside = (along - middle) / np.maximum(half, LINE)
        self.distances = np.sum(self.inside**2, axis=1)

    def size(self, degree: int) -> int:
        """Return how many terms a polynomial of a total degree has."""
        return (1, degree + 1, (degree + 1) * (degree + 2) // 2)[self.count]

    def basis(self, degree: int) -> np.ndarray:
        """Chebyshev polynomials of a total degree, a row for each place."""
        first, second = (chebyshev.chebvander(self.inside[:, i], degree) for i in (0, 1))
        most = [degree if self.count > i else 0 for i in (0, 1)]
        pairs = [(i, j) for i in range(most[0] + 1) for j in range(min(degree - i, most[1]) + 1)]
        return np.stack([first[:, i] * second[:, j] for i, j in pairs], axis=1)

    def telling(self, basis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows of places that tell a polynomial, and others to check it at, far out and any."""
        from scipy.linalg import qr  # which takes long to import

        nodes = qr(basis.T, mode="r", pivoting=True)[1][: basis.shape[1]]
        outward = np.argsort(-self.distances)
        others = outward[~np.isin(outward, nodes)]
        half = CHECKED // 2
        return nodes, np.concatenate([others[:half], others[half :: max(len(others) // half, 1)]])


def _logit(share: np.ndarray) -> np.ndarray:
    """Return log(P / (1 - P)), which sees how far a share is from 0 and from 1."""
    found: np.ndarray = np.log(share) - np.log1p(-share)
    return found


def _share(logit: np.ndarray) -> np.ndarray:
    """Return the share with a logit."""
    found: np.ndarray = 1.0 / (1.0 + np.exp(-logit))
    return found
