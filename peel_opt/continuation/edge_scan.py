"""Starts for every equilibrium at a pressure, by a scan of the reaction at the clamped edge.

A state is a reaction R whose rod has N_y = theta' = 0 where it crosses the height of the tip.
There the first integral H leaves

    theta'^2 = 2 N_y sin(theta),

so that w = |N_y| - |sin(theta)| + i sqrt(2) theta' has the modulus |N_y| + |sin(theta)|.  A state is
where w passes the negative axis; on the positive axis the rod only touches the height, with
theta' = 0 but a load.  By the same equation a touch is an inflection: no pair of crossings is born
at it, and the k-th crossing is a smooth function of R.  So each crossing is followed over R: an interval
across which one turns, or moves, too far is divided, until none does or doubles do not tell its
ends apart.  What such rods do farther on is not known, and the scan says from which length on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ..base.arrays import EPS
from ..model.equations import Scalars
from ..model.groups import PI4
from ..residual.discretisation import PROFILE_POINTS, Profile, chebyshev
from .edge_shooting import FIRST, Crossings, EdgeShooting

#: Reactions to begin with, how they crowd towards zero, and parts into which an interval is divided.
BEGIN, CROWDED, PARTS = 161, 7.0, 24

#: The most reactions that are tried.
MOST = 8000

#: The farthest that w and the angle of a crossing may turn between neighbours.
TURN, SWING = 0.5 * math.pi, 0.6

#: Factor on the fastest turn seen nearby, in the bound of what w may do between neighbours.
WARY = 2.0

#: The farthest that it may move, as shares of its place and of the length of the layer.
SHARE, SHIFT = 0.1, 0.3

#: Distance between reactions that doubles still tell apart.
ROUNDING = 8.0 * EPS

#: How often an interval that holds a state is divided to sharpen the start.
SHARPENED = 2

#: Scaled length beta1^(1/4) of a piece of the profile of a start.
PIECE = 4.0


@dataclass(frozen=True)
class EdgeScan:
    """What a scan has found.

    Parameters
    ----------
    starts : list of Profile
        One for each state.
    reached : float
        sbar/eta below which there are no others.
    """

    starts: list[Profile]
    reached: float


def scan(shooting: EdgeShooting) -> EdgeScan:
    """Find a start for every state up to the greatest length."""
    known = _resolved(shooting)
    reached = _reached(shooting, known)
    for _ in range(SHARPENED):
        inside = np.unique(_states(shooting, known)[0])
        known = _divided(shooting, known, inside)
    interval, number = _states(shooting, known)
    a, b = known.w[interval, number].imag, known.w[interval + 1, number].imag
    share = a / (a - b)

    def between(values: np.ndarray) -> np.ndarray:
        return (1.0 - share) * values[0] + share * values[1]

    lengths = between(np.stack([known.s[interval, number], known.s[interval + 1, number]]))
    reactions = between(np.stack([known.reactions[interval], known.reactions[interval + 1]]))
    inside = lengths <= shooting.longest
    return EdgeScan(_profiles(shooting, reactions[inside], lengths[inside]), reached)


def _resolved(shooting: EdgeShooting) -> Crossings:
    """Divide intervals until each crossing can be followed from neighbour to neighbour."""
    reactions = np.sinh(np.linspace(-CROWDED, CROWDED, BEGIN)) / math.sinh(CROWDED) * shooting.greatest
    if shooting.tip == 0.0:
        # A rod with no reaction leaves the plate with no length.
        least = 8.0 * FIRST / shooting.rate * abs(1.0 - shooting.P)
        reactions = reactions[np.abs(reactions) > least]
    known = shooting.crossings(reactions)
    while len(known.reactions) < MOST:
        R = known.reactions
        apart = np.diff(R) > ROUNDING * np.abs(R[1:])
        coarse = np.isfinite(_parted(shooting, known)) & apart
        if not coarse.any():
            break
        known = _divided(shooting, known, np.flatnonzero(coarse))
    return known


def _divided(shooting: EdgeShooting, known: Crossings, interval: np.ndarray) -> Crossings:
    """Shoot rods within some intervals too."""
    low, high = known.reactions[interval, None], known.reactions[interval + 1, None]
    inner = np.setdiff1d(low + (high - low) * (np.arange(1, PARTS) / PARTS), known.reactions)
    return known.with_others(shooting.crossings(inner)) if inner.size else known


def _parted(shooting: EdgeShooting, known: Crossings, *, wary: bool = True) -> np.ndarray:
    """s of the first crossing that cannot be followed from one rod to the next; infinite if all can.

    If ``wary`` also where w could pass the negative axis between them and come back.
    """
    s, theta = known.s, known.theta
    turn = np.abs(np.angle(known.w[1:] * known.w[:-1].conj()))
    far = SHARE * s[1:] + SHIFT / shooting.rate
    lost = (np.abs(np.diff(s, axis=0)) > far) | (np.abs(np.diff(theta, axis=0)) > SWING) | (turn > TURN)
    lost |= np.isnan(s[1:]) != np.isnan(s[:-1])
    if wary:
        lost |= _could_return(known, turn)
    first = np.where(lost, np.fmin(s[1:], s[:-1]), np.inf).min(axis=1, initial=np.inf)
    if shooting.tip == 0.0:
        first[known.reactions[:-1] * known.reactions[1:] < 0.0] = np.inf  # nothing lies between
    return np.where(first < shooting.longest, first, np.inf)


def _could_return(known: Crossings, turn: np.ndarray) -> np.ndarray:
    """Whether w, no faster than nearby, has room to pass the negative axis and come back."""
    width = np.diff(known.reactions)[:, None]
    rate = np.pad(np.nan_to_num(turn / width), ((1, 1), (0, 0)))
    fastest = np.maximum(np.maximum(rate[:-2], rate[2:]), rate[1:-1])  # of the intervals on either side too
    short_of = np.angle(-known.w)
    there_and_back = np.abs(short_of[1:]) + np.abs(short_of[:-1])
    return (short_of[1:] * short_of[:-1] > 0.0) & (there_and_back < WARY * fastest * width)


def _reached(shooting: EdgeShooting, known: Crossings) -> float:
    """Length below which every crossing is followed, but for rods far under the plate."""
    parted = _parted(shooting, known)
    ends = np.where(known.given_up, np.inf, known.ends)
    under = np.where(known.given_up, known.ends, np.inf)
    parted[np.minimum(under[:-1], under[1:]) <= parted] = np.inf
    return float(min(shooting.longest, ends.min(), parted.min()))


def _states(shooting: EdgeShooting, known: Crossings) -> tuple[np.ndarray, np.ndarray]:
    """Intervals, and numbers of the crossings, in which w passes the negative axis."""
    a, b = known.w[:-1], known.w[1:]
    followed = np.fmax(known.s[:-1], known.s[1:]) < _parted(shooting, known, wary=False)[:, None]
    interval, number = np.nonzero(followed & ((a.imag < 0.0) != (b.imag < 0.0)) & ((a + b).real < 0.0))
    return interval, number


def _profiles(shooting: EdgeShooting, reactions: np.ndarray, lengths: np.ndarray) -> list[Profile]:
    """Shoot rods once more, sampled from the tip in the scaled variables."""
    if not reactions.size:
        return []
    states, slopes = (np.stack(parts) for parts in zip(*shooting.rods(reactions), strict=True))
    found = []
    for i, length in enumerate(lengths.tolist()):
        going = slopes[:, 0, i] > 0.0  # the rest repeats the last
        z, slope = states[going, :, i], slopes[going, :, i]
        along = CubicHermiteSpline(z[:, 0], z[:, 1:], slope[:, 1:] / slope[:, :1])
        pieces = math.ceil(shooting.rate * length / PIECE)
        xi = (np.arange(pieces)[:, None] + chebyshev(PROFILE_POINTS)[0]) / pieces
        theta, turn, ny, y = np.moveaxis(along(length * (1.0 - xi)), -1, 0)
        A, nx = -float(theta[0, 0]), shooting.P * (y[0, 0] - y)
        fields = np.stack([theta, length * turn, length**2 * nx, length**2 * ny, y / length], axis=-1) / A
        scalars = Scalars(A, length**3 * (shooting.P - 1.0) / A, length, shooting.ratio * length**4 - PI4)
        found.append(Profile(np.full(pieces, 1.0 / pieces), fields, scalars))
    return found
