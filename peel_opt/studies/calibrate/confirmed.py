"""Fitted states, asked for again by the public functions."""

from __future__ import annotations

import numpy as np

from ...base.errors import AmbiguousState, NotCertified, PeelOptError
from ...continuation.primary import primary_branch
from ...equilibria.ask import length_given_pressure, pressure_given_length
from ...equilibria.result import Equilibrium
from ...model.bond import CohesiveLaw, as_asked
from ...model.labels import UNFOLDED
from ...model.rod import Rod
from ...residual.closures import Closure
from .problem import Fitted, Problem

#: Largest difference (p/T0 or sbar/eta) between a fitted state and the public answer.
MOST_APART = 1e-6

#: Distance below p = T0 at which the state beside T is asked for: at T itself the rod is straight.
BESIDE_T = 1e-12


def resolved(problem: Problem, fitted: Fitted) -> tuple[list[Equilibrium], float]:
    """Return the public answer for every fitted state, and the largest difference from the fit.

    Raises
    ------
    NotCertified
        If a fitted state is not the one the public function finds.
    PeelOptError
        If that function has no answer.
    """
    rod, states, law = fitted.rod, fitted.states, problem.chart.law
    labels = _labels(law, rod, states.A)
    equilibria, worst = [], 0.0
    for i, observation in enumerate(problem.observations):
        sigma, P = states.numbers[i].tolist()
        problem.watch()
        by_length = observation.is_known_by_length(sigma, P, states.by_A[i])
        eq, gap = _asked(rod, sigma, P, labels[i], by_length, law)
        if gap > MOST_APART:
            raise NotCertified(
                f"{observation.name} is fitted at p/T0 = {P:.8g}, sbar/eta = {sigma:.8g},"
                f" but the fitted rod is at p/T0 = {eq.pressure_ratio:.8g},"
                f" sbar/eta = {eq.length_ratio:.8g} there.",
                remedy="Near a fold a length or pressure has no state nearby: give it a standard deviation.",
            )
        equilibria.append(eq)
        worst = max(worst, gap)
    return equilibria, worst


def _labels(law: CohesiveLaw, rod: Rod, A: np.ndarray) -> list[str]:
    """Return the names of states by their tip angles, which grow along the branch."""
    branch = primary_branch(law, Closure("ratio", rod.ratio))
    branch.continue_to("LP-pressure")
    places = np.interp(A, *np.transpose([(p.scalars.A, p.arclength) for p in branch.points]))
    return [branch.state_at(float(place)) for place in places]


def _asked(
    rod: Rod, sigma: float, P: float, label: str, by_length: bool, law: CohesiveLaw
) -> tuple[Equilibrium, float]:
    """Ask for the state in the better conditioned way, then in the other."""
    error: PeelOptError | None = None
    # "auto" calls law (8) linear where the two agree.
    named = as_asked(law)
    for length_given in (by_length, not by_length):
        try:
            if length_given:
                eq = _holding(rod, rod.length(sigma), rod.pressure(P), label, named)
                return eq, abs(eq.pressure_ratio - P)
            state = "unfolded" if label in UNFOLDED else label
            held = rod.pressure(min(P, 1.0 - BESIDE_T))
            eq = length_given_pressure(rod, held, state=state, law=named)
            return eq, abs(eq.length_ratio - sigma)
        except PeelOptError as caught:
            error = error or caught
    assert error is not None
    raise error


def _holding(rod: Rod, length: float, pressure: float, label: str, law: str | CohesiveLaw) -> Equilibrium:
    """Equilibrium of a length; ``near``, which walks elsewhere too, only where the name does not tell."""
    try:
        eq = pressure_given_length(rod, length, state=label, law=law)
        if abs(eq.pressure - pressure) <= rod.pressure(MOST_APART):
            return eq
    except AmbiguousState:
        pass
    return pressure_given_length(rod, length, near=pressure, law=law)
