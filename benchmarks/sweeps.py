"""What a sweep costs a point, against the single calls: ``python -m benchmarks.sweeps``."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import peel_opt as po
from peel_opt.continuation.primary import forget_branches
from peel_opt.studies.sweep.workers import cores

from .figures import Figure

#: Points of each scene, as rods times pressures.
SCENES = {
    "series": (np.geomspace(1.0, 50.0, 100), np.linspace(0.55, 0.95, 100)),
    "law (8)": (np.geomspace(1.0, 50.0, 20), np.linspace(0.25, 0.45, 100)),
    "law (8), every rod another": (np.geomspace(1.0, 50.0, 1000), np.array([0.3])),
}


def _single_calls(ratios: np.ndarray, pressures: np.ndarray) -> float:
    """CPU seconds of one call a point, the branches of earlier rods remembered as usual."""
    forget_branches()
    began = time.process_time()
    for ratio in ratios:
        rod = po.Rod.from_ratio(ratio)
        for pressure in pressures:
            po.length_given_pressure(rod, float(pressure), throw=False)
    return time.process_time() - began


def _sweep(
    ratios: np.ndarray,
    pressures: np.ndarray,
    clock: Callable[[], float],
    workers: int = 1,
    journal: Path | None = None,
) -> float:
    began = clock()
    po.sweep({"ratio": ratios, "pressure_ratio": pressures}, workers=workers, journal=journal)
    return clock() - began


def figures() -> list[Figure]:
    """Milliseconds a point: CPU time of single calls, of a sweep here and with a journal; time in a pool.

    The pool has yet to start; what it takes depends on what else the machine does.
    """
    found = []
    _single_calls(np.array([1.0]), np.array([0.3, 0.8]))
    for name, (ratios, pressures) in SCENES.items():
        points = len(ratios) * len(pressures)
        with TemporaryDirectory() as folder:
            single = _single_calls(ratios, pressures)
            taken = {
                "sweep, workers=1": _sweep(ratios, pressures, time.process_time),
                "with a journal": _sweep(
                    ratios, pressures, time.process_time, journal=Path(folder) / "journal"
                ),
                f"{cores()} processes, elapsed": _sweep(ratios, pressures, time.perf_counter, cores()),
            }
        found.append(Figure(f"{name}, {points} points: single call", 1e3 * single / points, "ms"))
        for how, seconds in taken.items():
            note = f"{seconds / single:.2f} of the single calls, {seconds:.1f} s"
            found.append(Figure(f"{name}: {how}", 1e3 * seconds / points, "ms", note=note))
    return found


def main() -> None:
    """Measure and print."""
    print(f"{platform.machine()}, {cores()} cores, Python {platform.python_version()}")
    for figure in figures():
        print(figure, flush=True)


if __name__ == "__main__":
    main()
