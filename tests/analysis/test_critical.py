"""Transitions of scenes by their linear problem, and what becomes of them where something lifts the rod.

Modules: `critical`, `unfolding`.
"""

from __future__ import annotations

import math
from typing import Any

import pytest
from scipy.optimize import brentq

import peel_opt as po

from ..rods import FLAP
from ..scene_states import REFERENCE

ROD = po.Rod.from_ratio(1.0)

LINEAR = REFERENCE["linear_critical"]

#: d lambda / d alpha1 over beta0 at T of the paper's rod.
SLOPE = float(REFERENCE["slopes_at_T"]["paper"])


def _of_group(table: str, group: str) -> float:
    return float(LINEAR[table][group])


#: beta1 at the transition by 40-digit power series, with the scene that has it at eta/y0 = 1.
CASES = {
    f"{table} {group}": (make, float(group), _of_group(table, group))
    for table, make, groups in (
        (
            "S2_follower",
            lambda v, L: po.Scene(ROD, [po.SkinFriction(v / L**3)]),
            ("0.5", "-10.0", "20", "40"),
        ),
        ("S2_deadDrag", lambda v, L: po.Scene(ROD, [po.Drag(v / L**3)]), ("5.0", "-5.0")),
        ("S6_axial", lambda v, L: po.Scene(ROD, tip=po.TipLoad(-v / L**2)), ("1.0", "5.0", "-5.0")),
        ("S7_N0", lambda v, L: po.Blister(ROD, roller=v / L**2), ("1.0", "5.0", "-5.0")),
    )
    for group in groups
}


@pytest.mark.parametrize("case", CASES)
def test_the_transition_of_a_loaded_rod_is_that_of_its_series(case: str) -> None:
    make, group, beta1 = CASES[case]
    found = po.critical_length(make(group, beta1**0.25))
    assert found.length_ratio == pytest.approx(beta1**0.25, abs=found.error + 1e-13)
    assert found.beta1 == pytest.approx(beta1, rel=1e-11)
    assert found.pressure_ratio == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("kap", [0.5, -0.5, 1.5, -1.5])
def test_a_wall_moves_the_transition_as_its_eigenvalue_says(kap: float) -> None:
    """beta1 = mu(kap) + kap^4 - kap beta0, for a rod as curved as its wall, kap = kw sbar."""
    mu = _of_group("S4_mu", f"{abs(kap)}")
    sigma = brentq(lambda s: s**4 - (mu + kap**4 - kap * s**3), 1.0, 8.0, xtol=1e-14)
    wall = po.Circle(kap / sigma)
    found = po.critical_length(po.Scene(ROD, wall=wall, natural_curvature=kap / sigma))
    assert found.length_ratio == pytest.approx(sigma, abs=1e-11)


@pytest.mark.parametrize(
    "scene",
    [
        po.Scene(ROD),
        po.Scene(ROD, [po.Pressure(dead=0.4)]),
        po.Scene(ROD, [po.Pressure(po.profiles.jet())]),
        po.Scene(ROD, [po.Weight(0.2)]),
        po.Scene(ROD, law=po.EffectiveOpening(0.7)),
        po.Scene(ROD, law=po.ShearSprings(5.0)),
    ],
)
def test_what_acts_at_second_order_leaves_it_at_pi_to_the_fourth(scene: po.Scene) -> None:
    found = po.critical_length(scene)
    assert found.beta1 == pytest.approx(math.pi**4, rel=1e-12)
    assert found.pressure_ratio == pytest.approx(1.0 + scene.numbers.get("weight", 0.0), abs=1e-14)


def test_the_transition_is_in_the_units_of_the_rod() -> None:
    found = po.critical_length(FLAP)
    assert found.length == pytest.approx(FLAP.critical_length, rel=1e-12)
    assert found.pressure == pytest.approx(FLAP.adhesion_strength)
    strip = po.critical_length(po.Blister(FLAP, roller=0.0))
    assert strip.length / FLAP.critical_length == pytest.approx(3.926602312047919 / math.pi, rel=1e-12)


def test_states_near_it_are_where_it_says() -> None:
    """The solved branch, extrapolated to its transition, with loads that change sbar, p and slope there."""
    scene = po.Scene(ROD, [po.SkinFriction(traction=0.3), po.Weight(0.1), po.Pressure(dead=0.2)])
    found, h = po.critical_length(scene), 1e-4
    lengths = [
        po.solve(scene, free="length", pressure=found.pressure - n * h, state="unfolded").length
        for n in (1, 2, 3)
    ]
    limit = 3.0 * lengths[0] - 3.0 * lengths[1] + lengths[2]
    assert limit == pytest.approx(found.length, abs=1e-8)


@pytest.mark.parametrize(
    "scene",
    [
        po.Scene(ROD, unbonded=1.0),
        po.Scene(ROD, natural_curvature=0.1),
        po.Scene(ROD, [po.SkinFriction(traction=0.1)], po.Circle(0.1), natural_curvature=0.1),
        po.Scene(ROD, [po.Pressure(dead=0.1)], po.Circle(0.1), natural_curvature=0.1),
        po.Blister(ROD, slack=0.1),
    ],
)
def test_a_scene_that_is_lifted_from_the_start_has_none(scene: po.Scene) -> None:
    with pytest.raises(po.InvalidInput, match="no transition"):
        po.critical_length(scene)


@pytest.mark.parametrize(
    ("load", "offset"),
    [
        (po.Pressure(po.profiles.linear(-1e-3)), -1e-3 * 4.0 * math.pi**2),
        (po.Pressure(po.profiles.linear(0.01), dead=0.4), 0.01 * 4.0 * math.pi**2),
        (po.Pressure(lambda at: 1.0 + 0.01 * at.xi**2), 0.01 * 0.134698674863444),
        (po.Pressure(lambda at: 1.0 + 0.01 * at.xi**3), 0.01 * 0.103655185815776),
    ],
)
def test_a_profile_unfolds_the_transition(load: po.Pressure, offset: float) -> None:
    """lambda A - 0.0961917 beta0 A^2 + 4 pi^2 c beta0 = 0, and by the adjoint kernel for other profiles."""
    found = po.unfolding(po.Scene(ROD, [load]))
    if abs(offset) < 2e-3:
        offset *= 2.0 * math.pi**5 / math.cosh(0.5 * math.pi)  # over c11
    beta0 = found.transition.beta0
    assert beta0 == pytest.approx(math.pi**3, rel=1e-12)
    assert abs(found.offset / beta0 - offset) <= found.offset_error / beta0 + 1e-13
    assert abs(found.slope / beta0 - (1.0 - load.dead) * SLOPE) <= found.slope_error / beta0


@pytest.mark.parametrize(
    ("scene", "slope"),
    [
        (po.Scene(ROD, [po.SkinFriction(traction=0.3)]), "tau=0.3 r=1"),
        (po.Scene(ROD, law=po.EffectiveOpening(1.0)), "op zeta=1 r=1"),
    ],
)
def test_the_slope_at_the_transition_is_the_known_one(scene: po.Scene, slope: str) -> None:
    found = po.unfolding(scene)
    assert found.slope / found.transition.beta0 == pytest.approx(REFERENCE["slopes_at_T"][slope], abs=1e-5)
    assert found.offset == pytest.approx(0.0, abs=1e-14)


@pytest.mark.slow
def test_a_load_that_is_largest_at_the_tip_ends_the_branch_early() -> None:
    """lambda_max = -3.897 beta0 sqrt|c|, which the computed branch tends to: -3.62 at c = -1e-3."""
    off = []
    for c in (1e-3, 1e-5):
        scene = po.Scene(ROD, [po.Pressure(po.profiles.linear(-c))])
        found = po.unfolding(scene)
        assert found.largest_lam == pytest.approx(-3.897 * math.pi**3 * math.sqrt(c), rel=2e-4)
        longest = po.trace(scene, points=60).special("LP-length")[0].lam
        off.append(abs(longest / found.largest_lam - 1.0))
    assert off[0] == pytest.approx(1.0 - 3.62 / 3.82, abs=2e-3)
    assert off[1] < 0.012


@pytest.mark.slow
def test_a_branch_that_turns_sharply_beside_its_rest_has_the_folds_it_has() -> None:
    """No fold in pressure where the tangent of the small states turns by more than a right angle."""
    scene = po.Scene(ROD, [po.Pressure(po.profiles.linear(-1e-5))])
    first, second, *_ = po.trace(scene, points=12).special_points
    assert (first.kind, second.kind) == ("LP-length", "LP-length")
    assert first.lam == pytest.approx(po.unfolding(scene).largest_lam, rel=0.01)


@pytest.mark.parametrize(
    "parts",
    [
        {"natural_curvature": 1e-6},
        {"tip": po.TipLoad(moment=-1e-6)},
        {"tip": po.TipLoad(1e-6, 1.2)},
        {"unbonded": 1e-5},
        {"loads": [po.Pressure(po.profiles.exponential(1e4))]},
    ],
)
@pytest.mark.slow
def test_other_imperfections_shift_the_branch_by_as_much(parts: Any) -> None:
    """lambda(sbar) - f(alpha1(sbar)) + h/alpha1 = 0 at one pressure, f' the slope: a shift of sbar."""
    scene = po.Scene(ROD, **parts)
    found, P = po.unfolding(scene), 0.99
    plain = po.length_given_pressure(ROD, P).length
    shifted = po.solve(scene, free="length", pressure=P, state="unfolded").length - plain
    rate = 4.0 * plain**3 - found.slope * 3.0 * (P - 1.0) * plain**2
    assert shifted == pytest.approx(-found.offset / ((P - 1.0) * plain**3) / rate, rel=0.05)
    small = found.alpha1(found.largest_lam * 1.5)
    assert len(small) == 2
    assert found.lam(small[0]) == pytest.approx(found.largest_lam * 1.5)
    assert small[0] > small[1]


def test_what_does_not_unfold_is_refused() -> None:
    for scene in (
        po.Blister(ROD, slack=0.1),
        po.Scene(ROD, wall=po.Circle(0.1)),
        po.Scene(ROD, line_energy=0.1),
    ):
        with pytest.raises(po.InvalidInput, match="flat wall"):
            po.unfolding(scene)
