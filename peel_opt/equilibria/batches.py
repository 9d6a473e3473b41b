"""Unfolded states of many rods at once: layouts, stacks, Newton, errors.

A question of the batch goes through the same hands as a single one: a start that is no answer, Newton,
an error and a certificate.  Where anything fails, or the error is too large on the finest mesh, it is left
to the single call.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.threads import one_thread
from ..model.bond import COHESIVE
from ..model.labels import UNFOLDED
from ..residual.batch import CHUNK, Solved, solve
from ..residual.stack import TAIL, gradient
from .unfolded import Many, Start, Traits, labelled, on_charts, starts, strayed, unbent

#: How often a mesh is refined where the error misses the tolerance.
REFINEMENTS = 2

#: The numbers of a state, in the order of the rows of `FoundTogether.numbers`.
NUMBERS = ("A", "m", "sigma", "lam", "height", "error", "certificate", "condition")


@dataclass(frozen=True, eq=False)
class FoundTogether:
    """What the batch has found: where it is certified, the numbers of the states and their labels.

    Parameters
    ----------
    certified : ndarray of bool, shape (states,)
    numbers : dict of str to ndarray
        `NUMBERS`; nan where nothing is certified.
    states : ndarray of str
    """

    certified: np.ndarray
    numbers: dict[str, np.ndarray]
    states: np.ndarray


@one_thread
def find(question: Many, tol: float) -> FoundTogether:
    """Answer those questions of many that can be answered together, to a tolerance."""
    count = len(question.held)
    found = FoundTogether(
        np.zeros(count, bool), {name: np.full(count, math.nan) for name in NUMBERS}, np.full(count, "", "U8")
    )
    rows = np.flatnonzero(question.taken())
    for names, have_them in on_charts(question.of(rows)):
        alike = np.flatnonzero(have_them)
        for begin in range(0, len(alike), CHUNK):
            here = rows[alike[begin : begin + CHUNK]]
            for start in starts(question.of(here), names):
                own = Start(here[start.rows], start.stack, start.x, start.sure)
                _answer(question, own, tol, found)
    return found


def _answer(question: Many, start: Start, tol: float, found: FoundTogether) -> None:
    """Solve questions of one layout, and write down those that are certified."""
    law, read = COHESIVE if question.law is None else question.law, question.asks.asked.read
    given = question.given
    for _ in range(REFINEMENTS + 1):
        solved = solve(start.stack, question.kinds, given[start.rows], start.x)
        kept = np.flatnonzero(solved.converged & ~strayed(solved.x[:, TAIL], start.x[:, TAIL]))
        solved, start = solved.of(kept), start.of(kept)
        if not kept.size:
            return
        belongs, lower = labelled(question, _traits(solved), start.sure)
        kept = np.flatnonzero(belongs)
        solved, start, named = solved.of(kept), start.of(kept), np.where(lower, *UNFOLDED[::-1])[kept]
        if not kept.size:
            return
        errors, certificates = solved.errors(read), solved.certificates(law)
        good = (errors <= tol) & (certificates <= tol)
        done = start.rows[good]
        by_given = (gradient(read, solved.x)[:, :, None] * solved.response).sum(axis=1)
        asked = [k for k, kind in enumerate(question.kinds) if kind != "ratio"]
        condition = np.abs(by_given[:, asked]).max(axis=1)
        columns = (*solved.x[:, TAIL].T, solved.shapes[2], errors, certificates, condition)
        for name, column in zip(NUMBERS, columns, strict=True):
            found.numbers[name][done] = column[good]
        found.states[done], found.certified[done] = named[good], True
        if good.all():
            return
        finer, there = start.stack.finer, start.stack.prolonged(solved.x[~good])
        start = Start(start.rows[~good], finer, there, start.sure[~good])


def _traits(solved: Solved) -> Traits:
    Theta, K, height = solved.shapes
    by_held, by_number = np.moveaxis(solved.response, 2, 0)
    free = solved.stack.shares(solved.x) if solved.stack.free else None
    return Traits(unbent(Theta, K), height, free, solved.scalars, by_held.T, by_number.T)
