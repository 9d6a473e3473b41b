"""`Branch.at`, selections of its points, and special points in SI."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import peel_opt as po

FLAP = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)


@pytest.fixture(scope="module")
def flap() -> po.Branch:
    return po.trace(FLAP, points=40)


@pytest.fixture(scope="module")
def diagram() -> po.Branch:
    return po.trace(beta0=4, lam=(-1, 3), points=40)


def test_all_states_at_a_pressure_are_what_the_questions_answer(flap: po.Branch) -> None:
    lower, folded = flap.at(pressure="60 kPa")
    asked = po.length_given_pressure(FLAP, 60e3)
    assert (lower.state, folded.state) == ("lower", "folded")
    assert lower.certified
    assert folded.certified
    assert lower.pressure == 60e3
    assert abs(lower.length - asked.length) < 1e-12
    assert [eq.state for eq in flap.at(pressure_ratio=60 / 140)] == ["lower", "folded"]


def test_all_states_at_a_length_lie_on_the_branch(flap: po.Branch) -> None:
    found = flap.at(length=1.79e-3)
    assert [eq.state for eq in found] == ["middle", "lower", "folded"]
    for eq in found:
        near = np.interp(-eq.tip_angle, flap.A, flap.pressure)
        assert abs(near - eq.pressure) < 2e-3 * FLAP.adhesion_strength
    (one,) = flap.at(length=1.79e-3, near="59 kPa")
    assert one.state == "lower"
    assert [eq.state for eq in flap.at(length=1.79e-3, state="unfolded")] == ["middle", "lower"]
    (steep,) = flap.at(tip_angle=-1.0)
    assert abs(steep.tip_angle + 1.0) < 1e-12


def test_what_the_branch_does_not_have_is_an_error_that_says_so(flap: po.Branch) -> None:
    with pytest.raises(po.NoEquilibrium, match="nearest it has is 25942") as nothing:
        flap.at(pressure="10 kPa")
    assert nothing.value.nearest == pytest.approx(flap.pressure.min())
    with pytest.raises(po.NoEquilibrium, match="There it is middle"):
        flap.at(pressure=100e3, state="lower")
    for wrong in (
        {},
        {"pressure": 1e4, "length": 1e-3},
        {"pressure": "3 mm"},
        {"state": "upper", "lam": 0.0},
    ):
        with pytest.raises(po.InvalidInput):
            flap.at(**wrong)  # type: ignore[arg-type]


def test_a_value_read_off_a_point_comes_back(flap: po.Branch) -> None:
    least = flap.special("LP-pressure")[0]
    (eq,) = flap.at(pressure=least.pressure)
    assert eq.length == pytest.approx(least.length, rel=1e-6)
    assert flap.at(length=float(flap.length[3]), near=float(flap.pressure[3]))[0].state == flap.state[3]


def test_at_fixed_beta0_both_sides_and_unlocated_folds_are_seen(diagram: po.Branch) -> None:
    spurious, lower = diagram.at(lam=1)
    assert (spurious.state, lower.state) == ("spurious", "lower")
    assert lower.alpha1 == pytest.approx(-4.4354069891, abs=1e-9)
    # From T to the window's lower border and back: the coarse branch of two points has its fold between them.
    fold = diagram.special("LP-lambda")[0]
    coarse = diagram[[fold.index - 2, fold.index + 2]]
    assert len(coarse.at(lam=fold.lam + 1e-3 * (coarse.lam.min() - fold.lam))) == 2
    with pytest.raises(po.InvalidInput, match="no rod"):
        diagram.at(pressure=1.0)


def test_special_points_have_the_units_of_the_rod(flap: po.Branch, diagram: po.Branch) -> None:
    fold = flap.special("LP-length")[0]
    assert fold.pressure == fold.pressure_ratio * 140e3
    assert fold.length == fold.length_ratio * FLAP.eta
    assert "p = 91193" in repr(flap)
    assert f"{fold.pressure!r}" in flap.csv_text()
    bent = diagram.special("LP-lambda")[0]
    assert bent.pressure == bent.beta0 + bent.alpha1
    assert math.isclose(bent.length, 4.0 ** (1 / 3))


def test_points_are_chosen_as_numpy_does(flap: po.Branch) -> None:
    assert flap[-1].pressure == flap.pressure[-1]
    assert np.array_equal(flap[2:10].length, flap.length[2:10])
    high = flap[flap.pressure > 5e4]
    assert np.array_equal(high.pressure, flap.pressure[flap.pressure > 5e4])
    assert len(high.pieces) == 2
    assert len(high.at(pressure=6e4)) == 2
    assert [p.kind for p in high.special_points][:2] == ["BP", "LP-length"]
    assert np.array_equal(flap[[0, 4, 8]].A, flap.A[[0, 4, 8]])
    assert len(flap[flap.pressure < 0.0]) == 0
    assert sum(1 for _ in flap[:3]) == 3
    for wrong in (len(flap), [True], np.zeros((2, 2), int), 1.5):
        with pytest.raises(IndexError):
            flap[wrong]


@pytest.mark.slow
def test_the_branch_of_a_scene_answers_too_and_so_does_its_file(tmp_path: Path) -> None:
    branch = po.trace(po.Scene(FLAP, unbonded=0.5e-3), points=30, tol=1e-6)
    found = branch.at(length="2 mm")
    assert [eq.state for eq in found] == ["middle", "folded"]
    again = po.Branch.load(branch.save(tmp_path / "branch.npz")).at(length="2 mm")
    assert [eq.pressure for eq in again] == [eq.pressure for eq in found]
    with pytest.raises(po.InvalidInput, match="Give pressure or length"):
        branch.at(lam=1.0)
