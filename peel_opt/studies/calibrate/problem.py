"""Observations as blocks with the phases their shapes ask for, solved until those are consistent.

Law (8) has a kink at y = y0, and a state has a phase for every piece of the law it visits.
Which ones can change while the material numbers move, and so can the phase that a measured
point is nearest to.  Both are read off the solution, and the programme is posed anew until
they no longer change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from ...base.progress import progress
from ...model.bond import COHESIVE
from ...residual.discretisation import Profile
from ...residual.phases import layout, without_empty_phases
from ...residual.shape import DENSE_POINTS, sample_shape
from ...residual.transcriptions import Spectral
from .blocks import Signature, block
from .data import Observation
from .programme import FURTHEST, Outcome, Solver, State, solve

#: How often the programme is posed anew before its phases count as undecided.
MOST_ROUNDS = 10

#: Nodes of the spectral form, from the first solve to the finest.
NODES = (16, 24, 36, 54)


def _unwatched() -> None:
    """Nobody looks on."""


@dataclass(frozen=True, eq=False)
class Placed:
    """One observation at its present solution.

    Parameters
    ----------
    profile : Profile
    origin : float
        x of the detachment point, in the reference eta.
    """

    profile: Profile
    origin: float = 0.0


@dataclass(frozen=True, eq=False)
class Blocks:
    """The blocks of all observations: signatures, unknowns and data, and how points were sorted."""

    signatures: list[Signature]
    state: State
    orders: list[np.ndarray]

    def same_as(self, other: Blocks) -> bool:
        """Whether phases and the sorting of measured points are the same."""
        return self.signatures == other.signatures and all(
            np.array_equal(a, b) for a, b in zip(self.orders, other.orders, strict=True)
        )

    def placed(self) -> list[Placed]:
        """Return the solutions themselves."""
        found = []
        for signature, u in zip(self.signatures, self.state.unknowns, strict=True):
            problem = block(signature).problem
            profile = problem.profile(u[: problem.size])
            found.append(Placed(profile, float(u[-1]) if signature.free_origin else 0.0))
        return found


@dataclass(frozen=True, eq=False)
class Fitted:
    """A solved programme whose phases are those of its solution."""

    blocks: Blocks
    outcome: Outcome
    rounds: int
    iterations: int

    @property
    def q(self) -> np.ndarray:
        """Logarithms of the material numbers over those of the reference rod."""
        return self.outcome.state.q

    @property
    def deviance(self) -> float:
        """Sum of the losses; chi-square with least squares."""
        return 2.0 * self.outcome.objective


@dataclass(frozen=True, eq=False)
class Problem:
    """A fit without its answer.

    Parameters
    ----------
    observations : list of Observation
        In units of the reference rod's eta and T0.
    ratio : float
        eta/y0 of the reference rod.
    free : ndarray of bool, shape (3,)
    delta : float or None
        Scale of the pseudo-Huber loss; None for least squares.
    nodes : int
    ridge : float
        Weight of |q|^2, which holds the numbers near the reference rod; 0 but where the data leave
        them open.
    solver : Solver
    watch : callable
        Called at every programme that is solved, and at every state that is solved again.
    """

    observations: list[Observation]
    ratio: float
    free: np.ndarray
    delta: float | None
    nodes: int = NODES[0]
    ridge: float = 0.0
    solver: Solver = field(default_factory=Solver)
    watch: Callable[[], object] = field(default=_unwatched, repr=False)

    def pose(self, q: np.ndarray, places: Sequence[Placed]) -> Blocks:
        """Return blocks with the phases and feet of these solutions."""
        signatures, unknowns, data, orders = [], [], [], []
        for observation, place in zip(self.observations, places, strict=True):
            signature, u, d, order = self._block(observation, place, q)
            signatures.append(signature)
            unknowns.append(u)
            data.append(d)
            orders.append(order)
        return Blocks(signatures, State(np.array(q, float), unknowns, data), orders)

    def _block(
        self, observation: Observation, place: Placed, q: np.ndarray
    ) -> tuple[Signature, np.ndarray, np.ndarray, np.ndarray]:
        profile = without_empty_phases(place.profile) or place.profile
        plan = layout(COHESIVE, profile)
        problem = Spectral(self.nodes).discretise(plan.phases)
        x = problem.pack(profile.rephased(plan.breaks))
        head = [
            observation.length or 1.0,
            observation.pressure or 1.0,
            1.0 / (observation.length_sd or 1.0),
            1.0 / (observation.pressure_sd or 1.0),
            self.ratio,
        ]
        signature = Signature(
            plan.phases, self.nodes, observation.role("length"), observation.role("pressure")
        )
        if observation.points is None:
            return signature, x, np.array(head), np.empty(0, int)
        eta = float(np.exp((q[0] - q[1]) / 3.0))
        shape = sample_shape(problem, x)
        unit = profile.scalars.sigma * eta
        points = observation.points - np.array([place.origin, 0.0, 0.0])
        owner, zeta = _feet(np.column_stack([shape.x, shape.y]) * unit, points[:, :2], len(plan.phases))
        if observation.tip:
            owner[0] = len(plan.phases)
        order = np.argsort(owner, kind="stable")
        counts = np.bincount(owner, minlength=len(plan.phases) + 2)
        signature = replace(
            signature,
            feet=tuple(int(n) for n in counts[:-2]),
            at_tip=int(counts[-2]),
            on_plate=int(counts[-1]),
            free_origin=observation.free_origin,
        )
        rows = observation.points[order]
        rows[:, 2] = 1.0 / rows[:, 2]
        feet = zeta[order][: sum(signature.feet)]
        u = np.concatenate([x, feet, [place.origin] if observation.free_origin else []])
        return signature, u, np.concatenate([head, rows.ravel()]), order

    def solve(
        self, q: np.ndarray, places: Sequence[Placed], fixed: int | None = None, patient: bool = True
    ) -> Fitted | None:
        """Solve from a start; None if IPOPT fails or the phases do not settle.

        ``fixed`` is a free entry of q that keeps its value.  With ``patient``, what Gauss-Newton
        does not finish is taken up with exact Hessians.
        """
        q = np.array(q, float)
        loose = self.free.copy()
        if fixed is not None:
            loose[fixed] = False
        bounds = (np.where(loose, -FURTHEST, q), np.where(loose, FURTHEST, q))
        iterations = 0
        blocks = self.pose(q, places)
        for rounds in range(1, MOST_ROUNDS + 1):
            self.watch()
            outcome = solve(blocks.signatures, blocks.state, bounds, self.delta, self.ridge, self.solver)
            iterations += outcome.iterations
            if patient and outcome.tired and not self.solver.exact_hessian:
                # Gauss-Newton goes round in circles where residuals are large against the radius of
                # curvature of the branch.
                exact = replace(self.solver, exact_hessian=True)
                outcome = solve(blocks.signatures, outcome.state, bounds, self.delta, self.ridge, exact)
                iterations += outcome.iterations
            if not outcome.solved:
                return None
            solved = Blocks(blocks.signatures, outcome.state, blocks.orders)
            again = self.pose(outcome.state.q, solved.placed())
            if again.same_as(solved):
                return Fitted(solved, outcome, rounds, iterations)
            blocks = again
        return None

    def by_homotopy(self, q: np.ndarray, places: Sequence[Placed]) -> Fitted | None:
        """Solve by moving the data from where the start has them to where they were measured."""
        begin = [self._as_if(o, place, q) for o, place in zip(self.observations, places, strict=True)]
        there, step, reached = 0.0, 0.25, 0.0
        found: Fitted | None = None
        while reached < 1.0:
            there = min(1.0, reached + step)
            moved = [_between(a, b, there) for a, b in zip(begin, self.observations, strict=True)]
            trial = replace(self, observations=moved).solve(q, places, patient=there == 1.0)
            if trial is None:
                step *= 0.5
                if step < 0.05:
                    return None
                continue
            found, reached, step = trial, there, min(1.5 * step, 0.5)
            q, places = trial.q, trial.blocks.placed()
        return found

    def _as_if(self, observation: Observation, place: Placed, q: np.ndarray) -> Observation:
        """Return the observation as it would be, had the start been seen without error."""
        s = place.profile.scalars
        eta = float(np.exp((q[0] - q[1]) / 3.0))
        return replace(
            observation,
            length=None if observation.length is None else s.sigma * eta,
            pressure=None
            if observation.pressure is None
            else max(s.pressure_ratio, 1e-12) * float(np.exp(q[1])),
        )


@contextmanager
def watched(problem: Problem) -> Iterator[Problem]:
    """Return a problem whose steps are counted on a terminal from the first second on."""
    with progress("step of the calibration") as step:
        yield replace(problem, watch=step)


def _between(a: Observation, b: Observation, share: float) -> Observation:
    def mixed(first: float | None, second: float | None) -> float | None:
        if first is None or second is None:
            return None
        return float(first ** (1.0 - share) * second**share)

    return replace(b, length=mixed(a.length, b.length), pressure=mixed(a.pressure, b.pressure))


def _feet(curve: np.ndarray, points: np.ndarray, phases: int) -> tuple[np.ndarray, np.ndarray]:
    """Which part of a rod each measured point is nearest to, and where in it.

    Parameters
    ----------
    curve : ndarray, shape (phases * (DENSE_POINTS - 1) + 1, 2)
    points : ndarray, shape (n, 2)
    phases : int

    Returns
    -------
    tuple of ndarray
        The phase, or ``phases`` for the tip and ``phases + 1`` for the attached part, and the
        local coordinate.
    """
    step = np.diff(curve, axis=0)
    away = points[:, None] - curve[:-1]
    share = np.clip(np.sum(away * step, axis=2) / np.maximum(np.sum(step**2, axis=1), 1e-300), 0.0, 1.0)
    gaps = np.linalg.norm(away - share[..., None] * step, axis=2)
    nearest = np.argmin(gaps, axis=1)
    rows = np.arange(len(points))
    place = nearest + share[rows, nearest]
    intervals = DENSE_POINTS - 1
    owner = np.minimum(nearest // intervals, phases - 1)
    zeta = place / intervals - owner
    owner[place <= 0.0] = phases
    owner[(points[:, 0] > 0.0) & (np.abs(points[:, 1]) <= gaps[rows, nearest])] = phases + 1
    return owner, zeta
