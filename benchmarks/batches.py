"""Many answers: the diagram of one beta0, and a batch of random rods on two processes."""

from __future__ import annotations

import multiprocessing
import time
from functools import partial

import numpy as np

import peel_opt as po
from peel_opt.studies.tradeoff.peers import BvpPeer
from peel_opt.studies.tradeoff.run import REFERENCE

from .figures import Figure, alternating
from .single_answers import ACCURACY, kernel_start, peer_at, peer_from

#: Answers in the batch.
COUNT = 4000


def diagram() -> list[Figure]:
    """The beta0 = 4 diagram in one call, over a solve_bvp solve."""
    reference = po.equilibrium(beta0=4.0, lam=1.0, method=REFERENCE, tol=1e-4)
    peer: BvpPeer = peer_from(kernel_start(4.0, 1.0), reference)
    tol, _ = peer_at(peer, reference.answer, ACCURACY)
    call = partial(po.trace, beta0=4.0, lam=(-3.0, 3.0))
    branch = call()
    kinds = sorted({point.kind for point in branch.special_points})
    whole, single = alternating(call, lambda: peer.solve(tol), repeats=9)
    note = f"{len(branch.lam)} points, error <= {np.max(branch.error):.0e}, {', '.join(kinds)}"
    return [
        Figure("(b) trace(beta0=4, lam=(-3, 3))", whole, "ms", 6.0, note=note),
        Figure("(b) its points", len(branch.lam), "", 125.0, True),
        Figure("(b) in solve_bvp solves", whole / single, "", 0.7, note=f"one takes {single:.2f} ms"),
    ]


def _answer(question: tuple[float, float]) -> bool:
    ratio, P = question
    return po.length_given_pressure(po.Rod.from_ratio(ratio), P, tol=1e-8).certified


def batch() -> list[Figure]:
    """Random (r, P), r in [0.5, 100] and P in [0.5, 0.99], one call each, on two processes."""
    rng = np.random.default_rng(5)
    questions = list(zip(rng.uniform(0.5, 100.0, COUNT), rng.uniform(0.5, 0.99, COUNT), strict=True))
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        pool.map(_answer, questions[:200], chunksize=50)
        began = time.perf_counter()
        certified = sum(pool.map(_answer, questions, chunksize=100))
        seconds = time.perf_counter() - began
    note = f"{certified} of {COUNT} certified"
    return [Figure("(d) single calls on two processes", certified / seconds, "/s", 10000.0, True, note)]


def figures() -> list[Figure]:
    """All of this module."""
    return [*diagram(), *batch()]
