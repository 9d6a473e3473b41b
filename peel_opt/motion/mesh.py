"""A rod in motion on a mesh that is fixed in it: with contact, bonds that remember, and pressures that change.

Steps are those of the backward differentiation formula of order 2, which keeps its order for the forces
that hold the links together; they are as long as the fastest link may turn in one.  The mesh is as long as the motion needs: it grows ahead
of the front.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..base.errors import NotConverged
from .chain import NX, NY, THETA, UNKNOWNS, Chain, Stage, X, Z
from .memory import Memory
from .run import Posture, Setting, Told, Track, Until
from .trajectory import Happening, Ledger, TipPath

#: Link lengths over eta, and angles [rad] that a link turns in a step, of the two resolutions.
LINKS, TURNS = (0.05, 0.025), (0.05, 0.025)

#: First and longest step, and by what a step may grow on the one before.
FIRST, LONGEST, GROWTH = 1e-4, 2.0, 1.6

#: Step below which the motion counts as lost, and what is no angle.
SHORTEST, TINY = 1e-10, 1e-12

#: By how much a turn may differ from the last, as a share of the largest.
BENDS = 0.1

#: Attached rod, over eta, that a mesh has at least ahead of the front, and by how much it grows.
AHEAD, BLOCK = 0.6, 1.2

#: Shares of a stored shape.
POINTS = 65

#: Speed below which, and distance still to go over eta below which, nothing moves any more, and the time
#: over which it must have died away.
SLOW, REST, WINDOW = 1e-3, 5e-4, 4.0

#: Heights, over that of the top, to which a tip is lifted one after the other that a mesh holds down, how long
#: a lift takes, and by how much more a tip rises that goes on by itself.
LIFTS, LIFTING, RISEN = (0.02, 0.04, 0.08, 0.16), 6.0, 1.5

#: Share of what the bond has lost at the tip by which its height may be off in a rod at rest.
NEARLY = 0.03

#: Swings of the tip that are compared, as a share of its greatest height the least that count, and the
#: share of them by which they may differ and be the same.
CYCLES, SWING, SAME = 4, 0.02, 0.005

#: Tip angle [rad] beyond which a rod is folded over.
FOLDED = -0.5 * math.pi

#: Links that are left ahead of the front at the end of the rod.
END = 2.0

#: Share of the range of the bond to which a point has been open that is behind the front.
DAMAGED = 0.01


@dataclass(frozen=True, eq=False)
class Moment:
    """The rod at one time.

    Parameters
    ----------
    t : float
    u : ndarray, shape (n, 5)
        Unknowns of the chain.
    r, v, a : ndarray, shape (2, n)
        Place, velocity and acceleration of the nodes.
    open_to : ndarray, shape (n,)
        Greatest height of each node so far.
    dt : float
        The step that led here; infinite where what was before does not count.
    r_before, v_before : ndarray, shape (2, n)
        Places and velocities before it.
    """

    t: float
    u: np.ndarray
    r: np.ndarray
    v: np.ndarray
    a: np.ndarray
    open_to: np.ndarray
    dt: float
    r_before: np.ndarray
    v_before: np.ndarray

    @property
    def y(self) -> np.ndarray:
        """Heights of the nodes."""
        heights: np.ndarray = self.r[1]
        return heights

    def longer(self, nodes: int, h: float) -> Moment:
        """Return the same with more attached rod ahead."""
        n = len(self.u)
        more = np.tile(self.u[-1], (nodes, 1))
        more[:, X] = (n + np.arange(nodes)) * h
        still = np.zeros((2, nodes))
        stuck = np.stack([more[:, X], still[1]])
        return replace(
            self,
            u=np.concatenate([self.u, more]),
            r=np.concatenate([self.r, stuck], axis=1),
            v=np.concatenate([self.v, still], axis=1),
            a=np.concatenate([self.a, still], axis=1),
            open_to=np.concatenate([self.open_to, still[0]]),
            r_before=np.concatenate([self.r_before, stuck], axis=1),
            v_before=np.concatenate([self.v_before, still], axis=1),
        )


class Spent(NamedTuple):
    """What the pressure has done and what drag has taken, over T0 eta^2."""

    work: float = 0.0
    drag: float = 0.0


def step(chain: Chain, at: Moment, dt: float, pressure: float) -> Moment | None:
    """Take one step, to where the pressure is ``pressure``; None where Newton's method does not settle."""
    ratio = dt / at.dt
    behind, lead = ratio**2 / (1.0 + ratio), (1.0 + 2.0 * ratio) / (1.0 + ratio)
    base = ((1.0 + ratio) * at.r - behind * at.r_before) / lead
    base_v = ((1.0 + ratio) * at.v - behind * at.v_before) / lead
    stage = Stage(dt / lead, base, base_v, pressure)
    u = chain.solve(at.u, stage, at.open_to)
    if u is None:
        return None
    r = chain.places(u)
    v = (r - base) / stage.span
    a = (v - base_v) / stage.span if chain.mass else np.zeros_like(v)
    return Moment(at.t + dt, u, r, v, a, np.maximum(at.open_to, r[1]), dt, at.r, at.v)


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


def spent(chain: Chain, before: Moment, after: Moment, pressures: tuple[float, float]) -> Spent:
    """Return the work of the pressure and of the drag in a step."""
    pair = (before, after)
    moved = after.r - before.r
    force = sum(chain.loads(at.u[:, THETA], p) for at, p in zip(pair, pressures, strict=True))
    w = chain.share(len(moved[0]))
    lifted = -0.5 * w[0] * float(before.u[0, Z] + after.u[0, Z]) * moved[1, 0] if chain.tip_at is not None else 0.0
    dragged = 0.5 * chain.drag * float(np.sum(w * (before.v + after.v) * moved))
    return Spent(0.5 * float(np.sum(force * moved)) + lifted, dragged)


def front_of(chain: Chain, at: Moment) -> float:
    """Return the arc length of the front, between nodes.

    The rod presses on the plate at the front with all of its force, N_y, in one point.  On the mesh two
    nodes share it, and the front is where their forces have the same moment.  With damage it is where the
    bond has been open to a share of its range: what has been open a little is held open by the pressure.
    """
    if chain.memory.bond == "damage":
        return _damaged_to(chain, at)
    above = np.flatnonzero(at.y > 0.0)
    if not above.size:
        return 0.0
    k = int(above[-1])
    force = at.u[k:, NY]
    share = float(force[1:].sum() / force[0]) if force[0] < 0.0 else 0.0
    return chain.h * (k + 1 + min(max(share, 0.0), 1.0))


def _damaged_to(chain: Chain, at: Moment) -> float:
    """Return where the bond has been open to `DAMAGED` of its range; the opening grows with a third power."""
    least = DAMAGED / chain.memory.ratio
    above = np.flatnonzero(at.open_to > least)
    if not above.size:
        return 0.0
    k = int(above[-1])
    if k + 1 == len(at.open_to):
        return chain.h * k
    near, far, wanted = np.cbrt([at.open_to[k], at.open_to[k + 1], least]).tolist()
    return chain.h * (k + (near - wanted) / (near - far))


def missed(chain: Chain, at: Moment, pressure: float) -> float:
    """Return p y_tip - Phi(y_tip) - int (rho r_tt + c r_t).(e_x - t) ds, with what contact and memory add."""
    y, w, memory = at.y, chain.share(len(at.u)), chain.memory
    theta = at.u[:, THETA]
    along = np.stack([np.cos(theta), np.sin(theta)])
    along[:, 1:] = 0.5 * (along[:, 1:] + along[:, :-1].copy())
    resists = chain.mass * at.a + chain.drag * at.v
    other = memory.holding(y, at.open_to)[0] - memory.held(y).traction - chain.pressed(at.u)
    found = pressure * y[0] - memory.held(y[:1]).work[0] + np.sum(w * other * along[1])
    return float(found - np.sum(w * (resists[0] * (1.0 - along[0]) - resists[1] * along[1])))


class Recorder:
    """What a run keeps of every step."""

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.rows: list[list[float]] = []
        self.shapes: list[np.ndarray] = []
        self.events: list[Happening] = []
        self.spent = Spent()
        self.speeds: list[tuple[float, float]] = []
        self.turns: list[float] = []

    def add(self, at: Moment, pressure: float, spent: Spent) -> None:
        """Keep a moment."""
        chain, u, n = self.chain, at.u, len(at.u)
        self.spent = Spent(self.spent.work + spent.work, self.spent.drag + spent.drag)
        w, theta, memory = chain.share(n), u[:, THETA], chain.memory
        turned = np.diff(np.append(theta, 0.0))
        front = front_of(chain, at)
        angle = theta[0] - 0.125 * (theta[1] - theta[0])
        energies = (
            0.5 * chain.mass * float(np.sum(w * at.v**2)),
            0.5 * float(turned @ turned) / chain.h,
            float(w @ memory.stored(at.y, at.open_to)),
            *self.spent,
            float(w @ memory.lost(at.open_to)),
        )
        identity = missed(chain, at, pressure)
        self.rows.append([at.t, front, at.y[0], u[0, X], angle, *energies, identity])
        s = np.linspace(0.0, front, POINTS)
        nodes = chain.h * np.arange(n)
        middles = np.concatenate([[0.0], nodes + 0.5 * chain.h])
        self.shapes.append(
            np.stack(
                [
                    np.interp(s, nodes, u[:, X]),
                    np.interp(s, nodes, at.y),
                    np.interp(s, middles, np.concatenate([[angle], theta])),
                ]
            )
        )

    def happened(self, kind: str) -> None:
        """Note that something happened at the last moment."""
        t, front, y, x, angle = self.rows[-1][:5]
        self.events.append(Happening(kind, t, front, y, x, angle))

    @property
    def rose(self) -> bool:
        """Whether a tip that was lifted went on by itself."""
        lifts = [event for event in self.events if event.kind == "lift"]
        if not lifts:
            return False
        heights = [row[2] for row in self.rows if row[0] >= lifts[-1].t]
        return max(heights) > RISEN * lifts[-1].y

    def repeats(self) -> bool:
        """Whether the tip goes up and down as far as it did the last times."""
        heights = np.array([row[2] for row in self.rows[-3:]])
        if len(heights) == 3 and (heights[1] - heights[0]) * (heights[2] - heights[1]) < 0.0:
            self.turns.append(float(heights[1]))
        swings = np.abs(np.diff(self.turns[-2 * CYCLES :]))
        if len(swings) < 2 * CYCLES - 1 or swings.min() < SWING * max(self.turns):
            return False
        return float(np.ptp(swings)) < SAME * float(swings.max())

    def at_rest(self, at: Moment, pressure: float) -> bool:
        """Whether what is left of the motion, as it dies away, is too small to matter.

        A tip that stands off the plate must have the height that its pressure asks of it, where the bond heals:
        close to T0 what leaves an unstable state is as slow as what comes to rest.
        """
        speed = float(np.abs(at.v).max())
        self.speeds.append((at.t, speed))
        while len(self.speeds) > 2 and self.speeds[1][0] < at.t - WINDOW:
            self.speeds.pop(0)
        then, before = self.speeds[0]
        if speed > SLOW or at.t - then < WINDOW:
            return False
        left = speed * (at.t - then)
        if speed > 0.0 and left >= REST * math.log(before / speed):
            return False
        tip, memory = at.y[:1], self.chain.memory
        if memory.bond != "reversible" or not tip[0]:
            return True
        mean = float(memory.held(tip).work[0] / tip[0])
        return abs(pressure - mean) < NEARLY * max(1.0 - pressure, 1.0 - mean)

    def track(self, spin: np.ndarray, outcome: str) -> Track:
        """Return it all."""
        t, front, y, x, angle, *energies, identity = np.array(self.rows).T
        shapes = np.array(self.shapes)
        return Track(
            t=t,
            front=front,
            tip=TipPath(y, x, angle),
            fraction=np.linspace(0.0, 1.0, POINTS),
            x=shapes[:, 0],
            y=shapes[:, 1],
            theta=shapes[:, 2],
            spin=spin,
            energy=Ledger(*energies),
            identity=identity,
            events=tuple(self.events),
            outcome=outcome,
        )


def from_the_end(rate: np.ndarray, end: float, h: float) -> np.ndarray:
    """Integrate along the links from the stuck end back."""
    found: np.ndarray = end - h * np.cumsum(rate[::-1])[::-1]
    return found


def begun(chain: Chain, start: Posture, longest: float) -> Moment:
    """Return a posture on the mesh."""
    h = chain.h
    n = math.ceil(min(start.s[-1] + AHEAD + BLOCK, longest) / h)
    middles = h * (np.arange(n) + 0.5)
    theta = np.interp(middles, start.s, start.theta, right=0.0)
    spin = np.interp(middles, start.s, start.spin, right=0.0)

    u = np.zeros((n, UNKNOWNS))
    u[:, X], y = from_the_end(np.cos(theta), n * h, h), from_the_end(np.sin(theta), 0.0, h)
    u[:, Z] = np.where(y > 0.0, y, -1.0)
    u[:, THETA] = theta
    v = np.stack([from_the_end(-np.sin(theta) * spin, 0.0, h), from_the_end(np.cos(theta) * spin, 0.0, h)])
    if not chain.mass:
        v[:] = 0.0
    r = chain.places(u)
    return Moment(start.t, u, r, v, np.zeros_like(v), r[1], np.inf, r, v)


def tail(at: Moment) -> int:
    """Return how many nodes lie on the plate from the tip on."""
    return int(np.argmax(at.y > 0.0))


def run_on_mesh(
    setting: Setting, start: Posture, until: Until, *, resolution: int = 0, told: Told | None = None
) -> Track:
    """Compute a run on a fixed mesh, as `Tier` says.

    A tip that has landed slides into the state in which it just touches the plate, which is unstable: on the
    mesh it is held there by the bond of its last half link.  It is given a small lift, once; where it lands
    again it would go on to do so.  What the lift takes counts as work.
    """
    memory = Memory(setting.law, setting.ratio, setting.bond)
    chain = Chain(LINKS[resolution], memory, setting.mass, setting.drag)
    at = begun(chain, start, setting.length)
    kept = Recorder(chain)
    kept.add(at, setting.pressure, Spent())
    kept.happened("start")
    pacer = Pacer(TURNS[resolution])
    outcome, lift, lifts = "not settled", None, 0
    while outcome == "not settled" and at.t < until.time:
        before, at = at, pacer.taken(chain, at, lift.end if lift else until.time, setting.pressure, lift)
        held = chain if lift is None else replace(chain, tip_at=at.y[0])
        kept.add(at, setting.pressure, spent(held, before, at, (setting.pressure, setting.pressure)))
        if told is not None:
            told(at.t)
        front = kept.rows[-1][1]
        if not at.y.any():
            outcome = "closes"
        elif before.y[0] > 0.0 >= at.y[0] and lift is None:
            outcome = landed(kept, until)
        if setting.length - front < END * chain.h:
            outcome = "end of rod"
            kept.happened("end of rod")
        if outcome == "not settled" and front + AHEAD > len(at.u) * chain.h:
            room = min(BLOCK, setting.length - len(at.u) * chain.h)
            at = at.longer(round(room / chain.h), chain.h)
        if lift is not None and at.t >= lift.end:
            lift, at = None, let_go(at)
            pacer.begins()
            kept.happened("lift")
        elif lift is None and until.arrest and kept.at_rest(at, setting.pressure):
            if tail(at) == 1 and lifts < len(LIFTS):
                lift = Lift(at.t, LIFTS[lifts] * float(at.y.max()))
                at, lifts = replace(at, dt=np.inf), lifts + 1
                pacer.begins()
                continue
            outcome = at_rest(at)
            kept.happened("arrest")
        elif lift is None and until.arrest and kept.repeats():
            outcome = "flapping"
    return kept.track(spin_of(chain, at), outcome)


def landed(kept: Recorder, until: Until) -> str:
    """Say what follows from a landing, and note it."""
    rose = kept.rose
    kept.happened("contact")
    if until.contact:
        return "contact"
    return "flapping" if rose else "not settled"


def at_rest(at: Moment) -> str:
    """Say in what state a rod has come to rest."""
    down = tail(at)
    if down > 1:
        return "flat fold"
    if down == 1:
        return "touching"
    return "folded" if at.u[0, THETA] < FOLDED else "held"


def spin_of(chain: Chain, at: Moment) -> np.ndarray:
    """Return theta_t at the points of the last shape."""
    along = np.append(at.v, np.zeros((2, 1)), axis=1)
    theta = at.u[:, THETA]
    spin = (np.diff(along[1]) * np.cos(theta) - np.diff(along[0]) * np.sin(theta)) / chain.h
    s = np.linspace(0.0, front_of(chain, at), POINTS)
    return np.interp(s, chain.h * (np.arange(len(theta)) + 0.5), spin)


@dataclass(eq=False)
class Pacer:
    """How long a step may be: as long as no link turns, nor changes how it turns, by much.

    Parameters
    ----------
    turn : float
        Largest angle [rad] that a link turns in a step.
    """

    turn: float
    dt: float = FIRST
    rate: np.ndarray | None = None

    def begins(self) -> None:
        """Begin anew, from a moment whose past does not count."""
        self.dt, self.rate = FIRST, None

    def taken(
        self, chain: Chain, at: Moment, end: float, pressure: float, lift: Lift | None = None
    ) -> Moment:
        """Take one step, not beyond a time.

        Raises
        ------
        NotConverged
        """
        while True:
            dt = min(self.dt, end - at.t)
            held = chain if lift is None else replace(chain, tip_at=lift.at(at.t + dt))
            after = step(held, at, dt, pressure)
            if after is not None:
                moved = after.u[:, THETA] - at.u[:, THETA]
                turned = float(np.abs(moved).max())
                if turned <= 2.0 * self.turn or dt <= FIRST:
                    break
            self.dt = 0.5 * dt
            if self.dt < SHORTEST:
                raise NotConverged(
                    f"the motion could be followed to t = {at.t:.6g} tau only: no step of it is short enough.",
                    remedy="Give some drag: without it, what a contact sets going never comes to rest.",
                )
        rate = moved / dt
        known = len(self.rate) if self.rate is not None else 0
        last = np.zeros_like(rate)
        if self.rate is not None:
            last[:known] = self.rate
        bend = float(np.abs(rate - last).max()) * dt if known else 0.0
        grows = min(GROWTH, self.turn / max(turned, TINY), math.sqrt(BENDS * self.turn / max(bend, TINY)))
        self.rate, self.dt = rate, min(dt * grows, LONGEST)
        return after
