"""Starts for every equilibrium at a question, by shooting from the free tip.

At the tip theta' = N_x = N_y = 0, and by the first integrals its height is either zero or
that at which the law's mean traction is p/T0.  Two numbers are left open, the tip angle and
the pressure (or the length): a grid over both is integrated at once, every cell in which
theta and y at the detachment point may vanish together is refined by Newton's method in the
two numbers, all cells at once.  The grid is set by the range asked for, not by known answers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..base.errors import InvalidInput
from ..model.bond import CohesiveLaw
from ..model.equations import Scalars
from ..model.groups import PI4
from ..residual.discretisation import PROFILE_POINTS, Profile, chebyshev

#: Tip angles beyond a full turn wind the rod up; no such state has been met.
STEEPEST = 2.0 * np.pi

#: Newton steps on the candidates of a grid, and the misses with which one counts as a start.
NEWTON_STEPS, CLOSE = 12, 1e-4

#: Step after which a candidate is left alone: a start need not be better.
SETTLED = 1e-9


@dataclass(frozen=True)
class TipGrid:
    """Resolution of the search.

    Parameters
    ----------
    angles, values : int
        Points of the grid in the tip angle and in the other unknown, for gamma =
        beta1^(1/4) up to 4; both grow with gamma, which says how fast shapes part.
    steps : int
        Runge-Kutta steps along the rod, likewise.
    widest : int
        Cap on the growth.
    """

    angles: int = 160
    values: int = 160
    steps: int = 48
    widest: int = 3


@dataclass(frozen=True)
class TipShooting:
    """Shapes that start at a free tip, for one rod and law, in units of eta and T0.

    Parameters
    ----------
    law : CohesiveLaw
        The linear law or law (8).
    ratio : float
        eta/y0.
    touching : bool
        Whether the tip rests on the plate (y = 0 at any pressure) instead of hanging free.
    """

    law: CohesiveLaw
    ratio: float
    touching: bool = False

    def __post_init__(self) -> None:
        if not self.law.falls_straight:
            raise InvalidInput(
                f"the search for further states knows the linear law and law (8), not {self.law.name!r}."
            )

    def tip_height(self, P: np.ndarray) -> np.ndarray:
        """y(0)/y0 at each pressure."""
        if self.touching:
            return np.zeros_like(P)
        linear = 2.0 * (1.0 - P)
        if self.law.is_linear:
            return linear
        return np.where(P >= 0.5, linear, 0.5 / np.maximum(P, 1e-12))

    def states(self, angle: np.ndarray, P: np.ndarray, sigma: np.ndarray, steps: int) -> Iterator[np.ndarray]:
        """Yield (theta, theta', N_x, N_y, y), shape (5, n), step by step from the tip on."""
        zero = np.zeros_like(angle)
        z = np.stack([angle, zero, zero, zero, self.tip_height(P) / self.ratio])
        h = sigma / steps
        yield z
        for _ in range(steps):
            k1 = self._slopes(z, P)
            k2 = self._slopes(z + 0.5 * h * k1, P)
            k3 = self._slopes(z + 0.5 * h * k2, P)
            k4 = self._slopes(z + h * k3, P)
            z = np.clip(z + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), -1e8, 1e8)
            yield z

    def _slopes(self, z: np.ndarray, P: np.ndarray) -> np.ndarray:
        """(6) for all shapes at once."""
        theta, turn, nx, ny, y = z
        sine, cosine = np.sin(theta), np.cos(theta)
        u = self.ratio * y
        lost = u if self.law.is_linear else np.minimum(u, 1.0)  # 1 - tau
        slopes = np.empty_like(z)
        slopes[0], slopes[1], slopes[2] = turn, ny * cosine - nx * sine, -P * sine
        slopes[3], slopes[4] = P * cosine - 1.0 + lost, sine
        return slopes

    def misses(self, angle: np.ndarray, P: np.ndarray, sigma: np.ndarray, steps: int) -> np.ndarray:
        """theta and y at the detachment point, shape (2, n)."""
        last = deque(self.states(angle, P, sigma, steps), maxlen=1)[0]
        return last[[0, 4]]


def starts_at_length(
    shooting: TipShooting, sigma: float, pressures: tuple[float, float], scan: TipGrid | None = None
) -> list[Profile]:
    """Starts for all states at a length, with p/T0 in a range."""
    scan = scan or TipGrid()
    growth = _growth(shooting.ratio, sigma, scan)
    angles, values = _axis(scan.angles * growth), np.linspace(*pressures, scan.values * growth)
    angle, P = (a.ravel() for a in np.meshgrid(angles, values))
    steps = scan.steps * growth
    theta, y = shooting.misses(angle, P, np.full_like(P, sigma), steps).reshape(2, len(values), -1)
    cells = _both_vanish(theta, y)

    def misses(x: np.ndarray) -> np.ndarray:
        return shooting.misses(x[0], x[1], np.full_like(x[0], sigma), steps)

    angle, P = _refined(misses, _middles(angles, cells[:, 1]), _middles(values, cells[:, 0]))
    inside = (pressures[0] <= P) & (pressures[1] >= P)
    return _profiles(shooting, angle[inside], P[inside], np.full_like(P[inside], sigma))


def _axis(count: int) -> np.ndarray:
    """Tip angles; an even count keeps the straight rod off the grid."""
    return np.linspace(-STEEPEST, STEEPEST, count + count % 2)


def _middles(axis: np.ndarray, index: np.ndarray) -> np.ndarray:
    return 0.5 * (axis[index] + axis[index + 1])


def _growth(ratio: float, sigma: float, scan: TipGrid) -> int:
    gamma = (ratio * sigma**4) ** 0.25
    return int(np.clip(np.ceil(gamma / 4.0), 1, scan.widest))


def _both_vanish(f: np.ndarray, g: np.ndarray) -> np.ndarray:
    """Cells of a grid in which two functions may vanish together, shape (k, 2)."""

    def changes(a: np.ndarray) -> np.ndarray:
        corners = np.stack([a[:-1, :-1], a[1:, :-1], a[:-1, 1:], a[1:, 1:]])
        return (corners.min(axis=0) < 0.0) & (corners.max(axis=0) > 0.0)

    return np.argwhere(changes(f) & changes(g))


def _refined(
    misses: Callable[[np.ndarray], np.ndarray], angle: np.ndarray, value: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Newton's method for two equations in two unknowns, for all candidates at once."""
    x = np.stack([angle, value])
    moving = np.arange(x.shape[1])
    for _ in range(NEWTON_STEPS):
        if not moving.size:
            break
        y = x[:, moving]
        h = 1e-7 * (1.0 + np.abs(y))
        # The shape itself and the two that are moved a little, all in one.
        f, a, b = np.split(misses(np.hstack([y, y + h * [[1.0], [0.0]], y + h * [[0.0], [1.0]]])), 3, axis=1)
        (a, c), (b, d) = (a - f) / h[0], (b - f) / h[1]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step = np.stack([d * f[0] - b * f[1], a * f[1] - c * f[0]]) / (a * d - b * c)
        step = np.nan_to_num(step, nan=0.0, posinf=0.0, neginf=0.0)
        size = np.abs(step).max(axis=0)
        x[:, moving] = y - step * np.minimum(1.0, 0.3 / np.maximum(size, 1e-300))
        moving = moving[size > SETTLED]
    close = np.abs(misses(x)).max(axis=0) < CLOSE
    # Many cells lead to the same state.
    kept = np.unique(np.round(x[:, close], 5), axis=1, return_index=True)[1]
    return x[0, close][kept], x[1, close][kept]


def _profiles(shooting: TipShooting, angle: np.ndarray, P: np.ndarray, sigma: np.ndarray) -> list[Profile]:
    """Integrate the starts once more, sampled as profiles in the scaled variables."""
    bent = np.abs(angle) > 1e-6  # the rest is the straight rod
    angle, P, sigma = angle[bent], P[bent], sigma[bent]
    if not len(angle):
        return []
    steps = 384
    states = np.stack(list(shooting.states(angle, P, sigma, steps)))
    place = chebyshev(PROFILE_POINTS)[0] * steps
    low = np.minimum(place.astype(int), steps - 1)
    share = (place - low)[:, None, None]
    sampled = (1.0 - share) * states[low] + share * states[low + 1]
    profiles = []
    for i, (tip, p, s) in enumerate(zip(angle, P, sigma, strict=True)):
        # theta, theta' sbar, N sbar^2/k, y/sbar: from units of eta to units of sbar.
        fields = sampled[:, :, i] * np.array([1.0, s, s**2, s**2, 1.0 / s]) / -tip
        scalars = Scalars(-tip, s**3 * (p - 1.0) / -tip, s, shooting.ratio * s**4 - PI4)
        profiles.append(
            Profile(np.ones(1), fields[None], Scalars(*(float(v) for v in vars(scalars).values())))
        )
    return profiles
