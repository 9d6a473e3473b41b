"""Energies of single states: what they must add up to, and what has none.

Modules: `energy_terms`.
"""

from __future__ import annotations

import math

import pytest

import peel_opt as po

from ..rods import FLAP

ROD = po.Rod.from_ratio(1.0)
DEAD = po.Pressure(dead=1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        po.Scene(
            ROD,
            [DEAD, po.Weight(0.05, 0.2), po.Drag(0.03)],
            tip=po.TipLoad(0.02, 1.0, -0.03),
            natural_curvature=0.02,
        ),
        po.Scene(ROD, [DEAD, po.Weight(0.02)], law=po.EffectiveOpening(0.7)),
        po.Scene(ROD, [DEAD], line_energy=0.02),
        po.Scene(ROD, [DEAD], unbonded=0.3),
        po.Blister(ROD, [DEAD], slack=0.1),
        po.Blister(ROD, [DEAD], roller=0.1),
        po.Scene(ROD, [DEAD], tip=po.Contact(), natural_curvature=-0.2),
        pytest.param(
            po.Scene(ROD, [DEAD, po.Weight(0.02)], law=po.ElasticLayer(300.0), natural_curvature=0.02),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["loads", "bond", "front", "edge", "slack", "roller", "contact", "layer"],
)
def test_the_total_energy_moves_with_a_load_by_its_own_potential(scene: po.Scene) -> None:
    """At an equilibrium nothing else counts: d(total)/dp is the potential of the pressure over p."""
    p, h = 0.5, 2e-3
    totals = [po.energies(po.solve(scene, free="length", pressure=p + d)).total for d in (-h, h)]
    found = po.energies(po.solve(scene, free="length", pressure=p))
    assert found.non_conservative == ()
    slope = found.potential["Pressure"] / p
    assert (totals[1] - totals[0]) / (2.0 * h) == pytest.approx(slope, rel=3e-4)
    assert found.error < 1e-9


def test_a_plain_state_has_the_energies_of_its_branch() -> None:
    branch = po.trace(ROD, points=24)
    i = len(branch) // 3
    along, one = po.energies(branch), po.energies(branch[i])
    assert one.bending == pytest.approx(along.bending[i], rel=1e-9)
    assert one.separation == pytest.approx(along.separation[i], rel=1e-9)


def test_what_loads_put_in_is_the_work_of_separation_at_the_tip() -> None:
    eq = po.length_given_pressure(FLAP, 6e4)
    found = po.energies(eq)
    assert found.work["Pressure"] == pytest.approx(FLAP.work_of_separation, rel=1e-9)
    assert found.unit == "N"
    unit = FLAP.adhesion_strength * FLAP.eta**2
    over = po.energies(po.length_given_pressure(po.Rod.from_ratio(FLAP.ratio), 6e4 / FLAP.adhesion_strength))
    assert found.bending == pytest.approx(over.bending * unit, rel=1e-9)
    assert over.unit == "T0 eta^2"


def test_what_turns_with_the_rod_has_no_potential() -> None:
    loads = [po.Pressure(dead=0.3), po.SkinFriction(share=0.1), po.Weight(0.02)]
    found = po.energies(po.solve(po.Scene(ROD, loads), free="length", pressure=0.75))
    assert len(found.non_conservative) == 2
    assert set(found.potential) == {"Pressure", "Weight"}
    assert "no potential: SkinFriction" in repr(found)
    with pytest.raises(po.InvalidInput, match="no total energy"):
        _ = found.total


def test_a_force_that_is_no_gradient_has_no_potential() -> None:
    """A pressure that keeps pointing up, but varies along the plate: its work depends on the way."""
    scene = po.Scene(ROD, [po.Pressure(lambda at: 1.0 + 0.1 * at.x, dead=1.0)])
    found = po.energies(po.solve(scene, free="length", pressure=0.5))
    assert found.potential == {}
    assert "no gradient" in found.non_conservative[0]


def test_a_straight_rod_brings_the_energy_that_its_wall_bent_it_to() -> None:
    eq = po.solve(po.Scene(ROD, wall=po.Circle(-0.1)), free="length", pressure=0.5)
    assert po.energies(eq).glued == pytest.approx(0.5 * 0.1**2 * eq.length)


@pytest.mark.slow
def test_a_rod_that_stretches_counts_its_strain() -> None:
    """Along states without a pressure d(total)/d(force) is how far the tip has gone along it."""
    tip = po.TipLoad(force=1.0, angle=1.2)
    scene = po.Scene(ROD, [po.Weight(0.02)], line_energy=0.1, stretch=5.0, glued_strain=0.02, tip=tip)
    below, eq, above = (po.solve(scene, free="force", length=2.5 + d) for d in (-2e-3, 0.0, 2e-3))
    found = po.energies(eq)
    assert found.stretch > 0.1
    assert found.non_conservative == ()
    rise = po.energies(above).total - po.energies(below).total
    assert rise / (above.answer - below.answer) == pytest.approx(found.potential["tip"] / eq.answer, rel=1e-5)
    slope = (above.answer - below.answer) / 4e-3
    assert po.sensitivities(eq)["length"] == pytest.approx(slope, rel=1e-4)


def test_what_carries_no_solution_says_so(tmp_path: object) -> None:
    eq = po.length_given_pressure(ROD, 0.5)
    path = f"{tmp_path}/state.npz"
    eq.save(path)
    with pytest.raises(po.InvalidInput, match="Compute it again"):
        po.energies(po.Equilibrium.load(path))
    with pytest.raises(po.InvalidInput, match="of a rod"):
        po.energies(po.equilibrium(beta0=4.0, lam=1.0))
    assert math.isfinite(po.energies(eq).bending)
