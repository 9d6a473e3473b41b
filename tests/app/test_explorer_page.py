"""The explorer's page as a document, without a browser: widgets, callbacks, panels, what is taken away."""

from __future__ import annotations

import builtins
import re
import socket
import threading
import urllib.request
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="the explorer's page needs the extra 'explore'")

from bokeh.document import Document
from bokeh.server.callbacks import PeriodicCallback

import peel_opt as po
from peel_opt.app.cards import load_card
from peel_opt.app.cli.main import main
from peel_opt.app.explorer import page as page_module
from peel_opt.app.explorer.page import Page
from peel_opt.app.explorer.screen import Screen
from peel_opt.app.explorer.server import make_server, open_page
from peel_opt.app.explorer.state import CHOICES, State

from ..futures import at_once


def never(_work: Callable[[], Screen]) -> Future[Screen]:
    """Take work and never do it."""
    return Future()


def pump(page: Page, *, rest: bool = True) -> None:
    """Run what the server's event loop would run, timeouts included, until nothing is left."""
    for _ in range(20):
        waiting = [c for c in page.doc.session_callbacks if not isinstance(c, PeriodicCallback)]
        if not rest:
            waiting = [c for c in waiting if type(c).__name__ == "NextTickCallback"]
        if not waiting:
            return
        for each in waiting:
            if each in page.doc.session_callbacks:
                page.doc.callbacks.remove_session_callback(each)
                each.callback()
    raise AssertionError("the page never comes to rest")


def opened(state: State | None = None, submit: Callable[..., Any] = at_once) -> Page:
    page = Page(Document(), state or State(accuracy="sketch"), submit=submit)
    pump(page)
    return page


def slide(page: Page, name: str, value: float, *, rest: bool = True) -> None:
    page.controls.numbers[name].slider.value = value
    pump(page, rest=rest)


def here(page: Page) -> tuple[float, float]:
    data = page.panels.diagram.here.data
    return float(data["x"][0]), float(data["y"][0])


def test_a_page_opens_with_all_panels_filled() -> None:
    page = opened(State())
    assert page.screen.full
    assert here(page) == pytest.approx((-0.23, po.equilibrium(beta0=4, lam=-0.23).alpha1), rel=1e-6)
    assert len(page.panels.rod.lines["rod"].data["x"]) > 20
    assert page.panels.potential.here.data["x"][0] == pytest.approx(here(page)[1], rel=1e-6)
    assert len(page.panels.loop.lines["up"].data["x"]) > 20
    for part in ("state", "diagram", "potential"):
        assert f">{part}</td>" in page.costs.text
    assert "certified" in page.panels.headline.text
    assert page.address.data["query"] == [page.state.to_query()]


def test_all_panels_follow_a_slider() -> None:
    page = opened()
    before = np.array(page.panels.rod.lines["rod"].data["y"])
    slide(page, "lam", 1.0, rest=False)
    assert not page.screen.full
    assert here(page)[0] == pytest.approx(1.0)
    assert page.panels.loop.here.data["x"][0] == pytest.approx(1.0)
    assert page.panels.potential.items["current"].label["value"] == "λ = 1"
    assert np.nanmax(page.panels.rod.lines["rod"].data["y"]) > np.nanmax(before)
    pump(page)
    assert page.screen.full
    slide(page, "beta0", 9.0)
    assert page.screen.diagram.marks[1].x == pytest.approx(-1.38, abs=0.02)
    assert page.controls.numbers["beta0"].field.value == "9"


def test_many_values_of_one_drag_make_one_picture() -> None:
    page = opened()
    pictures = []
    page._live, live = lambda: (pictures.append(page.state.lam), live()), page._live  # type: ignore[method-assign]
    for value in np.linspace(0.0, 1.0, 50):
        page.controls.numbers["lam"].slider.value = float(value)
    pump(page)
    assert pictures == [1.0]


def test_a_value_released_while_the_browser_paints_makes_one_picture_and_one_solve() -> None:
    solves: list[Callable[[], Screen]] = []

    def taken(work: Callable[[], Screen]) -> Future[Screen]:
        solves.append(work)
        return Future()

    page = Page(Document(), State(accuracy="sketch"), submit=taken)

    def painted() -> None:
        page.pace.pulse.data = {"sent": [page.pace.count], "seen": [page.pace.count]}

    painted()
    slide(page, "lam", 0.1, rest=False)  # sent, and not yet painted
    sent = page.pace.count
    solves.clear()
    slide(page, "lam", 0.2, rest=False)
    page._slider("lam", 0.3, False)
    page._slider("lam", 0.5, True)
    assert page._held
    painted()
    for _ in range(3):
        pump(page)
        painted()
    assert page.pace.count == sent + 1
    assert here(page)[0] == pytest.approx(0.5)
    assert len(solves) == 1
    # And the next value is shown as ever.
    slide(page, "lam", 0.6, rest=False)
    assert here(page)[0] == pytest.approx(0.6)


@pytest.mark.parametrize("end", ["start", "end"])
def test_the_slider_of_the_rod_reaches_its_ends(end: str) -> None:
    page = opened(State(given="length", law="cohesive", accuracy="sketch"), submit=never)
    slider = page.controls.numbers["ratio"].slider
    slide(page, "ratio", getattr(slider, end), rest=False)
    assert page.state.ratio == {"start": 0.005, "end": 3000.0}[end]
    assert "outside" not in page.notes.text


def test_a_stale_result_is_not_shown() -> None:
    waiting: list[tuple[Callable[[], Screen], Future[Screen]]] = []

    def later(work: Callable[[], Screen]) -> Future[Screen]:
        waiting.append((work, Future()))
        return waiting[-1][1]

    page = Page(Document(), State(accuracy="sketch"), submit=later)
    slide(page, "lam", 0.5)
    first, second = waiting
    second[1].set_result(second[0]())
    first[1].set_result(first[0]())
    pump(page)
    assert page.screen.state.lam == 0.5
    assert page.screen.full


def test_a_failing_computation_leaves_the_page_alive() -> None:
    def broken(_work: Callable[[], Screen]) -> Future[Screen]:
        future: Future[Screen] = Future()
        future.set_exception(RuntimeError("<b>boom</b>"))
        return future

    page = Page(Document(), State(accuracy="sketch"), submit=broken)
    pump(page)
    assert "&lt;b&gt;boom" in page.notes.text
    slide(page, "lam", 0.5)
    assert here(page)[0] == pytest.approx(0.5)


def test_what_cannot_be_typed_stays_with_its_reason_beside_it() -> None:
    page = opened(submit=never)
    number = page.controls.numbers["beta0"]
    for text in ("nan", "1e999", "-5", "<script>alert(1)</script>", "", "4 mm", "9" * 500):
        number.field.value = text
        pump(page)
        assert page.state.beta0 == 4.0
        assert number.refused.said.visible
        assert "beta0" in number.refused.said.text
        assert "<script" not in number.refused.said.text
        assert number.field.value == text
        assert number.field.css_classes == ["refused"]
    # A picture that comes later leaves it there; another value takes its place.
    page.controls.show(page.state, page.screen.curve)
    assert number.field.value == "9" * 500
    slide(page, "lam", 0.25)
    assert page.state.lam == 0.25
    assert not number.refused.said.visible
    assert (number.field.value, number.field.css_classes) == ("4", [])


def test_a_refused_number_of_a_rod_says_why_below_the_rod() -> None:
    page = opened(State(units="SI", given="length", law="cohesive", accuracy="sketch"), submit=never)
    k, y0 = page.controls.texts["k"], page.controls.texts["y0"]
    before = page.state.y0
    y0.value = "3 kPa"
    pump(page)
    assert (page.state.y0, y0.value, k.css_classes) == (before, "3 kPa", [])
    assert page.controls.refused.said.visible
    assert "y0" in page.controls.refused.said.text
    y0.value = "0.8 mm"
    pump(page)
    assert page.state.y0 == pytest.approx(8e-4)
    assert not page.controls.refused.said.visible
    assert float(y0.value.removesuffix(" um")) == 800.0


def test_a_rod_in_si_is_typed_and_switched() -> None:
    page = opened()
    before = page.screen.equilibrium
    assert before is not None
    page.controls.groups["units"].active = 1
    pump(page)
    assert page.state.units == "SI"
    assert page.screen.equilibrium is not None
    assert page.screen.equilibrium.pressure_ratio == pytest.approx(before.pressure_ratio, abs=1e-3)
    assert page.controls.rod_box.visible
    assert not page.controls.numbers["beta0"].box.visible
    page.controls.texts["k"].value = "30 uN m"
    pump(page)
    assert page.state.k == pytest.approx(3e-5)
    page.controls.numbers["length"].field.value = "2.1 mm"
    pump(page)
    assert page.state.length == pytest.approx(2.1e-3)
    assert page.controls.numbers["length"].slider.value == pytest.approx(2100.0)
    assert "mm" in page.panels.diagram.figure.xaxis[0].axis_label
    slide(page, "length", 2200.0)
    assert page.state.length == pytest.approx(2.2e-3)
    assert "Pa" in page.panels.headline.text


def test_si_and_groups_given_cannot_be_combined_and_say_so() -> None:
    page = opened(State(units="SI", given="length", law="cohesive", accuracy="sketch"))
    page.controls.groups["given"].active = 0
    pump(page)
    assert page.state.given == "length"
    assert "its groups follow" in page.notes.text
    assert page.controls.groups["given"].active == 1


def test_every_choice_can_be_made() -> None:
    page = opened(submit=never)
    for field in ("given", "law", "convention", "accuracy", "units"):
        for number, value in enumerate(CHOICES[field]):
            page.controls.groups[field].active = number
            pump(page, rest=False)
            assert getattr(page.state, field) == value
            assert page.screen.equilibrium is not None or page.screen.message


def test_cards_and_figures_are_begun_with_by_name() -> None:
    page = opened(State(accuracy="sketch", convention="maxwell"))
    begin = page.controls.begin
    assert begin.value == ""
    begin.value = "Transparent office tape"
    pump(page)
    assert (page.state.accuracy, page.state.convention) == ("sketch", "maxwell")
    assert (page.state.units, page.state.pressure) == ("SI", 2e5)
    assert page.screen.equilibrium is not None
    # k of the card's sheet: E h^3 / (12 (1 - nu^2)).
    assert page.state.k == pytest.approx(1.5e9 * 40e-6**3 / (12.0 * (1.0 - 0.4**2)))
    page.controls.numbers["pressure"].slider.value *= 0.9
    pump(page)
    assert begin.value == ""
    begin.value = "Figure 6: β₀ = 10"
    pump(page)
    assert (page.state.beta0, page.state.label) == (10.0, "unfolded")
    assert begin.value == "Figure 6: β₀ = 10"
    groups = cast(dict[str, list[str]], begin.options)
    named = groups["Cards of problems/"]
    assert "Aortic media flap, circumferential" in named
    assert len(named) >= 8


def test_the_page_says_what_it_is_and_what_its_letters_mean() -> None:
    page = opened(submit=never)
    said = cast(Any, page.doc.get_model_by_name("header")).text
    for letter in "TFMDYPC":
        assert f"<dt>{letter}</dt>" in said
    assert "<h1>" in said
    drawn = {text[0] for each in page.panels.pictures for text in each.marks.data["letter"] if text}
    assert drawn
    for letter in drawn:
        assert f"<dt>{letter}</dt>" in said
    for picture in page.panels.pictures:
        assert cast(Any, page.doc.get_model_by_name(f"caption-{picture.figure.name}")).text.endswith(".")


def test_a_state_that_does_not_exist_offers_the_nearest() -> None:
    page = opened(State(lam=-0.9, accuracy="sketch"))
    assert "nearest that does exist" in page.notes.text
    assert "no such state" in page.panels.headline.text
    assert page.controls.nearest.visible
    assert len(page.panels.rod.lines["rod"].data["x"]) == 0
    page._to_nearest()
    pump(page)
    assert page.state.lam == pytest.approx(-0.269, abs=1e-3)
    assert not page.controls.nearest.visible
    assert len(page.panels.rod.lines["rod"].data["x"]) > 20


def test_a_click_on_a_branch_shows_that_state() -> None:
    page = opened(State(given="length", law="cohesive", accuracy="sketch"))
    page._tapped(SimpleNamespace(x=5.0, y=0.3))
    pump(page)
    assert page.state.label == "folded"
    assert here(page) == pytest.approx((5.0, 0.3), abs=0.1)
    assert any("folded back" in w for w in page.screen.warnings)
    first = page.screen.equilibrium
    assert first is not None
    slide(page, "length", page.state.length + 0.02, rest=False)
    assert page.screen.equilibrium is not None
    assert page.screen.equilibrium.pressure_ratio == pytest.approx(first.pressure_ratio, abs=0.03)
    page._tapped(SimpleNamespace(x=None, y=None))
    page._tapped(SimpleNamespace(x=float("nan"), y=0.0))
    assert page.state.label == "folded"


def test_the_sweep_plays_and_ends_where_it_began() -> None:
    page = opened()
    state, start = page.state, here(page)
    page.controls.play.active = True
    (periodic,) = [c for c in page.doc.session_callbacks if isinstance(c, PeriodicCallback)]
    places, heights = [], []
    for _ in range(len(page._frames)):
        periodic.callback()
        places.append((float(page.panels.loop.here.data["x"][0]), float(page.panels.loop.here.data["y"][0])))
        heights.append(float(np.nanmax(page.panels.rod.lines["rod"].data["y"])))
    assert {y == 0.0 for _, y in places} == {True, False}
    assert min(heights) == 0.0
    assert max(heights) > 0.03
    periodic.callback()
    assert not page.controls.play.active
    assert (page.state, here(page)) == (state, start)
    assert not [c for c in page.doc.session_callbacks if isinstance(c, PeriodicCallback)]


def test_touching_a_slider_ends_the_sweep() -> None:
    page = opened()
    page.controls.play.active = True
    slide(page, "lam", 0.75)
    assert not page.controls.play.active
    assert here(page)[0] == pytest.approx(0.75)


def test_two_pages_do_not_disturb_each_other() -> None:
    one, two = opened(), opened(State(beta0=10.0, lam=-1.0, accuracy="sketch"))
    before = (two.state, here(two), two.panels.headline.text)
    slide(one, "lam", 2.0)
    one.controls.groups["accuracy"].active = 1
    pump(one)
    pump(two)
    assert (two.state, here(two), two.panels.headline.text) == before


def test_csv_and_card_are_delivered(tmp_path: Path) -> None:
    page = opened(State(given="pressure", law="cohesive", pressure=0.4, accuracy="sketch"))
    page._send_csv()
    (text,) = page.outbox.data["text"]
    assert page.outbox.data["kind"] == ["text/csv"]
    assert "diagram,unstable," in text
    page._send_card()
    card = tmp_path / page.outbox.data["name"][0]
    card.write_text(page.outbox.data["text"][0], encoding="utf-8")
    ((_, eq),) = load_card(card).ask()
    assert isinstance(eq, po.Equilibrium)
    assert eq.length_ratio == pytest.approx(here(page)[0], rel=1e-3)
    page._send_link()
    assert page.address.data["query"] == [page.state.to_query()]
    assert page.outbox.data["number"] == [3]
    # The only kind that the browser does not make a file of.
    assert page.outbox.data["kind"] == ["clipboard"]
    assert 'kind == "clipboard"' in page.outbox.js_property_callbacks["change:data"][0].code  # type: ignore[attr-defined]


def test_a_page_that_opens_with_a_bad_link_says_so_and_works() -> None:
    doc = Document()
    request = SimpleNamespace(arguments={"beta0": [b"<img src=x onerror=alert(1)>"], "lam": [b"0.5"]})
    doc._session_context = lambda: SimpleNamespace(request=request)  # type: ignore[assignment, return-value]
    pages: list[Page] = []
    real = page_module.Page
    try:
        page_module.Page = lambda *given: pages.append(real(*given, submit=at_once))  # type: ignore[assignment, misc]
        open_page(doc, State(accuracy="sketch"))
    finally:
        page_module.Page = real  # type: ignore[misc]
    (page,) = pages
    assert page.state.lam == 0.5
    assert "&lt;img" in page.notes.text
    assert "<img" not in page.notes.text


# --- the server and the command -----------------------------------------------------------------


def test_the_server_listens_on_the_loopback_address_only() -> None:
    import asyncio

    found: dict[str, Any] = {}
    up = threading.Event()

    def run() -> None:
        asyncio.set_event_loop(asyncio.new_event_loop())
        taken = socket.socket()
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        number = taken.getsockname()[1]
        try:
            with pytest.raises(po.InvalidInput, match="cannot listen"):
                make_server(port=number)
        finally:
            taken.close()
        server = found["server"] = make_server()
        server.start()
        found["loop"] = server.io_loop
        up.set()
        server.io_loop.start()
        server.stop()
        server.io_loop.close()

    thread = threading.Thread(target=run)
    thread.start()
    assert up.wait(30)
    server = found["server"]
    try:
        assert {s.getsockname()[0] for s in server._http._sockets.values()} == {"127.0.0.1"}
        text = urllib.request.urlopen(f"http://127.0.0.1:{server.port}/", timeout=30).read().decode()
    finally:
        found["loop"].add_callback(found["loop"].stop)
        thread.join(30)
    assert "peel_opt explorer" in text
    # Scripts come from this server, by a path and not by a host.
    scripts = re.findall(r'src="([^"]+)"', text)
    assert scripts
    assert all(source.startswith("static/") or source.startswith("/static/") for source in scripts)
    assert "cdn" not in text.lower()


def test_without_bokeh_the_command_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = builtins.__import__

    def absent(name: str, *rest: Any) -> Any:
        if name.split(".", maxsplit=1)[0] == "bokeh":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", absent)
    assert main(["explore", "--no-browser"]) == 1
    assert "pip install 'peel_opt[explore]'" in capsys.readouterr().err


@pytest.mark.parametrize(
    "options", [["--port", "99999"], ["nowhere.toml"], ["--backend", "qt"], ["--port", "x"]]
)
def test_wrong_options_are_wrong_input(options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explore", *options]) == 2
    assert capsys.readouterr().err


def test_serving_says_where_and_ends_when_interrupted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from peel_opt.app.explorer import server as module

    class Loop:
        def start(self) -> None:
            raise KeyboardInterrupt

    stopped = []
    fake = SimpleNamespace(port=5999, io_loop=Loop(), start=lambda: None, stop=lambda: stopped.append(True))
    monkeypatch.setattr(module, "make_server", lambda state, *, port=None: fake)
    monkeypatch.setattr(module, "warm_up", lambda: None)
    assert main(["explore", "--no-browser"]) == 130
    assert "http://127.0.0.1:5999/" in capsys.readouterr().out
    assert stopped == [True]
