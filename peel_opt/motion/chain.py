"""The rod as a chain of stiff links on its plate: the balances of a stage of a step, and their derivatives.

Node i lies at the arc length s_i = i h from the tip and has a place x_i, a height y_i and a contact force C_i
per length; the link to the next has an angle theta_i and a force N_i.  The last node is stuck.  With
the loads of each link shared by its ends,

    r_{i+1} - r_i = h (cos theta_i, sin theta_i)
    (theta_{i+1} - 2 theta_i + theta_{i-1}) / h + h (N_x sin theta - N_y cos theta)_i = 0
    h (rho a + c v)_i = p n_i h + h (C_i - tau(y_i)) e_y - (N_i - N_{i-1})
    y >= 0,  C >= 0,  y C = 0.

The attached rod is among them: there theta = y = 0 and C > 0.  The front is where that ends.  One number z
for each node says both what it is open by and what it is pressed with, y = max(z, 0), C = max(-z, 0), so
that the complementarity holds by itself and Newton's method on z is that of the active set.  While a stage
is solved, C is counted in what it takes to move a node by 1 within the stage, so that neither side of z = 0
is steeper than the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgbsv

from .memory import Memory

#: Unknowns of a node and its link: x, z, theta, N_x, N_y; and rows, r_x, r_y, moments, forces.
UNKNOWNS = 5
X, Z, THETA, NX, NY = range(UNKNOWNS)

#: Diagonals below and above that are not zero.
BELOW, ABOVE = 7, 5


class Stage(NamedTuple):
    """What a stage of a step is implicit in: r = base + span v, v = base_v + span a."""

    span: float
    base: np.ndarray
    base_v: np.ndarray
    pressure: float

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
    """

    h: float
    memory: Memory
    mass: float
    drag: float
    tip_at: float | None = None

    def share(self, n: int) -> np.ndarray:
        """Length of rod of each node."""
        w = np.full(n, self.h)
        w[0] *= 0.5
        return w

    def places(self, u: np.ndarray) -> np.ndarray:
        """x and y of the nodes, (2, n)."""
        places = np.stack([u[:, X], np.maximum(u[:, Z], 0.0)])
        if self.tip_at is not None:
            places[1, 0] = self.tip_at
        return places

    def pressed(self, u: np.ndarray) -> np.ndarray:
        """Force per length with which each node is held up, in the unit of z; that of a lift has any sign."""
        pressed = np.maximum(-u[:, Z], 0.0)
        if self.tip_at is not None:
            pressed[0] = -u[0, Z]
        return pressed

    def end(self, n: int) -> float:
        """Place of the stuck end."""
        return n * self.h

    def loads(self, theta: np.ndarray, pressure: float) -> np.ndarray:
        """Force of the pressure on each node, (2, n): half of that on each of its links."""
        force = 0.5 * self.h * pressure * np.stack([-np.sin(theta), np.cos(theta)])
        force[:, 1:] += force[:, :-1].copy()
        return force

    def residual(self, u: np.ndarray, stage: Stage, open_to: np.ndarray) -> np.ndarray:
        """Return the balances, (n, 5): places of the links, moments and forces."""
        h, n = self.h, len(u)
        theta, Nx, Ny = u[:, THETA], u[:, NX], u[:, NY]
        x, y = places = self.places(u)
        sine, cosine = np.sin(theta), np.cos(theta)
        v = (places - stage.base) / stage.span
        w, inert = self.share(n), self.drag * v
        if self.mass:
            inert = inert + self.mass * (v - stage.base_v) / stage.span
        held_up = stage.stiffness(self) * self.pressed(u) - self.memory.holding(y, open_to)[0]
        load = self.loads(theta, stage.pressure)
        rows = np.empty((n, UNKNOWNS))
        rows[:, 0] = np.append(x[1:], self.end(n)) - x - h * cosine
        rows[:, 1] = np.append(y[1:], 0.0) - y - h * sine
        turned = np.diff(theta, append=0.0) / h
        rows[:, 2] = turned + h * (Nx * sine - Ny * cosine)
        rows[1:, 2] -= turned[:-1]
        rows[:, 3] = w * inert[0] - load[0] + Nx
        rows[:, 4] = w * (inert[1] - held_up) - load[1] + Ny
        rows[1:, 3] -= Nx[:-1]
        rows[1:, 4] -= Ny[:-1]
        return rows

    def derivatives(self, u: np.ndarray, stage: Stage, open_to: np.ndarray) -> np.ndarray:
        """Return the derivatives of the balances by all unknowns, banded as LAPACK takes them."""
        h, n = self.h, len(u)
        theta, Nx, Ny = u[:, THETA], u[:, NX], u[:, NY]
        sine, cosine = np.sin(theta), np.cos(theta)
        free = u[:, Z] > 0.0
        if self.tip_at is not None:
            free[0] = False
        slope = self.memory.holding(self.places(u)[1], open_to)[1]
        w, stiffness, push = self.share(n), stage.stiffness(self), 0.5 * h * stage.pressure
        band = np.zeros((2 * BELOW + ABOVE + 1, n, UNKNOWNS))

        def put(row: int, column: int, values: np.ndarray | float, ahead: int = 0) -> None:
            """Enter the derivatives of a row of all nodes by a number of the node ``ahead``, in its order."""
            where = slice(max(ahead, 0), n + min(ahead, 0))
            diagonal = BELOW + ABOVE + row - column - UNKNOWNS * ahead
            band[diagonal, where, column] = values[where] if isinstance(values, np.ndarray) else values

        put(0, X, -1.0)
        put(0, X, 1.0, 1)
        put(0, THETA, h * sine)
        put(1, Z, -1.0 * free)
        put(1, Z, 1.0 * free, 1)
        put(1, THETA, -h * cosine)
        middle = h * (Nx * cosine + Ny * sine) - 2.0 / h
        middle[0] += 1.0 / h
        put(2, THETA, middle)
        put(2, NX, h * sine)
        put(2, NY, -h * cosine)
        put(3, X, w * stiffness)
        put(4, Z, w * (stiffness + np.where(free, slope, 0.0)))
        for row, force, turning in ((3, NX, cosine), (4, NY, sine)):
            put(row, force, 1.0)
            put(row, force, -1.0, -1)
            put(row, THETA, push * turning)
            put(row, THETA, push * turning, -1)
        put(2, THETA, 1.0 / h, 1)
        put(2, THETA, 1.0 / h, -1)
        return band.reshape(band.shape[0], -1)

    def solve(
        self, u: np.ndarray, stage: Stage, open_to: np.ndarray, *, most: int = 14, tol: float = 1e-9
    ) -> np.ndarray | None:
        """Solve the balances of a stage from a guess; None where Newton's method does not settle."""
        stiffness = stage.stiffness(self)
        u = _pressed(u, 1.0 / stiffness)
        for _ in range(most):
            rows, band = self.residual(u, stage, open_to), self.derivatives(u, stage, open_to)
            _, _, update, info = dgbsv(BELOW, ABOVE, band, -rows.ravel(), overwrite_ab=True, overwrite_b=True)
            if info != 0 or not np.abs(update).max() < 1e3:
                return None
            change = update.reshape(u.shape)
            u = u + change
            if np.abs(change[:, THETA]).max() < tol and np.abs(change[:, :2]).max() < tol:
                return _pressed(u, stiffness)
            if np.abs(change[:, THETA]).max() > 2.0:
                return None
        return None


def _pressed(u: np.ndarray, factor: float) -> np.ndarray:
    """Count the contact forces in another unit."""
    u = u.copy()
    u[:, Z] = np.where(u[:, Z] < 0.0, factor * u[:, Z], u[:, Z])
    return u
