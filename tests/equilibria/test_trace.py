"""Branches: the points, the special points, and where they end.

Modules: `trace`, `branch`, `branch_points`, `assembly`, `follow`.
"""

from __future__ import annotations

import itertools
import math
import pickle
from collections.abc import Callable
from itertools import islice

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation.family import Family, StepControl, transition
from peel_opt.continuation.points import Point
from peel_opt.continuation.primary import PrimaryBranch
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.residual.closures import Closure, chart
from peel_opt.residual.shooting import Shooting
from peel_opt.residual.spectral import Spectral

from ..registry import REFERENCES, Reference

PI4 = math.pi**4
FOLDS = [ref for ref in REFERENCES if "fold" in ref.tags]


@pytest.fixture(scope="module")
def beta0_4() -> po.Branch:
    return po.trace(beta0=4, lam=(-1, 3))


@pytest.fixture(scope="module")
def rod_1(branch_of: Callable[..., po.Branch]) -> po.Branch:
    return branch_of(1.0, points=60)


@pytest.fixture(scope="module")
def traced() -> dict[float, po.Branch]:
    return {}


@pytest.mark.parametrize("reference", FOLDS, ids=str)
def test_folds_are_located_to_nine_digits(reference: Reference, traced: dict[float, po.Branch]) -> None:
    question, expected = reference.question, reference.expected
    kind = str(question["kind"])
    key = float(question.get("ratio", -float(question.get("beta0", 0.0))))
    if key not in traced:
        if "beta0" in question:
            traced[key] = po.trace(beta0=float(question["beta0"]), lam=(-90, 3), points=40)
        else:
            traced[key] = po.trace(po.Rod.from_ratio(key), points=30)
    found = traced[key].special(kind)
    for name, value in expected.items():
        if name in ("lam", "alpha1", "pressure_ratio", "length_ratio"):
            errors = [abs(getattr(p, name) - value) for p in found]
            assert min(errors) < 1e-9 * max(1.0, abs(value)), (name, [getattr(p, name) for p in found])
    assert all(p.status == "located" for p in found)


def test_the_beta0_4_diagram(beta0_4: po.Branch) -> None:
    br = beta0_4
    assert len(br) >= 125
    assert br.lam[0] == pytest.approx(3.0, abs=1e-12)
    assert br.lam[-1] == pytest.approx(3.0, abs=1e-12)
    assert br.alpha1[0] == pytest.approx(3.5396937370, abs=1e-9)
    assert br.alpha1[-1] == pytest.approx(-6.3212369673, abs=1e-9)
    assert max(br.error.max(), br.certificate.max()) < 1e-10
    fold = br.special("LP-lambda")[0]
    assert (fold.lam, fold.alpha1) == (
        pytest.approx(-0.26900108827, abs=1e-10),
        pytest.approx(-1.3942820254, abs=1e-9),
    )
    assert br.lam[fold.index] == fold.lam == br.lam.min()
    assert br.special("BP")[0].lam == pytest.approx(0.0, abs=1e-12)
    assert list(dict.fromkeys(br.state)) == ["spurious", "middle", "lower"]
    assert np.all(br.alpha1[br.spurious] > 0)
    assert np.array_equal(br.trivial.alpha1, np.zeros(len(br.trivial.lam)))


def test_branch_points_of_the_straight_rod() -> None:
    br = po.trace(beta0=4, lam=(-1, 81 * PI4), points=20)
    assert [p.lam for p in br.trivial.special_points] == pytest.approx([0.0, 15 * PI4, 80 * PI4])


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_branches_of_higher_modes_leave_where_the_determinant_vanishes(mode: int) -> None:
    lam = (mode**4 - 1) * PI4
    br = po.trace(beta0=4, lam=(lam - 20, lam + 20), mode=mode, points=20)
    start = br.special("BP")[0]
    assert start.lam == pytest.approx(lam, abs=1e-9 * max(1.0, lam))
    assert start.alpha1 == 0.0
    assert br.alpha1.min() < 0.0 < br.alpha1.max()


def test_a_rod_from_t_to_contact(rod_1: po.Branch) -> None:
    kinds = [p.kind for p in rod_1.special_points]
    assert kinds == ["BP", "LP-length", "y=y0", "LP-pressure", "LP-length", "y=y0", "y=y0", "contact"]
    assert list(dict.fromkeys(rod_1.state)) == ["middle", "lower", "folded"]
    assert np.all(np.diff(rod_1.tip_angle) < 0)  # monotone
    assert rod_1.tip_u[-1] == pytest.approx(0.0, abs=1e-10)
    assert rod_1.pressure_ratio[-1] == pytest.approx(1.0, abs=1e-12)
    assert max(rod_1.error.max(), rod_1.certificate.max()) < 1e-10
    crossings = rod_1.special("y=y0")
    assert [p.pressure_ratio for p in crossings[:2]] == pytest.approx([0.5, 0.5], abs=1e-9)


@pytest.mark.parametrize(
    ("ratio", "folds"),
    [(0.05, 1), (0.25, 1), (0.33, 3), (0.4, 3), (0.47, 3), (0.7, 2), (3.0, 2), (30.0, 2), (100.0, 2)],
)
def test_number_of_folds_in_length(ratio: float, folds: int) -> None:
    br = po.trace(po.Rod.from_ratio(ratio), points=24, tol=1e-8)
    assert br.ended == "contact"
    assert len(br.special("LP-length")) == folds
    assert len(br.special("LP-pressure")) == 1


def test_minimum_pressure_has_both_asymptotes() -> None:
    def least(ratio: float) -> float:
        branch = PrimaryBranch(Family(COHESIVE, Spectral(16), Closure("ratio", ratio)))
        branch.extend(lambda _: branch.fold("LP-pressure") is not None)
        return branch.fold("LP-pressure").point.scalars.pressure_ratio

    assert least(1000.0) * (4 * 1000.0) ** 1.5 == pytest.approx(1.0, abs=2e-3)
    assert (1 - least(0.005)) / 0.005 == pytest.approx(1.022, abs=3e-3)
    curve = [least(r) for r in (0.01, 0.1, 1.0, 10.0, 100.0)]
    assert curve == sorted(curve, reverse=True)


@pytest.mark.parametrize("transcription", [Spectral(20), Shooting(24), Shooting(16, steps=2)], ids=repr)
def test_the_same_branch_from_other_transcriptions(transcription: object, beta0_4: po.Branch) -> None:
    at = {"lam": [-0.2, 1.0, 2.5]}
    br = po.trace(beta0=4, lam=(-1, 3), points=12, transcription=transcription, at=at, tol=1e-7)  # type: ignore[arg-type]
    fold = br.special("LP-lambda")[0]
    assert fold.lam == pytest.approx(beta0_4.special("LP-lambda")[0].lam, abs=1e-9)
    exact = {1.0: -4.43540698907106, -0.2: -2.09952054324776}
    for lam, alpha1 in exact.items():
        landed = np.flatnonzero(np.abs(br.lam - lam) < 1e-12)
        assert len(landed) == 2
        assert br.alpha1[landed].min() == pytest.approx(alpha1, abs=1e-8)


@pytest.mark.parametrize("largest", [0.1, 0.6, 2.0, 5.0])
def test_no_step_size_makes_it_jump(largest: float) -> None:
    family = Family(COHESIVE, Spectral(20), Closure("ratio", 1.0))
    walk = PrimaryBranch(family, control=StepControl(first=largest, largest=largest))
    walk.extend(lambda _: walk.fold("LP-pressure") is not None)
    fold = walk.fold("LP-pressure").point.scalars
    assert fold.pressure_ratio == pytest.approx(0.121837041296, abs=1e-9)
    for point in walk.points[1:]:
        s = point.scalars
        assert s.pressure_ratio == pytest.approx(
            COHESIVE.mean_traction(s.height(point.profile.values[0, 0, 4]))
        )


@pytest.mark.parametrize(("beta0", "points"), [(37.53, 64), (37.544, 64), (37.545, 32)])
def test_no_corner_is_cut_where_two_branches_nearly_meet(
    beta0: float, points: int, folds: po.FoldCurve
) -> None:
    br = po.trace(beta0=beta0, lam=(-97, 1), points=points)
    found = br.special("LP-lambda")
    assert [p.lam for p in found] == pytest.approx(
        [folds.at(beta0)[0]], abs=1e-6
    )  # not those of the other one
    assert br.state[-1] == "lower"
    assert br.alpha1[-1] == pytest.approx(-25.84, abs=0.02)


def test_arclength_does_not_depend_on_the_mesh() -> None:
    ends = []
    for nodes in (16, 24):
        family = Family(LINEAR, Spectral(nodes), Closure("length", math.cbrt(4.0)))
        point = list(islice(family.walk(transition(family), StepControl(first=0.1, largest=0.1)), 12))[-1]
        ends.append(chart(point.x[-4:])[0])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


def test_landing_on_asked_for_values() -> None:
    br = po.trace(po.Rod.from_ratio(1.0), points=20, at={"pressure_ratio": [0.8, 0.2], "tip_angle": [-1.0]})
    assert np.abs(br.pressure_ratio - 0.8).min() < 1e-13
    assert np.sum(np.abs(br.pressure_ratio - 0.2) < 1e-12) == 2  # lower and folded
    assert np.abs(br.tip_angle + 1.0).min() < 1e-13
    lengths = br.length_ratio[np.abs(br.pressure_ratio - 0.8) < 1e-12]
    assert lengths.min() == pytest.approx(3.03680400592249, abs=1e-10)


def test_above_the_turn_the_branch_runs_down_to_beta1_zero() -> None:
    br = po.trace(beta0=50, lam=(-96, 2), points=20)
    assert not br.special("LP-lambda")
    assert br.lam.min() == pytest.approx(-96.0, abs=1e-9)
    assert set(br.state) == {"middle", "spurious"}


@pytest.mark.parametrize(("ratio", "ended"), [(0.3, "contact"), (1.0, "p < 0")])
def test_a_rod_under_the_linear_law_ends_at_contact_or_where_the_pressure_vanishes(
    ratio: float, ended: str
) -> None:
    br = po.trace(po.Rod.from_ratio(ratio), law="linear", points=20, tol=1e-8)
    assert br.ended == ended
    assert (br.pressure_ratio[-1] < 0.0) == (ended == "p < 0")


def test_beta0_zero_is_a_pitchfork() -> None:
    br = po.trace(beta0=0, lam=(-1, 2), points=20)
    assert br.lam.min() == pytest.approx(0.0, abs=1e-10)
    np.testing.assert_allclose(br.alpha1[0], -br.alpha1[-1], rtol=1e-9)
    assert np.all(np.isnan(br.pressure_ratio))


def test_arrays_are_immutable_and_slices_are_branches(beta0_4: po.Branch) -> None:
    with pytest.raises(ValueError, match="read-only"):
        beta0_4.lam[0] = 1.0
    part = beta0_4[10:90]
    assert len(part) == 80
    assert part.lam[5] == beta0_4.lam[15]
    for point in part.special_points:
        assert part.lam[point.index] == point.lam
    assert "Branch of" in repr(beta0_4)
    assert "LP-lambda" in repr(beta0_4)


def test_points_are_equilibria(rod_1: po.Branch) -> None:
    i = int(np.argmin(np.abs(rod_1.pressure_ratio - 0.3)))
    eq = rod_1[i]
    assert eq.certified
    # Cubes of arrays and of floats may differ in the last place.
    assert eq.pressure_ratio == pytest.approx(rod_1.pressure_ratio[i], rel=1e-15)
    again = po.length_given_pressure(po.Rod.from_ratio(1.0), eq.pressure_ratio, near=eq)
    assert again.length_ratio == pytest.approx(eq.length_ratio, abs=1e-8)


# --- other curves ------------------------------------------------------------------------------


def test_an_interrupted_walk_keeps_its_points() -> None:
    walk = po.Walk(po.length_given_pressure(po.Rod.from_ratio(1.0), 0.3), hold="pressure_ratio")
    list(islice(walk, 4))
    br = walk.branch()
    assert len(br) >= 4
    np.testing.assert_allclose(br.pressure_ratio, 0.3, atol=1e-12)
    more = po.follow(br, hold="pressure_ratio", steps=3)
    assert more.A[0] == pytest.approx(br.A[-1], abs=1e-10)
    assert (more.A[1] - more.A[0]) * (br.A[-1] - br.A[-2]) > 0  # goes on, not back


@pytest.mark.parametrize("hold", ["ratio", "beta0", "pressure_ratio", "lam", "alpha1", "tip_angle"])
def test_any_quantity_can_be_held(hold: str) -> None:
    start = po.equilibrium(beta0=4, lam=1.0)
    br = po.follow(start, hold=hold, steps=6)
    held = getattr(br, hold)
    np.testing.assert_allclose(held, held[0], rtol=1e-9, atol=1e-9)
    assert br.error.max() < 1e-9


def test_where_a_rod_meets_itself_is_located() -> None:
    crossed = next(eq for eq in po.equilibria(beta0=53.16, beta1=113.1) if "self-contact" in eq.flags)
    br = po.follow(crossed, hold="beta0", steps=8, direction=-1, transcription=po.Spectral(nodes=40))
    (where,) = br.special("self-contact")
    assert where.status == "located"
    assert where.pressure_ratio == pytest.approx(1.15501, abs=1e-4)
    assert "self-contact" in br[where.index - 1].flags
    assert "self-contact" not in br[where.index + 1].flags


def test_a_curve_less_accurate_than_asked_for_is_refused() -> None:
    crossed = next(eq for eq in po.equilibria(beta0=53.16, beta1=113.1) if "self-contact" in eq.flags)
    with pytest.raises(po.NotConverged, match="accurate to"):
        po.follow(crossed, hold="beta0", steps=35, direction=-1)


def test_what_cannot_be_walked() -> None:
    start = po.equilibrium(beta0=4, lam=1.0)
    with pytest.raises(po.InvalidInput, match="hold"):
        po.Walk(start, hold="colour")
    with pytest.raises(po.InvalidInput, match="direction"):
        po.Walk(start, hold="lam", direction=0)
    nothing = po.equilibrium(beta0=4, lam=-5.0, throw=False)
    with pytest.raises(po.InvalidInput):
        po.Walk(nothing, hold="beta0", law=LINEAR)


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"beta0": -1.0},
        {"beta0": 4.0, "lam": (3.0, -1.0)},
        {"beta0": 4.0, "lam": (-200.0, 3.0)},
        {"beta0": 4.0, "lam": 3.0},
        {"beta0": 4.0, "mode": 0},
        {"beta0": 4.0, "points": 1},
        {"beta0": 4.0, "law": "cubic"},
        {"beta0": 0.0, "law": "cohesive"},
        {"beta0": 4.0, "at": {"colour": [1.0]}, "points": 10},
        {"beta0": math.nan},
    ],
)
def test_traces_that_cannot_be_meant(arguments: dict) -> None:
    with pytest.raises(po.InvalidInput):
        po.trace(**arguments)


# --- errors, flags and labels along a branch ---------------------------------------------------


@pytest.mark.parametrize("nodes", [5, 6, 8])
def test_errors_of_equilibria_on_a_branch_are_those_at_their_groups(nodes: int) -> None:
    # The branch is near in the plane across it; what is reported is alpha1 at beta0 and lambda.
    branch = po.trace(beta0=4, lam=(-1, 3), transcription=po.Spectral(nodes), tol=1e-2, points=20)
    for eq in branch[::2]:
        if abs(eq.alpha1) > 1e-6 and eq.error < 1e-3:  # off T and the fold
            exact = po.equilibrium(beta0=eq.beta0, lam=eq.lam, near=eq.alpha1, tol=1e-9)
            assert abs(exact.alpha1 - eq.alpha1) <= eq.error + exact.error
            assert eq.error <= 5.0 * abs(exact.alpha1 - eq.alpha1) + 1e-12
    fold = branch.special("LP-lambda")[0]
    assert branch[fold.index].error > 1e-2  # at that lambda alpha1 is hardly known


def test_a_loaded_or_pickled_branch_keeps_its_flags() -> None:
    branch = po.trace(po.Rod.from_ratio(1.0), law="linear", points=20)
    again = pickle.loads(pickle.dumps(branch))
    assert [eq.flags for eq in again] == [eq.flags for eq in branch]
    assert any("y > y0" in eq.flags for eq in branch)


def test_an_interrupted_walk_is_not_taken_for_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    rod, step, count = po.Rod.from_ratio(0.7771), Family.step, itertools.count()

    def interrupted(self: Family, here: Point, ds: float, behind: Point | None) -> Point | None:
        if next(count) == 6:
            raise KeyboardInterrupt
        return step(self, here, ds, behind)

    with monkeypatch.context() as patch:
        patch.setattr(Family, "step", interrupted)
        with pytest.raises(KeyboardInterrupt):
            po.length_given_pressure(rod, 0.3, state="folded", method="spectral")
    assert po.pressure_given_length(rod, 3.3, method="spectral").state == "lower"
    assert po.length_given_pressure(rod, 0.5, state="folded").certified


def test_few_points_do_not_cut_a_branch() -> None:
    for points in (2, 5):
        branch = po.trace(po.Rod.from_ratio(30.0), points=points)
        assert branch.ended == "contact"
        assert branch.special("LP-pressure")


def test_a_walk_keeps_the_law_that_was_solved_with() -> None:
    rod = po.Rod.from_ratio(1.0)
    eq = po.pressure_given_length(rod, 3.1456, law="linear")
    assert "y > y0" in eq.flags
    branch = po.follow(eq, hold="ratio", steps=3)
    assert branch.law == "linear"
    assert branch.pressure_ratio[0] == pytest.approx(eq.pressure_ratio, abs=1e-9)
    for wrong in ({"law": "linaer"}, {"step": 0.1}):
        with pytest.raises(po.InvalidInput):
            po.follow(eq, hold="ratio", **wrong)


def test_points_are_read_back_of_every_transcription() -> None:
    for mesh in (po.Collocation(), po.Shooting(), po.Spectral(np.int64(16))):
        branch = po.trace(beta0=4, lam=(-1, 1), points=10, transcription=mesh, tol=1e-5)
        assert branch[3].certificate < 1e-5


@pytest.mark.parametrize("ratio", [0.32107, 0.322, 0.3235])
def test_two_folds_between_two_points_of_the_walk_are_found(ratio: float) -> None:
    # Just above the cusp at 0.32105 the folds in length lie closer together than any step.
    branch = po.trace(po.Rod.from_ratio(ratio), points=20)
    least, greatest = (p for p in branch.special("LP-length") if p.pressure_ratio < 0.7)
    assert least.length_ratio < greatest.length_ratio
    assert least.status == greatest.status == "located"
    assert set(branch.state) == {"middle", "lower", "folded"}
    between = 0.5 * (least.length_ratio + greatest.length_ratio)
    before = np.arange(len(branch)) <= branch.special("LP-pressure")[0].index
    assert np.count_nonzero(np.diff(np.sign(branch.sigma[before] - between))) == 3
    states = po.equilibria(po.Rod.from_ratio(ratio), length=between)
    assert sum(eq.state in ("middle", "lower") for eq in states) == 3


def test_higher_modes_of_a_rod_hold_their_certificates() -> None:
    rod = po.Rod.from_ratio(0.1)
    second, third = po.trace(rod, mode=2), po.trace(rod, mode=3, tol=1e-6)
    # The tip of an even mode stays on the plate, where the identity says nothing by itself.
    assert np.abs(second.tip_height).max() < 1e-9
    assert max(second.certificate.max(), third.certificate.max()) < 1e-6
    for point in third.special("self-contact"):
        assert third.lam[point.index] == point.lam
