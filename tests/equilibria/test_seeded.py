"""Single answers from seeds: the states of a walk, without one, and the same whatever was asked before.

Module: `unfolded`.
"""

from importlib import import_module

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation.primary import forget_branches, primary_branch
from peel_opt.equilibria.question import Question
from peel_opt.equilibria.select import select
from peel_opt.equilibria.unfolded import seeded
from peel_opt.model.bond import COHESIVE
from peel_opt.model.rod import RATIOS
from peel_opt.residual.accuracy import response
from peel_opt.residual.closures import Closure
from peel_opt.residual.linear import Linearised

ASK = import_module("peel_opt.equilibria.ask")


def rods(count, seed):
    return np.exp(np.random.default_rng(seed).uniform(*np.log(RATIOS), count))


def pressure_of(ratio, share):
    """Between T0 and a little above the least pressure of a rod."""
    return (4.0 * ratio) ** (-1.35 * share) if ratio > 0.45 else 1.0 - ratio * share


def no_walk(question):
    raise AssertionError(f"a walk for {question.words}")


@pytest.mark.parametrize("given", ["pressure", "length"])
def test_unfolded_states_are_those_of_the_walk(given):
    for ratio, share in zip(rods(20, 3), np.random.default_rng(4).uniform(0.05, 0.95, 20), strict=True):
        rod = po.Rod.from_ratio(ratio)
        question = Question.of_rod(rod, "pressure", pressure_of(ratio, share))
        walked = select(question).candidate
        if given == "length":
            question = Question.of_rod(rod, "length", walked.profile.scalars.sigma)
            walked = select(question).candidate
        found = seeded(question)
        assert found is not None
        state, _, points = found
        assert points == 0
        assert state.state == walked.state
        assert state.profile.scalars.sigma == pytest.approx(walked.profile.scalars.sigma, rel=1e-7)
        assert pytest.approx(walked.profile.scalars.A, rel=1e-5) == state.profile.scalars.A


def test_a_rod_never_seen_takes_no_walk(monkeypatch):
    forget_branches()
    monkeypatch.setattr(ASK, "select", no_walk)
    for ratio in rods(15, 5):
        rod = po.Rod.from_ratio(ratio)
        eq = po.length_given_pressure(rod, pressure_of(ratio, 0.7), method="spectral")
        assert eq.certified
        assert eq.stats.path_points == 0
        assert po.pressure_given_length(rod, eq.length, method="spectral").certified
    for law in ("linear", "cohesive"):
        lower, middle = (
            po.equilibrium(beta0=20.0, lam=-6.0, law=law, state=state, method="spectral")
            for state in ("unfolded", "middle")
        )
        assert (lower.state, middle.state) == ("lower", "middle")
        assert lower.certified
        assert -10.0 < lower.alpha1 < middle.alpha1 < 0.0


@pytest.mark.parametrize("ratio", [0.1, 1.0, 40.0])
def test_an_answer_does_not_depend_on_what_was_asked_before(ratio):
    rod, P = po.Rod.from_ratio(ratio), pressure_of(ratio, 0.8)
    forget_branches()
    cold = po.length_given_pressure(rod, P, method="spectral")
    primary_branch(COHESIVE, Closure("ratio", rod.ratio)).extend(lambda _: False)
    known = po.length_given_pressure(rod, P, method="spectral")
    assert (cold.length.hex(), cold.error.hex()) == (known.length.hex(), known.error.hex())


@pytest.mark.parametrize(
    "named",
    [{"state": "folded"}, {"near": 4.0}, {"law": po.exponential()}, {"law": "linear"}],
    ids=["folded", "near", "another law", "the linear law beyond y0"],
)
def test_other_states_are_walked_to(named):
    assert seeded(Question.of_rod(po.Rod.from_ratio(1.0), "pressure", 0.3, **named)) is None


def test_a_state_that_is_not_there_is_not_made_up():
    rod = po.Rod.from_ratio(1.0)
    assert seeded(Question.of_rod(rod, "pressure", 0.3, state="middle")) is None
    assert seeded(Question.of_rod(rod, "pressure", 0.12)) is None
    with pytest.raises(po.NoEquilibrium):
        po.length_given_pressure(rod, 0.1218)


@pytest.mark.parametrize("ratio", [0.3, 5.0, 300.0])
def test_what_is_read_off_the_factors_of_a_correction_is_that_of_the_solution(ratio):
    rod = po.Rod.from_ratio(ratio)
    least, met = po.readhesion_pressure(rod).pressure_ratio, 0
    for beyond in (1e-8, 1.6e-7, 1e-5, 1e-3, 4e-3, 0.1):
        asked = Question.of_rod(rod, "pressure", least * (1.0 + beyond))
        found = seeded(asked)
        if found is None:  # a walk has to tell
            continue
        state = found[0].solution
        anew = Linearised.at(state.problem, state.correction.x, *state.given)
        kept, own = (response(at, state.correction.update, asked.read) for at in (state.linearised, anew))
        assert kept.condition == pytest.approx(own.condition, rel=3e-4)
        assert kept.rounding == pytest.approx(own.rounding, rel=0.01)
        met += 1
    assert met >= 3
