"""Ctrl-C is heard, also where a library swallows it.

CasADi calls back into Python to convert what it is given, and looks for signals before it evaluates.
A KeyboardInterrupt that rises there is cleared: the call returns nothing, or raises an error of its
own, which we would take for a failure to converge.  So what the handler of SIGINT raises is noted
while we compute, and raised again at the latest when the computation ends.
"""

from __future__ import annotations

import signal
import threading
from contextlib import ContextDecorator
from types import CodeType, FrameType, TracebackType
from typing import Any


class _Heard(ContextDecorator):
    """Note what the handler of SIGINT raises, from the first entry to the last exit of the main thread.

    Only the main thread receives signals.  A handler of the caller's that raises nothing stays in
    charge.  The code objects in ``quiet`` are never interrupted in the middle: what is pressed there is
    raised when they are left.
    """

    def __init__(self) -> None:
        self.depth = 0
        self.own: Any = None
        self.raised: BaseException | None = None
        self.late: FrameType | None = None
        self.quiet: set[CodeType] = {type(self).__enter__.__code__, type(self).__exit__.__code__}

    def __enter__(self) -> None:
        if threading.current_thread() is not threading.main_thread():
            return
        if self.depth == 0:
            self.raised, own = None, signal.getsignal(signal.SIGINT)
            if callable(own) and own != self._press:
                self.own = own
                signal.signal(signal.SIGINT, self._press)
        self.depth += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if threading.current_thread() is not threading.main_thread():
            return
        self.depth -= 1
        own, lost = self.own, None
        if self.depth == 0 and own is not None:
            if signal.getsignal(signal.SIGINT) == self._press:
                signal.signal(signal.SIGINT, own)
            self.own = None
            lost, self.raised = self.raised, None
        late, self.late = self.late, None
        if late is not None:
            (self._deliver if self.depth else own)(signal.SIGINT, late)
        if lost is not None and (error is None or isinstance(error, Exception)):
            raise lost

    def check(self) -> None:
        """Raise what was raised by an interrupt and has not come through."""
        if self.raised is not None and threading.current_thread() is threading.main_thread():
            lost, self.raised = self.raised, None
            raise lost

    def _press(self, number: int, frame: FrameType | None) -> None:
        around = frame
        while around is not None:
            if around.f_code in self.quiet:
                self.late = frame
                return
            around = around.f_back
        self._deliver(number, frame)

    def _deliver(self, number: int, frame: FrameType | None) -> None:
        try:
            self.own(number, frame)
        except BaseException as error:
            self.raised = error
            raise


#: Context and decorator of whatever calls CasADi.
heard = _Heard()
