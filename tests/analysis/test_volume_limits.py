"""What a pump that gives a volume holds: the swept area along a branch, and where it turns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import peel_opt as po

#: Where U + Phi has a value before the least pressure, S as an integration by other code has it, to 3e-3.
SWEPT = [(0.3, 3.0422, 3.885), (0.566, 3.2837, 7.180), (1.0, 2.728, 11.778)]

#: By how much U + Phi is more where a branch has its largest area again, and where it had its smallest.
GAINS = {0.5: (0.00200, 0.00143), 0.566: (0.00645, 0.00408)}  # as docs/motion.md has them

#: Windows of tip angles and pressures in which the area falls, by other code on a grid: 0.02 rad, 0.01 T0.
FALLS = {0.5: ((-2.81, 0.49), (-2.88, 0.53)), 0.566: ((-2.98, 0.48), (-3.10, 0.56))}


def branch(ratio: float, points: int = 140) -> po.Branch:
    return po.trace(po.Rod.from_ratio(ratio), points=points)


def energies_gained(walked: po.Branch, largest: po.VolumeLimit, smallest: po.VolumeLimit) -> list[float]:
    """U + Phi behind a jump from either limit to the same area on the branch, less that before it."""
    balance = po.energies(walked)
    stored, below, above = balance.bending + balance.separation, largest.index + 1, smallest.index + 1
    sides = [
        CubicHermiteSpline(
            balance.swept[rows], stored[rows], balance.pressure_ratio[rows]
        )  # dU + dPhi = p dS
        for rows in (slice(below), slice(above, None))
    ]
    before, after = ([float(side(limit.swept)) for limit in (largest, smallest)] for side in sides)
    return [after[0] - before[0], before[1] - after[1]]


@pytest.mark.parametrize(("ratio", "energy", "swept"), SWEPT)
@pytest.mark.slow
def test_the_swept_area_is_that_of_another_code(ratio: float, energy: float, swept: float) -> None:
    balance = po.energies(branch(ratio))
    stored, least = balance.bending + balance.separation, int(np.argmin(balance.pressure_ratio))
    # Near the least pressure the energy runs through its value once.
    near = slice(least - 8, least + 9)
    order = np.argsort(stored[near])
    assert np.interp(energy, stored[near][order], balance.swept[near][order]) == pytest.approx(
        swept, abs=3e-3
    )
    assert balance.swept_error < 1e-4


@pytest.mark.parametrize("ratio", FALLS)
def test_a_pump_meets_two_limit_points_near_one_half(ratio: float) -> None:
    walked, coarser = branch(ratio, 100), branch(ratio, 40)
    limits = po.volume_limits(walked)
    assert [limit.kind for limit in limits] == ["maximum", "minimum"]
    for limit, (angle, pressure) in zip(limits, FALLS[ratio], strict=True):
        assert limit.tip_angle == pytest.approx(angle, abs=0.025)
        assert limit.pressure == pytest.approx(pressure, abs=0.01)
    assert limits[0].swept > limits[1].swept
    # A small motion at fixed volume begins or ceases to grow where the area turns, by its eigenvalues.
    for limit in limits:
        either = {po.stability(walked, i).volume_index % 2 for i in (limit.index - 1, limit.index + 2)}
        assert either == {0, 1}
    # A coarser branch is as near as it says.
    for fine, coarse in zip(limits, (near := po.volume_limits(coarser)), strict=True):
        assert abs(fine.swept - coarse.swept) < coarse.error < 1e-3
        assert fine.tip_angle == pytest.approx(coarse.tip_angle, abs=1e-7)
    # A jump at a held volume does no work, and cannot lead to where the branch has that volume again.
    assert energies_gained(coarser, *near) == pytest.approx(GAINS[ratio], abs=5e-5)


def test_the_height_of_a_tip_says_the_pressure(branch_of: Callable[..., po.Branch]) -> None:
    height = 0.8  # of y0, where law (8) has Phi(y)/y = T0 (1 - y/(2 y0))
    held = branch_of(1.0, points=60).at(pressure=1.0 - height / 2.0)
    assert [eq.state for eq in held] == ["lower", "folded"]
    assert [eq.tip_height for eq in held] == pytest.approx([height, height], abs=1e-8)


@pytest.mark.parametrize("ratio", [0.3, 0.8])
@pytest.mark.slow
def test_other_rods_are_carried_through(ratio: float) -> None:
    assert po.volume_limits(branch(ratio, 60)) == ()


@pytest.mark.slow
def test_a_turn_that_a_grid_passes_over_is_found() -> None:
    walked = branch(0.7)
    first, second = po.volume_limits(walked)
    assert 2.0 * first.error < first.swept - second.swept < 1e-3
    places = (first.index - 1, first.index + 2, second.index + 2)
    indices = [po.stability(walked, i).volume_index for i in places]
    assert indices == [0, 1, 0]


@pytest.mark.slow
def test_limits_are_in_the_units_of_the_rod() -> None:
    unit = po.volume_limits(branch(0.5, 60))[0]
    rod = po.Rod(2e-5, 1.4e5, 2.0 * (2e-5 / 1.4e5) ** (1 / 3))
    limit = po.volume_limits(po.trace(rod, points=60))[0]
    assert limit.swept == pytest.approx(unit.swept * rod.eta**2, rel=1e-6)
    assert limit.pressure == pytest.approx(unit.pressure * 1.4e5, rel=1e-6)
    assert limit.length == pytest.approx(unit.length * rod.eta, rel=1e-6)
    assert limit.error == pytest.approx(unit.error * rod.eta**2, rel=0.5)
    with pytest.raises(po.InvalidInput):
        po.volume_limits(po.trace(beta0=4.0))
