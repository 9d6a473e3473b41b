"""Special points of a branch: what vanishes there, and where."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from ..residual.accuracy import SAFE, can_estimate, refinement
from ..residual.closures import Closure, Plane
from ..residual.linear import Linearised
from ..residual.newton import correct
from ..residual.phases import heights_with_extrema, turning_heights
from ..residual.shape import sample_shape
from .family import FOLD_WIDTH, Family
from .points import Point, arclength_between, place_of, turning

#: A function of a point that changes sign at a special point.
Monitor = Callable[[Point], float]


#: Two monitors that vanish within this at one point tell of one event.
SAME = 1e-9

#: Difference in y/y0 from a jump of the traction within which a special point is at it.
AT_JUMP = 1e-9

#: Steps of Newton's method from the vertex of a parabola to where the rod is level: its height there has an
#: error of the fourth power of the distance after the first.
LEVELLINGS = 2

#: No rod rises by this share of y0 between two points of its profile.
CLEAR = 0.02


def tip(point: Point) -> float:
    """Height of the tip over the amplitude: zero where the branch ends at the contact."""
    return point.ends[0]


def tip_excess(point: Point) -> float:
    """u - 1 at the tip."""
    return float(point.scalars.height(point.ends[0])) - 1.0


def highest_excess(point: Point) -> float:
    """u - 1 at the highest place of the rod; of its points alone where that tells the sign."""
    profile = point.profile
    sampled = float(profile.heights().max()) - 1.0
    if abs(sampled) > CLEAR:
        return sampled
    xi, u = heights_with_extrema(profile)
    top = int(np.argmax(u))
    if top in (0, len(u) - 1):
        return float(u[top]) - 1.0
    where = xi[top : top + 1]
    for _ in range(LEVELLINGS):
        theta, curvature = point.scalars.A * profile.at(where)[:, :2].T
        where = np.clip(where - np.tan(theta) / curvature, xi[top - 1], xi[top + 1])
    return max(float(u[top]), float(profile.heights_at(where)[0])) - 1.0


def off_a_jump(family: Family, point: Point) -> float:
    """Least difference between a jump of the traction and the heights of the tip and of the vertices."""
    if not family.law.jumps:
        return math.inf
    off = np.subtract.outer(turning_heights(point.profile), np.array(family.law.jumps)).ravel()
    return float(off[np.argmin(np.abs(off))])


def apart(point: Point) -> float:
    """1 while the rod does not cross itself, -1 where it does."""
    theta = point.scalars.A * point.profile.values[:, :, 0]
    turned = float(np.ptp(theta)) > np.pi  # it takes more than half a turn
    return -1.0 if turned and sample_shape(point.problem, point.x).crosses_itself() else 1.0


#: Monitors by kind of special point.  Two monitors may share a kind.
PRESSURE: tuple[str, Monitor] = ("LP-pressure", lambda p: p.rate(lambda s: s.pressure_ratio))
LENGTH: tuple[str, Monitor] = ("LP-length", lambda p: p.turn.sigma)
LAMBDA: tuple[str, Monitor] = ("LP-lambda", lambda p: p.turn.lam)

#: What is located besides folds: a kind, named in words in `model.labels`, and what changes sign there.
EVENTS: list[tuple[str, Monitor]] = [
    ("y=y0", tip_excess),
    ("y=y0", highest_excess),
    ("self-contact", apart),
]

#: Of these, what is known on the charts of seeds: where the tip passes y0; no other height does, nor do
#: such rods meet themselves.
ON_CHARTS = frozenset({"y=y0", "self-contact"})

#: Steps of a secant to where an inner phase ends.
SECANTS = 8

#: Height u of the tip at special points that are known by it.
AT_HEIGHT: dict[Monitor, float] = {tip: 0.0, tip_excess: 1.0}

#: What folds, where the monitor of a fold is its rate along the branch.
FOLDING: dict[str, Callable[[Point], float]] = {
    "LP-length": lambda p: p.scalars.sigma,
    "LP-lambda": lambda p: p.scalars.lam,
}

#: Arclength over which the rate of a monitor is taken.
ASIDE = 1e-3

#: How often an interval is cut in search of two folds that lie close together.
CUTS = 4

#: Share of the rates at its ends down to which an interval is not looked into.
DIP = 0.3

BRANCH_POINT: tuple[str, Monitor] = ("BP", lambda p: p.scalars.A)
CONTACT: tuple[str, Monitor] = ("contact", tip)

#: The folds of a family, by the closure that stays fixed along it.
FOLDS: dict[str, tuple[tuple[str, Monitor], ...]] = {
    "ratio": (PRESSURE, LENGTH),
    "length": (LAMBDA,),
    "pressure": (LENGTH,),
    "lam": (LENGTH,),
    "alpha1": (LENGTH,),
    "amplitude": (LENGTH,),
}


@dataclass(frozen=True, eq=False)
class Located:
    """A special point: its kind, the solution there, the arclengths between which it lies, what vanishes.

    ``error`` is what `place_error` says of it, where that is known already.
    """

    kind: str
    point: Point
    bracket: tuple[float, float]
    monitor: Monitor
    error: float = math.nan

    @property
    def status(self) -> str:
        """Say "located" if the bracket is as narrow as asked for, else "bracketed"."""
        return "located" if self.bracket[1] - self.bracket[0] <= 10.0 * FOLD_WIDTH else "bracketed"


def located(family: Family, here: Point, there: Point, kind: str, monitor: Monitor) -> Located:
    """Find the special point between two points on both sides of it.

    By p y_tip = Phi(y_tip) the pressure is known where the tip is at y0 or on the plate: that is landed on.
    """
    if monitor in AT_HEIGHT and family.tip_free and family.closure.kind != "pressure":
        given = Closure("pressure", family.law.mean_traction(AT_HEIGHT[monitor]))
        landed = family.at(here, there, given) if here.miss(given) * there.miss(given) < 0.0 else None
        if landed is not None and abs(monitor(landed)) < SAME:
            error = _landing_error(family, landed, given)
            return Located(kind, landed, (landed.arclength, landed.arclength), monitor, error)
    if len(here.problem.phases) == len(there.problem.phases) + 2:
        across = _beyond_a_phase(family, here, there, monitor)
        if across is not None:
            return Located(kind, *across, monitor)
    return Located(kind, *family.turning_point(here, there, monitor), monitor)


def _landing_error(family: Family, point: Point, given: Closure) -> float:
    """How far the refined mesh would move a point where a number is given; nan where a solve must tell."""
    if not can_estimate(family.transcription):
        return math.nan
    moved = refinement(Linearised.at(point.problem, point.x, *family.closures, given))
    return SAFE * float(np.linalg.norm(point.chart[1] @ moved[point.problem.tail]))


def _beyond_a_phase(
    family: Family, here: Point, there: Point, monitor: Monitor
) -> tuple[Point, tuple[float, float]] | None:
    """Locate the end of an inner phase, which has no length there: on the branch of the shape without it.

    The length of the phase ends with a square root, but the shape that follows goes on smoothly before it, in
    the pieces of the law that are left.  None where the tip angle does not lead to it, or back.
    """

    def at(A: float) -> Point | None:
        start = there.x + (A - there.scalars.A) / there.turn.A * there.tangent
        solved = correct(there.problem, start, (*family.closures, Closure("amplitude", A)))
        if not solved.converged:
            return None
        along = arclength_between(here, there, place_of(there.problem, solved))
        return family.point(there.problem, solved.x, there.direction, along, solved.iterations)

    if not turning(there, there):
        return None
    ends, point = (here.scalars.A, there.scalars.A), there
    (a, b), (f, g) = ends, (monitor(here), monitor(there))
    signs, width = (f, g), FOLD_WIDTH * there.direction[0]
    for _ in range(SECANTS):
        c = b - g * (b - a) / (g - f)
        found = at(c) if min(ends) < c < max(ends) else None
        if found is None:
            return None
        a, b, f, g, point = b, c, g, monitor(found), found
        if abs(b - a) < abs(width) or f == g:
            break
    aside = [at(b + step) for step in (-width, width)]
    if not all(p is not None and monitor(p) * sign > 0.0 for p, sign in zip(aside, signs, strict=True)):
        return None
    return point, (point.arclength - FOLD_WIDTH, point.arclength + FOLD_WIDTH)


def found_again(family: Family, around: tuple[Point, Point], found: Located) -> Located | None:
    """Find a special point on another mesh, from its neighbours on a branch; None if it is not between them.

    Only they are solved for anew: a finer mesh is not walked.
    """
    ends = []
    for point in around:
        solved = family.solve(point.profile, Plane.across(point.place, point.direction))
        if solved is None:
            return None
        ends.append(family.point(solved[0], solved[1].x, point.direction, point.arclength, 0))
    here, there = ends
    if found.monitor(here) * found.monitor(there) >= 0.0:
        return None
    return located(family, here, there, found.kind, found.monitor)


def place_error(family: Family, found: Located) -> float:
    """How far a special point may be from its place, along the branch.

    On the branch of a finer mesh its monitor does not vanish quite there: what is left, over the
    rate of the monitor along the branch, is the distance.  Infinite where that cannot be said: the
    monitor of a self-contact has no rate.
    """
    if math.isfinite(found.error):
        return found.error
    finer = replace(family, transcription=family.transcription.refined())
    point, monitor = found.point, found.monitor
    if abs(off_a_jump(family, point)) < AT_JUMP:
        # A fold at a corner: its own rate jumps there, the height that makes the corner does not.
        monitor = partial(off_a_jump, family)
    again = finer.solve(point.profile, Plane.across(point.place, point.direction))
    aside = family.step(point, ASIDE)
    if again is None or aside is None:
        return math.inf
    same = finer.point(again[0], again[1].x, point.direction, 0.0, 0)
    rate = abs(monitor(aside) - monitor(point)) / ASIDE
    left = abs(monitor(same) - monitor(point)) + abs(monitor(point))
    shift = left / rate if found.kind != "self-contact" and rate > 0.0 else math.inf
    whole = family.transcription.whole_error(point.problem, point.x, shift)
    return whole + found.bracket[1] - found.bracket[0]


def locate(family: Family, points: Sequence[Point], monitors: Sequence[tuple[str, Monitor]]) -> list[Located]:
    """Find the special points between neighbouring points, in order along the branch."""
    found: list[Located] = []
    for kind, monitor in monitors:
        values = [monitor(point) for point in points]
        for i, (here, there) in enumerate(pairwise(points)):
            if values[i] * values[i + 1] > 0.0 and kind in FOLDING:
                middle = _between_folds(family, here, there, monitor, FOLDING[kind])
                if middle is not None:
                    found.append(located(family, here, middle, kind, monitor))
                    found.append(located(family, middle, there, kind, monitor))
            if values[i] * values[i + 1] >= 0.0:
                continue
            same = (p.point for p in found if p.kind == kind)
            between = (p for p in same if here.arclength <= p.arclength <= there.arclength)
            if any(abs(monitor(point)) < SAME for point in between):
                continue  # the tip is the highest place
            found.append(located(family, here, there, kind, monitor))
    return sorted(found, key=lambda p: p.point.arclength)


def _between_folds(
    family: Family,
    here: Point,
    there: Point,
    rate: Monitor,
    quantity: Callable[[Point], float],
    cuts: int = CUTS,
) -> Point | None:
    """Return a point between two folds that lie between neighbours, if there are such.

    Both rates have one sign then, and so has their mean; the parabola through the three dips
    below zero or comes near it.  Where it does, its vertex is looked at, and what lies beside it.
    """
    span = here.ahead(there.place)
    a, b = rate(here), rate(there)
    mean = (quantity(there) - quantity(here)) / span
    bend = 6.0 * (mean - 0.5 * (a + b))  # of a + (b - a) t + bend t (1 - t), which has this mean
    if cuts == 0 or bend * a >= 0.0:
        return None
    vertex = 0.5 + 0.5 * (b - a) / bend
    least = a + (b - a) * vertex + bend * vertex * (1.0 - vertex)
    if not 0.0 < vertex < 1.0 or least / a > DIP * min(1.0, b / a):
        return None
    middle = family.step(here, vertex * span)
    if middle is None or rate(middle) * a < 0.0:
        return middle
    return _between_folds(family, here, middle, rate, quantity, cuts - 1) or _between_folds(
        family, middle, there, rate, quantity, cuts - 1
    )
