"""The kind of the fixture `call`."""

from __future__ import annotations

from collections.abc import Callable

#: Arguments of a command in; its exit code, stdout and stderr out.
Call = Callable[..., tuple[int, str, str]]
