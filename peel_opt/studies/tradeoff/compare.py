"""Every method on the same questions: who answers, who refuses, and whether all say the same."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

from ...equilibria.result import Equilibrium
from ...model.labels import CERTIFIED

#: The rungs of the ladder, and what climbs it.
METHODS = ("series", "spectral", "collocation", "shooting", "auto")


@dataclass(frozen=True)
class Attempt:
    """One method on one question; NaN where there is no answer.

    Parameters
    ----------
    method : str
        As asked for.
    status : str
        "certified", or the short name of the error that was raised.
    used : str
        What it was answered with at last.
    answer, error : float
    seconds : float
        Of the second of two calls, when everything on the way is known.
    unknowns : float
        Of the finest mesh.
    condition : float
    beta1 : float
    message : str
    """

    method: str
    status: str
    used: str = ""
    answer: float = math.nan
    error: float = math.nan
    seconds: float = math.nan
    unknowns: float = math.nan
    condition: float = math.nan
    beta1: float = math.nan
    message: str = ""

    @property
    def certified(self) -> bool:
        """Whether there is an answer."""
        return self.status == CERTIFIED


@dataclass(frozen=True)
class Compared:
    """What the methods made of one question.

    Parameters
    ----------
    x, y : float
        Where the question lies in the plane that is scanned.
    attempts : tuple of Attempt
    """

    x: float
    y: float
    attempts: tuple[Attempt, ...]

    def by(self, method: str) -> Attempt:
        """Return what one method made of it."""
        return next(attempt for attempt in self.attempts if attempt.method == method)

    @property
    def contradictions(self) -> list[tuple[Attempt, Attempt]]:
        """Certified answers further apart than their errors: none, or somebody is wrong."""
        found = combinations((a for a in self.attempts if a.certified), 2)
        return [(a, b) for a, b in found if abs(a.answer - b.answer) > a.error + b.error]


def compare(
    ask: Callable[..., Equilibrium], x: float, y: float, methods: Sequence[str] = METHODS
) -> Compared:
    """Put one question to all methods.

    Parameters
    ----------
    ask : callable
        Takes ``method`` and ``throw`` and returns an `Equilibrium`.
    x, y : float
        Kept with the result.
    methods : sequence of str
    """
    return Compared(x, y, tuple(_attempt(ask, method) for method in methods))


def _attempt(ask: Callable[..., Equilibrium], method: str) -> Attempt:
    eq = ask(method=method, throw=False)
    if not eq.certified:
        return Attempt(method, eq.status, message=eq.message)
    began = time.perf_counter()
    ask(method=method, throw=False)
    seconds = time.perf_counter() - began
    return Attempt(
        method,
        eq.status,
        used=eq.stats.method,
        answer=eq.answer,
        error=eq.error,
        seconds=seconds,
        unknowns=float(eq.stats.unknowns),
        condition=eq.stats.condition,
        beta1=eq.beta1,
    )
