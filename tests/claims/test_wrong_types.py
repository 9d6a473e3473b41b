"""Every argument of every public call with a value of the wrong kind: an answer, or a typed error."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import peel_opt as po

from ..rods import FLAP

ROD = po.Rod.from_ratio(1.0)

#: Arguments with which a call can be meant, by its name; or a function that makes them.
GOOD: dict[str, Callable[[], dict[str, Any]]] = {
    "Rod": lambda: {"bending_stiffness": 1.0, "adhesion_strength": 1.0, "adhesion_range": 1.0},
    "Spectral": dict,
    "Collocation": dict,
    "Shooting": dict,
    "trapezoidal": lambda: {"plateau": 0.4},
    "pressure_given_length": lambda: {"rod": ROD, "length": 3.2},
    "length_given_pressure": lambda: {"rod": ROD, "pressure": 0.8},
    "equilibrium": lambda: {"beta0": 4.0, "lam": 1.0},
    "answers": lambda: {"ratio": [1.0, 2.0], "pressure_ratio": 0.8},
    "equilibria": lambda: {"rod": ROD, "pressure": 0.8, "law": po.exponential()},
    "trace": lambda: {"beta0": 4.0, "lam": (-1.0, 1.0), "points": 8},
    "follow": lambda: {"start": po.equilibrium(beta0=4.0, lam=1.0), "hold": "beta0", "steps": 3},
    "fold_curve": lambda: {"beta0": (1.0, 2.0), "points": 8},
    "maxwell_curve": lambda: {"beta0": (2.0, 4.0), "points": 6},
    "maxwell_length": lambda: {"ratio": 1.0},
    "least_lambda": lambda: {"beta0": 4.0},
    "lyapunov_schmidt": lambda: {"beta0": 4.0},
    "hysteresis": lambda: {"beta0": 4.0, "points": 5},
    "branch_potential": lambda: {"branch": po.trace(beta0=4.0, lam=(-1.0, 1.0), points=8)},
    "energies": lambda: {"subject": po.trace(ROD, points=8)},
    "stability_changes": lambda: {"branch": po.trace(ROD, points=8)},
    "stability": lambda: {"state": po.length_given_pressure(ROD, 0.8)},
    "control_table": lambda: {"eq": po.length_given_pressure(ROD, 0.8)},
    "sensitivities": lambda: {"subject": po.length_given_pressure(ROD, 0.8)},
    "held_length": lambda: {"rod": ROD, "pressure": 0.5},
    "holding_pressure": lambda: {"rod": ROD, "length": 3.5},
    "readhesion_pressure": lambda: {"rod": ROD},
    "safe_pressure": lambda: {"rod": ROD, "flaw": 1.0},
    "loading_curve": lambda: {"rod": ROD, "flaw": 1.0, "points": 3},
    "critical_flaw": lambda: {"rod": ROD, "pressure": 0.4},
    "energy_release_rate": lambda: {"force": [100.0, 200.0], "angle": 1.5},
    "peel_force": lambda: {"work": 100.0, "angle": 1.5},
    "initiation_force": lambda: {"rod": ROD, "angle": 1.5, "arm": 0.5},
    "load_card": lambda: {"path": Path(__file__).parents[2] / "problems" / "office_tape.toml"},
    "citation": lambda: {"result": po.length_given_pressure(ROD, 0.8)},
    "Scene": lambda: {"rod": ROD},
    "solve": lambda: {"scene": po.Scene(ROD), "free": "length", "pressure": 0.8},
    "Pressure": dict,
    "Weight": lambda: {"w": 0.1},
    "SkinFriction": lambda: {"traction": 0.1},
    "Drag": lambda: {"traction": 0.1},
    "Circle": lambda: {"curvature": 0.1},
    "Flat": dict,
    "TipLoad": dict,
    "Contact": dict,
    "Blister": lambda: {"rod": ROD, "slack": 0.1},
    "EffectiveOpening": lambda: {"zeta": 0.5},
    "ShearSprings": lambda: {"stiffness": 1.0},
    "ElasticLayer": lambda: {"stiffness": 100.0},
    "critical_length": lambda: {"scene": ROD},
    "unfolding": lambda: {"scene": po.Scene(ROD)},
    "touching": lambda: {"rod": ROD, "pressure": 0.8},
    "flat_fold": lambda: {"rod": ROD, "pressure": 0.8},
    "grown_flap": lambda: {"rod": ROD, "pressure": 0.8},
    "largest_flap": lambda: {"rod": ROD},
    "growth_rate": lambda: {"eq": po.length_given_pressure(ROD, 0.8)},
    "critical_drag": lambda: {"eq": po.length_given_pressure(ROD, 0.8)},
    "snap": lambda: {"rod": ROD, "pressure": 0.8, "flaw": 1.0, "drag": 1.0},
    "history": lambda: {"rod": ROD, "pressure": ([0.0, 0.1], [0.3, 0.31])},
    "volume_limits": lambda: {"branch": po.trace(ROD, points=12)},
    "tradeoff": lambda: {
        "problem": lambda method, tol: po.equilibrium(beta0=4.0, lam=1.0, method=method, tol=tol),
        "methods": ("spectral",),
        "tols": (1e-6,),
        "repeats": 1,
    },
    "Measurements": lambda: {"length": [1.9e-3], "pressure": [6e4], "pressure_sd": 500.0},
    "MeasuredShape": lambda: {"x": [0.0, 1e-3], "y": [0.0, 1e-4], "sd": 1e-5, "pressure": 6e4},
    "calibrate": lambda: {
        "data": [po.Measurements([1.765e-3, 1.8e-3], [67e3, 6e4], pressure_sd=500.0)],
        "free": ("adhesion_range",),
        "rod": FLAP,
    },
    "sweep": lambda: {"axes": {"ratio": [1.0, 2.0], "pressure_ratio": 0.8}, "workers": 1},
    "uncertainty": lambda: {
        "rod": FLAP,
        "spread": {"adhesion_strength": "5 %"},
        "pressure": 6e4,
        "samples": 4,
        "indices": False,
        "workers": 1,
    },
    "Target": lambda: {"quantity": "maxwell_length", "equal": 1e-3},
    "design": lambda: {
        "known": FLAP,
        "free": "bending_stiffness",
        "targets": po.Target("maxwell_length", equal="2 mm"),
    },
}

WRONG = [None, "x", -1, 0, float("nan"), [1], {}, object(), 1j, True, (1, 2, 3), b"x", ROD, lambda *_: 1]

#: What is not checked: callables of the caller's, whose own errors are the caller's too.
OWN = {("tradeoff", "problem"), ("tradeoff", "clock"), ("sweep", "progress"), ("uncertainty", "progress")}

#: Every call; a motion and a history take a second, and are asked for dozens of times.
LONG = ("snap", "history")
EVERY = [pytest.param(name, marks=[pytest.mark.slow] if name in LONG else []) for name in GOOD]


@pytest.mark.parametrize("name", EVERY)
def test_arguments_of_the_wrong_kind_raise_typed_errors(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # "x" is a good name for a journal
    call, good = getattr(po, name), GOOD[name]()
    call(**good)
    for parameter in inspect.signature(call).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD or (name, parameter.name) in OWN:
            continue
        for wrong in WRONG:
            try:
                call(**good | {parameter.name: wrong})
            except po.PeelOptError:
                pass
            except TypeError as error:
                if "missing" not in str(error):  # as Python says it of an argument
                    pytest.fail(f"{parameter.name} = {wrong!r:.60}: {error!r}")


#: Kinds of numbers that mean the same as a float.
KINDS = [Fraction, lambda x: Decimal(repr(x)), np.float64, np.array]


@pytest.mark.parametrize("name", EVERY)
def test_any_kind_of_number_is_taken_where_a_number_is(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    call, good = getattr(po, name), GOOD[name]()
    signature = inspect.signature(call)
    given = {k: p.default for k, p in signature.parameters.items() if p.default is not p.empty} | good
    for parameter, value in given.items():
        if type(value) is float and math.isfinite(value):
            for kind in KINDS:
                call(**good | {parameter: kind(value)})


@pytest.mark.parametrize("kind", KINDS)
def test_a_number_of_any_kind_gives_the_same_answer_and_the_same_refusal(kind: Callable) -> None:
    assert po.length_given_pressure(FLAP, kind(60000.0)).length == po.length_given_pressure(FLAP, 6e4).length
    assert po.pressure_given_length(ROD, kind(3.25)).pressure == po.pressure_given_length(ROD, 3.25).pressure
    near = {"beta0": kind(4.0), "lam": kind(-0.125), "near": kind(-2.5)}
    assert po.equilibrium(**near).alpha1 == po.equilibrium(beta0=4.0, lam=-0.125, near=-2.5).alpha1
    with pytest.raises(po.NoEquilibrium, match="100 Pa"):
        po.length_given_pressure(FLAP, kind(100.0))
    with pytest.raises(po.NoEquilibrium, match="9 m"):
        po.pressure_given_length(FLAP, kind(9.0))


#: What is public and not in the table, errors aside: results, and what is read or built otherwise.
RESULTS = """
Answers Branch Calibration Card Citation Design Equilibrium FlawLimit FoldCurve History LargestFlap
LoadingCurve PeelPeak Sensitivities Snap SpecialPoint Stability Sweep Transition Unfolding VolumeLimit
"""
OTHERS = (
    "CohesiveLaw Ipopt Method NormalForm Place Uncertainty Walk WorkPrecision exponential read_measurements"
)


def test_no_public_call_is_forgotten() -> None:
    public = {name: getattr(po, name) for name in po.__all__}
    errors = {n for n, p in public.items() if isinstance(p, type) and issubclass(p, Exception)}
    calls = {n for n, p in public.items() if callable(p)}
    assert calls - errors == set(GOOD) | {*RESULTS.split(), *OTHERS.split(), "read_shape"}


@pytest.mark.parametrize("wrong", [5, (2.5, 3), (3,), 3.0, None, "ab"])
def test_diagrams_of_the_reduction(wrong: object) -> None:
    for name in ("samples", "lam_range", "A_range"):
        with pytest.raises(po.InvalidInput):
            po.lyapunov_schmidt(4.0).diagram(**{name: wrong if name == "samples" else 3.0})


@pytest.mark.parametrize("wrong", [[1], "nothing", 3.0, {}])
def test_limits_that_have_no_sensitivities(wrong: object) -> None:
    with pytest.raises(po.InvalidInput):
        po.sensitivities(ROD, of=wrong)
