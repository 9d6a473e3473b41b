"""Unfolded states of many rods at once: layouts, stacks, Newton, errors; and what is left for single calls.

A question of the batch goes through the same hands as a single one: a start that is no answer, Newton,
an error and a certificate.  What it is an answer to is read off the solution.  Every state below belongs to
the rod's branch from T and not to another if the rod never bends back (Theta' >= 0, Theta <= 0), as it
does nowhere on it before the minimum pressure; the pressure falls as the tip turns up to there and rises
beyond.  Where any of this fails, or the error is too large, the question is left to the single call.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..base.threads import one_thread
from ..continuation.seeds import BEYOND, LEAVES, Rods, charts, share_of
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.groups import PI4
from ..model.labels import UNFOLDED
from ..model.rod import RATIOS
from ..residual.batch import Solved, solve
from ..residual.stack import TAIL, Stack, gradient
from .question import LENGTH, PRESSURE, RATIO, Asks

#: States that go through the machine together: their matrices stay in the cache.
CHUNK = 128

#: How often a mesh is refined where the error misses the tolerance.
REFINEMENTS = 2

#: Where the two folds in length begin, p/T0 there, and where the second of them has gone: eta/y0 below the
#: first has only middle states, above the last two kinds; between, three states may share a length.
CUSP, CUSP_PRESSURE, ONE_FOLD = 0.32105, 0.626, 0.343

#: How close to the cusp labels are left to the walk.
NEAR_CUSP = 2e-4

#: How far from its start a state may be, as a share of its scalars, and by how much a length must lie
#: beyond that of the minimum pressure for it to be sure that it does.
STRAYED, SURE = 0.25, 5e-3

#: What rounding may leave of an angle or a curvature that is zero.
NOISE = 1e-7


@dataclass(frozen=True, eq=False)
class Many:
    """One question of many states.

    Parameters
    ----------
    asks : Asks
    given : ndarray, shape (states, 2)
    law : CohesiveLaw or None
        None for "auto".
    state : str or None
    tol : float
    """

    asks: Asks
    given: np.ndarray
    law: CohesiveLaw | None
    state: str | None
    tol: float

    @property
    def ratio(self) -> np.ndarray:
        """eta/y0; not a number, or infinite, where there is none."""
        first, second = self.given.T
        with np.errstate(all="ignore"):
            return first if self.asks.held is RATIO else (PI4 + second) / first**4

    @property
    def kinds(self) -> tuple[str, str]:
        """Of the closures."""
        return self.asks.held.kind, self.asks.given.kind

    @property
    def is_linear(self) -> bool:
        """Whether the bond pushes beyond y0."""
        return self.law is not None and self.law.is_linear

    @property
    def sigma(self) -> np.ndarray:
        """sbar/eta, where it is given."""
        return self.given[:, 1 if self.asks.given is LENGTH else 0]

    def taken(self) -> np.ndarray:
        """Which of the questions the batch may take on."""
        law = COHESIVE if self.law is None else self.law
        if not law.falls_straight or self.state not in (None, "unfolded", *UNFOLDED):
            return np.zeros(len(self.given), bool)
        ratio = self.ratio
        with np.errstate(invalid="ignore"):
            fine: np.ndarray = (
                np.isfinite(self.given).all(axis=1) & (ratio >= RATIOS[0]) & (ratio <= RATIOS[1])
            )
            fine &= np.abs(ratio - CUSP) > NEAR_CUSP
            if self.asks.given is PRESSURE:
                P = self.given[:, 1]
                return fine & (P > 0.0) & (P < 1.0) & ((not law.is_linear) | (ratio < LEAVES) | (P >= 0.5))
            return fine & (self.sigma > 0.0) & ((ratio < CUSP) | (ratio > ONE_FOLD))

    def of(self, rows: np.ndarray) -> Many:
        """Some of the questions."""
        return Many(self.asks, self.given[rows], self.law, self.state, self.tol)


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
def find(question: Many) -> FoundTogether:
    """Answer those questions of many that can be answered together."""
    count = len(question.given)
    found = FoundTogether(
        np.zeros(count, bool), {name: np.full(count, math.nan) for name in NUMBERS}, np.full(count, "", "U8")
    )
    rows = np.flatnonzero(question.taken())
    for begin in range(0, len(rows), CHUNK):
        here = rows[begin : begin + CHUNK]
        for among, stack, start, sure in _starts(question.of(here)):
            _answer(question, here[among], stack, start, sure, found)
    return found


def _starts(question: Many) -> Iterator[tuple[np.ndarray, Stack, np.ndarray, np.ndarray]]:
    """Yield questions of one layout each: which of them, their stack, starts, and which are sure.

    Sure are those of which a label "middle" leaves no doubt that there is no lower state.
    """
    whole = question.ratio < LEAVES
    open_ones = ("within",) if question.is_linear else ("within", "beyond")
    groups = {("whole",): np.flatnonzero(whole), open_ones: np.flatnonzero(~whole)}
    for names, rows in groups.items():
        if not rows.size:
            continue
        mine = question.of(rows)
        on = {name: charts()[name].rods(mine.ratio) for name in names}
        if "pressure" in question.kinds:
            yield from _at_pressure(mine, rows, on)
        else:
            yield from _at_length(mine, rows, on)


Starts = Iterator[tuple[np.ndarray, Stack, np.ndarray, np.ndarray]]


def _at_pressure(question: Many, rows: np.ndarray, on: dict[str, Rods]) -> Starts:
    P = question.given[:, 1]
    for name, rods in on.items():
        here = {"whole": P > 0.0, "within": P >= 0.5, "beyond": P < 0.5}[name]
        share = share_of(rods.along()[0], np.log(P) if name == "beyond" else 1.0 - P)
        mine = np.flatnonzero(here & np.isfinite(share))
        if mine.size:
            yield rows[mine], rods.chart.stack, rods.of(mine).starts(share[mine]), np.ones(len(mine), bool)


def _at_length(question: Many, rows: np.ndarray, on: dict[str, Rods]) -> Starts:
    """The state of lowest pressure: the last on the way, the first if it is to be a middle one."""
    lengths = {name: rods.along()[1] for name, rods in on.items()}
    sought = np.log(question.sigma)
    last = question.state != "middle"
    left = np.ones(len(rows), bool)
    least = list(lengths.values())[-1][:, -1]
    order = list(reversed(on) if last else on)
    # Only what is on no chart may lie a little beyond the end of one.
    for name, beyond in [*((name, 0.0) for name in order), *((name, BEYOND) for name in order)]:
        share = share_of(lengths[name], sought, last=last, beyond=beyond)
        mine = np.flatnonzero(left & np.isfinite(share))
        left[mine] = False
        if mine.size:
            rods = on[name].of(mine)
            sure = (sought[mine] > least[mine] + SURE) if last else np.ones(len(mine), bool)
            yield rows[mine], rods.chart.stack, rods.starts(share[mine]), sure


def _answer(
    question: Many, rows: np.ndarray, stack: Stack, start: np.ndarray, sure: np.ndarray, found: FoundTogether
) -> None:
    """Solve questions of one layout, and write down those that are certified."""
    law = COHESIVE if question.law is None else question.law
    read = question.asks.asked.read
    for refinement in range(REFINEMENTS + 1):
        solved = solve(stack, question.kinds, question.given[rows], start)
        strayed = np.abs(solved.x[:, TAIL] - start[:, TAIL]) > STRAYED * (1.0 + np.abs(start[:, TAIL]))
        kept = np.flatnonzero(solved.converged & ~strayed.any(axis=1))
        solved, rows, sure = solved.of(kept), rows[kept], sure[kept]
        labels = _labels(question, solved, sure)
        kept = np.flatnonzero(labels != "")
        solved, rows, sure, labels = solved.of(kept), rows[kept], sure[kept], labels[kept]
        if not rows.size:
            return
        errors, certificates = solved.errors(read), solved.certificates(law)
        good = (errors <= question.tol) & (certificates <= question.tol)
        s, (_, _, height) = solved.scalars, stack.shapes(solved.x)
        by_given = (gradient(read, solved.x)[:, :, None] * solved.response()).sum(axis=1)
        asked = [k for k, kind in enumerate(question.kinds) if kind != "ratio"]
        condition = np.abs(by_given[:, asked]).max(axis=1)
        columns = (s.A, s.m, s.sigma, s.lam, height, errors, certificates, condition)
        for name, column in zip(NUMBERS, columns, strict=True):
            found.numbers[name][rows[good]] = column[good]
        found.states[rows[good]], found.certified[rows[good]] = labels[good], True
        if good.all() or refinement == REFINEMENTS:
            return
        rows, sure, start = rows[~good], sure[~good], stack.prolonged(solved.x[~good])
        stack = stack.finer


def _labels(question: Many, solved: Solved, sure: np.ndarray) -> np.ndarray:
    """Name each state by what it is; leave empty what is not surely the unfolded one that is meant."""
    s, stack = solved.scalars, solved.stack
    Theta, K, height = stack.shapes(solved.x)
    bound = NOISE * np.abs(K).max(axis=1, initial=0.0)
    belongs = (Theta.max(axis=1, initial=-1.0) <= NOISE) & (K.min(axis=1, initial=0.0) >= -bound)
    belongs &= (s.A > 0.0) & (np.abs(s.A) < math.pi)
    share = stack.shares(solved.x)
    belongs &= (height >= 1.0) & (share > 0.0) & (share < 1.0) if stack.free else height <= 1.0
    ratio = s.ratio
    along = solved.response()
    change = along[:, :, 1]
    if question.asks.held is not RATIO:  # along the branch of the rod, sigma and lambda both change
        change = along[:, :, 0] + along[:, :, 1] * (4.0 * ratio * s.sigma**3)[:, None]
    dA, dm, dsigma, _ = change.T
    turned = np.sign(dA)
    belongs &= turned * ((dm * s.A + s.m * dA) * s.sigma - 3.0 * s.alpha1 * dsigma) < 0.0  # P falls
    lower = (turned * dsigma > 0.0) | ((ratio > CUSP) & (s.pressure_ratio < CUSP_PRESSURE))
    labels = np.where(lower, "lower", "middle")
    if "length" in question.kinds and question.state != "middle":
        # Of a lower state there is only one, which is that of lowest pressure.
        belongs &= lower | (ratio < CUSP) | sure
        if question.is_linear:
            belongs &= lower | (ratio < LEAVES)
    if question.state in UNFOLDED:
        belongs &= labels == question.state
    return np.where(belongs, labels, "")
