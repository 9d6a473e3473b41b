"""The explorer as a Matplotlib window: `show`, and `Window`, which needs no display."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from matplotlib.figure import Figure

from ...base.errors import MissingExtra, PeelOptError
from ...plots import style
from . import look
from .curves import Curve
from .moves import chosen, framed, picked, slid
from .panels import Frame
from .screen import Scene, full_scene, live_scene
from .state import State
from .window_controls import WindowControls
from .window_panels import draw_diagram, draw_loop, draw_nothing, draw_potential, draw_rod

#: A slider has rested when nothing came for this long [ms]; how often finished work is looked for.
RESTED, LOOKED_FOR = 350, 60

#: Time from one frame of the sweep to the next [ms]; a whole figure is drawn for each.
FRAME = 150

#: Seconds that the first walk may take.
FIRST = 1.0

#: Width and height [inches] and resolution: 1280 x 800.
SIZE, DPI = (12.8, 8.0), 100.0

Submit = Callable[[Callable[[], Scene]], "Future[Scene]"]

_WORKERS = ThreadPoolExecutor(max_workers=1, thread_name_prefix="peel-opt-window")


class Window:
    """Four linked panels and their controls in a figure.

    Parameters
    ----------
    figure : Figure
        An empty one, 1280 x 800 pixels or about that.
    state : State, optional
    submit : callable, optional
        Runs a full computation; by default in a thread, so that the window stays alive.

    Attributes
    ----------
    state : State
    scene : Scene
        What is shown.
    """

    def __init__(
        self, figure: Figure, state: State | None = None, *, submit: Submit = _WORKERS.submit
    ) -> None:
        self.figure, self.state = figure, state or State()
        # The first walk is the slowest: functions are compiled on the way.
        self.scene = live_scene(self.state, budget=FIRST)
        self._submit = submit
        self._best: Curve | None = None
        self._said = ""
        self._frames: tuple[Frame, ...] | None = None  # of a sweep that is under way
        self._work: tuple[State, Future[Scene]] | None = None
        grid = figure.add_gridspec(
            2, 2, left=0.285, right=0.972, bottom=0.160, top=0.855, wspace=0.24, hspace=0.52
        )
        self.rod, self.diagram, self.potential, self.loop = (
            figure.add_subplot(grid[i // 2, i % 2]) for i in range(4)
        )
        self.headline = figure.text(0.235, 0.975, "", fontsize=12.5, fontweight="bold", va="top")
        self.numbers = figure.text(0.235, 0.943, "", fontsize=style.SMALL, va="top")
        self.notes = figure.text(0.235, 0.090, "", fontsize=style.SMALL - 0.5, va="top", linespacing=1.25)
        self.costs = figure.text(0.010, 0.195, "", fontsize=style.SMALL - 1.0, va="top", linespacing=1.3)
        self.controls = WindowControls(figure, self._choice, self._slid, self._typed)
        self.controls.play.on_clicked(lambda _event: self.play() if self._frames is None else self.stop())
        self.controls.nearest.on_clicked(lambda _event: self._to_nearest())
        canvas = figure.canvas
        canvas.mpl_connect("button_press_event", self._clicked)
        canvas.mpl_connect("resize_event", lambda _event: self._draw())  # the rod keeps its true shape
        self._rest = canvas.new_timer(RESTED)
        self._rest.single_shot = True
        self._rest.add_callback(self.solve)
        self._look = canvas.new_timer(LOOKED_FOR)
        self._look.add_callback(self._looked)
        self._sweep = canvas.new_timer(FRAME)
        self._sweep.add_callback(self.step)
        self._draw()
        self._rest.start()

    # --- what people do -------------------------------------------------------------------

    def _choice(self, field: str, value: str) -> None:
        self._try(lambda state: chosen(state, field, value))

    def _slid(self, field: str, value: float) -> None:
        self._try(lambda state: slid(state, field, value, self.scene.equilibrium))

    def _typed(self, field: str, text: str) -> None:
        self._try(lambda state: state.typed(field, text))

    def _to_nearest(self) -> None:
        nearest = self.scene.nearest
        if nearest is not None:
            self._try(lambda _state: nearest)

    def _clicked(self, event: Any) -> None:
        toolbar = getattr(self.figure.canvas, "toolbar", None)
        if event.inaxes is not self.diagram or event.button != 1 or (toolbar is not None and toolbar.mode):
            return
        spot = self.scene.diagram.nearest_spot(float(event.xdata), float(event.ydata))
        if spot is not None:
            self._try(lambda state: picked(state, spot))

    def _try(self, change: Callable[[State], State]) -> None:
        """Change the state; what cannot be meant is said, and all stays as it was."""
        self.stop()
        try:
            self.state, self._said = change(self.state), ""
        except PeelOptError as error:
            self._said = str(error)
        else:
            self.scene = live_scene(self.state, best=self._best, before=self.scene.equilibrium)
            self._rest.stop()
            self._rest.start()
        self._draw()

    # --- work -----------------------------------------------------------------------------

    def solve(self) -> None:
        """Have the state solved and traced to the accuracy asked for."""
        state = self.state

        def work() -> Scene:
            return full_scene(state)

        if self._work is not None:
            self._work[1].cancel()  # nobody waits for it any more
        self._work = state, self._submit(work)
        self._look.start()

    def _looked(self) -> None:
        self.deliver()  # a timer forgets a callback that returns False

    def deliver(self) -> bool:
        """Show what was solved, if it is still wanted; return whether there is more to wait for."""
        if self._work is None:
            return False
        state, future = self._work
        if not future.done():
            return True
        self._work = None
        self._look.stop()
        if state == self.state:
            error = future.exception()
            if error is not None:
                self._said = f"The full computation failed: {error}"
            else:
                self.scene = future.result()
                self._best = self.scene.curve
            if self._frames is None:
                self._draw()
        return False

    # --- the sweep ------------------------------------------------------------------------

    def play(self) -> None:
        """Take the state round the loop."""
        if self.scene.loop is not None:
            self._frames = self.scene.loop.frames
            self.controls.play.label.set_text("Stop")
            self._sweep.start()

    def step(self) -> None:
        """Show the next moment of the sweep; nothing is left of it after the last."""
        loop = self.scene.loop
        if not self._frames or loop is None:
            self.stop()
            return
        frame, self._frames = self._frames[0], self._frames[1:]
        try:
            scene = live_scene(framed(self.state, loop, frame), best=self._best)
        except PeelOptError:
            return  # outside what a state may be; the sweep goes on
        if scene.rod is not None:  # otherwise the picture before stays for a moment
            self._draw_scene(scene)
            self.figure.canvas.draw_idle()

    def stop(self) -> None:
        """End the sweep and show the state again."""
        self._sweep.stop()
        self.controls.play.label.set_text("Play sweep")
        if self._frames is not None:
            self._frames = None
            self._draw()

    # --- pictures -------------------------------------------------------------------------

    def _draw(self) -> None:
        scene = self.scene
        self._draw_scene(scene)
        self.controls.show(
            self.state, scene.curve, nearest=scene.nearest is not None, loop=scene.loop is not None
        )
        self.figure.canvas.draw_idle()

    def _draw_scene(self, scene: Scene) -> None:
        if scene.rod is None:
            draw_nothing(self.rod, "Rod", "no such state: see below")
        else:
            draw_rod(self.rod, scene.rod)
        draw_diagram(self.diagram, scene.diagram)
        if scene.potential is None:
            draw_nothing(self.potential, "Potential (35)", "no state, no β₀, no potential")
        else:
            draw_potential(self.potential, scene.potential)
        if scene.loop is None:
            draw_nothing(self.loop, "Hysteresis loop", scene.no_loop)
        else:
            draw_loop(self.loop, scene.loop)
        self.headline.set_text(_plain(_headline(scene)))
        self.numbers.set_text(_plain(_numbers(scene)))
        said = [*([self._said] if self._said else []), *([scene.message] if scene.message else [])]
        calm = [*scene.warnings, *([] if scene.loop is None else [scene.loop.note])]
        self.notes.set_text(_plain("\n".join(textwrap.fill(text, 150) for text in (*said, *calm))))
        self.notes.set_color("#8C2D04" if said else look.INK)
        kind = "Full picture" if scene.full else "Quick picture; the full one follows"
        parts = (textwrap.fill(f"{part.name}: {part.error}, {part.method}", 46) for part in scene.parts)
        self.costs.set_text(_plain("\n".join([kind, *parts])))


def _headline(scene: Scene) -> str:
    if scene.answer is None:
        return f"{'adhered' if scene.state.label == 'adhered' else 'no such state'} at {scene.state.words}"
    return f"{scene.answer.headline} at {scene.state.words}"


def _numbers(scene: Scene) -> str:
    answer = scene.answer
    if answer is None:
        return ""
    verdict = "certified" if answer.certified else "not certified"
    numbers = ", ".join(f"{name} = {value}" for name, value in answer.numbers)
    return (
        f"{answer.label} state, {answer.law} law, {verdict} (certificate {answer.certificate:.0e}); {numbers}"
    )


def _plain(text: str) -> str:
    """Text that no dollar sign turns into a formula."""
    return text.replace("$", r"\$")


def show(state: State | None = None) -> None:
    """Open the explorer in a window, and return when it is closed.

    Parameters
    ----------
    state : State, optional
        What it shows at first.

    Raises
    ------
    MissingExtra
        If no window can be opened here: no display, or no toolkit that Matplotlib knows.
    """
    from matplotlib import pyplot
    from matplotlib.backend_bases import FigureManagerBase

    remedy = (
        "On a machine with a display install a toolkit, such as PyQt6, or set MPLBACKEND=WebAgg;"
        " or take the page: peel-opt explore, or peel-opt explore --export FILE.html"
    )
    try:
        figure = pyplot.figure("peel_opt explorer", figsize=SIZE, dpi=DPI)
    except (ImportError, RuntimeError) as error:
        raise MissingExtra(f"no window can be opened: {error}.", remedy=remedy) from error
    kind: Any = type(figure.canvas.manager)
    # What a backend with windows has of its own: toolkits the loop, WebAgg what shows its page.
    own = (
        getattr(kind, name).__func__ is not getattr(FigureManagerBase, name).__func__
        for name in ("start_main_loop", "pyplot_show")
    )
    if not any(own):
        pyplot.close(figure)
        raise MissingExtra(
            f"no window can be opened: Matplotlib's backend is {pyplot.get_backend()!r}, which has none"
            " (there is no display, or no toolkit).",
            remedy=remedy,
        )
    window = Window(figure, state)
    kind.pyplot_show(block=True)
    window.stop()
