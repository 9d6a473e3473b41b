"""The explorer's Matplotlib window, driven without a display: widgets, clicks, the sweep, no backend."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backend_bases import MouseEvent, ResizeEvent, TimerBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.app.cards import load_card
from peel_opt.app.cli.main import main
from peel_opt.app.explorer.screen import Scene
from peel_opt.app.explorer.state import CHOICES, State
from peel_opt.app.explorer.state_cards import from_card
from peel_opt.app.explorer.window import DPI, LOOKED_FOR, RESTED, SIZE, Window, show
from peel_opt.app.explorer.window_controls import RADIOS

from ..futures import at_once

SKETCH = State(accuracy="sketch")
FLAP = Path(__file__).parents[2] / "problems" / "aortic_flap.toml"


def opened(state: State = SKETCH, submit: Callable[..., Future[Scene]] = at_once) -> Window:
    figure = Figure(figsize=SIZE, dpi=DPI)
    canvas = FigureCanvasAgg(figure)
    # As in a window: drawn later, once, when there is nothing else to do.
    canvas.draw_idle = lambda: None  # type: ignore[method-assign]
    timers: dict[int, TimerBase] = {}
    canvas.new_timer = lambda interval: timers.setdefault(interval, TimerBase(interval))  # type: ignore
    window = Window(figure, state, submit=submit)
    window.solve()
    window.deliver()
    return window


def here(window: Window) -> tuple[float, float]:
    """Where the dot of the diagram is."""
    (dot,) = [line for line in window.diagram.lines if line.get_gid() == "here"]
    (x,), (y,) = dot.get_data()
    return float(x), float(y)


def press(window: Window, name: str) -> None:
    """Press and release a button."""
    box = getattr(window.controls, name).ax.bbox
    for kind in ("button_press_event", "button_release_event"):
        canvas = window.figure.canvas
        canvas.callbacks.process(kind, MouseEvent(kind, canvas, *box.get_points().mean(axis=0), button=1))


def test_a_window_shows_four_panels_and_the_solved_state() -> None:
    window = opened(State())
    eq = po.equilibrium(beta0=4, lam=-0.23)
    assert window.scene.full
    assert here(window) == pytest.approx((-0.23, eq.alpha1), rel=1e-12)
    assert "α₁ = -1.92442620" in window.headline.get_text()
    assert "certified" in window.numbers.get_text()
    assert [ax.get_xlabel()[:1] for ax in (window.rod, window.diagram, window.potential, window.loop)] == [
        "x", "λ", "e", "λ",
    ]  # fmt: skip
    letters = {text.get_text() for text in window.diagram.texts}
    assert {"T", "F", "Y"} <= letters
    window.figure.canvas.draw()
    ink = np.asarray(window.figure.canvas.buffer_rgba())[..., :3]  # type: ignore[attr-defined]
    assert ink.shape == (800, 1280, 3)
    assert (ink < 128).any(axis=2).mean() > 0.01


def test_the_rod_keeps_its_scales_in_any_window() -> None:
    window = opened()
    canvas = window.figure.canvas
    window.figure.set_size_inches(15.0, 6.0)
    canvas.callbacks.process("resize_event", ResizeEvent("resize_event", canvas))
    panel, ax = window.scene.rod, window.rod
    assert panel is not None
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    per_x, per_y = ax.bbox.width / (right - left), ax.bbox.height / (top - bottom)
    assert per_y / per_x == pytest.approx(panel.stretch, rel=1e-6)
    assert left <= panel.x.low < panel.x.high <= right


def test_sliders_and_fields_move_all_panels() -> None:
    window = opened()
    window.controls.lower.slider.set_val(0.5)
    assert not window.scene.full
    x, y = here(window)
    assert (x, y) == pytest.approx((0.5, po.equilibrium(beta0=4, lam=0.5).alpha1), rel=1e-2)
    window.solve()
    assert window.deliver() is False
    assert window.scene.full
    window.controls.upper.text.set_val("2")
    assert window.state.beta0 == 2.0
    assert window.controls.upper.slider.val == 2.0
    before = window.state
    window.controls.lower.text.set_val("a lot")
    assert window.state == before
    assert "lambda" in window.notes.get_text()
    assert window.controls.lower.text.text == "0.5"


def test_the_full_picture_follows_every_time_a_slider_rests() -> None:
    window = opened()
    for lam in (0.4, 0.8, 1.2):
        window.controls.lower.slider.set_val(lam)
        assert not window.scene.full
        for interval in (RESTED, LOOKED_FOR):
            window.figure.canvas.new_timer(interval)._on_timer()  # as the toolkit's loop does
        assert window.scene.full
        assert here(window)[0] == pytest.approx(lam)


def test_choices_reach_the_state_and_the_widgets_follow() -> None:
    window = opened()
    for field in ("given", "law", "convention", "accuracy"):
        values, labels = CHOICES[field], RADIOS[field][1]
        window.controls.radios[field].set_active(len(labels) - 1)
        assert getattr(window.state, field) == values[-1]
        window.controls.radios["accuracy"].set_active(0)
    assert window.controls.lower.field == "pressure"
    assert window.controls.upper.field == "ratio"
    window.controls.upper.slider.set_val(0.0)  # its logarithm
    assert window.state.ratio == 1.0
    window.controls.radios["units"].set_active(1)
    assert window.state.units == "SI"
    assert window.controls.fields["k"].ax.get_visible()
    assert not window.controls.upper.slider.ax.get_visible()
    window.controls.fields["y0"].set_val("0.8 mm")
    assert window.state.y0 == pytest.approx(0.8e-3, rel=1e-12)
    window.controls.radios["label"].set_active(CHOICES["label"].index("adhered"))
    assert window.headline.get_text().startswith("adhered")


def test_a_click_on_a_branch_shows_that_state() -> None:
    window = opened()
    curve = window.scene.curve
    row = int(np.argmin(np.abs(curve.alpha1 - 2.6)))
    place = window.diagram.transData.transform((curve.lam[row], curve.alpha1[row]))
    canvas = window.figure.canvas
    canvas.callbacks.process("button_press_event", MouseEvent("button_press_event", canvas, *place, button=1))
    assert window.state.label == "spurious"
    assert here(window)[1] == pytest.approx(2.6, abs=0.3)
    assert "Spurious" in window.notes.get_text()
    state = window.state
    outside = MouseEvent("button_press_event", canvas, 3.0, 3.0, button=1)
    canvas.callbacks.process("button_press_event", outside)
    assert window.state is state


def test_the_sweep_goes_round_and_ends() -> None:
    window = opened()
    loop = window.scene.loop
    assert loop is not None
    few = replace(window.scene, loop=replace(loop, frames=loop.frames[::7]))
    window.scene = few
    press(window, "play")
    assert window.controls.play.label.get_text() == "Stop"
    adhered = []
    while window.controls.play.label.get_text() == "Stop":
        window.step()
        adhered.append(here(window)[1] == 0.0)
    assert len(adhered) == len(loop.frames[::7]) + 1
    assert adhered[0]
    assert not all(adhered)
    # All is as before, and so it is when somebody stops it half way.
    assert here(window)[0] == pytest.approx(-0.23)
    press(window, "play")
    window.step()
    assert here(window)[0] != pytest.approx(-0.23)
    press(window, "play")
    assert here(window)[0] == pytest.approx(-0.23)
    assert window.controls.play.label.get_text() == "Play sweep"


def test_a_state_that_does_not_exist_is_said_and_left() -> None:
    window = opened(State(lam=-0.4, accuracy="sketch"))
    assert "no such state" in window.headline.get_text()
    assert "The nearest that does exist" in window.notes.get_text()
    press(window, "nearest")
    window.solve()
    window.deliver()
    assert window.scene.equilibrium is not None
    assert window.state.lam == pytest.approx(-0.269, abs=2e-3)
    state = window.state
    press(window, "nearest")  # no longer needed: does nothing
    assert window.state is state


def test_work_that_fails_or_comes_too_late_leaves_the_window_alive() -> None:
    def fail(_work: Callable[[], Scene]) -> Future[Scene]:
        future: Future[Scene] = Future()
        future.set_exception(RuntimeError("no luck"))
        return future

    window = opened(submit=fail)
    assert "The full computation failed: no luck" in window.notes.get_text()
    late: Future[Scene] = Future()
    window = opened(submit=lambda _work: late)
    assert window.deliver() is True
    shown = window.scene
    window.controls.lower.slider.set_val(0.3)
    late.set_result(shown)
    assert window.deliver() is False
    assert window.scene.state.lam == pytest.approx(0.3)


def test_work_that_has_not_begun_is_given_up_for_newer_work() -> None:
    futures: list[Future[Scene]] = []

    def queued(_work: Callable[[], Scene]) -> Future[Scene]:
        futures.append(Future())
        return futures[-1]

    window = opened(submit=queued)
    window.controls.lower.slider.set_val(0.3)
    window.solve()
    assert [future.cancelled() for future in futures] == [True, False]
    assert window.deliver() is True


def test_a_card_opens_in_its_units() -> None:
    window = opened(from_card(load_card(FLAP)).changed(accuracy="draft"))
    assert "[mm]" in window.diagram.get_xlabel()
    assert "kPa" in window.controls.lower.text.text


def test_without_a_display_there_is_one_line_and_an_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(po.errors.MissingExtra, match=r"(?i)'agg'"):
        show()
    assert main(["explore", "--backend", "mpl"]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert "no window can be opened" in said.err
    assert "--export" in said.err


def test_a_toolkit_without_its_display_is_one_line_too() -> None:
    kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-m", "peel_opt", "explore", "--backend", "mpl"],
        env={**kept, "MPLBACKEND": "TkAgg"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("peel-opt: no window can be opened")
    assert done.stderr.count("\n") == 1


def test_the_window_needs_no_bokeh() -> None:
    code = "import sys, peel_opt.app.explorer.window as w; print('bokeh' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
