"""What moves, and where it is let go: rods, edges without glue, and scenes that are lifted or not."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.motion.subject import Subject, lengthened, subject_of

ROD = po.Rod.from_ratio(1.0)
EDGE = Subject(ROD, "auto", po.Scene(ROD, unbonded=1.0))

#: p_max/T0 of this edge, as `safe_pressure` finds it.
SNAPS = 0.353551300


def test_an_edge_begins_lifted_and_snaps_from_its_unfolded_state() -> None:
    lifted, start = EDGE.lifted(0.2), EDGE.unstable(0.2)
    assert lifted is not None
    assert start.state is not None
    assert start.state.state == "middle"
    for posture, state in ((lifted, "lifted"), (start.posture, "unfolded")):
        eq = po.solve(EDGE.scene, free="length", pressure=0.2, state=state)
        assert posture.s[-1] == pytest.approx(eq.length, rel=1e-12)
        np.testing.assert_array_equal(posture.theta, eq.theta)
        assert not posture.spin.any()


def test_above_what_the_edge_holds_it_begins_where_it_snaps() -> None:
    limit = EDGE.unstable(SNAPS + 1e-6)
    assert limit.state is None
    assert EDGE.lifted(SNAPS + 1e-6) is None
    assert EDGE.unstable(0.9).posture.s[-1] == limit.posture.s[-1] == pytest.approx(2.86679124, abs=1e-7)
    assert abs(limit.posture.theta[-1]) < 1e-15
    below = EDGE.unstable(SNAPS - 1e-6)
    assert below.state is not None
    # Beside a limit point lengths go with the root of the distance.
    assert below.posture.s[-1] == pytest.approx(limit.posture.s[-1], abs=0.02)
    assert below.posture.s[-1] > limit.posture.s[-1]


def test_an_edge_under_no_pressure_lies_flat() -> None:
    for pressure in (0.0, 1e-10):
        flat = EDGE.lifted(pressure)
        assert flat is not None
        assert flat.s[-1] == 1.0
        assert not flat.theta.any()
    with pytest.raises(po.NoEquilibrium, match=r"too low\. It lies flat, or nearly so, there"):
        EDGE.unstable(0.0)
    with pytest.raises(po.NoEquilibrium, match=r"too low\. It is lifted"):
        EDGE.unstable(0.1)


def test_what_pulls_the_attached_rod_off_is_told_from_what_has_no_state() -> None:
    with pytest.raises(po.OutOfRange, match=r"pulled off with 1\.2 T0 at its front, sbar/eta = 2\.866"):
        EDGE.unstable(1.2)
    with pytest.raises(po.OutOfRange, match="from T0 on the bond fails"):
        Subject(ROD, "auto").unstable(1.0)
    assert Subject(ROD, "auto").lifted(0.5) is None


@pytest.mark.slow
def test_a_long_edge_grows_stably_and_says_so() -> None:
    long = Subject(ROD, "auto", po.Scene(ROD, unbonded=5.0))
    with pytest.raises(po.NoEquilibrium, match=r"does not snap, but grows stably.*sbar = 6\.06466 eta"):
        long.unstable(0.2)
    with pytest.raises(po.OutOfRange, match="sbar/eta = 5"):
        long.unstable(1.2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "pressure", "lifted", "unstable"),
    [
        (po.Scene(ROD, [po.Weight(0.05)]), 0.3, None, "lower"),
        (po.Scene(ROD, [po.Weight(0.05)], unbonded=1.0), 0.04, 1.0, None),
        (po.Scene(ROD, [po.Weight(0.05)], unbonded=1.0), 0.3, 2.0224979, "middle"),
        (po.Scene(ROD, [po.Pressure(po.profiles.stream())], unbonded=1.0), 2.5, None, "middle"),
        (po.Scene(ROD, [po.Pressure(dead=1.0)], unbonded=1.0), 0.1, 1.4629193, "middle"),
        (po.Scene(ROD, tip=po.TipLoad(0.1, 1.5)), 0.0, 0.1995005, None),
        (po.Scene(ROD, natural_curvature=0.3), 0.9, None, "limit"),
    ],
)
def test_scenes_begin_where_they_stand(
    scene: po.Scene, pressure: float, lifted: float | None, unstable: str | None
) -> None:
    subject = Subject(ROD, "auto", scene)
    found = subject.lifted(pressure)
    assert (None if found is None else found.s[-1]) == (lifted if lifted is None else pytest.approx(lifted))
    if unstable is None:
        with pytest.raises(po.NoEquilibrium):
            subject.unstable(pressure)
    else:
        state = subject.unstable(pressure).state
        assert ("limit" if state is None else state.state) == unstable


def test_a_scene_has_its_own_law_and_the_papers_is_its_rod() -> None:
    law = po.exponential()
    plain = subject_of(po.Scene(ROD, law=law), "auto")
    assert plain.scene is None
    assert plain.bond_law == law
    assert Subject(ROD, "auto", po.Scene(ROD, law=law, unbonded=1.0)).bond_law == law
    with pytest.raises(po.InvalidInput, match="its own law"):
        subject_of(po.Scene(ROD), law)
    with pytest.raises(po.InvalidInput, match="curved wall"):
        subject_of(po.Scene(ROD, wall=po.Circle(-0.1), loads=[po.Weight(0.1)]), "auto")
    with pytest.raises(po.InvalidInput, match="rod must be a Rod"):
        subject_of(None, "auto")  # type: ignore[arg-type]


def test_a_shape_is_lengthened_as_it_is() -> None:
    flat = EDGE.lifted(0.0)
    assert flat is not None
    longer = lengthened(flat, 1.5)
    assert longer.s[-1] == 1.5
    np.testing.assert_array_equal(longer.theta, flat.theta)


def test_a_rod_that_curls_into_its_wall_begins_with_its_tip_on_it() -> None:
    wall = po.Circle(0.1)
    resting = po.solve(po.Scene(ROD, wall=wall, tip=po.Contact()), free="length", pressure=0.6)
    for tip in (po.Scene(ROD).tip, po.Contact()):
        what = subject_of(po.Scene(ROD, wall=wall, tip=tip), "auto")
        start = what.lifted(0.6)
        assert start is not None
        assert start.s[-1] == resting.length
        # Its angle counts from where it lay: down, at the tip.
        assert start.theta[0] == pytest.approx(resting.tip_angle + 0.1 * resting.length, abs=1e-12)
        assert start.theta[-1] == pytest.approx(0.0, abs=1e-15)


def test_a_rod_goes_around_its_circle_once_at_most() -> None:
    around = Subject(ROD, "auto", po.Scene(ROD, wall=po.Circle(-0.2), natural_curvature=-0.2))
    assert around.longest(None) == pytest.approx(10.0 * np.pi)
    assert around.longest(12.0) == 12.0
    with pytest.raises(po.InvalidInput, match=r"more than once, on 31\.4159 eta"):
        around.longest(40.0)
    assert EDGE.longest(None) == np.inf


@pytest.mark.slow
def test_a_flap_outside_a_cylinder_peels_all_around_it() -> None:
    """Where its wall falls away from the rod the pressure does not fold it over."""
    snapped = po.snap(po.Scene(ROD, wall=po.Circle(-0.2), natural_curvature=-0.2), 0.6)
    assert snapped.outcome == "end of rod"
    assert snapped.front[-1] == pytest.approx(10.0 * np.pi, abs=1e-6)


@pytest.mark.slow
def test_a_shape_that_has_more_phases_than_it_was_solved_in_is_not_merged() -> None:
    bent = po.Scene(po.Rod.from_ratio(22.3741), natural_curvature=-0.174)
    with pytest.raises(po.NotConverged, match="lost at 94 %"):
        po.snap(bent, 0.4)
