"""A snap: one orbit whatever it starts from, its end, its energies, its units and what is refused.

Modules: `snap`, `departure`, `layout`, `trajectory`.  The orbits come from another code, which collocates
at Chebyshev points and follows front and height y0 too.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import peel_opt as po
from peel_opt.base.records import Schema
from peel_opt.model.bond import COHESIVE
from peel_opt.motion import tiers
from peel_opt.motion.departure import held_at, stretched
from peel_opt.motion.run import PARTS, Setting, in_parts
from peel_opt.motion.tracking import goes_round
from peel_opt.motion.trajectory import Happening

#: Tip angle, time since the first of them, front, x and y of the tip, in eta and c eta/T0 or t_i.
ORBITS = {
    (0.3, 0.9, 0.0, 1.0): [
        (-1.0, 0.0, 3.64493841, 0.85265751, 1.95962308),
        (-1.5, 2.20762408, 3.51085988, 1.73551122, 2.43860484),
        (-2.0, 4.02339985, 3.40604291, 2.67565186, 2.47614157),
        (-2.5, 5.73059879, 3.29663851, 3.43680291, 2.09647879),
        (-3.0, 7.586825, 3.17724219, 3.86872579, 1.44351957),
    ],
    (0.566, 0.4, 0.0, 1.0): [
        (-1.5, 0.0, 3.8064007, 1.92528, 2.6927433),
        (-2.0, 12.246966, 4.150443, 3.3942614, 3.0990769),
        (-2.5, 22.971071, 4.2981435, 4.6948801, 2.7966493),
    ],
    (0.05, 0.97, 0.0, 1.0): [
        (-1.0, 0.0, 3.36172798, 0.76793473, 1.77749137),
        (-1.5, 15.32941867, 3.04275006, 1.44293371, 2.06108387),
        (-2.0, 29.74198011, 2.87506174, 2.15794938, 2.04614225),
        (-2.5, 53.06779418, 2.80196492, 2.82011553, 1.76838159),
    ],
    (0.3, 0.9, 1.0, 1.0): [
        (-1.0, 0.0, 3.68455086, 0.86363725, 1.98361897),
        (-1.5, 2.55770935, 3.58874396, 1.78508336, 2.5018286),
        (-2.0, 4.50672685, 3.5285279, 2.80745185, 2.57916825),
        (-2.5, 6.13763403, 3.46827857, 3.68199465, 2.21051038),
        (-3.0, 7.52234746, 3.39782529, 4.221041, 1.52595603),
    ],
    (0.3, 0.9, 1.0, 0.0): [
        (-1.0, 0.0, 3.8151137, 0.8942582, 2.0544671),
        (-2.0, 2.0152705, 4.0137085, 3.2709016, 2.9676981),
        (-3.0, 3.504862, 4.5067368, 6.0613145, 1.9093482),
    ],
}

#: How well the other code knows them.
KNOWN = {
    (0.3, 0.9, 0.0, 1.0): 2e-8,
    (0.566, 0.4, 0.0, 1.0): 2e-6,
    (0.05, 0.97, 0.0, 1.0): 5e-8,
    (0.3, 0.9, 1.0, 1.0): 2e-7,
    (0.3, 0.9, 1.0, 0.0): 5e-7,
}

#: U and Phi at the angles of the first orbit, and K of the last.
ENERGIES = {-1.0: (0.1999337, 2.0019795), -2.0: (0.8895982, 2.5015019), -3.0: (2.1407707, 2.0789158)}


#: What is computed for every run of the tests.
SHARED = [(0.3, 0.9, 0.0, 1.0), (0.3, 0.9, 1.0, 0.0)]


@pytest.fixture(scope="module")
def overdamped() -> po.Snap:
    return orbit(*SHARED[0])


@cache
def orbit(r: float, P: float, mass: float, drag: float) -> po.Snap:
    """To rest, or with a mass to where it comes down."""
    rod = po.Rod.from_ratio(r)
    if not mass:
        return po.snap(rod, P, drag=drag)
    with pytest.raises(po.OutOfRange, match="rod came down") as raised:
        po.snap(rod, P, mass=mass, drag=drag)
    landed = raised.value.candidates[0]
    assert isinstance(landed, po.Snap)
    return landed


def passed(snapped: po.Snap) -> dict[float, tuple[float, float, float, float]]:
    """When, and with which front and tip, an angle is passed first."""
    events = [e for e in snapped.events if e.kind == "angle"][::-1]
    return {round(e.angle, 6): (e.t, e.front, e.x, e.y) for e in events}


@pytest.mark.parametrize(
    "asked", [pytest.param(asked, marks=() if asked in SHARED else pytest.mark.slow) for asked in ORBITS]
)
def test_the_orbit_is_that_of_another_code(asked: tuple[float, ...]) -> None:
    snapped = orbit(*asked)
    found, tol = passed(snapped), KNOWN[asked]
    begin = found[ORBITS[asked][0][0]][0]
    for angle, t, front, x, y in ORBITS[asked]:
        ours = np.array(found[angle]) - (begin, 0.0, 0.0, 0.0)
        assert ours == pytest.approx([t, front, x, y], abs=tol)
    assert snapped.error < 1e-6
    assert snapped.t[0] == snapped.event("start").t == 0.0
    assert np.abs(snapped.certificate).max() < 1e-10
    assert np.abs(snapped.energy.defect).max() < 1e-7


def test_energies_are_those_of_another_code(overdamped: po.Snap) -> None:
    for angle, (bending, separation) in ENERGIES.items():
        i = int(np.argmin(np.abs(overdamped.tip.angle - angle)))
        near = slice(i - 3, i + 4)
        order = np.argsort(overdamped.tip.angle[near])
        for values, expected in (
            (overdamped.energy.bending, bending),
            (overdamped.energy.separation, separation),
        ):
            polynomial = np.polynomial.Polynomial.fit(
                overdamped.tip.angle[near][order] - angle, values[near][order], 6
            )
            assert polynomial(0.0) == pytest.approx(expected, abs=2e-6)


def test_it_ends_in_the_folded_equilibrium_and_drag_takes_the_rest(overdamped: po.Snap) -> None:
    rod = po.Rod.from_ratio(0.3)
    fold = po.length_given_pressure(rod, 0.9, state="folded")
    assert overdamped.outcome == "folded"
    assert overdamped.front[-1] == pytest.approx(fold.length, abs=1e-7)
    assert overdamped.tip.angle[-1] == pytest.approx(fold.tip_angle, abs=1e-6)
    energy = overdamped.energy
    assert energy.drag[-1] == pytest.approx(1.4607524, abs=2e-7)
    rise = energy.bending + energy.separation
    assert rise[-1] - rise[0] == pytest.approx(3.877584767, abs=5e-4)  # it starts 1e-4 rad off
    assert energy.work[-1] - energy.drag[-1] == pytest.approx(rise[-1] - rise[0], abs=1e-7)
    assert overdamped.growth_rate == pytest.approx(
        po.growth_rate(po.length_given_pressure(rod, 0.9)), abs=1e-8
    )


@pytest.mark.parametrize("kind", ["flaw", pytest.param("start", marks=pytest.mark.slow)])
def test_orbits_from_other_starts_agree(overdamped: po.Snap, kind: str) -> None:
    rod = po.Rod.from_ratio(0.3)
    unfolded = po.length_given_pressure(rod, 0.9)
    other = (
        po.snap(rod, 0.9, flaw=1.0005 * unfolded.length, until=60.0)
        if kind == "flaw"
        else po.snap(rod, 0.9, start=po.length_given_pressure(rod, 0.8998), until=60.0)
    )
    assert math.isnan(other.growth_rate)
    first, second = passed(overdamped), passed(other)
    for angle in (-1.5, -2.0, -2.5, -3.0):
        ours = np.array(first[angle]) - (first[-1.0][0], 0.0, 0.0, 0.0)
        theirs = np.array(second[angle]) - (second[-1.0][0], 0.0, 0.0, 0.0)
        assert ours == pytest.approx(theirs, abs=3e-8)


@pytest.mark.parametrize("bond", ["no_rebond", pytest.param("reversible", marks=pytest.mark.slow)])
def test_a_flaw_shorter_than_critical_closes(bond: str) -> None:
    rod = po.Rod.from_ratio(0.3)
    snapped = po.snap(rod, 0.9, flaw=0.97 * po.length_given_pressure(rod, 0.9).length, bond=bond)
    assert snapped.outcome == "closes"
    assert snapped.front[-1] < 0.1 * snapped.front[0]
    assert np.all(np.diff(snapped.tip.y) < 0.0)


@pytest.fixture(scope="module")
def landed() -> po.Snap:
    return po.snap(po.Rod.from_ratio(0.3), 0.99, until="contact")


def test_where_the_tip_lands(landed: po.Snap) -> None:
    assert landed.outcome == "contact"
    assert landed.tip.y[-1] == pytest.approx(0.0, abs=1e-9)
    assert landed.tip.angle[-1] < -math.pi
    assert landed.front.max() == pytest.approx(5.3, abs=0.05)  # on a fixed mesh
    thrown = orbit(*SHARED[1])
    assert thrown.outcome == "contact"
    assert thrown.tip.y[-1] == pytest.approx(0.0, abs=1e-9)


def test_beyond_contact_a_mesh_goes_on_and_its_error_covers_where_the_tip_lands(landed: po.Snap) -> None:
    beyond = po.snap(po.Rod.from_ratio(0.3), 0.99, until=54.0)
    ours, known = beyond.event("contact"), landed.event("contact")
    assert abs(ours.front - known.front) <= beyond.error < 5e-3
    assert abs(ours.x - known.x) <= beyond.error
    assert abs(ours.t - known.t) <= beyond.time_error < 0.1
    assert ours.y == 0.0
    assert beyond.t[-1] == 54.0
    assert np.all(np.diff(beyond.t) > 0.0)
    assert np.abs(np.diff(beyond.front)).max() < 0.1
    assert np.abs(beyond.energy.defect).max() < 1e-2


@pytest.mark.slow
def test_close_to_T0_a_state_is_left_however_slowly() -> None:
    """Its first motions are slower than those of a rod at rest."""
    landed = po.snap(po.Rod.from_ratio(0.089), 0.99999, until="contact")
    assert landed.outcome == "contact"
    assert abs(landed.tip.y[-1]) < 1e-8
    assert landed.error < 1e-4
    assert np.abs(landed.certificate).max() < 1e-6


@pytest.mark.slow
def test_a_rod_of_its_own_length_runs_out() -> None:
    rod = po.Rod.from_ratio(0.3)
    snapped = po.snap(rod, 0.9, mass=1.0, drag=0.0, rod_length=4.2)
    assert snapped.outcome == "end of rod"
    assert snapped.front[-1] == pytest.approx(4.2, abs=1e-9)


FLAP, KG, DRAG = po.Rod(2.2867e-5, 140096.0, 0.728e-3), 2.7, 2e4


@pytest.mark.parametrize("until", [1e-3, pytest.param(0.02, marks=pytest.mark.slow)])
def test_units_are_those_of_the_rod(until: float) -> None:
    alone, scale = po.Rod.from_ratio(FLAP.ratio), FLAP.eta / FLAP.adhesion_strength
    unit = math.sqrt(KG * scale)
    heavy = po.snap(FLAP, 40e3, mass=KG, drag=DRAG, until=until)
    bare = po.snap(alone, 40e3 / 140096.0, mass=1.0, drag=DRAG * scale / unit, until=until / unit)
    assert heavy.time_unit == "s"
    assert heavy.t[-1] == pytest.approx(until)
    assert heavy.growth_rate == pytest.approx(bare.growth_rate / unit, rel=1e-7)
    assert heavy.front[-1] == pytest.approx(FLAP.eta * bare.front[-1], rel=1e-8)
    assert heavy.drag_time == pytest.approx(DRAG * scale)
    assert heavy.inertial_time == pytest.approx(unit)
    if until > 0.01:
        assert heavy.energy.work[-1] == pytest.approx(140096.0 * FLAP.eta**2 * bare.energy.work[-1], rel=1e-7)


def test_without_a_drag_times_are_in_that_of_drag() -> None:
    timeless = po.snap(FLAP, 40e3, until=20.0)
    assert timeless.time_unit == "c eta/T0"
    seconds = po.snap(FLAP, 40e3, drag=DRAG, until=20.0 * timeless.drag_time * DRAG * FLAP.eta / 140096.0)
    assert seconds.front[-1] == pytest.approx(timeless.front[-1], rel=1e-9)
    assert seconds.t[-1] == pytest.approx(20.0 * seconds.drag_time)


def test_files_bring_it_back(overdamped: po.Snap, tmp_path: Path) -> None:
    again = po.Snap.load(overdamped.save(tmp_path / "snap.npz"))
    assert repr(again) == repr(overdamped)
    assert again.events == overdamped.events
    for name in ("t", "front", "theta", "certificate"):
        assert np.array_equal(getattr(again, name), getattr(overdamped, name))
    assert np.array_equal(again.energy.work, overdamped.energy.work)
    assert "front [eta]" in overdamped.csv_text()


@pytest.mark.parametrize(
    ("profile", "kept"), [(po.profiles.mixed(0.3), True), (lambda at: 1.0 - 0.1 * at.xi, False)]
)
def test_files_hold_the_scene_or_its_words(
    profile: Any, kept: bool, overdamped: po.Snap, tmp_path: Path
) -> None:
    scene = po.Scene(overdamped.rod, [po.Pressure(profile)], unbonded=1.0)
    moved = replace(overdamped, scene=scene)
    again = po.Snap.load(moved.save(tmp_path / "snap.npz"))
    assert again.scene == scene if kept else str(again.scene).startswith("Scene(rod=")
    assert repr(again) == repr(moved)
    assert "Snap of a scene at" in repr(again)
    assert "unbonded" in moved.csv_text().split("\nt [")[0]
    if not kept:
        assert again.arrest is None


def test_files_without_a_scene_are_read_as_before(
    overdamped: po.Snap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(po.Snap, "schema", Schema("peel_opt snap", 1))
        overdamped.save(tmp_path / "snap.npz")
    again = po.Snap.load(tmp_path / "snap.npz")
    assert again.scene is None
    assert repr(again) == repr(overdamped)


def test_shapes_between_steps(overdamped: po.Snap) -> None:
    i = len(overdamped) // 2
    pose = overdamped.shape(overdamped.t[i])
    assert pose.y == pytest.approx(overdamped.y[i], abs=1e-12)
    middle = overdamped.shape(0.5 * (overdamped.t[i] + overdamped.t[i + 1]))
    lengths = np.hypot(np.diff(middle.x), np.diff(middle.y)).sum()
    assert lengths == pytest.approx(middle.s[-1], rel=1e-4)  # it does not stretch
    with pytest.raises(po.InvalidInput, match="outside the motion"):
        overdamped.shape(1e9)
    with pytest.raises(po.InvalidInput, match="nothing of the kind"):
        overdamped.event("contact")


@pytest.mark.parametrize(
    ("wrong", "kind", "says"),
    [
        ({"pressure": 1.0}, po.OutOfRange, "fails everywhere"),
        ({"pressure": 0.5}, po.NoEquilibrium, "nearest"),
        ({"drag": -1.0}, po.InvalidInput, "drag"),
        ({"drag": 0.0}, po.InvalidInput, "infinitely fast"),
        ({"mass": -1.0}, po.InvalidInput, "mass"),
        ({"bond": "glue"}, po.InvalidInput, "unknown bond"),
        ({"until": "soon"}, po.InvalidInput, "until"),
        ({"rod_length": 2.0}, po.InvalidInput, "nothing is left to peel"),
        ({"flaw": 4.0, "start": 1}, po.InvalidInput, "not at both"),
        ({"start": 1}, po.InvalidInput, "Equilibrium"),
    ],
)
def test_what_cannot_be_meant_is_refused(wrong: dict, kind: type[Exception], says: str) -> None:
    with pytest.raises(kind, match=says):
        po.snap(po.Rod.from_ratio(0.3), **{"pressure": 0.9, **wrong})


def test_a_scene_that_is_the_papers_is_its_rod() -> None:
    rod = po.Rod.from_ratio(0.3)
    plain = po.snap(po.Scene(rod), 0.9, until=5.0)
    assert plain.front[-1] == po.snap(rod, 0.9, until=5.0).front[-1]
    assert plain.scene is None


ONE = po.Rod.from_ratio(1.0)

#: An edge that was never glued: it snaps at p/T0 = 0.35355, and has folded states from 0.12184 on.
EDGE = po.Scene(ONE, unbonded=1.0)


def test_above_what_an_edge_holds_it_is_let_go_where_it_snaps() -> None:
    snapped = po.snap(EDGE, 0.4, bond="damage", until=1.0)
    assert snapped.scene == EDGE
    assert math.isnan(snapped.growth_rate)
    assert snapped.front[0] == pytest.approx(2.86679124, abs=0.05)  # on a mesh
    assert snapped.front[-1] > snapped.front[0] + 0.08
    assert np.abs(snapped.certificate).max() < 1e-4


@pytest.mark.parametrize(
    ("asked", "kind", "says"),
    [
        ({"rod": po.Scene(ONE, [po.Weight(0.1)], po.Circle(-0.1))}, po.InvalidInput, "curved wall"),
        ({"rod": po.Scene(ONE, line_energy=0.1)}, po.InvalidInput, "line energy"),
        ({"law": "linear"}, po.InvalidInput, "its own law"),
        ({"flaw": 0.9}, po.InvalidInput, "less than the edge that was never glued, 1 eta"),
        ({"pressure": 0.1}, po.NoEquilibrium, "pressure is too low. It is lifted there"),
        ({"pressure": 1.1}, po.OutOfRange, "pulled off with 1.1 T0 at its front"),
        ({"pressure": 1.1, "flaw": 4.0}, po.OutOfRange, "pulled off"),
    ],
)
def test_what_cannot_be_meant_of_a_scene_is_refused(
    asked: dict[str, Any], kind: type[Exception], says: str
) -> None:
    with pytest.raises(kind, match=says.replace(".", r"\.")):
        po.snap(**{"rod": EDGE, "pressure": 0.3, **asked})


def test_a_state_of_another_scene_must_be_one_that_moves() -> None:
    state = po.solve(EDGE, free="length", pressure=0.2)
    with pytest.raises(po.NoEquilibrium, match="nothing grows"):
        po.snap(EDGE, 0.2, start=state)
    with pytest.raises(po.InvalidInput, match="the words alone"):
        po.snap(EDGE, 0.2, start=replace(state, scene="Scene(...)"))
    with pytest.raises(po.InvalidInput, match="line energy"):
        po.snap(EDGE, 0.2, start=replace(state, scene=po.Scene(ONE, line_energy=0.1)))
    with pytest.raises(po.InvalidInput, match="less than the edge"):
        po.snap(po.Scene(ONE, unbonded=5.0), 0.2, start=state)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pressure", "begins", "outcome", "rests"),
    [
        (0.2, {}, "folded", "folded"),
        (0.4, {}, "folded", "folded"),
        (0.2, {"flaw": 3.0}, "standing", "lifted"),
        (0.1, {"start": 0.3}, "standing", "lifted"),
    ],
)
def test_an_edge_comes_to_rest_folded_or_stands(
    pressure: float, begins: dict[str, float], outcome: str, rests: str
) -> None:
    """From its unfolded state, from where it snaps, from below, and from a folded state of its rod."""
    asked: dict[str, Any] = dict(begins)
    if "start" in begins:
        asked["start"] = po.length_given_pressure(ONE, begins["start"], state="folded")
    snapped = po.snap(EDGE, pressure, **asked)
    assert snapped.outcome == outcome
    known = po.solve(EDGE, free="length", pressure=pressure, state=rests)
    assert snapped.front[-1] == pytest.approx(known.length, abs=2.0 * snapped.error + 1e-6)
    assert snapped.error < 1e-6
    assert snapped.arrest is not None
    assert snapped.arrest.scene == EDGE
    assert snapped.arrest.state == rests
    assert np.abs(snapped.certificate).max() < 1e-10
    assert np.abs(snapped.energy.defect).max() < 1e-6
    if not begins and pressure < 0.35:
        unfolded = po.solve(EDGE, free="length", pressure=pressure, state="unfolded")
        assert snapped.growth_rate == pytest.approx(po.growth_rate(unfolded), rel=1e-6)


@pytest.mark.slow
def test_a_scene_whose_tip_lands_rests_in_its_folded_state_to_the_error_of_the_mesh() -> None:
    scene = po.Scene(ONE, [po.Pressure(po.profiles.linear(-0.1))])
    snapped = po.snap(scene, 0.5)
    assert snapped.outcome == "folded"
    assert snapped.event("contact").y == 0.0
    assert snapped.arrest is not None
    assert abs(snapped.front[-1] - snapped.arrest.length) < snapped.error < 2e-2


@pytest.mark.slow
def test_a_tip_that_its_curvature_presses_on_the_plate_stays_there() -> None:
    """What lifts the tip of a rod that lies down presses it down once the rod is folded over."""
    snapped = po.snap(po.Scene(ONE, natural_curvature=0.3), 0.5)
    assert snapped.outcome == "touching"
    assert snapped.tip.y[-1] == 0.0
    assert snapped.arrest is None


@pytest.mark.slow
def test_under_a_dead_load_nothing_stops_a_peel() -> None:
    scene = po.Scene(ONE, [po.Pressure(dead=1.0)], unbonded=1.0)
    snapped = po.snap(scene, 0.3, rod_length=10.0)
    assert snapped.outcome == "end of rod"
    late = snapped.front > 8.0
    assert np.all(np.diff(snapped.speed[late]) > -1e-3)  # it does not slow down


def folded(rod: po.Rod, pressure: float) -> po.Equilibrium:
    return po.length_given_pressure(rod, pressure, state="folded")


@pytest.mark.parametrize(
    ("ratio", "pressure", "outcome", "known"),
    [
        (0.3, 0.9, "folded", folded),
        pytest.param(1.0, 0.8, "flat fold", po.flat_fold, marks=pytest.mark.slow),
        pytest.param(0.566, 0.9, "folded", folded, marks=pytest.mark.slow),
    ],
)
def test_it_comes_to_rest_in_an_equilibrium_of_its_own_rows(ratio, pressure, outcome, known) -> None:
    rod = po.Rod.from_ratio(ratio)
    snapped = orbit(ratio, pressure, 0.0, 1.0)
    assert snapped.outcome == outcome
    expected = known(rod, pressure)
    assert snapped.arrest is not None
    assert snapped.arrest.certified
    assert snapped.arrest.length == pytest.approx(expected.length, rel=1e-9)
    if outcome == "folded":
        assert abs(snapped.front[-1] - expected.length) <= snapped.error + 1e-6
    if snapped.event("start").t < 0.0 or any(e.kind == "contact" for e in snapped.events):
        assert snapped.event("contact").y == 0.0
        assert np.abs(snapped.energy.defect).max() < 1e-2
        assert np.all(np.diff(snapped.t) > 0.0)


def test_a_bond_that_does_not_heal_stops_where_it_came_to_and_takes_its_work() -> None:
    rod = po.Rod.from_ratio(1.0)
    damaged = po.snap(rod, 0.5, bond="damage")
    # Up to where the tip comes into the range of the bond the motion is that of one that heals, tracked.
    assert damaged.front[-1] == pytest.approx(5.25316519, abs=5e-3)
    assert damaged.front[-1] > po.grown_flap(rod, 0.5).length
    assert damaged.front[-1] < po.largest_flap(rod).length
    assert damaged.energy.bond_loss[-1] == pytest.approx(
        0.5 * rod.adhesion_range * (damaged.front[-1] - 1.3), abs=0.1
    )
    assert damaged.energy.drag[-1] > 0.0
    assert np.all(np.diff(damaged.energy.bond_loss) >= 0.0)
    assert np.abs(damaged.certificate).max() < 1e-3  # from the start on, where it is let go of
    assert np.abs(damaged.energy.defect).max() < 2e-3


def test_runs_that_end_differently_are_as_far_apart_as_their_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the angles passed on the way say of the error is not all: one of two meshes may end elsewhere."""
    meshed = tiers.run_on_mesh

    def sooner(*args: Any, **options: Any) -> Any:
        found = meshed(*args, **options)
        if options["resolution"]:
            return found
        last = found.events[-1]._replace(kind="arrest", front=found.front[-1] - 0.7)
        return replace(found, outcome="held", events=(*found.events, last))

    monkeypatch.setattr(tiers, "run_on_mesh", sooner)
    run = po.snap(po.Rod.from_ratio(1.0), 0.5, bond="damage", until=20.0)
    assert run.error > 0.4  # 0.7, less what the two meshes differ by themselves


@pytest.mark.parametrize("mass", [0.0, pytest.param(1.0, marks=pytest.mark.slow)])
def test_a_front_that_takes_too_many_steps_is_left_to_the_mesh(
    mass: float, overdamped: po.Snap, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("peel_opt.motion.tracking.MOST_STEPS", 5)
    snapped = po.snap(po.Rod.from_ratio(0.3), 0.9, mass=mass, drag=1.0, until="contact")
    known = ORBITS[0.3, 0.9, mass, 1.0]
    assert snapped.outcome == ("contact" if mass else overdamped.outcome)
    assert 1e-5 < snapped.error < 5e-3
    found = passed(snapped)
    for angle, _, front, x, y in known[1:]:
        assert found[angle][1:] == pytest.approx((front, x, y), abs=max(2.0 * snapped.error, 2e-3))


def test_a_run_that_takes_too_long_is_given_up_with_what_it_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("peel_opt.motion.mesh.MOST", (4e3, 1e4))
    run = po.snap(po.Rod.from_ratio(1.0), 0.5, bond="damage")
    assert run.outcome == "not settled"
    assert run.events[-1].kind == "given up"
    assert run.events[-1].t == run.t[-1] < 30.0
    assert 1e-5 < run.error < 0.05  # of the times that both meshes came to
    assert np.abs(run.energy.defect).max() < 1e-2


def passages(ratio: float, left: float, width: float, many: int = 5) -> list[Happening]:
    """Passages of an angle up and down, those up as far apart as leaves so much to go after the last."""
    apart = left * (1.0 / ratio - 1.0) if ratio < 1.0 else left
    last = [Happening("angle", 0.0, 3.0, 1.0, 4.0, -3.0)]
    for _ in range(many // 2):
        here = last[0]
        last = [here._replace(front=here.front - apart), here._replace(front=here.front - width), *last]
        apart /= ratio
    return last


@pytest.mark.parametrize(
    ("ratio", "left", "width", "cycle"),
    [
        (0.3, 1.5e-4, 0.3, True),
        (0.3, 2.5e-4, 0.3, False),  # still too far from it
        (0.95, 2.5e-4, 0.3, False),  # from one passage to the next hardly nearer
        (1.05, 1e-5, 0.3, False),  # away from something
        (0.5, 1.5e-4, 4e-4, False),  # round a place of rest
    ],
)
def test_a_cycle_is_one_where_what_is_left_to_it_is_small(
    ratio: float, left: float, width: float, cycle: bool
) -> None:
    assert goes_round(passages(ratio, left, width)) is cycle
    assert not goes_round(passages(ratio, left, width)[2:])


def test_runs_at_several_resolutions_have_one_bar_between_them() -> None:
    steps: list[int] = []
    with in_parts(steps.append, 10.0) as told:
        done = []
        for until in (10.0, 40.0, 5.0):
            for t in np.linspace(0.0, until, 9):
                told(float(t))
            done.append(sum(steps))
    assert done == [PARTS / 2, 3 * PARTS / 4, 3 * PARTS / 4 + PARTS // 16]
    assert sum(steps) == PARTS
    assert min(steps) > 0


def test_a_rod_may_rest_in_a_state_of_its_own() -> None:
    setting = Setting(0.3, COHESIVE, 0.9, 0.0, 1.0)
    unfolded, folded = (
        po.length_given_pressure(po.Rod.from_ratio(0.3), 0.9, state=state) for state in ("unfolded", "folded")
    )
    assert held_at(setting, stretched(folded, 1.001 * folded.length_ratio)) == pytest.approx(
        folded.length_ratio
    )
    assert held_at(setting, stretched(unfolded, unfolded.length_ratio)) is None  # it is left
    flat = stretched(folded, folded.length_ratio)
    assert held_at(replace(setting, pressure=0.1), replace(flat, theta=0.0 * flat.theta)) is None


@pytest.mark.slow
def test_a_fold_that_the_branch_of_its_scene_does_not_reach_is_one() -> None:
    # A rod that hangs is folded on a branch of its own.
    hangs = po.Scene(ONE, [po.Weight(-0.05)])
    assert [eq.state for eq in po.equilibria(hangs, pressure=0.3)] == ["lower"]
    snapped = po.snap(hangs, 0.3)
    assert snapped.outcome == "folded"
    assert snapped.arrest is None
    assert (0.3 + 0.05) * snapped.tip.y[-1] == pytest.approx(0.5, abs=2e-3)  # the identity


def test_the_error_of_a_motion_that_rests_counts_how_far_from_its_rest_it_stands_still() -> None:
    snapped = po.snap(po.Rod.from_ratio(0.1), 0.95)
    rest = snapped.arrest
    assert rest is not None
    off = abs(snapped.front[-1] - rest.length), abs(snapped.tip.y[-1] - rest.tip_height)
    assert 0.0 < max(off) <= snapped.error < 1e-6
