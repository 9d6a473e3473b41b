"""Stability: exact values at T, a second discretisation, and where it changes along branches.

Modules: `stability`, `stability_along`, and of the residual `motions`.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.interpolate import make_interp_spline
from scipy.linalg import eig

import peel_opt as po
from peel_opt.analysis.stability import stability

PI4 = math.pi**4
#: Roots of cos k cosh k = -1: the clamped-free beam.
CLAMPED_FREE = (1.8751040687119611, 4.694091132974174)


def differences(eq: po.Equilibrium, count: int) -> np.ndarray:
    """Smallest mu from finite differences on equal links, sharing no code with the library.

    Links of length h with angles theta_i hinged by springs; the same virtual work.
    """
    h = 1.0 / count
    xi = (np.arange(count) + 0.5) * h
    theta = np.interp(xi, eq.shape.xi, eq.shape.theta)
    y = np.interp(xi, eq.shape.xi, eq.shape.y)
    opened = eq.beta1 / eq.beta0 * y
    soft = eq.beta1 * (opened <= 1.0) if eq.law != "linear" else np.full(count, eq.beta1)
    sine, cosine = np.sin(theta), np.cos(theta)
    # Displacement of the middle of link i from rotations of links i..n-1.
    reach = np.triu(np.ones((count, count)), 1) + 0.5 * np.eye(count)
    X, Y = h * reach * sine, -h * reach * cosine
    bending = np.zeros((count, count))
    for i in range(count - 1):
        bending[i, i] += 1 / h
        bending[i + 1, i + 1] += 1 / h
        bending[i, i + 1] -= 1 / h
        bending[i + 1, i] -= 1 / h
    bending[-1, -1] += 2 / h  # the edge is clamped half a link away
    nx, ny = np.interp(xi, eq.shape.xi, eq.shape.Nx), np.interp(xi, eq.shape.xi, eq.shape.Ny)
    K = bending - np.diag(h * (cosine * nx + sine * ny))
    K -= h * X.T @ (-eq.alpha * np.diag(cosine))
    K -= h * Y.T @ (-eq.alpha * np.diag(sine) + soft[:, None] * Y)
    M = h * (X.T @ X + Y.T @ Y)
    mu = 1.0 / eig(M, K, right=False)
    return mu[np.argsort(np.abs(mu))]


def test_at_the_transition_the_eigenvalues_are_those_of_a_clamped_beam() -> None:
    br = po.trace(beta0=4, lam=(-0.5, 1), points=10)
    found = stability(br, br.special("BP")[0].index)
    exact = [k**4 - PI4 for k in CLAMPED_FREE]
    np.testing.assert_allclose(found.eigenvalues[:2].real, exact, rtol=1e-8)
    assert found.index == 1
    assert found.error < 1e-6


@pytest.mark.parametrize(("ratio", "P", "state"), [(1.0, 0.3, None), (1.0, 0.3, "folded"), (0.2, 0.9, None)])
def test_a_chain_of_links_has_the_same_eigenvalues(ratio: float, P: float, state: str | None) -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(ratio), P, state=state)
    found = stability(eq).eigenvalues[:2]
    coarse, fine = (differences(eq, n)[:2] for n in (120, 240))
    np.testing.assert_allclose(np.sort(found.real), np.sort(fine.real), rtol=0.02, atol=1.0)
    if eq.law == "linear":  # no kink between two links to blur the convergence
        distances = [np.abs(np.sort(mu.real) - np.sort(found.real)).max() for mu in (coarse, fine)]
        assert distances[1] < distances[0]


#: tau by stretches, as polynomials in u, and the kinks between: whose traction jumps.
JUMPING = {
    "falls off": ([[1.0, -0.1], [0.0]], (1.0,)),
    "with a drop": ([[1.0, -0.5], [0.8, -0.5], [0.0]], (0.4, 1.6)),
}


def jumping(name: str) -> po.CohesiveLaw:
    """The law of these polynomials."""
    stretches, kinks = JUMPING[name]
    return po.CohesiveLaw(
        [lambda u, c=c: c[0] + (c[1] * u if len(c) > 1 else 0.0 * u) for c in stretches], kinks, name=name
    )


def worked(name: str) -> tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
    """The integral of tau from 0 and its integral, also of complex u."""
    stretches, kinks = JUMPING[name]
    edges = (0.0, *kinks)
    once, twice = [], []
    for i, coefficients in enumerate(stretches):
        first = Polynomial(coefficients).integ(lbnd=edges[i])
        first += once[-1](edges[i]) if once else 0.0
        second = first.integ(lbnd=edges[i])
        second += twice[-1](edges[i]) if twice else 0.0
        once.append(first)
        twice.append(second)

    def read(pieces: list[Polynomial]) -> Callable[[np.ndarray], np.ndarray]:
        return lambda u: np.select([u.real <= k for k in kinks], [p(u) for p in pieces[:-1]], pieces[-1](u))

    return read(once), read(twice)


def derivatives_of_a_chain(eq: po.Equilibrium, name: str, count: int) -> np.ndarray:
    """Smallest mu of rigid links, from derivatives of their forces by complex steps.

    The work of the bond is integrated along each link, so that a kink inside one is nothing
    special, and the forces are what the work changes by: no derivative of tau is formed.
    """
    h = 1.0 / count
    xi = (np.arange(count) + 0.5) * h
    theta = make_interp_spline(eq.shape.xi, eq.shape.theta)(xi)
    Phi, Psi = worked(name)
    scale = eq.beta1 / eq.beta0
    after = np.triu(np.ones((count + 1, count)))  # from the angles to the start of each link and the edge

    def forces(angles: np.ndarray) -> np.ndarray:
        """What keeps the links from turning, shape (count, n), for n sets of angles."""
        sine, cosine = np.sin(angles), np.cos(angles)
        padded = np.vstack([angles, -angles[-1]])  # the edge is clamped half a link away
        turn = np.diff(padded, axis=0) / h
        bending = -turn
        bending[1:] += turn[:-1]
        u = -scale * h * after @ sine
        u1, u2 = u[:-1], u[1:]
        mean = (Psi(u2) - Psi(u1)) / (u2 - u1)
        by_ends = np.zeros_like(u)
        by_ends[:-1] += h * (mean - Phi(u1)) / (u2 - u1)
        by_ends[1:] += h * (Phi(u2) - mean) / (u2 - u1)
        # Turning link i by 1 moves everything before it, and the middle of it by half as much.
        bond = -h * eq.beta0 * cosine * (after.T @ by_ends)
        reach = np.triu(np.ones((count, count)), 1) + 0.5 * np.eye(count)
        pressure = -eq.alpha * h * h * (sine * (reach.T @ sine) + cosine * (reach.T @ cosine))
        return bending + bond - pressure

    tiny = 1e-30
    K = forces(theta[:, None] + 1j * tiny * np.eye(count)).imag / tiny
    reach = np.triu(np.ones((count, count)), 1) + 0.5 * np.eye(count)
    X, Y = h * reach * np.sin(theta), -h * reach * np.cos(theta)
    mu = 1.0 / eig(h * (X.T @ X + Y.T @ Y), K, right=False)
    return mu[np.lexsort((mu.imag, np.round(np.abs(mu), 9)))]  # of a pair, the lower one first


@pytest.mark.parametrize(
    ("ratio", "P", "state", "name", "lowest"),
    [
        (1.0, 0.4504, None, "falls off", -24.8),
        (0.5, 0.7177, None, "with a drop", -32.9),
        (0.5, 0.9067, "folded", "falls off", None),
    ],
)
def test_a_traction_that_jumps_softens_where_it_does(
    ratio: float, P: float, state: str | None, name: str, lowest: float | None
) -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(ratio), P, state=state, law=jumping(name))
    found = stability(eq)
    chains = [derivatives_of_a_chain(eq, name, n)[:2] for n in (40, 80, 160)]
    distances = [np.abs(mu - found.eigenvalues[:2]).max() for mu in chains]
    assert distances[2] < 0.01 * abs(found.eigenvalues[1])
    assert distances[2] < 0.5 * distances[0]
    if lowest is None:
        assert found.flutter
    else:
        assert found.eigenvalues[0].real == pytest.approx(lowest, abs=0.05)
        assert found.index == 1


def test_the_index_changes_at_the_minimum_pressure_of_a_law_that_jumps() -> None:
    br = po.trace(po.Rod.from_ratio(0.5), law=jumping("with a drop"), points=24, tol=1e-8)
    fold = br.special("LP-pressure")[0].index
    assert abs(stability(br, fold).eigenvalues[0]) < 1e-5
    assert [stability(br, i).index for i in (fold - 1, fold + 1)] == [1, 0]


@pytest.mark.parametrize("method", [po.Shooting(4, "rk4"), po.Shooting(2), po.Spectral(5), po.Spectral(8)])
def test_the_error_covers_that_of_the_state(method: po.Shooting | po.Spectral) -> None:
    rod = po.Rod.from_ratio(1.0)
    exact = stability(po.length_given_pressure(rod, 0.3, method=po.Spectral(32))).eigenvalues
    found = stability(po.length_given_pressure(rod, 0.3, method=method, tol=10.0))
    off = np.abs(found.eigenvalues - exact) / (1.0 + np.abs(exact))
    assert off.max() <= found.error
    assert found.error > 1e-8


@pytest.mark.parametrize("ratio", [0.1, 0.35, 0.6, 1.0, 3.0, 10.0])
def test_the_change_is_at_the_fold_in_pressure_not_at_the_fold_in_length(ratio: float) -> None:
    br = po.trace(po.Rod.from_ratio(ratio), points=20, tol=1e-8)
    fold = br.special("LP-pressure")[0].index
    before = [stability(br, i) for i in range(1, fold)]
    assert {s.index for s in before} == {1}
    assert {s.determinant_sign for s in before} == {-1}
    assert not any(s.flutter for s in before)
    assert abs(stability(br, fold).eigenvalues[0]) < 1e-6  # a vanishing eigenvalue at the fold itself
    after = stability(br, fold + 1)
    assert after.index == 0
    assert after.determinant_sign == 1


def test_folded_states_flutter_above_a_ratio_of_0_3() -> None:
    def fluttering(ratio: float) -> bool:
        br = po.trace(po.Rod.from_ratio(ratio), points=20, tol=1e-8)
        return any(stability(br, i).flutter for i in np.flatnonzero(br.state == "folded"))

    assert not fluttering(0.15)
    assert fluttering(0.4)


def test_two_negative_real_eigenvalues_far_on_the_folded_part() -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(2.0), 0.96, state="folded")
    found = stability(eq)
    assert found.index == 2
    assert found.determinant_sign == 1
    assert found.growth > 0


def test_holding_the_volume_stabilises_the_unfolded_state() -> None:
    found = stability(po.length_given_pressure(po.Rod.from_ratio(1.0), 0.5))
    assert not found.stable
    assert found.volume_index == 0
    assert "unstable (index 1) at fixed pressure" in repr(found)


def test_only_a_computed_equilibrium_can_be_analysed() -> None:
    eq = pickle.loads(pickle.dumps(po.length_given_pressure(po.Rod.from_ratio(1.0), 0.5)))
    with pytest.raises(po.InvalidInput, match="no discrete solution"):
        stability(eq)


def test_a_branch_knows_its_index_and_draws_it_dashed() -> None:
    br = po.trace(po.Rod.from_ratio(0.2), points=20, tol=1e-8)
    assert br.index is None
    known = br.with_stability()
    fold = br.special("LP-pressure")[0].index
    assert set(known.index[1:fold]) == {1}
    assert set(known.index[fold + 1 :]) == {0}
    styles = {line.get_linestyle() for line in br.plot().get_lines() if len(line.get_xdata()) > 2}
    assert {"-", "--"} <= styles


def test_changes_of_stability_are_located() -> None:
    changes = po.stability_changes(po.trace(po.Rod.from_ratio(0.3), points=24, tol=1e-8))
    assert [(c.before, c.after.split()[0]) for c in changes] == [
        ("index 1", "stable"),
        ("stable", "flutter"),
        (changes[1].after, "stable"),
    ]
    assert changes[0].pressure_ratio == pytest.approx(0.6460251524, abs=1e-9)
    assert all(abs(c.tip_angles[0] - c.tip_angles[1]) < 1e-5 for c in changes)
    with pytest.raises(po.InvalidInput, match="branch of a rod"):
        po.stability_changes(po.trace(beta0=4, lam=(-1, 1), points=8))


def test_changes_do_not_depend_on_the_points(branch_of: Callable[..., po.Branch]) -> None:
    lists = [po.stability_changes(branch_of(1.0, **options)) for options in ({"points": 15}, {})]
    assert [c.before for c in lists[0]] == [
        "index 1",
        "stable",
        "flutter",
        "flutter even under drag",
        "flutter",
    ]
    assert lists[0][-1].after == "stable"
    for changes in lists:
        assert [(c.before, c.after) for c in changes] == [(c.before, c.after) for c in lists[0]]
        angles = np.array([c.tip_angles for c in changes])
        assert np.abs(np.diff(angles, axis=1)).max() <= 1e-6
        np.testing.assert_allclose(angles, [c.tip_angles for c in lists[0]], rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("points", [15, 60])
def test_no_direction_is_claimed_from_an_eigenvalue_that_vanishes(
    points: int, branch_of: Callable[..., po.Branch]
) -> None:
    br = branch_of(1.0, points=points)
    found = stability(br, len(br) - 1)
    assert br.ended == "contact"
    assert abs(found.eigenvalues[0]) < found.error
    assert found.marginal
    assert not found.stable
    assert (found.index, found.determinant_sign) == (0, 0)
    assert "marginal" in repr(found)
