"""Quotients of a law by the height keep their digits at any height."""

from __future__ import annotations

import casadi as ca
import pytest

import peel_opt as po
from peel_opt.model.named_laws import exponential
from peel_opt.model.quotients import mean_over_height, over_height


@pytest.mark.parametrize("u", [1e-14, 1e-6, 0.9e-4, 1.1e-4, 0.5, 3.0, 70.0, 1e4, 1e6, -0.4])
def test_quotients_of_a_drop_are_right_at_any_height(u: float) -> None:
    drop = exponential().pieces[0].drop
    v = ca.SX.sym("v")
    values = ca.Function("q", [v], [over_height(drop, v), mean_over_height(drop, v)])(u)
    import mpmath

    with mpmath.workdps(60):
        exact = -mpmath.expm1(-mpmath.mpf(u)) / u
        mean = (1 - exact) / u
    assert [float(q) for q in values] == pytest.approx([float(exact), float(mean)], rel=2e-15)


def test_quotients_at_zero_are_the_slope_and_half_of_it() -> None:
    law = po.CohesiveLaw(lambda u: 1.0 / (1.0 + 3.0 * u), drop=lambda u: 3.0 * u / (1.0 + 3.0 * u))
    drop = law.pieces[0].drop
    v = ca.SX.sym("v")
    q, mean = over_height(drop, v), mean_over_height(drop, v)
    at_zero = ca.Function("q", [v], [q, mean, ca.jacobian(q, v), ca.jacobian(mean, v)])(0.0)
    assert [float(part) for part in at_zero] == pytest.approx([3.0, 1.5, -9.0, -3.0], rel=1e-13)
