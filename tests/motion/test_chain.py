"""The balances of the chain, its bond with a memory (`memory`), and its steps (`moments`)."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.bond import COHESIVE
from peel_opt.motion.acting import PRESSURE_ALONE, loads_on
from peel_opt.motion.chain import UNKNOWNS, Chain, Stage, X
from peel_opt.motion.memory import Memory


def dense(band: np.ndarray, beside: int) -> np.ndarray:
    size = band.shape[1]
    matrix = np.zeros((size, size))
    for column in range(size):
        for row in range(max(0, column - beside), min(size, column + beside + 1)):
            matrix[row, column] = band[2 * beside + row - column, column]
    return matrix


#: An edge of two links and a half, a fluid that ends in the sixth, and a pressure that feels all there is.
LOADED = loads_on(
    po.Scene(
        po.Rod.from_ratio(1.0),
        loads=[
            po.Pressure(lambda at: ca.exp(-at.s) + at.x * at.y + at.xi + at.theta**2, dead=0.3, until=0.53),
            po.Weight(0.2, 0.1),
            po.SkinFriction(0.1),
        ],
        unbonded=0.25,
        tip=po.TipLoad(force=0.1, angle=1.0, moment=-0.2),
        natural_curvature=0.1,
    )
)


#: A wall that is not flat.
CURVED = loads_on(
    po.Scene(po.Rod.from_ratio(1.0), wall=po.Circle(-0.4), unbonded=0.25, natural_curvature=0.1)
)


@pytest.mark.parametrize("bond", ["reversible", "damage", "no_rebond"])
@pytest.mark.parametrize("tip_at", [None, 0.3])
@pytest.mark.parametrize("loads", [PRESSURE_ALONE, LOADED, CURVED])
def test_the_derivatives_are_those_of_the_balances(bond, tip_at, loads):
    random = np.random.default_rng(1)
    n = 8
    chain = Chain(0.1, Memory(COHESIVE, 1.0, bond), 0.7, 0.5, tip_at, loads)
    u = 0.5 * random.normal(size=(n, UNKNOWNS))
    stage = Stage(0.3, random.normal(size=(2, n)), random.normal(size=(2, n)), 0.7, 0.62)
    open_to = np.abs(random.normal(size=n))
    exact = dense(chain.derivatives(u, stage, open_to), chain.diagonals)
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


def test_a_load_that_ends_within_a_link_and_a_bond_that_begins_within_a_cell_have_their_share():
    chain = Chain(0.1, Memory(COHESIVE, 1.0), 0.0, 1.0, loads=LOADED)
    u = np.zeros((8, UNKNOWNS))
    u[:, X] = 0.1 * np.arange(8)
    assert chain.glued(8) == pytest.approx([0.0, 0.0, 0.0, 0.1, 0.1, 0.1, 0.1, 0.1])
    assert replace(chain, loads=loads_on(po.Scene(po.Rod.from_ratio(1.0), unbonded=0.22))).glued(8)[
        :4
    ] == pytest.approx([0.0, 0.0, 0.03, 0.1])
    force = chain.acted(u, 0.5, 0.62).force[1] + 0.2 * np.cos(0.1)
    at = np.array([0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.62, 0.62])  # ahead of the front as at it
    whole = 0.5 * (np.exp(-at) + at / 0.62)
    assert force == pytest.approx(whole * [1.0, 1.0, 1.0, 1.0, 1.0, 0.3, 0.0, 0.0])
    assert chain.pushed(chain.acted(u, 0.5, 0.62))[:, 0] == pytest.approx(
        [
            0.05 * (0.1 + 0.2 * np.sin(0.1)) - 0.1 * np.cos(1.0),
            0.05 * (whole[0] - 0.2 * np.cos(0.1)) + 0.1 * np.sin(1.0),
        ]
    )
