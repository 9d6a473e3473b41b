"""Uncertainty in what people know: sheets, the work of separation, correlations, snaps, and lost samples.

Modules: `material`, `correlation`, `flaws_of_many`, `fates`, `app.cli.material_of_many`.
"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy import stats

import peel_opt as po
from peel_opt.analysis.nearby_snaps import NearbySnaps
from peel_opt.app.cli.main import main
from peel_opt.model.rod import MATERIAL
from peel_opt.studies.uncertainty.correlation import Scores, correlations_of
from peel_opt.studies.uncertainty.flaws_of_many import snaps_of
from peel_opt.studies.uncertainty.inputs import spread_of
from peel_opt.studies.uncertainty.material import BOND, Ingredients

from ..rods import FLAP

TAPE = po.Rod.from_sheet("1.5 GPa", "40 um", 0.4, "0.5 MPa", "100 J/m^2")
FEW = {"pressure": 350e3, "samples": 32, "indices": False, "workers": 1}


@pytest.mark.parametrize(
    "uncertain", [("youngs_modulus",), ("thickness", "work_of_separation"), ("poisson_ratio",)]
)
@pytest.mark.parametrize("hold", [None, *BOND])
def test_slopes_are_those_of_the_numbers(uncertain: tuple[str, ...], hold: str | None) -> None:
    if hold in uncertain:
        return
    material = Ingredients.of(TAPE, uncertain, hold)
    nominal = material.nominal
    at = {name: np.array([value]) for name, value in nominal.items()}
    made = material.numbers(at)
    for name in MATERIAL:
        assert made[name][0] == pytest.approx(getattr(TAPE, name), rel=1e-14)
    for number in MATERIAL:
        slopes = material.slopes({number: 1.0})
        for name, value in nominal.items():
            step = 1e-6 * value
            up, down = (
                material.numbers(at | {name: np.array([value + s])})[number][0] for s in (step, -step)
            )
            assert slopes.get(name, 0.0) == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-300), (
                name
            )


def test_a_sheet_is_sampled_as_the_rods_it_makes() -> None:
    spread = {"thickness": "2 um", "youngs_modulus": "10 % lognormal", "work_of_separation": "5 %"}
    found = po.uncertainty(TAPE, spread, **FEW)["length"]  # type: ignore[arg-type]
    again = po.uncertainty(TAPE, dict(reversed(spread.items())), **FEW)  # type: ignore[arg-type]
    assert np.array_equal(found.values, again["length"].values)
    for i in (0, 40):
        E, h, G = (float(again.samples[n][i]) for n in ("youngs_modulus", "thickness", "work_of_separation"))
        single = po.length_given_pressure(po.Rod.from_sheet(E, h, 0.4, 0.5e6, G), 350e3)
        assert found.values[i] == pytest.approx(single.length, rel=1e-9)
    assert found.linear_sd == pytest.approx(found.sd, rel=0.1)


def test_strength_may_vary_at_the_same_work() -> None:
    free = po.uncertainty(TAPE, {"adhesion_strength": "5 %"}, **FEW)["length"]  # type: ignore[arg-type]
    held = po.uncertainty(TAPE, {"adhesion_strength": "5 %"}, hold="work_of_separation", **FEW)["length"]  # type: ignore[arg-type]
    up = po.Rod(TAPE.bending_stiffness, 1.001 * TAPE.adhesion_strength, TAPE.adhesion_range / 1.001)
    slope = (po.length_given_pressure(up, 350e3).length - held.nominal) / (1e-3 * TAPE.adhesion_strength)
    assert held.derivatives["adhesion_strength"] == pytest.approx(slope, rel=5e-3)
    assert held.derivatives != free.derivatives


def test_what_says_one_thing_twice_is_refused() -> None:
    ask = {"pressure": 350e3, "samples": 4}
    for rod, spread, options, words in (
        (FLAP, {"thickness": "5 %"}, {}, "does not say what it was cut from"),
        (TAPE, {"thickness": "5 %", "bending_stiffness": "5 %"}, {}, "follows from thickness"),
        (TAPE, dict.fromkeys(BOND, "5 %"), {}, "too many"),
        (TAPE, {"adhesion_strength": "5 %"}, {"hold": "adhesion_strength"}, "held and uncertain"),
        (TAPE, {"adhesion_strength": "5 %"}, {"hold": "thickness"}, "cannot hold"),
        (TAPE, {"flaw": "5 %"}, {}, "no input"),
        (TAPE, {"adhesion_strength": "5 %"}, {"of": "safe_pressure"}, "at a flaw"),
        (TAPE, {"adhesion_strength": "5 %"}, {"flaw": 1e-3}, "one of pressure, length and flaw"),
        (TAPE, {"adhesion_strength": "5 %"}, {"correlations": [[1.0, 0.2], [0.2, 1.0]]}, "1 x 1"),
    ):
        with pytest.raises(po.InvalidInput, match=words):
            po.uncertainty(rod, spread, **{**ask, **options})  # type: ignore[arg-type]


def test_a_copy_of_another_stiffness_forgets_its_sheet() -> None:
    from dataclasses import replace

    assert replace(TAPE, adhesion_strength=1e6).sheet == TAPE.sheet
    assert replace(TAPE, bending_stiffness=1e-5).sheet is None
    assert po.Rod(*(getattr(TAPE, name) for name in MATERIAL)) == TAPE


def test_samples_have_the_correlations_that_were_given() -> None:
    spreads = [
        spread_of("bending_stiffness", "30 % lognormal", 2e-5),
        spread_of("adhesion_strength", "20 % uniform", 1e5),
        spread_of("adhesion_range", stats.norm(1e-3, 5e-5), 1e-3),
    ]
    wanted = np.array([[1.0, 0.6, -0.3], [0.6, 1.0, 0.2], [-0.3, 0.2, 1.0]])
    shares = np.clip(stats.qmc.Sobol(3, seed=1).random(2**14), 1e-12, 1 - 1e-12)
    scores = Scores(spreads, wanted).correlated(shares)
    columns = np.stack([s.quantiles(scores[:, i]) for i, s in enumerate(spreads)])
    assert np.abs(np.corrcoef(columns) - wanted).max() < 2e-3
    assert np.allclose(columns.std(axis=1), [s.sd for s in spreads], rtol=5e-3)  # each as it was
    with pytest.raises(po.InvalidInput, match="have a correlation of at most"):
        Scores(spreads[:2], np.array([[1.0, 0.999], [0.999, 1.0]]))


def test_correlations_are_read_in_the_callers_order_or_by_name() -> None:
    names, order = ("b", "a", "c"), ("a", "b", "c")
    matrix = np.array([[1.0, 0.5, 0.0], [0.5, 1.0, -0.2], [0.0, -0.2, 1.0]])
    both = (
        correlations_of(matrix, names, order),
        correlations_of({("a", "b"): 0.5, ("a", "c"): -0.2}, names, order),
    )
    assert np.array_equal(*both)  # type: ignore[arg-type]
    assert both[0][0, 1] == 0.5  # type: ignore[index]
    assert correlations_of(np.eye(3), names, order) is None
    for wrong in (
        matrix[:2],
        matrix + 1.0,
        np.triu(matrix),
        {("a", "b"): 0.9, ("b", "c"): 0.9, ("a", "c"): -0.9},
        {("a", "b"): 0.5, ("b", "a"): 0.4},
        {("a", "d"): 0.5},
        {"a": 0.5},
        "x",
    ):
        with pytest.raises(po.InvalidInput):
            correlations_of(wrong, names, order)


def test_the_linear_estimate_knows_the_correlations() -> None:
    spread = {"bending_stiffness": "5 %", "adhesion_range": "5 %"}
    alone, both = (
        po.uncertainty(FLAP, spread, pressure=105e3, samples=64, workers=1, correlations=c)["length"]
        for c in (None, [[1.0, 0.9], [0.9, 1.0]])
    )
    parts = [both.derivatives[n] * 0.05 * getattr(FLAP, n) for n in spread]
    assert both.linear_sd == pytest.approx(
        math.sqrt(parts[0] ** 2 + parts[1] ** 2 + 1.8 * parts[0] * parts[1])
    )
    assert both.sd == pytest.approx(both.linear_sd, rel=0.05)
    assert both.linear_sd > 1.1 * alone.linear_sd
    assert alone.indices is not None
    assert both.indices is None
    assert "the inputs are correlated" in str(both)


def test_distributions_of_scipy_of_both_kinds() -> None:
    newer = spread_of("adhesion_strength", stats.Normal(mu=1.4e5, sigma=7e3), 140e3)
    older = spread_of("adhesion_strength", stats.norm(1.4e5, 7e3), 140e3)
    assert (newer.mean, newer.sd) == (older.mean, older.sd)
    assert np.allclose(newer.quantiles(np.array([0.1, 0.9])), older.quantiles(np.array([0.1, 0.9])))


def test_samples_without_an_answer_are_told_apart() -> None:
    found = po.uncertainty(FLAP, {"pressure": "60 kPa"}, pressure=80e3, samples=32, workers=1)["length"]
    pressures = stats.norm(80e3, 60e3)
    closes, off = (found.fates[name] / 64 for name in ("re-adhere", "break off"))
    assert closes == pytest.approx(pressures.cdf(25942.398), abs=0.03)
    assert off == pytest.approx(pressures.sf(140e3), abs=0.03)
    assert found.failed == closes + off
    assert f"{found.fates['re-adhere']} re-adhere: what is lifted closes" in str(found)
    broken = po.uncertainty(TAPE, {"thickness": "60 %"}, **FEW)["length"]  # type: ignore[arg-type]
    assert broken.fates["make no rod"] > 0


@pytest.mark.slow
def test_lengths_without_an_answer_are_told_apart() -> None:
    held = po.uncertainty(FLAP, {"length": "0.4 mm"}, length=2.2e-3, samples=32, workers=1)["pressure"]
    lengths = stats.norm(2.2e-3, 0.4e-3)
    assert held.fates["re-adhere"] / 64 == pytest.approx(lengths.cdf(1.734172664e-3), abs=0.03)
    assert held.fates["break off"] / 64 == pytest.approx(lengths.sf(2.622224924e-3), abs=0.03)


def test_critical_lengths_are_in_closed_form() -> None:
    found = po.uncertainty(TAPE, {"thickness": "5 %"}, of="critical_length", samples=64, workers=1)[
        "critical_length"
    ]
    assert found.nominal == TAPE.critical_length
    assert found.linear_sd == pytest.approx(0.05 * 0.75 * TAPE.critical_length, rel=1e-12)  # k ~ h^3


@pytest.mark.slow
def test_a_snap_beside_another_is_the_one_that_is_walked_to() -> None:
    rng = np.random.default_rng(5)
    for flaw, given in ((False, 0.4), (True, 0.9)):
        snaps = NearbySnaps(flaw)
        snaps.at(0.75, given)
        for _ in range(4):
            r, g = 0.75 * np.exp(rng.uniform(-0.3, 0.3)), given * np.exp(rng.uniform(-0.3, 0.3))
            value, error = snaps.at(r, g)
            rod = po.Rod.from_ratio(r)
            walked = po.safe_pressure(rod, g).pressure if flaw else po.critical_flaw(rod, g).flaw
            assert abs(value - walked) < 1e-10 + error


@pytest.mark.slow
@pytest.mark.parametrize(("name", "given"), [("critical_flaw", 50e3), ("safe_pressure", 0.5e-3)])
def test_snaps_of_many_are_those_of_each(name: str, given: float) -> None:
    rng = np.random.default_rng(3)
    rods = {n: getattr(FLAP, n) * np.exp(0.06 * rng.normal(size=400)) for n in MATERIAL}
    rods["bending_stiffness"][0] = -1.0
    pressures = np.full(400, given)
    pressures[1] = 1e6 if name == "critical_flaw" else given
    values, status, error = snaps_of(name, rods, pressures)
    assert status[0] == "invalid-input"
    assert (status[1] == "out-of-range") == (name == "critical_flaw")
    assert error < 1e-3 * np.nanstd(values)
    for i in (2, 77, 301, int(np.nanargmax(values))):
        rod = po.Rod(*(float(rods[n][i]) for n in MATERIAL))
        single = (
            po.critical_flaw(rod, given).flaw
            if name == "critical_flaw"
            else po.safe_pressure(rod, given).pressure
        )
        assert abs(values[i] - single) <= error


@pytest.mark.slow
def test_the_slopes_of_a_snap_are_those_of_the_calls() -> None:
    spread = {"bending_stiffness": "1 %", "adhesion_strength": "1 %", "adhesion_range": "1 %"}
    flaws = po.uncertainty(
        FLAP, spread | {"pressure": "1 %"}, pressure=50e3, of="critical_flaw", samples=8, indices=False
    )
    safe = po.uncertainty(FLAP, spread | {"flaw": "1 %"}, flaw=0.5e-3, samples=8, indices=False)
    for found, call, at in (
        (flaws["critical_flaw"], lambda rod, p: po.critical_flaw(rod, p).flaw, ("pressure", 50e3)),
        (safe["safe_pressure"], lambda rod, a: po.safe_pressure(rod, a).pressure, ("flaw", 0.5e-3)),
    ):
        numbers = {n: getattr(FLAP, n) for n in MATERIAL} | {at[0]: at[1]}
        for name, value in numbers.items():
            up, down = (numbers | {name: value * (1.0 + s)} for s in (1e-4, -1e-4))
            ends = [call(po.Rod(*(n[m] for m in MATERIAL)), n[at[0]]) for n in (up, down)]
            assert found.derivatives[name] == pytest.approx((ends[0] - ends[1]) / (2e-4 * value), rel=1e-5), (
                name
            )


def test_the_command_takes_sheets(capsys: pytest.CaptureFixture[str]) -> None:
    sheet = ["--E", "1.5 GPa +- 10 %", "--thickness", "38 .. 42 um", "--nu", "0.4", "--T0", "0.5 MPa"]
    asked = [*sheet, "--work", "100 J/m^2 +- 5 %", "--pressure", "0.7 T0", "--samples", "8", "--json"]
    assert main(["uncertainty", *asked, "--correlation", "E,thickness=-0.4"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["inputs"]["thickness"]["nominal"] == pytest.approx(40e-6)
    assert found["inputs"]["work_of_separation"]["unit"] == "J/m^2"
    assert found["correlations"] == [{"inputs": ["youngs_modulus", "thickness"], "value": -0.4}]
    assert found["results"][0]["nominal"] == pytest.approx(po.length_given_pressure(TAPE, 350e3).length)
    for wrong in (
        ["--correlation", "E=0.4"],
        ["--correlation", "E,k=0.4"],
        ["--hold", "k"],
        ["--k", "1 uN m"],
    ):
        assert main(["uncertainty", *asked, *wrong]) == 2
    capsys.readouterr()


def test_sweeps_take_sheets(capsys: pytest.CaptureFixture[str]) -> None:
    sheet = ["--thickness", "40 um", "--nu", "0.4", "--T0", "0.5 MPa", "--pressure", "350 kPa", "--json"]
    assert main(["sweep", "--E", "1.5:3 GPa:2", "--work", "100 J/m^2", *sheet]) == 0
    first, second = json.loads(capsys.readouterr().out)["points"]
    assert first["length [m]"] == pytest.approx(po.length_given_pressure(TAPE, 350e3).length, rel=1e-9)
    assert second["bending_stiffness [N m]"] == pytest.approx(2 * TAPE.bending_stiffness)
    assert main(["sweep", "--E", "1:2 GPa:2", "--work", "90, 100 J/m^2", *sheet]) == 0
    assert len(json.loads(capsys.readouterr().out)["points"]) == 4
    for wrong in (
        ["--E", "1:2 GPa:2", "--work", "1 J"],
        ["--E", "1 GPa", "--work", "9 J/m^2", "--y0", "1 mm"],
    ):
        assert main(["sweep", *wrong, *sheet]) == 2
    capsys.readouterr()
