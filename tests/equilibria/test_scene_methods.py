"""A scene by three transcriptions: orders as theory says, answers that agree within their errors.

Modules: `scene_intervals`, `scene_system`, `scenes`.
"""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.residual.collocation import Collocation
from peel_opt.residual.discretisation import Transcription
from peel_opt.residual.shooting import Shooting

ROD = po.Rod.from_ratio(1.0)

#: Scenes with a pressure at which each is solved.
SCENES = {
    "profile": (po.Scene(ROD, [po.Pressure(po.profiles.linear(-0.1))]), 0.8),
    "friction": (po.Scene(ROD, [po.SkinFriction(share=0.2)]), 0.5),
    "tip force": (po.Scene(ROD, tip=po.TipLoad(force=0.05, angle=1.57)), 0.7),
    "circle": (po.Scene(ROD, wall=po.Circle(-0.1), natural_curvature=-0.05), 0.7),
    "blister": (po.Blister(ROD, slack=0.1), 0.5),
}
OTHERS = {
    "stretch": (po.Blister(ROD, stretch=20.0, line_energy=0.05), 0.5),
    "contact": (po.Scene(ROD, tip=po.Contact(), natural_curvature=-0.2), 0.3),
    "layer": (po.Scene(ROD, law=po.ElasticLayer(1e3)), 0.7),
    "edge": (po.Scene(ROD, unbonded=0.5), 0.5),
    "slip": (po.Scene(ROD, law=po.EffectiveOpening(1.0)), 0.3),
}


def _length(name: str, method: str | Transcription, tol: float = 1e-8) -> po.Equilibrium:
    scene, pressure = (SCENES | OTHERS)[name]
    return po.length_given_pressure(scene, pressure, method=method, tol=tol)


@pytest.mark.parametrize("method", ["collocation", "shooting"])
@pytest.mark.parametrize("name", [*SCENES, *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)])
def test_the_methods_agree_within_their_errors(name: str, method: str) -> None:
    one, other = _length(name, "spectral"), _length(name, method)
    assert other.stats.method.lower().startswith(method)
    assert abs(one.length - other.length) <= one.error + other.error < 2e-8
    assert other.certificate < 1e-9
    assert other.state == one.state
    assert other.tip_height == pytest.approx(one.tip_height, rel=1e-7)
    # A traction along the displacement has at the front the direction that the tolerance leaves it.
    assert other.Nx[-1] == pytest.approx(one.Nx[-1], abs=1e-6 if name == "slip" else 1e-8)


@pytest.mark.parametrize(
    ("mesh", "order"),
    [
        (lambda n: Shooting(n, "rk4"), 4),
        (lambda n: Shooting(n, "midpoint"), 2),
        (lambda n: Collocation(n, 2, "uniform"), 4),
        (lambda n: Collocation(n, 1, "uniform"), 2),
    ],
    ids=["shooting of order 4", "of order 2", "collocation of order 4", "with one stage"],
)
def test_errors_fall_with_the_order_and_are_not_understated(mesh: object, order: int) -> None:
    exact, errors = _length("profile", "spectral").length, []
    for intervals in (24, 48):
        eq = _length("profile", mesh(intervals), tol=1.0)  # type: ignore[operator]
        errors.append(abs(eq.length - exact))
        assert errors[-1] <= eq.error < 20.0 * errors[-1]
        assert f"intervals={intervals}" in eq.stats.method
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.4)


def test_ipopt_solves_for_a_number_of_the_scene() -> None:
    scene, pressure = SCENES["friction"]
    eq = po.solve(scene, free="share", pressure=pressure, length=3.0, near=0.2, method="shooting")
    found = po.Scene(ROD, [po.SkinFriction(share=eq.numbers["share"])])
    back = po.solve(found, free="length", pressure=pressure, near=3.0)
    assert back.length == pytest.approx(3.0, abs=1e-9)


def test_readings_take_answers_of_any_transcription() -> None:
    one, other = _length("profile", "spectral"), _length("profile", "shooting")
    assert po.energies(other).bending == pytest.approx(po.energies(one).bending, rel=1e-7)
    by_pressure = [po.sensitivities(eq).derivatives["pressure"] for eq in (one, other)]
    assert by_pressure[1] == pytest.approx(by_pressure[0], rel=1e-6)
    assert po.stability(other).stable == po.stability(one).stable


def test_all_states_by_another_method() -> None:
    scene, pressure = SCENES["circle"]
    by_shooting = po.equilibria(scene, pressure=pressure, method="shooting")
    plain = po.equilibria(scene, pressure=pressure)
    assert [eq.length for eq in by_shooting] == pytest.approx([eq.length for eq in plain], abs=1e-8)


def test_the_series_is_refused() -> None:
    scene, pressure = SCENES["circle"]
    with pytest.raises(po.InvalidInput, match="closed form is that of the plain rod"):
        po.solve(scene, free="length", pressure=pressure, method="series")
