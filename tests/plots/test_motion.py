"""Pictures and films of motions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import peel_opt as po
from peel_opt.plots import film, plot_ledger, plot_orbit, plot_shapes
from peel_opt.plots.motion_panels import MotionPanels


@pytest.fixture(scope="module")
def moved() -> po.Snap:
    return po.snap(po.Rod(2.2867e-5, 140096.0, 0.728e-3), 40e3, mass=2.7, drag=2e4)


@pytest.mark.slow
def test_front_and_tip_against_time(moved: po.Snap) -> None:
    ax = moved.plot()
    front = ax.get_lines()[0]
    assert front.get_ydata()[-1] == pytest.approx(1e3 * moved.front[-1])
    assert ax.get_xlabel() == "$t$ [ms]"
    assert ax.get_ylabel() == "length [mm]"
    assert ax.get_xlim()[1] < 1e3 * (moved.t[-1] - moved.t[0])  # the growth from nothing is not shown


def test_the_ledger_shows_what_adds_up(moved: po.Snap) -> None:
    ax = plot_ledger(moved)
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in ax.get_lines()}
    paid = sum(lines[name] for name in ("bending", "separation", "kinetic", "lost to drag"))
    assert paid == pytest.approx(lines["work of the pressure"], abs=1e-6 * lines["bending"].max())
    assert ax.get_ylabel().endswith("[mJ/m]")


def test_the_orbit_lies_at_its_pressure_in_the_diagram_of_its_rod(moved: po.Snap) -> None:
    ax = plot_orbit(moved, po.trace(moved.rod))
    orbit = next(line for line in ax.get_lines() if line.get_label() == "snap")
    assert set(np.asarray(orbit.get_xdata())) == {40.0}
    with pytest.raises(po.InvalidInput, match="diagram"):
        plot_orbit(moved, po.trace(po.Rod.from_ratio(1.0)))


def test_shapes_stand_on_the_plate(moved: po.Snap) -> None:
    ax = plot_shapes(moved, count=4)
    shapes = [line for line in ax.get_lines() if len(np.asarray(line.get_xdata())) > 50]
    assert len(shapes) == 4
    assert all(np.asarray(line.get_ydata())[-2] == pytest.approx(0.0, abs=1e-9) for line in shapes)


def test_a_scene_is_named_and_its_glue_marked(moved: po.Snap) -> None:
    torn = replace(moved, scene=po.Scene(moved.rod, [po.Weight(50.0)], unbonded=0.5e-3))
    ax = plot_shapes(torn, count=3)
    dots = [line for line in ax.get_lines() if line.get_marker() == "o"]
    assert len(dots) == 3
    pose = torn.shape(torn.t[-1])
    there = np.interp(0.5e-3, pose.s, pose.x), np.interp(0.5e-3, pose.s, pose.y)
    last = min(np.hypot(d.get_xdata()[0] - 1e3 * there[0], d.get_ydata()[0] - 1e3 * there[1]) for d in dots)
    assert last < 1e-2
    title = torn.plot().get_title(loc="left")
    assert "bond: folded" in title
    assert "unbonded = 500 µm, weight = 50 Pa" in title
    labels = [line.get_label() for line in plot_ledger(torn).get_lines()]
    assert "work of all loads" in labels
    with pytest.raises(po.InvalidInput, match="what acts on it"):
        plot_orbit(torn, po.trace(moved.rod))
    assert "in a scene" in replace(moved, scene="Scene(...)").plot().get_title(loc="left")


@pytest.mark.slow
def test_an_orbit_is_drawn_over_the_branch_of_its_scene(moved: po.Snap) -> None:
    torn = replace(moved, scene=po.Scene(moved.rod, unbonded=0.5e-3))
    branch = po.trace(torn.scene, points=40, tol=1e-6)
    ax = plot_orbit(torn, branch)
    lines = {line.get_label(): np.asarray(line.get_xdata(), float) for line in ax.get_lines()}
    assert {"lifted", "unfolded", "folded", "snap"} <= lines.keys()
    snap = branch.special("LP-pressure")[0].pressure / 1e3
    assert np.nanmax(lines["lifted"]) == pytest.approx(snap, rel=1e-6)
    assert np.nanmax(branch.pressure) > moved.rod.adhesion_strength > 1e3 * np.nanmax(lines["folded"])


def test_films(moved: po.Snap, tmp_path: Path) -> None:
    seen = []
    path = moved.film(
        tmp_path / "snap.gif", frames=3, fps=10, progress=lambda done, total: seen.append((done, total))
    )
    with Image.open(path) as picture:
        frames = [
            np.asarray(picture.convert("L")) for _ in range(picture.n_frames) if picture.seek(_) is None
        ]
    assert len(frames) == 3
    assert np.any(frames[0] != frames[1])
    assert seen == [(1, 3), (2, 3), (3, 3)]
    assert "data:image/png" in film(moved, tmp_path / "snap.html", frames=2).read_text()
    with pytest.raises(po.InvalidInput, match="format of a film"):
        moved.film(tmp_path / "snap.avi")


@pytest.mark.parametrize("radius", [10e-3, -10e-3])
def test_a_wall_that_is_not_flat_is_drawn_as_it_is(moved: po.Snap, radius: float) -> None:
    scene = po.Scene(moved.rod, wall=po.Circle(1.0 / radius), natural_curvature=1.0 / radius)
    panel = MotionPanels(replace(moved, scene=scene)).rod(float(moved.t[-1]))
    lines = {line.look: (np.asarray(line.x), np.asarray(line.y)) for line in panel.lines}
    for look in ("wall", "attached"):  # in mm, a circle through the origin along +x
        x, y = lines[look]
        assert np.hypot(x, y - 1e3 * radius) == pytest.approx(abs(1e3 * radius), rel=1e-12)
    x, y = lines["attached"]
    angle = moved.front[-1] / radius
    assert (x[0], y[0]) == pytest.approx((1e3 * radius * np.sin(angle), 1e3 * radius * (1.0 - np.cos(angle))))
    assert panel.ground.solid is not None
    ax = plot_shapes(replace(moved, scene=scene), count=3)
    ends = [np.array(line.get_xydata())[-1] for line in ax.get_lines() if len(line.get_xdata()) > 50]
    assert all(np.hypot(a, b - 1e3 * radius) == pytest.approx(abs(1e3 * radius)) for a, b in ends)
