"""The diagram at fixed beta0 as one interpolant in the tip angle, through T.

The states of a rod that stays within y0, spurious ones on one side of T and detached ones on the other,
are one analytic curve in the tip angle.  They are solved for at Chebyshev points of it, all at once from
the series about the mode (22).  The polynomial through them has the points of a branch; its folds are
roots of a derivative, and so are the places where it enters a window of lambda and leaves it roots.

What the polynomial leaves out is not taken on trust: each of its points is put into the equations of a
finer mesh.  Where it would take too many coefficients, or the series does not reach, there is no interpolant.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from ..base.arrays import EPS
from ..base.threads import one_thread
from ..model.series_curve import curve
from ..residual.accuracy import can_estimate
from ..residual.batch import Solved
from ..residual.closures import READINGS
from ..residual.meshes import SUMMED
from ..residual.spectral import Spectral
from ..residual.stack import TAIL, Stack, stack_of
from .family import Family
from .points import Point
from .segments import Segment
from .special import LAMBDA, Located, tip_excess

#: Order of the series that starts are taken from.
ORDER = 12

#: Values of alpha1 on either side of T among which the ends of a window are looked for, and how much further
#: than the leading term says.
SAMPLES, FURTHER = 24, 1.6

#: Values of alpha1 from which on the series has no meaning at any beta0.
DIVERGES = 100.0

#: Largest error of lambda, over 1 + |lambda|, of a start.
ROUGH = 0.05

#: Numbers of Chebyshev points, tried in turn, and the share of the last coefficients in the largest that is
#: small enough.
COUNTS, ENOUGH = (16, 24, 36), 1e-11

#: Least beta0: of smaller ones T and the fold lie too close together on one polynomial.
LEAST_BETA0 = 0.1

#: Largest slope [rad]: no rod with less is higher anywhere than at its tip, or meets itself.
STEEPEST = 1.5

#: Arclength between points at most: splines through them, such as potentials, are good to 1e-11 then.  Share
#: of their distance within which one makes room.
APART, CLOSE = 0.12, 1e-3

#: Places at which the arclength is tabulated.
TABULATED = 200

#: Tip angle, over the length of the domain, within which a root is T.
AT_T = 1e-13

#: Places for each Chebyshev point between which a polynomial is seen to change its sign, and steps of
#: Newton's method from there to a root at most: some beside a fold.
SEEN, MOST_STEPS = 8, 60

#: Arclength on either side of a fold, tried in turn, between which the slope of lambda changes its sign.
WIDTHS = np.array([4e-12, 4e-11])


@dataclass(frozen=True, eq=False)
class Diagram:
    """The branch through T inside a window of lambda.

    Parameters
    ----------
    family : Family
        With the mesh of its points.
    sections : list
        In order from the spurious side on: the points of each, and its special points.
    fold : float
        Arclength of the first fold of the detached side; infinite without one.
    rounding : float
        What it does to a point at most, as arclength.
    """

    family: Family
    sections: list[tuple[list[Point], list[Located]]]
    fold: float
    rounding: float

    def state_at(self, arclength: float) -> str:
        """Label of a place on the curve."""
        if arclength < 0.0:
            return "spurious"
        return "lower" if arclength > self.fold else "middle"


@one_thread
def diagram(
    families: Sequence[Family], window: tuple[float, float], points: int, tol: float
) -> Diagram | None:
    """Return the branch through T in a window of lambda, by one interpolant.

    Parameters
    ----------
    families : sequence of Family
        One branch on several meshes, tried in turn.
    window : (float, float)
    points : int
        Least number of points.
    tol : float
        Largest error of a point, but for rounding.

    Returns
    -------
    Diagram or None
        None where the curve is no such polynomial, or not to that error, or not in the window.
    """
    for family in filter(covers, families):
        known = Interpolant.of(family, window[1])
        sections = known.sections(window) if known is not None else []
        if known is None or not sections:
            return None
        found = known.diagram(family, sections, points, tol)
        if found is not None:
            return found
    return None


def covers(family: Family) -> bool:
    """Whether states of a family may be one interpolant: at fixed beta0, under a law that falls straight."""
    at_beta0 = family.closure.kind == "length" and family.closure.value**3 >= LEAST_BETA0
    return at_beta0 and family.law.falls_straight and family.tip_free and can_estimate(family.transcription)


class Section(NamedTuple):
    """A part of the curve between borders of a window: its ends as places, and lambda there."""

    ends: tuple[float, float]
    lam: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Interpolant:
    """States at fixed beta0 as a polynomial in minus the tip angle.

    Parameters
    ----------
    domain : (float, float)
    nodes : Segment
        The states at its Chebyshev points.
    """

    domain: tuple[float, float]
    nodes: Segment

    @classmethod
    def of(cls, family: Family, lam: float) -> Interpolant | None:
        """Solve for the states of a family on both sides of T, up to a value of lambda; None on failure."""
        sigma, law = family.closure.value, family.law
        alpha1, A = _reaching(sigma, lam)
        if not alpha1.size:
            return None
        assert isinstance(family.transcription, Spectral)
        stack, summed = (stack_of(mesh, law.pieces[:1]) for mesh in (family.transcription, SUMMED))
        domain = (float(A[0]), float(A[-1]))
        for count in COUNTS:
            places = 0.5 * (domain[0] + domain[1]) + 0.5 * (domain[1] - domain[0]) * _chebyshev(count)
            start = summed.prolonged(curve(ORDER).unknowns_of(np.interp(places, A, alpha1), sigma), stack)
            start[:, TAIL][:, 0] = places
            found = cls(domain, Segment.at(stack, family.closure, places, start, sharp=True))
            if not found.nodes.solved.converged.all():
                return None
            if found._is_resolved:
                return found if found._reaches(lam) and found._is_flat(kinked=not law.is_linear) else None
        return None

    @property
    def _is_resolved(self) -> bool:
        """Whether the last coefficients of every unknown are small enough."""
        sizes = np.abs(self._series(self.nodes.solved.x))
        return bool(np.all(sizes[-2:].max(axis=0) <= ENOUGH * np.maximum(1.0, sizes.max(axis=0))))

    def _reaches(self, lam: float) -> bool:
        """Whether both ends are beyond a value of lambda."""
        ends = chebyshev.chebval(np.array([-1.0, 1.0]), self._series(self._lam))
        return bool(np.all(ends > lam))

    def _is_flat(self, *, kinked: bool) -> bool:
        """Whether no rod is steep anywhere, nor beyond y0 where its law has a kink."""
        stack = self.nodes.stack
        assert isinstance(stack, Stack)
        Theta, _, height = stack.shapes(self.nodes.solved.x)
        steepest = max(map(abs, self.domain)) * float(np.abs(Theta).max())
        return steepest < STEEPEST and not (kinked and height.max() > 1.0)

    @property
    def _lam(self) -> np.ndarray:
        return self.nodes.solved.x[:, -1]

    # --- between the nodes --------------------------------------------------------------------------

    def at(self, A: np.ndarray) -> Segment:
        """The states at some places."""
        count, own, held = len(self.nodes), self.nodes.solved, self.nodes.held
        matrix = chebyshev.chebvander(self._scaled(A), count - 1) @ _analysis(count)
        x = matrix @ own.x
        x[:, TAIL][:, 0], x[:, TAIL][:, 2] = A, held.value
        x[A == 0.0, -1] = 0.0  # T is where (18) says
        inverse = (matrix @ own.inverse.reshape(count, -1)).reshape(-1, *own.inverse.shape[1:])
        i = np.clip(np.searchsorted(self.nodes.A, A), 1, count - 1)
        sizes = np.maximum(own.sizes[i - 1], own.sizes[i])  # moduli, which have corners
        given = np.column_stack([np.full(len(A), held.value), A])
        solved = Solved(
            own.stack, own.kinds, given, x, np.ones(len(A), bool), np.zeros_like(x), inverse, sizes
        )
        return Segment(held, solved)

    def arclengths(self, A: np.ndarray) -> np.ndarray:
        """Arclength from T to some places, negative on the spurious side."""
        along: np.ndarray = chebyshev.chebval(self._scaled(A), self._from_T)
        return along

    @cached_property
    def _from_T(self) -> np.ndarray:
        """Coefficients of the arclength from T."""
        half = 0.5 * (self.domain[1] - self.domain[0])
        integral = chebyshev.chebint(self._series(self.nodes.speeds), scl=half)
        integral[0] -= chebyshev.chebval(self._scaled(np.zeros(())), integral)
        return integral

    def roots(self, *values: np.ndarray, between: Sequence[float] | np.ndarray = ()) -> list[np.ndarray]:
        """Where the polynomials through some values at the nodes change their signs, ascending for each.

        Two changes between neighbouring places that are looked at are missed, unless one of ``between`` lies
        between them.
        """
        count, (low, high) = len(self.nodes), self.domain
        series = self._series(np.column_stack(values))
        slopes = np.concatenate([chebyshev.chebder(series), np.zeros((1, len(values)))])
        t = np.sort(np.concatenate([np.linspace(-1.0, 1.0, SEEN * count), self._scaled(np.asarray(between))]))
        seen = chebyshev.chebvander(t, count - 1) @ series
        which, i = np.nonzero((seen[1:] < 0.0).T != (seen[:-1] < 0.0).T)
        found = t[i] - seen[i, which] * (t[i + 1] - t[i]) / (seen[i + 1, which] - seen[i, which])
        for _ in range(MOST_STEPS):
            terms, before = chebyshev.chebvander(found, count - 1).T, found
            step = (terms * series[:, which]).sum(axis=0) / (terms * slopes[:, which]).sum(axis=0)
            found = np.clip(found - step, t[i], t[i + 1])
            if np.all(np.abs(found - before) < 2.0 * EPS):
                break
        places = low + 0.5 * (high - low) * (1.0 + found)
        places[np.abs(places) < AT_T * (high - low)] = 0.0
        return [places[which == k] for k in range(len(values))]

    def _scaled(self, A: np.ndarray) -> np.ndarray:
        """Places on [-1, 1]."""
        low, high = self.domain
        return (2.0 * A - low - high) / (high - low)

    def _series(self, values: np.ndarray) -> np.ndarray:
        """Chebyshev coefficients of values at the nodes."""
        series: np.ndarray = _analysis(len(self.nodes)) @ values
        return series

    # --- a window of lambda -------------------------------------------------------------------------

    @cached_property
    def special(self) -> list[np.ndarray]:
        """Where lambda turns, and where the tip passes y0: p = T0/2 there."""
        return self.roots(self.nodes.slopes(READINGS["lam"]), self.nodes.solved.scalars.pressure_ratio - 0.5)

    def sections(self, window: tuple[float, float]) -> list[Section]:
        """Sections inside a window, from border to border."""
        roots = self.roots(*(self._lam - lam for lam in window), between=self.special[0])
        borders = sorted((A, lam) for lam, places in zip(window, roots, strict=True) for A in places.tolist())
        pairs = list(pairwise(borders))
        middle = np.array([0.5 * (a + b) for (a, _), (b, _) in pairs])
        lam = chebyshev.chebval(self._scaled(middle), self._series(self._lam))
        inside = (window[0] < lam) & (lam < window[1])
        return [Section(*zip(*pair, strict=True)) for pair, kept in zip(pairs, inside, strict=True) if kept]

    def diagram(self, family: Family, sections: Sequence[Section], points: int, tol: float) -> Diagram | None:
        """Return so many points evenly along sections, and all that is special in them."""
        dense = np.linspace(*self.domain, TABULATED)
        along = self.arclengths(dense)
        begins, ends = np.interp([section.ends for section in sections], dense, along).T
        spacing = min(float((ends - begins).sum()) / (points - 1), APART)
        special, chosen = np.concatenate([[0.0], *self.special]), []
        for section, begin, end in zip(sections, begins, ends, strict=True):
            low, high = section.ends
            pieces = math.ceil((end - begin) / spacing * (1.0 - 1e-12))
            even = np.interp(np.linspace(begin, end, pieces + 1)[1:-1], along, dense)
            own = special[(low <= special) & (special <= high)]
            near = np.abs(np.subtract.outer(even, own)) < CLOSE * (high - low) / pieces
            chosen.append(np.unique([low, *own, *even[~near.any(axis=1)], high]))
        states = self.at(np.concatenate(chosen))
        firsts = np.cumsum([0, *map(len, chosen)])
        for section, first, last in zip(sections, firsts[:-1], firsts[1:] - 1, strict=True):
            states.solved.x[[first, last], -1] = section.lam
        mesh, rounding = states.errors
        if not np.all(mesh <= np.maximum(tol, rounding)):
            return None
        every = states.points(self.arclengths(states.A))
        parts = [every[a:b] for a, b in pairwise(firsts.tolist())]
        specials = self._specials(states, every)
        if not all(math.isfinite(special.error) for special in specials):
            return None
        detached = self.special[0][self.special[0] > 0.0]
        return Diagram(
            family,
            [(part, [s for s in specials if any(s.point is p for p in part)]) for part in parts],
            float(self.arclengths(detached[:1])[0]) if detached.size else math.inf,
            float(rounding.max()),
        )

    def _specials(self, states: Segment, points: Sequence[Point]) -> list[Located]:
        """Folds of lambda, and where the tip passes y0, among states."""
        found = []
        folds, passages = (np.flatnonzero(np.isin(states.A, places)) for places in self.special)
        for row, width in zip(folds.tolist(), self._widths(states.of(folds)).tolist(), strict=True):
            point = points[row]
            bracket = (point.arclength - width, point.arclength + width)
            found.append(Located(LAMBDA[0], point, bracket, LAMBDA[1], 2.0 * width))
        if passages.size:
            # How far the pressure is off at each tip angle, over its rate along the branch.
            pressure = READINGS["pressure"]
            off = states.solved.errors(pressure) / np.abs(states.slopes(pressure)) * states.speeds
            for row in passages.tolist():
                point = points[row]
                bracket = (point.arclength, point.arclength)
                found.append(Located("y=y0", point, bracket, tip_excess, float(off[row])))
        return sorted(found, key=lambda special: special.point.arclength)

    def _widths(self, folds: Segment) -> np.ndarray:
        """Arclength on either side of folds between which lambda turns on the finer mesh, or infinity."""
        if not len(folds):
            return np.empty(0)
        aside = np.concatenate([-WIDTHS[::-1], WIDTHS])
        A = (folds.A[:, None] + aside / folds.speeds[:, None]).ravel()
        start = folds.stack.prolonged(self.at(A).solved.x)
        finer = Segment.at(folds.stack.finer, folds.held, A, start)
        slopes = finer.slopes(READINGS["lam"]).reshape(len(folds), 2, len(WIDTHS))
        reached = finer.solved.converged.reshape(len(folds), -1).all(axis=1, keepdims=True)
        turns: np.ndarray = (slopes[:, 0, ::-1] * slopes[:, 1] < 0.0) & reached
        return np.where(turns.any(axis=1), WIDTHS[turns.argmax(axis=1)], np.inf)


def _reaching(sigma: float, lam: float) -> tuple[np.ndarray, np.ndarray]:
    """Values of alpha1 and minus the tip angles of states from beyond ``lam`` on one side of T to the other.

    Minus the tip angle rises.  None where the series does not converge, or never comes to ``lam``.
    """
    beta0, sums = sigma**3, curve(ORDER)
    a1, a2 = sums.series.leading
    # lambda = -alpha1 (alpha1 + a2 beta0)/a1 to leading order.
    furthest = FURTHER * (abs(a2) * beta0 + math.sqrt(abs(a1) * max(lam, 0.0)))
    if furthest > DIVERGES:
        return np.empty(0), np.empty(0)
    alpha1 = furthest * np.linspace(1.0, -1.0, 2 * SAMPLES + 1)
    A, _, _, reached = sums.unknowns_of(alpha1, sigma)[:, TAIL].T
    good = sums.series.curve_error(alpha1, beta0) < ROUGH * (1.0 + np.abs(reached))
    begin, end = SAMPLES, SAMPLES
    while begin >= 0 and good[begin] and reached[begin] <= lam:
        begin -= 1
    # Down to its fold the detached side may be above ``lam`` already.
    while end <= 2 * SAMPLES and good[end] and (reached[end] <= lam or reached[end] <= reached[end - 1]):
        end += 1
    if begin < 0 or end > 2 * SAMPLES or not (good[begin] and good[end]):
        return np.empty(0), np.empty(0)
    return alpha1[begin : end + 1], A[begin : end + 1]


@lru_cache(maxsize=8)
def _chebyshev(count: int) -> np.ndarray:
    """Chebyshev points on [-1, 1], ascending."""
    places: np.ndarray = -np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return places


@lru_cache(maxsize=8)
def _analysis(count: int) -> np.ndarray:
    """Matrix from values at Chebyshev points to the coefficients of the polynomial through them."""
    matrix = 2.0 / count * chebyshev.chebvander(_chebyshev(count), count - 1).T
    matrix[0] *= 0.5
    return matrix
