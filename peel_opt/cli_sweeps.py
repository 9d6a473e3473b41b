"""The commands over many rods: ``peel-opt sweep`` and ``peel-opt uncertainty``."""

from __future__ import annotations

from .cli_common import AddCommand


def add_commands(command: AddCommand) -> None:
    """Add the commands of this module to the command line."""
