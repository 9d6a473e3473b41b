"""Public calls with values nobody means: an answer that can be looked at, or a typed error in one line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

import peel_opt as po
from peel_opt.plots import save_figure

from ..fuzzing import NUMBERS, WILD, examples, hammer, typed
from ..rods import FLAP

ROD = po.Rod.from_ratio(1.0)


#: Public calls with places for wild values; each place also takes a value that can be meant.
CALLS: dict[str, tuple[Callable[..., Any], list[Any]]] = {
    "Rod": (po.Rod, [2.3e-5, 140e3, 0.73e-3]),
    "Rod.from_ratio": (po.Rod.from_ratio, [1.0]),
    "pressure_given_length": (
        lambda x, tol, near: po.pressure_given_length(ROD, x, tol=tol, near=near),
        [5.0, 1e-8, None],
    ),
    "length_given_pressure": (
        lambda x, tol, near: po.length_given_pressure(ROD, x, tol=tol, near=near),
        [0.8, 1e-8, None],
    ),
    "of a real rod": (lambda x, near: po.pressure_given_length(FLAP, x, near=near), [1.9e-3, None]),
    "options": (
        lambda law, state, method: po.length_given_pressure(ROD, 0.8, law=law, state=state, method=method),
        ["auto", None, "auto"],
    ),
    "of no rod": (lambda rod: po.length_given_pressure(rod, 0.8), [ROD]),
    "equilibrium": (lambda b, x, near: po.equilibrium(beta0=b, lam=x, near=near), [4.0, 1.0, None]),
    "equilibrium, beta1": (lambda b, x: po.equilibrium(beta0=b, beta1=x), [4.0, 98.4]),
    "equilibria": (lambda x: po.equilibria(ROD, length=x), [5.2]),
    "equilibria, pressure": (lambda x: po.equilibria(ROD, pressure=x), [0.2]),
    "equilibria, groups": (lambda b, x: po.equilibria(beta0=b, beta1=x), [4.0, 98.4]),
    "trace": (
        lambda b, lo, hi, mode: po.trace(beta0=b, lam=(lo, hi), mode=mode, points=8),
        [4.0, -1.0, 1.0, 1],
    ),
    "trace, options": (
        lambda n, tol, law: po.trace(beta0=4, lam=(-1, 1), points=n, tol=tol, law=law),
        [8, 1e-8, None],
    ),
    "trace, at": (lambda x: po.trace(beta0=4, lam=(-1, 1), points=8, at={"lam": [x]}), [0.3]),
    "trace, a rod": (lambda rod: po.trace(rod, points=8), [ROD]),
    "trace, of a ratio": (lambda r: po.trace(po.Rod.from_ratio(r), points=8), [1.0]),
    "trace, trapezoidal": (
        lambda r, plateau: po.trace(po.Rod.from_ratio(r), law=po.trapezoidal(plateau), points=8),
        [1.0, 0.4],
    ),
    "hysteresis, a rod": (lambda r: po.hysteresis(po.Rod.from_ratio(r), points=5), [1.0]),
    "fold_curve": (lambda lo, hi: po.fold_curve(beta0=(lo, hi)), [1.0, 4.0]),
    "maxwell_curve": (lambda lo, hi: po.maxwell_curve((lo, hi), points=6), [2.0, 4.0]),
    "maxwell_length": (po.maxwell_length, [1.0, "paper"]),
    "least_lambda": (po.least_lambda, [4.0]),
    "hysteresis": (lambda b, form: po.hysteresis(beta0=b, points=5, form=form), [4.0, po.NormalForm.paper()]),
    "hysteresis, options": (
        lambda n, lo, hi: po.hysteresis(beta0=4.0, points=n, lam=(lo, hi)),
        [5, -0.5, 0.5],
    ),
    "normal form": (
        lambda b, x: (po.NormalForm.paper().fold(b), po.NormalForm.exact().alpha1(b, x)),
        [4.0, 0.1],
    ),
    "normal form, uniform": (lambda n, b: po.NormalForm.uniform(n).maxwell(b), [4, 4.0]),
    "lyapunov_schmidt": (po.lyapunov_schmidt, [4.0]),
    "trapezoidal": (po.trapezoidal, [0.4]),
    "Spectral": (po.Spectral, [12]),
    "Collocation": (po.Collocation, [8, 4]),
    "Shooting": (po.Shooting, [8]),
    "held_length": (lambda x: po.held_length(ROD, x), [0.5]),
    "holding_pressure": (lambda x: po.holding_pressure(ROD, x), [3.5]),
    "readhesion_pressure": (po.readhesion_pressure, [ROD]),
    "stability": (po.stability, [None]),
    "sensitivities": (po.sensitivities, [None]),
    "Measurements": (
        lambda x, y, sd: po.Measurements([x, 2e-3], [y, 6e4], pressure_sd=sd),
        [1.9e-3, 67e3, 500.0],
    ),
    "MeasuredShape": (
        lambda x, y, sd: po.MeasuredShape([0.0, x], [0.0, y], sd, pressure=6e4),
        [1e-3, 1e-4, 1e-5],
    ),
    "calibrate": (lambda data, free: po.calibrate(data, free=free, rod=FLAP), [[], ("adhesion_range",)]),
    "sweep": (lambda x, y: po.sweep({"ratio": x, "pressure_ratio": [y, 0.8]}, workers=1), [1.0, 0.7]),
    "sweep, options": (
        lambda axes, tol, n: po.sweep(axes, rod=ROD, tol=tol, workers=n),
        [{"pressure": [0.7, 0.8]}, 1e-8, 1],
    ),
    "uncertainty": (
        lambda sd, n: po.uncertainty(
            FLAP, {"adhesion_strength": sd}, pressure=6e4, samples=n, indices=False, workers=1
        ),
        ["+- 5 %", 4],
    ),
    "design": (
        lambda x, free: po.design(FLAP, free=free, targets=po.Target("maxwell_length", equal=x)),
        ["2 mm", "bending_stiffness"],
    ),
    "Target": (po.Target, ["maxwell_length", 1e-3]),
    "load": (po.Equilibrium.load, ["nowhere.npz"]),
    "load a branch": (po.Branch.load, ["nowhere.npz"]),
    "read_measurements": (po.read_measurements, ["nowhere.csv"]),
    "save_figure": (
        lambda path: save_figure(po.length_given_pressure(ROD, 0.8).plot().figure, path),
        ["no/where.png"],
    ),
}

#: How many times fewer inputs a call gets whose answers take long.
COSTLY = {
    "equilibria": 12,
    "equilibria, pressure": 12,
    "equilibria, groups": 12,
    "hysteresis, options": 4,
    "trace, of a ratio": 4,
    "trace, trapezoidal": 8,
    "hysteresis, a rod": 4,
}


def spoilt(good: list[Any]) -> st.SearchStrategy[list[Any]]:
    """Return the values with one or more of them wild."""
    places = st.sets(st.integers(0, len(good) - 1), min_size=1, max_size=len(good))
    wild = st.lists(WILD | NUMBERS, min_size=len(good), max_size=len(good))
    return st.builds(
        lambda where, other: [other[i] if i in where else value for i, value in enumerate(good)], places, wild
    )


@pytest.mark.parametrize("name", CALLS)
@examples(few=12, many=80)
def test_any_call_answers_or_raises_a_typed_error(name, count, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    function, good = CALLS[name]

    def check(values: list[Any]) -> None:
        found = typed(lambda: function(*values))
        if not isinstance(found, po.PeelOptError):
            repr(found)
            for number in np.atleast_1d(getattr(found, "answer", 0.0)):
                assert np.isfinite(number)

    hammer(check, spoilt(good), max(count // COSTLY.get(name, 1), 1))
