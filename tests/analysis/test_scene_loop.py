"""Loops of scenes in the pressure: where they peel and come back, and where there is none.

Modules: `scene_loop`.
"""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.analysis.pressure_loop import PressureLoop

ROD = po.Rod.from_ratio(1.0)


def looped(scene: po.Scene) -> PressureLoop:
    found = po.hysteresis(scene, points=12)
    assert isinstance(found, PressureLoop)
    return found


def test_an_edge_snaps_at_its_safe_pressure_and_comes_back_at_the_least() -> None:
    loop = looped(po.Scene(ROD, unbonded=1.0))
    up, down = loop.jumps
    assert up.pressure == pytest.approx(po.safe_pressure(ROD, 1.0).pressure, abs=1e-9)
    assert down.pressure == pytest.approx(po.readhesion_pressure(ROD).pressure, abs=1e-9)
    assert loop.visited == ("lifted", "folded")
    # Folded beyond the edge the rod is the plain one; on the way back it is lifted as it was before.
    assert up.length_after == pytest.approx(po.length_given_pressure(ROD, up.pressure, state="folded").length)
    lifted = po.solve(po.Scene(ROD, unbonded=1.0), free="length", pressure=down.pressure)
    assert down.length_after == pytest.approx(lifted.length, abs=1e-8)
    assert 0.0 < loop.area_error < 1e-6 < loop.area
    assert loop.plot() is not None


def test_the_area_is_what_the_lengths_enclose() -> None:
    """By Gauss's rule on lengths that are solved for one by one; the ends are folds."""
    scene = po.Scene(ROD, unbonded=0.3)
    loop = looped(scene)
    low, high = loop.jumps[1].pressure, loop.jumps[0].pressure
    x, weights = np.polynomial.legendre.leggauss(12)
    u = 0.5 + 0.5 * x
    area = 0.0
    for at, weight in zip(u.tolist(), weights.tolist(), strict=True):
        pressure = low + (high - low) * (3.0 - 2.0 * at) * at**2
        plain = po.length_given_pressure(ROD, pressure, state="folded").length
        folded = po.solve(scene, free="length", pressure=pressure, near=plain).length
        lifted = po.solve(scene, free="length", pressure=pressure).length
        area += 3.0 * weight * (high - low) * at * (1.0 - at) * (folded - lifted)
    assert loop.area == pytest.approx(area, rel=1e-4)


@pytest.mark.slow
def test_a_heavy_rod_peels_where_it_is_lifted_off_and_its_weight_leads_to_the_plain_loop() -> None:
    loop = looped(po.Scene(ROD, [po.Weight(0.05)]))
    assert loop.jumps[0].pressure == pytest.approx(1.05, abs=1e-8)
    assert loop.visited == ("adhered", "folded")
    light, plain = looped(po.Scene(ROD, [po.Weight(1e-9)])), po.hysteresis(ROD, points=12)
    assert light.area == pytest.approx(plain.area, abs=light.area_error + plain.area_error)
    assert looped(po.Scene(ROD)).area == plain.area


@pytest.mark.parametrize(
    ("scene", "error", "words"),
    [
        (po.Scene(ROD, unbonded=4.5), po.NoEquilibrium, "does not snap, but grows stably"),
        pytest.param(
            po.Scene(ROD, line_energy=0.05),
            po.NoEquilibrium,
            "the more pressure it takes",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            po.Scene(ROD, [po.Pressure(lambda at: 1.0 + 0.1 * at.xi)]),
            po.NoEquilibrium,
            "the more pressure it takes",
            marks=pytest.mark.slow,
        ),
        (po.Scene(ROD, tip=po.Contact(), natural_curvature=-0.1), po.InvalidInput, "free or a loaded tip"),
    ],
)
def test_a_scene_without_a_loop_says_why(scene: po.Scene, error: type[po.PeelOptError], words: str) -> None:
    with pytest.raises(error, match=words):
        po.hysteresis(scene)


def test_a_loop_of_a_scene_takes_its_own_law() -> None:
    with pytest.raises(po.InvalidInput, match="its own law"):
        po.hysteresis(po.Scene(ROD, unbonded=1.0), law="linear")


@pytest.mark.slow
def test_an_extremum_that_rounding_makes_beside_a_rest_is_no_least_pressure() -> None:
    loads = [po.Pressure(po.profiles.linear(-0.1)), po.Weight(0.02, 0.1), po.SkinFriction(share=0.1)]
    loop = looped(po.Scene(ROD, [*loads, po.Drag(0.01)]))
    assert [jump.direction for jump in loop.jumps] == ["up", "down"]
    assert loop.jumps[1].pressure == pytest.approx(0.170528607, abs=1e-8)
