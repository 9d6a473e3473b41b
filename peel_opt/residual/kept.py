"""Which problems stay compiled: those used last, up to a bound on the memory they take."""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .discretisation import Discretisation

#: Sum of the weights of the problems whose compiled functions are kept: some 300 MB, 80 problems
#: of law (8) or a handful of a law with twenty kinks, of which every sequence of phases is one.
MOST_KEPT = 500_000

_KEPT: OrderedDict[Discretisation, int] = OrderedDict()
_KEPT_LOCK = threading.Lock()


def keep(problem: Discretisation) -> None:
    """Keep what is compiled of a problem, and drop that of the ones not used for longest."""
    with _KEPT_LOCK:
        if _KEPT and next(reversed(_KEPT)) is problem:
            return
        _KEPT.pop(problem, None)
        _KEPT[problem] = problem.weight
        total = sum(_KEPT.values())
        while total > MOST_KEPT and len(_KEPT) > 1:
            oldest, weight = _KEPT.popitem(last=False)
            oldest.release()
            total -= weight
