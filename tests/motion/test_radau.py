"""Steps of implicit systems in time: their order, algebraic rows, u'', and what rounding leaves of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from peel_opt.motion.radau import Integrator, Step
from peel_opt.motion.tracking import MESHES


class Linearised:
    """R, and its derivatives by u, u' and u''."""

    def __init__(self, residual: np.ndarray, *by: np.ndarray) -> None:
        self.residual = residual
        self.by_state, self.by_rate, self.by_second = by


class Pendulum:
    """theta'' + sin theta = 0 with the height as an algebraic unknown: y - cos theta = 0.

    Without u'' its speed is an unknown of its own.
    """

    def __init__(self, mass: bool) -> None:
        self.mass = mass

    def residual(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> np.ndarray:
        height = u[:, 1] - np.cos(u[:, 0])
        if self.mass:
            return np.stack([a[:, 0] + np.sin(u[:, 0]), height], axis=-1)
        return np.stack([z[:, 0] - u[:, 2], height, z[:, 2] + np.sin(u[:, 0])], axis=-1)

    def balance(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> Linearised:
        by = np.zeros((3, *u.shape, u.shape[1]))
        by[0, :, 1, 1], by[0, :, 1, 0] = 1.0, np.sin(u[:, 0])
        if self.mass:
            by[2, :, 0, 0], by[0, :, 0, 0] = 1.0, np.cos(u[:, 0])
        else:
            by[1, :, 0, 0], by[0, :, 0, 2] = 1.0, -1.0
            by[1, :, 2, 2], by[0, :, 2, 0] = 1.0, np.cos(u[:, 0])
        return Linearised(self.residual(u, z, a), *by)

    def felt(self, change: np.ndarray) -> np.ndarray:
        return change


def swung(mass: bool, steps: int) -> float:
    """By how much the energy of a pendulum is missed after 4 units of time in equal steps."""
    system = Integrator(Pendulum(mass), mass, 1e-12)
    u, z = np.array([1.0, math.cos(1.0), 0.5]), np.array([0.5, -0.5 * math.sin(1.0), 0.0])
    if mass:
        u, z = u[:2], z[:2]
    begin, before = 0.125 - math.cos(1.0), None
    for i in range(steps):
        taken = system.step(4.0 * i / steps, u, z, 4.0 / steps, before)
        assert isinstance(taken, Step)
        u, z, before = taken.u[-1], taken.z[-1], taken
    speed = z[0] if mass else u[2]
    assert u[1] == pytest.approx(math.cos(u[0]), abs=1e-13)
    return abs(0.5 * speed**2 - math.cos(u[0]) - begin)


@pytest.mark.parametrize("mass", [False, True])
def test_an_end_of_a_step_is_of_order_nine(mass: bool) -> None:
    errors = [swung(mass, steps) for steps in (3, 6, 12)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 8.0), (errors, orders)


@pytest.mark.parametrize("tol", [MESHES[0][1], MESHES[1][1]])
def test_steps_are_as_long_as_the_interpolant_may_be_in_error(tol: float) -> None:
    system, exact = Integrator(Pendulum(False), False, tol), Integrator(Pendulum(False), False, 1e-12)
    u, z = np.array([1.0, math.cos(1.0), 0.5]), np.zeros(3)
    taken, _ = system.advance(0.0, u, z, 5.0)
    between = taken.start + taken.length * np.array([0.13, 0.45, 0.71])
    missed = 0.0
    for t in between:
        fine = exact.step(0.0, u, z, float(t), None)
        assert fine is not None
        missed = max(missed, float(np.abs(taken.at(np.array([t]))[0][0] - fine.u[-1]).max()))
    assert 1e-3 * tol < missed < tol


def test_a_step_goes_no_further_than_rounding_leaves_it() -> None:
    """A residual with noise of 1e-9, of which no correction gets rid, is solved to that and says so."""

    class Noisy(Pendulum):
        random = np.random.default_rng(1)

        def residual(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> np.ndarray:
            return super().residual(u, z, a) + 1e-9 * self.random.normal(size=u.shape)

    u, z = np.array([1.0, math.cos(1.0), 0.5]), np.zeros(3)
    taken, _ = Integrator(Noisy(False), False, 1e-11).advance(0.0, u, z, 0.1)
    assert taken.length > 0.01
    assert 1e-10 < taken.rounding < 1e-7
