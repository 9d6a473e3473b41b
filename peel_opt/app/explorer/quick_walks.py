"""Quick walks along a branch, taken while a slider moves.

A quick walk takes long steps, stops when its time is up and goes on the next time it is asked.
Between its points, curve and tangents are known, so a cubic through both draws it.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ...continuation.family import Family, StepControl
from ...continuation.goal import below_zero, left_for_good
from ...continuation.points import Point
from ...continuation.primary import PrimaryBranch
from ...continuation.special import FOLDS, Located
from ...equilibria.branch import Branch
from ...equilibria.branch_parts import SpecialPoint, Trivial
from ...model.bond import CohesiveLaw
from ...model.rod import Rod
from ...residual.arclength import chart
from ...residual.closures import Closure
from ...residual.meshes import PATH
from .curves import Curve

#: Steps of a quick walk: a rod's branch from T to contact takes some 20 points.
LONG = StepControl(first=0.05, largest=0.5, quick=5, turn=0.7)

#: Steps taken to find a fold: the last leaves its pressure right to 1e-4.
SECANTS = 3

#: Points drawn between two points of a quick walk.
DENSE = 8


class QuickBranch(PrimaryBranch):
    """A primary branch whose folds are found by one step each, not to the last digit."""

    #: Time it has been walked for, over all the pictures that asked for more of it.
    seconds = 0.0

    def walk_on(self, enough: Callable[[Point], bool]) -> None:
        """Walk on as `extend` does, and count the time."""
        began = time.perf_counter()
        self.extend(enough)
        self.seconds += time.perf_counter() - began

    def _insert_folds(self, here: Point, there: Point) -> None:
        folds = [
            Located(kind, *found, rate)
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


def walked(law: CohesiveLaw, ratio: float, deadline: float) -> QuickBranch:
    """Walk the branch at a ratio until it ends or ``deadline`` (of ``time.perf_counter``) is past."""
    branch = quick_branch(law, "ratio", ratio)
    branch.walk_on(lambda _: below_zero(branch) or time.perf_counter() > deadline)
    return branch


def quick_rod(law: CohesiveLaw, rod: Rod, deadline: float) -> tuple[QuickBranch, Curve]:
    """Walk a rod's branch so far, and draw it."""
    branch = walked(law, rod.ratio, deadline)
    done = branch.ended or ("p < 0" if branch.points[-1].scalars.pressure_ratio < 0.0 else "")
    return branch, _drawn((branch,), (len(branch.points),), rod, done)


def gone(branch: QuickBranch, span: tuple[float, float]) -> bool:
    """Whether a walk at fixed beta0 has ended or left the window of lambda for good."""
    return bool(branch.ended) or left_for_good(branch, span)


def quick_groups(
    law: CohesiveLaw, beta0: float, span: tuple[float, float], deadline: float
) -> tuple[tuple[QuickBranch, QuickBranch], Curve]:
    """Walk both sides of the branch through T at fixed beta0, as far as the window of lambda."""
    sides = tuple(quick_branch(law, "length", math.cbrt(beta0), side) for side in (-1, 1))

    for branch in sides:
        branch.walk_on(lambda _, b=branch: gone(b, span) or time.perf_counter() > deadline)  # type: ignore[misc]
    done = "window" if all(gone(b, span) for b in sides) else ""
    return (sides[0], sides[1]), _drawn(sides, tuple(len(b.points) for b in sides), None, done)


@lru_cache(maxsize=32)
def _drawn(walks: tuple[QuickBranch, ...], _counts: tuple[int, ...], rod: Rod | None, ended: str) -> Curve:
    """Draw cubics through points and tangents of walks that share their first point, T; once for so many."""
    began = time.perf_counter()
    parts, error = [], 0.0
    for walk in walks:
        s = np.array([p.arclength for p in walk.points])
        x = np.array([p.tail for p in walk.points])
        dx = np.array([p.rates for p in walk.points])
        if len(s) > 1:
            error = max(error, _interpolation_error(s, x, dx))
            fine = np.unique([*s, *np.concatenate([np.linspace(a, b, DENSE) for a, b in pairwise(s)])])
            s, x = fine, CubicHermiteSpline(s, x, dx)(fine)
        labels = [walk.state_at(float(a)) for a in s]
        # One way through both: the side beyond T comes first, backwards and without T.
        parts.append((-s[:0:-1], x[:0:-1], labels[:0:-1]) if walk.side < 0 else (s, x, labels))
    s, x = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    A, m, sigma, lam = x.T
    closure, last = walks[0].family.closure, walks[-1]
    found = [("BP", "exact", 0.0)] + [(f.kind, "bracketed", f.point.arclength) for f in last.folds]
    if last.ended == "contact":
        found.append(("contact", "located", last.points[-1].arclength))
    nothing = np.full(len(s), np.nan)
    branch = Branch(
        law=last.family.law.name,
        hold="ratio" if rod is not None else "beta0",
        held=closure.value if rod is not None else closure.value**3,
        rod=rod,
        arclength=s,
        A=A,
        m=m,
        sigma=sigma,
        lam=lam,
        tip_u=nothing,
        error=np.full(len(s), error),
        certificate=nothing,
        iterations=np.zeros(len(s)),
        state=np.array([label for part in parts for label in part[2]]),
        trivial=None if rod is not None else Trivial(np.array([lam.min(), lam.max()]), ()),
        ended=ended,
    )
    specials = tuple(_special(branch, *entry, error) for entry in found)
    # Both sides begin at T.
    solved = [p for walk in walks for p in (walk.points[:0:-1] if walk.side < 0 else walk.points)]
    method = f"quick walk of {len(solved)} points"
    branch = replace(branch, special_points=specials)
    seconds = sum(walk.seconds for walk in walks) + time.perf_counter() - began
    return Curve(branch, method, seconds, tuple(solved))


def _special(branch: Branch, kind: str, status: str, arclength: float, error: float) -> SpecialPoint:
    i = int(np.argmin(np.abs(branch.arclength - arclength)))
    names = ("beta0", "lam", "alpha1", "pressure_ratio", "length_ratio")
    groups = {name: float(getattr(branch, name)[i]) for name in names}
    return SpecialPoint(kind, status, (arclength, arclength), i, error=error, **groups)


def _interpolation_error(s: np.ndarray, x: np.ndarray, dx: np.ndarray) -> float:
    """Error of the cubics in the metric of the arclength, estimated from above.

    It is the most that leaving out a point changes there, each in its turn.  Half the step would leave
    a sixteenth of that on a smooth branch walked in equal steps.  But steps grow fivefold, and a kink of
    the law is a jump of the curvature where the tip passes it, so that no share of it is safe.
    """
    if len(s) < 3:
        return math.inf
    # All cubics from a point to the next but one at once: a spline for each takes too long.
    h = (s[2:] - s[:-2])[:, None]
    a = (s[1:-1] - s[:-2])[:, None] / h
    b = 1.0 - a
    ends = b**2 * (1.0 + 2.0 * a) * x[:-2] + a**2 * (1.0 + 2.0 * b) * x[2:]
    rough = ends + a * b * h * (b * dx[:-2] - a * dx[2:])
    gaps = [chart(p)[0] - chart(q)[0] for p, q in zip(rough, x[1:-1], strict=True)]
    return float(np.linalg.norm(gaps, axis=1).max())
