"""The detached part in motion: theta in piecewise polynomials between tip, kinks of the bond and front.

A point at a fixed fraction of its phase is at x = sbar - int cos(theta), y = -int sin(theta), from the
front back, and belongs to another s as the lengths of the phases change: a material point moves with
v = r_t - t s_t.  The principle of virtual power then reads, for every motion the polynomials can make,

    int (q - c v - rho v_t) . delta r ds = delta U,     q = p n + f e_y,

which holds with a front that runs, because theta' = 0 at it: the bond is rigid up to T0, so that the
front is where an obstacle ends, and nothing is released there.  theta = theta' = 0 at the front are
built in; theta' = 0 at the tip is natural.  A kink of the traction is the end of a phase, held to its
height by a multiplier, which tends to zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .basis import Basis, basis
from .run import Setting
from .tractions import Held, Traction
from .trajectory import TipPath


class Balance(NamedTuple):
    """Virtual power of every unknown, and its derivatives by these, their rates and those of the rates."""

    residual: np.ndarray
    by_state: np.ndarray
    by_rate: np.ndarray
    by_second: np.ndarray


class Shapes(NamedTuple):
    """Angle, curvature, place and height at the Gauss points, and what integrates over them."""

    theta: np.ndarray
    curvature: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray
    x: np.ndarray
    y: np.ndarray
    weights: np.ndarray
    inward: np.ndarray


class Rates(NamedTuple):
    """Of the points at the Gauss points: their velocity and acceleration, and what the rod itself turns."""

    vx: np.ndarray
    vy: np.ndarray
    ax: np.ndarray
    ay: np.ndarray
    spin: np.ndarray


class Reading(NamedTuple):
    """Front, tip and energies of a moving state, what is missed of the identity, and its greatest speed."""

    front: float
    tip: TipPath
    kinetic: float
    bending: float
    separation: float
    identity: float
    speed: float


@dataclass(frozen=True, eq=False)
class Flap:
    """The detached part of a rod under a setting, in phases of the law from the tip on.

    Its unknowns are the coefficients of theta, the lengths of the phases and a multiplier for every kink.

    Parameters
    ----------
    setting : Setting
    phases : tuple of int
        Which piece of the law each phase is on.
    degrees : tuple of int
        Of the polynomials of each phase.
    """

    setting: Setting
    phases: tuple[int, ...]
    degrees: tuple[int, ...]

    @cached_property
    def basis(self) -> Basis:
        """Its polynomials."""
        return basis(self.degrees)

    @cached_property
    def pieces(self) -> list[Traction]:
        """What the bond holds in each phase."""
        return [Traction(self.setting.law.pieces[i]) for i in self.phases]

    @cached_property
    def kinks(self) -> np.ndarray:
        """Heights at which one phase ends and the next begins, over eta."""
        kinks = self.setting.law.kinks
        return np.array([kinks[min(pair)] for pair in pairwise(self.phases)]) / self.setting.ratio

    @cached_property
    def fields(self) -> slice:
        """Where the coefficients of theta are among the unknowns."""
        return slice(0, self.basis.size)

    @cached_property
    def lengths(self) -> slice:
        """Where the lengths of the phases are."""
        return slice(self.basis.size, self.basis.size + len(self.phases))

    @cached_property
    def multipliers(self) -> slice:
        """Where the multipliers are."""
        return slice(self.lengths.stop, self.size)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.basis.size + 2 * len(self.phases) - 1

    # -- shape and rates

    def shapes(self, u: np.ndarray) -> Shapes:
        """Return the shape at the Gauss points."""
        value, slope = self.basis.tables
        theta, lengths = value @ u[self.fields], u[self.lengths]
        inward = self.basis.reaching(lengths)
        sine, cosine = np.sin(theta), np.cos(theta)
        curvature = slope @ u[self.fields] / self._spread(lengths)
        x, y = lengths.sum() - inward @ cosine, -inward @ sine
        return Shapes(theta, curvature, sine, cosine, x, y, lengths @ self.basis.whole, inward)

    def rates(self, at: Shapes, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> Rates:
        """Return velocities and accelerations for rates and rates of rates of the unknowns."""
        vx, vy = self._carried(at, z)
        phi, spread = self.basis.tables[0] @ z[self.fields], z[self.lengths]
        st = self._mesh @ spread
        spin = phi - at.curvature * st
        if not self.setting.mass:
            nothing = np.zeros_like(vx)
            return Rates(vx, vy, nothing, nothing, spin)
        turning = self.basis.reaching(spread)
        ax, ay = self._carried(at, a)
        ax = (
            ax
            + 2.0 * turning @ (at.sine * phi)
            + at.inward @ (at.cosine * phi**2)
            + at.sine * st * (phi + spin)
        )
        ay = (
            ay
            - 2.0 * turning @ (at.cosine * phi)
            + at.inward @ (at.sine * phi**2)
            - at.cosine * st * (phi + spin)
        )
        return Rates(vx, vy, ax, ay, spin)

    def _spread(self, per_phase: np.ndarray) -> np.ndarray:
        """Repeat a number of each phase at all its points."""
        return np.repeat(per_phase, len(self.basis.grid.xi))

    @cached_property
    def _mesh(self) -> np.ndarray:
        """How the s of each point moves with each length, (points, count)."""
        mesh: np.ndarray = 1.0 - self.basis.outward.sum(axis=2).T
        return mesh

    def _carried(self, at: Shapes, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how points of the rod move when the unknowns change by ``z``."""
        phi, spread = self.basis.tables[0] @ z[self.fields], z[self.lengths]
        outward, st = self.basis.reaching(spread), self._mesh @ spread
        x = spread.sum() + at.inward @ (at.sine * phi) - outward @ at.cosine - at.cosine * st
        y = -at.inward @ (at.cosine * phi) - outward @ at.sine - at.sine * st
        return x, y

    def _carriers(self, at: Shapes) -> tuple[np.ndarray, np.ndarray]:
        """Return the matrices of `_carried`, (points, unknowns without multipliers)."""
        value, outward = self.basis.tables[0], self.basis.outward
        x = [
            at.inward @ (at.sine[:, None] * value),
            1.0 - (outward @ at.cosine).T - at.cosine[:, None] * self._mesh,
        ]
        y = [
            -at.inward @ (at.cosine[:, None] * value),
            -(outward @ at.sine).T - at.sine[:, None] * self._mesh,
        ]
        return np.hstack(x), np.hstack(y)

    def _carriers_changed(self, at: Shapes, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of `_carried` by the unknowns."""
        value, outward = self.basis.tables[0], self.basis.outward
        phi, spread = value @ z[self.fields], z[self.lengths]
        turning, st = self.basis.reaching(spread), self._mesh @ spread

        def turned(first: np.ndarray, second: np.ndarray) -> np.ndarray:
            """Derivative by theta of inward (first' phi) and of what stands at the points, as a matrix."""
            matrix: np.ndarray = at.inward * (first * phi) + turning * second
            matrix[np.diag_indices_from(matrix)] += second * st
            return matrix @ value

        x = np.hstack([turned(at.cosine, at.sine), (outward @ (at.sine * phi)).T])
        y = np.hstack([turned(at.sine, -at.cosine), -(outward @ (at.cosine * phi)).T])
        return x, y

    # -- the principle of virtual power

    def balance(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> Balance:
        """Return what must vanish and its derivatives.

        Parameters
        ----------
        u, z, a : ndarray, shape (size,)
            Unknowns, their rates and the rates of these; multipliers count in ``u`` only.
        """
        residual, Tx, Ty, at, force = self._virtual(u, z, a)
        moving = slice(0, self.lengths.stop)
        by_state, by_rate, by_second = (np.zeros((self.size, self.size)) for _ in range(3))
        s, w, value = self.setting, at.weights[:, None], self.basis.tables[0]
        # What acts on a point, as the shape changes under it.
        slope = s.ratio * np.concatenate([held.slope for held in self._held(at)])
        dvx, dvy = self._carriers_changed(at, z)
        dfx, dfy = -s.drag * dvx, -s.drag * dvy - slope[:, None] * self._heights_changed(at)
        dfx[:, self.fields] -= s.pressure * at.cosine[:, None] * value
        dfy[:, self.fields] -= s.pressure * at.sine[:, None] * value
        if s.mass:
            dax, day = self._acceleration_by_state(at, u, z, a)
            dfx, dfy = dfx - s.mass * dax, dfy - s.mass * day
            bx, by = self._acceleration_by_rate(at, z)
            by_rate[moving, moving] -= s.mass * (Tx.T @ (w * bx) + Ty.T @ (w * by))
            by_second[moving, moving] = -s.mass * (Tx.T @ (w * Tx) + Ty.T @ (w * Ty))
        by_rate[moving, moving] -= s.drag * (Tx.T @ (w * Tx) + Ty.T @ (w * Ty))
        by_state[moving, moving] = Tx.T @ (w * dfx) + Ty.T @ (w * dfy)
        lengthened = self.basis.whole.T  # the weights, by the lengths
        by_state[moving, self.lengths] += Tx.T @ (force[0][:, None] * lengthened) + Ty.T @ (
            force[1][:, None] * lengthened
        )
        by_state[moving, moving] += self._virtual_changed(at, at.weights * force[0], at.weights * force[1])
        by_state[moving, moving] -= self._bending_changed(u)
        if len(self.kinks):
            by_kink, curved = self._kinks_changed(at, u[self.multipliers])
            by_state[moving, moving] += curved
            by_state[moving, self.multipliers] = by_kink.T
            by_state[self.multipliers, moving] = by_kink
        return Balance(residual, by_state, by_rate, by_second)

    def residual(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return what must vanish alone."""
        return self._virtual(u, z, a)[0]

    def _held(self, at: Shapes) -> list[Held]:
        heights = (self.setting.ratio * at.y).reshape(len(self.pieces), -1)
        return [piece(u) for piece, u in zip(self.pieces, heights, strict=True)]

    def _virtual(
        self, u: np.ndarray, z: np.ndarray, a: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, Shapes, tuple[np.ndarray, np.ndarray]]:
        at, s = self.shapes(u), self.setting
        Tx, Ty = self._carriers(at)
        rates = self.rates(at, u, z, a)
        traction = np.concatenate([held.traction for held in self._held(at)])
        fx = -s.pressure * at.sine - s.drag * rates.vx - s.mass * rates.ax
        fy = s.pressure * at.cosine - traction - s.drag * rates.vy - s.mass * rates.ay
        power = Tx.T @ (at.weights * fx) + Ty.T @ (at.weights * fy) - self._bending(u)[1]
        if not len(self.kinks):
            return power, Tx, Ty, at, (fx, fy)
        by_kink, _ = self._kinks_changed(at, u[self.multipliers])
        power = power + by_kink.T @ u[self.multipliers]
        return np.append(power, self._heights(at) - self.kinks), Tx, Ty, at, (fx, fy)

    def _bending(self, u: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the energy of bending and its gradient."""
        w, lengths = u[self.fields], u[self.lengths]
        moments = self.basis.bending @ w
        energies = 0.5 * (moments @ w)
        gradient = np.append((moments / lengths[:, None]).sum(axis=0), -energies / lengths**2)
        return float((energies / lengths).sum()), gradient

    def _bending_changed(self, u: np.ndarray) -> np.ndarray:
        w, lengths, stop = u[self.fields], u[self.lengths], self.lengths.stop
        moments = self.basis.bending @ w
        changed = np.zeros((stop, stop))
        changed[self.fields, self.fields] = np.tensordot(1.0 / lengths, self.basis.bending, 1)
        changed[self.lengths, self.fields] = -moments / lengths[:, None] ** 2
        changed[self.fields, self.lengths] = changed[self.lengths, self.fields].T
        changed[self.lengths, self.lengths] = np.diag(moments @ w / lengths**3)
        return changed

    def _heights_changed(self, at: Shapes) -> np.ndarray:
        """Return how the heights at fixed fractions of the phases change with the unknowns."""
        value, outward = self.basis.tables[0], self.basis.outward
        return np.hstack([-at.inward @ (at.cosine[:, None] * value), -(outward @ at.sine).T])

    def _virtual_changed(self, at: Shapes, gx: np.ndarray, gy: np.ndarray) -> np.ndarray:
        """Return how the virtual power of given forces at the points changes with the unknowns."""
        value, outward, stop = self.basis.tables[0], self.basis.outward, self.lengths.stop
        hx, hy = at.inward.T @ gx, at.inward.T @ gy
        per_x, per_y = gx @ outward, gy @ outward  # (count, points)
        changed = np.zeros((stop, stop))
        changed[self.fields, self.fields] = value.T @ ((hx * at.cosine + hy * at.sine)[:, None] * value)
        turned = per_x * at.sine - per_y * at.cosine
        changed[self.fields, self.lengths] = value.T @ turned.T
        here = (gx * at.sine - gy * at.cosine) * self._mesh.T
        changed[self.lengths, self.fields] = (turned + here) @ value
        return changed

    def _acceleration_by_state(
        self, at: Shapes, u: np.ndarray, z: np.ndarray, a: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        (value, slope), outward = self.basis.tables, self.basis.outward
        phi, spread = value @ z[self.fields], z[self.lengths]
        turning, st = self.basis.reaching(spread), self._mesh @ spread
        twice = 2.0 * phi - at.curvature * st
        x, y = self._carriers_changed(at, a)
        bent = np.hstack(
            [
                slope / self._spread(u[self.lengths])[:, None],
                -(at.curvature / self._spread(u[self.lengths]))[:, None] * (self.basis.whole.T > 0.0),
            ]
        )

        def turned(first: np.ndarray, second: np.ndarray) -> np.ndarray:
            matrix: np.ndarray = 2.0 * turning * (first * phi) + at.inward * (second * phi**2)
            matrix[np.diag_indices_from(matrix)] += first * st * twice
            return matrix @ value

        x[:, self.fields] += turned(at.cosine, -at.sine)
        y[:, self.fields] += turned(at.sine, at.cosine)
        x[:, self.lengths] += (outward @ (at.cosine * phi**2)).T
        y[:, self.lengths] += (outward @ (at.sine * phi**2)).T
        return x - (at.sine * st**2)[:, None] * bent, y + (at.cosine * st**2)[:, None] * bent

    def _acceleration_by_rate(self, at: Shapes, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, outward = self.basis.tables[0], self.basis.outward
        phi, spread = value @ z[self.fields], z[self.lengths]
        turning, st = self.basis.reaching(spread), self._mesh @ spread

        def parts(first: np.ndarray, second: np.ndarray) -> np.ndarray:
            """Of 2 turning first phi + inward second phi^2 + first st (2 phi - theta' st)."""
            matrix = 2.0 * (turning * first + at.inward * (second * phi))
            matrix[np.diag_indices_from(matrix)] += 2.0 * first * st
            lengthened = 2.0 * (outward @ (first * phi)).T
            lengthened = lengthened + (first * 2.0 * (phi - at.curvature * st))[:, None] * self._mesh
            return np.hstack([matrix @ value, lengthened])

        return parts(at.sine, at.cosine), parts(-at.cosine, at.sine)

    def heights(self, u: np.ndarray) -> np.ndarray:
        """Return the heights of the ends of the phases, which the kinks hold."""
        return self._heights(self.shapes(u))

    def kinks_by(self, u: np.ndarray) -> np.ndarray:
        """Return the derivatives of `heights` by the unknowns without multipliers."""
        return self._kinks_changed(self.shapes(u), np.zeros(len(self.kinks)))[0]

    def _heights(self, at: Shapes) -> np.ndarray:
        """Return the heights at the starts of the phases but the first."""
        falls = (self.basis.whole > 0.0) @ (at.sine * at.weights)
        heights: np.ndarray = -np.cumsum(falls[::-1])[::-1]
        return heights[1:]

    def _kinks_changed(self, at: Shapes, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of `_heights`, and their derivatives times the multipliers."""
        value, whole, stop = self.basis.tables[0], self.basis.whole, self.lengths.stop
        inside = np.triu(np.ones((len(self.phases),) * 2))[1:]  # phases from a kink to the front
        own = (whole > 0.0) * at.weights
        changed = np.hstack([-inside @ (own * at.cosine) @ value, -inside * (whole @ at.sine)])
        pressed = multipliers @ inside
        curved = np.zeros((stop, stop))
        curved[self.fields, self.fields] = value.T @ ((pressed @ own * at.sine)[:, None] * value)
        curved[self.lengths, self.fields] = -pressed[:, None] * ((whole * at.cosine) @ value)
        curved[self.fields, self.lengths] = curved[self.lengths, self.fields].T
        return changed, curved

    def felt(self, change: np.ndarray) -> np.ndarray:
        """Return what of changes of the unknowns, (..., size), counts as error: angles and lengths."""
        return np.concatenate(
            [change[..., self.fields] @ self.basis.tables[0].T, change[..., self.lengths]], -1
        )

    # -- what is read off a state

    def read(self, u: np.ndarray, z: np.ndarray) -> Reading:
        """Return what a state with these rates holds, and by how much the identity is missed."""
        s, at, tip = self.setting, self.shapes(u), self.tip(u)
        rates = self.rates(at, u, z, self.second(u, z) if s.mass else np.zeros_like(z))
        opened = np.concatenate([held.work for held in self._held(at)]) / s.ratio
        drive = (
            s.pressure * float(tip.y)
            - float(self.pieces[0](np.atleast_1d(s.ratio * tip.y)).work[0]) / s.ratio
        )
        resisting_x = s.mass * rates.ax + s.drag * rates.vx
        resisting_y = s.mass * rates.ay + s.drag * rates.vy
        speeds = rates.vx**2 + rates.vy**2
        return Reading(
            front=float(u[self.lengths].sum()),
            tip=tip,
            kinetic=0.5 * s.mass * float(at.weights @ speeds),
            bending=self._bending(u)[0],
            separation=float(at.weights @ opened),
            identity=drive - float(at.weights @ (resisting_x * (1.0 - at.cosine) - resisting_y * at.sine)),
            speed=math.sqrt(float(speeds.max())),
        )

    def powers(self, u: np.ndarray, z: np.ndarray) -> tuple[float, float]:
        """Return the power of the pressure, and what drag takes of it."""
        at = self.shapes(u)
        vx, vy = self._carried(at, z)
        pressing = at.weights @ (vy * at.cosine - vx * at.sine)
        return self.setting.pressure * float(pressing), self.setting.drag * float(
            at.weights @ (vx**2 + vy**2)
        )

    def outline(self, u: np.ndarray, many: int, z: np.ndarray | None = None) -> np.ndarray:
        """Return s, theta, x, y and the spin at so many Chebyshev points of every phase, (phases, n, 5)."""
        xi, value, slope, to_end = self.basis.looked(many)
        at, lengths, shape = self.shapes(u), u[self.lengths], (len(self.phases), many)
        ends = np.cumsum(lengths)
        back = lengths[:, None] * (1.0 - xi)
        falls = []
        for integrand in (at.cosine, at.sine):
            inside = lengths[:, None] * (integrand.reshape(len(lengths), -1) @ to_end.T)
            whole = (self.basis.whole > 0.0) @ (integrand * at.weights)
            falls.append(inside + (whole.sum() - np.cumsum(whole))[:, None])
        theta = (value @ u[self.fields]).reshape(shape)
        spin = np.zeros(shape)
        if z is not None:
            moved = np.cumsum(z[self.lengths])[:, None] - z[self.lengths][:, None] * (1.0 - xi)
            bent = (slope @ u[self.fields]).reshape(shape) / lengths[:, None]
            spin = (value @ z[self.fields]).reshape(shape) - bent * moved
        return np.stack([ends[:, None] - back, theta, ends[-1] - falls[0], -falls[1], spin], axis=-1)

    def rate(self, u: np.ndarray) -> np.ndarray:
        """Return the rates of the unknowns of a rod without mass."""
        return self._driven(u, np.zeros(self.size), self.setting.drag, np.zeros(len(self.kinks)))

    def second(self, u: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the rates of the rates of a rod with mass."""
        shapes, moving = self.shapes(u), z[: self.lengths.stop]
        bends = [moving @ self._kinks_changed(shapes, one)[1] @ moving for one in np.eye(len(self.kinks))]
        return self._driven(u, z, self.setting.mass, np.array(bends))

    def _driven(self, u: np.ndarray, z: np.ndarray, resists: float, bends: np.ndarray) -> np.ndarray:
        """Return what is driven against drag or mass by all the rest, with the kinks at their heights."""
        moving, kinks = slice(0, self.lengths.stop), self.multipliers
        unpressed = np.append(u[moving], np.zeros(len(self.kinks)))
        residual, Tx, Ty, at, _ = self._virtual(unpressed, z, np.zeros(self.size))
        matrix = np.zeros((self.size, self.size))
        matrix[moving, moving] = resists * (Tx.T * at.weights @ Tx + Ty.T * at.weights @ Ty)
        held = self._kinks_changed(at, np.zeros(len(self.kinks)))[0]
        matrix[moving, kinks], matrix[kinks, moving] = -held.T, held
        driven: np.ndarray = np.linalg.solve(matrix, np.append(residual[moving], -bends))
        driven[kinks] = 0.0
        return driven

    def tip(self, u: np.ndarray) -> TipPath:
        """Return height, place and angle of the tip."""
        at = self.shapes(u)
        return TipPath(-at.weights @ at.sine, u[self.lengths].sum() - at.weights @ at.cosine, u[0])
