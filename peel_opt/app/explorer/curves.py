"""Curves of equilibria for the explorer: what a diagram draws, and its branch as traced at rest."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...base.errors import PeelOptError
from ...continuation.points import Point
from ...equilibria.branch import Branch
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


@dataclass(frozen=True)
class Special:
    """A special point: kind as in `peel_opt.SpecialPoint`, and its row in the curve."""

    kind: str
    status: str
    row: int


@dataclass(frozen=True, eq=False)
class Curve:
    """A branch to draw; arrays have shape (n,) and run along it.

    Parameters
    ----------
    hold : {"ratio", "beta0"}
    held : float
    law : str
    lam, alpha1, pressure_ratio, length_ratio : ndarray
        Those over T0, eta and y0 are NaN at beta0 = 0.
    state : ndarray of str
    index : ndarray or None
        Unstable directions at fixed pressure, where computed; -1 where not.
    specials : tuple of Special
    ended : str
        "" where a quick walk has more to come.
    method : str
    error : float
        Largest distance from the exact branch, in the metric of the arclength; a quick walk's is
        estimated from above, by what leaving out one of its points changes.
    seconds : float
    origin : Branch or tuple of Point
        The solved states that it is drawn through.
    """

    hold: str
    held: float
    law: str
    lam: np.ndarray
    alpha1: np.ndarray
    pressure_ratio: np.ndarray
    length_ratio: np.ndarray
    state: np.ndarray
    index: np.ndarray | None
    specials: tuple[Special, ...]
    ended: str
    method: str
    error: float
    seconds: float
    origin: Branch | tuple[Point, ...] = ()

    @property
    def beta0(self) -> np.ndarray:
        """(sbar/eta)^3."""
        return self.length_ratio**3

    def special(self, kind: str) -> Special | None:
        """The first special point of a kind."""
        return next((s for s in self.specials if s.kind == kind), None)


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
    return _traced("ratio", state.effective_ratio, state.law, None, *options)


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
    return _of_branch(branch, held, time.perf_counter() - began)


def _of_branch(branch: Branch, held: float, seconds: float) -> Curve:
    return Curve(
        hold=branch.hold,
        held=held,
        law=branch.law,
        lam=branch.lam,
        alpha1=branch.alpha1,
        pressure_ratio=branch.pressure_ratio,
        length_ratio=branch.length_ratio,
        state=branch.state,
        index=None if branch.unstable is None else branch.unstable.astype(int),
        specials=tuple(Special(p.kind, p.status, p.index) for p in branch.special_points),
        ended=branch.ended,
        method=f"trace of {len(branch)} points",
        error=float(branch.error.max()),
        seconds=seconds,
        origin=branch,
    )
