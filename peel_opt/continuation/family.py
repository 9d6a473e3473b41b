"""Pseudo-arclength continuation on the discretised (12).

The family is the residual of (12) with one closure (a rod's ratio, or beta0): a curve, whose
length is measured as `closures` says.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import EPS
from ..base.errors import NotConverged
from ..base.roots import between
from ..model.bond import CohesiveLaw
from ..model.equations import Scalars, kernel
from ..model.groups import PI4
from ..residual import closures
from ..residual.accuracy import certificate_of_ends, certificates_of_ends
from ..residual.closures import Closing, Closure, Plane
from ..residual.discretisation import (
    PROFILE_POINTS,
    Discretisation,
    Phases,
    Profile,
    Transcription,
    chebyshev,
)
from ..residual.linear import Linearised
from ..residual.newton import Correction, correct, correct_sharply
from ..residual.phases import Layout, fits, layout, without_empty_phases, without_thinnest_inner_phase
from .corners import crossed, next_corner
from .points import Point, arclength_between, interpolated, place_of, predicted, scalars_of, turning

#: Distance in the coordinates of the arclength beyond which steps grow: no rod gets there
#: before its tip touches the plate, but the linear law and beta0 = 0 know no end.
FAR = 10.0

#: Relative distance of lambda at a transition from (18) that is put down to rounding.
EXACT = 1e-11

#: Angle at the plate [rad] above which a solution is not one of (14), on the coarsest mesh.
FLAT = 0.05

#: Width of the bracket, in arclength, at which a fold counts as located.
FOLD_WIDTH = 1e-11

#: Tip angle [rad] by which a solution may lie beyond a point that it coincides with.
SLACK = 1e-9

#: Share of its smaller miss at two points at which their interpolation, which is not exact, meets a closure.
MET = 1e-4

#: Width of the bracket below which no landing is tried any more.
LANDING_WIDTH = 1e-9


@dataclass(frozen=True)
class StepControl:
    """How far to step along a branch."""

    first: float = 0.02
    largest: float = 0.25  # a branch from T to contact is about 5 long: some 30 points
    smallest: float = 1e-7
    quick: int = 4  # a correction this quick lets the next step grow
    turn: float = 0.85  # least cosine between successive directions


@dataclass(frozen=True)
class Family:
    """A one-parameter family: a law, a transcription and one closure.

    With ``tip_free`` solutions whose tip is held down to the plate are left out of the equations.
    """

    law: CohesiveLaw
    transcription: Transcription
    closure: Closure
    tip_free: bool = True

    @property
    def closures(self) -> tuple[Closure, ...]:
        """The closures that hold along the branch."""
        return (self.closure,)

    def solve(self, profile: Profile, other: Closing) -> tuple[Discretisation, Correction] | None:
        """Correct from a profile, cutting the phases anew until they are those the law asks for.

        None on failure.
        """
        for _ in range(6):
            fitted = without_empty_phases(profile) or profile
            plan = self.phases_of(fitted)
            problem = self.transcription.discretise(plan.phases)
            result = correct(problem, problem.pack(fitted.rephased(plan.breaks)), (*self.closures, other))
            if not result.converged:
                return None
            profile = problem.profile(result.x)
            if self.suits(profile, problem):
                return (problem, result) if is_flat(profile) else None
        return None

    def certificate(self, point: Point) -> float:
        """How far a solution misses the equation that it was not solved with."""
        return certificate_of_ends(self.law, point.scalars, point.ends, point.problem.phases[0])

    def certificates(self, points: Sequence[Point]) -> np.ndarray:
        """`certificate` of many points."""
        pieces = {id(point.problem): point.problem.phases[0] for point in points}.values()
        heals = all(piece.lost is not None and not piece.for_good for piece in pieces)
        s = scalars_of(points)
        if not (heals and self.law.falls_straight and s.beta0.all()):
            return np.array([self.certificate(point) for point in points])
        Y, edges = np.array([point.ends for point in points]).T
        return certificates_of_ends(self.law, s, s.height(Y), edges)

    def phases_of(self, profile: Profile) -> Layout:
        """Read the phases of a shape off its heights."""
        return layout(self.law, profile, tip_free=self.tip_free)

    def merged(self, profile: Profile, phases: Phases) -> Profile | None:
        """Return a shape whose thinnest phase that may end with a square root has ended; None without one."""
        return without_thinnest_inner_phase(profile, phases)

    def suits(self, profile: Profile, problem: Discretisation) -> bool:
        """Whether the phases of a solution are those the law asks for."""
        if len(self.law.pieces) == 1 or fits(profile, problem.phases):
            return True
        return bool(np.all(profile.lengths > 0.0)) and self.phases_of(profile).phases == problem.phases

    def point(
        self, problem: Discretisation, x: np.ndarray, forward: np.ndarray, arclength: float, iterations: int
    ) -> Point:
        """Return the solution ``x`` with its unit tangent, on the side of the direction ``forward``."""
        at = Linearised.at(problem, x, *self.closures, Plane.facing(forward))
        return Point(problem, x, at.tangent(), arclength, iterations, at.sign())

    def step(self, here: Point, ds: float, behind: Point | None = None) -> Point | None:
        """Advance by ``ds`` along the tangent, started by a point behind too; None if the corrector fails."""
        plane = Plane.across(here.place, here.direction, ds)
        problem = here.problem
        if _outlives_its_phases(here, ds) and (there := self._merge_step(here, plane, ds)) is not None:
            return there
        result = correct(problem, predicted(here, ds, behind), (*self.closures, plane))
        if not result.converged:
            return self._merge_step(here, plane, ds)
        if len(self.law.pieces) > 1:
            profile = problem.profile(result.x)
            if not self.suits(profile, problem):
                again = self.solve(profile, plane)
                if again is None:
                    return None
                problem, result = again
        there = self.point(problem, result.x, here.direction, here.arclength + ds, result.iterations)
        return there if is_flat(there.profile) and not _crossed_over(here, there) else None

    def _merge_step(self, here: Point, plane: Plane, ds: float) -> Point | None:
        """Step over the end of an inner phase.

        The height grazes a kink there: the length of the phase goes to zero with a square
        root, which no tangent follows, while the shape itself is smooth.
        """
        merged = self.merged(here.profile, here.problem.phases)
        again = self.solve(merged, plane) if merged is not None else None
        if again is None:
            return None
        problem, result = again
        return self.point(problem, result.x, here.direction, here.arclength + ds, result.iterations)

    def walk(self, start: Point, control: StepControl | None = None) -> Iterator[Point]:
        """Yield points from ``start`` on, until the step falls below its floor."""
        control = control or StepControl()
        here, ds, behind = start, control.first, None
        yield here
        while ds > control.smallest:
            there = self.step(here, ds, behind)
            if there is not None and here.direction @ there.direction < control.turn:
                there = None
            if there is None or crossed(self, here, there):
                corner = next_corner(self, here, ds)
                there = corner if corner is not None and is_flat(corner.profile) else there
            if there is None:
                ds *= 0.5
                continue
            if there.iterations <= control.quick:
                # Far out the coordinates grow without end, and the steps with them.
                far = float(np.linalg.norm(there.place)) / FAR
                ds = min(1.6 * ds, control.largest * max(1.0, far))
            behind, here = here, there
            yield here

    def solve_between(
        self, here: Point, there: Point, other: Closure
    ) -> tuple[Discretisation, Correction] | None:
        """Solve between two neighbouring points for a closure that changes sign between them.

        Near a fold of the closure its Newton basin is tiny, so the bracket is narrowed by
        steps along the branch until a correction from its middle stays inside it.
        """
        found = self._land_by_interpolation(here, there, other) if turning(here, there) else None
        if found is not None:
            return found
        low, high, shrink = here, there, 1.0
        least = max(LANDING_WIDTH, _resolution(there))
        # Arclengths add up steps of different origin: the bracket is measured from its lower end.
        while (span := low.ahead(high.place)) > least and shrink > 1e-6:
            a, b = low.miss(other), high.miss(other)
            for start in sorted((low, high), key=lambda p: abs(p.miss(other))):
                found = self.solve(start.profile, other)
                if found is None or _past_a_corner(low, found[0], high):
                    continue
                problem, result = found
                if turning(low, high) and not _within(low, high, problem.scalars(result.x).A):
                    continue
                if self.between(low, high, place_of(*found)):
                    return found
            share = min(max(a / (a - b), 0.1), 0.9) if a != b else 0.5
            middle = self.step(low, shrink * share * span)
            if middle is None:
                shrink *= 0.5
                continue
            shrink = 1.0
            low, high = (middle, high) if middle.miss(other) * a > 0.0 else (low, middle)
        return None

    def at(self, here: Point, there: Point, other: Closure) -> Point | None:
        """Return the point between two neighbours at which a further closure holds; None on failure."""
        landed = self.solve_between(here, there, other)
        if landed is None:
            return None
        problem, result = landed
        if other.kind in closures.OF_A_SCALAR:  # the given number, not the rounding error of it
            result.x[problem.column(closures.OF_A_SCALAR[other.kind])] = other.value
        arclength = arclength_between(here, there, place_of(problem, result))
        return self.point(problem, result.x, here.direction, arclength, result.iterations)

    def _land_by_interpolation(
        self, here: Point, there: Point, other: Closure
    ) -> tuple[Discretisation, Correction] | None:
        """Solve from where the interpolation between two points meets a closure, in their phases."""
        problem = here.problem
        start = interpolated(here, there, _meets(other, here, there))
        result = correct(problem, start, (*self.closures, other))
        if not result.converged:
            result = correct_sharply(problem, start, (*self.closures, other)) or result
        if not result.converged or not _within(here, there, problem.scalars(result.x).A):
            return None
        if not self.between(here, there, place_of(problem, result)):
            return None
        profile = problem.profile(result.x)
        return (problem, result) if self.suits(profile, problem) and is_flat(profile) else None

    @staticmethod
    def between(here: Point, there: Point, place: np.ndarray) -> bool:
        """Whether a solution lies where the two points say: no jump to another branch."""
        a, b, c = (
            math.sqrt(v @ v) for v in (place - here.place, there.place - place, there.place - here.place)
        )
        return a + b < 1.1 * c + 1e-9

    def turning_point(
        self, here: Point, there: Point, rate: Callable[[Point], float]
    ) -> tuple[Point, tuple[float, float]]:
        """Locate where ``rate`` vanishes between two neighbouring points.

        Returns the nearer end of the last bracket, and the arclengths of both.

        Bracketed secant steps, every other one of double length from the better end, so that
        both ends close in; where they do not, because of rounding, the bracket is halved.  Each
        step is taken from the lower end, by a short way along the branch.
        """
        low, high, shrink, reach = here, there, 1.0, 1.0
        a, b = rate(low), rate(high)
        before = last = math.inf
        least = max(FOLD_WIDTH, _resolution(there))
        # Arclengths add up steps of different origin: the bracket is measured from its lower end.
        while (span := low.ahead(high.place)) > least and shrink > 1e-6:
            near, value = (0.0, a) if abs(a) < abs(b) else (span, b)
            aim = near - reach * value * span / (b - a) if span < 0.5 * before else 0.5 * span
            margin = min(0.4 * least, 0.4 * span)
            point = self.step(low, shrink * min(max(aim, margin), span - margin))
            if point is None:
                shrink *= 0.5
                continue
            shrink, reach, before, last = 1.0, 3.0 - reach, last, span
            if (value := rate(point)) * a > 0:
                low, a = point, value
            else:
                high, b = point, value
        found = low if abs(a) < abs(b) else high
        start = arclength_between(here, there, low.place)
        if found is not here and found is not there:
            found = replace(found, arclength=arclength_between(here, there, found.place))
        return found, (start, start + max(span, 0.0))


def _within(here: Point, there: Point, A: float) -> bool:
    """Whether a tip angle lies between those of two points: past a fold, which is one, there is a twin."""
    low, high = sorted((here.scalars.A, there.scalars.A))
    return low - SLACK <= A <= high + SLACK


def _meets(other: Closure, here: Point, there: Point) -> float:
    """Share of the way in the tip angle between two points at which their interpolation meets a closure."""
    ends = (here.miss(other), there.miss(other))

    def off(share: float) -> float:
        return closures.miss(other, interpolated(here, there, share)[here.problem.tail])

    return between(off, (0.0, 1.0), ends, MET * min(abs(ends[0]), abs(ends[1])))


def is_flat(profile: Profile) -> bool:
    """Whether a solution leaves the plate without an angle.

    Where the reaction at the edge vanishes, shapes that leave it at an angle branch off: there the
    rod is under the plate, and the identity does not imply Theta(1) = 0.
    """
    return bool(abs(profile.angle_at_plate) < FLAT)


def _resolution(point: Point) -> float:
    """Length of branch below which doubles do not tell places apart, far out."""
    return 16.0 * EPS * max(abs(point.arclength), float(np.linalg.norm(point.place)))


def _outlives_its_phases(here: Point, ds: float) -> bool:
    """Whether an inner phase ends on the next step: the square of its length falls evenly to zero there."""
    phases, lengths, rates = here.problem.phases, here.x[here.problem.inner], here.tangent[here.problem.inner]
    ends = lengths + 2.0 * ds * rates < 0.0
    return any(ends[j] and phases[j - 1] == phases[j + 1] for j in range(1, len(phases) - 1))


def _past_a_corner(low: Point, problem: Discretisation, high: Point) -> bool:
    """Whether a solution near two neighbours is on the far side of one that is a corner."""
    return problem is low.before or (high.before is not None and problem is high.problem)


def _crossed_over(here: Point, there: Point) -> bool:
    """Whether a step went straight across a corner where two branches nearly meet.

    The determinant of the bordered Jacobian keeps its sign along a branch.  On its far side
    the other branch has the other sign, however smooth the step looks.
    """
    if here.problem is not there.problem:
        return False
    return here.orientation * there.orientation < 0


def transition(family: Family, mode: int = 1) -> Point:
    """Return the start of a detached branch, where a mode (16) leaves the straight rod.

    ``mode`` = 1 is T.  Walk from it with A > 0 for the detached side (p < T0).
    """
    lam = (mode * math.pi) ** 4 / family.law.initial_slope - PI4
    if family.closure.kind == "ratio":
        sigma = ((lam + PI4) / family.closure.value) ** 0.25
    else:
        sigma = family.closure.value
    fields = kernel(chebyshev(PROFILE_POINTS)[0], mode)
    nx = -(sigma**3) * (fields["Y"] - fields["Y"][0])
    values = np.stack([fields["Theta"], fields["K"], nx, fields["ny"], fields["Y"]], axis=-1)
    # Only a law that is smooth at u = 0 can be evaluated at amplitude zero itself.
    small = 0.0 if family.law.pieces[0].vanishes_smoothly else 1e-4
    profile = Profile(np.ones(1), values[None], Scalars(small, float(fields["m"]), sigma, lam))
    problem = family.transcription.discretise(family.phases_of(profile).phases)
    result = correct(problem, problem.pack(profile), (family.closure, Closure("amplitude", small)))
    if not result.converged:
        raise NotConverged(
            f"the start of the branch of mode {mode} at {family.closure} was not found.",
            remedy="Try a finer transcription.",
        )
    at_A, at_lam = problem.column("A"), problem.column("lam")
    result.x[at_A] = small  # not the rounding error of it: its sign would be read as a side
    if abs(result.x[at_lam] - lam) < EXACT * (1.0 + abs(lam)):
        result.x[at_lam] = lam
    return family.point(problem, result.x, np.array([1.0, 0.0, 0.0, 0.0]), 0.0, result.iterations)
