"""The same question put to `scipy.integrate.solve_bvp`, to compare with.

(12) in the paper's scaled variables, as a user of SciPy would write it: five fields in each
phase of the law, the answered number and the lengths of the phases as parameters, the
Jacobian by hand, and a start on the right branch, since from most others it falls back to the
straight rod.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_bvp

from ...base.errors import InvalidInput, NotConverged
from ...equilibria.result import Equilibrium

#: Points of the first mesh; solve_bvp adds what it needs.
START_POINTS = 21

#: Distance from y0 (in u = y/y0) within which a sampled point is where the phases meet.
AT_KINK = 1e-8


@dataclass(frozen=True)
class PeerSolution:
    """What solve_bvp returned for the answered number."""

    answer: float
    iterations: int
    unknowns: int
    evaluations: int


@dataclass(eq=False)
class BvpPeer:
    """A question with its start, ready for solve_bvp.

    Parameters
    ----------
    asked : {"pressure_ratio", "length_ratio", "alpha1"}
    fixed : tuple of float
        beta0 and beta1; for the length r = eta/y0 and P.
    held : tuple of bool
        For each phase from the tip, whether the bond still holds there.
    parameters : ndarray
        alpha1 or sbar/eta, and the lengths of all phases but the last.
    mesh, fields : ndarray
        Local coordinate, and theta, theta', N_x, N_y, y of every phase on it.
    """

    asked: str
    fixed: tuple[float, float]
    held: tuple[bool, ...]
    parameters: np.ndarray
    mesh: np.ndarray
    fields: np.ndarray
    evaluations: int = field(default=0, init=False)

    @classmethod
    def of(cls, eq: Equilibrium, points: int = START_POINTS) -> BvpPeer:
        """Start from a solved equilibrium, under the linear law or law (8)."""
        if eq.law not in ("linear", "cohesive"):
            raise InvalidInput(f"this comparison knows the linear law and law (8), not {eq.law!r}.")
        shape = eq.shape
        u = shape.y * (eq.beta1 / eq.beta0) if eq.law == "cohesive" else np.zeros_like(shape.y)
        breaks = shape.xi[1:-1][np.abs(u[1:-1] - 1.0) < AT_KINK]
        edges = np.array([0.0, *breaks, 1.0])
        middles = np.interp(0.5 * (edges[1:] + edges[:-1]), shape.xi, u)
        mesh = np.linspace(0.0, 1.0, points)
        where = [a + (b - a) * mesh for a, b in pairwise(edges)]
        columns = (shape.theta, shape.curvature, shape.Nx, shape.Ny, shape.y)
        fields = np.vstack([np.interp(xi, shape.xi, column) for xi in where for column in columns])
        by_length = eq.answered == "length_ratio"
        fixed = (eq.ratio, eq.pressure_ratio) if by_length else (eq.beta0, eq.beta1)
        first = eq.length_ratio if by_length else eq.alpha1
        held = tuple(bool(h <= 1.0) for h in middles)
        return cls(eq.answered, fixed, held, np.array([first, *np.diff(edges)[:-1]]), mesh, fields)

    def solve(self, tol: float, most_nodes: int = 20000) -> PeerSolution:
        """Run solve_bvp at its own tolerance, a relative residual.

        Raises
        ------
        NotConverged
            If it says so itself, or comes back with the straight rod.
        """
        self.evaluations = 0
        solution = solve_bvp(
            self._slope,
            self._ends,
            self.mesh,
            self.fields,
            self.parameters,
            fun_jac=self._slope_jacobian,
            bc_jac=self._ends_jacobian,
            tol=tol,
            max_nodes=most_nodes,
        )
        if solution.status != 0:
            raise NotConverged(f"solve_bvp: {solution.message}")
        if abs(solution.y[0, 0]) < 1e-6 * abs(self.fields[0, 0]):
            raise NotConverged("solve_bvp returned the straight rod.")
        value = float(solution.p[0])
        if self.asked == "pressure_ratio":
            value = 1.0 + value / self.fixed[0]
        unknowns = solution.y.size + solution.p.size
        return PeerSolution(value, int(solution.niter), unknowns, self.evaluations)

    def _groups(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(alpha1, beta0, beta1) and their derivatives with respect to the first parameter."""
        if self.asked == "length_ratio":
            (r, P), s = self.fixed, p[0]
            values = [(P - 1.0) * s**3, s**3, r * s**4]
            return np.array(values), np.array([3.0 * (P - 1.0) * s**2, 3.0 * s**2, 4.0 * r * s**3])
        return np.array([p[0], *self.fixed]), np.array([1.0, 0.0, 0.0])

    def _lengths(self, p: np.ndarray) -> np.ndarray:
        return np.append(p[1:], 1.0 - p[1:].sum())

    def _slope(self, _: np.ndarray, z: np.ndarray, p: np.ndarray) -> np.ndarray:
        self.evaluations += 1
        (alpha1, beta0, beta1), out = self._groups(p)[0], np.empty_like(z)
        alpha = alpha1 + beta0
        for j, (length, held) in enumerate(zip(self._lengths(p), self.held, strict=True)):
            theta, K, Nx, Ny, y = z[5 * j : 5 * j + 5]
            sine, cosine = np.sin(theta), np.cos(theta)
            load = alpha * cosine - (beta0 - beta1 * y if held else 0.0)
            rows = (K, Ny * cosine - Nx * sine, -alpha * sine, load, sine)
            out[5 * j : 5 * j + 5] = length * np.array(rows)
        return out

    def _slope_jacobian(self, _: np.ndarray, z: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        (alpha1, beta0, beta1), (d_alpha1, d_beta0, d_beta1) = self._groups(p)
        alpha, d_alpha = alpha1 + beta0, d_alpha1 + d_beta0
        n, m = z.shape
        by_z, by_p = np.zeros((n, n, m)), np.zeros((n, len(p), m))
        slope = self._slope(_, z, p)
        lengths = self._lengths(p)
        for j, (length, held) in enumerate(zip(lengths, self.held, strict=True)):
            i = 5 * j
            theta, _K, Nx, Ny, y = z[i : i + 5]
            sine, cosine = np.sin(theta), np.cos(theta)
            by_z[i, i + 1] = length
            by_z[i + 1, i] = -length * (Ny * sine + Nx * cosine)
            by_z[i + 1, i + 2], by_z[i + 1, i + 3] = -length * sine, length * cosine
            by_z[i + 2, i], by_z[i + 3, i] = -length * alpha * cosine, -length * alpha * sine
            by_z[i + 4, i] = length * cosine
            by_z[i + 3, i + 4] = length * beta1 if held else 0.0
            by_p[i + 2, 0] = -length * d_alpha * sine
            by_p[i + 3, 0] = length * (d_alpha * cosine - (d_beta0 - d_beta1 * y if held else 0.0))
            rate = slope[i : i + 5] / length
            if j < len(lengths) - 1:
                by_p[i : i + 5, 1 + j] += rate
            else:
                by_p[i : i + 5, 1:] -= rate[:, None]
        return by_z, by_p

    def _ends(self, a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
        """(14), continuity, and y = y0 where phases meet."""
        _, beta0, beta1 = self._groups(p)[0]
        inner = range(5, len(a), 5)
        switches = [b[i - 1] - beta0 / beta1 for i in inner]
        return np.array([*a[1:4], *b[-5:-3], b[-1], *(a[5:] - b[:-5]), *switches])

    def _ends_jacobian(
        self, a: np.ndarray, b: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        n, k = len(a), len(p)
        by_a, by_b, by_p = np.zeros((n + k, n)), np.zeros((n + k, n)), np.zeros((n + k, k))
        by_a[[0, 1, 2], [1, 2, 3]] = 1.0
        by_b[[3, 4, 5], [n - 5, n - 4, n - 1]] = 1.0
        joints = np.arange(n - 5)
        by_a[6 + joints, 5 + joints], by_b[6 + joints, joints] = 1.0, -1.0
        (_, beta0, beta1), (_, d_beta0, d_beta1) = self._groups(p)
        for row, i in enumerate(range(5, n, 5), n + 1):
            by_b[row, i - 1] = 1.0
            by_p[row, 0] = -(d_beta0 * beta1 - beta0 * d_beta1) / beta1**2
        return by_a, by_b, by_p
