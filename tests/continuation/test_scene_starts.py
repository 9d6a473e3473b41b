"""Small states to begin with: beams on paper, whose equations and ends are checked here by differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import peel_opt as po
from peel_opt.continuation.scene_starts import CURL, STRIP, SmallState, curled, swollen

ROD = po.Rod.from_ratio(1.0)


def fields(state: SmallState) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """xi, and Theta, K, n_y, Y there."""
    values = state.profile.values[0]
    return 1.0 + values[:, 5], values[:, 0], values[:, 1], values[:, 3], values[:, 4]


def derivative(xi: np.ndarray, values: np.ndarray) -> np.ndarray:
    return make_interp_spline(xi, values, 7).derivative()(xi)


@pytest.mark.parametrize("kappa", [-0.002, -0.2])
def test_a_short_rod_curls_into_its_wall(kappa: float) -> None:
    scene = po.Scene(ROD, tip=po.Contact(), natural_curvature=kappa)
    state = curled(scene, 1.0)
    xi, Theta, K, ny, Y = fields(state)
    assert derivative(xi, Y) == pytest.approx(Theta, abs=1e-6)
    assert derivative(xi, Theta) == pytest.approx(K, abs=1e-5)
    # A beam under its bond alone: the shear falls evenly.
    assert np.ptp(derivative(xi, ny)) < 1e-3
    assert (Y[0], Y[-1], Theta[-1], K[-1]) == (0.0, 0.0, 0.0, 0.0)
    assert np.all(Y[1:-1] > 0.0)
    # Without a moment the tip has the curvature of its own.
    s = state.profile.scalars
    assert s.A * K[0] / s.sigma == pytest.approx(max(kappa, -CURL), rel=1e-9)


def test_a_rod_that_curls_away_has_no_contact_to_begin_with() -> None:
    with pytest.raises(po.InvalidInput, match="curls into it"):
        curled(po.Scene(ROD, tip=po.Contact(), natural_curvature=0.2), 1.0)


@pytest.mark.parametrize("asked", [{"roller": 0.0}, {"slack": 0.1}])
def test_a_strip_begins_with_the_kernel_of_its_linear_problem(asked: dict[str, float]) -> None:
    assert math.tan(STRIP) == pytest.approx(math.tanh(STRIP), abs=1e-12)
    state = swollen(po.Blister(ROD, **asked), 1.0)
    xi, Theta, K, ny, Y = fields(state)
    for rate, values in ((Theta, Y), (K, Theta), (ny, K)):
        assert derivative(xi, values) == pytest.approx(rate, abs=1e-4 * np.abs(rate).max())
    # Symmetric at the middle, clamped and without moment at the edge.
    assert [Theta[0], ny[0], Y[-1], Theta[-1], K[-1]] == pytest.approx([0.0] * 5, abs=1e-10)
    assert K[0] == pytest.approx(-1.0, rel=1e-10)
    assert state.profile.scalars.sigma == pytest.approx(STRIP)


@pytest.mark.parametrize(("N0", "beta1"), [(5.0, 179.893715621), (-10.0, 351.941710809)])
def test_a_strip_that_is_pushed_or_pulled_begins_with_its_own_kernel(N0: float, beta1: float) -> None:
    """beta1 at which a strip under an axial force leaves its wall, by power series."""
    state = swollen(po.Blister(po.Rod.from_ratio(beta1), roller=N0), beta1)
    xi, Theta, K, ny, Y = fields(state)
    assert state.profile.scalars.sigma == pytest.approx(1.0, rel=1e-10)
    assert derivative(xi, K) == pytest.approx(ny - N0 * Theta, abs=1e-4 * np.abs(ny).max())
    assert [Theta[0], ny[0], Y[-1], Theta[-1], K[-1]] == pytest.approx([0.0] * 5, abs=1e-9)


def test_a_given_slack_is_what_the_strip_takes_up() -> None:
    state = swollen(po.Blister(ROD, slack=0.1), 1.0)
    xi, Theta, *_ = fields(state)
    s, ((name, slack),) = state.profile.scalars, state.instead
    assert name == "slack"
    taken = make_interp_spline(xi, 0.5 * (s.A * Theta) ** 2, 7).integrate(0.0, 1.0) * s.sigma
    assert slack == pytest.approx(taken, rel=1e-6)
