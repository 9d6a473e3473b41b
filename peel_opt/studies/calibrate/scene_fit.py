"""A fit of the numbers of a scene: where it starts, how it is confirmed, and what came of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ...base.errors import InvalidInput, NotCertified, NotConverged, PeelOptError
from ...base.threads import one_thread
from ...continuation.points import Point, cubic
from ...continuation.scene_family import scene_branches
from ...equilibria.ask import length_given_pressure, pressure_given_length
from ...equilibria.result import Equilibrium
from ...equilibria.scenes import DEFAULT
from ...model.labels import fits
from ...model.scene import Scene
from ...residual.meshes import SCENES
from .confirmed import MOST_APART
from .covariance import UNSEEN, singular
from .curve import nearest
from .data import Observation
from .pairs import Pairs
from .problem import watched
from .profile import BetterFit, met, quantile, require_level
from .result import Fit
from .scene_problem import LEAST, Coordinate, SceneFitted, SceneProblem, numbers_of, rates_of
from .search import AGREED, BETTER, LEFT, NEARER
from .words import CURVED, LOOSE, OUTLIER, Direction, goodness

#: Meshes on which a fit is made, the first that of a walk.
MOST_MESHES = 4

#: How often pairs are moved to where the branch is nearer.
MOST_ROUNDS = 4

#: Furthest end of an interval: a factor in a positive number, of any other so many times what the covariance
#: says, if that is more.
FURTHEST, WIDE = math.log(1e4), 4.0

#: Lines between two points of a branch, from which the nearest place is read.
BETWEEN = 8


def fit_scene(
    scene: Scene, seen: Sequence[Observation], free: Sequence[str], delta: float | None
) -> SceneCalibration:
    """Fit numbers of a scene and of its rod to pairs; see `calibrate`.

    Raises
    ------
    InvalidInput
        If a free number is none of the scene, or there are fewer data than free numbers or a picture.
    NotConverged
        If the branch of the scene cannot be walked, or the fit does not settle.
    NotCertified
        If the fitted states are not those that the public functions find.
    """
    if any(o.points is not None for o in seen):
        raise InvalidInput(
            "a scene is fitted to pairs of length and pressure, and not to shapes.",
            remedy="Give the pressures at detached lengths, as Measurements.",
        )
    coordinates = tuple(Coordinate.of(name, scene) for name in free)
    problem = SceneProblem(scene, coordinates, seen, delta, SCENES)
    with watched(problem) as watching:
        refined, fitted, equilibria, consistency = _refined(watching)
    problem = replace(refined, watch=problem.watch)
    model = problem.linear_model(fitted)
    degrees = sum(o.degrees for o in seen) - len(free)
    found = SceneCalibration(
        rod=problem.scene_at(fitted.z).rod,
        scene=problem.scene_at(fitted.z),
        free=tuple(free),
        deviance=fitted.deviance,
        degrees=degrees,
        singular_values=singular(model.jacobian)[0],
        observations=tuple(seen),
        residuals=tuple(model.residuals),
        weights=tuple(model.weights),
        equilibria=tuple(equilibria),
        consistency=consistency,
        loss="least-squares" if delta is None else "pseudo-huber",
        loss_scale=delta,
        iterations=fitted.iterations,
        own_covariance=model.covariance(sandwich=delta is not None),
        directions=singular(model.jacobian)[1],
        problem=problem,
        fitted=fitted,
    )
    return replace(found, warnings=tuple(_warnings(found)))


# --- where the states are ------------------------------------------------------------------------


@one_thread
def _settled(problem: SceneProblem) -> SceneFitted:
    """Minimise, with every pair at the nearest part of the branch that it may be on."""
    z = np.zeros(len(problem.coordinates))
    curve = _Curve.of(problem, z)
    unit = 1.0 / problem.pairs.values * np.isfinite(problem.pairs.sds)
    points = [curve.nearest(i, observation, unit[i])[0] for i, observation in enumerate(problem.observations)]
    start = SceneFitted(z, tuple(points), (False,) * len(points))
    try:
        return _minimised(problem, start)
    except NotConverged:
        beside = problem.minimised(start, np.zeros((len(z), 0)))
        model = problem.linear_model(beside)
        sizes, rows, seen = singular(model.jacobian)
        firm = rows[seen & (sizes * LOOSE > 1.0)].T
        if firm.shape[1] in (0, len(z)):
            raise
        return _minimised(problem, beside, firm)


def _minimised(
    problem: SceneProblem, fitted: SceneFitted, directions: np.ndarray | None = None
) -> SceneFitted:
    """Minimise, in some directions only, until no pair is nearer to another part of the branch."""
    free = np.eye(len(fitted.z)) if directions is None else directions
    for _ in range(MOST_ROUNDS):
        fitted = problem.minimised(fitted, directions)
        again = _nearer(problem, fitted)
        left = problem.linear_model(fitted).left(free)
        # Far from the data the steps are short: a fit goes on from where the last one ended.
        if again is fitted and left <= LEFT:
            return fitted
        settled, fitted = again is fitted, again
    reason = f"stops {left:.1e} standard deviations before its minimum" if settled else "does not settle"
    raise NotConverged(
        f"the fit {reason}.", remedy="Start from a scene nearer to the data, or fix a number that is known."
    )


def _nearer(problem: SceneProblem, fitted: SceneFitted) -> SceneFitted:
    """Return a fit with its pairs moved to where the branch comes nearer; the same one if it does nowhere."""
    curve, points, moved = _Curve.of(problem, fitted.z), list(fitted.points), False
    unit = curve.scale / problem.pairs.sds
    for i, (observation, one) in enumerate(zip(problem.observations, problem.seen(fitted), strict=True)):
        better = (1.0 - NEARER) * float(one.r @ one.r) - NEARER
        point, gap = curve.nearest(i, observation, unit[i])
        if gap**2 < better:
            there, _ = problem.foot(point, i, fitted.z)
            r = problem.residual(there, i, curve.scale)
            if r @ r < better:
                points[i], moved = there, True
    return replace(fitted, points=tuple(points)) if moved else fitted


@dataclass(frozen=True, eq=False)
class _Curve:
    """The branches of a scene as lines between places on them.

    Parameters
    ----------
    pairs : Pairs
    scale : ndarray, shape (2,)
        eta and T0.
    lines : ndarray, shape (n, 2, 2)
        Where each line begins and ends, sbar/eta and p/T0.
    points : list of Point
        The solved one beside each.
    labels : list of str
    """

    pairs: Pairs
    scale: np.ndarray
    lines: np.ndarray
    points: list[Point]
    labels: list[str]

    @classmethod
    def of(cls, problem: SceneProblem, z: np.ndarray) -> _Curve:
        """Walk the branches of a scene."""
        scene = problem.scene_at(z)
        lines, points, labels = [], [], []
        shares = np.linspace(0.0, 1.0, BETWEEN + 1)[:, None]
        for branch in scene_branches(problem.family_at(scene)):
            known = [p for p in branch.points if p.scalars.A > LEAST]
            for here, there in pairwise(known):
                width = there.arclength - here.arclength
                before, after = (width * rates_of(p) for p in (here, there))
                places = cubic(shares, numbers_of(here), numbers_of(there), before, after)
                for k, (begin, end) in enumerate(pairwise(places)):
                    lines.append((begin, end))
                    points.append(here if 2 * k < BETWEEN else there)
                    labels.append(branch.state_at(here.arclength + (k + 0.5) / BETWEEN * width))
        scale = np.array([scene.rod.eta, scene.rod.adhesion_strength])
        return cls(problem.pairs, scale, np.array(lines).reshape(-1, 2, 2), points, labels)

    def nearest(self, i: int, observation: Observation, unit: np.ndarray) -> tuple[Point, float]:
        """Return the solved state nearest to a pair on a part that it may be on, and how far that part is.

        Raises
        ------
        NotConverged
            If there is no such part.
        """
        wanted = sorted(_wanted([observation]))
        rows = [j for j, label in enumerate(self.labels) if any(fits(label, state) for state in wanted)]
        if not rows:
            raise NotConverged(
                f"{observation.name}: the scene to start from has no {' or '.join(wanted)} state; it has"
                f" {', '.join(dict.fromkeys(self.labels)) or 'none'}.",
                remedy="Say which state was seen, or start from another scene.",
            )
        begin, end = self.lines[rows, 0], self.lines[rows, 1]
        if not np.all(np.isfinite(self.pairs.sds[i])):
            unit = np.where(np.isfinite(self.pairs.sds[i]), unit, 0.0)
        measured = self.pairs.values[i : i + 1] / self.scale
        line, _, gap = nearest(measured, begin, end - begin, unit[None])
        return self.points[rows[int(line[0])]], float(gap[0])


@one_thread
def scene_band(fit: SceneCalibration) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the branch of the fitted scene and the standard deviation across it; see `curve.band`."""
    problem, z, scene = fit.problem, fit.fitted.z, fit.scene
    scale, wanted = np.array([scene.rod.eta, scene.rod.adhesion_strength]), _wanted(fit.observations)
    points = [
        point
        for branch in scene_branches(problem.family_at(scene))
        for point in branch.points
        if point.scalars.A > LEAST and any(fits(branch.state_at(point.arclength), state) for state in wanted)
    ]
    if len(points) < 3:
        return np.array([numbers_of(point) * scale for point in points]).reshape(-1, 2), None
    solved, rates = (np.array([read(point) for point in points]) for read in (numbers_of, rates_of))
    along = np.array([point.arclength for point in points])
    fine = np.interp(np.arange((len(along) - 1) * BETWEEN + 1) / BETWEEN, np.arange(len(along)), along)
    curve = CubicHermiteSpline(along, solved, rates)(fine) * scale
    ranges = np.ptp(curve, axis=0)
    if not np.all(np.isfinite(fit.own_covariance)) or np.any(ranges == 0.0):
        return curve, None
    tangent = rates * scale / ranges
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    by_z = np.array([problem.by_numbers(point, scene, z) / ranges[:, None] for point in points])
    change = np.einsum("ij,ijk->ik", normal, by_z)
    sd = np.sqrt(np.einsum("ij,jk,ik->i", change, fit.own_covariance, change))
    sideways = normal * sd[:, None] * ranges
    return curve, np.column_stack([np.interp(fine, along, column) for column in sideways.T])


def _wanted(observations: Sequence[Observation]) -> set[str]:
    """Return the states that were observed."""
    return {state for o in observations for state in (DEFAULT if o.state is None else (o.state,))}


# --- what the public functions say ---------------------------------------------------------------


def _refined(problem: SceneProblem) -> tuple[SceneProblem, SceneFitted, list[Equilibrium], float]:
    """Fit, on finer and finer meshes, until the public functions agree with the states.

    Raises
    ------
    NotCertified
        If a fitted state is not the one the public function finds.
    """
    fitted = _settled(problem)
    for last in range(1, MOST_MESHES + 1):
        equilibria, gaps = _confirmed(problem, fitted)
        consistency = max(gaps)
        if consistency <= AGREED or last == MOST_MESHES:
            break
        problem = replace(problem, mesh=problem.mesh.refined())
        fitted = problem.minimised(fitted, fitted.directions)
    if consistency > MOST_APART:
        worst = int(np.argmax(gaps))
        (sigma, P), eq = numbers_of(fitted.points[worst]), equilibria[worst]
        raise NotCertified(
            f"{problem.observations[worst].name} is fitted at p/T0 = {P:.8g}, sbar/eta = {sigma:.8g}, but the"
            f" fitted scene is at p/T0 = {eq.pressure_ratio:.8g}, sbar/eta = {eq.length_ratio:.8g} there.",
            remedy="Near a fold a length or pressure has no state nearby: give it a standard deviation.",
        )
    return problem, fitted, equilibria, consistency


def _confirmed(problem: SceneProblem, fitted: SceneFitted) -> tuple[list[Equilibrium], list[float]]:
    """Return the public answer for every fitted state, and how far the two are apart."""
    scene, found, gaps = problem.scene_at(fitted.z), [], []
    rod = scene.rod
    for observation, point in zip(problem.observations, fitted.points, strict=True):
        problem.watch()
        (sigma, P), rates = numbers_of(point), rates_of(point)
        by_length = observation.is_known_by_length(sigma, P, rates)
        try:
            eq, gap = _asked(scene, rod.length(sigma), rod.pressure(P), by_length)
        except PeelOptError:
            eq, gap = _asked(scene, rod.length(sigma), rod.pressure(P), not by_length)
        found.append(eq)
        gaps.append(gap)
    return found, gaps


def _asked(scene: Scene, length: float, pressure: float, by_length: bool) -> tuple[Equilibrium, float]:
    """Ask for a state by its length or its pressure."""
    if by_length:
        eq = pressure_given_length(scene, length, near=pressure)
        return eq, abs(eq.pressure - pressure) / scene.rod.adhesion_strength
    eq = length_given_pressure(scene, pressure, near=length)
    return eq, abs(eq.length - length) / scene.rod.eta


# --- what a reader must know ---------------------------------------------------------------------


def _warnings(fit: SceneCalibration) -> Iterator[str]:
    """Yield what a reader must know before believing a fit, in plain words."""
    loose = [d for d in fit.known if not d.determined]
    if loose:
        names = " and ".join(loose[-1].names)
        told = f"the data say next to nothing about {names}"
        if len(loose[-1].names) > 1:
            told = f"the data do not tell {names} apart"
        yield f"{told}. Fix a number that is known from elsewhere, or measure over a wider range of pressure."
    if fit.fitted.directions is not None:
        yield "what the data do not determine was held near the start of the fit."
    yield from filter(None, [goodness(fit)])
    for observation, eq, rests in zip(fit.observations, fit.equilibria, fit.fitted.at_rest, strict=True):
        if rests:
            yield f"{observation.name} is fitted where the branch of the scene begins: no state lies beyond."
        wanted = sorted(_wanted([observation]))
        if not any(fits(eq.state, state) for state in wanted):
            yield (
                f"{observation.name} is fitted on the {eq.state} state, not the {' or '.join(wanted)} one:"
                " it lies past the end of that part of the branch."
            )
        if not eq.valid:
            yield f"{observation.name} is fitted to a state that is not physical: {', '.join(eq.flags)}."
    if fit.loss != "least-squares":
        for observation, r, weights in zip(fit.observations, fit.residuals, fit.weights, strict=True):
            if weights.min() < OUTLIER:
                yield (
                    f"{observation.name} counts as an outlier: {float(np.linalg.norm(r)):.1f} sd off the fit"
                    f" to the others, weight {weights.min():.2g}."
                )
    curved = [name for name in fit.free if CURVED < fit.relative_sd(name) < np.inf]
    if curved and not loose:
        yield (
            f"{', '.join(curved)}: the uncertainty is so large that the covariance is a rough guide."
            " Use the interval of the profile likelihood."
        )


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SceneCalibration(Fit):
    """A fit of numbers of a scene to measurements.

    Parameters
    ----------
    rod, free, deviance, degrees, singular_values, observations, residuals, weights, equilibria, consistency
        As in `Fit`.
    loss, loss_scale, iterations, warnings
        As in `Fit`.
    scene : Scene
        With the fitted numbers.
    own_covariance : ndarray, shape (free, free)
        Of the coordinates of the fit: logarithms of positive numbers, others over their size at the start.
    directions : ndarray, shape (free, free)
        Combinations of these that the data know independently, the best first, as rows.
    """

    scene: Scene
    own_covariance: np.ndarray
    directions: np.ndarray
    problem: SceneProblem = field(repr=False)
    fitted: SceneFitted = field(repr=False)

    @property
    def estimates(self) -> dict[str, float]:
        """The fitted numbers, in the units of the rod."""
        pairs = zip(self.problem.coordinates, self.fitted.z.tolist(), strict=True)
        return {c.name: c.value(z) for c, z in pairs}

    @property
    def units(self) -> dict[str, str]:
        """Their units."""
        return {c.name: c.unit_of(self.rod) for c in self.problem.coordinates}

    @property
    def covariance(self) -> np.ndarray:
        """Covariance in the units of the rod, to first order, shape (free, free)."""
        pairs = zip(self.problem.coordinates, self.fitted.z.tolist(), strict=True)
        rates = np.array([c.rate(z) for c, z in pairs])
        return self.own_covariance * np.outer(rates, rates)

    def own_sd(self, name: str) -> float:
        """Standard deviation of the coordinate of a free number."""
        i = self._index(name)
        return float(math.sqrt(self.own_covariance[i, i]))

    def relative_sd(self, name: str) -> float:
        """Standard deviation of a free number over its size, the larger of that at the start and now."""
        i = self._index(name)
        coordinate, value = self.problem.coordinates[i], abs(self.estimates[name])
        return self.own_sd(name) if coordinate.is_log else self.sd[name] / max(value, coordinate.scale)

    @property
    def known(self) -> tuple[Direction, ...]:
        """Combinations of the free numbers that the data know independently, the best first."""
        return tuple(
            Direction.of(
                self.free,
                row,
                1.0 / size if size > UNSEEN * self.singular_values.max(initial=0.0) else math.inf,
            )
            for row, size in zip(self.directions, self.singular_values.tolist(), strict=True)
        )

    @property
    def has_profile(self) -> bool:
        """Whether there is a likelihood with a maximum: a robust loss is none."""
        known = bool(np.all(np.isfinite(self.own_covariance))) and self.fitted.directions is None
        return self.loss == "least-squares" and known

    def interval(self, name: str, *, level: float = 0.95, method: str | None = None) -> tuple[float, float]:
        """Interval of confidence of a free number, in the units of the rod.

        Parameters
        ----------
        name : str
        level : float
        method : {"profile", "covariance"}, optional
            From the profile likelihood, the other numbers fitted again at each value, or from the covariance.
            Default: the profile; with a robust loss, which is no likelihood, the covariance and Student's t.

        Returns
        -------
        tuple of float
            The end of what the number may be for an end that the data do not set.

        Raises
        ------
        InvalidInput
            If the number was not fitted, or level or method cannot be meant.
        NotConverged
            If a fit on the way to an end of the profile fails, or is better than the fit itself.
        """
        require_level(level)
        z = quantile(self, level, method)
        i = self._index(name)
        coordinate, centre, spread = self.problem.coordinates[i], float(self.fitted.z[i]), self.own_sd(name)
        if method == "covariance" or not self.has_profile:
            ends = [centre - z * spread, centre + z * spread]
        else:
            with watched(self.problem) as problem:
                ends = [_end(replace(self, problem=problem), i, side, z) for side in (-1.0, 1.0)]
        if coordinate.is_log:
            low, high = (math.exp(min(end - centre, 700.0)) for end in ends)
            return self.estimates[name] * low, self.estimates[name] * high if ends[1] < math.inf else math.inf
        return coordinate.value(max(ends[0], coordinate.low)), coordinate.value(min(ends[1], coordinate.high))

    def covariances(self) -> dict[str, Any]:
        """Return what the record has of covariances, plain data by name."""
        return {"covariance": self.covariance.tolist()}


def _end(fit: SceneCalibration, i: int, side: float, target: float) -> float:
    """Return the coordinate at which the root of the increased deviance meets ``target``, maybe infinite."""
    centre, coordinate = float(fit.fitted.z[i]), fit.problem.coordinates[i]
    limit = coordinate.high if side > 0.0 else coordinate.low
    spread = fit.own_sd(coordinate.name)
    furthest = min(abs(limit - centre), max(FURTHEST, 0.0 if coordinate.is_log else WIDE * target * spread))
    known = {0.0: (fit.fitted, -target)}
    follow = np.nan_to_num(fit.own_covariance[i] / fit.own_covariance[i, i])

    def left(distance: float) -> float:
        """How far the root is above the target at a distance, from the fit known nearest to it."""
        if distance not in known:
            near = min(known, key=lambda other: abs(other - distance))
            start, others = known[near][0], np.delete(np.eye(len(fit.free)), i, axis=1)
            for whole in (follow, np.eye(len(fit.free))[i]):
                z = start.z + side * (distance - near) * whole
                points = fit.problem.moved(start.points, start.z, z)
                if points is not None:
                    start = replace(start, z=z, points=tuple(points))
                    break
            else:
                raise NotConverged(
                    f"the states of the fit are lost on the way to {coordinate.name} ="
                    f" {coordinate.value(centre + side * distance):.6g}.",
                    remedy="Ask for a narrower interval, or use method='covariance'.",
                )
            there = fit.problem.minimised(start, others)
            gained = there.deviance - fit.deviance
            if gained < -max(BETTER, 1e-6 * fit.deviance):
                raise BetterFit(
                    f"a better fit was found on the way: with {coordinate.name} at"
                    f" {coordinate.value(centre + side * distance):.6g}, chi-square is {there.deviance:.6g},"
                    f" not {fit.deviance:.6g}.",
                    remedy="Fit again from a scene nearer to it, or fix a number that is known.",
                )
            known[distance] = there, math.sqrt(max(gained, 0.0)) - target
        return known[distance][1]

    distance = met(left, target * spread, furthest)
    if distance is not None:
        return centre + side * distance
    return limit if furthest == abs(limit - centre) else side * math.inf
