"""One thread for matrices of some hundred rows.

BLAS spreads their factorisation over all cores, and on a machine where something else runs the
threads wait for each other: a solve of 114 unknowns then takes 130 ms instead of 0.2 ms.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from functools import lru_cache

from threadpoolctl import ThreadpoolController

#: BLAS itself uses one thread for systems up to about this size.
SMALL = 48


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    # Both must be loaded to be found: NumPy and SciPy bring a BLAS each.
    import numpy  # noqa: F401
    import scipy.linalg  # noqa: F401

    return ThreadpoolController().select(user_api="blas")


def one_thread(size: int | None = None) -> AbstractContextManager[object]:
    """Return a context in which systems of ``size`` unknowns, or all, are solved on one thread."""
    return nullcontext() if size is not None and size <= SMALL else _libraries().limit(limits=1)
