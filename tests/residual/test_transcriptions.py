"""The discretisations: orders as theory says, profiles that carry over, the NLP by itself.

Modules: `shooting`, `spectral`, `spectral_fields`, `discretisation`, `compiled`,
`programme`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.sparse as sp

import peel_opt as po
from peel_opt.continuation.family import Family, StepControl, transition
from peel_opt.continuation.primary import PrimaryBranch
from peel_opt.model.bond import COHESIVE, LINEAR, Piece
from peel_opt.model.equations import Scalars, kernel
from peel_opt.model.named_laws import exponential
from peel_opt.residual import compiled, programme
from peel_opt.residual.closures import Closure
from peel_opt.residual.collocation import Collocation
from peel_opt.residual.discretisation import PROFILE_POINTS, Discretisation, Profile, Transcription, chebyshev
from peel_opt.residual.linear import closed_system
from peel_opt.residual.meshes import PATH
from peel_opt.residual.newton import correct, newton
from peel_opt.residual.shooting import Shooting
from peel_opt.residual.spectral import Spectral

GROUPS = (Closure("length", math.cbrt(4.0)), Closure("lam", 1.0))
ALPHA1 = -4.43540698907106


def kernel_profile(amplitude: float, sigma: float) -> Profile:
    """The mode (22) with an amplitude, as a start."""
    zeta, _ = chebyshev(PROFILE_POINTS)
    mode = kernel(zeta)
    nx = -(sigma**3) * (mode["Y"] - mode["Y"][0])
    values = np.stack([mode["Theta"], mode["K"], nx, mode["ny"], mode["Y"]], axis=-1)[None]
    return Profile(np.ones(1), values, Scalars(amplitude, float(mode["m"]), sigma, 0.0))


def start(amplitude: float = 0.15) -> Profile:
    return kernel_profile(amplitude, math.cbrt(4.0))


@pytest.mark.parametrize(
    ("integrator", "order", "counts"),
    [
        ("midpoint", 2, (40, 80, 160)),
        ("rk4", 4, (20, 40, 80)),
        ("dopri5", 5, (10, 20, 40)),
        ("dop853", 8, (4, 8, 16)),
    ],
)
def test_order_of_the_integrator(integrator: str, order: int, counts: tuple[int, ...]) -> None:
    errors = []
    for count in counts:
        problem = Shooting(count, integrator).discretise(LINEAR.pieces)
        result = correct(problem, problem.pack(start()), GROUPS)
        assert result.converged
        errors.append(abs(problem.scalars(result.x).alpha1 - ALPHA1))
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert rates[-1] > order - 0.6
    assert rates[-1] < order + 2.0  # superconvergence of one order is seen, two would be a bug


def test_steps_inside_an_interval_count_like_intervals() -> None:
    errors = []
    for settings in (Shooting(10, "rk4", steps=4), Shooting(40, "rk4")):
        problem = settings.discretise(LINEAR.pieces)
        result = correct(problem, problem.pack(start()), GROUPS)
        errors.append(problem.scalars(result.x).alpha1 - ALPHA1)
    assert errors[0] == pytest.approx(errors[1], rel=1e-6)


def test_spectral_convergence_is_faster_than_any_power() -> None:
    errors = []
    for nodes in (4, 6, 8, 10):
        problem = Spectral(nodes).discretise(LINEAR.pieces)
        result = correct(problem, problem.pack(start()), GROUPS)
        errors.append(abs(problem.scalars(result.x).alpha1 - ALPHA1))
    assert errors[-1] < 1e-8
    rates = -np.diff(np.log(errors)) / np.diff(np.log([4, 6, 8, 10]))
    assert rates[-1] > 12


@pytest.mark.parametrize("settings", [Shooting(), Shooting(30, "rk4"), Spectral(12)], ids=repr)
@pytest.mark.parametrize("P", [0.8, 0.2])
def test_a_profile_starts_another_method_at_its_solution(settings: object, P: float) -> None:
    branch = PrimaryBranch(Family(COHESIVE, PATH, Closure("ratio", 1.0)))
    branch.extend(lambda p: p.scalars.pressure_ratio < P)
    given = (Closure("ratio", 1.0), Closure("pressure", P))
    point = next(p for p in branch.points if p.scalars.pressure_ratio < P)
    problem = settings.discretise(point.problem.phases)  # type: ignore[attr-defined]
    result = correct(problem, problem.pack(point.profile), given)
    assert result.converged
    again = correct(problem, problem.pack(problem.profile(result.x)), given)
    assert again.iterations <= 3
    assert again.x[-2] == pytest.approx(result.x[-2], abs=1e-12)


def test_samples_of_two_methods_agree_between_their_nodes() -> None:
    zeta = np.linspace(0.0, 1.0, 23)
    samples = []
    for settings in (Shooting(24), Spectral(20)):
        problem = settings.discretise(LINEAR.pieces)
        result = correct(problem, problem.pack(start()), GROUPS)
        samples.append(problem.sampler(zeta)(result.x)[0])
    np.testing.assert_allclose(samples[0], samples[1], atol=3e-9)


def test_elements_refine_like_nodes() -> None:
    problem = Spectral(nodes=6, elements=4).discretise(LINEAR.pieces)
    result = correct(problem, problem.pack(start()), GROUPS)
    assert abs(problem.scalars(result.x).alpha1 - ALPHA1) < 1e-9


COUPLED, FREE = COHESIVE.pieces


@pytest.mark.parametrize("settings", [Spectral(10), Spectral(5, elements=2)], ids=repr)
@pytest.mark.parametrize(
    "phases",
    [(COUPLED,), (FREE, COUPLED), (COUPLED, FREE, COUPLED), exponential().pieces],
    ids=["one", "two", "three", "exponential"],
)
@pytest.mark.parametrize("amplitude", [0.7, 1e-4])
def test_the_jacobian_by_matrix_products_is_the_automatic_one(
    settings: Spectral, phases: tuple[Piece, ...], amplitude: float
) -> None:
    problem = settings.discretise(phases)
    x = np.random.default_rng(0).normal(size=problem.size)
    x[problem.field_count :] = [*[0.3, 0.2][: len(phases) - 1], amplitude, -5.0, 2.0, 3.0]
    residual, jacobian = problem.linearise(x)
    automatic = ca.Function("automatic", [problem.x], [ca.jacobian(problem.expression, problem.x)])
    expected = automatic(x).full()
    np.testing.assert_allclose(jacobian, expected, atol=1e-12 * np.max(np.abs(expected)), rtol=1e-12)
    np.testing.assert_array_equal(residual, problem.residual(x))
    np.testing.assert_array_equal(jacobian, problem.linearised(x)[1].full())


def bordered_by_hand(problem: Discretisation, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """R(x) with sigma = 4^(1/3) and lambda = 1, and its full Jacobian."""
    residual, jacobian = problem.linearise(x)
    matrix = np.eye(problem.size)  # its last two rows are those of sigma and lambda
    matrix[:-2] = jacobian.toarray() if sp.issparse(jacobian) else jacobian
    return np.append(residual, [x[-2] - math.cbrt(4.0), x[-1] - 1.0]), matrix


def by_hand(problem: Discretisation, x: np.ndarray) -> np.ndarray:
    """The solution of the same by plain Newton steps."""
    for _ in range(12):
        values, matrix = bordered_by_hand(problem, x)
        x = x - np.linalg.solve(matrix, values)
    return x


@pytest.mark.parametrize("settings", [Shooting(40, "rk4"), Collocation(40)], ids=repr)
def test_large_systems_are_sparse_and_solved_alike(settings: Transcription) -> None:
    problem = settings.discretise(LINEAR.pieces)
    assert sp.issparse(problem.linearise(problem.pack(start()))[1])
    closed = correct(problem, problem.pack(start()), GROUPS)
    assert closed.converged
    np.testing.assert_allclose(closed.x, by_hand(problem, problem.pack(start())), atol=1e-11)


def test_compiled_closures_are_the_same_question() -> None:
    problem = Spectral(12).discretise(LINEAR.pieces)
    x = problem.pack(start(0.5))
    closed = correct(problem, x, GROUPS)
    assert closed.converged
    np.testing.assert_allclose(closed.x, by_hand(problem, x), rtol=1e-12)


def test_kept_factors_end_where_newton_does() -> None:
    problem = Spectral(12).discretise(LINEAR.pieces)
    factorisations = []

    def linearise(x: np.ndarray) -> tuple:
        values, matrix = bordered_by_hand(problem, x)
        factorisations.append(1)
        return values, lambda: lambda b: np.linalg.solve(matrix, b)

    def equations(x: np.ndarray) -> np.ndarray:
        return bordered_by_hand(problem, x)[0]

    x, scale = problem.pack(start(0.5)), np.ones(problem.size)
    results, counts = [], []
    for keep in (None, equations):
        factorisations.clear()
        results.append(newton(linearise, x, scale, equations=keep))
        counts.append(len(factorisations))
    assert all(result.converged for result in results)
    np.testing.assert_allclose(results[0].x, results[1].x, rtol=1e-12)
    assert counts[1] < counts[0]


def test_threads_do_not_share_the_memory_of_a_compiled_problem() -> None:
    problem = Spectral(16).discretise((FREE, COUPLED))
    points = np.random.default_rng(1).normal(size=(64, problem.size))
    expected = [problem.linearise(x)[1] for x in points]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda x: problem.linearise(x)[1], points))
    np.testing.assert_array_equal(found, expected)


def test_three_transcriptions_walk_the_same_branch() -> None:
    """Each from T on by itself, over the fold in length, into two phases and past the minimum."""
    amplitudes = (0.1, 0.5, 1.2, 2.0)
    branches = []
    for settings in (Spectral(24), Collocation(16), Shooting(20)):
        family = Family(COHESIVE, settings, Closure("ratio", 1.0))
        walk = family.walk(transition(family), StepControl(first=0.1))
        found, here = [], next(walk)
        for amplitude in amplitudes:
            while amplitude > here.scalars.A:
                here = next(walk)
            solved = family.solve(here.profile, Closure("amplitude", amplitude))
            assert solved is not None
            scalars = solved[0].scalars(solved[1].x)
            found.append((len(solved[0].phases), scalars.pressure_ratio, scalars.sigma))
        branches.append(found)
    assert {phases for phases, _, _ in branches[0]} == {1, 2}
    for other in branches[1:]:
        np.testing.assert_allclose(other, branches[0], atol=3e-9)


@pytest.mark.parametrize("amplitude", [0.1, 0.2, 0.5])
def test_ipopt_from_the_mode_alone(amplitude: float) -> None:
    """The bare NLP, started from the kernel (22): the straight rod is no solution of it."""
    problem = Shooting(12).discretise(LINEAR.pieces)
    solution = programme.solve(problem, problem.pack(start(amplitude)), GROUPS)
    assert solution.solved
    assert problem.scalars(solution.x).alpha1 == pytest.approx(ALPHA1, abs=1e-7)


def test_ipopt_says_when_it_fails() -> None:
    problem = Shooting(12).discretise(LINEAR.pieces)
    below_the_fold = (GROUPS[0], Closure("lam", -5.0))
    solution = programme.solve(problem, problem.pack(start()), below_the_fold)
    assert not solution.solved


def test_a_failed_nlp_is_a_typed_error() -> None:
    hasty = po.Method(Shooting(2, "midpoint"), po.Ipopt(max_iterations=1))
    with pytest.raises(po.NotConverged, match="IPOPT stopped with"):
        po.equilibrium(beta0=4, lam=1.0, method=hasty)


def test_solvability_at_zero_amplitude_is_the_critical_condition() -> None:
    problem = Spectral(16).discretise(LINEAR.pieces)
    given = (Closure("length", 1.3), Closure("amplitude", 0.0))
    result = correct(problem, problem.pack(kernel_profile(0.0, 1.3)), given)
    assert result.converged
    assert problem.scalars(result.x).lam == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize(
    "arguments",
    [{"intervals": 0}, {"intervals": 2.5}, {"steps": -1}, {"integrator": "euler"}, {"intervals": True}],
)
def test_settings_that_cannot_be_meant(arguments: dict) -> None:
    with pytest.raises(po.InvalidInput):
        Shooting(**arguments)


def test_compiled_problems_are_kept_up_to_a_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "MOST_KEPT", 15_000)
    first, second = COHESIVE.pieces
    problems = [Spectral(11).discretise((second, first) * n) for n in range(1, 5)]
    for problem in problems:
        closed_system(problem, ("ratio", "pressure"))
    assert not problems[0].closed
    assert problems[-1].closed
    assert sum(problem.weight for problem in problems if problem.closed) <= 15_000
    # What was dropped comes back as it was.
    x = np.linspace(0.1, 0.2, problems[0].size)
    before = problems[0].residual(x)
    problems[0].release()
    np.testing.assert_array_equal(problems[0].residual(x), before)


def test_more_phases_than_fit_into_memory_are_refused() -> None:
    first, second = COHESIVE.pieces
    with pytest.raises(po.OutOfRange, match="200 phases takes 3200 unknowns"):
        Spectral(16).discretise((second, first) * 100)


def test_a_piece_of_a_law_is_compiled_once_for_all_sequences_of_phases() -> None:
    drops: list[int] = []

    def counted(j: int) -> Callable[[Any], Any]:
        def tau(u: Any) -> Any:
            if isinstance(u, ca.SX):
                drops.append(j)
            return (1.0 - 0.3 * u) ** 2 if j < 2 else 0.16 + 0.0 * u

        return tau

    law = po.CohesiveLaw([counted(j) for j in range(3)], kinks=(1.0, 2.0), name="counted")
    a, b, c = law.pieces
    mesh = Spectral(8)
    for tip_in in ((c, b, a), (b, a), (a,)):
        mesh.discretise(tip_in).linearised  # noqa: B018
    assert set(drops) == {0, 1, 2}
    drops.clear()
    for phases in ((b, c, b, a), (a, b, a), (c, b, c, b, a), (a, b, c, b, a)):
        mesh.discretise(phases).linearised  # noqa: B018
    assert drops == []
