"""Where the states of a branch end: its folds and the contact, located again on a finer mesh.

A walk knows its folds as well as its own mesh does, some 1e-11 of p/T0.  A question that close to a
fold is asked of the finer mesh, and what a refusal names as the nearest value is the fold found there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..residual.closures import Closure, Plane
from .family import Family
from .points import Point
from .primary import Candidate, PrimaryBranch, crossings
from .special import Located

#: Arclength on either side of a fold within which it is looked for again.
REACH = 0.02

#: Distance from a fold, as a share of the given number, within which its mesh may matter.
BESIDE = 1e-6


@dataclass(frozen=True, eq=False)
class Sharpened:
    """An end of states on a finer mesh than that of its walk, with a point on either side."""

    family: Family
    points: Sequence[Point]

    @property
    def end(self) -> Point:
        """The fold or the contact itself."""
        return self.points[1]


def sharpened(branch: PrimaryBranch, located: Located) -> Sharpened | None:
    """Locate a fold of a branch, or its contact, again on a finer mesh; None where that fails."""
    finer = replace(branch.family, transcription=branch.family.transcription.refined())
    walked = located.point
    solved = finer.solve(walked.profile, Plane.across(walked.place, walked.direction))
    if solved is None:
        return None
    problem, result = solved
    start = finer.point(problem, result.x, walked.direction, walked.arclength, result.iterations)
    before, after = finer.step(start, -REACH), finer.step(start, REACH)
    vanishes = located.monitor
    if before is None or after is None or vanishes(before) * vanishes(after) > 0.0:
        return None
    end, _ = finer.turning_point(before, after, vanishes)
    return Sharpened(finer, (before, end, after))


def beside_folds(branch: PrimaryBranch, given: Closure) -> list[Candidate]:
    """States that a question has beside a fold, where the mesh of the walk may not see them."""
    found: list[Candidate] = []
    for located in branch.folds:
        off = abs(located.point.miss(given)) / (1.0 + abs(given.value))
        fold = sharpened(branch, located) if off < BESIDE else None
        if fold is not None:
            found += crossings(fold.family, fold.points, given, branch.state_at)
    return found
