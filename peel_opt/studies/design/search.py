"""The search for a design: a scan that says where to start, and IPOPT from there.

Every way to meet the targets is tried: a critical flaw is long enough also where every flaw heals.
Each step of the search ends at states that are solved for anew by the public calls.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ...base.checks import positive
from ...base.errors import Infeasible, InvalidInput, PeelOptError
from ...model.rod import Rod
from . import programme as design_programme
from .material import Free, Material, material
from .programme import LAST_PRICE, PRICE, PRICE_FACTOR, Outcome
from .scan import Candidate, brackets, candidate, samples
from .targets import Achieved, Requirement, Target

#: Best of the designs scanned from which the programme is started.
STARTS = 2

#: What the best of them may miss, as a logarithm, for another way to meet the targets to be tried.
FAR_OFF = 1.0

#: How far a logarithm may move in a first step, the least such reach, and how many steps.
REACH, SHORTEST_REACH, MOST_STEPS = 0.5, 1e-3, 40

#: What the programme and the public calls can agree to, and what is still to meet a target.
LEAST_TOL, LARGEST_TOL = 1e-9, 1e-2

#: Rise of the merit that is put down to rounding, for each unit of the price.
SETTLED = 1e-10

#: By which a higher price has to reduce what is missed for a still higher one to be tried.
WORTH_ITS_PRICE = 0.5


@dataclass(frozen=True, eq=False)
class Verified:
    """A design that the public calls confirm."""

    z: np.ndarray
    achieved: tuple[Achieved, ...]
    requirements: tuple[Requirement, ...]
    multipliers: np.ndarray
    iterations: int
    settled: bool = True


@dataclass(frozen=True, eq=False)
class Reached:
    """What comes closest to the targets, and by how much it misses them."""

    z: np.ndarray
    achieved: tuple[Achieved, ...]
    missed: float


@dataclass(frozen=True, eq=False)
class Found:
    """Designs, the best first; if there are none, what comes closest, if anything.

    ``samples`` are the designs that were looked at.
    """

    designs: tuple[Verified, ...]
    closest: Reached | None
    samples: tuple[np.ndarray, ...]


@dataclass(frozen=True, eq=False)
class Search:
    """A design problem in terms of the logarithms of the free numbers."""

    material: Material
    targets: tuple[Target, ...]
    objective: np.ndarray
    of: str
    square: bool
    tol: float

    @classmethod
    def posed(
        cls,
        known: Rod | Mapping[str, object],
        free: Free,
        targets: Target | Sequence[Target],
        minimise: str | None,
        maximise: str | None,
        tol: float,
    ) -> Search:
        """Check that the question determines an answer."""
        stuff = material(known, free)
        several = isinstance(targets, Sequence) and not isinstance(targets, str)
        wanted = (targets,) if isinstance(targets, Target) else tuple(targets) if several else ()
        if not wanted or not all(isinstance(t, Target) for t in wanted):
            raise InvalidInput(
                "a design needs at least one Target.", remedy='Target("maxwell_length", equal="2 mm").'
            )
        if minimise is not None and maximise is not None:
            raise InvalidInput("give minimise or maximise, not both.")
        of = minimise or maximise
        if of is not None and of not in stuff.free:
            raise InvalidInput(f"{of!r} is not free.", remedy=f"Free are {', '.join(stuff.free)}.")
        if len({(t.quantity, t.given, t.sense) for t in wanted}) < len(wanted):
            raise InvalidInput(
                "two targets set the same number in the same sense.", remedy="Leave the weaker one out."
            )
        if not LEAST_TOL <= positive("tol", tol) <= LARGEST_TOL:
            raise InvalidInput(f"tol must lie between {LEAST_TOL:g} and {LARGEST_TOL:g}, got {tol:g}.")
        equal = sum(t.sense == "equal" for t in wanted)
        if equal > len(stuff.free):
            raise InvalidInput(f"{equal} targets to be met exactly need as many free numbers.")
        square = equal == len(stuff.free) == len(wanted)
        if of is None and not square:
            raise InvalidInput(
                f"{len(stuff.free)} free numbers and {equal} targets to be met exactly leave a choice.",
                remedy="Say which free number to minimise= or maximise=.",
            )
        of = of or stuff.free[0]
        objective = np.array([float(name == of) for name in stuff.free]) * (-1.0 if maximise else 1.0)
        return cls(stuff, wanted, objective, of, square, float(tol))

    def run(self) -> Found:
        """Search every way to meet the targets, the most promising first."""
        found: list[Verified] = []
        looked_at = samples(self.material)
        every = product(*(t.alternatives() for t in self.targets))
        possible = [way for way in every if not _contradictory(way)]
        if not possible:
            raise Infeasible(
                f"the targets exclude each other: {'; '.join(map(repr, self.targets))}.",
                remedy="Relax or drop one of them.",
            )
        ways = [self._ranked(looked_at, way) for way in possible]
        ways = sorted((way for way in ways if way), key=lambda way: way[0].missed)
        for ranked in ways:
            if found and ranked[0].missed > FAR_OFF:
                break
            pairs = brackets(self.material, looked_at, ranked) if self._is_one_equation else []
            tries = (self._between(*pair) for pair in pairs)
            for verified in tries if pairs else map(self._solved, ranked[: 1 if found else STARTS]):
                if verified is not None and self._is_new(verified, found):
                    found.append(verified)
        closest = None if found else self._closest([ranked[0] for ranked in ways])
        if isinstance(closest, Verified):
            found, closest = [closest], None
        # What meets the targets but has not come to an optimum is the last resort.
        found.sort(key=lambda v: (not v.settled, self._preference(v)))
        return Found(tuple(found), closest, tuple(looked_at))

    def _ranked(self, found: Sequence[np.ndarray], way: tuple[Requirement, ...]) -> list[Candidate]:
        """Samples on which all requirements have a value, the most promising first."""
        candidates = [c for z in found if (c := candidate(self.material, z, way)) is not None]
        return sorted(candidates, key=lambda c: (c.missed, float(self.objective @ c.z)))

    # --- the programme --------------------------------------------------------------------

    @property
    def _is_one_equation(self) -> bool:
        """Whether one number is to meet one target exactly."""
        return self.square and len(self.targets) == 1

    def _between(self, left: Candidate, right: Candidate) -> Verified | None:
        """Solve from either end of a bracket: the start that leads out of it is of another design."""
        verified = None
        for start in sorted((left, right), key=lambda c: c.missed):
            verified = self._solved(start) or verified
            if verified is not None and left.z[0] <= verified.z[0] <= right.z[0]:
                return verified
        return verified

    def _solved(self, start: Candidate, *, possible: bool = False) -> Verified | None:
        """Solve and confirm: a square problem in one go if that succeeds, else in steps.

        A price below a multiplier buys the objective with targets that could be met.  So it is
        raised while they are missed: as far as it goes where they are known to be ``possible``,
        else while that brings the targets closer.
        """
        if self.square:
            outcome = self._programme(start, elastic=False)
            if outcome.solved and (verified := self._verified(outcome, start.requirements)) is not None:
                return verified
        here, price, most = start, PRICE, math.inf
        while True:
            here, last, settled = self._walk(here, self.objective, price)
            if last is None:
                return None
            if (verified := self._verified(last, here.requirements)) is not None:
                return replace(verified, settled=settled)
            if not last.pays or price >= LAST_PRICE or not (possible or here.missed < most):
                return None
            price, most = PRICE_FACTOR * price, WORTH_ITS_PRICE * here.missed

    def _walk(
        self, start: Candidate, objective: np.ndarray, price: float = PRICE
    ) -> tuple[Candidate, Outcome | None, bool]:
        """Descend in steps of limited reach; every one ends at states that are solved for anew.

        So the phases may change from step to step, and a step that has slipped to another state
        is seen by what its own states miss, and taken back.  Also says whether the last step
        ended at an optimum within its reach.
        """
        here, reach, most, iterations = start, REACH, math.inf, 0
        last: Outcome | None = None

        def merit(reached: Candidate) -> float:
            return float(objective @ reached.z) + price * reached.missed

        for _ in range(MOST_STEPS):
            outcome = self._programme(here, elastic=True, objective=objective, reach=reach, price=price)
            iterations += outcome.iterations
            there = candidate(self.material, outcome.z, here.requirements) if outcome.solved else None
            if there is None or merit(there) > merit(here) + SETTLED * price:
                reach, most = 0.25 * reach, 0.5 * reach
                if reach < SHORTEST_REACH:
                    break
                continue
            ended = float(np.abs(there.z - here.z).max()) < 0.999 * reach and there.alike(here)
            here, last, most = there, replace(outcome, iterations=iterations), 1.5 * most
            if ended:
                return here, last, True
            reach = min(2.0 * reach, most)
        return here, last, False

    def _programme(
        self,
        here: Candidate,
        *,
        elastic: bool,
        objective: np.ndarray | None = None,
        reach: float = math.inf,
        price: float = PRICE,
    ) -> Outcome:
        weights = self.objective if objective is None else objective
        return design_programme.solve(
            self.material, here.blocks, here.z, weights, elastic=elastic, reach=reach, price=price
        )

    def _verified(self, outcome: Outcome, requirements: tuple[Requirement, ...]) -> Verified | None:
        """Return a design if the public calls confirm it."""
        achieved = self.achieved(outcome.z)
        if achieved is None or self._missed(achieved) > self.tol:
            return None
        return Verified(outcome.z, achieved, requirements, outcome.multipliers, outcome.iterations)

    def achieved(self, z: np.ndarray) -> tuple[Achieved, ...] | None:
        """Ask the public calls; None where the rod has no such state."""
        rod = self.material.rod(z)
        try:
            return tuple(t.achieved(rod, self.tol) for t in self.targets)
        except PeelOptError:
            return None

    def _missed(self, achieved: Sequence[Achieved]) -> float:
        return max(t.shortfall(a.value) for t, a in zip(self.targets, achieved, strict=True))

    def _is_new(self, verified: Verified, found: Sequence[Verified]) -> bool:
        return all(np.abs(verified.z - other.z).max() > 1e3 * self.tol for other in found)

    def _preference(self, verified: Verified) -> float:
        """The objective; in a square problem the distance from the given rod."""
        if not self.square or self.material.start is None:
            return float(self.objective @ verified.z)
        return float(np.abs(verified.z - self.material.start).max())

    def _closest(self, starts: Sequence[Candidate]) -> Reached | Verified | None:
        """Relax the targets; take the design up from there, or return what comes closest."""
        reached: list[Reached] = []
        for start in starts:
            relaxed, _, _ = self._walk(start, np.zeros_like(self.objective))
            for place in (relaxed.z, start.z):
                achieved = self.achieved(place)
                if achieved is not None:
                    reached.append(Reached(place, achieved, self._missed(achieved)))
            met = reached and min(r.missed for r in reached) <= self.tol
            if met and (verified := self._solved(relaxed, possible=True)) is not None:
                return verified
        return min(reached, key=lambda r: r.missed, default=None)


def _contradictory(way: Sequence[Requirement]) -> bool:
    """Whether two requirements on the same quantity exclude each other."""
    for a, b in product(way, way):
        same = a.quantity == b.quantity and a.given == b.given
        if same and a.sense != "at_most" and b.sense != "at_least" and a.value > b.value:
            return True
    return False
