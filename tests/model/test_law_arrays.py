"""Laws for arrays: tractions, and the heights at which the tip may stand."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.model.law_arrays import tip_heights, traction_of


@pytest.mark.parametrize(
    ("law", "P", "expected"),
    [
        ("linear", -1.0, [4.0]),
        ("linear", 1.3, [-0.6]),
        ("cohesive", 0.5, [1.0]),  # at the kink
        ("cohesive", 0.2, [2.5]),
        ("cohesive", 1.3, [-0.6]),
        ("cohesive", 1.0, []),
        ("cohesive", -0.1, []),
    ],
)
def test_heights_of_the_tip_at_a_pressure(law: str, P: float, expected: list[float]) -> None:
    assert tip_heights({"linear": LINEAR, "cohesive": COHESIVE}[law], P) == pytest.approx(expected, rel=1e-12)


def test_tractions_of_arrays_are_those_of_numbers() -> None:
    u = np.array([-0.1, 0.0, 0.2, 0.4, 0.7, 1.3, 5.0])
    for law in (po.trapezoidal(0.4), po.exponential()):
        assert traction_of(law, len(u))(u) == pytest.approx([law.traction(float(x)) for x in u], abs=1e-15)
