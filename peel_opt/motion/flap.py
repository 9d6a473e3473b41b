"""The detached part in motion: theta in piecewise polynomials between tip, kinks of the bond and front.

Material points at which a load or the bond ends part the polynomials as well.

theta counts from where the rod lay: on a wall of curvature kw its direction is phi = theta + kw s.  A point
at a fixed fraction of its phase is at the front less int (cos phi, sin phi), from there back, and belongs to
another s as the lengths of the phases change: a material point moves with v = r_t - t s_t.  The principle of
virtual power then reads, for every motion the polynomials can make,

    int (f + f_b - c v - rho v_t) . delta r ds + F . delta r(0) + M delta theta(0) = delta U,

which holds with a front that runs, because theta' = 0 at it: the bond is rigid up to T0, so that the
front is where an obstacle ends, and nothing is released there.  theta = theta' = 0 at the front are
built in; what theta' is at the tip is natural.  Where two phases meet, the kink of the traction is held to
its height, or the material point to its s, by a multiplier, which tends to zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np

from .acting import Acted, Past
from .arc import Above, Arc
from .basis import Basis, basis
from .run import Setting
from .tractions import NOTHING, Traction
from .trajectory import TipPath


class Phase(NamedTuple):
    """A stretch of the rod on which everything is smooth.

    Parameters
    ----------
    piece : int or None
        Of the law; None where nothing was ever glued.
    past : frozenset of str
        The material points between it and the tip.
    """

    piece: int | None
    past: Past = frozenset()


class Balance(NamedTuple):
    """Virtual power of every unknown, and its derivatives by these, their rates and those of the rates."""

    residual: np.ndarray
    by_state: np.ndarray
    by_rate: np.ndarray
    by_second: np.ndarray


class Shapes(NamedTuple):
    """Direction, curvature and place at the Gauss points, and what integrates over them.

    ``ahead`` is the direction of the wall at the front, (cos, sin) with one more axis for the points.
    """

    phi: np.ndarray
    curvature: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray
    x: np.ndarray
    y: np.ndarray
    s: np.ndarray
    sbar: np.ndarray
    weights: np.ndarray
    inward: np.ndarray
    ahead: tuple[np.ndarray, np.ndarray]


class Bonded(NamedTuple):
    """Where the points are above the wall, and the traction there with its slope by the gap."""

    above: Above
    held: tuple[np.ndarray, np.ndarray]


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

    Its unknowns are the coefficients of theta, the lengths of the phases and a multiplier for every place
    where two of them meet.  They may have axes before that of their number: all states are then looked at
    together.

    Parameters
    ----------
    setting : Setting
    phases : tuple of Phase
        From the tip on.
    degrees : tuple of int
        Of the polynomials of each phase.
    """

    setting: Setting
    phases: tuple[Phase, ...]
    degrees: tuple[int, ...]

    @cached_property
    def basis(self) -> Basis:
        """Its polynomials."""
        return basis(self.degrees)

    @cached_property
    def pieces(self) -> list[Traction]:
        """What the bond holds in each phase."""
        pieces = self.setting.law.pieces
        return [NOTHING if phase.piece is None else Traction(pieces[phase.piece]) for phase in self.phases]

    @cached_property
    def arc(self) -> Arc:
        """The wall."""
        return Arc(self.setting.loads.wall_curvature)

    @cached_property
    def first_bonded(self) -> int:
        """The phase nearest to the tip that was glued."""
        return next(j for j, phase in enumerate(self.phases) if phase.piece is not None)

    @cached_property
    def at_points(self) -> np.ndarray:
        """Where one phase ends and the next begins: whether at a material point, (count - 1,)."""
        return np.array([before.past != after.past for before, after in pairwise(self.phases)], bool)

    @cached_property
    def switches(self) -> np.ndarray:
        """What is held there, over eta: the s of a material point, or else the height of a kink."""
        points, kinks = dict(self.setting.loads.breaks), self.setting.law.kinks
        held = []
        for before, after in pairwise(self.phases):
            if names := after.past - before.past:
                held.append(max(points[name] for name in names))
            else:
                assert before.piece is not None
                assert after.piece is not None
                held.append(kinks[min(before.piece, after.piece)] / self.setting.ratio)
        return np.array(held)

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
        lengths, kw = u[..., self.lengths], self.arc.curvature
        phi, s = self._moved(u)
        inward, sbar = self.basis.reaching(lengths), lengths.sum(axis=-1, keepdims=True)
        sine, cosine = np.sin(phi), np.cos(phi)
        curvature = u[..., self.fields] @ self.basis.tables[1].T / self._spread(lengths) + kw
        front_x, front_y = self.arc.at(sbar)
        x, y = front_x - _on(inward, cosine), front_y - _on(inward, sine)
        weights, ahead = lengths @ self.basis.whole, (np.cos(kw * sbar), np.sin(kw * sbar))
        return Shapes(phi, curvature, sine, cosine, x, y, s, sbar, weights, inward, ahead)

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
        swerve = self.arc.curvature * z[..., self.lengths].sum(axis=-1, keepdims=True) ** 2
        ax = (
            ax
            + 2.0 * _on(turning, at.sine * phi)
            + _on(at.inward, at.cosine * phi**2)
            + at.sine * st * (phi + spin)
            - at.ahead[1] * swerve
        )
        ay = (
            ay
            - 2.0 * _on(turning, at.cosine * phi)
            + _on(at.inward, at.sine * phi**2)
            - at.cosine * st * (phi + spin)
            + at.ahead[0] * swerve
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

    @cached_property
    def _turning(self) -> np.ndarray:
        """How the phi of each point turns with the unknowns, (points, unknowns without multipliers)."""
        return np.hstack([self.basis.tables[0], self.arc.curvature * self._mesh])

    def _moved(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how phi at the points, and their s, change with the unknowns."""
        return z[..., : self.lengths.stop] @ self._turning.T, z[..., self.lengths] @ self._mesh.T

    def _carried(self, at: Shapes, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how points of the rod move when the unknowns change by ``z``."""
        (phi, st), spread = self._moved(z), z[..., self.lengths]
        outward = self.basis.reaching(spread)
        runs = spread.sum(axis=-1, keepdims=True)
        x = runs * at.ahead[0] + _on(at.inward, at.sine * phi) - _on(outward, at.cosine)
        y = runs * at.ahead[1] - _on(at.inward, at.cosine * phi) - _on(outward, at.sine)
        return x - at.cosine * st, y - at.sine * st

    def _placed(self, at: Shapes) -> np.ndarray:
        """Return how points at fixed fractions of the phases change place with the unknowns.

        x over y, (2 points, unknowns without multipliers).
        """
        points, per_length = at.sine.shape[-1], self.basis.per_length
        both = np.empty((*at.phi.shape[:-1], 2 * points, self.lengths.stop))
        x, y = both[..., :points, :], both[..., points:, :]
        x[...] = at.inward @ (_columns(at.sine) * self._turning)
        y[...] = -at.inward @ (_columns(at.cosine) * self._turning)
        x[..., self.lengths] += at.ahead[0][..., None] - per_length(at.cosine)
        y[..., self.lengths] += at.ahead[1][..., None] - per_length(at.sine)
        return both

    def _carriers(self, at: Shapes, placed: np.ndarray) -> np.ndarray:
        """Return the matrices of `_carried`, as those of `_placed`."""
        both = placed.copy()
        both[..., self.lengths] -= _columns(np.concatenate([at.cosine, at.sine], axis=-1)) * self._mesh_twice
        return both

    @cached_property
    def _mesh_twice(self) -> np.ndarray:
        return np.tile(self._mesh, (2, 1))

    def _carriers_changed(self, at: Shapes, z: np.ndarray) -> np.ndarray:
        """Return the derivatives of `_carried` by the unknowns, as `_carriers` does."""
        (phi, st), turning = self._moved(z), self.basis.reaching(z[..., self.lengths])
        points = at.sine.shape[-1]
        both = np.empty((*at.phi.shape[:-1], 2 * points, self.lengths.stop))
        swerve = self.arc.curvature * z[..., self.lengths].sum(axis=-1)[..., None, None]
        for here, first, second, ahead in (
            (both[..., :points, :], at.cosine, at.sine, -at.ahead[1]),
            (both[..., points:, :], at.sine, -at.cosine, at.ahead[0]),
        ):
            # By phi: of inward (first phi), of turning second, and of what stands at the points.
            matrix = at.inward * (first * phi)[..., None, :] + turning * second[..., None, :]
            self._add_diagonal(matrix, second * st)
            here[...] = matrix @ self._turning
            here[..., self.lengths] += self.basis.per_length(second * phi) + swerve * ahead[..., None]
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
        at, s = self.shapes(u), self.setting
        acted, bond = self._acted(at), self._bond(at)
        forces = self._forces(at, acted, bond, z, a)
        moving = slice(0, self.lengths.stop)
        by_state, by_rate, by_second = (np.zeros((*u.shape, self.size)) for _ in range(3))
        w = _columns(np.concatenate([at.weights, at.weights], axis=-1))
        # What acts on a point, as the shape changes under it.
        acting, placed = -s.drag * self._carriers_changed(at, z), self._placed(at)
        self._add_bond_changed(acting, placed, bond)
        self._add_loads_changed(acting, placed, acted)
        carriers = self._carriers(at, placed)
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
        if len(self.switches):
            by_switch = self._switches_by(at)
            by_state[..., moving, moving] += self._switches_curved(at, u[..., self.multipliers])
            by_state[..., moving, self.multipliers] = _turned(by_switch)
            by_state[..., self.multipliers, moving] = by_switch
        return Balance(self._virtual(u, at, *pressing), by_state, by_rate, by_second)

    def residual(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return what must vanish alone."""
        at = self.shapes(u)
        forces = self._forces(at, self._acted(at), self._bond(at), z, a)
        return self._virtual(u, at, *(at.weights * force for force in forces))

    @cached_property
    def _lengthened(self) -> np.ndarray:
        """The weights of x and y, by the lengths, (2 points, count)."""
        return np.tile(self.basis.whole.T, (2, 1))

    @cached_property
    def _alike(self) -> list[tuple[Past, slice]]:
        """The points on which the loads are smooth, with what is past them."""
        each, found = len(self.basis.grid.xi), list[tuple[Past, slice]]()
        for past, phases in groupby(range(len(self.phases)), key=lambda j: self.phases[j].past):
            first, *others = phases
            found.append((past, slice(first * each, (first + len(others) + 1) * each)))
        return found

    def _acted(self, at: Shapes) -> Acted:
        """Return what the loads are at the points."""
        sbar = np.broadcast_to(at.sbar, at.s.shape)
        parts = [
            self.setting.loads.at(
                self.setting.pressure,
                at.phi[..., here],
                at.x[..., here],
                at.y[..., here],
                at.s[..., here],
                sbar[..., here],
                past,
            )
            for past, here in self._alike
        ]
        if len(parts) == 1:
            return parts[0]
        force, by_theta = (
            np.concatenate(each, axis=-1) for each in zip(*(part[:2] for part in parts), strict=True)
        )
        by_place = [part.by_place for part in parts if part.by_place is not None]
        return Acted(force, by_theta, np.concatenate(by_place, axis=-1) if by_place else None)

    def _add_loads_changed(self, acting: np.ndarray, placed: np.ndarray, acted: Acted) -> None:
        """Add what the loads change by, x over y, as the unknowns without multipliers do."""
        points = self._turning.shape[0]
        x, y = rows = slice(0, points), slice(points, 2 * points)
        for i, here in enumerate(rows):
            acting[..., here, :] += _columns(acted.by_theta[i]) * self._turning
            if acted.by_place is not None:
                by_x, by_y, by_s, by_sbar = (_columns(part[i]) for part in acted.by_place)
                acting[..., here, :] += by_x * placed[..., x, :] + by_y * placed[..., y, :]
                acting[..., here, self.lengths] += by_s * self._mesh + by_sbar

    def _add_bond_changed(self, acting: np.ndarray, placed: np.ndarray, bond: Bonded) -> None:
        """Add the same of what the bond holds."""
        (traction, slope), (_, nx, ny, turning) = bond.held, bond.above
        points = self._turning.shape[0]
        x, y = slice(0, points), slice(points, 2 * points)
        if not self.arc:
            acting[..., y, :] -= _columns(slope) * placed[..., y, :]
            return
        rises = _columns(nx) * placed[..., x, :] + _columns(ny) * placed[..., y, :]
        slides = _columns(ny) * placed[..., x, :] - _columns(nx) * placed[..., y, :]
        # The normal turns towards where a point comes from.
        acting[..., x, :] -= _columns(slope * nx) * rises - _columns(traction * turning * ny) * slides
        acting[..., y, :] -= _columns(slope * ny) * rises + _columns(traction * turning * nx) * slides

    def _bond(self, at: Shapes) -> Bonded:
        """Return what the bond holds at the points."""
        above, phases = self.arc.above(at.x, at.y), (len(self.pieces), -1)
        opened = (self.setting.ratio * above.gap).reshape(*above.gap.shape[:-1], *phases)
        pulled = [piece.pull(opened[..., j, :]) for j, piece in enumerate(self.pieces)]
        traction, slope = (np.concatenate(parts, axis=-1) for parts in zip(*pulled, strict=True))
        return Bonded(above, (traction, self.setting.ratio * slope))

    def _forces(
        self, at: Shapes, acted: Acted, bond: Bonded, z: np.ndarray, a: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return what acts on the points, motion included."""
        s, rates, traction = self.setting, self.rates(at, z, a), bond.held[0]
        fx = acted.force[0] - traction * bond.above.nx - s.drag * rates.vx - s.mass * rates.ax
        fy = acted.force[1] - traction * bond.above.ny - s.drag * rates.vy - s.mass * rates.ay
        return fx, fy

    def _virtual(self, u: np.ndarray, at: Shapes, gx: np.ndarray, gy: np.ndarray) -> np.ndarray:
        """Return the virtual power of forces at the points, of bending and of what holds the switches."""
        hx, hy = self._resultants(at, gx, gy)
        kx, ky = self._by_lengths(gx, gy)
        power = (at.sine * hx - at.cosine * hy) @ self._turning - self._bending(u)[1]
        power[..., self.lengths] += self._onward(at, gx, gy) - _on(kx, at.cosine) - _on(ky, at.sine)
        power[..., self.lengths] -= (gx * at.cosine + gy * at.sine) @ self._mesh
        power[..., 0] -= self.setting.loads.tip_curvature
        if not len(self.switches):
            return power
        held = _adjoint(self._switches_by(at), u[..., self.multipliers])
        return np.concatenate([power + held, self._switched(at) - self.switches], axis=-1)

    def _onward(self, at: Shapes, gx: np.ndarray, gy: np.ndarray, *, across: bool = False) -> np.ndarray:
        """Return all forces along, or across, the direction in which the front runs, (..., 1)."""
        Fx, Fy = self.setting.loads.tip_force
        whole_x, whole_y = gx.sum(axis=-1, keepdims=True) + Fx, gy.sum(axis=-1, keepdims=True) + Fy
        cosine, sine = at.ahead
        found: np.ndarray = whole_y * cosine - whole_x * sine if across else whole_x * cosine + whole_y * sine
        return found

    def _resultants(self, at: Shapes, gx: np.ndarray, gy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the sum of all forces between each point and the tip, times its weight."""
        Fx, Fy = self.setting.loads.tip_force
        return _adjoint(at.inward, gx) + Fx * at.weights, _adjoint(at.inward, gy) + Fy * at.weights

    def _by_lengths(self, gx: np.ndarray, gy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the same, times its weight per length of each phase, (count, points)."""
        (Fx, Fy), whole = self.setting.loads.tip_force, self.basis.whole
        return self.basis.from_lengths(gx) + Fx * whole, self.basis.from_lengths(gy) + Fy * whole

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

    def _virtual_changed(self, at: Shapes, gx: np.ndarray, gy: np.ndarray) -> np.ndarray:
        """Return how the virtual power of given forces at the points changes with the unknowns."""
        hx, hy = self._resultants(at, gx, gy)
        kx, ky = self._by_lengths(gx, gy)
        sine, cosine = at.sine[..., None, :], at.cosine[..., None, :]
        turned = (kx * sine - ky * cosine) @ self._turning
        here = ((gx * at.sine - gy * at.cosine)[..., None, :] * self._mesh.T) @ self._turning
        changed: np.ndarray = self._turning.T @ (_columns(hx * at.cosine + hy * at.sine) * self._turning)
        changed[..., self.lengths] += _turned(turned)
        changed[..., self.lengths, :] += turned + here
        swerved = self.arc.curvature * self._onward(at, gx, gy, across=True)
        changed[..., self.lengths, self.lengths] += swerved[..., None]
        return changed

    def _acceleration_by_state(self, at: Shapes, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> np.ndarray:
        slope, kw = self.basis.tables[1], self.arc.curvature
        (phi, st), turning = self._moved(z), self.basis.reaching(z[..., self.lengths])
        twice = 2.0 * phi - at.curvature * st
        points, lengths = slope.shape[0], _columns(self._spread(u[..., self.lengths]))
        changed = self._carriers_changed(at, a)
        own = self.basis.whole.T > 0.0
        bent = np.concatenate([slope / lengths, -_columns(at.curvature - kw) / lengths * own], axis=-1)
        swerve = (kw * z[..., self.lengths].sum(axis=-1)[..., None, None]) ** 2
        for here, first, second, ahead in (
            (changed[..., :points, :], at.cosine, at.sine, at.ahead[0]),
            (changed[..., points:, :], at.sine, -at.cosine, at.ahead[1]),
        ):
            matrix = 2.0 * turning * (first * phi)[..., None, :]
            matrix -= at.inward * (second * phi**2)[..., None, :]
            self._add_diagonal(matrix, first * st * twice)
            here[...] += matrix @ self._turning
            here[..., self.lengths] += self.basis.per_length(first * phi**2) - swerve * ahead[..., None]
            here[...] -= _columns(second * st**2) * bent
        return changed

    def _acceleration_by_rate(self, at: Shapes, z: np.ndarray) -> np.ndarray:
        (phi, st), turning = self._moved(z), self.basis.reaching(z[..., self.lengths])
        points = at.sine.shape[-1]
        both = np.empty((*at.phi.shape[:-1], 2 * points, self.lengths.stop))
        swerve = 2.0 * self.arc.curvature * z[..., self.lengths].sum(axis=-1)[..., None, None]
        for here, first, second, ahead in (
            (both[..., :points, :], at.sine, at.cosine, -at.ahead[1]),
            (both[..., points:, :], -at.cosine, at.sine, at.ahead[0]),
        ):
            # Of 2 turning first phi + inward second phi^2 + first st (2 phi - theta' st).
            matrix = 2.0 * (turning * first[..., None, :] + at.inward * (second * phi)[..., None, :])
            self._add_diagonal(matrix, 2.0 * first * st)
            here[...] = matrix @ self._turning
            here[..., self.lengths] += 2.0 * self.basis.per_length(first * phi) + swerve * ahead[..., None]
            here[..., self.lengths] += _columns(first * 2.0 * (phi - at.curvature * st)) * self._mesh
        return both

    def switched(self, u: np.ndarray) -> np.ndarray:
        """Return what should be `switches`."""
        return self._switched(self.shapes(u))

    def switches_by(self, u: np.ndarray) -> np.ndarray:
        """Return the derivatives of `switched` by the unknowns without multipliers."""
        return self._switches_by(self.shapes(u))

    def _switched(self, at: Shapes) -> np.ndarray:
        gaps = self._starts(at).gap[..., 1:]
        if not self.at_points.any():
            return gaps
        ends = np.cumsum(at.weights @ (self.basis.whole > 0.0).T, axis=-1)[..., :-1]
        return np.where(self.at_points, ends, gaps)

    def _starts(self, at: Shapes) -> Above:
        """Return where the phases begin above the wall."""
        return self.arc.above(*self._begin(at))

    def _begin(self, at: Shapes) -> tuple[np.ndarray, np.ndarray]:
        """Return the places x, y where the phases begin, each (..., count)."""
        own = (self.basis.whole > 0.0).T
        back = (np.cumsum(((part * at.weights) @ own)[..., ::-1], axis=-1) for part in (at.cosine, at.sine))
        x, y = (front - part[..., ::-1] for front, part in zip(self.arc.at(at.sbar), back, strict=True))
        return x, y

    @cached_property
    def _inside(self) -> np.ndarray:
        """Phases from each switch to the front, (count - 1, count)."""
        return np.triu(np.ones((len(self.phases),) * 2))[1:]

    def _own(self, at: Shapes) -> np.ndarray:
        """Return the weights of each phase, (count, points)."""
        own: np.ndarray = (self.basis.whole > 0.0) * at.weights[..., None, :]
        return own

    def _switches_by(self, at: Shapes) -> np.ndarray:
        """Return the derivatives of `_switched`, (count - 1, unknowns without multipliers)."""
        by = self._starts_placed(at)[1]
        if self.arc:
            by = self._above_wall(at)[0]
        by[..., self.at_points, self.fields] = 0.0
        by[..., self.at_points, self.lengths] = 1.0 - self._inside[self.at_points]
        return by

    def _starts_placed(self, at: Shapes) -> tuple[np.ndarray, np.ndarray]:
        """Return how the starts of the phases but the first change place, each (count - 1, unknowns)."""
        own, whole = self._inside @ self._own(at), self.basis.whole.T
        x = (own * at.sine[..., None, :]) @ self._turning
        y = -(own * at.cosine[..., None, :]) @ self._turning
        for here, along, ahead in ((x, at.cosine, at.ahead[0]), (y, at.sine, at.ahead[1])):
            here[..., self.lengths] += ahead[..., None] - self._inside * (along @ whole)[..., None, :]
        return x, y

    def _above_wall(self, at: Shapes) -> tuple[np.ndarray, np.ndarray]:
        """Return the same across and along the wall."""
        (x, y), (_, nx, ny, _) = self._starts_placed(at), self._starts(at)
        nx, ny = _columns(nx[..., 1:]), _columns(ny[..., 1:])
        return nx * x + ny * y, ny * x - nx * y

    def _switches_curved(self, at: Shapes, multipliers: np.ndarray) -> np.ndarray:
        """Return the derivatives of those times the multipliers."""
        whole, above = self.basis.whole, self._starts(at)
        pressing = np.where(self.at_points, 0.0, multipliers)
        mx, my = pressing * above.nx[..., 1:], pressing * above.ny[..., 1:]
        px, py = mx @ self._inside, my @ self._inside
        bent = _adjoint(self._own(at), py) * at.sine + _adjoint(self._own(at), px) * at.cosine
        curved: np.ndarray = self._turning.T @ (_columns(bent) * self._turning)
        cosine, sine = at.cosine[..., None, :], at.sine[..., None, :]
        per_length = (_columns(px) * (whole * sine) - _columns(py) * (whole * cosine)) @ self._turning
        curved[..., self.lengths, :] += per_length
        curved[..., self.lengths] += _turned(per_length)
        if self.arc:
            across = (
                my.sum(axis=-1, keepdims=True) * at.ahead[0] - mx.sum(axis=-1, keepdims=True) * at.ahead[1]
            )
            curved[..., self.lengths, self.lengths] += self.arc.curvature * across[..., None]
            slides = self._above_wall(at)[1]
            curved -= _turned(_columns(pressing * above.turning[..., 1:]) * slides) @ slides
        return curved

    def felt(self, change: np.ndarray) -> np.ndarray:
        """Return what of changes of the unknowns, (..., size), counts as error: angles and lengths."""
        return np.concatenate(
            [change[..., self.fields] @ self.basis.tables[0].T, change[..., self.lengths]], -1
        )

    # -- what is read off a state

    def read(self, u: np.ndarray, z: np.ndarray) -> Reading:
        """Return what states with these rates hold, and by how much the identity is missed."""
        s, at, tip, loads = self.setting, self.shapes(u), self.tip(u), self.setting.loads
        rates = self.rates(at, z, self.second(u, z) if s.mass else np.zeros_like(z))
        first, acted, bond = self.first_bonded, self._acted(at), self._bond(at)
        heights = (s.ratio * bond.above.gap).reshape(*at.y.shape[:-1], len(self.pieces), -1)
        opened = [piece(heights[..., j, :]).work for j, piece in enumerate(self.pieces)]
        opened_to = self.pieces[first](s.ratio * self._starts(at).gap[..., first]).work / s.ratio
        net_x = acted.force[0] - s.mass * rates.ax - s.drag * rates.vx
        net_y = acted.force[1] - s.mass * rates.ay - s.drag * rates.vy
        speeds = rates.vx**2 + rates.vy**2
        kw = self.arc.curvature
        carried_x, carried_y = self.arc.carried(at.x, at.y)
        driven = net_x * (carried_x - at.cosine) + net_y * (carried_y - at.sine)
        return Reading(
            front=u[..., self.lengths].sum(axis=-1),
            tip=tip,
            kinetic=0.5 * s.mass * (at.weights * speeds).sum(axis=-1),
            bending=self._bending(u)[0] + (loads.natural_curvature - kw) * tip.angle,
            separation=(at.weights * np.concatenate(opened, axis=-1)).sum(axis=-1) / s.ratio,
            identity=(at.weights * driven).sum(axis=-1) + loads.at_tip(tip.angle) - opened_to,
            speed=np.sqrt(speeds.max(axis=-1)),
        )

    def powers(self, u: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the power of the loads, and what drag takes of it, (..., 2)."""
        at, s, loads = self.shapes(u), self.setting, self.setting.loads
        vx, vy = self._carried(at, z)
        force = self._acted(at).force
        loading = (at.weights * (force[0] * vx + force[1] * vy)).sum(axis=-1)
        tip_x, tip_y = self._tip_carried(at, z)
        loading += loads.tip_force[0] * tip_x + loads.tip_force[1] * tip_y + loads.moment * z[..., 0]
        return np.stack([loading, s.drag * (at.weights * (vx**2 + vy**2)).sum(axis=-1)], axis=-1)

    def _tip_carried(self, at: Shapes, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocity of the tip."""
        (phi, _), spread = self._moved(z), z[..., self.lengths]
        along, across = spread @ self.basis.whole, at.weights * phi
        runs = spread.sum(axis=-1)
        x = runs * at.ahead[0][..., 0] + (across * at.sine - along * at.cosine).sum(axis=-1)
        return x, runs * at.ahead[1][..., 0] - (across * at.cosine + along * at.sine).sum(axis=-1)

    def outline(self, u: np.ndarray, many: int, z: np.ndarray | None = None) -> np.ndarray:
        """Return s, theta, x, y and the spin at n Chebyshev points of every phase, (..., phases, n, 5)."""
        xi, value, slope, to_end = self.basis.looked(many)
        at, lengths = self.shapes(u), u[..., self.lengths, None]
        shape = (*lengths.shape[:-1], many)
        ends, back = np.cumsum(lengths, axis=-2), lengths * (1.0 - xi)
        falls = []
        for integrand in (at.cosine, at.sine):
            inside = lengths * (integrand.reshape(*shape[:-1], -1) @ to_end.T)
            whole = (integrand * at.weights) @ (self.basis.whole > 0.0).T
            falls.append(inside + (whole.sum(axis=-1, keepdims=True) - np.cumsum(whole, axis=-1))[..., None])
        theta = (u[..., self.fields] @ value.T).reshape(shape)
        spin = np.zeros(shape)
        if z is not None:
            lengthened = z[..., self.lengths, None]
            moved = np.cumsum(lengthened, axis=-2) - lengthened * (1.0 - xi)
            bent = (u[..., self.fields] @ slope.T).reshape(shape) / lengths
            spin = (z[..., self.fields] @ value.T).reshape(shape) - bent * moved
        front_x, front_y = self.arc.at(ends[..., -1:, :])
        return np.stack([ends - back, theta, front_x - falls[0], front_y - falls[1], spin], axis=-1)

    def rate(self, u: np.ndarray) -> np.ndarray:
        """Return the rates of the unknowns of a rod without mass."""
        return self._driven(u, np.zeros_like(u), self.setting.drag, np.zeros(len(self.switches)))

    def second(self, u: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the rates of the rates of a rod with mass."""
        at, moving = self.shapes(u), z[..., : self.lengths.stop]
        bends = [
            (moving * _on(self._switches_curved(at, one), moving)).sum(axis=-1)
            for one in np.eye(len(self.switches))
        ]
        return self._driven(u, z, self.setting.mass, np.stack(bends, axis=-1) if bends else np.zeros(0))

    def _driven(self, u: np.ndarray, z: np.ndarray, resists: float, bends: np.ndarray) -> np.ndarray:
        """Return what is driven against drag or mass by all the rest, with the switches where they are."""
        moving, held_by = slice(0, self.lengths.stop), self.multipliers
        unpressed = u.copy()
        unpressed[..., held_by] = 0.0
        residual, at = self.residual(unpressed, z, np.zeros_like(u)), self.shapes(u)
        carriers, held = self._carriers(at, self._placed(at)), self._switches_by(at)
        w = _columns(np.concatenate([at.weights, at.weights], axis=-1))
        matrix = np.zeros((*u.shape, self.size))
        matrix[..., moving, moving] = resists * _turned(w * carriers) @ carriers
        matrix[..., moving, held_by], matrix[..., held_by, moving] = -_turned(held), held
        residual[..., held_by] = -bends
        driven: np.ndarray = np.linalg.solve(matrix, residual[..., None])[..., 0]
        driven[..., held_by] = 0.0
        return driven

    def tip(self, u: np.ndarray) -> TipPath:
        """Return height and place of the tip over the wall, and its angle."""
        x, y = (part[..., 0] for part in self._begin(self.shapes(u)))
        return TipPath(self.arc.above(x, y).gap, self.arc.place(x, y), u[..., 0])
