"""Rods on an elastic layer: known states, the limit of a stiff one at its three rates, what fails ahead.

Modules: `layer`, `scenes`, `scene_starts`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import peel_opt as po

from ..scene_oracle import Start, march
from ..scene_states import REFERENCE, title

ROD = po.Rod.from_ratio(1.0)

STATES = [s for s in REFERENCE["states"] if s["scene"] == "S8"]


def _held(K: float, pressure: float, *loads: Any, **parts: Any) -> po.Equilibrium:
    return po.solve(
        po.Scene(ROD, loads, law=po.ElasticLayer(K), **parts), free="length", pressure=pressure, tol=1e-9
    )


def _beam(eq: po.Equilibrium, K: float) -> tuple[float, float, float]:
    """What the attached half alone says of its edge and of its layer, by SciPy's collocation.

    Returns the curvature and N_y at the edge that decay with what arrives there, and the largest pull of
    the layer behind its lobe of compression.  Lengths are in those of decay, 1/lam = (4k/K)^(1/4).
    """
    lam, Nx = (K / 4.0) ** 0.25, eq.Nx[-1]
    slope = lam / K

    def rates(_: Any, z: Any) -> Any:
        y, th, m, Ny = z
        th = th * slope
        turning = (Ny / lam * np.cos(th) - Nx * np.sin(th)) / (lam**2 * slope)
        return np.array([np.sin(th) / slope, m, turning, -y])

    def ends(a: Any, b: Any) -> Any:
        return np.array([a[0] - 1.0, a[1] - eq.theta[-1] / slope, b[0], b[1]])

    s = np.linspace(0.0, 24.0, 400)
    there = solve_bvp(rates, ends, s, np.zeros((4, s.size)), tol=1e-9, max_nodes=50_000)
    assert there.success
    lobe = there.sol(np.linspace(0.0, 9.0, 20_000))[0]
    _, _, m, Ny = there.sol(0.0)
    return m * slope * lam, Ny / lam, lobe[np.argmin(lobe) :].max()


@pytest.mark.parametrize("state", STATES, ids=title)
def test_a_known_state_on_a_layer_is_met(state: dict[str, Any]) -> None:
    p, v = state["params"], state["values"]
    eq = _held(p["K"], p["p"])
    assert abs(eq.length - v["s_p"]) <= eq.error + 1e-12
    assert eq.tip_angle == pytest.approx(v["theta_tip"], abs=1e-12)
    assert eq.tip_height == pytest.approx(v["y_tip"], abs=1e-12)
    assert eq.y[-1] == pytest.approx(1.0 / p["K"], rel=1e-9)
    assert eq.Nx[-1] == pytest.approx(v["Nx"], abs=1e-12)
    assert -eq.Ny[-1] == pytest.approx(v["R"], abs=1e-11)
    assert eq.curvature[-1] == pytest.approx(v["m_sp"], abs=1e-11)
    curvature, Ny, pull = _beam(eq, p["K"])
    assert curvature == pytest.approx(eq.curvature[-1], abs=1e-8)
    assert Ny == pytest.approx(eq.Ny[-1], abs=1e-7)
    assert eq.numbers["pull_ahead"] == pytest.approx(pull, rel=1e-4)
    # The state that was handed down has the largest of a few samples, up to 0.82 % below the peak.
    assert 0.991 * pull < v["next_tension_peak"] < pull
    assert eq.valid


@pytest.mark.slow
def test_the_identity_has_the_elastic_stretch() -> None:
    """p (y_tip - T0/K) = Phi(y_tip) and what other loads put in; an integration from the tip agrees."""
    loads = [po.Weight(0.05, 0.3), po.SkinFriction(traction=0.04), po.Pressure(dead=0.3)]
    eq = _held(200.0, 0.6, *loads, tip=po.TipLoad(0.05, 1.0, -0.05))
    assert eq.certificate < 1e-11
    tip = Start(eq.tip_angle, eq.x[0], eq.tip_height, eq.Nx[0], eq.Ny[0], eq.curvature[0])
    own = {"dead": 0.3, "tau": 0.04, "w": 0.05 * math.cos(0.3), "wx": 0.05 * math.sin(0.3)}
    end = march(own | {"y0": 1.0, "p": 0.6, "law": "K", "par": 200.0}, eq.length, tip)
    assert end.y == pytest.approx(1.0 / 200.0, abs=1e-10)
    assert end.x == pytest.approx(0.0, abs=1e-10)
    assert end.theta == pytest.approx(eq.theta[-1], abs=1e-10)
    assert end.curvature == pytest.approx(eq.curvature[-1], abs=1e-10)
    assert end.Ny == pytest.approx(eq.Ny[-1], abs=1e-9)


def test_a_stiff_layer_is_law_8_at_three_rates() -> None:
    """What the tip shows as 1/K; the length as K^(-1/4), then K^(-1/2) p/R, then K^(-3/4)."""
    plain = po.length_given_pressure(ROD, 0.8)
    stiffness = np.array([1e4, 1e5, 1e6])
    found = [_held(float(K), 0.8) for K in stiffness]

    def rate(off: list[float]) -> float:
        return float(np.polyfit(np.log(stiffness), np.log(np.abs(off)), 1)[0])

    assert rate([eq.tip_angle - plain.tip_angle for eq in found]) == pytest.approx(-1.0, abs=0.05)
    assert rate([eq.tip_height - plain.tip_height for eq in found]) == pytest.approx(-1.0, abs=0.05)
    lever = [plain.length - eq.length - (4.0 / K) ** 0.25 for eq, K in zip(found, stiffness, strict=True)]
    assert rate(lever) == pytest.approx(-0.5, abs=0.02)
    assert lever[-1] * 1e3 == pytest.approx(0.8 / -plain.Ny[-1], rel=1e-2)
    corrected = [eq.numbers["rigid_length"] - plain.length for eq in found]
    assert rate(corrected) == pytest.approx(-0.75, abs=0.1)
    assert abs(corrected[-1]) < 1e-4 * plain.length


@pytest.mark.slow
def test_a_layer_that_is_pulled_beyond_its_strength_ahead_says_so() -> None:
    """0.028 lam R of the lobe behind the pressed one, lam = (K/4k)^(1/4), exceeds T0 for stiff layers."""
    weak, strong = _held(1e8, 0.3), _held(1e6, 0.3)
    assert "fails ahead" in weak.flags
    assert not weak.valid
    assert strong.valid
    lam = (1e8 / 4.0) ** 0.25
    assert weak.numbers["pull_ahead"] == pytest.approx(0.028 * lam * -weak.Ny[-1], rel=0.05)


@pytest.mark.slow
def test_the_least_pressure_is_found_on_a_layer_too() -> None:
    """Law (8) has 0.121837041296; the tip hardly sees a stiff layer."""
    (least,) = po.trace(po.Scene(ROD, law=po.ElasticLayer(1e4)), points=40).special("LP-pressure")
    assert least.pressure_ratio == pytest.approx(0.121837041296, rel=1e-3)


@pytest.mark.slow
def test_a_layer_keeps_its_units() -> None:
    rod = po.Rod(2.3e-5, 140e3, 0.73e-3)
    T0, eta = rod.adhesion_strength, rod.eta
    scene = po.Scene(rod, law=po.ElasticLayer(500.0 * T0 / eta))
    over = po.Scene(po.Rod.from_ratio(rod.ratio), law=po.ElasticLayer(500.0))
    one, other = (po.solve(s, free="length", pressure=0.5 * f) for s, f in ((scene, T0), (over, 1.0)))
    assert one.length == pytest.approx(other.length * eta, rel=1e-10)
    assert one.numbers["rigid_length"] == pytest.approx(other.numbers["rigid_length"] * eta, rel=1e-9)
    assert one.numbers["pull_ahead"] == pytest.approx(other.numbers["pull_ahead"] * T0, rel=1e-9)
    back = po.solve(
        scene, free="layer_stiffness", pressure=0.5 * T0, length=one.length, near=550.0 * T0 / eta
    )
    assert back.answer == pytest.approx(500.0, rel=1e-6)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: po.ElasticLayer(0.0), "positive"),
        (lambda: po.Scene(ROD, law=po.ElasticLayer(0.9)), "as soft as its bond"),
        (lambda: po.Scene(ROD, law=po.ElasticLayer(100.0), wall=po.Circle(0.1)), "flat wall"),
        (lambda: po.Scene(ROD, law=po.ElasticLayer(100.0), unbonded=1.0), "glued up to"),
    ],
)
def test_what_a_layer_does_not_cover_is_refused(make: Any, words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        make()


@pytest.mark.slow
def test_below_its_least_pressure_a_rod_on_a_layer_has_no_state() -> None:
    scene = po.Scene(po.Rod.from_ratio(1.0), law=po.ElasticLayer(1e4))
    with pytest.raises(po.NoEquilibrium) as denied:
        po.solve(scene, free="length", pressure=0.05)
    assert denied.value.nearest == pytest.approx(0.12185946, abs=1e-6)
