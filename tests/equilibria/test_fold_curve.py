"""Folds at fixed beta0 as a curve, with its turn and its cusp, and as an optimum.

Modules: `fold_curve`, `fold_optimum`, and of the continuation `folds`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import peel_opt as po


def test_fold_curve_has_its_turn_and_its_cusp(folds: po.FoldCurve) -> None:
    turn, cusp = folds.special_points
    assert (turn.kind, cusp.kind) == ("turn", "cusp")
    assert turn.beta0 == pytest.approx(37.546, abs=1e-3)
    assert cusp.beta0 == pytest.approx(36.115, abs=1e-3)
    assert folds.ratio[turn.index] == pytest.approx(0.40133, abs=1e-5)
    assert folds.ratio[cusp.index] == pytest.approx(0.32105, abs=1e-5)
    assert folds.beta0[[0, -1]] == pytest.approx([0.1, 100.0], abs=1e-9)
    assert folds.error.max() < 1e-10


@pytest.mark.parametrize(
    ("beta0", "count"), [(4.0, 1), (36.0, 1), (36.5, 3), (37.5, 3), (38.0, 1), (80.0, 1)]
)
def test_folds_at_one_beta0(folds: po.FoldCurve, beta0: float, count: int) -> None:
    assert len(folds.at(beta0)) == count


def test_fold_curve_meets_the_folds_of_branches_and_rods(
    folds: po.FoldCurve, branch_of: Callable[..., po.Branch]
) -> None:
    assert folds.at(2.0)[0] == pytest.approx(-0.067107064982, abs=1e-11)
    assert folds.at(4.0)[0] == pytest.approx(-0.26900108827, abs=1e-10)
    fold = branch_of(1.0, points=60).special("LP-length")[0]
    assert np.abs(folds.at(fold.beta0) - fold.lam).min() < 1e-8


def test_a_fold_curve_holds_both_its_ends() -> None:
    curve = po.fold_curve((1, 50))
    assert len(curve.at(1.0)) == 1
    assert len(curve.at(50.0)) >= 1
    with pytest.raises(po.InvalidInput, match="not on this curve"):
        curve.at(51.0)


@pytest.mark.parametrize("span", [(40.0, 50.0), (5.0, 1.0), (0.0, 10.0), (1.0, math.inf)])
def test_fold_curve_ranges_that_cannot_be_meant(span: tuple[float, float]) -> None:
    with pytest.raises(po.InvalidInput):
        po.fold_curve(span)


@pytest.mark.parametrize("beta0", [0.5, 4.0, 20.0, 35.0])
def test_a_fold_is_the_least_lambda(folds: po.FoldCurve, beta0: float) -> None:
    least = po.least_lambda(beta0)
    assert least.lam == pytest.approx(folds.at(beta0)[0], abs=1e-8)


def test_above_the_turn_there_is_no_least_lambda() -> None:
    with pytest.raises(po.NoEquilibrium, match="no fold"):
        po.least_lambda(45.0)
