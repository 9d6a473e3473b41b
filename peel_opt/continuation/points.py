"""One solution on a branch, with the direction in which the branch goes on, or between two of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..model.equations import Scalars
from ..residual.closures import READINGS, Closing, chart, miss
from ..residual.discretisation import Discretisation, Profile
from ..residual.linear import rate
from ..residual.newton import Correction

#: The tip angle interpolates where it makes up at least this share of the arclength.
LEAST_TURN = 0.05


@dataclass(frozen=True, eq=False)
class Point:
    """One solution on a branch.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray
    tangent : ndarray
        dx/d(length), oriented along the walk.
    arclength : float
        From the start of the walk.
    iterations : int
        Newton iterations it took.
    orientation : int
        Sign of the determinant of the bordered Jacobian; 0 if it is not known.
    before : Discretisation, optional
        At a corner of the branch, the problem on the side it is walked from; ``problem`` and
        ``tangent`` are those of the other side.
    errors : (float, float), optional
        Its distance from the exact branch by the mesh, and by rounding, as arclength, where they are known.
    """

    problem: Discretisation
    x: np.ndarray
    tangent: np.ndarray
    arclength: float
    iterations: int
    orientation: int = 0
    before: Discretisation | None = None
    errors: tuple[float, float] | None = None

    @cached_property
    def scalars(self) -> Scalars:
        """A, m, sigma, lambda."""
        return self.problem.scalars(self.x)

    @property
    def tail(self) -> np.ndarray:
        """The scalars as an array."""
        return self.x[self.problem.tail]

    @property
    def rates(self) -> np.ndarray:
        """Derivatives of the scalars along the branch, as an array."""
        return self.tangent[self.problem.tail]

    @cached_property
    def turn(self) -> Scalars:
        """Derivatives of the four scalars along the branch."""
        return self.problem.scalars(self.tangent)

    @cached_property
    def chart(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates of the arclength and their gradient."""
        return chart(self.tail)

    def miss(self, closing: Closing) -> float:
        """By how much the solution misses a closure; of either sign."""
        return miss(closing, self.tail)

    @property
    def place(self) -> np.ndarray:
        """Coordinates of the arclength, shape (4,)."""
        return self.chart[0]

    def ahead(self, place: np.ndarray) -> float:
        """Distance of a place along the tangent."""
        return float(self.direction @ (place - self.place))

    @cached_property
    def direction(self) -> np.ndarray:
        """Unit tangent in the coordinates of the arclength, shape (4,)."""
        return self.chart[1] @ self.rates

    def rate(self, read: Callable[[Scalars], float]) -> float:
        """Derivative of a number of the scalars along the branch; zero where that number folds."""
        return rate(read, self.tail, self.rates)

    @cached_property
    def profile(self) -> Profile:
        """The fields, sampled."""
        return self.problem.profile(self.x)

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Y at the tip and Theta at the plate."""
        return self.profile.ends

    def placed(self, arclength: float, orientation: int) -> Point:
        """Return the same solution at an arclength, with all that is known of it."""
        point = replace(self, arclength=arclength, orientation=orientation)
        vars(point).update({name: value for name, value in vars(self).items() if name not in vars(point)})
        return point

    def turned(self, arclength: float) -> Point:
        """Return the same solution on a walk in the other direction."""
        return replace(self, tangent=-self.tangent, orientation=-self.orientation, arclength=arclength)


def scalars_of(points: Sequence[Point]) -> Scalars:
    """The scalars of some points, each an array."""
    tails = np.ascontiguousarray(np.array([point.tail for point in points]).T)
    return points[0].problem.form.of_unknowns(*tails)


def turning(here: Point, there: Point) -> bool:
    """Whether the tip angle can serve as the coordinate from one point to the next."""
    turns = (here.direction[0], there.direction[0])
    return here.problem is there.problem and (min(turns) > LEAST_TURN or max(turns) < -LEAST_TURN)


def interpolated(here: Point, there: Point, share: float | np.ndarray) -> np.ndarray:
    """Unknowns at a share of the way in the tip angle between two `turning` points, or at several.

    As functions of the tip angle they do not feel how the arclength was measured.
    """
    width = there.scalars.A - here.scalars.A
    before, after = (width * p.tangent / p.turn.A for p in (here, there))
    x = cubic(np.asarray(share)[..., None], here.x, there.x, before, after)
    P = [p.scalars.pressure_ratio if here.problem.phases[0].lets_go else 0.0 for p in (here, there)]
    if min(P) > 0.0:
        # Of a P far below 1, the cubics of m, sigma and A would not leave a digit.
        slopes = (
            width * p.rate(READINGS["pressure"]) / p.turn.A / p.scalars.pressure_ratio for p in (here, there)
        )
        pressure = np.exp(cubic(np.asarray(share), *np.log(P), *slopes))
        A, m, sigma, _ = (here.problem.tail.start + k for k in range(4))
        x[..., m] = (pressure - 1.0) * x[..., sigma] ** 3 / x[..., A]
    return x


def predicted(here: Point, ds: float, behind: Point | None) -> np.ndarray:
    """Unknowns a way ahead: along the tangent, or by the cubic through a point and the one behind it."""
    if behind is None or behind.problem is not here.problem:
        return here.x + ds * here.tangent
    chord = here.place - behind.place
    # The arc over a chord, by the angle between its ends.
    span = math.sqrt(chord @ chord) * (1.0 + (1.0 - float(here.direction @ behind.direction)) / 12.0)
    return cubic(np.array(1.0 + ds / span), behind.x, here.x, span * behind.tangent, span * here.tangent)


def cubic(t: np.ndarray, a: Any, b: Any, da: Any, db: Any) -> np.ndarray:
    """Cubic on [0, 1] with values a, b and derivatives da, db at the ends."""
    value: np.ndarray = a + t * (da + t * (3.0 * (b - a) - 2.0 * da - db + t * (2.0 * (a - b) + da + db)))
    return value


def place_of(problem: Discretisation, solved: Correction) -> np.ndarray:
    """Coordinates of the arclength of a solution, shape (4,)."""
    return chart(solved.x[problem.tail])[0]


def arclength_between(here: Point, there: Point, place: np.ndarray) -> float:
    """Arclength of a place between two neighbouring points, in proportion to its distances."""
    before, after = (float(np.linalg.norm(place - p.place)) for p in (here, there))
    share = before / (before + after) if before > 0.0 else 0.0
    return here.arclength + share * (there.arclength - here.arclength)
