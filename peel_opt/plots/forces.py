"""The forces on a rod as arrows: where they stand, where they point, how long they are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..equilibria.result import Equilibrium

#: Arrows of each kind along the detached part.
COUNT = 13

#: Arrows of a force that acts on a short part of the rod, and what limits their density.
FEWEST, MOST = 5, 45

#: Tractions below this fraction of the largest are not drawn.
FAINT = 0.02

#: A pressure below this fraction of the adhesion is drawn to a scale of its own.
READABLE = 0.25


@dataclass(frozen=True)
class ForceArrows:
    """Arrows from (x, y) by (u, v), all of shape (n,), in the coordinates of the axes."""

    x: np.ndarray
    y: np.ndarray
    u: np.ndarray
    v: np.ndarray

    @property
    def corners(self) -> np.ndarray:
        """Tails and heads, (2 n, 2)."""
        tails = np.stack([self.x, self.y], axis=-1)
        return np.concatenate([tails, tails + np.stack([self.u, self.v], axis=-1)])

    def pick(self, which: np.ndarray) -> ForceArrows:
        """Return the arrows where the mask ``which`` is set."""
        return ForceArrows(self.x[which], self.y[which], self.u[which], self.v[which])


@dataclass(frozen=True)
class Forces:
    """The forces of one picture.

    Parameters
    ----------
    pressure : ForceArrows
        Normal to the rod as drawn, on the side to which the pressure pushes; if p < 0 they
        stand on the same side and point at the rod.
    adhesion, repulsion : ForceArrows
        Vertical, towards the plate and away from it.
    magnified : float
        How much longer the pressure is drawn than adhesion of the same size.
    """

    pressure: ForceArrows
    adhesion: ForceArrows
    repulsion: ForceArrows
    magnified: float


def adhesive_force(eq: Equilibrium) -> np.ndarray:
    """Vertical force f per length in k/sbar^3, at the points of the shape.

    It is what the balance N_y' = p cos(theta) + f leaves, so it needs no law: a shape read
    from a file, or computed with a law of the user's own, shows its own traction.
    """
    shape = eq.shape
    return np.gradient(shape.Ny, shape.xi, edge_order=2) - eq.alpha * np.cos(shape.theta)


def forces_on(eq: Equilibrium, x: np.ndarray, y: np.ndarray, stretch: float, longest: float) -> Forces:
    """Place the arrows on a rod drawn through (x, y).

    Parameters
    ----------
    eq : Equilibrium
    x, y : array, shape (n,)
        The shape in the coordinates of the axes.
    stretch : float
        How many times the vertical scale is the horizontal one.
    longest : float
        Length of an arrow of the largest adhesive force, on the horizontal scale.
    """
    dx, dy = np.diff(x), stretch * np.diff(y)
    run = np.concatenate([[0.0], np.cumsum(np.hypot(dx, dy))])

    def at(stations: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.interp(stations, run, values)

    # The pressure between the stations of the adhesion, so that the arrows do not hide each other.
    between = run[-1] * (np.arange(COUNT) + 0.5) / COUNT
    angle = np.arctan2(stretch * np.sin(eq.theta), np.cos(eq.theta))
    turned = at(between, np.unwrap(angle))
    force = adhesive_force(eq)
    unit = max(float(np.abs(force).max()), eq.beta0)
    share = abs(eq.alpha) / unit if unit > 0.0 else 1.0
    magnified = magnification(share)
    size = longest * share * magnified
    u, v = -size * np.sin(turned), size * np.cos(turned) / stretch
    foot_x, foot_y = at(between, x), at(between, y)
    pressure = (
        ForceArrows(foot_x, foot_y, u, v) if eq.alpha >= 0.0 else ForceArrows(foot_x + u, foot_y + v, -u, -v)
    )

    pulls = force / unit if unit > 0.0 else np.zeros_like(force)
    on = _stations(run, np.abs(pulls) > FAINT)
    pull = at(on, pulls)
    vertical = ForceArrows(at(on, x), at(on, y), np.zeros_like(on), longest / stretch * pull)
    drawn = np.abs(pull) > FAINT
    # A force away from the plate is no adhesion, whatever side of the plate the rod is on.
    away = pull * np.where(at(on, y) < 0.0, -1.0, 1.0) > 0.0
    return Forces(pressure, vertical.pick(drawn & ~away), vertical.pick(drawn & away), magnified)


def magnification(share: float) -> float:
    """Return how much longer arrows are drawn whose force has this share of the largest: 1, 2, 5, 10 ..."""
    return _round_up(READABLE / share) if 0.0 < share < READABLE else 1.0


def _stations(run: np.ndarray, acts: np.ndarray) -> np.ndarray:
    """Spread stations along a rod, closer together if the force acts on a short part of it only."""
    steps = np.diff(run)
    active = float(steps[acts[:-1] & acts[1:]].sum())
    spacing = max(min(run[-1] / COUNT, active / FEWEST), run[-1] / MOST)
    return np.arange(0.0, run[-1] - 0.5 * spacing, spacing)


def _round_up(factor: float) -> float:
    """Return the next of 1, 2, 5, 10, 20 ..."""
    decade = 10.0 ** math.floor(math.log10(factor))
    return next(step * decade for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= factor * (1.0 - 1e-12))
