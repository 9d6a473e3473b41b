"""Small motions of the detached part with its edge clamped, in piecewise polynomials, one element per phase.

The bond is one-sided, so to first order the edge does not move: perturbations keep
theta(1) = y(1) = 0.  With phi = delta theta, displacements follow by integration from the edge,

    delta x = int_xi^1 sin(theta) phi,    delta y = -int_xi^1 cos(theta) phi,

and the virtual work of bending, pressure and bond, linearised, gives K phi = mu M phi for
motions exp(+-sqrt(-mu) t) of a rod with unit mass per length.  The pressure turns with the
rod, so K is not symmetric.

Where the traction of the law jumps by [tau] at a height y_k, that
height moves along the rod by delta y / |y'|, and with it the bond that has already let go:

    delta f = -T0 tau'(y) delta y - T0 [tau] delta(xi - xi_k) delta y / |y'(xi_k)|,

a spring at the point xi_k, negative for a traction that drops.
"""

from __future__ import annotations

from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eig

from ..base.errors import NotConverged
from ..base.quadrature import Grid
from ..base.threads import one_thread
from ..model.bond import Piece
from ..model.equations import Scalars
from ..model.stretch import shared_kink
from .closures import Closure
from .discretisation import Discretisation
from .meshes import MOTIONS
from .newton import correct
from .spectral import Spectral

#: Polynomial degrees per phase of the two solves whose difference is the error.
DEGREES = (16, 22)

#: Eigenvalues reported, smallest magnitude first.
REPORTED = 4

#: How far a state may be, relative to its size, from itself on a finer mesh.
APART = 0.1

#: Imaginary part, relative to the magnitude, from which a pair counts as complex.
COMPLEX = 1e-7

#: A jump of the traction over T0 up to here is rounding.
NO_JUMP = 1e-9


class Spectrum:
    """Eigenvalues of small motions about a discrete solution, and their error.

    The state is solved again on a finer mesh and its motions in a finer basis, so that the
    difference has the error of both.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray
    given : Closure, optional
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
    def __init__(self, problem: Discretisation, x: np.ndarray, given: Closure | None = None) -> None:
        problem, x = problem.without_points(x)
        states = (problem, x), _finer(problem, x, given)
        coarse, self._fine = (Motions(*state, degree) for state, degree in zip(states, DEGREES, strict=True))
        self.mu, rough = self._fine.eigenvalues(), coarse.eigenvalues()
        self.lowest = self.mu[:REPORTED]
        size = 1.0 + np.abs(self.lowest)
        self.error = float(np.max(np.abs(self.lowest - rough[: len(self.lowest)]) / size))
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
    def volume_index(self) -> int:
        """The same count as ``index`` when the swept volume is held."""
        return _negative(self._fine.eigenvalues(fixed_volume=True), self.error)


def _finer(
    problem: Discretisation, x: np.ndarray, given: Closure | None
) -> tuple[Discretisation, np.ndarray]:
    """Return the same state on a finer mesh."""
    s, own = problem.scalars(x), problem.settings
    finer = (own.refined() if isinstance(own, Spectral) else MOTIONS).discretise(problem.phases)
    rod = Closure("ratio", s.ratio) if s.sigma else Closure("length", 0.0)
    start = problem.prolonged(x, finer)
    for second in (given, Closure("amplitude", s.A)):  # at a fold only the latter is regular
        if second is not None:
            found = correct(finer, start, (rod, second))
            here, there = x[problem.tail], found.x[finer.tail]
            if found.converged and np.max(np.abs(there - here) / (1.0 + np.abs(here))) < APART:
                return finer, found.x
    raise NotConverged(
        "the state could not be solved again on a finer mesh, to tell the error of its motions.",
        remedy="Compute it with a finer method or a smaller tol.",
    )


def _is_real(mu: np.ndarray) -> np.ndarray:
    return np.abs(mu.imag) <= COMPLEX * np.abs(mu)


def _negative(mu: np.ndarray, error: float) -> int:
    """Count the real eigenvalues that are negative beyond their error."""
    return int(np.sum(_is_real(mu) & (mu.real < -error * (1.0 + np.abs(mu)))))


class Motions:
    """Stiffness and mass of small motions in piecewise polynomials, one element per phase."""

    def __init__(self, problem: Discretisation, x: np.ndarray, degree: int) -> None:
        self.scalars, lengths = problem.scalars(x), problem.lengths(x)
        grid = Grid.gauss(degree + 8)
        nodes, weights = grid.xi, grid.weights
        count, points = len(lengths), len(nodes)
        sample = problem.sampler(nodes)(x).full() * self.scalars.A
        theta, nx, ny, y = (sample[:, i] for i in (0, 2, 3, 4))
        self.weights = np.concatenate([length * weights for length in lengths])
        value, slope = _continuous_basis(degree, nodes, lengths)
        self.value, self.slope = value, slope
        # Integrals from each point to the edge: within its phase and over those after it.
        inside = np.kron(np.diag(lengths), grid.to_right)
        after = np.kron(np.triu(np.ones((count, count)), 1) * lengths, np.ones((points, 1)) * weights)
        outward = inside + after
        self.dx = outward @ (np.sin(theta)[:, None] * value)
        self.dy = -outward @ (np.cos(theta)[:, None] * value)
        self.theta = theta
        self.force = np.cos(theta) * nx + np.sin(theta) * ny
        self.softening = np.concatenate(
            [
                _softening(piece, self.scalars, y[j * points : (j + 1) * points])
                for j, piece in enumerate(problem.phases)
            ]
        )
        angles = problem.sampler(np.ones(1))(x).full()[:-1, 0] * self.scalars.A
        neighbours = zip(pairwise(problem.phases), angles, strict=True)
        self.springs = np.array([_spring(*pair, self.scalars, angle) for pair, angle in neighbours])
        # The value of delta y at each switch: integrals over the phases after it.
        past = np.kron(np.triu(np.ones((count, count)), 1) * lengths, weights)[: count - 1]
        self.dy_at_switches = -past @ (np.cos(theta)[:, None] * value)

    @property
    def mass(self) -> np.ndarray:
        """int (dx dx + dy dy)."""
        w = self.weights[:, None]
        return self.dx.T @ (w * self.dx) + self.dy.T @ (w * self.dy)

    @property
    def stiffness(self) -> np.ndarray:
        """Bending, the turning of the reaction force, and the change of pressure and bond."""
        w, alpha = self.weights[:, None], self.scalars.alpha
        cosine, sine = np.cos(self.theta)[:, None], np.sin(self.theta)[:, None]
        load_x = -alpha * cosine * self.value
        load_y = -alpha * sine * self.value + self.softening[:, None] * self.dy
        return (
            self.slope.T @ (w * self.slope)
            - self.value.T @ (w * self.force[:, None] * self.value)
            - self.dx.T @ (w * load_x)
            - self.dy.T @ (w * load_y)
            - self.dy_at_switches.T @ (self.springs[:, None] * self.dy_at_switches)
        )

    def eigenvalues(self, *, fixed_volume: bool = False) -> np.ndarray:
        """All mu, smallest magnitude first."""
        K, M = self.stiffness, self.mass
        if fixed_volume:
            # d(swept volume) = int (-sin theta dx + cos theta dy) = 0
            swept = self.weights @ (
                -np.sin(self.theta)[:, None] * self.dx + np.cos(self.theta)[:, None] * self.dy
            )
            free = np.linalg.svd(swept[None, :])[2][1:].T
            K, M = free.T @ K @ free, free.T @ M @ free
        # M nearly vanishes on fast motions, and at a fold K is singular: neither is inverted.
        above, below = eig(M, K, right=False, homogeneous_eigvals=True)
        with np.errstate(under="ignore"):
            finite = np.abs(above) > np.finfo(float).tiny * np.abs(below)
        mu = below[finite] / above[finite]
        mu = mu[np.abs(mu) < 1e13 * np.partition(np.abs(mu), 1)[1]]
        return mu[np.lexsort((mu.imag, np.round(np.abs(mu), 9)))]

    def determinant_sign(self) -> int:
        """Sign of det K."""
        return int(np.linalg.slogdet(self.stiffness)[0])


def _softening(piece: Piece, scalars: Scalars, y: np.ndarray) -> np.ndarray:
    """-d f/d y of the bond in scaled variables: beta1 under the linear law, 0 on a free arc."""
    u = ca.SX.sym("u")
    drop = piece.drop(u)
    slope = ca.Function("slope", [u], [ca.jacobian(drop, u) if isinstance(drop, ca.SX) else ca.SX(0)])
    heights = scalars.beta1 / scalars.beta0 * y if scalars.beta0 else y
    return scalars.beta1 * np.array([float(slope(v)) for v in heights])


def _spring(before: Piece, after: Piece, scalars: Scalars, theta: float) -> float:
    """Softening of the jump of traction where one phase ends and the next begins, at angle ``theta``."""
    kink = shared_kink(before, after)
    above, below = (before, after) if before.start == kink else (after, before)
    jump = float(above.drop(kink)) - float(below.drop(kink))
    if abs(jump) < NO_JUMP:
        return 0.0
    return float(scalars.beta0 * jump / abs(np.sin(theta)))


def _continuous_basis(degree: int, nodes: np.ndarray, lengths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and xi-derivatives at the Gauss nodes of all phases; zero at the edge.

    Each phase has hats for its two ends and integrated Legendre polynomials that vanish there.
    """
    count, points = len(lengths), len(nodes)
    z = 2.0 * nodes - 1.0
    bubbles = np.eye(degree)[1:]  # P_1 ... P_{degree-1}; their integrals vanish at both ends
    inner = legendre.legval(z, legendre.legint(bubbles.T, lbnd=-1)).T
    inner_slope = 2.0 * legendre.legval(z, bubbles.T).T
    size = count + count * (degree - 1)  # a value at the start of every phase, and the bubbles
    value, slope = np.zeros((count * points, size)), np.zeros((count * points, size))
    for j in range(count):
        here = slice(j * points, (j + 1) * points)
        value[here, j], slope[here, j] = 1.0 - nodes, -1.0 / lengths[j]
        if j + 1 < count:
            value[here, j + 1], slope[here, j + 1] = nodes, 1.0 / lengths[j]
        mine = slice(count + j * (degree - 1), count + (j + 1) * (degree - 1))
        value[here, mine], slope[here, mine] = inner, inner_slope / lengths[j]
    return value, slope
