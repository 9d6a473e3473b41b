"""The linear hierarchy and the series of uniform rods.

Modules: `hierarchy`, `series`, `series_curve`.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from peel_opt.analysis.reduction import lyapunov_schmidt
from peel_opt.base.errors import InvalidInput, NoEquilibrium, OutOfRange
from peel_opt.model.series import MAX_ORDER, uniform_series

SLOPE_AT_T = 1 / math.pi**2 - 2 * (math.cosh(math.pi) - 7) / (5 * math.pi**3 * math.sinh(math.pi))


@pytest.fixture(scope="module")
def series():
    return uniform_series(12)


def test_leading_coefficients_are_exact_to_twelve_digits(series):
    a1, a2 = series.leading
    assert a1 == pytest.approx(-7.247458102099, abs=5e-13)
    assert a2 == pytest.approx(0.697145349376, abs=5e-13)
    assert a2 / abs(a1) == pytest.approx(SLOPE_AT_T, rel=1e-13)


def test_polynomials_have_the_powers_j_to_2j_and_do_not_depend_on_the_order(series):
    higher = uniform_series(20)
    for j, (low, high) in enumerate(zip(series.polynomials, higher.polynomials, strict=False), start=1):
        assert len(low) == 2 * j + 1
        assert not low[:j].any()
        assert low[j:].all()
        np.testing.assert_allclose(low, high, rtol=1e-13)


def test_series_is_the_sum_of_its_polynomials(series):
    a, beta0 = -0.4, 3.0
    powers = [beta0 ** (2 * j) * np.polyval(p[::-1], a) for j, p in enumerate(series.polynomials, start=1)]
    assert series.lam(a, beta0) == pytest.approx(math.fsum(powers), rel=1e-13)


@pytest.mark.parametrize(
    ("beta0", "lam", "alpha1"),
    [
        (4.0, 1.0, [-4.4354069891, None]),
        (4.0, 3.0, [-6.3212369673, 3.5396937370]),
        (0.0, 1.0, [-2.7052337656, 2.7052337656]),
    ],
)
def test_reference_states(series, beta0, lam, alpha1):
    found = series.alpha1(beta0, lam)
    assert len(found) == len(alpha1)
    for x, wanted in zip(found, alpha1, strict=True):
        assert wanted is None or x == pytest.approx(wanted, abs=1e-9)


def test_a_rod_in_the_middle_of_its_branch():
    best = uniform_series(MAX_ORDER)
    sigma = best.length_ratio(1.0, 0.8)
    assert sigma == pytest.approx(3.036804006, abs=1e-9)
    assert best.theta(0.0, -0.2, sigma**3) == pytest.approx(-0.226103220, abs=1e-9)
    assert best.y(0.0, -0.2, sigma**3) * sigma == pytest.approx(0.4, abs=1e-9)  # y_tip = 2 (1 - P) y0
    assert best.length_ratio(1.0, 0.651466320) == pytest.approx(3.013827495, abs=1e-9)


@given(a=st.floats(-0.9, 0.2), beta0=st.floats(0.5, 15.0))
@settings(max_examples=30, deadline=None)
def test_summed_shape_solves_the_equations_and_the_boundary_conditions(a, beta0):
    series = uniform_series(20)
    assert series.residual(a, beta0) < 1e-12 + 10 * float(series.truncation_error(a, beta0))
    ends = series.fields(np.array([0.0, 1.0]), a, beta0)
    size = abs(a * beta0)
    assert np.abs([ends.theta[1], ends.y[1], ends.curvature[1]]).max() < 1e-13 * (1 + size)
    assert np.abs([ends.curvature[0], ends.Nx[0], ends.Ny[0]]).max() < 1e-12 * (1 + size)


def test_curvature_is_the_slope_of_theta(series):
    xi, h = np.linspace(0.1, 0.9, 9), 1e-4
    difference = (series.theta(xi + h, -0.5, 5.0) - series.theta(xi - h, -0.5, 5.0)) / (2 * h)
    np.testing.assert_allclose(series.fields(xi, -0.5, 5.0).curvature, difference, atol=1e-7)


def test_truncated_shape_shows_in_the_residual():
    residuals = [uniform_series(order).residual(-0.35, 10.0) for order in (1, 3, 6, 12)]
    assert residuals == sorted(residuals, reverse=True)
    assert residuals[0] > 1e-5
    assert residuals[-1] < 1e-12


@pytest.mark.parametrize("beta0", [4.0, 10.0, 20.0, 25.0])
@pytest.mark.parametrize("a", [-0.9, -0.5, -0.35, 0.15])
def test_converges_in_order_and_the_error_estimate_is_honest(a, beta0):
    exact = float(uniform_series(MAX_ORDER).lam(a, beta0))
    errors = []
    for order in (1, 2, 3, 6, 9, 12):
        series = uniform_series(order)
        errors.append(abs(float(series.lam(a, beta0)) - exact))
        assert errors[-1] <= float(series.truncation_error(a, beta0))
    assert errors[-1] < 1e-3 * errors[0]
    assert float(uniform_series(12).truncation_error(a, beta0)) < 300 * errors[-1] + 1e-11


def test_agrees_with_the_lyapunov_schmidt_reduction_where_the_series_converges(series):
    (curve,) = lyapunov_schmidt(10.0, nodes=24).diagram((-1.8, 2.0), (-8.0, 2.0), (9, 41))
    np.testing.assert_allclose(series.curve(curve.alpha1, 10.0), curve.lam, atol=1e-6)
    inner = np.abs(curve.alpha1) < 5.0
    np.testing.assert_allclose(
        uniform_series(24).curve(curve.alpha1, 10.0)[inner], curve.lam[inner], atol=1e-10
    )


def test_error_is_infinite_where_the_series_diverges(series):
    assert series.truncation_error(0.5, 25.0) == math.inf
    assert np.isfinite(series.truncation_error(-0.5, 25.0))


def test_only_roots_connected_to_the_straight_rod_are_returned(series):
    # The sum is a polynomial of degree 24 in alpha1; on [-25, 25] more real roots than states.
    wide = np.polynomial.Chebyshev.interpolate(lambda x: series.curve(x, 10.0), 24, [-25.0, 25.0])
    real = [x.real for x in (wide - 1.0).roots() if abs(x.imag) < 1e-6]
    roots = series.alpha1(10.0, 1.0)
    assert len(real) > len(roots) == 2
    low, high = series.interval(10.0)
    assert low < roots[0] < 0 < roots[1] < high


def test_no_state_below_the_fold_and_two_above(series):
    assert series.alpha1(4.0, -0.26900108828).size == 0
    assert series.alpha1(4.0, -0.26900108826).size == 2


@given(beta0=st.floats(0.1, 20.0), fraction=st.floats(0.0, 0.95))
@settings(max_examples=30, deadline=None)
def test_roots_give_back_lambda(beta0, fraction):
    series = uniform_series(12)
    lam = -fraction * 0.0167 * beta0**2
    roots = series.alpha1(beta0, lam)
    np.testing.assert_allclose(series.curve(roots, beta0), lam, atol=1e-12 * (1 + beta0**2))
    np.testing.assert_allclose(series.a(beta0, lam) * beta0, roots)


@given(r=st.floats(1.3, 500.0), P=st.floats(0.4, 0.999))
@settings(max_examples=30, deadline=None)
def test_length_ratio_is_on_the_curve(r, P):
    series = uniform_series(24)
    sigma = series.length_ratio(r, P)
    assert r * sigma**4 - math.pi**4 == pytest.approx(float(series.lam(P - 1, sigma**3)), abs=1e-11)


@pytest.mark.parametrize("order", [0, -1, 2.5, True, "6"])
def test_order_must_be_a_positive_integer(order):
    with pytest.raises(InvalidInput, match="order"):
        uniform_series(order)


def test_order_beyond_double_precision_names_the_limit():
    with pytest.raises(OutOfRange, match="at most 40") as caught:
        uniform_series(MAX_ORDER + 1)
    assert caught.value.nearest == MAX_ORDER


@pytest.mark.parametrize("beta0", [-1.0, math.nan, math.inf])
def test_bad_beta0(series, beta0):
    for call in (
        lambda: series.interval(beta0),
        lambda: series.alpha1(beta0, 0.1),
        lambda: series.theta(0.0, -0.1, beta0),
    ):
        with pytest.raises(InvalidInput, match="beta0"):
            call()


def test_a_needs_a_positive_beta0(series):
    with pytest.raises(InvalidInput, match="beta0"):
        series.a(0.0, 1.0)


def test_lambda_must_be_finite(series):
    with pytest.raises(InvalidInput, match="lam"):
        series.alpha1(4.0, math.nan)


@pytest.mark.parametrize("P", [1.0, 1.5, 0.0, -0.2])
def test_no_detached_state_at_such_a_pressure(series, P):
    with pytest.raises(NoEquilibrium):
        series.length_ratio(1.0, P)


@pytest.mark.parametrize(("r", "P"), [(0.05, 0.5), (0.4, 0.7), (1.0, 0.1)])
def test_length_ratio_does_not_guess_beyond_convergence(series, r, P):
    with pytest.raises(OutOfRange, match="order 12"):
        series.length_ratio(r, P)
