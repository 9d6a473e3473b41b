"""Corners of a branch under a law that jumps: where they are, and the two directions of the branch there."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation.corners import EXACT_TIP, crossed
from peel_opt.continuation.points import Point
from peel_opt.continuation.primary import primary_branch
from peel_opt.residual.closures import Closure

#: Holds 0.9 of its strength up to the end of its range, and then nothing.
DROP = po.CohesiveLaw([lambda u: 1.0 - 0.1 * u, lambda u: 0.0 * u], kinks=(1.0,), name="drop")


def tip(point: Point) -> float:
    """y/y0 at the tip."""
    return float(point.profile.heights()[0, 0])


def test_a_branch_has_its_corner_where_the_tip_comes_to_the_jump() -> None:
    branch = primary_branch(DROP, Closure("ratio", 1.0))
    branch.extend(lambda last: last.scalars.pressure_ratio < 0.9)
    (i,) = [i for i, point in enumerate(branch.points) if point.before is not None]
    before, corner, after = branch.points[i - 1 : i + 2]
    assert tip(corner) == pytest.approx(1.0, rel=EXACT_TIP)
    # The pressure is the mean traction up to the tip, here 1 - 0.1/2.
    assert corner.scalars.pressure_ratio == pytest.approx(0.95, abs=1e-9)
    assert len(before.problem.phases) == 1
    assert len(after.problem.phases) == 2
    assert crossed(branch.family, before, after)
    assert not crossed(branch.family, corner, after)
    # A tangent does not lead around it: arriving and leaving differ by more than a step would turn them.
    arriving = corner.place - before.place
    cosine = arriving @ corner.direction / np.linalg.norm(arriving) / np.linalg.norm(corner.direction)
    assert cosine < 0.999
    assert (after.place - corner.place) @ corner.direction > 0.0


def test_a_law_without_jumps_has_no_corners() -> None:
    branch = primary_branch(po.trapezoidal(0.4), Closure("ratio", 1.0))
    branch.extend(lambda last: last.scalars.pressure_ratio < 0.5)
    assert all(point.before is None for point in branch.points)
