"""Quick walks along a branch, taken while a slider moves.

A quick walk takes long steps, stops when its time is up and goes on the next time it is asked.
Between its points, curve and tangents are known, so a cubic through both draws it.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ...continuation.family import Family, StepControl
from ...continuation.goal import below_zero, left_for_good
from ...continuation.primary import PrimaryBranch
from ...equilibria.branch import Branch
from ...equilibria.branch_parts import SpecialPoint, Trivial
from ...model.bond import CohesiveLaw
from ...model.rod import Rod
from ...residual.closures import Closure, chart
from ...residual.meshes import PATH
from .curves import Curve

#: Steps of a quick walk: a rod's branch from T to contact takes some 20 points.
LONG = StepControl(first=0.05, largest=0.5, quick=5, turn=0.7)

#: Points drawn between two points of a quick walk.
DENSE = 8


def quick_branch(law: CohesiveLaw, closure: Closure, side: int = 1) -> PrimaryBranch:
    """Return the remembered quick walk at a closure; each thread has walks of its own, as they grow."""
    return _quick_branch(law, closure, side, threading.get_ident())


@lru_cache(maxsize=64)
def _quick_branch(law: CohesiveLaw, closure: Closure, side: int, _thread: int) -> PrimaryBranch:
    return PrimaryBranch(Family(law, PATH, closure), side, control=LONG)


def quick_rod(law: CohesiveLaw, rod: Rod, deadline: float) -> Curve:
    """Walk a rod's branch until it ends or ``deadline`` (of ``time.perf_counter``) is past, and draw it."""
    branch = quick_branch(law, Closure("ratio", rod.ratio))
    branch.extend(lambda _: below_zero(branch) or time.perf_counter() > deadline)
    # A question may have walked on from where a rod without an end is not drawn any more.
    below = next((i for i, p in enumerate(branch.points) if p.scalars.pressure_ratio < 0.0), None)
    if below is not None:
        return _drawn((branch,), (below + 1,), rod, "p < 0")
    return _drawn((branch,), (len(branch.points),), rod, branch.ended)


def gone(branch: PrimaryBranch, span: tuple[float, float]) -> bool:
    """Whether a walk at fixed beta0 has ended or left the window of lambda for good."""
    return bool(branch.ended) or left_for_good(branch, span)


def quick_groups(law: CohesiveLaw, beta0: float, span: tuple[float, float], deadline: float) -> Curve:
    """Walk both sides of the branch through T at fixed beta0, as far as the window of lambda; draw them."""
    sides = tuple(quick_branch(law, Closure("length", math.cbrt(beta0)), side) for side in (-1, 1))
    for branch in sides:
        branch.extend(lambda _, b=branch: gone(b, span) or time.perf_counter() > deadline)  # type: ignore[misc]
    done = "window" if all(gone(b, span) for b in sides) else ""
    return _drawn(sides, tuple(len(b.points) for b in sides), None, done)


@lru_cache(maxsize=32)
def _drawn(walks: tuple[PrimaryBranch, ...], counts: tuple[int, ...], rod: Rod | None, ended: str) -> Curve:
    """Draw cubics through the first points and tangents of walks that begin at T, once for so many."""
    began = time.perf_counter()
    parts, error = [], 0.0
    ways = [walk.points[:count] for walk, count in zip(walks, counts, strict=True)]
    for walk, way in zip(walks, ways, strict=True):
        s = np.array([p.arclength for p in way])
        x = np.array([p.tail for p in way])
        dx = np.array([p.rates for p in way])
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
    found = [("BP", "exact", 0.0)] + [(f.kind, f.status, f.point.arclength) for f in last.folds]
    if ended == "contact":
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
    solved = [
        p for walk, way in zip(walks, ways, strict=True) for p in (way[:0:-1] if walk.side < 0 else way)
    ]
    method = f"quick walk of {len(solved)} points"
    branch = replace(branch, special_points=specials)
    seconds = sum(walk.seconds for walk in walks) + time.perf_counter() - began
    return Curve(branch, method, seconds, tuple(solved))


def _special(branch: Branch, kind: str, status: str, arclength: float, error: float) -> SpecialPoint:
    i = int(np.argmin(np.abs(branch.arclength - arclength)))
    return SpecialPoint(
        kind,
        status,
        (arclength, arclength),
        i,
        beta0=float(branch.beta0[i]),
        lam=float(branch.lam[i]),
        alpha1=float(branch.alpha1[i]),
        pressure_ratio=float(branch.pressure_ratio[i]),
        length_ratio=float(branch.length_ratio[i]),
        error=error,
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
