"""Energies along a branch: the balance, the path-dependent area, and held lengths.

Modules: `energies`, `flaws`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import peel_opt as po
from peel_opt.analysis.energies import energies
from peel_opt.analysis.flaws import held_length, holding_pressure, readhesion_pressure

from ..rods import FLAP


@pytest.fixture(scope="module")
def rod_1(branch_of: Callable[..., po.Branch]) -> po.Branch:
    return branch_of(1.0, points=60)


def test_work_of_the_pressure_is_bending_and_separation(rod_1: po.Branch) -> None:
    e = energies(rod_1)
    assert e.imbalance.max() < 1e-10
    assert e.bending[0] == e.separation[0] == e.swept[0] == 0.0
    assert np.all(e.bending[1:] > 0.0)
    assert np.all(e.separation >= 0.0)


def test_swept_area_converges_within_its_error(rod_1: po.Branch) -> None:
    coarse, fine = energies(rod_1), energies(po.trace(po.Rod.from_ratio(1.0), points=120))
    assert abs(coarse.swept[-1] - fine.swept[-1]) <= coarse.swept_error
    assert fine.swept_error < coarse.swept_error


def test_gamma_falls_with_the_area_times_the_pressure(rod_1: po.Branch) -> None:
    e = energies(po.trace(po.Rod.from_ratio(1.0), points=240)[:100])
    middle = 0.5 * (e.swept[1:] + e.swept[:-1])
    np.testing.assert_allclose(np.diff(e.gamma), -middle * np.diff(e.pressure_ratio), rtol=2e-2, atol=1e-7)


def test_equal_area_pressure_is_not_the_paper_s_maxwell_pressure(rod_1: po.Branch) -> None:
    found = energies(rod_1).equal_area_pressure()
    assert found == pytest.approx(0.20343, abs=2e-5)
    assert abs(found - (1 - 2 * 0.696 / 3)) > 0.3  # (40): about 0.54


@pytest.mark.parametrize("ratio", [0.1, *(pytest.param(r, marks=pytest.mark.slow) for r in (1.0, 20.0))])
def test_the_equal_area_pressure_is_known_to_its_error(ratio: float) -> None:
    coarse, fine = (energies(po.trace(po.Rod.from_ratio(ratio), points=n)) for n in (20, 300))
    gap = abs(coarse.equal_area_pressure() - fine.equal_area_pressure())
    assert gap <= coarse.equal_area_error() < 1e-4
    assert fine.equal_area_error() < coarse.equal_area_error()


def test_energies_need_the_branch_of_a_rod() -> None:
    with pytest.raises(po.InvalidInput, match="branch of one rod"):
        energies(po.trace(beta0=4, lam=(-1, 1), points=10))


def test_equal_areas_need_the_folded_part(rod_1: po.Branch) -> None:
    with pytest.raises(po.NotConverged, match="was not met"):  # it is on the part that was cut off
        energies(rod_1[:12]).equal_area_pressure()


@pytest.mark.parametrize("ratio", [0.06, 0.566, 1.0, 30.0, 2500.0])
def test_readhesion_pressure_is_the_least_that_holds(ratio: float) -> None:
    rod = po.Rod.from_ratio(ratio)
    least = readhesion_pressure(rod)
    assert least.error < 1e-9
    with pytest.raises(po.NoEquilibrium):
        held_length(rod, 0.999 * least.pressure)
    assert held_length(rod, least.pressure + 1e-3 * (1 - least.pressure)).state in ("middle", "lower")


def test_the_held_length_of_a_holding_pressure_is_the_length() -> None:
    rod = FLAP
    for length in (1.74e-3, 1.7735e-3, 1.9e-3, 2.3e-3):
        held = holding_pressure(rod, length)
        assert held_length(rod, held.pressure).length == pytest.approx(length, rel=1e-9)


def test_a_holding_pressure_is_the_lowest_of_the_unfolded_states() -> None:
    """120 kPa and 64.7 kPa share a length: a middle state and a lower one."""
    rod = FLAP
    middle = held_length(rod, 120e3)
    assert middle.state == "middle"
    lower = holding_pressure(rod, middle.length)
    assert lower.state == "lower"
    assert lower.pressure == pytest.approx(64.7e3, rel=1e-3)
    states = po.equilibria(rod, length=middle.length)
    pressures = [eq.pressure for eq in states if eq.state in ("middle", "lower")]
    assert min(pressures) == pytest.approx(lower.pressure, rel=1e-8)
    assert max(pressures) == pytest.approx(120e3, rel=1e-6)
    for pressure in (30e3, 50e3, 80e3):
        eq = held_length(rod, pressure)
        assert holding_pressure(rod, eq.length).pressure == pytest.approx(pressure, rel=1e-6)


def test_lengths_that_no_unfolded_state_has() -> None:
    rod = FLAP
    for length in (1e-4, 1.0):
        with pytest.raises(po.NoEquilibrium):
            holding_pressure(rod, length)
    for length in (math.nan, -1.0):
        with pytest.raises(po.InvalidInput):
            holding_pressure(rod, length)


def test_results_of_many_arrays_print_in_a_few_lines(rod_1: po.Branch) -> None:
    found = po.energies(rod_1)
    lines = repr(found).splitlines()
    assert lines[0] == "Energies"
    assert f"├─ A: {len(found.A)} values, 0 to {found.A.max():.6g}" in lines
    assert len(lines) == 8
    for other in (po.hysteresis(beta0=4.0, points=5).up, po.length_given_pressure(rod_1.rod, 0.8).shape):
        assert max(map(len, repr(other).splitlines())) < 100
    assert "to -0" not in repr(po.trace(beta0=4.0, lam=(-1.0, 1.0), points=8))


def test_a_kind_of_special_point_that_does_not_exist_is_no_empty_answer(rod_1: po.Branch) -> None:
    assert rod_1.special("LP-lambda") == ()
    with pytest.raises(po.InvalidInput, match=r"no kind of special point 'LP'\. Kinds are BP, LP-lambda,"):
        rod_1.special("LP")


@pytest.mark.parametrize("share", [0.4, 0.7])
def test_what_a_pressure_holds_open_is_no_critical_flaw(share: float) -> None:
    """It contains the cohesive zone: an edge without glue snaps when it is shorter by factors."""
    rod = po.Rod.from_ratio(1.0)
    assert po.critical_flaw(rod, share).flaw < 0.5 * held_length(rod, share).length


def test_limits_under_another_law() -> None:
    """The least pressure under exp(-u): what is held beside it, and its derivative by differences."""
    rod, law = po.Rod.from_ratio(1.0), po.exponential()
    least = readhesion_pressure(rod, law=law).pressure
    assert held_length(rod, 1.001 * least, law=law).state in ("middle", "lower")
    with pytest.raises(po.NoEquilibrium):
        held_length(rod, 0.999 * least, law=law)
    length = held_length(rod, 0.6, law=law).length
    assert held_length(rod, holding_pressure(rod, length, law=law).pressure, law=law).length == pytest.approx(
        length, rel=1e-8
    )
    found = po.sensitivities(rod, "readhesion_pressure", law=law)
    assert found.value == pytest.approx(least, rel=1e-10)
    around = [readhesion_pressure(po.Rod.from_ratio(r), law=law).pressure for r in (0.999, 1.001)]
    assert found.dimensionless["ratio"] == pytest.approx((around[1] - around[0]) / 0.002, rel=1e-5)


def test_limits_that_a_law_does_not_have() -> None:
    rod = po.Rod.from_ratio(1.0)
    with pytest.raises(po.InvalidInput, match="belongs to"):
        po.sensitivities(rod, "maxwell_length", law=po.exponential())
    with pytest.raises(po.InvalidInput, match="its own law"):
        po.sensitivities(held_length(rod, 0.6), law="linear")
