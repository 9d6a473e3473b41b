"""Print every figure next to what is asked; exit with 1 where one falls short.

Run from the root of the repository, on a machine with nothing else to do::

    OMP_NUM_THREADS=1 python -m benchmarks.run
"""

from __future__ import annotations

import os
import platform
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before NumPy: threads only disturb such small systems

from . import auto_peer, batches, cold_starts, many_answers, scenes, single_answers


def main() -> int:
    """Measure, print and judge."""
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    short = 0
    for module in (single_answers, scenes, batches, many_answers, cold_starts, auto_peer):
        for figure in module.figures():
            print(figure, flush=True)
            short += not figure.met
    print(f"{short} fall short" if short else "all met")
    return 1 if short else 0


if __name__ == "__main__":
    sys.exit(main())
