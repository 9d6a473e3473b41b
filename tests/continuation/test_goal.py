"""How far a walk goes for a question, and the least pressure on it."""

from __future__ import annotations

import math

import pytest

import peel_opt as po
from peel_opt.continuation.goal import ENDLESS, Goal, below_zero, left_for_good, minimum_pressure
from peel_opt.continuation.primary import Family, PrimaryBranch
from peel_opt.model.bond import COHESIVE, LINEAR, CohesiveLaw
from peel_opt.model.groups import PI4
from peel_opt.residual.closures import Closure
from peel_opt.residual.meshes import GROUPS, PATH


def branch(law: CohesiveLaw, ratio: float, side: int = 1) -> PrimaryBranch:
    return PrimaryBranch(Family(law, PATH, Closure("ratio", ratio)), side)


@pytest.mark.parametrize(
    "target", [Closure("pressure", 0.6), Closure("length", 3.05), Closure("pressure", 0.1218370)]
)
def test_a_walk_that_has_passed_its_goal_holds_all_unfolded_states(target: Closure) -> None:
    short, whole = branch(COHESIVE, 1.0), branch(COHESIVE, 1.0)
    Goal(target).walk(short)
    whole.extend(lambda _: False)
    assert len(short.points) < len(whole.points)
    found = [c.estimate(lambda s: s.sigma) for c in short.candidates(target) if c.state != "folded"]
    every = [c.estimate(lambda s: s.sigma) for c in whole.candidates(target) if c.state != "folded"]
    assert found == pytest.approx(every, rel=1e-9)


def test_folded_states_are_looked_for_to_the_end() -> None:
    walk = branch(COHESIVE, 1.0)
    Goal(Closure("pressure", 0.6), anywhere=True).walk(walk)
    assert walk.ended == "contact"


def test_a_branch_without_an_end_is_given_up_some_time() -> None:
    walk = branch(LINEAR, 1.0)
    Goal(Closure("length", 1e9), anywhere=True).walk(walk)
    assert not walk.ended
    assert len(walk.points) == ENDLESS + 1


def test_below_zero_is_for_laws_that_let_the_pressure_fall() -> None:
    endless, ending = branch(LINEAR, 1.0), branch(COHESIVE, 1.0)
    for walk in (endless, ending):
        walk.extend(lambda _, walk=walk: below_zero(walk))  # type: ignore[misc]
    assert endless.points[-1].scalars.pressure_ratio < 0.0
    assert endless.points[-2].scalars.pressure_ratio >= 0.0
    assert ending.ended == "contact"


@pytest.mark.parametrize("window", [(-1.0, 3.0), (-0.1, 0.5), (-50.0, 1.0)])
def test_a_walk_leaves_a_window_only_where_it_does_not_come_back(window: tuple[float, float]) -> None:
    """The fold at beta0 = 4 lies at lambda = -0.269: the branch dips below -0.1 and comes back."""
    walk = PrimaryBranch(Family(LINEAR, GROUPS, Closure("length", math.cbrt(4.0))))
    walk.extend(lambda _: left_for_good(walk, window))
    lam = [p.scalars.lam for p in walk.points]
    assert lam[-1] > window[1]
    assert min(lam) == pytest.approx(-0.2690010883, abs=1e-9)


def test_a_branch_without_a_fold_goes_down_to_beta1_zero() -> None:
    walk = PrimaryBranch(Family(LINEAR, GROUPS, Closure("length", math.cbrt(60.0))))
    walk.extend(lambda _: left_for_good(walk, (-PI4, 10.0)))
    assert not walk.folds
    assert walk.points[-1].scalars.lam < -0.999 * PI4


def test_the_least_pressure_is_a_fold_or_an_error_that_says_why() -> None:
    fold = minimum_pressure(branch(COHESIVE, 1.0))
    assert fold.point.scalars.pressure_ratio == pytest.approx(0.121837041296, abs=1e-10)
    assert fold.point.scalars.sigma == pytest.approx(5.400884982, abs=1e-7)
    endless = branch(LINEAR, 1.0)
    endless.longest = 40
    with pytest.raises(po.NotConverged, match="was not reached"):
        minimum_pressure(endless)
