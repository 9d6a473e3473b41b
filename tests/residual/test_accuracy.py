"""One residual on a finer mesh tells how far the solution on that mesh is."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.equations import LowPressure, Scalars, identity, identity_terms
from peel_opt.residual.accuracy import SAFE, can_estimate, defect, refinement
from peel_opt.residual.batch import solve
from peel_opt.residual.closures import EQUATIONS, TERMS, Closure
from peel_opt.residual.compiled_stack import CompiledStack
from peel_opt.residual.linear import Linearised
from peel_opt.residual.newton import correct
from peel_opt.residual.spectral import SpectralDiscretisation
from peel_opt.residual.stack import stack_of


@pytest.mark.parametrize(
    ("ratio", "pressure", "state"),
    [(20.0, 0.3, "folded"), (100.0, 0.95, "folded"), (5.0, 0.6, "folded"), (40.0, 0.2, "folded")],
)
def test_the_step_is_of_the_size_of_the_distance_to_the_solution_on_the_finer_mesh(
    ratio: float, pressure: float, state: str
) -> None:
    given = (Closure("ratio", ratio), Closure("pressure", pressure))
    start = po.length_given_pressure(
        po.Rod.from_ratio(ratio), pressure, state=state, method=po.Spectral(16), tol=1.0
    )
    problem = start.source.problem
    here = correct(problem, start.source.x, given)
    finer = problem.settings.refined().discretise(problem.phases)
    there = correct(finer, problem.prolonged(here.x, finer), given)
    size = 1.0 + np.abs(here.x[problem.tail])
    apart = (there.x[finer.tail] - here.x[problem.tail]) / size
    step = refinement(Linearised.at(problem, here.x, *given))[problem.tail] / size
    assert np.linalg.norm(apart) > 1e-10  # more than rounding is seen
    assert 1.0 / SAFE < np.linalg.norm(step) / np.linalg.norm(apart) < SAFE


def test_a_stack_of_solutions_has_the_defects_of_each() -> None:
    rod = po.Rod.from_ratio(1.0)
    solved = [po.length_given_pressure(rod, P, method=po.Spectral(16)).source for P in (0.2, 0.3)]
    problem = solved[0].problem
    assert isinstance(problem, SpectralDiscretisation)
    together = defect(problem, np.array([s.x for s in solved]))
    for row, each in zip(together, solved, strict=True):
        np.testing.assert_allclose(row, defect(problem, each.x), rtol=1e-12, atol=1e-14)


def test_only_meshes_that_resolve_a_shape_are_trusted() -> None:
    assert can_estimate(po.Spectral(16))
    assert not any(can_estimate(mesh) for mesh in (po.Spectral(15), po.Collocation(), po.Shooting(), None))


@pytest.mark.parametrize(("nodes", "least"), [(6, 4), (9, 6), (12, 4)])
def test_a_finer_mesh_gains_what_the_last_coefficients_foretell(nodes: int, least: int) -> None:
    resolved = 0
    for ratio, pressure in ((0.05, 0.97), (0.7, 0.6), (6.0, 0.4), (60.0, 0.3)):
        for state in ("unfolded", "folded"):
            exact = po.length_given_pressure(
                po.Rod.from_ratio(ratio), pressure, state=state, method=po.Spectral(54), tol=1e-9
            ).source
            given = (Closure("ratio", ratio), Closure("pressure", pressure))
            scalars, gain = [exact.x[exact.problem.tail]], np.nan
            for mesh in (po.Spectral(nodes), po.Spectral(nodes).refined()):
                problem = mesh.discretise(exact.problem.phases)
                found = correct(problem, exact.problem.prolonged(exact.x, problem), given)
                if not found.converged:
                    break
                gain = mesh.gain_at(problem, found.x) if len(scalars) == 1 else gain
                scalars.append(found.x[problem.tail])
            if len(scalars) < 3:
                continue  # too coarse to have the state at all
            size = 1.0 + np.abs(scalars[0])
            coarse, fine = (np.linalg.norm((s - scalars[0]) / size) for s in scalars[1:])
            if gain > 1.0 and coarse > 1e-9:
                resolved += 1
                assert gain * fine <= coarse
    assert resolved >= least


def test_a_mesh_that_does_not_resolve_a_shape_has_no_error() -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.5, method=po.Spectral(3), tol=10.0, throw=False)
    assert eq.status == "not-certified"
    assert "its error inf" in eq.message


SIGNS = {  # of numbers with which no term of a closure takes anything from another
    "ratio": (Scalars(1.3, 2.1, 1.7, 90.0), -3.0),
    "pressure": (Scalars(1.3, 2.1, 1.7, 90.0), 0.2),
    "alpha1": (Scalars(1.3, 2.1, 1.7, 90.0), -5.0),
}


@pytest.mark.parametrize("kind", TERMS)
def test_the_terms_of_a_closure_are_counted_once(kind: str) -> None:
    s, number = SIGNS[kind]
    whole = float(EQUATIONS[kind](s, number))
    assert float(TERMS[kind](s, abs(number) if kind == "ratio" else number)) == pytest.approx(
        whole, rel=1e-14
    )


def test_the_terms_of_the_pressure_are_those_of_both_forms() -> None:
    low = LowPressure.of_unknowns(2.0, 1e-3, 100.0, 1.0)
    assert low.pressure_terms(1e-9) == pytest.approx(2e-3 + 1e-3, rel=1e-12)
    assert Scalars(*low.values).pressure_terms(1e-9) == pytest.approx(2e6, rel=1e-8)


@pytest.mark.parametrize(("ratio", "pressure"), [(1.0, 0.8), (1.0, 0.2), (2000.0, 1e-5)])
def test_the_terms_of_the_identity_are_counted_once(ratio: float, pressure: float) -> None:
    solved = po.length_given_pressure(po.Rod.from_ratio(ratio), pressure, method=po.Spectral(16)).source
    problem, given = solved.problem, (Closure("ratio", ratio), Closure("pressure", pressure))
    at = Linearised.at(problem, solved.x, *given)
    row, s = problem.identity_row, problem.scalars(solved.x)
    first = s.load if problem.phases[0].lets_go else s.m
    second = first - identity(problem.profile(solved.x).ends[0], s, problem.phases[0])
    assert abs(at.equations[row]) < 1e-9 * abs(first)
    # Of a load that is the difference of two, both count.
    terms = abs(s.m) + s.beta0 / s.A if problem.phases[0].lets_go else abs(first)
    assert identity_terms(s, problem.phases[0]) == pytest.approx(terms + abs(second), rel=1e-8)
    degrees = (abs(at.matrix) @ np.abs(solved.x))[row]
    assert 0.1 * degrees < at.sizes[row] < degrees


def test_a_stack_counts_as_one_state_does() -> None:
    for ratio, pressure in ((1.0, 0.8), (1.0, 0.2)):
        solved = po.length_given_pressure(po.Rod.from_ratio(ratio), pressure, method=po.Spectral(16)).source
        problem, given = solved.problem, (Closure("ratio", ratio), Closure("pressure", pressure))
        stack = CompiledStack.of(problem.settings, problem.phases)
        together = solve(stack, ("ratio", "pressure"), np.array([[ratio, pressure]]), solved.x[None])
        single = Linearised.at(problem, together.x[0], *given).sizes
        np.testing.assert_allclose(together.sizes[0], single, rtol=1e-6)
        dense = stack_of(problem.settings, problem.phases)
        there = solve(
            dense, ("ratio", "pressure"), np.array([[ratio, pressure]]), dense.gathered(solved.x[None])
        )
        np.testing.assert_allclose(there.sizes[0, -2:], single[-2:], rtol=1e-6)
