"""Fits from several starts, each refined until the public functions agree with its states."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.errors import NotCertified, NotConverged, PeelOptError
from ...continuation.primary import UNFOLDED
from ...equilibria.ask import length_given_pressure, pressure_given_length
from ...equilibria.result import Equilibrium
from ...model.equations import Scalars
from ...model.rod import MATERIAL, Rod, require_ratio
from .blocks import block
from .data import Observation
from .identifiability import combinations
from .problem import NODES, Blocks, Fitted, Placed, Problem
from .programme import FURTHEST
from .sensitivity import chance, follow, linear_model
from .start import coarse_rods, fits, projected

#: Difference of chi-square, by degree of freedom, of two fits that are one.
SAME = 1e-4

#: Chance of a larger chi-square below which other starts are tried: the fit may be another minimum.
SUSPICIOUS = 0.01

#: Largest difference of a fitted and a public answer (p/T0 or sbar/eta) that needs no finer mesh.
AGREED = 1e-8

#: Weight that holds numbers near their start where the data leave them open: one standard
#: deviation is a factor e.
RIDGE = 1.0

#: Decrease of chi-square from which a fit is better than another, and not only rounded.
BETTER = 1e-3

#: What is left to step, in standard deviations, from which a fit does not count as converged.
LEFT = 1e-3

#: The same for a fit that leaves a combination open, where less can be asked.
LEFT_HELD = 0.1

#: Largest difference (p/T0 or sbar/eta) between a fitted state and the public answer.
MOST_APART = 1e-6


@dataclass(frozen=True, eq=False)
class Trial:
    """A fit from one start, its states solved again."""

    reference: Rod
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
    for start in _starts(seen, known, rod):
        try:
            found.append(_trial(start, seen, problem))
        except PeelOptError as error:
            reason = str(error)
            continue
        likely = degrees == 0 or chance(found[-1].fitted.deviance, degrees) > SUSPICIOUS
        if likely and not found[-1].strayed:
            return found[-1]
        if len(found) > 1 and abs(found[-1].fitted.deviance - found[-2].fitted.deviance) < SAME * degrees:
            break  # two starts lead to one fit
    if not found:
        raise NotConverged(
            f"no start leads to a fit of {len(seen)} observations. The last one: {reason}",
            remedy="Check units and states (state='folded' for a rod folded back over itself), give a rod to"
            " start from, or give lengths a standard deviation: near a fold no exact length may exist.",
        )
    return min(found, key=lambda trial: (trial.strayed, trial.fitted.deviance))


def _starts(seen: Sequence[Observation], known: Mapping[str, float], rod: object) -> Iterator[Rod]:
    """Yield the rod given, then those of a search, which is not made if nobody asks."""
    if isinstance(rod, Rod):
        yield rod
    yield from (start for _, start in coarse_rods(seen, known))


def _trial(start: Rod, seen: Sequence[Observation], problem: Problem) -> Trial:
    """Fit from one rod."""
    require_ratio(start.ratio)
    own = [o.scaled(start.eta, start.adhesion_strength) for o in seen]
    places = [Placed(projected(start, o)) for o in seen]
    problem, fitted = _attempt(replace(problem, observations=own, ratio=start.ratio), places)
    if fitted is None:
        raise NotConverged(f"IPOPT does not converge from {start!r}.")
    if problem.ridge:
        # The ridge may have kept the numbers from a minimum that is there all the same.
        try:
            free = replace(problem, ridge=0.0)
            released = free.solve(fitted.q, fitted.blocks.placed())
            if released is not None and released.deviance < fitted.deviance - BETTER:
                return _checked(free, released, start)
        except PeelOptError:
            pass  # then they are held
    return _checked(problem, fitted, start)


def _checked(problem: Problem, fitted: Fitted, start: Rod) -> Trial:
    """Refuse a fit that ran away or stopped early; solve the states of any other again."""
    if np.any(np.abs(fitted.q) > 0.99 * FURTHEST):
        raise NotConverged(f"from {start!r} a number runs away.", remedy="The data do not bound it.")
    model = linear_model(fitted.blocks, problem.free, problem.delta)
    left = model.left(fitted.q[problem.free], problem.ridge)
    if left > (LEFT_HELD if problem.ridge else LEFT):
        raise NotConverged(f"from {start!r} the fit stops {left:.1e} standard deviations before its minimum.")
    return _refined(problem, fitted, start)


def _attempt(problem: Problem, places: Sequence[Placed]) -> tuple[Problem, Fitted | None]:
    """Solve as it stands, held near the start where the data leave a combination open.

    A combination that the data do not see is no place to go to: a solver wanders along it until
    it meets something else.
    """
    q = np.zeros(3)
    held = replace(problem, ridge=RIDGE)
    if not _leaves_open(problem, problem.pose(q, places)):
        fitted = problem.solve(q, places)
        if fitted is not None:
            return problem, fitted
    near = held.solve(q, places) or held.by_homotopy(q, places)
    if near is None:
        return problem, problem.by_homotopy(q, places)
    if _leaves_open(problem, near.blocks):
        return held, near
    fitted = problem.solve(near.q, near.blocks.placed())
    return problem, fitted or problem.by_homotopy(q, places)


def _leaves_open(problem: Problem, blocks: Blocks) -> bool:
    """Whether the data do not determine some combination, to first order at these states."""
    model = linear_model(blocks, problem.free, problem.delta)
    return not all(c.determined for c in combinations(model.jacobian, problem.free))


def _refined(problem: Problem, fitted: Fitted, reference: Rod) -> Trial:
    """Solve on finer meshes until the public functions agree with the fitted states."""
    best: Trial | None = None
    failure: PeelOptError | None = None
    for nodes in NODES:
        if nodes > problem.nodes:
            finer = replace(problem, nodes=nodes)
            again = finer.solve(fitted.q, fitted.blocks.placed())
            if again is None:
                break
            problem, fitted = finer, again
        rod = rod_at(reference, fitted.q)
        require_ratio(rod.ratio)
        try:
            equilibria, consistency = resolved(problem, fitted, rod)
        except PeelOptError as error:
            failure = error
            continue
        best = Trial(reference, problem, fitted, equilibria, consistency)
        if consistency <= AGREED:
            break
    if best is None:
        raise failure or NotConverged("the fit was lost on a finer mesh.", remedy="Give a rod to start from.")
    return best


def rod_at(reference: Rod, q: np.ndarray) -> Rod:
    """Return the rod whose numbers are exp(q) times those of a reference."""
    return Rod(*(getattr(reference, name) * math.exp(v) for name, v in zip(MATERIAL, q, strict=True)))


def resolved(problem: Problem, fitted: Fitted, rod: Rod) -> tuple[list[Equilibrium], float]:
    """Return the public answer for every fitted state, and the largest difference from the fit.

    Raises
    ------
    NotCertified
        If a fitted state is not the one the public function finds.
    PeelOptError
        If that function has no answer.
    """
    equilibria, worst = [], 0.0
    for observation, signature, u, d in zip(
        problem.observations,
        fitted.blocks.signatures,
        fitted.blocks.state.unknowns,
        fitted.blocks.state.data,
        strict=True,
    ):
        part = block(signature)
        s = part.problem.scalars(u[: part.problem.size])
        _, g_u, g_q, *_ = part.evaluate(u, fitted.q, d)
        # The direction along the branch: what is left without exact lengths and pressures.
        _, own = (
            follow(part, u, g_u, g_q) if "exact" not in (signature.length, signature.pressure) else (0, None)
        )
        by_length = signature.length == "exact"
        if own is not None:
            d_sigma = np.abs(own[part.problem.size - 2]).max()
            d_pressure = np.abs(_pressure_change(s, own[part.problem.size - 4 : part.problem.size])).max()
            by_length = d_sigma / s.sigma > d_pressure / max(s.pressure_ratio, 1e-300)
        problem.watch()
        eq, gap = _asked(rod, s.sigma, s.pressure_ratio, observation.state, by_length)
        if gap > MOST_APART:
            raise NotCertified(
                f"{observation.name} is fitted at p/T0 = {s.pressure_ratio:.8g}, sbar/eta = {s.sigma:.8g},"
                f" but the fitted rod is at p/T0 = {eq.pressure_ratio:.8g},"
                f" sbar/eta = {eq.length_ratio:.8g} there.",
                remedy="Near a fold a length or pressure has no state nearby: give it a standard deviation.",
            )
        equilibria.append(eq)
        worst = max(worst, gap)
    return equilibria, worst


def _pressure_change(s: Scalars, own: np.ndarray) -> np.ndarray:
    """Change of P = 1 + m A / sigma^3 along directions of (A, m, sigma, lambda)."""
    return (own[1] * s.A + s.m * own[0]) / s.beta0 - 3.0 * s.alpha1 / s.beta0 * own[2] / s.sigma


def _asked(rod: Rod, sigma: float, P: float, state: str | None, by_length: bool) -> tuple[Equilibrium, float]:
    """Ask for the state in the better conditioned way, then in the other."""
    error: PeelOptError | None = None
    for length_given in (by_length, not by_length):
        try:
            if length_given:
                eq = _holding(rod, rod.length(sigma), rod.pressure(P), state)
                return eq, abs(eq.pressure_ratio - P)
            eq = length_given_pressure(rod, rod.pressure(P), near=rod.length(sigma))
            return eq, abs(eq.length_ratio - sigma)
        except PeelOptError as caught:
            error = error or caught
    assert error is not None
    raise error


def _holding(rod: Rod, length: float, pressure: float, state: str | None) -> Equilibrium:
    """Equilibrium of a length near a pressure; by name if it is there, since ``near`` walks elsewhere too."""
    for name in UNFOLDED if state == "unfolded" else (state,):
        try:
            eq = pressure_given_length(rod, length, state=name)
        except PeelOptError:
            continue
        if abs(eq.pressure - pressure) <= rod.pressure(MOST_APART):
            return eq
    return pressure_given_length(rod, length, near=pressure)
