"""The normal form: its coefficients, fits and potentials.

Modules: `normal_form`, `normal_form_fit`, `branch_potential`, `potential`, `curve_pieces`.
"""

import itertools
import math
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import peel_opt as po
from peel_opt.analysis import design_relations as design
from peel_opt.analysis.branch_potential import BranchStates, branch_potential, states_potential
from peel_opt.analysis.normal_form import NormalForm
from peel_opt.base.errors import InvalidInput, NoEquilibrium, NotConverged, OutOfRange
from peel_opt.model.rod import Rod
from peel_opt.model.series import uniform_series

from ..rods import FLAP

FORMS = {"paper": NormalForm.paper(), "exact": NormalForm.exact(), "uniform": NormalForm.uniform(12)}
each_form = pytest.mark.parametrize("kind", FORMS)


def branch(beta0, low, high, points=161):
    """Points of a detached branch, to rounding, as a tracer would hand them over."""
    alpha1 = np.linspace(low, high, points)
    return SimpleNamespace(lam=uniform_series(30).curve(alpha1, beta0), alpha1=alpha1, beta0=beta0)


# Coefficients


def test_coefficients():
    assert (FORMS["paper"].a1, FORMS["paper"].a2) == (-7.29, 0.696)
    for form in (FORMS["exact"], FORMS["uniform"]):
        assert form.a1 == pytest.approx(-7.247458102099, abs=5e-13)
        assert form.a2 == pytest.approx(0.697145349376, abs=5e-13)


def test_paper_values_for_fig_7():
    assert FORMS["paper"].fold(4.0)[0] == pytest.approx(-0.2658, abs=5e-5)
    assert FORMS["paper"].maxwell(4.0)[0] == pytest.approx(-0.2363, abs=5e-5)


@pytest.mark.parametrize(
    ("beta0", "lam", "alpha1"),
    [(2.0, -0.067107064982, -0.697144260990), (4.0, -0.26900108827, -1.3942820254)],
)
def test_fold_of_the_full_equations(beta0, lam, alpha1):
    found = FORMS["uniform"].fold(beta0)
    assert found[0] == pytest.approx(lam, abs=2e-11)
    assert found[1] == pytest.approx(alpha1, abs=2e-10)
    assert FORMS["exact"].fold(beta0)[0] == pytest.approx(lam, rel=4e-3)


def test_uniform_of_order_one_is_exact():
    first, exact = NormalForm.uniform(1, tol=1e3), FORMS["exact"]
    assert first.fold(1.0) == pytest.approx(exact.fold(1.0), rel=1e-12)
    assert first.maxwell(1.0) == pytest.approx(exact.maxwell(1.0), rel=1e-12)


def test_fold_converges_with_the_order():
    folds = [NormalForm.uniform(order, tol=1e-2).fold(15.0)[0] for order in (2, 4, 6, 9, 12, 24)]
    errors = np.abs(np.array(folds[:-1]) - folds[-1])
    assert (errors[1:] < 0.1 * errors[:-1]).all()


# The potential and its critical points


@each_form
@given(x=st.floats(-5.0, 2.0), beta0=st.floats(0.0, 8.0), lam=st.floats(-1.0, 3.0))
@settings(max_examples=25, deadline=None)
def test_derivative_of_the_potential_is_the_normal_form(kind, x, beta0, lam):
    form = FORMS[kind]
    U, h = form.at(beta0), 1e-4
    numerical = (U(x + h, lam) - U(x - h, lam)) / (2 * h)
    assert float(numerical) == pytest.approx(float(form.derivative(x, beta0, lam)), abs=1e-5)
    assert float(U(x, lam)) == pytest.approx(quad(lambda t: float(U.derivative(t, lam)), 0, x)[0], abs=1e-8)


def test_quartic_potential_is_the_one_of_the_paper():
    x, beta0, lam = -1.3, 4.0, -0.1
    wanted = x**4 / 4 + 0.696 * beta0 * x**3 / 3 - 7.29 * lam * x**2 / 2
    assert float(FORMS["paper"].potential(x, beta0, lam)) == pytest.approx(wanted, rel=1e-14)


@each_form
@given(beta0=st.floats(0.5, 15.0), lam=st.floats(-0.5, -1e-6) | st.floats(1e-6, 0.5))
@settings(max_examples=40, deadline=None)
def test_minima_and_maxima_alternate_and_are_stationary(kind, beta0, lam):
    form = FORMS[kind]
    points = form.at(beta0).critical_points(lam)
    assert 0.0 in [point.alpha1 for point in points]
    kinds = [point.kind for point in points if point.kind != "inflection"]
    assert all(one != other for one, other in itertools.pairwise(kinds))
    assert kinds[0] == kinds[-1] == "minimum"
    for point in points:
        assert abs(float(form.derivative(point.alpha1, beta0, lam))) < 1e-9


@each_form
@given(beta0=st.floats(0.1, 20.0))
@settings(max_examples=25, deadline=None)
def test_maxwell_lies_between_fold_and_zero_at_equal_depth(kind, beta0):
    form = FORMS[kind]
    (fold, at_fold), (maxwell, at_maxwell) = form.fold(beta0), form.maxwell(beta0)
    assert fold < maxwell < 0.0
    assert at_maxwell < at_fold < 0.0
    scale = abs(float(form.potential(at_fold, beta0, fold)))
    assert abs(float(form.potential(at_maxwell, beta0, maxwell))) < 1e-8 * scale
    delay = form.delay(beta0)
    assert delay[0] == 0.0
    assert delay[1] < at_maxwell


@each_form
def test_the_deepest_minimum_switches_at_the_maxwell_point(kind):
    U = FORMS[kind].at(4.0)
    lam, alpha1 = U.maxwell()

    def deepest(level):
        return min(U.critical_points(level), key=lambda point: point.potential).alpha1

    assert deepest(lam - 1e-6) == 0.0
    assert deepest(lam + 1e-6) == pytest.approx(alpha1, abs=1e-4)


@each_form
def test_barriers_cross_at_the_maxwell_point_and_vanish_at_the_ends(kind):
    form = FORMS[kind]
    U = form.at(4.0)
    fold, maxwell = U.fold()[0], U.maxwell()[0]
    assert U.barrier(maxwell) == pytest.approx(U.barrier(maxwell, "detached"), rel=1e-9)
    assert U.barrier(-1e-4) < 1e-6 < U.barrier(-1e-4, "detached")
    assert U.barrier(fold + 1e-4, "detached") < 1e-4 < U.barrier(fold + 1e-4)


@each_form
def test_pitchfork_at_beta0_zero(kind):
    form = FORMS[kind]
    assert form.fold(0.0) == form.maxwell(0.0) == form.delay(0.0) == (0.0, 0.0)
    assert form.alpha1(0.0, -0.1).size == 0
    lower, upper = form.alpha1(0.0, 0.1)
    assert lower == pytest.approx(-upper, rel=1e-12)
    assert [point.kind for point in form.at(0.0).critical_points(0.0)] == ["minimum"]


def test_points_of_the_plane_come_as_arrays_too():
    lam, alpha1 = FORMS["uniform"].fold(np.array([[1.0, 2.0], [4.0, 0.0]]))
    assert lam.shape == alpha1.shape == (2, 2)
    assert lam[0, 1] == FORMS["uniform"].fold(2.0)[0]


def test_a_positive_factor_moves_the_maxwell_point_as_documented():
    a2 = FORMS["exact"].a2
    for power, ratio in ((0, 8 / 9), (1, 0.8693), (-1, 0.9057)):
        # dU = (p/T0)^power times the normal form at lambda = share of the fold's
        level = -ratio * a2 * a2 / 4
        lower = -0.5 * a2 - math.sqrt(a2 * a2 / 4 + level)
        depth = quad(lambda a, p=power, q=level: (1 + a) ** p * a * (a * a + a2 * a - q), 0, lower)[0]
        assert abs(depth) < 1e-6


def test_uniform_potential_ends_where_the_series_does():
    form = FORMS["uniform"]
    low, high = form.at(20.0).domain
    assert np.isnan(form.potential([low - 0.1, high + 0.1], 20.0, 0.0)).all()
    assert np.isfinite(form.potential([low, high], 20.0, 0.0)).all()


# From a branch


@pytest.mark.parametrize("beta0", [1.0, 4.0, 10.0])
def test_branch_potential_agrees_with_the_series(beta0):
    U, form = branch_potential(branch(beta0, -1.2 * beta0, 0.2 * beta0)), FORMS["uniform"]
    assert U.fold() == pytest.approx(form.fold(beta0), rel=1e-9)
    assert U.maxwell() == pytest.approx(form.maxwell(beta0), rel=1e-9)
    assert U.delay()[1] == pytest.approx(form.delay(beta0)[1], rel=1e-9)
    x = np.linspace(-beta0, 0.1 * beta0, 7)
    np.testing.assert_allclose(U(x, -0.1), form.potential(x, beta0, -0.1), atol=1e-8 * beta0**4)


@pytest.mark.parametrize(
    ("beta0", "fold", "maxwell"),
    [
        (1.0, -0.01676786333, -0.01490454199),
        (2.0, -0.06710706498, -0.05964711112),
        (4.0, -0.26900108827, -0.23905383612),
        (10.0, -1.70720906774, -1.51511957687),
        (20.0, -7.26175338680, -6.40726218553),
    ],
)
def test_potential_of_a_traced_branch(beta0, fold, maxwell):
    traced = po.trace(beta0=beta0, lam=(-97.0, 0.002 * beta0**2))
    U = branch_potential(traced)
    assert traced.special("LP-lambda")[0].lam == pytest.approx(fold, abs=2e-11)
    assert U.fold()[0] == pytest.approx(fold, abs=2e-10)
    assert U.maxwell()[0] == pytest.approx(maxwell, abs=2e-11)
    lam, alpha1 = U.maxwell()
    area = quad(lambda x: (lam - float(U.curve(x))) * x, 0.0, alpha1)[0]
    assert abs(area) < 1e-8 * beta0**4
    # A form is worth what its error says: exact() loses with beta0^4, uniform(12) beyond 15.
    exact, uniform = FORMS["exact"], FORMS["uniform"]
    assert abs(exact.fold(beta0)[0] - fold) == pytest.approx(3.0e-6 * beta0**4, rel=0.2)
    assert abs(exact.maxwell(beta0)[0] - maxwell) == pytest.approx(2.4e-6 * beta0**4, rel=0.2)
    for form, point in ((uniform.fold, fold), (uniform.maxwell, maxwell)):
        assert abs(form(beta0)[0] - point) < (2e-11 if beta0 <= 10.0 else 5e-8)


#: beta0 = 4 to 12 digits: the fold by continuation, the Maxwell point by quadrature over 600 points and more.
FOLD = (-0.2690010882735, -1.394282025372)
MAXWELL = (-0.2390538361223, -1.858817790959)


@pytest.mark.parametrize("law", ["linear", "cohesive"])
@pytest.mark.parametrize("points", [8, 12, 16, 24, 48, 128])
def test_errors_of_a_traced_potential_are_honest(law, points):
    U = branch_potential(po.trace(beta0=4.0, lam=(-1.0, 3.0), law=law, points=points))
    assert len(U.kinks) == (law == "cohesive")
    for found, true in ((U.fold(), FOLD), (U.maxwell(), MAXWELL)):
        assert abs(found.lam - true[0]) <= found.error + 1e-13 < 2e-10
        assert abs(found.alpha1 - true[1]) <= found.alpha1_error + 2e-12 < 1e-8
    landed = po.hysteresis(beta0=4.0, points=4).jumps[0].alpha1_after
    delay = U.delay()
    assert delay.error == 0.0
    if law == "linear":  # beyond y0 the two laws land at different places
        assert abs(delay.alpha1 - landed) <= delay.alpha1_error + 1e-10


@pytest.mark.parametrize("points", [32, 64, 128])
def test_a_kink_that_no_point_is_at_makes_no_fold(points):
    law = po.CohesiveLaw(
        [lambda u: 1 - u, lambda u: 0.7 - 2 * (u - 0.3), lambda u: 0.0 * u], kinks=(0.3, 0.65)
    )
    branch = po.trace(beta0=4.0, lam=(-40.0, 3.0), law=law, points=points)
    U = branch_potential(branch)
    (located,) = branch.special("LP-lambda")
    assert abs(U.fold().lam - located.lam) <= U.fold().error + 1e-12
    assert U.fold().alpha1 == pytest.approx(located.alpha1, abs=1e-9)
    found = U.maxwell()
    assert abs(found.lam - -24.481994) <= found.error + 1e-5  # from 500 points, to 4e-6


def test_a_branch_that_does_not_come_from_T_is_refused():
    with pytest.raises(InvalidInput, match="does not come from T"):
        branch_potential(po.trace(beta0=4.0, lam=(-1.0, 3.0), law=po.trapezoidal(0.4), points=32))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("beta0", [0.5, 4.0, 9.0])
def test_the_error_of_an_area_is_what_errors_of_its_points_may_do(beta0, sign):
    exact = NormalForm.uniform(36).at(beta0)
    peeled = exact.delay()
    alpha1, off = np.linspace(1.3 * peeled.alpha1, 0.0, 40), 1e-10
    # All points off to one side by all of their error: the worst there is.
    lam = exact.curve(alpha1) + sign * off * math.pi**4 * (alpha1 < 0.0)
    U = states_potential(BranchStates(beta0, alpha1, lam, error=np.full(40, off)))
    area, error = U.area(U.fold(), U.delay())
    missed = abs(area - exact.area(exact.fold(), peeled)[0])
    assert missed <= 1.0001 * error
    assert error <= 1.1 * missed


def test_critical_points_and_areas_have_errors():
    traced = po.trace(beta0=4.0, lam=(-1.0, 1.0), law="cohesive", points=16, at={"lam": [-0.2]})
    U = branch_potential(traced)
    solved = traced.alpha1[np.abs(traced.lam + 0.2) < 1e-12]
    for point in U.critical_points(-0.2):
        if point.alpha1:
            assert np.abs(solved - point.alpha1).min() <= point.error + 1e-12
            assert point.potential_error < 1e-6
    fine = branch_potential(po.trace(beta0=4.0, lam=(-1.0, 1.0), law="cohesive", points=200))
    area, error = U.area(U.fold(), U.delay())
    assert abs(area - fine.area(fine.fold(), fine.delay())[0]) <= error < 1e-4
    assert math.isnan(NormalForm.paper().at(4.0).maxwell().error)
    assert math.isnan(NormalForm.paper().at(4.0).error)
    assert abs(FORMS["uniform"].maxwell(4.0)[0] - MAXWELL[0]) <= FORMS["uniform"].maxwell(4.0).error + 1e-13


@pytest.mark.parametrize("beta0", [1.0, 20.0, 37.5])
@pytest.mark.parametrize("points", [8, 40])
def test_errors_are_honest_up_to_the_corner(beta0, points):
    traced = po.trace(beta0=beta0, lam=(-97.0, 0.002 * beta0**2), points=points)
    U = branch_potential(traced)
    true = {1.0: -0.014904541991, 20.0: -6.407262185532, 37.5: -34.255774994}[beta0]
    assert abs(U.maxwell().lam - true) <= U.maxwell().error + 1e-9 * abs(true)
    (located,) = traced.special("LP-lambda")
    assert abs(U.fold().alpha1 - located.alpha1) <= U.fold().alpha1_error + 1e-10


@pytest.mark.parametrize("kind", [*FORMS, "traced"])
def test_potentials_travel_between_processes_and_say_what_they_are(kind):
    U = FORMS[kind].at(4.0) if kind != "traced" else branch_potential(po.trace(beta0=4.0, lam=(-1.0, 0.5)))
    again = pickle.loads(pickle.dumps(U))
    assert again.maxwell() == U.maxwell()
    assert repr(again.maxwell().error) == repr(U.maxwell().error)
    assert U.beta0 == 4.0
    assert "at beta0 = 4, alpha1 from" in repr(U)


def test_a_factor_moves_the_maxwell_point_of_a_traced_branch_too():
    U = branch_potential(po.trace(beta0=4.0, lam=(-1.0, 0.05)))
    for power, ratio in ((-1, 0.905503), (0, 0.888672), (1, 0.869019)):
        lam = ratio * U.fold()[0]
        lower = float(U.alpha1(lam)[0])

        def slope(x, p=power, level=lam):
            return (1.0 + x / 4.0) ** p * x * (level - float(U.curve(x)))

        scale = quad(lambda x: abs(slope(x)), lower, 0.0)[0]
        assert abs(quad(slope, 0.0, lower)[0]) < 2e-5 * scale


def test_branch_potential_adds_T_and_does_not_care_for_the_direction():
    forward = branch(4.0, -5.0, -0.05)
    backward = SimpleNamespace(lam=forward.lam[::-1], alpha1=forward.alpha1[::-1], beta0=np.full(161, 4.0))
    assert branch_potential(forward).maxwell() == pytest.approx(
        branch_potential(backward).maxwell(), rel=1e-12
    )
    assert branch_potential(forward).maxwell() == pytest.approx(FORMS["uniform"].maxwell(4.0), rel=1e-8)


def test_branch_potential_uses_the_part_on_which_alpha1_is_monotone():
    good = branch(4.0, -5.0, 1.0)
    turned = SimpleNamespace(
        lam=np.append([7.0, 6.0], good.lam), alpha1=np.append([-4.0, -4.5], good.alpha1), beta0=4.0
    )
    assert branch_potential(turned).maxwell() == pytest.approx(branch_potential(good).maxwell(), rel=1e-10)


def test_short_branches_say_what_they_lack():
    # What lies beyond a branch that was cut is not denied.
    with pytest.raises(NotConverged, match=r"no fold .* Trace the branch further"):
        branch_potential(branch(4.0, -1.0, 1.0)).fold()
    with pytest.raises(NotConverged, match="no Maxwell point"):
        branch_potential(branch(4.0, -1.6, 1.0)).maxwell()
    with pytest.raises(NotConverged, match="lambda = 0"):
        branch_potential(branch(4.0, -2.0, 1.0)).delay()
    with pytest.raises(InvalidInput, match="too few"):
        branch_potential(branch(4.0, -2.0, 1.0, points=4))
    mixed = branch(4.0, -2.0, 1.0)
    mixed.beta0 = np.linspace(1.0, 4.0, mixed.lam.size)
    with pytest.raises(InvalidInput, match="one beta0"):
        branch_potential(mixed)


# Fits


def test_fit_gives_back_the_form_it_is_shown():
    alpha1 = np.linspace(-4.0, 1.0, 50)
    shown = SimpleNamespace(lam=FORMS["paper"].lam(alpha1, 4.0), alpha1=alpha1, beta0=4.0)
    form = NormalForm.fit(shown)
    assert (form.a1, form.a2) == pytest.approx((-7.29, 0.696), rel=1e-12)
    assert max(form.quality.uncertainty) < 1e-10


def test_fit_of_the_true_branch_gives_the_papers_numbers_and_drifts_to_the_exact_ones():
    truth = branch(4.0, -8.0, 5.0, 2001)
    fit = NormalForm.fit(truth, window=1.0)
    assert fit.a1 == pytest.approx(-7.29, abs=0.005)
    assert fit.a2 == pytest.approx(0.696, abs=0.0015)
    assert fit.kind == "fit"
    assert fit.quality.drift[0] == pytest.approx(fit.a1 - NormalForm.fit(truth, window=0.5).a1, abs=1e-14)
    assert fit.quality.uncertainty[0] > math.sqrt(fit.quality.covariance[0][0])
    small = NormalForm.fit(branch(0.2, -0.3, 0.2, 2001), window=0.01)
    exact = FORMS["exact"]
    assert small.a1 == pytest.approx(exact.a1, rel=1e-3)
    assert abs(NormalForm.fit(truth, window=3.0).a1 - exact.a1) > abs(fit.a1 - exact.a1)


def test_fit_to_several_branches_at_once():
    parts = [branch(b, -5.0, 3.0) for b in (0.0, 2.0, 4.0)]
    joined = SimpleNamespace(
        lam=np.concatenate([p.lam for p in parts]),
        alpha1=np.concatenate([p.alpha1 for p in parts]),
        beta0=np.repeat([0.0, 2.0, 4.0], 161),
    )
    assert NormalForm.fit(joined).a1 == pytest.approx(-7.30, abs=0.01)
    one_by_one = NormalForm.fit(parts)
    assert one_by_one.a1 == pytest.approx(-7.30, abs=0.01)
    assert one_by_one.quality.points == NormalForm.fit(joined).quality.points


def test_fit_of_a_traced_branch_gives_the_papers_numbers():
    fit = NormalForm.fit(po.trace(beta0=4.0, lam=(-1.0, 3.0)))
    assert (round(fit.a1, 2), round(fit.a2, 3)) == (-7.29, 0.697)  # the paper: -7.29, 0.696
    assert 0.0 < fit.quality.uncertainty[0] < 0.05


@given(seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_fit_does_not_care_where_points_crowd(seed):
    even = branch(4.0, -5.0, 3.0, 601)
    rng = np.random.default_rng(seed)
    alpha1 = np.sort(
        np.concatenate([np.linspace(-5.0, 3.0, 201), rng.uniform(-4.0, 1.0) + np.linspace(0, 1, 600)])
    )
    crowded = SimpleNamespace(lam=uniform_series(30).curve(alpha1, 4.0), alpha1=alpha1, beta0=4.0)
    for window in (0.5, 1.0, 2.0):
        here, there = NormalForm.fit(even, window), NormalForm.fit(crowded, window)
        assert here.a1 == pytest.approx(there.a1, abs=1e-3)
        assert here.a2 == pytest.approx(there.a2, abs=2e-4)


def test_bad_branches_for_a_fit():
    with pytest.raises(InvalidInput, match="a fit needs three"):
        NormalForm.fit(branch(4.0, -1.0, 1.0), window=1e-9)
    with pytest.raises(InvalidInput, match="beta0 = 0"):
        NormalForm.fit(branch(0.0, -2.0, 2.0))
    with pytest.raises(InvalidInput, match="window"):
        NormalForm.fit(branch(4.0, -1.0, 1.0), window=-1.0)
    broken = branch(4.0, -1.0, 1.0)
    broken.lam[3] = np.nan
    with pytest.raises(InvalidInput, match="not finite"):
        NormalForm.fit(broken)
    with pytest.raises(InvalidInput, match="one length"):
        NormalForm.fit(SimpleNamespace(lam=[1.0, 2.0], alpha1=[1.0], beta0=1.0))
    with pytest.raises(InvalidInput, match="zero or positive"):
        NormalForm.fit(SimpleNamespace(lam=[0.1] * 4, alpha1=[1.0] * 4, beta0=-1.0))


def test_three_points_are_enough_but_leave_the_drift_open():
    quality = NormalForm.fit(branch(4.0, -2.0, -1.0, 3), window=0.3).quality
    assert quality.points == 3
    assert np.isnan(quality.drift).all()
    assert np.isfinite(quality.uncertainty).all()


# Bad input


@each_form
@pytest.mark.parametrize("beta0", [-1.0, math.nan, math.inf])
def test_bad_beta0(kind, beta0):
    form = FORMS[kind]
    for call in (form.fold, form.maxwell, form.delay, form.at):
        with pytest.raises(InvalidInput, match="beta0"):
            call(beta0)


def test_beyond_the_series_there_is_an_error_with_a_remedy():
    with pytest.raises(NoEquilibrium, match="smaller beta0"):
        FORMS["uniform"].fold(37.0)
    with pytest.raises(NoEquilibrium, match="two minima"):
        FORMS["exact"].at(4.0).barrier(0.1)
    with pytest.raises(InvalidInput, match="'adhered' or 'detached'"):
        FORMS["exact"].at(4.0).barrier(-0.1, "up")
    with pytest.raises(OutOfRange):
        NormalForm.uniform(99)


# Design relations


def test_fold_pressure_of_the_paper():
    rod, form = FLAP, FORMS["paper"]
    assert design.fold_pressure(rod, form) / 140e3 == pytest.approx(0.652)


def test_profile_solves_the_equation_of_state_and_passes_the_points_of_fig_10():
    rod = FLAP
    sigma, form = np.array([3.3, 3.6, 4.0]), FORMS["exact"]
    excess = design.pressure_profile(rod, rod.eta * sigma) / 140e3 - 1.0
    scaled = rod.ratio / sigma**2 - math.pi**4 / sigma**6
    assert np.abs(excess**3 + form.a2 * excess**2 + form.a1 * scaled * excess).max() < 1e-14  # (37)
    fig10 = design.pressure_profile(Rod.from_ratio(0.566), np.array([2.128, 5.664]) / 0.566, FORMS["paper"])
    np.testing.assert_allclose(fig10, 0.25, atol=1e-4)


def test_profile_starts_at_the_fold():
    rod, form = Rod.from_ratio(2.0), FORMS["exact"]
    length = np.linspace(2.0, 3.0, 20001)
    pressure = design.pressure_profile(rod, length, form)
    first = int(np.argmax(np.isfinite(pressure)))
    assert np.isnan(pressure[:first]).all()
    assert pressure[first] == pytest.approx(design.fold_pressure(rod, form), abs=0.02)


def test_small_ratios_tend_to_the_plateau():
    rod = Rod.from_ratio(1e-4)
    assert design.pressure_profile(rod, 60.0) == pytest.approx(1.0 - FORMS["exact"].a2, abs=1e-6)  # (41)


@pytest.mark.parametrize("source", ["paper", "exact"])
@given(ratio=st.floats(0.05, 1000.0))
@settings(max_examples=40, deadline=None)
def test_maxwell_length_solves_42(source, ratio):
    s = design.maxwell_length(ratio, source)
    form = FORMS[source]
    left, right = s**4 / ratio**3 - math.pi**4, 2 / (9 * form.a1) * (form.a2 * s**3 / ratio**3) ** 2
    assert left == pytest.approx(right, abs=1e-12 * math.pi**4 + 1e-12 * abs(right))
    exponent = design.maxwell_exponent(ratio, source)
    step = math.log(
        design.maxwell_length(ratio * 1.0001, source) / design.maxwell_length(ratio / 1.0001, source)
    )
    assert exponent == pytest.approx(step / (2 * math.log(1.0001)), abs=1e-6)
    assert 0.75 < exponent < 1.0


def test_maxwell_length_tends_to_the_critical_length_for_stiff_rods():
    rod = Rod.from_ratio(1000.0)
    assert design.maxwell_length(1000.0) == pytest.approx(rod.critical_length / rod.adhesion_range, rel=1e-5)
    assert design.maxwell_exponent(1e4) == pytest.approx(0.75, abs=1e-6)


@pytest.mark.parametrize("ratio", [0.0, -1.0, math.nan, [1.0, math.inf]])
def test_bad_ratio(ratio):
    with pytest.raises(InvalidInput, match="ratio"):
        design.maxwell_length(ratio)


def test_sources_say_what_they_need():
    with pytest.raises(InvalidInput, match="six points"):
        design.maxwell_length(1.0, "branch", curve=SimpleNamespace(beta0=[1.0], lam=[-0.01]))
    with pytest.raises(InvalidInput, match="source"):
        design.maxwell_length(1.0, "guess")
    with pytest.raises(InvalidInput, match="closed formulas"):
        design.fold_pressure(Rod.from_ratio(1.0), FORMS["uniform"])
    with pytest.raises(InvalidInput, match="length"):
        design.pressure_profile(Rod.from_ratio(1.0), [1.0, -1.0])
