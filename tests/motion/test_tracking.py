"""A run before contact (flap, layout, radau, tracking): derivatives, orders, and phases that come and go."""

from __future__ import annotations

import numpy as np
import pytest

from peel_opt.model.bond import COHESIVE
from peel_opt.model.named_laws import exponential
from peel_opt.motion.flap import Flap
from peel_opt.motion.run import Setting


@pytest.mark.parametrize("phases", [(0,), (1, 0), (0, 1, 0)])
@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_the_derivatives_are_those_of_the_residual(phases: tuple[int, ...], mass: float) -> None:
    flap = Flap(Setting(0.7, COHESIVE, 0.6, mass, 0.8), phases, (7, 5, 7)[: len(phases)])
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
