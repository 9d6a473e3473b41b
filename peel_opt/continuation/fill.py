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
from ..residual.accuracy import UNITS, can_estimate, units_lost
from ..residual.closures import Closing, Closure, Plane, chart, parameters
from ..residual.compiled_stack import AnyStack, stacked
from ..residual.discretisation import Discretisation
from ..residual.linear import Linearised, closed_system
from .family import Family, StepControl
from .points import Point, cubic, interpolated, place_of, turning
from .segments import Segment, arclengths

#: Steps of Newton's method between two neighbours; more mean that the guess was bad.
MOST_STEPS = 4

#: Largest update, relative to the unknowns, that counts as converged.
SMALL = 1e-11

#: Least share of the tip angle in the arclength with which it still tells states from one another.
TURNS = 1e-5

#: Arclength within which a point that is corrected again is the same.
SAME = 1e-6

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
    if not (turning(here, there) or _turns_on(family, here, there)):
        return False
    return closed_system(here.problem, (family.closure.kind, "amplitude")).pattern is None


def _turns_on(family: Family, here: Point, there: Point) -> bool:
    """Whether the tip angle grows from one point to the next, however little, as on a rod's whole branch."""
    law = family.law
    of_a_rod = family.closure.kind == "ratio" and law.falls_straight and law.branch_ends
    grows = min(here.turn.A, there.turn.A, there.scalars.A - here.scalars.A) > 0.0
    return of_a_rod and here.problem is there.problem and grows


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
    guesses, owners = [], []
    for number, (here, there) in enumerate(pairs):
        pieces = int(np.ceil((there.arclength - here.arclength) / largest * (1.0 - 1e-12)))
        share = np.arange(1, pieces) / pieces
        guesses.append(_hermite(here, there, share))
        owners += [number] * len(share)
    start = np.vstack(guesses)
    found: list[list[Point] | None] = [[] for _ in pairs]
    for number, point in zip(owners, _solved_between(family, pairs, owners, start), strict=True):
        own = found[number]
        if own is None or point is None:
            found[number] = None
        else:
            own.append(point)
    return [
        _in_place(family, pair, own) if own is not None else None
        for pair, own in zip(pairs, found, strict=True)
    ]


def _in_place(family: Family, pair: tuple[Point, Point], inner: list[Point]) -> list[Point] | None:
    """Return points between two with their arclengths; None where one does not belong there."""
    here, there = pair
    every = [here, *inner, there]
    A = np.array([p.scalars.A for p in every])
    if not np.all(np.diff(A) * (there.scalars.A - here.scalars.A) > 0.0):
        return None
    velocities = np.array([p.direction / p.turn.A for p in every])
    along = arclengths(np.array([p.place for p in every]), velocities, A)
    along *= (there.arclength - here.arclength) / along[-1]
    # No branch is left between neighbours on the same side of all corners.
    side = here.orientation if here.orientation == there.orientation else 0
    placed = [p.placed(here.arclength + float(s), side) for p, s in zip(inner, along[1:-1], strict=True)]
    belong = all(_belongs(family, a, b, there) for a, b in pairwise([here, *placed]))
    return placed if belong else None


def _solved_between(
    family: Family, pairs: list[tuple[Point, Point]], owners: list[int], start: np.ndarray
) -> list[Point | None]:
    """Correct guesses that each lie between a pair of points, at their tip angles; None where that fails."""
    problem = pairs[0][0].problem
    A = start[:, problem.column("A")]
    stack = stacked(problem, (family.closure.kind, "amplitude"))
    if stack is None:
        closing = [(family.closure, Closure("amplitude", float(a))) for a in A]
        x, rates, steps, good = corrected(problem, start, closing)
        return [
            _corrected(pairs[owner][0], x[i], rates[i, :, -1], steps) if good[i] else None
            for i, owner in enumerate(owners)
        ]
    segment = Segment.at(stack, family.closure, A, stack.gathered(start), sharp=True)
    turned = np.sign([pairs[owner][0].turn.A for owner in owners])
    points = segment.points(np.zeros(len(A)), turned)
    good = segment.solved.converged.tolist()
    return [point if reached else None for point, reached in zip(points, good, strict=True)]


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


def _corrected(here: Point, x: np.ndarray, rate: np.ndarray, steps: int) -> Point:
    """Return a solution as a point of the branch after another, at the arclength of that."""
    tail = here.problem.tail
    gradient = chart(x[tail])[1]
    tangent = rate if here.turn.A > 0.0 else -rate
    unit = tangent / np.linalg.norm(gradient @ tangent[tail])
    return Point(here.problem, x, unit, here.arclength, steps)


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
    mesh, rounding = np.array([point.errors or (np.nan, np.nan) for point in points]).T
    groups: dict[int, list[int]] = {}
    for i in np.flatnonzero(np.isnan(mesh)).tolist():
        groups.setdefault(id(points[i].problem), []).append(i)
    for members in groups.values():
        own = [points[i] for i in members]
        stack = stacked(own[0].problem, (family.closure.kind, "amplitude"))
        if stack is not None and can_estimate(family.transcription):
            mesh[members], rounding[members] = _weighted(family, stack, own)
    left = np.flatnonzero(np.isnan(mesh)).tolist()
    for members in groups.values():
        if others := [i for i in members if i in left]:
            mesh[others], rounding[others] = _one_step(finer, [points[i] for i in others])
    for i in left:
        if math.isnan(mesh[i]):
            mesh[i] = _solved_again(finer, points[i])
        if math.isnan(rounding[i]):
            rounding[i] = _rounding(family, points[i])
        mesh[i] = _whole(family, points[i], mesh[i])
    return PointErrors(mesh, rounding)


def _weighted(family: Family, stack: AnyStack, points: list[Point]) -> tuple[np.ndarray, np.ndarray]:
    """Errors by the residual on the finer mesh; not numbers where the tip angle does not tell states."""
    x = stack.gathered(np.array([point.x for point in points]))
    segment = Segment.at(stack, family.closure, np.array([point.scalars.A for point in points]), x)
    # The two must be one state: a correction may have gone elsewhere.
    same = np.linalg.norm(segment.places - np.array([point.place for point in points]), axis=1) < SAME
    turns = np.abs(segment.directions[:, 0]) > TURNS
    good = segment.solved.converged & same & turns
    left_out, rounding = segment.errors
    return np.where(good, left_out, np.nan), np.where(good, rounding, np.nan)


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
