"""Branches that begin on the charts of seeds: the same as walked ones, whatever the seeds are worth.

Modules: `charted`, `segments`, `compiled_stack`.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation import primary, seeds
from peel_opt.continuation.charted import charted, covers, is_coarse
from peel_opt.continuation.family import Family, StepControl
from peel_opt.continuation.primary import PrimaryBranch
from peel_opt.continuation.segments import Segment, arclengths
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.model.named_laws import exponential
from peel_opt.residual.batch import solve
from peel_opt.residual.closures import Closure, chart
from peel_opt.residual.compiled_stack import CompiledStack
from peel_opt.residual.spectral import Spectral
from peel_opt.residual.stack import stack_of

RATIOS = (0.05, 0.322, 0.4, 0.6, 0.9, 3.0, 40.0)


def whole(monkeypatch: pytest.MonkeyPatch, family: Family, *, walked: bool) -> PrimaryBranch:
    """The branch of a rod to its end, on the charts or step by step from T."""
    with monkeypatch.context() as patched:
        if walked:
            patched.setattr(primary, "covers", lambda _: False)
        branch = PrimaryBranch(family, control=StepControl(first=0.05))
        branch.extend(lambda _: False)
    return branch


@pytest.mark.parametrize("law", [COHESIVE, LINEAR], ids=["cohesive", "linear"])
@pytest.mark.parametrize("ratio", RATIOS)
def test_points_on_the_charts_are_those_of_a_walk(
    monkeypatch: pytest.MonkeyPatch, ratio: float, law: po.CohesiveLaw
) -> None:
    family = Family(law, Spectral(24), Closure("ratio", ratio))
    found = charted(family)
    assert found is not None
    last = found.points[-1].scalars.A
    with monkeypatch.context() as patched:
        patched.setattr(primary, "covers", lambda _: False)
        walk = PrimaryBranch(replace(family, transcription=Spectral(36)))
        walk.extend(lambda p: last < p.scalars.A)
    for point in found.points[1:-1:3]:
        (state,) = (c.solution for c in walk.candidates(Closure("amplitude", point.scalars.A)))
        assert len(state.problem.phases) == len(point.problem.phases)
        apart = float(np.linalg.norm(state.place - point.place))
        assert apart <= sum(point.errors) + 1e-12 * (1.0 + np.abs(point.place).max()), point.scalars
    assert [s.kind for s in found.specials if s.kind.startswith("LP")] == [
        f.kind for f in walk.folds if last > f.point.scalars.A
    ]


@pytest.mark.parametrize("ratio", RATIOS)
def test_special_points_are_those_of_a_walk(monkeypatch: pytest.MonkeyPatch, ratio: float) -> None:
    family = Family(COHESIVE, Spectral(24), Closure("ratio", ratio))
    known, walked = (whole(monkeypatch, family, walked=walked) for walked in (False, True))
    assert known.ended == walked.ended == "contact"
    assert 0 < known.walked_from < len(known.points)
    assert walked.walked_from == 0
    assert known.points[-1].arclength == pytest.approx(walked.points[-1].arclength, rel=0.02)
    assert [f.kind for f in known.folds] == [f.kind for f in walked.folds]
    pairs = [*zip(known.folds, walked.folds, strict=True), (known.contact, walked.contact)]
    for own, other in pairs:
        assert own.status == other.status == "located"
        gap = float(np.linalg.norm(own.point.place - other.point.place))
        # What folds is better than the place of its fold by far.
        assert gap < 1e-9 * (1.0 + np.abs(own.point.place).max())
        P, Q = (s.point.scalars.pressure_ratio for s in (own, other))
        assert pytest.approx(Q, rel=1e-10, abs=1e-12) == P


@pytest.mark.parametrize("ratio", [0.1, 1.0, 700.0])
def test_points_follow_one_another_and_solve_the_equations(ratio: float) -> None:
    family = Family(COHESIVE, Spectral(36), Closure("ratio", ratio))
    found = charted(family, 60)
    assert found is not None
    along = np.array([p.arclength for p in found.points])
    assert np.all(np.diff(along) > 0.0)
    for here, there in zip(found.points, found.points[1:], strict=False):
        chord = there.place - here.place
        assert there.arclength - here.arclength == pytest.approx(np.linalg.norm(chord), rel=0.02)
        assert min(here.direction @ chord, there.direction @ chord) > 0.95 * np.linalg.norm(chord)
        assert there.scalars.A > here.scalars.A
        assert family.certificate(there) < 1e-10
        own = family.point(there.problem, there.x, there.direction, 0.0, 0)
        assert np.abs(own.direction - there.direction).max() < 1e-7


@pytest.mark.parametrize("size", [1e-3, 0.3, 3.0])
def test_bad_seeds_cost_steps_and_change_no_branch(monkeypatch: pytest.MonkeyPatch, size: float) -> None:
    family = Family(COHESIVE, Spectral(24), Closure("ratio", 1.0))
    right = whole(monkeypatch, family, walked=False)
    rng = np.random.default_rng(1)
    bad = {
        name: replace(c, coefficients=c.coefficients * (1.0 + size * rng.normal(size=c.coefficients.shape)))
        for name, c in seeds.charts().items()
    }
    monkeypatch.setattr(import_module("peel_opt.continuation.charted"), "seed_charts", lambda: bad)
    branch = whole(monkeypatch, family, walked=False)
    assert branch.ended == "contact"
    assert branch.walked_from <= right.walked_from or size < 0.1
    assert [f.kind for f in branch.folds] == [f.kind for f in right.folds]
    for own, other in zip(branch.folds, right.folds, strict=True):
        assert own.point.place == pytest.approx(other.point.place, abs=1e-9)


def test_only_rods_whose_traction_falls_evenly_are_covered() -> None:
    family = Family(COHESIVE, Spectral(16), Closure("ratio", 1.0))
    assert covers(family)
    assert covers(replace(family, law=LINEAR))
    assert not covers(replace(family, law=exponential()))
    assert not covers(replace(family, closure=Closure("length", 1.5)))
    assert not covers(replace(family, closure=Closure("ratio", 4000.0)))
    assert not covers(replace(family, tip_free=False))
    assert not covers(replace(family, transcription=Spectral(12)))


def test_a_mesh_is_told_too_coarse_before_any_point_is_found() -> None:
    def told(ratio: float, nodes: int) -> bool:
        return is_coarse(Family(COHESIVE, Spectral(nodes), Closure("ratio", ratio)), 1e-10)

    assert told(0.05, 16)
    assert not told(0.05, 24)
    assert told(300.0, 24)
    assert not told(300.0, 36)


def test_compiled_states_are_those_of_the_stack() -> None:
    seen = seeds.charts()["beyond"]
    ratio = np.array([0.6, 2.0, 30.0])
    start = seen.rods(ratio).starts(np.array([0.3, 0.6, 0.8]))
    settings = Spectral(36)
    stack, compiled = stack_of(settings, seen.phases), CompiledStack.of(settings, seen.phases)
    start = seen.stack.prolonged(start, stack)
    given = np.column_stack([ratio, stack.scalars(start).A])
    kinds = ("ratio", "amplitude")
    one = solve(stack, kinds, given, start, sharp=True)
    other = solve(compiled, kinds, given, stack.spread(start), sharp=True)
    assert one.converged.all()
    assert other.converged.all()
    for x, y in zip(one.x, other.x, strict=True):
        assert chart(x[-4:])[0] == pytest.approx(chart(y[-4:])[0], abs=1e-10)
    # The closed form of the arc satisfies the equations at nodes on it.
    problem = settings.discretise(seen.phases)
    for x in stack.spread(one.x):
        assert np.abs(problem.residual(x)).max() < 1e-9 * np.abs(x[: problem.field_count]).max()
    rates = stack.spread_rates(one.x, one.inverse[:, :, -1])
    scale = np.abs(other.inverse[:, :, -1]).max(axis=1, keepdims=True)
    assert np.abs((rates - other.inverse[:, :, -1]) / scale).max() < 1e-7


def test_folds_closer_than_two_states_are_both_found() -> None:
    # Just above the cusp the two folds in length lie closer together than the states.
    family = Family(COHESIVE, Spectral(24), Closure("ratio", 0.3213))
    found = charted(family)
    assert found is not None
    least, greatest, _ = (s.point for s in found.specials if s.kind == "LP-length")
    assert 0.0 < greatest.arclength - least.arclength < 0.3
    assert least.scalars.sigma < greatest.scalars.sigma


def test_arclengths_are_those_of_the_curve() -> None:
    # A quarter of a circle of radius 2, by its angle.
    A = np.linspace(0.0, 0.5 * np.pi, 9)
    places = 2.0 * np.stack([np.cos(A), np.sin(A)], axis=1)
    velocities = 2.0 * np.stack([-np.sin(A), np.cos(A)], axis=1)
    assert arclengths(places, velocities, A) == pytest.approx(2.0 * A, abs=1e-4)


def test_a_fold_is_where_the_number_turns() -> None:
    seen = seeds.charts()["within"]
    ratio, shares = 1.0, np.linspace(0.0, 1.0, 9)
    start = seen.rods(np.full(9, ratio)).starts(shares)
    segment = Segment.at(seen.stack, Closure("ratio", ratio), seen.stack.scalars(start).A, start)
    found = segment.with_folds({"LP-length": lambda s: s.sigma})
    assert found is not None
    with_it, (fold,) = found
    assert len(with_it) == len(segment) + 1
    sigma = with_it.stack.scalars(with_it.solved.x).sigma
    assert fold.row == int(np.argmin(sigma))
    assert sigma[fold.row] == pytest.approx(3.013827494506, abs=1e-11)
    assert with_it.slopes(lambda s: s.sigma)[fold.row] == pytest.approx(0.0, abs=1e-11)
