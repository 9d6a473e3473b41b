"""The choice between states along branches that are walked for a while only.

Modules: `select`, and of the walks it asks for `isobar_walk`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache

import pytest

import peel_opt as po
from peel_opt.continuation.family import Family
from peel_opt.continuation.primary import PrimaryBranch
from peel_opt.equilibria.ask import solve_question
from peel_opt.equilibria.question import Question
from peel_opt.equilibria.select import SelectionWalk
from peel_opt.model.bond import CohesiveLaw
from peel_opt.residual.closures import Closure
from peel_opt.residual.meshes import PATH

ROD = po.Rod.from_ratio(1.0)


def fresh() -> Callable[[CohesiveLaw, Closure, int], PrimaryBranch]:
    """Branches that nobody has walked yet."""
    return cache(lambda law, closure, side: PrimaryBranch(Family(law, PATH, closure), side))


@pytest.mark.parametrize(
    "question",
    [
        Question.of_rod(ROD, "pressure", 0.3, state="folded"),
        Question.of_rod(ROD, "length", 4.0, state="folded", near=0.3),
        Question.of_rod(ROD, "pressure", 0.3, law="linear"),
        Question.of_groups(30.0, 80.0, state="lower"),
        Question.of_groups(4.0, 2.0, state="spurious"),
        Question.of_groups(60.0, 20.0),
    ],
    ids=lambda question: question.words,
)
def test_a_walk_that_is_cut_short_says_so_and_goes_on_when_it_is_asked_again(question: Question) -> None:
    branch = fresh()
    for _ in range(5):
        with pytest.raises(po.NotConverged, match="so far") as refused:
            solve_question(question, "spectral", search=SelectionWalk(branch, deadline=0.0))
        assert refused.value.nearest is None
    found = None
    while found is None:
        with suppress(po.NotConverged):
            search = SelectionWalk(branch, deadline=time.perf_counter() + 2e-3)
            found = solve_question(question, "spectral", search=search)
    exact = solve_question(question, "spectral")
    assert found.state == exact.state
    assert abs(found.answer - exact.answer) <= found.error + exact.error


def test_what_does_not_exist_is_said_once_enough_has_been_walked() -> None:
    question = Question.of_rod(ROD, "pressure", 0.01, state="folded")
    branch = fresh()
    with pytest.raises(po.NotConverged, match="so far"):
        solve_question(question, "spectral", search=SelectionWalk(branch, deadline=0.0))
    with pytest.raises(po.NoEquilibrium) as in_time:
        solve_question(
            question, "spectral", search=SelectionWalk(branch, deadline=time.perf_counter() + 600.0)
        )
    with pytest.raises(po.NoEquilibrium) as exact:
        solve_question(question)
    assert in_time.value.nearest == pytest.approx(exact.value.nearest, rel=1e-9)


@pytest.mark.parametrize(("name", "value"), [("pressure", 0.01), ("length", 2.5)])
def test_that_there_is_no_unfolded_state_takes_no_walk(name: str, value: float) -> None:
    question = Question.of_rod(ROD, name, value)
    with pytest.raises(po.NoEquilibrium) as at_once:
        solve_question(question, "spectral", search=SelectionWalk(fresh(), deadline=0.0))
    with pytest.raises(po.NoEquilibrium) as exact:
        solve_question(question)
    assert at_once.value.nearest == pytest.approx(exact.value.nearest, rel=1e-9)


def test_at_the_strength_of_the_bond_no_nearest_pressure_is_named_that_is_the_one_asked() -> None:
    with pytest.raises(po.NoEquilibrium, match="an end of theirs") as refused:
        solve_question(Question.of_rod(ROD, "pressure", ROD.adhesion_strength))
    assert refused.value.nearest == ROD.adhesion_strength
    assert "nearest that" not in str(refused.value)


def test_far_beyond_them_the_nearest_state_is_the_last() -> None:
    far, further = (Question.of_rod(ROD, "length", length) for length in (1e2, 1e20))
    with pytest.raises(po.NoEquilibrium) as near_by:
        solve_question(far)
    with pytest.raises(po.NoEquilibrium) as refused:
        solve_question(further)
    assert refused.value.nearest == near_by.value.nearest


@pytest.mark.parametrize("law", ["linear", "cohesive"])
@pytest.mark.parametrize(
    ("lam", "state"), [(-0.2, "middle"), (-0.2, "lower"), (-0.2, None), (1.0, "lower"), (1.0, "spurious")]
)
def test_the_branch_at_the_beta0_of_the_groups_holds_the_states_of_the_rod(
    law: str, lam: float, state: str
) -> None:
    question = Question.of_groups(4.0, lam, law=law, state=state)
    along = solve_question(question, method="spectral", search=SelectionWalk(fresh(), path=question.given[0]))
    rod = solve_question(question, method="spectral")
    assert along.state == rod.state
    assert along.answer == pytest.approx(rod.answer, abs=along.error + rod.error)


def test_no_lambda_is_named_where_the_branch_at_beta0_has_no_such_state() -> None:
    with pytest.raises(po.NoEquilibrium, match="no folded equilibrium") as refused:
        po.equilibrium(beta0=30.0, lam=80.0, law="cohesive", state="folded")
    assert refused.value.nearest is None
    assert "nearest" not in str(refused.value)
    with pytest.raises(po.NoEquilibrium) as lower:
        po.equilibrium(beta0=4.0, lam=-1.0, state="lower")
    fold = po.trace(beta0=4.0, lam=(-1.0, 1.0)).special("LP-lambda")[0]
    assert lower.value.nearest == pytest.approx(fold.lam, abs=1e-9)
