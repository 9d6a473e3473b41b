"""The uniform series lambda = sum beta0^(2j) P_j(a): its curve, its shapes, and where it ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev

from ..base.checks import finite, non_negative, positive
from ..base.errors import InvalidInput, NoEquilibrium, OutOfRange
from ..base.quadrature import Grid
from ..base.roots import graph_roots
from .groups import PI4
from .hierarchy import NODES, Modes, solve_hierarchy

#: Highest order offered: the coefficients are known to be right up to here, and where 40 terms
#: do not converge more of them do not either.
MAX_ORDER = 40

#: Terms beyond the order, computed to know what was cut off and not summed.
_GUARD = 3

#: (e, c) has left the disc of convergence where alpha1 exceeds the first, or beta0 alpha1 the second.
_REACH = (40.0, 2000.0)

#: Far above what any order reaches, with powers that are still numbers.
MOST_BETA0 = 1e5


class SeriesShape(NamedTuple):
    """Scaled fields of a state, those of (9) and (10), with the curvature theta'."""

    theta: np.ndarray
    curvature: np.ndarray
    Nx: np.ndarray
    Ny: np.ndarray
    y: np.ndarray


@np.errstate(under="ignore")  # close to T high powers vanish, and should
def _powers(x: np.ndarray, highest: int) -> np.ndarray:
    """x^0 ... x^highest along a new first axis."""
    table = np.broadcast_to(x, (highest + 1, *np.shape(x))).copy()
    table[0] = 1.0
    return np.multiply.accumulate(table)


@dataclass(frozen=True, eq=False)
class UniformSeries:
    """The uniform expansion lambda = sum beta0^(2j) P_j(a) with its shapes.

    Make it with `uniform_series`.

    Parameters
    ----------
    order : highest j summed
    polynomials : P_j as coefficients of a^0, a^1, ...; ``polynomials[0]`` is P_1
    modes : solutions of the linear hierarchy that the series sums, some orders further

    Notes
    -----
    Functions of ``a`` or ``alpha1`` and ``beta0`` take arrays that broadcast, except the shapes.
    At beta0 = 0 only alpha1 makes sense.  The series converges for beta0 up to 39 at
    a = -0.35 (the fold), 64 at a = -0.7, 30 at a = -1, 33 at a = 0.2.
    """

    order: int
    polynomials: tuple[np.ndarray, ...] = field(repr=False)
    modes: Modes = field(repr=False)

    def curve(self, alpha1: Any, beta0: Any) -> np.ndarray:
        """Value of lambda at the extra pressure alpha1; beta0 may be zero."""
        found: np.ndarray = self._monomials(alpha1, beta0, self.order).sum(axis=0)
        return found

    def lam(self, a: Any, beta0: Any) -> np.ndarray:
        """Value of lambda at a = p/T0 - 1."""
        return self.curve(np.multiply(a, beta0), beta0)

    @property
    def leading(self) -> tuple[float, float]:
        """Coefficients (a1, a2) of (33) for beta0 -> 0, from P_1(a) = -(a2 a + a^2)/a1."""
        _, linear, square = self.polynomials[0]
        return -1.0 / float(square), float(linear / square)

    def truncation_error(self, a: Any, beta0: Any) -> np.ndarray:
        """Estimate of the absolute error of `lam`; infinite where the series has no end in sight.

        The first terms left out are known.  Their sum of moduli is continued as a geometric
        series whose ratio is that of this block to the block before it, and doubled, since the
        ratio still creeps up.  What rounding does to the sum is added.
        """
        return self.curve_error(np.multiply(a, beta0), beta0)

    def curve_error(self, alpha1: Any, beta0: Any) -> np.ndarray:
        """Estimate of the absolute error of `curve`, as `truncation_error`; beta0 may be zero."""
        return self._error(alpha1, beta0)[0]

    @np.errstate(under="ignore")
    def _monomials(self, alpha1: Any, beta0: Any, order: int, divided: int = 0) -> np.ndarray:
        """All terms in e^(j-k) c^k with 1 <= j <= order, degree by degree, over alpha1^divided."""
        alpha1, beta0 = np.broadcast_arrays(np.asarray(alpha1, float), np.asarray(beta0, float))
        j, k = (index[1:] for index in np.tril_indices(order + 1))
        products = _powers(beta0 + alpha1, order)[j - k] * _powers(alpha1, 2 * order)[j + k - divided]
        found: np.ndarray = self.modes.lam[j, k].reshape(-1, *(1,) * alpha1.ndim) * products
        return found

    def _error(self, alpha1: Any, beta0: Any) -> tuple[np.ndarray, np.ndarray]:
        """Absolute error of lambda and the size of its terms."""
        monomials = self._monomials(alpha1, beta0, self.order + _GUARD)
        starts = np.cumsum([0, *range(2, self.order + _GUARD + 1)])
        size = np.abs(np.add.reduceat(monomials, starts))
        width = min(_GUARD, self.order)
        last = size[self.order - width : self.order].sum(axis=0)
        left_out = size[self.order : self.order + width].sum(axis=0)
        rounding = 64 * np.finfo(float).eps * np.abs(monomials).sum(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(left_out > rounding, left_out / last, 0.0)  # of noise it says nothing
            tail = np.where(ratio < 1.0, 2.0 * left_out / (1.0 - ratio), np.inf)
        return tail + rounding, size[: self.order].sum(axis=0)

    def interval(self, beta0: float, tol: float = 1e-6) -> tuple[float, float]:
        """Extra pressures around zero that the series reaches before it stops converging.

        Both ends are where the error first exceeds ``tol`` times the sum of the moduli of the
        terms, coming from alpha1 = 0.
        """
        beta0, tol = non_negative("beta0", beta0), positive("tol", tol)
        if beta0 > MOST_BETA0:
            raise OutOfRange(f"the series is of no use at beta0 = {beta0:.4g}; it reaches to about 36.")

        def last_good(points: np.ndarray) -> int:
            error, size = self._error(points, beta0)
            return int(np.argmin(error <= tol * size)) - 1

        reach = min(_REACH[0], _REACH[1] / beta0) if beta0 else _REACH[0]
        ends = []
        for sign in (-1.0, 1.0):
            coarse = sign * np.linspace(0.0, reach, 801)
            i = last_good(coarse)
            fine = np.linspace(coarse[i], coarse[i + 1], 101)
            ends.append(float(fine[last_good(fine)]))
        return ends[0], ends[1]

    def secant(self, beta0: float, tol: float = 1e-6) -> Chebyshev:
        """Return lambda/alpha1 as a polynomial in alpha1 on `interval`, exact for this order.

        Divided by alpha1 it keeps its relative accuracy near T for small beta0.
        """
        domain = self.interval(beta0, tol)
        if not domain[0] < 0.0 < domain[1]:
            raise OutOfRange(
                f"the series of order {self.order} does not reach {tol:g} anywhere at beta0 = {beta0:g}.",
                remedy="Loosen tol or raise the order.",
            )
        return Chebyshev.interpolate(
            lambda x: self._monomials(x, beta0, self.order, divided=1).sum(axis=0), 2 * self.order - 1, domain
        )

    def alpha1(self, beta0: float, lam: float, tol: float = 1e-6) -> np.ndarray:
        """Extra pressures of the detached states at lambda, ascending.

        The polynomial has up to 2 ``order`` roots, most of them artefacts.  Since alpha1 is the
        parameter of the curve, the states connected to T are exactly those in the interval
        around alpha1 = 0 where the series converges, `interval`; a root beyond it has lost the
        connection, real or not.  The straight rod alpha1 = 0 is not listed.
        """
        lam, over = finite("lam", lam), self.secant(beta0, tol)
        if beta0 == 0.0 == lam:
            return np.empty(0)
        slope = over.deriv()
        low, high = over.domain
        return graph_roots(lambda x: x * over(x), lambda x: over(x) + x * slope(x), (low, high), lam)

    def a(self, beta0: float, lam: float, tol: float = 1e-6) -> np.ndarray:
        """Roots a = p/T0 - 1 of the detached states at lambda, ascending; see `alpha1`."""
        return self.alpha1(positive("beta0", beta0), lam, tol) / beta0

    def length_ratio(self, r: float, pressure_ratio: float, tol: float = 1e-6) -> float:
        """Return sigma = sbar/eta that p/T0 holds on the unfolded state of a rod with eta/y0 = ``r``.

        Solves r sigma^4 = pi^4 + lambda with beta0 = sigma^3 under the linear law, which is
        law (8) for ``pressure_ratio`` >= 1/2.

        Raises
        ------
        NoEquilibrium
            If ``pressure_ratio`` is not between 0 and 1.
        OutOfRange
            If the series has not converged there to ``tol``, relative to the size of its terms.
        """
        r, P = positive("r", r), finite("pressure_ratio", pressure_ratio)
        if not 0.0 < P < 1.0:
            raise NoEquilibrium(f"no detached state has p/T0 = {P:g}.", remedy="Ask for 0 < p/T0 < 1.")
        a = P - 1.0
        j, k = (index[1:] for index in np.tril_indices(self.order + 1))
        starts = np.cumsum([0, *range(2, self.order + 1)])
        rows = np.add.reduceat(self.modes.lam[j, k] * P ** (j - k) * a ** (j + k), starts)
        sixfold = 6.0 * np.arange(1, self.order + 1)
        sigma = math.pi * r**-0.25
        if rows[0] < 0.0:  # then lambda < 0, and both numbers lie above the root
            sigma = min(sigma, (-PI4 / rows[0]) ** (1 / 6))
        for _ in range(100):
            terms = rows * sigma**sixfold
            slope = 4.0 * r * sigma**4 - (sixfold * terms).sum()
            step = (r * sigma**4 - PI4 - terms.sum()) / slope if slope > 0.0 else math.nan
            if not abs(step) > 4e-15:
                break
            sigma *= max(1.0 - step, 0.5)
        error, size = self._error(a * sigma**3, sigma**3)
        if not (math.isfinite(step) and error <= tol * size):
            raise OutOfRange(
                f"the series of order {self.order} has not converged at eta/y0 = {r:g}, p/T0 = {P:g}.",
                remedy=f"Raise the order (up to {MAX_ORDER}) or solve the full equations.",
            )
        return float(sigma)

    def fields(self, xi: Any, a: float, beta0: float) -> SeriesShape:
        """All fields of the state at (a, beta0), at the points ``xi`` of [0, 1]."""
        sums = self._sums(a, beta0)
        grid = Grid.gauss(NODES)
        xi = np.asarray(xi, float)
        T, K, m, V = grid.evaluate(sums[[0, 1, 3, 4]], xi)
        alpha1 = a * beta0
        y, tip = alpha1 * V, alpha1 * grid.evaluate(sums[4], 0.0)
        return SeriesShape(alpha1 * T, alpha1 * K, (beta0 + alpha1) * (tip - y), alpha1 * m, y)

    def theta(self, xi: Any, a: float, beta0: float) -> np.ndarray:
        """theta(xi)."""
        return self.fields(xi, a, beta0).theta

    def y(self, xi: Any, a: float, beta0: float) -> np.ndarray:
        """y(xi), in units of sbar."""
        return self.fields(xi, a, beta0).y

    def residual(self, a: float, beta0: float) -> float:
        """Largest defect of the summed fields in (12), over alpha1 and with (12c), (12d) integrated.

        The summed fields meet (14) term by term, so this and the boundary conditions is all
        there is to a state.
        """
        T, _, T2, m, V = self._sums(a, beta0)
        grid = Grid.gauss(NODES)
        alpha1 = a * beta0
        beta1 = PI4 + float(self.curve(alpha1, beta0))
        S = T * np.sinc(alpha1 * T / math.pi)
        half = 0.5 * T * np.sinc(0.5 * alpha1 * T / math.pi)
        versine = 2.0 * alpha1 * half * half
        Nx = (beta0 + alpha1) * (float(grid.evaluate(V, 0.0)) - V)
        load = 1.0 - (beta0 + alpha1) * versine + beta1 * V
        defects = (
            T2 - m * np.cos(alpha1 * T) + Nx * alpha1 * S,
            m - grid.from_left @ load,
            V + grid.to_right @ S,
        )
        return float(np.max(np.abs(defects)))

    def _sums(self, a: float, beta0: float) -> np.ndarray:
        """Sum of T, T', T'', m and V at the nodes."""
        a, beta0 = finite("a", a), non_negative("beta0", beta0)
        j, k = np.tril_indices(self.order + 1)
        modes = self.modes
        weights = (beta0 * beta0 * a) ** j * (1.0 + a) ** (j - k) * a**k
        return np.stack([weights @ field[j, k] for field in (modes.T, modes.K, modes.T2, modes.m, modes.V)])


@lru_cache(maxsize=16)
def uniform_series(order: int = 12) -> UniformSeries:
    """Return the uniform expansion up to beta0^(2 order), computed once per order.

    Raises
    ------
    InvalidInput
        If ``order`` is not a positive integer.
    OutOfRange
        If ``order`` exceeds what double precision is known to carry.

    Examples
    --------
    >>> series = uniform_series(12)
    >>> [float(round(c, 11)) for c in series.polynomials[0]]
    [0.0, 0.09619170467, 0.13797941098]
    """
    if isinstance(order, bool) or not isinstance(order, int | np.integer) or order < 1:
        raise InvalidInput(f"order must be a positive integer, got {order!r}.")
    if order > MAX_ORDER:
        raise OutOfRange(
            f"order {order} is beyond what double precision is known to carry.",
            remedy=f"Ask for at most {MAX_ORDER}; where that does not converge, solve the full equations.",
            nearest=MAX_ORDER,
        )
    modes = solve_hierarchy(int(order) + _GUARD)
    polynomials = tuple(_in_powers_of_a(modes.lam[j], j) for j in range(1, int(order) + 1))
    return UniformSeries(int(order), polynomials, modes)


def _in_powers_of_a(row: np.ndarray, j: int) -> np.ndarray:
    """Sum over k of row[k] (a + a^2)^(j-k) a^(2k) as coefficients of a^0 ... a^(2j)."""
    out = np.zeros(2 * j + 1)
    for k in range(j + 1):
        for i in range(j - k + 1):
            out[j + k + i] += row[k] * math.comb(j - k, i)
    return out
