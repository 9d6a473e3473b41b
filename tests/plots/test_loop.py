"""Pictures of loops: what a reader sees of the numbers of the result."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes

import peel_opt as po

from ..rods import FLAP


def line(ax: Axes, look: str) -> np.ndarray:
    (found,) = [each for each in ax.lines if each.get_gid() == look]
    return np.array(found.get_data())


@pytest.mark.parametrize("convention", ["delay", "maxwell"])
def test_a_loop_in_lambda_shows_its_sweeps_area_and_convention(convention: str) -> None:
    loop = po.hysteresis(beta0=4.0, convention=convention, points=9)
    ax = loop.plot()
    np.testing.assert_array_equal(line(ax, "up"), [loop.up.lam, loop.up.alpha1])
    np.testing.assert_array_equal(line(ax, "down"), [loop.down.lam, loop.down.alpha1])
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        r"$\lambda = \beta_1 - \pi^4$",
        r"extra pressure $\alpha_1$",
    )
    title = ax.get_title(loc="left")
    assert ("Maxwell" if convention == "maxwell" else "delay") in title
    assert title.endswith("area 0" if convention == "maxwell" else "area 0.62488")


def test_the_loop_of_a_rod_is_in_its_units() -> None:
    loop = po.hysteresis(FLAP, points=9)
    ax = loop.plot()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("pressure $p$ [kPa]", r"detached length $\bar s$ [mm]")
    np.testing.assert_allclose(line(ax, "down"), [loop.down.pressure / 1e3, loop.down.length * 1e3])
    np.testing.assert_allclose(line(ax, "between"), [loop.between.pressure / 1e3, loop.between.length * 1e3])
    heads = [each for each in ax.lines if str(each.get_gid()).startswith("mark:")]
    assert [each.get_xdata()[0] for each in heads] == pytest.approx([140.0, loop.minimum_pressure / 1e3])
    (low, high), (left, right) = ax.get_ylim(), ax.get_xlim()
    assert low < 0.0 < loop.down.length.max() * 1e3 < high
    assert left < loop.up.pressure.min() / 1e3 < 140.0 < right
