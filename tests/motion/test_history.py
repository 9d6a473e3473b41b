"""Rods under pressures that change: what a bond that does not heal does to a loop of loading."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import peel_opt as po
from peel_opt.motion.mesh import carried

ROD = po.Rod.from_ratio(1.0)

#: A snap at 0.5, unloading to 0.06, a rest, and loading again to 0.8.
TIMES, PRESSURES = [0.0, 60.0, 420.0, 520.0, 900.0], [0.5, 0.5, 0.06, 0.06, 0.8]


@pytest.fixture(scope="module")
def damaged() -> po.History:
    return po.history(ROD, pressure=(TIMES, PRESSURES), bond="damage")


def front_at(run: po.History, pressure: float, *, reload: bool = False) -> float:
    part = run.t > TIMES[3] if reload else (run.t > TIMES[1]) & (run.t < TIMES[2])
    return float(run.front[part][np.argmin(np.abs(run.pressure[part] - pressure))])


@pytest.mark.slow
def test_a_flap_grows_on_unloading_to_the_largest_and_no_further(damaged: po.History) -> None:
    largest = po.largest_flap(ROD)
    stopped = front_at(damaged, 0.45)
    # Frozen until the flap that the pressure can grow is as long as it is: 5.25 at p/T0 = 0.23.
    assert stopped == pytest.approx(5.25, abs=0.02)
    assert po.grown_flap(ROD, 0.26).length < stopped < po.grown_flap(ROD, 0.21).length
    assert front_at(damaged, 0.28) == pytest.approx(stopped, abs=5e-3)
    # From there on it goes after the growing flap, behind it by what the rate leaves.
    assert stopped + 0.05 < front_at(damaged, 0.17) < po.grown_flap(ROD, 0.17).length
    # What the rate has left of the largest flap it gains on the way back, and no more.
    assert stopped + 0.2 < front_at(damaged, 0.06, reload=True) < largest.length
    assert front_at(damaged, 0.25, reload=True) == pytest.approx(largest.length, abs=0.03)
    assert front_at(damaged, 0.79, reload=True) == pytest.approx(largest.length, abs=0.03)
    assert damaged.outcome == "not settled"
    assert not damaged.flags


def test_the_ledger_closes_and_every_step_has_its_identity(damaged: po.History) -> None:
    assert np.abs(damaged.energy.defect).max() < 5e-3
    assert np.median(np.abs(damaged.certificate)) < 1e-3
    assert damaged.error < 0.05
    assert np.all(np.diff(damaged.dissipated) > -1e-12)
    # What the bond took: T0 y0/2 a length that is fully open, less near the front.
    assert 0.5 * (damaged.front[-1] - 2.0) < damaged.energy.bond_loss[-1] < 0.5 * damaged.front[-1]


@pytest.mark.slow
def test_a_bond_that_heals_lies_down_below_the_least_pressure() -> None:
    run = po.history(ROD, pressure=(TIMES[:4], PRESSURES[:4]))
    assert run.outcome == "closes"
    least = po.readhesion_pressure(ROD).pressure
    assert run.pressure[-1] < least  # after a delay that goes with the rate
    folded = po.length_given_pressure(ROD, 0.3, state="folded").length
    assert front_at(run, 0.3) == pytest.approx(folded, abs=0.1)
    assert run.energy.bond_loss.max() == 0.0


@pytest.mark.slow
def test_a_tip_that_the_mesh_holds_down_is_lifted() -> None:
    """It lands, slides into the state that just touches, which is unstable, and ends folded."""
    run = po.history(ROD, pressure=([0.0, 300.0], [0.5, 0.5]))
    lifted = [event.kind for event in run.events if event.kind in {"contact", "lift"}]
    assert lifted[0] == "contact"
    assert lifted[-1] == "lift"
    folded = po.length_given_pressure(ROD, 0.5, state="folded").length
    assert run.front[-1] == pytest.approx(folded, abs=1e-3)
    assert po.touching(ROD, 0.5).length < folded - 0.5


def falling(t: float, per: float) -> float:
    return 60e3 * (1.0 - 0.001 * t / per)


@pytest.mark.slow
def test_units_functions_and_files(tmp_path: Path) -> None:
    rod = po.Rod(2.2867e-5, 140096.0, 0.728e-3)
    seconds = 2e4 * rod.eta / rod.adhesion_strength
    falls = partial(falling, per=seconds)
    slow = po.history(rod, pressure=falls, duration=30 * seconds, drag=2e4)
    alone = po.history(
        po.Rod.from_ratio(rod.ratio), pressure=([0.0, 30.0], [60e3 / 140096.0, 0.97 * 60e3 / 140096.0])
    )
    assert slow.time_unit == "s"
    assert slow.front[-1] == pytest.approx(alone.front[-1] * rod.eta, rel=1e-6)
    assert slow.energy.work[-1] == pytest.approx(alone.energy.work[-1] * 140096.0 * rod.eta**2, rel=1e-5)
    text = slow.to_csv(tmp_path / "history.csv").read_text()
    assert "pressure [Pa]" in text
    again = po.History.load(slow.save(tmp_path / "history.npz"))
    for name in ("t", "pressure", "front", "certificate"):
        np.testing.assert_array_equal(getattr(again, name), getattr(slow, name))
    np.testing.assert_array_equal(again.energy, slow.energy)
    np.testing.assert_array_equal(again.tip, slow.tip)
    assert (again.rod, again.events, again.outcome) == (slow.rod, slow.events, slow.outcome)
    assert repr(again) == repr(slow)
    with pytest.raises(po.InvalidInput):
        po.Snap.load(tmp_path / "history.npz")


def test_files_hold_the_scene(damaged: po.History, tmp_path: Path) -> None:
    scene = po.Scene(ROD, [po.Weight(0.05)], unbonded=1.0)
    again = po.History.load(replace(damaged, scene=scene).save(tmp_path / "history.npz"))
    assert again.scene == scene
    assert "bond of a scene" in repr(again)
    assert "bond of a scene" not in repr(damaged)


def test_a_picture_shows_the_path_and_what_was_spent(damaged: po.History) -> None:
    branch = po.trace(ROD, points=20, tol=1e-6)
    path = damaged.plot(branch=branch)
    unfolded, _, line, *_ = path.lines
    np.testing.assert_array_equal(unfolded.get_ydata(), branch.length)
    np.testing.assert_array_equal(line.get_xdata(), damaged.pressure)
    np.testing.assert_array_equal(line.get_ydata(), damaged.front)
    spent = next(ax for ax in path.figure.axes if "dissipated" in ax.get_ylabel())
    tops = [area.get_paths()[0].vertices[:, 1].max() for area in spent.collections]
    assert tops == pytest.approx([np.ptp(damaged.energy.drag), damaged.dissipated.max()])
    with pytest.raises(po.InvalidInput, match="of the rod"):
        damaged.plot(branch=po.trace(po.Rod.from_ratio(0.4), points=20, tol=1e-6))
    torn = replace(damaged, scene=EDGE)
    with pytest.raises(po.InvalidInput, match="what acts on it"):
        torn.plot(branch=branch)
    assert "unbonded = 1 eta" in torn.plot().get_title(loc="left")


EDGE = po.Scene(ROD, unbonded=1.0)


def test_an_edge_without_glue_lies_flat_and_rises_with_the_pressure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("peel_opt.motion.history.STEPS", 20)
    run = po.history(EDGE, pressure=([0.0, 1.0], [0.0, 0.02]))
    assert run.scene == EDGE
    assert run.front[0] == 1.0
    assert run.tip.y[0] == 0.0
    assert np.all(run.front >= 1.0)
    assert run.tip.y[-1] > 1e-4
    assert run.energy.work[-1] > 0.0
    assert np.abs(run.certificate).max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("bond", ["reversible", "damage", "no_rebond"])
def test_an_edge_is_loaded_past_its_snap_and_let_down(bond: str) -> None:
    times, pressures = [0.0, 400.0, 450.0, 850.0], [0.0, 0.4, 0.4, 0.0]
    run = po.history(EDGE, pressure=(times, pressures), bond=bond)
    lifted, limit = po.solve(EDGE, free="length", pressure=0.2), po.safe_pressure(ROD, 1.0)
    rising = run.t < 300.0
    assert np.interp(0.2, run.pressure[rising], run.front[rising]) == pytest.approx(lifted.length, abs=0.02)
    jumped = run.pressure[np.argmax(run.front > 4.0)]
    assert limit.pressure < jumped < limit.pressure + 0.04  # behind it by what the rate leaves
    assert run.error < 0.08
    assert 0.0 < run.time_error < 1.0
    assert np.abs(run.energy.defect).max() < 1e-3
    if bond == "reversible":
        assert run.energy.bond_loss.max() == 0.0
        assert run.front[-1] < 2.0  # it has come back to its edge
    else:
        assert run.front[-1] > 4.0
    if bond == "damage":
        # T0 y0/2 a length that was glued and is fully open, less near the front.
        assert run.energy.bond_loss[-1] == pytest.approx(0.5 * (run.front[-1] - 2.3), abs=0.15)
        assert run.dissipated[-1] > run.energy.bond_loss[-1]
        assert np.all(np.diff(run.front[run.t > 420.0]) > -run.error)


@pytest.mark.parametrize(
    ("scene", "pressures", "kind", "says"),
    [
        (EDGE, [0.1, 1.1], po.OutOfRange, "pulled off with 1.1 T0"),
        (EDGE, [0.1, -0.1], po.OutOfRange, "are not negative"),
        (po.Scene(ROD, line_energy=0.1), [0.1, 0.2], po.InvalidInput, "line energy"),
    ],
)
def test_what_a_scene_cannot_live_through_is_refused(
    scene: po.Scene, pressures: list[float], kind: type[Exception], says: str
) -> None:
    with pytest.raises(kind, match=says):
        po.history(scene, pressure=([0.0, 1.0], pressures))


@pytest.mark.parametrize(
    ("wrong", "kind"),
    [
        ({"pressure": ([0, 1], [0.5, 1.0])}, po.OutOfRange),
        ({"pressure": ([0, 1], [0.5, -0.1])}, po.OutOfRange),
        ({"pressure": ([1, 2], [0.5, 0.4])}, po.InvalidInput),
        ({"pressure": ([0, 2, 2], [0.5, 0.4, 0.3])}, po.InvalidInput),
        ({"pressure": 0.5}, po.InvalidInput),
        ({"pressure": lambda t: 0.5}, po.InvalidInput),
        ({"pressure": ([0, 1], [0.5, 0.4]), "bond": "glue"}, po.InvalidInput),
        ({"pressure": ([0, 1], [0.05, 0.06])}, po.NoEquilibrium),
        ({"pressure": ([0, 1], [0.5, 0.4]), "rod_length": 3.0}, po.InvalidInput),
        ({"pressure": ([0, np.nan], [0.5, 0.4])}, po.InvalidInput),
        ({"pressure": ([0, np.inf], [0.5, 0.4])}, po.InvalidInput),
        ({"pressure": ([0, 1], [0.5, np.nan])}, po.InvalidInput),
        ({"pressure": (["a", 1], [0.5, 0.4])}, po.InvalidInput),
        ({"pressure": (1, 2)}, po.InvalidInput),
    ],
)
def test_what_cannot_be_meant_is_refused(wrong: dict, kind: type[Exception]) -> None:
    with pytest.raises(kind):
        po.history(ROD, **wrong)


def test_a_pressure_that_jumps_above_T0_between_looks_is_refused_when_it_does() -> None:
    with pytest.raises(po.OutOfRange, match=r"p/T0 = 1\.4"):
        po.history(ROD, pressure=lambda t: 1.4 if 1.003 < t < 1.02 else 0.5, duration=3.0)


def test_a_snap_that_comes_later_on_one_mesh_is_an_error_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    tracks, later = [], 1.5

    def late(*args: object, **options: object) -> object:
        found = carried(*args, **options)  # type: ignore[arg-type]
        if not tracks:
            track = found.track
            events = tuple(event._replace(t=event.t + later) for event in track.events)
            found = found._replace(track=replace(track, t=track.t + later, events=events))
        tracks.append(found.track)
        return found

    monkeypatch.setattr("peel_opt.motion.history.carried", late)
    run = po.history(ROD, pressure=([0.0, 9.0], [0.5, 0.5]))
    coarse, fine = tracks
    together, apart = (
        np.abs(np.interp(fine.t, coarse.t - by, coarse.front) - fine.front).max() for by in (later, 0.0)
    )
    assert run.time_error == pytest.approx(later, abs=0.05)
    assert run.error < 2.0 * together < 0.2 * apart


def test_a_run_that_ends_before_the_other_counts_in_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mesh on which the rod lies down sooner is as far from the other as that one's front."""
    tracks = []

    def cut(*args: object, **options: object) -> object:
        found = carried(*args, **options)  # type: ignore[arg-type]
        if not tracks:  # the coarse run, as if it had ended after a few steps
            track = found.track
            found = found._replace(track=replace(track, t=track.t[:9], front=track.front[:9]))
        tracks.append(found.track)
        return found

    monkeypatch.setattr("peel_opt.motion.history.carried", cut)
    run = po.history(ROD, pressure=([0.0, 6.0], [0.5, 0.5]))
    assert run.error >= abs(run.front[-1] - tracks[0].front[-1]) > 0.3


@pytest.mark.slow
def test_a_strip_that_curls_into_its_wall_rests_there_while_the_pressure_rises() -> None:
    scene = po.Scene(po.Rod.from_ratio(1.0), wall=po.Circle(0.1))
    loaded = po.history(scene, pressure=([0, 400, 600], [0.3, 0.8, 0.8]))
    known = po.solve(po.Scene(scene.rod, wall=scene.wall, tip=po.Contact()), free="length", pressure=0.8)
    assert loaded.front[-1] == pytest.approx(known.length, abs=2.0 * loaded.error)
    assert loaded.error < 0.05
    assert loaded.tip.y.max() < 1e-4
    assert not [event for event in loaded.events if event.kind == "lift"]


@pytest.mark.slow
def test_a_pressure_that_decays_along_the_rod_may_rise_above_the_strength_of_its_bond() -> None:
    decaying = po.Scene(ROD, [po.Pressure(po.profiles.exponential(5.0))], unbonded=0.5)
    loaded = po.history(decaying, pressure=([0, 400, 500], [0.3, 1.05, 1.05]))
    known = po.solve(decaying, free="length", pressure=1.05, near=float(loaded.front[-1]))
    assert loaded.front[-1] == pytest.approx(known.length, abs=2.0 * loaded.error + 1e-3)
