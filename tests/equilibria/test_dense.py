"""`eq.sol`: the shape at any place, its stretches, and its error."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

import peel_opt as po

FIELDS = ("x", "y", "theta", "curvature", "Nx", "Ny")
R1 = po.Rod.from_ratio(1.0)


@pytest.fixture(scope="module")
def folded() -> po.Equilibrium:
    """Return a state with bond, free arc, and bond again at the tip."""
    return po.length_given_pressure(R1, 0.9, state="folded")


def scaled_difference(a: po.Equilibrium, b: po.Equilibrium) -> float:
    """Return the largest difference of two shapes at the same places, scaled as the paper does."""
    s = np.linspace(0.0, 1.0, 237) * min(a.length, b.length)
    one, two = a.sol(s), b.sol(s)
    assert a.rod is not None
    force, length = a.rod.force(1.0, a.length), a.length
    sizes = {"x": length, "y": length, "theta": 1.0, "curvature": 1.0 / length, "Nx": force, "Ny": force}
    return max(float(np.abs(getattr(one, n) - getattr(two, n)).max()) / sizes[n] for n in FIELDS)


def test_it_passes_through_the_samples_of_the_shape(folded: po.Equilibrium) -> None:
    there = folded.sol(folded.s)
    for name in FIELDS:
        assert np.allclose(getattr(there, name), getattr(folded, name), rtol=0, atol=1e-12 * 60), name
    assert folded.sol(0.0).theta == pytest.approx(folded.tip_angle, abs=1e-13)
    assert folded.sol([[0.1, 0.2], [0.3, 0.4]]).y.shape == (2, 2)
    assert "7" not in repr(folded.sol(0.5)).split("\n")[0]


def test_its_error_holds(folded: po.Equilibrium) -> None:
    exact = po.length_given_pressure(R1, 0.9, state="folded", method=po.Spectral(24))
    assert exact.sol.error < 1e-9
    off = scaled_difference(folded, exact)
    assert off <= folded.sol.error + exact.sol.error
    assert folded.sol.error < 5.0 * off


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ratio", "pressure", "state"),
    [(0.05, 0.97, None), (1.0, 0.2, None), (1.0, 0.9, "folded"), (100.0, 0.01, None), (2000.0, 0.7, None)],
)
def test_its_error_holds_on_every_mesh(ratio: float, pressure: float, state: str | None) -> None:
    rod = po.Rod.from_ratio(ratio)
    exact = po.length_given_pressure(rod, pressure, state=state, method=po.Spectral(60))
    for method in (po.Spectral(12), po.Spectral(16), po.Collocation(6), po.Shooting(6, "rk4"), "shooting"):
        eq = po.length_given_pressure(rod, pressure, state=state, method=method, tol=1.0)
        assert scaled_difference(eq, exact) <= eq.sol.error + exact.sol.error, method


def test_the_kinks_are_where_the_bond_lets_go_and_takes_hold_again(folded: po.Equilibrium) -> None:
    assert folded.sol.free is not None
    ((begin, end),) = folded.sol.free
    assert np.allclose(folded.sol([begin, end]).y, 1.0, atol=1e-8)  # y0 = 1
    assert np.allclose(folded.sol.breaks, [0.0, begin, end, folded.length])
    assert folded.sol(0.5 * (begin + end)).y > 1.0
    assert po.length_given_pressure(R1, 0.8).sol.free == ()


def test_a_file_keeps_the_shape_and_says_what_it_does_not_know(
    folded: po.Equilibrium, tmp_path: Path
) -> None:
    again = po.Equilibrium.load(folded.save(tmp_path / "eq.npz"))
    s = np.linspace(0.0, folded.length, 50)
    for other in (again, pickle.loads(pickle.dumps(folded))):
        assert np.array_equal(other.sol(s).theta, folded.sol(s).theta)
        assert np.allclose(other.sol.free, folded.sol.free)
        assert math.isnan(other.sol.error)


def test_units_are_the_rods_and_a_place_off_the_rod_is_refused() -> None:
    rod = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
    eq = po.length_given_pressure(rod, "60 kPa")
    assert eq.sol("0.4 mm").y == eq.sol(0.4e-3).y
    assert eq.sol(["0.4 mm", "0.1 cm"]).s.tolist() == [0.4e-3, 1e-3]
    with pytest.raises(po.OutOfRange, match="detached part") as beyond:
        eq.sol("3 mm")
    assert beyond.value.nearest == eq.length
    for wrong in ("3 kPa", float("nan"), "far", [0.0, [1.0]]):
        with pytest.raises(po.InvalidInput):
            eq.sol(wrong)
    with pytest.raises(po.InvalidInput, match="no shape"):
        _ = po.length_given_pressure(rod, 2e4, throw=False).sol
