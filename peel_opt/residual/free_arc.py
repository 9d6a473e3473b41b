"""The part of a rod that the bond has let go, in closed form but for one curve.

From the free tip on, as long as there is no traction, a rod feels the pressure alone.  The moment of a
uniform pressure on an arc is p/2 times the square of its chord, so that with lengths in (k/p)^(1/3)

    phi' = (X^2 + Y^2) / 2,   X' = cos phi,   Y' = sin phi,   phi = X = Y = 0 at the tip:

one curve for all rods and pressures, turned by the tip angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.polynomial import chebyshev

from ..base.quadrature import Grid
from ..model.equations import Scalars, symbolic

#: Longest arc, in (k/p)^(1/3): it has turned by 4.2, and no rod's tip turns so far before it is back at y0.
LONGEST = 4.6

#: Chebyshev nodes of the curve, Gauss nodes of its integrals, and successive approximations until it has
#: settled to rounding.
NODES, GAUSS, ROUNDS = 56, 80, 120


class FreeCurve(NamedTuple):
    """The angle turned, and the place, at distances from the tip."""

    phi: np.ndarray
    X: np.ndarray
    Y: np.ndarray


@lru_cache(maxsize=4)
def _curve(longest: float) -> np.ndarray:
    """Chebyshev coefficients of phi/c^3, X/c and Y/c^4 in c^3 from 0 to longest^3, shape (NODES, 3).

    Of the cube of the distance these are smooth functions, and close to the tip they keep their digits.
    """
    angles = np.pi * (np.arange(NODES) + 0.5) / NODES
    to_series = 2.0 / NODES * np.cos(np.outer(np.arange(NODES), angles))
    to_series[0] *= 0.5
    grid, cube = Grid.gauss(GAUSS), 0.5 * longest**3 * (1.0 + np.cos(angles))
    # From values at the nodes to the mean of their polynomial between 0 and c, weighted with a power.
    there = np.multiply.outer(cube, grid.xi**3)
    between = chebyshev.chebvander(2.0 * there / longest**3 - 1.0, NODES - 1) @ to_series
    mean = {power: np.einsum("k,ikj->ij", grid.weights * grid.xi**power, between) for power in (0, 2, 3)}
    F, G, H = np.full(NODES, 1.0 / 6.0), np.ones(NODES), np.full(NODES, 1.0 / 24.0)
    for _ in range(ROUNDS):
        phi = cube * F
        G, H = mean[0] @ np.cos(phi), mean[3] @ (np.sin(phi) / cube)
        F = 0.5 * mean[2] @ (G * G + (cube * H) ** 2)
    return to_series @ np.stack([F, G, H], axis=1)


def polynomials(place: np.ndarray, count: int) -> np.ndarray:
    """Chebyshev polynomials between 0 and 1, the first ``count`` in the last axis, by their cosines.

    Twenty by the recurrence take as many calls of NumPy for a single place.
    """
    angle = np.arccos(np.minimum(np.maximum(2.0 * place - 1.0, -1.0), 1.0))
    values: np.ndarray = np.cos(angle[..., None] * np.arange(count))
    return values


def curve(c: np.ndarray, longest: float = LONGEST) -> FreeCurve:
    """The curve at distances 0 <= c <= longest from the tip; not a number beyond."""
    cube = np.where(np.abs(c) <= longest, c * c * c, np.nan)
    basis = polynomials(cube / longest**3, NODES)
    F, G, H = np.moveaxis((basis[..., None, :] @ _curve(longest))[..., 0, :], -1, 0)
    return FreeCurve(cube * F, c * G, c * cube * H)


def turned(place: FreeCurve, A: Any, stretch: Any, sine: Any, cosine: Any) -> tuple[Any, Any, Any, Any]:
    """Theta, K, rise above the tip and n_y at a place on the curve of a rod.

    Parameters
    ----------
    place : FreeCurve
    A : float, array or expression
        Minus the tip angle; ``sine`` and ``cosine`` are its own.
    stretch : float, array or expression
        Detached length in (k/p)^(1/3).
    sine, cosine : float, array or expression
    """
    phi, X, Y = place
    return (
        phi / A - 1.0,
        stretch * (0.5 * (X * X + Y * Y)) / A,
        (cosine * Y - sine * X) / (stretch * A),
        stretch * stretch * (cosine * X + sine * Y) / A,
    )


@lru_cache(maxsize=16)
def _along(zeta: tuple[float, ...]) -> np.ndarray:
    """Matrix from the polynomials of c^3 to phi/(zeta c)^3, X/(zeta c), Y/(zeta c)^4, one upon the other."""
    places = 0.5 * (1.0 + np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES))
    values = polynomials(np.multiply.outer(np.array(zeta) ** 3, places), NODES) @ _curve(LONGEST)
    to_series = 2.0 / NODES * polynomials(places, NODES).T
    to_series[0] *= 0.5
    return np.concatenate([part @ to_series.T for part in np.moveaxis(values, 2, 0)])


def curve_expression(zeta: np.ndarray, end: ca.MX) -> FreeCurve:
    """The curve at shares ``zeta`` of an arc that ends at the distance ``end``, as CasADi expressions."""
    angle = ca.acos(2.0 * end**3 / LONGEST**3 - 1.0)
    values = ca.mtimes(_along(tuple(zeta.tolist())), ca.cos(angle * np.arange(NODES)))
    F, G, H = ca.vertsplit(values, len(zeta))
    c = end * zeta
    return FreeCurve(c**3 * F, c * G, c**4 * H)


@lru_cache(maxsize=2)
def end_function(form: type[Scalars]) -> ca.Function:
    """Return (place on the curve, share, scalars) -> `turned` there and its gradient by share and scalars."""
    place, share, (s, scalars) = ca.SX.sym("place", 3), ca.SX.sym("share"), symbolic(form)
    phi, X, Y = ca.vertsplit(place)
    stretch = scalars.alpha ** (1.0 / 3.0)
    A = scalars.A
    values = ca.vertcat(*turned(FreeCurve(phi, X, Y), A, stretch, ca.sin(A), ca.cos(A)))
    unknown = ca.vertcat(share, s)
    along = ca.vertcat(0.5 * (X * X + Y * Y), ca.cos(phi), ca.sin(phi))  # of the curve, by the distance
    moved = ca.mtimes(ca.jacobian(values, place), ca.mtimes(along, ca.jacobian(share * stretch, unknown)))
    return ca.Function("end", [place, share, s], [values, ca.densify(ca.jacobian(values, unknown) + moved)])


@dataclass(frozen=True, eq=False)
class FreeArc:
    """The free arcs of some states, each a share of its rod.

    Parameters
    ----------
    share : ndarray, shape (states,)
        Of the detached length.
    scalars : Scalars
        Arrays of that shape.
    """

    share: np.ndarray
    scalars: Scalars

    @cached_property
    def _stretch(self) -> np.ndarray:
        """Detached length in (k/p)^(1/3)."""
        stretch: np.ndarray = np.cbrt(self.scalars.alpha)
        return stretch

    @cached_property
    def _end(self) -> FreeCurve:
        return curve(self.share * self._stretch)

    @cached_property
    def end(self) -> np.ndarray:
        """Theta, K, rise above the tip and n_y where the arc ends, shape (states, 4)."""
        A = self.scalars.A
        return np.stack(turned(self._end, A, self._stretch, np.sin(A), np.cos(A)), axis=1)

    def rates(self) -> np.ndarray:
        """Gradient of `end` by the share and by the scalars, shape (states, 4, 5)."""
        s, q, (phi, X, Y) = self.scalars, self._stretch, self._end
        Theta, K, rise, ny = self.end.T
        A, zero = s.A, np.zeros_like(s.A)
        sine, cosine = np.sin(phi - A), np.cos(phi - A)
        along = X * np.cos(phi) + Y * np.sin(phi)  # derivative of half the square of the chord
        by_c = np.stack([A * K / q, q * along, sine / q, q * q * cosine], axis=1) / A[:, None]
        by_q = np.stack([zero, K / q, -rise / q, 2.0 * ny / q], axis=1)
        by_A = [-(Theta + 1.0), -K, -ny / q**3 * A - rise, q**3 * A * rise - ny]
        # c = share q, with q^3 = alpha = sigma^3 + m A.
        by_alpha = (by_q + self.share[:, None] * by_c) * (q / (3.0 * s.alpha))[:, None]
        rates = [
            by_c * q[:, None],
            np.stack(by_A, axis=1) / A[:, None] + by_alpha * s.m[:, None],
            by_alpha * A[:, None],
            by_alpha * (3.0 * s.sigma**2)[:, None],
            np.zeros_like(by_c),
        ]
        return np.stack(rates, axis=2)

    def bend(self, zeta: np.ndarray) -> np.ndarray:
        """Theta'' at local coordinates of the arc, shape (states, len(zeta))."""
        q = self._stretch[:, None]
        phi, X, Y = curve((self.share[:, None] * q) * zeta)
        bend: np.ndarray = q * q / self.scalars.A[:, None] * (X * np.cos(phi) + Y * np.sin(phi))
        return bend

    def bend_rate(self, zeta: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Derivative of `bend` along a direction of the share and the scalars, shape (states, 5)."""
        by_share, by_A, by_m, by_sigma, _ = rates.T[:, :, None]
        s, q, share = self.scalars, self._stretch[:, None], self.share[:, None]
        A = s.A[:, None]
        by_alpha = 3.0 * s.sigma[:, None] ** 2 * by_sigma + s.m[:, None] * by_A + A * by_m
        by_q = by_alpha / (3.0 * q * q)
        phi, X, Y = curve((share * q) * zeta)
        sine, cosine = np.sin(phi), np.cos(phi)
        moment, slope = X * cosine + Y * sine, 1.0 + 0.5 * (X * X + Y * Y) * (Y * cosine - X * sine)
        rate: np.ndarray = moment * (2.0 * by_q / q - by_A / A) + slope * zeta * (by_share * q + share * by_q)
        return q * q / A * rate
