"""The rod as a chain of stiff links on its plate: the balances of a stage of a step, and their derivatives.

Node i lies at the arc length s_i = i h from the tip and has a place x_i, a height y_i and a contact force C_i
per length; the link to the next has an angle theta_i and a force N_i.  The last node is stuck.  With
the loads f of each link, as they are at its middle, shared by its ends, and g_i the part of h on which
the rod was glued,

    h (rho a + c v)_i = (f_i + f_{i-1}) h / 2 + (h C_i - g_i tau(y_i)) e_y - (N_i - N_{i-1})
    (theta_{i+1} - 2 theta_i + theta_{i-1}) / h + h (N_x sin theta - N_y cos theta)_i = 0
    r_{i+1} - r_i = h (cos theta_i, sin theta_i)
    y >= 0,  C >= 0,  y C = 0,

and at the tip its force, and theta' of what bends it there.  Where a load ends within a link, the link has
its share of it.  On a wall of curvature kw, x_i is a place along it and y_i a height over it, along which
act C and tau; theta counts from where the rod lay, so that a link points along phi = theta + kw s.

The attached rod is among them: there theta = y = 0 and C > 0.  The front is where that ends.  One number z
for each node says both what it is open by and what it is pressed with, y = max(z, 0), C = max(-z, 0), so
that the complementarity holds by itself and Newton's method on z is that of the active set.  While a stage
is solved, C is counted in what it takes to move a node by 1 within the stage, so that neither side of z = 0
is steeper than the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgbtrf, dgbtrs

from .acting import PRESSURE_ALONE, Acted, Loads, Past
from .arc import Arc
from .memory import Memory

#: Unknowns of a node and its link: x, z, theta, N_x, N_y; and rows: forces, moments, places of the ends.
UNKNOWNS = 5
X, Z, THETA, NX, NY = range(UNKNOWNS)
FX, FY, TURN, RX, RY = range(UNKNOWNS)

#: Ratio of two corrections from which on the derivatives are taken anew.
SLOW = 0.1

#: Before all ends of loads.
NOWHERE = Past()


class Stage(NamedTuple):
    """What a stage of a step is implicit in: r = base + span v, v = base_v + span a.

    ``front`` is where loads that count from it are told that it is.
    """

    span: float
    base: np.ndarray
    base_v: np.ndarray
    pressure: float
    front: float = math.inf

    def stiffness(self, chain: Chain) -> float:
        """Force per length that a displacement takes."""
        return chain.drag / self.span + chain.mass / self.span**2


@dataclass(frozen=True)
class Chain:
    """A rod of equal links under its loads.

    Parameters
    ----------
    h : float
        Length of a link, over eta.
    memory : Memory
        Its bond.
    mass, drag : float
        Per area.
    tip_at : float or None
        Height to which the tip is lifted from outside; None where nothing does.
    loads : Loads
        What acts on it.
    """

    h: float
    memory: Memory
    mass: float
    drag: float
    tip_at: float | None = None
    loads: Loads = PRESSURE_ALONE

    @property
    def diagonals(self) -> int:
        """How many above and below the main one are not zero: one more where a load feels its place."""
        return 6 if self.loads.feels & {"x", "y"} else 5

    @property
    def asks_front(self) -> bool:
        """Whether a load changes with where the front is, or with how far from the tip it acts."""
        return bool(self.loads.feels & {"s", "sbar"})

    def share(self, n: int) -> np.ndarray:
        """Length of rod of each node."""
        w = np.full(n, self.h)
        w[0] *= 0.5
        return w

    def glued(self, n: int) -> np.ndarray:
        """Length of rod of each node on which it was glued."""
        w, a = self.share(n), self.loads.unbonded
        return np.clip(self.h * (np.arange(n) + 0.5) - a, 0.0, w) if a else w

    @cached_property
    def arc(self) -> Arc:
        """The wall."""
        return Arc(self.loads.wall_curvature)

    @cached_property
    def link(self) -> float:
        """Length of a link: of the chord that it is of its wall."""
        kw = self.arc.curvature
        return 2.0 * math.sin(0.5 * kw * self.h) / kw if kw else self.h

    def phi(self, theta: np.ndarray) -> np.ndarray:
        """Direction of each link."""
        return theta if not self.arc else theta + self.arc.curvature * self.h * (np.arange(len(theta)) + 0.5)

    def normals(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x and y of the normal of the wall below each node."""
        return self.arc.normal(u[:, X])

    def heights(self, u: np.ndarray) -> np.ndarray:
        """Height of the nodes over the wall, (n,)."""
        heights = np.maximum(u[:, Z], 0.0)
        if self.tip_at is not None:
            heights[0] = self.tip_at
        return heights

    def places(self, u: np.ndarray) -> np.ndarray:
        """x and y of the nodes, (2, n)."""
        if not self.arc:
            return np.stack([u[:, X], self.heights(u)])
        return np.stack(self.arc.at(u[:, X])) + self.heights(u) * np.stack(self.normals(u))

    def pressed(self, u: np.ndarray) -> np.ndarray:
        """Force per length with which each node is held up, in the unit of z; that of a lift has any sign."""
        pressed = np.maximum(-u[:, Z], 0.0)
        if self.tip_at is not None:
            pressed[0] = -u[0, Z]
        return pressed

    def end(self, n: int) -> tuple[float, float]:
        """Place of the stuck end."""
        x, y = self.arc.at(np.array(n * self.h))
        return float(x), float(y)

    def acted(self, u: np.ndarray, pressure: float, front: float = math.inf) -> Acted:
        """Return what the loads are on each link, and what they change by.

        Ahead of the front, where no scene says what they are, they pull a link off by no more than at it.
        """
        phi, loads, n = self.phi(u[:, THETA]), self.loads, len(u)
        if not loads.feels and not loads.ends:
            return loads.at(pressure, phi, phi, phi, phi, phi)
        nodes, i, places = self.places(u), np.arange(n), np.empty((5, n))
        places[0], places[3], places[4] = phi, self.h * (i + 0.5), front
        places[1:3, :-1] = 0.5 * (nodes[:, :-1] + nodes[:, 1:])
        places[1:3, -1] = 0.5 * (nodes[:, -1] + self.end(n))
        if not loads.ends:
            return self._acted(pressure, places)
        force, by_theta, by_place = np.zeros((2, n)), np.zeros((2, n)), np.zeros((4, 2, n))
        past, begins = NOWHERE, 0.0
        for name, ends in (*loads.ends, ("", math.inf)):
            share = np.clip(ends / self.h - i, 0.0, 1.0) - np.clip(begins / self.h - i, 0.0, 1.0)
            if (here := share > 0.0).any():
                found = self._acted(pressure, places[:, here], past)
                force[:, here] += share[here] * found.force
                by_theta[:, here] += share[here] * found.by_theta
                if found.by_place is not None:
                    by_place[:, :, here] += share[here] * found.by_place
            past, begins = past | {name}, ends
        return Acted(force, by_theta, by_place)

    def _acted(self, pressure: float, places: np.ndarray, past: Past = NOWHERE) -> Acted:
        """Return what the loads are at places, and what they change by."""
        theta, x, y, s, sbar = places
        found = self.loads.at(pressure, theta, x, y, s, sbar, past)
        if (ahead := s > sbar).any():
            front, still = sbar[:1], np.zeros(1)
            there = self.loads.at(pressure, still, front, still, front, front, past)
            more = ahead & (found.force[1] > there.force[1])
            found.force[:, more], found.by_theta[:, more] = there.force, there.by_theta
            if found.by_place is not None:
                found.by_place[:, :, more] = 0.0
        return found

    def pushed(self, acted: Acted) -> np.ndarray:
        """Force of the loads on each node, (2, n): half of that on each of its links, and that on the tip."""
        force = 0.5 * self.h * acted.force
        force[:, 1:] += force[:, :-1].copy()
        force[:, 0] += self.loads.tip_force
        return force

    def residual(self, u: np.ndarray, stage: Stage, open_to: np.ndarray) -> np.ndarray:
        """Return the balances, (n, 5): places of the links, moments and forces."""
        h, n = self.h, len(u)
        theta, Nx, Ny = u[:, THETA], u[:, NX], u[:, NY]
        x, y = places = self.places(u)
        end_x, end_y = self.end(n)
        phi = self.phi(theta)
        sine, cosine = np.sin(phi), np.cos(phi)
        v = (places - stage.base) / stage.span
        w, inert = self.share(n), self.drag * v
        if self.mass:
            inert = inert + self.mass * (v - stage.base_v) / stage.span
        held_up, (nx, ny) = self.held_up(u, stage, open_to), self.normals(u)
        load = self.pushed(self.acted(u, stage.pressure, stage.front))
        rows = np.empty((n, UNKNOWNS))
        rows[:, FX] = w * inert[0] - held_up * nx - load[0] + Nx
        rows[:, FY] = w * inert[1] - held_up * ny - load[1] + Ny
        rows[1:, FX] -= Nx[:-1]
        rows[1:, FY] -= Ny[:-1]
        turned = np.diff(theta, append=0.0) / h
        rows[:, TURN] = turned + h * (Nx * sine - Ny * cosine)
        rows[1:, TURN] -= turned[:-1]
        rows[0, TURN] -= self.loads.tip_curvature
        rows[:, RX] = np.append(x[1:], end_x) - x - self.link * cosine
        rows[:, RY] = np.append(y[1:], end_y) - y - self.link * sine
        return rows

    def held_up(self, u: np.ndarray, stage: Stage, open_to: np.ndarray) -> np.ndarray:
        """Return the force of contact and bond on each node, along the normal of the wall."""
        n, traction = len(u), self.memory.holding(self.heights(u), open_to)[0]
        return self.share(n) * stage.stiffness(self) * self.pressed(u) - self.glued(n) * traction

    def derivatives(self, u: np.ndarray, stage: Stage, open_to: np.ndarray) -> np.ndarray:
        """Return the derivatives of the balances by all unknowns, banded as LAPACK takes them."""
        h, n = self.h, len(u)
        phi, Nx, Ny = self.phi(u[:, THETA]), u[:, NX], u[:, NY]
        sine, cosine = np.sin(phi), np.cos(phi)
        free = u[:, Z] > 0.0
        if self.tip_at is not None:
            free[0] = False
        slope = self.memory.holding(self.heights(u), open_to)[1]
        weighed = self.share(n) * stage.stiffness(self)
        acted = self.acted(u, stage.pressure, stage.front)
        band = np.zeros((3 * self.diagonals + 1, n, UNKNOWNS))

        def put(row: int, column: int, values: np.ndarray | float, ahead: int = 0) -> None:
            """Enter the derivatives of a row of all nodes by a number of the node ``ahead``, in its order."""
            where = slice(max(ahead, 0), n + min(ahead, 0))
            diagonal = 2 * self.diagonals + row - column - UNKNOWNS * ahead
            band[diagonal, where, column] += values[where] if isinstance(values, np.ndarray) else values

        # How a node moves with its place along the wall, and with its height.
        nx, ny = self.normals(u)
        along = 1.0 - self.arc.curvature * self.heights(u)
        rises = weighed + np.where(free, self.glued(n) * slope, 0.0)
        put(FX, X, weighed * along * ny)
        put(FY, Z, rises * ny)
        if self.arc:
            turned = self.arc.curvature * self.held_up(u, stage, open_to)
            put(FX, X, turned * ny)
            put(FY, X, -(weighed * along + turned) * nx)
            put(FX, Z, rises * nx)
        for row, force, turning in ((FX, NX, acted.by_theta[0]), (FY, NY, acted.by_theta[1])):
            put(row, force, 1.0)
            put(row, force, -1.0, -1)
            put(row, THETA, -0.5 * h * turning)
            put(row, THETA, -0.5 * h * turning, -1)
        if acted.by_place is not None and self.diagonals > 5:
            for row, column, by, moves in (
                (FX, X, acted.by_place[0, 0], 1.0),
                (FX, Z, acted.by_place[1, 0], free),
                (FY, X, acted.by_place[0, 1], 1.0),
                (FY, Z, acted.by_place[1, 1], free),
            ):
                own, before = -0.25 * h * by, np.append(0.0, -0.25 * h * by[:-1])
                put(row, column, (own + before) * moves)
                put(row, column, before * moves, 1)
                put(row, column, own * moves, -1)
        middle = h * (Nx * cosine + Ny * sine) - 2.0 / h
        middle[0] += 1.0 / h
        put(TURN, THETA, middle)
        put(TURN, THETA, 1.0 / h, 1)
        put(TURN, THETA, 1.0 / h, -1)
        put(TURN, NX, h * sine)
        put(TURN, NY, -h * cosine)
        for ahead, sign in ((0, -1.0), (1, 1.0)):
            put(RX, X, sign * along * ny, ahead)
            put(RY, Z, sign * free * ny, ahead)
            if self.arc:
                put(RY, X, -sign * along * nx, ahead)
                put(RX, Z, sign * free * nx, ahead)
        put(RX, THETA, self.link * sine)
        put(RY, THETA, -self.link * cosine)
        return band.reshape(band.shape[0], -1)

    def solve(
        self, u: np.ndarray, stage: Stage, open_to: np.ndarray, *, most: int = 20, tol: float = 1e-9
    ) -> np.ndarray | None:
        """Solve the balances of a stage from a guess; None where Newton's method does not settle.

        Derivatives are taken anew where a node has left the plate or come down on it, and where corrections
        shrink slowly.
        """
        stiffness = stage.stiffness(self)
        u = self._counted(u, 1.0 / stiffness)
        free, factors, last, diagonals = u[:, Z] > 0.0, None, 1.0, self.diagonals
        for _ in range(most):
            if factors is None:
                band = self.derivatives(u, stage, open_to)
                *factors, info = dgbtrf(band, diagonals, diagonals, overwrite_ab=True)
                if info != 0:
                    return None
            rows = self.residual(u, stage, open_to)
            update, _ = dgbtrs(factors[0], diagonals, diagonals, -rows.ravel(), factors[1], overwrite_b=True)
            if not np.abs(update).max() < 1e3:
                return None
            change = update.reshape(u.shape)
            u = u + change
            if np.abs(change[:, THETA]).max() > 2.0:
                return None
            size, was_free, free = float(np.abs(change[:, :3]).max()), free, u[:, Z] > 0.0
            turned, shrunk = free != was_free, size / last
            # What neither lifts nor presses, as an edge without glue and without load, may count as either.
            same = not np.any(turned & (np.abs(u[:, Z]) > tol))
            # The next correction is less than this one times what this one is of the last.
            if same and (size < tol or (shrunk < SLOW and size * shrunk < tol)):
                return self._counted(u, stiffness)
            if turned.any() or shrunk > SLOW:
                factors = None
            last = size
        return None

    def _counted(self, u: np.ndarray, factor: float) -> np.ndarray:
        """Count the contact forces, and that of a lift, in another unit."""
        u, force = u.copy(), u[:, Z] < 0.0
        if self.tip_at is not None:
            force[0] = True
        u[force, Z] *= factor
        return u
