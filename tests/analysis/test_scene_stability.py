"""Stability of scenes: known limits, a chain of links, and the folds where it must change.

Modules: `stability`, and `motions`, `load_rates`, `scene_load_rates` of the residual.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.linalg import eig

import peel_opt as po
from peel_opt.continuation.scene_family import SceneFamily, entered_branch
from peel_opt.continuation.special import Located
from peel_opt.residual.closures import Closure
from peel_opt.residual.motions import Motions, Spectrum
from peel_opt.residual.scene_spectral import SceneSolution, SceneSpectral
from peel_opt.residual.spectral import Spectral

ROD = po.Rod.from_ratio(1.0)


def solved(scene: po.Scene, pressure: float, state: str | None = None) -> po.Equilibrium:
    return po.solve(scene, free="length", pressure=pressure, state=state)


@pytest.mark.parametrize("state", [None, "folded"])
def test_a_uniform_pressure_is_the_rods_own(state: str | None) -> None:
    plain = po.stability(po.length_given_pressure(ROD, 0.3, state=state))
    found = po.stability(solved(po.Scene(ROD), 0.3, state))
    np.testing.assert_allclose(found.eigenvalues, plain.eigenvalues, rtol=1e-11)
    assert (found.index, found.flutter) == (plain.index, plain.flutter)
    assert (found.determinant_sign, found.volume_index) == (plain.determinant_sign, plain.volume_index)


@pytest.mark.parametrize(
    ("ratio", "pressure", "length", "mu"),
    [
        (0.3, 0.9, 3.7521209067, -0.275089002),
        (1.0, 0.6, 3.0166196992, -0.81545369),
        (0.566, 0.6, 3.2917529459, -0.40246366),
        (1.0, 0.4, 4.6808352263, 0.0813723 - 0.0989169j),
        (0.566, 0.6, 3.6338106105, -0.0669547 - 0.2162114j),
    ],
)
def test_growth_rates_are_those_of_the_motion_itself(
    ratio: float, pressure: float, length: float, mu: complex
) -> None:
    """Rates in units of T0 and eta, from time integration with a moving front, by other means."""
    scene = po.Scene(po.Rod.from_ratio(ratio))
    eq = po.solve(scene, free="length", pressure=pressure, near=length)
    assert eq.length == pytest.approx(length, abs=1e-9)
    lowest = po.stability(eq).eigenvalues[0] / eq.length_ratio**4
    assert lowest.real == pytest.approx(np.real(mu), abs=2e-7)
    assert abs(lowest.imag) == pytest.approx(abs(np.imag(mu)), abs=2e-7)


def test_loads_that_keep_their_direction_have_a_symmetric_stiffness() -> None:
    dead = [po.Pressure(dead=1.0), po.Weight(0.05, 0.1), po.Drag(0.05)]
    eq = solved(po.Scene(ROD, dead, tip=po.TipLoad(0.02, 1.0, -0.02)), 0.7)
    assert isinstance(eq.source, SceneSolution)
    K = Motions(eq.source.problem, eq.source.x, 16).stiffness
    np.testing.assert_allclose(K, K.T, atol=1e-9 * np.abs(K).max())
    found = po.stability(eq)
    assert not found.flutter
    assert found.volume_index is None


#: Forces on a link at (theta, x, y, s), by formulas of their own.
Forces = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def chain(eq: po.Equilibrium, forces: Forces, pull: tuple[float, float], count: int) -> np.ndarray:
    """Smallest mu over eta and T0 of rigid links that springs hinge, by complex steps of their forces."""
    length = eq.length
    h = length / count
    xi = (np.arange(count) + 0.5) / count
    theta = make_interp_spline(eq.shape.xi, eq.shape.theta)(xi)
    reach = h * (np.triu(np.ones((count, count)), 1) + 0.5 * np.eye(count))
    whole = h * np.ones(count)

    def residual(angles: np.ndarray) -> np.ndarray:
        sine, cosine = np.sin(angles), np.cos(angles)
        x, y = -reach @ cosine, -reach @ sine
        turn = np.diff(np.append(angles, -angles[-1])) / h  # clamped half a link beyond the last
        bending = -turn
        bending[1:] += turn[:-1]
        fx, fy = forces(angles, x, y, xi * length)
        lever_x, lever_y = (
            sine * (reach.T @ fx + whole * pull[0] / h),
            cosine * (reach.T @ fy + whole * pull[1] / h),
        )
        return bending - h * (lever_x - lever_y)

    tiny = 1e-30
    K = np.stack([residual(theta + 1j * tiny * e).imag / tiny for e in np.eye(count)], axis=1)
    X, Y = reach * np.sin(theta), -reach * np.cos(theta)
    mu = 1.0 / eig(h * (X.T @ X + Y.T @ Y), K, right=False)
    return mu[np.argsort(np.abs(mu))]


def bonded(y: np.ndarray) -> np.ndarray:
    """Law (8) at eta/y0 = 1."""
    return np.where(y.real < 1.0, 1.0 - y, 0.0)


def on_a_plate(theta: np.ndarray, x: np.ndarray, y: np.ndarray, s: np.ndarray) -> Any:
    """A decaying pressure, a fifth of it dead, a tilted weight, friction and drag."""
    p = 0.7 * np.exp(-s / 8.0)
    along = 0.06
    fx = -0.8 * p * np.sin(theta) + along * np.cos(theta) + 0.02 * math.sin(0.2) - 0.03
    fy = 0.8 * p * np.cos(theta) + along * np.sin(theta) + 0.2 * p - 0.02 * math.cos(0.2) - bonded(y)
    return fx, fy


def round_a_cylinder(theta: np.ndarray, x: np.ndarray, y: np.ndarray, s: np.ndarray) -> Any:
    """A uniform pressure, and a bond to the nearest point of a circle below."""
    centre = 1.0 / -0.2
    away = np.sqrt(x**2 + (y - centre) ** 2)
    gap = away + centre  # the radius is -centre
    fx = -0.5 * np.sin(theta) - bonded(gap) * x / away
    fy = 0.5 * np.cos(theta) - bonded(gap) * (y - centre) / away
    return fx, fy


@pytest.mark.parametrize(
    ("scene", "pressure", "forces", "pull"),
    [
        (
            po.Scene(
                ROD,
                [
                    po.Pressure(po.profiles.exponential(8.0), dead=0.2),
                    po.Weight(0.02, 0.2),
                    po.SkinFriction(traction=0.06),
                    po.Drag(-0.03),
                ],
                tip=po.TipLoad(0.03, 1.0, -0.02),
                natural_curvature=0.01,
            ),
            0.7,
            on_a_plate,
            (-0.03 * math.cos(1.0), 0.03 * math.sin(1.0)),
        ),
        (
            po.Scene(ROD, wall=po.Circle(-0.2), natural_curvature=-0.2),
            0.5,
            round_a_cylinder,
            (0.0, 0.0),
        ),
    ],
    ids=["on a plate", "round a cylinder"],
)
def test_a_chain_of_links_under_the_same_loads_moves_alike(
    scene: po.Scene, pressure: float, forces: Forces, pull: tuple[float, float]
) -> None:
    eq = solved(scene, pressure, "unfolded")
    found = po.stability(eq).eigenvalues[:2].real / eq.length_ratio**4
    coarse, fine = (np.sort(chain(eq, forces, pull, n)[:2].real) for n in (60, 120))
    np.testing.assert_allclose(found, (4.0 * fine - coarse) / 3.0, rtol=2e-3, atol=2e-3)


def folds(scene: po.Scene) -> tuple[SceneFamily, list[Located]]:
    transcription = SceneSpectral(scene, Spectral(nodes=20))
    family = SceneFamily(scene.bond.law, transcription, Closure("ratio", scene.rod.ratio))
    return family, [f for f in entered_branch(family).folds if f.kind == "LP-pressure"]


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(po.Scene(ROD, [po.Pressure(po.profiles.linear(-0.1))]), id="stretches with the length"),
        pytest.param(po.Scene(ROD, [po.Pressure(lambda at: 1.0 + 0.1 * at.x)]), id="along the plate"),
        pytest.param(po.Scene(ROD, [po.SkinFriction(share=0.2)]), id="friction"),
        pytest.param(po.Scene(ROD, unbonded=1.0), id="an unbonded edge"),
        pytest.param(po.Scene(ROD, law=po.EffectiveOpening(1.0)), id="effective opening"),
        pytest.param(
            po.Scene(ROD, wall=po.Circle(0.1), natural_curvature=0.1, line_energy=0.02), id="line energy"
        ),
        pytest.param(po.Scene(ROD, wall=po.Circle(0.1), tip=po.Contact()), id="a tip on its wall"),
        pytest.param(po.Blister(ROD, slack=0.1), id="a strip with slack"),
        pytest.param(
            po.Scene(
                ROD,
                [
                    po.Pressure(lambda at: 1.0 + 0.1 * at.x - 0.1 * at.xi, dead=0.2),
                    po.Weight(0.02, 0.1),
                    po.SkinFriction(share=0.1),
                ],
                law=po.ElasticLayer(300.0),
                tip=po.TipLoad(0.02, 1.0, -0.02),
            ),
            id="an elastic layer",
        ),
        pytest.param(
            po.Scene(
                ROD,
                [
                    po.Pressure(lambda at: 1.0 + 0.1 * at.x - 0.1 * at.xi, dead=0.2),
                    po.Weight(0.02, 0.1),
                    po.SkinFriction(share=0.1),
                ],
                stretch=20.0,
                line_energy=0.02,
                glued_strain=0.01,
                tip=po.TipLoad(0.02, 1.0, -0.02),
            ),
            id="a rod that stretches",
        ),
        pytest.param(
            po.Blister(ROD, slack=0.1, stretch=50.0, line_energy=0.02),
            id="a strip that stretches",
        ),
    ],
)
@pytest.mark.slow
def test_a_motion_without_a_force_exists_where_the_pressure_turns_round(scene: po.Scene) -> None:
    """At a fold of the nonlinear problem, to which the motions are linearised, one of them is neutral."""
    _, found = folds(scene)
    for fold in found[:2]:
        spectrum = Spectrum(fold.point.problem, fold.point.x)
        assert abs(spectrum.lowest[0]) < max(1e-6, 10.0 * spectrum.error)
        assert abs(spectrum.lowest[1]) > 1.0


@pytest.mark.slow
def test_what_is_lifted_is_stable_up_to_its_snap_and_not_beyond() -> None:
    whole = po.trace(po.Scene(ROD, unbonded=1.0), points=12)
    snap, least = whole.special("LP-pressure")
    branch = whole[: least.index].with_stability()
    assert branch.index is not None
    assert not branch.index[: snap.index].any()
    np.testing.assert_array_equal(branch.index[snap.index + 1 :], 1)
    part = branch[2:9]
    np.testing.assert_array_equal(part.index, branch.index[2:9])
    assert po.stability(part, 0).index == branch.index[2]
    assert "Branch of" in repr(branch)
    elsewhere = pickle.loads(pickle.dumps(branch))
    np.testing.assert_array_equal(elsewhere.flutter, branch.flutter)
    with pytest.raises(po.InvalidInput, match="Trace it again"):
        po.stability(elsewhere)


@pytest.mark.slow
def test_a_stiff_layer_and_a_stiff_rod_move_as_their_limits_do() -> None:
    """The layer as K^(-3/4), as seen from the tip, the stretch as 1/EA: mu over T0 and eta."""

    def lowest(scene: po.Scene, length: float) -> np.ndarray:
        eq = po.solve(scene, free="length", pressure=0.5, near=length)
        return po.stability(eq).eigenvalues[:2].real / eq.length_ratio**4

    plain = po.length_given_pressure(ROD, 0.5)
    limit = po.stability(plain).eigenvalues[:2].real / plain.length_ratio**4
    apart = [lowest(po.Scene(ROD, law=po.ElasticLayer(K)), plain.length) - limit for K in (1.6e5, 2.56e6)]
    assert np.all(apart[0] / apart[1] > 0.95 * 16.0**0.75)
    held = solved(po.Scene(ROD, line_energy=0.05), 0.5)
    limit = po.stability(held).eigenvalues[:2].real / held.length_ratio**4
    scenes = (po.Scene(ROD, line_energy=0.05, stretch=EA) for EA in (400.0, 800.0))
    apart = [lowest(scene, held.length) - limit for scene in scenes]
    np.testing.assert_allclose(apart[0] / apart[1], 2.0, rtol=0.02)


@pytest.mark.slow
def test_a_strip_that_stretches_does_not_count_that_it_may_wander() -> None:
    found = po.stability(
        po.solve(po.Blister(ROD, stretch=50.0, line_energy=0.02), free="length", pressure=0.1)
    )
    assert (found.index, found.volume_index, found.marginal) == (1, 0, False)
    assert np.abs(found.eigenvalues).min() > 1.0
    assert found.error < 1e-6


def test_who_holds_what_of_a_scene() -> None:
    table = po.control_table(solved(po.Scene(ROD, [po.SkinFriction(share=0.1)]), 0.6))
    assert table["fixed pressure"] == "unstable (index 1)"
    assert table["fixed swept volume"] == "not covered"


@pytest.mark.slow
def test_friction_makes_a_rod_at_its_transition_flutter_as_leipholz_column_does() -> None:
    """The bond shifts all mu alike: those of a clamped-free column meet at 40.05 k/L^3."""
    loads, squares = [], []
    for beta1, friction in ((2.6108, 40.0), (2.36, 40.1)):
        branch = po.trace(po.Scene(po.Rod.from_ratio(beta1), [po.SkinFriction(traction=friction)]), points=6)
        first, second = po.stability(branch, 0).eigenvalues[:2]
        loads.append(friction * branch.sigma[0] ** 3)
        squares.append(float(((second - first) ** 2).real))  # negative where they are complex
    meet = loads[0] + (loads[1] - loads[0]) * squares[0] / (squares[0] - squares[1])
    assert meet == pytest.approx(40.054, abs=0.004)
