"""One figure: what is asked, what was measured, and whether it is met."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any


@dataclass(frozen=True)
class Figure:
    """A measured number beside the one asked for.

    Parameters
    ----------
    name : str
    measured : float
    unit : str
    asked : float or None
        None where a figure is reported only.
    at_least : bool
        Whether more is better.
    note : str
        What it was measured against.
    """

    name: str
    measured: float
    unit: str
    asked: float | None = None
    at_least: bool = False
    note: str = ""

    @property
    def met(self) -> bool:
        """Whether the figure is as asked, or nothing was."""
        if self.asked is None:
            return True
        return self.measured >= self.asked if self.at_least else self.measured <= self.asked

    def __str__(self) -> str:
        sign = ">=" if self.at_least else "<="
        asked = "" if self.asked is None else f"{sign} {self.asked:g} {self.unit}"
        verdict = "" if self.asked is None else ("met" if self.met else "FALLS SHORT")
        return f"{self.name:<66}{self.measured:>10.4g} {self.unit:<6}{asked:>16}  {verdict:<12}{self.note}"


def milliseconds(call: Callable[[], Any], repeats: int = 25) -> float:
    """Median time of a call, after a warm-up."""
    call()
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - began)
    return 1e3 * median(seconds)


def alternating(*calls: Callable[[], Any], repeats: int = 25) -> list[float]:
    """Median milliseconds of calls that take turns, so that a busy moment slows all of them.

    At each turn a call runs twice and the second time counts: the others emptied the caches.
    """
    seconds: list[list[float]] = [[] for _ in calls]
    for _ in range(repeats):
        for own, call in zip(seconds, calls, strict=True):
            call()
            began = time.perf_counter()
            call()
            own.append(time.perf_counter() - began)
    return [1e3 * median(own) for own in seconds]
