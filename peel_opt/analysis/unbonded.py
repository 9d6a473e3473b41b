"""An edge that was never glued: at which pressure it snaps, and which length is critical.

A flaw is a length a without glue, not a detached length: that contains the cohesive zone ahead of it.
At p = 0 the edge lies flat; pressure, detached length and tip angle then rise together until the
pressure has its maximum p_max(a).  There the rod snaps.  p_max falls with a, and as a -> 0 it goes to
T0: the paper's transition is the limit of these limit points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..base.checks import positive
from ..base.errors import NoEquilibrium, NotConverged, OutOfRange
from ..base.threads import one_thread
from ..continuation.points import Point
from ..continuation.scene_family import SceneBranch, SceneFamily, entered_branch, scene_branches
from ..continuation.special import Located
from ..model.bond import CohesiveLaw
from ..model.rod import RATIOS, Rod, Units, require_rod
from ..model.scene import Scene
from ..residual.closures import Closure
from ..residual.free_arc import curve
from ..residual.meshes import SNAPS
from ..residual.scene_spectral import SceneDiscretisation, SceneSpectral
from ..residual.spectral import Spectral

#: Tip angle [rad] just short of 4 pi/3, at which the tip of a flap without glue comes down to its wall.
TOUCHING = 4.188

#: Stretches a (p/k)^(1/3) between which the tip of a clamped flap comes down to its plate.
TOUCHES = (4.5, 5.2)

#: Largest error of p/T0 or a/eta, and largest certificate, that is returned.
LARGEST = 1e-8

#: What rounding leaves of a located snap.
ROUNDING = 1e-14

#: a/eta from which the way to a critical flaw begins, where none is found from an edge that holds.
BEGINNING = 0.5

#: p/T0 above which an edge is lost beside T0, as a short one, and below which as a long one.
HALF = 0.5

#: Edges that hold, over (k y0/T0)^(1/4): near T0 as a multiple of 1 - p/T0, and as a share of that of a
#: clamped flap.
NEAR_T, CLAMPED = 0.5, 0.25


@dataclass(frozen=True)
class FlawLimit:
    """The snap of an edge that was never glued.

    Parameters
    ----------
    pressure : float
        p_max(a) [Pa].
    flaw : float
        a, the length without glue [m].
    length : float
        Detached length at the snap [m].
    tip_angle : float
        theta at the tip there [rad].
    pressure_ratio, flaw_ratio : float
        p/T0 and a/eta.
    error : float
        Absolute error of the one that was asked for, p/T0 or a/eta.
    certificate : float
        By how much the identity p y_tip = Phi(y(a)) is missed, over T0 eta.
    rod : Rod
    law : str
        Name of the cohesive law.
    """

    pressure: float
    flaw: float
    length: float
    tip_angle: float
    pressure_ratio: float
    flaw_ratio: float
    error: float
    certificate: float
    rod: Rod
    law: str


@one_thread
def safe_pressure(rod: Rod, flaw: float, *, law: str | CohesiveLaw = "auto") -> FlawLimit:
    """Return the pressure at which an edge without glue snaps; below it, it holds.

    Parameters
    ----------
    rod : Rod
    flaw : float
        Length a from the tip that was never glued [m].
    law : str or CohesiveLaw
        As in `length_given_pressure`.

    Returns
    -------
    FlawLimit
        Its ``pressure`` [Pa] is what is asked for.

    Raises
    ------
    NoEquilibrium
        If the edge does not snap, but grows stably; the message says up to where.
    NotConverged
        If the states of this edge could not be followed so far.

    Examples
    --------
    >>> round(safe_pressure(Rod.from_ratio(1.0), 1.0).pressure, 9)
    0.3535513
    """
    scene = flawed(rod, flaw, law)
    found = [snap_of(loading(scene, mesh), scene) for mesh in SNAPS]
    return _limit(
        scene, found, [s.point.scalars.pressure_ratio for s in found], flaw=scene.numbers["unbonded"]
    )


@one_thread
def critical_flaw(rod: Rod, pressure: float, *, law: str | CohesiveLaw = "auto") -> FlawLimit:
    """Return the length without glue that snaps at a pressure; a shorter one holds.

    The inverse of `safe_pressure`: at a fixed pressure no equilibrium that is lifted from rest has a
    longer one.

    Parameters
    ----------
    rod : Rod
    pressure : float
        Between zero and T0 [Pa].
    law : str or CohesiveLaw
        As in `length_given_pressure`.

    Returns
    -------
    FlawLimit
        Its ``flaw`` [m] is what is asked for.

    Raises
    ------
    OutOfRange
        From T0 on, where every edge snaps, and below zero, where none does.
    NoEquilibrium
        If at this pressure edges of every length that was followed grow stably.
    NotConverged
        If the states at this pressure could not be followed so far.

    Examples
    --------
    >>> round(critical_flaw(Rod.from_ratio(1.0), 0.3535512998).flaw, 7)
    1.0
    """
    P = require_rod(rod, RATIOS).pressure_ratio(pressure)
    if not 0.0 < P < 1.0:
        raise OutOfRange(
            f"p/T0 = {P:.6g}: a flaw is critical at pressures between 0 and T0 only.",
            remedy="From T0 on an edge of any length snaps, and without a pressure none does.",
        )
    scene = flawed(rod, BEGINNING * rod.eta, law)
    found = [snap_of(_growing(scene, mesh, P), scene) for mesh in SNAPS]
    flaws = [s.point.problem.found(s.point.x)["unbonded"] for s in found]  # type: ignore[attr-defined]
    return _limit(scene, found, flaws, flaw=flaws[-1])


def flawed(rod: Rod, flaw: float, law: str | CohesiveLaw) -> Scene:
    """Return the scene of an edge without glue."""
    require_rod(rod, RATIOS)
    flaw = positive("flaw", flaw, "" if rod.dimensionless else "m")
    return Scene(rod, law=law, unbonded=flaw)


def loading(scene: Scene, mesh: Spectral) -> SceneBranch:
    """Return the states of an edge at all pressures.

    Raises
    ------
    NotConverged
        If none was reached.
    """
    try:
        return entered_branch(loaded(scene, mesh))
    except NotConverged as error:
        raise NotConverged(
            f"no state of an edge without glue of {scene.numbers['unbonded']:.6g} eta could be reached.",
            remedy="Give a shorter one, or check its unit.",
        ) from error


def loaded(scene: Scene, mesh: Spectral) -> SceneFamily:
    """Return the family of the states of an edge at all pressures."""
    return SceneFamily(scene.bond.law, SceneSpectral(scene, mesh), Closure("ratio", scene.rod.ratio))


def _growing(scene: Scene, mesh: Spectral, P: float) -> SceneBranch:
    """Return the states of edges of all lengths at a pressure.

    Critical flaws scale with (k y0/T0)^(1/4): they fall with T0 - p to zero, and a clamped flap, which has
    the moment p a^2/2 at its front, snaps where k kappa^2/2 is T0 y0/2.  Where the plain rod leads to none
    that snaps, one that still holds does.
    """
    rod, ratio, held = scene.rod, Closure("ratio", scene.rod.ratio), Closure("pressure", P)
    holds = min(NEAR_T * (1.0 - P), CLAMPED * math.sqrt(2.0 / P)) * rod.ratio**-0.25
    ways: list[tuple[float, Callable[[SceneFamily], Sequence[SceneBranch]]]] = [
        (BEGINNING, lambda family: (entered_branch(family),)),
        (holds, scene_branches),
    ]
    found: SceneBranch | None = None
    lost: NotConverged | None = None
    for flaw, branches_of in reversed(ways) if holds > BEGINNING else ways:
        start = SceneSpectral(replace(scene, unbonded=flaw * rod.eta), mesh, "unbonded")
        try:
            branches = branches_of(SceneFamily(scene.bond.law, start, ratio, holding=(held,)))
        except NotConverged as error:
            lost = error
            continue
        found = next((branch for branch in branches if branch.snap is not None), found or branches[0])
        if found.snap is not None:
            return found
    if found is None:
        raise NotConverged(
            f"at p/T0 = {P:.6g} no edge without glue could be followed.", remedy="Give a higher pressure."
        ) from lost
    return found


def snap_of(branch: SceneBranch, scene: Scene) -> Located:
    """Return the maximum of what loads the edge.

    Raises
    ------
    NoEquilibrium
        If there is none.
    NotConverged
        If the walk did not come far enough to know.
    """
    if (found := branch.snap) is not None and found.point.scalars.A < TOUCHING:
        if found.status != "located":
            raise NotConverged(
                "the snap could only be bracketed.", remedy="Give a slightly different edge or pressure."
            )
        return found
    s = branch.points[-1].scalars
    rod = scene.rod
    reached = f"p/T0 = {s.pressure_ratio:.6g}, sbar/eta = {s.sigma:.6g}, tip angle {-s.A:.4g} rad"
    if branch.ends[1] in ("stalled", "limit"):
        raise NotConverged(
            f"no snap was met as far as the edge could be followed ({reached}).",
            remedy="Give a shorter edge."
            if branch.family.free is None
            else f"Give a {'lower' if s.pressure_ratio > HALF else 'higher'} pressure.",
        )
    if branch.overshoots or not branch.rises:
        raise NotConverged(
            "the edge snaps nearer to its rest than its states are followed, beside T0.",
            remedy="Give a longer edge, or a lower pressure.",
        )
    if branch.family.free is not None:
        longest = rod.length(max(branch.family.loading(p) for p in branch.points))
        raise NoEquilibrium(
            f"no edge snaps at this pressure: those that were followed, up to a = {longest:.6g}"
            f" {Units.of(rod).length}, grow stably."
        )
    highest = min(1.0, (touching_stretch() / scene.numbers["unbonded"]) ** 3)
    held = f"{rod.pressure(highest):.6g} {Units.of(rod).pressure}"
    where = "where the bond itself fails" if highest == 1.0 else "where its tip comes back to the plate"
    raise NoEquilibrium(
        f"the edge does not snap: it grows stably up to p = {held} (p/T0 = {highest:.6g}), {where}.",
        nearest=rod.pressure(highest),
    )


@lru_cache(maxsize=1)
def touching_stretch() -> float:
    """Return a (p/k)^(1/3) of an edge without glue whose tip comes back to the plate.

    There its front is back where the glue begins, and the edge is a flap that is clamped at it: the curve
    of a free arc has closed.

    Examples
    --------
    >>> round(touching_stretch(), 6)
    4.857301
    """
    from scipy.optimize import brentq  # which takes long to import

    def level(stretch: float) -> float:
        return float(curve(np.array([stretch]), TOUCHES[1])[1][0])

    return float(brentq(level, *TOUCHES, xtol=1e-15, rtol=1e-14))


def certified(point: Point, error: float, of: str = "", *, remedy: str = "") -> float:
    """Return the certificate of a state of a scene, if neither it nor the error of the answer is too large.

    Raises
    ------
    NotConverged
        If one of them is.
    """
    assert isinstance(point.problem, SceneDiscretisation)
    missed = point.problem.certificate(point.x)
    if max(error, missed) > LARGEST:
        raise NotConverged(
            f"the error {error:.1e} or the certificate {missed:.1e}{of} exceeds {LARGEST:g}.", remedy=remedy
        )
    return missed


def _limit(scene: Scene, found: list[Located], answers: list[float], flaw: float) -> FlawLimit:
    rod, s = scene.rod, found[-1].point.scalars
    error = abs(answers[1] - answers[0]) + ROUNDING
    missed = certified(found[-1].point, error, " of this snap", remedy="Give a slightly different edge.")
    return FlawLimit(
        pressure=rod.pressure(s.pressure_ratio),
        flaw=rod.length(flaw),
        length=rod.length(s.sigma),
        tip_angle=-s.A,
        pressure_ratio=s.pressure_ratio,
        flaw_ratio=flaw,
        error=error,
        certificate=missed,
        rod=rod,
        law=scene.bond.law.name,
    )
