"""Batches of certified answers: ``python -m benchmarks.many_answers``.

Against the single calls of the same run, so that the figures are ratios, in CPU time; and answers a
second, which are what they are on a quiet machine only.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from functools import partial
from statistics import median

import numpy as np

import peel_opt as po
from peel_opt.continuation.primary import forget_branches

from .figures import Figure

#: Questions in a batch, and of how many of them single calls are timed.
COUNT, SINGLES = 4000, 100

#: The rod of an uncertainty, and by how much it scatters.
TAPE = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
SCATTER = {"bending_stiffness": "5 %", "adhesion_strength": "5 %", "adhesion_range": "5 %"}


def questions(low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Random rods, r from 0.5 to 100, and pressures between two, p/T0."""
    rng = np.random.default_rng(5)
    return rng.uniform(0.5, 100.0, COUNT), rng.uniform(low, high, COUNT)


def seconds(*calls: Callable[[], object]) -> list[float]:
    """Median CPU seconds of calls that take turns, after a warm-up."""
    taken: list[list[float]] = [[] for _ in calls]
    for _ in range(6):
        for own, call in zip(taken, calls, strict=True):
            began = time.process_time()
            call()
            own.append(time.process_time() - began)
    return [median(own[1:]) for own in taken]


def _answered(given: tuple[np.ndarray, np.ndarray]) -> int:
    ratio, P = given
    return int(po.answers(ratio=ratio, pressure_ratio=P).certified.sum())


def _one_by_one(ratio: np.ndarray, P: np.ndarray) -> None:
    forget_branches()
    for r, p in zip(ratio[:SINGLES], P[:SINGLES], strict=True):
        po.length_given_pressure(po.Rod.from_ratio(float(r)), float(p))


def against_single_calls() -> list[Figure]:
    """Of one process: rods never seen before, the tip within y0 and beyond."""
    found = []
    for words, low, high in (("within y0", 0.5, 0.99), ("beyond y0", 0.36, 0.499)):
        ratio, P = questions(low, high)
        batch = partial(_answered, (ratio, P))
        together, alone = seconds(batch, partial(_one_by_one, ratio, P))
        each, single = together / COUNT, alone / SINGLES
        found += [
            Figure(f"(f) answers, {words}, each", 1e6 * each, "us"),
            Figure(f"(f) single call of a rod not seen before, {words}", 1e3 * single, "ms", 0.8),
            Figure("(f) that over a batch", single / each, "x"),
        ]
    return found


def without_an_answer() -> list[Figure]:
    """Of rods never seen before, below their least pressure: for the nearest each walks along its branch."""
    ratio = np.random.default_rng(5).uniform(0.5, 100.0, SINGLES)

    def refused() -> None:
        forget_branches()
        assert not po.answers(ratio=ratio, pressure_ratio=1e-6).certified.any()

    return [Figure("(f) answers, none at that pressure, each", 1e3 * seconds(refused)[0] / SINGLES, "ms")]


def on_two_processes() -> list[Figure]:
    """Certified answers a second."""
    ratio, P = questions(0.5, 0.99)
    parts = [(ratio, P)] * 8
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        pool.map(_answered, parts[:2], chunksize=1)
        began = time.perf_counter()
        certified = sum(pool.map(_answered, parts, chunksize=1))
        seconds = time.perf_counter() - began
    note = f"{certified} of {8 * COUNT} certified"
    return [Figure("(f) certified answers on two processes", certified / seconds, "/s", 50000.0, True, note)]


def studies() -> list[Figure]:
    """A sweep of 1000 rods at one pressure, and an uncertainty of 8192 samples, in this process."""
    axes = {"ratio": np.geomspace(1.0, 50.0, 1000), "pressure_ratio": np.array([0.3])}
    swept = partial(po.sweep, axes, workers=1)
    spread = partial(po.uncertainty, TAPE, SCATTER, pressure=60e3, samples=4096, indices=False, workers=1)
    a, b = seconds(swept, spread)
    return [
        Figure("(f) sweep of 1000 rods at one pressure, law (8)", a, "s", 0.2),
        Figure("(f) uncertainty of 8192 samples, law (8)", b, "s", 0.5),
    ]


def figures() -> list[Figure]:
    """All of this module."""
    return [*against_single_calls(), *without_an_answer(), *on_two_processes(), *studies()]


if __name__ == "__main__":
    for figure in figures():
        print(figure, flush=True)
