"""Batches: what the single calls say, whatever stands beside, and every failure its own reason.

Modules: `answers`, `batches`.
"""

from importlib import import_module

import numpy as np
import pytest

import peel_opt as po
from peel_opt.equilibria.answers import KINDS, NUMBERS, TEXTS
from peel_opt.model.rod import RATIOS

ONE_BY_ONE = import_module("peel_opt.equilibria.answers")


@pytest.fixture(autouse=True)
def _single_calls_walk(monkeypatch):
    """Compare with answers that have nothing in common with the batch, seeds neither."""
    monkeypatch.setattr(import_module("peel_opt.equilibria.ask"), "seeded", lambda _: None)


def single(point, **options):
    """The call that a question of a batch stands for."""
    if "beta0" in point:
        return po.equilibrium(**point, **{"law": "linear"} | options)
    rod = po.Rod.from_ratio(point["ratio"])
    if "pressure_ratio" in point:
        return po.length_given_pressure(rod, point["pressure_ratio"], **options)
    return po.pressure_given_length(rod, point["length_ratio"], **options)


def assert_agrees(found, i, **options):
    """Compare one answer with its single call: within the errors of both, and in all texts."""
    point = {name: float(getattr(found, name).flat[i]) for name in found.given}
    if not found.certified.flat[i]:
        with pytest.raises(po.PeelOptError) as caught:
            single(point, **options)
        assert found.statuses.flat[i] == caught.value.status
        assert found.reasons.flat[i] == str(caught.value)
        assert np.isnan(found.values.flat[i])
        return
    eq = single(point, **options)
    assert found.statuses.flat[i] == eq.status, point
    assert abs(found.values.flat[i] - eq.answer) <= found.errors.flat[i] + eq.error, point
    assert (found.states.flat[i], found.laws.flat[i]) == (eq.state, eq.law), point
    assert found.flags.flat[i] == ", ".join(eq.flags)
    assert found.tip_angle.flat[i] == pytest.approx(eq.theta[0], abs=1e-5)
    for name in NUMBERS[:6]:
        assert getattr(found, name).flat[i] == pytest.approx(getattr(eq, name), rel=1e-5, abs=1e-5)
    # It is read off a Jacobian near the solution, and grows as the distance from a fold shrinks, whose place
    # depends on the mesh by some 1e-10.  That of the series is a bound.
    if "Spectral" in eq.stats.method:
        condition = eq.stats.condition
        assert found.conditions.flat[i] == pytest.approx(condition, rel=2e-2 + 1e-10 * condition**2, abs=1e-4)


def alone(monkeypatch):
    """Names of the questions that a batch leaves to single calls, as they come."""
    seen, real = [], ONE_BY_ONE._alone

    def watched(point, *others):
        seen.append(point)
        return real(point, *others)

    monkeypatch.setattr(ONE_BY_ONE, "_alone", watched)
    return seen


def extremes(count, seed):
    """Random rods of all kinds, and shares of the way of their unfolded states."""
    rng = np.random.default_rng(seed)
    return np.exp(rng.uniform(*np.log(RATIOS), count)), rng.uniform(0.02, 0.98, count)


def states_of(ratio, share):
    """Pressures between T0 and one that is a little above the least of each rod."""
    stiff = ratio > 0.45
    return np.where(stiff, (4.0 * ratio) ** (-1.5 * 0.9 * share), 1.0 - ratio * share)


def least_pressure(ratio):
    return po.trace(po.Rod.from_ratio(ratio)).special("LP-pressure")[0].pressure_ratio


def test_what_the_design_promises():
    found = po.answers(ratio=[1.0, 1.0, 2.0], pressure_ratio=[0.8, 0.2, 0.3])
    assert found.values[0] == pytest.approx(3.036804006, abs=1e-9)
    assert found.tip_height[0] == pytest.approx(0.4, abs=1e-12)
    assert found.tip_height[1:] == pytest.approx(0.5 / np.array([0.2, 0.3]), rel=1e-12)  # p y = Phi
    assert found.tip_angle[0] == pytest.approx(-0.226103220, abs=1e-9)
    assert found.certified.all()
    assert found.states.tolist() == ["middle", "lower", "lower"]
    assert found.laws.tolist() == ["linear", "cohesive", "cohesive"]


def test_the_papers_groups():
    found = po.answers(beta0=[4.0, 2.0], lam=[1.0, 0.5])
    assert found.asked == "alpha1"
    assert found.values[0] == pytest.approx(-4.4354069891, abs=1e-9)
    assert found.ratio[0] == pytest.approx((np.pi**4 + 1.0) / 4.0 ** (4 / 3))
    for i in range(2):
        assert_agrees(found, i)


@pytest.mark.parametrize("given", ["pressure_ratio", "length_ratio"])
def test_answers_are_those_of_single_calls_over_all_rods(given, monkeypatch):
    ratio, share = extremes(24, seed=11)
    left = alone(monkeypatch)
    found = po.answers(ratio=ratio, pressure_ratio=states_of(ratio, share))
    if given == "length_ratio":
        found = po.answers(ratio=ratio, length_ratio=found.length_ratio)
    assert not left
    assert found.certified.all()
    for i in range(len(ratio)):
        assert_agrees(found, i)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["auto", "linear"])
@pytest.mark.parametrize("state", [None, "middle", "lower"])
def test_answers_are_those_of_single_calls_beside_every_fold(law, state):
    ratio, _ = extremes(60, seed=12)
    ratio[:20] = np.random.default_rng(1).uniform(0.3, 0.5, 20)
    rng = np.random.default_rng(13)
    near = 10.0 ** rng.uniform(-9.0, -2.0, 60)
    least = np.array([least_pressure(r) for r in ratio])
    folds = np.array([po.trace(po.Rod.from_ratio(r)).length_ratio.min() for r in ratio])
    for P in (least * (1.0 + near), 0.5 * (1.0 + near * rng.choice([-1.0, 1.0], 60)), 1.0 - near):
        found = po.answers(ratio=ratio, pressure_ratio=P, law=law, state=state)
        for i in range(60):
            assert_agrees(found, i, law=law, state=state)
    critical = np.pi * ratio**-0.25
    for sigma in (folds * (1.0 + near), critical * (1.0 - near), critical * (1.0 + near)):
        found = po.answers(ratio=ratio, length_ratio=sigma, law=law, state=state)
        for i in range(60):
            assert_agrees(found, i, law=law, state=state)


def test_bits_do_not_depend_on_what_else_is_asked():
    ratio, share = extremes(300, seed=5)
    ratio, P = np.maximum(ratio, 1.0), 0.2 + 0.79 * share
    together = po.answers(ratio=ratio, pressure_ratio=P)
    order = np.random.default_rng(6).permutation(300)
    for rows in (order, order[:37], order[:2], order[:1], order[1:2]):
        some = po.answers(ratio=ratio[rows], pressure_ratio=P[rows])
        for name in NUMBERS:
            assert np.array_equal(getattr(some, name), getattr(together, name)[rows], equal_nan=True)


def test_most_questions_are_answered_together(monkeypatch):
    left = alone(monkeypatch)
    ratio, share = extremes(400, seed=7)
    found = po.answers(ratio=np.maximum(ratio, 1.0), pressure_ratio=0.2 + 0.79 * share)
    assert found.certified.all()
    assert not left


def test_errors_are_within_tol_and_finer_meshes_serve_smaller_ones(monkeypatch):
    left = alone(monkeypatch)
    ratio = np.geomspace(0.02, 0.3, 30)
    for tol in (1e-8, 1e-11):
        found = po.answers(ratio=ratio, pressure_ratio=1.0 - 0.8 * ratio, tol=tol)
        assert found.certified.all()
        assert (found.errors <= tol).all()
        assert (found.certificates <= tol).all()
    assert not left
    assert po.answers(ratio=ratio, pressure_ratio=1.0 - 0.8 * ratio).errors.max() > 1e-11


# --- shapes and what is out of range --------------------------------------------------------------


def test_arrays_broadcast_and_numbers_do():
    grid = po.answers(ratio=np.array([[1.0], [2.0]]), pressure_ratio=[0.5, 0.6, 0.7])
    assert grid.shape == grid.values.shape == grid.states.shape == (2, 3)
    assert grid.ratio[1].tolist() == [2.0] * 3
    assert len(grid) == 6
    one = po.answers(ratio=1.0, pressure_ratio=0.5)
    assert one.shape == ()
    assert float(one.values) == grid.values[0, 0]
    assert po.answers(ratio=[], pressure_ratio=[]).shape == (0,)


def test_what_was_given_stands_unchanged():
    ratio, P = np.array([0.7, 1.3, 2.0]), np.array([0.61, 0.4, 5.0])
    found = po.answers(ratio=ratio, pressure_ratio=P)
    assert found.ratio.tolist() == ratio.tolist()
    assert found.pressure_ratio.tolist() == P.tolist()


@pytest.mark.parametrize(
    ("ratio", "P", "status"),
    [
        (1.0, 0.1, "no-equilibrium"),
        (1.0, 1.0, "no-equilibrium"),
        (1.0, -0.5, "no-equilibrium"),
        (1.0, np.nan, "invalid-input"),
        (1.0, np.inf, "invalid-input"),
        (np.nan, 0.5, "invalid-input"),
        (-1.0, 0.5, "invalid-input"),
        (0.0, 0.5, "invalid-input"),
        (1e-4, 0.9999, "out-of-range"),
        (1e5, 0.9, "out-of-range"),
    ],
)
def test_a_number_out_of_range_costs_its_own_answer_only(ratio, P, status):
    found = po.answers(ratio=[1.0, ratio], pressure_ratio=[0.8, P])
    assert found.statuses.tolist() == ["certified", status]
    assert found.reasons[0] == ""
    assert found.reasons[1]
    assert np.isnan([found.values[1], found.errors[1]]).all()
    assert "1 of 2 certified" in found.summary()
    assert status in repr(found)


def test_what_is_masked_has_no_answer():
    found = po.answers(ratio=np.ma.array([1.0, 2.0], mask=[False, True]), pressure_ratio=0.8)
    assert found.statuses.tolist() == ["certified", "invalid-input"]


def test_the_nearest_that_exists_is_said():
    found = po.answers(ratio=[1.0, 1.0], pressure_ratio=[0.5, 0.1])
    assert found.nearest[1] == pytest.approx(0.121837041296, abs=1e-9)
    assert np.isnan(found.nearest[0])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "nothing given"),
        ({"ratio": 1.0}, "ratio given"),
        ({"ratio": 1.0, "pressure_ratio": 0.5, "length_ratio": 3.0}, "no question"),
        ({"ratio": 1.0, "lam": 0.5}, "no question"),
        ({"ratio": "one", "pressure_ratio": 0.5}, "ratio must be an array of numbers"),
        ({"ratio": 1.0, "pressure_ratio": [0.5, "x"]}, "pressure_ratio must be"),
        ({"ratio": 1.0, "pressure_ratio": True}, "pressure_ratio must be"),
        ({"ratio": [[1.0, 2.0], [3.0]], "pressure_ratio": 0.5}, "ratio must be"),
        ({"ratio": 1j, "pressure_ratio": 0.5}, "ratio must be"),
        ({"ratio": [1.0, 2.0], "pressure_ratio": [0.5, 0.6, 0.7]}, "no common"),
        ({"ratio": 1.0, "pressure_ratio": 0.5, "law": "steel"}, "unknown law"),
        ({"ratio": 1.0, "pressure_ratio": 0.5, "state": "upper"}, "unknown state"),
        ({"ratio": 1.0, "pressure_ratio": 0.5, "tol": 0.0}, "tol must be positive"),
    ],
)
def test_what_cannot_be_meant_is_said(given, words):
    with pytest.raises(po.InvalidInput, match=words):
        po.answers(**given)


# --- what the batch does not reach ----------------------------------------------------------------


def test_other_laws_and_states_are_answered_one_by_one():
    law = po.exponential()
    found = po.answers(ratio=[1.0, 1.5], pressure_ratio=0.7, law=law)
    assert found.options["law"] == law.name
    for i in range(2):
        assert_agrees(found, i, law=law)
    folded = po.answers(ratio=1.0, pressure_ratio=0.3, state="folded")
    assert folded.states == "folded"
    assert_agrees(folded, 0, state="folded")


def test_a_state_that_is_not_there_is_refused_as_single_calls_do():
    found = po.answers(ratio=1.0, pressure_ratio=[0.8, 0.3], state="middle")
    assert found.statuses.tolist() == ["certified", "no-equilibrium"]
    assert_agrees(found, 1, state="middle")


def test_the_linear_law_beyond_y0_is_answered_one_by_one():
    found = po.answers(ratio=1.0, pressure_ratio=[0.6, 0.4], law="linear")
    assert found.laws.tolist() == ["linear", "linear"]
    assert found.flags.tolist() == ["", "y > y0"]
    for i in range(2):
        assert_agrees(found, i, law="linear")


# --- files ----------------------------------------------------------------------------------------


def test_answers_are_saved_and_read_back_bit_for_bit(tmp_path):
    found = po.answers(ratio=[[1.0], [0.02]], pressure_ratio=[0.8, 0.3], state="unfolded")
    again = po.Answers.load(found.save(tmp_path / "answers.npz"))
    assert (again.given, again.options, again.asked) == (found.given, found.options, "length_ratio")
    for name in (*NUMBERS, *TEXTS):
        a, b = getattr(found, name), getattr(again, name)
        assert a.shape == b.shape == (2, 2)
        assert np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    assert repr(again) == repr(found)


def test_a_table_has_a_line_for_each_question(tmp_path):
    found = po.answers(ratio=[1.0, 1.0], pressure_ratio=[0.8, 0.1])
    lines = found.to_csv(tmp_path / "answers.csv").read_text().splitlines()
    rows = [line for line in lines if not line.startswith("#")]
    assert rows[0].startswith("ratio,pressure_ratio,length_ratio")
    assert "tip_angle [rad]" in rows[0]
    assert len(rows) == 3
    assert '# asked = "length_ratio"' in lines


def test_every_question_has_an_answer():
    assert {asks.asked.attribute for asks in KINDS.values()} == {"length_ratio", "pressure_ratio", "alpha1"}
