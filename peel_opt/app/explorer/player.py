"""The player of a film: it lets a state go in a thread, says how far it is, and plays, stops and seeks."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.models import Button, InlineStyleSheet, Row, Slider, Toggle

from ...base.errors import PeelOptError
from ...equilibria.branch import Branch
from ...equilibria.result import Equilibrium
from ...plots.diagram import place
from ...plots.panels import Line, Panel
from ...plots.words import plain
from . import look
from .film import FRAMES, Film, film_of
from .pace import Pace
from .panels import FourPanels, apply
from .screen import Screen
from .state import State
from .texts import running

#: Time from one moment to the next [ms].
FRAME = 60

#: Time in which a step may be under way to the page while the page says something else [s].
CROSSING = 0.4

#: A motion takes seconds of a core: one at a time, beside the pictures.
_WORKER = ThreadPoolExecutor(max_workers=1, thread_name_prefix="peel-opt-snap")

Submit = Callable[[Callable[[], Film]], "Future[Film]"]


def _moves_along(film: Film, branch: Branch) -> bool:
    """Whether a branch is that of the rod that moves, with what acts on it."""
    return branch.rod == film.motion.rod and branch.scene == film.motion.scene


class NotWanted(Exception):
    """Nobody waits for a motion any more."""


class Player:
    """What computes a film and plays it.

    Parameters
    ----------
    doc : Document
    panels : FourPanels
    pace : Pace
    button : Button
        Lets a state go, or gives the motion up while it is computed.
    refused : callable
        Called with the reason why there is no film.
    closed : callable
        Called when the panels are to show the state again.
    submit : callable
        Runs the computation off the event loop.
    """

    def __init__(
        self,
        doc: Document,
        panels: FourPanels,
        pace: Pace,
        button: Button,
        refused: Callable[[str], None],
        closed: Callable[[], None],
        *,
        submit: Submit = _WORKER.submit,
    ) -> None:
        self.doc, self.panels, self.pace, self.button = doc, panels, pace, button
        self._refused, self._closed, self._submit = refused, closed, submit
        self.film: Film | None = None
        self._token, self._computing, self._quiet = 0, False, False
        self._branch: Any = None
        self._timer: Any = None
        self._stepped = -math.inf
        style = [InlineStyleSheet(css=look.WIDGETS)]
        self.play = Toggle(label="▶ Play", active=False, width=90, name="film-play", stylesheets=style)
        self.moment = Slider(
            start=0,
            end=FRAMES - 1,
            value=0,
            step=1,
            title="moment of the motion",
            show_value=False,
            sizing_mode="stretch_width",
            name="film-moment",
            stylesheets=style,
        )
        self.close = Button(label="Back to the state", width=130, name="film-close", stylesheets=style)
        self.bar = Row(
            self.play,
            self.moment,
            self.close,
            spacing=10,
            visible=False,
            sizing_mode="stretch_width",
            name="film",
            stylesheets=[InlineStyleSheet(css=look.PLAYER)],
        )
        self.play.on_change("active", self._played)
        self.moment.on_change("value", self._sought)
        self.close.on_click(self.end)

    @property
    def busy(self) -> bool:
        """Whether a motion is computed or shown."""
        return self._computing or self.film is not None

    def begin(self, state: State, screen: Screen) -> None:
        """Let a state go; asked again while that is computed, give it up."""
        if self._computing:
            self.end()
            return
        self.end()
        self._token += 1
        token, eq = self._token, screen.equilibrium
        self._computing = True
        self.button.label = "■ Give it up"
        self._told(token, 0, 100)
        work = partial(self._computed, token, state, eq)
        self._submit(work).add_done_callback(partial(self._done, token, screen))

    def _computed(self, token: int, state: State, eq: Equilibrium | None) -> Film:
        """In a thread: compute a film, as long as it is wanted."""
        shown = 0

        def told(done: int, total: int | None) -> None:
            nonlocal shown
            if token != self._token:
                raise NotWanted
            if done > shown:
                shown = done
                self.doc.add_next_tick_callback(partial(self._told, token, done, total or 100))

        return film_of(state, eq, told)

    def _told(self, token: int, done: int, total: int) -> None:
        if token == self._token and self._computing:
            self.panels.progress.text = running(done, total)

    def _done(self, token: int, screen: Screen, future: Future[Film]) -> None:
        if token == self._token and not future.cancelled():
            self.doc.add_next_tick_callback(partial(self._deliver, token, screen, future))

    def _deliver(self, token: int, screen: Screen, future: Future[Film]) -> None:
        if token != self._token:
            return
        error = future.exception()
        if error is not None:
            self.end()
            said = str(error) if isinstance(error, PeelOptError) else f"The motion failed: {error}"
            self._refused(said)
            return
        self._computing = False
        self.button.label = "▶ Let it snap"
        self.show(future.result(), screen)

    def show(self, film: Film, screen: Screen) -> None:
        """Show a film from its first moment, and play it."""
        self.film = film
        self.panels.progress.text = ""
        diagram, self._branch = None, None
        curve = screen.curve
        if screen.diagram is not None and curve is not None and _moves_along(film, curve.branch):
            self._branch = curve.branch
            diagram = self._crossed(film, screen.diagram)
        self.bar.visible = True
        apply(self.panels.film_begins(film, diagram))
        self._quiet = True
        self.moment.value = 0
        self._quiet = False
        self._at(0)
        self.play.active = True

    def _crossed(self, film: Film, diagram: Panel) -> Panel:
        """Return the diagram with the motion across it, at its pressure."""
        shown = [film.front(float(t)) for t in film.times]
        x, y = np.transpose([place(self._branch, front, film.motion.pressure) for front in shown])
        crossed = replace(diagram, lines=(*diagram.lines, Line("orbit", x, y, "motion")))
        return crossed.at((float(x.max()), float(y[0]))).at((float(x[0]), float(y[0])))

    def _at(self, number: int) -> None:
        """Show a moment."""
        film = self.film
        assert film is not None  # one is shown
        t = float(film.times[number])
        where = None
        if self._branch is not None:
            where = place(self._branch, film.front(t), film.motion.pressure)
        self.doc.hold("combine")
        try:
            apply(self.panels.film_at(film, t, where))
            unit = film.panels.times_in
            self.moment.title = f"{plain(unit.axis('t'))} = {film.panels.time_of(t):.3g}"
            self.pace.sent()
        finally:
            self.doc.unhold()

    def _sought(self, _attribute: str, _old: float, new: float) -> None:
        if self._quiet or self.film is None:
            return
        self.play.active = False
        self._at(int(new))
        if time.monotonic() - self._stepped < CROSSING:
            self.doc.add_timeout_callback(self._settle, int(1e3 * CROSSING))

    def _settle(self) -> None:
        """Say again where the slider is: a step that was under way to the page may have moved it back."""
        number = int(self.moment.value)
        self._quiet = True
        self.moment.value = number - 1 if number else 1
        self.moment.value = number
        self._quiet = False

    def _played(self, _attribute: str, _old: bool, new: bool) -> None:
        if self._timer is not None:
            self.doc.remove_periodic_callback(self._timer)
            self._timer = None
        self.play.label = "❚❚ Pause" if new else "▶ Play"
        if new and self.film is not None:
            if self.moment.value >= FRAMES - 1:
                self._move(0)
            self._timer = self.doc.add_periodic_callback(self._step, FRAME)

    def _step(self) -> None:
        if not self.pace.keeps_up():
            return
        if self.moment.value >= FRAMES - 1:
            self.play.active = False
            return
        self._move(int(self.moment.value) + 1)

    def _move(self, number: int) -> None:
        self._quiet, self._stepped = True, time.monotonic()
        self.moment.value = number
        self._quiet = False
        self._at(number)

    def forget(self) -> None:
        """Give up what is computed; the page is gone."""
        self._token += 1

    def end(self) -> None:
        """Give up what is computed, and show the state again."""
        if not self.busy:
            return
        self._token += 1
        shown, self.film, self._computing = self.film is not None, None, False
        self.play.active = False
        self.bar.visible = False
        self.button.label = "▶ Let it snap"
        self.panels.progress.text = ""
        if shown:
            apply(self.panels.filming(on=False))
            self._closed()
