"""The derivations of the paper, by automatic differentiation and quadrature."""

from __future__ import annotations

import math
from collections.abc import Callable

import casadi as ca
import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from peel_opt.model import equations as elastica
from peel_opt.model.bond import COHESIVE, LINEAR, CohesiveLaw

PI, PI4 = math.pi, math.pi**4
XI = np.linspace(0.0, 1.0, 41)
Field = Callable[[float], float]


def at(function: ca.Function, xi: np.ndarray) -> np.ndarray:
    return function(xi.reshape(1, -1)).full()


def mean(f: Callable[[float], float]) -> float:
    return quad(f, 0.0, 1.0, epsabs=1e-14, epsrel=1e-13)[0]


# ------------------------------------------------- Appendix A: Euler-Lagrange equations, free end point


class SmoothRod:
    """Smooth fields that meet theta'(0) = N(0) = 0 and theta = y = x = 0 at sbar, but nothing else."""

    k, p, sbar = 1.7, 0.9, 2.3

    def __init__(self) -> None:
        s = ca.SX.sym("s")
        left = self.sbar - s
        fields = {
            "theta": 0.31 * (ca.cos(2.0 * s) - math.cos(2.0 * self.sbar)) + 0.05 * s**2 * left,
            "x": -left * (1.0 + 0.1 * ca.sin(s)),
            "y": 0.4 * left * (0.3 + ca.exp(-s)),
            "Nx": 0.6 * ca.sin(1.3 * s),
            "Ny": -0.8 * s + 0.2 * s**3,
        }
        values = ca.vertcat(*fields.values())
        first = ca.jacobian(values, s)
        self.fields, self.first, self.second = (
            ca.Function("field", [s], [v]) for v in (values, first, ca.jacobian(first, s))
        )

    def adhesion(self, y: float) -> float:
        return -0.7 * (1.0 - 0.6 * y)

    def equations(self, s: np.ndarray) -> np.ndarray:
        """Coefficients of the variations of theta, x, y, Nx, Ny in (4) less (5)."""
        theta, _, y, nx, ny = at(self.fields, s)
        _, dx, dy, dnx, dny = at(self.first, s)
        return np.array(
            [
                -self.k * at(self.second, s)[0] - nx * np.sin(theta) + ny * np.cos(theta),
                dnx + self.p * np.sin(theta),
                dny - self.p * np.cos(theta) - self.adhesion(y),
                -(dx - np.cos(theta)),
                -(dy - np.sin(theta)),
            ]
        )

    def discrete(self, cells: int) -> tuple[np.ndarray, float]:
        """Differentiate the energy (2) less the virtual work (3) on a grid of s = sbar xi.

        Returns the derivatives by the nodal values, over the spacing, and by sbar with the values held.
        """
        q = [ca.SX.sym(name, cells + 1) for name in ("theta", "x", "y", "Nx", "Ny")]
        sbar, dr = ca.SX.sym("sbar"), [ca.SX.sym(name, cells + 1) for name in ("dx", "dy")]
        h = sbar / cells

        def mid(v: ca.SX) -> ca.SX:
            return 0.5 * (v[1:] + v[:-1])

        def slope(v: ca.SX) -> ca.SX:
            return (v[1:] - v[:-1]) / h

        theta, x, y, nx, ny = q
        sine, cosine = ca.sin(mid(theta)), ca.cos(mid(theta))
        energy = h * ca.sum1(
            0.5 * self.k * slope(theta) ** 2 - mid(nx) * (slope(x) - cosine) - mid(ny) * (slope(y) - sine)
        )
        normal = (sine, -cosine)
        force = (-self.p * normal[0], -self.p * normal[1] + self.adhesion(mid(y)))
        work = h * ca.sum1(force[0] * mid(dr[0]) + force[1] * mid(dr[1]))

        # values held at xi: the material point s = sbar xi moves by -r' xi per unit of sbar
        xi = ca.DM(np.linspace(0.0, 1.0, cells + 1))
        by_sbar = ca.jacobian(energy, sbar) + h * ca.sum1(
            mid(xi) * (force[0] * slope(x) + force[1] * slope(y))
        )
        by_nodes = ca.horzcat(*(ca.gradient(energy, v) for v in q))
        by_nodes[:, 1] -= ca.gradient(work, dr[0])
        by_nodes[:, 2] -= ca.gradient(work, dr[1])
        f = ca.Function("variation", [*q, sbar], [by_nodes / h, by_sbar])
        values = at(self.fields, np.linspace(0.0, self.sbar, cells + 1))
        nodes, end = f(*values, self.sbar)
        return nodes.full().T, float(end)


def orders(errors: list[float]) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def test_energy_and_virtual_work_give_the_equilibrium_equations() -> None:
    rod, errors = SmoothRod(), []
    for cells in (20, 40, 80, 160):
        s = np.linspace(0.0, rod.sbar, cells + 1)[1:-1]
        errors.append(np.abs(rod.discrete(cells)[0][:, 1:-1] - rod.equations(s)).max())
    assert errors[-1] < 1e-3
    np.testing.assert_allclose(orders(errors), 2.0, atol=0.05)


def test_free_end_point_gives_the_condition_of_weierstrass_and_erdmann() -> None:
    """The coefficient of delta sbar is -k/2 theta'(sbar)^2, (47), so that (49) closes the problem.

    The end point slides along the plate, delta x = delta sbar there; all other variations at fixed s
    are -xi times the slope of their field, and their share is the integral in (47).
    """
    rod = SmoothRod()
    curvature = float(at(rod.first, np.array([rod.sbar]))[0, 0])
    assert abs(curvature) > 0.1

    def integrand(s: float) -> float:
        point = np.array([s])
        xi = s / rod.sbar
        theta, x, y, nx, ny = -xi * at(rod.first, point)[:, 0]
        return float(rod.equations(point)[:, 0] @ [theta, x + xi, y, nx, ny])

    interior = quad(integrand, 0.0, rod.sbar, epsabs=1e-12)[0]
    errors = []
    for cells in (20, 40, 80, 160):
        by_nodes, by_sbar = rod.discrete(cells)
        sliding = np.linspace(0.0, 1.0, cells + 1)  # delta x = xi delta sbar
        found = by_sbar + rod.sbar / cells * by_nodes[1] @ sliding - interior
        errors.append(abs(found + 0.5 * rod.k * curvature**2))
    assert errors[-1] < 1e-3
    np.testing.assert_allclose(orders(errors), 2.0, atol=0.1)


def test_boundary_terms_are_the_natural_conditions_and_the_reactions() -> None:
    """At s = 0 they are the conditions (7a); at the plate they are reactions and need not vanish."""
    rod = SmoothRod()
    by_nodes, _ = rod.discrete(2000)
    h = rod.sbar / 2000
    np.testing.assert_allclose(h * by_nodes[:3, 0], 0.0, atol=3 * h)  # k theta', Nx, Ny at s = 0
    theta, nx, ny = at(rod.first, np.array([rod.sbar]))[0, 0], *at(rod.fields, np.array([rod.sbar]))[3:, 0]
    np.testing.assert_allclose(h * by_nodes[:3, -1], [rod.k * theta, -nx, -ny], atol=3 * h)


def test_scaling_turns_the_equilibrium_equations_into_the_groups() -> None:
    rng = np.random.default_rng(12)
    for _ in range(20):
        k, T0, y0, sbar, p = rng.uniform(0.2, 3.0, 5)
        theta, theta_ss, nx, nx_s, ny, ny_s, y = rng.normal(size=7)
        f = -T0 * (1.0 - y / y0)
        eta = math.cbrt(k / T0)
        alpha, beta0, beta1 = sbar**3 * p / k, (sbar / eta) ** 3, (sbar / eta) ** 3 * sbar / y0
        physical = np.array(
            [
                k * theta_ss + nx * math.sin(theta) - ny * math.cos(theta),
                nx_s + p * math.sin(theta),
                ny_s - p * math.cos(theta) - f,
            ]
        )
        force = sbar**2 / k
        scaled = np.array(
            [
                sbar**2 * theta_ss + force * (nx * math.sin(theta) - ny * math.cos(theta)),
                sbar * force * nx_s + alpha * math.sin(theta),
                sbar * force * ny_s - alpha * math.cos(theta) + beta0 - beta1 * y / sbar,
            ]
        )
        np.testing.assert_allclose(
            scaled, physical * [force, sbar * force, sbar * force], rtol=1e-12, atol=1e-12
        )


# --------------------------------------------------------------- Appendix B: the critical condition


def matrix_50(g: mpmath.mpf) -> mpmath.matrix:
    e, c, s = mpmath.exp, mpmath.cos(g), mpmath.sin(g)
    return mpmath.matrix(
        [
            [g, -g, 0, g],
            [e(g), e(-g), c, s],
            [e(g) * g, -e(-g) * g, -g * s, g * c],
            [g**2, g**2, -(g**2), 0],
        ]
    )


@pytest.mark.parametrize("gamma", ["0.3", "1", "2.5", "7.7"])
def test_determinant_of_the_linear_problem(gamma: str) -> None:
    with mpmath.workdps(30):
        g = mpmath.mpf(gamma)
        expected = -4 * g**4 * mpmath.sin(g) * mpmath.sinh(g)  # (51)
        assert abs(mpmath.det(matrix_50(g)) / expected - 1) < mpmath.mpf("1e-24")


@pytest.mark.parametrize("n", [1, 2, 3])
def test_modes_are_the_roots_of_the_determinant(n: int) -> None:
    with mpmath.workdps(40):
        matrix = matrix_50(n * mpmath.pi)
        # sinh grows like the entries: compare with the determinant half way to the next root
        scale = abs(mpmath.det(matrix_50((n + mpmath.mpf("0.5")) * mpmath.pi)))
        assert abs(mpmath.det(matrix)) < mpmath.mpf("1e-34") * scale
        null = mpmath.lu_solve(matrix[:3, :3], -matrix[:3, 3])
        assert abs(matrix[3, 0] * null[0] + matrix[3, 1] * null[1] + matrix[3, 2] * null[2]) < 1e-30
    lam = (n * PI) ** 4 - PI4
    assert lam == pytest.approx([0.0, 15.0 * PI4, 80.0 * PI4][n - 1], abs=1e-9)


def test_no_other_critical_loads() -> None:
    gamma = np.linspace(0.05, 4 * PI - 0.07, 1000)
    values = [float(mpmath.det(matrix_50(mpmath.mpf(g)))) / (g**4 * math.sinh(g)) for g in gamma]
    changes = gamma[:-1][np.diff(np.sign(values)) != 0.0]
    np.testing.assert_allclose(changes, PI * np.array([1, 2, 3]), atol=0.02)


# ------------------------------------------------------------------------- kernel and adjoint kernel


def kernel_22(beta0: float) -> ca.Function:
    xi = ca.SX.sym("xi")
    e = ca.exp
    E = math.exp(PI)
    up, down = e(PI * xi), e(PI - PI * xi)
    sine, cosine = ca.sin(PI * xi), ca.cos(PI * xi)
    theta = (
        (up + down) / (2 * (E - 1) * PI**3) + sine / (2 * PI**3) + (1 + E) * cosine / (2 * (E - 1) * PI**3)
    )
    nx = (
        beta0 * (-up + down + 2 - 2 * E) / (2 * (E - 1) * PI4)
        - (1 + E) * beta0 * sine / (2 * (E - 1) * PI4)
        + beta0 * cosine / (2 * PI4)
    )
    ny = -(up + down) / (2 * PI - 2 * E * PI) - sine / (2 * PI) + (1 + E) * cosine / (2 * PI - 2 * E * PI)
    y = (
        (up - down + 2 - 2 * E) / (2 * (E - 1) * PI4)
        + (1 + E) * sine / (2 * (E - 1) * PI4)
        - cosine / (2 * PI4)
    )
    return ca.Function("u0", [xi], [ca.vertcat(theta, nx, ny, y, 1.0)])


def adjoint_25() -> ca.Function:
    xi = ca.SX.sym("xi")
    S, C = math.sinh(PI / 2), math.cosh(PI / 2)
    sinh, cosh = ca.sinh(PI * (0.5 - xi)), ca.cosh(PI * (0.5 - xi))
    sine, cosine = ca.sin(PI * xi), ca.cos(PI * xi)
    falling = sinh - S * cosine - C * sine
    return ca.Function(
        "v0",
        [xi],
        [
            ca.vertcat(
                sinh + S * cosine + C * sine,
                0.0 * xi,
                (cosh - S * sine + C * cosine) / PI,
                PI**2 * falling,
                falling / PI**2,
            )
        ],
    )


def derivative(function: ca.Function) -> ca.Function:
    xi = ca.SX.sym("xi")
    return ca.Function("d", [xi], [ca.jacobian(function(xi), xi)])


def operator_21(U: ca.Function, beta0: float) -> Callable[[np.ndarray], np.ndarray]:
    d, dd = derivative(U), derivative(derivative(U))

    def L(xi: np.ndarray) -> np.ndarray:
        theta, _, ny, y, alpha1 = at(U, xi)
        _, dnx, dny, dy, dalpha1 = at(d, xi)
        return np.array(
            [at(dd, xi)[0] - ny, dnx + beta0 * theta, dny - alpha1 - PI4 * y, dy - theta, dalpha1]
        )

    return L


def operator_24(Phi: ca.Function, beta0: float) -> Callable[[np.ndarray], np.ndarray]:
    d, dd = derivative(Phi), derivative(derivative(Phi))

    def adjoint(xi: np.ndarray) -> np.ndarray:
        p1, p2, p3, p4, _ = at(Phi, xi)
        _, d2, d3, d4, d5 = at(d, xi)
        return np.array([at(dd, xi)[0] + beta0 * p2 - p4, -d2, -d3 - p1, -d4 - PI4 * p3, -d5 - p3])

    return adjoint


@pytest.mark.parametrize("beta0", [0.0, 4.0, 10.0])
def test_kernel_solves_the_linear_problem(beta0: float) -> None:
    u0 = kernel_22(beta0)
    np.testing.assert_allclose(operator_21(u0, beta0)(XI), 0.0, atol=1e-13)
    tip, plate = at(u0, np.array([0.0, 1.0])).T
    slope = at(derivative(u0), np.array([0.0, 1.0]))[0]
    np.testing.assert_allclose([tip[1], tip[2], slope[0]], 0.0, atol=1e-15)  # (14a)
    np.testing.assert_allclose([plate[0], slope[1], plate[3]], 0.0, atol=1e-15)  # (14b)


def test_adjoint_kernel_solves_the_adjoint_problem() -> None:
    v0 = adjoint_25()
    np.testing.assert_allclose(operator_24(v0, 4.0)(XI), 0.0, atol=1e-11)
    tip, plate = at(v0, np.array([0.0, 1.0])).T
    slope = at(derivative(v0), np.array([0.0]))[0, 0]
    conditions = [slope, plate[1], plate[2], tip[3], tip[4], plate[4]]
    np.testing.assert_allclose(conditions, 0.0, atol=1e-13)


def test_adjoint_belongs_to_the_operator() -> None:
    """<L U, Phi> = <U, L+ Phi> for any U under (14) and Phi under the conditions below (24)."""
    rng, xi, beta0 = np.random.default_rng(24), ca.SX.sym("xi"), 4.0

    def any_field() -> ca.SX:
        a, b, c = rng.normal(size=3)
        return a + b * xi + c * ca.sin(2.0 * xi)

    left = 1 - xi
    for _ in range(3):
        U = [xi**2 * left**2 * any_field() + 1.3 * (1 + 2 * xi) * left**2, xi * any_field(), xi * any_field()]
        U += [left * any_field(), any_field()]
        Phi = [xi**2 * any_field() + 0.7, left * any_field(), left * any_field(), xi * any_field()]
        Phi += [xi * left * any_field()]
        fU, fPhi = (ca.Function("f", [xi], [ca.vertcat(*v)]) for v in (U, Phi))
        LU, LPhi = operator_21(fU, beta0), operator_24(fPhi, beta0)
        direct = mean(lambda x, LU=LU, f=fPhi: float((LU(np.array([x])) * at(f, np.array([x]))).sum()))
        moved = mean(lambda x, LP=LPhi, f=fU: float((LP(np.array([x])) * at(f, np.array([x]))).sum()))
        assert direct == pytest.approx(moved, rel=1e-11, abs=1e-11)


def test_transition_is_transversal_and_leans_as_its_coefficients_say() -> None:
    """Second order of (32): lambda = beta0 alpha1 a2/|a1| with a2/|a1| in closed form."""
    beta0 = 1.0
    u0, v0 = kernel_22(beta0), adjoint_25()

    def product(f: Callable[[np.ndarray, np.ndarray], float]) -> float:
        return mean(lambda x: float(f(at(u0, np.array([x]))[:, 0], at(v0, np.array([x]))[:, 0])))

    transversal = product(lambda u, v: -u[3] * v[2])
    assert abs(transversal) > 1e-3
    quadratic = product(lambda u, v: v[0] * u[1] * u[0] + v[2] * 0.5 * beta0 * u[0] ** 2)
    lean = -quadratic / transversal
    closed = 1 / PI**2 - 2 * (math.cosh(PI) - 7) / (5 * PI**3 * math.sinh(PI))
    assert lean == pytest.approx(closed, rel=1e-11)
    assert closed == pytest.approx(0.697145349376 / 7.247458102099, rel=1e-11)


def test_nonlinear_remainder() -> None:
    """(29) is (12) less (21)."""
    rng = np.random.default_rng(29)
    for _ in range(20):
        theta, nx, ny, y, alpha1, beta0, lam = rng.normal(size=7)
        s, c = math.sin(theta), math.cos(theta)
        full = [nx * s - ny * c, (beta0 + alpha1) * s, -(beta0 + alpha1) * c + beta0 - (PI4 + lam) * y, -s]
        linear = [-ny, beta0 * theta, -alpha1 - PI4 * y, -theta]
        remainder = [
            nx * s + ny * (1 - c),
            beta0 * (s - theta) + alpha1 * s,
            (beta0 + alpha1) * (1 - c) - lam * y,
            theta - s,
        ]
        np.testing.assert_allclose(np.subtract(full, linear), remainder, rtol=1e-12, atol=1e-12)


# -------------------------------------------------------------------------- the model of the package


def test_kernel_of_the_package_is_the_kernel_of_the_paper() -> None:
    theta, _, ny, y, _ = at(kernel_22(4.0), XI)
    second = at(derivative(derivative(kernel_22(4.0))), XI)[0]
    found = elastica.kernel(XI)
    scale = -1.0 / theta[0]  # Theta(0) = -1
    np.testing.assert_allclose(found["Theta"], scale * theta, atol=1e-14)
    np.testing.assert_allclose(found["K"], scale * at(derivative(kernel_22(4.0)), XI)[0], atol=1e-13)
    np.testing.assert_allclose(found["ny"], scale * second, atol=1e-13)
    np.testing.assert_allclose(found["ny"], scale * ny, atol=1e-13)
    np.testing.assert_allclose(found["Y"], scale * y, atol=1e-14)
    assert float(found["m"]) == pytest.approx(scale, rel=1e-14)


@pytest.mark.parametrize(("law", "piece"), [(LINEAR, 0), (COHESIVE, 0), (COHESIVE, 1)])
@pytest.mark.parametrize("amplitude", [1e-3, 0.009, 0.011, 0.7, 4.0])
def test_rhs_times_the_amplitude_is_12(law: CohesiveLaw, piece: int, amplitude: float) -> None:
    rng = np.random.default_rng(5)
    for _ in range(10):
        Theta, K, nx, ny, Y, m, lam = rng.normal(size=7)
        sigma = rng.uniform(0.5, 3.0)
        A = amplitude
        theta, y, Nx, Ny, alpha1 = A * Theta, A * Y, A * nx, A * ny, A * m
        beta0, beta1 = sigma**3, PI4 + lam
        alpha = beta0 + alpha1
        traction = beta0 - beta1 * y if piece == 0 else 0.0
        expected = [
            A * K,
            Ny * math.cos(theta) - Nx * math.sin(theta),
            -alpha * math.sin(theta),
            alpha * math.cos(theta) - traction,
            math.sin(theta),
        ]
        scalars = elastica.Scalars(A, m, sigma, lam)
        found = elastica.rhs((Theta, K, nx, ny, Y), scalars, law.pieces[piece])
        np.testing.assert_allclose(A * np.array([float(v) for v in found]), expected, rtol=1e-13, atol=1e-13)


def test_rhs_at_zero_amplitude_is_the_linear_problem() -> None:
    rng = np.random.default_rng(13)
    for _ in range(10):
        Theta, K, nx, ny, Y, m, lam = rng.normal(size=7)
        beta0 = 4.0
        scalars = elastica.Scalars(0.0, m, math.cbrt(beta0), lam)
        found = [float(v) for v in elastica.rhs((Theta, K, nx, ny, Y), scalars, LINEAR.pieces[0])]
        expected = [K, ny, -beta0 * Theta, m + (PI4 + lam) * Y, Theta]
        np.testing.assert_allclose(found, expected, rtol=1e-13)


@pytest.mark.parametrize("A", [1e-9, 1e-5, 0.00999, 0.01001])
def test_small_angles_lose_no_digits(A: float) -> None:
    for Theta in (-1.0, -0.3, 0.8):
        with mpmath.workdps(40):
            x = mpmath.mpf(A) * mpmath.mpf(Theta)
            sine, versine = mpmath.sin(x) / mpmath.mpf(A), (1 - mpmath.cos(x)) / mpmath.mpf(A)
        assert float(elastica.sin_over(A, Theta)) == pytest.approx(float(sine), rel=4e-16)
        assert float(elastica.versine_over(A, Theta)) == pytest.approx(float(versine), rel=1e-15)


def test_model_takes_symbols_and_numbers_alike() -> None:
    state, numbers = ca.SX.sym("state", 5), [0.2, -0.4, 0.1, 0.3, -0.6]
    scalars = elastica.Scalars(0.3, -2.0, 1.2, 0.5)
    symbolic = ca.Function("rhs", [state], elastica.rhs(state, scalars, LINEAR.pieces[0]))
    direct = [float(v) for v in elastica.rhs(numbers, scalars, LINEAR.pieces[0])]
    np.testing.assert_allclose([float(v) for v in symbolic(numbers)], direct, rtol=1e-15)


def test_scalars_are_the_groups_of_the_paper() -> None:
    scalars = elastica.Scalars(A=0.2, m=-3.0, sigma=1.5, lam=0.7)
    assert scalars.beta0 == pytest.approx(1.5**3)
    assert scalars.beta1 == pytest.approx(PI4 + 0.7)
    assert scalars.alpha1 == pytest.approx(-0.6)
    assert scalars.alpha == pytest.approx(1.5**3 - 0.6)
    assert scalars.pressure_ratio == pytest.approx(scalars.alpha / scalars.beta0)
    assert scalars.ratio == pytest.approx(scalars.beta1 / scalars.beta0 ** (4 / 3))
    assert scalars.height(0.4) == pytest.approx(
        0.08 * scalars.beta1 / scalars.beta0
    )  # y/y0 = (y/sbar)(sbar/y0)
