"""Corners of a branch, which it has where the traction jumps.

Its direction is not the same on both sides where the tip comes to the height of a jump, and where
the rod comes down to it from beyond, so that an inner phase ends.  A tangent does not lead around a
corner: it is landed on, and the walk goes on from it with the phases and the tangent of what follows.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from ..model.bond import CohesiveLaw
from ..model.stretch import shared_kink
from ..residual.closures import Closing, Closure, Plane
from ..residual.discretisation import PROFILE_POINTS, Discretisation, Profile, Transcription
from ..residual.newton import correct
from ..residual.phases import EXCURSION, Layout, turning_heights, without_thinnest_inner_phase
from .points import Point, place_of

#: Share of its own within which the tip is at the height of a jump.
EXACT_TIP = 1e-8

#: Arclength along a tangent over which it shows on which side of a jump it leads.
ASIDE = 1e-6

#: Steps of a secant to where a rod only touches a jump.
STEPS = 8


class SolutionCurve(Protocol):
    """What a family of equilibria is, for a corner of it."""

    @property
    def law(self) -> CohesiveLaw: ...  # noqa: D102
    @property
    def transcription(self) -> Transcription: ...  # noqa: D102
    @property
    def closure(self) -> Closure: ...  # noqa: D102
    @property
    def tip_free(self) -> bool: ...  # noqa: D102

    def phases_of(self, profile: Profile) -> Layout: ...  # noqa: D102

    def point(  # noqa: D102
        self, problem: Discretisation, x: np.ndarray, forward: np.ndarray, arclength: float, iterations: int
    ) -> Point: ...


def next_corner(curve: SolutionCurve, here: Point, reach: float) -> Point | None:
    """Return the corner that the tangent leads to within ``reach``; None where it leads to none."""
    if not curve.law.jumps or not curve.tip_free:
        return None
    return _tip_at_a_jump(curve, here, reach) or _end_of_inner_phase(curve, here, reach)


def crossed(curve: SolutionCurve, here: Point, there: Point) -> bool:
    """Whether the tip is in another piece of a law that jumps than it was."""
    return bool(curve.law.jumps) and here.problem.phases[0] != there.problem.phases[0]


def _tip_at_a_jump(curve: SolutionCurve, here: Point, reach: float) -> Point | None:
    """Return the point at which the tip is at a jump.

    By the first integrals of (12) the pressure there is the mean traction up to the jump.
    """
    law, old = curve.law, here.problem
    low, high = (_tip(old, x) for x in (here.x, here.x + reach * here.tangent))
    passed = [k for k in law.jumps if (low - k) * (high - k) < 0.0 and abs(low - k) > EXACT_TIP * k]
    if not passed or curve.closure.kind == "pressure":
        return None
    kink = min(passed, key=lambda k: abs(k - low))
    ahead = law.pieces[law.kinks.index(kink) + (high > kink)]
    x = here.x + (kink - low) / (high - low) * reach * here.tangent
    profile = _without_tip_phase(old, x) if _ends(here, x) else _with_tip_phase(old, x)
    phases = old.phases[1:] if _ends(here, x) else (ahead, *old.phases)
    if phases[0] != ahead:
        return None
    new = curve.transcription.discretise(phases)
    given = Closure("pressure", law.mean_traction(kink))
    # Where the traction is its own mean, the pressure says nothing of the height of the tip.
    flat = abs(1.0 - float(ahead.drop(kink)) - given.value)
    if abs(1.0 - float(old.phases[0].drop(kink)) - given.value) > flat:
        met = correct(old, x, (curve.closure, given))
        second: Closing = Plane.across(place_of(old, met), here.direction)
    else:
        second = given
    solved = correct(new, new.pack(profile), (curve.closure, second))
    if not solved.converged or abs(_tip(new, solved.x) - kink) > EXACT_TIP * kink:
        return None
    rise = _tip(new, solved.x + ASIDE * curve.point(new, solved.x, here.direction, 0.0, 0).tangent) - kink
    return _as_corner(curve, here, reach, new, solved.x, turned=rise * (high - low) < 0.0)


def _end_of_inner_phase(curve: SolutionCurve, here: Point, reach: float) -> Point | None:
    """Return the point at which the rod only touches a jump, on whose far side a part of it has been.

    The length of that part goes to zero as the way to the corner does.  The merged shape leaves the
    corner in a direction of its own, in which the height moves away from the jump.
    """
    phases = here.problem.phases
    merged = without_thinnest_inner_phase(here.profile, phases)
    if merged is None:
        return None
    before, after = (here.problem.lengths(x) for x in (here.x, here.x + reach * here.tangent))
    j = min(range(1, len(phases) - 1), key=lambda j: after[j])
    if phases[j - 1] != phases[j + 1] or after[j] >= 0.0:
        return None
    kink = shared_kink(phases[j - 1], phases[j])
    if kink not in curve.law.jumps:
        return None
    plan = curve.phases_of(merged)
    problem = curve.transcription.discretise(plan.phases)
    way = Plane.across(here.place, here.direction, reach * before[j] / (before[j] - after[j]))
    guess = problem.pack(merged.rephased(plan.breaks))
    for _ in range(STEPS):
        solved = correct(problem, guess, (curve.closure, way))
        if not solved.converged:
            return None
        point = curve.point(problem, solved.x, here.direction, 0.0, 0)
        left, aside = (_excess(problem, x, kink) for x in (solved.x, solved.x + ASIDE * point.tangent))
        rate = (aside - left) / ASIDE
        if abs(left) < EXCURSION:
            inwards = rate > 0.0 if phases[j].start == kink else rate < 0.0
            return _as_corner(curve, here, reach, problem, solved.x, turned=inwards)
        way = Plane.across(point.place, point.direction, -left / rate)
        guess = solved.x - left / rate * point.tangent
    return None


def _as_corner(
    curve: SolutionCurve, here: Point, reach: float, problem: Discretisation, x: np.ndarray, *, turned: bool
) -> Point | None:
    """Return a solution as the corner after ``here``, with the tangent that leads away from it."""
    point = curve.point(problem, x, here.direction, 0.0, 0)
    distance = float(np.linalg.norm(point.place - here.place))
    if not distance < 2.0 * reach:
        return None
    forward = -point.direction if turned else point.direction
    return replace(curve.point(problem, x, forward, here.arclength + distance, 0), before=here.problem)


def _tip(problem: Discretisation, x: np.ndarray) -> float:
    """y/y0 at the tip."""
    return float(problem.profile(x).heights()[0, 0])


def _excess(problem: Discretisation, x: np.ndarray, kink: float) -> float:
    """Difference in y/y0 between the vertex nearest to a jump and the jump."""
    heights = turning_heights(problem.profile(x))[1:]
    return float(heights[np.argmin(np.abs(heights - kink))] - kink) if heights.size else np.inf


def _ends(here: Point, x: np.ndarray) -> bool:
    """Whether the phase of the tip has shrunk to nothing on the way to ``x``."""
    lengths = here.problem.lengths(x)
    return len(lengths) > 1 and bool(lengths[0] < 0.5 * here.profile.lengths[0])


def _without_tip_phase(problem: Discretisation, x: np.ndarray) -> Profile:
    profile = problem.profile(x)
    lengths = profile.lengths[1:]
    return Profile(lengths / lengths.sum(), profile.values[1:], profile.scalars)


def _with_tip_phase(problem: Discretisation, x: np.ndarray) -> Profile:
    """Add a phase of no length yet at the tip."""
    profile = problem.profile(x)
    tip = np.repeat(profile.values[:1, :1], PROFILE_POINTS, axis=1)
    return Profile(np.append(0.0, profile.lengths), np.concatenate([tip, profile.values]), profile.scalars)
