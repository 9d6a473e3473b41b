"""Numerical Lyapunov-Schmidt reduction, equations (21) to (32).

States are split as U = A (u0 + w) with u0 of (22) and w orthogonal to it.  The amplitude is
divided out of (30), so that with B = A b the pair solved is

    L w + mu v0 = -b(u0 + w; A, lambda),   <u0, w> = 0,
    h(A, lambda) = <v0, b(u0 + w)>,        g = A h,

and the trivial branch A = 0, a zero of g for every lambda, is not one of h.  The multiplier
mu is what (30) writes out with the projector Q.

With G the inverse of L on its range, the iteration (31) is a fixed point w -> -G b(u0 + w),
for a whole grid of (A, lambda) at a time.  The projector in (31c) has to be I - P, since w
lives in the complement of the kernel; the conditions that define G see to it.  Where the
iteration does not contract, Newton's method solves the same equations: w + G b(u0 + w) = 0 is
a Fredholm equation of the second kind, and its Jacobian is the identity plus G times five by
five blocks at the nodes.

The fifth field of v0 is not constant, so away from g = 0 the extra pressure of w varies along
the rod.  On g = 0 it is constant, and the extra pressure is A plus that of A w, which equals A
to first order only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..base.arrays import floats
from ..base.checks import finite, non_negative
from ..base.errors import InvalidInput
from ..base.threads import one_thread
from ..model.equations import sin_over, versine_over
from .linear_operator import FIELDS, LinearOperator
from .reduced_diagram import ReducedCurve, zero_set

#: Batches are cut so that the Jacobians of one batch stay below some 100 MB.
_BATCH = 512


@dataclass(frozen=True)
class Coefficients:
    """Leading Taylor coefficients of the reduced function.

    g = A (c11 lambda + c20 A + c30 A^2 + c21 A lambda + c12 lambda^2 + ...).
    """

    c11: float
    c20: float
    c30: float
    c21: float
    c12: float


@dataclass(frozen=True, eq=False)
class ComplementSolution:
    """Solution of (30) at one or many (A, lambda).

    Parameters
    ----------
    h : g / A
    alpha1 : extra pressure, averaged along the rod (it is constant where h = 0)
    w : correction over A, fields and nodes on the last two axes
    iterations : steps of the iteration or of Newton's method
    rate : last contraction of the iteration (NaN under Newton's method)
    defect : largest change the last step would still make
    converged : whether ``defect`` met the tolerance; `h` and `alpha1` are NaN where it did not
    """

    h: np.ndarray
    alpha1: np.ndarray
    w: np.ndarray
    iterations: np.ndarray
    rate: np.ndarray
    defect: np.ndarray
    converged: np.ndarray


@dataclass(eq=False)
class _Corrected:
    """What the two solvers of (30) work on, one entry per point."""

    w: np.ndarray
    iterations: np.ndarray
    rate: np.ndarray
    defect: np.ndarray


@dataclass(frozen=True, eq=False)
class Reduction(LinearOperator):
    """The reduced problem at one beta0; make it with `lyapunov_schmidt`.

    Parameters
    ----------
    beta0 : float
    nodes : Gauss nodes per field
    tol : largest change of the fields of w that counts as converged
    """

    tol: float

    @one_thread
    def solve(self, A: Any, lam: Any, method: str = "auto", max_iterations: int = 60) -> ComplementSolution:
        """Solve (30) for w on arrays of (A, lambda) that broadcast.

        Parameters
        ----------
        A, lam : array_like
        method : {"auto", "iteration", "newton"}
            The iteration (31), Newton's method, or the second where the first does not converge.
        max_iterations : int
            Bound on the steps of the iteration; Newton's method takes at most 25.
        """
        if method not in ("auto", "iteration", "newton"):
            raise InvalidInput(f"method must be 'auto', 'iteration' or 'newton', got {method!r}.")
        A, lam = np.broadcast_arrays(floats("A", A), floats("lam", lam))
        if not (np.isfinite(A).all() and np.isfinite(lam).all()):
            raise InvalidInput("A and lambda must be finite.")
        shape, A, lam = A.shape, A.ravel(), lam.ravel()
        w = np.zeros((A.size, FIELDS, self.nodes))
        state = _Corrected(w, np.zeros(A.size, int), np.full(A.size, np.nan), np.full(A.size, np.inf))
        if method != "newton":
            self._iterate(state, A, lam, max_iterations)
        todo = np.flatnonzero(~(state.defect <= self.tol)) if method != "iteration" else np.empty(0, int)
        for start in range(0, todo.size, _BATCH):
            self._newton(state, A, lam, todo[start : start + _BATCH])
        converged = state.defect <= self.tol
        left = _remainder(self.beta0, self.u0 + state.w, A, lam)
        h = np.where(converged, self.inner(self.v0, left), np.nan)
        mean = state.w[:, 4] @ self.grid.weights
        return ComplementSolution(
            h.reshape(shape),
            np.where(converged, A * (1.0 + mean), np.nan).reshape(shape),
            state.w.reshape(*shape, FIELDS, self.nodes),
            state.iterations.reshape(shape),
            state.rate.reshape(shape),
            state.defect.reshape(shape),
            converged.reshape(shape),
        )

    def _iterate(self, state: _Corrected, A: np.ndarray, lam: np.ndarray, max_iterations: int) -> None:
        """The iteration (31), for all points that still change, until they settle or grow."""
        active = np.arange(A.size)
        for _ in range(max_iterations):
            if not active.size:
                return
            w = state.w[active]
            new = -self.solve_linear(_remainder(self.beta0, self.u0 + w, A[active], lam[active]))[0]
            change = np.abs(new - w).max(axis=(-2, -1))
            previous = state.defect[active]
            state.rate[active] = np.where(
                np.isfinite(previous), change / np.maximum(previous, 1e-300), np.nan
            )
            state.w[active], state.defect[active] = new, change
            state.iterations[active] += 1
            active = active[(change > self.tol) & (np.abs(new).max(axis=(-2, -1)) < 1e3)]

    def _newton(self, state: _Corrected, A: np.ndarray, lam: np.ndarray, active: np.ndarray) -> None:
        """Newton's method from w = 0, for points the iteration has not solved."""
        size = FIELDS * self.nodes
        G = self._inverse[0].reshape(size, FIELDS, self.nodes)
        state.w[active], state.rate[active], state.iterations[active] = 0.0, np.nan, 0
        for _ in range(25):
            if not active.size:
                return
            w, A_, lam_ = state.w[active], A[active], lam[active]
            residual = w + self.solve_linear(_remainder(self.beta0, self.u0 + w, A_, lam_))[0]
            D = _remainder_derivative(self.beta0, self.u0 + w, A_, lam_)
            J = np.einsum("pen,befn->bpfn", G, D, optimize=True).reshape(-1, size, size)
            J += np.eye(size)
            try:
                step = np.linalg.solve(J, residual.reshape(-1, size, 1))[..., 0].reshape(w.shape)
            except np.linalg.LinAlgError:
                state.defect[active] = np.inf
                return
            state.w[active] = w - step
            state.iterations[active] += 1
            state.defect[active] = np.abs(step).max(axis=(-2, -1))
            active = active[(state.defect[active] > self.tol) & (state.defect[active] < 1e3)]

    def g(self, A: Any, lam: Any) -> np.ndarray:
        """Reduced function (32); NaN where (30) has not been solved."""
        return floats("A", A) * self.solve(A, lam).h

    def alpha1(self, A: Any, lam: Any) -> np.ndarray:
        """Extra pressure of A (u0 + w): A to first order, exact where g = 0."""
        return self.solve(A, lam).alpha1

    @cached_property
    def coefficients(self) -> Coefficients:
        """Leading Taylor coefficients of g, from linear problems, not from differences."""
        theta, nx, ny, _, alpha1 = self.u0
        zero = np.zeros(self.nodes)
        half_beta0 = 0.5 * self.beta0
        quadratic = np.stack([nx * theta, alpha1 * theta, half_beta0 * theta**2, zero, zero])
        cubic = np.stack(
            [ny * theta**2 / 2, -self.beta0 * theta**3 / 6, alpha1 * theta**2 / 2, theta**3 / 6, zero]
        )

        def by_lambda(w: np.ndarray) -> np.ndarray:
            return np.stack([zero, zero, -w[3], zero, zero])

        def mixed(w: np.ndarray) -> np.ndarray:
            rows = [nx * w[0] + w[1] * theta, alpha1 * w[0] + w[4] * theta, self.beta0 * theta * w[0]]
            return np.stack([*rows, zero, zero])

        w_A = -self.solve_linear(quadratic)[0]
        w_lam = -self.solve_linear(by_lambda(self.u0))[0]

        def project(R: np.ndarray) -> float:
            return float(self.inner(self.v0, R))

        return Coefficients(
            c11=project(by_lambda(self.u0)),
            c20=project(quadratic),
            c30=project(mixed(w_A) + cubic),
            c21=project(mixed(w_lam) + by_lambda(w_A)),
            c12=project(by_lambda(w_lam)),
        )

    def diagram(
        self,
        lam_range: tuple[float, float] = (-1.0, 3.0),
        A_range: tuple[float, float] = (-7.0, 5.0),
        samples: tuple[int, int] = (13, 121),
    ) -> list[ReducedCurve]:
        """Zero set of g in a window, off the trivial branch A = 0 (Fig 4).

        A curve has one point for each of the ``samples[1]`` amplitudes at which h = g/A changes
        sign between two of the ``samples[0]`` values of lambda; lambda is then refined until
        the bracket or h is down to rounding.  Where (30) could not be solved there is no point.

        Raises
        ------
        InvalidInput
            If a range does not ascend, or there are fewer than two samples.
        NotConverged
            If a point cannot be refined.
        """
        return zero_set(self, lam_range, A_range, samples)


def lyapunov_schmidt(beta0: float, *, nodes: int = 24, tol: float = 1e-12) -> Reduction:
    """Return the numerical Lyapunov-Schmidt reduction (26) to (32) at one beta0 >= 0.

    Parameters
    ----------
    beta0 : float
        (sbar/eta)^3; zero is allowed.
    nodes : int, optional
        Gauss nodes per field, 8 to 64; 24 carry beta0 = 4 over Fig 4 to rounding.
    tol : float, optional
        Largest change of the fields of w (scaled to alpha1 = 1) that counts as converged.

    Returns
    -------
    Reduction

    Raises
    ------
    InvalidInput
        If ``beta0`` is negative or not finite, ``nodes`` or ``tol`` out of bounds.

    Examples
    --------
    >>> red = lyapunov_schmidt(4.0)
    >>> round(red.coefficients.c11, 12)  # cosh(pi/2) / (2 pi^5)
    0.004099701103
    """
    if isinstance(nodes, bool) or not isinstance(nodes, int | np.integer) or not 8 <= nodes <= 64:
        raise InvalidInput(f"nodes must be an integer from 8 to 64, got {nodes!r}.")
    if not 1e-14 <= finite("tol", tol) <= 1e-2:
        raise InvalidInput(f"tol must lie between 1e-14 and 1e-2, got {tol:g}.")
    return Reduction(non_negative("beta0", beta0), int(nodes), float(tol))


def _remainder(beta0: float, V: np.ndarray, A: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Nonlinear part B(A V)/A of (29), at A = 0 too."""
    A, lam = A[..., None], lam[..., None]
    theta, nx, ny, y, alpha1 = (V[..., i, :] for i in range(FIELDS))
    slope, versine = sin_over(A, theta), versine_over(A, theta)
    b = np.zeros_like(V)
    b[..., 0, :] = A * (nx * slope + ny * versine)
    b[..., 1, :] = beta0 * (slope - theta) + A * alpha1 * slope
    b[..., 2, :] = (beta0 + A * alpha1) * versine - lam * y
    b[..., 3, :] = theta - slope
    return b


def _remainder_derivative(beta0: float, V: np.ndarray, A: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Derivative of b with respect to V: equation by field by node."""
    A, lam = A[..., None], lam[..., None]
    theta, nx, ny, _, alpha1 = (V[..., i, :] for i in range(FIELDS))
    sine, cosine = A * sin_over(A, theta), np.cos(A * theta)
    versine = versine_over(A, theta)
    load = beta0 + A * alpha1
    D = np.zeros((*V.shape[:-2], FIELDS, FIELDS, V.shape[-1]))
    D[..., 0, 0, :] = A * (nx * cosine + ny * sine)
    D[..., 0, 1, :] = sine
    D[..., 0, 2, :] = A * versine
    D[..., 1, 0, :] = load * cosine - beta0
    D[..., 1, 4, :] = sine
    D[..., 2, 0, :] = load * sine
    D[..., 2, 3, :] = -lam
    D[..., 2, 4, :] = A * versine
    D[..., 3, 0, :] = A * versine
    return D
