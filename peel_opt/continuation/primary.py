"""The primary branch: the one that leaves T, walked once and remembered.

No single solve from a guess finds every equilibrium, so each answer is reached along the
branch it lies on.  A `PrimaryBranch` grows only as far as the questions asked of it need,
and knows its folds, hence which part of it a state belongs to:

* *middle* from T to the first fold in length that comes before the minimum pressure,
* *lower* from there to the minimum pressure,
* *folded* from there until the tip touches the plate.
"""

from __future__ import annotations

import threading
import time
from bisect import insort
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import islice, pairwise

import numpy as np

from ..base.errors import NotConverged
from ..base.threads import heard, one_thread
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.equations import Scalars
from ..residual.closures import READINGS, Closure, misses
from ..residual.discretisation import Profile
from ..residual.meshes import PATH
from ..residual.newton import SolvedState
from .charted import charted, covers
from .family import Family, StepControl, transition
from .points import Point
from .special import CONTACT, FOLDS, Located, locate, located, tip

#: Kinds of folds of a rod's branch.
FOLDED = tuple(kind for kind, _ in FOLDS["ratio"])

#: Depth below the plate, as a share of the largest height, that no mesh puts a detached rod to.
BELOW = 1e-3


@dataclass(frozen=True, eq=False)
class Candidate:
    """A place on a branch, between two points, where a question is answered.

    Parameters
    ----------
    family : Family
    here, there : Point
        Neighbours between which the closure ``given`` changes sign.
    share : float
        Where between them, by interpolation.
    given : Closure
    state : str
    """

    family: Family
    here: Point
    there: Point
    share: float
    given: Closure
    state: str

    def estimate(self, read: Callable[[Scalars], float]) -> float:
        """Interpolate a number between the neighbours; free, and good to a few digits."""
        return (1.0 - self.share) * read(self.here.scalars) + self.share * read(self.there.scalars)

    def least_distance(self, read: Callable[[Scalars], float], value: float) -> float:
        """Return how near to a value a number comes that is monotone between the neighbours."""
        low, high = sorted((read(self.here.scalars), read(self.there.scalars)))
        return max(low - value, value - high, 0.0)

    def holds(self, other: Candidate) -> bool:
        """Whether the solution of another walk lies between these neighbours."""
        return self.family.between(self.here, self.there, other.solution.place)

    @cached_property
    def solution(self) -> SolvedState:
        """The solution itself.

        Raises
        ------
        NotConverged
            If it cannot be reached from either neighbour.
        """
        landed = self.family.solve_between(self.here, self.there, self.given)
        if landed is None:
            raise NotConverged(
                f"lost the branch between two neighbouring points while looking for {self.given}.",
                remedy="Move the given number a little, or pick another state.",
            )
        return SolvedState(*landed, (self.family.closure, self.given))

    @property
    def profile(self) -> Profile:
        """The solution itself, sampled."""
        return self.solution.profile


def crossings(
    family: Family, points: Sequence[Point], given: Closure, label: Callable[[float], str]
) -> list[Candidate]:
    """All places where a closure is met along a branch; ``label`` names the state at an arclength."""
    if not points:
        return []
    off = misses(given, np.array([p.tail for p in points])).tolist()
    found = []
    for (here, there), (a, b) in zip(pairwise(points), pairwise(off), strict=True):
        # A zero at the first point is the straight rod at T, which is no answer.
        if a * b < 0.0 or (b == 0.0 and there is not points[-1]):
            state = label(0.5 * (here.arclength + there.arclength))
            share = a / (a - b) if b else 1.0  # of a branch that meets it all along, at its points
            found.append(Candidate(family, here, there, share, given, state))
    return found


@dataclass(eq=False)
class PrimaryBranch:
    """The branch from T at one closure, growing on demand.

    Parameters
    ----------
    family : Family
        The law and the closure that stays fixed: a rod's ratio, or beta0 = 0.
    side : {1, -1}
        1 for the detached side p < T0; -1 for the spurious one beyond T.
    mode : int
        1 for the branch from T, n for the one from beta1 = (n pi)^4.
    control : StepControl
    longest : int
        Points after which the walk ends without an end of the branch.
    least : int
        Points that the branch of a rod is to have where its points need not be walked to.

    Attributes
    ----------
    events : list of Located
        Special points beside the folds and the contact that are known without a search.
    walked_from : int
        Number of points that were found together; the walk begins at the last of them.
    seconds : float
        Time it has been walked for, by all who asked for more of it.
    """

    family: Family
    side: int = 1
    mode: int = 1
    control: StepControl = field(default_factory=StepControl)
    longest: int = 400
    least: int = 0
    points: list[Point] = field(default_factory=list)
    folds: list[Located] = field(default_factory=list)
    events: list[Located] = field(default_factory=list)
    contact: Located | None = None
    ended: str = ""
    walked_from: int = 0
    seconds: float = 0.0
    _walk: Iterator[Point] | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @one_thread
    def extend(self, enough: Callable[[Point], bool]) -> None:
        """Walk on until ``enough`` is true of the last point, or the branch ends."""
        with self._lock:
            began = time.perf_counter()
            try:
                if self._walk is None:
                    self._walk = self._start()
                while not self.ended and not enough(self.points[-1]):
                    self._advance()
                heard.check()  # a step may have failed of one
            except BaseException:
                # What interrupts a walk ends it; nobody may take the part for the whole.
                self._walk, self.ended = None, ""
                self.points.clear()
                self.folds.clear()
                self.events.clear()
                self.contact, self.walked_from = None, 0
                raise
            finally:
                self.seconds += time.perf_counter() - began

    def _start(self) -> Iterator[Point]:
        """Find the first points, on the charts as far as they cover the branch, and the walk that goes on."""
        on_charts = self.side > 0 and self.mode == 1 and covers(self.family)
        found = charted(self.family, self.least) if on_charts else None
        if found is None:
            self.points.append(self._first_point())
            walk = self.family.walk(self.points[0], self.control)
        else:
            self.points += found.points
            self.folds += (s for s in found.specials if s.kind in FOLDED)
            self.events += (s for s in found.specials if s.kind not in FOLDED and s.kind != CONTACT[0])
            self.contact = next((s for s in found.specials if s.kind == CONTACT[0]), None)
            self.ended = "contact" if self.contact else ""
            self.walked_from = len(found.points) - 1
            walk = self.family.walk(found.points[-1], replace(self.control, first=self.control.largest))
        next(walk)
        return walk

    def _first_point(self) -> Point:
        start = first_point(self.family, self.mode)
        if self.side < 0:
            back = np.array([-1.0, 0.0, 0.0, 0.0])
            start = self.family.point(start.problem, start.x, back, 0.0, start.iterations)
        return start

    def _advance(self) -> None:
        here = self.points[-1]
        assert self._walk is not None
        there = next(self._walk, None)
        if there is None or len(self.points) > self.longest:
            self.ended = "stalled" if there is None else "limit"
            return
        if there.scalars.beta1 <= 0.0:
            there = self._short_of_softness(here, there)
        if there is None or (not self.family.tip_free and self.side > 0 and _past_contact(there)):
            self.ended = "stalled"  # a tip that is held down has no contact to end at
            return
        s = there.scalars
        if self.side > 0 and s.A > 1.0 and self.family.tip_free and tip(there) < 0.0:
            self.contact = located(self.family, here, there, *CONTACT)
            there, self.ended = self.contact.point, "contact"
        elif self._strays(here, there):
            self.ended = "stalled"
            return
        self._insert_folds(here, there)
        self.points.append(there)

    def _short_of_softness(self, here: Point, there: Point) -> Point | None:
        """Return a point short of beta1 = 0, where y0 is infinite; None if none is left."""
        reach = there.arclength - here.arclength
        while reach > self.control.smallest:
            reach *= 0.5
            point = self.family.step(here, reach)
            if point is not None and point.scalars.beta1 > 0.0:
                return point
        return None

    def _strays(self, here: Point, there: Point) -> bool:
        """Whether a step has left the detached branch of a rod.

        No state of it has a part below the plate, and under law (8) the tip turns further all the way.
        """
        if not (self._is_rod and self.side > 0 and self.mode == 1 and self.family.law.branch_ends):
            return False
        if self.family.law.falls_straight and there.scalars.A <= here.scalars.A:
            return True
        heights = there.scalars.A * there.profile.values[:, :, 4]
        return bool(heights.min() < -BELOW * np.abs(heights).max())

    def _walk_back(self, given: Closure) -> None:
        """Walk from the first point towards T0, as far as a question asks: without T there is no beginning.

        Raises
        ------
        NotConverged
            If the branch is lost before.
        """
        if not self.points or self.family.law.initial_slope > 0.0:
            return
        if given.kind not in ("pressure", "length") or (given.kind == "pressure" and given.value >= 1.0):
            return
        sought = READINGS[given.kind]
        with self._lock:
            first = self.points[0]
            back = self.family.point(first.problem, first.x, -first.direction, 0.0, first.iterations)
            steps = islice(self.family.walk(back), 1, self.longest)
            while sought(self.points[0].scalars) < given.value:
                before = next(steps, None)
                if before is None:
                    s = self.points[0].scalars
                    raise NotConverged(
                        f"the branch was followed back to p/T0 = {s.pressure_ratio:.12g},"
                        f" sbar/eta = {s.sigma:.6g} only.",
                        remedy="Ask for a state further from p = T0.",
                    )
                start = first.arclength - before.arclength
                turned = before.turned(start)
                self._insert_folds(turned, self.points[0])
                self.points.insert(0, turned)
                self.points.sort(key=lambda p: p.arclength)

    @property
    def _is_rod(self) -> bool:
        return self.family.closure.kind == "ratio"

    def _insert_folds(self, here: Point, there: Point) -> None:
        """Make every fold a point, so that p and sbar are monotone between neighbours."""
        for fold in locate(self.family, (here, there), FOLDS[self.family.closure.kind]):
            self.folds.append(fold)
            if fold.point is not here and fold.point is not there:
                insort(self.points, fold.point, key=lambda p: p.arclength)

    def fold(self, kind: str) -> Located | None:
        """The first fold of a kind met so far."""
        return next((f for f in self.folds if f.kind == kind), None)

    @property
    def _minimum(self) -> Located | None:
        """The minimum pressure as far as it is known: the first fold, where the traction never rises."""
        if self.family.law.softens:
            return self.fold("LP-pressure")
        folds = (f for f in self.folds if f.kind == "LP-pressure")
        return min(folds, key=lambda f: f.point.scalars.pressure_ratio, default=None)

    def continue_to(self, kind: str) -> Located | None:
        """Walk on to the first fold of a kind; None if the branch ends before."""
        self.extend(lambda _: self.fold(kind) is not None)
        return self.fold(kind)

    def state_at(self, arclength: float) -> str:
        """Label of a place on the branch that has been walked."""
        if self.side < 0:
            return "spurious"
        if self.mode > 1:
            return "other"
        if not self._is_rod:
            # A fold in lambda at fixed beta0 and one in length on the rod are the same points.
            bend = self.fold("LP-lambda")
            turned = self.family.closure.value == 0.0 or (bend and arclength > bend.point.arclength)
            return "lower" if turned else "middle"
        minimum, bend = self._minimum, self.fold("LP-length")
        if minimum is not None and arclength > minimum.point.arclength:
            return "folded"
        if bend is not None and arclength > bend.point.arclength:
            return "lower"
        return "middle"

    def candidates(self, given: Closure) -> list[Candidate]:
        """All states that answer a question on the part walked so far, from T on."""
        self._walk_back(given)
        return crossings(self.family, self.points, given, self.state_at)


def first_point(family: Family, mode: int = 1) -> Point:
    """T, or for a law without slope at u = 0 a point near p = T0 reached by homotopy."""
    if family.law.initial_slope > 0.0:
        return transition(family, mode)
    return _by_homotopy(family)


#: p/T0 at which a law without a transition is entered, one after the other: a stiff rod has no low one.
ENTRIES = (0.8, 0.9, 0.95, 0.98, 0.99)

#: Shortest step of a homotopy from law (8) to another.
SHORTEST = 1e-3

#: How close to T0 the branch of such a law is walked back: as far as it can be landed on.
HIGHEST = (1.0 - 1e-7, 1.0 - 1e-6, 1.0 - 1e-5, 0.9999, 0.9995)


def _by_homotopy(family: Family) -> Point:
    """Blend law (8) into the family's law at fixed pressure, then walk back towards T0."""
    start = primary_branch(COHESIVE, family.closure)
    fold = start.continue_to("LP-pressure")
    # A stiff rod has no state so low: half way down to its least pressure, then.
    half_way = 0.5 * (1.0 + fold.point.scalars.pressure_ratio) if fold else 0.0
    furthest = 0.0
    for entry in sorted({max(entry, half_way) for entry in ENTRIES}):
        given = Closure("pressure", entry)
        back, h = _blended(family, start.candidates(given)[0].profile, given)
        furthest = max(furthest, h)
        if back is not None:
            return _towards_strength(family, back)
    raise NotConverged(
        f"the homotopy from law (8) to law {family.law.name!r} stalls at {furthest:.3g}.",
        remedy="Try a law with a slope at u = 0, or another ratio eta/y0.",
    )


def _blended(family: Family, profile: Profile, given: Closure) -> tuple[Point | None, float]:
    """Follow a state of law (8) to the family's law; None, and how far it went, where that stalls."""
    h, step, solved = 0.0, 0.125, None
    while h < 1.0:
        target = min(1.0, h + step)
        law = family.law if target == 1.0 else COHESIVE.blend(family.law, target)
        solved = Family(law, family.transcription, family.closure).solve(profile, given)
        if solved is None:
            step *= 0.5
            if step < SHORTEST:
                return None, h
            continue
        h = target
        profile = solved[0].profile(solved[1].x)
    assert solved is not None
    problem, result = solved
    return family.point(problem, result.x, np.array([-1.0, 0.0, 0.0, 0.0]), 0.0, 0), h


def _towards_strength(family: Family, back: Point) -> Point:
    """Walk back towards p = T0, and turn there."""
    before = there = back
    for there in family.walk(back):
        if there.scalars.pressure_ratio > HIGHEST[-1]:
            break
        before = there
    # While the tip is on a plateau of full strength p = T0 at any height: nothing is monotone there.
    for highest in HIGHEST if there is not before else ():
        landed = family.at(before, there, Closure("pressure", highest))
        if landed is not None:
            there = landed
            break
    return Point(there.problem, there.x, -there.tangent, 0.0, there.iterations)


def primary_branch(law: CohesiveLaw, closure: Closure, side: int = 1) -> PrimaryBranch:
    """Return the remembered primary branch of a law at a closure."""
    return _remembered(law, closure, side)


@lru_cache(maxsize=256)
def _remembered(law: CohesiveLaw, closure: Closure, side: int) -> PrimaryBranch:
    # Calls that leave out the side or name it must meet the same branch.
    return PrimaryBranch(Family(law, PATH, closure), side)


def forget_branches() -> None:
    """Let go of all remembered branches."""
    _remembered.cache_clear()


def _past_contact(point: Point) -> bool:
    """Whether p has come back to T0 with the rod folded, which at contact it does."""
    return point.scalars.A > 1.0 and point.scalars.m > 0.0
