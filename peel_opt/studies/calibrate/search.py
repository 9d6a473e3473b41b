"""Fits from several starts, each refined until the public functions agree with its states."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import NotConverged, PeelOptError
from ...equilibria.result import Equilibrium
from ...model.labels import fits
from ...model.rod import RATIOS, Rod, require_ratio
from ...residual.meshes import FITTED
from .chart import Chart, ChartStates
from .confirmed import resolved
from .covariance import chance, singular
from .curve import BranchSpline
from .data import Observation
from .pairs import scales
from .problem import Fitted, Problem
from .start import begun, coarse_rods
from .words import combinations

#: Difference of chi-square, by degree of freedom, of two fits that are one.
SAME = 1e-4

#: Chance of a larger chi-square below which other starts are tried: the fit may be another minimum.
SUSPICIOUS = 0.01

#: Largest difference of a fitted and a public answer (p/T0 or sbar/eta) that needs no finer mesh.
AGREED = 1e-8

#: Decrease of chi-square from which a fit is better than another, and not only rounded.
BETTER = 1e-3

#: What is left to step, in standard deviations, from which a fit does not count as converged.
LEFT = 1e-3

#: Share by which a pair must come nearer on another part of its curve to be moved there.
NEARER = 0.1

#: How often pairs are moved.
MOST_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Trial:
    """A fit from one start, its states solved again."""

    problem: Problem
    fitted: Fitted
    equilibria: list[Equilibrium]
    consistency: float

    @property
    def strayed(self) -> int:
        """How many states are not those that were observed."""
        pairs = zip(self.problem.observations, self.equilibria, strict=True)
        return sum(not fits(eq.state, observation.state) for observation, eq in pairs)


def best(seen: Sequence[Observation], known: Mapping[str, float], rod: object, problem: Problem) -> Trial:
    """Fit from the rod given, and from those of a search where that fails or fits badly."""
    degrees = sum(o.degrees for o in seen) - int(problem.free.sum())
    found: list[Trial] = []
    reason = "there is none to try."
    for start in _starts(seen, known, rod, problem):
        try:
            found.append(_trial(start, problem))
        except PeelOptError as error:
            reason = str(error)
            continue
        likely = degrees == 0 or chance(found[-1].fitted.deviance, degrees) > SUSPICIOUS
        if likely and not found[-1].strayed and not found[-1].fitted.held:
            return found[-1]
        if len(found) > 1 and abs(found[-1].fitted.deviance - found[-2].fitted.deviance) < SAME * degrees:
            break  # two starts lead to one fit
    if not found:
        raise NotConverged(
            f"no start leads to a fit of {len(seen)} observations. The last one: {reason}",
            remedy="Check units and states (state='folded' for a rod folded back over itself), give a rod to"
            " start from, or give lengths a standard deviation: near a fold no exact length may exist.",
        )
    return min(found, key=lambda trial: (trial.fitted.held, trial.strayed, trial.fitted.deviance))


def _starts(
    seen: Sequence[Observation], known: Mapping[str, float], rod: object, problem: Problem
) -> Iterator[Rod]:
    """Yield the rod given, then those of a search, which is not made if nobody asks."""
    if isinstance(rod, Rod):
        yield rod
    yield from (start for _, start in coarse_rods(seen, known, problem.chart.law))


def _trial(rod: Rod, problem: Problem) -> Trial:
    """Fit from one rod: free, or with what the data leave open held where it runs away."""
    require_ratio(rod.ratio)
    start, nodes = begun(rod, problem)
    try:
        return _refined(problem, _solved(problem, start, nodes))
    except PeelOptError:
        directions = _determined(problem, start, nodes)
        if directions.shape[1] in (0, start.directions.shape[1]):
            raise
        return _refined(problem, _solved(problem, replace(start, directions=directions), nodes))


def _determined(problem: Problem, start: Fitted, nodes: ChartStates) -> np.ndarray:
    """Directions of the free logarithms that the data determine at a start, to first order."""
    near = problem.minimised(nearer(problem, replace(start, directions=start.directions[:, :0]), nodes))
    if near is None:
        return start.directions
    jacobian = problem.linear_model(near).jacobian
    known = [c.determined for c in combinations(jacobian, problem.free)]
    return singular(jacobian)[1][known].T


def _solved(problem: Problem, start: Fitted, nodes: ChartStates) -> Fitted:
    """Minimise, with every pair on the part of its curve nearest to it."""
    fitted, again = start, nearer(problem, start, nodes)
    for _ in range(MOST_ROUNDS):
        found = problem.minimised(again)
        if found is None:
            break
        fitted, again = found, nearer(problem, found, nodes)
        if again is fitted:
            _require_minimum(problem, fitted)
            return fitted
    raise NotConverged("the states of the observations do not settle.", remedy="Give a rod to start from.")


def nearer(problem: Problem, fitted: Fitted, nodes: ChartStates) -> Fitted:
    """Return a fit with its pairs moved to where their curve is nearer; the same one if none is."""
    rows, (scale, log_r) = problem.rows[0], scales(fitted.q)
    if not len(rows):
        return fitted
    curve = BranchSpline.through(problem.chart.at(nodes, log_r, nodes.A, halvings=1))
    if len(curve.nodes) < 2:  # nothing of the curve of the start leads to this rod
        return fitted
    # States that were not solved yet are nearer anywhere.
    own = problem.pairs.residuals(fitted.states.take(rows).numbers, scale)
    known = np.nan_to_num((own**2).sum(axis=1), nan=np.inf)
    A, cost = curve.nearest(problem.pairs, scale)
    moved = np.flatnonzero(cost < (1.0 - NEARER) * known - NEARER)
    if not len(moved):
        return fitted
    there = problem.chart.at(curve.beside(A[moved]), log_r, A[moved])
    return replace(fitted, states=fitted.states.put(rows[moved], there))


def _require_minimum(problem: Problem, fitted: Fitted) -> None:
    """Refuse a fit that ran away or stopped early."""
    ratio = fitted.rod.ratio
    if not RATIOS[0] * (1.0 + 1e-6) < ratio < RATIOS[1] * (1.0 - 1e-6):
        require_ratio(ratio)
        raise NotConverged(
            f"eta/y0 runs to {ratio:.4g}, the end of its range.", remedy="The data do not bound it."
        )
    left = problem.linear_model(fitted).left(fitted.directions)
    if not left <= LEFT:
        raise NotConverged(f"the fit stops {left:.1e} standard deviations before its minimum.")


def _refined(problem: Problem, fitted: Fitted) -> Trial:
    """Solve on finer meshes until the public functions agree with the fitted states."""
    best: Trial | None = None
    failure: PeelOptError | None = None
    for count in (mesh.nodes for mesh in FITTED):
        if count > problem.chart.nodes:
            problem = replace(problem, chart=Chart(problem.chart.law, count))
            again = problem.minimised(fitted)
            if again is None:
                break
            fitted = again
        try:
            equilibria, consistency = resolved(problem, fitted)
        except PeelOptError as error:
            failure = error
            continue
        best = Trial(problem, fitted, equilibria, consistency)
        if consistency <= AGREED:
            break
    if best is None:
        raise failure or NotConverged("the fit was lost on a finer mesh.", remedy="Give a rod to start from.")
    return best
