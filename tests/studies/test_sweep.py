"""Sweeps: the answers of the single calls, the same bits whoever computes them and in however many goes."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import peel_opt as po
from peel_opt.studies.sweep import plan as sweep_plan
from peel_opt.studies.sweep import process as sweep_process
from peel_opt.studies.sweep import workers as sweep_workers
from peel_opt.studies.sweep.answers import NUMBERS, TEXTS, ChunkAnswers

from ..rods import FLAP

#: Some points by series, some by a walk under law (8), some without an answer.
GRID = {"ratio": np.geomspace(0.3, 20.0, 6), "pressure_ratio": np.linspace(0.2, 0.95, 7)}


def same(a: po.Sweep, b: po.Sweep) -> bool:
    """Whether two sweeps agree in every bit."""
    return a.shape == b.shape and all(
        a[name].tobytes() == b[name].tobytes() if name in NUMBERS else (a[name] == b[name]).all()
        for name in (*NUMBERS, *TEXTS)
    )


class Here(Executor):
    """An executor that computes at once, counts, and breaks after a number of chunks."""

    def __init__(self, breaks_after: int = 10**9) -> None:
        self.asked: list[int] = []
        self.breaks_after = breaks_after

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if len(self.asked) < self.breaks_after:
            self.asked.append(arguments[0].number)
            future.set_result(function(*arguments, **named))
        else:
            future.set_exception(RuntimeError("out of order"))
        return future


needs_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")


def _children(pid: int) -> list[int]:
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            if int(stat.read_text().rpartition(")")[2].split()[1]) == pid:
                found.append(int(stat.parent.name))
        except OSError:
            continue  # it ended meanwhile
    return found


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep_plan, "CHUNK", 8)


@pytest.fixture(scope="module")
def whole() -> Iterator[po.Sweep]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep_plan, "CHUNK", 8)
        yield po.sweep(GRID, workers=1)


# --- what is computed ---------------------------------------------------------------------


def agrees(found: float, eq: po.Equilibrium, error: float, unit: float = 1.0) -> bool:
    """Whether an answer is that of the single call, within the errors of both."""
    return abs(found / unit - eq.answer) <= error + eq.error


def test_every_point_is_the_single_call_within_the_errors_of_both(whole: po.Sweep) -> None:
    assert whole.shape == (6, 7)
    for i, r in enumerate(GRID["ratio"]):
        for j, P in enumerate(GRID["pressure_ratio"]):
            eq = po.length_given_pressure(po.Rod.from_ratio(r), P, throw=False)
            assert whole["status"][i, j] == eq.status
            if eq.certified:
                assert agrees(whole["length_ratio"][i, j], eq, whole["error"][i, j])
                assert max(whole["error"][i, j], whole["certificate"][i, j]) <= 1e-8
                for name in ("pressure_ratio", "beta0", "beta1", "lam", "alpha1", "pressure", "length"):
                    assert whole[name][i, j] == pytest.approx(getattr(eq, name), rel=1e-6, abs=1e-6)
                assert whole["condition"][i, j] == pytest.approx(eq.stats.condition, rel=0.02)
                assert [whole[n][i, j] for n in ("state", "law")] == [eq.state, eq.law]
                assert whole["flags"][i, j] == ", ".join(eq.flags)


def test_points_asked_with_a_method_are_the_single_call_bit_for_bit() -> None:
    found = po.sweep({"ratio": [0.5, 1.0], "pressure_ratio": [0.6, 0.8]}, method="spectral")
    for i, r in enumerate((0.5, 1.0)):
        for j, P in enumerate((0.6, 0.8)):
            eq = po.length_given_pressure(po.Rod.from_ratio(r), P, method="spectral")
            got = [found[n][i, j] for n in ("length_ratio", "alpha1", "error", "certificate", "condition")]
            expected = [eq.length_ratio, eq.alpha1, eq.error, eq.certificate, eq.stats.condition]
            assert [v.hex() for v in got] == [float(v).hex() for v in expected]


def test_failures_are_rows_with_their_reason(whole: po.Sweep) -> None:
    assert 0 < len(whole.failures) == (~whole.certified).sum() < len(whole)
    for row in whole.failures:
        assert row["status"] == "no-equilibrium"
        assert row["message"].startswith("no unfolded equilibrium")
        # What is said to exist does exist.
        po.length_given_pressure(po.Rod.from_ratio(row["ratio"]), row["nearest"] * (1.0 + 1e-9))
    assert np.isnan(whole["length_ratio"][~whole.certified]).all()


def test_si_numbers_groups_and_lists() -> None:
    rod = FLAP
    pressures = [50e3, 60e3]
    found = po.sweep({"adhesion_range": [0.7e-3, 0.73e-3], "pressure": pressures}, rod=rod)
    single = po.length_given_pressure(rod, 60e3)
    assert agrees(found["length"][1, 1], single, found["error"][1, 1], rod.eta)
    assert found["pressure"][1, 1] == 60e3
    assert found.unit("length") == "m"
    assert found["pressure_ratio"][0] == pytest.approx(np.array(pressures) / 140e3, rel=1e-12)
    columns = {"ratio": [0.5, 1.0, 2.0], "length_ratio": [3.5, 3.2, 1.0]}
    listed = po.sweep(columns, zipped=True)
    assert listed.shape == (3,)
    single = po.pressure_given_length(po.Rod.from_ratio(1.0), 3.2)
    assert agrees(listed["pressure_ratio"][1], single, listed["error"][1])
    assert listed["length"][:2].tolist() == [3.5, 3.2]
    assert listed["status"][2] == "no-equilibrium"
    groups = po.sweep({"beta0": 4.0, "lam": [-1.0, 1.0]})
    assert groups["alpha1"][1] == pytest.approx(-4.4354069891, abs=1e-9)
    assert groups["nearest"][0] == pytest.approx(-0.26900108827, abs=1e-6)
    by_beta1 = po.sweep({"beta0": 4.0, "beta1": math.pi**4 + groups["lam"]})
    assert by_beta1["nearest"][0] == pytest.approx(groups["nearest"][0] + math.pi**4, rel=1e-9)


def test_numbers_of_a_rod_known_by_its_ratio_are_in_its_own_units() -> None:
    rod = po.Rod.from_ratio(1.0)
    found = po.sweep({"bending_stiffness": [1.0, 2.0], "pressure": 0.8}, rod=rod)
    units = [found.unit(name) for name in ("bending_stiffness", "pressure", "length")]
    assert units == ["T0 eta^3", "T0", "eta"]
    single = po.Rod(2.0, 1.0, 1.0)
    assert agrees(found["length"][1], po.length_given_pressure(single, 0.8), found["error"][1], single.eta)
    material = {"bending_stiffness": [2.3e-5], "adhesion_strength": 140e3, "adhesion_range": 0.73e-3}
    assert po.sweep(material | {"pressure": 1e5}, rod=rod).unit("length") == "m"


def test_given_ratio_of_an_si_rod_keeps_its_terms() -> None:
    rod = FLAP
    found = po.sweep({"pressure_ratio": [0.1, 0.5]}, rod=rod)
    assert found["nearest"][0] == pytest.approx(po.readhesion_pressure(rod).pressure_ratio, rel=1e-6)
    assert found.asked == "length_ratio"
    single = po.length_given_pressure(rod, rod.pressure(0.5))
    assert agrees(found["length"][1], single, found["error"][1], rod.eta)


@pytest.mark.parametrize(
    ("axes", "named", "words"),
    [
        ({}, {}, "axes must be"),
        ({"ratio": 1.0, "pressure_ratio": 0.5}, {}, "several values"),
        ({"ration": [1.0], "pressure_ratio": [0.5]}, {}, "'ratio'"),
        ({"ratio": [1.0], "pressure": [0.5]}, {}, "takes no other numbers"),
        ({"ratio": [1.0, np.nan], "pressure_ratio": [0.5]}, {}, "finite"),
        ({"ratio": [[1.0]], "pressure_ratio": [0.5]}, {}, "a row of them"),
        ({"ratio": ["1.0", "2.0"], "pressure_ratio": [0.5]}, {}, "must hold numbers"),
        ({"ratio": [True, False], "pressure_ratio": [0.5]}, {}, "must hold numbers"),
        ({"ratio": [10**400], "pressure_ratio": [0.5]}, {}, "must hold numbers"),
        ({"ratio": np.ma.masked_invalid([1.0, np.nan]), "pressure_ratio": [0.5]}, {}, "finite"),
        ({"ratio": [[1.0], [1.0, 2.0]], "pressure_ratio": [0.5]}, {}, "a row of them"),
        ({"pressure": [1.0]}, {"rod": "rod"}, "must be a Rod"),
        (GRID, {"executor": "dask"}, "get_executor"),
        (GRID, {"journal": 3}, "path of a file"),
        ({"ratio": [1.0], "pressure_ratio": [0.5], "length_ratio": [3.0]}, {}, "give one of"),
        ({"beta0": [1.0]}, {}, "beta0 with lam or beta1"),
        ({"pressure": [1.0]}, {}, "the rod lacks"),
        ({"ratio": [1.0, 2.0], "pressure_ratio": [0.5]}, {"zipped": True}, "equally long"),
        (GRID, {"state": "upper"}, "unknown state"),
        (GRID, {"law": "magic"}, "unknown law"),
        (GRID, {"workers": 0}, "whole number"),
        ({"ratio": np.ones(10**4), "pressure_ratio": np.ones(10**4)}, {}, "too large"),
        (GRID, {"tol": -1.0}, "tol"),
        (GRID, {"zipped": "no"}, "zipped must be True or False"),
        (GRID, {"same_bits": None}, "same_bits must be True or False"),
    ],
)
def test_what_cannot_be_meant_is_refused_at_once(axes: Any, named: dict[str, Any], words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        po.sweep(axes, **named)


def test_a_point_that_trips_the_programme_costs_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    from peel_opt.studies.sweep import answers as sweep_answers

    def trips(rod: po.Rod, given: str, value: float, **options: Any) -> po.Equilibrium:
        if (given, value) == ("pressure", 0.6):
            raise ZeroDivisionError("an accident")
        return po.length_given_pressure(rod, value, **options)

    monkeypatch.setattr(sweep_answers, "ask_about", trips)
    found = po.sweep({"ratio": 1.0, "pressure_ratio": [0.5, 0.6, 0.7]}, method="spectral")
    assert found["status"].tolist() == ["certified", "crashed", "certified"]
    assert found["message"][1] == "ZeroDivisionError: an accident"
    assert math.isnan(found["length_ratio"][1])


def test_what_trips_all_together_is_asked_point_by_point(monkeypatch: pytest.MonkeyPatch) -> None:
    from peel_opt.studies.sweep import answers as sweep_answers

    def trips(*_: Any) -> None:
        raise ZeroDivisionError("an accident")

    monkeypatch.setattr(sweep_answers, "answered_together", trips)
    found = po.sweep({"ratio": 1.0, "pressure_ratio": [0.5, 0.6]})
    assert found["status"].tolist() == ["certified", "certified"]


# --- the same bits ------------------------------------------------------------------------


def test_points_of_a_rod_share_a_chunk_and_none_is_lost() -> None:
    axes = {"pressure_ratio": np.linspace(0.5, 0.9, 3), "ratio": np.arange(1.0, 6.0)}
    plan = sweep_plan.Plan.of(axes, None, False, sweep_plan.Options())
    assert sorted(np.concatenate(plan.chunks).tolist()) == list(range(15))
    for chunk in plan.chunks:
        rods = plan.columns["ratio"][chunk]
        assert len(chunk) <= 8
        assert all((plan.columns["ratio"] == r).sum() == (rods == r).sum() for r in set(rods))


def test_threads_and_order_do_not_matter(whole: po.Sweep) -> None:
    with ThreadPoolExecutor(3) as threads:
        assert same(whole, po.sweep(GRID, executor=threads))
    assert same(whole, po.sweep(GRID, executor=Here()))


def test_the_number_of_blas_threads_does_not_matter(whole: po.Sweep) -> None:
    from threadpoolctl import threadpool_limits

    from peel_opt.studies.sweep.answers import arithmetic

    for threads in (1, 2):
        arithmetic.cache_clear()
        with threadpool_limits(threads, user_api="blas"):
            found = po.sweep(GRID, workers=1)
        assert same(whole, found)
        assert found.arithmetic == whole.arithmetic


def test_what_was_asked_before_does_not_matter() -> None:
    # What a message lists used to depend on how far the branch had been walked.
    axes = {"ratio": 1.0, "length_ratio": [5.47, 3.2]}
    fresh = po.sweep(axes)
    po.equilibria(po.Rod.from_ratio(1.0), length=3.2)
    po.trace(po.Rod.from_ratio(1.0), points=10, tol=1e-6)
    assert same(fresh, po.sweep(axes))


def _kill_one_worker_once(journal: Path, others: set[int]) -> threading.Thread:
    def kill() -> None:
        while True:
            if journal.exists() and journal.read_bytes().count(b"\n") > 1:
                for child in _children(os.getpid()):
                    if child not in others:
                        os.kill(child, signal.SIGKILL)
                        return
            time.sleep(0.002)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    return thread


@pytest.mark.slow
@needs_proc
def test_a_killed_worker_of_the_pool_costs_nothing(tmp_path: Path, whole: po.Sweep) -> None:
    journal = tmp_path / "journal"
    killer = _kill_one_worker_once(journal, set(_children(os.getpid())))
    found = po.sweep(GRID, workers=2, journal=journal)
    killer.join(timeout=10.0)
    assert not killer.is_alive()
    assert same(whole, found)
    plan = sweep_plan.Plan.of(GRID, None, False, sweep_plan.Options())
    assert journal.read_bytes().count(b"\n") == 1 + len(plan.chunks)


def test_a_long_sweep_goes_over_to_processes(monkeypatch: pytest.MonkeyPatch, whole: po.Sweep) -> None:
    _go_over_at_once(monkeypatch)
    here: list[int] = []
    answer = sweep_workers.answer_chunk

    def counted(task: sweep_plan.Task) -> ChunkAnswers:
        here.append(task.number)
        return answer(task)

    monkeypatch.setattr(sweep_workers, "Crew", lambda size, options: size)
    monkeypatch.setattr(sweep_workers, "_by_crew", lambda tasks, crew: map(answer, tasks))
    monkeypatch.setattr(sweep_workers, "answer_chunk", counted)
    assert same(whole, po.sweep(GRID))
    assert here == [0]


def _worker_that(monkeypatch: pytest.MonkeyPatch, line: str) -> None:
    """Let workers run a line of Python before they serve."""
    before, served, after = sweep_process._MAIN.partition("worker.serve()")
    assert served
    monkeypatch.setattr(sweep_process, "_MAIN", f"{before}{line}; {served}{after}")


@pytest.mark.slow
def test_workers_that_keep_dying_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep_workers, "MOST_LOSSES", 1)
    _worker_that(
        monkeypatch, "import os; worker._answered = lambda task: (os.write(2, b'Ouch'), os._exit(1))"
    )
    with pytest.raises(po.WorkersLost, match=r"2 times without finishing anything \(Ouch.*16 of 16 chunks"):
        po.sweep({"ratio": [1.0, 2.0], "pressure_ratio": np.linspace(0.5, 0.9, 60)}, workers=2)


@pytest.mark.slow
def test_workers_that_cannot_begin_are_an_error_if_asked_for(
    monkeypatch: pytest.MonkeyPatch, whole: po.Sweep
) -> None:
    _worker_that(monkeypatch, "raise SystemExit('not today')")
    with pytest.raises(po.WorkersLost, match=r"before it began: not today\. Pass workers=1"):
        po.sweep(GRID, workers=2)
    _go_over_at_once(monkeypatch)
    assert same(whole, po.sweep(GRID))


@pytest.mark.parametrize("name", ["frozen", "qgis-bin.exe", "/nowhere/python3"])
def test_a_program_that_is_no_plain_python_is_not_started(
    monkeypatch: pytest.MonkeyPatch, whole: po.Sweep, name: str
) -> None:
    if name == "frozen":
        monkeypatch.setattr(sys, "frozen", True, raising=False)
    else:
        monkeypatch.setattr("multiprocessing.spawn.get_executable", lambda: os.fsencode(name))
    with pytest.raises(po.WorkersLost, match=r"no plain Python.*workers=1|no process can be started here"):
        po.sweep(GRID, workers=2)
    _go_over_at_once(monkeypatch)
    assert same(whole, po.sweep(GRID))


SCRIPT = """\
import numpy as np
import peel_opt as po
from peel_opt.studies.sweep import workers as sweep_workers

print("begins")
sweep_workers.ALONE = sweep_workers.WORTHWHILE = 0.0
sweep_workers.cores = lambda: 2
begin = sweep_workers.Crew.__init__

def counted(crew, *arguments):
    try:
        begin(crew, *arguments)
        print("crew")
    except po.InvalidInput:
        print("no crew")
        raise

def traction(u):
    return 1.0 - u

sweep_workers.Crew.__init__ = counted
axes = {"ratio": np.linspace(1.0, 3.0, 12), "pressure_ratio": np.linspace(0.55, 0.95, 12)}
print(po.sweep(axes, law=LAW).summary())
"""


@pytest.mark.parametrize("by_name", [True, False], ids=["file", "standard input"])
@pytest.mark.parametrize(("law", "crew"), [("'linear'", "crew"), ("po.CohesiveLaw(traction)", "no crew")])
def test_an_unguarded_script_runs_once_and_is_answered(
    tmp_path: Path, by_name: bool, law: str, crew: str
) -> None:
    text = SCRIPT.replace("LAW", law)
    path = tmp_path / "script.py"
    path.write_text(text)
    run = subprocess.run(
        [sys.executable, "-W", "error", str(path) if by_name else "-"],
        cwd=Path(__file__).parents[2],
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])},
        input="" if by_name else text,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (run.stdout.splitlines(), run.stderr) == (["begins", crew, "144 of 144 points certified"], "")
    assert run.returncode == 0


def test_workers_that_round_otherwise_are_an_error(monkeypatch: pytest.MonkeyPatch, whole: po.Sweep) -> None:
    from peel_opt.studies.sweep import answers as sweep_answers

    names = iter(["one"] * 2 + ["other"] * 100)
    monkeypatch.setattr(sweep_answers, "arithmetic", lambda: next(names))
    with pytest.raises(po.WorkersLost, match="do not round alike"):
        po.sweep(GRID, executor=Here())
    assert same(whole, po.sweep(GRID, executor=Here(), same_bits=False))


def test_an_executor_that_takes_no_more_is_an_error_and_what_it_took_is_kept(tmp_path: Path) -> None:
    class Full(Here):
        def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
            if self.asked:
                raise RuntimeError("no more.")
            return super().submit(function, *arguments, **named)

    journal = tmp_path / "journal"
    with pytest.raises(po.WorkersLost, match=r"RuntimeError: no more\. What is finished"):
        po.sweep(GRID, executor=Full(), journal=journal)
    assert journal.read_bytes().count(b"\n") == 2


def test_a_law_that_does_not_travel_is_refused_before_any_process_starts() -> None:
    law = po.CohesiveLaw(lambda u: 1.0 - u, name="mine")
    with pytest.raises(po.InvalidInput, match="cannot be sent"):
        po.sweep(GRID, law=law, workers=2)
    assert po.sweep({"ratio": 1.0, "pressure_ratio": [0.6, 0.8]}, law=law).certified.all()


def _go_over_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep_workers, "ALONE", 0.0)
    monkeypatch.setattr(sweep_workers, "WORTHWHILE", 0.0)
    monkeypatch.setattr(sweep_workers, "cores", lambda: 2)


@pytest.fixture
def _eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep that goes over to processes as soon as it may, and fails the test if it does."""

    def refused(words: Any) -> Any:
        raise AssertionError("a process was started")

    _go_over_at_once(monkeypatch)
    monkeypatch.setattr(sweep_workers, "Worker", refused)


@pytest.mark.usefixtures("_eager")
def test_by_default_what_does_not_travel_stays_here(whole: po.Sweep) -> None:
    with pytest.raises(AssertionError, match="was started"):
        po.sweep(GRID)
    axes = {"ratio": np.linspace(1.0, 3.0, 3), "pressure_ratio": np.linspace(0.6, 0.9, 6)}
    law = po.CohesiveLaw(lambda u: 1.0 - u, name="mine")
    assert same(po.sweep(axes, law=law), po.sweep(axes, law=law, workers=1))


@pytest.mark.usefixtures("_eager")
def test_one_of_several_processes_starts_no_others(monkeypatch: pytest.MonkeyPatch, whole: po.Sweep) -> None:
    monkeypatch.setattr(sweep_workers, "parent_process", lambda: "another")
    assert same(whole, po.sweep(GRID))


# --- the journal --------------------------------------------------------------------------


def test_an_interrupted_sweep_goes_on_where_it_stopped(tmp_path: Path, whole: po.Sweep) -> None:
    journal = tmp_path / "journal"
    first, second = Here(breaks_after=2), Here()
    with pytest.raises(po.WorkersLost, match="out of order"):
        po.sweep(GRID, journal=journal, executor=first)
    found = po.sweep(GRID, journal=journal, executor=second)
    assert same(whole, found)
    assert len(first.asked) == 2
    assert sorted(first.asked + second.asked) == list(range(len(first.asked) + len(second.asked)))
    third = Here()
    assert same(whole, po.sweep(GRID, journal=journal, executor=third))
    assert third.asked == []


def test_a_torn_last_line_is_cut_off_at_any_byte(tmp_path: Path, whole: po.Sweep) -> None:
    journal = tmp_path / "journal"
    po.sweep(GRID, journal=journal)
    content = journal.read_bytes()
    lines = content.splitlines(keepends=True)
    ends = np.cumsum([len(line) for line in lines])
    for cut in (0, 5, int(ends[0]) - 1, int(ends[0]), int(ends[1]) + 7, int(ends[-1]) - 1):
        journal.write_bytes(content[:cut])
        again = Here()
        assert same(whole, po.sweep(GRID, journal=journal, executor=again))
        kept = int((ends[1:] <= cut).sum())
        assert len(again.asked) == len(lines) - 1 - kept
        assert sorted(journal.read_bytes().splitlines()) == sorted(content.splitlines())


@pytest.mark.parametrize(
    "other",
    [
        {"axes": {**GRID, "ratio": GRID["ratio"] * (1.0 + 1e-15)}},
        {"tol": 1e-9},
        {"state": "folded"},
        {"law": "linear"},
        {"method": "spectral"},
    ],
)
def test_the_journal_of_another_sweep_is_refused(tmp_path: Path, other: dict[str, Any]) -> None:
    journal = tmp_path / "journal"
    with pytest.raises(po.WorkersLost):
        po.sweep(GRID, journal=journal, executor=Here(breaks_after=0))
    before = journal.read_bytes()
    with pytest.raises(po.InvalidInput, match="another sweep"):
        po.sweep(**({"axes": GRID, "journal": journal} | other))
    assert journal.read_bytes() == before


def test_laws_of_one_name_are_told_apart(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    axes = {"ratio": 1.0, "pressure_ratio": [0.6, 0.8]}
    po.sweep(axes, law=po.CohesiveLaw(lambda u: 1.0 - u, name="mine"), journal=journal)
    with pytest.raises(po.InvalidInput, match="another sweep"):
        po.sweep(axes, law=po.CohesiveLaw(lambda u: 1.0 - 2.0 * u, name="mine"), journal=journal)


def _tail(c: float, far: float = 3.5) -> po.CohesiveLaw:
    import casadi as ca

    shapes = (lambda u: 1.0 - u / 7.0, lambda u: (1.0 - far / 7.0) * ca.exp(-c * (u - far)))
    return po.CohesiveLaw(shapes, kinks=(far,), name="mine")


def test_laws_of_one_name_are_told_apart_by_their_tails(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    axes = {"ratio": [2.0, 3.0], "length_ratio": [3.0, 3.5]}
    po.sweep(axes, law=_tail(0.3), journal=journal)
    with pytest.raises(po.InvalidInput, match="another sweep"):
        po.sweep(axes, law=_tail(3.0), journal=journal)
    identities = [sweep_plan.Options(law).identity() for law in (_tail(0.3), _tail(0.3), _tail(0.3, 3.6))]
    assert identities[0] == identities[1] != identities[2]


def test_laws_of_one_name_are_told_apart_on_every_piece_and_far_out() -> None:
    def stepped(middle: float, end: float) -> po.CohesiveLaw:
        shapes = (lambda u: 1.0 - u, lambda u: middle + 0.0 * u, lambda u: end / (u + 1.0))
        return po.CohesiveLaw(shapes, kinks=(40.0, 40.5), name="mine")

    def slow(scale: float) -> po.CohesiveLaw:
        return po.CohesiveLaw(
            (lambda u: 1.0 + 0.0 * u, lambda u: 1.0 - scale + 0.0 * u), kinks=(800.0,), name="mine"
        )

    laws = (stepped(0.1, 0.1), stepped(0.2, 0.1), stepped(0.1, 0.2), slow(0.1), slow(0.2))
    found = [repr(sweep_plan.Options(law).identity()) for law in laws]
    assert len(set(found)) == len(laws)


def test_a_law_that_ends_somewhere_is_no_error_of_the_sweep() -> None:
    def ends(u: Any) -> Any:
        if isinstance(u, float) and u > 50.0:
            raise ValueError("not measured")
        return 1.0 - u

    assert len(sweep_plan.Options(po.CohesiveLaw(ends, name="mine")).identity()[1]) > 0


def test_the_journal_of_another_release_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from peel_opt.studies.sweep import journal as sweep_journal

    journal = tmp_path / "journal"
    with monkeypatch.context() as patch:
        for module in (sweep_plan, sweep_journal):
            patch.setattr(module, "__version__", "0.0.1")
        po.sweep(GRID, journal=journal)
    before = journal.read_bytes()
    for named in ({}, {"same_bits": False}):
        with pytest.raises(po.InvalidInput, match=r"another sweep \(.*release 0\.0\.1\)"):
            po.sweep(GRID, journal=journal, **named)
    assert journal.read_bytes() == before


@pytest.mark.parametrize("chunks", [2, 10**9])
def test_a_journal_that_was_rounded_otherwise_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: po.Sweep, chunks: int
) -> None:
    from peel_opt.studies.sweep import answers as sweep_answers

    journal = tmp_path / "journal"
    with monkeypatch.context() as patch, contextlib.suppress(po.WorkersLost):
        patch.setattr(sweep_answers, "arithmetic", lambda: "another")
        po.sweep(GRID, journal=journal, executor=Here(breaks_after=chunks))
    before = journal.read_bytes()
    assert before.count(b"another") > 1
    with pytest.raises(po.WorkersLost, match=r"do not round alike.*name another journal"):
        po.sweep(GRID, journal=journal)
    assert journal.read_bytes() == before
    found = po.sweep(GRID, journal=journal, same_bits=False)
    assert same(whole, found)
    assert "another" in found.arithmetic


@pytest.mark.parametrize("arithmetic", [None, "another machine"])
def test_a_journal_with_a_torn_end_that_is_refused_stays_bit_for_bit(
    tmp_path: Path, arithmetic: str | None
) -> None:
    journal = tmp_path / "journal"
    po.sweep(GRID, journal=journal)
    head, *chunks = journal.read_bytes().splitlines(keepends=True)
    record = json.loads(chunks[0].partition(b" ")[2]) | {"arithmetic": arithmetic}
    text = json.dumps(record, separators=(",", ":")).encode("ascii")
    refused = head + b"%08x %s\n" % (zlib.crc32(text), text) + chunks[0][:40]
    journal.write_bytes(refused)
    with pytest.raises(po.InvalidInput if arithmetic is None else po.WorkersLost):
        po.sweep(GRID, journal=journal)
    assert journal.read_bytes() == refused


def test_files_that_are_no_journal_or_damaged_are_left_alone(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    for content in (b"precious\n", b"precious", b"\x00\xff\n" * 3):
        journal.write_bytes(content)
        with pytest.raises(po.InvalidInput, match="not the journal"):
            po.sweep(GRID, journal=journal)
        assert journal.read_bytes() == content
    journal.unlink()
    po.sweep(GRID, journal=journal)
    content = bytearray(journal.read_bytes())
    content[len(content) // 2] ^= 1
    journal.write_bytes(content)
    with pytest.raises(po.InvalidInput, match="checksum"):
        po.sweep(GRID, journal=journal)
    assert journal.read_bytes() == content
    with pytest.raises(po.InvalidInput, match="cannot open"):
        po.sweep(GRID, journal=tmp_path / "nowhere" / "journal")


def test_a_line_with_a_right_checksum_may_still_be_no_record(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    po.sweep(GRID, journal=journal)
    head, *lines = journal.read_bytes().splitlines(keepends=True)
    for text in (b"{", b"[" * 100_000, b"3", b"{}", b'{"chunk":-1,"numbers":[],"texts":[]}'):
        journal.write_bytes(b"".join([head, b"%08x %s\n" % (zlib.crc32(text), text), *lines]))
        with pytest.raises(po.InvalidInput, match="damaged"):
            po.sweep(GRID, journal=journal)


@pytest.mark.parametrize("name", ["/dev/null", "/dev/full"])
def test_a_device_is_no_journal(name: str) -> None:
    if not Path(name).exists():
        pytest.skip(f"there is no {name}")
    with pytest.raises(po.InvalidInput, match="not a regular file"):
        po.sweep(GRID, journal=name)


def test_two_sweeps_do_not_share_a_journal(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    pytest.importorskip("fcntl")
    plan = sweep_plan.Plan.of(GRID, None, False, sweep_plan.Options())
    from peel_opt.studies.sweep.journal import Journal

    with Journal(journal, plan), pytest.raises(po.InvalidInput, match="another process"):
        po.sweep(GRID, journal=journal)


@pytest.mark.parametrize("stop", [KeyboardInterrupt, MemoryError])
def test_what_stops_in_the_middle_of_a_point_leaves_no_trace_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stop: type[BaseException]
) -> None:
    from peel_opt.studies.sweep import answers as sweep_answers

    journal, asked, ask = tmp_path / "journal", itertools.count(1), sweep_answers.ask

    def stopped(*arguments: Any) -> po.Equilibrium:
        if next(asked) == 20:
            raise stop
        return ask(*arguments)

    monkeypatch.setattr(sweep_answers, "ask", stopped)
    with pytest.raises(stop):
        po.sweep(GRID, workers=1, journal=journal, method="spectral")
    assert journal.read_bytes().count(b"\n") == 1 + 2  # the chunks of 7 points before
    monkeypatch.setattr(sweep_answers, "ask", ask)
    whole = po.sweep(GRID, workers=1, method="spectral")
    assert same(whole, po.sweep(GRID, workers=1, journal=journal, method="spectral"))


# --- processes and signals ----------------------------------------------------------------

COMMAND = ("sweep", "--ratio", "0.5:5:40", "--pressure-ratio", "0.15:0.45:10", "--workers", "2", "--no-plot")


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def interrupted(arguments: tuple[str, ...], out: Path, sent: signal.Signals, lines: int) -> int:
    """Run the command until its journal has so many lines, send a signal, and return the exit code."""
    process = subprocess.Popen(
        [sys.executable, "-m", "peel_opt", *arguments, "--out", str(out)],
        cwd=Path(__file__).parents[2],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    journal = out / "sweep.journal"
    while process.poll() is None:
        if journal.exists() and journal.read_bytes().count(b"\n") >= lines:
            break
        time.sleep(0.005)
    workers = _children(process.pid)
    process.send_signal(sent)
    code = process.wait(timeout=60.0)
    deadline = time.monotonic() + 10.0
    while any(map(_alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(map(_alive, workers))
    return code


@needs_proc
@pytest.mark.parametrize("sent", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_a_stopped_sweep_leaves_a_journal_and_no_orphans(tmp_path: Path, sent: signal.Signals) -> None:
    code = interrupted(COMMAND, tmp_path, sent, lines=2)
    assert code == (130 if sent == signal.SIGINT else -sent)
    before = (tmp_path / "sweep.journal").read_bytes()
    assert 2 <= before.count(b"\n") < 5
    assert not (tmp_path / "sweep.csv").exists()


@pytest.mark.slow
def test_dask_loses_and_repeats_nothing_when_a_worker_dies(
    tmp_path: Path, whole: po.Sweep, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")
    journal = tmp_path / "journal"
    monkeypatch.setattr(sweep_plan, "CHUNK", 8)
    with (
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            dashboard_address=None,
            local_directory=str(tmp_path),
            silence_logs=50,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        pids = list(client.run(os.getpid).values())
        killed = []

        def kill() -> None:
            while not (journal.exists() and journal.read_bytes().count(b"\n") > 1):
                time.sleep(0.002)
            os.kill(pids[0], signal.SIGKILL)
            killed.append(pids[0])

        killer = threading.Thread(target=kill)
        killer.start()
        found = po.sweep(GRID, executor=client.get_executor(), journal=journal)
        killer.join()
    assert killed
    assert same(whole, found)
    assert found.arithmetic == whole.arithmetic
    plan = sweep_plan.Plan.of(GRID, None, False, sweep_plan.Options())
    assert journal.read_bytes().count(b"\n") == 1 + len(plan.chunks)


@pytest.mark.slow
def test_ten_thousand_equilibria_in_several_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments = ("sweep", "--ratio", "0.4:50:100:log", "--pressure-ratio", "0.15:0.95:100", "--no-plot")
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    run = [sys.executable, "-m", "peel_opt", *arguments]
    root = Path(__file__).parents[2]
    subprocess.run([*run, "--workers", "1", "--out", str(whole)], cwd=root, check=False)
    for sent, lines in ((signal.SIGTERM, 20), (signal.SIGKILL, 50), (signal.SIGINT, 75)):
        code = interrupted((*arguments, "--resume"), cut, sent, lines)
        assert code == (130 if sent == signal.SIGINT else -sent)
    subprocess.run([*run, "--resume", "--out", str(cut)], cwd=root, check=False)
    first, second = (po.Sweep.load(folder / "sweep.npz") for folder in (whole, cut))
    assert len(first) == 10_000
    assert same(first, second)
    assert (whole / "sweep.csv").read_bytes() == (cut / "sweep.csv").read_bytes()
    lines = [(folder / "sweep.journal").read_bytes().splitlines() for folder in (whole, cut)]
    assert sorted(lines[0]) == sorted(lines[1])
