"""Far below T0 the pressure is held with all its digits, where the bond has let the tip go.

Module: `newton`.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.equations import LowPressure, Scalars
from peel_opt.plots.figures.minimum_pressure import least_pressure
from peel_opt.residual.newton import sharper
from peel_opt.residual.spectral import SpectralDiscretisation

#: Relative distances of a pressure from the least one.
ABOVE = (1e-8, 1e-7, 1e-5, 1e-3, 0.1)


@pytest.mark.parametrize("ratio", [25.0, 80.0, 300.0, 1000.0, 2500.0])
def test_slender_rods_are_answered_beside_their_least_pressure(ratio: float) -> None:
    rod = po.Rod.from_ratio(ratio)
    least = po.readhesion_pressure(rod).pressure
    answers = [po.length_given_pressure(rod, least * (1.0 + above)) for above in ABOVE]
    assert all(eq.valid and eq.error <= 1e-8 for eq in answers)
    for above, eq in zip(ABOVE, answers, strict=True):
        finer = po.length_given_pressure(rod, least * (1.0 + above), method=po.Spectral(54))
        assert abs(eq.length_ratio - finer.length_ratio) <= eq.error + finer.error
        tip = eq.tip_height * ratio  # in y0: p y_tip = T0 y0/2
        assert 2.0 * eq.pressure_ratio * tip == pytest.approx(1.0, rel=1e-10)
    longer = [eq.length_ratio for eq in answers]
    assert all(b < a for a, b in pairwise(longer))
    # sbar leaves its value at the least pressure with a square root.
    gaps = np.array(longer[:3]) - longer[0]
    assert gaps[2] / gaps[1] == pytest.approx((1e-5**0.5 - 1e-4) / (1e-7**0.5 - 1e-4), rel=2e-2)


@pytest.mark.parametrize("ratio", [1100.0, 2000.0, 2990.0])
def test_none_is_refused_a_billionth_above_it(ratio: float) -> None:
    rod = po.Rod.from_ratio(ratio)
    P = least_pressure(ratio) * (1.0 + 1e-9)
    answers = [po.length_given_pressure(rod, P)]
    answers += [po.length_given_pressure(rod, P, method=po.Spectral(nodes), tol=1e-7) for nodes in (36, 54)]
    assert answers[0].error <= 1e-8
    for one, other in pairwise(answers):  # what lies between them is rounding
        assert abs(one.length_ratio - other.length_ratio) <= one.error + other.error


@pytest.mark.parametrize("above", [1e-6, 1e-5, 2e-5])
def test_the_arc_in_closed_form_is_the_one_at_nodes_to_rounding(above: float) -> None:
    rod = po.Rod.from_ratio(80.0)
    P = po.readhesion_pressure(rod).pressure * (1.0 + above)
    closed, noded = (
        po.length_given_pressure(rod, P, method=po.Spectral(24, free_arc=free)) for free in (True, False)
    )
    # A hundred units lost on the curve were 1e-11 to 4e-11 here.
    assert abs(closed.length_ratio - noded.length_ratio) <= min(closed.error, noded.error)


def test_both_forms_are_the_same_equations() -> None:
    solved = po.length_given_pressure(po.Rod.from_ratio(3.0), 0.1, method=po.Spectral(16)).source
    usual = solved.problem
    assert isinstance(usual, SpectralDiscretisation)
    other = sharper(usual)
    assert other is not None
    moved = solved.x * (1.0 + 1e-3 * np.cos(np.arange(len(solved.x))))
    same = usual.in_form(moved, other)
    np.testing.assert_allclose(other.residual(same), usual.residual(moved), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.in_form(same, usual), moved, rtol=1e-13)
    np.testing.assert_allclose(other.prolonged(same, other), same, rtol=1e-12)


def test_the_scalars_know_a_pressure_that_is_nearly_nothing() -> None:
    s = LowPressure.of_unknowns(2.0, 1e-3, 100.0, 1.0)
    assert s.pressure_ratio == 2e-3 / 1e6
    assert Scalars(*s.values).pressure_ratio == pytest.approx(s.pressure_ratio, abs=1e-15)
    assert LowPressure.as_unknowns(s) == (2.0, 1e-3, 100.0, 1.0)


def test_nothing_is_gained_while_the_bond_holds_the_tip() -> None:
    rod = po.Rod.from_ratio(1.0)
    assert sharper(po.length_given_pressure(rod, 0.8, method="spectral").source.problem) is None
    assert sharper(po.length_given_pressure(rod, 0.2, method="collocation").source.problem) is None
