"""The work-precision table: honest rows, failures kept, a peer that solves the same problem."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import astuple
from functools import partial
from itertools import count
from pathlib import Path

import numpy as np
import pytest

import peel_opt as po
from benchmarks import auto_peer
from benchmarks.figures import Figure
from peel_opt.app.cards import Card
from peel_opt.app.cli.main import main
from peel_opt.studies.tradeoff.peers import BvpPeer
from peel_opt.studies.tradeoff.run import tradeoff
from peel_opt.studies.tradeoff.table import WorkPrecision

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
        assert row.evaluations > row.iterations >= 1  # those that bound the rounding count too


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
    lines = table.to_csv(tmp_path / "work.csv").read_text().splitlines()
    head = dict(line[2:].split(" = ") for line in lines if line.startswith("# "))
    assert float(head["reference"]) == table.reference
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [row["method"] for row in rows] == [row.method for row in table.rows]
    assert float(rows[0]["true_error"]) == table.rows[0].true_error
    assert float(rows[0]["seconds [s]"]) == table.rows[0].seconds


def test_npz_reads_back_bit_for_bit(table: WorkPrecision, tmp_path) -> None:
    back = WorkPrecision.load(table.save(tmp_path / "work.npz"))
    assert repr(back) == repr(table)
    for a, b in zip(back.rows, table.rows, strict=True):
        np.testing.assert_equal(astuple(a), astuple(b))
    assert (back.answered, back.reference) == (table.answered, table.reference)


@pytest.mark.parametrize("damage", ["column", "schema", "reference", "bytes"])
def test_a_damaged_table_is_refused(table: WorkPrecision, tmp_path, damage: str) -> None:
    path = table.save(tmp_path / "work.npz")
    with np.load(path) as stored:
        arrays = dict(stored)
    head = json.loads(str(arrays["metadata"]))
    if damage == "column":
        arrays["tol"] = arrays["tol"].astype(str)
    elif damage == "schema":
        head["schema"] = "peel_opt branch"
    elif damage == "reference":
        head["reference"] = "four"
    arrays["metadata"] = np.array(json.dumps(head))
    np.savez(path, **arrays)
    if damage == "bytes":
        path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(po.InvalidInput, match="not a work-precision file"):
        WorkPrecision.load(path)


def test_repr_is_a_table(table: WorkPrecision) -> None:
    lines = repr(table).splitlines()
    assert lines[0].split()[:3] == ["method", "tol", "ms"]
    assert len(lines) == 10
    assert "reference alpha1 = -4.43540698907" in lines[-1]


def test_plot_returns_its_axes(table: WorkPrecision) -> None:
    ax = table.plot()
    assert ax.get_legend_handles_labels()[1] == ["series", "spectral", "solve_bvp"]
    assert ax.get_yscale() == "log"
    assert ax.get_xlabel().endswith("[ms]")
    assert min(line.get_ydata().min() for line in ax.lines[:3]) >= table.reference_error
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


def test_a_method_nobody_has_is_refused_before_any_work() -> None:
    with pytest.raises(po.InvalidInput, match="unknown method 'magic'"):
        tradeoff(SCENES["groups"], ("series", "magic"))


def test_ipopt_s_evaluations_count() -> None:
    row = tradeoff(SCENES["groups"], ("shooting",), (1e-6,), repeats=1).rows[0]
    newton = tradeoff(SCENES["groups"], (po.Method(po.Shooting()),), (1e-6,), repeats=1).rows[0]
    assert row.evaluations > newton.evaluations > newton.iterations


@pytest.mark.parametrize("empty", [{"methods": ()}, {"tols": ()}, {"repeats": 0}])
def test_nothing_to_measure(empty: dict) -> None:
    with pytest.raises(po.InvalidInput, match=r"at least (one|1)"):
        tradeoff(SCENES["groups"], **empty)


def test_a_benchmark_figure_knows_whether_it_is_met() -> None:
    assert Figure("faster", 31.0, "x", 30.0, at_least=True).met
    assert not Figure("slower", 5.1, "ms", 5.0).met
    assert Figure("reported only", 5.1, "ms").met
    assert "FALLS SHORT" in str(Figure("slower", 5.1, "ms", 5.0))
    assert "met" not in str(Figure("reported only", 5.1, "ms"))


def test_the_page_on_methods_runs() -> None:
    page = (Path(__file__).parents[2] / "docs" / "choosing_a_method.md").read_text(encoding="utf-8")
    code = page.split("```python\n")[1].split("```")[0]
    names: dict = {}
    exec(code, names)
    assert names["table"].methods == ("spectral", "collocation", "solve_bvp")


# --- on the command line ----------------------------------------------------------------

QUICK = ("--methods", "series", "spectral", "--tols", "1e-6", "--repeats", "1")


def asked(capsys, *arguments: str) -> tuple[int, str, str]:
    code = main(["tradeoff", *arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_command_prints_a_table(capsys) -> None:
    code, out, err = asked(capsys, "--beta0", "4", "--lam", "1", *QUICK)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "alpha1 at beta0 = 4, lambda = 1"
    assert [line.split()[0] for line in lines[2:5]] == ["method", "series", "spectral"]
    assert "reference alpha1 = -4.43540698907" in lines[5]


def test_command_writes_its_files(capsys, tmp_path) -> None:
    flags = ("--ratio", "0.566", "--pressure", "0.7 T0", *QUICK, "--out", str(tmp_path))
    assert asked(capsys, *flags)[0] == 0
    assert {path.name for path in tmp_path.iterdir()} == {
        "tradeoff.npz",
        "tradeoff.csv",
        "tradeoff.png",
        "written.json",
    }
    table = WorkPrecision.load(tmp_path / "tradeoff.npz")
    assert table.answered == "length_ratio"
    assert [row.method for row in table.rows] == ["series", "spectral"]


def test_command_asks_all_questions_of_a_card(capsys, tmp_path) -> None:
    card = tmp_path / "card.toml"
    card.write_text(
        'title = "t"\n[rod]\nratio = 2.0\n'
        "[[questions]]\npressure_ratio = 0.7\n[[questions]]\npressure_ratio = 1.7\n"
        "[[questions]]\nlength_ratio = 3.0\n"
    )
    code, out, err = asked(capsys, "--card", str(card), *QUICK, "--json", "--out", str(tmp_path), "--no-plot")
    assert code == 1
    assert "p/T0 = 1.7" in err
    tables = json.loads(out)["tables"]
    assert [table["answered"] for table in tables] == ["length_ratio", "pressure_ratio"]
    assert tables[0]["rows"][1]["method"] == "spectral"
    assert tables[0]["rows"][1]["evaluations"] >= 2  # on the mesh it landed on, and on a finer one
    assert {path.name for path in tmp_path.glob("*.npz")} == {"tradeoff-1-card.npz", "tradeoff-3-card.npz"}
    assert not list(tmp_path.glob("*.png"))


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        ("", "give either --beta0, or a rod"),
        ("--beta0 4", "--lam or --beta1"),
        ("--ratio 1 --lam 1", "--lam or --beta1"),
        ("--beta0 4 --ratio 1 --lam 1", "give either --beta0, or a rod"),
        ("--beta0 4 --lam 1 --length 3", "--length is about a rod"),
        ("--beta0 -4 --lam 1", "beta0 must be zero or positive"),
        ("--ratio 1", "give --length or --pressure"),
        ("--ratio 1 --pressure 60kPa", "pressure"),
        ("--ratio 1 --pressure 0.7 --methods magic", "unknown method 'magic'"),
        ("--ratio 1 --pressure 0.7 --repeats 0", "at least 1"),
        ("--card problems/office_tape.toml --state lower", "--state goes with"),
        ("--card problems/office_tape.toml --ratio 3", "give the rod by"),
        ("--card nowhere.toml", "cannot read card"),
    ],
)
def test_command_says_what_it_cannot_use(capsys, flags: str, words: str) -> None:
    code, out, err = asked(capsys, *flags.split())
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_command_without_an_answer_exits_with_one(capsys) -> None:
    code, out, err = asked(capsys, "--ratio", "1", "--pressure", "0.1", *QUICK)
    assert (code, out) == (1, "")
    assert "nearest that does exist" in err


# --- AUTO -------------------------------------------------------------------------------


def test_auto_s_equations_are_those_of_the_peer() -> None:
    state, alpha1, lam = [0.3, -0.7, 0.2, 0.9, -0.1], -1.5, 0.4
    peer = BvpPeer.of(po.equilibrium(beta0=auto_peer.BETA0, lam=lam))
    other = peer._slope(np.zeros(1), np.array(state)[:, None], np.array([alpha1])).ravel()
    np.testing.assert_allclose(auto_peer.slope(state, [lam, alpha1]), other, rtol=1e-14)
    a, b = np.arange(5.0), 10.0 + np.arange(5.0)
    np.testing.assert_array_equal(auto_peer.ends(a, b, [lam, alpha1]), peer._ends(a, b, np.array([alpha1])))


@pytest.mark.skipif(bool(auto_peer.missing()), reason="needs bifpy and gfortran")
def test_auto_finds_the_same_diagram() -> None:
    diagram = auto_peer.diagram(repeats=1)
    assert diagram.fold == pytest.approx(-0.26900108827, abs=1e-10)
    assert abs(diagram.branch_point) < 1e-8
    for (lam, alpha1), state in zip(diagram.ends, ("lower", "spurious"), strict=True):
        assert lam == pytest.approx(3.0, abs=1e-6)
        assert alpha1 == pytest.approx(po.equilibrium(beta0=4.0, lam=lam, state=state).alpha1, abs=1e-8)
    assert 0.0 < diagram.seconds < diagram.seconds + diagram.around


def test_where_auto_is_missing_a_line_says_so(monkeypatch) -> None:
    monkeypatch.setattr(auto_peer, "find_spec", lambda _: None)
    (line,) = auto_peer.figures()
    assert line.met
    assert "skipped: bifpy is not installed" in str(line)


def test_a_problem_that_is_called_otherwise_is_refused() -> None:
    rod = po.Rod.from_ratio(1.0)
    with pytest.raises(po.InvalidInput, match=r"called with method and tol.*partial\("):
        tradeoff(lambda: po.length_given_pressure(rod, 0.8))
    with pytest.raises(po.InvalidInput, match="returns an Equilibrium, got 3"):
        tradeoff(lambda method, tol: 3)  # type: ignore[arg-type, return-value]
