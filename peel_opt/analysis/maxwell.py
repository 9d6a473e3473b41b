"""Maxwell points of traced branches at fixed beta0, as a curve over beta0.

On a branch lambda = Lambda(alpha1) from T past its fold, the Maxwell point is where

    integral of (lambda_M - Lambda(alpha1)) alpha1 dalpha1 = 0,   from 0 to the lower branch.

It needs the fold, which the branch from T has up to beta0 = `TURN`.  There the branch meets
another one: its two halves change partners, and lambda_M ends with a vertical tangent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..base.checks import pair, whole
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged
from ..base.threads import one_thread
from ..base.units import told_apart
from ..continuation.family import Family, StepControl
from ..continuation.fill import point_errors
from ..continuation.goal import LOWEST
from ..continuation.primary import PrimaryBranch
from ..model.bond import LINEAR
from ..model.equations import kernel
from ..model.groups import PI4, Groups
from ..residual.closures import Closure
from ..residual.meshes import GROUPS
from .branch_potential import points_potential
from .potential import EffectivePotential

#: Largest beta0 at which the branch from T has a fold in lambda.
TURN = 37.54580749

#: Default range of beta0: eta/y0 from 5300 down to 0.4996; at `TURN` it is 0.4989.
RANGE = (0.05, 37.54)

#: Steps from T to the Maxwell point, and least cosine between two of them: near `TURN` the
#: branch has a corner, and longer steps cross to the other branch.
_STEPS = 64
_STRAIGHT = 0.995


@dataclass(frozen=True, eq=False)
class MaxwellCurve(Groups[np.ndarray]):
    """Maxwell points of the branches from T, by ascending beta0.

    Parameters
    ----------
    beta0, lam, alpha1 : ndarray
    error : ndarray
        Of lambda: how far it moves when every second point of the branch is left out.
    """

    beta0: np.ndarray
    lam: np.ndarray
    alpha1: np.ndarray
    error: np.ndarray

    def __len__(self) -> int:
        return len(self.beta0)

    def __repr__(self) -> str:
        return (
            f"MaxwellCurve of {len(self)} points, beta0 {self.beta0[0]:.6g} to {self.beta0[-1]:.6g}\n"
            f"├─ lambda {self.lam[0]:.6g} to {self.lam[-1]:.6g}\n"
            f"├─ eta/y0 {self.ratio[0]:.6g} to {self.ratio[-1]:.6g}\n"
            f"└─ error up to {self.error.max():.1e}"
        )


def maxwell_curve(beta0: tuple[float, float] = RANGE, *, points: int = 32) -> MaxwellCurve:
    """Trace branches at fixed beta0 and find the Maxwell point of each, under the linear law.

    Parameters
    ----------
    beta0 : tuple of float
        From and to; the end must be below 37.5458.
    points : int
        How many, at least 6; they crowd towards both ends.  Splines through the 32 of the
        default range have lambda_M to 1e-7.

    Returns
    -------
    MaxwellCurve
        Computed once for each set of arguments.

    Raises
    ------
    InvalidInput
        If the range is not one.
    NoEquilibrium
        If it goes beyond the last beta0 with a fold.

    Examples
    --------
    >>> curve = maxwell_curve((4.0, 10.0), points=6)
    >>> [float(round(curve.lam[i], 9)) for i in (0, -1)]
    [-0.239053836, -1.515119577]
    """
    low, high = pair("beta0", beta0)
    if not 0.0 < low < high:
        raise InvalidInput(f"the range of beta0 must be positive and rise, got ({low:g}, {high:g}).")
    points = whole("points", points, 6)
    if high >= TURN:
        raise no_fold(high)
    return _curve(low, high, points)


def no_fold(beta0: float) -> NoEquilibrium:
    """Return the error that says why there is no Maxwell point and no loop at this beta0."""
    mine, last = told_apart(beta0, TURN, 6)
    return NoEquilibrium(
        f"above beta0 = {last} the branch from T has no fold in lambda: asked for beta0 = {mine},"
        " where it runs to lambda = -pi^4 without coming back.",
        remedy=f"Ask for beta0 below {TURN:g}, or for a normal form, which always has a fold.",
        nearest=TURN,
    )


def stretched(beta0: np.ndarray) -> np.ndarray:
    """Variable in which lambda_M/beta0^2 is smooth up to its end."""
    return -np.log1p(-((beta0 / TURN) ** 2))


@lru_cache(maxsize=16)
@one_thread
def _curve(low: float, high: float, points: int) -> MaxwellCurve:
    first, last = stretched(np.array([low, high]))
    x = first + (last - first) * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, points)) ** 2
    values = TURN * np.sqrt(-np.expm1(-x))
    values[[0, -1]] = low, high
    found = np.array([maxwell_point(float(value)) for value in values])
    columns = [values, *found.T.copy()]
    for column in columns:
        column.flags.writeable = False  # the curve is remembered
    return MaxwellCurve(*columns)


def maxwell_point(beta0: float, steps: int = _STEPS) -> tuple[float, float, float]:
    """Return lambda_M, alpha1_M and the error of lambda_M of the branch at one beta0."""
    found = potential_of(beta0, walk_round_the_fold(beta0, steps)).maxwell()
    return *found, found.error


def potential_of(beta0: float, walk: PrimaryBranch) -> EffectivePotential:
    """Return the effective potential of a walk at fixed beta0, with the errors of its points."""
    return points_potential(beta0, walk.points, errors=point_errors(walk.family, walk.points).total)


def walk_round_the_fold(beta0: float, steps: int = _STEPS, *, beyond: float = 0.6) -> PrimaryBranch:
    """Walk from T round the fold in even steps, until lambda is past ``beyond`` times that of the fold.

    By default this is past the Maxwell point, whose share is between 0.74 and 0.89.

    Raises
    ------
    NoEquilibrium
        If there is no fold at this beta0.
    """
    if beta0 >= TURN:
        raise no_fold(beta0)
    size = 0.5 * beta0 * math.hypot(1.0 / float(kernel(np.zeros(1))["m"]), 1.0 / (1.0 + beta0))
    control = StepControl(first=size / steps, largest=size / steps, turn=_STRAIGHT)
    closure = Closure("length", math.cbrt(beta0))
    walk = PrimaryBranch(Family(LINEAR, GROUPS, closure), control=control, longest=20 * steps)
    walk.extend(lambda last: _past(walk, last.scalars.lam, beyond))
    if not walk.folds:
        raise NotConverged(
            f"no fold in lambda was met at beta0 = {beta0:.9g}.",
            remedy=f"Stay further below beta0 = {TURN:g}, where the branch has a corner.",
        )
    return walk


def _past(walk: PrimaryBranch, lam: float, share: float) -> bool:
    fold = walk.fold("LP-lambda")
    return lam < -LOWEST * PI4 or (fold is not None and lam > share * fold.point.scalars.lam)
