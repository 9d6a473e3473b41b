"""The film of a snap in the explorer: what lets go, what is refused, and how it is played."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer's page needs the extra 'explore'")

from bokeh.document import Document
from bokeh.server.callbacks import PeriodicCallback

import peel_opt as po
from peel_opt.app.explorer.answers import full_answer
from peel_opt.app.explorer.film import FRAMES, Film, film_of
from peel_opt.app.explorer.page import Page
from peel_opt.app.explorer.player import NotWanted
from peel_opt.app.explorer.state import State

from ..futures import at_once
from .test_explorer_page import never, pump

LETS_GO = State(given="pressure", law="cohesive", ratio=0.3, pressure=0.9, accuracy="sketch")


def silent(_done: int, _total: int | None) -> None:
    """Hear how far a motion is, and do nothing."""


@pytest.mark.parametrize(
    ("state", "said"),
    [
        (LETS_GO.changed(label="folded"), "nothing grows about this state: it does not snap"),
        (LETS_GO.at(0.2), "no unfolded equilibrium at p/T0 = 0.2"),
        (LETS_GO.at(1.0), "fails everywhere at once"),
        (State(lam=1.0), "the linear law has no end at y0"),
    ],
)
def test_what_does_not_snap_is_refused_in_the_words_of_the_library(state: State, said: str) -> None:
    eq = None if state.rods_scene is not None else full_answer(state).equilibrium
    with pytest.raises(po.PeelOptError, match=said):
        film_of(state, eq, silent)


def test_a_motion_that_nobody_waits_for_is_given_up() -> None:
    calls = []

    def told(done: int, _total: int | None) -> None:
        calls.append(done)
        raise NotWanted

    with pytest.raises(NotWanted):
        film_of(LETS_GO, full_answer(LETS_GO).equilibrium, told)
    assert len(calls) == 1


def test_the_button_begins_a_motion_and_gives_it_up() -> None:
    page = Page(Document(), LETS_GO, submit=never)
    waiting: list[Callable[[], Film]] = []

    def taken(work: Callable[[], Film]) -> Future[Film]:
        waiting.append(work)
        return Future()

    player = page.player
    player._submit = taken
    player.begin(page.state, page.screen)
    assert player.button.label == "■ Give it up"
    assert "<progress" in page.panels.progress.text
    player.begin(page.state, page.screen)  # the same button
    assert (player.button.label, page.panels.progress.text) == ("▶ Let it snap", "")
    with pytest.raises(NotWanted):
        waiting[0]()
    # What is refused is said below the panels, and the page goes on.
    player._submit = at_once  # type: ignore[assignment]
    page.controls.label.value = "folded"
    pump(page, rest=False)
    player.begin(page.state, page.screen)
    pump(page)
    assert "does not snap" in page.notes.text
    assert not player.busy
    assert not player.bar.visible


@pytest.mark.slow
def test_an_edge_without_glue_plays_across_the_diagram_of_its_scene() -> None:
    state = State(given="pressure", law="cohesive", ratio=1.0, pressure=0.3, accuracy="sketch")
    page = Page(Document(), state.staged("flaw").changed(label="middle"), submit=at_once)
    pump(page)
    eq = page.screen.equilibrium
    assert page.screen.curve is not None
    film = film_of(page.state, eq, silent)
    assert film.motion.scene == page.state.rods_scene is not None
    page.player._submit = lambda _work: at_once(lambda: film)  # type: ignore[arg-type, return-value]
    page.player.begin(page.state, page.screen)
    pump(page)
    begins = page.panels.diagram.here.data
    assert (begins["x"][0], begins["y"][0]) == pytest.approx((eq.length, 0.3), abs=0.05)  # type: ignore[union-attr]
    assert "unbonded = 0.5" in page.panels.headline.text
    # A lifted edge stays.
    lifted = po.solve(film.motion.scene, free="length", pressure=0.3)
    with pytest.raises(po.NoEquilibrium, match="does not snap"):
        film_of(page.state, lifted, silent)


@pytest.fixture(scope="module")
def film() -> Film:
    """A rod that lets go at 0.9 T0 and comes to rest folded."""
    return film_of(LETS_GO, full_answer(LETS_GO).equilibrium, silent)


@pytest.mark.slow
def test_a_film_plays_pauses_and_seeks(film: Film) -> None:
    page = Page(Document(), LETS_GO, submit=at_once)
    pump(page)
    page.player._submit = lambda _work: at_once(lambda: film)  # type: ignore[arg-type, return-value]
    page.player.begin(page.state, page.screen)
    pump(page)
    assert page.player.bar.visible
    shown = {name for name, box in page.panels.boxes.items() if box.visible}
    assert shown == {"rod", "diagram", "motion", "ledger"}
    lengths, ledger = page.panels.film

    def dot(picture: Any) -> tuple[float, float]:
        return float(picture.here.data["x"][0]), float(picture.here.data["y"][0])

    # It begins in the state that let go, and plays.
    begun = po.length_given_pressure(po.Rod.from_ratio(0.3), 0.9)
    assert dot(page.panels.diagram) == pytest.approx((begun.length, 0.9), abs=0.02)
    (timer,) = [c for c in page.doc.session_callbacks if isinstance(c, PeriodicCallback)]
    for _ in range(10):
        timer.callback()
    assert page.player.moment.value == 10
    page.player.play.active = False
    assert not [c for c in page.doc.session_callbacks if isinstance(c, PeriodicCallback)]
    # The slider goes anywhere: to where it comes to rest.
    page.player.moment.value = FRAMES - 1
    rest = po.length_given_pressure(po.Rod.from_ratio(0.3), 0.9, state="folded")
    assert dot(page.panels.diagram) == pytest.approx((rest.length, 0.9), abs=0.01)
    shape = page.panels.rod.lines["rod"].data
    assert shape["x"][-1] == pytest.approx(rest.length, abs=0.01)
    assert np.nanmax(shape["y"]) == pytest.approx(rest.y.max(), abs=0.02)
    assert dot(lengths)[1] == pytest.approx(rest.length, abs=0.01)
    # All entries of the ledger add up to the work.
    end = film.motion.energy
    entries = ("bending", "separation", "drag-loss")
    parts = [float(ledger.lines[name].data["y"][-1]) for name in entries]
    assert sum(parts) == pytest.approx(float(ledger.lines["work"].data["y"][-1]), abs=1e-5)
    assert dot(ledger)[1] == pytest.approx(float(end.work[-1]), rel=0.02)
    assert "folded equilibrium" in page.panels.headline.text
    assert "certificate" in page.panels.headline.text
    # A picture that comes meanwhile does not disturb it; a slider ends it.
    page._draw()
    assert "folded equilibrium" in page.panels.headline.text
    page.controls.numbers["pressure"].slider.value = 0.85
    pump(page)
    assert not page.player.bar.visible
    shown = {name for name, box in page.panels.boxes.items() if box.visible}
    assert shown == {"rod", "diagram", "potential", "loop"}
    assert "unfolded" in page.panels.headline.text or "middle" in page.panels.headline.text


@pytest.mark.slow
def test_a_state_in_the_papers_groups_lets_go_as_its_rod() -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(0.3), 0.9)
    shown = film_of(State(beta0=eq.beta0, lam=eq.lam, law="cohesive"), eq, silent)
    assert shown.motion.pressure == pytest.approx(0.9)
    assert shown.motion.rod.ratio == pytest.approx(0.3)
