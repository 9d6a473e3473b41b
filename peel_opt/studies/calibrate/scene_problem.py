"""A fit of the numbers of a scene to pairs of length and pressure, as nonlinear least squares.

A scene has no chart that all rods share.  Every pair holds a state of its own, which moves along the branch
of the scene at hand to the foot of the pair, in planes across the branch, where no length and no pressure
folds.  How the foot moves with the numbers of the scene follows from the residual linearised there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from ...base.errors import InvalidInput, NotConverged, PeelOptError
from ...continuation.points import Point
from ...continuation.scene_family import SceneFamily
from ...model.dimension import DOMAINS, Dimension
from ...model.renumbered import renumbered
from ...model.rod import MATERIAL, RATIOS, UNITS, Rod
from ...model.scene import Scene
from ...residual.closures import READINGS, Closure, Plane
from ...residual.linear import Linearised, gradient
from ...residual.scene_spectral import SceneDiscretisation, SceneSpectral
from ...residual.spectral import Spectral
from .covariance import LinearModel, Seen, cost, robust_rows
from .data import Observation
from .pairs import GROUPS, Pairs
from .problem import FURTHEST

#: Relative tolerance of the sum of losses and of the coordinates: states are solved to some 1e-11.
TOLERANCE = 1e-9

#: Least amplitude of a state that is fitted: below it the branch comes to rest, or to T.
LEAST = 1e-4

#: Steps towards a foot, the longest in arclength, and the one that ends it.
MOST_STEPS, LONGEST, SHORT = 60, 0.2, 1e-11

#: How often the way to other numbers of a scene is halved where its states are lost.
HALVINGS = 4

#: Least size by which a number that may be zero is measured, over its unit of T0 and eta.
SIZE = 0.1


@dataclass(frozen=True)
class Coordinate:
    """One free number as a coordinate z, zero at the start.

    Parameters
    ----------
    name : str
    start : float
        Where it begins, in the units of the rod.
    scale : float
        The number is ``start exp(z)`` where this is zero, or else ``start + scale z``.
    low, high : float
        Limits of z.
    dimension : Dimension or None
        None of a number of the rod.
    """

    name: str
    start: float
    scale: float
    low: float
    high: float
    dimension: Dimension | None

    @classmethod
    def of(cls, name: str, scene: Scene) -> Coordinate:
        """Return the coordinate of a number of the rod, which is positive, or of the scene.

        Raises
        ------
        InvalidInput
            If the scene has no such number.
        """
        if name in MATERIAL:
            return cls(name, getattr(scene.rod, name), 0.0, -FURTHEST, FURTHEST, None)
        if name not in scene.numbers:
            known = ", ".join((*MATERIAL, *scene.numbers))
            raise InvalidInput(
                f"unknown free number {name!r}.",
                remedy=f"Choose among {known}; name a load in the scene, with any size, to fit it.",
            )
        dimension = scene.dimensions[name]
        unit = dimension.size(scene.rod)
        start, (low, high) = scene.numbers[name] * unit, DOMAINS.get(name, (-math.inf, math.inf))
        if (low, high) == (0.0, math.inf) and start > 0.0:
            return cls(name, start, 0.0, -FURTHEST, FURTHEST, dimension)
        scale = max(abs(start), SIZE * unit)
        return cls(name, start, scale, (low - start) / scale, (high - start) / scale, dimension)

    def unit_of(self, rod: Rod) -> str:
        """Return the name of its unit."""
        if self.dimension is not None:
            return self.dimension.unit_of(rod)
        return "" if rod.dimensionless else UNITS[self.name]

    @property
    def is_log(self) -> bool:
        """Whether the number is positive, and z its logarithm."""
        return not self.scale

    def value(self, z: float) -> float:
        """Return the number."""
        return self.start * math.exp(z) if self.is_log else self.start + self.scale * z

    def rate(self, z: float) -> float:
        """Return its derivative by z."""
        return self.value(z) if self.is_log else self.scale


@dataclass(frozen=True, eq=False)
class SceneFitted:
    """Numbers of a scene, and the states of all pairs that go with them.

    Parameters
    ----------
    z : ndarray, shape (free,)
    points : tuple of Point
    at_rest : tuple of bool
        Whether a state is held where its branch begins.
    deviance : float
    iterations : int
        Scenes that were tried.
    directions : ndarray, shape (free, m), or None
        In which z was free to move, where some were held.
    """

    z: np.ndarray
    points: tuple[Point, ...]
    at_rest: tuple[bool, ...]
    deviance: float = math.nan
    iterations: int = 0
    directions: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class SceneProblem:
    """A fit of a scene without its answer.

    Parameters
    ----------
    scene : Scene
        Where it starts, and whose other numbers are known.
    coordinates : tuple of Coordinate
    observations : sequence of Observation
        Pairs, all of them.
    delta : float or None
        Scale of the pseudo-Huber loss; None for least squares.
    mesh : Spectral
    watch : callable
        Called at every scene that is tried.
    """

    scene: Scene
    coordinates: tuple[Coordinate, ...]
    observations: Sequence[Observation]
    delta: float | None
    mesh: Spectral
    watch: Callable[[], object] = field(default=lambda: None, repr=False)

    @cached_property
    def pairs(self) -> Pairs:
        """The pairs as arrays."""
        return Pairs.of(self.observations)

    # --- one scene -------------------------------------------------------------------------

    def scene_at(self, z: np.ndarray) -> Scene:
        """Return the scene with these free numbers; what is known stays as it is in SI units.

        Raises
        ------
        InvalidInput
            If there is no such scene.
        """
        values = {c.name: c.value(float(v)) for c, v in zip(self.coordinates, z, strict=True)}
        material = {name: values.pop(name, getattr(self.scene.rod, name)) for name in MATERIAL}
        return renumbered(self.scene, values, Rod(**material))

    def family_at(self, scene: Scene) -> SceneFamily:
        """Return the curve of states of a scene."""
        ratio = Closure("ratio", scene.rod.ratio)
        return SceneFamily(scene.bond.law, SceneSpectral(scene, self.mesh), ratio)

    def moved(self, points: Sequence[Point], before: np.ndarray, z: np.ndarray) -> list[Point] | None:
        """Return states of other numbers in the planes across the branch; None where they are lost."""
        return self._moved(points, before, z, HALVINGS)

    def _moved(
        self, points: Sequence[Point], before: np.ndarray, z: np.ndarray, halvings: int
    ) -> list[Point] | None:
        family, found = self.family_at(self.scene_at(z)), []
        for point in points:
            again = family.solve(point.profile, Plane.across(point.place, point.direction))
            if again is None:
                break
            problem, solved = again
            there = family.point(problem, solved.x, point.direction, 0.0, solved.iterations)
            if there.direction @ point.direction < 0.5:
                break
            found.append(there)
        if len(found) == len(points):
            return found
        if not halvings:
            return None
        middle = 0.5 * (before + z)
        half = self._moved(points, before, middle, halvings - 1)
        return None if half is None else self._moved(half, middle, z, halvings - 1)

    # --- the pairs beside it -----------------------------------------------------------------

    def feet(self, points: Sequence[Point], z: np.ndarray) -> tuple[list[Point], list[bool]]:
        """Move the states of one scene to the feet of their pairs; whether any is held at its beginning."""
        found = [self.foot(point, i, z) for i, point in enumerate(points)]
        return [point for point, _ in found], [held for _, held in found]

    def foot(self, point: Point, i: int, z: np.ndarray) -> tuple[Point, bool]:
        """Move a state to the foot of a pair, and say whether it is held where its branch begins.

        By steps of Gauss and Newton along the branch; one that leads further away is cut.
        """
        scene = self.scene_at(z)
        family, scale = self.family_at(scene), _scale(scene)
        reach, r = LONGEST, self.residual(point, i, scale)
        for _ in range(MOST_STEPS):
            along = self._along(point, i, scale)
            ds = float(np.clip(-(r @ along) / (along @ along), -reach, reach))
            falls = -point.scalars.A * 0.5 / point.turn.A if ds * point.turn.A < 0.0 else math.inf
            ds = math.copysign(min(abs(ds), abs(falls)), ds)
            if abs(ds) <= SHORT:
                return point, False
            if point.scalars.A + ds * point.turn.A < LEAST:
                return point, True
            there = family.step(point, ds)
            gap = None if there is None else self.residual(there, i, scale)
            if there is None or gap is None or gap @ gap > r @ r:
                # What is left is rounding, or the step was too long.
                if abs(ds) < 1e-8:
                    return point, False
                reach = 0.25 * abs(ds)
                continue
            point, r, reach = there, gap, min(LONGEST, 2.0 * abs(ds) + SHORT)
        return point, False

    def residual(self, point: Point, i: int, scale: np.ndarray) -> np.ndarray:
        """Return length and pressure of a state less those of a pair, in standard deviations."""
        found: np.ndarray = self.pairs.residuals(numbers_of(point), scale)[i]
        return found

    def _along(self, point: Point, i: int, scale: np.ndarray) -> np.ndarray:
        """Their derivatives along the branch."""
        along: np.ndarray = rates_of(point) * scale / self.pairs.sds[i]
        return along

    def seen(self, fitted: SceneFitted) -> list[Seen]:
        """Return every pair at its state, with derivatives by z; its place is its own unknown."""
        scene = self.scene_at(fitted.z)
        scale, found = _scale(scene), []
        for i, (point, rests) in enumerate(zip(fitted.points, fitted.at_rest, strict=True)):
            along = self._along(point, i, scale)
            own = np.zeros((2, 1)) if rests else along[:, None]
            by_z = self.by_numbers(point, scene, fitted.z) / self.pairs.sds[i][:, None]
            r = self.residual(point, i, scale)
            found.append(Seen(r, by_z, own, self.observations[i].measured, rests))
        return found

    def by_numbers(self, point: Point, scene: Scene, z: np.ndarray) -> np.ndarray:
        """Return derivatives of length and pressure by z in a plane across the branch, shape (2, free)."""
        problem = point.problem
        assert isinstance(problem, SceneDiscretisation)
        across = Plane.across(point.place, point.direction)
        at = Linearised.at(problem, point.x, Closure("ratio", scene.rod.ratio), across)
        reads = [gradient(READINGS[name], at.tail) for name in ("length", "pressure")]
        adjoint = at.adjoint(np.column_stack(reads))
        by_ratio = -adjoint[-2:].T @ at.by_given[:, 0]
        known = dict(
            zip(problem.settings.given, (-adjoint[:-2].T @ problem.by_numbers(point.x)).T, strict=True)
        )
        scale, sizes = _scale(scene), scene.dimensions
        # As the rod changes, the numbers of the scene stay, but not over their units.
        by_rod = np.outer(by_ratio, scene.rod.ratio * GROUPS[2])
        for name, kind in sizes.items():
            by_rod -= np.outer(known[name], scene.numbers[name] * kind.powers)
        by_rod += numbers_of(point)[:, None] * GROUPS[:2]
        columns = []
        for coordinate, value in zip(self.coordinates, z, strict=True):
            if coordinate.dimension is None:
                columns.append(by_rod[:, MATERIAL.index(coordinate.name)])
            else:
                size = coordinate.dimension.size(scene.rod)
                columns.append(known[coordinate.name] * coordinate.rate(float(value)) / size)
        return scale[:, None] * np.column_stack(columns)

    def linear_model(self, fitted: SceneFitted) -> LinearModel:
        """Return the fit to first order."""
        return LinearModel.of(self.seen(fitted), np.ones(len(fitted.z), dtype=bool), self.delta)

    # --- minimising --------------------------------------------------------------------------

    def minimised(self, start: SceneFitted, directions: np.ndarray | None = None) -> SceneFitted:
        """Minimise the loss over the free numbers, from a start.

        Parameters
        ----------
        start : SceneFitted
        directions : ndarray, shape (free, m), optional
            In which z may move; in all by default.

        Raises
        ------
        NotConverged
            If the scene has no states like those of the start.
        """
        from scipy.optimize import least_squares

        basis = np.eye(len(start.z)) if directions is None else directions
        size, count = 2 * len(self.observations), basis.shape[1]
        at, last = start, (np.array([math.nan]), np.empty(0), np.empty((0, 0)))

        def residuals(w: np.ndarray) -> np.ndarray:
            nonlocal at, last
            if np.array_equal(w, last[0]):
                return last[1]
            self.watch()
            z = start.z + basis @ w
            try:
                there = self.moved(at.points, at.z, z) if self._is_in_range(z) else None
            except PeelOptError:  # there is no such scene
                there = None
            if there is None:
                return np.full(size, np.nan)
            points, at_rest = self.feet(there, z)
            here = SceneFitted(z, tuple(points), tuple(at_rest))
            seen = self.seen(here)
            r = np.concatenate([one.r for one in seen])
            if np.all(np.isfinite(r)):
                by_z = np.vstack([one.projected(self.delta) for one in seen])
                at, last = here, (w.copy(), r, by_z @ basis)
            return r

        def jacobian(w: np.ndarray) -> np.ndarray:
            residuals(w)
            return last[2]

        begin = np.zeros(count)
        first = residuals(begin)
        if not np.all(np.isfinite(first)):
            raise NotConverged(
                "the scene to start from has no states like those observed.",
                remedy="Start from a scene whose branch comes nearer to the data.",
            )
        if not count:
            return replace(at, deviance=cost(first, self.delta), iterations=1, directions=directions)
        best = least_squares(
            residuals,
            begin,
            jacobian,
            bounds=self._bounds(start.z, basis),
            x_scale="jac",
            loss="linear" if self.delta is None else partial(robust_rows, delta=self.delta),
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=TOLERANCE,
            max_nfev=100,
        )
        final = residuals(best.x)
        deviance, tried = cost(final, self.delta), int(best.nfev)
        return replace(at, deviance=deviance, iterations=tried, directions=directions)

    def _bounds(self, z: np.ndarray, basis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how far each direction may be followed; one along a coordinate has its limits."""
        low, high = np.full(basis.shape[1], -np.inf), np.full(basis.shape[1], np.inf)
        for k, direction in enumerate(basis.T):
            j = int(np.argmax(direction))
            # A factor has no end that a fit comes to: what is out of range is refused as it is tried.
            if np.array_equal(direction, np.eye(len(z))[j]) and not self.coordinates[j].is_log:
                low[k], high[k] = self.coordinates[j].low - z[j], self.coordinates[j].high - z[j]
        return np.minimum(low, -1e-12), np.maximum(high, 1e-12)

    def _is_in_range(self, z: np.ndarray) -> bool:
        inside = all(c.low <= v <= c.high for c, v in zip(self.coordinates, z.tolist(), strict=True))
        return inside and RATIOS[0] <= self.scene_at(z).rod.ratio <= RATIOS[1]


def _scale(scene: Scene) -> np.ndarray:
    """Return (eta, T0)."""
    return np.array([scene.rod.eta, scene.rod.adhesion_strength])


def numbers_of(point: Point) -> np.ndarray:
    """Return (sbar/eta, p/T0) of a state."""
    return np.array([point.scalars.sigma, point.scalars.pressure_ratio])


def rates_of(point: Point) -> np.ndarray:
    """Return their derivatives along the branch."""
    return np.array([point.turn.sigma, point.rate(READINGS["pressure"])])
