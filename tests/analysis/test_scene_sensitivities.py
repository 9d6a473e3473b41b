"""Sensitivities of scenes: against closed forms, and against differences of answers.

Modules: `scene_sensitivities`, `derivatives`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

import peel_opt as po
from peel_opt.model.rod import MATERIAL

from ..rods import FLAP

T0, ETA = FLAP.adhesion_strength, FLAP.eta


def test_the_moment_that_peels_goes_with_the_roots_of_stiffness_and_work() -> None:
    """|M| = sqrt(2 k G), with G = T0 y0/2, as soon as the tip is out of the zone, at any length."""
    scene = po.Scene(FLAP, tip=po.TipLoad(moment=-1.0))
    found = po.sensitivities(po.solve(scene, free="moment", length=3.5 * ETA))
    assert found.value == pytest.approx(
        -((2.0 * FLAP.bending_stiffness * FLAP.work_of_separation) ** 0.5), rel=1e-9
    )
    for name in ("bending_stiffness", "adhesion_strength", "adhesion_range"):
        assert found.elasticities[name] == pytest.approx(0.5, abs=1e-8)
    assert found.elasticities["length"] == pytest.approx(0.0, abs=1e-8)
    assert found.units["moment"] == "N"


def test_the_papers_scene_has_the_sensitivities_of_its_rod() -> None:
    plain = po.sensitivities(po.length_given_pressure(FLAP, 6e4))
    found = po.sensitivities(po.solve(po.Scene(FLAP), free="length", pressure=6e4))
    for name, rate in plain.derivatives.items():
        assert abs(found[name] - rate) <= found.errors[name] + plain.errors[name] + 1e-9 * abs(rate)
    assert found.units == plain.units


#: The numbers of a scene with many of them.
MANY = {
    "gradient": -0.1,
    "dead": 0.2,
    "weight": 0.02 * T0,
    "tilt": 0.1,
    "friction": 0.03 * T0,
    "drag": 0.01 * T0,
    "force": 0.02 * T0 * ETA,
    "angle": 1.0,
    "moment": -0.01 * T0 * ETA**2,
    "natural_curvature": 0.02 / ETA,
}


def many(rod: po.Rod = FLAP, **numbers: float) -> po.Scene:
    q = MANY | numbers
    loads = [
        po.Pressure(po.profiles.linear(q["gradient"]), dead=q["dead"]),
        po.Weight(q["weight"], q["tilt"]),
        po.SkinFriction(traction=q["friction"]),
        po.Drag(q["drag"]),
    ]
    tip = po.TipLoad(q["force"], q["angle"], q["moment"])
    return po.Scene(rod, loads, tip=tip, natural_curvature=q["natural_curvature"])


def circled(rod: po.Rod = FLAP, curvature: float = 0.05 / ETA, natural_curvature: float = 0.02 / ETA) -> Any:
    return po.Scene(rod, wall=po.Circle(curvature), tip=po.Contact(), natural_curvature=natural_curvature)


def blistered(rod: po.Rod = FLAP, slack: float = 0.1 * ETA) -> Any:
    return po.Blister(rod, slack=slack)


def capillary(rod: po.Rod = FLAP, line_energy: float = 0.01 * T0 * ETA, zeta: float = 0.5) -> Any:
    return po.Scene(rod, law=po.EffectiveOpening(zeta), line_energy=line_energy)


@pytest.mark.parametrize(
    ("make", "free", "given", "names"),
    [
        (many, "length", {"pressure": 0.6 * T0}, ("bending_stiffness", "adhesion_strength", "gradient")),
        (many, "length", {"pressure": 0.6 * T0}, ("tilt", "force", "angle", "moment", "pressure")),
        (many, "pressure", {"length": 1.5 * ETA}, ("adhesion_range", "natural_curvature", "length")),
        (circled, "length", {"pressure": 0.5 * T0}, ("curvature", "natural_curvature", "adhesion_range")),
        (blistered, "pressure", {"length": 3.6 * ETA}, ("slack", "bending_stiffness")),
        (capillary, "length", {"pressure": 0.6 * T0}, ("line_energy", "zeta", "adhesion_strength")),
    ],
    ids=["rod", "loads", "pressure", "circle", "blister", "front"],
)
@pytest.mark.slow
def test_derivatives_are_those_of_answers(
    make: Callable[..., po.Scene], free: str, given: dict[str, float], names: tuple[str, ...]
) -> None:
    def answer(name: str, value: float) -> float:
        rod = replace(FLAP, **{name: value}) if name in MATERIAL else FLAP
        own = {} if name in given or name in MATERIAL else {name: value}
        held = given | ({name: value} if name in given else {})
        return float(getattr(po.solve(make(rod, **own), free=free, tol=1e-7, **held), free))

    eq = po.solve(make(), free=free, tol=1e-7, **given)
    found = po.sensitivities(eq)
    assert set(names) <= set(found.derivatives)
    for name in names:
        value = found.parameters[name]
        h = 1e-3 * abs(value)
        slope = (answer(name, value + h) - answer(name, value - h)) / (2.0 * h)
        assert found[name] == pytest.approx(slope, rel=2e-5), name
        assert found.errors[name] <= 1e-6 * abs(found[name])
    assert "elasticity" in str(found)
