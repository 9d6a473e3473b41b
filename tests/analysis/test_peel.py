"""Peel tests: force and angle into work and back, and the peak with which a short arm begins.

Module: `peel`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pint
import pytest

import peel_opt as po

U = pint.UnitRegistry()

TAPE = po.Rod.from_sheet("1.5 GPa", "40 um", 0.4, "0.5 MPa", "100 J/m^2")


@pytest.mark.parametrize(
    ("force", "angle", "work"),
    [
        ("2 N/20 mm", "90 deg", 100.0),  # a tape pulled straight up spends its force
        ("2 N/20 mm", "180 deg", 200.0),  # pulled back over itself, twice that
        (100.0, math.pi / 3.0, 50.0),
        (6.0 * U.N / (25.0 * U.mm), 90.0 * U.deg, 240.0),
        ("100 gf/in", "180 deg", 2.0 * 0.1 * 9.80665 / 0.0254),
        ("0 N/m", "90 deg", 0.0),
    ],
)
def test_force_and_angle_are_work_with_the_factor_of_the_angle(force: Any, angle: Any, work: float) -> None:
    assert po.energy_release_rate(force, angle) == pytest.approx(work, rel=1e-14)
    assert isinstance(po.energy_release_rate(force, angle), float)


def test_arrays_of_texts_and_quantities_are_taken_back_and_forth() -> None:
    angles = ["30 deg", "90 deg", "180 deg"]
    forces = po.peel_force("100 J/m^2", angles)
    assert forces == pytest.approx([100.0 / (1.0 - math.sqrt(0.75)), 100.0, 50.0], rel=1e-13)
    assert po.energy_release_rate(forces * U.N / U.m, angles) == pytest.approx([100.0] * 3, rel=1e-14)
    assert po.peel_force(np.array(["1 J/m^2", "2 mJ/cm^2"]), "90 deg") == pytest.approx([1.0, 20.0])


def test_a_small_angle_does_not_cancel() -> None:
    assert po.peel_force(1.0, 1e-9) == pytest.approx(2e18, rel=1e-14)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: po.energy_release_rate(100.0, 90.0), "got 90 [rad]. Write '90 deg' for degrees"),
        (lambda: po.peel_force(math.nan, "90 deg"), "at least 0, got nan"),
        (lambda: po.energy_release_rate(100.0, 0.0), "above 0 and up to pi"),
        (lambda: po.energy_release_rate(-1.0, 1.0), "at least 0"),
        (lambda: po.energy_release_rate("100 kPa", "90 deg"), "cannot be measured in 'kPa'"),
        (lambda: po.energy_release_rate("5 oz/in", "90 deg"), "'oz' is a mass. Its weight is 'ozf'"),
        (lambda: po.peel_force("100", "90 deg"), "needs a unit"),
        (lambda: po.peel_force([1.0, math.nan], "90 deg"), "finite"),
        (lambda: po.peel_force("x", object()), "work"),
        (lambda: po.initiation_force(TAPE, math.pi), "a flat rod stays flat"),
        (lambda: po.initiation_force(TAPE, 90.0), "'deg' where degrees are meant"),
        (lambda: po.initiation_force(TAPE, "90 deg", arm="-1 mm"), "arm"),
    ],
)
def test_what_cannot_be_meant_is_said(call: Any, words: str) -> None:
    with pytest.raises(po.PeelOptError) as caught:
        call()
    assert words in str(caught.value)


@pytest.mark.parametrize(("angle", "arm"), [(90.0, 0.0), (150.0, 0.1e-3)])
@pytest.mark.slow
def test_the_peak_is_a_state_and_its_neighbours_need_less(angle: float, arm: float) -> None:
    peak = po.initiation_force(TAPE, f"{angle} deg", arm)
    scene = po.Scene(TAPE, tip=po.TipLoad(angle=math.radians(angle)), unbonded=arm)

    def force(length: float) -> float:
        return po.solve(scene, free="force", length=length, near=peak.force).numbers["force"]

    size = TAPE.adhesion_strength * TAPE.eta
    assert force(peak.length) == pytest.approx(peak.force, abs=10.0 * peak.error * size)
    assert max(force(peak.length * s) for s in (0.97, 1.03)) < peak.force * (1.0 - 1e-4)
    assert peak.force > peak.long_arm_force * 1.1
    assert peak.error < 1e-10
    assert peak.certificate < 1e-10


def test_a_long_arm_has_no_peak_but_the_steady_force() -> None:
    with pytest.raises(po.NoEquilibrium, match="without a peak above it: 100 N/m") as caught:
        po.initiation_force(TAPE, "90 deg", "6 mm")
    assert caught.value.nearest == pytest.approx(100.0, rel=1e-12)


def test_a_peak_below_the_steady_force_is_not_taken_for_the_largest() -> None:
    soft = po.Rod.from_ratio(0.06)  # its tip leaves the bond long before the peel is steady
    with pytest.raises(po.PeelOptError):
        po.initiation_force(soft, "150 deg", 0.3)
