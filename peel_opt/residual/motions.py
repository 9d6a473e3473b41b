"""Small motions of the detached part with its edge clamped, in piecewise polynomials, one element per phase.

The bond is one-sided, so to first order the edge carries no force as it moves: perturbations keep
theta(1) = y(1) = 0.  With phi = delta theta, displacements follow by integration from the edge,

    delta x = int_xi^1 sin(theta) phi,    delta y = -int_xi^1 cos(theta) phi,

and the virtual work of bending, loads and bond, linearised, gives K phi = mu M phi for
motions exp(+-sqrt(-mu) t) of a rod with unit mass per length, or exp(-mu t) under as much drag.  A
pressure turns with the rod, so K is not symmetric.

The edge does follow, to where theta' is what it was there: by -phi'/theta'', which a load that
stretches with the detached length feels at once.  Where the front itself has an energy, theta' is
not zero there, and both conditions of a front that moves make phi' = phi theta''/theta' at the edge.

Where the traction of the law jumps by [tau] at a height y_k, that
height moves along the rod by delta y / |y'|, and with it the bond that has already let go:

    delta f = -T0 tau'(y) delta y - T0 [tau] delta(xi - xi_k) delta y / |y'(xi_k)|,

a spring at the point xi_k, negative for a traction that drops.

Where the rod stretches, delta eps is a field of its own, with

    delta r' = delta eps t + (1 + eps) phi e,    T = -N,

and the form gains EA delta eps^2 + 2 delta eps phi N.e.  Glued with a strain eps_a, the edge is shifted by
(eps - eps_a)/theta' phi as its front moves, whose condition has the change of T_x beside that of theta'.

On an elastic layer the attached rod moves, too, clamped where all has decayed.  The front, at a gap of T0/K,
is one more height at which the load jumps, and places count from where it is.
"""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eig, null_space

from ..base.quadrature import Grid
from ..base.threads import one_thread
from .closures import Closure
from .discretisation import Discretisation
from .load_rates import LoadRates, plain_load_rates
from .scene_load_rates import scene_load_rates
from .scene_spectral import SceneDiscretisation
from .solved_again import solved_again

#: Polynomial degrees per phase: the difference of the solves with two neighbouring ones is the error, and the
#: first two are taken where it is small enough.  A folded rod that stays within y0 is one long phase.
DEGREES, ENOUGH = (16, 22, 30), 1e-8

#: Eigenvalues reported, smallest magnitude first.
REPORTED = 4

#: An eigenvalue, over the next, up to which it is that of a strip that shifts along its wall.
SHIFT = 1e-6

#: Imaginary part, relative to the magnitude, from which a pair counts as complex.
COMPLEX = 1e-7


class Spectrum:
    """Eigenvalues of small motions about a discrete solution, and their error.

    The state is solved again on a finer mesh and its motions in a finer basis, so that the
    difference has the error of both.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray
    *given : Closure
        What the state was asked at, beside the rod; without it the finer state is that of the
        same tip angle.

    Attributes
    ----------
    mu : ndarray of complex
        All eigenvalues in units of k/(rho sbar^4), smallest magnitude first.
    lowest : ndarray of complex
        The first of them.
    error : float
        Largest relative change of these between the two discretisations.
    index : int
        Number of negative real eigenvalues; one within its error of zero does not count.
    marginal : bool
        Whether an eigenvalue is within its error of zero, so that its sign is not known.

    Raises
    ------
    NotConverged
        If the state could not be solved again.
    """

    @one_thread
    def __init__(self, problem: Discretisation, x: np.ndarray, *given: Closure) -> None:
        problem, x = problem.without_points(x)
        states = (problem, x), solved_again(problem, x, given)
        for degrees in pairwise(DEGREES):
            coarse, self._fine = (Motions(*s, degree) for s, degree in zip(states, degrees, strict=True))
            self.mu, rough = self._fine.eigenvalues(), coarse.eigenvalues()
            self.lowest = self.mu[:REPORTED]
            size = 1.0 + np.abs(self.lowest)
            self.error = float(np.max(np.abs(self.lowest - rough[: len(self.lowest)]) / size))
            if self.error <= ENOUGH:
                break
        # Where a traction drops, a negative eigenvalue may lie beyond those reported.
        self.index, seen = _negative(self.mu, self.error), _negative(rough, self.error)
        # Where a real eigenvalue vanishes, as at contact, its sign is that of rounding.
        vanishes = np.any(_is_real(self.lowest) & (np.abs(self.lowest.real) <= self.error * size))
        self.marginal = bool(vanishes) or self.index != seen

    @property
    def flutter(self) -> bool:
        """Whether a pair of the lowest is complex."""
        return not _is_real(self.lowest).all()

    @one_thread
    def determinant_sign(self) -> int:
        """Sign of det K, 0 where it is not known."""
        return 0 if self.marginal else self._fine.determinant_sign()

    @one_thread
    def volume_index(self) -> int | None:
        """The same count as ``index`` when the swept volume is held; None where no pressure does that."""
        if not self._fine.rates.encloses:
            return None
        return _negative(self._fine.eigenvalues(fixed_volume=True), self.error)


def _is_real(mu: np.ndarray) -> np.ndarray:
    return np.abs(mu.imag) <= COMPLEX * np.abs(mu)


def _negative(mu: np.ndarray, error: float) -> int:
    """Count the real eigenvalues that are negative beyond their error."""
    return int(np.sum(_is_real(mu) & (mu.real < -error * (1.0 + np.abs(mu)))))


class Motions:
    """Stiffness and mass of small motions in piecewise polynomials, one element per phase.

    Attributes
    ----------
    mass : ndarray, shape (m, m)
        int (dx dx + dy dy), of unit mass per length; the same for a drag that is the same in all directions.
    stiffness : ndarray, shape (m, m)
        Bending, the turning of the reaction force, and the change of the loads.
    """

    def __init__(self, problem: Discretisation, x: np.ndarray, degree: int) -> None:
        grid = Grid.gauss(degree + 8)
        self.rates = _load_rates(problem, x, grid.xi)
        self.lengths = np.concatenate([problem.lengths(x), self.rates.attached])
        self.detached = len(problem.phases) * len(grid.xi)
        self.weights = np.concatenate([length * grid.weights for length in self.lengths])
        moves = self.rates.curl != 0.0
        self.value, self.slope = continuous_basis(degree, grid.xi, self.lengths, free_edge=moves)
        #: How the strain changes; nothing where the rod does not stretch.
        self.strain = np.zeros_like(self.value)
        stretch, long = self.rates.stretching, np.ones((len(self.weights), 1))
        if stretch is not None:
            own = np.kron(np.eye(len(self.lengths)), legendre.legvander(2.0 * grid.xi - 1.0, degree - 1))
            turns, none = self.value.shape[1], np.zeros((len(self.weights), own.shape[1]))
            self.value, self.slope = np.hstack([self.value, none]), np.hstack([self.slope, none])
            self.strain = np.hstack([np.zeros((len(self.weights), turns)), own])
            long = 1.0 + stretch.strain[:, None]
        # Integrals from each point to the edge: within its phase and over those after it.
        count, points = len(self.lengths), len(grid.xi)
        inside = np.kron(np.diag(self.lengths), grid.to_right)
        over = np.ones((points, 1)) * grid.weights
        outward = inside + np.kron(np.triu(np.ones((count, count)), 1) * self.lengths, over)
        sine, cosine = np.sin(self.rates.theta)[:, None], np.cos(self.rates.theta)[:, None]
        self.rate_x = long * sine * self.value - cosine * self.strain
        self.rate_y = -long * cosine * self.value - sine * self.strain
        #: x of the edge: the rod comes off with another strain than it was glued with.
        self.edge_x = self._at_edge() * (stretch.parted / self.rates.curl if stretch is not None else 0.0)
        self.dx, self.dy = outward @ self.rate_x + self.edge_x, outward @ self.rate_y
        #: theta, x and y of the tip.
        turn = np.eye(1, self.value.shape[1])[0]
        tip_x = self.weights @ self.rate_x + self.edge_x
        self.tip = np.stack([turn, tip_x, self.weights @ self.rate_y])
        self.mass = self.dx.T @ self._weighted(self.dx) + self.dy.T @ self._weighted(self.dy)
        self.stiffness = self._stiffness()

    def _weighted(self, field: np.ndarray) -> np.ndarray:
        return self.weights[:, None] * field

    def _stiffness(self) -> np.ndarray:
        r, place = self.rates, np.stack([self.dx, self.dy])
        seen = place
        if r.front is not None:  # position counts from the front, which moves on a layer
            seen = place - np.stack([self._at_switch(r.front.phase)[1], np.zeros_like(self.dy[0])])[:, None]
        pull = np.cos(r.theta) * r.nx + np.sin(r.theta) * r.ny
        load = r.by_theta.T[:, :, None] * self.value + np.einsum("nij,jnm->inm", r.by_place, seen)
        if r.by_length is not None:
            load = load + r.by_length.T[:, :, None] * self._front()
        long = np.ones_like(pull)
        K: np.ndarray = self.slope.T @ self._weighted(self.slope)
        if r.stretching is not None:
            across = np.cos(r.theta) * r.ny - np.sin(r.theta) * r.nx
            turned = self.strain.T @ self._weighted(across[:, None] * self.value)
            K += r.stretching.stiffness * self.strain.T @ self._weighted(self.strain) + turned + turned.T
            load = load + r.stretching.by_strain.T[:, :, None] * self.strain
            long = 1.0 + r.stretching.strain
        K -= self.value.T @ self._weighted((long * pull)[:, None] * self.value)
        K -= sum(at.T @ self._weighted(part) for at, part in zip(place, load, strict=True))
        for switch in (*r.switches, *((r.front,) if r.front is not None else ())):
            there = self._at_switch(switch.phase)
            K += np.outer(switch.jump @ there[1:], switch.rates @ there) / switch.slope
        if r.tip is not None:
            K -= self.tip[1:].T @ r.tip @ self.tip[1:]
        if r.curl:
            edge, bend = self._at_edge(), r.bend
            if r.stretching is not None:  # what pulls the edge along changes as it moves
                bend -= r.stretching.parted / r.curl * r.stretching.load
            K -= bend / r.curl * np.outer(edge, edge)
        return K

    def _at_switch(self, phase: int) -> np.ndarray:
        """theta, x and y where a phase ends: integrals over the phases after it."""
        start = (phase + 1) * (len(self.weights) // len(self.lengths))
        value = np.eye(1, self.value.shape[1], phase + 1)[0]
        x, y = (self.weights[start:] @ rate[start:] for rate in (self.rate_x, self.rate_y))
        return np.stack([value, x + self.edge_x, y])

    def _at_edge(self) -> np.ndarray:
        """theta at the edge, zero unless it is free."""
        if not self.rates.curl:
            return np.zeros(self.value.shape[1])
        return np.eye(1, self.value.shape[1], len(self.lengths))[0]

    def _front(self) -> np.ndarray:
        """How far the edge moves: theta' stays what it is there, and theta that of the wall; or the gap."""
        if self.rates.front is not None:
            there = self._at_switch(self.rates.front.phase)
            return -(self.rates.front.rates @ there) / self.rates.front.slope
        if self.rates.curl:
            return -self._at_edge() / self.rates.curl
        return -_slope_at_edge(self.value.shape[1], self.lengths) / self.rates.bend

    @cached_property
    def _kinds(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Stiffness and mass of each kind of motions."""
        return [self._held(hold @ self.tip) for hold in self.rates.holds]

    def _held(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness and mass where some linear forms vanish."""
        if not len(rows):
            return self.stiffness, self.mass
        free = null_space(rows)
        return free.T @ self.stiffness @ free, free.T @ self.mass @ free

    def eigenvalues(self, *, fixed_volume: bool = False) -> np.ndarray:
        """All mu, smallest magnitude first."""
        kinds = self._kinds
        if fixed_volume:
            # d(swept volume) = int (-sin theta dx + cos theta dy) = 0
            # On a layer the pressure is on the detached rod alone.
            under = self.weights * (np.arange(len(self.weights)) < self.detached)
            if self.rates.stretching is not None:
                under = under * (1.0 + self.rates.stretching.strain)
            sine, cosine = np.sin(self.rates.theta), np.cos(self.rates.theta)
            swept = (under * -sine) @ self.dx + (under * cosine) @ self.dy
            kinds = [self._held(np.vstack([self.rates.holds[0] @ self.tip, swept])), *kinds[1:]]
        mu = np.concatenate([_finite(*kinds[0]), *(_without_shift(_finite(*kind)) for kind in kinds[1:])])
        return mu[np.lexsort((mu.imag, np.round(np.abs(mu), 9)))]

    def determinant_sign(self) -> int:
        """Sign of det K; without the shift of a strip, along which it vanishes."""
        first, *others = self._kinds
        negative = sum(np.sum(_without_shift(_finite(*kind)).real < 0.0) for kind in others)
        return int(np.linalg.slogdet(first[0])[0]) * (-1) ** int(negative)


def _load_rates(problem: Discretisation, x: np.ndarray, zeta: np.ndarray) -> LoadRates:
    if isinstance(problem, SceneDiscretisation):
        return scene_load_rates(problem, x, zeta)
    return plain_load_rates(problem, x, zeta)


def _finite(K: np.ndarray, M: np.ndarray) -> np.ndarray:
    """Eigenvalues of K phi = mu M phi that the basis holds."""
    # M nearly vanishes on fast motions, and at a fold K is singular: neither is inverted.
    above, below = eig(M, K, right=False, homogeneous_eigvals=True)
    with np.errstate(under="ignore"):
        finite = np.abs(above) > np.finfo(float).tiny * np.abs(below)
    mu = below[finite] / above[finite]
    kept: np.ndarray = mu[np.abs(mu) < 1e13 * np.partition(np.abs(mu), 1)[1]]
    return kept


def _without_shift(mu: np.ndarray) -> np.ndarray:
    """Leave out the eigenvalue zero of a ruck that wanders along a wall which is the same everywhere."""
    size = np.abs(mu)
    return np.delete(mu, np.argmin(size)) if size.min() <= SHIFT * np.partition(size, 1)[1] else mu


def continuous_basis(
    degree: int, nodes: np.ndarray, lengths: np.ndarray, *, free_edge: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Values and xi-derivatives at the Gauss nodes of all phases; zero at the edge unless it is free.

    Each phase has hats for its two ends and integrated Legendre polynomials that vanish there.
    """
    count, points = len(lengths), len(nodes)
    z = 2.0 * nodes - 1.0
    bubbles = np.eye(degree)[1:]  # P_1 ... P_{degree-1}; their integrals vanish at both ends
    inner = legendre.legval(z, legendre.legint(bubbles.T, lbnd=-1)).T
    inner_slope = 2.0 * legendre.legval(z, bubbles.T).T
    hats = count + free_edge  # a value at the start of every phase, and at the edge
    size = hats + count * (degree - 1)
    value, slope = np.zeros((count * points, size)), np.zeros((count * points, size))
    for j in range(count):
        here = slice(j * points, (j + 1) * points)
        value[here, j], slope[here, j] = 1.0 - nodes, -1.0 / lengths[j]
        if j + 1 < hats:
            value[here, j + 1], slope[here, j + 1] = nodes, 1.0 / lengths[j]
        mine = slice(hats + j * (degree - 1), hats + (j + 1) * (degree - 1))
        value[here, mine], slope[here, mine] = inner, inner_slope / lengths[j]
    return value, slope


def _slope_at_edge(size: int, lengths: np.ndarray) -> np.ndarray:
    """xi-derivative at a clamped edge."""
    slope = np.zeros(size)
    slope[len(lengths) - 1] = -1.0
    slope[-(size // len(lengths) - 1) :] = 2.0  # P_k(1) = 1
    return slope / float(lengths[-1])
