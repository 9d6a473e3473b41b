"""The picture of the explorer in the README and in docs/explorer.md, taken with Chromium.

    python -m benchmarks.explorer_picture [PICTURE]

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

OWN = Path(__file__).parents[1] / "docs" / "img" / "explorer.png"

#: Size of the picture [pixels].
SIZE = (1280, 920)

#: Another state, looked at before.
OTHER = "?beta0=7&lam=-0.7"

#: Time within which the full picture must be there [s].
PATIENCE = 120.0

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--hide-scrollbars",
    "--force-device-scale-factor=1",
)

SOLVED = """
const doc = globalThis.Bokeh?.documents?.[0]
return Boolean(doc?.is_idle && doc.get_model_by_name("costs")?.text.startsWith("<b>Full picture"))
"""


def on_the_path(*names: str) -> str:
    """Return the first of some programs that is on the PATH."""
    found = next((path for name in names if (path := shutil.which(name))), None)
    if found is None:
        raise SystemExit(f"{' or '.join(names)} is not on the PATH")
    return found


def browser() -> Any:
    """Return a Chromium without a window, its page of the size of the picture."""
    options = webdriver.ChromeOptions()
    options.binary_location = on_the_path("chromium", "chromium-browser", "google-chrome")
    for flag in FLAGS:
        options.add_argument(flag)
    driver = webdriver.Chrome(options=options, service=Service(on_the_path("chromedriver")))
    size = {"width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    return driver


def until_solved(driver: Any) -> None:
    """Wait for the full picture."""
    ends = time.monotonic() + PATIENCE
    while not driver.execute_script(SOLVED):
        if time.monotonic() > ends:
            raise SystemExit(f"no full picture within {PATIENCE:.0f} s")
        time.sleep(0.1)


def main(path: Path = OWN) -> Path:
    """Take the picture of the page as it opens, and return where it is."""
    command = [sys.executable, "-u", "-m", "peel_opt", "explore", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            words = server.stdout.readline().split()
            address = next(word for word in words if word.startswith("http://"))
            with browser() as driver:
                for query in (OTHER, ""):  # the first page of a process also compiles and imports
                    driver.get(address + query)
                    until_solved(driver)
                path.write_bytes(driver.get_screenshot_as_png())
        finally:
            server.terminate()
    return path


if __name__ == "__main__":
    print(main(*(Path(argument) for argument in sys.argv[1:2])))
