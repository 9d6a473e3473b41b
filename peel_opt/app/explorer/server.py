"""`serve`: the explorer on this machine's loopback address, for this machine only."""

from __future__ import annotations

import errno
import socket
from typing import TYPE_CHECKING, Any

from ...base.errors import InvalidInput, MissingExtra
from .state import State

if TYPE_CHECKING:
    from bokeh.document import Document
    from bokeh.server.server import Server

ADDRESS = "127.0.0.1"

#: Where Bokeh servers are looked for.
USUAL_PORT = 5006


def make_server(state: State | None = None, *, port: int | None = None) -> Server:
    """Return a server of the explorer that listens and waits to be run.

    Parameters
    ----------
    state : State, optional
        What a page shows whose address does not say otherwise.
    port : int, optional
        Without it 5006, or any free one where that is taken.

    Returns
    -------
    bokeh.server.server.Server

    Raises
    ------
    MissingExtra
        If Bokeh is not installed.
    InvalidInput
        If the port cannot be listened at.
    """
    try:
        from bokeh.application import Application
        from bokeh.application.handlers.function import FunctionHandler
        from bokeh.server.server import Server
        from bokeh.settings import settings
    except ImportError as error:
        raise MissingExtra(
            "the explorer needs Bokeh, which is not installed.",
            remedy="Install it with: pip install 'peel_opt[explore]'",
        ) from error
    start = state or State()
    # Whatever the environment says: nothing is fetched from elsewhere.
    settings.resources = "server"

    def listen(where: int) -> Any:
        application = Application(FunctionHandler(lambda doc: open_page(doc, start), trap_exceptions=True))
        return Server(
            {"/": application},
            address=ADDRESS,
            port=where,
            allow_websocket_origin=[f"{ADDRESS}:{where}", f"localhost:{where}"],
            # A page whose tab is closed is given up soon.
            unused_session_lifetime_milliseconds=10_000,
        )

    if port is not None and not 1 <= port <= 65535:
        raise InvalidInput(f"a port lies between 1 and 65535, got {port}.")
    try:
        return listen(_bound(USUAL_PORT if port is None else port))
    except OSError as error:
        if error.errno not in (errno.EADDRINUSE, errno.EACCES) or port is not None:
            raise InvalidInput(
                f"cannot listen at {ADDRESS}:{port}: {error.strerror}.",
                remedy="Give another --port, or none for a free one.",
            ) from error
    return listen(_bound(0))


def _bound(port: int) -> int:
    """Return a port that can be listened at, or any one for 0; raise the OSError if it cannot."""
    with socket.socket() as probe:
        # A port that was left a moment ago counts as free, as for the server itself.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((ADDRESS, port))
        return int(probe.getsockname()[1])


def open_page(doc: Document, start: State) -> None:
    """Fill a document with a page of its own; the address may name the state."""
    from .page import Page

    context: Any = doc.session_context
    arguments = context.request.arguments if context is not None and context.request is not None else {}
    if not arguments:
        Page(doc, start)
        return
    state, messages = State.from_query(arguments)
    Page(doc, state, messages)


def warm_up() -> None:
    """Compile what the first pictures need, so that the first drag is as quick as all others."""
    from .presets import presets
    from .screens import live_screen

    presets()
    for given, law in (("groups", "linear"), ("length", "cohesive"), ("pressure", "cohesive")):
        state = State(given=given, law=law)  # type: ignore[arg-type]
        live_screen(state, budget=1.0)


def serve(
    state: State | None = None, *, port: int | None = None, browser: bool = True, ready: Any = None
) -> None:
    """Serve the explorer on 127.0.0.1 until interrupted.

    Parameters
    ----------
    state : State, optional
        What the page shows at first.
    port : int, optional
        Without it 5006, or any free one where that is taken.
    browser : bool
        Whether to open a browser.
    ready : callable, optional
        Called with the address once the page can be opened.

    Raises
    ------
    MissingExtra
        If Bokeh is not installed.
    InvalidInput
        If the port cannot be listened at.
    """
    server = make_server(state, port=port)
    warm_up()
    url = f"http://{ADDRESS}:{server.port}/"
    if ready is not None:
        ready(url)
    server.start()
    if browser:
        server.io_loop.add_callback(lambda: _browse(url))
    try:
        server.io_loop.start()
    finally:
        server.stop()


def _browse(url: str) -> None:
    import webbrowser

    webbrowser.open(url)
