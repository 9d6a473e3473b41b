"""What a peel test measures: the force on a long arm, the work behind it, and the peak on a short one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.arrays import EPS, brief, floats
from ..base.checks import non_negative, positive
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged, OutOfRange
from ..base.threads import one_thread
from ..continuation.scene_family import SceneBranch, SceneFamily, entered_branch
from ..continuation.special import Located, found_again
from ..model.bond import CohesiveLaw
from ..model.dimension import FORCE
from ..model.rod import RATIOS, Rod, Units, require_rod
from ..model.scene import Scene
from ..model.tips import TipLoad
from ..residual.closures import Closure
from ..residual.meshes import SNAPS
from ..residual.scene_spectral import SceneSpectral
from ..residual.spectral import Spectral
from .unbonded import LARGEST, ROUNDING, certified

#: Detached length beyond the arm at which a peel is steady: cohesive zones, and lengths sqrt(k/F) over which
#: a pulled rod turns into the direction of its pull.
ZONES, LONG = 2.0, 12.0

#: Angle [rad] from a pull in line within which no peel begins.
IN_LINE = 1e-6


def energy_release_rate(force: Any, angle: Any) -> Any:
    """Return the energy per area that a peel test spends, G = F (1 - cos phi), on a long arm.

    The factor is 1 at 90 degrees and 2 at 180: a tape pulled back over itself spends twice its force.  It is
    the work of separation where the arm neither stretches nor bends plastically (Rivlin 1944).

    Parameters
    ----------
    force : array_like
        Force over width F [N/m], such as "6 N/25 mm".
    angle : array_like
        Peel angle phi [rad], such as "90 deg": from above 0 to pi.

    Returns
    -------
    float or ndarray
        G [J/m^2].

    Raises
    ------
    InvalidInput
        If a force is negative or an angle is not one.

    Examples
    --------
    >>> energy_release_rate("2 N/20 mm", "180 deg")
    200.0
    """
    F = _checked("force", force, "N/m", least=0.0)
    return _together(np.multiply, F, _factor(angle))


def peel_force(work: Any, angle: Any) -> Any:
    """Return the force that peels a long arm, F = G / (1 - cos phi): `energy_release_rate` inverted.

    Parameters
    ----------
    work : array_like
        Work of separation G [J/m^2].
    angle : array_like
        Peel angle phi [rad], from above 0 to pi.

    Returns
    -------
    float or ndarray
        F [N/m].

    Raises
    ------
    InvalidInput

    Examples
    --------
    >>> round(peel_force("100 J/m^2", "60 deg"), 9)
    200.0
    """
    G = _checked("work", work, "J/m^2", least=0.0)
    return _together(np.divide, G, _factor(angle))


def _factor(angle: Any) -> np.ndarray:
    """Return 1 - cos phi, without cancellation."""
    phi = _checked("angle", angle, "rad", least=0.0)
    if np.any(phi == 0.0) or np.any(phi > math.pi * (1.0 + EPS)):
        raise InvalidInput(
            f"angle must lie above 0 and up to pi, got {brief(phi)} [rad].",
            remedy="Write '90 deg' for degrees.",
        )
    factor: np.ndarray = 2.0 * np.sin(0.5 * phi) ** 2
    return factor


def _checked(name: str, value: Any, unit: str, least: float) -> np.ndarray:
    try:
        numbers = floats(name, value, unit)
    except (TypeError, ValueError, OverflowError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(
            f"{name} [{unit}] must be a number or an array of them, got {value!r:.60}."
        ) from error
    if not np.all(np.isfinite(numbers)) or np.any(numbers < least):
        raise InvalidInput(f"{name} [{unit}] must be finite and at least {least:g}, got {brief(numbers)}.")
    return numbers


def _together(operation: np.ufunc, one: np.ndarray, other: np.ndarray) -> Any:
    """Return a number of two numbers, or an array of arrays of a common shape."""
    try:
        found = operation(one, other)
    except ValueError as error:
        raise InvalidInput(
            f"arrays of the shapes {one.shape} and {other.shape} have no common one.",
            remedy="Give arrays that broadcast.",
        ) from error
    return found if np.ndim(found) else float(found)


@dataclass(frozen=True)
class PeelPeak:
    """The force at which the arm of a peel test lets go: the largest on its way to the steady one.

    Parameters
    ----------
    force : float
        F [N/m] at the peak.
    long_arm_force : float
        G / (1 - cos phi) [N/m], with which a long arm peels.
    angle : float
        Peel angle [rad].
    arm : float
        Length from the tip that was never glued [m].
    length : float
        Detached length at the peak [m], the arm and the cohesive zone ahead of it.
    tip_angle : float
        theta at the tip there [rad].
    force_ratio : float
        F/(T0 eta).
    error : float
        Absolute error of ``force_ratio``.
    certificate : float
        By how much the identity of the pulled rod is missed, over T0 eta.
    rod : Rod
    law : str
        Name of the cohesive law.
    """

    force: float
    long_arm_force: float
    angle: float
    arm: float
    length: float
    tip_angle: float
    force_ratio: float
    error: float
    certificate: float
    rod: Rod
    law: str


@one_thread
def initiation_force(
    rod: Rod, angle: float, arm: float = 0.0, *, law: str | CohesiveLaw = "auto"
) -> PeelPeak:
    """Return the force at which a peel begins: the peak on the way from rest to the steady force.

    A short arm of a stiff rod is a weak lever: the force that opens it rises above the steady one before the
    front runs.  Of several peaks it is the highest.

    Parameters
    ----------
    rod : Rod
    angle : float
        Peel angle phi [rad], between 0 and pi: of a tip that is pulled in line the flat rod stays flat.
    arm : float
        Length a from the tip that was never glued [m].
    law : str or CohesiveLaw
        As in `length_given_pressure`.

    Returns
    -------
    PeelPeak

    Raises
    ------
    OutOfRange
        If the angle is not between 0 and pi.
    NoEquilibrium
        If the force rises to that of a long arm, ``nearest`` [N/m], without a peak above it.
    NotConverged
        If the states could not be followed so far.

    Examples
    --------
    >>> tape = Rod(bending_stiffness=9.5e-6, adhesion_strength=0.5e6, adhesion_range=0.4e-3)
    >>> peak = initiation_force(tape, "90 deg")
    >>> round(peak.force, 4), round(peak.long_arm_force, 9)
    (120.0544, 100.0)
    """
    require_rod(rod, RATIOS)
    phi = positive("angle", angle, "rad")
    if not phi < math.pi - IN_LINE:
        raise OutOfRange(
            f"a peel at {math.degrees(phi):.6g} deg has no beginning: pulled in line a flat rod stays flat.",
            remedy="Give an angle between 0 and 180 deg, and 'deg' where degrees are meant.",
        )
    arm = non_negative("arm", arm, "" if rod.dimensionless else "m")
    scene = Scene(rod, tip=TipLoad(angle=phi), law=law, unbonded=arm)
    coarse, fine = (_family(scene, mesh) for mesh in SNAPS)
    steady = rod.work_of_separation / float(_factor(phi))
    branch, peak = _highest(coarse, steady / FORCE.size(rod), arm / rod.eta)
    if peak is None:
        raise NoEquilibrium(
            "the force rises to that of a long arm without a peak above it:"
            f" {steady:.6g} {Units.of(rod).force}.",
            nearest=steady,
        )
    i = branch.points.index(peak.point)
    again = found_again(fine, (branch.points[i - 1], branch.points[i + 1]), peak)
    if again is None:
        raise NotConverged("the peak of the force was lost on a finer mesh.", remedy="Give another arm.")
    ratio = fine.loading(again.point)
    error = abs(ratio - coarse.loading(peak.point)) + ROUNDING
    missed = certified(again.point, error, " of this peak", remedy="Give a slightly different arm or angle.")
    s, size = again.point.scalars, FORCE.size(rod)
    return PeelPeak(
        force=size * ratio,
        long_arm_force=steady,
        angle=phi,
        arm=arm,
        length=rod.length(s.sigma),
        tip_angle=-s.A,
        force_ratio=ratio,
        error=error,
        certificate=missed,
        rod=rod,
        law=scene.bond.law.name,
    )


def _highest(family: SceneFamily, steady: float, arm: float) -> tuple[SceneBranch, Located | None]:
    """Return the states of an arm at all forces, and the highest peak above the steady force.

    Raises
    ------
    NotConverged
        If they could not be followed to where the force is the steady one.
    """
    branch, rod = entered_branch(family), family.scene.rod
    far = arm + ZONES * rod.critical_length / rod.eta + LONG / math.sqrt(steady)
    if max(p.scalars.sigma for p in branch.points) < far:
        raise NotConverged(
            f"the peel could not be followed to its steady force (it ended: {branch.ends[1]}).",
            remedy="Give another angle, or a shorter arm.",
        )
    peaks = [
        fold
        for fold in branch.folds
        if fold.kind == "LP-load"
        and fold.point.scalars.sigma < far
        and family.loading(fold.point) > steady * (1.0 + LARGEST)
    ]
    return branch, max(peaks, key=lambda fold: family.loading(fold.point), default=None)


def _family(scene: Scene, mesh: Spectral) -> SceneFamily:
    """Return the family of the states of an arm at all forces, without a pressure."""
    ratio, none = Closure("ratio", scene.rod.ratio), Closure("pressure", 0.0)
    return SceneFamily(scene.bond.law, SceneSpectral(scene, mesh, "force"), ratio, holding=(none,))
