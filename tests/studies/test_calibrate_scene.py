"""Calibration of scenes: what is recovered, how sure, and that its derivatives are exact."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import peel_opt as po
from peel_opt.plots.fit import fit_figure
from peel_opt.studies.calibrate.scene_fit import SceneCalibration
from peel_opt.studies.calibrate.scene_problem import Coordinate, SceneFitted

from ..rods import FLAP

PAIRS = po.Measurements([0.7e-3, 0.9e-3, 1.1e-3], [12e3, 28e3, 40e3], length_sd=1e-5)
TORN = po.Scene(FLAP, unbonded=0.5e-3)


def measured(scene: po.Scene, pressures: list[float], noise: float = 0.0, seed: int = 0) -> po.Measurements:
    """Lengths of a scene with a standard deviation of half a percent, at exact pressures."""
    lengths = np.array([po.solve(scene, free="length", pressure=p).length for p in pressures])
    rng = np.random.default_rng(seed)
    seen = lengths * (1.0 + noise * rng.standard_normal(len(lengths)))
    return po.Measurements(seen, pressures, length_sd=0.005 * lengths)


# --- what cannot be meant ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"free": ["weight"]}, "unknown free number 'weight'"),
        ({"free": []}, "nothing is free"),
        (
            {"free": ["unbonded", "adhesion_strength", "adhesion_range", "bending_stiffness"]},
            "cannot determine",
        ),
        ({"free": ["unbonded"], "law": "linear"}, "a scene has its own law"),
        ({"free": ["unbonded"], "loss": "huber"}, "unknown loss"),
        ({"free": ["unbonded"], "state": "upper"}, "unknown state"),
    ],
)
def test_what_cannot_be_meant_is_said(asked: dict[str, Any], words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        po.calibrate(PAIRS, rod=TORN, **asked)


def test_a_scene_is_not_fitted_to_shapes() -> None:
    shape = po.MeasuredShape([-1e-3, -5e-4], [1e-4, 2e-5], sd=1e-5, pressure=20e3)
    with pytest.raises(po.InvalidInput, match="not to shapes"):
        po.calibrate([PAIRS, shape], rod=TORN, free=["unbonded"])


def test_coordinates_have_the_limits_of_their_numbers() -> None:
    scene = po.Scene(FLAP, [po.Pressure(dead=0.2), po.Weight(-10.0)], unbonded=0.5e-3)
    dead, weight, unbonded, strength = (
        Coordinate.of(name, scene) for name in ("dead", "weight", "unbonded", "adhesion_strength")
    )
    assert [dead.value(z) for z in (0.0, dead.low, dead.high)] == pytest.approx([0.2, 0.0, 1.0])
    assert weight.value(0.0) == -10.0
    assert (weight.low, weight.high) == (-np.inf, np.inf)
    assert unbonded.is_log
    assert strength.is_log
    assert unbonded.value(np.log(2.0)) == pytest.approx(1e-3)
    for one in (dead, weight, unbonded, strength):
        assert one.rate(0.3) == pytest.approx(
            (one.value(0.3 + 1e-6) - one.value(0.3 - 1e-6)) / 2e-6, rel=1e-8
        )


# --- what is recovered ---------------------------------------------------------------------------

CASES = {
    "an edge without glue": (
        TORN,
        [10e3, 20e3, 35e3, 48e3],
        po.Scene(replace(FLAP, adhesion_strength=120e3, adhesion_range=0.85e-3), unbonded=0.4e-3),
        ("adhesion_strength", "adhesion_range", "unbonded"),
    ),
    "a strip in an artery": (
        po.Scene(FLAP, wall=po.Circle(100.0), tip=po.Contact()),
        [20e3, 40e3, 60e3, 80e3],
        po.Scene(FLAP, wall=po.Circle(130.0), tip=po.Contact()),
        ("curvature",),
    ),
    "weight": (
        po.Scene(FLAP, [po.Weight(2.8e3)]),
        [35e3, 60e3, 90e3],
        po.Scene(replace(FLAP, adhesion_strength=150e3), [po.Weight(100.0)]),
        ("weight", "adhesion_strength"),
    ),
    "a film that stretches": (
        po.Blister(FLAP, stretch=2e5, line_energy=20.0),
        [30e3, 60e3, 120e3],
        po.Blister(FLAP, stretch=2e5, line_energy=15.0),
        ("line_energy",),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_the_truth_is_recovered_from_exact_data(name: str) -> None:
    truth, pressures, start, free = CASES[name]
    fit = po.calibrate(measured(truth, pressures), rod=start, free=free)
    assert isinstance(fit, SceneCalibration)
    numbers = {n: getattr(truth.rod, n) for n in vars(FLAP) if not n.startswith("_")}
    numbers |= {n: v * truth.dimensions[n].size(truth.rod) for n, v in truth.numbers.items()}
    for number in free:
        assert fit.estimates[number] == pytest.approx(numbers[number], rel=1e-7)
    assert fit.consistency < 1e-8
    assert all(eq.certified for eq in fit.equilibria)
    assert fit.scene.form == truth.form


@pytest.mark.slow
def test_the_derivatives_of_residuals_are_those_of_differences() -> None:
    truth, pressures, start, free = CASES["an edge without glue"]
    fit = po.calibrate(measured(truth, pressures, 0.005), rod=start, free=free)
    assert isinstance(fit, SceneCalibration)
    problem, z = fit.problem, fit.fitted.z + 0.03
    points = problem.moved(fit.fitted.points, fit.fitted.z, z)
    assert points is not None
    by_z = [one.by_q for one in problem.seen(SceneFitted(z, tuple(points), (False,) * len(points)))]

    def residuals(at: np.ndarray) -> np.ndarray:
        moved, scene = problem.moved(points, z, at), problem.scene_at(at)
        assert moved is not None
        scale = np.array([scene.rod.eta, scene.rod.adhesion_strength])
        return np.array([problem.residual(point, i, scale) for i, point in enumerate(moved)])

    for j, step in enumerate(1e-5 * np.eye(len(z))):
        rates = (residuals(z + step) - residuals(z - step)) / 2e-5
        found = np.array(by_z)[:, :, j]
        np.testing.assert_allclose(rates, found, atol=1e-8 * np.abs(found).max())


@pytest.mark.slow
def test_intervals_hold_what_they_say_and_more_noise_is_seen() -> None:
    start = po.Scene(replace(FLAP, adhesion_strength=125e3), unbonded=0.55e-3)
    free = ("adhesion_strength", "unbonded")
    data = measured(TORN, [10e3, 22e3, 34e3, 45e3], 0.005, seed=3)
    fit = po.calibrate(data, rod=start, free=free)
    assert isinstance(fit, SceneCalibration)
    assert fit.identifiable
    assert not fit.warnings
    for name, truth in (("adhesion_strength", 140e3), ("unbonded", 0.5e-3)):
        low, high = fit.interval(name)
        assert low < truth < high
        np.testing.assert_allclose((low, high), fit.interval(name, method="covariance"), rtol=3e-3)
        assert fit.interval(name, level=0.5)[0] > low
    noisy = po.calibrate(replace(data, length_sd=np.asarray(data.length_sd) / 10.0), rod=start, free=free)
    assert any("larger than the standard deviations allow" in warning for warning in noisy.warnings)
    robust = po.calibrate(data, rod=start, free=free, loss="pseudo-huber")
    assert robust.interval("unbonded") == robust.interval("unbonded", method="covariance")
    with pytest.raises(po.InvalidInput, match="no likelihood"):
        robust.interval("unbonded", method="profile")
    record = fit.summary()
    assert record["unbonded [m]"] == fit.estimates["unbonded"]
    assert "unbonded_sd [m]" in fit.csv_text()
    assert len(fit_figure(fit).axes) == 2


@pytest.mark.slow
def test_what_the_data_do_not_tell_apart_is_named() -> None:
    """At one place on the branch T0 and y0 do one thing."""
    scene = po.Scene(FLAP, [po.Weight(500.0)])
    data = measured(scene, [100e3, 100.5e3, 101e3], 0.005)
    fit = po.calibrate(data, rod=scene, free=("adhesion_strength", "adhesion_range"))
    assert not fit.identifiable
    assert "what the data do not determine was held near the start of the fit." in fit.warnings
    assert fit.interval("adhesion_range") == fit.interval("adhesion_range", method="covariance")
    assert any("do not tell" in text or "next to nothing" in text for text in fit.warnings)


@pytest.mark.slow
def test_the_papers_scene_is_fitted_as_its_rod() -> None:
    lengths = [1.8e-3, 2.0e-3, 2.3e-3]
    pressures = [po.pressure_given_length(FLAP, length).pressure for length in lengths]
    data = po.Measurements(lengths, pressures, pressure_sd=500.0)
    fit = po.calibrate(data, free=["adhesion_strength"], rod=po.Scene(FLAP))
    assert isinstance(fit, po.Calibration)
    assert fit.estimates["adhesion_strength"] == pytest.approx(140e3, rel=1e-8)


@pytest.mark.slow
def test_data_far_from_the_scene_are_fitted_and_found_out() -> None:
    rod = po.Rod.from_sheet(0.6e6, 0.7e-3, 0.5, 140e3, 51.0)
    pressures = np.array([150.0, 300.0, 420.0, 500.0]) * 133.322387415
    data = po.Measurements([0.98e-3, 1.17e-3, 1.33e-3, 1.47e-3], pressures, pressure_sd=1.07e3)
    fit = po.calibrate(data, rod=po.Scene(rod, wall=po.Circle(100.0), tip=po.Contact()), free=["curvature"])
    assert any("larger than the standard deviations allow" in warning for warning in fit.warnings)
