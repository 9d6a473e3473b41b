"""The search for a design: SLSQP in the logarithms of the free numbers, with exact elasticities.

From each of some starts the largest shortfall is made as small as it gets; where it vanishes, the
objective is descended among the designs that meet the targets.  Steps are limited, since the state
that a target is about may end on the way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from ...base.errors import PeelOptError
from ...model.rod import RATIOS
from .problem import DesignProblem
from .roots import along_one, within
from .targets import Achieved, Target

#: Designs looked at over several free numbers, and the best of them from which SLSQP starts.
SAMPLES, STARTS = 24, 3

#: How far a logarithm may move in a first search, the least such reach, and how many searches.
REACH, SHORTEST_REACH, MOST_SEARCHES = 1.0, 1e-4, 30

#: Distance of log(eta/y0) from the ends of the range, so that rounding does not leave it.
MARGIN = 1e-6

#: Distance of a logarithm from its bound at which it counts as binding.
BINDING = 1e-6

#: What of the objective's gradient the binding constraints may leave over at an optimum.
STATIONARY = 1e-4


@dataclass(frozen=True, eq=False)
class Reached:
    """A design, what the public calls say of it, and by how much it misses the targets.

    ``multipliers`` are d(objective)/d(log wanted) of the targets that bind; ``settled`` says
    whether they and the bounds that bind balance the objective.
    """

    z: np.ndarray
    achieved: tuple[Achieved, ...]
    missed: float
    iterations: int
    multipliers: np.ndarray
    settled: bool


@dataclass(frozen=True, eq=False)
class Search(DesignProblem):
    """A design problem with what is already known about designs."""

    _known: dict[tuple[bytes, int], tuple[float, np.ndarray]] = field(default_factory=dict)

    def run(self) -> tuple[list[Reached], Reached | None, list[np.ndarray]]:
        """Return designs, the best first; else what comes closest, if anything; and where it was looked."""
        given = self.material.start
        looked_at = self._samples()
        found: list[Reached] = []
        closest: list[Reached] = []
        if self.square and len(self.targets) == 1:
            roots = along_one(lambda z: None if self._unknown(z) else float(self._gaps(z)[0]), looked_at)
            found = [r for z in roots if (r := self._reached(z)).missed <= self.tol]
        elif self.square and given is not None and not self._unknown(given):
            found = [r for r in [self._from(given)] if r.missed <= self.tol]
        if not found:
            starts = [z for z in looked_at if not self._unknown(z)]
            starts.sort(key=lambda z: (self._missed(z), float(self.objective @ z)))
            for reached in map(self._from, starts[:STARTS]):
                (found if reached.missed <= self.tol else closest).append(reached)
        found.sort(key=lambda r: (not r.settled, self._preference(r)))
        distinct: list[Reached] = []
        for reached in found:
            if all(np.abs(reached.z - other.z).max() > 1e3 * self.tol for other in distinct):
                distinct.append(reached)
        return distinct, min(closest, key=lambda r: r.missed, default=None), looked_at

    # --- what is known at a design ------------------------------------------------------------

    def _at(self, z: np.ndarray, i: int, slopes: bool = False) -> tuple[float, np.ndarray]:
        """Gap of a target, and on demand the gradient of its logarithm."""
        key, target = (z.tobytes(), i), self.targets[i]
        rod = self.material.rod(z)
        gap, gradient = self._known.get(key) or (target.gap(target.value_at(rod, self.law)), np.empty(0))
        if slopes and not gradient.size:
            gradient = target.elasticities(rod, self.law) @ self.material.matrix
        self._known[key] = gap, gradient
        return gap, gradient

    def _unknown(self, z: np.ndarray) -> bool:
        """Whether the rod lacks a state that a target is about."""
        try:
            self._gaps(z)
        except PeelOptError:
            return True
        return False

    def _gaps(self, z: np.ndarray) -> np.ndarray:
        return np.array([self._at(z, i)[0] for i in range(len(self.targets))])

    def _slopes(self, z: np.ndarray) -> np.ndarray:
        return np.array([self._at(z, i, slopes=True)[1] for i in range(len(self.targets))])

    def _missed(self, z: np.ndarray) -> float:
        return float(max(t.missed(gap) for t, gap in zip(self.targets, self._gaps(z), strict=True)))

    def _samples(self) -> list[np.ndarray]:
        """Designs within the bounds whose branch can be walked; the given one first."""
        stuff = self.material
        first = [] if stuff.start is None or not stuff.in_range(stuff.start) else [stuff.start]
        if len(stuff.free) == 1:
            return within(stuff, first)
        from scipy.stats.qmc import Halton

        points = Halton(len(stuff.free), scramble=False).random(64 * SAMPLES)
        grid = (stuff.lower + (stuff.upper - stuff.lower) * p for p in points)
        return first + [z for z in grid if stuff.in_range(z)][:SAMPLES]

    # --- SLSQP ---------------------------------------------------------------------------------

    def _from(self, start: np.ndarray) -> Reached:
        """Meet the targets as well as can be; descend from there if they are met."""
        closest, iterations = self._closest(start)
        if self.square or self._missed(closest) > self.tol:
            return self._reached(closest, iterations)
        best, more = self._best(closest)
        return self._reached(best, iterations + more)

    def _closest(self, start: np.ndarray) -> tuple[np.ndarray, int]:
        """Make the largest shortfall as small as it gets: min t, with every shortfall up to t."""
        m = len(start)
        last = np.eye(m + 1)[m]

        signs = np.array([s for t in self.targets for s in _signs(t)])
        rows = [i for i, t in enumerate(self.targets) for _ in _signs(t)]

        def gradient(u: np.ndarray) -> np.ndarray:
            return np.column_stack([signs[:, None] * self._slopes(u[:m])[rows], np.ones(len(rows))])

        within_t = {"type": "ineq", "fun": lambda u: signs * self._gaps(u[:m])[rows] + u[m], "jac": gradient}
        constraints = [within_t, self._in_range(m + 1)]

        def search(z: np.ndarray, low: np.ndarray, high: np.ndarray) -> OptimizeResult:
            bounds = [*zip(low, high, strict=True), (0.0, None)]
            return _slsqp(last, np.append(z, self._missed(z)), bounds, constraints)

        return self._steps(start, search, self._missed, lambda z: self._missed(z) <= 1e-2 * self.tol)

    def _best(self, start: np.ndarray) -> tuple[np.ndarray, int]:
        """Descend the objective from a design that meets the targets."""
        constraints = [self._in_range(len(start))]
        for kind, equal in (("eq", True), ("ineq", False)):
            rows = [i for i, t in enumerate(self.targets) if (t.sense == "equal") is equal]
            signs = np.array([_signs(self.targets[i])[0] for i in rows])
            if rows:
                constraints.append(
                    {
                        "type": kind,
                        "fun": lambda z, signs=signs, rows=rows: signs * self._gaps(z)[rows],
                        "jac": lambda z, signs=signs, rows=rows: signs[:, None] * self._slopes(z)[rows],
                    }
                )

        def search(z: np.ndarray, low: np.ndarray, high: np.ndarray) -> OptimizeResult:
            return _slsqp(self.objective, z, [*zip(low, high, strict=True)], constraints)

        def merit(z: np.ndarray) -> float:
            return float(self.objective @ z) if self._missed(z) <= self.tol else math.inf

        return self._steps(start, search, merit, lambda z: self._balance(z)[1])

    def _steps(
        self,
        start: np.ndarray,
        search: Callable[[np.ndarray, np.ndarray, np.ndarray], OptimizeResult],
        merit: Callable[[np.ndarray], float],
        done: Callable[[np.ndarray], bool],
    ) -> tuple[np.ndarray, int]:
        """Search within reach, from what the last search found, as long as the reach is what ends it.

        Where a search meets rods without the state asked for, or finds nothing better, the reach is
        taken back.
        """
        here, reach, iterations = start, REACH, 0
        for _ in range(MOST_SEARCHES):
            if reach < SHORTEST_REACH or done(here):
                break
            low = np.maximum(self.material.lower, here - reach)
            high = np.minimum(self.material.upper, here + reach)
            try:
                found = search(here, low, high)
                there = np.clip(found.x[: len(here)], low, high)
                better = merit(there) < merit(here)
            except PeelOptError:
                reach *= 0.25
                continue
            iterations += int(found.nit)
            at_reach = bool(np.any(np.abs(there - here) > 0.999 * reach))
            if better:
                here = there
            elif found.success:
                break
            reach *= 2.0 if better and at_reach else 0.25 if not better else 1.0
        return here, iterations

    def _in_range(self, size: int) -> dict[str, Any]:
        """Keep eta/y0 where the branch can be walked."""
        constant, slopes = self.material.log_ratio
        low, high = math.log(RATIOS[0]) + MARGIN, math.log(RATIOS[1]) - MARGIN
        row = np.zeros(size)
        row[: len(slopes)] = slopes

        def room(u: np.ndarray) -> np.ndarray:
            ratio = constant + row @ u
            return np.array([ratio - low, high - ratio])

        return {"type": "ineq", "fun": room, "jac": lambda _: np.array([row, -row])}

    # --- what came out -------------------------------------------------------------------------

    def _reached(self, z: np.ndarray, iterations: int = 0) -> Reached:
        """Confirm what was found by the public calls."""
        rod = self.material.rod(z)
        achieved = tuple(t.achieved(rod, self.law) for t in self.targets)
        missed = max(t.shortfall(a.value) for t, a in zip(self.targets, achieved, strict=True))
        multipliers, settled = self._balance(z)
        return Reached(z, achieved, missed, iterations, multipliers, settled)

    def _balance(self, z: np.ndarray) -> tuple[np.ndarray, bool]:
        """Multipliers of the targets by least squares, and whether they make an optimum.

        grad(objective) = sum of multiplier times gradient over the targets and bounds that bind, where
        those of inequalities push inwards.
        """
        stuff, multipliers = self.material, np.zeros(len(self.targets))
        try:
            gaps, slopes = self._gaps(z), self._slopes(z)
        except PeelOptError:
            return multipliers, False
        binding = [i for i, t in enumerate(self.targets) if t.sense == "equal" or abs(gaps[i]) < BINDING]
        senses = [{"equal": 0.0, "at_least": 1.0, "at_most": -1.0}[self.targets[i].sense] for i in binding]
        constant, ratio = stuff.log_ratio
        at = constant + float(ratio @ z)
        low, high = (math.log(r) for r in RATIOS)
        rows = [*slopes[binding]]
        for row, below, above in [
            *zip(np.eye(len(z)), z - stuff.lower, stuff.upper - z, strict=True),
            (ratio, at - low - MARGIN, high - MARGIN - at),
        ]:
            if min(below, above) < BINDING:
                rows.append(row)
                senses.append(1.0 if below < above else -1.0)
        if not rows:
            return multipliers, False
        columns = np.array(rows).T
        found = np.linalg.lstsq(columns, self.objective)[0]
        multipliers[binding] = found[: len(binding)]
        rest = float(np.abs(columns @ found - self.objective).max())
        return multipliers, rest < STATIONARY and bool(np.all(np.array(senses) * found > -STATIONARY))

    def _preference(self, reached: Reached) -> float:
        """The objective; in a square problem the distance from the given rod."""
        if not self.square or self.material.start is None:
            return float(self.objective @ reached.z)
        return float(np.abs(reached.z - self.material.start).max())


def _slsqp(
    weights: np.ndarray, start: np.ndarray, bounds: Any, constraints: list[dict[str, Any]]
) -> OptimizeResult:
    return minimize(
        lambda u: float(weights @ u),
        start,
        jac=lambda _: weights,
        bounds=bounds,
        constraints=constraints,
        method="SLSQP",
        options={"ftol": 1e-13, "maxiter": 60},
    )


def _signs(target: Target) -> tuple[float, ...]:
    """Signs of the gap that may not fall below zero."""
    return {"equal": (1.0, -1.0), "at_least": (1.0,), "at_most": (-1.0,)}[target.sense]
