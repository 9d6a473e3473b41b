"""The fold in lambda as a curve over beta0, through its turn and its cusp."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..base.checks import pair, positive, whole
from ..base.errors import InvalidInput, NotConverged
from ..base.records import Column, Table, Tabled
from ..base.threads import one_thread
from ..continuation.family import StepControl
from ..continuation.folds import FoldFamily
from ..continuation.landing import points_at
from ..continuation.points import Point
from ..continuation.special import Located, Monitor, locate
from ..model.groups import PI4, AmplitudeGroups
from ..residual.closures import Closure
from ..residual.newton import correct
from .assembly import describe
from .branch_parts import SpecialPoint

#: Where beta0 turns round along the curve; at a cusp lambda turns there too.
_TURN: tuple[tuple[str, Monitor], ...] = (("turn", lambda p: p.turn.sigma),)

#: Rate of lambda, in units of pi^4, below which it counts as turning.
_STILL = 1e-6


@dataclass(frozen=True, eq=False)
class FoldCurve(AmplitudeGroups[np.ndarray], Tabled):
    """Folds in lambda at fixed beta0, which are the folds in length of rods.

    Arrays have shape (n,) and follow the curve; beta0 is not monotone along it.

    Parameters
    ----------
    arclength, A, m, sigma, lam : ndarray
    error : ndarray
        Distance of each point from the fold on a finer mesh, in the metric of the arclength.
    special_points : tuple of SpecialPoint
        Where the curve is vertical in the (beta0, lambda) plane: "turn" of beta0, or "cusp".
    """

    arclength: np.ndarray
    A: np.ndarray
    m: np.ndarray
    sigma: np.ndarray
    lam: np.ndarray
    error: np.ndarray
    special_points: tuple[SpecialPoint, ...]
    unknowns: tuple[np.ndarray, ...] = field(repr=False, default=())

    def __len__(self) -> int:
        return len(self.lam)

    def at(self, beta0: float) -> np.ndarray:
        """All fold values of lambda at one beta0, solved for, in order along the curve."""
        closure = Closure("length", math.cbrt(positive("beta0", beta0)))
        gap, system, found = self.beta0 - beta0, FoldFamily().system, []
        gap[np.abs(gap) <= 1e-14 * beta0] = 0.0  # the ends are landed on, to rounding
        last = len(gap) - 2
        crossed = (gap[:-1] * gap[1:] < 0.0) | (gap[:-1] == 0.0)
        crossed[last] |= gap[-1] == 0.0
        if not crossed.any():
            raise InvalidInput(
                f"beta0 = {beta0:g} is not on this curve,"
                f" from {self.beta0.min():.6g} to {self.beta0.max():.6g}."
            )
        for i in np.flatnonzero(crossed):
            share = gap[i] / (gap[i] - gap[i + 1])
            start = (1.0 - share) * self.unknowns[i] + share * self.unknowns[i + 1]
            solved = correct(system, start, (closure,))
            if not solved.converged:
                raise NotConverged(
                    f"the fold at beta0 = {beta0:g} did not converge.", remedy="Give more points."
                )
            found.append(system.scalars(solved.x).lam)
        return np.array(found)

    def _table(self) -> Table:
        names = ("beta0", "lam", "alpha1", "arclength", "error")
        points = (("special point", point.numbers) for point in self.special_points)
        return Table(points, {name: Column(getattr(self, name)) for name in names})

    def __repr__(self) -> str:
        lines = [f"FoldCurve of {len(self)} points, beta0 {self.beta0.min():.6g} to {self.beta0.max():.6g}"]
        lines += [
            f"├─ {p.kind}: beta0 = {p.beta0:.9g}, lambda = {p.lam:.9g}, alpha1 = {p.alpha1:.9g} ({p.status})"
            for p in self.special_points
        ]
        return "\n".join([*lines, f"└─ error up to {self.error.max():.1e}"])


@one_thread
def fold_curve(beta0: tuple[float, float] = (0.1, 100.0), *, points: int = 80) -> FoldCurve:
    """Follow the fold in lambda over beta0 under the linear law.

    Parameters
    ----------
    beta0 : tuple of float
        From (below 36, where the fold is unique) and to, both positive.
    points : int
        About how many; the step adapts.

    Returns
    -------
    FoldCurve

    Raises
    ------
    InvalidInput
        If the range is not one.
    NotConverged
        If the curve cannot be followed to its end.

    Examples
    --------
    >>> curve = fold_curve((1, 50))
    >>> [(p.kind, round(p.beta0, 3)) for p in curve.special_points]
    [('turn', 37.546), ('cusp', 36.115)]
    """
    low, high = pair("beta0", beta0)
    if not 0.0 < low < min(high, 36.0):
        raise InvalidInput(f"beta0 must start between 0 and 36 and rise, got ({low:g}, {high:g}).")
    points = whole("points", points, 2)
    family = FoldFamily()
    length = math.asinh(math.cbrt(high)) - math.asinh(math.cbrt(low)) + 6.0
    control = StepControl(first=0.01, largest=length / points)
    walked: list[Point] = []
    for there in family.walk(family.start(low), control):
        if there.scalars.beta0 > high:
            walked += points_at(family, [walked[-1], there], "beta0", high)
            break
        walked.append(there)
        if len(walked) > 20 * points:
            raise NotConverged(f"the fold curve did not reach beta0 = {high:g}.", remedy="Give more points.")
    else:
        raise NotConverged(f"the fold curve stopped before beta0 = {high:g}.", remedy="Give more points.")
    special = locate(family, walked, _TURN)
    every = sorted([*walked, *(found.point for found in special)], key=lambda p: p.arclength)
    A, m, sigma, lam = np.array([p.tail for p in every]).T
    return FoldCurve(
        np.array([p.arclength for p in every]),
        A,
        m,
        sigma,
        lam,
        error=family.errors(every),
        special_points=tuple(_described(found, every.index(found.point)) for found in special),
        unknowns=tuple(p.x for p in every),
    )


def _described(found: Located, index: int) -> SpecialPoint:
    """Return a turn or a cusp with its numbers."""
    kind = "cusp" if abs(found.point.turn.lam) < _STILL * PI4 else "turn"
    return describe(kind, found.status, found.bracket, index, found.point.scalars)
