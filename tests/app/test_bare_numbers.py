"""Numbers of a card without a unit are in SI, and the report says so."""

from __future__ import annotations

from pathlib import Path

import pytest

import peel_opt as po
from peel_opt.app.cli.main import main

CARD = """\
title = "a tape"
source = "measured"
[rod]
bending_stiffness = 2.3e-5
adhesion_strength = "140 kPa"
adhesion_range = 0.73e-3
[[questions]]
pressure = 100000
tol = 1e-6
[[questions]]
length = "1.9 mm"
"""


def test_the_heading_lists_them_with_their_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "tape.toml"
    path.write_text(CARD)
    assert main(["run", str(path)]) == 0
    wanted = "bending_stiffness = 2.3e-05 N m, adhesion_range = 0.00073 m, pressure = 100000 Pa"
    assert capsys.readouterr().out.count(f"numbers without a unit are in SI: {wanted}\n") == 1
    assert po.load_card(path).bare == tuple(wanted.split(", "))


def test_numbers_of_scenes_have_units_too_and_ratios_none(tmp_path: Path) -> None:
    path = tmp_path / "card.toml"
    path.write_text(CARD + "[scene]\nweight = 20.0\nunbonded = 1e-4\ntilt = '10 deg'\n")
    assert {"weight = 20 Pa", "unbonded = 0.0001 m"} < set(po.load_card(path).bare)
    path.write_text('title = "r"\n[rod]\nratio = 1.0\n[[questions]]\npressure = 0.7\n')
    assert po.load_card(path).bare == ()
    path.write_text('title = "g"\n[groups]\nbeta0 = 4\nlam = 1\n[[questions]]\n')
    assert po.load_card(path).bare == ()
