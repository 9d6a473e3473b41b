"""The page that is written to a file: what is in it, that it is whole, and that it works offline."""

from __future__ import annotations

import builtins
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="a page needs the extra 'explore'")

import peel_opt as po
from peel_opt.app.cli.main import main
from peel_opt.app.explorer import export, precomputed
from peel_opt.app.explorer.export import write_page
from peel_opt.app.explorer.precomputed import places, relatives, solved
from peel_opt.app.explorer.presets import FIGURES, SCENES
from peel_opt.app.explorer.state import State
from peel_opt.plots.scene import LINES

from . import test_explorer_browser as live

browser, downloads = live.browser, live.downloads

START = State(lam=-0.2)
#: One of them is not on its branch.
BEGIN = {"Figures": {name: FIGURES[name] for name in ("Figure 6: β₀ = 10", "Figure 3 (e): y < 0")}}
FLAP = State(units="SI", given="length", law="cohesive", length=1.9e-3, pressure=6e4)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small page: two beta0, few places."""
    return write_page(
        tmp_path_factory.mktemp("page") / "page.html", START, values=[8.0, 42.0], points=10, begin=BEGIN
    )


# --- which states ---------------------------------------------------------------------------


def test_relatives_hold_the_state_itself_once() -> None:
    found = relatives(START)
    assert [r.state.beta0 for r in found] == [1.0, 2.0, 4.0, 8.0, 16.0]
    assert [r.asked for r in found] == [False, False, True, False, False]
    assert [r.state.beta0 for r in relatives(State(beta0=0.0))] == [0.0, 1.0, 2.0, 4.0]
    assert [r.state.beta0 for r in relatives(START, [4.0, 9.0])] == [4.0, 9.0]
    flaps = relatives(FLAP)
    own = FLAP.effective_ratio
    assert [r.state.effective_ratio for r in flaps] == pytest.approx([0.5 * own, own, 2 * own], rel=1e-12)
    assert len({(r.state.k, r.state.T0) for r in flaps}) == 1
    assert all(r.state.accuracy == "standard" for r in relatives(State(accuracy="sketch")))
    with pytest.raises(po.InvalidInput, match="finite"):
        relatives(START, [float("nan")])
    with pytest.raises(po.OutOfRange):
        relatives(START, [-1.0])


def test_places_run_along_the_branch_and_have_the_answers_of_the_package() -> None:
    state = START.changed(accuracy="standard")
    found = places(state, 10)
    assert 6 <= len(found) <= 10
    alpha1 = np.array([p.y for p in found])
    assert (np.diff(alpha1) < 0.0).all()
    assert {p.state.label for p in found} == {"middle", "lower"}
    for place in found[::3]:
        screen = solved(place)
        assert screen is not None
        eq = po.equilibrium(beta0=4, lam=place.state.lam, state=place.state.label)
        assert screen.equilibrium is not None
        assert screen.equilibrium.alpha1 == pytest.approx(eq.alpha1, abs=1e-8)


def test_a_place_whose_answer_lies_elsewhere_is_left_out() -> None:
    found = places(START.changed(accuracy="standard"), 6)
    wrong = precomputed.SliderPlace(found[-1].state, found[-1].x, found[0].y)
    assert solved(found[-1]) is not None
    assert solved(wrong) is None
    assert solved(precomputed.SliderPlace(START.changed(lam=-5.0), -5.0, -1.0)) is None


# --- the file -------------------------------------------------------------------------------


def test_a_page_is_whole_small_and_says_what_it_is(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert page.stat().st_size < 6_000_000
    assert not re.search(r"<(?:script|link|iframe)\b[^>]*\b(?:src|href)=", text)
    assert "connect-src" not in text
    assert "default-src 'none'" in text
    assert [f.name for f in page.parent.iterdir()] == ["page.html"]
    assert f"peel_opt {po.__version__}" in text
    assert re.search(r"(\d+) states, solved beforehand by method \S+ to 1e-8: \1 certified", text)
    assert "Linear law (Fig 2b), delay convention" in text
    assert "The state asked for" not in text
    assert "Play the sweep" not in text  # there is none
    assert "Choose a problem and move along its branch" in text


@pytest.mark.parametrize(
    "state",
    [State(lam=-5.0), State(lam=1.0, label="spurious"), State(beta0=53.16, lam=15.69)],
)
def test_a_state_that_is_not_on_the_branch_is_said(tmp_path: Path, state: State) -> None:
    text = write_page(tmp_path / "page.html", state, values=[], points=4, begin={}).read_text(
        encoding="utf-8"
    )
    assert f"({state.label}), is not on this branch" in text


def test_a_rod_has_places_from_t_to_contact_and_its_own_state_among_them() -> None:
    state = FLAP.changed(accuracy="standard")
    found = places(state, 7)
    assert [p.state.given for p in found] == ["pressure"] * len(found)
    assert {p.state.label for p in found} == {"middle", "lower", "folded"}
    found, at, shown = precomputed.with_own(found, state)
    assert shown
    screen = solved(found[at])
    assert screen is not None
    assert screen.equilibrium is not None
    eq = po.pressure_given_length(po.Rod(state.k, state.T0, state.y0), 1.9e-3)
    assert screen.equilibrium.pressure == pytest.approx(eq.pressure, rel=1e-10)


@pytest.mark.slow
def test_relatives_of_a_scene_have_another_number_of_it() -> None:
    state = SCENES["An edge never glued, of 0.5 η"]
    found = relatives(state)
    assert [r.name for r in found] == ["a = 0.25 η", "a = 0.5 η", "a = 0.75 η"]
    assert [r.asked for r in found] == [False, True, False]
    assert [r.state.unbonded for r in relatives(state, [1.0])] == [0.5, 1.0]


@pytest.mark.slow
def test_places_of_a_scene_run_along_its_branch() -> None:
    state = SCENES["An edge never glued, of 0.5 η"].changed(accuracy="standard")
    found = places(state, 6)
    assert {p.state.label for p in found} == {"lifted", "middle", "folded"}
    found, at, own = precomputed.with_own(found, state)
    assert own
    for place in (found[at], found[-1]):
        screen = solved(place)
        assert screen is not None
        assert screen.loop is not None


def test_the_same_problem_gives_the_same_bytes(page: Path, tmp_path: Path) -> None:
    code = (
        "import sys; from peel_opt.app.explorer.export import write_page;"
        "from peel_opt.app.explorer.state import State;"
        "from peel_opt.app.explorer.presets import FIGURES;"
        "begin = {'Figures': {name: FIGURES[name] for name in ('Figure 6: β₀ = 10', 'Figure 3 (e): y < 0')}};"
        "write_page(sys.argv[1], State(lam=-0.2), values=[8.0, 42.0], points=10, begin=begin)"
    )
    # Ids have been counted otherwise there, and strings hash differently.
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "third.html"], check=False, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (tmp_path / "third.html").read_bytes() == page.read_bytes()


def test_nothing_is_written_or_computed_where_it_cannot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(export, "places", lambda *_: pytest.fail("computed in vain"))
    (tmp_path / "file").write_text("")
    for target, said in (
        (tmp_path / "file" / "a.html", "cannot make the folder"),
        (tmp_path / "a.png", "ends in .html"),
        (tmp_path / "nul\0.html", "NUL"),
    ):
        assert main(["explore", "--export", str(target)]) == 2
        captured = capsys.readouterr()
        assert said in captured.err
        assert captured.err.count("\n") == 1
        assert captured.out == ""
    (tmp_path / "folder.html").mkdir()
    with pytest.raises(po.InvalidInput, match="it is a folder"):
        write_page(tmp_path / "folder.html")
    with pytest.raises(po.InvalidInput, match="2 to 400 places"):
        write_page(tmp_path / "b.html", points=1)
    assert sorted(f.name for f in tmp_path.iterdir()) == ["file", "folder.html"]


def test_an_interrupted_page_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "page.html"
    target.write_text("before", encoding="utf-8")

    def interrupted(*_: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(export, "solved", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_page(target, START, values=[], points=4, begin={})
    assert target.read_text(encoding="utf-8") == "before"
    assert [f.name for f in tmp_path.iterdir()] == ["page.html"]


def test_a_page_of_nothing_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export, "solved", lambda _place: None)
    with pytest.raises(po.NoEquilibrium, match="could be solved"):
        write_page(tmp_path / "page.html", START, values=[], points=4, begin={})
    assert not list(tmp_path.iterdir())


def test_without_bokeh_the_line_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = builtins.__import__

    def missing(name: str, *rest: Any) -> Any:
        if name.partition(".")[0] == "bokeh":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", missing)
    assert main(["explore", "--export", str(tmp_path / "a.html")]) == 1
    assert "pip install 'peel_opt[explore]'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


# --- in a browser ---------------------------------------------------------------------------


def begin_with_a_figure(browser: Any) -> None:
    """A problem to begin with opens at its own state, and takes the mark off the relatives."""
    options = live.js(browser, "return model('begin').options")
    assert [name for _, name in options["Figures"]] == ["Figure 6: β₀ = 10"]
    live.js(browser, "model('begin').value = arguments[0]", options["Figures"][0][0])
    live.wait(lambda: "β₀ = 10" in live.text(browser, "headline"))
    assert live.dot(browser, "diagram")[0] == pytest.approx(-1.0)
    assert live.js(browser, "return model('choice').active") is None
    # Above the turn there is no potential: no axes of nothing, and no complaint of a mark that is gone.
    live.js(browser, "model('choice').active = 2; model('place').value = 5")
    live.wait(lambda: "β₀ = 42" in live.text(browser, "headline"))
    live.wait(lambda: not live.js(browser, "return model('potential').below[0].visible"))
    live.js(browser, "model('choice').active = 1")
    live.wait(lambda: "β₀ = 8" in live.text(browser, "headline"))
    assert live.js(browser, "return model('begin').value") == ""
    live.js(browser, "const s = model('place'); s.value = s.end")
    live.wait(lambda: live.dot(browser, "diagram")[0] > 2.5)


def test_an_exported_page_works_without_any_network(browser: Any, page: Path) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    browser.get_log("performance")
    browser.execute_cdp_cmd("Network.enable", {})
    browser.execute_cdp_cmd(
        "Network.emulateNetworkConditions",
        {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0},
    )
    try:
        browser.get(page.as_uri())
        live.wait(
            lambda: browser.execute_script(
                "return window.Bokeh?.documents?.length && Bokeh.documents[0].is_idle"
            )
        )
        # It opens at the state that was asked for.
        eq = po.equilibrium(beta0=4, lam=-0.2)
        assert live.dot(browser, "diagram") == pytest.approx([-0.2, eq.alpha1], rel=1e-6)
        assert f"{eq.alpha1:.9f}" in live.text(browser, "headline")

        # The slider moves every panel.
        live.wait(lambda: not live.nameless(browser))
        assert {"place along the branch", "bifurcation diagram"} <= {n["name"] for n in live.heard(browser)}
        before = [live.dot(browser, name) for name in ("diagram", "potential", "loop")]
        own = 1 + LINES.index("rod")  # the ground comes first
        rod = f"return Array.from(model('rod').renderers[{own}].data_source.data.y).slice(0, 5)"
        shape = live.js(browser, rod)
        last = live.js(browser, "const s = model('place'); s.value = s.end; return s.end")
        assert last > 6
        live.wait(lambda: live.dot(browser, "diagram")[0] > 2.5)
        after = [live.dot(browser, name) for name in ("diagram", "potential", "loop")]
        assert all(a != b for a, b in zip(after, before, strict=True))
        assert live.js(browser, rod) != shape
        lam, alpha1 = live.dot(browser, "diagram")
        assert po.equilibrium(beta0=4, lam=lam).alpha1 == pytest.approx(alpha1, rel=1e-5)

        # Another beta0 has its own branch, at the same share of it.
        live.js(browser, "model('choice').active = 1")
        live.wait(lambda: "β₀ = 8" in live.text(browser, "headline"))
        lam, alpha1 = live.dot(browser, "diagram")
        assert po.equilibrium(beta0=8, lam=lam).alpha1 == pytest.approx(alpha1, rel=1e-5)

        begin_with_a_figure(browser)

        # A click on the branch goes there.
        code = """
        const view = Bokeh.index.find_one_by_id(model("diagram").id)
        const box = view.el.getBoundingClientRect()
        const {x_scale, y_scale} = view.frame
        return [box.x + x_scale.compute(arguments[0]), box.y + y_scale.compute(arguments[1])]
        """
        x, y = live.js(browser, code, -0.9, -1.5)
        click = ActionChains(browser)
        click.w3c_actions.pointer_action.move_to_location(int(x), int(y))
        click.w3c_actions.pointer_action.click()
        click.perform()
        live.wait(lambda: live.js(browser, "return model('place').value") < last - 2)
        live.wait(lambda: live.dot(browser, "diagram")[1] > -6.0)

        # It plays to the end and stops.
        live.js(browser, "model('place').value = 1; model('play').active = true")
        live.wait(lambda: not live.js(browser, "return model('play').active"))
        assert live.js(browser, "return [model('place').value, model('play').label]") == [last, "▶ Play"]
        assert not live.complaints(browser)

        asked = []
        for entry in browser.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] in ("Network.requestWillBeSent", "Network.webSocketCreated"):
                asked.append(message["params"].get("url") or message["params"]["request"]["url"])
        assert page.as_uri() in asked
        assert not [
            url
            for url in asked
            if url.split(":")[0] not in ("file", "data", "blob", "chrome", "chrome-untrusted")
        ]
    finally:
        browser.execute_cdp_cmd(
            "Network.emulateNetworkConditions",
            {"offline": False, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1},
        )
