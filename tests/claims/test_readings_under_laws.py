"""Every reading that takes a law, under law (8), the exponential law and a law of a reader's own."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import peel_opt as po
from peel_opt.analysis.limits import fold_gradient
from peel_opt.model.bond import COHESIVE, LINEAR, CohesiveLaw
from peel_opt.model.named_laws import exponential, trapezoidal

from ..rods import FLAP

OWN = CohesiveLaw(
    lambda u: 1 / (1 + u) ** 2, drop=lambda u: u * (2 + u) / (1 + u) ** 2, name="inverse square"
)
DUGDALE = CohesiveLaw([lambda u: 1.0 + 0.0 * u, lambda u: 0.0 * u], kinks=(1,), name="Dugdale")
LAWS = {"cohesive": COHESIVE, "exponential": exponential(), "own": OWN}
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


@each_law
def test_the_loop_of_a_rod(law: CohesiveLaw) -> None:
    loop = po.hysteresis(FLAP, law=law, points=6)
    assert loop.visited == ("adhered", "folded")
    up, down = loop.jumps
    assert up.pressure == FLAP.adhesion_strength
    # With the tip on the plate p = T0 again; at the minimum pressure the rod lets go for good.
    assert loop.branch.law == law.name
    assert down.pressure == pytest.approx(loop.branch.pressure.min(), rel=1e-12)
    assert loop.area_error < 1e-4 * loop.area
    P, sigma = (
        column[loop.branch.special("LP-pressure")[0].index :]
        for column in (loop.branch.pressure, loop.branch.length)
    )
    assert loop.area == pytest.approx(np.trapezoid(sigma, P), rel=2e-3)


@each_law
def test_how_the_minimum_pressure_moves(law: CohesiveLaw) -> None:
    ratio, h, of = 1.0, 1e-3, "readhesion_pressure"
    found = po.sensitivities(po.Rod.from_ratio(ratio), of, law=law)
    low, high = (fold_gradient(r, law, of).value for r in (ratio - h, ratio + h))
    assert found.dimensionless["ratio"] == pytest.approx((high - low) / (2 * h), rel=1e-4)
    fold = po.trace(po.Rod.from_ratio(ratio), law=law, points=12, tol=1e-8).special("LP-pressure")[0]
    assert found.value == pytest.approx(fold.pressure_ratio, abs=1e-8)


@pytest.mark.parametrize(
    ("law", "of"), [(OWN, "least_length"), (OWN, "maxwell_length"), (exponential(), "maxwell_length")]
)
def test_what_a_law_does_not_have_is_not_that_of_law_8(law: CohesiveLaw, of: str) -> None:
    with pytest.raises(po.PeelOptError, match=law.name):
        po.sensitivities(po.Rod.from_ratio(1.0), of, law=law)


def test_the_exponential_law_has_not_the_minimum_of_law_8() -> None:
    pressures = [fold_gradient(1.0, law, "readhesion_pressure").value for law in LAWS.values()]
    assert pressures[0] == pytest.approx(0.121837041296, abs=1e-10)
    assert pressures[1] > 2 * pressures[0]  # twice the work of separation


@pytest.mark.parametrize("law", [LINEAR, trapezoidal(0.3), DUGDALE], ids=lambda law: law.name)
def test_a_law_without_transition_or_end_has_no_loop(law: CohesiveLaw) -> None:
    with pytest.raises(po.NoEquilibrium, match="no loop"):
        po.hysteresis(FLAP, law=law)


def test_a_law_says_itself_whether_branches_end_and_how_far_it_holds() -> None:
    assert [law.branch_ends for law in (LINEAR, *LAWS.values(), DUGDALE)] == [False, True, True, True, True]
    assert not CohesiveLaw(lambda u: 1 - 2 * u, name="pushes").branch_ends
    # What pushes for a while, but never as much as was gained, does not count.
    assert CohesiveLaw(lambda u: ca.exp(-u) * ca.cos(u), name="swings").branch_ends
    assert [law.is_affine for law in (LINEAR, COHESIVE, OWN)] == [True, False, False]
    rod = po.Rod.from_ratio(1.0)
    assert "y > y0" in po.length_given_pressure(rod, 0.4, law="linear").flags
    short = CohesiveLaw(lambda u: 1 / (1 + u) ** 2, name="short", holds_to=0.5)
    assert "y > y0" in po.length_given_pressure(rod, 0.6, law=short).flags  # the tip is at 1/0.6 - 1 = 0.67
    assert "y > y0" not in po.length_given_pressure(rod, 0.7, law=short).flags
    assert "y > y0" not in po.length_given_pressure(rod, 0.6, law=OWN).flags


@pytest.mark.parametrize("P", [0.97, 0.8, 0.6])
def test_constant_traction_is_the_limit_of_a_steep_end(P: float) -> None:
    rod = po.Rod.from_ratio(1.0)
    found = po.length_given_pressure(rod, P, law=DUGDALE)
    steep = [po.length_given_pressure(rod, P, law=trapezoidal(1 - e)).length_ratio for e in (0.002, 0.001)]
    assert found.length_ratio == pytest.approx(2 * steep[1] - steep[0], abs=1e-5)
    assert found.tip_height * rod.ratio == pytest.approx(1 / P, abs=1e-9)


def test_traces_and_questions_of_constant_traction_agree() -> None:
    rod = po.Rod.from_ratio(1.0)
    branch = po.trace(rod, law=DUGDALE, points=12, tol=1e-8, at={"pressure_ratio": [0.6]})
    asked = po.length_given_pressure(rod, 0.6, law=DUGDALE)
    here = np.isclose(branch.pressure_ratio, 0.6, rtol=0, atol=1e-12) & (branch.state != "folded")
    np.testing.assert_allclose(branch.length_ratio[here], [asked.length_ratio], atol=1e-8)
    assert asked.state == branch.state[here][0]
