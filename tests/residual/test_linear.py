"""The bordered system: its readings against differences of full solves, dense and sparse."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest

from peel_opt.continuation.primary import Family, PrimaryBranch
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.model.equations import SCALARS, Scalars
from peel_opt.residual.closures import TERMS, Closure, Plane, chart, derivatives, miss
from peel_opt.residual.collocation import Collocation
from peel_opt.residual.discretisation import Discretisation
from peel_opt.residual.linear import DenseFactors, Linearised, SparseFactors, gradient, rate
from peel_opt.residual.meshes import PATH
from peel_opt.residual.newton import correct
from peel_opt.residual.shooting import Shooting
from peel_opt.residual.spectral import Spectral

MESHES = [Spectral(16), Shooting(40, "rk4"), Collocation(24)]
GIVEN = (Closure("ratio", 1.0), Closure("pressure", 0.6))


@lru_cache(maxsize=3)
def solved(mesh: object) -> tuple[Discretisation, np.ndarray]:
    """The state at P = 0.6 of the rod of ratio 1, whose tip has not let go."""
    branch = PrimaryBranch(Family(COHESIVE, PATH, GIVEN[0]))
    branch.extend(lambda p: p.scalars.pressure_ratio < 0.6)
    problem = mesh.discretise(branch.points[-1].problem.phases)  # type: ignore[attr-defined]
    result = correct(problem, problem.pack(branch.points[-1].profile), GIVEN)
    assert result.converged
    return problem, result.x


def again(problem: Discretisation, x: np.ndarray, *given: Closure) -> np.ndarray:
    result = correct(problem, x, given)
    assert result.converged
    return result.x


@pytest.mark.parametrize("mesh", MESHES, ids=repr)
def test_the_response_is_the_difference_of_two_solves(mesh: object) -> None:
    problem, x = solved(mesh)
    response = Linearised.at(problem, x, *GIVEN).response()
    h = 1e-4
    for i in range(len(GIVEN)):
        ahead, behind = (
            again(
                problem, x, *(Closure(c.kind, c.value + (s if j == i else 0.0)) for j, c in enumerate(GIVEN))
            )
            for s in (h, -h)
        )
        difference = (ahead - behind) / (2.0 * h)
        np.testing.assert_allclose(response[:, i], difference, atol=1e-6 * np.abs(difference).max())


@pytest.mark.parametrize("mesh", MESHES, ids=repr)
def test_the_adjoint_says_what_a_residue_does_to_a_number(mesh: object) -> None:
    """Against the solution of the system with one of its equations off by a little."""
    problem, x = solved(mesh)
    at = Linearised.at(problem, x, *GIVEN)
    weights = np.array([[1.0, 0.2], [0.0, -0.3], [-2.0, 0.1], [0.5, 0.0]])
    adjoint = at.adjoint(weights)
    full = at.jacobian if isinstance(at.jacobian, np.ndarray) else at.jacobian.toarray()
    matrix = np.vstack([full, np.pad(at.border, ((0, 0), (problem.size - len(SCALARS), 0)))])
    for row in (0, problem.size // 2, problem.size - 1):
        moved = np.linalg.solve(matrix, np.eye(problem.size)[row])
        np.testing.assert_allclose(adjoint[row], moved[-len(SCALARS) :] @ weights, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(at.adjoint(weights[:, 1]), adjoint[:, 1], rtol=1e-9, atol=1e-14)
    degrees = np.abs(matrix) @ np.abs(x)
    once = {problem.identity_row, *(problem.size - 2 + k for k, c in enumerate(GIVEN) if c.kind in TERMS)}
    others = [row for row in range(problem.size) if row not in once]
    np.testing.assert_allclose(at.sizes[others], degrees[others])
    assert np.all(at.sizes <= degrees * (1.0 + 1e-12))


@pytest.mark.parametrize("mesh", MESHES, ids=repr)
def test_the_tangent_goes_to_the_next_solution(mesh: object) -> None:
    problem, x = solved(mesh)
    place, by_scalars = chart(x[problem.tail])
    forward = np.array([1.0, 0.3, 0.2, 0.1])
    tangent = Linearised.at(problem, x, GIVEN[0], Plane.facing(forward)).tangent()
    direction = by_scalars @ tangent[problem.tail]
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert direction @ forward > 0.0
    h = 1e-4
    ahead, behind = (
        again(problem, x + s * tangent, GIVEN[0], Plane.across(place, direction, s)) for s in (h, -h)
    )
    np.testing.assert_allclose(tangent, (ahead - behind) / (2.0 * h), atol=1e-6 * np.abs(tangent).max())


def test_the_null_vector_of_a_fold_is_the_tangent_there() -> None:
    """At the least pressure R_x with the ratio held and the pressure held is singular along it."""
    branch = PrimaryBranch(Family(COHESIVE, PATH, GIVEN[0]))
    fold = branch.continue_to("LP-pressure")
    assert fold is not None
    p = fold.point
    tangent = Linearised.at(p.problem, p.x, GIVEN[0], Plane.facing(p.direction)).tangent()
    held = Linearised.at(p.problem, p.x, GIVEN[0], Closure("pressure", p.scalars.pressure_ratio))
    size = np.abs(held.jacobian).max() * np.abs(tangent).max()
    assert np.abs(held.jacobian @ tangent).max() < 1e-9 * size
    assert np.abs(held.border @ tangent[p.problem.tail]).max() < 1e-9 * size


def test_factors_solve_both_ways_and_know_the_sign_of_the_determinant() -> None:
    import scipy.sparse as sp

    random = np.random.default_rng(3)
    signs = set()
    for _ in range(8):
        matrix = random.normal(size=(7, 7))
        right = random.normal(size=(7, 3))
        for factors in (DenseFactors(np.asfortranarray(matrix.copy())), SparseFactors(sp.csc_matrix(matrix))):
            np.testing.assert_allclose(matrix @ factors.solve(right), right, atol=1e-12)
            np.testing.assert_allclose(matrix.T @ factors.solve(right, transposed=True), right, atol=1e-12)
            assert factors.sign() == np.linalg.slogdet(matrix)[0]
            signs.add(factors.sign())
    assert signs == {-1, 1}


def test_a_singular_system_is_said_to_be_one() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="singular"):
        DenseFactors(np.zeros((3, 3), order="F"))


@pytest.mark.parametrize(
    ("read", "exact"),
    [
        (lambda s: s.pressure_ratio, (-5.0 / 8.0, 0.5 / 8.0, 3.0 * 2.5 / 16.0, 0.0)),
        (lambda s: s.ratio, (0.0, 0.0, -4.0 * (math.pi**4 + 3.0) / 32.0, 1.0 / 16.0)),
        (lambda s: s.beta0 ** (1.0 / 3.0), (0.0, 0.0, 1.0, 0.0)),
        (lambda s: np.array([1.0, 2.0, 3.0, 4.0]) @ np.array(s.values), (1.0, 2.0, 3.0, 4.0)),
    ],
)
def test_the_gradient_of_a_number_is_exact(read, exact: tuple[float, ...]) -> None:
    scalars = np.array([0.5, -5.0, 2.0, 3.0])
    np.testing.assert_allclose(gradient(read, scalars), exact, rtol=1e-15, atol=1e-16)
    along = np.array([0.3, -0.1, 0.7, 2.0])
    assert rate(read, scalars, along) == pytest.approx(along @ exact, rel=1e-14)


@pytest.mark.parametrize("kind", ["ratio", "length", "pressure", "lam", "alpha1", "amplitude"])
def test_derivatives_of_a_closure_are_those_of_its_miss(kind: str) -> None:
    scalars, h = np.array([0.5, -5.0, 2.0, 3.0]), 1e-6
    by_scalars, by_given = derivatives((Closure(kind, 0.7),), scalars)
    steps = h * np.eye(4)
    differences = [
        (miss(Closure(kind, 0.7), scalars + e) - miss(Closure(kind, 0.7), scalars - e)) / (2 * h)
        for e in steps
    ]
    np.testing.assert_allclose(by_scalars[0], differences, rtol=1e-7, atol=1e-8)
    by_number = (miss(Closure(kind, 0.7 + h), scalars) - miss(Closure(kind, 0.7 - h), scalars)) / (2 * h)
    assert by_given[0, 0] == pytest.approx(by_number, rel=1e-7)


def test_unknowns_end_in_the_scalars_by_name() -> None:
    problem = Spectral(6).discretise(LINEAR.pieces)
    x = np.arange(float(problem.size))
    scalars = problem.scalars(x)
    assert scalars == Scalars(*x[problem.tail])
    assert [x[problem.column(name)] for name in SCALARS] == list(scalars.values)
