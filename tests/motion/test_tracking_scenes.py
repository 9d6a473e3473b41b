"""A tracked front under the loads of a scene: derivatives, growth, and where it comes to rest."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import peel_opt as po
from peel_opt.base.threads import one_thread
from peel_opt.motion.acting import SceneLoads
from peel_opt.motion.departure import departure, stretched
from peel_opt.motion.flap import Flap, Phase
from peel_opt.motion.run import Posture, Setting, Track, Until
from peel_opt.motion.tracking import track

ROD = po.Rod.from_ratio(1.0)
EDGE = po.Scene(ROD, unbonded=1.0)

#: A scene with all that may act on a moving rod.
MANY = po.Scene(
    ROD,
    loads=[
        po.Pressure(
            profile=lambda place: 1.0 + 0.1 * place.x * place.s - 0.2 * place.xi + 0.1 * place.y,
            dead=0.2,
            until=2.0,
        ),
        po.Weight(0.1, 0.3),
        po.SkinFriction(share=0.1),
        po.Drag(0.05),
    ],
    unbonded=0.5,
    natural_curvature=0.1,
    tip=po.TipLoad(force=0.1, angle=1.0, moment=-0.2),
)
#: One on a wall that is not flat.
CURVED = po.Scene(ROD, wall=po.Circle(-0.2), unbonded=0.5, natural_curvature=0.1, tip=po.TipLoad(moment=-0.2))
GLUED, DRY = frozenset({"unbonded"}), frozenset({"unbonded", "until"})


def setting(scene: po.Scene, pressure: float, mass: float = 0.0, drag: float = 1.0) -> Setting:
    """What drives the rod of a scene."""
    return Setting(scene.rod.ratio, scene.bond.law, pressure, mass, drag, loads=SceneLoads(scene))


@one_thread
def run(scene: po.Scene, pressure: float, start: Posture, time: float = 3000.0) -> Track:
    """Follow a rod to rest."""
    until = Until(time, contact=False, arrest=True)
    return track(setting(scene, pressure), start, until, resolution=1)


def moved(scene: po.Scene, mass: float, degree: int) -> tuple[Flap, np.ndarray, np.ndarray, np.ndarray]:
    """Return a flap in all its phases with unknowns, rates and rates of rates of no meaning."""
    phases = (Phase(None), Phase(1, GLUED), Phase(0, GLUED))
    if scene is MANY:
        phases = (Phase(None), Phase(1, GLUED), Phase(1, DRY), Phase(0, DRY))
    flap = Flap(setting(scene, 0.6, mass, 0.8), phases, (degree, 5, 6, 7)[: len(phases)])
    u, z, a = 0.3 * np.random.default_rng(1).normal(size=(3, flap.size))
    u[flap.lengths] = [1.2, 1.7, 1.4, 1.1][: len(phases)]
    return flap, u, z, a


@pytest.mark.parametrize("scene", [MANY, CURVED])
@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_the_derivatives_are_those_of_the_residual(scene: po.Scene, mass: float) -> None:
    flap, u, z, a = moved(scene, mass, 7)
    at, moving = flap.balance(u, z, a), slice(0, flap.lengths.stop)
    for which, found in enumerate((at.by_state, at.by_rate[:, moving], at.by_second[:, moving])):
        for i, column in enumerate(found.T):
            ends = []
            for step in (1e-6, -1e-6):
                beside = [u.copy(), z.copy(), a.copy()]
                beside[which][i] += step
                ends.append(flap.residual(*beside))
            assert column == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-8)


def test_velocities_and_accelerations_over_a_curved_wall_are_those_of_the_places() -> None:
    flap, u, z, a = moved(CURVED, 1.0, 9)
    at, rates, step = flap.shapes(u), flap.rates(flap.shapes(u), z, a), 1e-5

    def later(t: float) -> tuple[np.ndarray, np.ndarray]:
        state = u + t * z + 0.5 * t * t * a
        there = flap.rates(flap.shapes(state), z + t * a, 0.0 * a)
        shapes = flap.shapes(state)
        return np.array([shapes.x, shapes.y]), np.array([there.vx, there.vy])

    (before, slow), (after, fast) = later(-step), later(step)
    passing = (
        z[flap.lengths] @ flap.basis.per_length(np.ones_like(at.s)).T
    )  # what a fraction has to the front
    along = z[flap.lengths].sum() - passing
    velocity = (after - before) / (2.0 * step) - along * np.array([at.cosine, at.sine])
    np.testing.assert_allclose(velocity, [rates.vx, rates.vy], atol=1e-8)
    turned = along * rates.spin * np.array([-at.sine, at.cosine])
    np.testing.assert_allclose((fast - slow) / (2.0 * step) - turned, [rates.ax, rates.ay], atol=1e-8)


def test_the_power_of_the_loads_is_what_they_do() -> None:
    flap = Flap(setting(MANY, 0.6), (Phase(None), Phase(1, GLUED), Phase(1, DRY), Phase(0, DRY)), (9,) * 4)
    u, z = 0.1 * np.random.default_rng(2).normal(size=(2, flap.size))
    u[flap.lengths] = [0.5, 1.5, 1.4, 1.1]
    z[flap.lengths] = [0.0, 0.0, 0.4, -0.2]
    z[flap.multipliers] = 0.0
    without = Flap(setting(po.Scene(ROD, loads=MANY.loads, unbonded=0.5), 0.6), flap.phases, flap.degrees)
    tips = [flap.tip(u + step * z) for step in (1e-5, -1e-5)]
    vx, vy, spin = ((getattr(tips[0], name) - getattr(tips[1], name)) / 2e-5 for name in ("x", "y", "angle"))
    Fx, Fy = flap.setting.loads.tip_force
    at_tip = Fx * vx + Fy * vy - 0.2 * spin
    assert flap.powers(u, z)[0] - without.powers(u, z)[0] == pytest.approx(at_tip, abs=1e-9)


@functools.cache
def unfolded() -> po.Equilibrium:
    """The unstable state of the edge that was never glued."""
    return po.solve(EDGE, free="length", pressure=0.3, state="unfolded")


def test_an_edge_leaves_its_unstable_state_at_the_rate_that_is_known_otherwise() -> None:
    left = departure(setting(EDGE, 0.3), unfolded())
    assert left.growth == pytest.approx(po.growth_rate(unfolded()), abs=1e-10)
    found = track(setting(EDGE, 0.3), left.posture, Until(20.0, contact=False, arrest=False))
    assert found.outcome == "not settled"
    assert np.abs(found.identity).max() < 1e-12
    assert np.abs(found.energy.defect).max() < 1e-9


@pytest.mark.slow
def test_an_edge_rests_folded_or_lifted_by_where_it_begins() -> None:
    folded = run(EDGE, 0.3, stretched(unfolded(), 1.02 * unfolded().length))
    assert folded.outcome == "folded"
    known = po.solve(EDGE, free="length", pressure=0.3, state="folded")
    assert folded.front[-1] == pytest.approx(known.length, abs=1e-7)
    lifted = run(EDGE, 0.3, stretched(unfolded(), 0.95 * unfolded().length))
    assert lifted.outcome == "standing"
    known = po.solve(EDGE, free="length", pressure=0.3, state="lifted")
    assert lifted.front[-1] == pytest.approx(known.length, abs=1e-7)


@pytest.mark.slow
def test_beyond_what_it_holds_an_edge_snaps_from_rest() -> None:
    low = po.solve(EDGE, free="length", pressure=0.3535, state="lifted")
    found = run(EDGE, 0.36, stretched(low, low.length))
    assert found.outcome == "folded"
    known = po.solve(EDGE, free="length", pressure=0.36, state="folded")
    assert found.front[-1] == pytest.approx(known.length, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    "parts",
    [
        {"loads": [po.Weight(0.02)]},
        {"loads": [po.SkinFriction(traction=0.01)]},
        {"loads": [po.Drag(-0.02)], "unbonded": 0.5},
        {"loads": [po.Pressure(until=2.5)]},
        {"natural_curvature": 0.02},
        {"tip": po.TipLoad(force=0.02, angle=1.5)},
    ],
)
def test_a_snap_comes_to_rest_in_the_folded_equilibrium(parts: dict[str, object]) -> None:
    scene = po.Scene(ROD, **parts)
    start = po.solve(scene, free="length", pressure=0.3, state="unfolded")
    left = departure(setting(scene, 0.3), start)
    assert left.growth == pytest.approx(po.growth_rate(start), rel=1e-9)
    found = run(scene, 0.3, left.posture)
    assert found.outcome == "folded"
    near = float(found.front[-1])
    known = po.solve(scene, free="length", pressure=0.3, state="folded", near=near)
    assert near == pytest.approx(known.length, abs=1e-6)
    assert np.abs(found.identity).max() < 1e-5
    assert np.abs(found.energy.defect).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wall", "rod", "unbonded"), [(0.1, 0.12, 0.0), (0.05, 0.05, 1.0), (-0.05, -0.05, 0.5)]
)
def test_a_snap_off_a_curved_wall_comes_to_rest_in_the_folded_equilibrium(
    wall: float, rod: float, unbonded: float
) -> None:
    scene = po.Scene(ROD, wall=po.Circle(wall), natural_curvature=rod, unbonded=unbonded)
    start = po.solve(scene, free="length", pressure=0.3, state="unfolded")
    left = departure(setting(scene, 0.3), start)
    assert left.growth == pytest.approx(po.growth_rate(start), rel=1e-9)
    found = run(scene, 0.3, left.posture)
    assert found.outcome == "folded"
    near = float(found.front[-1])
    known = po.solve(scene, free="length", pressure=0.3, state="folded", near=near)
    assert near == pytest.approx(known.length, abs=1e-6)
    assert found.tip.angle[-1] == pytest.approx(known.tip_angle + wall * near, abs=1e-6)
    assert np.abs(found.identity).max() < 1e-10
    assert np.abs(found.energy.defect).max() < 1e-7


@pytest.mark.slow
def test_nothing_stops_a_peel_under_a_load_that_does_not_turn_with_the_rod() -> None:
    dead = po.Scene(ROD, loads=[po.Pressure(dead=1.0)])
    start = po.solve(dead, free="length", pressure=0.3, state="unfolded")
    found = run(dead, 0.3, stretched(start, 1.05 * start.length), time=100.0)
    assert found.outcome == "not settled"
    late = found.t > 50.0
    speeds = np.gradient(found.front[late], found.t[late])
    assert speeds.min() > 0.2  # it goes on and on
    assert np.abs(found.identity).max() < 1e-11
