"""The model: equations (12) and (14) of the paper, with the amplitude divided out.

The straight rod solves (12) for every load, and a solver that falls back to it returns a
wrong answer that looks converged.  So the shape is written as an amplitude times a field,

    theta = A Theta,   y = A Y,   N = A n,   alpha1 = A m,   A = -theta(0),

which makes Theta(0) = -1 part of the boundary conditions.  The straight rod is no solution
of the scaled system; at A = 0 that system is the linear problem (13), whose solvability
condition is beta1 = pi^4.  The tip angle is monotone along the whole primary branch, also
where alpha1 returns to zero with the rod folded over, so it serves as amplitude everywhere.

All functions here take floats, arrays or CasADi expressions alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import casadi as ca
import numpy as np

from .bond import Affine, Piece
from .groups import AmplitudeGroups

#: Number of first-order fields: Theta, K = Theta', n_x, n_y, Y.
FIELDS = ("Theta", "K", "nx", "ny", "Y")


@dataclass(frozen=True)
class Scalars(AmplitudeGroups[Any]):
    """The four numbers that go with the fields; floats or CasADi symbols.

    Parameters
    ----------
    A : amplitude, minus the tip angle [rad]
    m : alpha1 / A
    sigma : sbar / eta, so that beta0 = sigma^3
    lam : beta1 - pi^4; kept instead of beta1, which loses the digits near T
    """

    A: Any
    m: Any
    sigma: Any
    lam: Any

    @property
    def values(self) -> tuple[Any, ...]:
        """All of them, in the order in which they stand among the unknowns."""
        return tuple(getattr(self, name) for name in SCALARS)

    @classmethod
    def of_unknowns(cls, *unknowns: Any) -> Scalars:
        """Return the scalars that stand among the unknowns of a discrete problem."""
        return cls(*unknowns)

    @staticmethod
    def as_unknowns(scalars: Scalars) -> tuple[Any, ...]:
        """What stands for some scalars among the unknowns."""
        return scalars.values

    @property
    def load(self) -> Any:
        """alpha/A, the pressure over the amplitude."""
        return self.m + self.beta0 / self.A

    @property
    def load_terms(self) -> Any:
        """Size of the terms of `load`."""
        return abs(self.m) + abs(self.beta0 / self.A)

    def less_pressure(self, P: Any) -> Any:
        """beta0 times how much p/T0 is above P."""
        return self.alpha1 - (P - 1.0) * self.beta0

    def pressure_terms(self, P: Any) -> Any:
        """Size of the terms of `less_pressure`."""
        return abs(self.alpha1) + abs((P - 1.0) * self.beta0)

    def height(self, Y: Any) -> Any:
        """u = y/y0 of a scaled height."""
        return self.A * Y * self.beta1 / self.beta0


@dataclass(frozen=True)
class LowPressure(Scalars):
    """The scalars with the digits of a pressure far below T0, which alpha1 = alpha - beta0 has lost.

    Parameters
    ----------
    A, m, sigma, lam
        As in `Scalars`.
    exact_load : alpha / A; among the unknowns in place of m
    """

    exact_load: Any

    @classmethod
    def of_unknowns(cls, *unknowns: Any) -> LowPressure:
        """Return the scalars that stand among the unknowns of a discrete problem."""
        A, load, sigma, lam = unknowns
        return cls(A, load - sigma**3 / A, sigma, lam, load)

    @staticmethod
    def as_unknowns(scalars: Scalars) -> tuple[Any, ...]:
        """What stands for some scalars among the unknowns."""
        return (scalars.A, scalars.load, scalars.sigma, scalars.lam)

    @property
    def load(self) -> Any:
        """alpha/A, the pressure over the amplitude."""
        return self.exact_load

    @property
    def load_terms(self) -> Any:
        """Size of the terms of `load`: one."""
        return abs(self.exact_load)

    @property
    def alpha(self) -> Any:
        """Scaled pressure sbar^3 p / k, equation (10)."""
        return self.load * self.A

    @property
    def pressure_ratio(self) -> Any:
        """P = p/T0 = alpha/beta0."""
        return self.alpha / self.beta0

    def less_pressure(self, P: Any) -> Any:
        """beta0 times how much p/T0 is above P."""
        return self.alpha - P * self.beta0

    def pressure_terms(self, P: Any) -> Any:
        """Size of the terms of `less_pressure`."""
        return abs(self.alpha) + abs(P * self.beta0)


#: Names of the scalars, in the order in which they stand among the unknowns.
SCALARS = tuple(f.name for f in fields(Scalars))


def symbolic(form: type[Scalars] = Scalars) -> tuple[ca.SX, Scalars]:
    """Return what stands for the scalars as one column of CasADi symbols, and them by name."""
    column = ca.SX.sym("s", len(SCALARS))
    return column, form.of_unknowns(*ca.vertsplit(column))


SMALL_ANGLE = 1e-2


def sin_over(A: Any, Theta: Any) -> Any:
    """sin(A Theta) / A without cancellation, also at A = 0."""
    x = A * Theta
    if isinstance(x, np.ndarray):
        return Theta * np.sinc(x / math.pi)
    small = ca.fabs(x) < SMALL_ANGLE
    safe = ca.if_else(small, 1.0, x)
    q = x * x
    series = 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0)))
    return Theta * ca.if_else(small, series, ca.sin(safe) / safe)


def versine_over(A: Any, Theta: Any) -> Any:
    """(1 - cos(A Theta)) / A without cancellation, also at A = 0."""
    half = sin_over(A, Theta / 2.0)
    return 2.0 * A * half * half


def vertical_load(Theta: Any, Y: Any, scalars: Scalars, piece: Piece) -> Any:
    """n_y' of (12c): pressure, less adhesion, over the amplitude."""
    upward = scalars.load if piece.lets_go else scalars.m + piece.pull(Y, scalars)
    return upward - scalars.alpha * versine_over(scalars.A, Theta)


def identity(Y_tip: Any, scalars: Scalars, piece: Piece) -> Any:
    """p/T0 - Phi(u)/u at the tip, over the amplitude and times beta0; zero by the first integrals of (12).

    p y_tip = Phi(y_tip) has the factor y_tip, of which the states are the zeros whose tip is held
    to the plate at any pressure.  Without it, they are no solutions.
    """
    if piece.lets_go:
        return scalars.load - piece.work_done * scalars.beta0 / (scalars.A * scalars.height(Y_tip))
    return scalars.m + piece.mean_pull(Y_tip, scalars)


def identity_terms(scalars: Scalars, piece: Piece) -> Any:
    """Size of the terms of `identity` where it holds; None on pieces where there are more than two."""
    if piece.lets_go:
        return scalars.load_terms + abs(scalars.load)
    return 2.0 * abs(scalars.m) if piece.is_first and isinstance(piece.drop, Affine) else None


def bending(Theta: Any, nx: Any, ny: Any, scalars: Scalars) -> Any:
    """Theta'' of (12a)."""
    A = scalars.A
    return ny * ca.cos(A * Theta) - nx * ca.sin(A * Theta)


def rhs(state: Any, scalars: Scalars, piece: Piece) -> list[Any]:
    """(12) as a first-order system for (Theta, K, n_x, n_y, Y), d/dxi."""
    Theta, K, nx, ny, Y = (state[i] for i in range(5))
    slope = sin_over(scalars.A, Theta)
    return [
        K,
        bending(Theta, nx, ny, scalars),
        -scalars.alpha * slope,
        vertical_load(Theta, Y, scalars, piece),
        slope,
    ]


def kernel(xi: np.ndarray, mode: int = 1) -> dict[str, np.ndarray]:
    """Mode of (13), (14) at beta1 = (mode pi)^4, scaled so that Theta(0) = -1.

    For ``mode`` = 1 this is (22), up to its amplitude.

    Returns
    -------
    dict
        Theta, K = Theta', ny = Theta'' and Y (arrays like ``xi``) and the number m = alpha1/A.
        The remaining field of (22) is N_x = beta0 (Y(0) - Y).
    """
    g = mode * math.pi
    s = (-1.0) ** mode
    q = s * math.exp(-g)
    grow, fade = -s * np.exp(g * (xi - 1.0)), np.exp(-g * xi)
    cosine, sine = np.cos(g * xi), np.sin(g * xi)
    # (16) with (17), and its derivatives over powers of g.
    theta = grow + fade + (1.0 - q) * cosine + (1.0 + q) * sine
    first = grow - fade - (1.0 - q) * sine + (1.0 + q) * cosine
    second = grow + fade - (1.0 - q) * cosine - (1.0 + q) * sine
    third = grow - fade + (1.0 - q) * sine - (1.0 + q) * cosine
    edge = -s - math.exp(-g) - (1.0 + q) * s  # of the third, where y = 0: alpha1
    scale = -1.0 / (2.0 * (1.0 - q))
    return {
        "Theta": scale * theta,
        "K": scale * g * first,
        "ny": scale * g**2 * second,
        "Y": scale * (third - edge) / g,
        "m": np.asarray(scale * g**3 * edge),
    }
