"""One solution on a branch, with the direction in which the branch goes on, or between two of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..model.equations import Scalars
from ..residual.arclength import chart
from ..residual.closures import Closing
from ..residual.discretisation import Discretisation, Profile
from ..residual.newton import Correction


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
    """

    problem: Discretisation
    x: np.ndarray
    tangent: np.ndarray
    arclength: float
    iterations: int
    orientation: int = 0

    @cached_property
    def scalars(self) -> Scalars:
        """A, m, sigma, lambda."""
        return self.problem.scalars(self.x)

    @cached_property
    def turn(self) -> Scalars:
        """Derivatives of the four scalars along the branch."""
        return self.problem.scalars(self.tangent)

    @cached_property
    def chart(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates of the arclength and their gradient."""
        return chart(self.x[-4:])

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
        return self.chart[1] @ self.tangent[-4:]

    @property
    def pressure_rate(self) -> float:
        """Derivative of P along the branch, up to a positive factor; zero at a fold in pressure."""
        s, d = self.scalars, self.turn
        # P - 1 = m A / sigma^3
        return (d.m * s.A + s.m * d.A) * s.sigma - 3.0 * s.alpha1 * d.sigma

    @cached_property
    def profile(self) -> Profile:
        """The fields, sampled."""
        return self.problem.profile(self.x)


@dataclass(frozen=True, eq=False)
class Landed:
    """A converged solution for the given numbers, on the mesh of a walk."""

    problem: Discretisation
    correction: Correction
    given: tuple[Closing, ...]

    @cached_property
    def profile(self) -> Profile:
        """The fields, sampled."""
        return self.problem.profile(self.correction.x)


def arclength_between(here: Point, there: Point, place: np.ndarray) -> float:
    """Arclength of a place between two neighbouring points, in proportion to its distances."""
    before, after = (float(np.linalg.norm(place - p.place)) for p in (here, there))
    share = before / (before + after) if before > 0.0 else 0.0
    return here.arclength + share * (there.arclength - here.arclength)
