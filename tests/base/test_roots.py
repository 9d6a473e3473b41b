"""Zeros and turning points of functions that are known exactly: none missed, none twice."""

from __future__ import annotations

import math

import numpy as np
import pytest

from peel_opt.base.roots import between, graph_roots, turning_points, zeros


def test_every_change_of_sign_is_a_zero_and_a_zero_at_a_point_is_found_once() -> None:
    assert zeros(np.sin, np.array([1.0, 4.0, 5.0, 7.0])) == pytest.approx([math.pi, 2.0 * math.pi], rel=1e-15)
    assert zeros(lambda x: x - 2.0, np.array([1.0, 2.0, 3.0])) == [2.0]
    assert zeros(lambda x: x * x + 1.0, np.array([-1.0, 0.0, 1.0])) == []


@pytest.mark.parametrize("power", [1, 3, 9])
def test_a_place_between_two_ends_is_as_good_as_asked(power: int) -> None:
    """Also where one end would stay: a high power is flat at one of them."""

    def function(x: float) -> float:
        return x**power - 0.5

    where = between(function, (0.0, 1.0), (function(0.0), function(1.0)), 1e-9)
    assert where == pytest.approx(0.5 ** (1.0 / power), abs=1e-8)


def test_turns_and_roots_of_a_cubic() -> None:
    curve, slope = np.polynomial.Polynomial([0.0, -3.0, 0.0, 1.0]), np.polynomial.Polynomial([-3.0, 0.0, 3.0])
    assert turning_points(slope, (-3.0, 3.0)) == pytest.approx([-1.0, 1.0], abs=1e-15)
    for level in (-2.5, -1.0, 1.999999, 2.5):
        exact = np.roots([1.0, 0.0, -3.0, -level])
        expected = np.sort(exact[np.abs(exact.imag) < 1e-12].real)
        assert graph_roots(curve, slope, (-3.0, 3.0), level) == pytest.approx(expected, abs=1e-7)
    # Through the origin it goes anyway.
    assert graph_roots(curve, slope, (-3.0, 3.0), 0.0) == pytest.approx([-math.sqrt(3.0), math.sqrt(3.0)])
