"""The scan of tip angles: known states are its zeros, and it finds them without being told."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation.tip_scan import TipGrid, TipShooting, starts_at_length
from peel_opt.model.bond import COHESIVE, LINEAR

#: A grid of a quarter of the points: enough for three states far apart.
COARSE = TipGrid(angles=80, values=40)


@pytest.mark.parametrize(
    ("pressure", "sigma", "tip_angle"),
    [(0.6, 3.01661969919912, -0.461253599385446), (0.2493, 3.63052618549983, -0.991914500927011)],
)
def test_a_state_of_the_registry_misses_the_edge_by_the_step_alone(
    pressure: float, sigma: float, tip_angle: float
) -> None:
    shooting = TipShooting(COHESIVE, 1.0)
    state = [np.array([v]) for v in (tip_angle, pressure, sigma)]
    coarse, fine = (np.abs(shooting.misses(*state, steps)).max() for steps in (48, 192))
    assert coarse < 1e-3
    # Of the fourth order where the traction is smooth, and of the second at least across its kink.
    assert fine < coarse / 10.0


def test_all_states_at_a_length_are_started_from() -> None:
    rod, sigma = po.Rod.from_ratio(1.0), 4.4453617483096  # of the folded state at p/T0 = 0.5
    found = starts_at_length(TipShooting(COHESIVE, 1.0), sigma, (0.1, 0.9), COARSE)
    pressures = sorted(profile.scalars.pressure_ratio for profile in found)
    assert any(pytest.approx(0.5, rel=1e-2) == P for P in pressures)
    unfolded = po.pressure_given_length(rod, sigma).pressure_ratio
    assert any(pytest.approx(unfolded, rel=1e-2) == P for P in pressures)
    assert all(profile.scalars.sigma == sigma for profile in found)


def test_a_tip_that_rests_on_the_plate_has_no_height_at_any_pressure() -> None:
    assert not TipShooting(LINEAR, 1.0, touching=True).tip_height(np.array([0.2, 0.9])).any()


def test_another_law_is_refused() -> None:
    with pytest.raises(po.InvalidInput, match="not 'exponential'"):
        TipShooting(po.exponential(), 1.0)
