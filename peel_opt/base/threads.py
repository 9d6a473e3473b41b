"""Threads while we compute: BLAS is held to one, and the main one hears Ctrl-C.

BLAS spreads work over all cores, and sums in another order for each number of them.  For our
matrices of some ten to some hundred rows the threads mostly wait for each other: where something
else runs, a solve of 114 unknowns takes 130 ms instead of 0.2 ms.  One thread is faster, and gives the
same bits on every machine.

CasADi calls back into Python to convert what it is given, and looks for signals before it evaluates.
A KeyboardInterrupt that rises there is cleared: the call returns nothing, or raises an error of its
own, which we would take for a failure to converge.  So what the handler of SIGINT raises is noted
while we compute, and raised again at the latest when the computation ends.
"""

from __future__ import annotations

# What `signal` makes of handlers, members of an enumeration, takes it fifty times as long as the call.
import _signal  # type: ignore[import-not-found]
import signal
import threading
from collections.abc import Callable
from contextlib import ContextDecorator
from functools import lru_cache
from types import CodeType, FrameType, TracebackType
from typing import Any

import casadi as ca
from threadpoolctl import OpenBLASController, ThreadpoolController, register


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
        self.press = self._press  # one object, to be known again

    def __enter__(self) -> None:
        if threading.current_thread() is not threading.main_thread():
            return
        if self.depth == 0:
            self.raised, own = None, _signal.getsignal(signal.SIGINT)
            if callable(own) and own is not self.press:
                self.own = own
                _signal.signal(signal.SIGINT, self.press)
        self.depth += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if threading.current_thread() is not threading.main_thread():
            return
        self.depth -= 1
        own, lost = self.own, None
        if self.depth == 0 and own is not None:
            if _signal.getsignal(signal.SIGINT) is self.press:
                _signal.signal(signal.SIGINT, own)
            self.own = None
            lost, self.raised = self.raised, None
        if self.depth:
            self.catch_up()
        elif self.late is not None:
            late, self.late = self.late, None
            own(signal.SIGINT, late)
        if lost is not None and (error is None or isinstance(error, Exception)):
            raise lost

    def check(self) -> None:
        """Raise what was raised by an interrupt and has not come through."""
        if self.raised is not None and threading.current_thread() is threading.main_thread():
            lost, self.raised = self.raised, None
            raise lost

    def catch_up(self) -> None:
        """Raise what was pressed where nothing is interrupted."""
        if self.late is not None and threading.current_thread() is threading.main_thread():
            late, self.late = self.late, None
            self._deliver(signal.SIGINT, late)

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


class _CasadiBLAS(OpenBLASController):  # type: ignore[misc]  # threadpoolctl has no types
    """The BLAS that CasADi brings for its own products, and for IPOPT; not known to threadpoolctl."""

    filename_prefixes = ("libcasadi-tp-openblas",)


register(_CasadiBLAS)


@lru_cache(maxsize=1)
def _libraries() -> list[Any]:
    # All must be loaded to be found: NumPy, SciPy and, since 3.8, CasADi bring a BLAS each.
    import numpy  # noqa: F401
    import scipy.linalg  # noqa: F401

    if hasattr(ca, "has_blas"):
        ca.has_blas("classic")
    return list(ThreadpoolController().select(user_api="blas").lib_controllers)


class _Inside(threading.local):
    """How deep one thread is inside."""

    depth = 0


class _OneThread(ContextDecorator):
    """Hold BLAS on one thread from the first entry to the last exit, from whatever thread.

    The number of BLAS threads belongs to the process, so that those who hold it are counted.  OpenBLAS
    may ignore what another thread than the main one asks for: what could not be given back by it is
    given back after the next call.
    """

    def __init__(self) -> None:
        self.inside = _Inside()
        self.lock = threading.Lock()
        self.holders = 0
        self.before: list[int] = []
        self.owed = False

    def __enter__(self) -> None:
        if self.inside.depth == 0:
            heard.__enter__()  # from here on nothing is interrupted before the body begins
            with self.lock:
                if self.holders == 0:
                    now = [library.get_num_threads() for library in _libraries()]
                    if not self.owed:
                        self.before = now
                    self._set(now, [1] * len(now))
                self.holders += 1
        self.inside.depth += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.inside.depth -= 1
        if self.inside.depth:
            if heard.late is not None:
                heard.catch_up()
            return
        with self.lock:
            self.holders -= 1
            if self.holders == 0:
                self.owed = self._set([1] * len(self.before), self.before)
        heard.__exit__(kind, error, trace)

    def run(self, function: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        """Call inside; a single call that is inside already costs no entry."""
        if self.inside.depth:
            return function(*arguments, **options)
        with self:
            return function(*arguments, **options)

    @staticmethod
    def _set(now: list[int], wanted: list[int]) -> bool:
        """Set the numbers of threads that are others now; whether one of them has stayed another."""
        others = [(lib, n) for lib, m, n in zip(_libraries(), now, wanted, strict=True) if m != n]
        for library, number in others:
            library.set_num_threads(number)
        return any(library.get_num_threads() != number for library, number in others)


#: Context and decorator; entering it again costs next to nothing.  What is computed in it hears Ctrl-C.
one_thread = _OneThread()
heard.quiet |= {_OneThread.__enter__.__code__, _OneThread.__exit__.__code__}
