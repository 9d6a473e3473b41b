"""``peel-opt hysteresis`` prints what `hysteresis` finds, and writes files that hold it."""

import csv
import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import peel_opt as po
from peel_opt.app.cli.main import main

REAL_ROD = ["--k", "23 uN m", "--T0", "140 kPa", "--y0", "0.73 mm"]


def asked(capsys, *arguments):
    code = main(["hysteresis", *arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_a_loop_in_lambda_prints_its_jumps_and_area(capsys):
    code, out, err = asked(capsys, "--beta0", "4", "--points", "9")
    assert (code, err) == (0, "")
    assert "down  re-adheres  -0.2690010883  -1.394282025" in out
    assert "area: 0.624880" in out
    assert "not computed" in out


def test_json_is_what_the_library_finds(capsys):
    loop = po.hysteresis(beta0=2.0, points=7)
    code, out, _ = asked(capsys, "--beta0", "2", "--points", "7", "--json")
    document = json.loads(out)
    assert code == 0
    assert document["area"] == loop.area
    assert [jump["lam"] for jump in document["jumps"]] == [jump.lam for jump in loop.jumps]
    assert document["error"] < 1e-10


def test_a_rods_loop_has_units_in_every_number(capsys):
    code, out, _ = asked(capsys, *REAL_ROD, "--points", "5")
    assert code == 0
    for words in ("down  re-adheres  25.94", "kPa", " mm", "Pa m = ", "T0 eta"):
        assert words in out
    document = json.loads(asked(capsys, *REAL_ROD, "--points", "5", "--json")[1])
    down = document["jumps"][1]
    assert down["pressure [Pa]"] == pytest.approx(25942.4, abs=0.1)
    assert down["pressure_ratio"] * 140e3 == pytest.approx(down["pressure [Pa]"], rel=1e-12)
    assert document["area [Pa m]"] == pytest.approx(251.1, abs=0.5)


@pytest.mark.parametrize(
    ("form", "convention", "jump"),
    [("paper", "maxwell", -0.2363), ("paper", "delay", -0.2658), ("exact", "delay", -0.26824)],
)
def test_a_normal_form_can_take_the_place_of_the_solver(form, convention, jump, capsys):
    arguments = ("--beta0", "4", "--form", form, "--convention", convention, "--json")
    document = json.loads(asked(capsys, *arguments)[1])
    assert document["source"] == form
    assert document["jumps"][1]["lam"] == pytest.approx(jump, abs=5e-5)
    assert document["error"] is None
    assert (document["area"] == 0.0) == (convention == "maxwell")


def test_without_a_jump_the_table_says_so(capsys):
    assert "no jumps" in asked(capsys, "--beta0", "0", "--points", "5")[1]


@pytest.mark.parametrize("arguments", [("--beta0", "4"), tuple(REAL_ROD)], ids=["beta0", "rod"])
def test_files_hold_every_state(arguments, capsys, tmp_path):
    code, _, err = asked(capsys, *arguments, "--points", "5", "--out", str(tmp_path / "new"))
    assert (code, err) == (0, "")
    files = {path.suffix: path for path in (tmp_path / "new").iterdir()}
    assert set(files) == {".npz", ".csv", ".png", ".json"}
    with np.load(files[".npz"], allow_pickle=False) as stored:
        columns = {name: stored[name] for name in stored.files if name != "metadata"}
        head = json.loads(str(stored["metadata"]))
    assert head["schema"] == "peel_opt hysteresis"
    lines = [line for line in files[".csv"].read_text(encoding="ascii").splitlines() if line[0] != "#"]
    rows = list(csv.DictReader(lines))
    assert list(rows[0]) == list(columns)
    swept = "lam" if arguments[0] == "--beta0" else "pressure [Pa]"
    assert [float(row[swept]) for row in rows] == columns[swept].tolist()
    # A jump is two rows of one leg at one value of what is swept.
    for jump in head["jumps"]:
        leg = columns["leg"] == jump["direction"]
        assert (columns[swept][leg] == jump[swept]).sum() == 2
    assert (columns["state"] == "adhered").any()


def test_without_pictures_there_is_none(capsys, tmp_path):
    asked(capsys, "--beta0", "4", "--form", "exact", "--no-plot", "--out", str(tmp_path))
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".csv", ".json", ".npz"]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ((), 2, "give either --beta0, or a rod"),
        (("--beta0", "4", "--ratio", "1"), 2, "give either --beta0, or a rod"),
        (("--ratio", "1", "--lam", "-1", "1"), 2, "--lam goes with a fixed --beta0"),
        (("--ratio", "1", "--form", "paper"), 2, "no normal form"),
        (("--ratio", "1", "--convention", "maxwell"), 2, "delay convention"),
        (("--beta0", "4", "--lam", "0", "1"), 2, "does not hold the loop"),
        (("--beta0", "4", "--points", "1"), 2, "points must be"),
        (("--beta0", "4", "--form", "own"), 2, "invalid choice"),
        (("--beta0", "4", "--form", "paper", "--tol", "1e-6"), 2, "--tol is about solved states"),
        (("--beta0", "40"), 1, "no fold in lambda"),
    ],
)
def test_what_cannot_be_swept_is_said(arguments, code, words, capsys):
    found, out, err = asked(capsys, *arguments)
    assert (found, out) == (code, "")
    assert words in err


def test_a_branch_that_stalls_is_not_a_whole_one(capsys, monkeypatch):
    from peel_opt.equilibria import trace as tracing

    branch = tracing.trace(beta0=4.0, lam=(-1.0, 1.0), points=8)
    for ended, code in (("window", 0), ("stalled", 1)):
        monkeypatch.setattr(tracing, "trace", lambda ended=ended, **_: replace(branch, ended=ended))
        assert main(["trace", "--beta0", "4"]) == code
        out, err = capsys.readouterr()
        assert f"ended: {ended}" in out
        assert ("goes on" in err) == bool(code)


def test_python_dash_m_is_the_command_line():
    run = [sys.executable, "-m", "peel_opt", "--version"]
    done = subprocess.run(run, capture_output=True, text=True, check=True)
    assert done.stdout == f"peel-opt {po.__version__}\n"
