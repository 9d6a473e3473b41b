"""The fields of any scene in the spectral form, with their gradients.

The unknowns are those of the paper's scene: Theta'' at the nodes, phase lengths, the four scalars, and
between them what a scene adds, such as a number that is left free.  The inclination is that of the
wall plus the amplitude times Theta,

    theta = kw (s - sbar) + A Theta,   Theta(0) = -1,

so that a rod that lies on its wall is no solution.  Lengths are over eta, forces over T0 eta.  A rod that
stretches has its strain at the nodes among the unknowns: what it does to the shape is what loads it.
On an elastic layer some stretches of the attached rod follow the detached ones, up to where all has decayed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ..model.bond import Piece
from ..model.equations import Scalars
from ..model.place import Place
from ..model.scene import Scene
from ..model.stretch import past_of
from .scene_system import SceneSystem
from .traced import Traced, integrated, pointwise, stacked


class SceneFields:
    """A scene at the nodes of all phases.

    Parameters
    ----------
    scene : Scene
    phases : sequence of Piece
        The stretches of rod between switches, each with the material points it is past.
    chain : ndarray
        Matrix from nodal values times the lengths of their phases to the integrals from the tip to the
        nodes, to the ends of the phases, and to the tip itself, which are zero.
    x : casadi.MX
        All unknowns.
    parts : mapping of str to slice
        Where the "fields", "inner" lengths, "strain", Theta'' of the "attached" rod, "named" numbers and
        the four scalars ("tail") stand in ``x``.
    names : sequence of str
        Names of the unknown numbers.
    given : casadi.MX
        The known numbers of the scene.
    known : sequence of str
        Their names.
    """

    def __init__(
        self,
        scene: Scene,
        phases: Sequence[Piece],
        chain: np.ndarray,
        x: ca.MX,
        parts: Mapping[str, slice],
        names: Sequence[str],
        given: ca.MX,
        known: Sequence[str],
    ) -> None:
        self.scene, self.phases, self.chain = scene, phases, chain
        self.system, self.given = SceneSystem(scene, tuple(names), tuple(known)), given
        self.size, n = x.shape[0], chain.shape[1]
        self.nodes, self.local = n, parts["fields"].stop // len(phases)
        self.stretches = n // self.local
        #: Rows of the front, of the end where the inclination vanishes, and of the tip.
        self.edge = slice(n + len(phases) - 1, n + len(phases))
        self.far = slice(n + self.stretches - 1, n + self.stretches)
        self.tip = slice(n + self.stretches, n + self.stretches + 1)
        identity = ca.DM.eye(self.size)

        def unknown(part: slice) -> Traced:
            return Traced(x[part], ca.densify(identity[part, :]))

        self.curl = unknown(parts["fields"])
        if scene.layer is not None:
            self.curl = stacked([self.curl, unknown(parts["attached"])])
        self.strain = [unknown(parts["strain"])] if scene.stretch is not None else []
        self.scalars = unknown(slice(parts["named"].start, parts["tail"].stop))
        self.lengths = self._shares(unknown(parts["inner"]) if len(phases) > 1 else None)
        spread = np.kron(np.eye(self.stretches), np.ones((self.local, 1)))
        self.h = Traced(ca.mtimes(spread, self.lengths.values), ca.mtimes(spread, self.lengths.gradient))

        bend, zero = self._of([self._constant(0.0)], self.system.at_the_tip)
        self.tip_curvature, self.tip_inclination = bend, zero
        self.K, self.Theta = self._turned(chain)
        self.xi = integrated(chain, self.h, self._constant(1.0, n))
        (self.theta,) = self._of([self.Theta, self.xi], self.system.inclined)
        self.rates = self._of([self.theta[:n], *self.strain], self.system.moving)
        self.x, self.y, self.slip = self._places(chain)
        loads = [self._at(part, self.system.loaded) for part in self._parts]
        loads += [self._at(part, self.system.attached) for part in self._parts_attached]
        self.loads = [stacked(parts) for parts in zip(*loads, strict=True)]
        self.pulls = self._at(self.tip, self.system.pulled)
        self.N = [
            self._from_tip(chain, load, pull) for load, pull in zip(self.loads, self.pulls, strict=True)
        ]

    def residual(self) -> Traced:
        """Bending at the nodes, the front, Theta(1) = 0, the switches, and what the tip adds."""
        n = self.nodes
        at_nodes = [self.theta[:n], *(N[:n] for N in self.N)]
        (bend,) = self._of([*at_nodes, *self.strain], self.system.bending)
        if self.scene.layer is None:
            (front,) = self._of([self.K[self.edge], self.N[0][self.edge]], self.system.front)
        else:
            (front,) = self._at(self.edge, lambda at, q, _: [self.scene.yielding(at, q)])
        rows = [self.curl - bend, front, self.Theta[self.far]]
        if self.strain:
            (due,) = self._of(at_nodes, self.system.strained)
            rows.append(self.strain[0] - due)
        for j, (a, b) in enumerate(pairwise(self.phases)):
            end = slice(n + j, n + j + 1)
            rows += self._at(end, self.system.switched(a, b))
        if self.scene.reactions:
            rows += self._at(self.tip, lambda at, q, _: self.scene.tip_equations(at, q))
        return stacked(rows)

    def sampled(self, chain: np.ndarray) -> list[Traced]:
        """Return `SAMPLED` at other places, by integrals from the tip to them."""
        K, Theta = self._turned(chain)
        x, y, slip = self._places(chain)
        N = [self._from_tip(chain, load, pull) for load, pull in zip(self.loads, self.pulls, strict=True)]
        return [Theta, K, *self._of([*N, y, x, slip], self.system.over_amplitude)]

    def work(self) -> Traced:
        """Return the integral of what the loads put into the identity."""
        densities = [
            self._at(part, lambda at, q, _: [self.scene.work(at, q) * at.sbar])[0] for part in self._parts
        ]
        density = stacked([*densities, *(self._constant(0.0, self.local) for _ in self._parts_attached)])
        return integrated(self.chain, self.h, density)[self.edge]

    @property
    def _parts(self) -> list[slice]:
        """Rows of the nodes of each detached stretch."""
        return [slice(j * self.local, (j + 1) * self.local) for j in range(len(self.phases))]

    @property
    def _parts_attached(self) -> list[slice]:
        """Rows of the nodes of each stretch of the attached rod."""
        return [slice(j * self.local, (j + 1) * self.local) for j in range(len(self.phases), self.stretches)]

    # -- integrals

    def _turned(self, chain: np.ndarray) -> tuple[Traced, Traced]:
        """Return K and Theta."""
        n = self.nodes
        own = integrated(self.chain, self.h, self.curl)[:n] + self.tip_curvature
        K = integrated(chain, self.h, self.curl) + self.tip_curvature
        return K, integrated(chain, self.h, own) + self.tip_inclination

    def _places(self, chain: np.ndarray) -> list[Traced]:
        """Return x, y and slip: x and slip count from the front, y from the wall, where all has decayed."""
        starts = (self.edge, self.far, self.edge)
        whole = [integrated(self.chain, self.h, rate) for rate in self.rates]
        every = whole if chain is self.chain else [integrated(chain, self.h, rate) for rate in self.rates]
        return [part - all_of[start] for part, all_of, start in zip(every, whole, starts, strict=True)]

    def _from_tip(self, chain: np.ndarray, rate: Traced, start: Traced) -> Traced:
        """Integrate from the tip."""
        return integrated(chain, self.h, rate) + start

    # -- applying them

    def _of(
        self,
        fields: Sequence[Traced],
        function: Callable[[Sequence[Any], Scalars, dict[str, Any]], Sequence[Any]],
    ) -> list[Traced]:
        """Apply a function of fields, scalars and numbers at every point."""
        return pointwise(lambda q, s: function(q, *self.system.named(s)), fields, self.scalars, self.given)

    def _at(
        self, rows: slice, function: Callable[[Place, dict[str, Any], Piece], Sequence[Any]]
    ) -> list[Traced]:
        """Apply a function of the place at some points, which lie in one phase."""
        piece = self._piece_of(rows)

        def at_place(q: Sequence[Any], s: Scalars, numbers: dict[str, Any]) -> Sequence[Any]:
            xi, theta, x, y, slip, *strain = q
            at = Place(xi * s.sigma, s.sigma, theta, x, y, slip, past_of(piece), *strain)
            return function(at, numbers, piece)

        fields = [f[rows] for f in (self.xi, self.theta, self.x, self.y, self.slip)]
        if rows.stop <= self.nodes:
            fields += [strain[rows] for strain in self.strain]
        return self._of(fields, at_place)

    def _piece_of(self, rows: slice) -> Piece:
        if rows == self.tip:
            return self.phases[0]
        index = rows.start // self.local if rows.start < self.nodes else rows.start - self.nodes
        return self.phases[min(index, len(self.phases) - 1)]

    def _constant(self, value: float, rows: int = 1) -> Traced:
        return Traced(ca.DM.ones(rows) * value, ca.DM.zeros(rows, self.size))

    def _shares(self, inner: Traced | None) -> Traced:
        """Shares of all phases, the last is what the others leave; then those of the attached rod."""
        rest = self._constant(1.0)
        for j in range(len(self.phases) - 1):
            assert inner is not None
            rest = rest - inner[j : j + 1]
        shares = [rest] if inner is None else [inner, rest]
        if self.scene.layer is not None:
            shares += self._of([self._constant(0.0)], self.system.reaching)
        return stacked(shares) if len(shares) > 1 else rest
