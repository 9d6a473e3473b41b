"""Texts with units are taken by the public calls wherever a number has a unit, arrays included.

Module: `units`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import peel_opt as po
from peel_opt.base.units import in_si

from ..rods import FLAP

CARD = Path(__file__).parents[2] / "problems" / "office_tape.toml"


def test_a_sheet_makes_the_rod_of_its_formula() -> None:
    rod = po.Rod.from_sheet("1.5 GPa", "40 um", 0.4, "0.5 MPa", "100 J/m^2")
    assert rod.bending_stiffness == pytest.approx(1.5e9 * 64e-15 / (12.0 * 0.84), rel=1e-15)
    assert rod.adhesion_strength == 0.5e6
    assert rod.work_of_separation == pytest.approx(100.0, rel=1e-15)
    assert po.Rod.from_sheet(1.5e9, 40e-6, 0.4, 0.5e6, 100.0) == rod


@pytest.mark.parametrize("nu", [-1.0, 0.51, "0.4 mm", float("nan")])
def test_no_sheet_has_such_a_ratio_of_poisson(nu: Any) -> None:
    with pytest.raises(po.InvalidInput, match="poisson_ratio"):
        po.Rod.from_sheet("1.5 GPa", "40 um", nu, "0.5 MPa", "100 J/m^2")


def test_a_card_is_read_in_python() -> None:
    card = po.load_card(CARD)
    assert isinstance(card, po.Card)
    assert card.rod() == po.Rod.from_sheet("1.5 GPa", "40 um", 0.4, "0.5 MPa", "100 J/m^2")
    with pytest.raises(po.CardError, match="nowhere"):
        po.load_card("nowhere.toml")


@pytest.mark.parametrize(
    ("of_texts", "of_numbers"),
    [
        (lambda: po.length_given_pressure(FLAP, "60 kPa"), lambda: po.length_given_pressure(FLAP, 60e3)),
        (
            lambda: po.pressure_given_length(FLAP, "1.9 mm", near="45 kPa"),
            lambda: po.pressure_given_length(FLAP, 1.9e-3, near=45e3),
        ),
        (lambda: po.critical_flaw(FLAP, "450 mmHg"), lambda: po.critical_flaw(FLAP, 450 * 133.322387415)),
        (
            lambda: po.solve(po.Scene(FLAP, [po.Weight("20 Pa")]), free="length", pressure="60 kPa"),
            lambda: po.solve(po.Scene(FLAP, [po.Weight(20.0)]), free="length", pressure=60e3),
        ),
        (
            lambda: po.length_given_pressure(po.Scene(FLAP, [po.Weight("20 Pa")]), "60 kPa", near="1.8 mm"),
            lambda: po.length_given_pressure(po.Scene(FLAP, [po.Weight(20.0)]), 60e3, near=1.8e-3),
        ),
    ],
)
def test_a_question_is_asked_in_texts(of_texts: Callable[[], Any], of_numbers: Callable[[], Any]) -> None:
    found, expected = of_texts(), of_numbers()
    assert (found.pressure, found.length) == pytest.approx((expected.pressure, expected.length), rel=1e-9)


def test_times_of_a_motion_may_have_a_unit_where_drag_says_which() -> None:
    for until, drag, words in (
        ("20 kPa", "1 kPa s/m", "kPa"),
        ("20 us", None, "Without drag"),
        ("x", 1e3, "a time"),
    ):
        with pytest.raises(po.InvalidInput, match=words):
            po.snap(FLAP, pressure="60 kPa", flaw="1.8 mm", drag=drag, until=until)
    with pytest.raises(po.InvalidInput, match="times"):
        po.history(FLAP, pressure=(["0 kPa", "1 kPa"], ["60 kPa", "50 kPa"]), drag="1 kPa s/m")


@pytest.mark.slow
def test_histories_and_rods_on_their_tips_are_asked_in_texts() -> None:
    drag, times = "1 kPa s/m", (["0 us", "20 us"], ["60 kPa", "60.1 kPa"])
    texts, numbers = (
        po.history(FLAP, pressure=p, drag=drag) for p in (times, ([0.0, 20e-6], [60e3, 60.1e3]))
    )
    assert texts.front == pytest.approx(numbers.front, rel=1e-9)
    assert po.snap(FLAP, pressure="60 kPa", drag=drag, until="20 us").t[-1] == pytest.approx(20e-6)
    for call in (po.touching, po.flat_fold):
        assert call(FLAP, "60 kPa").length == pytest.approx(call(FLAP, 60e3).length, rel=1e-12)
    known = {"bending_stiffness": "23 uN m", "adhesion_range": "0.73 mm"}
    data = po.Measurements(["1.9 mm", "2.0 mm"], ["48.7 kPa", "41.9 kPa"], pressure_sd="0.5 kPa")
    assert po.calibrate(data, free="adhesion_strength", rod=known).rod.adhesion_strength == pytest.approx(
        140e3, rel=1e-2
    )


def test_rows_of_texts_are_rows_of_numbers() -> None:
    lengths = in_si("length", np.array([["1.9 mm", "2 mm"], ["1 um", "1 in"]]), "m")
    assert lengths == pytest.approx(np.array([[1.9e-3, 2e-3], [1e-6, 0.0254]]), rel=1e-15)
    data = po.Measurements(["1.9 mm", "2.0 mm"], np.array(["60 kPa", "450 mmHg"]), pressure_sd="500 Pa")
    assert data.length.tolist() == [1.9e-3, 2.0e-3]
    assert data.pressure == pytest.approx([60e3, 450 * 133.322387415], rel=1e-9)
    swept = po.sweep({"pressure": ["60 kPa", "70 kPa"]}, rod=FLAP, workers=1)
    assert swept.axes["pressure"].tolist() == [60e3, 70e3]
    scene = po.Scene(FLAP, [po.Weight(1.0)])
    found = po.answers(scene, pressure_ratio=0.5, weight=["10 Pa", "20 Pa"])
    assert found.numbers["weight"].tolist() == [10.0, 20.0]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: po.length_given_pressure(FLAP, "60"), "pressure needs a unit"),
        (lambda: po.length_given_pressure(FLAP, "60 mm"), "pressure cannot be measured in 'mm'"),
        (lambda: po.length_given_pressure(FLAP, "60,5 kPa"), "decimal comma, got '60,5'. Write 60.5"),
        (lambda: po.length_given_pressure(po.Rod.from_ratio(1.0), "0.8"), "pressure must be a number"),
        (lambda: po.length_given_pressure(FLAP, ["60 kPa", "70 kPa"]), "must be a number"),
        (lambda: po.sweep({"pressure": ["60 kPa", "70 mm"]}, rod=FLAP), "cannot be measured in 'mm'"),
        (lambda: po.sweep({"ratio": ["1"], "pressure_ratio": 0.5}), "must hold numbers"),
        (lambda: po.equilibrium(beta0="4", lam=1.0), "beta0 must be a number"),  # type: ignore[arg-type]
    ],
)
def test_a_text_that_cannot_be_meant_is_named(call: Callable[[], Any], words: str) -> None:
    with pytest.raises(po.InvalidInput) as caught:
        call()
    assert words in str(caught.value)
