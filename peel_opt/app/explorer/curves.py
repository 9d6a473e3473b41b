"""Curves of equilibria for the explorer: what a diagram draws, and its branch as traced at rest."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, replace
from functools import lru_cache

from ...base.errors import PeelOptError
from ...continuation.points import Point
from ...equilibria.branch import Branch
from ...equilibria.branch_parts import SpecialPoint
from ...equilibria.follow import follow
from ...equilibria.result import Equilibrium
from ...equilibria.trace import trace
from ...model.bond import COHESIVE, LINEAR, CohesiveLaw
from ...model.groups import PI4
from ...model.rod import Rod
from .state import State

#: Steps each way along a state's own branch.
_STEPS = 60

#: lambda_F/beta0^2 at small beta0: what the window of a diagram is measured in.
FOLD_SCALE = 0.0168

#: Least number of points and largest error of a traced curve, by accuracy; None is the quick walk.
TRACED: dict[str, tuple[int, float] | None] = {
    "sketch": None,
    "draft": (40, 1e-5),
    "standard": (56, 1e-8),
    "reference": (128, 1e-10),
}


@dataclass(frozen=True, eq=False)
class Curve:
    """A branch to draw, and what it comes from.

    Parameters
    ----------
    branch : Branch
        Traced, or between the points of a quick walk, ``ended`` being "" where that has more to come.
    method : str
    seconds : float
    walk : tuple of Point
        The solved states of a quick walk; empty where the branch was traced.
    """

    branch: Branch
    method: str
    seconds: float
    walk: tuple[Point, ...] = ()

    @property
    def error(self) -> float:
        """Largest distance from the exact branch, in the metric of the arclength.

        A quick walk's is estimated from above, by what leaving out one of its points changes.
        """
        return float(self.branch.error.max())

    @property
    def ended(self) -> str:
        """Why it stopped; "" where a quick walk has more to come."""
        return self.branch.ended

    def special(self, kind: str) -> SpecialPoint | None:
        """The first special point of a kind."""
        return next(iter(self.branch.special(kind)), None)


def law_of(state: State) -> CohesiveLaw:
    """Return the law to walk with."""
    return LINEAR if state.law == "linear" else COHESIVE


def window(beta0: float, lam: float | None = None) -> tuple[float, float]:
    """Return the window of lambda of a diagram: the paper's (-1, 3) at beta0 = 4, and ``lam`` in it."""
    scale = FOLD_SCALE * max(beta0, 1.5) ** 2
    low, high = max(-3.7 * scale, -0.98 * PI4), 11.2 * scale
    if lam is not None:
        low, high = max(min(low, lam - 0.5 * scale), -PI4), max(high, lam + 0.1 * abs(lam))
    return low, high


def traced(state: State) -> Curve | None:
    """Return the diagram of a state as traced; None at the accuracy of a sketch."""
    options = TRACED[state.accuracy]
    if options is None:
        return None
    if state.given == "groups":
        span = window(state.beta0, state.lam)
        return _traced("beta0", state.beta0, state.law, span, *options)
    known = _traced("ratio", state.effective_ratio, state.law, None, *options)
    return replace(known, branch=replace(known.branch, rod=state.rod))


def own_branch(state: State, eq: Equilibrium) -> tuple[Branch, ...]:
    """Follow the branch of a state both ways through the diagram, as far as that can be done."""
    low, high = window(state.beta0, state.lam)
    groups = state.given == "groups"
    found = []
    for direction in (1, -1):
        with contextlib.suppress(PeelOptError):
            found.append(
                follow(
                    eq,
                    hold="beta0" if groups else "ratio",
                    direction=direction,
                    steps=_STEPS,
                    until=(lambda s: not low <= s.lam <= high) if groups else None,
                    tol=1e-4,
                )
            )
    return tuple(found)


@lru_cache(maxsize=64)
def _traced(
    hold: str, held: float, law: str, span: tuple[float, float] | None, points: int, tol: float
) -> Curve:
    began = time.perf_counter()
    if hold == "ratio":
        branch = trace(Rod.from_ratio(held), law=law, points=points, tol=tol).with_stability()
    else:
        assert span is not None
        branch = trace(beta0=held, lam=span, law=law, points=points, tol=tol)
    return Curve(branch, f"trace of {len(branch)} points", time.perf_counter() - began)
