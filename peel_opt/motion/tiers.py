"""A run by what computes it best: the front tracked, and a mesh where that cannot go on; each twice.

What two resolutions differ by is the error of the finer one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import takewhile
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BarycentricInterpolator

from ..base.errors import NotConverged
from .follow import beyond, joined, posture_of, taken_over
from .mesh import LINKS, MOST, run_on_mesh
from .run import Posture, Setting, Told, Track, Until
from .tracking import MESHES, track
from .trajectory import Happening

#: Largest error of front and tip over eta, or of the identity, with which a finer run is not tried, by the
#: resolution, of which each takes twice the time of the one before.
GOOD = (0.0, 2e-6, 2e-5, 1e-3)

#: Error over eta of a run on a mesh.
MESHED = 1e-4

#: By what share of the front two runs that were lost may be apart, and what share of the longer one they must
#: have in common.
LOST, COMMON = 1e-3, 0.8

#: Length over that of the unfolded state with which a motion begins on a mesh.
OPENED = 1.01

#: Steps without which a mesh does not come to anything new.
FEWEST = 400

#: Runs that are lost before one gives in: where they must end on the plate, and where a mesh may go on.
MOST_LOST = (2, 3)

#: States that a moment between two of them is read off.
NEAR = 4


class Known(NamedTuple):
    """A run, its error and that of its times."""

    run: Track
    error: float
    time_error: float


def best(setting: Setting, start: Posture, until: Until, told: Told) -> Known:
    """Run by what computes it best.

    A mesh goes on where a tracked front comes down on the plate or is lost.  If hardly anything of it was
    resolved, all is done on the mesh: from a length that is not that of the unfolded state itself, which a
    mesh has elsewhere.
    """
    # What follows the landing of a rod with mass depends on how it bounces.
    meshed = replace(until, contact=until.contact or bool(setting.mass))
    if setting.bond != "reversible":
        return _on_meshes(setting, start, meshed, told)
    beyond_contact = not (until.contact or setting.mass)
    try:
        known = _tracked(setting, start, replace(until, arc=beyond_contact), told)
        if not (beyond_contact and _goes_on(known.run)):
            return known
        then = _gone_on(setting, known, until, told)
        if known.run.outcome != "arc" or any(e.kind == "contact" for e in then.run.events):
            return then
        known = _tracked(setting, start, until, told)  # the arc rose again: the front is known better
        return _gone_on(setting, known, until, told) if _goes_on(known.run) else known
    except NotConverged:
        opened = replace(start, s=OPENED * start.s)
        return _on_meshes(setting, opened, meshed, told)


def _on_meshes(setting: Setting, start: Posture, until: Until, told: Told) -> Known:
    """Run on two meshes.

    What swings passes few angles for the first time: there the fronts count at all times.
    """
    coarse, fine = (
        run_on_mesh(setting, start, until, resolution=resolution, told=told) for resolution in (0, 1)
    )
    error, time_error = apart(coarse, fine)
    if setting.mass:
        error, time_error = map(_largest, zip((error, time_error), apart_in_time(coarse, fine), strict=True))
    return Known(fine, error, time_error)


def _is_lost(run: Track) -> bool:
    """Whether a run ends where its front was lost."""
    return run.events[-1].kind == "given up"


def _goes_on(run: Track) -> bool:
    """Whether there is more to a motion than a tracked run of it."""
    return run.outcome in {"contact", "arc"} or _is_lost(run)


def _gone_on(setting: Setting, first: Known, until: Until, told: Told) -> Known:
    """Let a mesh go on from a tracked run.

    From where it takes over to the end of that run the front is known by both.
    """
    run, at = first.run, taken_over(setting, first.run)
    if _is_lost(run) and FEWEST * run.front[at] > MOST[1] * LINKS[1]:
        return first
    coarse, then = (beyond(setting, run, at, until, resolution=i, told=told) for i in (0, 1))
    if _is_lost(run) and then.t[-1] < run.t[-1]:
        return first
    known = [apart(coarse, then), (first.error, first.time_error)]
    landing = next((e for e in then.events if e.kind == "contact"), None)
    if run.outcome != "contact":
        known.append((_distance(_when(run, run.t[-1]), _when(then, run.t[-1])), math.nan))
    elif landing is not None:
        events = tuple(e for e in then.events if e.t <= landing.t)
        known.append(apart(run, replace(then, events=events, outcome="contact")))
    if (rested := _rested(setting, then, until, told)) is not None:
        known[0] = apart(*(_up_to_rise(mesh, coarse, then) for mesh in (coarse, then)))
        then = rested
    places, times = zip(*known, strict=True)
    return Known(then, _largest(places), _largest(times))


def _rested(setting: Setting, run: Track, until: Until, told: Told) -> Track | None:
    """Return a run on a mesh with its front tracked from the last lift of its tip on, if that rests folded.

    Close to T0 the height of a folded tip is the difference of two nearly equal numbers, of which a mesh
    knows few digits.
    """
    lifts = [e.t for e in run.events if e.kind == "lift"]
    if not (lifts and until.arrest and run.outcome in {"folded", "touching"}):
        return None
    at = int(np.searchsorted(run.t, lifts[-1]))
    try:
        rest = track(setting, posture_of(run, at), replace(until, contact=True), told=told)
    except NotConverged:
        return None
    return joined(run, at, rest) if rest.outcome == "folded" else None


def _up_to_rise(run: Track, *both: Track) -> Track:
    """Return a run up to the first lift of its tip, or where one of two was not lifted, up to its landing."""
    lifted = all(any(e.kind == "lift" for e in one.events) for one in both)
    end = next(e.t for e in run.events if e.kind == ("lift" if lifted else "contact"))
    return replace(run, events=tuple(e for e in run.events if e.t <= end), outcome="contact")


def _tracked(setting: Setting, start: Posture, until: Until, told: Told) -> Known:
    """Track the front at one resolution after another until two runs agree; return the finer one.

    They need not agree to more digits than a mesh has where one is to go on, and may be lost there.

    Raises
    ------
    NotConverged
        If no two agree, or a second one is lost with too little to go on from.
    """
    coarse, error, lost = None, math.inf, []
    for resolution in range(len(MESHES)):
        try:
            run = track(setting, start, until, resolution=resolution, told=told)
        except NotConverged as why:
            lost.append(why)
            known = _in_common(setting, lost) if until.arc else None
            if known is not None:
                return known
            if len(lost) == MOST_LOST[until.arc] or resolution == len(MESHES) - 1:
                raise
            continue
        if coarse is not None:
            error, time_error = apart(coarse, run)
            missed = max(error, float(np.abs(run.identity).max()))
            goes_on = _goes_on(run) and not (until.contact or setting.mass)
            if missed <= max(GOOD[resolution], MESHED if goes_on else 0.0):
                return Known(run, error, time_error)
        coarse = run
    raise NotConverged(
        f"front and tip of two runs differ by {error:.1e} eta.",
        remedy="Give a time or a rod_length to end at.",
    )


def _in_common(setting: Setting, lost: list[NotConverged]) -> Known | None:
    """Return what the last two runs that were lost have in common, if it is most and no mere start."""
    parts: list[Track] = [part for why in lost for part in why.candidates][-2:]
    if len(parts) < 2:
        return None
    coarse, fine = parts
    both = fine.t[fine.t <= coarse.t[-1]]
    differ = [_distance(_when(coarse, t), _when(fine, t)) for t in both]
    n = int(np.argmax(np.append(np.array(differ) > LOST * fine.front[: len(both)], True)))
    longest = max(coarse.t[-1], fine.t[-1]) - fine.t[0]
    if n < NEAR or both[n - 1] - fine.t[0] < COMMON * longest:
        return None
    fine = fine.until(n)
    if fine.front[taken_over(setting, fine)] < OPENED * fine.front[0]:
        return None
    return Known(fine, *apart(coarse, fine))


def apart(coarse: Track, fine: Track) -> tuple[float, float]:
    """Return the largest difference of front and tip at one angle, and of times, between two runs.

    Where a motion starts from a nudge its time is that of the first angle it passes: the nudge is arbitrary.
    Two runs that end differently are as far apart as their ends.
    """
    named = [[e for e in run.events if e.kind == "angle"] for run in (coarse, fine)]
    pairs = list(takewhile(lambda ab: abs(ab[0].angle - ab[1].angle) < 1e-6, zip(*named, strict=False)))
    if coarse.outcome == fine.outcome and fine.outcome in {"not settled", "arc"}:  # one may have come further
        t = min(coarse.t[-1], fine.t[-1])
        pairs.append((_when(coarse, t), _when(fine, t)))
    elif not coarse.outcome == fine.outcome == "flapping":
        pairs.append((_end(coarse), _end(fine)))
    if not pairs:
        return math.nan, math.nan
    begins = pairs[0][0].t - pairs[0][1].t
    later = [(a, b) for a, b in pairs[1:] if a.kind in {"angle", "contact", "end of rod"}]
    return max(_distance(a, b) for a, b in pairs), _largest([abs(a.t - b.t - begins) for a, b in later])


def _largest(values: Iterable[float]) -> float:
    """Return the largest of what is known; nan if nothing is."""
    return max((value for value in values if not math.isnan(value)), default=math.nan)


def apart_in_time(coarse: Track, fine: Track) -> tuple[float, float]:
    """Return by how much the fronts of two runs from one start differ, and the times of what happens in both.

    A front counts as far as it is from all that the other has within that time.
    """
    passed: list[dict[float, list[float]]] = [{}, {}]
    for run, times in zip((coarse, fine), passed, strict=True):
        for event in run.events:
            if event.kind == "angle":
                times.setdefault(round(event.angle, 1), []).append(event.t)
    both = [(passed[0][angle], passed[1][angle]) for angle in passed[0].keys() & passed[1].keys()]
    shifts = [np.abs(np.subtract(*pair)).max() for pair in both if len(pair[0]) == len(pair[1])]
    shift = float(max(shifts, default=0.0))
    return max(_missed(coarse, fine, shift), _missed(fine, coarse, shift)), shift


def _missed(run: Track, other: Track, shift: float) -> float:
    """Return how far the front of a run is at most from all that another has within a time."""
    t = np.union1d(run.t, other.t)  # one that has ended keeps its last front
    front = np.interp(t, run.t, run.front)
    begin, end = (np.interp(t + by, other.t, other.front) for by in (-shift, shift))
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    first, last = np.searchsorted(other.t, t - shift), np.searchsorted(other.t, t + shift, "right")
    for i in np.flatnonzero(last > first):
        within = other.front[first[i] : last[i]]
        low[i], high[i] = min(low[i], within.min()), max(high[i], within.max())
    return float(np.maximum(np.maximum(low - front, front - high), 0.0).max())


def _distance(a: Happening, b: Happening) -> float:
    """Return the largest difference of front and tip between two moments."""
    return max(abs(a.front - b.front), abs(a.x - b.x), abs(a.y - b.y))


def _end(run: Track) -> Happening:
    """Return the moment at which a run ends."""
    return _when(run, run.t[-1]) if run.outcome == "arc" else run.events[-1]


def _when(run: Track, t: float) -> Happening:
    """Return where front and tip of a run were at a time, by cubics through the states about it."""
    last = min(max(int(np.searchsorted(run.t, t)) + 2, NEAR), len(run.t))
    near = slice(max(last - NEAR, 0), last)
    at = (run.front, run.tip.y, run.tip.x, run.tip.angle)
    found = BarycentricInterpolator(run.t[near], np.array([values[near] for values in at]).T)(t)
    return Happening("time", t, *found.tolist())
