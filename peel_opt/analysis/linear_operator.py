"""The operator L of (21) at one beta0: kernels, projectors, and its inverse on the range.

The inverse is one small matrix, computed once.  It solves L w + mu v0 = R with <u0, w> = 0 for
any R; the multiplier mu is what the projector Q takes out of R.  That mu = <v0, R>/<v0, v0> is
the Fredholm alternative, and `LinearOperator.fredholm_defect` measures it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.quadrature import Grid
from ..base.threads import one_thread
from ..model.equations import kernel
from ..model.groups import PI4

#: Fields in the order of the paper: theta, N_x, N_y, y, alpha1.
FIELDS = 5


def adjoint_kernel(xi: np.ndarray) -> np.ndarray:
    """v0 of (25) at ``xi``, one row per equation; it does not depend on beta0."""
    pi = math.pi
    sinh, cosh = math.sinh(pi / 2), math.cosh(pi / 2)
    sine, cosine = np.sin(pi * xi), np.cos(pi * xi)
    odd, even = np.sinh(pi * (0.5 - xi)), np.cosh(pi * (0.5 - xi))
    fourth = odd - sinh * cosine - cosh * sine
    return np.stack(
        [
            odd + sinh * cosine + cosh * sine,
            np.zeros_like(xi),
            (even - sinh * sine + cosh * cosine) / pi,
            pi**2 * fourth,
            fourth / pi**2,
        ]
    )


def kernel_vector(xi: np.ndarray, beta0: float) -> np.ndarray:
    """u0 of (22) at ``xi``, one row per field, scaled to alpha1 = 1."""
    mode = kernel(xi)
    theta, y, ny = (mode[name] / mode["m"] for name in ("Theta", "Y", "ny"))
    tip = kernel(np.zeros(1))
    return np.stack([theta, beta0 * (tip["Y"][0] / tip["m"] - y), ny, y, np.ones_like(xi)])


@dataclass(frozen=True, eq=False)
class LinearOperator:
    """L at one beta0, on Gauss nodes.

    Parameters
    ----------
    beta0 : float
    nodes : Gauss nodes per field
    """

    beta0: float
    nodes: int

    @cached_property
    def grid(self) -> Grid:
        """Nodes and integration matrices."""
        return Grid.gauss(self.nodes)

    @cached_property
    def u0(self) -> np.ndarray:
        """Kernel of L, (22), fields by nodes."""
        return kernel_vector(self.grid.xi, self.beta0)

    @cached_property
    def v0(self) -> np.ndarray:
        """Kernel of the adjoint, (25), equations by nodes."""
        return adjoint_kernel(self.grid.xi)

    def inner(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Scalar product of L2, summed over the fields (last two axes)."""
        return ((first * second) @ self.grid.weights).sum(axis=-1)

    def P(self, x: np.ndarray) -> np.ndarray:
        """Projector (26) onto the kernel."""
        return self._along(self.u0, x)

    def Q(self, y: np.ndarray) -> np.ndarray:
        """Projector (27) onto the range."""
        return y - self._along(self.v0, y)

    def _along(self, direction: np.ndarray, x: np.ndarray) -> np.ndarray:
        scale = self.inner(direction, x) / self.inner(direction, direction)
        return np.asarray(scale)[..., None, None] * direction

    @cached_property
    @one_thread
    def _inverse(self) -> tuple[np.ndarray, np.ndarray]:
        """Matrices (G, multiplier): R -> w and R -> mu of L w + mu v0 = R with <u0, w> = 0."""
        n, beta0 = self.nodes, self.beta0
        J0, J1, weights = self.grid.from_left, self.grid.to_right, self.grid.weights
        twice = J1 @ J1
        one = np.ones(n)
        # Every field as a linear function of (theta'', alpha1(0)) and of the right-hand side,
        # with (14) built in; theta'(0) = 0 and <u0, w> = 0 are the last two rows.
        theta = np.hstack([twice, np.zeros((n, 1))])
        y = -J1 @ theta
        alpha1 = np.hstack([np.zeros((n, n)), one[:, None]])
        ny = J0 @ (alpha1 + PI4 * y)
        fields = np.stack([theta, -beta0 * J0 @ theta, ny, y, alpha1])
        blocks = np.zeros((FIELDS, n, FIELDS, n))
        blocks[1, :, 1] = J0
        blocks[3, :, 3] = -J1
        blocks[4, :, 4] = J0
        blocks[2, :, 2] = J0
        blocks[2, :, 3] = -PI4 * J0 @ J1
        blocks[2, :, 4] = J0 @ J0
        source = blocks.reshape(FIELDS, n, FIELDS * n)
        of_v0 = source @ self.v0.ravel()

        functional = (self.u0 * weights).ravel()
        matrix = np.zeros((n + 2, n + 2))
        matrix[:n, : n + 1] = np.hstack([np.eye(n), np.zeros((n, 1))]) - ny
        matrix[:n, n + 1] = self.v0[0] + of_v0[2]
        matrix[n, :n] = weights
        matrix[n + 1, : n + 1] = functional @ fields.reshape(-1, n + 1)
        matrix[n + 1, n + 1] = -functional @ of_v0.ravel()
        right = np.zeros((n + 2, FIELDS * n))
        right[:n] = source[2]
        right[:n, :n] += np.eye(n)
        right[n + 1] = -functional @ source.reshape(-1, FIELDS * n)
        solution = np.linalg.solve(matrix, right)
        G = fields.reshape(-1, n + 1) @ solution[: n + 1] + source.reshape(-1, FIELDS * n)
        G -= np.outer(of_v0.ravel(), solution[n + 1])
        return G, solution[n + 1]

    def solve_linear(self, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return w with L w = Q ``right`` and <u0, w> = 0, and the multiple of v0 taken out."""
        flat = np.reshape(right, (*np.shape(right)[:-2], -1))
        G, multiplier = self._inverse
        return (flat @ G.T).reshape(np.shape(right)), flat @ multiplier

    def transversality(self) -> float:
        """Share of F_(U beta1)[u0] outside the range of L, between 0 and 1; it must not vanish."""
        image = np.zeros_like(self.u0)
        image[2] = -self.u0[3]
        outside = image - self.Q(image)
        return float(np.sqrt(self.inner(outside, outside) / self.inner(image, image)))

    def kernel_defect(self) -> float:
        """Largest defect of L u0 = 0, integrated along the rod, over the size of u0."""
        theta, nx, ny, y, alpha1 = self.u0
        J0, J1 = self.grid.from_left, self.grid.to_right
        defects = (
            theta - J1 @ J1 @ ny,
            self.grid.weights @ ny,
            nx + self.beta0 * J0 @ theta,
            ny - J0 @ (alpha1 + PI4 * y),
            y + J1 @ theta,
        )
        return float(max(np.abs(d).max() for d in defects) / np.abs(self.u0).max())

    def fredholm_defect(self) -> float:
        """How far the solvability of L w = R is from <v0, R> = 0.

        L w + mu v0 = R is solved for every right-hand side the grid resolves; mu must be
        <v0, R> / <v0, v0>.  Returned is the norm of the difference over the norm of mu, as
        functionals on the lower half of the Legendre modes of each equation.
        """
        modes = np.polynomial.legendre.legvander(2.0 * self.grid.xi - 1.0, self.nodes // 2).T
        R = np.zeros((FIELDS, len(modes), FIELDS, self.nodes))
        for i in range(FIELDS):
            R[i, :, i] = modes
        mu = self.solve_linear(R)[1]
        expected = self.inner(self.v0, R) / self.inner(self.v0, self.v0)
        return float(np.linalg.norm(mu - expected) / np.linalg.norm(expected))
