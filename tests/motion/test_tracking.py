"""A run before contact (flap, layout, radau, tracking): derivatives, orders, and phases that come and go."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

import peel_opt as po
from peel_opt.model.bond import COHESIVE
from peel_opt.model.named_laws import exponential
from peel_opt.motion.departure import stretched
from peel_opt.motion.flap import Flap, Phase
from peel_opt.motion.layout import BORN, excesses, laid_out, through
from peel_opt.motion.radau import Integrator
from peel_opt.motion.run import Setting


def on(*pieces: int) -> tuple[Phase, ...]:
    """Phases of the paper's scene, on these pieces of its law."""
    return tuple(Phase(piece) for piece in pieces)


@pytest.mark.parametrize("phases", [(0,), (1, 0), (0, 1, 0)])
@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_the_derivatives_are_those_of_the_residual(phases: tuple[int, ...], mass: float) -> None:
    flap = Flap(Setting(0.7, COHESIVE, 0.6, mass, 0.8), on(*phases), (7, 5, 7)[: len(phases)])
    rng = np.random.default_rng(len(phases))
    u, z, a = 0.3 * rng.normal(size=(3, flap.size))
    u[flap.lengths] = 1.0 + rng.random(len(phases))
    at, step = flap.balance(u, z, a), 1e-6

    def slopes(which: int) -> np.ndarray:
        columns = []
        for one in np.eye(flap.size):
            ends = []
            for sign in (1.0, -1.0):
                moved = [u, z, a]
                moved[which] = moved[which] + sign * step * one
                ends.append(flap.residual(*moved))
            columns.append((ends[0] - ends[1]) / (2.0 * step))
        return np.array(columns).T

    moving = slice(0, flap.lengths.stop)
    assert at.by_state == pytest.approx(slopes(0), abs=1e-8)
    assert at.by_rate[:, moving] == pytest.approx(slopes(1)[:, moving], abs=1e-8)
    assert at.by_second[:, moving] == pytest.approx(slopes(2)[:, moving], abs=1e-8)


def test_a_law_of_ones_own_pulls_as_it_says() -> None:
    from peel_opt.motion.tractions import Traction

    law = exponential()
    u = np.array([0.0, 0.3, 2.0])
    held = Traction(law.pieces[0])(u)
    assert held.traction == pytest.approx([law.traction(v) for v in u], abs=1e-14)
    assert held.work == pytest.approx([law.separation_work(v) for v in u], abs=1e-13)
    near = Traction(law.pieces[0])(u + 1e-6).traction - Traction(law.pieces[0])(u - 1e-6).traction
    assert held.slope == pytest.approx(near / 2e-6, abs=1e-8)


def moving(degree: int) -> tuple[Flap, np.ndarray]:
    """A rod under drag well on its way: the unfolded state, stretched."""
    eq = po.length_given_pressure(po.Rod.from_ratio(0.3), 0.9)
    start = stretched(eq, 1.1 * eq.length_ratio)
    flap, u, _ = laid_out(Setting(0.3, COHESIVE, 0.9, 0.0, 1.0), degree, start.s[-1], *through(start))
    step, t, h = None, 0.0, 0.5
    while t < 0.5:  # what is fast has settled
        step, h = Integrator(flap, False, 1e-9).advance(t, u, 0.0 * u, h, step)
        t, u = step.stop, step.u[-1]
        h = min(h, 0.5 - t)
    return flap, u


@pytest.mark.slow
def test_polynomials_converge_faster_than_any_power() -> None:
    fronts = []
    for degree in (10, 14, 18, 30):
        flap, u = moving(degree)
        step, _ = Integrator(flap, False, 1e-10).advance(0.0, u, 0.0 * u, 0.3)
        while step.stop < 0.3 - 1e-12:
            step, _ = Integrator(flap, False, 1e-10).advance(step.stop, step.u[-1], 0.0 * u, 0.3 - step.stop)
        fronts.append(step.u[-1][flap.lengths].sum())
    errors = np.abs(np.array(fronts[:-1]) - fronts[-1])
    assert np.all(errors[1:] < errors[:-1] / 5.0)


def dipping(turns: float, length: float = 5.0) -> tuple[np.ndarray, float, float]:
    """Unknowns of a flap of one phase that rises, falls from 2 from its front on and rises from ``turns`` on.

    With its lowest height and the second derivative of the height there.
    """

    def theta(s: np.ndarray) -> np.ndarray:
        zeta = length - s
        return -0.02 * zeta**2 * (zeta - 2.0) * (zeta - turns)

    flap = Flap(Setting(1.0, COHESIVE, 0.9, 0.0, 1.0), on(0), (31,))
    xi, value, _, _ = flap.basis.looked(200)
    u = np.append(np.linalg.lstsq(value, theta(length * xi), rcond=None)[0], length)
    height = quad(lambda s: -math.sin(theta(s)), length - turns, length, epsabs=1e-13)[0]
    return u, height, 0.02 * turns**2 * (turns - 2.0)


@pytest.mark.parametrize("beyond", [-0.01, 0.01])
def test_a_dip_into_the_range_of_the_bond_is_seen_from_where_it_begins(beyond: float) -> None:
    u, height, bend = dipping(2.912345)  # between the points at which heights are looked at
    depth = 0.125 * bend * BORN[1] ** 2  # of an arc that is BORN long
    ratio = 1.0 / (height + (1.0 + beyond) * depth)
    found = excesses(Flap(Setting(ratio, COHESIVE, 0.9, 0.0, 1.0), on(1), (31,)), u[None])[0]
    assert found.most == found.beyond == pytest.approx(beyond * depth, abs=1e-10)


@pytest.mark.parametrize("turns", [2.9, 3.9])
def test_a_rod_that_sinks_below_its_plate_between_tip_and_front_is_seen(turns: float) -> None:
    u, height, bend = dipping(turns)
    assert (height < 0.0) == (turns > 3.0)
    flap = Flap(Setting(0.01, COHESIVE, 0.9, 0.0, 1.0), on(0), (31,))
    lowest = max(-height - 0.125 * bend * BORN[1] ** 2, -float(flap.tip(u).y))
    assert excesses(flap, u[None])[0].sunk == pytest.approx(lowest, abs=1e-9)
