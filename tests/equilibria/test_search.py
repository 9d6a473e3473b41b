"""Every state at given groups, or of a rod at a length or a pressure."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import peel_opt as po

from .. import oracle


def test_six_states_at_the_groups_of_fig_10a() -> None:
    found = po.equilibria(beta0=53.16, beta1=113.1)
    alphas = [eq.alpha for eq in found]
    assert len(found) >= 6
    assert all(eq.certified for eq in found)
    assert alphas == sorted(alphas)
    assert min(abs(a - 14.864604605976) for a in alphas) < 1e-8
    assert [eq.state for eq in found].count("lower") == 1
    assert min(abs(a - b) for a, b in pairwise(alphas)) > 1e-3


@pytest.mark.slow
def test_more_than_a_dozen_states_at_the_groups_of_fig_10b() -> None:
    found = po.equilibria(beta0=1001.6, beta1=5670.6)
    assert len(found) > 12
    assert min(abs(eq.alpha - 298.432164675117) for eq in found) < 1e-6
    # Of the identity p y_tip = Phi(y_tip) both factors: tips that hang free and tips held to the plate.
    held = [eq for eq in found if "tip on plate" in eq.flags]
    for alpha1 in (-1428.167359, -781.200207, 722.165499, 864.647385):
        assert min(abs(eq.alpha1 - alpha1) for eq in held) < 1e-5
    assert all(eq.certified for eq in found)


@pytest.mark.slow
def test_all_states_of_a_rod_at_a_length() -> None:
    found = po.equilibria(po.Rod.from_ratio(1.0), length=5.5)
    labels = [eq.state for eq in found]
    assert labels[:2] == ["folded", "folded"]
    assert [eq.pressure_ratio for eq in found[:2]] == pytest.approx([0.122886, 0.174898], abs=1e-6)


def test_all_states_of_a_rod_at_a_pressure() -> None:
    found = po.equilibria(po.Rod.from_ratio(0.05), pressure=0.97)
    physical = [eq for eq in found if eq.valid]
    assert sorted(eq.state for eq in physical) == ["folded", "middle"]


def test_order_and_number_of_states_are_stable() -> None:
    first, second = (po.equilibria(beta0=20.0, lam=2.0) for _ in range(2))
    assert [eq.alpha1 for eq in first] == [eq.alpha1 for eq in second]


@pytest.mark.parametrize("seed", range(4))
def test_states_at_random_groups_are_those_of_the_independent_solver(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    beta0, lam = float(rng.uniform(1.0, 60.0)), float(rng.uniform(0.5, 60.0))
    found = po.equilibria(beta0=beta0, lam=lam)
    assert any(eq.state in ("lower", "middle") for eq in found)
    for eq in found:
        if "tip on plate" in eq.flags:
            continue  # the oracle ties the tip's height to the pressure
        again = oracle.given_groups(beta0, lam, guess=(eq.alpha1, eq.tip_angle))
        assert again.alpha1 == pytest.approx(eq.alpha1, abs=1e-6 * (1.0 + abs(eq.alpha1)))


def test_a_state_of_the_branch_that_is_not_certified_is_listed() -> None:
    found = po.equilibria(po.Rod.from_ratio(24.487), pressure=0.0037115, tol=1e-12)
    assert [eq.state for eq in found if eq.state in ("lower", "folded")]
    assert not any(eq.certified for eq in found if eq.error > 1e-12)


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"beta0": 4.0},
        {"beta0": 0.0, "lam": 1.0},
        {"beta0": 4.0, "lam": 1.0, "beta1": 2.0},
        {"beta0": 4.0, "lam": 1.0, "pressure": 0.5},
        {"beta0": 4.0, "pressure": 0.5},
        {"pressure": 0.5},
        {"rod": po.Rod.from_ratio(1.0)},
        {"rod": po.Rod.from_ratio(1.0), "lam": 1.0},
        {"rod": po.Rod.from_ratio(1.0), "pressure": 0.5, "length": 3.0},
        {"rod": po.Rod.from_ratio(1.0), "beta0": 4.0, "lam": 1.0},
        {"rod": po.Rod.from_ratio(1.0), "pressure": 0.5, "law": "linaer"},
        {"rod": 1.0, "pressure": 0.5},
    ],
)
def test_searches_that_cannot_be_meant(arguments: dict) -> None:
    with pytest.raises(po.InvalidInput):
        po.equilibria(**arguments)
