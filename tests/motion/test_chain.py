"""The balances of the chain, its bond with a memory (`memory`), and its steps (`moments`)."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.bond import COHESIVE
from peel_opt.motion.chain import ABOVE, BELOW, UNKNOWNS, Chain, Stage
from peel_opt.motion.memory import Memory


def dense(band: np.ndarray) -> np.ndarray:
    size = band.shape[1]
    matrix = np.zeros((size, size))
    for column in range(size):
        for row in range(max(0, column - ABOVE), min(size, column + BELOW + 1)):
            matrix[row, column] = band[BELOW + ABOVE + row - column, column]
    return matrix


@pytest.mark.parametrize("bond", ["reversible", "damage", "no_rebond"])
@pytest.mark.parametrize("tip_at", [None, 0.3])
def test_the_derivatives_are_those_of_the_balances(bond, tip_at):
    random = np.random.default_rng(1)
    n = 8
    chain = Chain(0.1, Memory(COHESIVE, 1.0, bond), 0.7, 0.5, tip_at)
    u = 0.5 * random.normal(size=(n, UNKNOWNS))
    stage = Stage(0.3, random.normal(size=(2, n)), random.normal(size=(2, n)), 0.7)
    open_to = np.abs(random.normal(size=n))
    exact = dense(chain.derivatives(u, stage, open_to))
    eps = 1e-6
    for column in range(u.size):
        shift = np.zeros(u.size)
        shift[column] = eps
        shift = shift.reshape(u.shape)
        ahead, behind = (chain.residual(u + side * shift, stage, open_to).ravel() for side in (1, -1))
        assert exact[:, column] == pytest.approx((ahead - behind) / (2 * eps), abs=1e-7)


@pytest.mark.parametrize("law", [COHESIVE, po.trapezoidal(0.4), po.exponential()])
@pytest.mark.parametrize("bond", ["reversible", "damage", "no_rebond"])
def test_what_is_put_into_a_bond_is_stored_or_lost(law, bond):
    # Open to 1.3 y0, down to 0.2 y0 and up again to 2 y0: work against the traction, by quadrature.
    memory = Memory(law, 0.8, bond)
    path = np.concatenate([np.linspace(a, b, 4001) for a, b in ((0.0, 1.3), (1.3, 0.2), (0.2, 2.0))]) / 0.8
    open_to = np.maximum.accumulate(path)
    traction = memory.holding(path, open_to)[0]
    work = float(np.sum(0.5 * (traction[1:] + traction[:-1]) * np.diff(path)))
    kept = memory.stored(path[-1:], open_to[-1:]) - memory.stored(np.zeros(1), np.zeros(1))
    assert work == pytest.approx(float(kept[0] + memory.lost(open_to[-1:])[0]), abs=1e-3)


def test_a_bond_that_does_not_heal_gives_back_the_triangle_only():
    # By hand: D(m) = T0 min(m, y0)/2, and all of G where it has let go.
    memory = Memory(COHESIVE, 1.0, "damage")
    open_to = np.array([0.0, 0.25, 0.5, 1.0, 3.0])
    assert memory.lost(open_to) == pytest.approx([0.0, 0.125, 0.25, 0.5, 0.5])
    assert memory.holding(np.full(5, 0.2), open_to)[0] == pytest.approx([0.8, 0.6, 0.2, 0.0, 0.0])
    assert Memory(COHESIVE, 1.0, "no_rebond").holding(np.full(5, 0.2), open_to)[0] == pytest.approx(
        [0.8, 0.8, 0.8, 0.0, 0.0]
    )
