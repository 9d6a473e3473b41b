"""Work against precision: what each method takes and what it gives, on one question.

Every method is warmed up, timed several times and held against one reference; a method that
fails keeps its row, with the reason.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from inspect import signature
from itertools import product
from statistics import median
from typing import Any, Protocol

from ...base.checks import listed, positive, whole
from ...base.errors import InvalidInput, NotConverged, PeelOptError
from ...base.progress import Progress
from ...base.progress import progress as progressing
from ...equilibria.methods import Method, as_method
from ...equilibria.result import Equilibrium
from ...residual.discretisation import Transcription
from ...residual.meshes import REFERENCE
from .peers import BvpPeer
from .table import Work, WorkPrecision

#: Name under which SciPy's solver takes part.
PEER = "solve_bvp"


class Poses(Protocol):
    """Something that holds one question, a card say, and makes a call of it."""

    def pose(self) -> Callable[..., Equilibrium]:
        """Return a call that takes ``method`` and ``tol``."""


def tradeoff(
    problem: Callable[..., Equilibrium] | Poses,
    methods: Sequence[str | Method | Transcription] = ("series", "spectral", "collocation", "shooting", PEER),
    tols: Sequence[float] = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11),
    *,
    repeats: int = 5,
    clock: Callable[[], float] = time.perf_counter,
    progress: Progress = None,
) -> WorkPrecision:
    """Measure what methods take and give on one question.

    Parameters
    ----------
    problem : callable or Card
        Takes ``method`` and ``tol`` and returns an `Equilibrium`, such as
        ``functools.partial(length_given_pressure, rod, 0.2)``, or a card with one question.
    methods : sequence
        Anything ``method=`` takes, and "solve_bvp": SciPy's solver with the Jacobian by hand,
        started from the state the others are started from.  Like the series it knows the paper's scene only.
    tols : sequence of float
    repeats : int
        Timed calls, after one that is not.
    clock : callable
        Seconds, for tests.
    progress : None, bool or callable
        By default a bar on stderr after a second, if that is a terminal; False for none; or a
        function that is called with the number of runs done and of all.

    Returns
    -------
    WorkPrecision

    Raises
    ------
    InvalidInput
        If a card has not exactly one question, there is no such method, or nothing is to be
        measured.
    PeelOptError
        Whatever the reference solve raises: without one there is nothing to compare.
    """
    ask = _question(problem)
    repeats = whole("repeats", repeats, 1)
    methods, tols = listed("methods", methods), [positive("tol", tol) for tol in listed("tols", tols)]
    if not methods or not tols:
        raise InvalidInput("give at least one method and one tolerance.")
    for method in methods:
        if method != PEER:
            as_method(method)
    reference = ask(method=REFERENCE, tol=1e-2)
    if not isinstance(reference, Equilibrium):
        raise InvalidInput(f"a problem returns an Equilibrium, got {reference!r:.60}.")
    if not reference.certified:
        raise NotConverged(
            f"there is no reference to compare with: {reference.message or reference!r:.200}",
            remedy="Ask something that method='spectral' answers.",
        )
    known = reference.scene is None and reference.law in ("linear", "cohesive")
    peer = BvpPeer.of(reference) if PEER in methods and known else None
    rows = []
    with progressing("run", len(methods) * len(tols), progress) as step:
        for method, tol in product(methods, tols):
            run = _peer_run(peer, tol) if method == PEER else _own_run(ask, method, tol)
            rows.append(_measured(run, str(method), tol, reference.answer, repeats, clock))
            step()
    return WorkPrecision(tuple(rows), reference.answered, reference.answer, reference.error)


#: The answer and everything of a row that is not measured from outside.
_Outcome = tuple[float, dict[str, Any]]


def _question(problem: Callable[..., Equilibrium] | Poses) -> Callable[..., Equilibrium]:
    if callable(problem):
        try:
            signature(problem).bind(method="auto", tol=1e-8)
        except TypeError as error:
            raise InvalidInput(
                f"a problem is called with method and tol: {error}.",
                remedy="For instance functools.partial(length_given_pressure, rod, 60e3).",
            ) from error
        except ValueError:
            pass  # some calls do not say what they take
        return problem
    pose = getattr(problem, "pose", None)
    if pose is None:
        raise InvalidInput(f"a problem is a Card or a call that takes method and tol, got {problem!r:.60}.")
    posed: Callable[..., Equilibrium] = pose()
    return posed


def _own_run(
    ask: Callable[..., Equilibrium], method: str | Method | Transcription, tol: float
) -> Callable[[], _Outcome]:
    def run() -> _Outcome:
        eq = ask(method=method, tol=tol)
        return eq.answer, {
            "iterations": float(eq.stats.iterations),
            "unknowns": float(eq.stats.unknowns),
            "evaluations": float(eq.stats.evaluations),
            "error": eq.error,
            "status": eq.status,
        }

    return run


def _peer_run(peer: BvpPeer | None, tol: float) -> Callable[[], _Outcome]:
    def run() -> _Outcome:
        if peer is None:
            raise InvalidInput("it knows the paper's scene under the linear law and law (8) only.")
        found = peer.solve(tol)
        return found.answer, {
            "iterations": float(found.iterations),
            "unknowns": float(found.unknowns),
            "evaluations": float(found.evaluations),
            "status": "solved",
        }

    return run


def _measured(
    run: Callable[[], _Outcome],
    method: str,
    tol: float,
    reference: float,
    repeats: int,
    clock: Callable[[], float],
) -> Work:
    try:
        answer, numbers = run()
        seconds = []
        for _ in range(repeats):
            began = clock()
            run()
            seconds.append(clock() - began)
    except PeelOptError as error:
        return Work(method, tol, status=f"{error.status}: {error}")
    return Work(method, tol, median(seconds), true_error=abs(answer - reference), **numbers)
