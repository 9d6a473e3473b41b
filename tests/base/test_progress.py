"""Progress: bars for people at a terminal, calls for programs, and nothing where nobody can see it."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import peel_opt as po
from peel_opt.base.progress import progress
from peel_opt.plots import figures

from ..rods import FLAP

GRID = {"ratio": [0.5, 1.0], "pressure_ratio": [0.6, 0.8]}


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Pane:
    """An object that a program with windows puts in the place of stderr."""

    def write(self, text: str) -> None:
        raise AssertionError(text)


def _closed() -> io.StringIO:
    stream = io.StringIO()
    stream.close()
    return stream


def test_a_terminal_shows_a_bar_after_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with progress("rod", 3) as step:
        step()
    assert terminal.getvalue() == ""
    monkeypatch.setattr("peel_opt.base.progress.PATIENCE", 0.0)
    with progress("rod", 3) as step:
        step(2)
    assert "0/3" in terminal.getvalue()
    shown = terminal.getvalue()
    with progress("rod", 3, False) as step:
        step(2)
    assert terminal.getvalue() == shown


@pytest.mark.parametrize(
    "stream",
    [None, pytest.param(Pane(), marks=pytest.mark.slow), pytest.param(_closed(), marks=pytest.mark.slow)],
    ids=["none", "pane", "closed"],
)
def test_long_work_needs_no_stderr(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, stream: Any) -> None:
    monkeypatch.setattr("sys.stderr", stream)
    assert po.sweep(GRID).certified.all()
    assert po.uncertainty(FLAP, {"adhesion_strength": "5 %"}, pressure=1e5, samples=2)["length"].sd > 0.0
    asked = partial(po.length_given_pressure, FLAP, 1e5)
    assert po.tradeoff(asked, ["spectral"], [1e-6], repeats=1).rows[0].status == "certified"
    data = po.Measurements([1.74e-3], [100e3], pressure_sd=500.0)
    known = {"bending_stiffness": 2.3e-5, "adhesion_range": 0.73e-3}
    assert po.calibrate(data, free=("adhesion_strength",), rod=known).rod.adhesion_strength > 100e3
    assert figures.make(["4"], tmp_path, formats=("svg",))


def test_there_is_one_place_that_asks_who_is_watching() -> None:
    modules = Path(po.__file__).parent.rglob("*.py")
    words = re.compile(r"\bimport tqdm|from tqdm|isatty\(")
    asking = [path.name for path in modules if words.search(path.read_text(encoding="utf-8"))]
    assert asking == ["progress.py"]


def test_a_program_is_told_how_far_its_sweep_is() -> None:
    told: list[tuple[int, int | None]] = []
    po.sweep(GRID, progress=lambda done, total: told.append((done, total)))
    assert told[0] == (0, 4)
    assert told[-1] == (4, 4)
    with pytest.raises(po.InvalidInput, match="progress must be None, False or a function"):
        po.sweep(GRID, progress="yes")  # type: ignore[arg-type]


@pytest.mark.skipif(os.name != "posix", reason="closes a file by the shell")
def test_a_command_without_stderr_answers_and_keeps_its_errors_out_of_the_result() -> None:
    command = f"{sys.executable} -m peel_opt sweep --ratio 0.5,1.0 --pressure-ratio 0.01,0.8 --json 2>&-"
    root = Path(__file__).parents[2]
    run = subprocess.run(command, shell=True, cwd=root, stdout=subprocess.PIPE, check=False)
    assert json.loads(run.stdout)["summary"] == "2 of 4 points certified, 2 no-equilibrium"
    assert run.returncode == 1
    wrong = f"{sys.executable} -m peel_opt sweep --nothing --json 2>&-"
    run = subprocess.run(wrong, shell=True, cwd=root, stdout=subprocess.PIPE, check=False)
    assert (run.stdout, run.returncode) == (b"", 2)
