"""The gap between a rod and its wall."""

from __future__ import annotations

import math

import numpy as np
import pytest

import peel_opt as po


def test_the_gap_to_a_circle_is_exact_as_its_curvature_vanishes() -> None:
    at = po.Place(0.0, 3.0, 0.0, -2.0, 0.3, 0.0)
    for kw in (1e-12, -1e-12, 0.2, -0.2):
        gap, nx, ny = po.Circle(kw).gap(at, {"curvature": kw})
        centre = np.array([0.0, 1.0 / kw])
        exact = (1.0 - abs(kw) * math.dist((-2.0, 0.3), centre)) / kw
        assert gap == pytest.approx(exact, abs=1e-3 if abs(kw) < 1e-6 else 1e-13)
        assert math.hypot(nx, ny) == pytest.approx(1.0)
