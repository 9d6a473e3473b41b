"""Quick walks along a branch, taken while a slider moves.

A quick walk takes long steps, stops when its time is up and goes on the next time it is asked.
Between its points, curve and tangents are known, so a cubic through both draws it.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ...continuation.family import Family, StepControl
from ...continuation.goal import below_zero, left_for_good
from ...continuation.points import Point
from ...continuation.primary import PrimaryBranch
from ...continuation.special import FOLDS, Located
from ...model.bond import CohesiveLaw
from ...residual.arclength import chart
from ...residual.closures import Closure
from ...residual.meshes import PATH
from .curves import Curve, Special

#: Steps of a quick walk: a rod's branch from T to contact takes some 20 points.
LONG = StepControl(first=0.05, largest=0.5, quick=5, turn=0.7)

#: Steps taken to find a fold: the last leaves its pressure right to 1e-4.
SECANTS = 3

#: Points drawn between two points of a quick walk.
DENSE = 8


class QuickBranch(PrimaryBranch):
    """A primary branch whose folds are found by one step each, not to the last digit."""

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


def quick_rod(law: CohesiveLaw, ratio: float, deadline: float) -> tuple[QuickBranch, Curve]:
    """Walk a rod's branch until it ends or ``deadline`` (of ``time.perf_counter``) is past."""
    began = time.perf_counter()
    branch = quick_branch(law, "ratio", ratio)

    branch.extend(lambda _: below_zero(branch) or time.perf_counter() > deadline)
    done = branch.ended or ("p < 0" if branch.points[-1].scalars.pressure_ratio < 0.0 else "")
    return branch, _dense([branch], "ratio", done, began)


def gone(branch: QuickBranch, span: tuple[float, float]) -> bool:
    """Whether a walk at fixed beta0 has ended or left the window of lambda for good."""
    return bool(branch.ended) or left_for_good(branch, span)


def quick_groups(
    law: CohesiveLaw, beta0: float, span: tuple[float, float], deadline: float
) -> tuple[tuple[QuickBranch, QuickBranch], Curve]:
    """Walk both sides of the branch through T at fixed beta0, as far as the window of lambda."""
    began = time.perf_counter()
    sides = tuple(quick_branch(law, "length", math.cbrt(beta0), side) for side in (-1, 1))

    for branch in sides:
        branch.extend(lambda _, b=branch: gone(b, span) or time.perf_counter() > deadline)  # type: ignore[misc]
    done = "window" if all(gone(b, span) for b in sides) else ""
    return (sides[0], sides[1]), _dense(list(sides), "beta0", done, began)


def _dense(branches: list[QuickBranch], hold: str, ended: str, began: float) -> Curve:
    """Draw cubics through points and tangents of walks that share their first point."""
    parts, states, specials, error, rows = [], [], [], 0.0, 0
    origin: list[Point] = []
    for branch in branches:
        points = branch.points
        # Both sides begin at T.
        origin += points[:0:-1] if branch.side < 0 else points
        s = np.array([p.arclength for p in points])
        x = np.array([p.tail for p in points])
        dx = np.array([p.rates for p in points])
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
        state=np.array(states),
        index=None,
        specials=tuple(Special(*entry) for entry in specials),
        ended=ended,
        method=f"quick walk of {len(origin)} points",
        error=error,
        seconds=time.perf_counter() - began,
        origin=tuple(origin),
    )


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
