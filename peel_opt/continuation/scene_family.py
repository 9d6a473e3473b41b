"""Branches of scenes: how one is entered from the paper's, and walked both ways from there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from ..base.errors import InvalidInput, NotConverged
from ..model.mixed_bonds import LINE
from ..model.renumbered import renumbered
from ..model.scene import Scene
from ..model.tips import Contact, Middle, TipLoad
from ..residual.closures import READINGS, Closing, Closure
from ..residual.discretisation import Discretisation, Phases, Profile
from ..residual.newton import Correction
from ..residual.phases import Layout, fits, without_middle_phase
from ..residual.scene_phases import material_breaks, scene_layout
from ..residual.scene_spectral import SceneDiscretisation, SceneProfile, SceneSpectral
from .family import Family, StepControl
from .points import Point, place_of
from .primary import Candidate, crossings, primary_branch
from .scene_starts import SmallState, buckled, curled, layered, pressed, split, swollen
from .special import LENGTH, Located, Monitor, locate

#: Tip angles [rad] at which a scene is entered, one after the other: at a fixed angle, where neither p
#: nor sbar is held, a state exists in almost every scene.
ENTRIES = (0.4, 0.8, 0.2, 1.2, 0.1)

#: What is held on the way into a scene, one after the other where it stalls.
HELD = {"amplitude": lambda s: float(s.A), "pressure": READINGS["pressure"], "length": READINGS["length"]}

#: p/T0 from which on the last even step of a way to no pressure would still be a long one.
ENORMOUS = 100.0

#: Share of its amplitude that a state keeps at least in a step of the way into a scene.
SHRINKS = 0.1

#: Shortest step of the way into a scene.
SHORTEST = 1e-3

#: Detached length over eta below which a state counts as vanished.
SHORT = 1e-6

#: Detached length, in lengths of decay of the attached rod, below which none is followed on a layer: the
#: pressure that it takes grows without limit.
LEVER = 0.3

#: Height of a tip, as a share of the largest, below which its least one is that of a touch.
NEAR = 0.02

#: Least amplitude to which a branch is followed, by which the equations are divided: towards T, where
#: rounding in a tangent goes with its inverse square, and towards a rest, where the loads vanish with it.
LEAST, RESTING = 1e-5, 1e-9

#: Amplitude below which rounding may turn a branch: no least pressure is there.
ROUNDED = 1e-4

#: p/T0 beyond which no branch is followed, and that of the state it begins with, times a factor.
HIGHEST, ABOVE = 1e3, 4.0

#: Gap at the tip, as a share of the largest, within which a folded rod has come back to its wall.
TOUCHING = 1e-7

#: The same, within which a walk that can go no further has come to where the rods are whose tip touches.
DOWN = 1e-4

#: Factor by which the tip angle falls at most between the last states of a branch.
FALLING = 4.0

#: Gap at the tip over y0, and p/T0, below zero that no rounding explains.
BELOW = 1e-9

#: Inclination [rad] beyond which a rod is rolled up.
ROLLED = 6.5

#: Detached length over eta beyond which neither a strip nor a rod that rests on its tip is followed.
FAR = 50.0

#: Rate along a branch below which a number stands still, as the moment of a long strip does.
STILL = 1e-7

#: Directions in which the tip turns further, away from rest, and in which the rod gets longer.
FORWARD, LONGER = np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])

#: Points over which a branch shows whether it rises: at the first alone its tangent may be rounding.
BEGINNING = 3

#: Share by which what loads a rod falls where a maximum was stepped over: more than what rounding does.
STEPPED_OVER = 1e-10

#: Iterations of a correction that lets the next step grow, on a layer: rounding makes the last two.
QUICK_ON_A_LAYER = 6

#: Points of a branch after which it is given up, in each direction.
LONGEST = 200


@dataclass(frozen=True)
class SceneFamily(Family):
    """A one-parameter family of states of a scene.

    Parameters
    ----------
    holding : tuple of Closure
        What is held beside the rod's ratio: the pressure, where a number of the scene is left free.
    """

    holding: tuple[Closure, ...] = ()

    @property
    def closures(self) -> tuple[Closure, ...]:
        """The closures that hold along the branch."""
        return (self.closure, *self.holding)

    @property
    def scene(self) -> Scene:
        """The scene."""
        assert isinstance(self.transcription, SceneSpectral)
        return self.transcription.scene

    @property
    def free(self) -> str | None:
        """The number of the scene that varies along the branch, where the pressure is held."""
        assert isinstance(self.transcription, SceneSpectral)
        return self.transcription.free

    @cached_property
    def keeps_flat(self) -> bool:
        """Whether the attached rod is an equilibrium all along, whatever the varying number has become."""
        scene, flat = self.scene, self.scene.keeps_flat
        if self.free is None or not flat:
            return flat
        another = (2.0 * scene.numbers[self.free] + 1.0) * scene.dimensions[self.free].size(scene.rod)
        try:
            return renumbered(scene, {self.free: another}).keeps_flat
        except InvalidInput:  # a number that may not be so large
            return flat

    def loading(self, point: Point) -> float:
        """What loads the rod at a point: p/T0, or the number left free."""
        if self.free is None:
            return float(point.scalars.pressure_ratio)
        return float(point.x[point.problem.extra.stop - 1])

    def loading_rate(self, point: Point) -> float:
        """Derivative along the branch of what loads the rod: the pressure, or the number left free."""
        if self.free is None:
            return point.rate(lambda s: s.pressure_ratio)
        return float(point.tangent[point.problem.extra.stop - 1])

    @property
    def monitors(self) -> tuple[tuple[str, Monitor], ...]:
        """What vanishes at the folds of the branch."""
        return (("LP-pressure" if self.free is None else "LP-load", self.loading_rate), LENGTH)

    def certificate(self, point: Point) -> float:
        """How far a solution misses the identity of the scene, or its edge in an independent integration."""
        assert isinstance(point.problem, SceneDiscretisation)
        return point.problem.certificate(point.x)

    def certificates(self, points: Sequence[Point]) -> np.ndarray:
        """`certificate` of many points, one after the other."""
        return np.array([self.certificate(point) for point in points])

    def step(self, here: Point, ds: float, behind: Point | None = None) -> Point | None:
        """Advance by ``ds`` along the tangent alone.

        A better start would let steps grow beyond the places where a tip comes down and goes up again.
        """
        return super().step(here, ds)

    def solve(self, profile: Profile, other: Closing) -> tuple[Discretisation, Correction] | None:
        """Correct from a profile; a step that foresees no length leads nowhere."""
        return super().solve(profile, other) if profile.scalars.sigma > 0.0 else None

    def phases_of(self, profile: Profile) -> Layout:
        """Read the stretches of a shape off what the bond sees and where its material points are."""
        assert isinstance(profile, SceneProfile)
        return scene_layout(profile)

    def merged(self, profile: Profile, phases: Phases) -> Profile | None:
        """Return a shape without its thinnest inner phase, or without that at the middle of a strip."""
        inner = super().merged(profile, phases)
        if inner is not None or not isinstance(self.scene.tip, Middle) or len(phases) < 2:
            return inner
        return without_middle_phase(profile)

    def suits(self, profile: Profile, problem: Discretisation) -> bool:
        """Whether the stretches of a solution are those that the scene asks for."""
        assert isinstance(profile, SceneProfile)
        if profile.scalars.sigma <= 0.0 or not np.all(profile.lengths > 0.0):
            return False
        inside = frozenset(name for _, name in material_breaks(profile))
        last = problem.phases[-1]
        if getattr(last, "past", frozenset()) != inside:
            return False
        return fits(profile, problem.phases) or self.phases_of(profile).phases == problem.phases


@dataclass(eq=False)
class SceneBranch:
    """The curve of states of a scene through the one at which it is entered, walked both ways.

    Parameters
    ----------
    family : SceneFamily
    points : list of Point
        In order, from the small states on.
    folds : list of Located
    ends : tuple of str
        Why the walk ended before its first and after its last point: "T", where the rod lies on its
        wall; "rest", where it comes to rest on its wall; "unloaded", where its pressure vanishes; "below",
        where it would have to go through its wall; "contact", "lifts", "rolled up"; or what the walk gave up
        at: "short", "long", "touched", "suction", "unbounded", "stalled" or "limit".
    """

    family: SceneFamily
    points: list[Point]
    folds: list[Located]
    ends: tuple[str, str]

    @cached_property
    def rises(self) -> bool:
        """Whether the branch goes on from the attached rod, and what loads it rises along it at first."""
        if self.ends[0] == "T" or len(self.points) < BEGINNING:
            return False
        first, later = (self.family.loading(self.points[i]) for i in (0, BEGINNING - 1))
        return later > first

    @cached_property
    def _turns(self) -> list[Point]:
        """Where what loads the rod has an extremum."""
        kind = "LP-pressure" if not self.family.free else "LP-load"
        return [f.point for f in self.folds if f.kind == kind]

    @cached_property
    def _least(self) -> list[float]:
        """Arclengths at which it has a minimum; beside a rest rounding makes extrema of its own."""
        turns = [p for p in self._turns if p.scalars.A > ROUNDED]
        loads = [self.family.loading(p) for p in (*turns, *self.points[-1:])]
        falls = [here < there for here, there in pairwise(loads)]
        return [p.arclength for p, low in zip(turns, falls, strict=True) if low]

    @cached_property
    def overshoots(self) -> bool:
        """Whether what loads the rod has its maximum so near to rest that the walk stepped over it.

        Then its first extremum, or the end of the branch, lies lower than a state before.
        """
        return self.rises and self._peak is not self._end_of_rise

    @cached_property
    def _end_of_rise(self) -> Point:
        """The first extremum of what loads the rod, or the end of the branch."""
        return self._turns[0] if self._turns else self.points[-1]

    @cached_property
    def _peak(self) -> Point:
        """Where it is largest up to there: there, unless a maximum was stepped over."""
        end, load = self._end_of_rise, self.family.loading
        highest = max((p for p in self.points if p.arclength <= end.arclength), key=load)
        return highest if load(highest) - load(end) > STEPPED_OVER * abs(load(highest)) else end

    @property
    def snap(self) -> Located | None:
        """The maximum of what loads a rod that is lifted from its rest; None where none was met."""
        if not self.rises or self.overshoots:
            return None
        kind = self.family.monitors[0][0]
        return next((f for f in self.folds if f.kind == kind), None)

    def state_at(self, arclength: float) -> str:
        """Label of a place on the branch.

        Where the rod is lifted from the start, "lifted" until the load has its maximum, the snap.  From
        there, or from T: "middle" until the first fold in length, "lower" until the minimum pressure,
        "folded" after it.  Where another number than the pressure varies, what is not lifted is "other".
        """
        snap = -math.inf
        if self.rises:
            snap = self._peak.arclength if self._turns or self.overshoots else math.inf
        if arclength < snap:
            return "lifted"
        if self.family.free is not None:
            return "other"
        least = next((at for at in self._least if at > snap), math.inf)
        if arclength > least:
            return "folded"
        bends = (f.point.arclength for f in self.folds if f.kind == "LP-length")
        return "lower" if any(snap < at < arclength for at in bends) else "middle"

    def holds(self, point: Point) -> bool:
        """Whether a state of the same family lies between two points of the branch."""
        return any(self.family.between(a, b, point.place) for a, b in pairwise(self.points))

    def candidates(self, given: Closure) -> list[Candidate]:
        """All states of the branch at a closure.

        Where the tip of a folded rod comes down to its wall the branch meets that of the rods whose tip
        touches it, which by the identity exist at every pressure.  A walk may turn into that one, and what
        it finds there is "other".
        """
        found = crossings(self.family, self.points, given, self.state_at)
        return [replace(c, state="other") if self._is_down(c) else c for c in found]

    def _is_down(self, candidate: Candidate) -> bool:
        """Whether the tip of a folded rod touches its wall: on a finer mesh nothing is left of its height."""
        mesh = self.family.transcription
        assert isinstance(mesh, SceneSpectral)
        if not isinstance(mesh.scene.tip, TipLoad) or candidate.state != "folded":
            return False
        if min(relative_height(p) for p in (candidate.here, candidate.there)) > NEAR:
            return False
        finer = replace(self.family, transcription=replace(mesh, mesh=mesh.mesh.refined().refined()))
        try:
            solved = finer.solve(candidate.profile, candidate.given)
        except NotConverged:
            return False
        return solved is not None and lies_down(solved[0].profile(solved[1].x))


@lru_cache(maxsize=128)
def scene_branches(family: SceneFamily) -> tuple[SceneBranch, ...]:
    """Return the curves of states of a scene that are found, each walked to both of its ends; remembered.

    With the pressure free there is one, entered from the paper's scene.  With another number free there
    is one through every state that the scene has at the pressure that is held, as far as they are not on
    one already; where it has none, again the one that is entered.

    Raises
    ------
    NotConverged
        If no way into the scene was found.
    """
    found: list[SceneBranch] = []
    for start in _starts(family):
        if not any(branch.holds(start) for branch in found):
            found.append(_walked(family, start))
    return tuple(found) or (entered_branch(family),)


@lru_cache(maxsize=64)
def entered_branch(family: SceneFamily) -> SceneBranch:
    """Return the curve through the state at which a scene is entered from the paper's; remembered.

    Raises
    ------
    NotConverged
        If no way into the scene was found.
    """
    return _walked(family, _entered(family))


def forget_scenes() -> None:
    """Let go of all remembered branches of scenes."""
    scene_branches.cache_clear()
    entered_branch.cache_clear()


def _starts(family: SceneFamily) -> Iterator[Point]:
    """Yield the states of a scene at the pressure that is held, with its own value of the free number."""
    if family.free is None:
        return
    mesh = family.transcription
    assert isinstance(mesh, SceneSpectral)
    with_all_given = replace(family, transcription=replace(mesh, free=None), holding=())
    try:
        (branch,) = scene_branches(with_all_given)
    except NotConverged:
        return
    for candidate in branch.candidates(family.holding[0]):
        try:
            solved = family.solve(candidate.profile, Closure("length", candidate.profile.scalars.sigma))
        except NotConverged:
            continue
        if solved is not None:
            yield family.point(solved[0], solved[1].x, _forward(family.scene), 0.0, solved[1].iterations)


def _forward(scene: Scene) -> np.ndarray:
    """Return the direction away from rest.

    A strip with slack that is short is the one that stands without a pressure: as it gets longer and
    flatter its pressure rises, up to where it snaps.
    """
    return LONGER if isinstance(scene.tip, Middle) and scene.tip.slack else FORWARD


def _walked(family: SceneFamily, start: Point) -> SceneBranch:
    """Walk both ways from a state."""
    start = _pressed(family, start)
    sucked = family.free is None and start.scalars.pressure_ratio < 0.0
    before, first = _walk(family, start.turned(0.0), _under_suction if sucked else _towards_rest)
    after, last = _walk(family, start, _towards_contact)
    points = [*(p.turned(-p.arclength) for p in reversed(before[1:])), *after]
    folds = [fold for pair in pairwise(points) for fold in _folds(family, pair)]
    known = {id(p) for p in points}
    points += [f.point for f in folds if id(f.point) not in known]
    return SceneBranch(family, sorted(points, key=lambda p: p.arclength), folds, (first, last))


def _pressed(family: SceneFamily, start: Point) -> Point:
    """Return a state without suction to begin with, where the way into a scene has led to one with it."""
    if family.free is not None or start.scalars.pressure_ratio >= 0.0:
        return start
    rises = start.rate(READINGS["pressure"]) > 0.0
    for first in (start, start.turned(0.0)) if rises else (start.turned(0.0), start):
        points, end = _walk(family, first, _towards_pressure)
        if end == "pressed":
            own = points[-1].problem, points[-1].x, _forward(family.scene), 0.0, points[-1].iterations
            return family.point(*own)
    return start


def _folds(family: SceneFamily, pair: tuple[Point, Point]) -> list[Located]:
    """Find the folds between two neighbours; what stands still but for rounding has none."""
    # Rounding in a tangent goes with 1/A^2.
    if min(p.scalars.A for p in pair) < 2.0 * _least_angle(family):
        return []
    moving = [m for m in family.monitors if max(abs(m[1](p)) for p in pair) > STILL]
    return locate(family, pair, tuple(moving))


def _walk(
    family: SceneFamily, start: Point, ends: Callable[[SceneFamily, Point], str]
) -> tuple[list[Point], str]:
    """Walk until an end of the branch is passed, and say which it is."""
    points: list[Point] = []
    highest = max(HIGHEST, ABOVE * abs(start.scalars.pressure_ratio))
    control = StepControl(quick=QUICK_ON_A_LAYER) if family.scene.layer is not None else None
    for point in family.walk(start, control):
        s = point.scalars
        if points and _least_angle(family) > s.A:
            return [*points, *_least(family, points[-1])], "T" if family.keeps_flat else "rest"
        if s.beta1 <= 0.0 or abs(s.pressure_ratio) > highest:
            return points, "unbounded"
        points.append(point)
        if end := ends(family, point):
            return points, end
        if _touched(points):
            return points[:-1], "touched"
        if s.A * np.abs(point.profile.values[:, :, 0]).max() > ROLLED or len(points) > LONGEST:
            return points, "limit" if len(points) > LONGEST else "rolled up"
    return points, "contact" if beside_contact(points[-1], DOWN) else "stalled"


def beside_contact(point: Point, within: float) -> bool:
    """Whether the tip of a folded rod is all but down, to a share of the largest gap.

    There the branch crosses that of the rods whose tip touches, and no step may go over a crossing.
    """
    return math.pi < point.scalars.A and relative_height(point) < within


def _touched(points: list[Point]) -> bool:
    """Whether the tip of a folded rod has come down to its wall and gone up again.

    The identity keeps it from going through: its height touches zero and changes no sign, and what a
    walk finds beyond is no state of a rod on a wall.
    """
    if len(points) < 3 or math.pi > points[-1].scalars.A:
        return False
    before, least, after = (relative_height(p) for p in points[-3:])
    return least < NEAR and least < before and least < after


def relative_height(point: Point) -> float:
    """Gap at the tip as a share of the largest."""
    assert isinstance(point.profile, SceneProfile)
    gaps = np.abs(point.profile.gaps())
    return float(gaps[0, 0] / gaps.max())


def _least_angle(family: SceneFamily) -> float:
    """Least amplitude to which a branch is followed: where it begins at T, or where the rod comes to rest."""
    return LEAST if family.keeps_flat else RESTING


def _least(family: SceneFamily, last: Point) -> list[Point]:
    """Return the states of ever smaller tip angles beyond the last point of a walk, down to the least.

    The pressure at a transition need not be T0, and alpha1/A then grows as the angle falls: no step may
    be long in its logarithm.
    """
    found: list[Point] = []
    A, least = last.scalars.A, _least_angle(family)
    while least < A:
        A = max(A / FALLING, least)
        solved = family.solve(last.profile, Closure("amplitude", A))
        if solved is None:
            break
        arclength = last.arclength + float(np.linalg.norm(place_of(*solved) - last.place))
        # The branch may turn by more than a right angle in a step, but the angle goes on falling.
        last = family.point(solved[0], solved[1].x, -FORWARD, arclength, solved[1].iterations)
        found.append(last)
    return found


def _towards_rest(family: SceneFamily, point: Point) -> str:
    """Say that the rod has come to rest on its wall, has vanished, or would have to go through it."""
    if family.free is None and point.scalars.pressure_ratio < 0.0 and point.scalars.sigma >= SHORT:
        return "unloaded"
    return _under_suction(family, point)


def _under_suction(family: SceneFamily, point: Point) -> str:
    """Say the same where the pressure is below zero from the start."""
    s, scene = point.scalars, family.scene
    if s.sigma < SHORT:
        return "rest"
    if scene.layer is not None and s.sigma * scene.layer.decay(_found(point)) < LEVER:
        return "short"
    return "below" if gap_at_tip(point) < -BELOW else ""


def _towards_pressure(family: SceneFamily, point: Point) -> str:
    """Say that the pressure is not below zero any more, or why that will not be seen."""
    if point.scalars.pressure_ratio >= 0.0:
        return "pressed"
    end = _under_suction(family, point) or _towards_contact(family, point)
    return "" if end == "suction" else end


def _towards_contact(family: SceneFamily, point: Point) -> str:
    """Say that the tip has come back to the wall, or that one that rests on it lifts off."""
    s, tip = point.scalars, family.scene.tip
    if not isinstance(tip, TipLoad):
        if s.sigma > FAR:
            return "long"
        if family.free is None and s.pressure_ratio < -BELOW:
            return "suction"
        lifts = isinstance(tip, Contact) and _found(point)["reaction"] < 0.0
        return "lifts" if lifts else ""
    down = lies_down(point.profile) if s.A > 1.0 else _opening_at_tip(point.profile) < -BELOW
    return "contact" if down else ""


def lies_down(profile: Profile) -> bool:
    """Whether the tip of a folded rod is on its wall, or below."""
    return profile.scalars.A > 1.0 and _opening_at_tip(profile) < TOUCHING


def _opening_at_tip(profile: Profile) -> float:
    """What the bond sees at the tip beyond what it sees at the front, as a share of the largest."""
    assert isinstance(profile, SceneProfile)
    layer, heights = profile.scene.layer, profile.heights()
    glued = layer.yields_at(profile.numbers) if layer is not None else 0.0
    return float((heights[0, 0] - glued) / np.abs(heights).max())


def _found(point: Point) -> dict[str, float]:
    """All numbers of the scene at a point."""
    assert isinstance(point.problem, SceneDiscretisation)
    return point.problem.found(point.x)


def gap_at_tip(point: Point) -> float:
    """Gap at the tip over y0, whatever else the bond sees of it."""
    assert isinstance(point.profile, SceneProfile)
    return float(point.profile.gaps()[0, 0] * point.scalars.ratio)


def _entered(family: SceneFamily) -> Point:
    """Return a state of a scene, led over from the paper's at a fixed tip angle, or from a small one.

    The loads come first, at whatever pressure the angle asks for; a number that is left free is then
    let go of, while the pressure moves to the one that is held.
    """
    furthest = 0.0
    for profile, way, held in _ways(family):
        found, h = _led_in(way, profile, held)
        if found is not None and family.free is not None:
            found, h = _released(family, found)
            h += 1.0
        furthest = max(furthest, h / (2.0 if family.free else 1.0))
        if found is not None:
            problem, solved = found
            return family.point(problem, solved.x, _forward(family.scene), 0.0, solved.iterations)
    raise NotConverged(
        f"the way from a plain rod into the scene was lost at {100.0 * furthest:.0f} % of it"
        f"{_where(family, furthest)}.",
        remedy="Name fewer or smaller loads, or check their units.",
    )


def _where(family: SceneFamily, share: float) -> str:
    """Return what the numbers that grow on the way into a scene had become, in words."""
    scene = family.scene
    share = min(1.0, 2.0 * share) if family.free is not None else share  # half of the way lets go of a number
    if not share:
        return ""
    there = scene.entered(share)
    grown = [
        f"{name} = {value * scene.dimensions[name].size(scene.rod):.4g}"
        f" {scene.dimensions[name].unit_of(scene.rod)}".rstrip()
        for name, value in scene.numbers.items()
        if there[name] != value and value
        for value in (there[name],)
    ]
    return f", where {', '.join(grown)}" if grown else ""


def _ways(family: SceneFamily) -> Iterator[tuple[Profile, Callable[[float], SceneFamily], Closure]]:
    """Yield states to begin with, each with a way into the scene and what is held on it."""
    scene = family.scene
    if scene.bond is not LINE and isinstance(scene.tip, TipLoad):
        for A in _entries(family):
            if (profile := _plain(family, A)) is None:
                continue
            if scene.layer is None:
                yield profile, _into(family), Closure("amplitude", A)
            else:
                yield from _way_from(family, layered(scene, profile))
        return
    for first in _small(scene):
        yield from _way_from(family, first(scene, family.closure.value))


def _way_from(
    family: SceneFamily, start: SmallState
) -> Iterator[tuple[Profile, Callable[[float], SceneFamily], Closure]]:
    """Yield a small state once it is solved for, with the way into the scene."""
    way = _into(family, start)
    if (found := way(0.0).solve(start.profile, start.held)) is not None:
        yield found[0].profile(found[1].x), way, start.held


def _small(scene: Scene) -> tuple[Callable[[Scene, float], SmallState], ...]:
    """Small states that a scene may begin with, the likeliest first."""
    if isinstance(scene.tip, Contact):
        return (pressed,) if scene.line_energy else (curled,)
    if not scene.line_energy:
        return (swollen,)
    if not (isinstance(scene.tip, Middle) and scene.tip.slack):
        return (split,)
    return (buckled, *((swollen,) if scene.bond is not LINE else ()), *((split,) if scene.stretch else ()))


def _entries(family: SceneFamily) -> list[float]:
    """Tip angles to enter at: below the one at which a plain rod bears the pressure that is held."""
    plain = primary_branch(family.law, family.closure)
    found = [c for held in family.holding for c in plain.candidates(held)]
    return [*(0.6 * c.estimate(lambda s: s.A) for c in found[:1]), *ENTRIES]


def _into(family: SceneFamily, start: SmallState | None = None) -> Callable[[float], SceneFamily]:
    """Return the way into a scene: from the paper's, or from a start of its own, to all of its loads."""
    mesh = family.transcription
    assert isinstance(mesh, SceneSpectral)
    first, instead = (start.entered, start.instead) if start is not None else (0.0, ())

    def way(h: float) -> SceneFamily:
        numbers = tuple((name, _between(v, family.scene.numbers[name], h)) for name, v in instead)
        entered = first + h * (1.0 - first)
        own = replace(mesh, entered=entered, free=None, instead=numbers if h < 1.0 else ())
        return replace(family, transcription=own, holding=())

    return way


def _between(start: float, end: float, h: float) -> float:
    """Return a number on its way, by equal factors where it is positive."""
    return start * (end / start) ** h if start > 0.0 < end else start + h * (end - start)


def _pressure_between(start: float, end: float, h: float) -> float:
    """Return a pressure on its way; from thousands of T0 by equal factors down to about T0, then evenly."""
    if abs(start) < ENORMOUS:
        return _between(start, end, h)
    return math.sinh((1.0 - h) * math.asinh(start) + h * math.asinh(end)) if h < 1.0 else end


def _released(
    family: SceneFamily, found: tuple[Discretisation, Correction]
) -> tuple[tuple[Discretisation, Correction] | None, float]:
    """Let go of a number while the pressure of a state moves to the one that is held.

    Its amplitude stays, or where that way is lost its length.
    """
    s = found[0].scalars(found[1].x)
    (held,) = family.holding

    def way(h: float) -> SceneFamily:
        pressure = _pressure_between(s.pressure_ratio, held.value, h)
        return replace(family, holding=(Closure(held.kind, pressure),))

    profile = found[0].profile(found[1].x)
    solved, furthest = led_over(way, profile, Closure("amplitude", float(s.A)))
    if solved is None:
        return led_over(way, profile, Closure("length", float(s.sigma)))
    return solved, furthest


def _plain(family: SceneFamily, A: float) -> SceneProfile | None:
    """Return the plain rod's state at a tip angle, as a profile of the scene that has not begun."""
    branch = primary_branch(family.law, family.closure)
    branch.extend(lambda last: last.scalars.A > A)
    found = branch.candidates(Closure("amplitude", A))
    if not found:
        return None
    plain = found[0].profile
    values = np.concatenate([plain.values, np.zeros((*plain.values.shape[:2], 2))], axis=2)
    scene = family.scene
    ratio = family.closure.value
    numbers = {**scene.entered(0.0), "pressure": plain.scalars.pressure_ratio, "ratio": ratio}
    return SceneProfile(plain.lengths, values, plain.scalars, scene, numbers)


def _led_in(
    way: Callable[[float], SceneFamily], profile: Profile, held: Closure
) -> tuple[tuple[Discretisation, Correction] | None, float]:
    """Follow a state into a scene; where that stalls with one number of it held, with another from there on.

    The states of a scene turn back in any number somewhere, but not in all of them at once.
    """
    h, last = 0.0, profile
    for kind in (held.kind, *(kind for kind in HELD if kind != held.kind)):
        own = held if kind == held.kind else Closure(kind, HELD[kind](last.scalars))
        if steps := list(_leading(way, last, own, h)):
            last, h, found = steps[-1]
            if h == 1.0:
                return found, h
    return None, h


def led_over(
    way: Callable[[float], SceneFamily], profile: Profile, held: Closure
) -> tuple[tuple[Discretisation, Correction] | None, float]:
    """Follow a state along a way from 0 to 1; None, and how far it went, where that stalls."""
    steps = list(_leading(way, profile, held, 0.0))
    if not steps:
        return None, 0.0
    _, h, found = steps[-1]
    return (found if h == 1.0 else None), h


def _on_its_side(
    family: SceneFamily, profile: Profile, held: Closure
) -> tuple[Discretisation, Correction] | None:
    """Correct from a profile, unless that turns it over or lays it down."""
    solved = family.solve(profile, held)
    if solved is None:
        return None
    kept = solved[0].scalars(solved[1].x).A / profile.scalars.A
    return solved if kept > SHRINKS else None


def _leading(
    way: Callable[[float], SceneFamily], profile: Profile, held: Closure, h: float
) -> Iterator[tuple[Profile, float, tuple[Discretisation, Correction]]]:
    """Yield states along a way from h on, until it ends or stalls."""
    step = 0.25
    while h < 1.0:
        share = min(1.0, h + step)
        family = way(share)
        solved = _on_its_side(family, profile, held)
        if solved is None:  # a phase may end on the way, and its length with a square root
            phases = family.phases_of(profile).phases  # which may be more than it was solved in
            merged = family.merged(profile, phases) if len(phases) == len(profile.lengths) else None
            solved = _on_its_side(family, merged, held) if merged is not None else None
        if solved is None:
            step *= 0.5
            if step < SHORTEST:
                return
            continue
        h, profile = share, solved[0].profile(solved[1].x)
        yield profile, h, solved
