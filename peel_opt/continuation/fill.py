"""Many corrections at once: points between the neighbours of a walk, and errors of points.

A walk needs one point to find the next, a few dozen in all.  What lies between them does not:
its guesses come from interpolation, and Newton's method for all of them is one loop over the
compiled residual and one call of LAPACK for the whole stack.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..base.arrays import EPS
from ..base.threads import one_thread
from ..residual.accuracy import UNITS, units_lost
from ..residual.closures import Closing, Closure, Plane, chart, parameters
from ..residual.discretisation import Discretisation
from ..residual.linear import Linearised, closed_system
from .family import Family, StepControl
from .points import Point, cubic, interpolated, place_of, turning

#: Steps of Newton's method between two neighbours; more mean that the guess was bad.
MOST_STEPS = 4

#: Largest update, relative to the unknowns, that counts as converged.
SMALL = 1e-11

#: A first update on the finer mesh larger than this is no measure of the error yet.
LINEAR_RANGE = 1e-5


def filled(family: Family, points: Sequence[Point], largest: float) -> list[Point]:
    """Put points between the points of a walk until none are further apart than ``largest``.

    Parameters
    ----------
    family : Family
    points : sequence of Point
        In order along the branch.
    largest : float
        Arclength.

    Returns
    -------
    list of Point
        The given points are among them.
    """
    gaps: dict[int, list[tuple[Point, Point]]] = {}
    inner: list[Point] = []
    for here, there in pairwise(points):
        if there.arclength - here.arclength <= largest:
            continue
        if _is_smooth(family, here, there):
            gaps.setdefault(id(here.problem), []).append((here, there))
        else:
            inner += _stepped(family, here, there, largest)
    for pairs in gaps.values():
        for pair, found in zip(pairs, _interpolated(family, pairs, largest), strict=True):
            inner += _stepped(family, *pair, largest) if found is None else found
    return sorted([*points, *inner], key=lambda p: p.arclength)


def _is_smooth(family: Family, here: Point, there: Point) -> bool:
    """Whether the tip angle can serve as the coordinate from one point to the next."""
    if not turning(here, there):
        return False
    return closed_system(here.problem, (family.closure.kind, "amplitude")).pattern is None


def _stepped(family: Family, here: Point, there: Point, largest: float) -> Iterator[Point]:
    """Walk from one point to the next; the points between them."""
    span = there.arclength - here.arclength
    walk = family.walk(here, StepControl(first=largest, largest=largest))
    next(walk)
    for point in walk:
        if point.arclength >= here.arclength + (1.0 - 1e-3) * span:
            return
        yield point


def _interpolated(
    family: Family, pairs: list[tuple[Point, Point]], largest: float
) -> list[list[Point] | None]:
    """Points between neighbours that share their discrete problem; None where that fails."""
    problem = pairs[0][0].problem
    guesses, owners = [], []
    for number, (here, there) in enumerate(pairs):
        pieces = int(np.ceil((there.arclength - here.arclength) / largest * (1.0 - 1e-12)))
        share = np.arange(1, pieces) / pieces
        guesses.append(_hermite(here, there, share))
        owners += [number] * len(share)
    start = np.vstack(guesses)
    at_A = problem.column("A")
    closing: list[tuple[Closing, ...]] = [
        (family.closure, Closure("amplitude", float(x[at_A]))) for x in start
    ]
    x, rates, steps, good = corrected(problem, start, closing)
    found: list[list[Point] | None] = [[] for _ in pairs]
    for i, number in enumerate(owners):
        here, there = pairs[number]
        own = found[number]
        point = _placed(here, there, x[i], rates[i, :, -1], steps) if good[i] else None
        if own is None or point is None or not _belongs(family, own[-1] if own else here, point, there):
            found[number] = None
        else:
            own.append(point)
    return found


def _hermite(here: Point, there: Point, share: np.ndarray) -> np.ndarray:
    """Unknowns at shares of the arclength between two points, shape (len(share), n)."""
    span, start, end = there.arclength - here.arclength, here.scalars.A, there.scalars.A
    amplitude = cubic(share, start, end, span * here.turn.A, span * there.turn.A)
    guess = interpolated(here, there, (amplitude - start) / (end - start))
    guess[:, here.problem.column("A")] = amplitude
    return guess


def corrected(
    problem: Discretisation, x: np.ndarray, closing: Sequence[Sequence[Closing]]
) -> tuple[np.ndarray, np.ndarray, int, np.ndarray]:
    """Correct a stack of guesses, whose algebra is dense.

    Returns the solutions, what a unit on the right of each closure does to the unknowns (for a
    closure such as A - given, the derivative by its number), the steps taken, and which ones converged.
    """
    system = closed_system(problem, tuple(c.kind for c in closing[0]))
    given = np.array([parameters(c) for c in closing])
    scale = 1.0 + np.abs(x)
    scale[:, : problem.field_count] = 1.0 + np.abs(x[:, : problem.field_count]).max(axis=1, keepdims=True)
    before, closures = np.full(len(x), np.inf), len(closing[0])
    for step in range(1, MOST_STEPS + 1):
        values, jacobians = system.system.many(x, given)
        right = np.zeros((*values.shape, 1 + closures))
        right[:, :, 0] = -values
        right[:, -closures:, 1:] = np.eye(closures)
        try:
            with one_thread:
                solved = np.linalg.solve(jacobians, right)
        except np.linalg.LinAlgError:
            return x, np.zeros((*x.shape, closures)), step, np.zeros(len(x), dtype=bool)
        update = np.abs(solved[:, :, 0] / scale).max(axis=1)
        x = x + solved[:, :, 0]
        # Convergence is quadratic: what one update leaves is of the size of the next.
        with np.errstate(invalid="ignore"):
            good = (update < SMALL) | ((update < 1e-6) & (update * update / before < SMALL))
        if np.all(good | ~np.isfinite(update)):
            break
        before = update
    return x, solved[:, :, 1:], step, good


def _placed(here: Point, there: Point, x: np.ndarray, rate: np.ndarray, steps: int) -> Point:
    """Return a solution as a point of the branch between its neighbours."""
    tail = here.problem.tail
    place, gradient = chart(x[tail])
    tangent = rate if here.turn.A > 0.0 else -rate
    unit = tangent / np.linalg.norm(gradient @ tangent[tail])
    # No branch is left between neighbours on the same side of all corners.
    orientation = here.orientation if here.orientation == there.orientation else 0
    return Point(here.problem, x, unit, here.arclength + here.ahead(place), steps, orientation)


def _belongs(family: Family, before: Point, point: Point, there: Point) -> bool:
    """Whether a point lies between its neighbours, on their branch and in their phases."""
    if not before.arclength < point.arclength < there.arclength:
        return False
    if (
        not family.between(before, there, point.place)
        or before.direction @ point.direction < StepControl().turn
    ):
        return False
    if len(family.law.pieces) == 1:
        return True
    return family.suits(point.profile, point.problem)


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Errors of some points in the metric of the arclength, arrays of shape (n,).

    Parameters
    ----------
    mesh : ndarray
        Distance from the branch of the refined mesh, along the normal plane; of the coarser
        solution, so not an underestimate while refinement helps at all.  Infinite where the
        finer mesh has no solution near.
    rounding : ndarray
        What the last place of all terms of the equations does to a point.
    """

    mesh: np.ndarray
    rounding: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """Both together."""
        return self.mesh + self.rounding

    def gains_by_refinement(self, tol: float) -> bool:
        """Whether a point misses ``tol`` by its mesh and not by rounding."""
        return bool(np.any(self.mesh > np.maximum(tol, self.rounding)))


def point_errors(family: Family, points: Sequence[Point]) -> PointErrors:
    """Estimate the errors of points of a branch, many at once."""
    finer = replace(family, transcription=family.transcription.refined())
    mesh, rounding = np.full(len(points), np.nan), np.full(len(points), np.nan)
    groups: dict[int, list[int]] = {}
    for i, point in enumerate(points):
        groups.setdefault(id(point.problem), []).append(i)
    for members in groups.values():
        mesh[members], rounding[members] = _one_step(finer, [points[i] for i in members])
    for i in np.flatnonzero(np.isnan(mesh)).tolist():
        mesh[i] = _solved_again(finer, points[i])
    for i in np.flatnonzero(np.isnan(rounding)).tolist():
        rounding[i] = _rounding(family, points[i])
    whole = [_whole(family, point, gap) for point, gap in zip(points, mesh.tolist(), strict=True)]
    return PointErrors(np.array(whole), rounding)


def _whole(family: Family, point: Point, gap: float) -> float:
    """Error of a point that is so far from the refined mesh, which may have to be refined itself to tell."""
    error = family.transcription.whole_error(point.problem, point.x, gap)
    if math.isfinite(error) or not math.isfinite(gap):
        return error
    finer = replace(family, transcription=family.transcription.refined())
    found = finer.solve(point.profile, Plane.across(point.place, point.direction))
    if found is None:
        return math.inf
    there = finer.point(found[0], found[1].x, point.direction, point.arclength, 0)
    finest = replace(family, transcription=finer.transcription.refined())
    return gap + finer.transcription.whole_error(there.problem, there.x, _solved_again(finest, there))


def _one_step(finer: Family, points: list[Point]) -> tuple[np.ndarray, np.ndarray]:
    """Distances by one step of Newton's method on the finer mesh, and rounding.

    The distance is nan where the step is too long to be one.
    """
    problem = finer.transcription.discretise(points[0].problem.phases)
    closing = [(finer.closure, Plane.across(p.place, p.direction)) for p in points]
    system = closed_system(problem, tuple(c.kind for c in closing[0]))
    unknown = np.full(len(points), np.nan)
    if system.pattern is not None:
        return unknown, unknown
    x = np.array([points[0].problem.prolonged(p.x, problem) for p in points])
    values, jacobians = system.system.many(x, np.array([parameters(c) for c in closing]))
    gradients = np.array([p.chart[1] for p in points])
    weights = np.zeros((*x.shape, 4))
    weights[:, problem.tail, :] = np.swapaxes(gradients, 1, 2)
    try:
        # How the coordinates of the arclength respond to every equation.
        with one_thread:
            response = np.linalg.solve(np.swapaxes(jacobians, 1, 2), weights)
    except np.linalg.LinAlgError:
        return unknown, unknown
    gap = np.linalg.norm(np.einsum("ijk,ij->ik", response, values), axis=1)
    sizes = np.einsum("ijk,ik->ij", np.abs(jacobians), np.abs(x))
    residues = np.linalg.norm(response * sizes[:, :, None], axis=(1, 2))
    return np.where(gap < LINEAR_RANGE, gap, np.nan), UNITS * EPS * residues


def _rounding(family: Family, point: Point) -> float:
    """What rounding does to one point, on its own mesh, whether its algebra is dense or sparse."""
    at = Linearised.at(point.problem, point.x, *family.closures, Plane.facing(point.direction))
    with one_thread:
        response, sizes = at.adjoint(point.chart[1].T), at.sizes
    lost = units_lost(point.problem, len(sizes)) * sizes
    return EPS * float(np.linalg.norm(response * lost[:, None]))


def _solved_again(finer: Family, point: Point) -> float:
    """Distance of one point from its full solution on the finer mesh."""
    found = finer.solve(point.profile, Plane.across(point.place, point.direction))
    if found is None:
        return np.inf
    return float(np.linalg.norm(place_of(*found) - point.place))
