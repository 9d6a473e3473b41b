"""Which pieces of the law a moving flap visits, when that changes, and the flap in its new phases."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from ..base.errors import NotConverged
from .arc import Arc
from .flap import Flap, Phase
from .run import Posture, Setting

#: Length, over eta, of a stretch beyond a kink from which it is a phase of its own, and below which a phase
#: ends, at the tip and within the rod.  What is left out of the traction rises with the distance from the
#: kink at the tip, and within the rod, where the stretch is an arc, with its square.
BORN, DEAD = (2.5e-3, 2e-2), (1.5e-3, 1.2e-2)

KEPT = tuple(0.5 * (born + dead) for born, dead in zip(BORN, DEAD, strict=True))

#: Height over eta below a kink from which a stretch within the rod is looked at.
NEAR = -0.05

#: Depth over eta below the plate that is none: heights near the front are as small.
FLAT = 1e-10

#: Points of a phase at which its heights are looked at, a multiple of its degree.
LOOKED = 4

#: Corrections of the places of kinks.
MOST_CORRECTIONS = 8
PLACED = 1e-13


#: Spacing over eta with which crossings of a kink are looked for.
FINE = 5e-4


#: Lengths over eta up to which a phase has a lower degree: its high modes would be those of rounding.
DEGREES = ((0.03, 5), (0.2, 9), (0.8, 15))


#: Share of its greatest length from which a phase has the next degree.
FULL = 0.9


def degrees(lengths: np.ndarray, degree: int) -> tuple[int, ...]:
    """Return the degree of the polynomials of each phase, by its length."""
    return tuple(min([degree, *(low for most, low in DEGREES if length < FULL * most)]) for length in lengths)


class Excess(NamedTuple):
    """How far a flap is beyond its phases, positive from where they must change, and below the plate."""

    beyond: float
    short: float
    long: float
    sunk: float

    @property
    def most(self) -> float:
        """The largest of what changes the phases."""
        return max(self.beyond, self.short, self.long)


def excesses(flap: Flap, u: np.ndarray) -> list[Excess]:
    """Return `Excess` of states, (n, size)."""
    outlines = _over_wall(flap.arc, flap.outline(u, LOOKED * flap.basis.degree))
    return [
        _excess(flap, lengths, outline) for lengths, outline in zip(u[:, flap.lengths], outlines, strict=True)
    ]


def _excess(flap: Flap, lengths: np.ndarray, outline: np.ndarray) -> Excess:
    """Return by how much heights pass the kinks of their phases, and a phase is too short or too long.

    ``sunk`` is how far the tip is below the plate, or the lowest point between it and the front.
    """
    beyond, sunk = [-np.inf], -outline[0, 0, 3]
    # Phases that begin or end where nothing happens at a height of its own: there a height leaves first.
    begins, ends = np.append(True, flap.at_points), np.append(flap.at_points, False)
    for j, phase in enumerate(outline):
        low, high = _between(flap.setting, flap.phases[j])
        heights = phase[:, 3]
        for at_end, i in ((begins[j], 0), (ends[j], -1)):
            if at_end:
                margin = BORN[0] * abs(np.sin(phase[i, 1]))
                beyond += [heights[i] - high - margin, low - heights[i] - margin]
        turns = np.flatnonzero((heights[1:-1] - heights[:-2]) * (heights[2:] - heights[1:-1]) <= 0.0) + 1
        for i in turns.tolist():
            top = heights[i] >= heights[i - 1]
            over = heights[i] - high if top else low - heights[i]
            if max(over, -np.inf if top else -heights[i]) > NEAR:
                height, bend = _turning(phase, i)
                born = 0.125 * abs(bend) * BORN[1] ** 2  # by how much one is beyond that is BORN long
                beyond.append((height - high if top else low - height) - born)
                sunk = sunk if top else max(sunk, -height - born - FLAT)
    sbar, met = float(lengths.sum()), flap.phases[-1].past
    beyond += [sbar - s - BORN[0] for name, s in flap.setting.loads.breaks if name not in met]
    long = [
        length - most
        for length, own in zip(lengths, flap.degrees, strict=True)
        for most, low in DEGREES
        if own == low
    ]
    return Excess(
        float(max(beyond)),
        float(np.max(_dead(begins, ends) - lengths)),
        float(max(long, default=-np.inf)),
        float(sunk),
    )


def _over_wall(arc: Arc, outline: np.ndarray) -> np.ndarray:
    """Return an outline by its angle to the wall, its place along that and its height over it."""
    if not arc:
        return outline
    s, theta, x, y, spin = np.moveaxis(outline, -1, 0)
    turned = theta + arc.curvature * s - arc.angle(x, y)
    return np.stack([s, turned, arc.place(x, y), arc.above(x, y).gap, spin], axis=-1)


def _between(setting: Setting, phase: Phase) -> tuple[float, float]:
    """Return the heights over eta between which a phase stays on its piece of the law."""
    if phase.piece is None:
        return -math.inf, math.inf
    kinks = [-math.inf, *setting.law.kinks, math.inf]
    low, high = kinks[phase.piece : phase.piece + 2]
    return low / setting.ratio, high / setting.ratio


def _dead(begins: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the lengths below which phases end: those between two material points do not."""
    ends_too = np.append(ends[:-1], True)
    alone = begins & ends_too
    dead = np.where(begins | ends, DEAD[0], DEAD[1])
    dead[alone] = -np.inf
    if len(dead) > 1 and alone[-1]:  # the front has come back to a material point
        dead[-1] = DEAD[0]
    return dead


def _turning(phase: np.ndarray, i: int) -> tuple[float, float]:
    """Return the height at which a phase turns near one of its points, and its second derivative there.

    The angle is a multiple of pi there.  The points are too far apart for a parabola.
    """
    places = -np.cos(np.linspace(0.0, np.pi, len(phase)))
    theta, height = (_to_chebyshev(len(phase)) @ phase[:, [1, 3]]).T
    slope, level = chebyshev.chebder(theta), np.pi * round(phase[i, 1] / np.pi)
    place = places[i]
    for _ in range(MOST_CORRECTIONS):
        change = (level - chebyshev.chebval(place, theta)) / chebyshev.chebval(place, slope)
        place = min(max(place + change, places[i - 1]), places[i + 1])
        if abs(change) < PLACED:
            break
    per_length = 2.0 / (phase[-1, 0] - phase[0, 0])
    bend = math.cos(level) * float(chebyshev.chebval(place, slope)) * per_length
    return float(chebyshev.chebval(place, height)), bend


#: The angle of a flap, or its spin, as a function of s.
Along = Callable[[np.ndarray], np.ndarray]


def along(flap: Flap, u: np.ndarray, z: np.ndarray | None = None) -> Callable[[np.ndarray], np.ndarray]:
    """Return theta, x, y and with rates ``z`` the spin of a flap at any s, (n, 4), by its own polynomials."""
    many, ends = flap.basis.degree + 2, np.append(0.0, np.cumsum(u[flap.lengths]))
    series = _to_chebyshev(many) @ flap.outline(u, many, z)[:, :, 1:]

    def values(s: np.ndarray) -> np.ndarray:
        which = np.clip(np.searchsorted(ends, s) - 1, 0, len(series) - 1)
        found = np.empty((len(s), 4))
        for j, coefficients in enumerate(series):
            here = which == j
            places = 2.0 * (s[here] - ends[j]) / (ends[j + 1] - ends[j]) - 1.0
            found[here] = chebyshev.chebval(places, coefficients).T
        return found

    return values


def shapes_of(flap: Flap, u: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Return theta, x and y of states (n, size) at shares of their lengths (m,) as (n, m, 3)."""
    many, lengths = flap.basis.degree + 2, u[:, flap.lengths]
    series = _to_chebyshev(many) @ flap.outline(u, many)[..., 1:4]
    ends = np.cumsum(np.insert(lengths, 0, 0.0, axis=-1), axis=-1)
    s = fractions * ends[:, -1:]
    which = (s[..., None] > ends[:, None, 1:-1]).sum(axis=-1)
    states = np.arange(len(u))[:, None]
    places = 2.0 * (s - ends[states, which]) / lengths[states, which] - 1.0
    polynomials = np.cos(np.arange(many) * np.arccos(np.clip(places, -1.0, 1.0))[..., None])
    found: np.ndarray = (polynomials[..., None, :] @ series[states, which])[..., 0, :]
    return found


@lru_cache(maxsize=8)
def _to_chebyshev(many: int) -> np.ndarray:
    """Matrix from values at Chebyshev points of a phase to coefficients."""
    inverse: np.ndarray = np.linalg.inv(
        chebyshev.chebvander(-np.cos(np.linspace(0.0, np.pi, many)), many - 1)
    )
    return inverse


def through(posture: Posture) -> tuple[Along, Along]:
    """Return the angle and the spin of a posture."""
    return CubicSpline(posture.s, posture.theta), CubicSpline(posture.s, posture.spin)


def laid_out(
    setting: Setting, degree: int, sbar: float, theta: Along, spin: Along | None = None
) -> tuple[Flap, np.ndarray, np.ndarray]:
    """Return the flap of a length with an angle and a spin, in the phases that it visits.

    Returns
    -------
    flap : Flap
    u, z : ndarray
        Its unknowns and their rates; these are zero without a spin.

    Raises
    ------
    NotConverged
        If the places of its kinks were not found.
    """
    phases, lengths = _phases(setting, sbar, theta)
    flap = Flap(setting, phases, degrees(lengths, degree))
    xi, value, slope, _ = flap.basis.looked(LOOKED * flap.basis.degree)
    for _ in range(MOST_CORRECTIONS):
        ends = np.cumsum(lengths)
        s = np.concatenate([end - length * (1.0 - xi) for end, length in zip(ends, lengths, strict=True)])
        fields = np.linalg.lstsq(value, theta(s), rcond=None)[0]
        u = np.concatenate([fields, lengths, np.zeros(len(flap.switches))])
        moved = flap.switches - flap.switched(u)
        starts = _over_wall(flap.arc, flap.outline(u, 2))[1:, 0, 1]
        moved[~flap.at_points] /= np.sin(starts[~flap.at_points])
        lengths = lengths + np.append(moved, 0.0) - np.append(0.0, moved)
        if np.abs(moved).max(initial=0.0) < PLACED * sbar:
            break
        if lengths.min() <= 0.0:
            raise NotConverged("the places where the bond lets go could not be found on the moving rod.")
    if excesses(flap, u[None])[0].most > 0.0:
        raise NotConverged("where the bond lets go could not be told apart on the moving rod.")
    z = np.zeros(flap.size)
    if spin is not None:
        count = len(lengths)
        own = np.repeat(np.eye(count), len(xi), axis=0)
        bent = slope @ fields / (own @ lengths)
        mesh = own @ np.tril(np.ones((count, count))) - own * np.tile(1.0 - xi, count)[:, None]
        held = flap.switches_by(u)
        matrix = np.vstack([np.hstack([value, -bent[:, None] * mesh]), held])
        z[: flap.lengths.stop] = np.linalg.lstsq(matrix, np.append(spin(s), np.zeros(len(held))), rcond=None)[
            0
        ]
    return flap, u, z


def _phases(setting: Setting, sbar: float, theta: Along) -> tuple[tuple[Phase, ...], np.ndarray]:
    """Return the phases of the rod from the tip on, and how long each is."""
    points = [(name, s) for name, s in setting.loads.breaks if s < sbar - KEPT[0]]
    if not points and not setting.law.kinks:
        return (Phase(0),), np.array([sbar])
    s = np.linspace(0.0, sbar, 1 + 2 * math.ceil(sbar / FINE))
    arc, past = Arc(setting.loads.wall_curvature), frozenset[str]()
    phi = theta(s) + arc.curvature * s
    reached, fallen = (cumulative_simpson(part(phi), x=s, initial=0.0) for part in (np.cos, np.sin))
    front_x, front_y = arc.at(np.array(sbar))
    heights = arc.above(front_x + reached - reached[-1], front_y + fallen - fallen[-1]).gap
    runs: list[tuple[Phase, float]] = []
    ends = np.array([0.0, *(point for _, point in points), sbar])
    for j, (start, stop) in enumerate(pairwise(ends.tolist())):
        past |= {points[j - 1][0]} if j else frozenset()
        if setting.loads.unbonded and "unbonded" not in past:
            runs.append((Phase(None, past), start))
            continue
        here = np.append(np.append(start, s[(s > start) & (s < stop)]), stop)
        pieces = _runs(setting, here, np.interp(here, s, heights), to_front=stop == sbar)
        runs += [(Phase(piece, past), place) for piece, place in pieces]
    phases, starts = zip(*runs, strict=True)
    return phases, np.diff([*starts, sbar])


def _runs(setting: Setting, s: np.ndarray, y: np.ndarray, *, to_front: bool) -> list[tuple[int, float]]:
    """Return the pieces of the law that heights run through, and where each begins."""
    kinks = np.array(setting.law.kinks) / setting.ratio
    piece = np.searchsorted(kinks, y)
    runs = [(int(piece[0]), float(s[0]))]
    for i in np.flatnonzero(np.diff(piece)):
        kink = kinks[min(piece[i], piece[i + 1])]
        where = s[i] + (s[i + 1] - s[i]) * (kink - y[i]) / (y[i + 1] - y[i])
        if where - runs[-1][1] < KEPT[len(runs) > 1]:  # too short for a phase
            del runs[-1]
        if not runs or runs[-1][0] != piece[i + 1]:
            runs.append((int(piece[i + 1]), float(where) if runs else float(s[0])))
    if len(runs) > 1 and not to_front and s[-1] - runs[-1][1] < KEPT[0]:
        del runs[-1]
    return runs
