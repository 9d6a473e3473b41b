"""Strips between two edges, and tips that rest on their wall: known states, transitions, limits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import peel_opt as po

from ..rods import FLAP
from ..scene_oracle import Start, march
from ..scene_states import REFERENCE, blisters, pressure_of, scene_of, title

ROD = po.Rod.from_ratio(1.0)

QUICK = ("roller Nx=0 P=.8", "slack d=0.1 sbar=3", "slack d=0.2 sbar=5")


@pytest.mark.parametrize(
    "state",
    [pytest.param(s, marks=() if s["tag"] in QUICK else pytest.mark.slow, id=title(s)) for s in blisters()],
)
def test_a_known_blister_is_met_within_its_error(state: dict[str, Any]) -> None:
    v, by_length = state["values"], state["free"] == ["sbar"]
    given = {"pressure": pressure_of(state)} if by_length else {"length": v["sbar"]}
    eq = po.solve(scene_of(state), free="length" if by_length else "pressure", **given)
    digits = 10.0 ** (1 - state["digits"])
    assert eq.certified
    assert abs(eq.answer - v[state["free"][0]]) <= eq.error + digits
    assert eq.valid
    assert eq.y[0] == pytest.approx(v["y_c"], abs=300.0 * digits)
    assert eq.curvature[0] == pytest.approx(v["kap_c"], abs=300.0 * digits)
    assert eq.Nx[0] == pytest.approx(v["Nx_c"], abs=300.0 * digits)
    assert eq.Ny[-1] == pytest.approx(v["Ny_sbar"], abs=300.0 * digits)
    assert eq.theta[0] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ratio", "slack", "pressure"),
    [
        (0.01, 0.1, 0.0),
        (0.01, 1.0, 0.1),
        (0.1, 2.0, 0.2),
        (1.0, 5.0, 0.0),
        (30.0, 0.01, 0.0),
        (30.0, 1.0, 0.0),
    ],
)
def test_a_slack_strip_stands_whatever_its_slack(ratio: float, slack: float, pressure: float) -> None:
    eq = po.solve(po.Blister(po.Rod.from_ratio(ratio), slack=slack), free="length", pressure=pressure)
    assert (eq.state, eq.certified, "self-contact" in eq.flags) == ("lifted", True, False)
    assert eq.length + eq.x[0] == pytest.approx(slack, abs=1e-9)
    start = Start(0.0, eq.x[0], eq.y[0], eq.numbers["thrust"], 0.0, eq.curvature[0])
    assert march({"y0": 1.0 / ratio, "p": pressure}, eq.length, start).missed < 1e-8


@pytest.mark.slow
def test_a_strip_that_meets_its_other_half_says_so() -> None:
    eq = po.solve(po.Blister(po.Rod.from_ratio(0.1), slack=5.0), free="length", pressure=0.1)
    assert eq.x.min() < eq.x[0]
    assert "self-contact" in eq.flags


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "roller"), [(0.005, 1.0), (0.005, 5.0), (100.0, 0.0), (1000.0, -10.0)])
def test_a_strip_on_rollers_lifts_in_its_lowest_mode(ratio: float, roller: float) -> None:
    eq = po.solve(po.Blister(po.Rod.from_ratio(ratio), roller=roller), free="length", pressure=0.8)
    assert (eq.state, eq.certified, eq.valid) == ("middle", True, True)
    assert eq.y.argmax() == 0
    start = Start(0.0, eq.x[0], eq.y[0], roller, 0.0, eq.curvature[0])
    assert march({"y0": 1.0 / ratio, "p": 0.8}, eq.length, start).missed < 1e-8


def test_a_strip_on_rollers_lifts_at_a_longer_length_than_an_edge() -> None:
    """As p -> T0 half of it has the length g (k y0/T0)^(1/4) with tan(g) = tanh(g), not pi."""
    gamma = float(REFERENCE["linear_critical"]["S7_gamma"])
    lengths = [
        po.solve(po.Blister(ROD, roller=0.0), free="length", pressure=1.0 - h).length for h in (2e-5, 1e-5)
    ]
    assert 2.0 * lengths[1] - lengths[0] == pytest.approx(gamma, abs=1e-9)


@pytest.mark.parametrize("N0", ["1.0", "10.0", "-5.0"])
def test_a_push_on_the_ends_brings_that_length_forward(N0: str) -> None:
    """beta1c(N0), with N0 = N_x sbar^2/k; a pull puts it off."""
    critical = float(REFERENCE["linear_critical"]["S7_N0"].get(N0, math.nan))
    if math.isnan(critical):
        critical = 121.470979364
    length = critical**0.25
    scene = po.Blister(ROD, roller=float(N0) / length**2)
    lengths = [po.solve(scene, free="length", pressure=1.0 - h).length for h in (2e-5, 1e-5)]
    assert 2.0 * lengths[1] - lengths[0] == pytest.approx(length, abs=1e-8)


def test_slack_and_thrust_are_inverses() -> None:
    """The force that a slack brings about, given on rollers, takes up that slack."""
    held = po.solve(po.Blister(ROD, slack=0.1), free="length", pressure=0.5)
    thrust = held.numbers["thrust"]
    free = po.solve(po.Blister(ROD, roller=thrust), free="length", pressure=0.5, near=held.length)
    assert free.length == pytest.approx(held.length, abs=1e-9)
    assert free.length + free.x[0] == pytest.approx(0.1, abs=1e-9)
    back = po.solve(po.Blister(ROD, slack=0.3), free="slack", pressure=0.5, length=held.length)
    assert back.answer == pytest.approx(0.1, abs=1e-8)


def test_a_strip_with_slack_stands_without_pressure_and_grows_with_it() -> None:
    """Buckled at p = 0; the state that grows from there comes first, and is the default."""
    scene = po.Blister(ROD, slack=0.1)
    lengths = [po.solve(scene, free="length", pressure=p).length for p in (0.0, 0.3, 0.5)]
    assert np.all(np.diff(lengths) > 0.0)
    assert po.solve(scene, free="length", pressure=0.5, state="unfolded").length > lengths[-1]
    with pytest.raises(po.NoEquilibrium, match=r"nearest.*pressure = 0\.557"):
        po.solve(scene, free="length", pressure=0.6)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "flat for ever"),
        ({"slack": 0.0}, "flat for ever"),
        ({"slack": -0.1}, "zero or positive"),
        ({"roller": 0.0, "slack": 0.1}, "one of roller= and slack="),
        ({"stretch": 100.0}, "line energy"),
        ({"roller": math.inf}, "finite"),
        ({"slack": 0.1, "tip": po.Contact()}, "tip of a blister"),
        ({"slack": 0.1, "wall": po.Circle(0.1)}, "flat wall"),
    ],
)
def test_a_strip_that_cannot_lift_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        po.Blister(ROD, **given)


@pytest.mark.parametrize(
    "scene",
    [
        po.Blister(ROD, slack=0.1),
        po.Blister(ROD, stretch=50.0, line_energy=0.2),
        po.Scene(ROD, wall=po.Circle(0.1), tip=po.Contact()),
    ],
    ids=["slack", "stretch", "contact"],
)
@pytest.mark.slow
def test_strips_and_tips_that_rest_are_traced(scene: po.Scene) -> None:
    branch = po.trace(scene, points=12)
    assert branch.error.max() < 1e-10
    assert branch.certificate.max() < 1e-9
    i = len(branch) // 3
    eq = branch[i]
    assert eq.tip_angle == pytest.approx(branch.tip_angle[i], abs=1e-9)
    assert eq.tip_height == pytest.approx(branch.tip_height[i], abs=1e-9)
    assert branch.ended in ("far", "suction", "lifts", "long")


def test_a_branch_that_goes_on_for_ever_is_traced_up_to_twelve_lengths() -> None:
    """A jet dies out as the rod turns up: P_min by shooting, and no refusal of what lies before."""
    branch = po.trace(po.Scene(ROD, [po.Pressure(po.profiles.jet())]), points=24)
    least = branch.special("LP-pressure")[0]
    assert least.pressure_ratio == pytest.approx(0.458879373767, abs=1e-11)
    assert least.length_ratio == pytest.approx(4.4388244, abs=1e-6)
    assert branch.ended == "far"
    assert branch.error.max() <= 1e-10


@pytest.mark.parametrize("pressure", [0.3, 0.5])
def test_both_states_of_a_strip_with_slack_are_listed(pressure: float) -> None:
    found = po.equilibria(po.Blister(ROD, slack=0.1), pressure=pressure)
    assert [eq.state for eq in found] == ["lifted", "middle"]
    for eq in found:
        assert eq.certified
        # p y_c = Phi(y_c) - k kap_c^2/2
        work = eq.y[0] - 0.5 * eq.y[0] ** 2 if eq.y[0] < 1.0 else 0.5
        assert pressure * eq.y[0] == pytest.approx(work - 0.5 * eq.curvature[0] ** 2, abs=1e-10)


# -- tips that rest on their wall


@pytest.mark.parametrize("curvature", [0.0, 0.2, -0.1])
def test_the_reaction_at_a_tip_balances_the_curl(curvature: float) -> None:
    """Fc sin(theta - psi) = (k/2) (kw - kap_n)^2, with psi the angle of the wall at the tip."""
    curl = 0.2
    scene = po.Scene(ROD, wall=po.Circle(curvature), tip=po.Contact(), natural_curvature=curvature - curl)
    eq = po.solve(scene, free="length", pressure=0.3)
    angle = math.atan2(curvature * eq.x[0], 1.0 - curvature * eq.y[0])
    assert eq.numbers["reaction"] * math.sin(eq.tip_angle - angle) == pytest.approx(0.5 * curl**2, abs=1e-12)
    assert eq.curvature[0] == pytest.approx(curvature - curl, abs=1e-12)
    assert eq.valid


def test_a_little_curl_lifts_a_length_that_is_known() -> None:
    """sbar -> 2 sqrt(|kap_n| k / (T0 - p))."""
    for curl, within in ((1e-2, 1e-3), (1e-4, 1e-5)):
        scene = po.Scene(ROD, tip=po.Contact(), natural_curvature=-curl)
        length = po.solve(scene, free="length", pressure=0.5).length
        assert length == pytest.approx(2.0 * math.sqrt(2.0 * curl), rel=within)


def test_a_straight_strip_in_an_artery_rests_on_its_tip() -> None:
    """Wall and rod bend against each other: the tip touches, in the units of the rod too."""
    rod = FLAP
    scene = po.Scene(rod, wall=po.Circle(0.2 / rod.eta), tip=po.Contact())
    eq = po.solve(scene, free="length", pressure=0.5 * rod.adhesion_strength)
    assert eq.certified
    assert eq.numbers["reaction"] > 0.0
    over = po.solve(
        po.Scene(po.Rod.from_ratio(rod.ratio), wall=po.Circle(0.2), tip=po.Contact()),
        free="length",
        pressure=0.5,
    )
    assert eq.length == pytest.approx(over.length * rod.eta, rel=1e-9)
    unit = rod.adhesion_strength * rod.eta
    assert eq.numbers["reaction"] == pytest.approx(over.numbers["reaction"] * unit, rel=1e-9)


@pytest.mark.slow
def test_the_curl_of_a_tip_is_found_from_its_length() -> None:
    scene = po.Scene(ROD, tip=po.Contact(), natural_curvature=-0.1)
    found = po.solve(scene, free="natural_curvature", pressure=0.0, length=0.8950880223457239)
    assert found.answer == pytest.approx(-0.2, abs=1e-8)


def test_a_tip_that_is_lifted_by_its_curl_does_not_rest() -> None:
    scene = po.Scene(ROD, tip=po.Contact(), natural_curvature=0.1)
    with pytest.raises(po.InvalidInput, match="curls into"):
        po.solve(scene, free="length", pressure=0.3)


def test_above_the_snap_of_a_strip_with_slack_there_is_no_state_and_beyond_its_longest_there_may_be() -> None:
    strip = po.Blister(po.Rod.from_ratio(1.0), slack=0.039266)
    with pytest.raises(po.NoEquilibrium) as caught:
        po.solve(strip, free="length", pressure=0.9)
    assert caught.value.nearest == pytest.approx(0.7215, abs=1e-3)
    with pytest.raises(po.NotConverged, match="as far as it was followed"):
        po.solve(strip, free="length", pressure=0.1, state="folded")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "line_energy", "pressure"), [("auto", 0.001, 0.3), ("auto", 0.01, 2.0), ("none", 0.01, 0.3)]
)
def test_a_tip_rests_on_its_wall_where_a_line_energy_holds_the_front(
    law: str, line_energy: float, pressure: float
) -> None:
    scene = po.Scene(ROD, wall=po.Circle(0.2), tip=po.Contact(), law=law, line_energy=line_energy)
    eq = po.solve(scene, free="length", pressure=pressure)
    assert eq.certified
    assert eq.numbers["reaction"] > 0.0
    given = {"y0": 1.0, "p": pressure, "kw": 0.2, "G0": line_energy} | ({"nocoh": 1} if law == "none" else {})
    start = Start(eq.tip_angle, eq.x[0], eq.y[0], eq.Nx[0], eq.Ny[0], eq.curvature[0])
    assert march(given, eq.length, start).missed < 1e-8


def test_a_line_energy_that_lifts_the_tip_leaves_no_contact() -> None:
    scene = po.Scene(ROD, wall=po.Circle(0.2), tip=po.Contact(), line_energy=0.05)
    with pytest.raises(po.NotConverged, match="its tip lifts off"):
        po.solve(scene, free="length", pressure=0.3)


def test_a_strip_with_hardly_any_slack_stands_lifted_up_to_a_maximum_that_is_stepped_over() -> None:
    strip = po.Blister(po.Rod.from_ratio(0.75), slack=1e-11)
    low, high = (po.solve(strip, free="length", pressure=P) for P in (0.05, 0.6))
    assert (low.state, high.state) == ("lifted", "lifted")
    assert low.length < high.length
