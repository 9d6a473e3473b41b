"""Walls of moving rods: the geometry of a circle, and a snap on one by both ways of computing it."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.base.threads import one_thread
from peel_opt.motion.acting import loads_on
from peel_opt.motion.arc import Arc
from peel_opt.motion.departure import stretched
from peel_opt.motion.mesh import run_on_mesh
from peel_opt.motion.run import Setting, Until
from peel_opt.motion.tracking import track


@pytest.mark.parametrize("curvature", [0.3, -0.3, 1e-9, 0.0])
def test_a_place_along_a_wall_and_a_height_over_it_come_back(curvature: float) -> None:
    arc, s, height = Arc(curvature), np.linspace(-2.0, 2.0, 9), np.linspace(0.0, 0.8, 9)
    (x, y), (nx, ny) = arc.at(s), arc.normal(s)
    found = arc.above(x + height * nx, y + height * ny)
    np.testing.assert_allclose(found.gap, height, atol=1e-14)
    np.testing.assert_allclose([found.nx, found.ny], [nx, ny], atol=1e-14)
    np.testing.assert_allclose(arc.place(x + height * nx, y + height * ny), s, atol=1e-14)
    np.testing.assert_allclose(arc.angle(x, y), curvature * s, atol=1e-14)
    np.testing.assert_allclose(found.turning * (1.0 - curvature * height), curvature, rtol=1e-12)


@pytest.mark.parametrize("curvature", [0.3, -0.3, 0.0])
def test_the_normal_turns_as_it_says(curvature: float) -> None:
    arc, x, y = Arc(curvature), np.array([0.7]), np.array([0.5])
    at, step = arc.above(x, y), 1e-6
    ahead, behind = (arc.above(x + sign * step * at.ny, y - sign * step * at.nx) for sign in (1.0, -1.0))
    assert (ahead.nx - behind.nx) / (2 * step) == pytest.approx(-at.turning * at.ny, abs=1e-9)
    assert (ahead.ny - behind.ny) / (2 * step) == pytest.approx(at.turning * at.nx, abs=1e-9)


@pytest.mark.slow
@one_thread
def test_a_front_that_is_tracked_and_a_mesh_agree_on_a_curved_wall() -> None:
    scene = po.Scene(po.Rod.from_ratio(1.0), wall=po.Circle(-0.05), natural_curvature=-0.05, unbonded=0.5)
    start = po.solve(scene, free="length", pressure=0.3, state="unfolded")
    setting = Setting(1.0, scene.bond.law, 0.3, 0.0, 1.0, loads=loads_on(scene))
    posture, until = stretched(start, 1.02 * start.length), Until(3000.0, contact=False, arrest=True)
    tracked = track(setting, posture, until, resolution=1)
    meshed = [run_on_mesh(setting, posture, until, resolution=resolution) for resolution in (0, 1)]
    assert [run.outcome for run in (tracked, *meshed)] == ["folded"] * 3
    for angle in (-1.0, -1.5, -2.0):
        exact, coarse, fine = (
            next(e for e in run.events if e.kind == "angle" and abs(e.angle - angle) < 1e-6)
            for run in (tracked, *meshed)
        )
        assert [fine.front, fine.y, fine.x] == pytest.approx([exact.front, exact.y, exact.x], abs=1e-3)
        assert abs(fine.y - exact.y) < 0.5 * abs(coarse.y - exact.y)
    known = po.solve(scene, free="length", pressure=0.3, state="folded")
    assert tracked.front[-1] == pytest.approx(known.length, abs=1e-7)
    identities, ledgers = (
        [np.abs(values(run)[2:]).max() for run in meshed]
        for values in (lambda run: run.identity, lambda run: run.energy.defect)
    )
    assert identities[1] < 0.3 * identities[0] < 3e-4
    assert ledgers[1] < 0.3 * ledgers[0] < 1e-4
