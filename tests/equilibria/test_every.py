"""Every state at a given pressure, against a brute search that shares no code with the package.

Modules: `every`, `states`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import peel_opt as po
from peel_opt.model.law_arrays import tip_heights

Traction = Callable[[np.ndarray], np.ndarray]


def softening(u: np.ndarray) -> np.ndarray:
    return np.where(u < 1.0, 1.0 - u, 0.0)


def decaying(u: np.ndarray) -> np.ndarray:
    return np.exp(-np.clip(u, -5.0, None))


def dropping(u: np.ndarray) -> np.ndarray:
    return np.where(u < 1.0, 1.0 - 0.1 * u, 0.0)


#: A law whose traction jumps.
DROP = po.CohesiveLaw([lambda u: 1.0 - 0.1 * u, lambda u: 0.0 * u], kinks=(1.0,), name="drop")


def brute(tau: Traction, ratio: float, P: float, tip: float, longest: float) -> list[tuple[float, float]]:
    """(sbar/eta, tip angle) of states above the plate, in lengths of eta: shoot from the edge, s backwards.

    A grid of edge reactions is shot with small steps.  Where the rod's height is that of the tip in the
    middle of four neighbours, and so may be its curvature, both are solved for.
    """

    def slopes(_: float, z: np.ndarray) -> np.ndarray:
        theta, turn, ny, y = z.reshape(4, -1)
        nx = P * (tip / ratio - y)
        bend = nx * np.sin(theta) - ny * np.cos(theta)
        return np.concatenate([-turn, bend, tau(ratio * y) - P * np.cos(theta), -np.sin(theta)])

    def end(reaction: float, length: float) -> np.ndarray:
        start = np.array([0.0, 0.0, -reaction, 0.0])
        solved = solve_ivp(slopes, (0.0, length), start, "DOP853", rtol=1e-10, atol=1e-12, max_step=0.1)
        return solved.y[:, -1]

    count, steps = 3000, 60 * int(longest)
    reactions, h = np.linspace(1e-3, 1.2 * longest, count), longest / steps
    z = np.concatenate([np.zeros(2 * count), -reactions, np.zeros(count)])
    height, turn, load = (np.empty((steps + 1, count)) for _ in range(3))
    for i in range(steps + 1):
        _, turn[i], load[i], height[i] = z.reshape(4, -1)
        k1 = slopes(0.0, z)
        k2 = slopes(0.0, z + 0.5 * h * k1)
        k3 = slopes(0.0, z + 0.5 * h * k2)
        k4 = slopes(0.0, z + h * k3)
        z = np.clip(z + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4), -1e6, 1e6)

    def change(values: np.ndarray) -> np.ndarray:
        corners = np.stack([values[:-1, :-1], values[1:, :-1], values[:-1, 1:], values[1:, 1:]])
        return (corners.min(axis=0) < 0.0) & (corners.max(axis=0) > 0.0)

    above = np.minimum.accumulate(height)[:-1, :-1] > -1e-2 / ratio
    found: list[tuple[float, float]] = []
    for step, rod in np.argwhere(
        change(height - tip / ratio) & change(turn) & above & (np.abs(load[:-1, :-1]) < 0.3)
    ):
        guess = [reactions[rod], (step + 0.5) * h]
        solved = root(lambda x: end(*x)[[1, 3]] - [0.0, tip / ratio], guess, tol=1e-10)
        theta, _, ny, _ = end(*solved.x)
        near = abs(solved.x[1] - guess[1]) < 0.2
        if not (solved.success and near and abs(ny) < 1e-5 and 0.1 < solved.x[1] < longest):
            continue
        if not any(abs(solved.x[1] - sigma) < 1e-4 for sigma, _ in found):
            found.append((float(solved.x[1]), float(theta)))
    return sorted(found)


@pytest.mark.parametrize(
    ("ratio", "P", "law", "tau", "tip"),
    [
        (1.0, 0.5, "auto", softening, 1.0),
        (0.2, 0.9, "auto", softening, 0.2),
        (1.5, 0.5, po.exponential(), decaying, 1.5936242600400394),  # P u = 1 - exp(-u)
        (1.0, 0.97, DROP, dropping, 0.6),
    ],
)
def test_no_state_above_the_plate_is_missed(
    ratio: float, P: float, law: str | po.CohesiveLaw, tau: Traction, tip: float
) -> None:
    states = po.equilibria(po.Rod.from_ratio(ratio), pressure=P, law=law)
    assert states.searched is not None
    longest = states.searched.length_ratios[1]
    expected = sorted([*brute(tau, ratio, P, tip, longest), *brute(tau, ratio, P, 0.0, longest)])
    assert len(expected) >= 2
    found = [eq for eq in states if "y < 0" not in eq.flags and eq.length_ratio < longest]
    lengths, angles = zip(*expected, strict=True)
    assert [eq.length_ratio for eq in found] == pytest.approx(lengths, abs=2e-6)
    assert [eq.tip_angle for eq in found] == pytest.approx(angles, abs=2e-5)
    # The reaction at the edge is the load that is left there.
    for eq in found:
        assert 0.0 < -eq.shape.Ny[-1] / eq.length_ratio**2 < states.searched.edge_reactions[1]


@pytest.mark.parametrize(
    ("ratio", "met", "not_met"),
    [
        pytest.param(1.0, [0.6, 0.958], [0.3], marks=pytest.mark.slow),
        (3.0, [0.97], []),
        pytest.param(10.0, [0.97], [], marks=pytest.mark.slow),
    ],
)
def test_the_branch_under_a_law_that_jumps_has_the_states_that_a_scan_finds(
    ratio: float, met: list[float], not_met: list[float]
) -> None:
    """It has a corner where the tip comes to the jump, and goes on to the contact."""
    rod = po.Rod.from_ratio(ratio)
    branch = po.trace(rod, law=DROP, at={"pressure_ratio": met})
    assert branch.ended == "contact"
    assert branch.special("contact")[0].pressure_ratio == pytest.approx(1.0, abs=1e-9)
    for P in (*met, *not_met):
        walked = np.sort(branch.length_ratio[np.abs(branch.pressure_ratio - P) < 1e-9])
        scanned = [
            eq for eq in po.equilibria(rod, pressure=P, law=DROP) if eq.state in ("middle", "lower", "folded")
        ]
        assert walked == pytest.approx(sorted(eq.length_ratio for eq in scanned), rel=1e-7)
        for state in ("unfolded", "folded"):
            there = [eq for eq in scanned if (eq.state == "folded") == (state == "folded")]
            if there:
                best = min(there, key=lambda eq: eq.error)
                found = po.length_given_pressure(rod, P, law=DROP, state=state, near=best.length_ratio)
                assert found.length_ratio == pytest.approx(best.length_ratio, rel=1e-9)
            else:
                with pytest.raises(po.NoEquilibrium):
                    po.length_given_pressure(rod, P, law=DROP, state=state)


def test_states_of_each_height_of_the_tip_are_found() -> None:
    law = po.CohesiveLaw(
        [lambda u: 1 - u, lambda u: 0.4 + 0.8 * (u - 0.6), lambda u: 0.8 - 0.8 * (u - 1.1), lambda u: 0 * u],
        kinks=(0.6, 1.1, 2.1),
    )
    heights = tip_heights(law, 0.66)
    assert heights == pytest.approx([0.7113999063670616, 1.15, 1.4], abs=1e-9)
    states = po.equilibria(po.Rod.from_ratio(0.8), pressure=0.66, law=law)
    for u in heights:
        assert any(eq.tip_height * 0.8 == pytest.approx(u, abs=1e-7) and eq.certified for eq in states)


def test_two_states_at_almost_the_same_reaction_are_told_apart() -> None:
    # Both of them lay between two neighbouring reactions of a scan that looked at changes of sign alone.
    states = po.equilibria(po.Rod.from_ratio(14.232829314015301), pressure=0.6615219434124648)
    assert states.searched.length_ratios[1] > 7.6
    for sigma, tip in ((7.3524565015, -4.2755804068), (7.5721264313, -4.2542742535)):
        found = min(states, key=lambda eq: abs(eq.length_ratio - sigma))
        assert found.length_ratio == pytest.approx(sigma, abs=1e-8)
        assert found.tip_angle == pytest.approx(tip, abs=1e-7)


def test_a_state_that_is_not_certified_ends_what_is_claimed() -> None:
    rod = po.Rod.from_ratio(1.0)
    states = po.equilibria(rod, pressure=0.5)
    others = [eq.length_ratio for eq in states if eq.state == "other"]
    assert others
    assert max(others) < states.searched.length_ratios[1]
    # At a tolerance that rounding does not allow only the states of the branch are listed.
    strict = po.equilibria(rod, pressure=0.5, tol=1e-17)
    assert not [eq for eq in strict if eq.state == "other"]
    assert strict.searched.length_ratios[1] == pytest.approx(min(others), rel=1e-6)


def test_a_tip_that_is_held_is_on_the_plate_whatever_the_mesh_makes_of_it() -> None:
    states = po.equilibria(po.Rod.from_ratio(1.0), pressure=0.958, law=DROP)
    held = min(states, key=lambda eq: abs(eq.length_ratio - 3.0390095))
    assert held.state == "other"
    assert held.flags == ("overhang", "tip on plate")
