"""Points filled in between those of a walk, and the errors of many points at once."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation import family as continuation
from peel_opt.continuation.family import Family, StepControl
from peel_opt.continuation.fill import filled, point_errors
from peel_opt.continuation.points import Point
from peel_opt.continuation.primary import PrimaryBranch
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.model.named_laws import exponential
from peel_opt.residual.closures import Closure, Plane, chart
from peel_opt.residual.discretisation import Phases, Profile
from peel_opt.residual.phases import fits
from peel_opt.residual.shooting import Shooting
from peel_opt.residual.spectral import Spectral


def walk(family: Family, until: float, side: int = 1) -> list[Point]:
    """Points of a primary branch up to a tip angle."""
    branch = PrimaryBranch(family, side, control=StepControl(largest=0.25))
    branch.extend(lambda point: abs(point.scalars.A) > until or point.scalars.lam > 100.0)
    return branch.points


FAMILIES = {
    "beta0 = 4": Family(LINEAR, Spectral(16), Closure("length", 4.0 ** (1 / 3))),
    "r = 1": Family(COHESIVE, Spectral(24), Closure("ratio", 1.0)),
    "r = 0.05": Family(COHESIVE, Spectral(24), Closure("ratio", 0.05)),
    "r = 300": Family(COHESIVE, Spectral(36), Closure("ratio", 300.0)),
    "exponential": Family(exponential(), Spectral(24), Closure("ratio", 0.6)),
}


@pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES.keys())
def test_filled_points_lie_on_the_branch_in_order(family: Family) -> None:
    points = walk(family, 2.0)
    dense = filled(family, points, 0.02)
    assert {id(p) for p in points} <= {id(p) for p in dense}
    arclengths = np.array([p.arclength for p in dense])
    assert np.all(np.diff(arclengths) > 0.0)
    assert np.diff(arclengths).max() < 0.03
    for here, there in pairwise(dense):  # no corner, no jump, and tangents that agree with the chords
        chord = there.place - here.place
        assert here.direction @ there.direction > StepControl().turn
        assert chord @ here.direction > 0.7 * np.linalg.norm(chord)
        assert family.suits(there.profile, there.problem)


@pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES.keys())
def test_filled_points_solve_the_equations_as_walked_ones_do(family: Family) -> None:
    dense = filled(family, walk(family, 2.0), 0.05)
    for point in dense[1::4]:
        _, again = family.solve(point.profile, Plane.across(point.place, point.direction))
        assert np.linalg.norm(chart(again.x[-4:])[0] - point.place) < 1e-10 * (1.0 + np.abs(point.x).max())
        own = family.point(point.problem, point.x, point.direction, 0.0, 0)
        np.testing.assert_allclose(own.direction, point.direction, atol=1e-7)


def test_a_mesh_too_large_for_dense_algebra_is_walked_instead() -> None:
    family = replace(FAMILIES["beta0 = 4"], transcription=Shooting(intervals=40))
    points = walk(family, 0.5)
    dense = filled(family, points, 0.05)
    assert len(dense) > len(points)
    reference = filled(FAMILIES["beta0 = 4"], walk(FAMILIES["beta0 = 4"], 0.5), 0.05)
    lam = np.interp(
        [p.scalars.A for p in dense], *np.array([(p.scalars.A, p.scalars.lam) for p in reference]).T
    )
    np.testing.assert_allclose([p.scalars.lam for p in dense], lam, atol=0.02)


@pytest.mark.parametrize("nodes", [6, 8, 10, 12])
@pytest.mark.parametrize("name", ["beta0 = 4", "r = 1", "r = 0.05"])
def test_errors_of_points_are_honest(name: str, nodes: int) -> None:
    family = replace(FAMILIES[name], transcription=Spectral(nodes))
    exact = replace(FAMILIES[name], transcription=Spectral(44))
    points = walk(family, 1.5)[1:]
    errors = point_errors(family, points).total
    for point, error in zip(points, errors, strict=True):
        found = exact.solve(point.profile, Plane.across(point.place, point.direction))
        assert found is not None
        true = float(np.linalg.norm(chart(found[1].x[-4:])[0] - point.place))
        assert true <= error
        assert error <= 100.0 * true + 1e-11


def test_errors_include_rounding_whatever_the_algebra() -> None:
    family = FAMILIES["beta0 = 4"]
    points = walk(family, 0.9)[1:]
    dense = point_errors(family, points).rounding
    assert np.all(dense > 0.0)
    sparse = replace(family, transcription=Shooting(intervals=40))
    alone = point_errors(sparse, walk(sparse, 0.9)[1:]).rounding
    assert np.all(alone > 0.0)
    assert np.median(alone) < 1e3 * np.median(dense)


def test_a_contact_is_a_point_like_its_neighbours() -> None:
    family = FAMILIES["r = 1"]
    branch = PrimaryBranch(family)
    branch.extend(lambda _: False)
    assert branch.ended == "contact"
    errors = point_errors(family, branch.points[-3:])
    assert 0.2 * min(errors.mesh[:-1]) < errors.mesh[-1] < 5.0 * max(errors.mesh[:-1])
    # What rounding does is smooth along the branch: it changes less over the shorter step to the contact.
    before, last = np.diff(errors.rounding)
    steps = np.diff([p.arclength for p in branch.points[-3:]])
    assert steps[1] < steps[0]
    assert abs(last) <= abs(before)
    # Solved for as any other point is, it has the same.
    contact = branch.points[-1]
    solved = family.solve(contact.profile, Plane.across(contact.place, contact.direction))
    assert solved is not None
    again = family.point(solved[0], solved[1].x, contact.direction, 0.0, 0)
    assert point_errors(family, [again]).rounding[0] == pytest.approx(errors.rounding[-1], rel=1e-6)


def test_a_phase_that_is_overlooked_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    # Both meshes then agree on the wrong phases; only the first integrals tell.
    def blind_to_the_tip(profile: Profile, phases: Phases) -> bool:
        # A free arc and a bonded one, though the tip has come down through y0 again.
        return fits(profile, phases) or (len(phases) == 2 and bool(np.all(profile.lengths > 0.0)))

    monkeypatch.setattr(continuation, "fits", blind_to_the_tip)
    with pytest.raises(po.NotConverged, match="though two meshes agree"):
        po.trace(po.Rod.from_ratio(30.0), points=20)
