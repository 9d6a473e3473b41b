"""Stacked evaluation: it is the compiled residual, state by state."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from peel_opt.continuation.seeds import charts
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.model.equations import Scalars
from peel_opt.residual import free_arc
from peel_opt.residual.batch import solve
from peel_opt.residual.linear import closed_system
from peel_opt.residual.spectral import Spectral
from peel_opt.residual.stack import serves, stack_of

WITHIN, FREE = COHESIVE.pieces
KINDS = ("ratio", "pressure")

#: The same states compiled, one at a time.
ARC = Spectral(16, free_arc=True).discretise((FREE, WITHIN))


def made_up(stack, count=40, seed=1):
    """Unknowns that solve nothing, amplitudes from tiny to large, and given numbers."""
    rng = np.random.default_rng(seed)
    fields = 5.0 * rng.normal(size=(count, stack.nodes))
    free = rng.uniform(0.1, 0.4, (count, stack.free))
    scalars = [
        rng.choice([0.01, 0.29, 0.31, 1.5], count),
        rng.uniform(-0.1, 0.1, count),
        rng.uniform(1.0, 5.0, count),
        rng.uniform(-50.0, 200.0, count),
    ]
    return np.concatenate([fields, free, np.stack(scalars, axis=1)], axis=1), rng.uniform(
        0.5, 1.0, (count, 2)
    )


def solved(name, pressures):
    """States of a chart at r = 0.3 or 1, solved for."""
    chart = charts()[name]
    ratio = np.full(len(pressures), 0.3 if name == "whole" else 1.0)
    start = chart.rods(ratio).starts(np.linspace(0.1, 0.9, len(pressures)))
    given = np.stack([ratio, chart.stack.scalars(start).pressure_ratio], axis=1)
    found = solve(chart.stack, KINDS, given, start)
    assert found.converged.all()
    return found


@pytest.mark.parametrize("phases", [(WITHIN,), LINEAR.pieces], ids=["law (8)", "linear"])
@pytest.mark.parametrize("kinds", [("ratio", "pressure"), ("ratio", "length"), ("length", "lam")])
def test_one_phase_is_the_compiled_system(phases, kinds):
    stack = stack_of(Spectral(16), phases)
    x, given = made_up(stack)
    x[0, -4] = 1e-9  # a shape without amplitude is none of NumPy's divisions by zero
    compiled = closed_system(Spectral(16).discretise(phases), kinds)
    equations, jacobian = stack.linearise(x, kinds, given)
    for i in range(len(x)):
        values, matrix = compiled.system(x[i], given[i])
        assert equations[i] == pytest.approx(values, abs=1e-14 * np.abs(values).max())
        assert np.abs(jacobian[i] - matrix).max() < 1e-12 * np.abs(matrix).max()


def test_a_free_arc_and_a_phase_are_the_compiled_system():
    stack = stack_of(Spectral(16), (FREE, WITHIN))
    x, given = made_up(stack)
    compiled = closed_system(ARC, KINDS)
    equations, jacobian = stack.linearise(x, KINDS, given)
    for i in range(len(x)):
        values, matrix = compiled.system(x[i], given[i])
        assert np.all(np.abs(equations[i] - values) < 1e-12 * (np.abs(matrix) @ np.abs(x[i])))
        assert np.abs(jacobian[i] - matrix).max() < 1e-11 * np.abs(matrix).max()


def test_a_state_with_a_free_arc_solves_the_compiled_system_of_two_phases():
    found = solved("beyond", range(8))
    problem = Spectral(16).discretise((FREE, WITHIN))
    for x, free in zip(found.x, found.stack.shares(found.x), strict=True):
        profile = ARC.profile(x)
        values = problem.residual(problem.pack(profile))
        assert np.abs(values).max() < 1e-9 * np.abs(profile.values[:, :, 3]).max()
        assert profile.lengths[0] == free


def test_the_jacobian_with_a_free_arc_is_the_derivative():
    stack = stack_of(Spectral(16), (FREE, WITHIN))
    x, given = made_up(stack)
    _, jacobian = stack.linearise(x, KINDS, given)
    size = np.abs(jacobian).max(axis=2)
    for k in range(stack.size):
        step = np.zeros_like(x)
        step[:, k] = 1e-6 * np.minimum(1.0 + np.abs(x[:, k]), np.where(k == stack.size - 4, x[:, k], np.inf))
        there, back = (stack.equations(x + sign * step, KINDS, given) for sign in (1.0, -1.0))
        numerical = (there - back) / (2.0 * step[:, k : k + 1])
        assert np.abs((numerical - jacobian[:, :, k]) / size).max() < 1e-5


def test_the_free_curve_solves_its_equations():
    c = np.array([0.3, 1.0, 2.0, free_arc.LONGEST])

    def rates(_, state):
        phi, X, Y = state
        return [0.5 * (X * X + Y * Y), np.cos(phi), np.sin(phi)]

    reference = solve_ivp(rates, (0.0, c[-1]), np.zeros(3), t_eval=c, rtol=1e-13, atol=1e-16, method="DOP853")
    assert np.array(free_arc.curve(c)) == pytest.approx(reference.y, rel=2e-12)
    assert np.isnan(free_arc.curve(np.array([free_arc.LONGEST + 0.1])).phi).all()


def test_the_free_curve_is_as_good_as_doubles_are():
    # Integrated by Taylor series with 30 digits (mpmath.odefun).
    known = {
        0.5: (0.02083309113501078, 0.4999844995038847, 0.00260407920728255),
        1.25: (0.3246012351799216, 1.2406122746388704, 0.10089764935169934),
        2.0: (1.2744363150582714, 1.7754454923760685, 0.5856243834329312),
        2.5: (2.2369124733279313, 1.6920984557157837, 1.0590417369637732),
        3.5: (3.7739623129076816, 0.7911813002413663, 1.0912901638098857),
        4.5: (4.181187784924676, 0.17923801663136127, 0.30909117819122145),
    }
    for c, expected in known.items():
        assert np.array(free_arc.curve(np.array([c])))[:, 0] == pytest.approx(expected, rel=1e-15)


def test_the_free_curve_keeps_its_digits_at_the_tip():
    c = np.array([1e-5, 1e-3, 0.01])
    phi, X, Y = free_arc.curve(c)
    assert phi == pytest.approx(c**3 / 6.0, rel=1e-7)
    assert phi[0] == pytest.approx(c[0] ** 3 / 6.0, rel=1e-14)
    assert X[0] == pytest.approx(c[0], rel=1e-14)
    assert Y[0] == pytest.approx(c[0] ** 4 / 24.0, rel=1e-14)


def test_the_end_of_the_free_arc_is_where_the_nodes_begin():
    found = solved("beyond", range(4))
    share, s = found.stack.shares(found.x), found.scalars
    assert isinstance(s, Scalars)
    Theta = free_arc.FreeArc(share, s).end[:, 0]
    profiles = [ARC.profile(x) for x in found.x]
    for end in ((0, -1), (1, 0)):
        assert Theta == pytest.approx([p.values[*end, 0] for p in profiles], abs=1e-13)


def test_only_straight_pieces_with_a_free_arc_or_none_are_stacked():
    assert serves((WITHIN,))
    assert serves((FREE, WITHIN))
    assert not serves((WITHIN, FREE))
    assert not serves((WITHIN, FREE, WITHIN))
    with pytest.raises(ValueError, match="cannot be stacked"):
        stack_of(Spectral(16), (WITHIN, FREE))
