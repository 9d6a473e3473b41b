"""What engineers of the trades type: flaws, peel tests, rods of a sheet, units, limits in their words.

Modules: `flaws`, `peels`, `flaw_report`, `peel_report`, `common`.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

import peel_opt as po

from .calling import Call

PROBLEMS = Path(__file__).parents[2] / "problems"
FLAP = ["--k", "23 uN m", "--T0", "140 kPa", "--y0", "0.73 mm"]
SHEET = ["--E", "1.5 GPa", "--thickness", "40 um", "--nu", "0.4"]
TAPE = [*SHEET, "--T0", "0.5 MPa", "--work", "100 J/m^2"]

#: What a millimetre of mercury is [Pa].
MMHG = 133.322387415


# --- rods of a sheet ----------------------------------------------------------------------


def test_a_sheet_and_its_numbers_are_the_same_rod(call: Call) -> None:
    card = ["--card", PROBLEMS / "office_tape.toml"]
    bonds = (["--y0", "0.4 mm", "--work", "100 J/m^2"], ["--T0", "0.5 MPa", "--y0", "0.4 mm"])
    ways = (TAPE, card, *([*SHEET, *bond] for bond in bonds))
    found = [json.loads(call("length", "--pressure", "0.2 MPa", *rod, "--json")[1]) for rod in ways]
    assert [f["length [m]"] for f in found] == pytest.approx([found[1]["length [m]"]] * 4, rel=1e-12)


@pytest.mark.parametrize(
    ("rod", "words"),
    [
        (["--E", "1 GPa", "--T0", "1 kPa", "--y0", "1 mm"], "a rod needs --thickness and --nu too"),
        (["--T0", "1 kPa", "--work", "1 J/m^2"], "a rod needs --k too"),
        ([*SHEET, "--T0", "1 kPa"], "a rod needs --y0 too"),
        ([*SHEET, "--k", "1 N m", "--T0", "1 kPa", "--y0", "1 mm"], "--k is given, and --E and --thickness"),
        ([*TAPE, "--y0", "1 mm"], "two of them say the third"),
        ([*TAPE, "--ratio", "1"], "or by --ratio"),
        (["--E", "1,5 GPa", *TAPE[2:]], "--E has a decimal comma, got '1,5'. Write 1.5."),
        ([*SHEET, "--T0", "1 kPa", "--work", "5 oz/in"], "'oz' is a mass. Its weight is 'ozf'"),
        (["--E", "1 GPa", "--thickness", "1 mil", "--nu", "0.7", *TAPE[6:]], "poisson_ratio must lie"),
    ],
)
def test_what_a_rod_lacks_is_said_by_its_options(call: Call, rod: list[str], words: str) -> None:
    code, out, err = call("length", "--pressure", "60 kPa", *rod)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err


# --- limits in the words of the trade -----------------------------------------------------


@pytest.mark.parametrize(
    ("question", "words"),
    [
        (
            ["length", "--pressure", "100 mmHg"],
            "100 mmHg. Below 194.58396 mmHg every lifted edge closes.",
        ),
        (["length", "--pressure", "2 bar"], "at pressure 2 bar. From 1.4 bar on the bond itself fails."),
        (["length", "--pressure", "1.4 bar"], "at pressure 1.4 bar. From 1.4 bar on the bond itself fails."),
        (
            ["length", "--pressure", "25.942398 kPa"],
            "25.942398 kPa. Below 25.94239804 kPa every lifted edge",
        ),
        (["pressure", "--length", "1 mm"], "at length 1 mm. None is shorter than 1.7341727 mm."),
        (["pressure", "--length", "1 cm"], "at length 1 cm. None is longer than 0.26222249 cm."),
        (["pressure", "--length", "1e19 mm"], "at length 1e+19 mm. None is longer than 2.6222249 mm."),
        (
            ["flaw", "--pressure", "2 bar"],
            "critical at 2 bar: from T0 = 1.4 bar on every edge snaps.",
        ),
    ],
)
def test_what_is_out_of_range_is_said_in_words_and_in_the_unit_typed(
    call: Call, question: list[str], words: str
) -> None:
    code, out, err = call(*question, *FLAP)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert words in err
    assert " Pa" not in err
    assert " m " not in err


def test_the_least_pressure_is_that_of_the_library() -> None:
    rod = po.Rod("23 uN m", "140 kPa", "0.73 mm")
    assert po.readhesion_pressure(rod).pressure / MMHG == pytest.approx(194.58396, rel=1e-7)


# --- units that are asked for -------------------------------------------------------------


def test_answers_are_printed_in_the_units_asked_for(call: Call) -> None:
    expected = po.length_given_pressure(po.Rod("23 uN m", "140 kPa", "0.73 mm"), 60e3)
    code, out, err = call("length", "--pressure", "60 kPa", *FLAP, "--units", "mmHg, mil")
    assert (code, err) == (0, "")
    pressure, length = (re.search(rf"  {n} +([\d.]+) (\w+)\n", out) for n in ("pressure", "length"))
    assert pressure is not None
    assert length is not None
    assert (pressure[2], length[2]) == ("mmHg", "mil")
    assert float(pressure[1]) * MMHG == pytest.approx(60e3, rel=1e-7)
    assert float(length[1]) * 25.4e-6 == pytest.approx(expected.length, rel=1e-7)


def test_cards_are_printed_in_the_units_asked_for(call: Call) -> None:
    code, out, _ = call("run", PROBLEMS / "aortic_flap.toml", "--units", "mmHg,um")
    assert code == 0
    assert " mmHg" in out
    assert " kPa" not in out.split("question", 1)[1].replace("at 60 kPa", "")


@pytest.mark.parametrize(
    ("units", "words"),
    [("mm,A", "cannot be measured in 'A'"), ("mmHG", "did you mean 'mmHg'"), ("mm,5 kPa", "cannot be read")],
)
def test_units_that_are_none_are_named(call: Call, units: str, words: str) -> None:
    code, out, err = call("length", "--pressure", "60 kPa", *FLAP, "--units", units)
    assert (code, out) == (2, "")
    assert words in err


def test_a_document_keeps_its_units(call: Call) -> None:
    code, out, err = call("length", "--pressure", "60 kPa", *FLAP, "--units", "mmHg", "--json")
    assert (code, out) == (2, "")
    assert "--json has its own" in err


# --- flaws --------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_critical_flaw_and_the_safe_pressure_are_each_others_inverse(call: Call) -> None:
    code, out, _ = call("flaw", "--pressure", "450 mmHg", *FLAP, "--json")
    assert code == 0
    found = json.loads(out)
    flaw = found["answers"][0]["flaw [m]"]
    back = json.loads(call("flaw", "--flaw", f"{flaw!r} m", *FLAP, "--json")[1])
    assert back["answers"][0]["pressure [Pa]"] == pytest.approx(450 * MMHG, rel=1e-9)
    least = po.readhesion_pressure(po.Rod("23 uN m", "140 kPa", "0.73 mm"))
    assert found["readhesion"]["pressure [Pa]"] == pytest.approx(least.pressure, rel=1e-12)


def test_a_flaw_is_answered_in_a_sentence(call: Call) -> None:
    code, out, err = call("flaw", "--flaw", "0.5 mm", *FLAP, "--units", "kPa,mm")
    assert (code, err) == (0, "")
    assert "an edge without glue on 0.50000000 mm snaps at 56.243490 kPa; a shorter one holds" in out
    assert "below p_min = 25.942398 kPa every lifted edge closes" in out


@pytest.mark.slow
def test_a_chart_of_flaws_is_written_and_that_of_another_rod_stays(call: Call, tmp_path: Path) -> None:
    card = PROBLEMS / "aortic_flap.toml"
    code, out, _ = call("flaw", "--flaw", "0.3 mm", "--card", card, "--out", tmp_path)
    assert code == 0
    assert f"wrote to {tmp_path}: flaw-aortic-flap.npz, flaw-aortic-flap.csv, flaw-aortic-flap.png, " in out
    lines = (tmp_path / "flaw-aortic-flap-chart.csv").read_text().splitlines()
    pressures = [float(line.split(",")[0]) for line in lines[1:]]
    assert lines[0].startswith("pressure [Pa],flaw [m]")
    assert len(pressures) >= 5
    assert pressures == sorted(pressures, reverse=True)
    assert (tmp_path / "flaw-aortic-flap-chart.png").stat().st_size > 10_000
    before = (tmp_path / "flaw-aortic-flap.csv").read_bytes()
    code, out, err = call("flaw", "--flaw", "0.4 mm", "--card", card, "--out", tmp_path)
    assert (code, out) == (2, "")
    assert "--force" in err
    assert (tmp_path / "flaw-aortic-flap.csv").read_bytes() == before


# --- peel tests ---------------------------------------------------------------------------


@pytest.mark.parametrize(("angle", "factor"), [("90 deg", 1.0), ("180 deg", 2.0), ("60 deg", 0.5)])
def test_force_and_work_go_back_and_forth(call: Call, angle: str, factor: float) -> None:
    found = json.loads(call("peel", "--pull", "6 N/25 mm", "--angle", angle, "--json")[1])
    assert found["work [J/m^2]"] == pytest.approx(240.0 * factor, rel=1e-13)
    back = json.loads(call("peel", "--work", f"{240 * factor} J/m^2", "--angle", angle, "--json")[1])
    assert back["force [N/m]"] == pytest.approx(240.0, rel=1e-13)


def test_a_peel_is_said_with_its_factor_and_in_units(call: Call) -> None:
    code, out, err = call("peel", "--pull", "50 ozf/in", "--angle", "180 deg", "--units", "ozf/in")
    assert (code, err) == (0, "")
    assert "1 - cos 180 deg = 2" in out
    assert "100.00000 ozf/in" in out


def test_a_short_arm_begins_with_more_than_the_steady_force(call: Call, tmp_path: Path) -> None:
    code, out, err = call("peel", *TAPE, "--angle", "90 deg", "--json", "--out", tmp_path)
    assert code == 0
    found = json.loads(out)
    rod = po.Rod.from_sheet("1.5 GPa", "40 um", 0.4, "0.5 MPa", "100 J/m^2")
    peak = po.initiation_force(rod, math.pi / 2.0)
    assert found["long_arm_force [N/m]"] == pytest.approx(100.0, rel=1e-12)
    assert found["initiation"]["force [N/m]"] == pytest.approx(peak.force, rel=1e-12)
    assert "peel.npz, peel.csv, peel.png" in err
    state = po.Equilibrium.load(tmp_path / "peel.npz")
    assert state.length == pytest.approx(peak.length, rel=1e-9)


def test_pulled_back_over_itself_a_flat_rod_stays_flat(call: Call) -> None:
    code, out, _ = call("peel", *TAPE, "--angle", "180 deg")
    assert code == 0
    assert "50.000000 N/m, 1 - cos 180 deg = 2" in out
    assert "pulled in line the flat rod stays flat" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--pull", "5 oz/in", "--angle", "180 deg"], "'oz' is a mass. Its weight is 'ozf'"),
        (["--pull", "5 N", "--angle", "180 deg"], "--pull cannot be measured in 'N'"),
        (["--pull", "5 N/in", "--angle", "180"], "--angle needs a unit"),
        (["--pull", "5 N/in", "--angle", "200 deg"], "up to pi"),
        (["--pull", "5 N/in", "--work", "1 J/m^2", "--angle", "90 deg"], "--pull asks for the work"),
        (["--work", "1 J/m^2", "--angle", "90 deg", "--arm", "1 mm"], "needs a rod"),
        (["--angle", "90 deg"], "give the rod by"),
    ],
)
def test_what_a_peel_cannot_mean_is_one_line(call: Call, arguments: list[str], words: str) -> None:
    code, out, err = call("peel", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err


# --- what was written ---------------------------------------------------------------------


def test_a_long_list_of_files_is_a_count(call: Call, tmp_path: Path) -> None:
    cards = [PROBLEMS / "office_tape.toml", PROBLEMS / "aortic_flap.toml"]
    code, out, _ = call("run", *cards, "--out", tmp_path, "--no-plot")
    assert code == 0
    said = out.splitlines()[-1]
    written = [path for path in tmp_path.iterdir() if path.name != "written.json"]
    assert re.fullmatch(rf"wrote to {re.escape(str(tmp_path))}: {len(written)} files, \S+ to \S+", said)
