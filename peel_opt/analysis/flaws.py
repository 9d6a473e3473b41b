"""What the unstable branch means for a flaw: when it grows, and when it heals.

At fixed pressure the unfolded state is a barrier: a longer flaw peels on, a shorter one
closes.  Below the minimum pressure no length is held, and a detached rod closes.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..base.errors import NoEquilibrium, NotConverged
from ..continuation.family import Family
from ..continuation.primary import PrimaryBranch
from ..equilibria.ask import length_given_pressure, pressure_given_length
from ..equilibria.result import Equilibrium
from ..model.bond import COHESIVE
from ..model.rod import Rod, require_rod
from ..residual.closures import Closure
from ..residual.transcriptions import Spectral

#: Meshes on which the minimum pressure is located; their difference is its error.
MESHES = (Spectral(nodes=20), Spectral(nodes=30))


@dataclass(frozen=True)
class PressureLimit:
    """A pressure that bounds what a rod does.

    Parameters
    ----------
    pressure : float
        [Pa].
    pressure_ratio : float
        p/T0.
    length : float
        Detached length of the state at this pressure [m]; 0 if it is the bond's own strength.
    error : float
        Absolute error of ``pressure_ratio``.
    reason : str
        What sets the limit.
    """

    pressure: float
    pressure_ratio: float
    length: float
    error: float
    reason: str


def critical_flaw(rod: Rod, pressure: float) -> Equilibrium:
    """Return the unfolded equilibrium at a pressure [Pa]: a flaw longer than its length grows.

    Parameters
    ----------
    rod : Rod
    pressure : float
        [Pa]

    Returns
    -------
    Equilibrium

    Raises
    ------
    NoEquilibrium
        If no flaw grows (below the minimum pressure) or every one does (at T0 and above).

    Examples
    --------
    >>> round(critical_flaw(Rod.from_ratio(1.0), 0.5).length, 4)
    3.0384
    """
    return length_given_pressure(rod, pressure)


def readhesion_pressure(rod: Rod) -> PressureLimit:
    """Return the minimum pressure, below which a detached rod closes.

    Parameters
    ----------
    rod : Rod

    Returns
    -------
    PressureLimit

    Examples
    --------
    >>> round(readhesion_pressure(Rod.from_ratio(1.0)).pressure, 9)
    0.121837041
    """
    folds = []
    for mesh in MESHES:
        branch = PrimaryBranch(Family(COHESIVE, mesh, Closure("ratio", require_rod(rod).ratio)))
        fold = branch.reach("LP-pressure")
        if fold is None:
            raise NotConverged(
                f"the minimum pressure at eta/y0 = {rod.ratio:.4g} was not reached.",
                remedy="Check that the ratio lies between 0.005 and 3000.",
            )
        folds.append(fold.point.scalars)
    coarse, fine = folds
    error = abs(fine.pressure_ratio - coarse.pressure_ratio) + 1e-15
    return PressureLimit(
        rod.pressure(fine.pressure_ratio),
        fine.pressure_ratio,
        rod.length(fine.sigma),
        error,
        "the minimum pressure of the branch",
    )


def safe_pressure(rod: Rod, flaw: float) -> PressureLimit:
    """Return the pressure up to which a flaw of a given length [m] does not grow.

    For a length that an unfolded state has, its lowest pressure; for longer flaws the
    minimum pressure; for shorter ones the strength of the bond.

    Parameters
    ----------
    rod : Rod
    flaw : float
        Detached length [m].

    Returns
    -------
    PressureLimit

    Examples
    --------
    >>> round(safe_pressure(Rod.from_ratio(1.0), 3.5).pressure, 6)
    0.275545
    """
    sigma = require_rod(rod).length_ratio(flaw)  # a length, before anything is computed
    least = readhesion_pressure(rod)
    if rod.length(sigma) >= least.length:
        return PressureLimit(
            least.pressure,
            least.pressure_ratio,
            least.length,
            least.error,
            "longer than what holds at the minimum pressure",
        )
    try:
        held = pressure_given_length(rod, flaw)
    except NoEquilibrium:
        strength = rod.adhesion_strength
        return PressureLimit(
            strength, 1.0, 0.0, 0.0, "shorter than any length the branch holds: the bond's strength"
        )
    return PressureLimit(
        held.pressure, held.pressure_ratio, held.length, held.error, f"the {held.state} state"
    )
