"""How fast a rod leaves an equilibrium or comes back to it, and the drag from which it does not flutter.

With K phi = mu M phi the small motions of the detached part, front held (`stability`), motions exp(s t)
of a rod with mass rho and drag c per area have rho s^2 + c s + mu k/sbar^4 = 0.
"""

from __future__ import annotations

import math

import numpy as np

from ..analysis.stability import spectrum_of
from ..base.checks import non_negative
from ..base.errors import InvalidInput, NotCertified
from ..base.threads import one_thread
from ..equilibria.result import Equilibrium
from ..model.rod import Rod

#: Largest error of an eigenvalue, relative to its size and one, with which a rate is returned.
LARGEST = 1e-6


@one_thread
def growth_rate(eq: Equilibrium, mass: float = 0.0, drag: float | None = None) -> float:
    """Return the rate at which a rod leaves an equilibrium; negative where it comes back.

    Parameters
    ----------
    eq : Equilibrium
        Of a rod; it must carry its discrete solution, as for `stability`.
    mass : float
        Per area [kg/m^2]; 0 where drag alone resists.
    drag : float, optional
        Force per area and speed [Pa s/m].  Without it the rate is that under drag alone, over T0/(c eta).

    Returns
    -------
    float
        Largest real part of s [1/s], of motions exp(s t).

    Raises
    ------
    InvalidInput
        If mass and drag are both zero or one is negative, or there is no solution to linearise about.
    NotCertified
        If the eigenvalues of two discretisations do not agree to 1e-6 of their size and one.

    Examples
    --------
    >>> from peel_opt import Rod, length_given_pressure
    >>> round(growth_rate(length_given_pressure(Rod.from_ratio(0.3), 0.9)), 8)
    0.275089
    """
    rod, mu = _eigenvalues(eq)
    rho, c = resistance(rod, mass, drag)
    if not rho:
        return float(np.max(-mu.real)) / c
    root = np.sqrt(c * c - 4.0 * rho * mu.astype(complex))
    rates = -2.0 * mu / (c + root)  # (-c + root) / (2 rho) would cancel where drag rules
    return float(np.max(rates.real))


@one_thread
def critical_drag(eq: Equilibrium, mass: float | None = None) -> float:
    """Return the drag from which on no pair of small motions grows: a folded rod below it flaps.

    A pair mu = a +- ib is damped if c^2 a > rho b^2.

    Parameters
    ----------
    eq : Equilibrium
        As for `growth_rate`.
    mass : float, optional
        Per area [kg/m^2]; without it the answer is over sqrt(rho T0/eta).

    Returns
    -------
    float
        max |b| sqrt(rho/a) [Pa s/m]; 0 if nothing flutters, inf if no drag holds the rod.

    Raises
    ------
    InvalidInput, NotCertified
        As for `growth_rate`.

    Examples
    --------
    >>> from peel_opt import Rod, length_given_pressure
    >>> rod = Rod.from_ratio(1.0)
    >>> round(critical_drag(length_given_pressure(rod, 0.4, state="folded")), 5)
    0.34676
    """
    rod, mu = _eigenvalues(eq)
    unit = 1.0 if mass is None else math.sqrt(_mass(rod, mass) * rod.adhesion_strength / rod.eta)
    over = mu * rod.eta / rod.adhesion_strength
    if np.any(over.real <= 0.0):
        return math.inf
    return unit * float(np.max(np.abs(over.imag) / np.sqrt(over.real)))


def _eigenvalues(eq: Equilibrium) -> tuple[Rod, np.ndarray]:
    """Return the rod and mu k/sbar^4 in its units, of all motions that are resolved."""
    found = spectrum_of(eq)
    if eq.rod is None:
        raise InvalidInput(
            "a state of the paper's groups has no unit of time.", remedy="Ask for it with a Rod or a Scene."
        )
    if not found.error <= LARGEST:
        raise NotCertified(f"the eigenvalues of small motions are known to {found.error:.1e} only.")
    return eq.rod, found.lowest * eq.rod.bending_stiffness / eq.length**4


def _mass(rod: Rod, mass: float) -> float:
    return non_negative("mass", mass, "" if rod.dimensionless else "kg/m^2")


def resistance(rod: Rod, mass: float, drag: float | None) -> tuple[float, float]:
    """Return mass and drag in units of the rod; a drag that is not given is that of the unit of time.

    Raises
    ------
    InvalidInput
        If one is negative, both are zero, or a rod in SI units has a mass and no drag is named.
    """
    rho = _mass(rod, mass)
    if drag is None:
        if rho and not rod.dimensionless:
            raise InvalidInput(
                "a rod with a mass was given no drag, which sets the time of a snap more than its mass does.",
                remedy="Give drag [Pa s/m], also if it is 0.",
            )
        return rho, 1.0 if rod.dimensionless else rod.adhesion_strength / rod.eta
    c = non_negative("drag", drag, "" if rod.dimensionless else "Pa s/m")
    if not rho and not c:
        raise InvalidInput(
            "a rod without mass and drag would move infinitely fast.", remedy="Give mass or drag."
        )
    return rho, c
