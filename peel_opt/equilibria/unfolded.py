"""Unfolded states: where a question has its start, and what tells that the state reached is the one meant.

A start is no answer.  What has been reached is read off the solution.  It belongs to the rod's branch
from T and not to another if the rod never bends back (Theta' >= 0, Theta <= 0), as it does nowhere on it
before the minimum pressure; the pressure falls as the tip turns up to there and rises beyond.  A state
that fails any of this is none that is meant, and is left to the walk along the branch.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..base.threads import one_thread
from ..continuation.seeds import BEYOND, LEAVES, Rods, charts, share_of
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.equations import Scalars
from ..model.groups import PI4, over
from ..model.labels import UNFOLDED
from ..model.rod import RATIOS
from ..residual.discretisation import Profile
from ..residual.meshes import SEEDED
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
    """One question of many states, or of one: its numbers are arrays, or floats.

    Parameters
    ----------
    asks : Asks
    held, number : float or ndarray, shape (states,)
        What is given besides, eta/y0 or beta0^(1/3), and the given number.
    law : CohesiveLaw or None
        None for "auto".
    state : str or None
    """

    asks: Asks
    held: Any
    number: Any
    law: CohesiveLaw | None
    state: str | None

    @property
    def given(self) -> np.ndarray:
        """Both numbers, shape (states, 2)."""
        return np.stack([self.held, self.number], axis=-1)

    @cached_property
    def ratio(self) -> Any:
        """eta/y0; not a number, or infinite, where there is none."""
        if self.asks.held is RATIO:
            return self.held
        with np.errstate(all="ignore"):
            return over(PI4 + self.number, self.held**4, math.inf)

    @property
    def kinds(self) -> tuple[str, str]:
        """Of the closures."""
        return self.asks.held.kind, self.asks.given.kind

    @property
    def is_linear(self) -> bool:
        """Whether the bond pushes beyond y0."""
        return self.law is not None and self.law.is_linear

    @property
    def sigma(self) -> Any:
        """sbar/eta, where it is given."""
        return self.number if self.asks.given is LENGTH else self.held

    def taken(self) -> Any:
        """Which of the questions are about states that seeds lead to."""
        law, ratio = COHESIVE if self.law is None else self.law, self.ratio
        if not law.falls_straight or self.state not in (None, "unfolded", *UNFOLDED):
            return np.zeros(np.shape(ratio), bool)
        with np.errstate(invalid="ignore"):
            fine = (ratio >= RATIOS[0]) & (ratio <= RATIOS[1]) & (abs(ratio - CUSP) > NEAR_CUSP)
            if self.asks.given is PRESSURE:
                P = self.number
                return fine & (P > 0.0) & (P < 1.0) & ((not law.is_linear) | (ratio < LEAVES) | (P >= 0.5))
            fine = fine & (self.sigma > 0.0) & (self.sigma < math.inf)
            return fine & ((ratio < CUSP) | (ratio > ONE_FOLD))

    def of(self, rows: np.ndarray) -> Many:
        """Some of the questions."""
        return Many(self.asks, self.held[rows], self.number[rows], self.law, self.state)


def on_charts(question: Many) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the charts of seeds on which questions have their states, and whether or which of them have."""
    ratio, P = question.ratio, question.number
    yield ("whole",), ratio < LEAVES
    if "pressure" in question.kinds:
        yield ("within",), (ratio >= LEAVES) & (P >= 0.5)  # the height of the tip is known: p y = Phi(y)
        yield ("beyond",), (ratio >= LEAVES) & (P < 0.5)
    else:
        yield ("within",) if question.is_linear else ("within", "beyond"), ratio >= LEAVES


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
    ratio = np.atleast_1d(question.ratio)
    on = {name: charts()[name].rods(ratio) for name in names}
    return _at_pressure(question, *on.items()) if "pressure" in question.kinds else _at_length(question, on)


def _at_pressure(question: Many, chart: tuple[str, Rods]) -> Iterator[Start]:
    name, rods = chart
    P = np.atleast_1d(question.number)
    share = share_of(rods.along[0], np.log(P) if name == "beyond" else 1.0 - P)
    mine = np.flatnonzero(np.isfinite(share))
    if mine.size:
        yield Start(mine, rods.chart.stack, rods.of(mine).starts(share[mine]), np.ones(len(mine), bool))


def _at_length(question: Many, on: dict[str, Rods]) -> Iterator[Start]:
    """The state of lowest pressure: the last on the way, the first if it is to be a middle one."""
    lengths = {name: rods.along[1] for name, rods in on.items()}
    sought = np.log(np.atleast_1d(question.sigma))
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


class Traits(NamedTuple):
    """What tells states, or one state, by themselves; arrays of shape (states,), or single numbers.

    Parameters
    ----------
    unbent : bool
        Whether the rod nowhere bends back.
    height : float
        u = y/y0 of the tip.
    free : float or None
        Share of the length that is a free arc; None where there is to be none.
    scalars : Scalars
    by_held, by_number : sequence of float
        Derivatives of the four scalars by what is given besides, and by the given number.
    """

    unbent: Any
    height: Any
    free: Any
    scalars: Scalars
    by_held: Sequence[Any]
    by_number: Sequence[Any]


def unbent(Theta: np.ndarray, K: np.ndarray) -> Any:
    """Whether rods nowhere bend back; Theta and Theta' at any points of each, along the last axis."""
    straight = NOISE * np.abs(K).max(axis=-1)
    return (Theta.max(axis=-1) <= NOISE) & (K.min(axis=-1) >= -straight)


def strayed(tail: np.ndarray, start: np.ndarray) -> Any:
    """Whether the scalars of states, shape (..., 4), are far from those of their starts."""
    return (np.abs(tail - start) > STRAYED * (1.0 + np.abs(start))).any(axis=-1)


def labelled(question: Many, seen: Traits, sure: Any) -> tuple[Any, Any]:
    """Whether a state is surely the unfolded one that is meant, and whether it is "lower" and not "middle".

    Parameters
    ----------
    question : Many
    seen : Traits
    sure : bool or ndarray of bool, shape (states,)
        As in `Start`.
    """
    s = seen.scalars
    belongs = seen.unbent & (s.A > 0.0) & (math.pi > s.A)
    if seen.free is None:
        belongs = belongs & (seen.height <= 1.0)
    else:
        belongs = belongs & (seen.height >= 1.0) & (seen.free > 0.0) & (seen.free < 1.0)
    ratio, change = s.ratio, seen.by_number
    if question.asks.held is not RATIO:  # along the branch of the rod, sigma and lambda both change
        share = 4.0 * ratio * s.sigma**3
        change = [a + b * share for a, b in zip(seen.by_held, change, strict=True)]
    dA, dm, dsigma, _ = change
    turned = 1.0 * (dA > 0.0) - 1.0 * (dA < 0.0)
    falls = turned * ((dm * s.A + s.m * dA) * s.sigma - 3.0 * s.alpha1 * dsigma) < 0.0  # P does
    belongs = belongs & falls
    lower = (turned * dsigma > 0.0) | ((ratio > CUSP) & (s.pressure_ratio < CUSP_PRESSURE))
    if "length" in question.kinds and question.state != "middle":
        # Of a lower state there is only one, which is that of lowest pressure.
        belongs = belongs & (lower | (ratio < CUSP) | sure)
        if question.is_linear:
            belongs = belongs & (lower | (ratio < LEAVES))
    if question.state in UNFOLDED:
        belongs = belongs & (lower == (question.state == "lower"))
    return belongs, lower


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
    held, number = question.given
    one = Many(question.asks, held.value, number.value, question.law, question.state)
    if question.near is not None or not one.taken():
        return None
    names = next(names for names, has_it in on_charts(one) if has_it)
    for start in starts(one, names):
        problem = SEEDED.discretise(start.stack.phases)
        found = correct(problem, start.x[0], question.given, chord=NEARBY)
        if not found.converged or strayed(found.x[TAIL], start.x[0, TAIL]):
            return None
        solution = SolvedState(problem, found, question.given)
        belongs, lower = labelled(one, _traits(solution), bool(start.sure[0]))
        return (Seeded(solution, "lower" if lower else "middle"), math.inf, 0) if belongs else None
    return None


def _traits(solution: SolvedState) -> Traits:
    profile, along = solution.profile, solution.linearised.scalars_by_given().T.tolist()
    Theta, K, *_ = profile.values.reshape(-1, profile.values.shape[-1]).T
    return Traits(
        unbent=bool(unbent(Theta, K)),
        height=profile.scalars.height(float(profile.values[0, 0, 4])),
        free=float(profile.lengths[0]) if len(profile.lengths) > 1 else None,
        scalars=profile.scalars,
        by_held=along[0],
        by_number=along[1],
    )
