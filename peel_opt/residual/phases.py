"""Which pieces of the law a shape visits, and where it changes from one to the next."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..base.roots import between
from ..model.bond import CohesiveLaw
from .discretisation import Phases, Profile, held

#: Excursions past a kink smaller than this (in u = y/y0) are left in their phase: the error
#: they make goes with the power 3/2.
EXCURSION = 1e-9

#: An extremum this close to a kink may pass it between two points of a profile.
GRAZING = 1e-4

#: Share of the greatest height within which a tip may be on the plate, on the coarsest mesh.
ON_PLATE = 0.05

#: Share of its other factor that the factor of p y_tip = Phi(y_tip) is below which a mesh has as zero.
VANISHES = 0.1


@dataclass(frozen=True)
class Layout:
    """Phases from the tip to the detachment point and the xi where they change."""

    phases: Phases
    breaks: tuple[float, ...]


def layout(law: CohesiveLaw, profile: Profile, *, tip_free: bool = True) -> Layout:
    """Read the phases of a shape off its heights; its tip may be held to the plate if not ``tip_free``."""
    pieces = law.pieces if tip_free else held(law.pieces)
    if len(pieces) == 1:
        return Layout(pieces, ())
    crossings = kink_crossings(law, profile)
    # The detachment point has u = 0: without a crossing everything is in the first piece.
    sequence, breaks = [pieces[crossings[0][1] if crossings else 0]], []
    for where, _, after in crossings:
        sequence.append(pieces[after])
        breaks.append(where)
    return Layout(tuple(sequence), tuple(breaks))


def holds_its_tip(law: CohesiveLaw, profile: Profile) -> bool:
    """Whether a solution has its tip on the plate at a pressure that would lift a free one.

    Of p y_tip = Phi(y_tip) one factor vanishes, the height of the tip or p/T0 - Phi(u)/u, but on a coarse
    mesh only up to its error: it is the smaller one.
    """
    s, heights = profile.scalars, profile.values[:, :, 4]
    if s.beta0 == 0.0 or abs(heights[0, 0]) > ON_PLATE * np.abs(heights).max():
        return False
    extra, drop = s.alpha1 / s.beta0, law.mean_drop(float(s.height(heights[0, 0])))
    missed = abs(extra + drop)
    return abs(drop) < VANISHES * missed and missed > VANISHES * abs(extra) + 1e-7


def fits(profile: Profile, phases: Phases) -> bool:
    """Whether every phase lies clearly inside its piece: a cheap look before `layout`."""
    if not np.all(profile.lengths > 0.0):
        return False
    for u, piece in zip(profile.heights(), phases, strict=True):
        # The law goes on below u = 0; a phase ends on a kink, and inside keeps away from it.
        low = piece.start if piece.start > 0.0 else -np.inf
        if np.any(u[1:-1] <= low) or np.any(u[1:-1] >= piece.stop):
            return False
        for inner in (np.argmin(u), np.argmax(u)):
            grazes = min(u[inner] - low, piece.stop - u[inner]) < GRAZING
            if grazes and 0 < inner < len(u) - 1:
                return False
    tip, first = float(profile.heights()[0, 0]), phases[0]
    low = first.start + GRAZING if first.start > 0.0 else -np.inf
    return low < tip < first.stop - GRAZING


def heights_with_extrema(profile: Profile) -> tuple[np.ndarray, np.ndarray]:
    """u on the profile's points, and at the vertices of its interior extrema."""
    xi, u = profile.coordinates().ravel(), profile.heights().ravel()
    keep = np.append(True, np.diff(xi) > 0)
    xi, u = xi[keep], u[keep]
    width = np.diff(xi)
    slope = np.diff(u) / width
    turning = np.flatnonzero(slope[:-1] * slope[1:] < 0) + 1
    if not turning.size:
        return xi, u
    # Of the parabola through each and its neighbours.
    before, after = slope[turning - 1], slope[turning]
    along = before * width[turning] + after * width[turning - 1]
    extra = xi[turning] - 0.5 * along / (after - before)
    at_extra = profile.heights_at(extra)
    order = np.argsort(np.concatenate([xi, extra]), kind="stable")
    return np.concatenate([xi, extra])[order], np.concatenate([u, at_extra])[order]


def turning_heights(profile: Profile) -> np.ndarray:
    """u at the tip, and at every interior extremum after it."""
    _, u = heights_with_extrema(profile)
    turns = np.flatnonzero((u[1:-1] - u[:-2]) * (u[2:] - u[1:-1]) <= 0.0) + 1
    return u[[0, *turns]]


def kink_crossings(law: CohesiveLaw, profile: Profile) -> list[tuple[float, int, int]]:
    """(xi, piece before, piece after) wherever what the bond sees passes a kink, from the tip on."""
    xi, u = heights_with_extrema(profile)
    return sorted(
        crossing
        for below, kink in enumerate(law.kinks)
        for crossing in _crossings(profile, xi, u - kink, kink, below)
    )


def _crossings(
    profile: Profile, xi: np.ndarray, excess: np.ndarray, kink: float, below: int
) -> list[tuple[float, int, int]]:
    """(xi, piece before, piece after) wherever the height passes ``kink``."""
    sure = np.flatnonzero(np.abs(excess) > EXCURSION)
    found = []
    for i, j in pairwise(sure):
        if excess[i] * excess[j] < 0:

            def height(x: float) -> float:
                return float(profile.heights_at(np.array([x]))[0]) - kink

            where = between(
                height, (float(xi[i]), float(xi[j])), (float(excess[i]), float(excess[j])), EXCURSION
            )
            pair = (below + 1, below) if excess[i] > 0 else (below, below + 1)
            found.append((where, *pair))
    return found


def without_empty_phases(profile: Profile) -> Profile | None:
    """Drop phases whose length is not positive; None if there are none."""
    keep = profile.lengths > 0
    if keep.all():
        return None
    lengths = profile.lengths[keep]
    return replace(profile, lengths=lengths / lengths.sum(), values=profile.values[keep])


def without_thinnest_inner_phase(profile: Profile, phases: Phases) -> Profile | None:
    """Lower the thinnest phase that lies between two of the same piece to the kink.

    None if there is no such phase.  The heights are clipped so that `layout` no longer sees
    the excursion; the result is a start, not a solution.
    """
    inner = [j for j in range(1, len(phases) - 1) if phases[j - 1] == phases[j + 1]]
    if not inner:
        return None
    j = min(inner, key=lambda j: profile.lengths[j])
    return _level(profile, j, profile.values[j, 0, 4])


def without_middle_phase(profile: Profile) -> Profile:
    """Lower the phase at the middle of a symmetric strip, where its height has an extremum, to the kink."""
    return _level(profile, 0, profile.values[0, -1, 4])


def _level(profile: Profile, phase: int, height: float) -> Profile:
    values = profile.values.copy()
    values[phase, :, 4] = height
    return replace(profile, values=values)
