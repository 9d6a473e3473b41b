"""Data without standard deviations: all count alike, and the residuals say how much they scatter."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import curve_fit
from scipy.special import stdtrit

import peel_opt as po

from ..rods import FLAP

FREE = ["adhesion_strength", "adhesion_range"]


@pytest.fixture(scope="module")
def pairs() -> tuple[np.ndarray, np.ndarray]:
    """Return ten noisy pairs of length and pressure, below the fold in length."""
    rng = np.random.default_rng(1)
    lengths = np.linspace(1.85e-3, 2.5e-3, 10)
    pressures = np.array([po.pressure_given_length(FLAP, length).pressure for length in lengths])
    return lengths * (1 + 0.004 * rng.normal(size=10)), pressures * (1 + 0.004 * rng.normal(size=10))


@pytest.fixture(scope="module")
def alike(pairs: tuple[np.ndarray, np.ndarray]) -> po.Calibration:
    return po.calibrate(po.Measurements(*pairs), free=FREE, rod=FLAP)


def test_the_fit_is_that_of_equal_shares_with_the_residuals_as_their_size(
    pairs: tuple[np.ndarray, np.ndarray], alike: po.Calibration
) -> None:
    lengths, pressures = pairs
    data = po.Measurements(lengths, pressures, length_sd=0.05 * lengths, pressure_sd=0.05 * pressures)
    said = po.calibrate(data, free=FREE, rod=FLAP)
    for name in FREE:
        assert alike.estimates[name] == pytest.approx(said.estimates[name], rel=1e-7)
    ratio = math.sqrt(said.chi2 / said.degrees)
    assert np.allclose(alike.covariance, said.covariance * ratio**2, rtol=1e-5)
    assert alike.chi2 == pytest.approx(alike.degrees)
    assert math.isnan(alike.p_value)
    assert alike.scaled == pytest.approx(5.0 * ratio, rel=1e-6)  # of one per cent
    share = alike.observations[0].pressure_sd / pressures[0]  # type: ignore[operator]
    assert f"{100 * share:.2g} % of lengths" in repr(alike)
    assert "standard deviations are those of the residuals" in repr(alike)
    assert po.calibrate(data, free=FREE, rod=FLAP, absolute_sd=False).sd == pytest.approx(alike.sd, rel=1e-5)


def test_intervals_are_those_of_student(alike: po.Calibration) -> None:
    low, high = alike.interval("adhesion_range", method="covariance")
    t = stdtrit(alike.degrees, 0.975)
    assert math.log(high / low) == pytest.approx(2 * t * alike.relative_sd("adhesion_range"))
    profiled = alike.interval("adhesion_range")
    assert profiled == pytest.approx((low, high), rel=5e-3)


@pytest.mark.slow
def test_it_is_curve_fit_where_pressures_alone_scatter(pairs: tuple[np.ndarray, np.ndarray]) -> None:
    lengths, pressures = pairs

    def model(s: np.ndarray, T0: float, y0: float) -> list[float]:
        rod = po.Rod(FLAP.bending_stiffness, T0, y0)
        return [po.pressure_given_length(rod, float(length)).pressure for length in s]

    p0 = [FLAP.adhesion_strength, FLAP.adhesion_range]
    best, covariance = curve_fit(
        model, lengths, pressures, p0=p0, diff_step=1e-5, method="trf", x_scale=p0, xtol=1e-12
    )
    fit = po.calibrate(
        po.Measurements(lengths, pressures, pressure_sd=400.0), free=FREE, rod=FLAP, absolute_sd=False
    )
    assert list(fit.estimates.values()) == pytest.approx(best, rel=1e-5)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(list(fit.sd.values()), rel=1e-2)


def test_shapes_count_alike_too() -> None:
    eq = po.pressure_given_length(FLAP, 2e-3)
    rng, there = np.random.default_rng(2), eq.sol(np.linspace(0.0, eq.length, 12))
    x, y = (v + 3e-6 * rng.normal(size=12) for v in (there.x, there.y))
    shape = po.MeasuredShape(x, y, pressure=eq.pressure, tip=True)
    fit = po.calibrate(shape, free=FREE, rod=FLAP)
    assert fit.observations[0].points is not None
    assert fit.observations[0].points[0, 2] == pytest.approx(3e-6, rel=0.5)
    assert "um of points" in repr(fit)
    with pytest.raises(po.InvalidInput, match="some of the data have standard deviations"):
        po.calibrate([shape, po.Measurements([2e-3], [eq.pressure], pressure_sd=500.0)], free=FREE, rod=FLAP)


def test_what_residuals_cannot_say_is_refused(pairs: tuple[np.ndarray, np.ndarray]) -> None:
    data = po.Measurements(*pairs)
    for options, words in (
        ({"loss": "pseudo-huber"}, "a robust loss has its scale in standard deviations"),
        ({"absolute_sd": True}, "no standard deviations that could be meant"),
        ({"absolute_sd": "yes"}, "absolute_sd must be True or False"),
    ):
        with pytest.raises(po.InvalidInput, match=words):
            po.calibrate(data, free=FREE, rod=FLAP, **options)  # type: ignore[call-overload]
    with pytest.raises(po.InvalidInput, match="leave no residuals"):
        po.calibrate(po.Measurements(pairs[0][:2], pairs[1][:2]), free=FREE, rod=FLAP)


def test_a_file_may_leave_them_out(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("length [mm], pressure [kPa]\n1.9, 48.7\n2.2, 33.4\n2.0, 42.9\n")
    assert not po.read_measurements(path).says_sd


@pytest.mark.slow
def test_data_on_the_wrong_branch_are_found_out_all_the_same() -> None:
    pressures = [60e3, 70e3, 80e3, 90e3]
    lengths = [po.length_given_pressure(FLAP, p, state="folded").length for p in pressures]
    fit = po.calibrate(po.Measurements(lengths, pressures), free=FREE, rod=FLAP)
    assert any("say state='folded'" in words for words in fit.warnings)


@pytest.mark.slow
def test_scenes_are_fitted_without_them_too() -> None:
    torn = po.Scene(po.Rod(2.3e-5, 110e3, 0.73e-3), unbonded=0.6e-3)
    lengths, pressures = [0.707e-3, 0.902e-3, 1.153e-3, 1.418e-3], [12.1e3, 27.7e3, 43.8e3, 53.7e3]
    fit = po.calibrate(po.Measurements(lengths, pressures), free=["adhesion_strength", "unbonded"], rod=torn)
    assert fit.chi2 == pytest.approx(fit.degrees)
    assert fit.estimates["unbonded"] == pytest.approx(0.497e-3, rel=0.05)
    assert fit.scatter
