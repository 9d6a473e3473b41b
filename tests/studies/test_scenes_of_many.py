"""Sweeps and uncertainties of scenes: the single calls, the same bits however they are split.

Modules: `plan`, `answers`, `run` of the sweep, `run` and `inputs` of the uncertainty.
"""

from __future__ import annotations

import itertools
import math
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import casadi
import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.renumbered import renumbered
from peel_opt.model.scene_record import identity_of
from peel_opt.studies.sweep.answers import NUMBERS, TEXTS

from ..rods import FLAP

ROD = po.Rod.from_ratio(1.0)
HEAVY = po.Scene(ROD, [po.Weight(0.02)])
AXES = {"weight": [0.0, 0.05], "pressure_ratio": [0.1, 0.5, 0.8]}


def same(a: po.Sweep, b: po.Sweep) -> bool:
    """Whether two sweeps agree in every bit."""
    return a.shape == b.shape and all(
        a[name].tobytes() == b[name].tobytes() if name in NUMBERS else (a[name] == b[name]).all()
        for name in (*NUMBERS, *TEXTS)
    )


@pytest.fixture(scope="module")
def whole() -> po.Sweep:
    return po.sweep(AXES, rod=HEAVY, workers=1)


def test_every_point_is_the_single_call_bit_for_bit(whole: po.Sweep) -> None:
    assert whole.asked == "length_ratio"
    for (i, weight), (j, pressure) in itertools.product(*map(enumerate, AXES.values())):
        scene = renumbered(HEAVY, {"weight": weight})
        eq = po.length_given_pressure(scene, pressure, throw=False)
        assert whole["status"][i, j] == eq.status
        if eq.certified:
            got = [whole[n][i, j] for n in ("length_ratio", "alpha1", "error", "certificate", "condition")]
            expected = [eq.length_ratio, eq.alpha1, eq.error, eq.certificate, eq.stats.condition]
            assert [v.hex() for v in got] == [float(v).hex() for v in expected]
    assert whole["status"][0].tolist() == ["no-equilibrium", "certified", "certified"]
    # The least pressure of the plain rod, at which the walk ends; and the message says so.
    assert whole["nearest"][0, 0] == pytest.approx(0.121837041296, rel=1e-3)


def test_a_set_of_numbers_does_not_depend_on_its_neighbours(whole: po.Sweep, tmp_path: Path) -> None:
    alone = po.sweep({"weight": [0.05], "pressure_ratio": AXES["pressure_ratio"]}, rod=HEAVY, workers=1)
    for name in NUMBERS:
        assert alone[name].tobytes() == whole[name][1:].tobytes()
    backwards = po.sweep({**AXES, "weight": [0.05, 0.0]}, rod=HEAVY, workers=1)
    assert backwards["length_ratio"][::-1].tobytes() == whole["length_ratio"].tobytes()
    listed = {name: np.repeat(values, 1) for name, values in AXES.items()}
    grid = [side.ravel() for side in np.meshgrid(*listed.values(), indexing="ij")]
    zipped = po.sweep(dict(zip(AXES, grid, strict=True)), rod=HEAVY, zipped=True, workers=1)
    assert zipped["length_ratio"].tobytes() == whole["length_ratio"].tobytes()


def test_it_resumes_and_is_kept_with_its_scene(whole: po.Sweep, tmp_path: Path) -> None:
    journal = tmp_path / "kept.journal"
    first = po.sweep(AXES, rod=HEAVY, workers=1, journal=journal)
    assert same(first, whole)
    lines = journal.read_bytes().splitlines(keepends=True)
    assert len(lines) == 3  # its head, and a chunk for each weight
    journal.write_bytes(b"".join(lines[:2]))
    assert same(po.sweep(AXES, rod=HEAVY, workers=1, journal=journal), whole)
    with pytest.raises(po.InvalidInput, match="another sweep"):
        po.sweep(AXES, rod=po.Scene(ROD, [po.Weight(0.02, tilt=0.1)]), workers=1, journal=journal)
    read = po.Sweep.load(whole.save(tmp_path / "sweep.npz"))
    assert same(read, whole)
    assert read.unit("weight") == "T0"
    assert "Weight(w=0.02" in read.options["scene"]
    assert "weight [T0]" in whole.csv_text()
    assert r"\mathrm{weight}/T_0" in str([t.get_text() for t in whole.plot().get_legend().get_texts()])


@pytest.mark.slow
def test_workers_of_any_kind_give_the_same_bits(whole: po.Sweep) -> None:
    assert same(po.sweep(AXES, rod=HEAVY, workers=2), whole)
    with ProcessPoolExecutor(1) as executor:
        assert same(po.sweep(AXES, rod=HEAVY, executor=executor), whole)


def test_what_a_scene_cannot_be_costs_its_own_point_only() -> None:
    scene = po.Scene(ROD, unbonded=0.5)
    found = po.sweep({"unbonded": [-1.0, 0.5], "length": 1.5}, rod=scene, workers=1)
    assert found["status"].tolist() == ["invalid-input", "certified"]
    assert "non-negative" in found["message"][0] or "unbonded" in found["message"][0]
    held = po.solve(scene, free="pressure", length=1.5)
    assert found["pressure"][1] == held.pressure


@pytest.mark.slow
def test_the_ratio_and_the_material_of_a_scene_vary_too() -> None:
    scene = po.Scene(ROD, [po.SkinFriction(traction=0.1)])
    found = po.sweep({"ratio": [0.8, 1.2], "pressure_ratio": 0.7}, rod=scene, workers=1)
    assert found.rod is None
    for r, length in zip((0.8, 1.2), found["length_ratio"], strict=True):
        own = po.Scene(po.Rod.from_ratio(r), scene.loads)
        assert length == po.solve(own, free="length", pressure=0.7).length
    drag = po.Scene(FLAP, [po.Drag(2e3)])
    stronger = po.sweep({"adhesion_strength": [120e3, 140e3], "pressure": 6e4}, rod=drag, workers=1)
    other = po.Rod(FLAP.bending_stiffness, 120e3, FLAP.adhesion_range)
    own = po.solve(po.Scene(other, drag.loads), free="length", pressure=6e4)
    assert stronger["length"][0] == own.length
    assert stronger.unit("length") == "m"


def test_the_papers_scene_is_swept_as_its_rod() -> None:
    asked = {"pressure_ratio": [0.5, 0.8]}
    found = po.sweep(asked, rod=po.Scene(ROD), workers=1)
    assert same(found, po.sweep(asked, rod=ROD, workers=1))


def test_a_scene_of_functions_is_known_by_what_they_compute() -> None:
    """Two processes must agree on which journal is theirs, and two functions must not be taken for one."""

    def scene_with(c: float) -> po.Scene:
        return po.Scene(ROD, [po.Pressure(lambda place: casadi.exp(-c * place.s))])

    assert identity_of(scene_with(0.1)) == identity_of(scene_with(0.1))
    assert identity_of(scene_with(0.1)) != identity_of(scene_with(0.1 + 1e-15))
    assert "0x" not in identity_of(scene_with(0.1))[0]


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: po.sweep({"drag": [0.1], "length": 3.0}, rod=HEAVY), "no axis 'drag'"),
        (lambda: po.sweep({"beta0": [1.0, 2.0], "lam": 0.1}, rod=HEAVY), "and a scene"),
        (lambda: po.sweep(AXES, rod=HEAVY, law="linear"), "own law"),
        (lambda: po.sweep(AXES, rod=ROD), "no axis 'weight'"),
        (lambda: po.sweep({"length": [3.0]}, rod=ROD, state="lifted"), "lifted"),
        (
            lambda: po.sweep({"ratio": [1.0], "pressure_ratio": 0.5}, rod=po.Scene(FLAP, [po.Drag(1.0)])),
            "known by its ratio alone",
        ),
        (lambda: po.uncertainty(HEAVY, {"weight": "10 %"}), "give a pressure or a length"),
        (lambda: po.uncertainty(HEAVY, {"drag": "10 %"}, pressure=0.5), "no input"),
        (
            lambda: po.uncertainty(HEAVY, {"weight": "10 %"}, pressure=0.5, of="maxwell_length"),
            "no 'maxwell_length' here",
        ),
        (
            lambda: po.uncertainty(po.Scene(ROD, [po.Drag(-0.1)]), {"drag": "5 % lognormal"}, pressure=0.5),
            "cannot be lognormal",
        ),
        (
            lambda: po.uncertainty(po.Scene(ROD, [po.Drag(0.0)]), {"drag": "5 %"}, pressure=0.5),
            "share of nothing",
        ),
    ],
)
def test_what_cannot_be_meant_is_refused(ask: Any, words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        ask()


@pytest.mark.slow
def test_uncertainty_of_a_number_of_a_scene_is_that_of_its_samples() -> None:
    """Along one uncertain number answers are a smooth curve, whose slope makes the linear estimate."""
    scene = po.Scene(FLAP, [po.Weight(500.0)])
    found = po.uncertainty(scene, {"weight": "+- 100 Pa uniform"}, pressure=1e5, samples=4, workers=1)[
        "length"
    ]
    step = 100.0
    ends = [
        po.solve(renumbered(scene, {"weight": 500.0 + side * step}), free="length", pressure=1e5).length
        for side in (-1.0, 1.0)
    ]
    slope = (ends[1] - ends[0]) / (2.0 * step)
    assert found.derivatives["weight"] == pytest.approx(slope, rel=1e-4)
    assert found.linear_sd == pytest.approx(abs(slope) * step / math.sqrt(3.0), rel=1e-4)
    assert min(ends) <= found.values.min() <= found.values.max() <= max(ends)
    assert found.failed == 0.0


@pytest.mark.slow
def test_samples_without_an_answer_are_counted() -> None:
    """Beyond the snap of its edge a flap has no lifted state, and the question no answer of its kind."""
    scene = po.Scene(ROD, unbonded=1.0)
    top = po.safe_pressure(ROD, flaw=1.0).pressure
    asked = {"pressure": 0.999 * top, "state": "lifted", "samples": 4, "workers": 1}
    found = po.uncertainty(scene, {"unbonded": (0.9, 1.1)}, **asked)["length"]
    assert 0.0 < found.failed < 1.0
    assert found.reasons.keys() <= {"no-equilibrium", "not-converged"}
    assert np.isfinite(found.values).sum() == round((1.0 - found.failed) * found.values.size)
