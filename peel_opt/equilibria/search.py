"""The search for every state of a rod at one pressure or length, on its primary branch and off it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np

from ..base.errors import NotConverged
from ..continuation.edge_scan import scan
from ..continuation.edge_shooting import EdgeShooting
from ..continuation.family import Family
from ..continuation.goal import ENDLESS
from ..continuation.points import Point
from ..continuation.primary import Candidate, PrimaryBranch, crossings, primary_branch
from ..continuation.tip_scan import STEEPEST, TipShooting, starts_at_length
from ..model.bond import CohesiveLaw
from ..model.law_arrays import tip_heights
from ..residual.closures import Closure
from ..residual.discretisation import Profile, Transcription
from ..residual.meshes import SCANNED, SEARCHED
from ..residual.newton import SolvedState
from .states import Searched

#: Range of p/T0 that is searched, for questions at a given length.
PRESSURES = (-2.0, 5.0)

#: The least p/T0 searched under law (8), whose tip then is 250 y0 high.
LOWEST = 0.002

#: Lengths are searched at a given pressure up to so many times the longest of the primary branch there, below
#: T0, and up to so many times the longest anywhere on it.
THERE, ANYWHERE = 2.5, 1.2

#: Above this gamma = beta1^(1/4) shapes part so fast that a grid misses some, and the states
#: found are followed through other rods at the same length for more.
EASY_GAMMA = 6.0

#: Points walked in each direction for that, and states after which it ends.
DETOUR, MOST_STATES = 30, 40

#: Relative distance in length, and distance in tip angle, of a state from the start that led to it.
KEPT = 0.02


@dataclass(frozen=True, eq=False)
class FoundState:
    """A solution and the name of its family."""

    solution: SolvedState
    state: str

    @property
    def profile(self) -> Profile:
        """The solution, sampled."""
        return self.solution.profile


@dataclass(frozen=True)
class StateSearch:
    """What is searched: a law, a rod and the number that is given.

    Parameters
    ----------
    law : CohesiveLaw
    ratio : float
        eta/y0.
    given : Closure
        Of the kind "pressure" or "length".
    """

    law: CohesiveLaw
    ratio: float
    given: Closure

    @property
    def rod(self) -> Closure:
        """What is fixed along the rod's branch."""
        return Closure("ratio", self.ratio)

    @property
    def gamma(self) -> float:
        """beta1^(1/4) at a given length: how fast shapes part."""
        return math.exp(0.25 * math.log(self.ratio)) * self.given.value

    def run(self) -> tuple[list[FoundState], Searched | None]:
        """States of the primary branch first, then those off it; and where these were looked for."""
        found, branches = self._on_primary_branch()
        if self.given.kind == "pressure":
            others, searched = self._from_edge(self._longest(branches[0], found))
            return found + others, searched
        if self.law.falls_straight:  # the search from the tip knows these two
            found += self._from_tip()
        if self.gamma > EASY_GAMMA:
            found = self._with_detours(found)
        return found, self._searched_from_tip()

    def _on_primary_branch(self) -> tuple[list[FoundState], list[PrimaryBranch]]:
        found, branches = [], [primary_branch(self.law, self.rod, side) for side in (1, -1)]
        for branch in branches:
            branch.extend(partial(self._past, branch))
            for candidate in branch.candidates(self.given):
                try:
                    found.append(FoundState(candidate.solution, candidate.state))
                except NotConverged:
                    continue  # near the end of the branch; the search off it has another chance
        return found, branches

    def _past(self, branch: PrimaryBranch, last: Point) -> bool:
        """Whether an endless side of the branch has been walked far enough."""
        return self._beyond(branch, last) or len(branch.points) > ENDLESS

    def _beyond(self, branch: PrimaryBranch, point: Point) -> bool:
        s, side, given = point.scalars, branch.side, self.given.value
        endless = side < 0 or not branch.family.law.branch_ends
        if not endless or point is branch.points[0]:
            return False
        if self.given.kind == "length":
            return s.sigma > given and not PRESSURES[0] < s.pressure_ratio < PRESSURES[1]
        return s.pressure_ratio > given if side < 0 else s.pressure_ratio < given

    def _longest(self, branch: PrimaryBranch, found: Sequence[FoundState]) -> float:
        """sbar/eta up to which states are looked for at a given pressure.

        What other questions have walked since of a branch without an end does not count.
        """
        lengths = []
        for point in branch.points[:ENDLESS]:
            lengths.append(point.scalars.sigma)
            if self._beyond(branch, point):
                break
        there = [s.sigma for s in (state.profile.scalars for state in found) if s.alpha1 < 0.0]
        return min(ANYWHERE * max(lengths), THERE * max(there, default=math.inf))

    def _from_edge(self, longest: float) -> tuple[list[FoundState], Searched]:
        """States at a given pressure, by a scan of the reaction at the edge for each height of the tip."""
        P, found, reached, greatest = self.given.value, [], longest, 0.0
        for tip in (*tip_heights(self.law, P), 0.0):
            shooting = EdgeShooting(self.law, self.ratio, P, tip, longest)
            scanned = scan(shooting)
            reached = min(reached, scanned.reached)
            for start in scanned.starts:
                state = self._solved(start, SCANNED)
                if state is None or not _near(start, state.profile):
                    reached = min(reached, start.scalars.sigma)
                if state is not None:
                    found.append(FoundState(state, _label(state) if tip else "other"))
            greatest = shooting.greatest
        reactions = (-greatest, greatest)
        return found, Searched((P, P), (0.0, reached), edge_reactions=reactions)

    def _from_tip(self) -> list[FoundState]:
        """States at a given length, by a grid over the tip angle and the pressure."""
        pressures, found = self._pressures(), []
        for touching in (False, True):
            shooting = TipShooting(self.law, self.ratio, touching)
            starts = starts_at_length(shooting, self.given.value, pressures)
            solved = (self._solved(start, (SEARCHED,)) for start in starts)
            found += [FoundState(s, "other" if touching else _label(s)) for s in solved if s is not None]
        return found

    def _pressures(self) -> tuple[float, float]:
        return LOWEST if self.law.branch_ends else PRESSURES[0], PRESSURES[1]

    def _searched_from_tip(self) -> Searched | None:
        if not self.law.falls_straight:
            return None
        angles, sigma = (-STEEPEST, STEEPEST), self.given.value
        return Searched(self._pressures(), (sigma, sigma), tip_angles=angles)

    def _solved(self, start: Profile, meshes: Sequence[Transcription]) -> SolvedState | None:
        """Correct a start on the first of some meshes that leads to the state it shows, or any state."""
        found = None
        for mesh in meshes:
            solved = Family(self.law, mesh, self.rod, tip_free=False).solve(start, self.given)
            if solved is not None:
                found = SolvedState(*solved, (self.rod, self.given))
                if _near(start, found.profile):
                    break
        return found

    def _with_detours(self, found: list[FoundState]) -> list[FoundState]:
        """Follow each state through other rods at the same length, for states the grid missed."""
        isolength = Family(self.law, SEARCHED, self.given, tip_free=False)
        queue, every = list(found), list(found)
        while queue and len(every) < MOST_STATES:
            state = queue.pop(0)
            for candidate in _met_again(isolength, state.profile, self.rod):
                try:
                    met = candidate.solution
                except NotConverged:
                    continue
                if not any(close(met.profile, other.profile) for other in every):
                    new = FoundState(met, _label(met))
                    every.append(new)
                    queue.append(new)
        return every


def close(a: Profile, b: Profile) -> bool:
    """Whether two profiles show one state."""
    gap = abs(a.scalars.alpha - b.scalars.alpha) + abs(a.scalars.A - b.scalars.A)
    return gap < 1e-5 * (1.0 + abs(a.scalars.alpha))


def _near(start: Profile, solved: Profile) -> bool:
    """Whether a start has led to the state that it shows."""
    a, b = start.scalars, solved.scalars
    return abs(a.sigma - b.sigma) < KEPT * a.sigma and abs(a.A - b.A) < KEPT * (1.0 + abs(a.A))


def _label(state: SolvedState) -> str:
    return "spurious" if state.profile.scalars.alpha1 > 0.0 else "other"


def _met_again(family: Family, profile: Profile, rod: Closure) -> list[Candidate]:
    """Places where a walk at fixed length comes back to the rod."""
    solved = family.solve(profile, rod)
    if solved is None:
        return []
    met: list[Candidate] = []
    for sign in (1.0, -1.0):
        forward = sign * np.array([1.0, 0.3, 0.2, 0.1])
        start = family.point(solved[0], solved[1].x, forward, 0.0, solved[1].iterations)
        points = list(islice(family.walk(start), DETOUR))
        met += crossings(family, points[1:], rod, lambda _: "other")
    return met
