"""Rods that stretch, and fronts that a line energy holds: known states, limits, contradictions.

Modules: `scenes`, `scene_starts`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import peel_opt as po

from ..scene_oracle import Start, march
from ..scene_states import REFERENCE, title

ROD = po.Rod.from_ratio(1.0)

STATES = [s for s in REFERENCE["states"] if s["params"].get("mode") == "ext"]


def _missed(eq: po.Equilibrium, **p: Any) -> float:
    """By how much an integration of a solved state from its tip misses its front."""
    tip = Start(eq.tip_angle, eq.x[0], eq.tip_height, eq.Nx[0], eq.Ny[0], eq.curvature[0])
    return march(p | {"y0": 1.0, "p": eq.pressure_ratio}, eq.length, tip).missed


@pytest.mark.parametrize("state", STATES, ids=title)
def test_a_known_strip_that_stretches_is_met(state: dict[str, Any]) -> None:
    p, v = state["params"], state["values"]
    EA, glued = 1.0 / p["iEA"], p["eps0"]
    scene = po.Blister(ROD, stretch=EA, glued_strain=glued, line_energy=0.01)
    eq = po.solve(scene, free="line_energy", pressure=p["p"], length=p["sbar"])
    jump = v["Nx_sbar"] / EA + glued
    assert eq.certified
    assert eq.answer == pytest.approx(0.5 * v["kap_end"] ** 2 + 0.5 * EA * jump**2, abs=1e-11)
    assert eq.y[0] == pytest.approx(v["y_c"], abs=1e-11)
    assert eq.curvature[0] == pytest.approx(v["kap_c"], abs=1e-11)
    assert eq.numbers["thrust"] == pytest.approx(v["Nx_c"], abs=1e-10)
    assert eq.x[0] == pytest.approx(v["x_c"], abs=1e-11)
    assert eq.Ny[-1] == pytest.approx(v["Ny_sbar"], abs=1e-10)


def test_the_length_that_a_pressure_holds_open_gives_that_pressure_back() -> None:
    scene = po.Blister(ROD, stretch=50.0, line_energy=0.2)
    held = po.solve(scene, free="length", pressure=0.8)
    assert po.solve(scene, free="pressure", length=held.length).pressure == pytest.approx(0.8, abs=1e-10)
    assert _missed(held, nocoh=True, iEA=0.02, G0=0.2) < 1e-9


def test_a_small_blister_is_a_clamped_plate() -> None:
    """G0 = p^2 sbar^4 / (18 k) where it bends alone."""
    eq = po.solve(po.Blister(ROD, stretch=100.0, line_energy=1e-4), free="length", pressure=0.5)
    assert eq.length == pytest.approx((18.0 * 1e-4 / 0.25) ** 0.25, rel=2e-3)


@pytest.mark.parametrize("EA", [5.0, 100.0])
def test_a_long_arm_that_stretches_peels_at_kendalls_force(EA: float) -> None:
    """G = F (1 - cos phi) + F^2/(2 EA)."""
    G, phi = 0.5, 0.5 * math.pi
    scene = po.Scene(ROD, law="none", line_energy=G, stretch=EA, tip=po.TipLoad(angle=phi))
    F = po.solve(scene, free="force", length=16.0).numbers["force"]
    assert F * (1.0 - math.cos(phi)) + F**2 / (2.0 * EA) == pytest.approx(G, abs=1e-6)


@pytest.mark.slow
def test_a_rod_that_hardly_stretches_is_one_that_does_not() -> None:
    """stretch -> infinity, at the rate 1/EA; with a cohesive zone and all loads at once."""
    loads = [po.Pressure(po.profiles.linear(0.2), dead=0.3), po.Weight(0.05, 0.3), po.SkinFriction(0.04)]
    tip = po.TipLoad(0.05, 1.0, -0.1)
    lengths = {}
    for EA in (math.inf, 1e4, 1e2):
        more = {} if math.isinf(EA) else {"stretch": EA}
        eq = po.solve(po.Scene(ROD, loads, tip=tip, line_energy=0.05, **more), free="length", pressure=0.6)
        lengths[EA] = eq.length
        own = {"G0": 0.05, "prof": ["lin", 0.2], "dead": 0.3, "tau": 0.04, "iEA": 1.0 / EA}
        own |= {"w": 0.05 * math.cos(0.3), "wx": 0.05 * math.sin(0.3)}
        assert _missed(eq, **own) < 1e-9
        assert eq.certificate < 1e-12
    off = [abs(lengths[EA] - lengths[math.inf]) for EA in (1e2, 1e4)]
    assert off[0] / off[1] == pytest.approx(100.0, rel=0.05)


@pytest.mark.parametrize("law", ["none", "auto"])
@pytest.mark.parametrize("how", [{"roller": 0.1}, {"slack": 0.05}])
def test_a_line_energy_holds_strips_that_do_not_stretch_too(law: str, how: dict[str, float]) -> None:
    """The sticky elastica, with and without a zone: the front has theta' = sqrt(2 G0/k)."""
    eq = po.solve(po.Blister(ROD, law=law, line_energy=0.5, **how), free="pressure", length=2.8)
    assert eq.certified
    assert eq.curvature[-1] == pytest.approx(1.0, abs=1e-10)
    assert _missed(eq, G0=0.5, nocoh=law == "none") < 1e-9
    if "slack" in how:
        assert eq.length + eq.x[0] == pytest.approx(0.05, abs=1e-10)


def test_slack_of_a_strip_that_stretches_is_what_its_middle_has_to_spare() -> None:
    eq = po.solve(po.Blister(ROD, stretch=1e4, slack=0.05, line_energy=0.5), free="length", pressure=0.5)
    assert _missed(eq, G0=0.5, nocoh=True, iEA=1e-4) < 1e-8
    assert eq.length + eq.x[0] == pytest.approx(0.05, abs=1e-10)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: po.Blister(ROD, stretch=100.0), "both have to vanish"),
        (lambda: po.Scene(ROD, stretch=100.0), "both have to vanish"),
        (lambda: po.Scene(ROD, stretch=0.0, line_energy=0.1), "stretch .* must be positive"),
        (lambda: po.Scene(ROD, law="none"), "held by its line_energy"),
        (lambda: po.Blister(ROD, slack=0.1, glued_strain=0.01), "no glued_strain"),
        (lambda: po.Scene(ROD, stretch=9.0, line_energy=0.1, glued_strain=-1.0), "above -1"),
        (lambda: po.Scene(ROD, stretch=9.0, line_energy=0.1, wall=po.Circle(0.1)), "flat wall"),
        (lambda: po.Scene(ROD, stretch=9.0, line_energy=0.1, law=po.EffectiveOpening(0.5)), "not slide"),
    ],
)
def test_contradictions_are_refused(make: Any, words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        make()


def test_a_strain_that_frees_more_than_the_line_energy_holds_leaves_no_short_rod() -> None:
    scene = po.Scene(ROD, law="none", stretch=1e4, glued_strain=0.02, line_energy=0.5)
    with pytest.raises(po.NotConverged, match="more than the line energy holds"):
        po.solve(scene, free="length", pressure=0.5)


def test_a_strip_that_stretches_keeps_its_units() -> None:
    rod = po.Rod(2.3e-5, 140e3, 0.73e-3)
    T0, eta = rod.adhesion_strength, rod.eta
    scene = po.Blister(rod, stretch=200.0 * T0 * eta, line_energy=0.1 * T0 * eta)
    over = po.Blister(po.Rod.from_ratio(rod.ratio), stretch=200.0, line_energy=0.1)
    one, other = (po.solve(s, free="length", pressure=0.4 * f) for s, f in ((scene, T0), (over, 1.0)))
    assert one.length == pytest.approx(other.length * eta, rel=1e-10)
    assert one.numbers["thrust"] == pytest.approx(other.numbers["thrust"] * T0 * eta, rel=1e-9)
    np.testing.assert_allclose(one.y / eta, other.y, atol=1e-12)
