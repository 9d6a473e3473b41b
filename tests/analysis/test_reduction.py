"""The Lyapunov-Schmidt reduction of the paper.

Modules: `reduction`, `reduced_diagram`, `linear_operator`.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import peel_opt as po
from peel_opt.analysis.reduction import lyapunov_schmidt
from peel_opt.base.errors import InvalidInput
from peel_opt.model.series import uniform_series


@pytest.fixture(scope="module", params=[0.0, 4.0, 30.0])
def red(request):
    return lyapunov_schmidt(request.param)


def test_c11_is_the_closed_form_at_every_beta0(red):
    assert red.coefficients.c11 == pytest.approx(math.cosh(math.pi / 2) / (2 * math.pi**5), rel=1e-13)


def test_slope_at_T_is_that_of_the_exact_normal_form(red):
    a1, a2 = uniform_series(1).leading
    c = red.coefficients
    assert -c.c20 / c.c11 == pytest.approx(red.beta0 * a2 / abs(a1), abs=1e-14 * (1 + red.beta0))


def test_cubic_coefficient_at_beta0_zero_is_that_of_the_exact_normal_form():
    c = lyapunov_schmidt(0.0).coefficients
    a1, _ = uniform_series(1).leading
    assert c.c11 / c.c30 == pytest.approx(a1, rel=1e-12)


def test_taylor_coefficients_are_those_of_g(red):
    c, h = red.coefficients, 1e-3
    t = np.array([-2 * h, -h, 0.0, h, 2 * h])

    def derivatives(values):
        first = (values[0] - 8 * values[1] + 8 * values[3] - values[4]) / (12 * h)
        second = (-values[0] + 16 * values[1] - 30 * values[2] + 16 * values[3] - values[4]) / (12 * h * h)
        return first, second

    in_A = derivatives(red.solve(t, 0.0).h)
    in_lam = derivatives(red.solve(0.0, t).h)
    corner = red.solve(np.array([h, -h, h, -h]), np.array([h, h, -h, -h])).h
    assert in_A[0] == pytest.approx(c.c20, abs=1e-10)
    assert in_A[1] / 2 == pytest.approx(c.c30, abs=1e-8)
    assert in_lam[0] == pytest.approx(c.c11, abs=1e-10)
    assert in_lam[1] / 2 == pytest.approx(c.c12, abs=1e-8)
    assert (corner[0] - corner[1] - corner[2] + corner[3]) / (4 * h * h) == pytest.approx(c.c21, abs=1e-8)


def test_kernels_and_solvability_are_as_the_paper_says(red):
    assert red.kernel_defect() < 1e-14
    assert red.fredholm_defect() < 1e-13
    assert red.transversality() > 0.02


def test_a_wrong_adjoint_kernel_would_be_noticed(red):
    R = np.zeros((5, red.nodes))
    R[0] = 1.0
    mu = float(red.solve_linear(R)[1])
    norm = red.inner(red.v0, red.v0)
    assert mu == pytest.approx(float(red.inner(red.v0, R) / norm), rel=1e-12)
    R[0], R[2] = 0.0, red.grid.xi
    wrong = red.v0 * np.array([1.0, 1.0, -1.0, 1.0, 1.0])[:, None]
    mu = float(red.solve_linear(R)[1])
    assert abs(mu - float(red.inner(red.v0, R) / norm)) < 1e-3 * abs(mu)
    assert abs(mu - float(red.inner(wrong, R) / norm)) > abs(mu)


def test_projectors(red):
    rng = np.random.default_rng(1)
    x = rng.normal(size=(5, red.nodes))
    np.testing.assert_allclose(red.P(red.P(x)), red.P(x), atol=1e-12)
    np.testing.assert_allclose(red.Q(red.Q(x)), red.Q(x), atol=1e-12)
    np.testing.assert_allclose(red.P(red.u0), red.u0, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(red.Q(red.v0), 0.0, atol=1e-12)


def test_correction_lies_in_the_complement_of_the_kernel(red):
    w = red.solve(-2.0, 0.5).w
    assert np.abs(w).max() > 1e-3
    np.testing.assert_allclose(red.P(w), 0.0, atol=1e-12)


def test_iteration_and_newton_agree_on_a_grid(red):
    A, lam = np.linspace(-6.0, 4.0, 6)[:, None], np.linspace(-1.0, 3.0, 5)
    iterated, newton = red.solve(A, lam, "iteration"), red.solve(A, lam, "newton")
    assert iterated.converged.all()
    assert newton.converged.all()
    assert iterated.h.shape == (6, 5)
    np.testing.assert_allclose(iterated.h, newton.h, atol=1e-13)
    assert newton.iterations.max() < iterated.iterations.max()


def test_newton_takes_over_where_the_iteration_does_not_contract():
    red = lyapunov_schmidt(4.0)
    iterated = red.solve(-5.0, 200.0, "iteration")
    assert not iterated.converged
    assert iterated.rate > 1.0
    assert np.isnan(iterated.h)
    assert np.isfinite(red.g(-5.0, 200.0))


def test_contraction_is_lambda_over_pi4_at_small_amplitude():
    rate = lyapunov_schmidt(4.0).solve(1e-3, 40.0, "iteration").rate
    assert float(rate) == pytest.approx(40.0 / math.pi**4, rel=1e-2)


def test_g_vanishes_on_the_trivial_branch_and_off_it_only_on_the_curve():
    red = lyapunov_schmidt(4.0)
    np.testing.assert_array_equal(red.g(0.0, np.linspace(-1, 1, 5)), 0.0)
    assert red.g(-2.0, -0.5) * red.g(-2.0, 0.5) < 0.0


@pytest.mark.parametrize("beta0", [0.0, 2.0, 4.0])
def test_diagram_is_the_detached_branch(beta0):
    (curve,) = lyapunov_schmidt(beta0).diagram()
    series = uniform_series(30)
    np.testing.assert_allclose(series.curve(curve.alpha1, beta0), curve.lam, atol=2e-11)
    assert curve.lam.max() > 2.8
    assert curve.alpha1.min() < -4.5


@pytest.mark.parametrize("beta0", [0.0, 2.0, 4.0])
def test_diagram_lies_on_the_traced_branch(beta0):
    (curve,) = lyapunov_schmidt(beta0).diagram()
    shown = (np.abs(curve.alpha1) > 0.05) & (curve.lam < 2.9)
    alpha1, lam = curve.alpha1[shown][::5], curve.lam[shown][::5]
    traced = po.trace(beta0=beta0, lam=(-1.0, 3.0), at={"alpha1": [float(x) for x in alpha1]})
    rows = np.array([int(np.argmin(np.abs(traced.alpha1 - x))) for x in alpha1])
    np.testing.assert_allclose(traced.alpha1[rows], alpha1, atol=1e-10)
    np.testing.assert_allclose(traced.lam[rows], lam, atol=5e-11)
    assert len(alpha1) > 12


def test_alpha1_is_the_amplitude_to_first_order_only():
    (curve,) = lyapunov_schmidt(4.0).diagram()
    difference = np.abs(curve.alpha1 - curve.A)
    assert difference.max() > 0.02
    assert (difference <= 2e-3 * curve.A**2 + 1e-12).all()


def test_diagram_splits_where_the_branch_leaves_the_window():
    curves = lyapunov_schmidt(4.0).diagram((-0.2, 3.0), (-7.0, 5.0))
    assert len(curves) == 2
    assert all((np.abs(np.diff(c.A)) < 0.11).all() for c in curves)
    assert lyapunov_schmidt(0.0).diagram((-2.0, -1.0), (-3.0, 3.0), (5, 9)) == []


@given(beta0=st.floats(0.0, 25.0), A=st.floats(-5.0, 2.0))
@settings(max_examples=15, deadline=None)
def test_g_changes_sign_across_the_series_curve(beta0, A):
    red = lyapunov_schmidt(beta0, nodes=16)
    on_curve = float(red.alpha1(A, 0.0))
    lam = float(uniform_series(24).curve(on_curve, beta0))
    h = red.solve(A, np.array([lam - 1.0, lam + 1.0])).h
    assert h[0] < 0.0 < h[1]


@pytest.mark.parametrize("beta0", [-0.1, math.nan, math.inf, "4"])
def test_bad_beta0(beta0):
    with pytest.raises(InvalidInput, match="beta0"):
        lyapunov_schmidt(beta0)


@pytest.mark.parametrize(
    "options", [{"nodes": 4}, {"nodes": 100}, {"nodes": 12.5}, {"tol": 0.0}, {"tol": math.nan}]
)
def test_bad_options(options):
    with pytest.raises(InvalidInput, match=next(iter(options))):
        lyapunov_schmidt(1.0, **options)


def test_bad_points_and_windows():
    red = lyapunov_schmidt(1.0, nodes=12)
    with pytest.raises(InvalidInput, match="finite"):
        red.solve(math.nan, 0.0)
    with pytest.raises(InvalidInput, match="method"):
        red.solve(1.0, 0.0, "magic")
    with pytest.raises(InvalidInput, match="lam_range"):
        red.diagram((1.0, -1.0))
    with pytest.raises(InvalidInput, match="samples"):
        red.diagram(samples=(1, 5))
