"""The part of a rod's branch that the charts of seeds cover: found at once, not step after step.

From T over the minimum pressure up to where the tip of the folded rod is nearly back at y0, or to the
contact of a compliant rod.  The starts are no solutions: all are solved for, each must follow the one
before it as the points of a walk do, and what does not ends the part.  A walk goes on from its last point.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.threads import one_thread
from ..model.rod import RATIOS
from ..residual.accuracy import can_estimate
from ..residual.batch import solve
from ..residual.closures import READINGS, charts
from ..residual.spectral import Spectral
from ..residual.stack import TAIL, Stack, stack_of
from .family import Family, transition
from .points import Point
from .seeds import LEAVES
from .seeds import charts as seed_charts
from .segments import NEAR, Segment, arclengths
from .special import CONTACT, LENGTH, PRESSURE, Located, Monitor, tip_excess

#: Largest arclength between states, and angle between their directions [rad].
APART, TURN = 0.25, 0.25

#: Least arclength of what a branch has left where the charts of its folded states end.
REST = 1.5

#: Least cosine between the directions of neighbours, and of a direction with the chord.
STRAIGHT = 0.85

#: Places along each chart by which its length is measured, closer towards its beginning: where the tip of a
#: stiff rod leaves y0 the branch all but turns at once.
PLACES = np.linspace(0.0, 1.0, 64) ** 2

#: Places along a chart at which a mesh is tried.
SAMPLED = np.linspace(0.1, 1.0, 6)

#: Largest share of its last coefficients in a shape that a mesh is taken to resolve.
RESOLVED = 1e-2

#: By how much a rod may be beyond y0 where it is not to be, or short of it; and where a chart ends.
NOISE, OVERSHOT = 1e-9, 1e-3

#: What folds of a rod's branch, by the kind of fold.
TURNS = {"LP-pressure": READINGS["pressure"], "LP-length": READINGS["length"]}

#: Fewer states are not worth it.
LEAST = 4

#: Special points that charts end with, and p/T0 there.
END_OF = {"within": "y=y0", "folded": "contact"}
ENDS = {"y=y0": 0.5, "contact": 1.0}

#: What vanishes at each.
MONITORS: dict[str, Monitor] = dict([PRESSURE, LENGTH, CONTACT, ("y=y0", tip_excess)])


@dataclass(frozen=True, eq=False)
class Charted:
    """What the charts lead to of a branch.

    Parameters
    ----------
    points : list of Point
        From T on.
    specials : list of Located
        Folds, where the tip leaves y0, and the contact, as far as they are among the points.
    """

    points: list[Point]
    specials: list[Located]


def covers(family: Family) -> bool:
    """Whether the charts hold states of a family: a rod's, under law (8) or up to y0 the linear law."""
    of_a_rod = family.closure.kind == "ratio" and RATIOS[0] <= family.closure.value <= RATIOS[1]
    return of_a_rod and family.law.falls_straight and family.tip_free and can_estimate(family.transcription)


@one_thread
def is_coarse(family: Family, tol: float) -> bool:
    """Whether a mesh, and not rounding, misses a tolerance on the last chart of a rod."""
    if not covers(family):
        return False
    name = _ways(family)[-1][-1]
    stack, x = _on_mesh(family, name, _on(name, family.closure.value, SAMPLED))
    segment = Segment.at(stack, family.closure, x[:, TAIL][:, 0], x)
    mesh, rounding = segment.errors
    return bool(np.any(segment.solved.converged & (mesh > np.maximum(tol, rounding))))


@one_thread
def charted(family: Family, points: int = 0) -> Charted | None:
    """Solve for the states of a branch on the charts; None where they do not lead away from T.

    Parameters
    ----------
    family : Family
        One that is covered.
    points : int
        Least number of points that the whole branch is to have.
    """
    apart = _spacing(family, points)
    segments: list[Segment] = []
    ends: list[tuple[str, float]] = []
    for names in _ways(family):
        segment = _segment(family, names, apart, segments[-1].A[-1] if segments else 0.0)
        kind = END_OF.get(names[-1], "")
        leading = _leading(segment, OVERSHOT if kind else NOISE)
        whole = leading == len(segment)
        ended = _ended(segment, kind) if whole and kind else None
        if ended is not None:
            segment, error = ended
            ends.append((kind, error))
        elif kind:
            leading = min(leading, _leading(segment, NOISE))
        if leading < LEAST:
            break
        segments.append(segment if ended else segment.of(np.arange(leading)))
        if not whole or (kind and ended is None):
            break
    return _joined(family, segments, ends) if segments else None


def _ways(family: Family) -> list[tuple[str, ...]]:
    """Charts of a rod, those of one layout together."""
    if family.closure.value < LEAVES:
        return [("whole", "folded")]
    return [("within",)] if family.law.is_linear else [("within",), ("beyond", "returning")]


def _segment(family: Family, names: Sequence[str], apart: float, begins: float) -> Segment:
    """Solve for states on charts of one layout, from the tip angle on where it begins."""
    x = np.concatenate(list(_starts(family.closure.value, names, apart)))
    stack, x = _on_mesh(family, names[0], x)
    A = x[:, TAIL][:, 0].copy()
    A[0] = begins
    return Segment.at(stack, family.closure, A, x)


def _on_mesh(family: Family, name: str, x: np.ndarray) -> tuple[Stack, np.ndarray]:
    """Return starts of a chart on the mesh of a family, and what they are starts of."""
    chart, law = seed_charts()[name], family.law
    assert isinstance(family.transcription, Spectral)
    stack = stack_of(family.transcription, law.pieces[:1] if len(chart.phases) == 1 else law.pieces[::-1])
    return stack, x if stack.settings == chart.stack.settings else chart.stack.prolonged(x, stack)


def _spacing(family: Family, points: int) -> float:
    """Arclength between the states if the whole branch is to have so many points."""
    if not points:
        return APART
    length = sum(
        float(np.linalg.norm(_steps(family.closure.value, name), axis=1).sum())
        for names in _ways(family)
        for name in names
    )
    if _ways(family)[-1][-1] != "folded":
        length += REST
    return min(APART, length / (points - 1))


def _on(name: str, ratio: float, shares: np.ndarray) -> np.ndarray:
    """Starts of a rod along a chart."""
    return seed_charts()[name].rods(np.full(len(shares), ratio)).starts(shares)


def _steps(ratio: float, name: str) -> np.ndarray:
    """Steps between `PLACES` along a chart, in the coordinates of the arclength."""
    steps: np.ndarray = np.diff(charts(np.ascontiguousarray(_on(name, ratio, PLACES)[:, TAIL]))[0], axis=0)
    return steps


def _starts(ratio: float, names: Sequence[str], apart: float) -> Iterator[np.ndarray]:
    """Starts along the charts of a rod, no further apart than a branch is followed by."""
    for name in names:
        steps = _steps(ratio, name)
        length = np.linalg.norm(steps, axis=1)
        cosine = (steps[1:] * steps[:-1]).sum(axis=1) / (length[1:] * length[:-1])
        turned = np.arccos(np.clip(cosine, -1.0, 1.0))
        between = 0.5 * (np.append(turned, 0.0) + np.insert(turned, 0, 0.0))
        effort = np.concatenate([[0.0], np.cumsum(np.maximum(length / apart, between / TURN))])
        count = max(int(np.ceil(effort[-1])), 4)
        chosen = np.interp(np.linspace(0.0, effort[-1], count + 1), effort, PLACES)
        # One chart begins where the one before it ends.
        yield _on(name, ratio, chosen[int(name != names[0]) :])


def _leading(segment: Segment, noise: float) -> int:
    """Number of states from the first on that follow one another along the branch, in their phases."""
    solved, A = segment.solved, segment.A
    with np.errstate(invalid="ignore"):
        good = solved.converged & (segment.resolved < RESOLVED) & (np.diff(A, prepend=-1.0) > 0.0)
        stack = segment.stack
        assert isinstance(stack, Stack)
        heights = stack.heights(solved.x)
        if stack.free:
            share = stack.shares(solved.x)
            good &= (heights[:, 0] > 1.0 - NOISE) & (np.abs(share - 0.5) < 0.5 + NOISE)
            good &= heights[:, 1:].max(axis=1) < 1.0 + NOISE
        elif np.isfinite(stack.phases[0].stop):
            good &= heights.max(axis=1) < 1.0 + noise
        chord = np.diff(segment.places, axis=0)
        chord /= np.linalg.norm(chord, axis=1, keepdims=True)
        along = segment.directions
        for a, b in ((along[:-1], along[1:]), (along[:-1], chord), (chord, along[1:])):
            good[1:] &= (a * b).sum(axis=1) > STRAIGHT
    return len(good) if good.all() else int(np.argmin(good))


def _ended(segment: Segment, kind: str) -> tuple[Segment, float] | None:
    """Return a segment that ends where the tip leaves y0 or touches the plate, and the error of that place.

    Both are equations of the state itself: p y_tip = Phi(y_tip) gives p = T0/2 at y0, and T0 at the plate.
    """
    last, held = len(segment) - 1, segment.held
    given = np.array([[held.value, ENDS[kind]]])
    solved = solve(segment.stack, (held.kind, "pressure"), given, segment.solved.x[last:], sharp=True)
    if not solved.converged[0]:
        return None
    end = Segment.at(segment.stack, held, solved.scalars.A, solved.x, sharp=True)
    near = APART / segment.speeds[last]
    if not (end.solved.converged[0] and abs(end.A[0] - segment.A[last]) < near):
        return None
    before = segment.of(np.flatnonzero(segment.A + NEAR / segment.speeds < end.A[0]))
    error = solved.errors(lambda s: s.A)[0] * end.speeds[0]
    return before.with_states(end), float(error)


def _joined(family: Family, segments: Sequence[Segment], ends: Sequence[tuple[str, float]]) -> Charted | None:
    """Return the segments as points and special points; None where a fold is lost."""
    turned = [segment.with_folds(TURNS) for segment in segments]
    if any(found is None for found in turned):
        return None
    whole = [found for found in turned if found is not None]
    # Where the layout changes, the state is there in both.
    kept = [segment.of(np.arange(int(k > 0), len(segment))) for k, (segment, _) in enumerate(whole)]
    names = ("places", "velocities", "A")
    along = arclengths(*(np.concatenate([getattr(part, name) for part in kept]) for name in names))
    first, points, specials = 0, [], []
    for k, (segment, (_, folds)) in enumerate(zip(kept, whole, strict=True)):
        own = segment.points(along[first : first + len(segment)])
        for fold in folds:
            point = own[fold.row - int(k > 0)]
            bracket = (point.arclength - fold.width, point.arclength + fold.width)
            specials.append(Located(fold.kind, point, bracket, MONITORS[fold.kind], fold.error))
        if k < len(ends):
            kind, error = ends[k]
            end = own[-1].arclength
            specials.append(Located(kind, own[-1], (end, end), MONITORS[kind], error))
        points += own
        first += len(segment)
    beginning = transition(family)
    points[0] = replace(beginning, errors=points[0].errors)
    return Charted(points, sorted(specials, key=lambda s: s.point.arclength))
