"""Snaps of edges without glue, many and much alike: each is found beside the nearest that is known.

At a snap what loads the edge has its maximum over the detached length.  From a snap nearby that is a few
secant steps of its rate along the branch, a solve each, where `safe_pressure` and `critical_flaw` walk the
whole branch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.errors import NotConverged, OutOfRange, PeelOptError
from ..base.threads import one_thread
from ..continuation.points import Point
from ..continuation.scene_family import LONGER, SceneFamily
from ..model.groups import PI4
from ..model.rod import Rod
from ..model.scene import Scene
from ..residual.closures import Closure
from ..residual.meshes import SNAPS
from ..residual.scene_spectral import SceneProfile, SceneSpectral
from ..residual.spectral import Spectral
from .unbonded import ROUNDING, TOUCHING, certified, critical_flaw, safe_pressure

#: Secant steps, the first of them over the length, and at which step they end.
STEPS, FIRST, LAST = 10, 1e-3, 1e-8


@dataclass(frozen=True)
class _Known:
    """A snap that has been found: log r, log of what is given, its shape."""

    place: np.ndarray
    profile: SceneProfile


@dataclass(eq=False)
class NearbySnaps:
    """The flaw that snaps at a pressure, or the pressure at which a flaw snaps, of rods that are much alike.

    Parameters
    ----------
    flaw : bool
        Whether the flaw is given, a/eta, and p/T0 is asked for; else the other way round.
    """

    flaw: bool
    _known: list[_Known] = field(default_factory=list)

    @one_thread
    def at(self, ratio: float, given: float) -> tuple[float, float]:
        """Return what is asked for at eta/y0 and a given number, and its error.

        Raises
        ------
        PeelOptError
            As `safe_pressure` and `critical_flaw`.
        """
        if not self.flaw and not 0.0 < given < 1.0:
            raise OutOfRange(f"p/T0 = {given:.6g}: a flaw is critical between 0 and T0 only.")
        place = np.log([ratio, given])
        near = min(self._known, key=lambda known: float(np.sum((known.place - place) ** 2)), default=None)
        try:
            if near is not None:
                return self._beside(near.profile, ratio, given)
        except PeelOptError:
            pass
        rod = Rod.from_ratio(ratio)
        found = safe_pressure(rod, given) if self.flaw else critical_flaw(rod, given)
        value = found.pressure_ratio if self.flaw else found.flaw_ratio
        self._learn(ratio, given, value, found.length)
        return value, found.error

    def _learn(self, ratio: float, given: float, value: float, sigma: float) -> None:
        """Keep the shape of a snap that was found by a walk, as far as one state tells it."""
        from ..equilibria.scenes import solve  # as a state of its scene

        flaw, pressure = (given, value) if self.flaw else (value, given)
        scene = Scene(Rod.from_ratio(ratio), unbonded=flaw)
        try:
            state = solve(scene, free="pressure", length=sigma, near=pressure)
        except PeelOptError:
            return
        source = state.source
        profile = source.problem.profile(source.x)  # type: ignore[union-attr]
        assert isinstance(profile, SceneProfile)
        self._known.append(_Known(np.log([ratio, given]), profile))

    def _beside(self, profile: SceneProfile, ratio: float, given: float) -> tuple[float, float]:
        flaw = given if self.flaw else profile.numbers["unbonded"]
        scene = Scene(Rod.from_ratio(ratio), unbonded=flaw)
        s = profile.scalars
        scalars = replace(s, lam=ratio * s.sigma**4 - PI4)
        numbers = profile.numbers | {"unbonded": flaw, "ratio": ratio}
        start = replace(profile, scene=scene, numbers=numbers, scalars=scalars)
        values = []
        for mesh in SNAPS:
            family = self._family(scene, mesh, ratio, given)
            point = _maximum(family, start)
            values.append(family.loading(point))
            if not family.suits(point.profile, point.problem) or point.scalars.A >= TOUCHING:
                raise NotConverged("the edge that was found is another.")
            start = point.profile  # type: ignore[assignment]
        error = abs(values[1] - values[0]) + ROUNDING
        certified(point, error)
        self._known.append(_Known(np.log([ratio, given]), start))
        return values[1], error

    def _family(self, scene: Scene, mesh: Spectral, ratio: float, given: float) -> SceneFamily:
        closure, law = Closure("ratio", ratio), scene.bond.law
        if self.flaw:
            return SceneFamily(law, SceneSpectral(scene, mesh), closure)
        held = (Closure("pressure", given),)
        return SceneFamily(law, SceneSpectral(scene, mesh, "unbonded"), closure, holding=held)


def _maximum(family: SceneFamily, start: SceneProfile) -> Point:
    """Return the state near a shape at which what loads the edge has its maximum over the length.

    Raises
    ------
    NotConverged
        If there is none that a few steps lead to.
    """

    def at(sigma: float) -> tuple[Point, float]:
        solved = family.solve(start, Closure("length", sigma))
        if solved is None:
            raise NotConverged("no state beside the snap.")
        point = family.point(solved[0], solved[1].x, LONGER, 0.0, 0)
        return point, family.loading_rate(point) / point.turn.sigma

    before, sigma = start.scalars.sigma, start.scalars.sigma * (1.0 + FIRST)
    _, rate_before = at(before)
    for _ in range(STEPS):
        point, rate = at(sigma)
        bend = (rate - rate_before) / (sigma - before) if sigma != before else -math.inf
        if not bend < 0.0:
            raise NotConverged("what loads the edge has no maximum here.")
        step = -rate / bend
        if abs(step) > 0.2 * sigma:
            raise NotConverged("the snap is not near.")
        if abs(step) < LAST * sigma:
            return point
        before, rate_before, sigma = sigma, rate, sigma + step
    raise NotConverged("the snap was not met in a few steps.")
