"""A scene on intervals: multiple shooting, or Gauss collocation on a mesh that follows the solution.

The `INTEGRATED` fields are unknown at the ends of all intervals.  Across one they are integrated by an
explicit method (shooting), or are unknown at its Gauss points, too (collocation).  Otherwise the two are one:
the same conditions at the tip, the switches and the front, and an explicit integration from the mesh
point before wherever a shape is sampled.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ..base.quadrature import gauss, integration_matrix
from ..model.bond import Piece
from ..model.equations import Scalars
from .collocation import Collocation
from .discretisation import Phases, Profile
from .mesh import QUANTUM, RESOLUTION, equidistributing, uniform
from .scene_spectral import (
    SceneDiscretisation,
    SceneEquations,
    SceneProfile,
    SceneTranscription,
    equations_of,
)
from .scene_system import INTEGRATED, REACHES, SAMPLED, SceneSystem
from .shooting import Shooting, runge_kutta, tableau

#: Columns of a profile that are integrated.
COLUMNS = [SAMPLED.index(name) for name in INTEGRATED]
FIELDS = len(INTEGRATED)

#: A function of what is known at a place: fields, xi, scalars, numbers.
AtPlace = Callable[[Sequence[Any], Any, Scalars, dict[str, Any]], Sequence[Any]]


@dataclass(frozen=True)
class SceneIntervals(SceneTranscription):
    """A scene on intervals.

    Parameters
    ----------
    scene, free, entered, instead
        As in `SceneTranscription`.
    mesh : Shooting or Collocation
    """

    mesh: Shooting | Collocation

    @property
    def stages(self) -> int:
        """Gauss points per interval at which fields are unknown."""
        return self.mesh.stages if isinstance(self.mesh, Collocation) else 0

    @property
    def sure_gain(self) -> float:
        """That of the mesh."""
        return self.mesh.sure_gain

    @property
    def most_gain(self) -> float:
        """That of the mesh."""
        return self.mesh.most_gain

    def discretise(self, phases: Phases) -> SceneIntervalsDiscretisation:
        """Return the compiled problem for these phases."""
        return _discretise(self, phases)


class SceneIntervalsDiscretisation(SceneDiscretisation):
    """Fields at all mesh points; with collocation at all stages, too, and the breakpoints."""

    settings: SceneIntervals

    def __init__(self, settings: SceneIntervals, phases: Phases) -> None:
        self.settings = settings
        self.beyond = 0 if settings.scene.layer is None else len(REACHES)
        stretches, m, stages = len(phases) + self.beyond, settings.mesh.intervals, settings.stages
        self.total = m * stretches
        #: Where the fields at the mesh points, those at the stages and the breakpoints stand.
        self.states = slice(0, FIELDS * (self.total + 1))
        self.staged = slice(self.states.stop, self.states.stop + FIELDS * stages * self.total)
        breaks = (m - 1) * stretches if stages else 0
        self.breaks = slice(self.staged.stop, self.staged.stop + breaks)
        super().__init__(phases, self.breaks.stop, len(settings.unknown))
        self.named = self.extra
        if not stages:
            self.defects = slice(4, 4 + FIELDS * self.total)
        self.equations = equations_of(self, IntervalEquations)
        self.numbers = ca.DM(list(settings.given.values()))

    def pack(self, profile: Profile) -> np.ndarray:
        """Unknowns that represent a profile with these phases."""
        assert isinstance(profile, SceneProfile)
        own = [profile.numbers.get(name, 0.0) for name in self.settings.unknown]
        return np.concatenate([self.pack_fields(profile), profile.lengths[:-1], own, profile.scalars.values])

    def pack_fields(self, profile: Profile) -> np.ndarray:
        """Fields at the mesh points and the stages, and the mesh itself."""
        assert isinstance(profile, SceneProfile)
        mesh, states, staged, meshes = self.settings.mesh, [], [], []
        along = SceneProfile(
            np.ones(self.stretches),
            np.concatenate([profile.values, profile.attached])[:, :, COLUMNS],
            profile.scalars,
            profile.scene,
            profile.numbers,
        )
        for j in range(self.stretches):
            breaks = uniform(mesh.intervals)
            if isinstance(mesh, Collocation) and mesh.mesh != "uniform":
                zeta = np.linspace(0.0, 1.0, RESOLUTION)
                curl = np.gradient(along.in_phase(j, zeta)[:, INTEGRATED.index("K")], zeta)
                breaks = equidistributing(curl, mesh.intervals)
            edges = np.concatenate([[0.0], breaks, [1.0]])
            states.append(along.in_phase(j, edges[:-1]).ravel())
            if self.settings.stages:
                points, _ = gauss(self.settings.stages)
                at = edges[:-1, None] + np.diff(edges)[:, None] * points
                staged.append(along.in_phase(j, at.ravel()).ravel())
                meshes.append(breaks)
        states.append(along.in_phase(self.stretches - 1, np.ones(1)).ravel())
        return np.concatenate([*states, *staged, *meshes])


@lru_cache(maxsize=128)
def _discretise(settings: SceneIntervals, phases: Phases) -> SceneIntervalsDiscretisation:
    return SceneIntervalsDiscretisation(settings, phases)


class IntervalEquations(SceneEquations):
    """The equations on intervals."""

    def __init__(self, model: SceneIntervalsDiscretisation) -> None:
        super().__init__(model)
        settings = model.settings
        self.model, self.scene, self.mesh = model, settings.scene, settings.mesh
        self.system = SceneSystem(settings.scene, settings.unknown, tuple(settings.given))
        #: Unknown numbers, scalars and known numbers.
        self.known = ca.vertcat(self.x[model.named.start : model.tail.stop], self.given)
        self.states = ca.reshape(self.x[model.states], FIELDS, model.total + 1)
        inner = self.x[model.inner]
        lengths = [*(ca.vertsplit(inner) if len(model.phases) > 1 else []), 1 - ca.sum1(inner)]
        if model.beyond:
            reaching = self._at(lambda _, __, s, q: self.system.reaching([], s, q))
            lengths += ca.vertsplit(reaching(self.states[:, 0], 0.0, self.known))
        self.lengths = lengths
        self.starts = [sum(lengths[:j], ca.MX(0.0)) for j in range(len(lengths))]
        m = settings.mesh.intervals
        moving = ca.reshape(self.x[model.breaks], m - 1, model.stretches) if settings.stages else None
        fixed = ca.MX(ca.DM(uniform(m)))
        self.edges = [
            ca.vertcat(0.0, fixed if moving is None else moving[:, j], 1.0) for j in range(model.stretches)
        ]
        residual = self._residual()
        arguments = [self.x, self.given]
        self.residual = ca.Function("residual", arguments, [residual])
        self.linearised = ca.Function("linearised", arguments, [residual, ca.jacobian(residual, self.x)])
        self.ends = ca.Function("ends", arguments, [self._places(), self._work()])

    def piece(self, stretch: int) -> Piece:
        """Return the piece of the law on a stretch; on the attached rod the last."""
        return self.model.phases[min(stretch, len(self.model.phases) - 1)]

    def _at(self, function: AtPlace) -> ca.Function:
        """Compile a function of the fields at a place, xi and all numbers."""
        state, xi = ca.SX.sym("state", FIELDS), ca.SX.sym("xi")
        known = ca.SX.sym("known", self.known.shape[0])
        values = function(ca.vertsplit(state), xi, *self.system.named(known))
        return ca.Function("at", [state, xi, known], [ca.vertcat(*values)])

    def _of_end(self, stretch: int, function: AtPlace) -> ca.MX:
        """Evaluate a function where a stretch ends."""
        end = (stretch + 1) * self.mesh.intervals
        xi = self.starts[stretch] + self.lengths[stretch]
        return self._at(function)(self.states[:, end], xi, self.known)

    def _intervals(self, stretch: int) -> tuple[slice, ca.MX, ca.MX]:
        """Places of the states before the intervals of a stretch, xi there, and the lengths of these."""
        m, length, edges = self.mesh.intervals, self.lengths[stretch], self.edges[stretch]
        xi = self.starts[stretch] + length * edges[:-1]
        return slice(stretch * m, (stretch + 1) * m), xi.T, length * (edges[1:] - edges[:-1]).T

    # -- the residual

    def _residual(self) -> ca.MX:
        """What holds at the tip, across all intervals, at the switches, at the front, and of the mesh."""
        scene, system, phases, m = self.scene, self.system, self.model.phases, self.mesh.intervals
        first, front, last = phases[0], len(phases) - 1, self.model.stretches - 1

        def at_tip(z: Sequence[Any], xi: Any, s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
            at, scale = system.place(z, xi, s, q, first), s.sigma**2 / s.A
            bend, Theta = system.at_the_tip([], s, q)
            Nx, Ny = system.pulled(at, q, first)
            free = [z[0] - Theta, z[1] - bend, z[2] - scale * Nx, z[3] - scale * Ny]
            return [*free, *(scene.tip_equations(at, q) if scene.reactions else [])]

        def at_front(z: Sequence[Any], xi: Any, s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
            if scene.layer is not None:
                return [z[5], scene.yielding(system.place(z, xi, s, q, phases[front]), q)]
            return [z[5], *system.front([z[1], z[2] * s.A / s.sigma**2], s, q)]

        tip = self._at(at_tip)(self.states[:, 0], 0.0, self.known)
        rows = [tip[:4]]
        for j in range(self.model.stretches):
            mine, xi, h = self._intervals(j)
            known = ca.repmat(self.known, 1, m)
            inputs = [self.states[:, mine], xi, h, known]
            if stages := self.model.settings.stages:
                staged = ca.reshape(self.x[self.model.staged], FIELDS * stages, self.model.total)
                inputs.append(staged[:, mine])
            end, *missed = self._step(self.piece(j), attached=j > front).map(m).call(inputs)
            rows.append(ca.vec(ca.vertcat(*missed, end - self.states[:, mine.start + 1 : mine.stop + 1])))
        for j, (a, b) in enumerate(pairwise(phases)):

            def switch(z: Any, xi: Any, s: Scalars, q: Any, a: Piece = a, b: Piece = b) -> Sequence[Any]:
                return system.switched(a, b)(system.place(z, xi, s, q, a), q, a)

            rows.append(self._of_end(j, switch))
        rows += [self._of_end(front, at_front), self._of_end(last, lambda z, *_: [z[0], z[4]]), tip[4:]]
        if self.model.settings.stages:
            rows += [b - QUANTUM * ca.floor(b / QUANTUM + 0.5) for b in (e[1:-1] for e in self.edges)]
        return ca.vertcat(*rows)

    def _step(self, piece: Piece, *, attached: bool) -> ca.Function:
        """(state, xi, length, numbers) and the fields at stages -> the end, and what the stages miss."""
        stages = self.model.settings.stages
        if not stages:
            advance = self._advance(piece, attached=attached)
            inputs = [ca.SX.sym("i", *advance.size_in(k)) for k in range(4)]
            return ca.Function("step", inputs, [advance(*inputs)[0]])
        state, xi, h = ca.SX.sym("state", FIELDS), ca.SX.sym("xi"), ca.SX.sym("h")
        known, staged = ca.SX.sym("known", self.known.shape[0]), ca.SX.sym("staged", FIELDS, stages)
        points, weights = gauss(stages)
        named = self.system.named(known)
        slopes = ca.horzcat(
            *(
                ca.vertcat(
                    *self.system.rates(
                        ca.vertsplit(staged[:, i]), xi + h * points[i], *named, piece, attached=attached
                    )
                )
                for i in range(stages)
            )
        )
        inside = ca.repmat(state, 1, stages) + h * ca.mtimes(slopes, integration_matrix(stages, points).T)
        end = state + h * ca.mtimes(slopes, weights)
        inputs = [state, xi, h, known, ca.vec(staged)]
        return ca.Function("step", inputs, [end, ca.vec(staged - inside)])

    def _advance(self, piece: Piece, *, attached: bool) -> ca.Function:
        """(state, xi, length, numbers) -> the state at the end, and the work of the loads on the way."""
        mesh = self.mesh
        order, steps = (mesh.integrator, mesh.steps) if isinstance(mesh, Shooting) else ("dop853", 2)
        state, xi, h = ca.SX.sym("state", FIELDS), ca.SX.sym("xi"), ca.SX.sym("h")
        known = ca.SX.sym("known", self.known.shape[0])
        s, q = self.system.named(known)

        def slope(z: ca.SX) -> ca.SX:
            fields, there = ca.vertsplit(z[:FIELDS]), z[FIELDS]
            rates = self.system.rates(fields, there, s, q, piece, attached=attached)
            work = self.scene.work(self.system.place(fields, there, s, q, piece), q) * s.sigma
            return ca.vertcat(*rates, 1.0, 0.0 if attached else work)

        end = runge_kutta(slope, ca.vertcat(state, xi, 0.0), h, tableau(order), steps)
        return ca.Function("advance", [state, xi, h, known], [end[:FIELDS], end[-1]])

    # -- what is read off it

    def _places(self) -> ca.MX:
        """Xi, theta, x, y and slip at the ends of all stretches, and at the tip."""

        def row(piece: Piece) -> AtPlace:
            def values(z: Sequence[Any], xi: Any, s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
                at = self.system.place(z, xi, s, q, piece)
                return [xi, at.theta, at.x, at.y, at.slip]

            return values

        ends = [self._of_end(j, row(self.piece(j))) for j in range(self.model.stretches)]
        tip = self._at(row(self.piece(0)))(self.states[:, 0], 0.0, self.known)
        return ca.horzcat(*ends, tip).T

    def _work(self) -> ca.MX:
        """Return the integral of what the loads put into the identity."""
        m, total = self.mesh.intervals, ca.MX(0.0)
        for j in range(len(self.model.phases)):
            mine, xi, h = self._intervals(j)
            advance = self._advance(self.piece(j), attached=False).map(m)
            total += ca.sum2(advance(self.states[:, mine], xi, h, ca.repmat(self.known, 1, m))[1])
        return total

    def sampled(self, zeta: np.ndarray, *, attached: bool) -> ca.MX:
        """`SAMPLED` by integration from the mesh point before."""
        front, count, where = len(self.model.phases), len(zeta), ca.DM(zeta).T
        known = ca.repmat(self.known, 1, count)
        samples = []
        for j in range(front, self.model.stretches) if attached else range(front):
            mine, xi, _ = self._intervals(j)
            edges, length, piece = self.edges[j], self.lengths[j], self.piece(j)
            # One in the row of the interval that holds the point: which it is, the mesh decides.
            after = ca.repmat(edges[1:-1], 1, count) <= ca.repmat(where, self.mesh.intervals - 1, 1)
            ones = ca.MX.ones(1, count)
            holds = ca.vertcat(ones, after) - ca.vertcat(after, 0 * ones)
            share = length * (where - ca.mtimes(edges[:-1].T, holds))
            begin = ca.mtimes(xi, holds)
            advance = self._advance(piece, attached=attached).map(count)
            state, _ = advance(ca.mtimes(self.states[:, mine], holds), begin, share, known)

            def position(z: Any, xi: Any, s: Scalars, q: Any, piece: Piece = piece) -> Sequence[Any]:
                return [self.system.place(z, xi, s, q, piece).x / s.sigma]

            x = self._at(position).map(count)(state, begin + share, known)
            samples.append(ca.vertcat(state[: FIELDS - 1, :], x, state[FIELDS - 1, :]).T)
        return ca.vertcat(*samples)
