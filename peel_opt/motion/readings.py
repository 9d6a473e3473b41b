"""What a rod on its mesh is like at a moment, and what a run keeps of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import BarycentricInterpolator

from .chain import THETA, Chain, X
from .moments import Moment, Spent, front_of
from .run import Track
from .trajectory import Happening, Ledger, TipPath

#: Shares of a stored shape.
POINTS = 101

#: Speed below which, and distance still to go over eta below which, nothing moves any more, and the time
#: over which it must have died away: by then what is fast has, and what leaves an unstable state is seen.
SLOW, REST, WINDOW = 1e-3, 5e-4, 15.0

#: What is no speed.
TINY = 1e-30

#: By how much more a tip rises, after it was lifted, that goes on by itself.
RISEN = 1.5

#: Landings from which a tip has risen by itself that show that it will go on to do so.
RISES = 2

#: Swings of the tip that are compared, as a share of its greatest height the least that count, and the
#: share of them by which they may differ and be the same.
CYCLES, SWING, SAME = 4, 0.02, 0.005

#: Tip angles that are named are this far apart [rad].
ANGLES = 0.5

#: Tip angle [rad] beyond which a rod is folded over.
FOLDED = -0.5 * math.pi

#: Height over eta of a point ahead of which a rod may lie down: nearer the front it is hardly open.
CLEAR = 0.01


def missed(chain: Chain, at: Moment, pressure: float) -> float:
    """Return what the identity of the motion misses, with what contact and memory add.

    That is int (f - rho r_tt - c r_t).(e - t) ds, and what the tip has, less the work of separation of
    what was glued, which is Phi(y) where that begins; e is e_x on a plate, and turns with a curved wall.
    """
    y, w, memory = at.y, chain.share(len(at.u)), chain.memory
    phi, force = chain.phi(at.u[:, THETA]), chain.acted(at.u, pressure, at.front).force
    along, carried = np.stack([np.cos(phi), np.sin(phi)]), np.stack(chain.arc.carried(*at.r))
    middles = np.append(0.5 * (carried[:, 1:] + carried[:, :-1]), carried[:, -1:], axis=1)
    driven = chain.h * float(np.sum(force * (middles - along)))
    along[:, 1:] = 0.5 * (along[:, 1:] + along[:, :-1].copy())
    resists = chain.mass * at.a + chain.drag * at.v
    kept = chain.glued(len(w)) * (memory.holding(y, at.open_to)[0] - memory.pull(y)[0])
    separated = memory.work(np.interp([chain.loads.unbonded], chain.h * np.arange(len(w)), y))[0]
    found = driven + float(chain.loads.at_tip(np.array(tip_angle(chain, at)))) - separated
    across = np.sum(np.stack(chain.normals(at.u)) * along, axis=0)
    found += np.sum((kept - w * chain.pressed(at.u)) * across)
    return float(found - np.sum(w * resists * (carried - along)))


def tip_angle(chain: Chain, at: Moment) -> float:
    """Return theta at the tip, half a link before the first of the links, with theta' there as it is held."""
    theta, slope = at.u[:2, THETA], chain.h * chain.loads.tip_curvature
    return float(theta[0] - 0.5 * slope - 0.125 * (theta[1] - theta[0] - slope))


def tail(at: Moment) -> int:
    """Return how many nodes lie on the plate from the tip on."""
    return int(np.argmax(at.y > 0.0))


def lying(at: Moment) -> np.ndarray:
    """Return the nodes that lie on the plate, from the tip to what is well open, (m,)."""
    open_at = np.flatnonzero(at.y > CLEAR)
    return np.flatnonzero(at.y[: open_at[-1]] == 0.0) if open_at.size else open_at


def at_rest_in(chain: Chain, at: Moment) -> str:
    """Say in what state a rod has come to rest: a point that touches lies in a node, or between two."""
    down = lying(at)
    if len(down) > (1 if at.y[0] == 0.0 else 2):
        return "flat fold"
    if len(down):
        return "touching"
    if at.u[0, THETA] < FOLDED:
        return "folded"
    return "standing" if chain.memory.bond == "reversible" else "held"


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
        self.rises = 0.0
        self.up = -math.inf

    def add(self, at: Moment, pressure: float, spent: Spent, held: Chain | None = None) -> None:
        """Keep a moment, of a chain whose tip is ``held`` by a lift or not."""
        chain, u, n = self.chain, at.u, len(at.u)
        self.spent = Spent(self.spent.work + spent.work, self.spent.drag + spent.drag)
        w, theta, memory = chain.share(n), u[:, THETA], chain.memory
        turned = np.diff(np.append(theta, 0.0))
        front = front_of(chain, at)
        self.up = at.t if at.y[0] > 0.0 else self.up
        angle, loads, glued = tip_angle(chain, at), chain.loads, chain.glued(n)
        energies = (
            0.5 * chain.mass * float(np.sum(w * at.v**2)),
            0.5 * float(turned @ turned) / chain.h
            + (loads.natural_curvature - loads.wall_curvature) * theta[0],
            float(glued @ memory.stored(at.y, at.open_to)),
            *self.spent,
            float(glued @ memory.lost(at.open_to)),
        )
        identity = missed(held or chain, at, pressure)
        self.rows.append([at.t, front, at.y[0], u[0, X], angle, *energies, identity])
        s = np.linspace(0.0, front, POINTS)
        nodes = chain.h * np.arange(n)
        middles = np.concatenate([[0.0], nodes + 0.5 * chain.h])
        self.shapes.append(
            np.stack(
                [
                    np.interp(s, nodes, at.r[0]),
                    np.interp(s, nodes, at.r[1]),
                    np.interp(s, middles, np.concatenate([[angle], theta])),
                ]
            )
        )

    def happened(self, kind: str) -> None:
        """Note that something happened at the last moment."""
        t, front, y, x, angle = self.rows[-1][:5]
        self.events.append(Happening(kind, t, front, y, x, angle))

    def landed(self, before: Moment, at: Moment) -> None:
        """Note that the rod has come down in the last step: where it would have, as it was coming."""
        down, length = lying(at), at.t - before.t
        normals = np.stack(self.chain.normals(before.u))[:, down]
        y, v = before.y[down], np.sum(normals * before.v[:, down], axis=0)
        gains = (v - np.sum(normals * before.v_before[:, down], axis=0)) / before.dt
        # Of y + v t + gains t^2/2 the first root, by what does not cancel.
        roots = 2.0 * y / np.maximum(np.sqrt(np.maximum(v * v - 2.0 * gains * y, 0.0)) - v, TINY)
        came = min(float(roots.min()), length)
        known = np.array([row[:5] for row in self.rows[-4:-1]])
        path = BarycentricInterpolator(known[:, 0], known[:, 1:])(before.t + came)
        front, height, x, angle = path.tolist()
        self.events.append(
            Happening("contact", before.t + came, front, height if at.y[0] > 0.0 else 0.0, x, angle)
        )

    @property
    def rose(self) -> bool:
        """Whether a tip that was lifted went on by itself, or one that was not has risen again and again."""
        lifts = [event for event in self.events if event.kind == "lift"]
        if not lifts:
            return sum(event.kind == "contact" for event in self.events) >= RISES
        heights = [row[2] for row in self.rows if row[0] >= lifts[-1].t]
        return max(heights) > RISEN * lifts[-1].y

    def repeats(self) -> bool:
        """Whether the tip goes up and down as far as it did the last times."""
        before, now = (row[2] for row in self.rows[-2:])
        if (now - before) * self.rises < 0.0:
            self.turns.append(before)
        self.rises = now - before or self.rises  # a tip that lies has not turned yet
        swings = np.abs(np.diff(self.turns[-2 * CYCLES :]))
        if len(swings) < 2 * CYCLES - 1 or swings.min() < SWING * max(self.turns):
            return False
        return float(np.ptp(swings)) < SAME * float(swings.max())

    def lain(self, at: Moment) -> bool:
        """Whether a bond that heals has held the tip down for as long as a rod takes to be at rest."""
        return self.chain.memory.bond == "reversible" and at.t - self.up >= WINDOW

    def at_rest(self, at: Moment) -> bool:
        """Whether what is left of the motion, as it dies away, is too small to matter.

        A rod with mass swings, and stands still where it turns: its fastest within the window counts.
        """
        speed, swings = float(np.abs(at.v).max()), bool(self.chain.mass)
        if not self.speeds or self.speeds[-1][0] < at.t:
            self.speeds.append((at.t, speed))
        since = at.t - (2.0 * WINDOW if swings else WINDOW)
        while len(self.speeds) > 2 and self.speeds[1][0] < since:
            self.speeds.pop(0)
        then, before = self.speeds[0]
        if speed > SLOW or then > since:
            return False
        length = at.t - then
        if swings:
            length, middle = 0.5 * length, at.t - 0.5 * length
            before = max(v for t, v in self.speeds if t <= middle)
            speed = max(v for t, v in self.speeds if t >= middle)
        return speed == 0.0 or speed * length < REST * math.log(before / speed)

    def track(self, outcome: str) -> Track:
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
            energy=Ledger(*energies),
            identity=identity,
            events=tuple(sorted((*self.events, *self._angles()), key=lambda event: event.t)),
            outcome=outcome,
        )

    def _angles(self) -> list[Happening]:
        """Name when the tip has first turned by each multiple of `ANGLES`, between steps by cubics.

        They do not reach beyond a landing, where it turns otherwise from one moment to the next.
        """
        path = np.array(self.rows)[:, :5]
        angle, found = path[:, 4], []
        landings = np.searchsorted(path[:, 0], [e.t for e in self.events if e.kind == "contact"])
        for k in range(1, int(-angle.min() / ANGLES) + 1):
            i = int(np.argmax(angle <= -k * ANGLES))
            last = min((int(n) for n in landings if i <= n < i + 2), default=i + 2)
            near = path[max(last - 4, 0) : last]
            if i == 0 or len(near) < 4 or np.any(np.diff(near[:, 4]) >= 0.0):
                continue
            wanted = -k * ANGLES - near[0, 4]
            numbers = [
                float(Polynomial.fit(near[:, 4] - near[0, 4], column, 3)(wanted)) for column in near[:, :4].T
            ]
            t, front, y, x = numbers
            found.append(Happening("angle", t, front, y, x, -k * ANGLES))
        return found
