"""Shapes of solutions: their geometry, and which of them cross themselves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import peel_opt as po
from peel_opt.residual.shape import Shape


@pytest.mark.parametrize(("pressure", "state"), [(0.6, None), (0.3, None), (0.2, "folded")])
def test_a_shape_is_the_curve_of_its_inclination(pressure: float, state: str | None) -> None:
    shape = po.length_given_pressure(po.Rod.from_ratio(1.0), pressure, state=state).shape
    assert (shape.xi[0], shape.xi[-1]) == (0.0, pytest.approx(1.0, abs=1e-15))
    assert np.all(np.diff(shape.xi) > 0.0)
    # (14) at the edge; at the tip no moment and no force.
    edge = [shape.x[-1], shape.y[-1], shape.theta[-1], shape.curvature[-1]]
    assert edge == pytest.approx([0.0, 0.0, 0.0, 0.0], abs=1e-10)
    assert [shape.curvature[0], shape.Nx[0], shape.Ny[0]] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    for values, slope in (
        (shape.x, np.cos(shape.theta)),
        (shape.y, np.sin(shape.theta)),
        (shape.theta, shape.curvature),
    ):
        spline = make_interp_spline(shape.xi, slope, 5).antiderivative()
        whole = spline(shape.xi) - spline(1.0)
        assert values - values[-1] == pytest.approx(whole, abs=1e-7)


def curve(theta: np.ndarray) -> Shape:
    """A shape of this inclination, without forces."""
    nothing, xi = np.zeros_like(theta), np.linspace(0.0, 1.0, len(theta))
    step = 1.0 / (len(theta) - 1)
    x, y = (np.concatenate([[0.0], np.cumsum(step * f(theta[:-1]))]) for f in (np.cos, np.sin))
    return Shape(xi, x, y, theta, nothing, nothing, nothing)


@pytest.mark.parametrize(
    ("theta", "crosses"),
    [
        (np.linspace(0.0, 3.0, 101), False),  # less than half a turn
        (np.linspace(0.0, 1.9 * np.pi, 101), False),  # a circle that does not close
        (np.linspace(0.0, 3.0 * np.pi, 101) ** 2 / 30.0, False),  # a spiral that opens, half a turn long
        (5.0 * np.linspace(0.0, 1.0, 101) ** 0.3, False),
        (np.linspace(0.0, 2.1 * np.pi, 101), True),  # a circle that goes on past its beginning
        (7.0 * np.sin(np.linspace(0.0, np.pi, 101)) ** 4 - 1.0, True),  # a loop
    ],
)
def test_what_crosses_itself(theta: np.ndarray, crosses: bool) -> None:
    assert curve(theta).crosses_itself() is crosses
