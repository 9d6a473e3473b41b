"""What moves, a rod under a uniform pressure or the rod of a scene, and the states that it is let go in."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..base.checks import positive
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged, OutOfRange
from ..continuation.points import Point
from ..continuation.scene_family import SceneBranch, relative_height, scene_branches
from ..equilibria.ask import length_given_pressure
from ..equilibria.question import known_law
from ..equilibria.result import Equilibrium
from ..equilibria.scene_question import posed
from ..equilibria.scenes import plain_law, refuse_options, solve
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.rod import Rod, Units, require_rod
from ..model.scene import Scene
from ..model.tips import FREE, Contact
from ..residual.meshes import SCENES
from ..residual.scene_spectral import SceneDiscretisation, SceneSolution
from .acting import Loads, loads_on
from .departure import at_rest, stretched
from .run import Posture

#: Height of the tip, as a share of the largest, below which a limit point is that of a rod that touches.
DOWN = 1e-2

#: Detached length over eta of a rod that is attached but for its tip.
SHORT = 1e-6


class Beginning(NamedTuple):
    """A shape to let go, and the equilibrium that it is, where it is one at the pressure that is held."""

    posture: Posture
    state: Equilibrium | None = None


@dataclass(frozen=True, eq=False)
class Subject:
    """What moves.

    Parameters
    ----------
    rod : Rod
    law : str or CohesiveLaw
        As a question about the rod takes it.
    scene : Scene or None
        None for the paper's.
    """

    rod: Rod
    law: str | CohesiveLaw
    scene: Scene | None = None

    @cached_property
    def loads(self) -> Loads:
        """What acts on it.

        Raises
        ------
        InvalidInput
            If a part of the scene is one whose motion is not computed.
        """
        return loads_on(self.scene or self.rod)

    @property
    def bond_law(self) -> CohesiveLaw:
        """The law of its bond."""
        return known_law(self.law) or COHESIVE if self.scene is None else self.scene.bond.law

    def unstable(self, pressure: float) -> Beginning:
        """Return the unfolded state at a pressure [Pa], or the limit point that an edge has gone beyond.

        Raises
        ------
        NoEquilibrium
            If there is neither; of what grows stably it says so.
        OutOfRange
            If the attached rod does not bear the pressure.
        """
        if self.scene is None:
            self.require_holds(pressure, 0.0)
            state = length_given_pressure(self.rod, pressure, law=self.law)
            return Beginning(stretched(state, state.length_ratio), state)
        try:
            start = self._unstable_of(self.scene, pressure)
        except (NoEquilibrium, NotConverged):
            self.require_holds(pressure, max(self.loads.unbonded, SHORT))
            raise
        self.require_holds(pressure, float(start.posture.s[-1]))
        return start

    def _unstable_of(self, scene: Scene, pressure: float) -> Beginning:
        branch = self._branch
        snap = branch.snap
        if snap is not None and relative_height(snap.point) < DOWN:
            snap = None
        if snap is not None and self.rod.pressure_ratio(pressure) >= branch.family.loading(snap.point):
            return Beginning(_posture(snap.point))
        try:
            state = solve(scene, free="length", pressure=pressure, state="unfolded")
        except NoEquilibrium as error:
            lifted = self.lifted(pressure)
            if lifted is None:
                raise
            raise self._stable(pressure, lifted, snapping=snap is not None or branch.overshoots) from error
        return Beginning(stretched(state, state.length_ratio), state)

    def _stable(self, pressure: float, lifted: Posture, *, snapping: bool) -> NoEquilibrium:
        """Say that nothing snaps at a pressure at which a rod is lifted."""
        units, length = Units.of(self.rod), self.rod.length(float(lifted.s[-1]))
        why = "the pressure is too low" if snapping else "its rod does not snap, but grows stably"
        there = "is lifted" if lifted.theta.any() else "lies flat, or nearly so,"
        if lifted.theta[0] > 0.0:
            there = "rests with its tip on the wall"
        return NoEquilibrium(
            f"this scene has no unfolded state to snap from at p = {pressure:.6g} {units.pressure}: {why}. It"
            f" {there} there, with sbar = {length:.6g} {units.length}.",
            remedy='solve(state="lifted") has that state, history(pressure=) the way there and back.',
        )

    def lifted(self, pressure: float) -> Posture | None:
        """Return the stable state that goes on from the attached rod at a pressure [Pa].

        That of an edge which nothing lifts off the plate lies flat, and a rod that curls into its wall rests
        there with its tip.  None where there is none.
        """
        if self.scene is None:
            return None
        if self.scene.imposed_curvature < 0.0:
            return self._solved(replace(self.scene, tip=Contact()), pressure)
        branch = self._branch
        if not branch.rises:
            return None
        least = branch.family.loading(branch.points[0])
        if self.loads.unbonded and branch.ends[0] == "rest" and self.rod.pressure_ratio(pressure) <= least:
            s = np.linspace(0.0, self.loads.unbonded)
            return Posture(s, np.zeros_like(s), np.zeros_like(s))
        return self._solved(self.scene, pressure)

    @staticmethod
    def _solved(scene: Scene, pressure: float) -> Posture | None:
        """Return the lifted state of a scene, None where there is none."""
        try:
            state = solve(scene, free="length", pressure=pressure, state="lifted")
        except (NoEquilibrium, NotConverged):
            return None
        return stretched(state, state.length_ratio)

    def longest(self, rod_length: float | None) -> float:
        """Return the length of the whole rod, over eta, of one that is given [m] or is long enough.

        Raises
        ------
        InvalidInput
            If it is not positive, or goes around the circle that it lies on more than once.
        """
        units, bent = Units.of(self.rod), abs(self.loads.wall_curvature)
        around = 2.0 * math.pi / bent if bent else math.inf
        if rod_length is None:
            return around
        length = self.rod.length_ratio(
            positive("rod_length", rod_length, "" if self.rod.dimensionless else "m")
        )
        if length > around:
            raise InvalidInput(
                f"a rod of {self.rod.length(length):.6g} {units.length} goes around its wall more than once,"
                f" on {self.rod.length(around):.6g} {units.length}.",
                remedy="Give a shorter rod_length, or leave it out.",
            )
        return length

    def require_holds(self, pressure: float, sbar: float) -> None:
        """Raise where the attached rod does not bear what pulls on it.

        Raises
        ------
        OutOfRange
        """
        P = self.rod.pressure_ratio(pressure)
        lift = self.loads.lift(P, sbar)
        if lift < 1.0:
            return
        if self.scene is None:
            raise OutOfRange(
                f"p/T0 = {P:.6g}: from T0 on the bond fails everywhere at once, and no front runs that is"
                " local.",
                remedy="Ask for a pressure just below T0, from a flaw a little longer than the unfolded"
                " state.",
            )
        raise OutOfRange(
            f"at p/T0 = {P:.6g} the attached rod is pulled off with {lift:.6g} T0 at its front, sbar/eta ="
            f" {sbar:.6g}: from T0 on the bond fails everywhere at once, and no front runs that is local.",
            remedy="Ask for a lower pressure.",
        )

    @property
    def _branch(self) -> SceneBranch:
        """The states of the scene at all pressures, as `solve` follows them; remembered there."""
        assert self.scene is not None
        question = posed(self.scene, "length", {})
        (branch,) = scene_branches(question.family(SCENES))
        return branch


def subject_of(given: Rod | Scene, law: str | CohesiveLaw) -> Subject:
    """Return what moves, of a rod under a law or of a scene, which has its own.

    Raises
    ------
    InvalidInput
        If it is neither, a scene comes with another law, or the motion of a part of it is not computed.
    """
    if not isinstance(given, Scene):
        return Subject(require_rod(given), law)
    refuse_options(law=law)
    if isinstance(given.tip, Contact):  # which is free to leave the wall
        given = replace(given, tip=FREE)
    subject = Subject(given.rod, plain_law(given)) if given.is_plain else Subject(given.rod, "auto", given)
    _ = subject.loads  # which may refuse it
    return subject


def lengthened(start: Posture, length: float) -> Posture:
    """Return a shape at rest, stretched to a length over eta."""
    s = start.s * (length / float(start.s[-1]))
    return Posture(s, start.theta, np.zeros_like(s))


def _posture(point: Point) -> Posture:
    """Return the shape of a point of a scene's branch."""
    assert isinstance(point.problem, SceneDiscretisation)
    shape = SceneSolution(point.problem, point.x, point.problem.settings.scene.bond.law).shape()
    scene, sbar = point.problem.settings.scene, point.scalars.sigma
    return at_rest(shape, sbar, scene.wall_curvature, sbar)
