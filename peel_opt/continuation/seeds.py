"""Starts for states of any rod under law (8), read off a file instead of walked to.

A state of the branch from T is known by its rod and by how far its tip has turned.  On five charts of
these two numbers, scaled so that nothing on them is singular, the fields are smooth, and a few hundred
Chebyshev coefficients give each of them to some four digits: one or two steps of Newton's method from a
solution.  The unfolded states have three charts, the folded ones two, up to where the tip is back at y0.
That is what a seed is, a start and no answer; which state has been reached, and how well, is read off
the solution.  `seeding` makes the file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.resources import files
from io import BytesIO

import numpy as np

from ..model.bond import COHESIVE
from ..model.groups import PI4
from ..model.rod import RATIOS
from ..residual.discretisation import Phases
from ..residual.free_arc import polynomials
from ..residual.meshes import PATH
from ..residual.stack import Stack, stack_of

#: eta/y0 above which the tip of an unfolded state may leave the cohesive zone: there P_min is 1/2.
LEAVES = 0.386459168173

#: Tip angle at which that of an infinitely stiff rod is back at y0.
LAST_ANGLE = 4.0 * math.pi / 3.0

#: File of the coefficients, beside this module.
FILE = "seeds.npz"

#: Places along a chart between which a number that is given is looked for, closer towards its end.
PLACES = 96

#: Share of the last value of a chart by which it may be wrong.
BEYOND = 1e-3


@dataclass(frozen=True, eq=False)
class SeedChart:
    """Unfolded states of one layout over (place of the rod, share of the way), both from 0 to 1.

    Parameters
    ----------
    phases : tuple of Piece
    ratios : (float, float)
        eta/y0 from and to.
    coefficients : ndarray, shape (degrees in the rod, degrees along, numbers)
        The numbers are those of `packed`.
    folded : bool
    """

    phases: Phases
    ratios: tuple[float, float]
    coefficients: np.ndarray
    folded: bool = False

    @property
    def stack(self) -> Stack:
        """What the starts are starts of."""
        return stack_of(PATH, self.phases)

    def rods(self, ratio: np.ndarray) -> Rods:
        """Return the chart's columns at some rods within its ratios; that of a single rod is remembered."""
        return _one_rod(self, float(ratio[0])) if len(ratio) == 1 else self.columns(ratio)

    def columns(self, ratio: np.ndarray) -> Rods:
        """Return the chart's columns at some rods within its ratios."""
        degrees, along, numbers = self.coefficients.shape
        basis = polynomials(place_of(ratio, self.ratios), degrees)
        # One product for each rod, so that none depends on the others.
        table = basis[:, None, :] @ self.coefficients.reshape(degrees, -1)
        return Rods(self, ratio, table.reshape(len(ratio), along, numbers))


@lru_cache(maxsize=256)
def _one_rod(chart: SeedChart, ratio: float) -> Rods:
    return chart.columns(np.array([ratio]))


@dataclass(frozen=True, eq=False)
class Rods:
    """The states of some rods on a chart, as polynomials of the share of the way.

    Parameters
    ----------
    chart : SeedChart
    ratio : ndarray, shape (rods,)
    coefficients : ndarray, shape (rods, degrees along, numbers)
    """

    chart: SeedChart
    ratio: np.ndarray
    coefficients: np.ndarray

    @cached_property
    def along(self) -> tuple[np.ndarray, np.ndarray]:
        """1 - P (ln P, if the tip has left y0) and ln(sigma) at `shares`, shape (rods, places)."""
        basis = _places(self._degree)
        amplitude, pressure, length = (
            np.ascontiguousarray(self.coefficients[:, :, k])[:, None, :] @ basis for k in (-3, -2, -1)
        )
        if len(self.chart.phases) == 1:
            pressure = amplitude * np.exp(pressure)
        return pressure[:, 0], length[:, 0]

    def starts(self, share: np.ndarray) -> np.ndarray:
        """Unknowns of a state of each rod, some share of the way along the chart."""
        basis = polynomials(share, self._degree + 1)
        numbers = (basis[:, None, :] @ self.coefficients)[:, 0]
        return unpacked(numbers, self.ratio, len(self.chart.phases), folded=self.chart.folded)

    def of(self, rows: np.ndarray) -> Rods:
        """Some of the rods, in increasing order; all of them are the same object."""
        if len(rows) == len(self.ratio):
            return self
        return Rods(self.chart, self.ratio[rows], self.coefficients[rows])

    @property
    def _degree(self) -> int:
        return self.coefficients.shape[1] - 1


@lru_cache(maxsize=8)
def _places(degree: int) -> np.ndarray:
    """The polynomials at `shares`, in columns."""
    return np.ascontiguousarray(polynomials(shares(), degree + 1).T)


def packed(stack: Stack, x: np.ndarray, *, folded: bool = False) -> np.ndarray:
    """Return states as numbers that change little over a chart, shape (states, nodes + 3 or 4).

    Theta'' by the length of its phase; with a free arc the logarithm of what is not free; A; the
    logarithm of (1 - P)/A, with a free arc of P; that of sigma.  Of folded states, whose pressure comes
    back to T0, there is no logarithm of 1 - P, and with a free arc A tends to `LAST_ANGLE`.
    """
    s, held = stack.scalars(x), 1.0 - stack.shares(x)
    bend = x[:, : stack.nodes] * (held * held)[:, None]
    P = s.pressure_ratio
    if stack.free:
        scalars = [np.log(held), np.log(LAST_ANGLE - s.A) if folded else s.A, np.log(P)]
    else:
        less = -s.m / s.beta0
        scalars = [s.A, less / _least(s.ratio) if folded else np.log(less)]
    return np.concatenate([bend, np.stack([*scalars, np.log(s.sigma)], axis=1)], axis=1)


def unpacked(numbers: np.ndarray, ratio: np.ndarray, phases: int, *, folded: bool = False) -> np.ndarray:
    """Return the states that `packed` made numbers of."""
    A, pressure, sigma = numbers[:, -3], numbers[:, -2], np.exp(numbers[:, -1])
    cube = sigma**3
    x = np.empty((len(numbers), numbers.shape[1] + 1))
    x[:, -2], x[:, -1] = sigma, ratio * (sigma * cube) - PI4
    if phases == 1:
        x[:, :-4], x[:, -4] = numbers[:, :-3], A
        x[:, -3] = -(pressure * _least(ratio) if folded else np.exp(pressure)) * cube
        return x
    A = LAST_ANGLE - np.exp(A) if folded else A
    held = np.exp(numbers[:, -4])
    x[:, :-5], x[:, -5] = numbers[:, :-4] / (held * held)[:, None], 1.0 - held
    x[:, -4], x[:, -3] = A, (np.exp(pressure) - 1.0) * cube / A
    return x


def _least(ratio: np.ndarray) -> np.ndarray:
    """Size of 1 - P_min: it grows with the ratio from zero to one."""
    return ratio / (1.0 + ratio)


def place_of(ratio: np.ndarray, ratios: tuple[float, float]) -> np.ndarray:
    """Place of a rod between two: by ln r, and above `LEAVES` by the root of its distance from there.

    The states beyond y0 begin at `LEAVES` with a square root.
    """
    low, high = ratios
    if low < LEAVES:
        place: np.ndarray = np.log(ratio / low) / math.log(high / low)
        return place
    return np.sqrt(np.log(np.maximum(ratio, LEAVES) / LEAVES) / math.log(high / LEAVES))


@lru_cache(maxsize=1)
def shares() -> np.ndarray:
    """Shares of the way along a chart, closer towards its end, where the pressure has its minimum."""
    return 1.0 - (1.0 - np.linspace(0.0, 1.0, PLACES)) ** 2


#: Each chart's name in the file, its phases from the tip and its ratios.
CHARTS: dict[str, tuple[Phases, tuple[float, float]]] = {
    "whole": (COHESIVE.pieces[:1], (RATIOS[0], LEAVES)),
    "within": (COHESIVE.pieces[:1], (LEAVES, RATIOS[1])),
    "beyond": (COHESIVE.pieces[::-1], (LEAVES, RATIOS[1])),
    "folded": (COHESIVE.pieces[:1], (RATIOS[0], LEAVES)),
    "returning": (COHESIVE.pieces[::-1], (LEAVES, RATIOS[1])),
}

#: Charts of folded states.
FOLDED = ("folded", "returning")


@lru_cache(maxsize=1)
def charts() -> dict[str, SeedChart]:
    """Return the charts of the file that comes with the package, read once."""
    content = files(__package__).joinpath(FILE).read_bytes()
    with np.load(BytesIO(content), allow_pickle=False) as data:
        return {
            name: SeedChart(*known, np.ascontiguousarray(data[name], dtype=float), name in FOLDED)
            for name, known in CHARTS.items()
        }


def share_of(
    values: np.ndarray, sought: np.ndarray, *, last: bool = True, beyond: float = BEYOND
) -> np.ndarray:
    """Share of the way at which a number is met, by interpolation; not a number where it is not.

    Parameters
    ----------
    values : ndarray, shape (rods, places)
        The number at `shares`.
    sought : ndarray, shape (rods,)
    last : bool
        Where it is met more than once, whether the last or the first time is meant.
    beyond : float
        A number that lies beyond an end by no more than this share counts as met there.
    """
    above = values > sought[:, None]
    changes = above[:, 1:] != above[:, :-1]
    at = changes.shape[1] - 1 - changes[:, ::-1].argmax(axis=1) if last else changes.argmax(axis=1)
    rows, s = np.arange(len(values)), shares()
    here, there = values[rows, at], values[rows, at + 1]
    met = changes[rows, at]
    if met.all():
        return s[at] + (sought - here) / (there - here) * (s[at + 1] - s[at])
    apart = np.where(met, there - here, 1.0)
    share = np.where(met, s[at] + (sought - here) / apart * (s[at + 1] - s[at]), np.nan)
    for end in (-1, 0):
        near = ~met & (np.abs(sought - values[:, end]) <= beyond * (1.0 + np.abs(values[:, end])))
        share[near], met = s[end], met | near
    return share
