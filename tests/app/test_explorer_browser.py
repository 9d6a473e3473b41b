"""The explorer in a real browser: sliders, clicks, the sweep, files, and nothing from elsewhere.

Skipped, with the reason, where no Chromium is found; with PEEL_OPT_BROWSER=required that is a failure.
"""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

import peel_opt as po
from peel_opt.app.cards import load_card

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1280,900",
)
#: Seconds after which something that should happen in the browser counts as not happening.
PATIENCE = 60.0


def _missing(reason: str) -> None:
    if os.environ.get("PEEL_OPT_BROWSER") == "required":
        pytest.fail(f"PEEL_OPT_BROWSER=required, but {reason}", pytrace=False)
    pytest.skip(f"the explorer is NOT tested in a browser: {reason}")


@pytest.fixture(scope="module")
def server_url() -> Iterator[str]:
    pytest.importorskip("bokeh")
    from peel_opt.app.explorer.server import make_server, warm_up

    found: dict[str, Any] = {}
    up = threading.Event()

    def run() -> None:
        asyncio.set_event_loop(asyncio.new_event_loop())
        server = found["server"] = make_server()
        found["loop"] = server.io_loop
        server.start()
        up.set()
        server.io_loop.start()
        server.stop()
        server.io_loop.close()

    warm_up()
    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    assert up.wait(PATIENCE)
    yield f"http://127.0.0.1:{found['server'].port}/"
    found["loop"].add_callback(found["loop"].stop)
    thread.join(PATIENCE)


@pytest.fixture(scope="module")
def downloads(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def browser(downloads: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    try:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service
    except ImportError:
        _missing("selenium is not installed (pip install 'peel_opt[test]')")
    chromium, chromedriver = (
        next((found for name in names if (found := shutil.which(name))), None)
        for names in (("chromium", "chromium-browser", "google-chrome"), ("chromedriver",))
    )
    if chromium is None or chromedriver is None:
        _missing("chromium or chromedriver is not on the PATH")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(chromedriver))
    driver.execute_cdp_cmd(
        "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(downloads)}
    )
    driver.set_script_timeout(PATIENCE)
    yield driver
    driver.quit()


def wait(condition: Callable[[], Any]) -> Any:
    """Return the first true value of a condition."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        value = condition()
        if value:
            return value
        time.sleep(0.03)
    raise AssertionError("nothing happened in the browser")


MODEL = "const model = (name) => Bokeh.documents[0].get_model_by_name(name);"


def js(browser: Any, code: str, *arguments: Any) -> Any:
    return browser.execute_script(MODEL + code, *arguments)


def open_page(browser: Any, url: str) -> None:
    browser.get(url)
    wait(
        lambda: browser.execute_script("return window.Bokeh?.documents?.length && Bokeh.documents[0].is_idle")
    )
    wait(lambda: "Full picture" in js(browser, "return model('costs').text"))


def text(browser: Any, name: str) -> str:
    return str(js(browser, "return model(arguments[0]).text", name))


def dot(browser: Any, panel: str) -> list[float]:
    """Where the dot of a panel is."""
    code = """
    const data = model(arguments[0]).renderers.map((r) => r.data_source.data)
    const last = data[data.length - 1]
    return [...last.x, ...last.y]
    """
    return [float(v) for v in js(browser, code, panel)]


def element(browser: Any, name: str, selector: str) -> Any:
    """An element within the shadow of a widget."""
    code = "return Bokeh.index.find_one_by_id(model(arguments[0]).id).shadow_el.querySelector(arguments[1])"
    return wait(lambda: js(browser, code, name, selector))


def press(browser: Any, name: str) -> None:
    """Click a button; found anew where it was drawn anew meanwhile."""
    from selenium.common.exceptions import StaleElementReferenceException

    def pressed() -> bool:
        try:
            element(browser, name, "button").click()
        except StaleElementReferenceException:
            return False
        return True

    wait(pressed)


def foreign(browser: Any) -> list[str]:
    """Addresses asked for that are not on this machine."""
    asked = []
    for entry in browser.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] in ("Network.requestWillBeSent", "Network.webSocketCreated"):
            parameters = message["params"]
            asked.append(parameters.get("url") or parameters["request"]["url"])
    assert asked
    return [
        url
        for url in asked
        # An empty tab shows a page that is part of Chromium.
        if urlsplit(url).scheme not in ("data", "blob", "chrome", "chrome-untrusted")
        and urlsplit(url).hostname != "127.0.0.1"
    ]


def complaints(browser: Any) -> list[str]:
    return [e["message"] for e in browser.get_log("browser") if e["level"] in ("SEVERE", "WARNING")]


def test_sliders_clicks_and_the_sweep(browser: Any, server_url: str) -> None:
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    open_page(browser, server_url)
    assert dot(browser, "diagram") == pytest.approx(
        [-0.23, po.equilibrium(beta0=4, lam=-0.23).alpha1], rel=1e-6
    )

    # The keyboard moves a slider.
    handle = element(browser, "slider-lam", ".noUi-handle")
    browser.execute_script("arguments[0].focus()", handle)
    ActionChains(browser).send_keys(Keys.ARROW_RIGHT * 4).perform()
    wait(lambda: dot(browser, "diagram")[0] > -0.22)

    # A drag: many values, one after the other; how long from a value to its picture?
    code = """
    const [value, done] = arguments
    const slider = model("slider-lam"), began = performance.now()
    const source = model("diagram").renderers.at(-1).data_source
    const seen = () => {
        if (Math.abs(source.data.x[0] - value) < 1e-9) {
            source.disconnect(source.properties.data.change, seen)
            done(performance.now() - began)
        }
    }
    source.connect(source.properties.data.change, seen)
    slider.value = value
    """
    delays = sorted(float(browser.execute_async_script(MODEL + code, 0.15 * k)) for k in range(1, 11))
    print(f"\nslider to picture in the browser: median {delays[5]:.0f} ms, slowest {delays[-1]:.0f} ms")
    wait(lambda: "Full picture" in text(browser, "costs"))
    assert dot(browser, "loop")[0] == pytest.approx(1.5)

    # A click on the spurious branch shows that state.
    code = """
    const view = Bokeh.index.find_one_by_id(model("diagram").id)
    const box = view.el.getBoundingClientRect()
    const {x_scale, y_scale} = view.frame
    return [box.x + x_scale.compute(arguments[0]), box.y + y_scale.compute(arguments[1])]
    """
    x, y = js(browser, code, 2.0, 2.7)
    click = ActionChains(browser)
    click.w3c_actions.pointer_action.move_to_location(int(x), int(y))
    click.w3c_actions.pointer_action.click()
    click.perform()
    wait(lambda: dot(browser, "diagram")[1] > 2.0)
    wait(lambda: "spurious branch" in text(browser, "notes"))

    # The sweep plays, and stops when asked.
    press(browser, "play")
    places = set()
    wait(lambda: places.add(tuple(dot(browser, "loop"))) or len(places) > 4)
    press(browser, "play")
    wait(lambda: "Play" in js(browser, "return model('play').label"))

    assert foreign(browser) == []
    assert not complaints(browser)


def heard(browser: Any) -> list[dict[str, Any]]:
    """What screen readers are told: role, name, value and properties of all that is not ignored."""
    browser.execute_cdp_cmd("Accessibility.enable", {})
    nodes = browser.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    return [
        {
            "role": node["role"]["value"],
            "name": node["name"]["value"],
            "value": node.get("value", {}).get("value"),
            **{p["name"]: p["value"].get("value") for p in node.get("properties", [])},
        }
        for node in nodes
        if not node["ignored"]
    ]


def nameless(browser: Any) -> list[dict[str, Any]]:
    """What is reached by Tab and has no name."""
    return [node for node in heard(browser) if node.get("focusable") and not node["name"]]


def test_all_controls_have_names_and_are_reached_by_tab(browser: Any, server_url: str) -> None:
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    open_page(browser, server_url + "?beta0=4&lam=0.5")
    wait(lambda: not nameless(browser))
    told = heard(browser)
    sliders = {node["name"]: node["value"] for node in told if node["role"] == "slider"}
    assert sliders == {"β₀ = (s̄/η)³": 4, "λ = β₁ − π⁴": 0.5}
    pressed = [node["name"] for node in told if node.get("pressed") == "true"]
    assert pressed == ["paper's groups", "β₀ and λ", "linear (Fig 2b)", "delay", "standard"]
    figures = [node["name"] for node in told if node["role"] in ("img", "image")]
    assert figures == ["shape of the rod", "bifurcation diagram", "effective potential", "hysteresis loop"]

    focused = """
    let at = document.activeElement
    while (at?.shadowRoot?.activeElement) at = at.shadowRoot.activeElement
    return at.ariaLabel || at.getRootNode().querySelector("label")?.textContent || at.innerText || ""
    """
    order: list[str] = []
    while len(order) < 60 and order.count("paper's groups") < 2:
        ActionChains(browser).send_keys(Keys.TAB).perform()
        order.append(browser.execute_script(focused).strip())
    wanted = ["paper's groups", "β₀ and λ", "λ = β₁ − π⁴", "State", "▶ Play sweep", "delay", "PNG", *figures]
    places = [order.index(name) for name in wanted]
    assert places == sorted(places)

    # A button that is pressed says so, and the slider its new value.
    assert js(browser, "model('convention').active = 1; return true")
    handle = element(browser, "slider-lam", ".noUi-handle")
    browser.execute_script("arguments[0].focus()", handle)
    ActionChains(browser).send_keys(Keys.ARROW_RIGHT * 3).perform()
    wait(
        lambda: (
            {"Maxwell", "paper's groups"} <= {n["name"] for n in heard(browser) if n.get("pressed") == "true"}
        )
    )
    wait(
        lambda: (
            handle.get_attribute("aria-valuetext") == js(browser, "return model('field-lam').value") != "0.5"
        )
    )
    assert not complaints(browser)


def test_files_and_links(browser: Any, server_url: str, downloads: Path) -> None:
    open_page(browser, server_url)
    js(browser, "model('field-lam').value = '0.5'")
    wait(lambda: "Full picture" in text(browser, "costs") and dot(browser, "diagram")[0] == 0.5)

    # Pictures, table and card come down as files.
    for kind in ("png", "svg", "csv", "card"):
        press(browser, f"save-{kind}")
    names = {f"peel_opt.{end}" for end in ("png", "svg", "csv", "toml")}
    wait(lambda: names <= {f.name for f in downloads.iterdir()})
    assert (downloads / "peel_opt.png").read_bytes().startswith(b"\x89PNG")
    svg = (downloads / "peel_opt.svg").read_text(encoding="utf-8")
    assert "<svg" in svg[:200]
    assert "effective potential" in svg
    assert "diagram,stable" in (downloads / "peel_opt.csv").read_text(encoding="utf-8")
    ((_, eq),) = load_card(downloads / "peel_opt.toml").ask()
    assert isinstance(eq, po.Equilibrium)
    assert [eq.lam, eq.alpha1] == pytest.approx(dot(browser, "diagram"), rel=1e-8)

    # The address bar restores the state, in another tab too, and the tabs are independent.
    assert "lam=0.5" in browser.current_url
    url, first = browser.current_url, browser.current_window_handle
    browser.switch_to.new_window("tab")
    open_page(browser, url)
    assert dot(browser, "diagram")[0] == 0.5
    js(browser, "model('field-lam').value = '2'")
    wait(lambda: dot(browser, "diagram")[0] == 2.0)
    assert not complaints(browser)
    browser.close()
    browser.switch_to.window(first)
    assert dot(browser, "diagram")[0] == 0.5
    assert "lam=0.5" in browser.current_url
    assert foreign(browser) == []
    assert not complaints(browser)


def test_wrong_links_and_numbers_leave_the_page_alive(browser: Any, server_url: str) -> None:
    open_page(
        browser, server_url + "?beta0=%3Cscript%3Ealert(1)%3C/script%3E&lam=nan&nonsense=1&accuracy=sketch"
    )
    notes = element(browser, "notes", ".bk-clearfix, div")
    assert "must be a finite number" in notes.text
    assert "<script>" in notes.text  # as text, where it can be read and does nothing
    js(browser, "model('field-beta0').value = '<img src=x onerror=window.hacked=1>'")
    wait(lambda: "onerror" in text(browser, "refused-beta0"))
    assert js(browser, "return model('field-beta0').value") == "<img src=x onerror=window.hacked=1>"
    js(browser, "model('field-beta0').value = '9'")
    wait(lambda: "β₀ = 9" in text(browser, "headline"))
    assert browser.execute_script("return window.hacked") is None
    assert foreign(browser) == []
    assert not complaints(browser)


#: Sizes of windows: a phone, a tablet, a laptop, a projector [pixels].
WINDOWS = (
    (390, 844),
    pytest.param(768, 1024, marks=pytest.mark.slow),
    (1280, 800),
    pytest.param(1920, 1080, marks=pytest.mark.slow),
)

#: Boxes of all that can be seen, shadow trees included, by a selector.
BOXES = """
const found = []
const search = (root) => root.querySelectorAll("*").forEach((element) => {
    if (element.matches(arguments[0]) && element.checkVisibility()) {
        const {x, y, width, height} = element.getBoundingClientRect()
        if (width) found.push([x, y, width, height])
    }
    if (element.shadowRoot) search(element.shadowRoot)
})
search(document)
return found
"""


@pytest.fixture
def window(browser: Any, tmp_path: Path) -> Iterator[Callable[[int, int], None]]:
    """What sets the size of the window, as long as a test needs it."""

    def size(width: int, height: int) -> None:
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    yield size
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def portrait(browser: Any, window: Callable[[int, int], None], width: int, path: Path) -> None:
    """Save the whole page, however long."""
    window(width, browser.execute_script("return document.documentElement.scrollHeight"))
    wait(lambda: browser.execute_script("return Bokeh.documents[0].is_idle"))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(browser.get_screenshot_as_png())


def pictures_of_tests(tmp_path: Path) -> Path:
    """Where pictures are kept for those who look at them."""
    return Path(os.environ.get("PEEL_OPT_PICTURES") or tmp_path)


@pytest.mark.parametrize(("width", "height"), WINDOWS)
def test_the_page_fits_from_a_phone_to_a_projector(
    browser: Any,
    server_url: str,
    window: Callable[[int, int], None],
    width: int,
    height: int,
    tmp_path: Path,
) -> None:
    window(width, height)
    open_page(browser, server_url)
    figures = wait(lambda: browser.execute_script(BOXES, ".bk-Figure"))
    inner, room, needed = browser.execute_script(
        "const page = document.documentElement; return [innerWidth, page.clientWidth, page.scrollWidth]"
    )
    assert inner == width
    assert needed == room  # nothing to scroll sideways
    assert len(figures) == 4
    # Columns of panels: one on a phone, two elsewhere.  All of each can be seen.
    assert len({round(x) for x, *_ in figures}) == (1 if width < 700 else 2)
    assert all(x >= 0 and x + wide <= width for x, _, wide, _ in figures)
    controls = browser.execute_script(BOXES, ".bk-btn, .bk-input")
    right, bottom = (max(box[k] + box[k + 2] for box in controls) for k in (0, 1))
    if width < 1100:
        assert bottom <= min(y for _, y, *_ in figures)
        targets = controls + browser.execute_script(BOXES, "summary")
        assert min(high for *_, high in targets) >= 40
        handles = browser.execute_script(BOXES, ".noUi-handle")
        assert len(handles) == 2
        assert min(min(wide, high) for *_, wide, high in handles) >= 40
    else:
        assert right <= min(x for x, *_ in figures)
    # Frames are not covered by a legend, and keep the proportions that the rod is drawn for.
    code = """
    const view = (each) => Bokeh.index.find_one_by_id(each.id)
    return ["rod", "diagram", "potential", "loop"].map((name) => {
        const figure = model(name), {frame} = view(figure)
        const legend = figure.above.find((each) => each.type == "Legend")
        const {bottom, width} = view(figure).views.find_one(legend).el.getBoundingClientRect()
        const box = view(figure).el.getBoundingClientRect()
        return [frame.bbox.width / frame.bbox.height, box.top + frame.bbox.top - bottom, box.width - width]
    })
    """
    for ratio, above, beside in js(browser, code):
        assert ratio == pytest.approx(398 / 234, rel=0.01)
        assert above >= 0
        assert beside >= 0
    portrait(browser, window, width, pictures_of_tests(tmp_path) / f"explorer_{width}.png")
    assert not complaints(browser)


@pytest.mark.slow
def test_panels_follow_the_window(browser: Any, server_url: str, window: Callable[[int, int], None]) -> None:
    window(1280, 1000)  # where the width decides, not the height
    open_page(browser, server_url)
    width = "return model('rod').inner_width"
    before = js(browser, width)
    window(1920, 1080)
    wait(lambda: js(browser, width) > 1.3 * before)
    window(390, 844)
    wait(lambda: js(browser, width) < 0.85 * before)
    assert browser.execute_script("return document.documentElement.scrollWidth") == 390
    assert not complaints(browser)


#: The same sizes, for a test that goes through all of them.
SIZES = ((390, 844), (768, 1024), (1280, 800), (1920, 1080))


@pytest.mark.slow
def test_a_scene_and_a_film_on_a_phone_and_on_a_projector(
    browser: Any, server_url: str, window: Callable[[int, int], None], tmp_path: Path
) -> None:
    folder = pictures_of_tests(tmp_path)
    window(1280, 800)
    open_page(browser, server_url + "?given=pressure&law=cohesive&accuracy=draft")
    # A scene is chosen: its slider comes, the page says what it does, and then its branch is there.
    js(browser, "model('scene').value = 'flaw'")
    wait(lambda: "solving" in text(browser, "progress") or "tracing" in text(browser, "progress"))
    wait(lambda: js(browser, "return model('slider-unbonded').value") == 0.5)
    whole = "const told = model('costs').text; return told.includes('Full picture') && !told.includes('…')"
    wait(lambda: js(browser, whole) and "lifted" in text(browser, "headline"))
    eq = po.length_given_pressure(po.Scene(po.Rod.from_ratio(1.0), unbonded=0.5), pressure=0.5)
    assert dot(browser, "diagram") == pytest.approx([eq.length, 0.5], rel=1e-5)
    assert not js(browser, "return model('potential').below[0].visible")
    assert "paper's scene" in js(browser, "return model('potential').center.at(-1).text")
    # A drag moves rod and dot while nothing is traced.
    js(browser, "model('slider-unbonded').value = 0.45")
    wait(lambda: "Quick picture" in text(browser, "costs") and dot(browser, "diagram")[0] < eq.length - 0.05)
    wait(lambda: js(browser, whole))
    assert not nameless(browser)
    for width, height in SIZES:
        window(width, height)
        portrait(browser, window, width, folder / f"explorer_scene_{width}.png")

    # A snap: how far it is, then it plays, and a finger can stop it.
    window(1280, 800)
    open_page(browser, server_url + "?given=pressure&law=cohesive&ratio=0.3&pressure=0.9")
    press(browser, "snap")
    wait(lambda: "<progress" in text(browser, "progress"))
    wait(lambda: js(browser, "return model('film-moment').value") > 5)
    assert js(browser, "return model('ledger').below[0].visible")
    js(browser, "model('film-moment').value = 100")
    wait(lambda: js(browser, "return model('film-play').label") == "▶ Play")
    wait(lambda: js(browser, "return model('film-moment').value") == 100)
    assert not nameless(browser)
    for width, height in SIZES:
        window(width, height)
        needed = browser.execute_script("return document.documentElement.scrollWidth")
        assert needed <= width
        portrait(browser, window, width, folder / f"explorer_film_{width}.png")
    js(browser, "model('film-play').active = true")
    press(browser, "film-close")
    wait(lambda: not js(browser, "return model('film').visible"))
    assert "middle" in text(browser, "headline")
    assert foreign(browser) == []
    assert not complaints(browser)
