"""One page: its state, its widgets and panels, and the work behind them.

While a slider moves, a quick screen is computed on the event loop, of the newest value only.  When
it rests, the full screen is computed in a thread and shown if it is still wanted.  Each document has a
page of its own and shares nothing but remembered branches.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any

from bokeh.core.templates import get_env
from bokeh.document import Document
from bokeh.models import InlineStyleSheet

from ...base.errors import PeelOptError
from ...equilibria.result import Equilibrium
from . import look, moves
from .controls import Controls
from .curves import Curve
from .downloads import address, outbox, picture
from .fit import fit
from .loops import LoopFrame
from .pace import Pace
from .panels import FourPanels, apply
from .player import Player
from .screen import Screen
from .screens import full_screens, live_screen
from .spoken import spoken
from .state import State
from .state_cards import to_card
from .tables import screen_csv
from .texts import costs, doing, notes, text_box

#: A slider has rested when nothing came for this long [ms].
RESTED = 350

#: Time from one frame of the sweep to the next [ms].
FRAME = 90

_WORKERS = ThreadPoolExecutor(max_workers=2, thread_name_prefix="peel-opt-explore")

Submit = Callable[[Callable[[], Screen]], "Future[Screen]"]


class Page:
    """The explorer in one document.

    Parameters
    ----------
    doc : Document
    state : State
    messages : tuple of str
        To be shown at first, such as what a link could not mean.
    submit : callable, optional
        Runs a full computation off the event loop; by default in one of two threads.
    """

    def __init__(
        self,
        doc: Document,
        state: State,
        messages: tuple[str, ...] = (),
        *,
        submit: Submit = _WORKERS.submit,
    ) -> None:
        self.doc, self.state, self.messages = doc, state, messages
        self._submit = submit
        self.best: Curve | None = None
        self.known: Equilibrium | None = None
        self.screen = live_screen(state)
        self._token = 0
        self._waiting = self._scheduled = self._held = False
        self._rest: Any = None
        self._sweep: Any = None
        self._frames: tuple[LoopFrame, ...] = ()
        self._frame = 0
        self.controls = Controls(self._choice, self._slider, self._text)
        self.panels = FourPanels(live=True)
        self.notes = text_box("notes", "alert")
        self.costs = text_box("costs", "status")
        self.costs.stylesheets = [InlineStyleSheet(css=look.TRUST)]
        self.outbox, self.address = outbox(), address()
        self.pace = Pace(self._caught_up)
        self.player = Player(
            doc, self.panels, self.pace, self.controls.snap, lambda said: self._say((said,)), self._draw
        )
        self._assemble()
        self._draw()
        self.controls.show(state, self.screen.curve)
        self._solve()

    def _assemble(self) -> None:
        for kind in ("png", "svg"):
            self.controls.buttons[kind].js_on_click(picture(self.panels.grid, kind))
        self.controls.buttons["csv"].on_click(self._send_csv)
        self.controls.buttons["card"].on_click(self._send_card)
        self.controls.buttons["link"].on_click(self._send_link)
        self.controls.nearest.on_click(self._to_nearest)
        self.controls.play.on_change("active", self._play)
        self.panels.diagram.figure.on_event("tap", self._tapped)
        self.controls.snap.on_click(lambda: self.player.begin(self.state, self.screen))
        root = self.panels.page(self.controls.box, self.costs, self.notes, [self.player.bar])
        self.doc.title = "peel_opt explorer"
        block = f"{{% extends base %}}{{% block preamble %}}{look.VIEWPORT}{{% endblock %}}"
        self.doc.template = get_env().from_string(block)
        sliders = {**self.controls.spoken_sliders, self.player.moment: None}
        pressed = {**self.controls.spoken_groups, self.player.play: "Film"}
        tell = spoken(sliders, pressed, self.panels.named)
        self.doc.js_on_event("document_ready", tell, fit(self.panels.every))
        self.pace.pulse.js_on_change("data", tell)  # after each picture
        with self.doc.models.freeze():  # one look through all models, not one for each root
            for model in (root, self.outbox, self.address, self.pace.pulse):
                self.doc.add_root(model)
        self.doc.on_session_destroyed(self._closed)

    # --- what people do -------------------------------------------------------------------

    def _choice(self, field: str, value: str) -> None:
        eq = self.screen.equilibrium
        self._try(lambda state: moves.chosen(state, field, value, eq))

    def _slider(self, field: str, value: float, rested: bool) -> None:
        eq = self.screen.equilibrium
        self._try(lambda state: moves.slid(state, field, value, eq), rested=rested)

    def _text(self, field: str, text: str) -> None:
        self._stop()
        try:
            state = moves.typed(self.state, field, text)
        except PeelOptError as error:
            self.controls.refuse(field, str(error))
            return
        self.go_to(state)

    def _tapped(self, event: Any) -> None:
        if event.x is None or event.y is None:
            return
        picked = moves.picked(self.screen, float(event.x), float(event.y))
        if picked is not None:
            self._try(lambda _: picked)

    def _to_nearest(self) -> None:
        nearest = self.screen.nearest
        if nearest is not None:
            self._try(lambda _: nearest)

    def _try(self, change: Callable[[State], State], *, rested: bool = True) -> None:
        """Change the state; what cannot be meant is said, and all stays as it was."""
        self._stop()
        try:
            state = change(self.state)
        except PeelOptError as error:
            self._say((str(error),))
            self.controls.show(self.state, self.screen.curve)
            return
        self.go_to(state, rested=rested)

    def go_to(self, state: State, *, rested: bool = True) -> None:
        """Show another state: at once quickly, fully when it rests."""
        self.player.end()
        self.state, self.messages = state, ()
        self.controls.accept()
        self._token += 1
        self._waiting = rested
        if not self._scheduled or self._held:
            # One picture for all the values that come before it.
            self._scheduled = True
            self.doc.add_next_tick_callback(self._live)

    # --- pictures -------------------------------------------------------------------------

    def _caught_up(self) -> None:
        if self._held:
            self._live()

    def _live(self) -> None:
        if not self._scheduled:
            return  # shown already, when the picture before had been painted
        self._held = not self.pace.keeps_up()
        if self._held:
            return  # painted first; then the newest value is next
        self._scheduled = False
        self.known = self.screen.equilibrium or self.known
        self.screen = live_screen(self.state, best=self.best, before=self.known)
        self._draw()
        self.controls.show(self.state, self.screen.curve)
        if self._rest is not None:
            self.doc.remove_timeout_callback(self._rest)
            self._rest = None
        if self._waiting:
            self._solve()
        else:
            self._rest = self.doc.add_timeout_callback(self._rested, RESTED)

    def _rested(self) -> None:
        self._rest = None
        self._solve()

    def _solve(self) -> None:
        """Compute the full screen off the event loop."""
        self._waiting = False
        token, state = self._token, self.state
        self._doing("solving")

        def work() -> Screen:
            screen = self.screen
            if token != self._token:
                return screen  # nobody waits for it any more
            for screen, what in full_screens(state):
                if token != self._token:
                    break
                if what:
                    self.doc.add_next_tick_callback(partial(self._part, token, screen, what))
            return screen

        self._submit(work).add_done_callback(partial(self._done, token))

    def _done(self, token: int, future: Future[Screen]) -> None:
        # In the thread of the work: the document may only be touched from its own.
        if token == self._token and not future.cancelled():
            self.doc.add_next_tick_callback(partial(self._deliver, token, future))

    def _part(self, token: int, screen: Screen, what: str) -> None:
        """Show what is known of a full picture, while more of it is computed."""
        if token == self._token:
            self._take(screen)
            self._doing(what)

    def _take(self, screen: Screen) -> None:
        self.screen, self.best = screen, screen.curve or self.best
        if self._sweep is None:
            self._draw()
            self.controls.show(self.state, screen.curve)

    def _deliver(self, token: int, future: Future[Screen]) -> None:
        if token != self._token:
            return
        error = future.exception()
        if error is not None:
            self._say((f"The full computation failed: {error}",))
            self._costs("; not solved")
            return
        self._take(future.result())
        self.address.data = {"query": [self.state.to_query()]}

    def _draw(self) -> None:
        if self.player.film is not None:
            return  # it is shown when that is over
        screen = self.screen
        self.doc.hold("combine")
        try:
            apply(self.panels.updates(screen))
            self.controls.play.disabled = screen.loop is None
            self.controls.nearest.visible = screen.nearest is not None
            self._say(self.messages)
            self._costs("")
            self.panels.progress.text = ""
            self.pace.sent()
        finally:
            self.doc.unhold()

    def _say(self, messages: tuple[str, ...]) -> None:
        """Show messages as text, never as markup."""
        self.notes.text = notes(self.screen, messages)

    def _doing(self, what: str) -> None:
        """Say what is computed now."""
        self._costs(f"; {what} …")
        self.panels.progress.text = doing(what)

    def _costs(self, doing: str) -> None:
        """Show what the picture cost and how far to trust it, part by part."""
        self.costs.text = costs(self.screen, doing)

    # --- the sweep ------------------------------------------------------------------------

    def _play(self, _attribute: str, _old: bool, new: bool) -> None:
        if not new:
            self._stop()
            return
        sweep = self.screen.sweep
        if sweep is None or self._sweep is not None:
            return
        self.player.end()
        self._frames, self._frame = sweep.frames, 0
        self.controls.play.label = "■ Stop"
        self._sweep = self.doc.add_periodic_callback(self._step, FRAME)

    def _step(self) -> None:
        if not self.pace.keeps_up():
            return
        if self._frame >= len(self._frames):
            self._stop()
            return
        frame, sweep = self._frames[self._frame], self.screen.sweep
        self._frame += 1
        assert sweep is not None  # it is what is played
        try:
            state = moves.framed(self.state, sweep, frame)
        except PeelOptError:  # outside what a state may be, or attached in a scene; the sweep goes on
            attached = "attached to its wall" if frame.label == "adhered" else "outside what is shown"
            apply(self.panels.rod.updates("Rod", None, attached))
            apply(self.panels.diagram.place(None))
            apply(self.panels.loop.place((frame.x, frame.y)))
            return
        screen = live_screen(state, best=self.best)
        self.doc.hold("combine")
        try:
            if screen.rod is not None:  # otherwise the picture before stays for a moment
                apply(self.panels.moving(screen))
                apply(self.panels.diagram.place(screen.diagram.here if screen.diagram else None))
            apply(self.panels.loop.place((frame.x, frame.y)))
            self.pace.sent()
        finally:
            self.doc.unhold()

    def _stop(self) -> None:
        """End the sweep and show the state again."""
        if self._sweep is None:
            return
        self.doc.remove_periodic_callback(self._sweep)
        self._sweep = None
        self.controls.play.label = "▶ Play sweep"
        self.controls.play.active = False
        self._draw()

    def _closed(self, _context: Any) -> None:
        self._token += 1  # work that has not begun is not begun any more
        self.player.forget()

    # --- taking away ----------------------------------------------------------------------

    def _send(self, name: str, text: str, kind: str) -> None:
        number = self.outbox.data["number"][0] + 1
        self.outbox.data = {"name": [name], "text": [text], "kind": [kind], "number": [number]}

    def _send_csv(self) -> None:
        self._send("peel_opt.csv", screen_csv(self.screen), "text/csv")

    def _send_card(self) -> None:
        try:
            self._send("peel_opt.toml", to_card(self.state), "application/toml")
        except PeelOptError as error:
            self._say((str(error),))

    def _send_link(self) -> None:
        query = self.state.to_query()
        self.address.data = {"query": [query]}
        self._send("link", f"?{query}", "clipboard")
        self._say((f"The link in the address bar restores this state: ?{query}",))
