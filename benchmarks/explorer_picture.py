"""The pictures of the explorer in the README and in docs/explorer.md, taken with Chromium.

    python -m benchmarks.explorer_picture [FOLDER]

It needs Chromium and its driver on the PATH, and Selenium (``peel_opt[test]``).  The times on the page are
those of this machine; everything else is the same wherever it is taken.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

OWN = Path(__file__).parents[1] / "docs" / "img"

#: Size of the picture [pixels].
SIZE = (1280, 990)

#: Another state, looked at before.
OTHER = "?beta0=7&lam=-0.7"

#: Pictures, by the queries of their states.
PICTURES = {
    "explorer": "",
    "explorer_wall": "?given=pressure&law=cohesive&scene=wall&curvature=-0.2&label=middle",
    "explorer_snap": "?given=pressure&law=cohesive&ratio=0.3&pressure=0.9",
}

#: The moment of the film that is shown, and what lets the state go.
MOMENT = 62
LET_GO = """
const {id} = Bokeh.documents[0].get_model_by_name("snap")
Bokeh.index.find_one_by_id(id).shadow_el.querySelector("button").click()
"""
FILMED = "return Bokeh.documents[0].get_model_by_name('film').visible"
SHOW = f"""
const model = (name) => Bokeh.documents[0].get_model_by_name(name)
model("film-play").active = false
model("film-moment").value = {MOMENT}
"""

#: Time within which each picture must be there [s].
PATIENCE = 180.0

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--hide-scrollbars",
    "--force-device-scale-factor=1",
)

SOLVED = """
const doc = globalThis.Bokeh?.documents?.[0]
const costs = doc?.get_model_by_name("costs")?.text ?? ""
return Boolean(doc?.is_idle && costs.startsWith("<b>Full picture") && !costs.includes("…"))
"""


def on_the_path(*names: str) -> str:
    """Return the first of some programs that is on the PATH."""
    found = next((path for name in names if (path := shutil.which(name))), None)
    if found is None:
        raise SystemExit(f"{' or '.join(names)} is not on the PATH")
    return found


def browser() -> Any:
    """Return a Chromium without a window, its page of the size of a picture."""
    options = webdriver.ChromeOptions()
    options.binary_location = on_the_path("chromium", "chromium-browser", "google-chrome")
    for flag in FLAGS:
        options.add_argument(flag)
    driver = webdriver.Chrome(options=options, service=Service(on_the_path("chromedriver")))
    size = {"width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    return driver


def until(driver: Any, code: str) -> None:
    """Wait until some code in the page returns true."""
    ends = time.monotonic() + PATIENCE
    while not driver.execute_script(code):
        if time.monotonic() > ends:
            raise SystemExit(f"the page has not come to its picture within {PATIENCE:.0f} s")
        time.sleep(0.1)


def main(folder: Path = OWN) -> list[Path]:
    """Take the pictures of the page as it opens, in a scene and in a film, and return where they are."""
    command = [sys.executable, "-u", "-m", "peel_opt", "explore", "--no-browser"]
    taken = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            words = server.stdout.readline().split()
            address = next(word for word in words if word.startswith("http://"))
            with browser() as driver:
                driver.get(address + OTHER)  # the first page of a process also compiles and imports
                until(driver, SOLVED)
                for name, query in PICTURES.items():
                    driver.get(address + query)
                    until(driver, SOLVED)
                    if name == "explorer_snap":
                        driver.execute_script(LET_GO)
                        until(driver, FILMED)
                        driver.execute_script(SHOW)
                        time.sleep(1.0)
                    taken.append(folder / f"{name}.png")
                    taken[-1].write_bytes(driver.get_screenshot_as_png())
        finally:
            server.terminate()
    return taken


if __name__ == "__main__":
    print(*main(*(Path(argument) for argument in sys.argv[1:2])), sep="\n")
