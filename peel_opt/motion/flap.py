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

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .basis import Basis, basis
from .run import Setting
from .tractions import Traction
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
    """Front, tip and energies of moving states, what is missed of the identity, and their greatest speeds."""

    front: np.ndarray
    tip: TipPath
    kinetic: np.ndarray
    bending: np.ndarray
    separation: np.ndarray
    identity: np.ndarray
    speed: np.ndarray


def _on(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply each matrix to its vector."""
    found: np.ndarray = (matrices @ vectors[..., None])[..., 0]
    return found


def _adjoint(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply the transpose of each matrix to its vector."""
    found: np.ndarray = (vectors[..., None, :] @ matrices)[..., 0, :]
    return found


def _turned(matrices: np.ndarray) -> np.ndarray:
    return np.swapaxes(matrices, -1, -2)


def _columns(values: np.ndarray) -> np.ndarray:
    """Return numbers at the points as what scales the rows of a matrix."""
    return values[..., :, None]


@dataclass(frozen=True, eq=False)
class Flap:
    """The detached part of a rod under a setting, in phases of the law from the tip on.

    Its unknowns are the coefficients of theta, the lengths of the phases and a multiplier for every kink.
    They may have axes before that of their number: all states are then looked at together.

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
        theta, lengths = u[..., self.fields] @ value.T, u[..., self.lengths]
        inward = self.basis.reaching(lengths)
        sine, cosine = np.sin(theta), np.cos(theta)
        curvature = u[..., self.fields] @ slope.T / self._spread(lengths)
        x, y = lengths.sum(axis=-1, keepdims=True) - _on(inward, cosine), -_on(inward, sine)
        return Shapes(theta, curvature, sine, cosine, x, y, lengths @ self.basis.whole, inward)

    def rates(self, at: Shapes, z: np.ndarray, a: np.ndarray) -> Rates:
        """Return velocities and accelerations for rates and rates of rates of the unknowns."""
        vx, vy = self._carried(at, z)
        phi, st = self._moved(z)
        spin = phi - at.curvature * st
        if not self.setting.mass:
            nothing = np.zeros_like(vx)
            return Rates(vx, vy, nothing, nothing, spin)
        turning = self.basis.reaching(z[..., self.lengths])
        ax, ay = self._carried(at, a)
        ax = (
            ax
            + 2.0 * _on(turning, at.sine * phi)
            + _on(at.inward, at.cosine * phi**2)
            + at.sine * st * (phi + spin)
        )
        ay = (
            ay
            - 2.0 * _on(turning, at.cosine * phi)
            + _on(at.inward, at.sine * phi**2)
            - at.cosine * st * (phi + spin)
        )
        return Rates(vx, vy, ax, ay, spin)

    def _spread(self, per_phase: np.ndarray) -> np.ndarray:
        """Repeat a number of each phase at all its points."""
        return np.repeat(per_phase, len(self.basis.grid.xi), axis=-1)

    @cached_property
    def _mesh(self) -> np.ndarray:
        """How the s of each point moves with each length, (points, count)."""
        mesh: np.ndarray = 1.0 - self.basis.outward.sum(axis=2).T
        return mesh

    def _moved(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how theta at the points, and their s, change with the unknowns."""
        return z[..., self.fields] @ self.basis.tables[0].T, z[..., self.lengths] @ self._mesh.T

    def _carried(self, at: Shapes, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how points of the rod move when the unknowns change by ``z``."""
        (phi, st), spread = self._moved(z), z[..., self.lengths]
        outward = self.basis.reaching(spread)
        x = spread.sum(axis=-1, keepdims=True) + _on(at.inward, at.sine * phi) - _on(outward, at.cosine)
        y = -_on(at.inward, at.cosine * phi) - _on(outward, at.sine)
        return x - at.cosine * st, y - at.sine * st

    def _carriers(self, at: Shapes) -> np.ndarray:
        """Return the matrices of `_carried`, x over y, (2 points, unknowns without multipliers)."""
        value, per_length = self.basis.tables[0], self.basis.per_length
        points, stop = value.shape[0], self.lengths.stop
        both = np.empty((*at.theta.shape[:-1], 2 * points, stop))
        x, y = both[..., :points, :], both[..., points:, :]
        x[..., self.fields] = at.inward @ (_columns(at.sine) * value)
        y[..., self.fields] = -at.inward @ (_columns(at.cosine) * value)
        x[..., self.lengths] = 1.0 - per_length(at.cosine) - _columns(at.cosine) * self._mesh
        y[..., self.lengths] = -per_length(at.sine) - _columns(at.sine) * self._mesh
        return both

    def _carriers_changed(self, at: Shapes, z: np.ndarray) -> np.ndarray:
        """Return the derivatives of `_carried` by the unknowns, as `_carriers` does."""
        value, per_length = self.basis.tables[0], self.basis.per_length
        (phi, st), turning = self._moved(z), self.basis.reaching(z[..., self.lengths])
        points, stop = value.shape[0], self.lengths.stop
        both = np.empty((*at.theta.shape[:-1], 2 * points, stop))
        for here, first, second in (
            (both[..., :points, :], at.cosine, at.sine),
            (both[..., points:, :], at.sine, -at.cosine),
        ):
            # By theta: of inward (first phi), of turning second, and of what stands at the points.
            matrix = at.inward * (first * phi)[..., None, :] + turning * second[..., None, :]
            self._add_diagonal(matrix, second * st)
            here[..., self.fields] = matrix @ value
            here[..., self.lengths] = per_length(second * phi)
        return both

    @staticmethod
    def _add_diagonal(matrices: np.ndarray, values: np.ndarray) -> None:
        along = np.arange(matrices.shape[-1])
        matrices[..., along, along] += values

    # -- the principle of virtual power

    def balance(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> Balance:
        """Return what must vanish and its derivatives.

        Parameters
        ----------
        u, z, a : ndarray, shape (..., size)
            Unknowns, their rates and the rates of these; multipliers count in ``u`` only.
        """
        at, s, value = self.shapes(u), self.setting, self.basis.tables[0]
        forces, slope = self._forces(at, z, a)
        moving, points = slice(0, self.lengths.stop), value.shape[0]
        by_state, by_rate, by_second = (np.zeros((*u.shape, self.size)) for _ in range(3))
        w = _columns(np.concatenate([at.weights, at.weights], axis=-1))
        # What acts on a point, as the shape changes under it.
        acting = -s.drag * self._carriers_changed(at, z)
        acting[..., points:, :] -= _columns(s.ratio * slope) * self._heights_changed(at)
        acting[..., :points, self.fields] -= s.pressure * _columns(at.cosine) * value
        acting[..., points:, self.fields] -= s.pressure * _columns(at.sine) * value
        carriers = self._carriers(at)
        weighted = _turned(w * carriers)
        resisted = weighted @ carriers
        if s.mass:
            acting -= s.mass * self._acceleration_by_state(at, u, z, a)
            by_rate[..., moving, moving] -= s.mass * weighted @ self._acceleration_by_rate(at, z)
            by_second[..., moving, moving] = -s.mass * resisted
        by_rate[..., moving, moving] -= s.drag * resisted
        # The weights go with the lengths.
        acting[..., self.lengths] += _columns(np.concatenate(forces, axis=-1)) * self._lengthened / w
        pressing = [at.weights * force for force in forces]
        by_state[..., moving, moving] = (
            weighted @ acting + self._virtual_changed(at, *pressing) - self._bending_changed(u)
        )
        if len(self.kinks):
            by_kink = self._kinks_by(at)
            by_state[..., moving, moving] += self._kinks_curved(at, u[..., self.multipliers])
            by_state[..., moving, self.multipliers] = _turned(by_kink)
            by_state[..., self.multipliers, moving] = by_kink
        return Balance(self._virtual(u, at, *pressing), by_state, by_rate, by_second)

    def residual(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return what must vanish alone."""
        at = self.shapes(u)
        return self._virtual(u, at, *(at.weights * force for force in self._forces(at, z, a)[0]))

    @cached_property
    def _lengthened(self) -> np.ndarray:
        """The weights of x and y, by the lengths, (2 points, count)."""
        return np.tile(self.basis.whole.T, (2, 1))

    def _pulled(self, at: Shapes) -> tuple[np.ndarray, np.ndarray]:
        """Return traction and slope of the bond at the points."""
        phases = (len(self.pieces), -1)
        heights = (self.setting.ratio * at.y).reshape(*at.y.shape[:-1], *phases)
        pulled = [piece.pull(heights[..., j, :]) for j, piece in enumerate(self.pieces)]
        traction, slope = (np.concatenate(parts, axis=-1) for parts in zip(*pulled, strict=True))
        return traction, slope

    def _forces(
        self, at: Shapes, z: np.ndarray, a: np.ndarray
    ) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        """Return what acts on the points, motion included, and the slope of the traction in it."""
        s, rates = self.setting, self.rates(at, z, a)
        traction, slope = self._pulled(at)
        fx = -s.pressure * at.sine - s.drag * rates.vx - s.mass * rates.ax
        fy = s.pressure * at.cosine - traction - s.drag * rates.vy - s.mass * rates.ay
        return (fx, fy), slope

    def _virtual(self, u: np.ndarray, at: Shapes, gx: np.ndarray, gy: np.ndarray) -> np.ndarray:
        """Return the virtual power of forces at the points, of bending and of what holds the kinks."""
        turned = at.sine * _adjoint(at.inward, gx) - at.cosine * _adjoint(at.inward, gy)
        per_length = _on(self.basis.from_lengths(gx), at.cosine) + _on(self.basis.from_lengths(gy), at.sine)
        lengthened = gx.sum(axis=-1, keepdims=True) - per_length
        lengthened = lengthened - (gx * at.cosine + gy * at.sine) @ self._mesh
        power = np.concatenate([turned @ self.basis.tables[0], lengthened], axis=-1) - self._bending(u)[1]
        if not len(self.kinks):
            return power
        held = _adjoint(self._kinks_by(at), u[..., self.multipliers])
        return np.concatenate([power + held, self._heights(at) - self.kinks], axis=-1)

    def _bending(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the energy of bending and its gradient."""
        lengths = u[..., self.lengths]
        moments = self.basis.bent(u[..., self.fields])
        energies = 0.5 * _on(moments, u[..., self.fields])
        by_fields = (moments / _columns(lengths)).sum(axis=-2)
        gradient = np.concatenate([by_fields, -energies / lengths**2], axis=-1)
        return (energies / lengths).sum(axis=-1), gradient

    def _bending_changed(self, u: np.ndarray) -> np.ndarray:
        w, lengths, stop = u[..., self.fields], u[..., self.lengths], self.lengths.stop
        moments, size = self.basis.bent(w), self.basis.size
        changed = np.zeros((*u.shape[:-1], stop, stop))
        stiffness = (1.0 / lengths) @ self.basis.bending.reshape(len(self.phases), -1)
        changed[..., self.fields, self.fields] = stiffness.reshape(*u.shape[:-1], size, size)
        changed[..., self.lengths, self.fields] = -moments / _columns(lengths) ** 2
        changed[..., self.fields, self.lengths] = _turned(changed[..., self.lengths, self.fields])
        self._add_diagonal(changed[..., self.lengths, self.lengths], _on(moments, w) / lengths**3)
        return changed

    def _heights_changed(self, at: Shapes) -> np.ndarray:
        """Return how the heights at fixed fractions of the phases change with the unknowns."""
        value = self.basis.tables[0]
        by_fields = -at.inward @ (_columns(at.cosine) * value)
        return np.concatenate([by_fields, -self.basis.per_length(at.sine)], axis=-1)

    def _virtual_changed(self, at: Shapes, gx: np.ndarray, gy: np.ndarray) -> np.ndarray:
        """Return how the virtual power of given forces at the points changes with the unknowns."""
        value, stop = self.basis.tables[0], self.lengths.stop
        hx, hy = _adjoint(at.inward, gx), _adjoint(at.inward, gy)
        changed = np.zeros((*gx.shape[:-1], stop, stop))
        bent = hx * at.cosine + hy * at.sine
        changed[..., self.fields, self.fields] = value.T @ (_columns(bent) * value)
        sine, cosine = at.sine[..., None, :], at.cosine[..., None, :]
        turned = self.basis.from_lengths(gx) * sine - self.basis.from_lengths(gy) * cosine
        changed[..., self.fields, self.lengths] = value.T @ _turned(turned)
        here = (gx * at.sine - gy * at.cosine)[..., None, :] * self._mesh.T
        changed[..., self.lengths, self.fields] = (turned + here) @ value
        return changed

    def _acceleration_by_state(self, at: Shapes, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> np.ndarray:
        (value, slope), per_length = self.basis.tables, self.basis.per_length
        (phi, st), turning = self._moved(z), self.basis.reaching(z[..., self.lengths])
        twice = 2.0 * phi - at.curvature * st
        points, lengths = value.shape[0], _columns(self._spread(u[..., self.lengths]))
        changed = self._carriers_changed(at, a)
        own = self.basis.whole.T > 0.0
        bent = np.concatenate([slope / lengths, -_columns(at.curvature) / lengths * own], axis=-1)
        for here, first, second in (
            (changed[..., :points, :], at.cosine, at.sine),
            (changed[..., points:, :], at.sine, -at.cosine),
        ):
            matrix = 2.0 * turning * (first * phi)[..., None, :]
            matrix -= at.inward * (second * phi**2)[..., None, :]
            self._add_diagonal(matrix, first * st * twice)
            here[..., self.fields] += matrix @ value
            here[..., self.lengths] += per_length(first * phi**2)
            here[...] -= _columns(second * st**2) * bent
        return changed

    def _acceleration_by_rate(self, at: Shapes, z: np.ndarray) -> np.ndarray:
        value, per_length = self.basis.tables[0], self.basis.per_length
        (phi, st), turning = self._moved(z), self.basis.reaching(z[..., self.lengths])
        points = value.shape[0]
        both = np.empty((*at.theta.shape[:-1], 2 * points, self.lengths.stop))
        for here, first, second in (
            (both[..., :points, :], at.sine, at.cosine),
            (both[..., points:, :], -at.cosine, at.sine),
        ):
            # Of 2 turning first phi + inward second phi^2 + first st (2 phi - theta' st).
            matrix = 2.0 * (turning * first[..., None, :] + at.inward * (second * phi)[..., None, :])
            self._add_diagonal(matrix, 2.0 * first * st)
            here[..., self.fields] = matrix @ value
            here[..., self.lengths] = 2.0 * per_length(first * phi)
            here[..., self.lengths] += _columns(first * 2.0 * (phi - at.curvature * st)) * self._mesh
        return both

    def heights(self, u: np.ndarray) -> np.ndarray:
        """Return the heights of the ends of the phases, which the kinks hold."""
        return self._heights(self.shapes(u))

    def kinks_by(self, u: np.ndarray) -> np.ndarray:
        """Return the derivatives of `heights` by the unknowns without multipliers."""
        return self._kinks_by(self.shapes(u))

    def _heights(self, at: Shapes) -> np.ndarray:
        """Return the heights at the starts of the phases but the first."""
        falls = (at.sine * at.weights) @ (self.basis.whole > 0.0).T
        heights: np.ndarray = -np.cumsum(falls[..., ::-1], axis=-1)[..., ::-1]
        return heights[..., 1:]

    @cached_property
    def _inside(self) -> np.ndarray:
        """Phases from each kink to the front, (kinks, count)."""
        return np.triu(np.ones((len(self.phases),) * 2))[1:]

    def _own(self, at: Shapes) -> np.ndarray:
        """Return the weights of each phase, (count, points)."""
        own: np.ndarray = (self.basis.whole > 0.0) * at.weights[..., None, :]
        return own

    def _kinks_by(self, at: Shapes) -> np.ndarray:
        """Return the derivatives of `_heights`, (kinks, unknowns without multipliers)."""
        by_fields = (self._inside @ (self._own(at) * at.cosine[..., None, :])) @ self.basis.tables[0]
        by_lengths = self._inside * (at.sine @ self.basis.whole.T)[..., None, :]
        return -np.concatenate([by_fields, by_lengths], axis=-1)

    def _kinks_curved(self, at: Shapes, multipliers: np.ndarray) -> np.ndarray:
        """Return the derivatives of those times the multipliers."""
        value, whole, stop = self.basis.tables[0], self.basis.whole, self.lengths.stop
        pressed = multipliers @ self._inside
        curved = np.zeros((*at.theta.shape[:-1], stop, stop))
        bent = _adjoint(self._own(at), pressed) * at.sine
        curved[..., self.fields, self.fields] = value.T @ (_columns(bent) * value)
        curved[..., self.lengths, self.fields] = -_columns(pressed) * (
            (whole * at.cosine[..., None, :]) @ value
        )
        curved[..., self.fields, self.lengths] = _turned(curved[..., self.lengths, self.fields])
        return curved

    def felt(self, change: np.ndarray) -> np.ndarray:
        """Return what of changes of the unknowns, (..., size), counts as error: angles and lengths."""
        return np.concatenate(
            [change[..., self.fields] @ self.basis.tables[0].T, change[..., self.lengths]], -1
        )

    # -- what is read off a state

    def read(self, u: np.ndarray, z: np.ndarray) -> Reading:
        """Return what states with these rates hold, and by how much the identity is missed."""
        s, at, tip = self.setting, self.shapes(u), self.tip(u)
        rates = self.rates(at, z, self.second(u, z) if s.mass else np.zeros_like(z))
        heights = (s.ratio * at.y).reshape(*at.y.shape[:-1], len(self.pieces), -1)
        opened = [piece(heights[..., j, :]).work for j, piece in enumerate(self.pieces)]
        drive = s.pressure * tip.y - self.pieces[0](np.asarray(s.ratio * tip.y)).work / s.ratio
        resisting_x = s.mass * rates.ax + s.drag * rates.vx
        resisting_y = s.mass * rates.ay + s.drag * rates.vy
        speeds = rates.vx**2 + rates.vy**2
        resisted = resisting_x * (1.0 - at.cosine) - resisting_y * at.sine
        return Reading(
            front=u[..., self.lengths].sum(axis=-1),
            tip=tip,
            kinetic=0.5 * s.mass * (at.weights * speeds).sum(axis=-1),
            bending=self._bending(u)[0],
            separation=(at.weights * np.concatenate(opened, axis=-1)).sum(axis=-1) / s.ratio,
            identity=drive - (at.weights * resisted).sum(axis=-1),
            speed=np.sqrt(speeds.max(axis=-1)),
        )

    def powers(self, u: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the power of the pressure, and what drag takes of it, (..., 2)."""
        at, s = self.shapes(u), self.setting
        vx, vy = self._carried(at, z)
        pressing = s.pressure * (at.weights * (vy * at.cosine - vx * at.sine)).sum(axis=-1)
        return np.stack([pressing, s.drag * (at.weights * (vx**2 + vy**2)).sum(axis=-1)], axis=-1)

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
        return self._driven(u, np.zeros_like(u), self.setting.drag, np.zeros(len(self.kinks)))

    def second(self, u: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the rates of the rates of a rod with mass."""
        at, moving = self.shapes(u), z[..., : self.lengths.stop]
        bends = [
            (moving * _on(self._kinks_curved(at, one), moving)).sum(axis=-1)
            for one in np.eye(len(self.kinks))
        ]
        return self._driven(u, z, self.setting.mass, np.stack(bends, axis=-1) if bends else np.zeros(0))

    def _driven(self, u: np.ndarray, z: np.ndarray, resists: float, bends: np.ndarray) -> np.ndarray:
        """Return what is driven against drag or mass by all the rest, with the kinks at their heights."""
        moving, kinks = slice(0, self.lengths.stop), self.multipliers
        unpressed = u.copy()
        unpressed[..., kinks] = 0.0
        residual, at = self.residual(unpressed, z, np.zeros_like(u)), self.shapes(u)
        carriers, held = self._carriers(at), self._kinks_by(at)
        w = _columns(np.concatenate([at.weights, at.weights], axis=-1))
        matrix = np.zeros((*u.shape, self.size))
        matrix[..., moving, moving] = resists * _turned(w * carriers) @ carriers
        matrix[..., moving, kinks], matrix[..., kinks, moving] = -_turned(held), held
        residual[..., kinks] = -bends
        driven: np.ndarray = np.linalg.solve(matrix, residual[..., None])[..., 0]
        driven[..., kinks] = 0.0
        return driven

    def tip(self, u: np.ndarray) -> TipPath:
        """Return height, place and angle of the tip."""
        at = self.shapes(u)
        fallen, reached = ((at.weights * part).sum(axis=-1) for part in (at.sine, at.cosine))
        return TipPath(-fallen, u[..., self.lengths].sum(axis=-1) - reached, u[..., 0])
