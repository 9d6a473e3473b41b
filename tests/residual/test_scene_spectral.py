"""The spectral form of scenes (`scene_spectral`, `scene_fields`, `traced`): its Jacobian, carried by hand."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.stretch import Stretch
from peel_opt.residual.scene_spectral import SceneSpectral
from peel_opt.residual.spectral import Spectral

from ..rods import FLAP

#: One scene for each load, wall, bond and tip that has terms of its own.
SCENES = {
    "plain": po.Scene(FLAP),
    "loads": po.Scene(
        FLAP,
        [
            po.Pressure(po.profiles.exponential(5e-3), dead=0.3),
            po.Weight(2e4, 0.4),
            po.SkinFriction(share=0.2),
        ],
        tip=po.TipLoad(1.0, 0.7, 1e-3),
    ),
    "inside a tube": po.Scene(
        FLAP, [po.SkinFriction(traction=5e3)], po.Circle(100.0), natural_curvature=80.0
    ),
    "opening along": po.Scene(FLAP, [po.Drag(3e3)], law=po.EffectiveOpening(zeta=0.5)),
    "springs along": po.Scene(FLAP, [po.Drag(3e3)], law=po.ShearSprings(0.3 * 140e3 / 0.73e-3)),
    "tip on its wall": po.Scene(FLAP, tip=po.Contact(), natural_curvature=-100.0),
    "strip": po.Blister(FLAP, slack=5e-5),
    "on a layer": po.Scene(FLAP, [po.Weight(2e4, 0.4)], law=po.ElasticLayer(2e10)),
    "stretched": po.Scene(
        FLAP,
        [po.Weight(2e4, 0.4), po.SkinFriction(share=0.2)],
        line_energy=6e3,
        stretch=2e3,
        glued_strain=0.01,
    ),
}


@pytest.mark.parametrize("phases", [1, 2])
@pytest.mark.parametrize(
    ("name", "free"), [(name, free) for name, scene in SCENES.items() for free in (None, *scene.numbers)]
)
def test_the_jacobian_of_a_scene_is_the_automatic_one(name: str, free: str | None, phases: int) -> None:
    scene = SCENES[name]
    pieces = scene.bond.law.pieces[phases - 1 :: -1]  # from the tip on
    settings = SceneSpectral(scene, Spectral(6), free)
    problem = settings.discretise(tuple(Stretch.of(piece, frozenset()) for piece in pieces))
    x = np.random.default_rng(0).normal(size=problem.size)
    x[problem.inner] = 0.4
    x[problem.tail] = [0.7, -5.0, 2.0, 3.0]
    if name in ("stretched", "on a layer") and free:
        x[problem.named] = scene.numbers[free]  # or nothing would hold it
    residual, jacobian = problem.linearise(x)
    automatic = ca.Function("automatic", [problem.x], [ca.jacobian(problem.expression, problem.x)])
    expected = automatic(x).full()
    assert len(expected) == len(residual) > problem.field_count
    np.testing.assert_allclose(jacobian, expected, atol=1e-12 * np.max(np.abs(expected)), rtol=1e-11)
    np.testing.assert_array_equal(residual, problem.residual(x))
