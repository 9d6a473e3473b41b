"""The picture of a scene: what acts on the rod, where its arrows point and how long they are."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import peel_opt as po
from peel_opt.app.explorer.panels import Picture
from peel_opt.equilibria.result import Equilibrium
from peel_opt.plots.panels import Arrows, Line, Panel
from peel_opt.plots.rod import rod_panel
from peel_opt.plots.scene import ARROWS, LINES
from peel_opt.plots.scene_forces import acting_on

UNIT = po.Rod.from_ratio(1.0)
FLAP = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)


@cache
def state(name: str) -> Equilibrium:
    windy = [
        po.Pressure(po.profiles.linear(-0.4)),
        po.Weight(0.05),
        po.SkinFriction(traction=0.02),
        po.Drag(0.03),
    ]
    makers = {
        "windy": lambda: po.length_given_pressure(po.Scene(UNIT, windy), 0.7),
        "tilted": lambda: po.length_given_pressure(po.Scene(FLAP, [po.Weight(5e3, tilt=0.4)]), 80e3),
        "pulled": lambda: po.solve(po.Scene(UNIT, tip=po.TipLoad(angle=1.2)), free="force", length=2.0),
        "bent up": lambda: po.solve(po.Scene(UNIT, tip=po.TipLoad(moment=-1.0)), free="moment", length=1.5),
        "torn": lambda: po.length_given_pressure(po.Scene(FLAP, unbonded=0.5e-3), 50e3),
        "inside": lambda: po.length_given_pressure(
            po.Scene(FLAP, wall=po.Circle(300.0), natural_curvature=300.0), 50e3
        ),
        "pressed": lambda: po.length_given_pressure(
            po.Scene(FLAP, wall=po.Circle(100.0), tip=po.Contact()), 50e3
        ),
        "blister": lambda: po.solve(po.Blister(FLAP, slack=0.05e-3), free="length", pressure=20e3),
        "held by a line": lambda: po.solve(
            po.Scene(UNIT, law="none", line_energy=0.1), free="length", pressure=0.5
        ),
        "layered": lambda: po.length_given_pressure(po.Scene(UNIT, law=po.ElasticLayer(1e4)), 0.8),
        "sheared": lambda: po.length_given_pressure(po.Scene(UNIT, law=po.EffectiveOpening(0.5)), 0.8),
    }
    return makers[name]()


STATES = (
    "windy",
    "tilted",
    "pulled",
    "bent up",
    "torn",
    "inside",
    "pressed",
    "blister",
    "held by a line",
    "layered",
    "sheared",
)


def arrows(panel: Panel, look: str) -> Arrows:
    (found,) = [group for group in panel.arrows if group.look == look]
    return found


def vectors(panel: Panel, look: str) -> np.ndarray:
    """Arrows as they are seen: with the vertical scale of the picture, (n, 2)."""
    group = arrows(panel, look)
    assert panel.ground is not None
    return np.stack([group.x1 - group.x0, panel.ground.stretch * (group.y1 - group.y0)], axis=-1)


def line(panel: Panel, look: str) -> Line:
    return next(each for each in panel.lines if each.look == look)


@pytest.mark.parametrize("name", ["windy", "sheared", "torn"])
def test_the_bond_is_what_the_balance_leaves(name):
    eq = state(name)
    shape, sigma = eq.shape, eq.length_ratio
    assert isinstance(eq.scene, po.Scene)
    n, t, x, y = sum(force.parts for force in acting_on(eq, eq.scene)).T
    sine, cosine = np.sin(shape.theta), np.cos(shape.theta)
    # N' = q in units of T0 eta and eta; N is stored in k/sbar^2 over s/sbar.
    wanted = np.stack([-n * sine + t * cosine + x, n * cosine + t * sine + y]) * sigma**3
    kinks = np.diff(shape.xi) < 1e-12
    found = np.stack([np.gradient(N, shape.xi, edge_order=2) for N in (shape.Nx, shape.Ny)])
    inner = np.ones(len(shape.xi), bool)
    for k in [*np.flatnonzero(kinks), np.searchsorted(eq.s, eq.numbers.get("unbonded", -1.0))]:
        inner[max(k - 3, 0) : k + 4] = False
    np.testing.assert_allclose(found[:, inner], wanted[:, inner], atol=2e-3 * sigma**3)


def test_arrows_are_as_long_as_what_they_stand_for():
    panel = rod_panel(state("windy"))
    pressure = np.hypot(*vectors(panel, "pressure").T)
    # p0 (1 - 0.4 s/sbar), at stations a step apart along the rod as drawn.
    steps = np.diff(pressure) / pressure[0]
    np.testing.assert_allclose(steps, steps[0], rtol=1e-2)
    assert pressure[-1] / pressure[0] == pytest.approx(0.6, abs=0.05)
    down = vectors(panel, "weight")
    np.testing.assert_allclose(down[:, 0], 0.0, atol=1e-12)
    assert (down[:, 1] < 0.0).all()
    across = vectors(panel, "drag")
    np.testing.assert_allclose(across[:, 1], 0.0, atol=1e-12)
    assert (across[:, 0] > 0.0).all()
    # Both magnified: 0.05 T0 beside 0.03 T0 beside the bond's T0, which comes first.
    assert "arrows × 5" in arrows(panel, "weight").full
    assert "arrows × 10" in arrows(panel, "drag").full
    adhesion = np.hypot(*vectors(panel, "adhesion").T)
    assert np.hypot(*down.T).max() / adhesion.max() == pytest.approx(5 * 0.05, rel=0.05)


def test_friction_runs_along_the_rod():
    panel = rod_panel(state("windy"))
    rod, along = line(panel, "rod"), vectors(panel, "friction")
    assert panel.ground is not None
    slope = np.gradient(panel.ground.stretch * rod.y, rod.x)
    assert (along[:, 0] > 0.0).all()
    np.testing.assert_allclose(
        along[:, 1] / along[:, 0], np.interp(arrows(panel, "friction").x0, rod.x, slope), atol=0.05
    )


def test_weight_hangs_on_the_plumb_line_of_a_tilted_plate():
    down = vectors(rod_panel(state("tilted")), "weight")
    np.testing.assert_allclose(down[:, 0] / -down[:, 1], math.tan(0.4), rtol=1e-9)


@pytest.mark.slow
def test_a_pull_at_its_angle_and_a_moment_in_its_sense():
    panel = rod_panel(state("pulled"))
    ((u, v),) = vectors(panel, "tip-force")
    assert math.atan2(v, -u) == pytest.approx(1.2)
    assert arrows(panel, "tip-force").full.startswith("force $F$ = 0.")
    arc = line(rod_panel(state("bent up")), "arc")
    swept = np.sum(arc.x[:-1] * np.diff(arc.y) - arc.y[:-1] * np.diff(arc.x))
    centre = arc.x.mean(), arc.y.mean()
    swept -= centre[0] * (arc.y[-1] - arc.y[0]) - centre[1] * (arc.x[-1] - arc.x[0])
    assert swept < 0.0  # clockwise, which lifts a tip at the left


def test_an_edge_without_glue_is_marked_and_not_held():
    panel = rod_panel(state("torn"))
    edge = line(panel, "unbonded")
    assert "a$ = 500 µm" in edge.full
    assert arrows(panel, "adhesion").x0.min() > edge.x[-1]
    assert [mark.meaning for mark in panel.marks][1] == "end of the glue $s = a$"


def test_a_circle_is_drawn_as_one_and_its_bond_pulls_along_its_normal():
    panel = rod_panel(state("inside"))
    wall, radius = line(panel, "wall"), 1e3 / 300.0
    assert panel.ground is not None
    assert panel.ground.stretch == 1.0
    np.testing.assert_allclose(np.hypot(wall.x, wall.y - radius), radius, rtol=1e-12)
    held = arrows(panel, "adhesion")
    away = np.stack([held.x0, held.y0 - radius], axis=-1)
    pull = vectors(panel, "adhesion")
    across = away[:, 0] * pull[:, 1] - away[:, 1] * pull[:, 0]
    turned = across / (np.hypot(*away.T) * np.hypot(*pull.T))
    np.testing.assert_allclose(turned, 0.0, atol=2e-3)  # the foot lies between points of the shape
    assert "inside a circle of radius 3.333 mm" in wall.full


def test_a_tip_on_its_wall_shows_what_presses_it():
    panel = rod_panel(state("pressed"))
    ((_, v),) = vectors(panel, "tip-force")
    assert v > 0.0
    assert arrows(panel, "tip-force").full.startswith("reaction = ")


def test_a_blister_is_drawn_whole():
    panel = rod_panel(state("blister"))
    rod, mirror = line(panel, "rod"), line(panel, "mirror")
    np.testing.assert_allclose(rod.x + mirror.x, 2.0 * rod.x[0])
    assert panel.x.low < mirror.x.min()
    assert sum(each.look == "attached" for each in panel.lines) == 2
    assert "thrust" in panel.title


def test_a_line_energy_has_no_range_to_draw():
    panel = rod_panel(state("held by a line"))
    assert panel.ground is not None
    assert panel.ground.y0 is None
    assert "no cohesive law" in panel.title


@pytest.mark.parametrize("name", STATES)
def test_everything_is_within_the_picture_and_explained_once(name):
    panel = rod_panel(state(name))
    for group in panel.arrows:
        assert group.x1.min() >= panel.x.low
        assert group.y1.min() >= panel.y.low
        assert group.y1.max() <= panel.y.high
    ax = state(name).plot()
    labels = ax.get_legend_handles_labels()[1]
    assert len(labels) == len(set(labels))
    assert ax.get_legend().get_window_extent().y1 < ax.get_window_extent().y0


@pytest.mark.parametrize("name", STATES)
def test_the_page_has_a_look_for_everything(name):
    panel = rod_panel(state(name))
    picture = Picture("rod", LINES, ARROWS, ground=True)
    assert {each.look for each in panel.lines} <= set(LINES)
    assert {each.look for each in panel.arrows} <= set(ARROWS)
    shown = [model for model, _ in picture.updates("a rod", panel)]
    for group in panel.arrows:
        assert picture.arrows[group.look] in shown


def test_what_a_file_keeps_is_drawn(tmp_path):
    torn = state("torn")
    torn.save(tmp_path / "torn.npz")
    panel, before = rod_panel(po.Equilibrium.load(tmp_path / "torn.npz")), rod_panel(torn)
    assert [each.look for each in panel.arrows] == [each.look for each in before.arrows]
    assert [each.look for each in panel.lines] == [each.look for each in before.lines]
    assert panel.warnings == before.warnings
    replace(torn, scene="a scene with a profile of my own").save(tmp_path / "mine.npz")
    panel = rod_panel(po.Equilibrium.load(tmp_path / "mine.npz"))
    assert line(panel, "unbonded").x.size
    assert not panel.arrows
    assert any("not drawn" in warning for warning in panel.warnings)
