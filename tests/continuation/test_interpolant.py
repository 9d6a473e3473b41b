"""The diagram at fixed beta0 as one polynomial in the tip angle: the same as the walk, and as honest."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation import interpolant
from peel_opt.continuation.family import Family
from peel_opt.continuation.interpolant import Interpolant, diagram
from peel_opt.continuation.points import Point
from peel_opt.continuation.segments import Segment
from peel_opt.equilibria import trace as tracing
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.residual.closures import READINGS, Closure
from peel_opt.residual.spectral import Spectral
from peel_opt.residual.stack import stack_of

CASES = [
    (0.5, (-1.0, 3.0)),
    (4.0, (-3.0, 3.0)),
    (4.0, (-90.0, 10.0)),
    (20.0, (-20.0, 3.0)),
    (30.0, (-60.0, 3.0)),
]


def family(beta0: float, nodes: int = 16, law: po.CohesiveLaw = LINEAR) -> Family:
    return Family(law, Spectral(nodes), Closure("length", math.cbrt(beta0)))


def solved_for(points: list[Point], beta0: float, nodes: int = 36) -> Segment:
    """The states at the tip angles of some points, on a finer mesh."""
    coarse, fine = (stack_of(Spectral(n), LINEAR.pieces) for n in (points[0].problem.settings.nodes, nodes))
    x = coarse.prolonged(np.array([p.x for p in points]), fine)
    A = np.array([p.scalars.A for p in points])
    return Segment.at(fine, Closure("length", math.cbrt(beta0)), A, x)


def distances(points: list[Point], fine: Segment) -> np.ndarray:
    """Of points from the branch of a finer mesh, which has states at their tip angles."""
    apart, along = fine.places - np.array([p.place for p in points]), fine.directions
    across = apart - (apart * along).sum(axis=1, keepdims=True) * along
    return np.linalg.norm(across, axis=1)


def walked(monkeypatch: pytest.MonkeyPatch, trace: Callable[[], po.Branch]) -> po.Branch:
    with monkeypatch.context() as patched:
        patched.setattr(tracing, "diagram", lambda *_: None)
        return trace()


@pytest.mark.parametrize(("beta0", "window"), CASES)
def test_points_and_folds_are_solutions_to_their_errors(beta0: float, window: tuple[float, float]) -> None:
    found = diagram([family(beta0, nodes) for nodes in (16, 24)], window, 60, 1e-12)
    assert found is not None
    points = [p for part, _ in found.sections for p in part]
    fine = solved_for(points, beta0)
    assert fine.solved.converged.all()
    gaps = distances(points, fine)
    assert np.all(gaps <= np.array([sum(p.errors) for p in points]) + fine.error)
    assert max(sum(p.errors) for p in points) < 1e-12
    rates = np.array([p.rates for p in points]) / np.array([p.turn.A for p in points])[:, None]
    np.testing.assert_allclose(rates, fine.rates[:, -4:], rtol=1e-7, atol=1e-7)
    (fold,) = (s for _, specials in found.sections for s in specials if s.kind == "LP-lambda")
    here = fine.of(np.array([points.index(fold.point)]))
    around = here.A + np.array([-1.0, 1.0]) * fold.error / here.speeds
    beside = Segment.at(here.stack, here.held, around, np.repeat(here.solved.x, 2, axis=0), sharp=True)
    before, after = beside.slopes(READINGS["lam"])
    assert before < 0.0 < after
    assert fold.status == "located"


@pytest.mark.parametrize("count", [6, 8, 10, 12])
def test_what_too_few_coefficients_leave_out_is_in_the_error(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interpolant, "COUNTS", (count,))
    monkeypatch.setattr(interpolant, "ENOUGH", 1.0)
    assert diagram([family(20.0)], (-3.0, 3.0), 60, 1e-12) is None
    found = diagram([family(20.0)], (-3.0, 3.0), 60, 1.0)  # the fold is outside
    assert found is not None
    points = [p for part, _ in found.sections for p in part]
    fine = solved_for(points, 20.0)
    gaps = distances(points, fine)
    assert gaps.max() > 1e-12
    assert np.all(gaps <= np.array([sum(p.errors) for p in points]) + fine.error)


@pytest.mark.parametrize("window", [(-1.0, 3.0), (-0.1, 2.0), (1.0, 3.0), (-0.26, -0.1), (-0.269, 0.5)])
def test_it_is_the_branch_that_is_walked(
    window: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    def trace() -> po.Branch:
        return po.trace(beta0=4, lam=window, points=24, at={"lam": [sum(window) / 2.0]})

    at_once, stepwise = trace(), walked(monkeypatch, trace)
    assert len(at_once) >= 24
    assert len(at_once.pieces) == len(stepwise.pieces)
    assert at_once.ended == stepwise.ended == "window"
    kinds = [[p.kind for p in branch.special_points] for branch in (at_once, stepwise)]
    assert kinds[0] == kinds[1]
    for own, other in zip(at_once.special_points, stepwise.special_points, strict=True):
        for name in ("lam", "alpha1", "length_ratio"):
            gap = abs(getattr(own, name) - getattr(other, name))
            # Of a length of one in the metric, lambda moves by pi^4 and alpha1 by 1 + beta0.
            assert gap <= 100.0 * (own.error + other.error), name
        assert own.status == other.status
    for piece, same in zip(at_once.pieces, stepwise.pieces, strict=True):
        ends, others = at_once.alpha1[piece][[0, -1]], stepwise.alpha1[same][[0, -1]]
        np.testing.assert_allclose(ends, others, rtol=1e-9)
        assert list(dict.fromkeys(at_once.state[piece])) == list(dict.fromkeys(stepwise.state[same]))
        assert np.all(np.diff(at_once.arclength[piece]) > 0.0)
        assert np.all(np.diff(at_once.A[piece]) > 0.0)


@pytest.mark.parametrize(
    ("beta0", "lam", "law"),
    [(40.0, 3.0, LINEAR), (4.0, 1000.0, LINEAR), (1e6, 3.0, LINEAR), (4.0, 3.0, COHESIVE)],
    ids=["no fold", "far", "stiff", "beyond y0"],
)
def test_what_is_no_such_polynomial_is_left_to_the_walk(
    beta0: float, lam: float, law: po.CohesiveLaw
) -> None:
    assert Interpolant.of(family(beta0, law=law), lam) is None


def test_law_8_within_y0_is_the_linear_law() -> None:
    known = [diagram([family(4.0, law=law)], (-0.4, -0.26), 12, 1e-12) for law in (COHESIVE, LINEAR)]
    assert all(found is not None for found in known)
    places = [[p.place for part, _ in found.sections for p in part] for found in known if found is not None]
    np.testing.assert_allclose(*places, atol=1e-13)
