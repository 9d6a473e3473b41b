"""The work-precision table: honest rows, failures kept, a peer that solves the same problem."""

from __future__ import annotations

import csv
import math
from functools import partial
from itertools import count
from pathlib import Path

import numpy as np
import pytest

import peel_opt as po
from benchmarks.figures import Figure
from peel_opt.cards import Card
from peel_opt.peers import BvpPeer
from peel_opt.work_precision import WorkPrecision, tradeoff

SCENES = {
    "groups": partial(po.equilibrium, beta0=4.0, lam=1.0),
    "law (8)": partial(po.length_given_pressure, po.Rod.from_ratio(1.0), 0.2),
    "folded": partial(po.length_given_pressure, po.Rod.from_ratio(1.0), 0.5, state="folded"),
    "given length": partial(po.pressure_given_length, po.Rod.from_ratio(1.0), 3.4),
}


@pytest.fixture(scope="module")
def table() -> WorkPrecision:
    methods = ("series", "spectral", "solve_bvp", po.Shooting(6, "rk4"))
    return tradeoff(SCENES["groups"], methods, (1e-3, 1e-6), repeats=2)


def test_every_method_has_a_row_at_every_tolerance(table: WorkPrecision) -> None:
    assert len(table.rows) == 8
    assert table.methods[:3] == ("series", "spectral", "solve_bvp")
    assert [row.tol for row in table.of("series")] == [1e-3, 1e-6]


def test_rows_hold_what_was_measured(table: WorkPrecision) -> None:
    for row in table.of("spectral"):
        assert row.status == "certified"
        assert row.seconds > 0.0
        assert row.true_error <= row.error + table.reference_error
        assert row.unknowns > 10
        assert row.evaluations == row.iterations >= 1


def test_failures_are_kept_with_their_reason(table: WorkPrecision) -> None:
    failed = table.rows[-1]
    assert failed.status.startswith("not-certified")
    assert "tol" in failed.status
    assert math.isnan(failed.seconds)
    assert math.isnan(failed.true_error)


def test_fastest_goes_by_the_true_error(table: WorkPrecision) -> None:
    best = table.fastest(1e-8)
    assert best is not None
    assert best.true_error < 1e-8
    assert best.seconds == min(row.seconds for row in table.rows if row.true_error <= 1e-8)


def test_csv_reads_back(table: WorkPrecision, tmp_path) -> None:
    with table.to_csv(tmp_path / "work.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["method"] for row in rows] == [row.method for row in table.rows]
    assert float(rows[0]["true_error"]) == table.rows[0].true_error


def test_repr_is_a_table(table: WorkPrecision) -> None:
    lines = repr(table).splitlines()
    assert lines[0].split()[:3] == ["method", "tol", "ms"]
    assert len(lines) == 10
    assert "reference alpha1 = -4.43540698907" in lines[-1]


def test_plot_returns_its_axes(table: WorkPrecision) -> None:
    ax = table.plot()
    assert [line.get_label() for line in ax.lines] == ["series", "spectral", "solve_bvp"]
    assert ax.get_yscale() == "log"
    assert table.plot(ax) is ax


@pytest.mark.parametrize("scene", SCENES)
def test_solve_bvp_finds_the_same_answer(scene: str) -> None:
    eq = SCENES[scene](method="spectral")
    found = BvpPeer.of(eq).solve(1e-8)
    assert found.answer == pytest.approx(eq.answer, abs=1e-7)
    assert found.evaluations > found.iterations


@pytest.mark.parametrize("scene", SCENES)
def test_jacobian_of_the_peer_is_that_of_its_equations(scene: str) -> None:
    peer = BvpPeer.of(SCENES[scene](method="spectral"), points=3)
    z, p, h = peer.fields, peer.parameters, 1e-6
    by_z, by_p = peer._slope_jacobian(peer.mesh, z, p)
    by_a, by_b, ends_by_p = peer._ends_jacobian(z[:, 0], z[:, -1], p)
    for i, e in enumerate(np.eye(len(z))):
        change = peer._slope(peer.mesh, z + h * e[:, None], p) - peer._slope(peer.mesh, z - h * e[:, None], p)
        np.testing.assert_allclose(by_z[:, i], change / (2 * h), atol=1e-5)
        a, b = z[:, 0], z[:, -1]
        np.testing.assert_allclose(
            by_a[:, i], (peer._ends(a + h * e, b, p) - peer._ends(a, b, p)) / h, atol=1e-5
        )
        np.testing.assert_allclose(
            by_b[:, i], (peer._ends(a, b + h * e, p) - peer._ends(a, b, p)) / h, atol=1e-5
        )
    for i, e in enumerate(np.eye(len(p))):
        change = peer._slope(peer.mesh, z, p + h * e) - peer._slope(peer.mesh, z, p - h * e)
        np.testing.assert_allclose(by_p[:, i], change / (2 * h), rtol=1e-5, atol=1e-4)
        moved = peer._ends(z[:, 0], z[:, -1], p + h * e) - peer._ends(z[:, 0], z[:, -1], p - h * e)
        np.testing.assert_allclose(ends_by_p[:, i], moved / (2 * h), atol=1e-5)


def test_a_law_the_peer_does_not_know_is_a_row_that_says_so() -> None:
    ask = partial(po.length_given_pressure, po.Rod.from_ratio(1.0), 0.6, law=po.exponential())
    table = tradeoff(ask, ("spectral", "solve_bvp", "series"), (1e-6,), repeats=1)
    assert [row.status.split(":")[0] for row in table.rows] == ["certified", "invalid-input", "not-converged"]


def test_seconds_are_the_median_of_the_repeats() -> None:
    ticks = count()
    table = tradeoff(SCENES["groups"], ("series",), (1e-6,), repeats=3, clock=lambda: float(next(ticks)) ** 2)
    assert table.rows[0].seconds == 5.0  # of 1, 5 and 9


def test_a_card_with_one_question_is_a_problem() -> None:
    card = Card.model_validate(
        {"title": "t", "rod": {"ratio": 2.0}, "questions": [{"pressure_ratio": 0.7}]}, by_alias=True
    )
    table = tradeoff(card, ("series",), (1e-8,), repeats=1)
    assert table.answered == "length_ratio"
    assert table.rows[0].status == "certified"


def test_a_card_with_several_questions_is_refused() -> None:
    questions = [{"pressure_ratio": 0.7}, {"pressure_ratio": 0.6}]
    card = Card.model_validate({"title": "t", "rod": {"ratio": 2.0}, "questions": questions}, by_alias=True)
    with pytest.raises(po.InvalidInput, match="2 questions"):
        tradeoff(card)


@pytest.mark.parametrize("empty", [{"methods": ()}, {"tols": ()}, {"repeats": 0}])
def test_nothing_to_measure(empty: dict) -> None:
    with pytest.raises(po.InvalidInput, match="at least one"):
        tradeoff(SCENES["groups"], **empty)


def test_a_benchmark_figure_knows_whether_it_is_met() -> None:
    assert Figure("faster", 31.0, "x", 30.0, at_least=True).met
    assert not Figure("slower", 5.1, "ms", 5.0).met
    assert Figure("reported only", 5.1, "ms").met
    assert "FALLS SHORT" in str(Figure("slower", 5.1, "ms", 5.0))
    assert "met" not in str(Figure("reported only", 5.1, "ms"))


def test_the_page_on_methods_runs() -> None:
    page = (Path(__file__).parent.parent / "docs" / "choosing_a_method.md").read_text(encoding="utf-8")
    code = page.split("```python\n")[1].split("```")[0]
    names: dict = {}
    exec(code, names)
    assert names["table"].methods == ("spectral", "collocation", "solve_bvp")
