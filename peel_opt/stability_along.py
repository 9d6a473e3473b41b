"""Stability along branches: the index of every point, and where it changes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from .assembly import discretised, law_of, transcription_from
from .branch import Branch, require_branch
from .closures import Closure
from .continuation import Family
from .errors import InvalidInput
from .small_motions import Stability, analyse, stability
from .transcription.base import Profile

#: Width of a bracket in the tip angle [rad] at which a change counts as located.
LOCATED = 1e-6


@dataclass(frozen=True)
class StabilityChange:
    """A place on a rod's branch where the number or the kind of unstable motions changes.

    Parameters
    ----------
    before, after : str
        "index 1", "flutter", "flutter even under drag", "stable" and the like.
    tip_angles : tuple of float
        Between which it lies [rad]; within 1e-6 unless the rod grazes y0 just there.
    pressure_ratio, length_ratio : float
        Of the state at the first of them.
    """

    before: str
    after: str
    tip_angles: tuple[float, float]
    pressure_ratio: float
    length_ratio: float


def describe(found: Stability) -> str:
    """Return the kind of stability in a word or two."""
    parts = [f"index {found.index}"] if found.index else []
    if found.flutter:
        parts.append("flutter even under drag" if found.growth > 0.0 else "flutter")
    return ", ".join(parts) or "stable"


def with_index(branch: Branch) -> Branch:
    """Return the branch with the number of unstable directions at fixed pressure at each point.

    Flutter counts as two: a complex pair grows.
    """
    if branch.index is not None:
        return branch
    found = [stability(branch, i) for i in range(len(branch))]
    return replace(branch, index=np.array([s.index + 2 * s.flutter for s in found]))


def stability_changes(branch: Branch) -> tuple[StabilityChange, ...]:
    """Locate the changes of stability along the branch of a rod.

    Parameters
    ----------
    branch : Branch

    Returns
    -------
    tuple of StabilityChange
        In order along the branch.

    Raises
    ------
    InvalidInput
        If the branch is not that of a rod.
    """
    if require_branch(branch).hold != "ratio" or branch.solutions is None:
        raise InvalidInput(
            "stability changes are located along the branch of a rod.", remedy="Use trace(rod)."
        )
    family = Family(
        law_of(branch), transcription_from(branch.solutions.transcription), Closure("ratio", branch.held)
    )
    kinds = [describe(stability(branch, i)) for i in range(len(branch))]
    changes = []
    for i in np.flatnonzero([a != b for a, b in pairwise(kinds)]):
        ends = tuple(problem.profile(x) for problem, x in (discretised(branch, int(k)) for k in (i, i + 1)))
        changes.append(_located(family, ends, kinds[i], kinds[i + 1]))
    return tuple(changes)


def _located(family: Family, ends: tuple[Profile, ...], before: str, after: str) -> StabilityChange:
    """Halve a bracket in the tip angle until it is narrow, or the branch cannot be solved inside."""
    low, high = ends
    while high.scalars.A - low.scalars.A > LOCATED:
        middle = Closure("amplitude", 0.5 * (low.scalars.A + high.scalars.A))
        solved = family.solve(low, middle) or family.solve(high, middle)
        if solved is None:
            break
        problem, result = solved
        kind = describe(analyse(family.law, problem, result.x))
        if kind == before:
            low = problem.profile(result.x)
        else:
            high, after = problem.profile(result.x), kind
    s = low.scalars
    return StabilityChange(before, after, (-s.A, -high.scalars.A), s.pressure_ratio, s.sigma)
