"""One residual on a finer mesh tells how far the solution on that mesh is."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.residual.accuracy import SAFE, can_estimate, defect, refinement
from peel_opt.residual.closures import Closure
from peel_opt.residual.linear import Linearised
from peel_opt.residual.newton import correct
from peel_opt.residual.spectral import SpectralDiscretisation


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
