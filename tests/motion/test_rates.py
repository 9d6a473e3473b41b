"""Growth rates, the drag from which on a folded rod does not flutter, and where it does whatever the drag."""

from __future__ import annotations

import math

import pytest

import peel_opt as po


def unfolded(r: float, P: float) -> po.Equilibrium:
    return po.length_given_pressure(po.Rod.from_ratio(r), P)


def folded(r: float, P: float) -> po.Equilibrium:
    return po.length_given_pressure(po.Rod.from_ratio(r), P, state="folded")


@pytest.mark.parametrize(
    ("r", "P", "mu"),
    [
        (0.3, 0.9, -0.275089002),
        (1.0, 0.6, -0.81545369),
        (0.566, 0.4, -0.16588625),
        (0.05, 0.97, -0.05558318),
        (0.7506304974, 0.285487, -0.11340151),
    ],
)
def test_an_unfolded_rod_leaves_at_a_known_rate(r: float, P: float, mu: float) -> None:
    eq = unfolded(r, P)
    assert po.growth_rate(eq) == pytest.approx(-mu, abs=1e-7)
    assert po.growth_rate(eq, drag=2.0) == pytest.approx(-0.5 * mu, abs=1e-7)
    s = po.growth_rate(eq, mass=1.0, drag=0.3)
    assert s * s + 0.3 * s + mu == pytest.approx(0.0, abs=1e-7)
    assert po.growth_rate(eq, mass=1.0, drag=0.0) == pytest.approx(math.sqrt(-mu), abs=1e-7)
    assert po.critical_drag(eq) == math.inf


@pytest.mark.parametrize("mass", [1e-3, 1e-8, 1e-12, 1e-16])
def test_a_light_rod_leaves_as_one_without_mass(mass: float) -> None:
    eq = unfolded(0.566, 0.4)
    rate = po.growth_rate(eq)
    assert po.growth_rate(eq, mass=mass, drag=1.0) == pytest.approx(rate - mass * rate**2, rel=1e-6)


def test_near_the_transition_the_rate_is_that_of_a_cantilever_less_the_bond() -> None:
    # (1.8751^4/pi^4 - 1) T0/y0: a clamped beam of length pi (k y0/T0)^(1/4) on a spring of -T0/y0.
    rod = po.Rod.from_ratio(0.5)
    limit = 0.8730881970348037 * rod.ratio
    rates = [po.growth_rate(po.length_given_pressure(rod, P)) for P in (1 - 1e-3, 1 - 1e-4)]
    assert rates[1] == pytest.approx(limit, rel=1e-4)
    assert abs(rates[1] - limit) < 0.2 * abs(rates[0] - limit)


@pytest.mark.parametrize(
    ("r", "P", "real", "imaginary"), [(1.0, 0.4, 0.0813723, 0.0989169), (0.566, 0.6, -0.0669547, 0.2162114)]
)
def test_the_drag_that_holds_a_folded_rod(r: float, P: float, real: float, imaginary: float) -> None:
    eq = folded(r, P)
    critical = imaginary / math.sqrt(real) if real > 0.0 else math.inf
    assert po.critical_drag(eq) == pytest.approx(critical, rel=1e-5)
    assert po.growth_rate(eq) == pytest.approx(-real, abs=1e-6)
    if real > 0.0:
        above, below = (po.growth_rate(eq, mass=1.0, drag=f * critical) for f in (1.01, 0.99))
        assert above < 0.0 < below


@pytest.mark.parametrize(
    ("r", "edges"),
    [
        (0.5, (0.48025423, 0.62458627)),
        pytest.param(0.566, (0.48127313, 0.70190593), marks=pytest.mark.slow),
        pytest.param(0.7, (0.51293952, 0.8080775), marks=pytest.mark.slow),
        pytest.param(1.0, (0.54271585, 0.99316247), marks=pytest.mark.slow),
        pytest.param(2.0, (0.58587796,), marks=pytest.mark.slow),
    ],
)
def test_where_no_drag_holds_a_folded_rod(r: float, edges: tuple[float, ...]) -> None:
    inside = [1.0, -1.0]
    for edge, sign in zip(edges, inside, strict=False):
        assert (
            po.growth_rate(folded(r, edge + 2e-6 * sign))
            > 0.0
            > po.growth_rate(folded(r, edge - 2e-6 * sign))
        )


@pytest.mark.parametrize("P", [0.7, 0.8, 0.9])
def test_a_short_ranged_rod_comes_back_to_its_fold(P: float) -> None:
    assert po.growth_rate(folded(0.3, P)) < 0.0


def test_rates_in_units() -> None:
    rod = po.Rod(2.2867e-5, 140096.0, 0.728e-3)
    eq = po.length_given_pressure(rod, 40e3)
    alone = po.growth_rate(po.length_given_pressure(po.Rod.from_ratio(rod.ratio), 40e3 / 140096.0))
    scale = rod.adhesion_strength / rod.eta
    assert po.growth_rate(eq) == pytest.approx(alone, rel=1e-7)  # over T0/(c eta)
    assert po.growth_rate(eq, drag=5.0) == pytest.approx(alone * scale / 5.0, rel=1e-7)
    assert po.growth_rate(eq, mass=0.742, drag=0.0) == pytest.approx(
        math.sqrt(alone * scale / 0.742), rel=1e-7
    )
    hold = po.length_given_pressure(rod, 40e3, state="folded")
    assert po.critical_drag(hold, mass=0.5) == pytest.approx(
        po.critical_drag(hold) * math.sqrt(0.5 * scale), rel=1e-12
    )


def test_what_cannot_be_meant_is_refused() -> None:
    eq = unfolded(1.0, 0.5)
    for wrong in ({"drag": -1.0}, {"mass": -1.0}, {"drag": 0.0}):
        with pytest.raises(po.InvalidInput):
            po.growth_rate(eq, **wrong)
    with pytest.raises(po.InvalidInput, match="drag"):
        po.growth_rate(po.length_given_pressure(po.Rod(2e-5, 1e5, 1e-3), 4e4), mass=1.0)
    with pytest.raises(po.InvalidInput, match="unit of time"):
        po.growth_rate(po.equilibrium(beta0=4, lam=1.0))


def test_a_folded_rod_within_y0_has_the_digits_of_its_phases_put_together() -> None:
    """It is one long phase, for which the first two degrees are too low: they differ by 2e-6."""
    assert po.stability(folded(1.0, 0.99)).error < 1e-8
