"""Every command with the card of a scene: an answer, or one clear line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import peel_opt as po
from peel_opt.app.cards import load_card
from peel_opt.app.cli.main import main

PROBLEMS = Path(__file__).parents[2] / "problems"
STREAM, TEAR, FLAP = (PROBLEMS / f"{name}.toml" for name in ("tape_in_stream", "aortic_tear", "aortic_flap"))


def said(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    code = main([str(part) for part in arguments])
    out, err = capsys.readouterr()
    return code, out, err


@pytest.mark.parametrize(
    "arguments",
    [
        ("flaw", "--card", STREAM, "--pressure", "20 kPa"),
        ("history", STREAM),
        ("calibrate", STREAM),
        ("peel", "--card", STREAM, "--angle", "90 deg"),
        ("tradeoff", "--card", STREAM, "--ratio", "1"),
        ("uncertainty", "--card", STREAM, "--spread", "unbonded=+- 10 %"),
        ("uncertainty", "--card", STREAM, "--spread", "weight=+- 10 %", "--pressure", "20 kPa"),
        ("uncertainty", "--card", FLAP, "--spread", "unbonded=+- 10 %", "--pressure", "20 kPa"),
        ("solve", "--card", STREAM, "--free", "weight", "--length", "1 mm"),
    ],
    ids=lambda arguments: " ".join(str(part) for part in arguments[::3]),
)
def test_what_a_command_does_not_take_of_a_scene_is_one_line(
    arguments: tuple[object, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, err = said(capsys, *arguments)
    assert code == 2
    assert not out
    assert err.startswith("peel-opt: ")
    assert err.count("\n") == 1


@pytest.mark.slow
def test_numbers_of_a_scene_are_uncertain(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    spreads = ("--spread", "unbonded=0.5 mm +- 5 %", "--spread", "share=0.002 .. 0.006", "--T0", "+- 10 %")
    size = ("--samples", 2, "--no-indices", "--workers", 1)
    code, out, _ = said(
        capsys, "uncertainty", "--card", STREAM, "--pressure", "20 kPa", *spreads, *size, "--json"
    )
    assert code == 0
    found = json.loads(out)
    scene = load_card(STREAM).scene()
    assert scene is not None
    wide = {"unbonded": "5 %", "share": (0.002, 0.006), "adhesion_strength": "10 %"}
    own = po.uncertainty(scene, wide, pressure=20e3, samples=2, indices=False, workers=1)
    assert found == json.loads(json.dumps(own.record()))


@pytest.mark.slow
def test_methods_are_compared_on_a_scene(capsys: pytest.CaptureFixture[str]) -> None:
    """What knows the paper's scene only keeps its row, with the reason."""
    code, out, err = said(capsys, "tradeoff", "--card", TEAR, "--repeats", 1, "--tols", "1e-7", "--json")
    assert code == 0
    assert err.count("left out") == 2  # the questions about flaws
    (table,) = json.loads(out)["tables"]
    status = {row["method"]: row["status"] for row in table["rows"]}
    assert {name for name, word in status.items() if word == "certified"} == {
        "spectral",
        "collocation",
        "shooting",
    }
    assert "paper's scene" in status["solve_bvp"]
    assert all(row["evaluations"] > 0 for row in table["rows"] if row["status"] == "certified")
    assert all(row["true_error"] < 1e-7 for row in table["rows"] if row["status"] == "certified")


@pytest.mark.slow
def test_a_flaw_is_asked_of_the_card_of_an_edge_without_glue(capsys: pytest.CaptureFixture[str]) -> None:
    _, own, _ = said(capsys, "flaw", "--card", TEAR, "--flaw", "0.5 mm", "--json")
    (answer,) = json.loads(own)["answers"]
    rod = load_card(TEAR).rod()
    assert rod is not None
    assert answer["pressure [Pa]"] == po.safe_pressure(rod, flaw=0.5e-3).pressure
