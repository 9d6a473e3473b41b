"""The equations of any scene at one place on the rod, as every transcription takes them.

Lengths are over eta, forces over T0 eta; theta = kw (s - sbar) + A Theta, so that a rod that lies on
its wall is no solution.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ..model.bond import Piece
from ..model.equations import SCALARS, Scalars
from ..model.place import Place
from ..model.scene import Scene
from ..model.stretch import past_of

#: Stretches of the attached rod on its layer, in lengths of decay: beyond their sum nothing is left.
REACHES = (4.0, 6.0, 8.0, 12.0)

#: What a profile has of a scene: fields over the amplitude, then position and slip over the length.
SAMPLED = ("Theta", "K", "nx", "ny", "Y", "x", "slip")

#: Those that are integrated along the rod, from which x follows.
INTEGRATED = ("Theta", "K", "nx", "ny", "Y", "slip")


@dataclass(frozen=True)
class SceneSystem:
    """A scene at one place.

    Parameters
    ----------
    scene : Scene
    unknown, known : tuple of str
        Names of its numbers that are unknown, and of those that are given.
    """

    scene: Scene
    unknown: tuple[str, ...]
    known: tuple[str, ...]

    def named(self, s: Any) -> tuple[Scalars, dict[str, Any]]:
        """Split a column of the unknown numbers, the four scalars and the known numbers; all by name."""
        split, count = ca.vertsplit(s), len(self.unknown)
        scalars = Scalars(*split[count : count + len(SCALARS)])
        numbers = dict(zip(self.unknown, split[:count], strict=True))
        numbers |= dict(zip(self.known, split[count + len(SCALARS) :], strict=True))
        return scalars, numbers | {"pressure": scalars.pressure_ratio, "ratio": scalars.ratio}

    # -- what happens at a point

    def at_the_tip(self, _: Sequence[Any], s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
        """K(0) and Theta(0)."""
        return self.scene.tip_start(s.A, s.sigma, q)

    def inclined(self, at: Sequence[Any], s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
        """Return theta, that of the wall and the rest."""
        Theta, xi = at
        return [s.A * Theta + self.scene.wall.curvature_of(q) * s.sigma * (xi - 1.0)]

    @staticmethod
    def moving(at: Sequence[Any], s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
        """Rates of x, y and slip along xi."""
        theta, *strain = at
        x, y, slip = ca.cos(theta), ca.sin(theta), -2.0 * ca.sin(0.5 * theta) ** 2
        for eps in strain:
            x, y, slip = x * (1.0 + eps), y * (1.0 + eps), slip + eps * x - q["glued_strain"]
        return [s.sigma * x, s.sigma * y, s.sigma * slip]

    def loaded(self, at: Place, q: dict[str, Any], piece: Piece) -> Sequence[Any]:
        """Rates of N_x and N_y along xi."""
        return [at.sbar * force for force in self.scene.per_length(at, piece, q)]

    def attached(self, at: Place, q: dict[str, Any], _: Piece) -> Sequence[Any]:
        """Rates of N_x and N_y along xi on the layer."""
        return [at.sbar * force for force in self.scene.attached(at, q)]

    def reaching(self, _: Sequence[Any], s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
        """Lengths of the stretches of the attached rod over the detached length."""
        assert self.scene.layer is not None
        return [reach / (self.scene.layer.decay(q) * s.sigma) for reach in REACHES]

    def switched(
        self, before: Piece, after: Piece
    ) -> Callable[[Place, dict[str, Any], Piece], Sequence[Any]]:
        """Return what vanishes where one stretch ends and the next begins."""
        return lambda at, q, _: [self.scene.switch(at, q, before, after)]

    def pulled(self, at: Place, q: dict[str, Any], _: Piece) -> Sequence[Any]:
        """N_x and N_y at the tip."""
        return self.scene.tip_force(at, q)

    @staticmethod
    def bending(at: Sequence[Any], s: Scalars, _: dict[str, Any]) -> Sequence[Any]:
        """Theta'' of the balance of moments."""
        theta, Nx, Ny, *strain = at
        bend = (Ny * ca.cos(theta) - Nx * ca.sin(theta)) * s.sigma**2 / s.A
        return [bend * (1.0 + eps) for eps in strain] or [bend]

    def strained(self, at: Sequence[Any], _: Scalars, q: dict[str, Any]) -> Sequence[Any]:
        """The strain that the forces ask for."""
        theta, Nx, Ny = at
        return [self.scene.strain(Nx * ca.cos(theta) + Ny * ca.sin(theta), q)]

    def front(self, at: Sequence[Any], s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
        """The condition at the front, over the amplitude."""
        K, Nx = at
        return [K - (self.scene.front_curvature(Nx, q) - self.scene.wall.curvature_of(q)) * s.sigma / s.A]

    @staticmethod
    def over_amplitude(at: Sequence[Any], s: Scalars, _: dict[str, Any]) -> Sequence[Any]:
        """Forces and heights in the scaling of a profile."""
        Nx, Ny, y, x, slip = at
        return [
            Nx * s.sigma**2 / s.A,
            Ny * s.sigma**2 / s.A,
            y / (s.sigma * s.A),
            x / s.sigma,
            slip / s.sigma,
        ]

    # -- along the rod as a first-order system

    def place(self, state: Sequence[Any], xi: Any, s: Scalars, q: dict[str, Any], piece: Piece) -> Place:
        """Return the place that `INTEGRATED` fields at xi are of."""
        Theta, _, nx, ny, Y, slip = state
        (theta,) = self.inclined([Theta, xi], s, q)
        strain = self._strains(theta, nx, ny, s, q)
        x = (slip + (1.0 + q.get("glued_strain", 0.0)) * (xi - 1.0)) * s.sigma
        return Place(
            xi * s.sigma, s.sigma, theta, x, Y * s.sigma * s.A, slip * s.sigma, past_of(piece), *strain
        )

    def rates(
        self, state: Sequence[Any], xi: Any, s: Scalars, q: dict[str, Any], piece: Piece, *, attached: bool
    ) -> list[Any]:
        """Return the derivatives of `INTEGRATED` fields along xi."""
        _, K, nx, ny, _, _ = state
        at, scale = self.place(state, xi, s, q, piece), s.sigma**2 / s.A
        strain = [at.strain] if self.scene.stretch is not None else []
        Nx, Ny = (self.attached if attached else self.loaded)(at, q, piece)
        _, y, slip = self.moving([at.theta, *strain], s, q)
        (bend,) = self.bending([at.theta, nx / scale, ny / scale, *strain], s, q)
        return [K, bend, Nx * scale, Ny * scale, y / (s.sigma * s.A), slip / s.sigma]

    def _strains(self, theta: Any, nx: Any, ny: Any, s: Scalars, q: dict[str, Any]) -> Sequence[Any]:
        if self.scene.stretch is None:
            return ()
        scale = s.sigma**2 / s.A
        return self.strained([theta, nx / scale, ny / scale], s, q)
