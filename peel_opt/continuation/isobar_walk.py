"""States off a rod's primary branch, reached through other rods at the same pressure.

Under the linear law with eta/y0 > 0.4319 the folded states (Fig 10b) are not connected to T
by any path on one rod.  At fixed p/T0 they are: the state of the rod itself, followed while
eta/y0 varies, runs through softer rods and folds over.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from ..base.errors import NotConverged
from ..model.bond import CohesiveLaw
from ..residual.closures import Closure
from ..residual.meshes import PATH
from .family import Family
from .goal import Goal
from .points import Point
from .primary import Candidate, crossings, primary_branch

#: Points to walk along an isobar, and along a curve of fixed length, in either direction.
ISOBAR_POINTS, ISOLENGTH_POINTS = 80, 40


def states_near(law: CohesiveLaw, ratio: float, sigma: float, pressure_ratio: float) -> list[Candidate]:
    """Return states of a rod at a length, found from its state at about the pressure sought.

    Parameters
    ----------
    ratio : float
        eta/y0.
    sigma : float
        sbar/eta.
    pressure_ratio : float
        p/T0 near which a state is sought.
    """
    closure = Closure("ratio", ratio)
    branch = primary_branch(law, closure)
    given = Closure("pressure", pressure_ratio)
    Goal(given).walk(branch)
    found: list[Candidate] = []
    for start in branch.candidates(given):
        isobar = _both_ways(Family(law, PATH, given), start, ISOBAR_POINTS)
        for place in crossings(*isobar, Closure("length", sigma), lambda _: "other"):
            isolength = _both_ways(Family(law, PATH, Closure("length", sigma)), place, ISOLENGTH_POINTS)
            found += crossings(*isolength, closure, lambda _: "other")
    return found


def _both_ways(family: Family, start: Candidate, most: int) -> tuple[Family, list[Point]]:
    """Walk a family in both directions from a state, into one sequence of points."""
    try:
        solved = family.solve(start.profile, start.family.closure)
    except NotConverged:
        solved = None  # what lies beyond is not looked for
    if solved is None:
        return family, []
    problem, result = solved
    forward = family.point(problem, result.x, np.array([1.0, 0.3, 0.2, 0.1]), 0.0, result.iterations)
    backward = family.point(problem, result.x, np.array([-1.0, -0.3, -0.2, -0.1]), 0.0, result.iterations)
    behind = list(islice(family.walk(backward), most))
    ahead = list(islice(family.walk(forward), most))
    turned = [Point(p.problem, p.x, -p.tangent, -p.arclength, p.iterations) for p in reversed(behind[1:])]
    return family, turned + ahead
