"""The meshes are as fine as their reasons say."""

from __future__ import annotations

import math

import pytest

from peel_opt.continuation.primary import Family, PrimaryBranch
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.residual.closures import Closure
from peel_opt.residual.meshes import AT_FOLDS, GROUPS, PATH
from peel_opt.residual.spectral import Spectral


def least_pressure(mesh: Spectral, ratio: float) -> float:
    fold = PrimaryBranch(Family(COHESIVE, mesh, Closure("ratio", ratio))).continue_to("LP-pressure")
    assert fold is not None
    return float(fold.point.scalars.pressure_ratio)


@pytest.mark.parametrize("ratio", [0.1, 1.0])
def test_walks_and_limits_resolve_the_least_pressure(ratio: float) -> None:
    finest = least_pressure(AT_FOLDS[-1], ratio)
    assert least_pressure(PATH, ratio) == pytest.approx(finest, abs=2e-11)
    assert least_pressure(AT_FOLDS[0], ratio) == pytest.approx(finest, abs=1e-12)


@pytest.mark.parametrize("beta0", [1.0, 30.0])
def test_curves_at_fixed_beta0_are_resolved_to_rounding(beta0: float) -> None:
    folds = []
    for mesh in (GROUPS, Spectral(nodes=36)):
        fold = PrimaryBranch(Family(LINEAR, mesh, Closure("length", math.cbrt(beta0)))).continue_to(
            "LP-lambda"
        )
        assert fold is not None
        folds.append(fold.point.scalars.lam)
    assert folds[0] == pytest.approx(folds[1], abs=1e-11)
