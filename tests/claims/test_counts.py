"""What answers and branches cost in corrections, factors, walks and files, the same on every machine."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation.family import Family
from peel_opt.continuation.points import Point
from peel_opt.residual import newton
from peel_opt.residual.linear import DenseFactors
from peel_opt.residual.meshes import TRACED


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Corrections, factorisations, and walks from a transition, from now on."""
    counts: Counter[str] = Counter()
    correction, factorise, walk = newton.newton, DenseFactors.__init__, Family.walk

    def corrected(*arguments: object, **options: object) -> newton.Correction:
        counts["corrections"] += 1
        return correction(*arguments, **options)

    def factorised(self: DenseFactors, matrix: np.ndarray) -> None:
        counts["factorisations"] += 1
        factorise(self, matrix)

    def walked(self: Family, here: Point, *arguments: object, **options: object) -> Iterator[Point]:
        counts["walks"] += here.arclength == 0.0  # the others lead from point to point
        return walk(self, here, *arguments, **options)

    monkeypatch.setattr(newton, "newton", corrected)
    monkeypatch.setattr(DenseFactors, "__init__", factorised)
    monkeypatch.setattr(Family, "walk", walked)
    return counts


@pytest.mark.parametrize(
    ("first", "again"),
    [
        (
            lambda: po.length_given_pressure(po.Rod.from_ratio(1.0), 0.5, state="folded"),
            lambda: po.length_given_pressure(po.Rod.from_ratio(1.0), 0.45, state="folded"),
        ),
        (
            lambda: po.pressure_given_length(po.Rod.from_ratio(20.0), 2.0, state="lower"),
            lambda: po.pressure_given_length(po.Rod.from_ratio(20.0), 1.9, state="lower"),
        ),
        (
            lambda: po.equilibrium(beta0=4.0, lam=1.0, method="spectral"),
            lambda: po.equilibrium(beta0=4.0, lam=1.0, method="spectral", tol=1e-9),
        ),
    ],
    ids=["folded", "length", "groups"],
)
def test_a_second_answer_is_one_landing_and_no_walk(
    first: Callable[[], po.Equilibrium], again: Callable[[], po.Equilibrium], counted: Counter[str]
) -> None:
    first()
    counted.clear()
    assert again().certified
    # It lands on the branch and, where one residual says so, is solved for on one finer mesh.
    assert 0 < counted["corrections"] <= 2
    # Three steps of Newton's method with one set of factors each, and those that the error takes.
    assert 0 < counted["factorisations"] <= 6
    assert counted["walks"] == 0


UNSEEN = (1.0 + 1e-6 * i for i in range(100_000))

#: Answers of the shortest ways, and the files of the package that they may cross.
SHORT: dict[str, tuple[Callable[[], po.Equilibrium], int]] = {
    "length": (lambda: po.length_given_pressure(po.Rod.from_ratio(1.0), 0.2), 20),
    "a rod never seen": (lambda: po.length_given_pressure(po.Rod.from_ratio(next(UNSEEN)), 0.2), 20),
    "pressure": (lambda: po.pressure_given_length(po.Rod.from_ratio(30.0), 3.0), 23),  # the series fails
    "groups": (lambda: po.equilibrium(beta0=4.0, lam=1.0), 15),
}


@pytest.mark.parametrize("name", SHORT)
def test_an_answer_from_a_seed_takes_one_set_of_factors(name: str, counted: Counter[str]) -> None:
    ask, _ = SHORT[name]
    ask()
    counted.clear()
    assert ask().certified
    if name == "groups":  # by the series
        assert not counted
        return
    # Label, error and condition are read off the factors that the correction ended with, unless it has gone
    # further than they reach.
    assert counted.keys() == {"corrections", "factorisations"}
    assert counted["corrections"] == 1
    assert counted["factorisations"] <= 1 + (name == "pressure")


def files_crossed(ask: Callable[[], object]) -> set[str]:
    """Files of the package in which a function is called on the way, the second time it is gone."""
    ask()
    files, room = set(), f"{Path(po.__file__).parent}"

    def seen(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(room):
            files.add(frame.f_code.co_filename)

    before = sys.getprofile()
    sys.setprofile(seen)
    try:
        ask()
    finally:
        sys.setprofile(before)
    return files


@pytest.mark.parametrize("name", SHORT)
def test_an_answer_crosses_few_files(name: str) -> None:
    ask, most = SHORT[name]
    files = files_crossed(ask)
    assert 0 < len(files) <= most, sorted(files)


@pytest.mark.parametrize(("ratio", "most"), [(0.05, 33), (1.0, 37)])
def test_a_branch_crosses_no_more_files_than_it_needs(ratio: float, most: int) -> None:
    files = files_crossed(lambda: po.trace(po.Rod.from_ratio(ratio)))
    assert 0 < len(files) <= most, sorted(files)


@pytest.mark.parametrize(("ratio", "corrections"), [(0.05, 1), (1.0, 90), (100.0, 60)])
def test_a_branch_under_law_8_is_walked_only_where_its_tip_is_back_at_y0(
    ratio: float, corrections: int, counted: Counter[str]
) -> None:
    po.trace(po.Rod.from_ratio(ratio))
    assert counted["walks"] == 0
    assert 0 < counted["corrections"] <= corrections


def test_the_diagram_at_fixed_beta0_is_neither_walked_nor_corrected_point_by_point(
    counted: Counter[str],
) -> None:
    branch = po.trace(beta0=4.0, lam=(-3.0, 3.0))
    assert len(branch) >= 128
    assert not counted
    po.trace(beta0=40.0, lam=(-3.0, 3.0), points=16)  # has no fold: its series does not come back
    assert counted["walks"] > 0


def test_a_branch_of_another_law_is_walked_once_on_each_mesh_that_is_tried(counted: Counter[str]) -> None:
    po.trace(po.Rod.from_ratio(0.6), law=po.exponential())
    assert 0 < counted["walks"] <= len(TRACED[False])
    assert 0 < counted["corrections"] <= 500
