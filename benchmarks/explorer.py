"""How the explorer keeps up: time of a picture while a slider is dragged, and of one at rest.

    python -m benchmarks.explorer

Every drag visits 60 values nobody has looked at before.  The time is that of the callback: solving,
walking, and setting everything the page shows; sending and painting come on top.  The last
column is the same with a trace at work in another thread.  Exits non-zero where the median of a drag
is above 50 ms.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from itertools import count

import numpy as np
from bokeh.document import Document

from peel_opt.app.explorer.curves import traced
from peel_opt.app.explorer.page import Page
from peel_opt.app.explorer.screen import Screen
from peel_opt.app.explorer.screens import full_screen
from peel_opt.app.explorer.server import warm_up
from peel_opt.app.explorer.state import CHOICES, State

#: Median time of a picture that still feels linked [s].
TARGET = 0.05

VALUES = 60

DRAGS: dict[str, tuple[State, str, np.ndarray]] = {
    "lambda at beta0 = 4": (State(), "lam", np.linspace(-0.26, 2.9, VALUES)),
    "beta0 from 1 to 36": (State(lam=-0.01), "beta0", np.linspace(1.0, 36.0, VALUES)),
    "length, eta/y0 = 1": (State(given="length", law="cohesive"), "length", np.linspace(3.02, 5.3, VALUES)),
    "pressure, eta/y0 = 1": (
        State(given="pressure", law="cohesive"),
        "pressure",
        np.linspace(0.95, 0.13, VALUES),
    ),
    "eta/y0 from 0.1 to 10, p = 0.96 T0": (
        State(given="pressure", law="cohesive", pressure=0.96),
        "ratio",
        np.geomspace(0.1, 10.0, VALUES),
    ),
    "k of a rod in SI, +- 50 %": (
        State(units="SI", given="pressure", law="cohesive", pressure=6e4),
        "k",
        2.3e-5 * np.linspace(0.5, 1.5, VALUES),
    ),
    "unglued edge from 0.3 to 0.55 eta, p = 0.5 T0": (
        State(given="pressure", law="cohesive").staged("flaw").changed(unbonded=0.3),
        "unbonded",
        np.linspace(0.3, 0.55, VALUES),
    ),
    "curvature of a wall from -0.05 to -0.2 / eta": (
        State(given="pressure", law="cohesive").staged("wall").changed(curvature=-0.05),
        "curvature",
        np.linspace(-0.05, -0.2, VALUES),
    ),
}


def never(_work: Callable[[], Screen]) -> Future[Screen]:
    """Take work and never do it: what is measured is the moving picture."""
    return Future()


def drag(state: State, field: str, values: np.ndarray) -> np.ndarray:
    """Return the time of each picture of a drag [s]."""
    page = Page(Document(), state, submit=never)
    if state.rods_scene is not None:  # a drag begins in a picture that was solved
        page._take(full_screen(state))
    times = []
    for value in values:
        page.go_to(page.state.changed(**{field: float(value)}), rested=False)
        began = time.perf_counter()
        page._live()
        times.append(time.perf_counter() - began)
        assert page.screen.state == page.state  # a picture was made
        assert page.screen.equilibrium is not None or state.rods_scene is None  # of the state
    return np.array(times)


def under_load(measure: Callable[[], np.ndarray]) -> np.ndarray:
    """Return what ``measure`` does while traces are computed in another thread."""
    done = threading.Event()

    def work() -> None:
        for number in count():
            if done.is_set():
                return
            traced(State(given="length", law="cohesive", ratio=0.9 + 1e-4 * number))

    thread = threading.Thread(target=work)
    thread.start()
    try:
        return measure()
    finally:
        done.set()
        thread.join()


def main() -> int:
    """Print both tables; return the exit code."""
    warm_up()
    slow = False
    print("| drag | median | 95 % | slowest | median beside a trace |\n|---|---|---|---|---|")
    for name, (state, field, values) in DRAGS.items():
        times = drag(state, field, values)
        # Other values, so that nothing is remembered.
        busy = under_load(lambda f=field, s=state, v=values: drag(s, f, v * (1.0 + 1e-3)))  # type: ignore[misc]
        median, most, slowest = (float(v) for v in (*np.quantile(times, (0.5, 0.95)), times.max()))
        slow |= median > TARGET
        print(
            f"| {name} | {1e3 * median:.0f} ms | {1e3 * most:.0f} ms | {1e3 * slowest:.0f} ms"
            f" | {1e3 * float(np.median(busy)):.0f} ms |"
        )
    print("\n| at rest | accuracy | time | error of the answer |\n|---|---|---|---|")
    for name, state in (
        ("beta0 = 7, lambda = -0.7", State(beta0=7.0, lam=-0.7)),
        ("eta/y0 = 0.8, sbar/eta = 3.3", State(given="length", law="cohesive", ratio=0.8, length=3.3)),
    ):
        for accuracy in CHOICES["accuracy"]:
            began = time.perf_counter()
            screen = full_screen(state.changed(accuracy=accuracy))
            seconds = time.perf_counter() - began
            assert screen.equilibrium is not None
            print(f"| {name} | {accuracy} | {seconds:.2f} s | {screen.equilibrium.error:.0e} |")
    return int(slow)


if __name__ == "__main__":
    sys.exit(main())
