"""How the limits of a rod move with r = eta/y0: its folds, and its Maxwell point.

At a fold the folding number does not move along the branch, so that its derivative with respect
to r is that of the residual alone (envelope theorem): no second derivative is needed, and the
small error of the fold's location does not enter to first order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..base.errors import InvalidInput, NoEquilibrium, NotConverged, PeelOptError
from ..continuation.family import Family
from ..continuation.goal import minimum_pressure
from ..continuation.landing import UNFINISHED
from ..continuation.primary import PrimaryBranch
from ..continuation.special import Located
from ..equilibria.unfolded import CUSP
from ..model.bond import CohesiveLaw
from ..model.equations import Scalars
from ..model.rod import require_ratio
from ..residual.closures import Closure, Plane
from ..residual.linear import Linearised, rate
from .flaws import on_both_meshes
from .maxwell_derivative import maxwell_gradient
from .surface import Gradient

#: eta/y0 up to which the two folds lie closer together than the points of the walk.
TOO_CLOSE = 0.32106

#: Rounding of a located fold and of one solve, relative to value and derivative.
FOLD_ROUNDING = 1e-11


@dataclass(frozen=True)
class Limit:
    """A scalar function of r, in units of T0 or eta, with its derivative.

    Parameters
    ----------
    kind : {"pressure", "length"}
    differentiate : callable
        From r and the law to the `Gradient` of the number; errors are absolute.
    """

    kind: str
    differentiate: Callable[[float, CohesiveLaw], Gradient]


def fold_gradient(ratio: float, law: CohesiveLaw, which: str) -> Gradient:
    """Return P or sigma at a fold of a rod's branch, with its derivative by r.

    Parameters
    ----------
    ratio : float
    law : CohesiveLaw
    which : {"readhesion_pressure", "least_length", "longest_length"}

    Raises
    ------
    OutOfRange
        If eta/y0 is outside the range of the walk.
    NoEquilibrium
        If the branch has no such fold.
    """
    require_ratio(ratio)
    closure, found = Closure("ratio", ratio), []
    read: Callable[[Scalars], float] = PRESSURE if which == "readhesion_pressure" else LENGTH
    for fold in on_both_meshes(law, closure, FOLDS[which]):
        point = fold.point
        at = Linearised.at(point.problem, point.x, closure, Plane.facing(point.direction))
        change = at.response()[point.problem.tail, 0]
        found.append((float(read(point.scalars)), rate(read, point.tail, change)))
    coarse, fine = found
    error = abs(fine[1] - coarse[1]) + FOLD_ROUNDING * (abs(fine[1]) + abs(fine[0]) / ratio)
    return Gradient(fine[0], np.array([fine[1]]), np.array([error]), np.array([ratio]))


def PRESSURE(s: Scalars) -> float:
    """p/T0."""
    return s.pressure_ratio


def LENGTH(s: Scalars) -> float:
    """sbar/eta."""
    return s.sigma


def _least_length(branch: PrimaryBranch) -> Located:
    """The first fold in length before the minimum pressure: the paper's."""
    minimum = minimum_pressure(branch)
    fold = branch.fold("LP-length")
    if fold is None or fold.point.arclength > minimum.point.arclength:
        raise _no_fold(branch.family, "the unfolded states have no fold in length")
    return fold


def _longest_length(branch: PrimaryBranch) -> Located:
    """The fold at which the length is greatest."""
    branch.extend(lambda _: False)
    if branch.ended in UNFINISHED:
        ratio, last = branch.family.closure.value, branch.points[-1].scalars
        reached = f"p/T0 = {last.pressure_ratio:.4g}, sbar/eta = {last.sigma:.4g}"
        raise NotConverged(
            f"the greatest length at eta/y0 = {ratio:.6g} was not met for certain: the branch could be"
            f" followed to {reached} only.",
            remedy="Try law (8), or another eta/y0.",
        )
    found = []
    for fold in branch.folds:
        i = branch.points.index(fold.point)
        here, *around = (branch.points[j].scalars.sigma for j in (i, i - 1, i + 1))
        if fold.kind == "LP-length" and here > max(around):
            found.append(fold)
    if not found:
        raise _no_fold(branch.family, "no detached length is the greatest")
    return max(found, key=lambda fold: fold.point.scalars.sigma)


def _no_fold(family: Family, words: str) -> PeelOptError:
    """Say that a length does not fold; just above the cusp, where it does, that the walk misses it."""
    ratio, law = family.closure.value, family.law
    if not law.falls_straight:
        return NoEquilibrium(
            f"at eta/y0 = {ratio:.6g} {words} under law {law.name!r}.", remedy="Try a larger eta/y0."
        )
    if CUSP < ratio <= TOO_CLOSE:
        return NotConverged(
            f"at eta/y0 = {ratio:.6g}, just above the cusp at {CUSP}, the two folds in length lie closer"
            " together than the points of the walk.",
            remedy=f"Ask at eta/y0 above {TOO_CLOSE}.",
        )
    return NoEquilibrium(
        f"at eta/y0 = {ratio:.6g} {words}.", remedy=f"It exists for eta/y0 above {CUSP}.", nearest=CUSP
    )


def _maxwell(ratio: float, law: CohesiveLaw) -> Gradient:
    """The Maxwell point is a reading of the paper's potential, which law (8) and the linear law share."""
    if not law.falls_straight:
        raise InvalidInput(
            f"the Maxwell length belongs to the paper's laws, not to {law.name!r}.", remedy="Leave out law=."
        )
    return maxwell_gradient(ratio)


#: Where on the branch each limit lies.
FOLDS: dict[str, Callable[[PrimaryBranch], Located]] = {
    "readhesion_pressure": minimum_pressure,
    "least_length": _least_length,
    "longest_length": _longest_length,
}

#: The limits of a rod by their public names.
LIMITS = {
    "readhesion_pressure": Limit("pressure", partial(fold_gradient, which="readhesion_pressure")),
    "least_length": Limit("length", partial(fold_gradient, which="least_length")),
    "longest_length": Limit("length", partial(fold_gradient, which="longest_length")),
    "maxwell_length": Limit("length", _maxwell),
}
