"""Which tier computes a run, what a mesh takes over, and how far two runs are apart (`tiers`, `follow`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import peel_opt as po
from peel_opt.base.errors import NotConverged
from peel_opt.model.bond import COHESIVE
from peel_opt.motion import tiers
from peel_opt.motion.flap import Phase
from peel_opt.motion.follow import SOON, taken_over
from peel_opt.motion.run import Setting, Track
from peel_opt.motion.tracking import comes_down
from peel_opt.motion.trajectory import Happening, Ledger, TipPath

PLAIN = Setting(1.0, COHESIVE, 0.5, 0.0, 1.0)


@pytest.mark.parametrize(
    ("pieces", "down"),
    [
        ((1, 0), False),
        ((0, 1, 0), False),  # the tip is low
        ((1, 0, 1, 0), True),
        ((0, 1, 0, 1, 0), True),
        ((2, 1, 2, 1, 0), True),
        ((None, 1, 0), False),  # an edge that was never glued
        ((1, 1, 0), False),  # a load begins
    ],
)
def test_an_arc_comes_down_where_both_sides_of_it_are_higher(pieces: tuple, down: bool) -> None:
    assert comes_down(tuple(Phase(piece) for piece in pieces)) is down


def lost_at(end: float, off: float = 0.0, first: float = 5.0) -> Track:
    """A run with a front that was lost, and by how much it is off from some time on."""
    t = np.linspace(0.0, end, 41)
    front = 3.0 + t + off * (t > first)
    flat = np.zeros((41, 3))
    run = Track(
        t=t,
        front=front,
        tip=TipPath(t, -t, 0.0 * t),
        fraction=np.linspace(0.0, 1.0, 3),
        x=flat,
        y=flat + t[:, None],
        theta=flat,
        energy=Ledger(*np.zeros((6, 41))),
        identity=0.0 * t,
        events=(Happening("start", 0.0, 3.0, 0.0, 0.0, 0.0),),
        outcome="not settled",
    )
    return run.until(41)


def in_common(*runs: Track) -> tiers.Known | None:
    return tiers._in_common(PLAIN, [NotConverged("lost", candidates=(run,)) for run in runs])


def test_what_two_lost_runs_have_in_common_is_kept() -> None:
    known = in_common(lost_at(9.0, 1e-3), lost_at(10.0))
    assert known is not None
    assert known.run.t[-1] == 9.0
    assert known.run.events[-1] == Happening("given up", 9.0, 12.0, 9.0, -9.0, 0.0)
    assert known.error == pytest.approx(1e-3)
    assert known.run.t[taken_over(PLAIN, known.run)] == pytest.approx(SOON * 9.0, abs=0.25)


@pytest.mark.parametrize(
    "runs",
    [
        (lost_at(10.0),),
        (lost_at(10.0, 0.1), lost_at(10.0)),  # from half of the time on they are apart
        (lost_at(10.0), lost_at(6.0)),  # one was lost long before the other
        (lost_at(0.02), lost_at(0.02)),  # hardly off
    ],
)
def test_what_is_not_known_or_a_mere_beginning_is_not(runs: tuple[Track, ...]) -> None:
    assert in_common(*runs) is None


def test_two_tracked_runs_up_to_an_arc_are_compared_where_the_first_of_them_is() -> None:
    coarse, fine = (replace(run, outcome="arc") for run in (lost_at(9.0, 2e-3), lost_at(9.5)))
    assert tiers.apart(coarse, fine)[0] == pytest.approx(2e-3)


@pytest.mark.slow
def test_beyond_an_arc_that_comes_down_the_mesh_is_where_the_front_was_tracked_to() -> None:
    """To see the arc on the plate takes the tracked front longer than all before."""
    rod = po.Rod.from_ratio(2.0)
    meshed, tracked = (po.snap(rod, 0.5, until=until) for until in (41.0, "contact"))
    ours, known = meshed.event("contact"), tracked.event("contact")
    assert tracked.error < 1e-5
    assert abs(ours.front - known.front) <= meshed.error < 1e-2
    assert abs(ours.x - known.x) <= 2.0 * meshed.error


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "pressure"), [(0.4, 0.99), (0.5, 0.9)])
def test_a_tip_that_was_lifted_is_tracked_to_rest(ratio: float, pressure: float) -> None:
    """On a mesh its height would be off by half a percent of y0 and more."""
    rod = po.Rod.from_ratio(ratio)
    run, known = po.snap(rod, pressure), po.length_given_pressure(rod, pressure, state="folded")
    assert run.outcome == "folded"
    assert run.error < 3e-3
    assert run.front[-1] == pytest.approx(known.length, abs=1e-6)
    assert run.tip.y[-1] == pytest.approx(known.tip_height, abs=3e-6)
    assert abs(run.certificate[-1]) < 1e-10
    assert np.all(np.diff(run.t) > 0.0)
    assert np.abs(run.energy.defect).max() < 1e-2


@pytest.mark.slow
def test_a_tip_that_lands_again_and_again_flaps_lifted_or_not() -> None:
    """Of two meshes one lets go of it by itself and the other does not."""
    run = po.snap(po.Rod.from_ratio(0.566), 0.5)
    assert run.outcome == "flapping"
    assert run.error < 2e-3
    assert run.t[-1] < 300.0


@pytest.mark.slow
def test_a_long_rod_is_followed_as_far_as_its_front_is_resolved() -> None:
    run = po.snap(po.Rod.from_ratio(25.0), 0.73)
    assert run.outcome == "not settled"
    assert run.events[-1].kind == "given up"
    assert run.front[-1] > 150.0
    assert run.error < 1e-3 * run.front[-1]
    assert np.abs(run.certificate).max() < 1e-5


@pytest.mark.slow
def test_where_a_front_is_lost_a_mesh_goes_on() -> None:
    run = po.snap(po.Rod.from_ratio(5.0), 0.9, until=40.0)
    assert run.t[-1] == 40.0
    assert run.error < 0.05
    assert np.abs(run.certificate[run.t < 25.0]).max() < 1e-8
    assert np.all(np.diff(run.t) > 0.0)
    assert np.abs(run.energy.defect).max() < 1e-2


def test_times_are_compared_where_there_are_two_moments() -> None:
    angles = [Happening("angle", t, 3.0 + t, t, -t, -t) for t in (1.0, 2.0)]
    run = replace(lost_at(4.0), events=tuple(angles), outcome="flapping")
    late = replace(run, events=(angles[0], angles[1]._replace(t=2.25)))
    assert tiers.apart(run, late) == (0.0, 0.25)
    assert np.isnan(tiers.apart(*(replace(one, events=one.events[:1]) for one in (run, late)))[1])


def test_fronts_that_swing_apart_are_seen_at_all_times() -> None:
    run = replace(lost_at(4.0), events=(), outcome="standing")
    swung = replace(run, front=run.front + 0.3 * np.sin(run.t))
    assert tiers.apart_in_time(run, swung) == (pytest.approx(0.3, abs=1e-3), 0.0)
