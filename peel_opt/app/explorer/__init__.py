"""The explorer: one page on which rod, diagram, potential and loop move together.

The model layer knows neither Bokeh nor Matplotlib figures: a `State` says what is looked at, and
`live_screen` and `full_screen` turn it into a `Screen`, plain arrays for the four linked panels.  The first
keeps up with a slider, the second solves and traces to the accuracy asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .screen import Screen
    from .screens import full_screen, live_screen
    from .server import serve
    from .state import State

_HOMES = {
    "State": "state",
    "Screen": "screen",
    "live_screen": "screens",
    "full_screen": "screens",
    "serve": "server",
}

__all__ = ["Screen", "State", "full_screen", "live_screen", "serve"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'peel_opt.app.explorer' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f".{_HOMES[name]}", __name__), name)
