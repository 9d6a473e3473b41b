"""Curves of equilibria for the explorer: walked quickly while a slider moves, traced when it rests.

A quick walk takes long steps, stops when its time is up and goes on the next time it is asked.
Between its points, curve and tangents are known, so a cubic through both draws it.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ..arclength import chart
from ..branch import Branch
from ..closures import Closure
from ..cohesion import COHESIVE, LINEAR, CohesiveLaw
from ..continuation import Family, StepControl
from ..elastica import PI4
from ..points import Point
from ..primary import PATH, PrimaryBranch
from ..rod import Rod
from ..specials import FOLDS, Located
from ..tracing import trace
from .state import State

#: Steps of a quick walk: a rod's branch from T to contact takes some 20 points.
LONG = StepControl(first=0.05, largest=0.5, quick=5, turn=0.7)

#: Steps taken to find a fold: the last leaves its pressure right to 1e-4.
SECANTS = 3

#: Points drawn between two points of a quick walk.
DENSE = 8

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
    lam, alpha1, pressure_ratio, length_ratio, tip_u : ndarray
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
        estimated from what leaving out every second point changes.
    seconds : float
    """

    hold: str
    held: float
    law: str
    lam: np.ndarray
    alpha1: np.ndarray
    pressure_ratio: np.ndarray
    length_ratio: np.ndarray
    tip_u: np.ndarray
    state: np.ndarray
    index: np.ndarray | None
    specials: tuple[Special, ...]
    ended: str
    method: str
    error: float
    seconds: float

    @property
    def beta0(self) -> np.ndarray:
        """(sbar/eta)^3."""
        return self.length_ratio**3

    def special(self, kind: str) -> Special | None:
        """The first special point of a kind."""
        return next((s for s in self.specials if s.kind == kind), None)


class QuickBranch(PrimaryBranch):
    """A primary branch whose folds are found by one step each, not to the last digit."""

    def _insert_folds(self, here: Point, there: Point) -> None:
        folds = [
            Located(kind, *found)
            for kind, rate in FOLDS[self.family.closure.kind]
            if (found := self._near_zero(here, there, rate)) is not None
        ]
        for fold in sorted(folds, key=lambda f: f.point.arclength):
            self.folds.append(fold)
            self.points.append(fold.point)

    def _near_zero(
        self, here: Point, there: Point, rate: Callable[[Point], float]
    ) -> tuple[Point, tuple[float, float]] | None:
        """Bracketed secant steps, three at most; the last point and the bracket it leaves."""
        span = there.arclength - here.arclength
        low, high, a, b = 0.0, 1.0, rate(here), rate(there)
        if a * b >= 0.0:
            return None
        best = None
        for _ in range(SECANTS):
            share = low + (high - low) * min(max(a / (a - b), 0.02), 0.98)
            point = self.family.step(here, share * span)
            if point is None:
                break
            value = rate(point)
            low, high, a, b = (share, high, value, b) if value * a > 0.0 else (low, share, a, value)
            best = point
        if best is None:
            return None
        return best, (here.arclength + low * span, here.arclength + high * span)


def quick_branch(law: CohesiveLaw, kind: str, value: float, side: int = 1) -> QuickBranch:
    """Return the remembered quick walk at a closure; each thread has walks of its own, as they grow."""
    return _quick_branch(law, kind, value, side, threading.get_ident())


@lru_cache(maxsize=64)
def _quick_branch(law: CohesiveLaw, kind: str, value: float, side: int, _thread: int) -> QuickBranch:
    return QuickBranch(Family(law, PATH, Closure(kind, value)), side, control=LONG)


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


def quick_rod(law: CohesiveLaw, ratio: float, deadline: float) -> tuple[QuickBranch, Curve]:
    """Walk a rod's branch until it ends or ``deadline`` (of ``time.perf_counter``) is past."""
    began = time.perf_counter()
    branch = quick_branch(law, "ratio", ratio)

    def enough(last: Point) -> bool:
        endless = law is LINEAR and last.scalars.pressure_ratio < 0.0
        return endless or time.perf_counter() > deadline

    branch.extend(enough)
    done = branch.ended or ("p < 0" if branch.points[-1].scalars.pressure_ratio < 0.0 else "")
    return branch, _dense([branch], "ratio", done, began)


def quick_groups(
    law: CohesiveLaw, beta0: float, span: tuple[float, float], deadline: float
) -> tuple[tuple[QuickBranch, QuickBranch], Curve]:
    """Walk both sides of the branch through T at fixed beta0, as far as the window of lambda."""
    began = time.perf_counter()
    sides = tuple(quick_branch(law, "length", math.cbrt(beta0), side) for side in (-1, 1))

    def gone(branch: QuickBranch) -> bool:
        lam = branch.points[-1].scalars.lam
        outside = lam > span[1] or lam < -0.99 * PI4 or (bool(branch.folds) and lam < span[0])
        return bool(branch.ended) or (len(branch.points) > 1 and outside)

    for branch in sides:
        branch.extend(lambda _, b=branch: gone(b) or time.perf_counter() > deadline)  # type: ignore[misc]
    done = "window" if all(gone(b) for b in sides) else ""
    return (sides[0], sides[1]), _dense(list(sides), "beta0", done, began)


def _dense(branches: list[QuickBranch], hold: str, ended: str, began: float) -> Curve:
    """Draw cubics through points and tangents of walks that share their first point."""
    parts, states, specials, error, rows, count = [], [], [], 0.0, 0, 0
    for branch in branches:
        points = branch.points
        count += len(points)
        s = np.array([p.arclength for p in points])
        x = np.array([p.x[-4:] for p in points])
        dx = np.array([p.tangent[-4:] for p in points])
        if len(points) > 1:
            fine = np.unique([*s, *np.concatenate([np.linspace(a, b, DENSE) for a, b in pairwise(s)])])
            values = CubicHermiteSpline(s, x, dx)(fine)
            error = max(error, _interpolation_error(s, x, dx))
        else:
            fine, values = s, x
        labels = [branch.state_at(float(a)) for a in fine]
        found = [("BP", "exact", 0)] + [
            (f.kind, "bracketed", int(np.argmin(np.abs(fine - f.point.arclength)))) for f in branch.folds
        ]
        if branch.ended == "contact":
            found.append(("contact", "located", len(fine) - 1))
        if branch.side < 0:
            values, labels = values[::-1], labels[::-1]
            found = []  # T is counted on the other side
        else:
            found = [(kind, status, row + rows) for kind, status, row in found]
        rows += len(values)
        parts.append(values)
        states += labels
        specials += found
    A, m, sigma, lam = np.concatenate(parts).T
    alpha1 = m * A
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(sigma > 0.0, 1.0 + alpha1 / sigma**3, np.nan)
    closure = branches[0].family.closure
    return Curve(
        hold=hold,
        held=closure.value**3 if hold == "beta0" else closure.value,
        law=branches[0].family.law.name,
        lam=lam,
        alpha1=alpha1,
        pressure_ratio=ratio,
        length_ratio=sigma,
        tip_u=_tip(branches[0].family.law, ratio),
        state=np.array(states),
        index=None,
        specials=tuple(Special(*entry) for entry in specials),
        ended=ended,
        method=f"quick walk of {count} points",
        error=error,
        seconds=time.perf_counter() - began,
    )


def _tip(law: CohesiveLaw, P: np.ndarray) -> np.ndarray:
    """u at the tip from P = Phi(y_tip)/y_tip, before any solve."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = 2.0 * (1.0 - P)
        return inside if law is LINEAR else np.where(P >= 0.5, inside, 0.5 / P)


def _interpolation_error(s: np.ndarray, x: np.ndarray, dx: np.ndarray) -> float:
    """Error of the cubics in the metric of the arclength.

    It is a fifteenth of what leaving out every second point changes at those points.
    """
    if len(s) < 3:
        return math.inf
    keep = np.unique([*range(0, len(s), 2), len(s) - 1])
    left = np.setdiff1d(np.arange(len(s)), keep)
    rough = CubicHermiteSpline(s[keep], x[keep], dx[keep])(s[left])

    gaps = [chart(a)[0] - chart(b)[0] for a, b in zip(rough, x[left], strict=True)]
    return float(np.abs(gaps).max()) / 15.0


def traced(state: State) -> Curve | None:
    """Return the diagram of a state as traced; None at the accuracy of a sketch."""
    options = TRACED[state.accuracy]
    if options is None:
        return None
    if state.given == "groups":
        span = window(state.beta0, state.lam)
        return _traced("beta0", state.beta0, state.law, span, *options)
    return _traced("ratio", state.effective_ratio, state.law, None, *options)


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
        tip_u=branch.tip_u,
        state=branch.state,
        index=branch.index,
        specials=tuple(Special(p.kind, p.status, p.index) for p in branch.special_points),
        ended=branch.ended,
        method=f"trace of {len(branch)} points",
        error=float(branch.error.max()),
        seconds=seconds,
    )
