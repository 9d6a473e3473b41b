"""Quantities of pint are taken wherever a number or an array is, converted or refused, never stripped.

Module: `checks`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pint
import pytest

import peel_opt as po
from peel_opt.base.arrays import floats
from peel_opt.base.units import in_si

from ..rods import FLAP

U = pint.UnitRegistry()


def test_a_rod_is_made_of_quantities() -> None:
    rod = po.Rod(23.0 * U.uN * U.m, 0.14 * U.MPa, 730.0 * U.um)
    assert rod.bending_stiffness == pytest.approx(2.3e-5, rel=1e-15)
    assert rod.adhesion_strength == pytest.approx(140e3, rel=1e-15)
    assert rod.adhesion_range == pytest.approx(0.73e-3, rel=1e-15)
    assert all(type(value) is float for value in (rod.bending_stiffness, rod.adhesion_strength))


@pytest.mark.parametrize(
    ("with_unit", "plain"),
    [
        (lambda: po.length_given_pressure(FLAP, 60.0 * U.kPa), lambda: po.length_given_pressure(FLAP, 60e3)),
        (
            lambda: po.pressure_given_length(FLAP, 1.9 * U.mm, near=45.0 * U.kPa),
            lambda: po.pressure_given_length(FLAP, 1.9e-3, near=45e3),
        ),
        (lambda: po.holding_pressure(FLAP, 1.9 * U.mm), lambda: po.holding_pressure(FLAP, 1.9e-3)),
        (
            lambda: po.equilibria(FLAP, pressure=60.0 * U.kPa)[0],
            lambda: po.equilibria(FLAP, pressure=60e3)[0],
        ),
    ],
)
def test_a_question_is_asked_in_quantities(
    with_unit: Callable[[], po.Equilibrium], plain: Callable[[], po.Equilibrium]
) -> None:
    found, expected = with_unit(), plain()
    assert (found.pressure, found.length) == pytest.approx((expected.pressure, expected.length), rel=1e-12)


def test_ratios_are_numbers_however_they_are_written() -> None:
    expected = po.maxwell_length(np.array([1.0, 2.0]), "paper")
    for ratio in ([1000.0, 2000.0] * U.um / U.mm, [100.0, 200.0] * U.percent, [1.0 * U.mm / U.mm, 2.0]):
        assert po.maxwell_length(ratio, "paper") == pytest.approx(expected, rel=1e-14)
    lam, alpha1 = po.NormalForm.paper().fold([4000.0] * U.um / U.mm)
    assert (lam[0], alpha1[0]) == pytest.approx(po.NormalForm.paper().fold(4.0), rel=1e-14)


@pytest.mark.parametrize(
    "call",
    [
        lambda: po.Rod(23.0 * U.uN * U.m, 0.14 * U.mm, 0.73 * U.mm),
        lambda: po.length_given_pressure(FLAP, 60.0 * U.mm),
        lambda: po.length_given_pressure(FLAP, [60.0, 70.0] * U.kPa),
        lambda: po.length_given_pressure(po.Rod.from_ratio(1.0), 0.8 * U.Pa),
        lambda: po.Rod.from_ratio(1.0 * U.mm),
        lambda: po.maxwell_length([1.0] * U.m, "paper"),
        lambda: po.NormalForm.paper().fold([4.0] * U.mm),
        lambda: po.NormalForm.paper().lam([4.0] * U.mm, 4.0),
        lambda: po.NormalForm.paper().potential([4.0] * U.mm, 4.0, 0.1),
        lambda: po.lyapunov_schmidt(4.0).g([0.1] * U.mm, 0.1),
        lambda: po.fold_curve((1.0 * U.m, 3.0)),
        lambda: po.trace(FLAP, at={"length_ratio": [3.0 * U.m]}),
        lambda: po.uncertainty(
            FLAP, {"adhesion_strength": (130 * U.mm, 150 * U.mm)}, pressure=6e4, samples=2
        ),
    ],
)
def test_another_unit_is_an_error_of_ours(call: Callable[[], Any]) -> None:
    with pytest.raises(po.InvalidInput):
        call()


def test_units_of_other_libraries_are_not_stripped_either() -> None:
    class Theirs(np.ndarray):
        unit = "mm"

    lengths = np.array([1.9, 2.0]).view(Theirs)
    with pytest.raises(po.InvalidInput, match=r"cannot be taken in 'mm'.*only those of pint"):
        po.sweep({"length": lengths}, rod=FLAP)
    with pytest.raises(po.InvalidInput, match="only those of pint"):
        floats("ratio", lengths)
    Theirs.unit = "m"  # as in `Sweep.to_xarray`
    assert in_si("length", lengths, "m") is lengths
