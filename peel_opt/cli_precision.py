"""The command ``peel-opt tradeoff``: time against error."""

from __future__ import annotations

from .cli_common import AddCommand


def add_commands(command: AddCommand) -> None:
    """Add the commands of this module to the command line."""
