"""The algebra of the groups: of floats, arrays and CasADi symbols alike."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from peel_opt.model.equations import Scalars, symbolic
from peel_opt.model.groups import Groups

NAMES = ("beta0", "beta1", "alpha1", "alpha", "pressure_ratio", "length_ratio", "ratio")


@dataclass(frozen=True)
class Plain(Groups[float]):
    beta0: float
    lam: float
    alpha1: float


def test_numbers_by_hand() -> None:
    """beta0 = 8, alpha1 = -2, beta1 = 2 pi^4: P = 3/4, sbar/eta = 2, eta/y0 = pi^4/8."""
    for groups in (Plain(8.0, math.pi**4, -2.0), Scalars(0.5, -4.0, 2.0, math.pi**4)):
        found = [getattr(groups, name) for name in NAMES]
        assert found == pytest.approx([8.0, 2 * math.pi**4, -2.0, 6.0, 0.75, 2.0, math.pi**4 / 8], rel=1e-15)


def test_arrays_and_symbols_are_the_same_algebra() -> None:
    rows = np.array([[0.5, -4.0, 2.0, 3.0], [1.5, 2.0, 0.3, -50.0]])
    column, symbols = symbolic()
    for name in NAMES:
        one_by_one = [getattr(Scalars(*row.tolist()), name) for row in rows]
        np.testing.assert_allclose(getattr(Scalars(*rows.T), name), one_by_one, rtol=1e-15)
        function = ca.Function("f", [column], [getattr(symbols, name)])
        np.testing.assert_allclose([float(function(row)) for row in rows], one_by_one, rtol=1e-14)


def test_without_a_bond_there_is_no_pressure_ratio() -> None:
    for groups in (Plain(0.0, 1.0, -2.0), Scalars(0.5, -4.0, 0.0, 1.0)):
        assert math.isnan(groups.pressure_ratio)
        assert groups.ratio == math.inf
    assert math.isnan(Plain(0.0, 1.0, -2.0).length_ratio)
    several = Scalars(*np.array([[0.5, -4.0, 0.0, 1.0], [0.5, -4.0, 2.0, 3.0]]).T)
    np.testing.assert_array_equal(several.pressure_ratio, [math.nan, 0.75])
    assert several.ratio[0] == math.inf
