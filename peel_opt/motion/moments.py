"""A rod on its mesh from one moment to the next.

Steps are those of the backward differentiation formula of order 2, which keeps its order for the forces
that hold the links together.  They are as long as the fastest link may turn in one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from ..base.errors import NotConverged
from .chain import NX, NY, THETA, UNKNOWNS, Chain, Stage, X, Z
from .run import Posture

#: First and longest step, and by what a step may grow on the one before.
FIRST, LONGEST, GROWTH = 1e-4, 2.0, 1.6

#: Step below which the motion counts as lost, and what is no angle.
SHORTEST, TINY = 1e-10, 1e-12

#: By how much a turn may differ from the last, as a share of the largest.
BENDS = 0.1

#: Attached rod, over eta, that a mesh has at least ahead of the front, and by how much it grows.
AHEAD, BLOCK = 0.6, 1.2

#: Share of the range of the bond to which a point has been open that is behind the front.
DAMAGED = 0.01

#: Height over eta to which a bond has been open that Newton's method tells from one that was not.
FELT = 1e-10

#: How long a lift takes.
LIFTING = 6.0

#: p/T0 at a time.
Pressure = Callable[[float], float]


@dataclass(frozen=True, eq=False)
class Moment:
    """The rod at one time.

    Parameters
    ----------
    t : float
    u : ndarray, shape (n, 5)
        Unknowns of the chain.
    y : ndarray, shape (n,)
        Heights of the nodes over the wall.
    r, v, a : ndarray, shape (2, n)
        Place, velocity and acceleration of the nodes.
    open_to : ndarray, shape (n,)
        Greatest height of each node so far.
    dt : float
        The step that led here; infinite where what was before does not count.
    r_before, v_before : ndarray, shape (2, n)
        Places and velocities before it.
    u_before : ndarray, shape (n, 5)
        Unknowns before it.
    front, front_before : float
        Where the front is, and where it was before that step, if a load asks.
    """

    t: float
    u: np.ndarray
    y: np.ndarray
    r: np.ndarray
    v: np.ndarray
    a: np.ndarray
    open_to: np.ndarray
    dt: float
    r_before: np.ndarray
    v_before: np.ndarray
    u_before: np.ndarray
    front: float = math.inf
    front_before: float = math.inf

    def longer(self, chain: Chain, nodes: int) -> Moment:
        """Return the same with more attached rod ahead."""
        n = len(self.u)
        more = np.tile(self.u[-1], (nodes, 1))
        more[:, X] = (n + np.arange(nodes)) * chain.h
        still = np.zeros((2, nodes))
        stuck = np.stack(chain.arc.at(more[:, X]))
        return replace(
            self,
            u=np.concatenate([self.u, more]),
            y=np.concatenate([self.y, still[0]]),
            r=np.concatenate([self.r, stuck], axis=1),
            v=np.concatenate([self.v, still], axis=1),
            a=np.concatenate([self.a, still], axis=1),
            open_to=np.concatenate([self.open_to, still[0]]),
            r_before=np.concatenate([self.r_before, stuck], axis=1),
            v_before=np.concatenate([self.v_before, still], axis=1),
            u_before=np.concatenate([self.u_before, more]),
        )


class Spent(NamedTuple):
    """What the loads have done and what drag has taken, over T0 eta^2."""

    work: float = 0.0
    drag: float = 0.0


def front_of(chain: Chain, at: Moment) -> float:
    """Return the arc length of the front, between nodes.

    The rod presses on the plate at the front with all of its force, N_y, in one point.  On the mesh two
    nodes share it, and the front is where their forces have the same moment.  With damage a point that has
    been open a little is held open by the pressure, and there is no such place: then the front is the
    furthest that has been reached.
    """
    if chain.memory.bond == "damage":
        return _damaged_to(chain, at)
    above = np.flatnonzero(at.y > 0.0)
    if not above.size:
        return 0.0
    k = int(above[-1])
    (nx, ny), u = chain.arc.normal(chain.h * (np.arange(k, len(at.u)) + 0.5)), at.u[k:]
    force = u[:, NX] * nx + u[:, NY] * ny
    share = float(force[1:].sum() / force[0]) if force[0] < 0.0 else 0.0
    return chain.h * (k + 1 + min(max(share, 0.0), 1.0))


def _damaged_to(chain: Chain, at: Moment) -> float:
    """Return where the opening that there has been would vanish, from where it is `DAMAGED` of the range.

    It grows with the third power of the distance from the front, which is within the two links beyond the
    last node that was ever open.  A bond that was never fully open has as range what it was open to.
    """
    most = float(np.max(at.open_to, where=chain.glued(len(at.u)) > 0.0, initial=0.0))
    above = np.flatnonzero(at.open_to > DAMAGED * min(1.0 / chain.memory.ratio, most))
    if not above.size or most < FELT:
        return 0.0
    k = int(above[-1])
    if k < 2:
        return chain.h * (k + 1)
    near, far = np.cbrt(at.open_to[[k, k - 2]]).tolist()
    slope = 0.5 * (far - near)
    furthest = int(np.flatnonzero(at.open_to)[-1]) + 2
    return chain.h * min(k + near / slope, furthest) if slope > 0.0 else chain.h * (k + 1)


def _known_front(chain: Chain, at: Moment, before: float | None = None) -> Moment:
    """Return a moment that knows its front, if a load asks; a rod that lies flat has it in its first link."""
    if not chain.asks_front:
        return at
    front = max(front_of(chain, at), 0.5 * chain.h)
    return replace(at, front=front, front_before=front if before is None else before)


def step(chain: Chain, at: Moment, dt: float, pressure: float) -> Moment | None:
    """Take one step, to where the pressure is ``pressure``; None where Newton's method does not settle.

    Loads are told the front that goes on from the two before.
    """
    ratio = dt / at.dt
    behind, lead = ratio**2 / (1.0 + ratio), (1.0 + 2.0 * ratio) / (1.0 + ratio)
    base = ((1.0 + ratio) * at.r - behind * at.r_before) / lead
    base_v = ((1.0 + ratio) * at.v - behind * at.v_before) / lead
    front = (
        max(at.front + ratio * (at.front - at.front_before), 0.5 * chain.h) if chain.asks_front else math.inf
    )
    stage = Stage(dt / lead, base, base_v, pressure, front)
    u = chain.solve(_guessed(at, ratio), stage, at.open_to)
    if u is None:
        return None
    r, y = chain.places(u), chain.heights(u)
    v = (r - base) / stage.span
    a = (v - base_v) / stage.span if chain.mass else np.zeros_like(v)
    after = Moment(at.t + dt, u, y, r, v, a, np.maximum(at.open_to, y), dt, at.r, at.v, at.u)
    return _known_front(chain, after, at.front)


def _guessed(at: Moment, ratio: float) -> np.ndarray:
    """Return the unknowns after a step so much longer than the last, as they went on in that.

    What lies on the plate is bounded by edges that run over several nodes in a step.  Newton's method would
    move them by one node at a time.
    """
    u = at.u + ratio * (at.u - at.u_before)
    free, before = at.u[:, Z] > 0.0, at.u_before[:, Z] > 0.0
    edges, were = np.flatnonzero(free[1:] != free[:-1]), np.flatnonzero(before[1:] != before[:-1])
    if len(edges) != len(were) or free[0] != before[0]:
        return u
    passed = np.clip(np.rint(edges + ratio * (edges - were)), -1, len(u) - 1).astype(int) + 1
    if np.any(np.diff(passed) <= 0):
        return u
    turns = np.zeros(len(u) + 1, int)
    turns[passed] = 1
    free = (np.cumsum(turns)[:-1] % 2 == 1) != free[0]
    u[:, Z] = np.where(free, np.maximum(u[:, Z], TINY), np.minimum(u[:, Z], -TINY))
    return u


def moving(chain: Chain, at: Moment, pressure: float) -> Moment:
    """Return the moment at which a run begins with its forces and rates, which a shape does not say."""
    after = step(chain, at, FIRST if chain.mass else SHORTEST, pressure)  # velocities change by their own
    if after is None:
        return at
    u = np.concatenate([at.u[:, :NX], after.u[:, NX:]], axis=1)
    stuck = (at.u[:, Z] < 0.0) & (after.u[:, Z] < 0.0)
    u[stuck, Z] = after.u[stuck, Z]
    at = replace(at, u=u, u_before=u, front=after.front, front_before=after.front)
    return replace(at, a=after.a) if chain.mass else replace(at, v=after.v)


@dataclass(frozen=True)
class Lift:
    """A slow lift of the tip, from the plate to a height."""

    start: float
    height: float

    @property
    def end(self) -> float:
        """When the tip is let go of."""
        return self.start + LIFTING

    def at(self, t: float) -> float:
        """Return the height at a time: there after half of it, and held until the rest has settled."""
        share = min(2.0 * (t - self.start) / LIFTING, 1.0)
        return self.height * share * share * (3.0 - 2.0 * share)


def let_go(at: Moment) -> Moment:
    """Return a rod whose tip was lifted with nothing that holds it any more."""
    u = at.u.copy()
    u[0, Z] = at.y[0]
    return replace(at, u=u, dt=np.inf)


def spent(chain: Chain, before: Moment, after: Moment, pressure: Pressure) -> Spent:
    """Return the work of the loads, and of what lifts the tip, and that of the drag in a step."""
    moved = after.r - before.r
    force = sum(chain.pushed(chain.acted(at.u, pressure(at.t), at.front)) for at in (before, after))
    turned = chain.loads.moment * float(after.u[0, THETA] - before.u[0, THETA])
    w = chain.share(len(moved[0]))
    lifted = 0.0
    if chain.tip_at is not None:
        lifted = -0.5 * w[0] * float(before.u[0, Z] + after.u[0, Z]) * float(after.y[0] - before.y[0])
    dragged = 0.5 * chain.drag * float(np.sum(w * (before.v + after.v) * moved))
    return Spent(0.5 * float(np.sum(force * moved)) + turned + lifted, dragged)


def _from_the_end(rates: np.ndarray, end: tuple[float, float], link: float) -> np.ndarray:
    """Integrate two rates along the links from the stuck end back, (2, n)."""
    found: np.ndarray = np.array(end)[:, None] - link * np.cumsum(rates[:, ::-1], axis=1)[:, ::-1]
    return found


def begun(chain: Chain, start: Posture, longest: float) -> Moment:
    """Return a posture on the mesh."""
    h = chain.h
    n = math.ceil(min(start.s[-1] + AHEAD + BLOCK, longest) / h)
    middles = h * (np.arange(n) + 0.5)
    detached = middles < start.s[-1]
    theta, spin = (
        np.where(detached, CubicSpline(start.s, values)(middles), 0.0) for values in (start.theta, start.spin)
    )

    u, phi = np.zeros((n, UNKNOWNS)), chain.phi(theta)
    along = np.stack([np.cos(phi), np.sin(phi)])
    x, y = _from_the_end(along, chain.end(n), chain.link)
    gap = chain.arc.above(x, y).gap
    u[:, X], u[:, Z], u[:, THETA] = chain.arc.place(x, y), np.where(gap > TINY, gap, -1.0), theta
    v = _from_the_end(spin * np.stack([-along[1], along[0]]), (0.0, 0.0), chain.link)
    if not chain.mass:
        v[:] = 0.0
    r, y = chain.places(u), chain.heights(u)
    return _known_front(chain, Moment(start.t, u, y, r, v, np.zeros_like(v), y, np.inf, r, v, u))


@dataclass(eq=False)
class Pacer:
    """How long a step may be: as long as no link turns, nor changes how it turns, by much.

    Parameters
    ----------
    turn : float
        Largest angle [rad] that a link turns in a step.
    longest : float
        Longest step.
    """

    turn: float
    longest: float = LONGEST
    dt: float = FIRST
    rate: np.ndarray | None = None

    def begins(self) -> None:
        """Begin anew, from a moment whose past does not count."""
        self.dt, self.rate = FIRST, None

    def taken(
        self, chain: Chain, at: Moment, end: float, pressure: Pressure, lift: Lift | None = None
    ) -> Moment:
        """Take one step, not beyond a time.

        Raises
        ------
        NotConverged
        """
        while True:
            dt = min(self.dt, end - at.t)
            held = chain if lift is None else replace(chain, tip_at=lift.at(at.t + dt))
            after = step(held, at, dt, pressure(at.t + dt))
            if after is not None:
                moved = after.u[:, THETA] - at.u[:, THETA]
                turned = float(np.abs(moved).max())
                if turned <= 2.0 * self.turn or dt <= FIRST:
                    break
            self.dt = 0.5 * dt
            if self.dt < SHORTEST:
                raise NotConverged(
                    f"the motion was followed to t = {at.t:.6g} tau only: no step is short enough there.",
                    remedy="Give some drag: without it, what a contact sets going never comes to rest.",
                )
        rate = moved / dt
        known = len(self.rate) if self.rate is not None else 0
        last = np.zeros_like(rate)
        if self.rate is not None:
            last[:known] = self.rate
        bend = float(np.abs(rate - last).max()) * dt if known else 0.0
        grows = min(GROWTH, self.turn / max(turned, TINY), math.sqrt(BENDS * self.turn / max(bend, TINY)))
        self.rate, self.dt = rate, min(dt * grows, self.longest)
        return after
