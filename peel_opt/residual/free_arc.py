"""The part of a rod that the bond has let go, in closed form but for one curve.

From the free tip on, as long as there is no traction, a rod feels the pressure alone.  The moment of a
uniform pressure on an arc is p/2 times the square of its chord, so that with lengths in (k/p)^(1/3)

    phi' = (X^2 + Y^2) / 2,   X' = cos phi,   Y' = sin phi,   phi = X = Y = 0 at the tip:

one curve for all rods and pressures, turned by the tip angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.polynomial import polynomial

from ..model.equations import Scalars, symbolic

#: Longest arc, in (k/p)^(1/3): it has turned by 4.2, and no rod's tip turns so far before it is back at y0.
LONGEST = 4.6

#: Length of the pieces into which the cube of the distance is cut, and Chebyshev coefficients on each.  One
#: polynomial for all would take 56, and their cosines lose a hundred units in the last place.
WIDTH, COUNT = LONGEST**3 / 12, 16

#: Order of the Taylor series by which the curve is integrated, and its steps.
ORDER, STRIDE = 28, 0.23


class FreeCurve(NamedTuple):
    """The angle turned, and the place, at distances from the tip."""

    phi: np.ndarray
    X: np.ndarray
    Y: np.ndarray


def _taylor(phi: Any, X: Any, Y: Any) -> np.ndarray:
    """Taylor coefficients of the curve about one of its places, shape (ORDER + 1, 3)."""
    series = np.zeros((5, ORDER + 1), np.longdouble)
    angle, x, y, sine, cosine = series
    series[:, 0] = phi, X, Y, np.sin(phi), np.cos(phi)
    powers = np.arange(ORDER + 1)
    for k in range(ORDER):
        x[k + 1], y[k + 1] = cosine[k] / (k + 1), sine[k] / (k + 1)
        angle[k + 1] = 0.5 * (x[: k + 1] @ x[k::-1] + y[: k + 1] @ y[k::-1]) / (k + 1)
        turning = powers[1 : k + 2] * angle[1 : k + 2]
        sine[k + 1] = turning @ cosine[k::-1] / (k + 1)
        cosine[k + 1] = -(turning @ sine[k::-1]) / (k + 1)
    return series[:3].T


def _integrated(places: np.ndarray) -> np.ndarray:
    """The curve at rising distances from the tip, shape (len(places), 3), in what precision there is."""
    found, here, first = np.empty((len(places), 3), np.longdouble), np.zeros(3, np.longdouble), 0
    for step in range(math.ceil(float(places[-1]) / STRIDE)):
        series = _taylor(*here)
        last = int(np.searchsorted(places, STRIDE * (step + 1), side="right"))
        ahead = np.append(places[first:last] - STRIDE * step, STRIDE).astype(np.longdouble)
        values = polynomial.polyval(ahead, series).T
        found[first:last], here, first = values[:-1], values[-1], last
    return found


def _nodes() -> tuple[np.ndarray, np.ndarray]:
    """Chebyshev nodes of a piece, from 0 to 1, and the matrix from values there to coefficients."""
    angles = np.pi * (np.arange(COUNT, dtype=np.longdouble)[::-1] + 0.5) / COUNT
    to_series = 2.0 / COUNT * np.cos(np.outer(np.arange(COUNT), angles))
    to_series[0] *= 0.5
    return 0.5 * (1.0 + np.cos(angles)), to_series


def _pieces(longest: float) -> int:
    """Number of pieces up to a distance."""
    return math.ceil(longest**3 / WIDTH * (1.0 - 1e-12))


@lru_cache(maxsize=4)
def _curve(longest: float) -> np.ndarray:
    """Chebyshev coefficients of phi/c^3, X/c and Y/c^4 in c^3 on every piece, shape (pieces, COUNT, 3).

    Of the cube of the distance these are smooth functions, and close to the tip they keep their digits.
    """
    count, (within, to_series) = _pieces(longest), _nodes()
    cubes = (WIDTH * (np.arange(count)[:, None] + within)).ravel()
    c = np.cbrt(cubes)
    phi, X, Y = _integrated(c).T
    values = np.stack([phi / cubes, X / c, Y / (c * cubes)], axis=1).reshape(count, COUNT, 3)
    return np.ascontiguousarray(to_series @ values, dtype=float)


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
    F, G, H = np.moveaxis(_scaled(cube, longest), -1, 0)
    return FreeCurve(cube * F, c * G, c * cube * H)


def _scaled(cube: np.ndarray, longest: float) -> np.ndarray:
    """phi/c^3, X/c and Y/c^4 at cubes of the distance, in the last axis."""
    place = cube / WIDTH
    piece = np.fmin(np.fmax(place, 0.0), _pieces(longest) - 1).astype(int)  # also of what is no number
    values: np.ndarray = (polynomials(place - piece, COUNT)[..., None, :] @ _curve(longest)[piece])[..., 0, :]
    return values


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
    """Matrix to phi/(zeta c)^3, X/(zeta c), Y/(zeta c)^4, one upon the other, from the polynomials of c^3.

    That of every piece of c^3 is a column, flat: shape (3 * len(zeta) * COUNT, pieces).
    """
    within, to_series = _nodes()
    cubes = WIDTH * np.add.outer(np.arange(_pieces(LONGEST)), within)
    values = _scaled(np.multiply.outer(np.array(zeta) ** 3, cubes), LONGEST)
    columns = np.einsum("kj,zpjf->kfzp", to_series, values).astype(float)
    return columns.reshape(-1, columns.shape[-1])


def curve_expression(zeta: np.ndarray, end: ca.MX) -> FreeCurve:
    """The curve at shares ``zeta`` of an arc that ends at the distance ``end``, as CasADi expressions."""
    place, count = end**3 / WIDTH, _pieces(LONGEST)
    piece = ca.fmin(ca.floor(place), count - 1)
    basis = ca.cos(ca.acos(2.0 * (place - piece) - 1.0) * np.arange(COUNT))
    here = ca.MX(ca.DM(_along(tuple(zeta.tolist()))))[:, piece]
    values = ca.mtimes(ca.reshape(here, 3 * len(zeta), COUNT), basis)
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
