"""Collocation: orders, a mesh that follows the shape and travels with the unknowns."""

from __future__ import annotations

import math

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation.primary import primary_branch
from peel_opt.model.bond import COHESIVE, LINEAR, CohesiveLaw
from peel_opt.model.named_laws import exponential
from peel_opt.residual.closures import Closure
from peel_opt.residual.collocation import Collocation
from peel_opt.residual.mesh import QUANTUM
from peel_opt.residual.newton import correct
from peel_opt.residual.phases import layout
from peel_opt.residual.shooting import Shooting
from peel_opt.residual.spectral import Spectral

from .test_transcriptions import ALPHA1, GROUPS, start


@pytest.mark.parametrize(
    ("stages", "counts"), [(1, (40, 80, 160)), (2, (10, 20, 40)), (3, (6, 12, 24)), (4, (4, 8, 16))]
)
def test_order_at_the_mesh_points_is_twice_the_stages(stages: int, counts: tuple[int, ...]) -> None:
    errors = []
    for count in counts:
        settings = Collocation(count, stages, mesh="uniform")
        problem = settings.discretise(LINEAR.pieces)
        result = correct(problem, problem.pack(start()), GROUPS)
        assert result.converged
        errors.append(abs(problem.scalars(result.x).alpha1 - ALPHA1))
    assert settings.order == 2 * stages
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert rates[-1] == pytest.approx(2 * stages, abs=0.1)


def test_one_element_of_the_spectral_form_is_one_interval() -> None:
    """Both are Gauss collocation: the same discrete solution, eliminated differently."""
    numbers = []
    for settings in (Collocation(5, 3, mesh="uniform"), Spectral(nodes=3, elements=5)):
        problem = settings.discretise(LINEAR.pieces)
        result = correct(problem, problem.pack(start()), GROUPS)
        numbers.append(problem.scalars(result.x).alpha1)
    # The breakpoints of collocation are rounded, by up to 2^-31.
    assert numbers[0] == pytest.approx(numbers[1], abs=1e-9)


def layered(law: CohesiveLaw, ratio: float, pressure: float) -> tuple:
    """The unfolded shape, its phases and closures, to ten digits."""
    given = (Closure("ratio", ratio), Closure("pressure", pressure))
    branch = primary_branch(law, given[0])
    branch.extend(lambda p: p.scalars.pressure_ratio < pressure)
    start = branch.candidates(given[1])[0].profile
    plan = layout(law, start)
    problem = Spectral(24, elements=4 // len(plan.phases)).discretise(plan.phases)
    result = correct(problem, problem.pack(start.rephased(plan.breaks)), given)
    assert result.converged
    return problem.profile(result.x), problem.phases, given


@pytest.mark.parametrize(
    ("law", "ratio", "pressure", "intervals", "gain"),
    [
        (COHESIVE, 100.0, 1.02 * 0.00012499661683, 6, 5.0),
        (COHESIVE, 100.0, 1.02 * 0.00012499661683, 10, 5.0),
        # No phase of its own for the cohesive zone; the number of intervals does not decide.
        *((exponential(), 1000.0, 2e-3, intervals, 100.0) for intervals in (16, 17, 20, 23)),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_the_adapted_mesh_beats_the_uniform_one(
    law: CohesiveLaw, ratio: float, pressure: float, intervals: int, gain: float
) -> None:
    profile, phases, given = layered(law, ratio, pressure)
    errors = []
    for mesh in ("uniform", "adapted"):
        problem = Collocation(intervals, mesh=mesh).discretise(phases)
        result = correct(problem, problem.pack(profile), given)
        assert result.converged
        errors.append(abs(problem.scalars(result.x).sigma / profile.scalars.sigma - 1.0))
    assert gain * errors[1] < errors[0]


def mesh_of(problem: object, x: np.ndarray) -> np.ndarray:
    settings = problem.settings  # type: ignore[attr-defined]
    inner = (settings.intervals - 1) * len(problem.phases)  # type: ignore[attr-defined]
    return x[problem.field_count - inner : problem.field_count]  # type: ignore[attr-defined]


def test_breakpoints_are_data_that_newton_does_not_move() -> None:
    profile, phases, given = layered(COHESIVE, 1.0, 0.2)
    problem = Collocation(8).discretise(phases)
    x = problem.pack(profile)
    x[-4:-2] *= 1.01
    result = correct(problem, x, given)
    assert result.converged
    assert result.iterations > 2
    np.testing.assert_array_equal(mesh_of(problem, result.x), mesh_of(problem, x))
    assert np.all(np.diff(mesh_of(problem, x).reshape(len(phases), -1), axis=1) > 100 * QUANTUM)


def test_one_compiled_problem_serves_every_mesh() -> None:
    problems = []
    for ratio, pressure in ((1.0, 0.2), (1.0, 0.3)):
        profile, phases, _ = layered(COHESIVE, ratio, pressure)
        problem = Collocation(8).discretise(phases)
        problems.append((problem, mesh_of(problem, problem.pack(profile))))
    assert problems[0][0] is problems[1][0]
    assert np.max(np.abs(problems[0][1] - problems[1][1])) > 1e-3


def test_samples_between_the_mesh_points_are_as_good_as_at_them() -> None:
    profile, phases, given = layered(COHESIVE, 1.0, 0.2)
    zeta = np.linspace(0.0, 1.0, 23)
    samples = []
    for settings in (Collocation(16), Spectral(24)):
        problem = settings.discretise(phases)
        result = correct(problem, problem.pack(profile), given)
        samples.append(problem.sampler(zeta)(result.x)[0])
    np.testing.assert_allclose(samples[0], samples[1], atol=1e-9)


@pytest.mark.parametrize("P", [0.8, 0.2])
def test_a_named_method_like_the_others(P: float) -> None:
    answers = [
        po.length_given_pressure(po.Rod.from_ratio(1.0), pressure=P, method=method)
        for method in ("collocation", "spectral")
    ]
    assert answers[0].error < 1e-8
    assert abs(answers[0].length_ratio - answers[1].length_ratio) <= answers[0].error + answers[1].error


def test_the_error_of_a_configured_mesh_is_honest() -> None:
    eq = po.equilibrium(beta0=4, lam=1.0, method=Collocation(4), tol=1e-4)
    assert abs(eq.alpha1 - ALPHA1) <= eq.error < 1e4 * abs(eq.alpha1 - ALPHA1)
    assert math.isclose(eq.alpha1, ALPHA1, abs_tol=1e-4)


@pytest.mark.parametrize(
    "arguments", [{"intervals": 0}, {"stages": 2.5}, {"stages": True}, {"mesh": "finest"}]
)
def test_settings_that_cannot_be_meant(arguments: dict) -> None:
    with pytest.raises(po.InvalidInput):
        Collocation(**arguments)


def test_shooting_and_collocation_share_nothing_but_the_answer() -> None:
    profile, phases, given = layered(COHESIVE, 10.0, 0.1)
    numbers = []
    for settings in (Shooting(20), Collocation(16)):
        problem = settings.discretise(phases)
        numbers.append(problem.scalars(correct(problem, problem.pack(profile), given).x).sigma)
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-9)
