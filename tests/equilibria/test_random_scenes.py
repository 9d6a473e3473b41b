"""Random scenes: each solved state survives an integration that shares nothing with the package.

Modules: `scenes`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import peel_opt as po

from ..scene_oracle import Start, march


def _scene(seed: int) -> tuple[po.Scene, dict[str, Any]]:
    """Return a scene, and the same in the words of the oracle."""
    rng = np.random.default_rng(seed)
    small = rng.uniform(-0.1, 0.1, size=12)
    r = float(rng.choice([0.3, 1.0, 3.0]))
    p: dict[str, Any] = {"y0": 1.0 / r}
    flat = bool(rng.integers(3))
    kind = int(rng.integers(4))
    profile, dead, law, wall = None, 0.0, "auto", po.Flat()
    if flat:
        p |= {"dead": dead} if (dead := abs(float(small[0])) * 3.0) else {}
        if kind == 0:
            law, p["law"], p["par"] = po.EffectiveOpening(0.6), "op", 0.6
        elif kind == 1:
            law, p["law"], p["par"] = po.ShearSprings(2.0 * r), "deg", 2.0 * r
        elif kind == 2:
            p["G0"] = 0.01 / r
    else:
        wall = po.Circle(float(small[1]))
        p["kw"] = float(small[1])
    c = float(small[2])
    profile, p["prof"] = [
        (po.profiles.linear(c), ["lin", c]),
        (po.profiles.exponential(30.0), ["exp", 30.0]),
        (po.profiles.mixed(abs(c)), ["mixsin", abs(c)]),
        (po.profiles.jet(), ["cos2"]),
    ][int(rng.integers(4))]
    w, tilt = 0.5 * float(small[3]), 3.0 * float(small[4])
    p |= {
        "w": w * math.cos(tilt),
        "wx": w * math.sin(tilt),
        "tau": float(small[5]),
        "drag": 0.5 * float(small[6]),
    }
    p |= {"F": 0.3 * abs(float(small[7])), "phi": 1.0, "M": -0.2 * abs(float(small[8]))}
    p["kn"] = p.get("kw", 0.0) + 0.2 * abs(float(small[9]))
    loads = [po.Pressure(profile, dead), po.Weight(w, tilt), po.SkinFriction(p["tau"]), po.Drag(p["drag"])]
    tip = po.TipLoad(p["F"], p["phi"], p["M"])
    scene = po.Scene(
        po.Rod.from_ratio(r), loads, wall, tip, law, natural_curvature=p["kn"], line_energy=p.get("G0", 0.0)
    )
    return scene, p


SEEDS = [0, 1, 4, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(5, 30))]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_scene_arrives_at_its_front(seed: int) -> None:
    scene, p = _scene(seed)
    for pressure in (0.6, 1.0, 1.2):  # a line energy holds more than T0
        states = po.equilibria(scene, pressure=pressure)
        if found := [eq for eq in states if eq.certified and eq.state != "folded"]:
            break
    for eq in found:
        tip = Start(eq.tip_angle, eq.x[0], eq.y[0], eq.Nx[0], eq.Ny[0], eq.curvature[0])
        end = march(p | {"p": pressure}, eq.length, tip)
        # Where the traction follows the displacement, its direction is lost as both vanish at the front.
        along = p.get("law") == "op"
        within = 1e-4 if along else 1e-8
        assert end.missed < (1e-6 if along else 1e-8), (eq.state, end)
        assert end.Nx == pytest.approx(eq.Nx[-1], abs=within)
    assert found
