"""Where the stability changes along branches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from ..base.errors import InvalidInput, NotConverged
from ..base.threads import one_thread
from ..continuation.family import Family
from ..continuation.points import Point
from ..equilibria.branch import Branch, require_branch
from ..equilibria.branch_points import law_of, transcription_of, walked
from ..residual.closures import Closure
from ..residual.motions import Spectrum
from .stability import Stability

#: Width of a bracket in the tip angle [rad] at which a change counts as located.
LOCATED = 1e-6

#: Distances from the end of a branch [rad] at which a state stands for a marginal end.
NEAR_THE_END = (1e-5, 1e-4, 1e-3)

#: Changes between two points beyond which they are taken for noise.
MANY = 20


@dataclass(frozen=True)
class StabilityChange:
    """A place on a rod's branch where the number or the kind of unstable motions changes.

    Parameters
    ----------
    before, after : str
        "index 1", "flutter", "flutter even under drag", "stable" and the like.
    tip_angles : tuple of float
        Between which it lies [rad], within 1e-6 of each other.
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
    return ", ".join(parts) or ("marginal" if found.marginal else "stable")


@one_thread
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
    NotConverged
        If the branch cannot be solved where its stability changes.

    Notes
    -----
    The kind of a marginal state, such as the end of a branch at contact, is not known; its
    neighbours decide.  Two changes between neighbouring points that cancel are not seen.
    """
    if isinstance(branch, Branch) and branch.scene is not None:
        raise InvalidInput(
            "stability changes are located along the branch of a rod, and this is that of a scene.",
            remedy="with_stability() of the branch has the stability at each of its points.",
        )
    if require_branch(branch).hold != "ratio" or branch.solutions is None:
        raise InvalidInput(
            "stability changes are located along the branch of a rod.", remedy="Use trace(rod)."
        )
    family = Family(law_of(branch), transcription_of(branch), Closure("ratio", branch.held))
    return tuple(
        change
        for low, high in pairwise(_known(family, walked(branch)))
        for change in _between(family, low, high)
    )


@dataclass(frozen=True, eq=False)
class _State:
    """A point of the branch and the kind of its stability."""

    point: Point
    found: Stability

    @property
    def A(self) -> float:
        return self.point.scalars.A

    @property
    def kind(self) -> str:
        return describe(self.found)


def _known(family: Family, points: Sequence[Point]) -> list[_State]:
    """Analyse the points, without those whose kind rounding would decide.

    The branch ends at contact in such a state: another, just before it, stands for the end.
    """
    states = [_state(family, point) for point in points]
    known = [state for state in states if not state.found.marginal]
    if len(states) > 1 and states[-1].found.marginal:
        before, end = states[-2], states[-1]
        for away in NEAR_THE_END:
            if away >= end.A - before.A:
                break
            near = _landed(family, before, end, end.A - away)
            if near is not None and not near.found.marginal:
                return [*known, near]
    return known


def _between(family: Family, low: _State, high: _State) -> list[StabilityChange]:
    """Locate one change after the other, until the kind is that of the upper end."""
    changes: list[StabilityChange] = []
    while low.kind != high.kind:
        if len(changes) == MANY:
            raise NotConverged(
                f"the stability changes more than {MANY} times between two points.",
                remedy="Trace more points, with a smaller tol.",
            )
        left, right = low, high
        while right.A - left.A > LOCATED:
            middle = _landed(family, left, right, 0.5 * (left.A + right.A))
            if middle is None:
                raise NotConverged(
                    f"the branch could not be solved at tip angles from {-left.A:.6g} to {-right.A:.6g},"
                    " where its stability changes.",
                    remedy="Trace more points.",
                )
            left, right = (middle, right) if middle.kind == low.kind else (left, middle)
        s = left.point.scalars
        changes.append(StabilityChange(left.kind, right.kind, (-left.A, -right.A), s.pressure_ratio, s.sigma))
        low = right
    return changes


def _landed(family: Family, low: _State, high: _State, A: float) -> _State | None:
    """Solve between two states at a tip angle; None on failure."""
    landed = family.at(low.point, high.point, Closure("amplitude", A))
    return None if landed is None else _state(family, landed)


def _state(family: Family, point: Point) -> _State:
    return _State(point, Stability.read(Spectrum(point.problem, point.x)))
