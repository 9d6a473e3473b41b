"""The command ``peel-opt explore``: the page with sliders."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from .common import OK, AddCommand, say

if TYPE_CHECKING:
    from ..explorer.state import State


def add_commands(command: AddCommand) -> None:
    """Add ``explore`` to the command line."""
    explore = command("explore", "rod, diagram, potential and loop, linked, with sliders", _explore)
    explore.add_argument("card", nargs="?", metavar="CARD", help="start at the first question of a card")
    explore.add_argument("--port", type=int, metavar="N", help="port on 127.0.0.1 (5006, or a free one)")
    explore.add_argument("--no-browser", action="store_true", help="only say where the page is")
    explore.add_argument("--export", metavar="FILE", help="write a page that needs no server, and end")
    explore.add_argument("--alone", action="store_true", help="write it without problems to begin with")


def _explore(arguments: argparse.Namespace) -> int:
    """Show the explorer, or write it to a file."""
    state = _state(arguments.card)
    if arguments.export is not None:
        from ...base.files import as_path, make_folder
        from ..explorer.export import write_page

        make_folder(as_path(arguments.export).parent)

        say(str(write_page(arguments.export, state, begin={} if arguments.alone else None)))
        return OK
    from ..explorer.server import serve

    def ready(url: str) -> None:
        say(f"The explorer is at {url} (for this machine only). Ctrl+C ends it.")

    serve(state, port=arguments.port, browser=not arguments.no_browser, ready=ready)
    return OK


def _state(card: str | None) -> State:
    from ..explorer.state import State

    if card is None:
        return State()
    from ..cards import load_card
    from ..explorer.state_cards import from_card

    return from_card(load_card(card))
