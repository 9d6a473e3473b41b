"""The pen of the page: what a browser is told to draw is what the result says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="a page needs the extra 'explore'")

from bokeh.models import ColumnDataSource

import peel_opt as po
from peel_opt.app.explorer.panels import FourPanels, Picture, apply
from peel_opt.app.explorer.screens import live_screen
from peel_opt.app.explorer.state import State
from peel_opt.plots.diagram import diagram_panel
from peel_opt.plots.panels import Axis, Line, Panel
from peel_opt.plots.rod import rod_panel

from ..rods import FLAP


def labels(picture: Picture) -> list[str]:
    return [item.label["value"] for item in picture.items.values() if item.visible]


def test_a_rod_has_its_shape_its_forces_and_its_units() -> None:
    eq = po.pressure_given_length(FLAP, 1.9e-3)
    pen = FourPanels(live=True).rod
    apply(pen.updates("Rod", rod_panel(eq)))
    np.testing.assert_allclose(pen.lines["rod"].data["x"], eq.x * 1e3, rtol=1e-14)
    np.testing.assert_allclose(pen.lines["rod"].data["y"], eq.y * 1e3, rtol=1e-14)
    fig = pen.figure
    assert (fig.xaxis[0].axis_label, fig.yaxis[0].axis_label) == ("x [mm]", "y [mm]")
    assert labels(pen) == ["pressure p", "adhesion f"]
    assert pen.marks.data["meaning"] == ["free tip s = 0", "detachment s = s̄"]
    # Adhesion is vertical: its heads point straight down.
    assert pen.arrows["adhesion"].data["angle"] == pytest.approx(-np.pi)
    x, y = fig.x_range, fig.y_range
    assert (x.end - x.start) / fig.frame_width == pytest.approx((y.end - y.start) / fig.frame_height)
    assert pen.ground is not None
    assert pen.ground[0].visible
    assert pen.ground[0].location == pytest.approx(0.73)


def test_a_diagram_has_letters_numbers_and_units() -> None:
    branch = po.trace(FLAP, points=24, tol=1e-6)
    pen = FourPanels(live=True).diagram
    apply(pen.updates("Diagram", diagram_panel(branch)))
    np.testing.assert_allclose(pen.lines["branch"].data["x"], branch.length * 1e3)
    assert pen.figure.yaxis[0].axis_label == "pressure p [kPa]"
    assert {"T", "F₁", "F₂", "P", "C"} < set(pen.marks.data["letter"])
    assert "P: fold in pressure" in pen.marks.data["meaning"]
    assert labels(pen) == ["detached"]


def test_pieces_of_a_look_are_one_line_with_gaps_and_nothing_is_sent_twice() -> None:
    one, two = np.array([0.0, 1.0]), np.array([3.0, 4.0])
    panel = Panel(Axis("$x$", 0.0, 4.0), Axis("$y$", 0.0, 4.0), (Line("up", one, one), Line("up", two, two)))
    pen = Picture("loop", ("up",))
    apply(pen.updates("Loop", panel))
    np.testing.assert_array_equal(pen.lines["up"].data["x"], [0.0, 1.0, np.nan, 3.0, 4.0])
    sent: list[Any] = []
    for model in pen.figure.references():
        if isinstance(model, ColumnDataSource):
            model.on_change("data", lambda attr, old, new: sent.append(new))
    apply(pen.updates("Loop", panel))
    assert not sent
    apply(pen.updates("Loop", None, "no loop here"))
    assert pen.absent.text == "no loop here"
    assert len(pen.lines["up"].data["x"]) == 0


def test_a_range_stands_still_while_it_is_filled() -> None:
    def shown(high: float) -> Panel:
        ends = np.array([0.0, high])
        return Panel(Axis("", 0.0, high), Axis("", 0.0, high), (Line("up", ends, ends),))

    pen = Picture("loop", ("up",))
    for high, expected in ((4.0, 4.0), (3.5, 4.0), (4.5, 4.5), (1.0, 1.0)):
        apply(pen.updates("", shown(high)))
        assert pen.figure.x_range.end == expected


def test_all_four_panels_show_the_state_of_a_scene() -> None:
    screen = live_screen(State(), budget=10.0)
    panels = FourPanels(live=True)
    apply(panels.updates(screen))
    eq = screen.equilibrium
    assert eq is not None
    for picture in (panels.diagram, panels.loop):
        assert (picture.here.data["x"][0], picture.here.data["y"][0]) == (eq.lam, eq.alpha1)
    assert panels.potential.here.data["x"] == [eq.alpha1]
    assert panels.diagram.figure.title.text.startswith("Bifurcation diagram\nstability at fixed s̄")
    assert panels.loop.figure.title.text.startswith("Hysteresis loop\ndelay, area 0.62")
    # A letter has one colour, whichever panel it stands in.
    colours: dict[str, set[str]] = {}
    for each in panels.pictures:
        for letter, colour in zip(each.marks.data["letter"], each.marks.data["colour"], strict=True):
            if letter:
                colours.setdefault(letter, set()).add(colour)
    assert "F" in colours
    assert all(len(found) == 1 for found in colours.values())
