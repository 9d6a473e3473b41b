"""Rods whose tip touches the plate, or lies on it, and flaps of a bond that does not heal (`grown`)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import peel_opt as po

#: Independent values: ratio, p/T0, sbar/eta, tip angle, least eigenvalue of small motions times eta/T0.
TOUCHING = [
    (0.3, 0.9, 3.128068, -3.98273, -0.046),
    (0.566, 0.9, 3.233151, -4.0041, -0.06084),
    (0.566, 0.6, 3.419564, -3.98902, -0.20927),
    (1.0, 0.8, 3.586302, -4.06166, -0.2795),
    (2.0, 0.5, 4.434432, -4.11345, -0.61628),
]

#: ratio, p/T0, length of the loop, greatest height, its width, -N_y at the front and N_y at the landing.
FLAT = [
    (0.3, 0.9, 4.008536, 0.811465, 1.9368, 3.85592, 1.4918),
    (0.566, 0.9, 4.108134, 0.84127, 1.94918, 3.55555, 1.49627),
    (1.0, 0.8, 4.439854, 0.935067, 2.01766, 2.87424, 1.45384),
    (2.0, 0.5, 5.383378, 1.177362, 2.34049, 1.98333, 1.26795),
]


@pytest.mark.parametrize(("ratio", "pressure", "length", "angle", "mu"), TOUCHING)
def test_touching_states_are_those_of_an_independent_computation(ratio, pressure, length, angle, mu):
    eq = po.touching(po.Rod.from_ratio(ratio), pressure)
    assert eq.certified
    assert eq.state == "touching"
    assert "tip on plate" in eq.flags
    assert eq.length_ratio == pytest.approx(length, abs=1e-6)
    assert eq.tip_angle == pytest.approx(angle, abs=1e-5)
    assert abs(eq.tip_height) < 1e-8
    assert max(abs(eq.curvature[0]), abs(eq.Nx[0]), abs(eq.Ny[0])) < 1e-8
    motions = po.stability(eq)
    assert motions.index == 1
    least = min(motions.eigenvalues.real) / eq.length_ratio**4
    assert least == pytest.approx(mu, abs=1e-5)


def test_touching_states_cross_the_folded_ones_at_the_strength():
    rod = po.Rod.from_ratio(1.0)
    contact = po.trace(rod, points=24, tol=1e-6).special("contact")[0]
    assert po.touching(rod, 1.0).length_ratio == pytest.approx(contact.length_ratio, abs=1e-7)
    touching = po.touching(rod, 0.999).length_ratio
    folded = po.length_given_pressure(rod, 0.999, state="folded").length_ratio
    assert touching != pytest.approx(folded, abs=1e-5)
    with pytest.raises(po.NoEquilibrium):
        po.touching(rod, 1.01)


@pytest.mark.parametrize(("ratio", "pressure", "length", "top", "width", "front", "landing"), FLAT)
def test_flat_folds_are_those_of_an_independent_computation(
    ratio, pressure, length, top, width, front, landing
):
    eq = po.flat_fold(po.Rod.from_ratio(ratio), pressure)
    assert eq.certified
    assert eq.valid
    assert eq.state == "flat fold"
    assert eq.length_ratio == pytest.approx(length, abs=1e-5)
    assert eq.y.max() == pytest.approx(top, abs=3e-4)  # on the points of the shape
    assert eq.x[0] == pytest.approx(width, abs=2e-5)
    assert -eq.Ny[-1] == pytest.approx(front, abs=1e-5)
    assert eq.numbers["reaction"] == pytest.approx(landing, abs=1e-5)
    assert eq.tip_angle == pytest.approx(-math.pi, abs=1e-9)
    assert max(abs(eq.curvature[0]), abs(eq.curvature[-1]), abs(eq.y[0]), abs(eq.theta[-1])) < 1e-8


def test_a_flat_fold_stays_down_to_hardly_any_pressure_and_in_the_units_of_its_rod():
    loop = po.flat_fold(po.Rod.from_ratio(1.0), 1e-3)
    assert loop.certified
    assert loop.length_ratio > po.flat_fold(po.Rod.from_ratio(1.0), 0.1).length_ratio
    rod = po.Rod(2.3e-5, 140e3, 0.73e-3)
    real, plain = po.flat_fold(rod, 56e3), po.flat_fold(po.Rod.from_ratio(rod.ratio), 0.4)
    assert real.length == pytest.approx(plain.length * rod.eta, rel=1e-8)
    force = rod.adhesion_strength * rod.eta
    assert real.numbers["reaction"] == pytest.approx(plain.numbers["reaction"] * force, rel=1e-7)


@pytest.mark.slow
def test_a_loop_that_is_long_beside_y0_is_known_to_what_rounding_leaves():
    rod = po.Rod.from_ratio(500.0)
    with pytest.raises(po.NotCertified, match="larger tol"):
        po.flat_fold(rod, 2e-3)
    loop = po.flat_fold(rod, 2e-3, tol=1e-6)
    assert 1e-8 < loop.error < 2e-7
    # Where hardly any of the loop is bonded, lengths go with p^(-1/3).
    near = po.flat_fold(rod, 2.2e-3, tol=1e-6)
    assert loop.length / near.length == pytest.approx(1.1 ** (1.0 / 3.0), rel=0.02)


def test_states_on_the_plate_take_other_laws():
    rod, law = po.Rod.from_ratio(1.0), po.trapezoidal(0.4)
    loop = po.flat_fold(rod, 0.8, law=law)
    assert loop.certified
    assert loop.length_ratio != pytest.approx(po.flat_fold(rod, 0.8).length_ratio, abs=1e-2)
    touching = po.touching(rod, 0.8, law=law)
    assert touching.certified
    assert po.stability(touching).index == 1


# -- bonds that do not heal


def unhealed(ratio, P, guess):
    """Return the detached length by shooting from the front, where N_x = G: the bond ends at y0 for good."""

    def shot(Ny, length):
        def rates(s, z, bonded):
            theta, bend, Nx, Ny, y = z
            pull = 1.0 - ratio * y if bonded else 0.0
            sine, cosine = math.sin(theta), math.cos(theta)
            # From the front to the tip: the arc length of the rod runs the other way.
            return [-bend, -(Ny * cosine - Nx * sine), P * sine, -(P * cosine - pull), -sine]

        def opens(s, z, *_):
            return z[4] - 1.0 / ratio

        opens.terminal, opens.direction = True, 1
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
        first = solve_ivp(
            rates, (0, length), [0, 0, 0.5 / ratio, Ny, 0], args=(True,), events=opens, **options
        )
        last = solve_ivp(rates, (first.t[-1], length), first.y[:, -1], args=(False,), **options)
        return [last.y[1, -1], last.y[3, -1]]

    return fsolve(lambda u: shot(*u), guess, xtol=1e-12)[1]


@pytest.mark.parametrize(("ratio", "P"), [(1.0, 0.5), (1.0, 0.8), (2.0, 0.9)])
def test_growing_flaps_are_those_of_shooting_with_a_bond_that_ends_for_good(ratio, P):
    eq = po.grown_flap(po.Rod.from_ratio(ratio), P)
    assert eq.certified
    assert eq.state == "grown"
    assert P * eq.tip_height == pytest.approx(0.5 / ratio, abs=1e-9)
    assert unhealed(ratio, P, [eq.Ny[-1], eq.length_ratio]) == pytest.approx(eq.length_ratio, abs=1e-7)


def test_growing_flaps_are_the_folded_states_until_the_tip_comes_down_through_y0():
    rod = po.Rod.from_ratio(0.566)
    grown, folded = po.grown_flap(rod, 0.4), po.length_given_pressure(rod, 0.4, state="folded")
    assert grown.length_ratio == pytest.approx(folded.length_ratio, abs=1e-8)
    with pytest.raises(po.NoEquilibrium, match="come down into the range") as caught:
        po.grown_flap(rod, 0.6)
    assert po.grown_flap(rod, caught.value.nearest * 0.999).certified
    with pytest.raises(po.NoEquilibrium, match="minimum pressure") as caught:
        po.grown_flap(rod, 0.2)
    assert caught.value.nearest == pytest.approx(po.readhesion_pressure(rod).pressure, abs=1e-8)


@pytest.mark.parametrize(
    ("ratio", "longest", "P"), [(1.0, 5.618032, 0.13745), (0.566, 4.365701, 0.304), (2.0, 7.662254, 0.05006)]
)
def test_the_largest_flap(ratio, longest, P):
    flap = po.largest_flap(po.Rod.from_ratio(ratio))
    assert flap.length_ratio == pytest.approx(longest, abs=1e-6)
    assert flap.pressure_ratio == pytest.approx(P, abs=1e-5)
    assert flap.error < 1e-9 > flap.certificate


@pytest.mark.parametrize("ratio", [0.3, 1.0])
def test_touching_states_reach_the_contact_at_T0_in_a_straight_line(ratio):
    rod = po.Rod.from_ratio(ratio)
    contact = po.trace(rod, points=40).special("contact")[0].length_ratio
    slope = (po.touching(rod, 0.999).length_ratio - contact) / 1e-3
    for below in (1e-4, 7e-5, 1e-5, 1e-6):
        eq = po.touching(rod, 1.0 - below)
        assert eq.state == "touching"
        assert eq.length_ratio == pytest.approx(contact + slope * below, abs=1e-7)
        assert abs(eq.tip_height) < 1e-9


def test_a_sharp_bond_has_the_largest_flap_in_closed_form():
    rod = po.Rod.from_ratio(300.0)
    flap = po.largest_flap(rod)
    size = math.sqrt(rod.bending_stiffness / (0.5 * rod.adhesion_range))
    assert flap.sharp_length == pytest.approx(3.616011585925 * size, rel=1e-11)
    assert flap.length == pytest.approx(flap.sharp_length, rel=2e-3)
    assert flap.tip_angle == pytest.approx(-2.591473, abs=1e-4)
    least = (
        0.5 * rod.adhesion_range / 2.0
    ) ** 1.5  # p_min, p_min: there the highest tip, Y = 2, does the work
    assert flap.sharp_pressure == pytest.approx(1.152957376 * least, rel=1e-7)


def test_a_rod_that_no_equilibrium_opens_fully_has_no_largest_flap():
    with pytest.raises(po.NoEquilibrium, match="fully"):
        po.largest_flap(po.Rod.from_ratio(0.2))
    with pytest.raises(po.NoEquilibrium):
        po.largest_flap(po.Rod.from_ratio(1.0), law=po.exponential())


def test_what_cannot_be_meant_is_refused():
    rod = po.Rod.from_ratio(1.0)
    for ask in (po.touching, po.flat_fold, po.grown_flap):
        for pressure in (0.0, -0.1, np.nan, "high"):
            with pytest.raises(po.PeelOptError):
                ask(rod, pressure)
    with pytest.raises(po.InvalidInput):
        po.flat_fold("rod", 0.5)
