"""What a fresh process takes: the first answer with its imports, and the help text."""

from __future__ import annotations

import subprocess
import sys
import time
from statistics import median

from .figures import Figure

FIRST = "import peel_opt as po; po.{call}"


def _seconds(*arguments: str, repeats: int = 5) -> float:
    taken = []
    for _ in range(repeats):
        began = time.perf_counter()
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
        taken.append(time.perf_counter() - began)
    return median(taken)


def figures() -> list[Figure]:
    """All of this module."""
    groups = FIRST.format(call="equilibrium(beta0=4, lam=1)")
    law_8 = FIRST.format(call="length_given_pressure(po.Rod.from_ratio(1.0), 0.2)")
    return [
        Figure(
            "(f) first answer of a fresh process, beta0 = 4, lambda = 1", _seconds("-c", groups), "s", 1.5
        ),
        Figure("(f) first answer of a fresh process, law (8), P = 0.2", _seconds("-c", law_8), "s", 1.5),
        Figure("(f) --help", _seconds("-m", "peel_opt", "--help"), "s", 0.3),
    ]
