"""How an edge without glue opens: from rest to the snap, in order, in the rod's units, and to files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import peel_opt as po


@pytest.fixture(scope="module")
def curve() -> po.LoadingCurve:
    return po.loading_curve(po.Rod.from_ratio(1.0), 1.0, points=12)


def test_it_rises_from_a_flat_edge_to_the_snap(curve: po.LoadingCurve) -> None:
    assert curve.ended == "snap"
    assert (curve.pressure[0], curve.length[0], curve.tip_height[0]) == (0.0, 1.0, 0.0)
    for values in (curve.pressure, curve.length, -curve.tip_angle, curve.tip_height):
        assert np.all(np.diff(values) > 0.0)
    # by shooting in the local frame
    assert curve.pressure[-1] == pytest.approx(0.3535512998, abs=1e-10)
    assert curve.length[-1] == pytest.approx(2.8667912, abs=1e-6)
    assert curve.tip_angle[-1] == pytest.approx(-0.5501037, abs=1e-6)
    assert curve.error.max() < 1e-12
    assert curve.certificate.max() < 1e-12


def test_a_point_of_it_is_the_state_that_solve_finds(curve: po.LoadingCurve) -> None:
    eq = po.solve(po.Scene(curve.rod, unbonded=1.0), free="length", pressure=float(curve.pressure[5]))
    assert eq.state == "lifted"
    assert eq.length == pytest.approx(curve.length[5], abs=1e-9)
    assert eq.tip_height == pytest.approx(curve.tip_height[5], abs=1e-9)


def test_a_long_edge_grows_stably_until_the_bond_fails() -> None:
    curve = po.loading_curve(po.Rod.from_ratio(1.0), 4.0, points=10)
    assert curve.ended == "strength"
    assert "grows stably up to" in curve.outcome
    assert curve.pressure[-1] == pytest.approx(1.0, abs=2.0 * curve.error[-1])
    assert np.all(np.diff(curve.pressure) > 0.0)
    with pytest.raises(po.NoEquilibrium, match=r"up to p = 1.*where the bond itself fails"):
        po.safe_pressure(po.Rod.from_ratio(1.0), 4.0)


@pytest.mark.parametrize(
    ("r", "a"),
    [
        (0.75, 8.0),
        *(pytest.param(*each, marks=pytest.mark.slow) for each in [(0.1, 5.0), (10.0, 200.0), (10.0, 50.0)]),
    ],
)
def test_a_longer_one_does_until_its_tip_comes_down(r: float, a: float) -> None:
    curve = po.loading_curve(po.Rod.from_ratio(r), a, points=4)
    assert "tip comes back to the plate" in curve.outcome
    with pytest.raises(po.NoEquilibrium, match="tip comes back") as refused:
        po.safe_pressure(curve.rod, a)
    assert refused.value.nearest == pytest.approx(curve.pressure[-1], rel=1e-3)
    assert curve.tip_angle[-1] == pytest.approx(-4.0 * np.pi / 3.0, abs=1e-4)
    assert curve.tip_height[-1] == pytest.approx(0.0, abs=1e-4 * a)


def test_it_is_in_the_units_of_the_rod(curve: po.LoadingCurve) -> None:
    rod = po.Rod(2.3e-5, 140e3, 2.3e-5 ** (1 / 3) * 140e3 ** (-1 / 3))
    own = po.loading_curve(rod, rod.eta, points=12)
    assert own.flaw == pytest.approx(rod.eta)
    np.testing.assert_allclose(own.pressure, curve.pressure * rod.adhesion_strength, rtol=1e-9)
    np.testing.assert_allclose(own.length, curve.length * rod.eta, rtol=1e-9)
    np.testing.assert_allclose(own.tip_height, curve.tip_height * rod.eta, rtol=1e-9)


def test_it_travels_by_file(curve: po.LoadingCurve, tmp_path: Path) -> None:
    read = po.LoadingCurve.load(curve.save(tmp_path / "opening.npz"))
    assert read.outcome == curve.outcome
    assert repr(read) == repr(curve)
    for name in ("pressure", "length", "tip_angle", "tip_height", "error", "certificate"):
        assert np.array_equal(getattr(read, name), getattr(curve, name))
    text = curve.to_csv(tmp_path / "opening.csv").read_text()
    assert "pressure [T0],length [eta],tip_angle [rad],tip_height [eta]" in text
    with pytest.raises(po.InvalidInput):
        po.LoadingCurve.load(tmp_path / "opening.csv")


@pytest.mark.parametrize(("flaw", "points"), [(0.0, 5), (-1.0, 5), (1.0, 1)])
def test_what_is_no_edge_is_refused(flaw: float, points: int) -> None:
    with pytest.raises(po.InvalidInput):
        po.loading_curve(po.Rod.from_ratio(1.0), flaw, points=points)
