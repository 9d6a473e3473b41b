"""States that no path on one rod reaches are reached through other rods at the same pressure."""

from __future__ import annotations

import numpy as np
import pytest

from peel_opt.continuation.isobar_walk import states_near
from peel_opt.continuation.tip_scan import TipShooting
from peel_opt.model.bond import LINEAR


def test_the_folded_state_of_fig_10b_is_met_through_softer_rods() -> None:
    beta0, beta1, alpha, tip_angle = (
        1002.12164002882482,
        5676.0169691232638,
        298.233910677637,
        -2.97424859961996,
    )
    sigma = beta0 ** (1.0 / 3.0)
    ratio, pressure = beta1 / sigma**4, alpha / beta0
    found = [c.profile.scalars for c in states_near(LINEAR, ratio, sigma, pressure)]
    assert all(s.sigma == pytest.approx(sigma, rel=1e-9) for s in found)
    assert all(s.ratio == pytest.approx(ratio, rel=1e-2) for s in found)
    assert any(
        s.pressure_ratio == pytest.approx(pressure, rel=1e-2) and pytest.approx(tip_angle, rel=1e-2) == -s.A
        for s in found
    )
    # What is met lies between two points of a walk; it is a state of some rod nearby all the same.
    for s in found:
        shot = TipShooting(LINEAR, s.ratio).misses(
            np.array([-s.A]), np.array([s.pressure_ratio]), np.array([sigma]), 2000
        )
        assert np.abs(shot).max() < 0.5
