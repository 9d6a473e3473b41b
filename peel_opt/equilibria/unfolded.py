"""Unfolded states: where a question has its start, and what tells that the state reached is the one meant.

A start is no answer.  What has been reached is read off the solution.  It belongs to the rod's branch
from T and not to another if the rod never bends back (Theta' >= 0, Theta <= 0), as it does nowhere on it
before the minimum pressure; the pressure falls as the tip turns up to there and rises beyond.  A state
that fails any of this is none that is meant, and is left to the walk along the branch.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..base.threads import one_thread
from ..continuation.seeds import BEYOND, LEAVES, Rods, charts, share_of
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.equations import Scalars
from ..model.groups import PI4
from ..model.labels import UNFOLDED
from ..model.rod import RATIOS
from ..residual.discretisation import Profile
from ..residual.meshes import PATH
from ..residual.newton import SolvedState, correct
from ..residual.stack import TAIL, Stack
from .question import LENGTH, PRESSURE, RATIO, Asks, Question

#: Where the two folds in length begin, p/T0 there, and where the second of them has gone: eta/y0 below the
#: first has only middle states, above the last two kinds; between, three states may share a length.
CUSP, CUSP_PRESSURE, ONE_FOLD = 0.32105, 0.626, 0.343

#: How close to the cusp labels are left to the walk.
NEAR_CUSP = 2e-4

#: How far from its start a state may be, as a share of its scalars, and by how much a length must lie
#: beyond that of the minimum pressure for it to be sure that it does.
STRAYED, SURE = 0.25, 5e-3

#: Updates from a seed below this size leave the Jacobian as it is: the state is near.
NEARBY = 3e-3

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
    """

    asks: Asks
    given: np.ndarray
    law: CohesiveLaw | None
    state: str | None

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
        return Many(self.asks, self.given[rows], self.law, self.state)


def on_charts(question: Many) -> Iterator[tuple[tuple[str, ...], np.ndarray]]:
    """Yield which questions have their states on which charts of seeds."""
    whole = question.ratio < LEAVES
    yield ("whole",), np.flatnonzero(whole)
    if "pressure" in question.kinds:
        within = question.given[:, 1] >= 0.5  # the height of the tip is known: p y = Phi(y)
        yield ("within",), np.flatnonzero(~whole & within)
        yield ("beyond",), np.flatnonzero(~whole & ~within)
    else:
        yield ("within",) if question.is_linear else ("within", "beyond"), np.flatnonzero(~whole)


class Start(NamedTuple):
    """Starts of some questions, of one layout.

    Parameters
    ----------
    rows : ndarray
        Which of the questions.
    stack : Stack
    x : ndarray, shape (rows, unknowns)
    sure : ndarray of bool, shape (rows,)
        Where a label "middle" would leave no doubt that there is no lower state.
    """

    rows: np.ndarray
    stack: Stack
    x: np.ndarray
    sure: np.ndarray

    def of(self, kept: np.ndarray) -> Start:
        """Some of them."""
        return Start(self.rows[kept], self.stack, self.x[kept], self.sure[kept])


def starts(question: Many, names: tuple[str, ...]) -> Iterator[Start]:
    """Yield the starts of questions that have their states on these charts."""
    on = {name: charts()[name].rods(question.ratio) for name in names}
    return _at_pressure(question, *on.items()) if "pressure" in question.kinds else _at_length(question, on)


def _at_pressure(question: Many, chart: tuple[str, Rods]) -> Iterator[Start]:
    name, rods = chart
    P = question.given[:, 1]
    share = share_of(rods.along[0], np.log(P) if name == "beyond" else 1.0 - P)
    mine = np.flatnonzero(np.isfinite(share))
    if mine.size:
        yield Start(mine, rods.chart.stack, rods.of(mine).starts(share[mine]), np.ones(len(mine), bool))


def _at_length(question: Many, on: dict[str, Rods]) -> Iterator[Start]:
    """The state of lowest pressure: the last on the way, the first if it is to be a middle one."""
    lengths = {name: rods.along[1] for name, rods in on.items()}
    sought = np.log(question.sigma)
    last = question.state != "middle"
    left = np.ones(len(sought), bool)
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
            yield Start(mine, rods.chart.stack, rods.starts(share[mine]), sure)


@dataclass(frozen=True, eq=False)
class Traits:
    """What tells a state by itself.

    Parameters
    ----------
    Theta, K : ndarray, shape (states, points)
        Anywhere on the rod.
    height : ndarray, shape (states,)
        u = y/y0 of the tip.
    share : ndarray, shape (states, 0 or 1)
        Of the length that is a free arc, if there is to be one.
    tail : ndarray, shape (states, 4)
        The scalars.
    along : ndarray, shape (states, 4, 2)
        Their derivatives by the given numbers.
    """

    Theta: np.ndarray
    K: np.ndarray
    height: np.ndarray
    share: np.ndarray
    tail: np.ndarray
    along: np.ndarray


def strayed(tail: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Whether the scalars of states, shape (states, 4), are far from those of their starts."""
    begun = start[:, TAIL]
    far: np.ndarray = (np.abs(tail - begun) > STRAYED * (1.0 + np.abs(begun))).any(axis=1)
    return far


def labels(question: Many, seen: Traits, sure: np.ndarray) -> np.ndarray:
    """Name each state by what it is; leave empty what is not surely the unfolded one that is meant.

    Parameters
    ----------
    question : Many
    seen : Traits
    sure : ndarray of bool
        As in `Start`.
    """
    s = Scalars(*seen.tail.T)
    bound = NOISE * np.abs(seen.K).max(axis=1)
    belongs = (seen.Theta.max(axis=1) <= NOISE) & (seen.K.min(axis=1) >= -bound)
    belongs &= (s.A > 0.0) & (np.abs(s.A) < math.pi)
    if seen.share.shape[1]:
        belongs &= (seen.height >= 1.0) & ((seen.share > 0.0) & (seen.share < 1.0)).all(axis=1)
    else:
        belongs &= seen.height <= 1.0
    ratio, change = s.ratio, seen.along[:, :, 1]
    if question.asks.held is not RATIO:  # along the branch of the rod, sigma and lambda both change
        change = seen.along[:, :, 0] + change * (4.0 * ratio * s.sigma**3)[:, None]
    dA, dm, dsigma, _ = change.T
    turned = np.sign(dA)
    belongs &= turned * ((dm * s.A + s.m * dA) * s.sigma - 3.0 * s.alpha1 * dsigma) < 0.0  # P falls
    lower = (turned * dsigma > 0.0) | ((ratio > CUSP) & (s.pressure_ratio < CUSP_PRESSURE))
    named = np.where(lower, "lower", "middle")
    if "length" in question.kinds and question.state != "middle":
        # Of a lower state there is only one, which is that of lowest pressure.
        belongs &= lower | (ratio < CUSP) | sure
        if question.is_linear:
            belongs &= lower | (ratio < LEAVES)
    if question.state in UNFOLDED:
        belongs &= named == question.state
    return np.where(belongs, named, "")


@dataclass(frozen=True)
class Seeded:
    """A state that was reached from a seed, with its label."""

    solution: SolvedState
    state: str

    @property
    def profile(self) -> Profile:
        """The solution, sampled."""
        return self.solution.profile


@one_thread
def seeded(question: Question) -> tuple[Seeded, float, int] | None:
    """Return what `select` does of the state that a question means; None where a walk has to tell.

    It takes no walk, and says nothing of other states.  Whether it finds the state does not depend on what
    was asked before.
    """
    given = np.array([[closure.value for closure in question.given]])
    many = Many(question.asks, given, question.law, question.state)
    if question.near is not None or not many.taken()[0]:
        return None
    for names, rows in on_charts(many):
        if not rows.size:
            continue
        for start in starts(many, names):
            problem = PATH.discretise(start.stack.phases)
            found = correct(problem, start.stack.spread(start.x)[0], question.given, chord=NEARBY)
            if not found.converged or strayed(found.x[None, TAIL], start.x)[0]:
                return None
            solution = SolvedState(problem, found, question.given)
            fields = solution.profile.values
            seen = Traits(
                Theta=fields[:, :, 0].reshape(1, -1),
                K=fields[:, :, 1].reshape(1, -1),
                height=solution.profile.heights()[:1, 0],
                share=problem.lengths(found.x)[None, :-1],
                tail=found.x[None, TAIL],
                along=solution.linearised.response()[None, TAIL],
            )
            label = labels(many, seen, start.sure)[0]
            return (Seeded(solution, str(label)), math.inf, 0) if label else None
    return None
