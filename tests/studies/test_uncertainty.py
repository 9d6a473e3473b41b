"""Uncertainty: linear and sampled agree where they must, disagree aloud near a fold, and count failures."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pint
import pytest
from scipy import stats

import peel_opt as po
from peel_opt.analysis.maxwell_derivative import maxwell_gradient
from peel_opt.app.cli.main import main
from peel_opt.studies.uncertainty.fates import Sampled
from peel_opt.studies.uncertainty.inputs import split, spread_of
from peel_opt.studies.uncertainty.limits_of_many import interpolated
from peel_opt.studies.uncertainty.sample import Sample

from ..rods import FLAP

SPREAD = {"bending_stiffness": "2 %", "adhesion_strength": "1 %", "adhesion_range": "1.5 %"}


@pytest.fixture(scope="module")
def smooth() -> po.Uncertainty:
    return po.uncertainty(FLAP, SPREAD, pressure=105e3, samples=64, workers=1)


def test_the_linear_estimate_is_the_chain_rule_by_finite_differences(smooth: po.Uncertainty) -> None:
    found, variance = smooth["length"], 0.0
    for name, percent in (("bending_stiffness", 2.0), ("adhesion_strength", 1.0), ("adhesion_range", 1.5)):
        value, step = getattr(FLAP, name), 1e-4
        numbers = {n: getattr(FLAP, n) for n in SPREAD}
        up, down = (
            po.length_given_pressure(po.Rod(**{**numbers, name: value * (1.0 + s)}), 105e3).length
            for s in (step, -step)
        )
        variance += ((up - down) / (2.0 * step) * 0.01 * percent) ** 2
    assert found.linear_sd == pytest.approx(math.sqrt(variance), rel=1e-6)
    assert found.linear_mean == found.nominal == po.length_given_pressure(FLAP, 105e3).length


def test_small_spreads_agree_with_the_linear_estimate(smooth: po.Uncertainty) -> None:
    found = smooth["length"]
    assert found.failed == 0.0
    assert found.nonlinearity < 0.05
    assert found.sd == pytest.approx(found.linear_sd, rel=0.05)
    assert found.mean == pytest.approx(found.linear_mean, abs=0.1 * found.linear_sd)
    assert found.error < 1e-8 * FLAP.eta
    assert all("disagree" not in words for words in found.warnings)
    # Nearly linear: the indices are the shares of the linear variance.
    shares = [(found.derivatives[n] * smooth.inputs[n].sd / found.linear_sd) ** 2 for n in smooth.inputs]
    assert found.indices is not None
    low, high = found.indices.first_interval.T
    assert (low - 0.02 < shares).all()
    assert (shares < high + 0.02).all()
    assert sum(found.indices.total) == pytest.approx(1.0, abs=0.15)
    assert "64 base samples" in found.indices.statement


def test_every_sample_is_the_single_call(smooth: po.Uncertainty) -> None:
    found = smooth["length"]
    assert found.values.shape == (128,)
    for i in (0, 50, 127):
        rod = po.Rod(**{name: float(values[i]) for name, values in smooth.samples.items()})
        single = po.length_given_pressure(rod, 105e3)
        assert abs(found.values[i] - single.length) <= found.error + rod.eta * single.error
        offsets = [found.derivatives[n] * (smooth.samples[n][i] - getattr(FLAP, n)) for n in SPREAD]
        assert found.linear_values[i] == pytest.approx(found.nominal + sum(offsets), rel=1e-14)


def test_the_seed_decides(smooth: po.Uncertainty) -> None:
    again = po.uncertainty(FLAP, SPREAD, pressure=105e3, samples=64, workers=1, indices=False)
    other = po.uncertainty(FLAP, SPREAD, pressure=105e3, samples=64, workers=1, indices=False, seed=1)
    assert (again["length"].values == smooth["length"].values).all()
    assert (other["length"].values != smooth["length"].values).any()
    assert again["length"].indices is None


def test_quantiles_of_one_input_are_the_answers_at_its_quantiles() -> None:
    # The pressure falls with the length throughout.
    found = po.uncertainty(
        FLAP, {"length": (1.85e-3, 1.95e-3)}, length=1.9e-3, samples=32, indices=False, workers=1
    )
    p = found["pressure"]
    for share in (0.0, 0.5, 1.0):
        exact = po.pressure_given_length(FLAP, 1.95e-3 - share * 0.1e-3).pressure
        assert p.quantile(share) == pytest.approx(exact, rel=0.01)
    assert p.quantile(0.1) < p.quantile(0.9)


def test_near_a_fold_failures_are_counted_and_disagreement_is_said() -> None:
    ratio_one = po.Rod.from_ratio(1.0)
    found = po.uncertainty(ratio_one, {"length": 0.02}, length=3.03, samples=64, workers=1)["pressure"]
    assert 0.05 < found.failed < 0.5
    assert found.reasons == {"no-equilibrium": round(found.failed * 128)}
    # The lengths below that of the fold are those without a state.
    assert found.failed == pytest.approx(stats.norm(3.03, 0.02).cdf(3.013827495), abs=0.02)
    assert found.indices is None
    assert found.nonlinearity > 0.1
    text = str(found)
    assert "linear and sampled disagree" in text
    assert f"{100.0 * found.failed:.2g} % of 128 samples have no answer" in text
    title = found_title(found)
    assert "no answer" in title
    assert "disagree" in title


def found_title(found: Any) -> str:
    from peel_opt.plots.spread import plot_spread

    return plot_spread(found).get_title("left")


def test_at_a_fold_there_is_no_linear_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    from peel_opt.studies.uncertainty import run as propagation

    def refuses(subject: Any) -> Any:
        raise po.AtFold("a fold")

    monkeypatch.setattr(propagation, "sensitivities", refuses)
    found = po.uncertainty(po.Rod.from_ratio(1.0), {"length": "0.1 %"}, length=3.05, samples=4, workers=1)
    assert math.isinf(found["pressure"].linear_sd)
    assert "fold" in str(found)
    assert "fold" in found_title(found["pressure"])


def test_limits_of_a_rod() -> None:
    spread = {"bending_stiffness": "3 %", "adhesion_strength": "3 % lognormal"}
    found = po.uncertainty(FLAP, spread, samples=16, workers=1)
    assert list(found.quantities) == ["readhesion_pressure", "maxwell_length"]
    least, maxwell = found["readhesion_pressure"], found["maxwell_length"]
    assert least.nominal == pytest.approx(po.readhesion_pressure(FLAP).pressure, rel=1e-9)
    for i in (3, 20):
        rod = po.Rod(*(float(found.samples[n][i]) for n in spread), FLAP.adhesion_range)
        assert abs(least.values[i] - po.readhesion_pressure(rod).pressure) < least.error
        assert maxwell.values[i] == pytest.approx(rod.adhesion_range * po.maxwell_length(rod.ratio, "branch"))
    assert least.error < 1e-7 * FLAP.adhesion_strength
    assert least.linear_sd == pytest.approx(0.03 * least.nominal * math.hypot(0.48493, 1.48493), rel=1e-4)
    assert maxwell.linear_sd == pytest.approx(0.03 * maxwell.nominal * math.hypot(0.27938, 0.27938), rel=1e-4)


def test_powers_of_lognormal_inputs_have_the_known_distribution_and_indices() -> None:
    # Towards p = T0 the length is pi (k y0/T0)^(1/4): a lognormal number with elasticities of 1/4.
    rod, percent = po.Rod(1.0, 1.0, 0.005), {"bending_stiffness": 20.0, "adhesion_range": 30.0}
    spread = {name: f"{value} % lognormal" for name, value in percent.items()}
    found = po.uncertainty(rod, spread, pressure=1.0 - 1e-9, samples=256, workers=1)["length"]
    assert found.nominal == pytest.approx(math.pi * 0.005**0.25, rel=1e-10)
    for name in spread:
        assert found.derivatives[name] * getattr(rod, name) / found.nominal == pytest.approx(0.25, abs=1e-9)
    variances = np.log1p([(0.01 * value) ** 2 for value in percent.values()])
    shares, whole = variances / 16.0, variances.sum() / 16.0
    median = found.nominal * math.exp(-0.125 * variances.sum())
    for share in (0.025, 0.16, 0.5, 0.84, 0.975):
        exact = median * math.exp(stats.norm.ppf(share) * math.sqrt(whole))
        assert found.quantile(share) == pytest.approx(exact, rel=0.01)
    assert found.mean == pytest.approx(median * math.exp(0.5 * whole), rel=1e-3)
    assert found.indices is not None
    assert found.indices.first == pytest.approx(np.expm1(shares) / math.expm1(whole), abs=0.03)
    total = 1.0 - np.expm1(whole - shares) / math.expm1(whole)
    assert found.indices.total == pytest.approx(total, abs=0.03)


def test_sobol_indices_of_the_ishigami_function() -> None:
    drawn = Sample.drawn([spread_of("length", (1e-9, 2.0 * math.pi), math.pi)] * 3, 1024, 0, True)
    x, y, z = (drawn.inputs - math.pi).T
    found = drawn.indices(np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x))
    assert found is not None
    assert found.first == pytest.approx([0.3139, 0.4424, 0.0], abs=0.05)
    assert found.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.05)
    low, high = found.total_interval.T
    assert ((low < [0.5576, 0.4424, 0.2437]) & (high > [0.5576, 0.4424, 0.2437])).all()
    assert drawn.indices(np.ones(len(x))) is None


def test_a_mixed_sample_without_an_answer_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from peel_opt.studies.uncertainty import run as propagation

    def answers(rod: po.Rod, varied: dict[str, np.ndarray], *_: Any) -> Sampled:
        values = np.full(len(varied["bending_stiffness"]), 1.7e-3)
        values[8 + 3] = math.nan
        return Sampled(values, np.full(len(values), "certified"), 0.0)

    monkeypatch.setattr(propagation, "_answers", answers)
    found = po.uncertainty(FLAP, SPREAD, pressure=105e3, samples=4)["length"]
    assert found.indices is None
    assert found.failed == 0.0
    assert "no Sobol indices: 1 of the samples mixed for them" in str(found)


def test_a_spread_below_the_error_of_the_answers_is_said() -> None:
    found = po.uncertainty(FLAP, {"bending_stiffness": "1e-13 %"}, pressure=105e3, samples=2, workers=1)
    assert "errors of up to" in str(found["length"])
    assert "trust the linear estimate" in str(found["length"])


def test_numbers_of_a_rod_known_by_its_ratio_have_its_units(tmp_path: Path) -> None:
    rod = po.Rod.from_ratio(1.0)
    found = po.uncertainty(rod, {"bending_stiffness": "1 %"}, pressure=0.8, samples=2, workers=1)
    assert "mean 1 T0 eta^3" in repr(found)
    title = found.to_csv(tmp_path / "samples.csv").read_text().splitlines()[0]
    assert title == "bending_stiffness [T0 eta^3],length [eta]"


def test_a_rod_that_has_no_maxwell_point_is_a_failed_sample() -> None:
    rod = po.Rod.from_ratio(0.51)
    found = po.uncertainty(rod, {"adhesion_range": "3 %"}, of="maxwell_length", samples=32, indices=False)
    ratios = 1.0 / found.samples["adhesion_range"]
    missing = ~np.isfinite(found["maxwell_length"].values)
    assert 0 < missing.sum() < 64
    assert (ratios[missing] < 0.4996 + 1e-4).all()
    assert found["maxwell_length"].reasons == {"no-equilibrium": int(missing.sum())}


@pytest.mark.parametrize("ratio", [pytest.param(0.4998, marks=pytest.mark.slow), 0.501, 0.7, 30.0])
def test_the_error_of_a_maxwell_length_holds_next_to_the_turn(ratio: float) -> None:
    rod = po.Rod.from_ratio(ratio)
    found = po.uncertainty(rod, {"bending_stiffness": "0.03 %"}, of="maxwell_length", samples=2)
    stiffness, answers = found.samples["bending_stiffness"], found["maxwell_length"]
    places = [int(np.argmin(stiffness)), int(np.argmax(stiffness))]
    for i in places:
        sample = replace(rod, bending_stiffness=float(stiffness[i]))
        solved = sample.length(maxwell_gradient(sample.ratio).value)
        assert abs(answers.values[i] - solved) <= answers.error
    assert answers.error < (1e-7 if ratio < 0.51 else 1e-10) * answers.nominal


def test_interpolation_falls_back_to_single_calls() -> None:
    from peel_opt.analysis.flaws import PressureLimit

    def kinked(r: float) -> PressureLimit:
        if r > 1.9:
            raise po.OutOfRange("too large")
        return PressureLimit(0.0, abs(r - 1.0), 0.0, 1e-15, "")

    ratios = np.linspace(0.5, 2.0, 60)
    values, status, _ = interpolated(kinked, ratios, 1e-8)
    good = ratios <= 1.9
    assert values[good] == pytest.approx(abs(ratios[good] - 1.0), abs=1e-14)
    assert set(status[~good]) == {"out-of-range"}
    assert np.isnan(values[~good]).all()


def test_samples_that_make_no_rod_are_failures() -> None:
    wide = {"bending_stiffness": stats.norm(2.3e-5, 2e-5)}
    found = po.uncertainty(FLAP, wide, pressure=105e3, samples=32, indices=False, workers=1)
    assert found["length"].reasons["invalid-input"] == (found.samples["bending_stiffness"] <= 0.0).sum() > 0


@pytest.mark.parametrize(
    ("given", "mean", "sd", "words"),
    [
        (2.0, 20.0, 2.0, "normal"),
        ("10 %", 20.0, 2.0, "normal"),
        ("10 % lognormal", 20.0, 2.0, "lognormal"),
        ("10 % uniform", 20.0, 4.0 / math.sqrt(12.0), "uniform"),
        ((10.0, 22.0), 16.0, 12.0 / math.sqrt(12.0), "uniform"),
        ("1000 cm .. 22 m", 16.0, 12.0 / math.sqrt(12.0), "uniform"),
        ("50 cm", 20.0, 0.5, "normal"),
        ("10 .. 22 m", 16.0, 12.0 / math.sqrt(12.0), "uniform"),
        ((20.0, 22.0), 21.0, 2.0 / math.sqrt(12.0), "uniform"),
        (stats.gamma(4.0, scale=5.0), 20.0, 10.0, "gamma"),
    ],
)
def test_forms_of_a_spread(given: Any, mean: float, sd: float, words: str) -> None:
    found = spread_of("length", given, 20.0)
    assert (found.mean, found.sd, found.words) == (pytest.approx(mean), pytest.approx(sd), words)
    assert found.quantiles(np.array([0.5]))[0] == pytest.approx(float(found.distribution.median()))


@pytest.mark.parametrize(
    "given",
    [
        *(
            "",
            "10",
            "10 kg",
            "-5 %",
            "0 %",
            "3 m .. 2 m",
            "10 m .. 22 m lognormal",
            0.0,
            -1.0,
            math.nan,
            True,
            None,
        ),
        *((2.0, 1.0), (1.0,), (10.0, 19.0), ("10 Pa", "22 Pa"), stats.cauchy(), stats.norm([1.0, 2.0])),
        *(stats.norm(1.0, 0.1), stats.multivariate_normal([0.0, 0.0])),
    ],
)
def test_what_is_no_spread_is_refused(given: Any) -> None:
    with pytest.raises(po.InvalidInput, match="length"):
        spread_of("length", given, 20.0)


@pytest.mark.parametrize(
    ("spread", "named", "words"),
    [
        ({}, {}, "nothing is uncertain"),
        ({"length": 1e-5}, {"pressure": 1e5}, "no input"),
        ({"bending_stiffness": 1e-6}, {"pressure": 1e5, "length": 1e-3}, "not both"),
        ({"bending_stiffness": 1e-6}, {"pressure": 1e5, "of": "pressure"}, "there is no 'pressure'"),
        ({"bending_stiffness": 1e-6}, {"samples": 100}, "power of 2"),
        ({"bending_stiffness": 1e-6}, {"samples": 2**33}, "at most"),
        ({"bending_stiffness": 1e-6, "adhesion_range": 1e-5}, {"samples": 2**21}, "the limit is"),
        ({"bending_stiffness": 1e-6}, {"seed": -1}, "seed"),
        ({"bending_stiffness": 1e-6}, {"of": 3}, "there is no 3"),
        ({"bending_stiffness": 1e-6}, {"law": "linear"}, "under law"),
        ({"bending_stiffness": 1e-6}, {"state": "folded"}, "of unfolded states"),
        ({"bending_stiffness": 1e-6}, {"tol": -1.0}, "tol"),
        ({"bending_stiffness": 1e-6}, {"indices": "no"}, "indices must be True or False"),
        ({"pressure": "1 %"}, {"pressure": 1e5, "of": "maxwell_length"}, "depends on nothing"),
        (["bending_stiffness"], {}, "nothing is uncertain"),
    ],
)
def test_what_cannot_be_meant_is_refused(spread: Any, named: dict[str, Any], words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        po.uncertainty(FLAP, spread, **named)
    with pytest.raises(po.NoEquilibrium):
        po.uncertainty(FLAP, {"length": "1 %"}, length=1e-3)


def test_picture_and_table(tmp_path: Path, smooth: po.Uncertainty) -> None:
    ax = smooth.plot()
    assert ax.get_xlabel() == r"$\bar s$ [mm]"
    assert ax.get_ylabel() == "probability per mm"
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["128 samples", "their density", "linear estimate"]
    lines = smooth.to_csv(tmp_path / "samples.csv").read_text().splitlines()
    assert lines[0].split(",")[-1] == "length [m]"
    assert float(lines[1].split(",")[-1]) == smooth["length"].values[0]
    assert json.loads(json.dumps(smooth.record()))["results"][0]["sobol"]["bending_stiffness"]["total"] > 0.1


def test_the_order_in_which_inputs_are_given_does_not_matter(smooth: po.Uncertainty) -> None:
    turned = dict(reversed(SPREAD.items()))
    again = po.uncertainty(FLAP, turned, pressure=105e3, samples=64, workers=1, indices=False)
    assert list(again.inputs) == list(SPREAD)
    assert (again["length"].values == smooth["length"].values).all()


@pytest.mark.parametrize("text", ["5 %", "+- 5 %", "± 5 %", "+/- 5 %", "7 kPa", "+-7 kPa", "+/-7 kPa"])
def test_a_spread_may_have_its_sign(text: str) -> None:
    spread = spread_of("adhesion_strength", text, 140e3)
    assert (spread.mean, spread.sd) == pytest.approx((140e3, 7e3), rel=1e-12)


def test_a_spread_has_no_value_beside_it() -> None:
    with pytest.raises(po.InvalidInput, match=r"beside a value, '150 kPa \+- 5 %'\. Its value is 140000"):
        spread_of("adhesion_strength", "150 kPa +- 5 %", 140e3)


def test_quantities_are_spreads() -> None:
    units = pint.UnitRegistry()
    for given, sd in (
        (7.0 * units.kPa, 7e3),
        ((130 * units.kPa, 0.15 * units.MPa), 20e3 / math.sqrt(12.0)),
        ([130, 150] * units.kPa, 20e3 / math.sqrt(12.0)),
    ):
        assert spread_of("adhesion_strength", given, 140e3).sd == pytest.approx(sd, rel=1e-12)
    for given in (7.0 * units.mm, (130 * units.kPa, 150 * units.mm)):
        with pytest.raises(po.InvalidInput, match="cannot be taken in 'millimeter'"):
            spread_of("adhesion_strength", given, 140e3)


def test_each_default_limit_stands_alone(capsys: pytest.CaptureFixture[str]) -> None:
    # Its ratio, 0.13, lies below the least that has a Maxwell point, 0.4996.
    card = str(Path(__file__).parents[2] / "problems" / "film_dressing.toml")
    asked = ["uncertainty", "--card", card, "--T0", "20 %", "--samples", "8", "--no-indices"]
    assert main(asked) == 0
    printed = capsys.readouterr().out
    assert "readhesion_pressure: " in printed
    assert "maxwell_length: none, " in printed
    assert "Maxwell" in printed.rpartition("none, ")[2]
    assert main([*asked, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert [found["name"] for found in record["results"]] == ["readhesion_pressure"]
    assert list(record["missing"]) == ["maxwell_length"]
    assert main([*asked, "--of", "readhesion_pressure", "maxwell_length"]) == 1


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    card = str(Path(__file__).parents[2] / "problems" / "aortic_flap.toml")
    command = ["uncertainty", "--card", card, "--k", "+- 5 %", "--pressure", "100 kPa +- 1 kPa"]
    few = ["--samples", "8", "--no-indices"]
    assert main([*command, *few, "--out", str(tmp_path)]) == 0
    assert "length: 1.7" in capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} == {
        "samples-aortic-flap.csv",
        "length-aortic-flap.png",
        "written.json",
    }
    assert main([*command, *few, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    expected = {"unit": "Pa", "nominal": 1e5, "mean": 1e5, "sd": 1e3, "distribution": "normal"}
    assert record["inputs"]["pressure"] == expected
    own = [
        "uncertainty",
        "--card",
        card,
        "--k",
        "22 .. 23 uN m",
        "--pressure",
        "0.7 T0 +- 1 %",
        *few,
        "--json",
    ]
    assert main(own) == 0
    inputs = json.loads(capsys.readouterr().out)["inputs"]
    assert inputs["pressure"]["nominal"] == pytest.approx(0.7 * 140.1e3)
    assert inputs["bending_stiffness"]["nominal"] == pytest.approx(22.5e-6)
    assert main(["uncertainty", "--k", "1 uN m .. 3 uN m", "--T0", "1 MPa"]) == 2
    assert main(["uncertainty", "--card", card, "--length", "+- 5 %"]) == 2
    assert main(["uncertainty", "--card", card]) == 2
    assert split("1 m ± 2 %") == ("1 m", "2 %")
    assert split("1 m +/- 2 %") == ("1 m", "2 %")
    assert split("2 % uniform") == ("", "2 % uniform")
    assert split("1 m .. 2 m") == ("", "1 m .. 2 m")
