"""Points of a branch at which a quantity has a value exactly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..base.checks import finite, listed
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged
from ..residual.closures import HOLDS, Closure, closure_for
from .family import Family
from .points import Point
from .special import Located

#: Distance in the metric of the arclength within which a landing is a point that is there already.
SAME_PLACE = 1e-9

#: How a walk ends whose branch goes on: where steps fail, or there have been enough.
UNFINISHED = ("stalled", "limit")


def asked_at(at: Mapping[str, Sequence[float]] | None) -> list[tuple[str, float]]:
    """Return the quantities and values at which points must lie, one pair for each."""
    if at is None:
        return []
    if not isinstance(at, Mapping):
        raise InvalidInput(
            f"at must give values by quantity, got {at!r:.60}.",
            remedy='Such as at={"pressure_ratio": [0.5]}.',
        )
    known = (*HOLDS, "length_ratio")
    if strange := [name for name in at if name not in known]:
        raise InvalidInput(
            f"unknown quantity {strange[0]!r} in at=.", remedy=f"Choose one of {', '.join(known)}."
        )
    pairs = [(name, finite(name, value)) for name, values in at.items() for value in listed(name, values)]
    return list(dict.fromkeys(pairs))


def require_met(asked: Sequence[tuple[str, float]], met: set[tuple[str, float]], ended: str) -> None:
    """Raise where a value that was asked for is nowhere on a branch, or not on what was walked of it."""
    missed = [f"{name} = {value:g}" for name, value in asked if (name, value) not in met]
    if not missed:
        return
    if ended in UNFINISHED:
        raise NotConverged(
            f"{', nor '.join(missed)}, asked for with at=, not met on the branch as far as it was walked.",
            remedy="Walk further, or ask for values between the ends of what was walked.",
        )
    raise NoEquilibrium(
        f"no point of the branch has {', nor '.join(missed)}, asked for with at=.",
        remedy="Ask for values that the branch takes between its ends.",
    )


def with_asked(
    family: Family, points: list[Point], specials: Sequence[Located], asked: Sequence[tuple[str, float]]
) -> tuple[list[Point], list[Located], set[tuple[str, float]]]:
    """Add special points and points at asked-for values; return those values that are met, too.

    What lands on a point that is there already takes its place: y = y0 is p = T0/2.
    """
    known = {id(p) for p in points}
    points = [*points, *(s.point for s in specials if id(s.point) not in known)]
    points.sort(key=lambda p: p.arclength)
    specials, met = list(specials), set()
    for name, value in asked:
        given = _given(name, value)
        if any(p.miss(given) == 0.0 for p in points):
            met.add((name, value))
        for found in points_at(family, points, name, value):
            met.add((name, value))
            same = next((p for p in points if np.linalg.norm(p.place - found.place) < SAME_PLACE), None)
            landed = found if same is None else replace(found, arclength=same.arclength)
            specials = [replace(s, point=landed) if s.point is same else s for s in specials]
            points = [*(p for p in points if p is not same), landed]
        points.sort(key=lambda p: p.arclength)
    return points, sorted(specials, key=lambda s: s.point.arclength), met


def _given(name: str, value: float) -> Closure:
    return Closure("length", value) if name == "length_ratio" else closure_for(name, value)


def points_at(family: Family, points: list[Point], name: str, value: float) -> list[Point]:
    """Points of a branch at which a quantity has a value exactly."""
    given = _given(name, value)
    misses = [p.miss(given) for p in points]
    found = []
    for i, (here, there) in enumerate(pairwise(points)):
        if misses[i] * misses[i + 1] < 0.0:
            landed = family.at(here, there, given)
            if landed is None:
                raise NotConverged(
                    f"could not land on {name} = {value:g}.",
                    remedy="Ask for a value off a fold, or nearer to the transition.",
                )
            found.append(landed)
    return found
