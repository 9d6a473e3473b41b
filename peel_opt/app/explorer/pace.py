"""How fast pictures may follow each other: a browser that cannot keep up sets the pace."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from .downloads import pulse

#: A browser that has not said for this long that it has painted is not waited for [s].
SILENT = 1.0


class Pace:
    """What a browser was sent, and what it has painted.

    Parameters
    ----------
    caught_up : callable
        Called when the last picture sent has been painted.

    Attributes
    ----------
    pulse : ColumnDataSource
        To be in the document: the browser answers by it.
    count : int
        Pictures sent.
    """

    def __init__(self, caught_up: Callable[[], None]) -> None:
        self.pulse = pulse()
        self.count = 0
        self._seen, self._sent_at = -1, 0.0
        self._caught_up = caught_up
        self.pulse.on_change("data", self._painted)

    def keeps_up(self) -> bool:
        """Whether the browser has painted all it was sent; True before it has ever said so."""
        silent = time.monotonic() - self._sent_at > SILENT
        return self._seen < 0 or self._seen == self.count or silent

    def sent(self) -> None:
        """Count a picture, and ask the browser to say when it is painted."""
        self.count += 1
        self._sent_at = time.monotonic()
        self.pulse.data = {"sent": [self.count], "seen": [self._seen]}

    def _painted(self, _attribute: str, _old: Any, new: Any) -> None:
        if new["seen"][0] == new["sent"][0] == self.count:
            self._seen = self.count
            self._caught_up()
