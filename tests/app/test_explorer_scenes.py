"""Scenes in the explorer: what may be chosen, what is said and drawn, and what is left blank."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest

import peel_opt as po
from peel_opt.app.cards import load_card
from peel_opt.app.explorer import moves
from peel_opt.app.explorer.presets import SCENES
from peel_opt.app.explorer.screen import Screen
from peel_opt.app.explorer.screens import full_screen, full_screens, live_screen
from peel_opt.app.explorer.setups import SCENE_NUMBERS, SETUPS, setup_of
from peel_opt.app.explorer.state import State
from peel_opt.app.explorer.state_cards import from_card, to_card

PRESSED = State(given="pressure", law="cohesive", accuracy="draft")
FLAW = PRESSED.staged("flaw")
SI = State(units="SI", given="length", law="cohesive", length=1.9e-3, pressure=6e4)
FORCED = SI.staged("force")


# --- what may be chosen -----------------------------------------------------------------------


@pytest.mark.parametrize("state", [*SCENES.values(), FORCED, FLAW.changed(label="lifted", near=1.7)])
def test_links_and_cards_restore_a_scene(state: State, tmp_path: Path) -> None:
    assert State.from_query(state.to_query()) == (state, ())
    card = tmp_path / "card.toml"
    card.write_text(to_card(state), encoding="utf-8")
    back = from_card(load_card(card))
    own = [each.name for each in SETUPS[state.scene].numbers]
    for name in ("scene", "given", "units", "label", "near", state.field, *own):
        assert getattr(back, name) == getattr(state, name)


def test_a_scene_of_the_library_is_known_by_its_parts_and_numbers() -> None:
    rod = po.Rod(2.3e-5, 140e3, 0.73e-3)
    assert setup_of(po.Scene(rod, unbonded=0.5e-3)) == ("flaw", {"unbonded": pytest.approx(0.5e-3)})
    pulled = po.Scene(rod, tip=po.TipLoad(force=3.0, angle=1.0))
    assert setup_of(pulled) == ("force", {"force": pytest.approx(3.0), "angle": 1.0})
    twisted = po.Scene(rod, tip=po.TipLoad(force=3.0, angle=1.0, moment=0.1))
    streamed = po.Scene(rod, [po.Pressure(po.profiles.stream())], unbonded=0.5e-3)
    for other in (twisted, streamed, po.Scene(rod, wall=po.Circle(10.0), unbonded=0.5e-3)):
        assert setup_of(other) is None


def test_each_scene_begins_with_numbers_in_the_units_that_are_shown() -> None:
    for name, setup in SETUPS.items():
        for each in setup.numbers:
            plain, in_si = PRESSED.staged(name), SI.staged(name)
            size = 1.0 if each.dimension.unit == "rad" else each.dimension.size(in_si.rod)  # type: ignore[arg-type]
            assert getattr(plain, each.name) == each.start
            assert getattr(in_si, each.name) == pytest.approx(each.start * size)
    # As ratios they stay what they are in other units, and so does the rod.
    assert FORCED.switched("groups").force == pytest.approx(0.1)
    there = FLAW.switched("SI")
    assert there.unbonded == pytest.approx(0.5 * po.Rod(there.k, there.T0, there.y0).eta)
    assert there.effective_ratio == pytest.approx(FLAW.ratio, rel=1e-12)
    assert there.switched("groups").unbonded == pytest.approx(0.5)


def test_a_number_of_a_scene_is_in_the_unit_of_its_label() -> None:
    assert moves.typed(FORCED, "angle", "45").angle == pytest.approx(0.25 * math.pi)
    assert moves.typed(FORCED, "angle", "1 rad").angle == 1.0
    assert SCENE_NUMBERS["force"].title(FORCED.rod) == "force F [N/m]"  # type: ignore[arg-type]
    assert moves.typed(FORCED, "force", "3").force == 3.0
    assert moves.typed(FORCED, "force", "1 lbf/in").force == pytest.approx(175.1268, rel=1e-6)
    flaw = SI.staged("flaw")
    assert SCENE_NUMBERS["unbonded"].title(flaw.rod) == "unglued edge a [µm]"  # type: ignore[arg-type]
    assert moves.typed(flaw, "unbonded", "500").unbonded == pytest.approx(5e-4)
    assert moves.typed(flaw, "unbonded", "0.5 mm").unbonded == 5e-4
    assert moves.typed(flaw, "unbonded", "1 eta").unbonded == pytest.approx(flaw.rod.eta)  # type: ignore[union-attr]
    assert SCENE_NUMBERS["unbonded"].worded(flaw.rod, 5e-4) == "a = 500.0 um"  # type: ignore[arg-type]


def test_what_a_scene_cannot_be_is_refused_in_words() -> None:
    with pytest.raises(po.InvalidInput, match="of its own scene"):
        FLAW.asking("groups")
    with pytest.raises(po.OutOfRange, match="the unglued edge lies between a = 0 η and a = 1000 η"):
        FLAW.typed("unbonded", "-1")
    with pytest.raises(po.InvalidInput, match=r"no state of this scene is called spurious.*lifted"):
        FLAW.changed(label="spurious")
    with pytest.raises(po.InvalidInput, match="no state of this scene is called lifted"):
        PRESSED.changed(label="lifted")
    # From the paper's groups a scene is asked for its length; without its number it is the paper's.
    assert State().staged("wall").given == "pressure"
    assert FLAW.changed(unbonded=0.0).rods_scene is None


# --- what is shown ----------------------------------------------------------------------------


def never(_work: Callable[[], Screen]) -> Future[Screen]:
    """Take work and never do it."""
    return Future()


def test_widgets_of_a_scene_come_with_it_and_nothing_is_said_before_it_is_solved() -> None:
    pytest.importorskip("bokeh")
    from bokeh.document import Document

    from peel_opt.app.explorer.page import Page

    from .test_explorer_page import pump

    page = Page(Document(), PRESSED, submit=never)
    page.controls.scene.value = "force"
    pump(page)
    shown = {name for name, number in page.controls.numbers.items() if number.box.visible}
    assert shown == {"ratio", "pressure", "force", "angle"}
    assert page.controls.numbers["angle"].field.value == "90"
    assert not page.controls.boxes["convention"].visible
    assert "spurious" not in dict(page.controls.label.options)  # type: ignore[arg-type]
    assert "being solved" in page.panels.headline.text
    assert page.panels.rod.absent.text == "being solved"
    assert "solving" in page.panels.progress.text
    assert not page.screen.message
    for picture in page.panels.pictures:  # axes of nothing are not drawn
        assert not picture.figure.xaxis[0].visible
    page.controls.numbers["force"].field.value = "much"
    pump(page)
    assert "force" in page.controls.numbers["force"].refused.said.text
    page.controls.groups["given"].active = 0
    pump(page)
    assert (page.state.given, page.state.scene) == ("pressure", "force")
    assert "of its own scene" in page.notes.text
    page.controls.scene.value = "plate"
    pump(page)
    assert page.panels.rod.figure.xaxis[0].visible


@pytest.fixture(scope="module")
def flaw() -> list[tuple[Screen, str]]:
    """The screens of an edge without glue, ever fuller."""
    return list(full_screens(FLAW))


@pytest.mark.slow
def test_the_answer_comes_first_then_the_branch_its_stability_and_the_loop(
    flaw: list[tuple[Screen, str]],
) -> None:
    (answered, what), (traced, _), (stable, _), (full, last) = flaw
    eq = po.length_given_pressure(po.Scene(po.Rod.from_ratio(1.0), unbonded=0.5), pressure=0.5)
    assert answered.equilibrium is not None
    assert answered.equilibrium.length == pytest.approx(eq.length, rel=1e-8)
    assert (answered.diagram, what, last) == (None, "tracing its branch", "")
    assert answered.rod is not None
    assert {line.look for line in answered.rod.lines} >= {"unbonded", "rod"}
    assert traced.diagram is not None
    assert {line.look for line in traced.diagram.lines} == {"branch"}  # stability is not known yet
    assert stable.diagram is not None
    assert {line.look for line in stable.diagram.lines} == {"stable", "unstable"}
    snap = po.safe_pressure(po.Rod.from_ratio(1.0), flaw=0.5)
    first = next(mark for mark in stable.diagram.marks if mark.look == "LP-pressure")
    assert (first.x, first.y) == pytest.approx((snap.length, snap.pressure), abs=1e-4)
    assert full.diagram is not None
    assert full.diagram.here == pytest.approx((eq.length, 0.5))
    assert full.off_branch < 1e-3
    assert (full.full, full.loop is not None) == (True, True)
    assert (full.potential, "paper's scene" in full.no_potential) == (None, True)
    heights = np.concatenate([line.y for line in full.diagram.lines])
    assert heights.min() >= 0.0
    assert heights.max() < 1.2 * snap.pressure


@pytest.mark.slow
def test_a_drag_follows_the_state_and_the_branch_before_is_dotted(flaw: list[tuple[Screen, str]]) -> None:
    full = flaw[-1][0]
    moved = live_screen(FLAW.changed(unbonded=0.52), best=full.curve, before=full.equilibrium)
    exact = po.length_given_pressure(po.Scene(po.Rod.from_ratio(1.0), unbonded=0.52), pressure=0.5)
    assert moved.equilibrium is not None
    assert abs(moved.equilibrium.length - exact.length) <= moved.equilibrium.error + exact.error
    assert moved.diagram is not None
    assert {line.look for line in moved.diagram.lines} == {"own"}
    assert not moved.diagram.marks
    assert moved.curve is None
    # Where there is no such state the last one is not shown in its place.
    lost = live_screen(FLAW.changed(unbonded=0.7), best=full.curve, before=full.equilibrium)
    assert (lost.equilibrium, lost.solving, lost.message) == (None, True, "")
    gone = next(iter(full_screens(FLAW.changed(unbonded=0.7))))[0]
    assert "no lifted or unfolded equilibrium" in gone.message
    assert gone.nearest is not None
    assert next(iter(full_screens(gone.nearest)))[0].equilibrium is not None
    # Along the branch that is known states are looked up.
    beyond = live_screen(FLAW.at(0.56), best=full.curve, before=full.equilibrium)
    assert "no lifted or unfolded equilibrium" in beyond.message
    here = live_screen(FLAW.at(0.4), best=full.curve, before=full.equilibrium)
    assert here.diagram is not None
    assert here.diagram.distance(here.diagram.here) < 1e-3  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_state_of_a_scene_is_held_and_picked(flaw: list[tuple[Screen, str]]) -> None:
    full = flaw[-1][0]
    assert full.equilibrium is not None
    other = moves.chosen(FLAW, "given", "length", full.equilibrium)
    assert (other.given, other.scene) == ("length", "flaw")
    held = next(iter(full_screens(other)))[0].equilibrium
    assert held is not None
    assert held.pressure == pytest.approx(0.5, rel=1e-7)
    in_si = moves.chosen(FLAW, "units", "SI", full.equilibrium)
    there = next(iter(full_screens(in_si)))[0].equilibrium
    assert there is not None
    assert there.length_ratio == pytest.approx(full.equilibrium.length_ratio, rel=1e-7)
    click = moves.picked(full, 4.0, 0.15)
    assert click is not None
    assert click.label == "middle"


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SCENES if "edge" not in name])
def test_every_scene_is_drawn_with_what_acts_in_it(name: str) -> None:
    state = SCENES[name].changed(accuracy="draft")
    screen = full_screen(state)
    assert screen.full
    assert screen.rod is not None
    assert screen.diagram is not None
    assert screen.diagram.distance(screen.diagram.here) < 2e-3  # type: ignore[arg-type]
    assert min(line.y.min() for line in screen.diagram.lines) > -0.1  # no states under suction
    looks = {each.look for each in (*screen.rod.lines, *screen.rod.arrows)}
    assert looks >= {"force": {"tip-force"}, "wall": {"wall"}}.get(state.scene, {state.scene})
    assert (screen.loop is None) == bool(screen.no_loop)


@pytest.mark.slow
def test_a_sweep_in_a_scene_shows_its_states_and_no_other_where_it_is_attached() -> None:
    pytest.importorskip("bokeh")
    from bokeh.document import Document

    from peel_opt.app.explorer.page import Page

    from ..futures import at_once
    from .test_explorer_page import pump

    page = Page(Document(), PRESSED.staged("weight"), submit=at_once)
    pump(page)
    page.controls.play.active = True
    seen = set()
    for frame in page._frames:
        page._step()
        assert page.panels.loop.here.data["x"] == [frame.x]
        shown = len(page.panels.rod.lines["rod"].data["x"]) > 0
        assert shown == (frame.label != "adhered") or page.panels.rod.absent.text == "being solved"
        seen.add((frame.label, shown))
    assert {("adhered", False), ("folded", True)} <= seen
