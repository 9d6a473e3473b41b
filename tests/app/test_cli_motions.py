"""``peel-opt snap`` and ``history``: asked of a card or of numbers, printed, written and filmed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import peel_opt as po
from peel_opt.app.cards import load_card
from peel_opt.app.cli.main import main
from peel_opt.app.motion_report import history_table

CARDS = Path(__file__).parents[2] / "problems"

SHORT = ["--ratio", "0.3", "--pressure", "0.9", "--until", "contact", "--rod-length", "3.76"]


def test_a_card_says_what_happens_and_that_drag_sets_the_time(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["snap", str(CARDS / "aortic_flap.toml"), "--rod-length", "2.2 mm"]) == 0
    said = capsys.readouterr().out
    assert "end of rod" in said
    assert "2.20000 mm" in said
    assert "Drag sets the time" in said


def test_numbers_of_a_card_may_say_what_resists(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (CARDS / "aortic_flap.toml").read_text(encoding="utf-8")
    text = text.replace("[sources]", 'mass_per_area = "2.7 kg/m^2"\ndrag = "20 kPa s/m"\n\n[sources]')
    text = text.replace("[estimates]", '[estimates]\nmass_per_area = "with the blood"\ndrag = "a guess"')
    card = tmp_path / "flap.toml"
    card.write_text(text, encoding="utf-8")
    assert main(["snap", str(card), "--until", "1 ms", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["pressure [Pa]"] == pytest.approx(300 * 133.322387415)
    assert record["events"][-1]["t [s]"] == pytest.approx(1e-3)
    assert record["outcome"] == "not settled"
    assert main(["length", "--card", str(card), "--pressure", "300 mmHg"]) == 0  # a state needs neither


@pytest.mark.slow
def test_files_and_a_film(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["snap", *SHORT, "--out", str(tmp_path), "--film"]) == 0
    assert "snap.gif" in capsys.readouterr().out
    moved = po.Snap.load(tmp_path / "snap.npz")
    assert moved.outcome == "end of rod"
    assert {path.name for path in tmp_path.iterdir()} >= {"snap.csv", "snap.png", "snap.gif"}


@pytest.mark.parametrize(
    ("wrong", "code", "says"),
    [
        (["--ratio", "0.3"], 2, "pressure"),
        (["--ratio", "0.3", "--pressure", "1.2"], 1, "fails everywhere"),
        (["--ratio", "0.3", "--pressure", "0.9", "--drag", "-1"], 2, "drag"),
        (["--ratio", "0.3", "--pressure", "0.9", "--film"], 2, "--out"),
        (["--ratio", "0.3", "--pressure", "0.9", "--until", "soon"], 2, "until"),
    ],
)
def test_what_cannot_be_meant(
    wrong: list[str], code: int, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["snap", *wrong]) == code
    assert says in capsys.readouterr().err


#: What `written` adds to the card of the aortic flap, and where.
HISTORY = """
[history]
times = ["0 s", "1 ms", "2 ms"]
pressures = ["300 mmHg", "0.3 T0", "35 kPa"]
bond = "no_rebond"

[sources]"""


def written(folder: Path, *changes: tuple[str, str]) -> str:
    text = (CARDS / "aortic_flap.toml").read_text(encoding="utf-8")
    given = ("[sources]", f'drag = "20 kPa s/m"\n{HISTORY}'), ("[estimates]", '[estimates]\ndrag = "a guess"')
    for old, new in (*given, *changes):
        assert old in text
        text = text.replace(old, new)
    path = folder / "flap.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_a_card_tells_a_history_in_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["history", written(tmp_path), "--json", "--out", str(out)]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["t [s]"] == pytest.approx(2e-3)
    assert record["pressure [Pa]"] == pytest.approx(35e3)
    assert record["outcome"] == "not settled"
    run = po.History.load(out / "history-flap.npz")
    assert run.pressure[0] == pytest.approx(300 * 133.322387415)
    assert max(run.pressure) == pytest.approx(0.3 * 140.1e3, rel=1e-3)
    assert record["length [m]"] == run.front[-1]
    assert record["dissipated [J/m]"] == run.dissipated[-1]
    assert {path.name for path in out.iterdir()} >= {"history-flap.csv", "history-flap.png"}
    assert main(["history", written(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "300" not in said.splitlines()[0]
    assert "2.00000 ms" in said
    assert "35.0000 kPa" in said
    assert "no_rebond bond, not settled" in said


@pytest.mark.parametrize(
    ("change", "code", "says"),
    [
        (('"1 ms"', '"1 mm"'), 2, "[history]: times no. 2 cannot be measured in 'mm'"),
        (('"35 kPa"', '"350 kPa"'), 1, "between 0 and T0"),
        (('"35 kPa"]', '"35 kPa", "1 kPa"]'), 2, "go in pairs"),
        (('"no_rebond"', '"glue"'), 2, "bond in [history]"),
        (("[history]", "[histories]"), 2, "did you mean 'history'?"),
    ],
)
def test_what_a_history_cannot_mean_is_one_line(
    change: tuple[str, str], code: int, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["history", written(tmp_path, change)]) == code
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


def torn(folder: Path, *changes: tuple[str, str]) -> str:
    """Return the card of the tear with a short history, changed."""
    text = (CARDS / "aortic_tear.toml").read_text(encoding="utf-8")
    given = ("[0, 800, 850, 1650] ", "[0, 2]"), ('["0 Pa", "70 kPa", "70 kPa", "0 Pa"]', '["0 Pa", "3 kPa"]')
    for old, new in (*given, *changes):
        assert old in text
        text = text.replace(old, new)
    path = folder / "tear.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_the_card_of_a_scene_tells_its_history(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("peel_opt.motion.history.STEPS", 20)
    out = tmp_path / "out"
    assert main(["history", torn(tmp_path), "--json", "--out", str(out), "--no-plot"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["scene"] == "unbonded = 500.000 um"
    assert record["length [m]"] >= 5e-4
    assert record["time_error [c eta/T0]"] == 0.0  # no angle was passed
    run = po.History.load(out / "history-tear.npz")
    assert run.scene == load_card(tmp_path / "tear.toml").scene()
    assert "scene: unbonded = 500.000 um" in history_table(run)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            ('unbonded = "0.5 mm"', 'unbonded = "0.5 mm"\nline_energy = "5 J/m^2"'),
            "a front with a line energy",
        ),
        (('bond = "damage"', 'bond = "damage"\nlaw = "linear"'), "its own law"),
    ],
)
def test_a_history_that_is_not_computed_of_a_scene_is_one_line(
    change: tuple[str, str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["history", torn(tmp_path, change)]) == 2
    error = capsys.readouterr().err
    assert "[history]: " in error
    assert says in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("card", "code", "says"),
    [
        pytest.param(
            "tape_in_stream", 1, "the pressure is too low. It is lifted there", marks=pytest.mark.slow
        ),
        ("paint_blister", 2, "the middle of a strip is not computed"),
    ],
)
def test_a_scene_that_does_not_snap_says_so_in_one_line(
    card: str, code: int, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["snap", str(CARDS / f"{card}.toml")]) == code
    out, error = capsys.readouterr()
    assert not out
    assert says in error
    assert error.count("\n") == 1


@pytest.mark.slow
def test_the_card_of_a_tear_snaps(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["snap", str(CARDS / "aortic_tear.toml"), "--until", "5"]) == 0
    said = capsys.readouterr().out
    assert "scene: unbonded = 500.000 um" in said
    assert "2.50751 mm" in said  # its unfolded state at 200 mmHg


def test_a_card_without_a_history_says_how_to_add_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["history", str(CARDS / "aortic_flap.toml")]) == 2
    assert "times = [0, 60, 200]" in capsys.readouterr().err
