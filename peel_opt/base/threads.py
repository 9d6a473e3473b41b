"""One BLAS thread while we compute: the same bits on every machine, and faster.

BLAS spreads work over all cores, and sums in another order for each number of them.  For our
matrices of some ten to some hundred rows the threads mostly wait for each other: where something
else runs, a solve of 114 unknowns takes 130 ms instead of 0.2 ms.
"""

from __future__ import annotations

import threading
from contextlib import ContextDecorator
from functools import lru_cache
from types import TracebackType
from typing import Any

import casadi as ca
from threadpoolctl import OpenBLASController, ThreadpoolController, register

from .interrupts import heard


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


class _OneThread(ContextDecorator):
    """Hold BLAS on one thread from the first entry to the last exit, from whatever thread.

    The number of BLAS threads belongs to the process, so that those who hold it are counted.  OpenBLAS
    may ignore what another thread than the main one asks for: what could not be given back by it is
    given back after the next call.
    """

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.holders = 0
        self.before: list[int] = []
        self.owed = False

    def __enter__(self) -> None:
        heard.__enter__()
        with self.lock:
            if self.holders == 0:
                if not self.owed:
                    self.before = [library.get_num_threads() for library in _libraries()]
                for library in _libraries():
                    library.set_num_threads(1)
            self.holders += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self.lock:
            self.holders -= 1
            if self.holders == 0:
                for library, threads in zip(_libraries(), self.before, strict=True):
                    library.set_num_threads(threads)
                self.owed = [library.get_num_threads() for library in _libraries()] != self.before
        heard.__exit__(kind, error, trace)


#: Context and decorator; entering it again costs a microsecond.  What is computed in it hears Ctrl-C.
one_thread = _OneThread()
heard.quiet |= {_OneThread.__enter__.__code__, _OneThread.__exit__.__code__}
