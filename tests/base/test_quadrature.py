"""Gauss's rule and its matrices against integrals known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from peel_opt.base.quadrature import Grid, gauss, integration_matrix, values_matrix


@pytest.mark.parametrize("n", [1, 2, 5, 16, 48])
def test_the_rule_is_exact_up_to_its_degree_and_no_further(n: int) -> None:
    xi, weights = gauss(n)
    for power in (0, n, 2 * n - 1):
        assert weights @ xi**power == pytest.approx(1.0 / (power + 1), rel=1e-13)
    if n < 16:
        assert abs(weights @ xi ** (2 * n) - 1.0 / (2 * n + 1)) > 1e-12


@pytest.mark.parametrize("n", [1, 2, 5, 16])
def test_polynomials_are_integrated_and_interpolated_exactly_anywhere(n: int) -> None:
    xi, _ = gauss(n)
    at = np.linspace(0.0, 1.0, 13)
    for power in range(n):
        np.testing.assert_allclose(
            integration_matrix(n, at) @ xi**power, at ** (power + 1) / (power + 1), atol=1e-14
        )
        np.testing.assert_allclose(values_matrix(n, at) @ xi**power, at**power, atol=2e-14)


def test_a_grid_integrates_from_both_ends() -> None:
    grid = Grid.gauss(20)
    values = np.exp(grid.xi)
    np.testing.assert_allclose(grid.from_left @ values, np.exp(grid.xi) - 1.0, atol=1e-14)
    np.testing.assert_allclose(grid.to_right @ values, np.e - np.exp(grid.xi), atol=1e-14)
    assert grid.evaluate(values, 0.3) == pytest.approx(np.exp(0.3), rel=1e-14)
