"""Runs on a mesh that is fixed in the rod: against independent orbits, and where they end (`readings`)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.motion.acting import loads_on
from peel_opt.motion.chain import THETA, UNKNOWNS, Chain, Z
from peel_opt.motion.memory import Memory
from peel_opt.motion.mesh import carried, chain_of, run_on_mesh
from peel_opt.motion.moments import Moment, begun, front_of, step
from peel_opt.motion.readings import Recorder, at_rest_in, missed
from peel_opt.motion.run import Posture, Setting, Until
from peel_opt.motion.tracking import track as track_front

#: Orbits of independent computations, to 1e-7: tip angle, time, front, x and y of the tip.
ORBITS = {
    (0.3, 0.9): [
        (-1.0, 0.0, 3.64493841, 0.85265751, 1.95962308),
        (-1.5, 2.20762408, 3.51085988, 1.73551122, 2.43860484),
        (-2.0, 4.02339985, 3.40604291, 2.67565186, 2.47614157),
        (-2.5, 5.73059879, 3.29663851, 3.43680291, 2.09647879),
        (-3.0, 7.586825, 3.17724219, 3.86872579, 1.44351957),
    ],
    (0.566, 0.4): [
        (-1.5, 0.0, 3.8064007, 1.92528, 2.6927433),
        (-2.0, 12.246966, 4.150443, 3.3942614, 3.0990769),
        (-2.5, 22.971071, 4.2981435, 4.6948801, 2.7966493),
    ],
}

#: With rho = c = 1 in units of the inertial time; the last column is the kinetic energy.
THROWN = [
    (-1.5, 2.55770935, 3.58874396, 1.78508336, 2.5018286, 0.0901934),
    (-2.5, 6.13763403, 3.46827857, 3.68199465, 2.21051038, 0.1257529),
    (-3.0, 7.52234746, 3.39782529, 4.221041, 1.52595603, 0.1360542),
]


def start_of(ratio, pressure, stretch=1.03):
    eq = po.length_given_pressure(po.Rod.from_ratio(ratio), pressure)
    return Posture(eq.s * stretch, eq.theta, np.zeros_like(eq.s))


def run(ratio, pressure, resolution=0, *, bond="reversible", mass=0.0, drag=1.0, stretch=1.03, **until):
    setting = Setting(ratio, COHESIVE, pressure, mass, drag, bond)
    end = Until(until.get("time", 2000.0), until.get("contact", False))
    return run_on_mesh(setting, start_of(ratio, pressure, stretch), end, resolution=resolution)


def named(track, angle):
    return next(e for e in track.events if e.kind == "angle" and abs(e.angle - angle) < 1e-9)


def missed_orbit(track, orbit):
    first = named(track, orbit[0][0]).t
    missed = []
    for angle, t, front, x, y in orbit:
        event = named(track, angle)
        missed.append((event.t - first - t, event.front - front, event.x - x, event.y - y))
    return np.abs(missed).max(axis=0)


@pytest.mark.parametrize("cell", [(0.3, 0.9), pytest.param((0.566, 0.4), marks=pytest.mark.slow)])
def test_orbits_are_those_of_front_tracking_and_come_nearer_on_a_finer_mesh(cell):
    coarse, fine = (run(*cell, resolution=i) for i in (0, 1))
    for track, scale in ((coarse, 1.0), (fine, 0.4)):
        time, *places = missed_orbit(track, ORBITS[cell])
        assert time < 0.3 * scale
        assert max(places) < 5e-3 * scale
        assert track.outcome == "folded"
        assert np.abs(track.energy.defect).max() < 2e-3 * scale
        assert np.abs(track.identity[1:]).max() < 3e-3 * scale
    eq = po.length_given_pressure(po.Rod.from_ratio(cell[0]), cell[1], state="folded")
    assert fine.front[-1] == pytest.approx(eq.length_ratio, abs=5e-4)
    assert fine.tip.y[-1] == pytest.approx(eq.tip_height, abs=5e-3)


@cache
def warm() -> tuple[Chain, Moment]:
    """A rod well on its way, on a coarse mesh."""
    chain = Chain(0.1, Memory(COHESIVE, 0.3), 0.0, 1.0)
    begins = begun(chain, start_of(0.3, 0.9), np.inf)
    return chain, carried(chain, begins, lambda _: 0.9, Until(11.0, False, False), turn=0.05).last


def orders(chain, begins, pressure, duration):
    """Return the ratios of the changes of tip angle and height, each time that the steps are halved."""
    ends = []
    for many in (10, 20, 40, 80):
        at = replace(begins, dt=np.inf)
        for _ in range(many):
            at = step(chain, at, duration / many, pressure)
        ends.append((at.u[0, THETA], at.y[0]))
    differences = np.diff(ends, axis=0)
    assert begins.y[0] < 0.95 * ends[0][1]
    return differences[:-1] / differences[1:]


def test_steps_in_time_are_of_order_two():
    chain, begins = warm()
    assert orders(chain, begins, 0.9, 4.0) == pytest.approx(np.full((2, 2), 4.0), abs=0.3)


@pytest.mark.parametrize(
    ("profile", "P"),
    [(lambda at: 1.0 - 0.4 * at.xi + 0.4 * at.xi**2, 0.95), (lambda at: 1.0 - 0.1 * at.x, 0.75)],
)
def test_a_load_that_follows_the_front_keeps_the_order_of_the_steps(profile, P):
    loads = loads_on(po.Scene(po.Rod.from_ratio(0.3), [po.Pressure(profile)]))
    chain = Chain(0.1, Memory(COHESIVE, 0.3), 0.0, 1.0, loads=loads)
    s = np.linspace(0.0, 4.3, 60)
    begins = begun(chain, Posture(s, -0.8 * (1.0 - s / 4.3) ** 2, 0.0 * s), np.inf)
    begins = carried(chain, begins, lambda _: P, Until(5.0, False, False), turn=0.05).last
    assert orders(chain, begins, P, 1.0) == pytest.approx(np.full((2, 2), 4.0), abs=0.4)


@pytest.mark.slow
def test_links_are_of_order_two(monkeypatch):
    missed = []
    for h in (0.1, 0.05):
        monkeypatch.setattr("peel_opt.motion.mesh.LINKS", (h,))
        monkeypatch.setattr("peel_opt.motion.mesh.TURNS", (0.00625,))
        missed.append(missed_orbit(run(0.3, 0.9, time=26.0), ORBITS[0.3, 0.9])[0])  # the times
    assert 3.0 < missed[0] / missed[1] < 6.0
    assert missed[1] < 2e-3


def test_a_rod_with_mass_is_thrown_as_by_front_tracking():
    track = run(0.3, 0.9, 1, mass=1.0, stretch=1.005, contact=True)
    first = named(track, -1.0).t
    for angle, t, front, x, y, kinetic in THROWN:
        event = named(track, angle)
        assert event.t - first == pytest.approx(t, abs=0.02)
        assert (event.front, event.x, event.y) == pytest.approx((front, x, y), abs=5e-3)
        assert np.interp(event.t, track.t, track.energy.kinetic) == pytest.approx(kinetic, abs=1e-3)
    assert np.abs(track.energy.defect[:-1]).max() < 1e-3  # the tip of a mesh does not bounce


@pytest.mark.slow
def test_orbits_from_two_starts_are_one():
    runs = [run(0.3, 0.9, 1, stretch=stretch) for stretch in (1.03, 1.003)]
    fronts = [[named(track, angle).front for angle in (-1.5, -2.0, -2.5, -3.0)] for track in runs]
    assert fronts[0] == pytest.approx(fronts[1], abs=2e-3)


#: Ratio, pressure, outcome, greatest and last front; (0.5, 0.5) swings without touching the plate.
ENDS = [
    (2.0, 0.5, "flat fold", 8.79, 8.54),
    (0.566, 0.6, "flapping", None, None),
]

MORE_ENDS = [
    (1.0, 0.5, "folded", None, 4.445),
    (1.0, 0.9, "flat fold", 6.48, 6.14),
    *(
        (r, P, "folded", None, None)
        for r, P in [(0.05, 0.96), (0.05, 0.999), (0.2, 0.99), (0.3, 0.96), (0.3, 0.8)]
    ),
    *(
        (r, P, "folded", None, None)
        for r, P in [(0.4, 0.7), (0.566, 0.4), (1.0, 0.3), (0.5, 0.9), (0.566, 0.9)]
    ),
    *((r, P, "folded", None, None) for r, P in [(0.566, 0.8), (2.0, 0.2)]),
    *((r, P, "flapping", None, None) for r, P in [(0.5, 0.5), (1.0, 0.6)]),
    *((r, P, "flat fold", None, None) for r, P in [(0.5, 0.99), (0.566, 0.96), (0.7, 0.9)]),
    (1.0, 0.99, "flat fold", None, 10.44),
    (1.0, 0.96, "flat fold", 7.95, 7.83),
    (1.0, 0.8, "flat fold", 5.75, 5.234),
    (1.0, 0.7, "flat fold", 5.47, 4.88),
    (2.0, 0.9, "flat fold", 20.76, 20.76),
    (2.0, 0.8, "flat fold", 16.53, 16.53),
    (2.0, 0.7, "flat fold", 13.37, 13.37),
    (2.0, 0.6, "flat fold", 10.79, 10.73),
    (2.0, 0.4, "flat fold", 7.59, 7.12),
    (2.0, 0.3, "flat fold", 7.13, 6.44),
    (0.566, 0.99, "flat fold", 5.28, 4.83),
]


@pytest.mark.parametrize(
    ("ratio", "pressure", "outcome", "most", "last"),
    [*ENDS, *(pytest.param(*row, marks=pytest.mark.slow) for row in MORE_ENDS)],
)
def test_where_snaps_end(ratio, pressure, outcome, most, last):
    track = run(ratio, pressure, int(pressure == 0.99))
    assert track.outcome == outcome
    if most is not None:
        assert track.front.max() == pytest.approx(most, rel=5e-3)
    if last is not None:
        assert track.front[-1] == pytest.approx(last, rel=5e-3)
    if outcome == "flat fold":
        assert track.theta[-1, 0] == pytest.approx(-np.pi, abs=1e-6)
        loop = po.flat_fold(po.Rod.from_ratio(ratio), pressure)
        down = np.flatnonzero(track.y[-1] > 0.0)[0] - 1
        landing = track.fraction[down] * track.front[-1]
        assert track.front[-1] - landing == pytest.approx(loop.length_ratio, abs=0.03 * track.front[-1])
    if outcome == "folded" and pressure < 0.99:
        eq = po.length_given_pressure(po.Rod.from_ratio(ratio), pressure, state="folded")
        assert track.front[-1] == pytest.approx(eq.length_ratio, rel=5e-3)


def test_a_flaw_that_is_too_short_closes_and_a_rod_may_run_out():
    assert run(0.566, 0.6, stretch=0.97).outcome == "closes"
    setting = Setting(2.0, COHESIVE, 0.9, 0.0, 1.0, "reversible", 8.0)
    track = run_on_mesh(setting, start_of(2.0, 0.9), Until(500.0, contact=False))
    assert track.outcome == "end of rod"
    assert track.front[-1] < 8.0


def test_contact_is_where_a_run_may_be_told_to_stop():
    track = run(0.566, 0.6, contact=True)
    assert track.outcome == "contact"
    assert track.tip.y[-1] == 0.0
    assert track.energy.bond_loss.max() == 0.0


@pytest.mark.slow
def test_close_to_the_strength_the_difference_of_two_meshes_tells_their_error():
    # There the height of the tip is the difference of two nearly equal numbers.
    coarse, fine = (run(0.05, 0.999, resolution=i) for i in (0, 1))
    exact = po.length_given_pressure(po.Rod.from_ratio(0.05), 0.999, state="folded").length_ratio
    assert coarse.outcome == fine.outcome == "folded"
    assert abs(fine.front[-1] - exact) < abs(fine.front[-1] - coarse.front[-1])


#: Lifted, unfolded and folded lengths over eta, at p = 0.3 T0 and eta = y0, of an edge of eta without glue.
EDGE = (2.27628485, 3.38894711, 4.98475689)
FLAT = Posture(np.linspace(0.0, 1.0, 3), np.zeros(3), np.zeros(3))


def run_scene(
    scene, pressure, resolution=0, start=FLAT, *, bond="reversible", mass=0.0, contact=False, time=2000.0
):
    setting = Setting(scene.rod.ratio, COHESIVE, pressure, mass, 1.0, bond, np.inf, loads_on(scene))
    return run_on_mesh(setting, start, Until(time, contact), resolution=resolution)


@pytest.mark.parametrize("bond", ["reversible", "damage"])
def test_an_edge_rises_into_its_lifted_state(bond):
    for resolution, scale in ((0, 1.0), (1, 0.3)):
        track = run_scene(po.Scene(po.Rod.from_ratio(1.0), unbonded=1.0), 0.3, resolution, bond=bond)
        assert track.outcome == ("standing" if bond == "reversible" else "held")
        if bond == "reversible":  # under damage the front is what was reached, and short of the same state
            assert track.front[-1] == pytest.approx(EDGE[0], abs=2e-3 * scale)
        assert np.abs(track.identity[1:]).max() < 1e-4 * scale
        assert np.abs(track.energy.defect).max() < 5e-5


def test_a_weight_is_a_stronger_bond_of_longer_range():
    # T0 -> T0 + w, y0 -> y0 (1 + w/T0) under the linear law, exactly: here on two meshes that are one.
    w, h, dt = 0.3, 0.1, 0.05
    eta = (1.0 + w) ** (-1.0 / 3.0)
    weighed = loads_on(po.Scene(po.Rod.from_ratio(0.7), [po.Weight(w)]))
    chains = (
        Chain(h, Memory(LINEAR, 0.7), 0.0, 1.0, loads=weighed),
        Chain(h / eta, Memory(LINEAR, 0.7 * eta / (1.0 + w)), 0.0, 1.0),
    )
    found = []
    for chain, T0, unit in zip(chains, (1.0, 1.0 + w), (1.0, eta), strict=True):
        s = np.linspace(0.0, 4.0, 50)
        at = begun(chain, Posture(s / unit, -0.8 * (1.0 - s / 4.0) ** 2, 0.0 * s), 5.0 / unit)
        for _ in range(20):
            at = step(chain, at, dt * T0 / unit, 0.9 / T0)
        found.append((at.u[:, THETA], at.y * unit))
    np.testing.assert_allclose(*found, atol=1e-8)
    assert found[0][1][0] > 0.8


def ramp(scene, times, pressures, bond="reversible"):
    setting = Setting(scene.rod.ratio, COHESIVE, pressures[0], 0.0, 1.0, bond, np.inf, loads_on(scene))
    chain = chain_of(setting, 0)
    until, longest = Until(times[-1], False, False), times[-1] / 100
    return carried(
        chain,
        begun(chain, FLAT, np.inf),
        lambda t: float(np.interp(t, times, pressures)),
        until,
        turn=0.05,
        longest=longest,
    ).track


def test_an_edge_that_lies_down_rises_again():
    edge = po.Scene(po.Rod.from_ratio(1.0), unbonded=1.0)
    track = ramp(edge, [0.0, 200.0, 400.0, 420.0, 620.0], [0.3, 0.3, 0.0, 0.0, 0.3])
    down = (track.t > 410.0) & (track.t < 420.0)
    assert track.y[down].max() < 1e-12
    assert track.front[-1] == pytest.approx(EDGE[0], abs=0.03)  # it lags
    assert track.outcome == "not settled"


def test_where_the_attached_rod_is_pulled_off_nothing_is_followed():
    grows = po.Pressure(lambda at: 0.3 * at.s)
    with pytest.raises(po.OutOfRange, match="pulled off"):
        run_scene(po.Scene(po.Rod.from_ratio(1.0), [grows], unbonded=3.0), 0.9)


def test_a_rod_with_mass_that_swings_is_not_at_rest_where_it_turns():
    edge = po.Scene(po.Rod.from_ratio(1.0), unbonded=1.0)
    setting = Setting(1.0, COHESIVE, 0.3, 1.0, 0.1, loads=loads_on(edge))
    track = run_on_mesh(setting, FLAT, Until(2000.0, contact=False))
    assert track.outcome == "standing"
    assert track.front.max() > EDGE[0] + 0.3
    assert track.tip.y[-1] == pytest.approx(0.3658, abs=1e-3)
    assert np.abs(track.energy.defect).max() < 1e-3


#: What acts, and at which pressure: every load, what is done to the tip, and loads that feel their place.
SCENES = {
    "edge": ({"unbonded": 0.97}, 0.3),
    "weight": ({"unbonded": 1.0, "loads": [po.Weight(0.05, 0.5)]}, 0.3),
    "dead": ({"unbonded": 1.0, "loads": [po.Pressure(dead=0.5)]}, 0.3),
    "friction": ({"unbonded": 1.0, "loads": [po.SkinFriction(0.1)]}, 0.3),
    "drag": ({"unbonded": 1.0, "loads": [po.Drag(-0.1)]}, 0.25),
    "force": ({"unbonded": 1.0, "tip": po.TipLoad(0.1, 1.2)}, 0.2),
    "moment": ({"tip": po.TipLoad(moment=-0.3)}, 0.3),
    "curl": ({"natural_curvature": 0.3}, 0.3),
    "until": ({"unbonded": 1.0, "loads": [po.Pressure(until=1.33)]}, 0.4),
    "along": ({"unbonded": 1.0, "loads": [po.Pressure(lambda at: ca.exp(-at.s))]}, 0.4),
    "share": ({"unbonded": 1.0, "loads": [po.Pressure(lambda at: 1.0 - 0.5 * at.xi)]}, 0.3),
    "turned": ({"unbonded": 1.0, "loads": [po.Pressure(lambda at: ca.cos(at.theta) ** 2)]}, 0.3),
    "height": ({"unbonded": 1.0, "loads": [po.Pressure(lambda at: 1.0 + at.y)]}, 0.25),
    "place": ({"unbonded": 1.0, "loads": [po.Pressure(lambda at: ca.exp(0.1 * at.x))]}, 0.35),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_a_lifted_rod_rests_in_its_equilibrium(name):
    parts, P = SCENES[name]
    scene = po.Scene(po.Rod.from_ratio(1.0), **parts)
    eq = po.solve(scene, free="length", pressure=P)
    assert eq.state == "lifted"
    for resolution, scale in ((0, 1.0), (1, 0.3)):
        track = run_scene(scene, P, resolution)
        assert track.outcome == "standing"
        assert track.front[-1] == pytest.approx(eq.length_ratio, abs=4e-3 * scale)
        assert track.tip.angle[-1] == pytest.approx(eq.theta[0], abs=5e-4 * max(scale, 0.5))
        assert abs(track.identity[-1]) < 3e-4 * scale


#: Scenes that snap, from 2 % beyond their unfolded state, and at which pressure.
SNAPS = {
    "edge and weight": ({"unbonded": 1.0, "loads": [po.Weight(0.05)]}, 0.33),
    "friction and force": ({"loads": [po.SkinFriction(0.05)], "tip": po.TipLoad(0.05, 1.2)}, 0.5),
    "until": ({"unbonded": 1.0, "loads": [po.Pressure(until=2.03)]}, 0.35),
    "place": ({"unbonded": 1.0, "loads": [po.Pressure(lambda at: 1.0 - 0.1 * at.x)]}, 0.25),
    "share": ({"unbonded": 1.0, "loads": [po.Pressure(lambda at: 1.0 - 0.3 * at.xi)]}, 0.35),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SNAPS)
def test_scenes_move_as_by_front_tracking(name):
    parts, P = SNAPS[name]
    scene = po.Scene(po.Rod.from_ratio(1.0), **parts)
    eq = po.solve(scene, free="length", pressure=P, state="unfolded")
    start = Posture(1.02 * eq.s, eq.theta, np.zeros_like(eq.s))
    setting = Setting(1.0, COHESIVE, P, 0.0, 1.0, loads=loads_on(scene))
    exact, turns = track_front(setting, start, Until(400.0)), {}
    for event in exact.events:
        if event.kind == "angle":
            turns.setdefault(round(event.angle, 6), event)
    begins, *orbit = [(angle, e.t, e.front, e.x, e.y) for angle, e in turns.items()][1:]
    orbit = [(angle, t - begins[1], *at) for angle, t, *at in (begins, *orbit)]
    for resolution, scale in ((0, 1.0), (1, 0.35)):
        track = run_scene(scene, P, resolution, start, contact=True)
        time, *places = missed_orbit(track, orbit)
        assert len(orbit) > 1
        assert time < 0.15 * scale
        assert max(places) < 4e-3 * scale
        for part in ("bending", "separation", "work", "drag"):
            ends = [getattr(run.energy, part)[-1] for run in (track, exact)]
            assert ends[0] == pytest.approx(ends[1], abs=6e-3 * scale)


def lies(*heights):
    """A rod at rest, folded over, with nodes at these heights and an open one behind."""
    y, n = np.array([*heights, 1.0, 0.0]), len(heights) + 2
    u, r = np.zeros((n, UNKNOWNS)), np.zeros((2, n))
    u[:, THETA] = np.linspace(-np.pi, 0.0, n)
    return Moment(0.0, u, y, r, r, r, y, np.inf, r, r, u)


def test_a_rod_at_rest_on_the_plate_may_touch_it_behind_its_tip():
    chain = Chain(0.1, Memory(COHESIVE, 1.0), 0.0, 1.0)
    assert at_rest_in(chain, lies(0.3)) == "folded"
    assert at_rest_in(chain, lies(0.0, 0.1)) == "touching"
    assert at_rest_in(chain, lies(0.1, 0.0, 0.1)) == "touching"
    assert at_rest_in(chain, lies(0.1, 0.0, 0.0, 0.1)) == "touching"
    assert at_rest_in(chain, lies(0.0, 0.0, 0.1)) == "flat fold"
    assert at_rest_in(chain, lies(0.1, 0.0, 0.0, 0.0, 0.1)) == "flat fold"


def test_a_tip_that_its_own_curvature_presses_down_is_not_lifted():
    # At rest C |sin theta| = theta'(0)^2 / 2, by the identity: the plate pushes, and no bond holds.
    curled = po.Scene(po.Rod.from_ratio(1.0), natural_curvature=0.3)
    track = run_scene(curled, 0.8)
    assert track.outcome == "touching"
    assert {event.kind for event in track.events} == {"start", "angle", "contact", "arrest"}


def test_a_pressure_that_decays_may_exceed_the_bond_at_the_tip():
    # From a flat rod: it comes to rest where the front of the lifted state is, behind which p < T0.
    decays = po.Scene(po.Rod.from_ratio(1.0), [po.Pressure(lambda at: ca.exp(-at.s / 5.0))])
    track = run_scene(decays, 1.08)
    assert track.outcome == "standing"
    assert track.front[-1] == pytest.approx(1.21174569, abs=2e-3)
    with pytest.raises(po.OutOfRange, match="pulled off"):
        run_scene(po.Scene(po.Rod.from_ratio(1.0), [po.Pressure(lambda at: 1.0 - 0.01 * at.s)]), 1.5)


@pytest.mark.slow
def test_a_load_that_grows_ahead_of_the_front_does_not_act_there():
    grows = po.Scene(po.Rod.from_ratio(1.0), [po.Pressure(lambda at: ca.exp(0.1 * at.x))], unbonded=1.0)
    eq = po.solve(grows, free="length", pressure=0.9, state="folded")
    assert run_scene(grows, 0.9).front[-1] == pytest.approx(eq.length_ratio, abs=2e-3)


def test_a_tip_that_lies_for_a_while_and_rises_again_has_turned_there():
    kept, told = Recorder(Chain(0.1, Memory(COHESIVE, 1.0), 0.0, 1.0)), []
    for height in [0.0, 0.5, 1.0, 0.4, 0.0, 0.0] * 8:
        kept.rows.append([0.0, 0.0, height])
        told.append(len(kept.rows) > 1 and kept.repeats())
    assert kept.turns == [1.0, 0.0] * 7 + [1.0]
    assert told.index(True) == 6 * 4 + 1  # eight turns


def test_what_holds_a_tip_down_counts_in_the_identity():
    chain, at = warm()
    held = replace(chain, tip_at=float(at.y[0]))
    for _ in range(8):  # in which the rod comes to rest but for its tip
        at = step(held, at, 0.2, 0.9)
    assert at.u[0, Z] > 0.3  # as a force per length of the tip's half link
    assert abs(missed(chain, at, 0.9)) > 0.01
    assert abs(missed(held, at, 0.9)) < 2e-3


def test_a_natural_curvature_moves_a_rod_as_a_moment_does():
    rod = po.Rod.from_ratio(1.0)
    curled, bent = (
        run_scene(scene, 0.3, time=3.0)
        for scene in (po.Scene(rod, natural_curvature=0.3), po.Scene(rod, tip=po.TipLoad(moment=-0.3)))
    )
    np.testing.assert_allclose(curled.y, bent.y, atol=1e-12)
    np.testing.assert_allclose(curled.energy.defect, bent.energy.defect, atol=1e-12)
    # What the moment has done is in the one ledger work, in the other bending that it gives back.
    gained = [run.energy.bending[-1] - run.energy.bending[0] for run in (curled, bent)]
    assert bent.energy.work[-1] - curled.energy.work[-1] == pytest.approx(gained[1] - gained[0])
    assert gained[0] < -0.01 < 0.01 < gained[1]


def test_a_damaged_front_is_no_further_than_what_was_open():
    # Heights that hardly change with the distance, as those of a wave, would vanish far beyond the rod.
    chain = Chain(0.1, Memory(COHESIVE, 1.0, "damage"), 0.0, 1.0)
    assert front_of(chain, lies(1.3, 1.001, 1.0)) == pytest.approx(0.5)
    assert front_of(chain, lies(64.0, 27.0, 8.0)) == pytest.approx(0.4)
