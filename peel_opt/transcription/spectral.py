"""Spectral form: Theta'' at Gauss nodes, everything else by integration.

With Theta(0) = -1 and K(0) = n_x(0) = n_y(0) = 0 built in, the only unknowns of a phase are
Theta'' at its nodes.  Converges faster than any power of the number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.polynomial import legendre

from ..elastica import Scalars, bending, sin_over, vertical_load
from .base import Discretisation, Phases, Profile, Transcription, switch_equations


@lru_cache(maxsize=64)
def gauss(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes and weights on [0, 1]."""
    t, w = legendre.leggauss(nodes)
    return 0.5 * (t + 1.0), 0.5 * w


def integration_matrix(nodes: int, zeta: np.ndarray) -> np.ndarray:
    """Matrix from values at Gauss nodes to their integral from 0 to each ``zeta``."""
    t, w = legendre.leggauss(nodes)
    # Discrete orthogonality of the Legendre polynomials at Gauss nodes: no inverse needed.
    degrees = np.arange(nodes)
    to_series = (degrees + 0.5)[:, None] * legendre.legvander(t, nodes - 1).T * w
    z = 2.0 * np.asarray(zeta) - 1.0
    columns = [legendre.legval(z, legendre.legint(np.eye(nodes)[d], lbnd=-1)) for d in degrees]
    return 0.5 * np.stack(columns, axis=-1) @ to_series


@dataclass(frozen=True)
class Spectral(Transcription):
    """Global Gauss collocation of (12a) in Theta''.

    Parameters
    ----------
    nodes : int
        Gauss nodes per element.
    elements : int
        Equal elements per phase.
    """

    nodes: int = 16
    elements: int = 1

    @property
    def sure_gain(self) -> float:
        """Half as many nodes again: ten is less than what is seen on any smooth phase."""
        return 10.0

    def discretise(self, phases: Phases) -> SpectralDiscretisation:
        """Return the compiled problem for these phases."""
        return _discretise(self, phases)

    def refined(self) -> Spectral:
        """Half as many nodes again."""
        return replace(self, nodes=self.nodes + self.nodes // 2)


class SpectralDiscretisation(Discretisation):
    """Theta'' at the Gauss nodes of every phase."""

    def __init__(self, settings: Spectral, phases: Phases) -> None:
        self.settings = settings
        self.local = settings.nodes * settings.elements
        super().__init__(phases, self.local * len(phases))
        nodes, weights = gauss(settings.nodes)
        # On a phase of length 1: cumulative integral at its nodes, and the whole integral.
        self.zeta = np.concatenate([(e + nodes) / settings.elements for e in range(settings.elements)])
        self.whole = np.tile(weights, settings.elements) / settings.elements
        self._fields = self._field_expressions()

    def _cumulative(self, zeta: np.ndarray) -> np.ndarray:
        """Matrix from nodal values of one phase of length 1 to integrals from 0 to ``zeta``."""
        n, elements = self.settings.nodes, self.settings.elements
        element = np.minimum((np.asarray(zeta) * elements).astype(int), elements - 1)
        out = np.zeros((len(zeta), self.local))
        for row, (z, e) in enumerate(zip(zeta, element, strict=True)):
            out[row, : e * n] = self.whole[: e * n]
            out[row, e * n : (e + 1) * n] = integration_matrix(n, np.array([z * elements - e]))[0] / elements
        return out

    def _chain(self, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Integrals from the tip to ``zeta`` in each phase, and to the end of each phase."""
        count = len(self.phases)
        points = len(zeta)
        inside = np.kron(np.eye(count), self._cumulative(zeta))
        before = np.kron(np.tril(np.ones((count, count)), -1), np.ones((points, 1)) * self.whole)
        ends = np.kron(np.tril(np.ones((count, count))), self.whole)
        return inside + before, ends

    def _field_expressions(self) -> dict[str, ca.MX]:
        """Fields at the nodes and what integrates to them."""
        curl, lengths, tail = self.symbols()
        scalars = Scalars(*ca.vertsplit(tail))
        h = ca.vertcat(*(ca.repmat(length, self.local, 1) for length in lengths))
        to_nodes, to_ends = self._chain(self.zeta)
        K = to_nodes @ (h * curl)
        Theta = -1 + to_nodes @ (h * K)
        slope = self._pointwise(lambda t, _y, s, _p: sin_over(s.A, t), Theta, Theta, tail)
        rise = to_nodes @ (h * slope)
        Y_tip = -(to_ends[-1:, :] @ (h * slope))
        Y = Y_tip + rise
        load = self._pointwise(vertical_load, Theta, Y, tail)
        return {
            "h": h,
            "curl": curl,
            "K": K,
            "Theta": Theta,
            "slope": slope,
            "Y_tip": Y_tip,
            "Y": Y,
            "load": load,
            "nx": -scalars.alpha * rise,
            "ny": to_nodes @ (h * load),
            "to_ends": to_ends,
        }

    def _pointwise(self, function: object, Theta: ca.MX, Y: ca.MX, tail: ca.MX) -> ca.MX:
        """Apply a function of (Theta, Y, scalars, piece) at the nodes of every phase."""
        theta, y, s = ca.SX.sym("Theta"), ca.SX.sym("Y"), ca.SX.sym("s", 4)
        blocks = []
        for j, piece in enumerate(self.phases):
            expression = function(theta, y, Scalars(*ca.vertsplit(s)), piece)  # type: ignore[operator]
            block = slice(j * self.local, (j + 1) * self.local)
            mapped = ca.Function("pointwise", [theta, y, s], [expression]).map(self.local)
            blocks.append(mapped(Theta[block].T, Y[block].T, ca.repmat(tail, 1, self.local)).T)
        return ca.vertcat(*blocks)

    def residual_expression(self) -> ca.MX:
        """(12a) at the nodes, K(1) = 0, Theta(1) = 0, y = y0 at the switches."""
        f = self._fields
        scalars = Scalars(*ca.vertsplit(self.symbols()[2]))
        ends = f["to_ends"]
        balance = f["curl"] - bending(f["Theta"], f["nx"], f["ny"], scalars)
        heights = scalars.height(f["Y_tip"] + ends[:-1, :] @ (f["h"] * f["slope"]))
        return ca.vertcat(
            balance,
            ends[-1:, :] @ (f["h"] * f["curl"]),
            -1 + ends[-1:, :] @ (f["h"] * f["K"]),
            *switch_equations(self.phases, ca.vertsplit(heights) if len(self.phases) > 1 else []),
        )

    @property
    def angle_row(self) -> int:
        """Row of Theta(1) = 0."""
        return self.field_count + 1

    def tip_expression(self) -> ca.MX:
        """Y(0)."""
        return self._fields["Y_tip"]

    def sample_expression(self, zeta: np.ndarray) -> ca.MX:
        """Fields at the same local coordinates in every phase."""
        f = self._fields
        scalars = Scalars(*ca.vertsplit(self.symbols()[2]))
        there, _ = self._chain(np.asarray(zeta))
        rise = there @ (f["h"] * f["slope"])
        return ca.horzcat(
            -1 + there @ (f["h"] * f["K"]),
            there @ (f["h"] * f["curl"]),
            -scalars.alpha * rise,
            there @ (f["h"] * f["load"]),
            f["Y_tip"] + rise,
        )

    def pack_fields(self, profile: Profile) -> np.ndarray:
        """Theta'' of a profile at the nodes, from (12a)."""
        parts = []
        for j in range(len(self.phases)):
            Theta, _, nx, ny, _ = profile.in_phase(j, self.zeta).T
            A = profile.scalars.A
            parts.append(ny * np.cos(A * Theta) - nx * np.sin(A * Theta))
        return np.concatenate(parts)


@lru_cache(maxsize=128)
def _discretise(settings: Spectral, phases: Phases) -> SpectralDiscretisation:
    return SpectralDiscretisation(settings, phases)
