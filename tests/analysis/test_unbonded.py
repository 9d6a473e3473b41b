"""Edges that were never glued: where they snap, and which are critical."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import peel_opt as po

from ..rods import FLAP

#: eta/y0, a/eta, p_max/T0 and its digits, tip angle and sbar/eta at the snap; by local-frame shooting.
SNAPS = [
    (1.0, 0.1, 0.87611826, 5e-9, 0.063744, 1.966977),
    (1.0, 0.5, 0.5541041147, 6e-11, 0.2917200, 2.3571351),
    (1.0, 1.0, 0.3535512998, 6e-11, 0.5501037, 2.8667912),
    (1.0, 3.0, 0.1283256172, 6e-11, 1.717703, 4.986583),
    (0.75063, 1.0, 0.3759996751, 6e-11, 0.6555493, 2.9996331),
    (2.0, 1.0, 0.3024746828, 6e-11, 0.3689232, 2.5753403),
]


@pytest.mark.parametrize(("r", "a", "p_max", "digits", "angle", "sbar"), SNAPS)
def test_an_edge_snaps_where_shooting_has_its_limit_point(
    r: float, a: float, p_max: float, digits: float, angle: float, sbar: float
) -> None:
    found = po.safe_pressure(po.Rod.from_ratio(r), a)
    assert abs(found.pressure_ratio - p_max) <= found.error + digits
    assert found.certificate < 1e-12
    assert found.tip_angle == pytest.approx(-angle, abs=1e-6)  # flat there
    assert found.length == pytest.approx(sbar, abs=1e-6)


@pytest.mark.parametrize(
    ("r", "a"), [(1.0, 0.5), (0.75063, 1.0), pytest.param(30.0, 0.3, marks=pytest.mark.slow)]
)
def test_the_critical_flaw_is_the_inverse(r: float, a: float) -> None:
    rod = po.Rod.from_ratio(r)
    back = po.critical_flaw(rod, po.safe_pressure(rod, a).pressure)
    assert abs(back.flaw_ratio - a) <= back.error + 1e-12


def test_longer_flaws_snap_at_lower_pressures_and_short_ones_towards_the_strength() -> None:
    rod = po.Rod.from_ratio(1.0)
    safe = [po.safe_pressure(rod, a).pressure_ratio for a in (0.02, 0.1, 0.5)]
    assert 1.0 > safe[0] > safe[1] > safe[2]


def test_a_long_edge_grows_stably_and_says_so() -> None:
    with pytest.raises(po.NoEquilibrium, match="grows stably up to"):
        po.safe_pressure(po.Rod.from_ratio(1.0), 4.0)


@pytest.mark.parametrize("pressure", [0.0, -1.0, 1.0, 2.0])
def test_only_pressures_between_zero_and_the_strength_have_a_critical_flaw(pressure: float) -> None:
    with pytest.raises(po.OutOfRange, match="between 0 and T0"):
        po.critical_flaw(po.Rod.from_ratio(1.0), pressure)


def test_a_real_flap_in_its_own_units() -> None:
    """What the plain branch holds at this pressure is longer than what is safe."""
    rod = FLAP
    flaw = po.critical_flaw(rod, 60e3)
    assert po.safe_pressure(rod, flaw.flaw).pressure == pytest.approx(60e3, rel=1e-9)
    assert flaw.flaw < 0.5 * po.held_length(rod, 60e3).length


@pytest.mark.parametrize(("r", "a"), [(1.0, 30.0), (10.0, 30.0), (100.0, 100.0)])
def test_no_snap_is_found_beyond_the_touch_of_the_tip(r: float, a: float) -> None:
    """The tip comes down at p a^3/k = 114.6, and touches without going through.

    Seen from the tip a clamped flap is the curve phi' = (X^2 + Y^2)/2, X' = cos phi, Y' = sin phi, up to
    where it closes.
    """
    with pytest.raises(po.NoEquilibrium, match="tip comes back") as found:
        po.safe_pressure(po.Rod.from_ratio(r), a)

    flap = solve_ivp(
        lambda _, z: [0.5 * (z[1] ** 2 + z[2] ** 2), np.cos(z[0]), np.sin(z[0])],
        (0.0, 6.0),
        (0.0, 0.0, 0.0),
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
        events=lambda s, z: float(z[1]) if s > 4.5 else 1.0,
    )
    assert found.value.nearest * a**3 == pytest.approx(flap.t_events[0][0] ** 3, rel=1e-8)


@pytest.mark.parametrize(
    ("r", "a"),
    [(0.75, 1e-8), *(pytest.param(r, a, marks=pytest.mark.slow) for r, a in [(0.005, 3e-8), (0.75, 1e-12)])],
)
def test_an_edge_that_snaps_nearer_to_rest_than_states_are_followed_is_refused(r: float, a: float) -> None:
    """Beside T0 the walk steps over the snap: neither the least pressure beyond it nor T0 is where it is."""
    with pytest.raises(po.NotConverged, match="nearer to its rest"):
        po.safe_pressure(po.Rod.from_ratio(r), a)


@pytest.mark.slow
def test_an_imperfection_too_small_to_be_followed_does_not_make_the_large_state_the_lifted_one() -> None:
    faint = po.Scene(po.Rod.from_ratio(0.75), unbonded=1e-8)
    with pytest.raises(po.NotConverged, match="the lifted state is smaller"):
        po.solve(faint, free="length", pressure=0.6)
    there = po.solve(faint, free="length", pressure=0.6, state="lower")
    assert there.length == pytest.approx(po.length_given_pressure(faint.rod, 0.6).length, abs=1e-7)


@pytest.mark.slow
def test_where_the_critical_edge_is_too_short_to_be_met_a_lower_pressure_is_what_helps() -> None:
    with pytest.raises(po.NotConverged, match=r"no snap was met .* Give a lower pressure"):
        po.critical_flaw(po.Rod.from_ratio(0.75), 1.0 - 2e-9)


@pytest.mark.slow
def test_an_edge_too_long_to_be_reached_is_named_with_its_length() -> None:
    with pytest.raises(po.NotConverged, match=r"without glue of 1e\+06 eta .* shorter one"):
        po.safe_pressure(po.Rod.from_ratio(0.75), 1e6)


@pytest.mark.slow
def test_the_shortest_edges_snap_just_below_the_strength() -> None:
    rod = po.Rod(2.3e-5, 140e3, 0.73e-3)
    safe = [po.safe_pressure(rod, a).pressure_ratio for a in (3e-7, 2e-6)]
    assert 1.0 > safe[0] > safe[1] > 0.995


@pytest.mark.slow
@pytest.mark.parametrize("pressure", [0.001, 0.5, 0.9])
def test_critical_flaws_of_slender_rods_scale_with_the_length_of_the_transition(pressure: float) -> None:
    """In (k y0/T0)^(1/4), as slopes are small; a long one is a clamped flap, a^4 = 4 k T0 y0/p^2."""
    scaled = []
    for ratio in (300.0, 3000.0):
        rod = po.Rod.from_ratio(ratio)
        found = po.critical_flaw(rod, pressure)
        assert po.safe_pressure(rod, found.flaw).pressure == pytest.approx(pressure, abs=1e-9)
        scaled.append(found.flaw * ratio**0.25)
    assert scaled[0] == pytest.approx(scaled[1], rel=1e-2)
    if pressure == 0.001:
        assert scaled[1] == pytest.approx((4.0 / pressure**2) ** 0.25, rel=0.05)
