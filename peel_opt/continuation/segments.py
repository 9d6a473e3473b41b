"""Segments of a branch: states of one layout, solved together, in the order of the tip angle.

A walk finds one state after the other.  Where starts for many of them are known beforehand, they are one
stack: Newton's method goes through all of them at once, and with the inverse of the last Jacobian come
the direction of the branch, the error of every state and what vanishes at a fold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..base.arrays import EPS
from ..base.quadrature import Grid
from ..model.equations import Scalars
from ..residual.accuracy import SAFE, UNITS, can_estimate
from ..residual.batch import CHORD, CHUNK, Solved, solve
from ..residual.closures import READINGS, Closure, charts
from ..residual.compiled_stack import AnyStack, CompiledStack
from ..residual.stack import TAIL, gradient
from .points import Point, cubic

#: Update of Newton's method below which the inverse is that of the solution, to as many digits.
FRESH = 1e-10

#: Arclength from a fold within which nothing but rounding tells a state from it.
NEAR = 1e-7

#: Steps of a secant to a fold at most, and the arclength of one that is the last.
SECANTS, LAST = 8, 1e-12

#: p/T0 below which states with a free arc are solved for with nodes on it as well: rounding there is 2e-11.
LOW = 1e-5

#: Share of what rounding and the mesh do to a state that is not worth a step.
IDLE = 0.05

#: Arclengths on either side of a fold, tried in turn, between which its rate is seen to change sign; the last
#: where rounding hides it closer by.
WIDTHS = (np.array([4e-12, 4e-11]), 4.0 * 10.0 ** np.arange(-10.5, -5.0, 0.5))

#: Share of the rates at its ends down to which an interval is not looked into, and how often one is cut.
DIP, CUTS = 0.3, 4


class Fold(NamedTuple):
    """A fold of a segment: its kind, its row, half its bracket and its error along the branch."""

    kind: str
    row: int
    width: float
    error: float


@dataclass(frozen=True, eq=False)
class Segment:
    """States at the same value of a closure, in the order of the tip angle.

    Parameters
    ----------
    held : Closure
    solved : Solved
        For that closure and the tip angle.
    """

    held: Closure
    solved: Solved

    @classmethod
    def at(
        cls, stack: AnyStack, held: Closure, A: np.ndarray, start: np.ndarray, *, sharp: bool = False
    ) -> Segment:
        """Solve at tip angles, each from its own start; ``sharp`` slopes are good to rounding."""
        given = np.column_stack([np.full(len(A), held.value), A])
        kinds = (held.kind, "amplitude")
        chunks = [slice(k, k + CHUNK) for k in range(0, len(A), CHUNK)]
        chord = CHORD if sharp else FRESH
        parts = [solve(stack, kinds, given[chunk], start[chunk], chord, sharp=sharp) for chunk in chunks]
        return cls(held, Solved.joined(parts))

    def __len__(self) -> int:
        return len(self.solved.x)

    def of(self, rows: np.ndarray) -> Segment:
        """Some of the states."""
        return Segment(self.held, self.solved.of(rows))

    def with_states(self, other: Segment) -> Segment:
        """Return both in one, in order."""
        solved = Solved.joined([self.solved, other.solved])
        return Segment(self.held, solved.of(np.argsort(solved.given[:, 1], kind="stable")))

    # --- numbers ------------------------------------------------------------------------------------

    @property
    def stack(self) -> AnyStack:
        """What the states are solutions of."""
        return self.solved.stack

    @property
    def A(self) -> np.ndarray:
        """Minus the tip angles."""
        return self.solved.given[:, 1]

    @property
    def rates(self) -> np.ndarray:
        """Derivatives of the unknowns by the tip angle."""
        return self.solved.inverse[:, :, -1]

    def slopes(self, read: Callable[[Scalars], Any]) -> np.ndarray:
        """Derivatives of a number of the scalars by the tip angle."""
        slopes: np.ndarray = (gradient(read, self.solved.x) * self.rates[:, TAIL]).sum(axis=1)
        return slopes

    @cached_property
    def _charts(self) -> tuple[np.ndarray, np.ndarray]:
        return charts(np.ascontiguousarray(self.solved.x[:, TAIL]))

    @property
    def places(self) -> np.ndarray:
        """Coordinates of the arclength."""
        return self._charts[0]

    @cached_property
    def velocities(self) -> np.ndarray:
        """Their derivatives by the tip angle."""
        velocities: np.ndarray = (self._charts[1] @ self.rates[:, TAIL, None])[:, :, 0]
        return velocities

    @cached_property
    def speeds(self) -> np.ndarray:
        """Derivatives of the arclength by the tip angle."""
        return np.linalg.norm(self.velocities, axis=1)

    @property
    def directions(self) -> np.ndarray:
        """Unit tangents in the coordinates of the arclength."""
        return self.velocities / self.speeds[:, None]

    @cached_property
    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Distance of each state from the exact branch by its mesh, and by rounding, as arclength."""
        solved, along = self.solved, self.directions
        across = self._charts[1] - along[:, :, None] * (along[:, None, :] @ self._charts[1])
        response = across @ solved.inverse[:, TAIL, :]
        left_out = SAFE * np.linalg.norm((response @ solved.missed[:, :, None])[:, :, 0], axis=1)
        if self.stack.free:  # the arc itself is exact, its nodes are not
            left_out += self.resolved**2
        rounding = UNITS * EPS * np.linalg.norm(response * solved.sizes[:, None, :], axis=(1, 2))
        return left_out, rounding

    @property
    def error(self) -> np.ndarray:
        """Both together."""
        left_out, rounding = self.errors
        return left_out + rounding

    @property
    def resolved(self) -> np.ndarray:
        """How well the mesh of a point has each state: its last coefficients over its largest."""
        stack, nodes = self.stack, self.stack.settings.nodes
        fields = stack.spread(self.solved.x)[:, : -stack.size + stack.nodes].reshape(len(self), -1, nodes)
        sizes = np.abs(fields @ Grid.gauss(nodes).analysis.T)
        tails: np.ndarray = (sizes[:, :, -2:].max(axis=2) / sizes.max(axis=2)).max(axis=1)
        return tails

    # --- between the states -------------------------------------------------------------------------

    def start(self, A: np.ndarray) -> np.ndarray:
        """Unknowns at tip angles, by the cubics between the states.

        Where the tip is free, that of ln P stands for m: of a P far below 1 it would not leave a digit.
        """
        i = np.clip(np.searchsorted(self.A, A) - 1, 0, len(self) - 2)
        width = self.A[i + 1] - self.A[i]
        x, rates = self.solved.x, self.rates
        t = (A - self.A[i]) / width
        wide = width[:, None]
        start = cubic(t[:, None], x[i], x[i + 1], wide * rates[i], wide * rates[i + 1])
        if self.stack.free:
            P = self.solved.scalars.pressure_ratio
            slope = width * (self.slopes(READINGS["pressure"]) / P)[[i, i + 1]]
            pressure = np.exp(cubic(t, *np.log(P)[[i, i + 1]], *slope))
            start[:, TAIL][:, 1] = (pressure - 1.0) * self.stack.scalars(start).beta0 / A
        return start

    def inserted(self, A: np.ndarray) -> Segment:
        """Return the segment with further states; those that are not reached are left out."""
        other = Segment.at(self.stack, self.held, A, self.start(A))
        return self.with_states(other.of(np.flatnonzero(other.solved.converged)))

    # --- folds --------------------------------------------------------------------------------------

    def with_folds(self, kinds: dict[str, Callable[[Scalars], Any]]) -> tuple[Segment, list[Fold]] | None:
        """Return the segment with its folds among the states, and them; None where one is not found.

        Parameters
        ----------
        kinds : dict
            What folds, by the kind of fold.
        """
        segment = self._cut(list(kinds.values()))
        slopes = {kind: segment.slopes(read) for kind, read in kinds.items()}
        brackets = [
            (kind, int(i))
            for kind, slope in slopes.items()
            for i in np.flatnonzero(slope[1:] * slope[:-1] < 0.0)
        ]
        if not brackets:
            return segment, []
        reads = [kinds[kind] for kind, _ in brackets]
        guesses = np.array([_root(segment.A, slopes[kind], i) for kind, i in brackets])
        A, bends = guesses.T
        found = Segment.at(self.stack, self.held, A, segment.start(A), sharp=True)
        at = np.array([i for _, i in brackets])
        low, high = segment.A[at], segment.A[at + 1]
        begins = np.array([slopes[kind][i] for kind, i in brackets])
        left, enough = found._each(reads), LAST + IDLE * found.error
        off = np.abs(left / bends) * found.speeds
        for _ in range(SECANTS):
            before, nearer, ahead = left, off, left * begins > 0.0
            low, high = np.where(ahead, found.A, low), np.where(ahead, high, found.A)
            aim = found.A - left / bends
            inside = (low - NEAR <= aim) & (aim <= high + NEAR)
            moved = np.where(inside, aim, 0.5 * (low + high)) - found.A
            start = found.solved.x + moved[:, None] * found.rates
            found = Segment.at(self.stack, self.held, found.A + moved, start, sharp=True)
            left = found._each(reads)
            # What a short step changes is lost in rounding.
            far = np.abs(moved) * found.speeds > NEAR
            bends = np.where(far, (left - before) / np.where(far, moved, 1.0), bends)
            off = np.abs(left / bends) * found.speeds
            lost = (off < NEAR) & (off > 0.5 * nearer)  # in rounding
            if np.all((off < enough) | lost):
                break
        widths = found._widths(reads, bends)
        near = NEAR / found.speeds
        inside = (segment.A[at] < found.A + near) & (found.A - near < segment.A[at + 1])
        if not np.all(found.solved.converged & np.isfinite(widths) & inside):
            return None
        moved = np.abs(found._finer._each(reads) - found._each(reads)) / np.abs(bends) * found.speeds
        # A state that is as good as at a fold is that fold.
        apart = np.abs(np.subtract.outer(segment.A, found.A)) > near
        together = segment.of(np.flatnonzero(apart.all(axis=1))).with_states(found)
        rows = np.searchsorted(together.A, found.A)
        errors = SAFE * moved + 2.0 * widths
        entries = zip(brackets, rows.tolist(), widths.tolist(), errors.tolist(), strict=True)
        folds = [Fold(kind, row, width, error) for (kind, _), row, width, error in entries]
        return together, sorted(folds, key=lambda fold: fold.row)

    def _each(self, reads: Sequence[Callable[[Scalars], Any]]) -> np.ndarray:
        """Slope of a number of its own at each state."""
        every = {read: self.slopes(read) for read in dict.fromkeys(reads)}
        return np.array([every[read][k] for k, read in enumerate(reads)])

    def _widths(self, reads: Sequence[Callable[[Scalars], Any]], bends: np.ndarray) -> np.ndarray:
        """Least half-width, as arclength, of a bracket in which a slope changes its sign as it should."""
        found, left = np.full(len(self), np.inf), np.arange(len(self))
        for widths in WIDTHS:
            steps = np.concatenate([-widths[::-1], widths])
            rows, aside = np.repeat(left, len(steps)), (steps / self.speeds[left, None]).ravel()
            start = self.solved.x[rows] + aside[:, None] * self.rates[rows]
            there = Segment.at(self.stack, self.held, self.A[rows] + aside, start, sharp=True)
            slopes = there._each([reads[row] for row in rows.tolist()]).reshape(len(left), 2, len(widths))
            below, above = slopes[:, 0, ::-1], slopes[:, 1]
            sign = np.sign(bends[left, None])
            changes = (below * sign < 0.0) & (above * sign > 0.0)
            done = changes.any(axis=1)
            found[left[done]] = widths[changes[done].argmax(axis=1)]
            left = left[~done]
            if not left.size:
                break
        return found

    @property
    def _finer(self) -> Segment:
        """The same states on the next finer mesh."""
        start = self.stack.prolonged(self.solved.x)
        return Segment.at(self.stack.finer, self.held, self.A, start, sharp=True)

    def _cut(self, reads: Sequence[Callable[[Scalars], Any]]) -> Segment:
        """Return the segment with states between folds that lie close together between two of its own.

        Slopes have one sign then, and dip between two states; where they do, the vertex is looked at.
        """
        segment = self
        for _ in range(CUTS):
            cuts = np.unique([a for read in reads for a in _dips(segment.A, segment.slopes(read))])
            if not cuts.size:
                break
            segment = segment.inserted(cuts)
        return segment

    # --- out ----------------------------------------------------------------------------------------

    def points(self, arclengths: np.ndarray, turned: float | np.ndarray = 1.0) -> list[Point]:
        """Return the states as points of a branch.

        Parameters
        ----------
        arclengths : ndarray
        turned : float or ndarray
            -1 where the branch is walked in the direction in which A falls.
        """
        low = self.solved.scalars.pressure_ratio < LOW if self.stack.free else np.zeros(len(self), bool)
        if low.any():
            return self._with_sharper(np.flatnonzero(low), arclengths, turned)
        stack, solved = self.stack, self.solved
        problem = stack.settings.discretise(stack.phases)
        rates = stack.spread_rates(solved.x, self.rates)
        tangents = rates * (turned / self.speeds)[:, None]
        known: list[Any] = [None] * len(self)
        if can_estimate(stack.settings):
            known = [(float(mesh), float(rounding)) for mesh, rounding in zip(*self.errors, strict=True)]
        rows = zip(stack.spread(solved.x), tangents, arclengths.tolist(), known, strict=True)
        points = [
            Point(problem, x, tangent, arclength, 0, errors=errors) for x, tangent, arclength, errors in rows
        ]
        directions = self.directions * np.broadcast_to(turned, len(self))[:, None]
        Y, Theta = stack.ends(solved.x)
        others = zip(*self._charts, directions, Y.tolist(), Theta.tolist(), strict=True)
        for point, (place, slopes, direction, tip, edge) in zip(points, others, strict=True):
            # Each would work it out for itself; it is known for all.
            vars(point).update(chart=(place, slopes), direction=direction, ends=(tip, edge))
        return points

    def _with_sharper(
        self, low: np.ndarray, arclengths: np.ndarray, turned: float | np.ndarray
    ) -> list[Point]:
        """`points`, some of them solved for once more with nodes on the free arc as well.

        Of a pressure far below T0 a double has few digits.  Then all unknowns are to be solutions for that
        double, those of the free arc too: what is taken from its closed form afterwards is not.
        """
        turned = np.broadcast_to(turned, len(self))
        x = self.stack.spread(self.solved.x)[low]
        full = CompiledStack.of(self.stack.settings, self.stack.phases)
        sharper = Segment.at(full, self.held, self.A[low], x)
        found: list[Point | None] = [None] * len(self)
        others = np.setdiff1d(np.arange(len(self)), low)
        for rows, own in ((low, sharper), (others, self.of(others))):
            points = own.points(arclengths[rows], turned[rows]) if rows.size else []
            for row, point in zip(rows.tolist(), points, strict=True):
                found[row] = point
        return [point for point in found if point is not None]


def arclengths(places: np.ndarray, velocities: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Arclength from the first of some places on a curve to each, along the cubics between them."""
    width = np.diff(A)[:, None]
    grid = Grid.gauss(6)
    total = np.zeros(len(width))
    for t, weight in zip(grid.xi, grid.weights, strict=True):
        chord = places[1:] - places[:-1]
        a, b = width * velocities[:-1], width * velocities[1:]
        # Derivative of the cubic with these ends and tangents.
        rate = a + t * (6.0 * chord - 4.0 * a - 2.0 * b + t * (3.0 * (a + b) - 6.0 * chord))
        total += weight * np.linalg.norm(rate, axis=1)
    return np.concatenate([[0.0], np.cumsum(total)])


def _root(A: np.ndarray, slopes: np.ndarray, i: int) -> tuple[float, float]:
    """Zero between two neighbours of the cubic through four values, and its derivative there."""
    first = min(max(i - 1, 0), max(len(A) - 4, 0))
    here = slice(first, first + 4)
    width = A[i + 1] - A[i]
    t = (A[here] - A[i]) / width
    series = np.polynomial.Polynomial.fit(t, slopes[here], len(t) - 1, domain=[0.0, 1.0], window=[0.0, 1.0])
    secant = slopes[i] / (slopes[i] - slopes[i + 1])
    roots = series.roots()
    real = roots[np.abs(roots.imag) < 1e-9].real
    inside = real[(real > 0.0) & (real < 1.0)]
    root = float(inside[np.argmin(np.abs(inside - secant))]) if inside.size else secant
    return float(A[i] + root * width), float(series.deriv()(root)) / float(width)


def _dips(A: np.ndarray, slopes: np.ndarray) -> list[float]:
    """Places between neighbours where the cubic through four slopes comes near zero, or beyond."""
    found = []
    for i in range(1, len(A) - 2):
        here = slopes[i - 1 : i + 3]
        a, b = slopes[i : i + 2].tolist()
        # An extremum towards zero lies between them only where the slope changes that way.
        if a * b <= 0.0 or (here[1] - here[0]) * a >= 0.0 or (here[3] - here[2]) * a <= 0.0:
            continue
        t = (A[i - 1 : i + 3] - A[i]) / (A[i + 1] - A[i])
        series = np.polynomial.Polynomial.fit(t, here, 3, domain=[0.0, 1.0], window=[0.0, 1.0])
        for root in np.asarray(series.deriv().roots(), complex).tolist():
            if abs(root.imag) < 1e-9 and 0.02 < root.real < 0.98:
                least = float(series(root.real))
                if least * np.sign(a) < DIP * min(abs(a), abs(b)):
                    found.append(float(A[i] + root.real * (A[i + 1] - A[i])))
    return found
