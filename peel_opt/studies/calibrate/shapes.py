"""A picture of the rod beside its states: how far its points are off, and the state that suits them best."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.polynomial.legendre import legvander

from ...base.quadrature import gauss, integration_matrix, values_matrix
from ...residual.discretisation import Discretisation
from .chart import HIGHEST, Chart, ChartStates
from .covariance import Seen, given_back, loss, squared
from .curve import nearest
from .data import Observation
from .pairs import GROUPS, Pairs

#: Gauss nodes of each phase from which a shape is integrated, and lines by which it is looked through.
NODES, LINES = 24, 100

#: Steps towards the foot of a point; each leaves its distance over the radius of curvature.
STEPS = 3

#: Steps towards the best state, and the step in standard deviations at which it is there.
MOST_STEPS, THERE = 40, 1e-8

#: Longest step in A.
LONGEST = 0.3


@dataclass(frozen=True, eq=False)
class Misses:
    """How far points are from a shape, in standard deviations: rows x, y of each point in turn.

    Parameters
    ----------
    r : ndarray, shape (2 n,)
    by_groups : ndarray, shape (2 n, 3)
        Derivatives by (log eta, log T0, log r), along the normals: feet move with the shape.
    by_own : ndarray, shape (2 n, 2)
        By A and by the x of the detachment point [m].
    beyond_tip : int
        Points that have the tip itself as their foot.
    """

    r: np.ndarray
    by_groups: np.ndarray
    by_own: np.ndarray
    beyond_tip: int


def misses(observation: Observation, state: ChartStates, eta: float, origin: float) -> Misses:
    """Return how far the points of an observation are from its one state.

    Parameters
    ----------
    observation : Observation
    state : ChartStates
        Of length 1.
    eta : float
        [m].
    origin : float
        x of the detachment point [m].
    """
    assert observation.points is not None
    shape = _Shape.of(state)
    size = eta * float(state.numbers[0, 0])
    measured = observation.points[:, :2] - (origin, 0.0)
    sd = observation.points[:, 2]
    phase, zeta, plate = shape.feet(measured / size)
    if observation.tip:
        phase[0], zeta[0], plate[0] = 0, 0.0, False
    (place, angle), change = shape.places(phase, zeta), shape.changes(phase, zeta)
    grows = np.stack([state.by_r[0, 0] * place, state.by_A[0, 0] * place], axis=-1)
    moves = np.zeros((len(sd), 2, 5))
    moves[:, :, 0] = size * place
    moves[:, :, 2], moves[:, :, 3] = np.moveaxis(eta * grows + size * change, -1, 0)
    moves[:, 0, 4] = 1.0
    off = size * place - measured
    # Along the rod a foot moves freely; along the plate, which has every x > 0, too.
    tangent = np.column_stack([np.cos(angle), np.sin(angle)])
    tangent[(phase == 0) & (zeta <= 0.0)] = 0.0
    moves -= tangent[:, :, None] * np.einsum("ij,ijk->ik", tangent, moves)[:, None]
    off -= tangent * np.sum(tangent * off, axis=1)[:, None]
    moves[plate], off[plate, 0], off[plate, 1] = 0.0, 0.0, -measured[plate, 1]
    beyond = int(np.count_nonzero((phase == 0) & (zeta <= 0.0) & ~plate))
    moves = (moves / sd[:, None, None]).reshape(-1, 5)
    return Misses((off / sd[:, None]).ravel(), moves[:, :3], moves[:, 3:], beyond)


@dataclass(frozen=True, eq=False)
class _Shape:
    """A solved shape in units of its length, the detachment point at the origin.

    Parameters
    ----------
    lengths, angles : ndarray, shapes (phases,) and (phases, NODES)
        Shares of the length, and theta at the Gauss nodes.
    d_lengths, d_angles : ndarray
        Their derivatives by log r and A, along a further last axis.
    """

    lengths: np.ndarray
    angles: np.ndarray
    d_lengths: np.ndarray
    d_angles: np.ndarray

    @classmethod
    def of(cls, state: ChartStates) -> _Shape:
        problem, x, rates = state.problems[0], state.x[0], state.rates[0]
        field, jacobian = (part.full() for part in _fields(problem)(x))
        at_A, phases = problem.column("A"), len(problem.phases)
        A = x[at_A]
        d_angles = A * jacobian @ rates + field * rates[at_A]
        ends = problem.lengths(np.zeros(problem.size))
        d_lengths = np.column_stack([problem.lengths(rate) - ends for rate in rates.T])
        return cls(
            problem.lengths(x),
            (A * field).reshape(phases, NODES),
            d_lengths,
            d_angles.reshape(phases, NODES, 2),
        )

    @cached_property
    def _slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """(cos, sin) of the angles at the nodes, and where each phase starts, the detachment point at 0."""
        slopes = np.stack([np.cos(self.angles), np.sin(self.angles)], axis=-1)
        steps = self.lengths[:, None] * np.einsum("k,pkc->pc", gauss(NODES)[1], slopes)
        return slopes, -np.cumsum(steps[::-1], axis=0)[::-1]

    def places(self, phase: np.ndarray, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places on the rod, shape (n, 2), and angles there, shape (n,)."""
        slopes, starts = self._slopes
        inside, values = _at(zeta)
        part = np.einsum("nk,nkc->nc", inside, slopes[phase])
        place = starts[phase] + self.lengths[phase][:, None] * part
        return place, np.einsum("nk,nk->n", values, self.angles[phase])

    def changes(self, phase: np.ndarray, zeta: np.ndarray) -> np.ndarray:
        """Derivatives of the places by log r and A, shape (n, 2, 2)."""
        slopes, _ = self._slopes
        whole, (inside, _) = gauss(NODES)[1], _at(zeta)
        d_slopes = np.stack([-slopes[..., 1], slopes[..., 0]], axis=-1)[..., None] * self.d_angles[:, :, None]
        d_steps = self.lengths[:, None, None] * np.einsum("k,pkcd->pcd", whole, d_slopes)
        d_steps += np.einsum("k,pkc->pc", whole, slopes)[..., None] * self.d_lengths[:, None]
        d_starts = -np.cumsum(d_steps[::-1], axis=0)[::-1]
        part = np.einsum("nk,nkc->nc", inside, slopes[phase])
        d_part = np.einsum("nk,nkcd->ncd", inside, d_slopes[phase])
        grown = part[..., None] * self.d_lengths[phase][:, None]
        return d_starts[phase] + self.lengths[phase][:, None, None] * d_part + grown

    def feet(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Phase and local coordinate nearest to each point, and whether the plate is nearer still."""
        phases, grid = len(self.lengths), np.linspace(0.0, 1.0, LINES + 1)
        curve, _ = self.places(np.repeat(np.arange(phases), LINES + 1), np.tile(grid, phases))
        curve = curve.reshape(phases, LINES + 1, 2)
        begin, step = curve[:, :-1].reshape(-1, 2), np.diff(curve, axis=1).reshape(-1, 2)
        line, share, gap = nearest(points, begin, step)
        phase, zeta = line // LINES, (line % LINES + share) / LINES
        plate = (points[:, 0] > 0.0) & (np.abs(points[:, 1]) <= gap)
        for _ in range(STEPS):
            place, angle = self.places(phase, zeta)
            ahead = (points - place)[:, 0] * np.cos(angle) + (points - place)[:, 1] * np.sin(angle)
            zeta = np.clip(zeta + ahead / self.lengths[phase], 0.0, 1.0)
        return phase, zeta, plate


@lru_cache(maxsize=1)
def _series() -> tuple[np.ndarray, np.ndarray]:
    """Matrices from values at the nodes to Legendre series: of their integral from 0, and of themselves."""
    points = gauss(NODES + 1)[0]
    back = np.linalg.inv(legvander(2.0 * points - 1.0, NODES))
    return back @ integration_matrix(NODES, points), back @ values_matrix(NODES, points)


def _at(zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices from values at the nodes to integrals from 0 to each ``zeta``, and to values there."""
    basis = legvander(2.0 * zeta - 1.0, NODES)
    integral, values = _series()
    return basis @ integral, basis @ values


@lru_cache(maxsize=64)
def _fields(problem: Discretisation) -> ca.Function:
    """Compiled x -> Theta at the Gauss nodes of every phase, and its Jacobian."""
    Theta = problem.sample_expression(gauss(NODES)[0])[:, 0]
    return ca.Function("angles", [problem.x], [Theta, ca.jacobian(Theta, problem.x)])


@dataclass(frozen=True, eq=False)
class SeenShape(Seen):
    """A picture at a state: what it misses in standard deviations, length and pressure first.

    Its own unknowns are A, and where it is free the origin in eta.

    Parameters
    ----------
    state : ChartStates
        Of length 1.
    origin : float
        x of the detachment point [m].
    cost : float
        Loss of the two numbers and of all points.
    step : ndarray, shape (own,)
        Step of Gauss and Newton in the own unknowns.
    beyond_tip : int
        Points that have the tip itself as their foot.
    """

    state: ChartStates = field(kw_only=True)
    origin: float = field(kw_only=True)
    cost: float = field(kw_only=True)
    step: np.ndarray = field(kw_only=True)
    beyond_tip: int = field(kw_only=True)

    @classmethod
    def at(
        cls,
        observation: Observation,
        state: ChartStates,
        origin: float,
        scale: np.ndarray,
        delta: float | None,
    ) -> SeenShape:
        """Compare a picture with a state of the rod that has this eta and T0, ``scale``."""
        numbers = Pairs.of([observation]).seen(state, scale)[0]
        points = misses(observation, state, float(scale[0]), origin)
        r = np.concatenate([numbers.r, points.r])
        by_q = np.vstack([numbers.by_q, points.by_groups @ GROUPS])
        # The origin in eta: both unknowns then are of the size of one.
        own = np.hstack([numbers.by_own, np.zeros((2, 1))])
        by_own = np.vstack([own, points.by_own * (1.0, scale[0])])[:, : 1 + observation.free_origin]
        cost, weight = loss(squared(r), delta)
        root = np.sqrt(np.repeat(weight, 2))[:, None]
        step = -given_back(root * by_own, root * r[:, None])[:, 0]
        return cls(
            r,
            by_q,
            by_own,
            observation.measured,
            state=state,
            origin=origin,
            cost=float(cost.sum()),
            step=step,
            beyond_tip=points.beyond_tip,
        )


def best_picture(
    observation: Observation,
    chart: Chart,
    log_r: float,
    scale: np.ndarray,
    near: tuple[ChartStates, float],
    delta: float | None,
) -> SeenShape:
    """Return a picture at the state and the origin that suit it best, from some nearby.

    Steps of Gauss and Newton, halved where they lead to something worse.
    """
    state, origin = near
    A, share, best = float(state.A[0]), 1.0, None
    for _ in range(MOST_STEPS):
        state = chart.at(state, log_r, np.array([A]))
        here = SeenShape.at(observation, state, origin, scale, delta)
        if best is None or here.cost <= best.cost:
            best, share = here, min(1.0, 2.0 * share)
        else:
            share *= 0.25
        step = best.step
        if not np.isfinite(best.cost) or np.linalg.norm(best.by_own @ step) * share < THERE:
            break
        state, origin = best.state, best.origin
        A = min(max(float(state.A[0]) + float(np.clip(share * step[0], -LONGEST, LONGEST)), 0.0), HIGHEST)
        if observation.free_origin:
            origin += share * float(step[1] * scale[0])
    assert best is not None
    return best
