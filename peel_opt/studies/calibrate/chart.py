"""States of the primary branches of all rods on one chart, (log r, A), many at once.

The tip angle -A is monotone along the branch of every rod from T to contact, so no state is
met twice and nothing folds: sbar/eta and p/T0 are smooth functions of (log r, A), whose derivatives
follow from the bordered system that solves for the state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from ...base.errors import InvalidInput
from ...base.threads import one_thread
from ...continuation.family import Family
from ...continuation.fill import corrected
from ...continuation.points import Point
from ...model.bond import Affine, CohesiveLaw
from ...residual.closures import Closing, Closure, parameters
from ...residual.discretisation import Discretisation, Profile
from ...residual.linear import closed_system
from ...residual.spectral import Spectral

#: Largest A at which a state is looked for: the tips of all rods are on the plate before.
HIGHEST = 4.2

#: Least A at which a law that is not affine at u = 0 can be evaluated; below, the chart is a parabola.
SMALLEST = 2e-3

#: Half the width of the differences along the branch that give curvatures, in A; less than `SMALLEST`.
WIDTH = 1e-3

#: How often the way to a state is halved before it counts as out of reach.
MOST_HALVINGS = 5

#: Fields of `ChartStates`: lists, numbers of shape (n, 2), and all arrays.
LISTS, NUMBERS = ("problems", "x", "rates"), ("numbers", "by_r", "by_A", "by_AA")
ARRAYS = ("log_r", "A", *NUMBERS)


@dataclass(frozen=True, eq=False)
class ChartStates:
    """Some states and their neighbourhood on the chart, to first order in log r, second in A.

    Parameters
    ----------
    problems : list of Discretisation
    x : list of ndarray
        Unknowns of each; of the last state that was found where there is none.
    rates : list of ndarray, shape (size, 2)
        Derivatives of the unknowns by log r and A.
    log_r, A : ndarray, shape (n,)
    numbers, by_r, by_A, by_AA : ndarray, shape (n, 2)
        sbar/eta and p/T0, and their derivatives; nan where there is no state.
    """

    problems: list[Discretisation]
    x: list[np.ndarray]
    rates: list[np.ndarray]
    log_r: np.ndarray
    A: np.ndarray
    numbers: np.ndarray
    by_r: np.ndarray
    by_A: np.ndarray
    by_AA: np.ndarray

    @classmethod
    def at_points(cls, points: list[Point]) -> Self:
        """Return points of a walk, without derivatives by log r."""
        empty = np.full((len(points), 2), np.nan)
        rates = [np.column_stack([0.0 * p.x, p.tangent / p.turn.A]) for p in points]
        log_r = np.log([p.scalars.ratio for p in points])
        A = np.array([p.scalars.A for p in points])
        return cls(
            [p.problem for p in points], [p.x for p in points], rates, log_r, A, empty, empty, empty, empty
        )

    def __len__(self) -> int:
        return len(self.A)

    def take(self, rows: np.ndarray) -> Self:
        """Return some of the states."""
        chosen: dict[str, Any] = {name: [getattr(self, name)[i] for i in rows] for name in LISTS}
        return replace(self, **chosen, **{name: getattr(self, name)[rows] for name in ARRAYS})

    def put(self, rows: np.ndarray, others: ChartStates) -> Self:
        """Return the states with some of them replaced."""
        merged: dict[str, Any] = {name: list(getattr(self, name)) for name in LISTS}
        merged |= {name: getattr(self, name).copy() for name in ARRAYS}
        for name in LISTS:
            for i, one in zip(rows, getattr(others, name), strict=True):
                merged[name][i] = one
        for name in ARRAYS:
            merged[name][rows] = getattr(others, name)
        return replace(self, **merged)

    def lost(self, A: np.ndarray, log_r: float) -> Self:
        """Return no states at these places, with the unknowns of these ones."""
        nothing: dict[str, Any] = {name: np.full((len(A), 2), np.nan) for name in NUMBERS}
        return replace(self, log_r=np.full(len(A), log_r), A=A, **nothing)

    def expanded(self, A: np.ndarray, log_r: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the numbers, and their derivatives by A, at other tip angles and another ratio nearby."""
        step, turn = (A - self.A)[:, None], (log_r - self.log_r)[:, None]
        numbers = self.numbers + turn * self.by_r + step * self.by_A + 0.5 * step**2 * self.by_AA
        return numbers, self.by_A + step * self.by_AA, self.by_AA

    def moved(self, A: np.ndarray, log_r: float) -> Self:
        """Return the states nearby that the expansion has there, unknowns and all."""
        numbers, by_A, _ = self.expanded(A, log_r)
        moves = np.column_stack([log_r - self.log_r, A - self.A])
        x = [v + rate @ move for v, rate, move in zip(self.x, self.rates, moves, strict=True)]
        return replace(self, x=x, log_r=np.full(len(A), log_r), A=A, numbers=numbers, by_A=by_A)

    def profile(self, i: int) -> Profile:
        """The fields of one state, sampled."""
        return self.problems[i].profile(self.x[i])


@dataclass(frozen=True)
class Chart:
    """The surface of all states of a law, on a mesh.

    Parameters
    ----------
    law : CohesiveLaw
        With a transition T: its traction falls at once.
    nodes : int
        Of the spectral form, in each phase.

    Raises
    ------
    InvalidInput
        If the law has no transition.
    """

    law: CohesiveLaw
    nodes: int

    def __post_init__(self) -> None:
        if not self.law.initial_slope > 0.0:
            raise InvalidInput(
                f"law {self.law.name!r} has no transition T, from which states are counted here.",
                remedy="Fit with a law whose traction falls from u = 0 on.",
            )

    @property
    def floor(self) -> float:
        """Least A at which states are solved for."""
        return 0.0 if isinstance(self.law.pieces[0].drop, Affine) else SMALLEST

    def family(self, log_r: float) -> Family:
        """The branch of one rod."""
        return Family(self.law, Spectral(self.nodes), Closure("ratio", float(np.exp(log_r))))

    def at(
        self, start: ChartStates, log_r: float, A: np.ndarray, halvings: int = MOST_HALVINGS
    ) -> ChartStates:
        """Return the states of a rod at some tip angles, each from a state nearby."""
        solved_at = np.clip(A, self.floor, HIGHEST)
        found = self._solved(start, log_r, solved_at, halvings)
        return found if np.array_equal(solved_at, A) else found.moved(A, log_r)

    def _solved(self, start: ChartStates, log_r: float, A: np.ndarray, halvings: int) -> ChartStates:
        found = start.lost(A, log_r)
        lost = []
        groups: dict[int, list[int]] = {}
        for i, problem in enumerate(start.problems):
            groups.setdefault(id(problem), []).append(i)
        for members in map(np.array, groups.values()):
            problem = start.problems[members[0]]
            if problem.settings == Spectral(self.nodes):
                moves = np.column_stack([log_r - start.log_r[members], (A - start.A)[members]])
                guess = np.array(
                    [start.x[i] + start.rates[i] @ m for i, m in zip(members, moves, strict=True)]
                )
                solved, good = self._expanded(problem, guess, log_r, A[members])
                found = found.put(members[good], solved.take(np.flatnonzero(good)))
                lost += members[~good].tolist()
            else:
                lost += members.tolist()
        for i in sorted(lost):
            row = np.array([i])
            found = found.put(row, self._one(start.take(row), log_r, A[row], halvings))
        return found

    def _one(self, start: ChartStates, log_r: float, A: np.ndarray, halvings: int) -> ChartStates:
        """Solve for one state, with the phases the law asks for, by shorter ways where it does not go."""
        solved = self.family(log_r).solve(start.profile(0), Closure("amplitude", float(A[0])))
        if solved is not None:
            problem, result = solved
            states, good = self._expanded(problem, result.x[None], log_r, A)
            if good[0]:
                return states
        if halvings == 0:
            return start.lost(A, log_r)
        middle = 0.5 * (log_r + float(start.log_r[0])), 0.5 * (A + start.A)
        half = self._solved(start, *middle, halvings - 1)
        if not np.all(np.isfinite(half.numbers)):
            return replace(half, log_r=np.array([log_r]), A=A)
        return self._solved(half, log_r, A, halvings - 1)

    def _expanded(
        self, problem: Discretisation, guess: np.ndarray, log_r: float, A: np.ndarray
    ) -> tuple[ChartStates, np.ndarray]:
        """Correct a stack of guesses on one mesh and differentiate; also which of them are states."""
        r = float(np.exp(log_r))
        closing: list[tuple[Closing, ...]] = [
            (Closure("ratio", r), Closure("amplitude", float(a))) for a in A
        ]
        x, response, _, good = corrected(problem, guess, closing)
        family = self.family(log_r)
        if len(self.law.pieces) > 1:
            good &= [ok and family.suits(problem.profile(v), problem) for ok, v in zip(good, x, strict=True)]
        # The closure is lambda + pi^4 - r sigma^4 = 0.
        sigma = x[:, problem.column("sigma")]
        rates = response * np.stack([r * sigma**4, np.ones(len(x))], axis=1)[:, None]
        bend = _curvatures(problem, x, rates[:, :, 1], closing)
        numbers, by_r, by_A, by_AA = _numbers(*(v[:, problem.tail] for v in (x, rates, bend)))
        good &= np.all(np.isfinite(np.hstack([numbers, by_r, by_A, by_AA])), axis=1)
        states = ChartStates(
            [problem] * len(x), list(x), list(rates), np.full(len(x), log_r), A, numbers, by_r, by_A, by_AA
        )
        return states, np.asarray(good, bool)


def _curvatures(
    problem: Discretisation, x: np.ndarray, along: np.ndarray, closing: list[tuple[Closing, ...]]
) -> np.ndarray:
    """Second derivatives of the unknowns by A: J x_AA = -F_xx[x_A, x_A], by second differences of F."""
    system = closed_system(problem, tuple(c.kind for c in closing[0]))
    given = np.array([parameters(c) for c in closing])
    middle, above, below = (system.equations.many(x + h * along, given)[0] for h in (0.0, WIDTH, -WIDTH))
    jacobians = system.system.many(x, given)[1]
    right = -(above + below - 2.0 * middle) / WIDTH**2
    try:
        with one_thread:
            return np.linalg.solve(jacobians, right[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        return np.full_like(x, np.nan)


def _numbers(x: np.ndarray, rates: np.ndarray, bend: np.ndarray) -> list[np.ndarray]:
    """sbar/eta and p/T0 = 1 + m A/sigma^3 of a stack, with derivatives by log r, A, and A twice."""
    A, m, sigma, _ = x.T
    over = sigma**-3.0

    def rate(d: np.ndarray) -> np.ndarray:
        dA, dm, ds, _ = d.T
        return np.column_stack([ds, over * (dm * A + m * dA - 3.0 * m * A * ds / sigma)])

    _, dm, ds, _ = rates[:, :, 1].T
    _, ddm, dds, _ = bend.T
    first, second = dm * A + m, ddm * A + 2.0 * dm
    turned = second - 6.0 * first * ds / sigma + 12.0 * m * A * (ds / sigma) ** 2 - 3.0 * m * A * dds / sigma
    return [
        np.column_stack([sigma, 1.0 + m * A * over]),
        rate(rates[:, :, 0]),
        rate(rates[:, :, 1]),
        np.column_stack([dds, over * turned]),
    ]
