"""Stand-ins for the threads of the explorer."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future

from peel_opt.app.explorer.screen import Screen


def at_once(work: Callable[[], Screen]) -> Future[Screen]:
    """Do the work of a thread here and now."""
    future: Future[Screen] = Future()
    try:
        future.set_result(work())
    except Exception as error:
        future.set_exception(error)
    return future
