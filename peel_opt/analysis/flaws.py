"""What a rod's unfolded states say: the flap in equilibrium at a pressure, and the least pressure.

At fixed pressure these states are unstable: nothing holds them there.  Their length contains the
cohesive zone, so that they say nothing about an edge that was never glued.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from ..continuation.family import Family
from ..continuation.goal import minimum_pressure
from ..continuation.primary import PrimaryBranch
from ..continuation.special import Located, found_again
from ..equilibria.ask import length_given_pressure, pressure_given_length
from ..equilibria.question import known_law
from ..equilibria.result import Equilibrium
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.rod import RATIOS, Rod, require_rod
from ..residual.closures import Closure
from ..residual.meshes import AT_FOLDS


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
        Detached length of the state at this pressure [m].
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


def held_length(rod: Rod, pressure: float, *, law: str | CohesiveLaw = "auto") -> Equilibrium:
    """Return the unfolded flap that is in equilibrium at a pressure, which nothing holds there.

    Its length contains the cohesive zone ahead of the part that carries no traction, and it is
    unstable at fixed pressure.  It is no bound for a flaw: an edge that was never glued gives way
    when it is shorter by factors.

    Parameters
    ----------
    rod : Rod
    pressure : float
        [Pa]
    law : str or CohesiveLaw
        As in `length_given_pressure`.

    Returns
    -------
    Equilibrium
        Its ``length`` [m] is what is asked for.

    Raises
    ------
    NoEquilibrium
        Below the minimum pressure and from T0 on.

    Examples
    --------
    >>> round(held_length(Rod.from_ratio(1.0), 0.5).length, 4)
    3.0384
    """
    return length_given_pressure(require_rod(rod, RATIOS), pressure, law=law, state="unfolded")


def holding_pressure(rod: Rod, length: float, *, law: str | CohesiveLaw = "auto") -> Equilibrium:
    """Return the unfolded state of lowest pressure with a detached length: what `held_length` has there.

    ``held_length(rod, holding_pressure(rod, length).pressure).length`` is ``length``.  The other way
    round the pressure may be lower than the one begun with: where lengths fold, a *middle* state shares
    its length with a *lower* one.

    Parameters
    ----------
    rod : Rod
    length : float
        Detached length [m].
    law : str or CohesiveLaw
        As in `pressure_given_length`.

    Returns
    -------
    Equilibrium
        Its ``pressure`` [Pa] is what is asked for.

    Raises
    ------
    NoEquilibrium
        If no unfolded state has this length; ``nearest`` is a length [m] that one has.

    Examples
    --------
    >>> round(holding_pressure(Rod.from_ratio(1.0), 3.5).pressure, 6)
    0.275545
    """
    return pressure_given_length(require_rod(rod, RATIOS), length, law=law)


def readhesion_pressure(rod: Rod, *, law: str | CohesiveLaw = "auto") -> PressureLimit:
    """Return the least pressure at which a detached equilibrium exists.

    Quasi-static, and for a bond that heals: below it a detached rod of any length closes.

    Parameters
    ----------
    rod : Rod
    law : str or CohesiveLaw
        As in `pressure_given_length`; default law (8).

    Returns
    -------
    PressureLimit

    Raises
    ------
    NoEquilibrium
        If the branch under this law ends without a minimum of the pressure.
    NotConverged
        If it could not be walked so far.

    Examples
    --------
    >>> round(readhesion_pressure(Rod.from_ratio(1.0)).pressure, 9)
    0.121837041
    """
    bond = known_law(law) or COHESIVE
    ratio = Closure("ratio", require_rod(rod).ratio)
    coarse, fine = (found.point.scalars for found in on_both_meshes(bond, ratio, minimum_pressure))
    error = abs(fine.pressure_ratio - coarse.pressure_ratio) + 1e-15
    return PressureLimit(
        rod.pressure(fine.pressure_ratio),
        fine.pressure_ratio,
        rod.length(fine.sigma),
        error,
        "the minimum pressure of the branch",
    )


@lru_cache(maxsize=256)
def on_both_meshes(
    law: CohesiveLaw, closure: Closure, locate: Callable[[PrimaryBranch], Located]
) -> tuple[Located, Located]:
    """Locate a fold on both of `AT_FOLDS`: by a walk on the coarse one, beside that walk on the fine one.

    Raises
    ------
    PeelOptError
        As ``locate`` does.
    """
    coarse, fine = (PrimaryBranch(Family(law, mesh, closure)) for mesh in AT_FOLDS)
    fold = locate(coarse)
    i = coarse.points.index(fold.point)
    around = coarse.points[i - 1], coarse.points[i + 1]
    return fold, found_again(fine.family, around, fold) or locate(fine)
