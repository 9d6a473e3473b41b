"""Newton on stacks: what converges, how honest the errors are, and that no state sees another."""

import numpy as np
import pytest

from peel_opt.continuation.seeds import charts
from peel_opt.equilibria.question import LENGTH, answering
from peel_opt.model.bond import COHESIVE
from peel_opt.residual.accuracy import certificate, response
from peel_opt.residual.batch import solve
from peel_opt.residual.closures import Closure
from peel_opt.residual.linear import Linearised
from peel_opt.residual.newton import correct
from peel_opt.residual.spectral import Spectral

KINDS = ("ratio", "pressure")


def question(name, count=80, seed=0):
    """Random rods and shares of a chart: given numbers, and starts for them."""
    chart, rng = charts()[name], np.random.default_rng(seed)
    ratio = np.exp(rng.uniform(*np.log(chart.ratios), count))
    start = chart.rods(ratio).starts(rng.uniform(0.02, 0.97, count))
    return chart.stack, np.stack([ratio, chart.stack.scalars(start).pressure_ratio], axis=1), start


@pytest.mark.parametrize("name", ["whole", "within", "beyond"])
@pytest.mark.parametrize("asked", ["length_ratio", "alpha1"])
def test_errors_are_not_smaller_than_the_true_ones(name, asked):
    stack, given, start = question(name)
    found = solve(stack, KINDS, given, start)
    finest = stack.finer.finer
    exact = solve(finest, KINDS, given, stack.finer.prolonged(stack.prolonged(found.x)))
    assert found.converged.mean() > 0.98
    kept = found.converged & exact.converged
    read = answering(asked).asked.read
    missed = np.abs(read(found.scalars) - read(exact.scalars))[kept]
    claimed, own = found.errors(read)[kept], exact.errors(read)[kept]
    assert (missed <= claimed + own).all()
    assert np.median(claimed) < 1e-10 * np.median(1.0 + np.abs(read(found.scalars)[kept]))


def test_a_finer_mesh_lowers_the_error_it_claims():
    stack, given, start = question("whole")
    found = solve(stack, KINDS, given, start)
    read = LENGTH.read
    again = solve(stack.finer, KINDS, given, stack.prolonged(found.x))
    coarse, fine = found.errors(read), again.errors(read)
    meant = coarse > 1e-11
    assert meant.any()
    assert (fine[meant] < 0.1 * coarse[meant]).all()


def test_rounding_and_condition_are_those_of_a_single_answer():
    stack, given, start = question("within", count=12)
    found = solve(stack, KINDS, given, start)
    problem, read = Spectral(16).discretise(stack.phases), LENGTH.read
    for i in np.flatnonzero(found.converged):
        closures = tuple(Closure(kind, value) for kind, value in zip(KINDS, given[i], strict=True))
        single = correct(problem, found.x[i], closures)
        own = response(Linearised.at(problem, single.x, *closures), single.update, read)
        assert abs(found.response[i, 2, 1]) == pytest.approx(own.condition, rel=1e-4)
        assert found.errors(read)[i] >= 0.5 * own.rounding


def test_certificates_are_those_of_the_compiled_profile():
    for name in ("within", "beyond"):
        stack, given, start = question(name, count=6)
        found = solve(stack, KINDS, given, start)
        problem = Spectral(16, free_arc=True).discretise(stack.phases)
        for x, own in zip(found.x, found.certificates(COHESIVE), strict=True):
            assert own == pytest.approx(
                certificate(COHESIVE, problem.profile(x), problem.phases[0]), rel=1e-3, abs=1e-11
            )


def test_a_start_that_is_none_does_not_converge_and_leaves_the_others_alone():
    stack, given, start = question("beyond", count=12)
    alone = solve(stack, KINDS, given, start)
    start[3] = np.nan
    start[5, -2] = -1e3
    given[7] = 0.0
    beside = solve(stack, KINDS, given, start)
    assert not beside.converged[[3, 5, 7]].any()
    others = np.delete(np.arange(12), [3, 5, 7])
    assert np.array_equal(beside.x[others], alone.x[others])


@pytest.mark.parametrize("name", ["whole", "beyond"])
def test_no_bit_depends_on_what_stands_beside(name):
    stack, given, start = question(name, count=67, seed=3)
    together, read = solve(stack, KINDS, given, start), LENGTH.read
    errors, certificates = together.errors(read), together.certificates(COHESIVE)
    order = np.random.default_rng(1).permutation(67)
    for rows in (order, order[:33], order[:8], order[:5], *order[:12, None]):
        some = solve(stack, KINDS, given[rows], start[rows])
        assert np.array_equal(some.x, together.x[rows])
        assert np.array_equal(some.errors(read), errors[rows])
        assert np.array_equal(some.certificates(COHESIVE), certificates[rows])
