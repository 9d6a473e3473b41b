"""Spectral form: Theta'' at Gauss nodes, everything else by integration.

With Theta(0) = -1 and K(0) = n_x(0) = n_y(0) = 0 built in, the only unknowns of a phase are
Theta'' at its nodes.  Converges faster than any power of the number of nodes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from ..base.checks import whole
from ..base.errors import OutOfRange
from ..base.quadrature import Grid, gauss, integration_matrix, values_matrix
from ..model.equations import LowPressure, Scalars
from .discretisation import Discretisation, Phases, Profile, Transcription
from .free_arc import curve_expression, end_function, turned
from .spectral_fields import Begin, Integration, SpectralFields

#: Share of the gain foretold by the last coefficients of a solution that is believed: in 1000 random
#: cases of 2 to 14 nodes a refinement gained less in 3, all of them by chance.
BELIEVED = 0.3

#: Share of the largest coefficient of a solution below which those of a phase are rounding.
STRAIGHT = 1e-9


@dataclass(frozen=True)
class Spectral(Transcription):
    """Global Gauss collocation of (12a) in Theta''.

    Parameters
    ----------
    nodes : int
        Gauss nodes per element.
    elements : int
        Equal elements per phase.
    low_pressure : bool
        Have alpha/A among the unknowns: digits of a pressure far below T0, for answers alone.
    free_arc : bool
        Have an outermost phase without traction in closed form instead of at nodes, for answers alone.

    Raises
    ------
    InvalidInput
        If one of them is no whole number, or too small or large.
    """

    nodes: int = 16
    elements: int = 1
    low_pressure: bool = field(default=False, repr=False)
    free_arc: bool = field(default=False, repr=False)

    def __post_init__(self) -> None:
        # A matrix of nodes x nodes is kept for each phase.
        object.__setattr__(self, "nodes", whole("nodes", self.nodes, 2, 1000))
        object.__setattr__(self, "elements", whole("elements", self.elements, 1, 1000))

    def gain_at(self, problem: SpectralDiscretisation, x: np.ndarray) -> float:
        """Factor by which half as many nodes again are sure to shrink the error of this solution.

        Where Theta'' is analytic its Legendre coefficients fall as rho^-k, and the error of scalars at
        Gauss nodes as rho^-2n: half as many nodes again gain rho^n, the largest coefficient over the last.
        A shape that is not resolved gains nothing for sure.
        """
        return self.gain_of(x[problem.fields])

    def gain_of(self, curl: np.ndarray) -> float:
        """That of a shape by its Theta'' at all nodes."""
        sizes = np.abs(curl.reshape(-1, self.nodes) @ Grid.gauss(self.nodes).analysis.T)
        # A phase where nothing but rounding bends, such as an arc under a moment alone, is resolved.
        own = np.maximum(sizes.max(axis=1), STRAIGHT * sizes.max())
        last = float((sizes[:, -2:].max(axis=1) / own).max())
        return BELIEVED / last if last > 0.0 else math.inf

    def discretise(self, phases: Phases) -> SpectralDiscretisation:
        """Return the compiled problem for these phases."""
        if self.free_arc and not (len(phases) > 1 and phases[0].lets_go and phases[0].lost is not None):
            return _discretise(replace(self, free_arc=False), phases)
        return _discretise(self, phases)

    def refined(self) -> Spectral:
        """Half as many nodes again."""
        return replace(self, nodes=self.nodes + self.nodes // 2)


#: Every one of some seventy dense matrices of a problem is of this size, 2 GB together.
MOST_UNKNOWNS = 2000


class SpectralDiscretisation(Discretisation):
    """Theta'' at the Gauss nodes of every phase."""

    settings: Spectral

    _compiled: ClassVar[tuple[str, ...]] = (*Discretisation._compiled, "_fields")

    def __init__(self, settings: Spectral, phases: Phases, extra: int = 0) -> None:
        self.settings = settings
        self.local = settings.nodes * settings.elements
        #: Phases before the first that has nodes: a free arc, or none.
        self.free = int(isinstance(settings, Spectral) and settings.free_arc)
        self.noded = len(phases) - self.free
        if (unknowns := self.local * self.noded) > MOST_UNKNOWNS:
            raise OutOfRange(
                f"a shape of {len(phases)} phases takes {unknowns} unknowns in the spectral form; the limit"
                f" is {MOST_UNKNOWNS}.",
                remedy="Give a law fewer kinks (a smooth curve through a table has none), or fewer nodes;"
                " method='collocation' has no such limit.",
            )
        super().__init__(phases, self.local * self.noded, extra)
        nodes, weights = gauss(settings.nodes)
        # On a phase of length 1: cumulative integral at its nodes, and the whole integral.
        self.zeta = np.concatenate([(e + nodes) / settings.elements for e in range(settings.elements)])
        self.whole = np.tile(weights, settings.elements) / settings.elements

    @property
    def form(self) -> type[Scalars]:
        """What stands for the scalars among the unknowns."""
        return LowPressure if self.settings.low_pressure else Scalars

    @property
    def identity_row(self) -> int | None:
        """After (12a) and K(1) = 0, if the tip is free."""
        return self.field_count + 1 if self.phases[0].lost is not None else None

    def with_form(self, *, low_pressure: bool) -> SpectralDiscretisation:
        """Return the same problem with the scalars in this form among the unknowns."""
        return _discretise(replace(self.settings, low_pressure=low_pressure), self.phases)

    def in_form(self, x: np.ndarray, other: SpectralDiscretisation) -> np.ndarray:
        """Return a solution as the same problem `with_form` has it."""
        return np.append(x[: self.tail.start], other.form.as_unknowns(self.scalars(x)))

    @cached_property
    def finer(self) -> SpectralDiscretisation:
        """The same phases on the next finer mesh."""
        return self.settings.refined().discretise(self.phases)

    @property
    def weight(self) -> int:
        """Its matrices are dense."""
        return self.size**2

    def _cumulative(self, zeta: np.ndarray) -> np.ndarray:
        """Matrix from nodal values of one phase of length 1 to integrals from 0 to ``zeta``."""
        n, elements = self.settings.nodes, self.settings.elements
        element = np.minimum((np.asarray(zeta) * elements).astype(int), elements - 1)
        out = np.zeros((len(zeta), self.local))
        for e in np.unique(element):
            here = element == e
            out[here, : e * n] = self.whole[: e * n]
            out[here, e * n : (e + 1) * n] = (
                integration_matrix(n, np.asarray(zeta)[here] * elements - e) / elements
            )
        return out

    @property
    def stretches(self) -> int:
        """Stretches of rod that are integrated over, from the tip on."""
        return self.noded

    def chain(self, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Integrals from the tip to ``zeta`` in each phase, and to the end of each phase."""
        count = self.stretches
        points = len(zeta)
        inside = np.kron(np.eye(count), self._cumulative(zeta))
        before = np.kron(np.tril(np.ones((count, count)), -1), np.ones((points, 1)) * self.whole)
        ends = np.kron(np.tril(np.ones((count, count))), self.whole)
        return inside + before, ends

    def _expressions(self, *, gradients: bool) -> SpectralFields:
        """Return the fields at the nodes and at the ends of the phases."""
        curl, lengths, tail = self.symbols()
        count = len(self.phases)
        ones = np.ones((self.local, 1))
        h = ca.vertcat(*(length * ca.DM(ones) for length in lengths[self.free :]))
        # The last length is what the others leave.
        dh = np.zeros((self.field_count, self.size))
        free = np.vstack([np.eye(count - 1), -np.ones((1, count - 1))])
        dh[:, self.inner] = np.kron(free[self.free :], ones)
        integration = Integration(np.vstack(self.chain(self.zeta)), h, dh, self.field_count)
        begin = self._begin(lengths[0], tail) if self.free else None
        return SpectralFields(
            self.phases, integration, curl, tail, form=self.form, gradients=gradients, begin=begin
        )

    def _begin(self, share: ca.MX, tail: ca.MX) -> Begin:
        """Return the fields where the free arc ends."""
        scalars = self.form.of_unknowns(*ca.vertsplit(tail))
        place = curve_expression(np.ones(1), share * scalars.alpha ** (1.0 / 3.0))
        form: Any = self.form
        values, rates = end_function(form)(ca.vertcat(*place), share, tail)
        before, between = (
            np.zeros((4, self.inner.start)),
            np.zeros((4, self.tail.start - self.inner.start - 1)),
        )
        return Begin(values, ca.horzcat(before, rates[:, 0], between, rates[:, 1:]))

    @cached_property
    def _fields(self) -> SpectralFields:
        return self._expressions(gradients=False)

    def residual_expression(self) -> ca.MX:
        """(12a) at the nodes, K(1) = 0, the equation at the edge, y = y0 at the switches."""
        return self._fields.residual()

    def linearised_expressions(self) -> tuple[ca.MX, ca.MX]:
        """Return the residual and its Jacobian, by matrix products instead of column by column."""
        fields = self._expressions(gradients=True)
        return fields.residual(), fields.jacobian()

    def sample_expression(self, zeta: np.ndarray) -> ca.MX:
        """Fields at the same local coordinates in every phase."""
        f = self._fields
        matrix, _ = self.chain(np.asarray(zeta))
        there = replace(f.integration, matrix=matrix)
        Theta0, K0, rise0, ny0 = f.start
        Theta, K = Theta0 + there.of(f.K[: self.field_count]), K0 + there.of(f.curl)
        rise, ny = rise0 + there.of(f.slope.values), ny0 + there.of(f.load.values)
        if self.free:
            A, stretch = f.scalars.A, f.scalars.alpha ** (1.0 / 3.0)
            arc = curve_expression(np.asarray(zeta), self.x[self.inner.start] * stretch)
            above = turned(arc, A, stretch, ca.sin(A), ca.cos(A))
            Theta, K, rise, ny = (ca.vertcat(*each) for each in zip(above, (Theta, K, rise, ny), strict=True))
        return ca.horzcat(Theta, K, -f.scalars.alpha * rise, ny, f.Y_tip + rise)

    def prolonged(self, x: np.ndarray, finer: Discretisation) -> np.ndarray:
        """Unknowns of the same solution on another mesh of the same phases; ``x`` may be a stack of them."""
        if not isinstance(finer, SpectralDiscretisation):
            return super().prolonged(x, finer)
        fields = x[..., : self.field_count].reshape(*x.shape[:-1], self.noded, self.local)
        there = fields @ _prolongation(self.settings, finer.settings).T
        there = there.reshape(*x.shape[:-1], finer.field_count)
        return np.concatenate([there, x[..., self.field_count :]], axis=-1)

    def restricted(self, residual: np.ndarray, finer: SpectralDiscretisation) -> np.ndarray:
        """Equations of a finer mesh, (..., n), as this mesh sees them: the adjoint of `prolonged`.

        (12a) is projected on the polynomials of this mesh, the other equations are the same on both.
        """
        balance = residual[..., : finer.field_count].reshape(*residual.shape[:-1], self.noded, finer.local)
        here = (balance * finer.whole) @ _prolongation(self.settings, finer.settings) / self.whole
        here = here.reshape(*residual.shape[:-1], self.field_count)
        return np.concatenate([here, residual[..., finer.field_count :]], axis=-1)

    def pack_fields(self, profile: Profile) -> np.ndarray:
        """Theta'' of a profile at the nodes, from (12a)."""
        parts = []
        for j in range(self.free, len(self.phases)):
            Theta, _, nx, ny, _ = profile.in_phase(j, self.zeta).T
            A = profile.scalars.A
            parts.append(ny * np.cos(A * Theta) - nx * np.sin(A * Theta))
        return np.concatenate(parts)


@lru_cache(maxsize=64)
def _prolongation(coarse: Spectral, fine: Spectral) -> np.ndarray:
    """Matrix from nodal values of one phase to those at the nodes of another mesh."""
    nodes, _ = gauss(fine.nodes)
    zeta = np.concatenate([(e + nodes) / fine.elements for e in range(fine.elements)])
    element = np.minimum((zeta * coarse.elements).astype(int), coarse.elements - 1)
    matrix = np.zeros((len(zeta), coarse.nodes * coarse.elements))
    for e in np.unique(element):
        here = element == e
        columns = slice(e * coarse.nodes, (e + 1) * coarse.nodes)
        matrix[here, columns] = values_matrix(coarse.nodes, zeta[here] * coarse.elements - e)
    return matrix


@lru_cache(maxsize=128)
def _discretise(settings: Spectral, phases: Phases) -> SpectralDiscretisation:
    return SpectralDiscretisation(settings, phases)
