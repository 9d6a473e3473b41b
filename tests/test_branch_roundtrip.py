"""A branch goes to a file and comes back the same, and goes on from there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import peel_opt as po
from peel_opt.branch import COLUMNS


@pytest.fixture(scope="module", params=["rod", "groups"])
def branch(request: pytest.FixtureRequest) -> po.Branch:
    if request.param == "rod":
        return po.trace(po.Rod(2.3e-5, 140e3, 0.73e-3), points=20, tol=1e-8)
    return po.trace(beta0=4, lam=(-1, 1), points=20)


def test_every_number_comes_back_bit_for_bit(branch: po.Branch, tmp_path: Path) -> None:
    again = po.Branch.load(branch.save(tmp_path / "branch.npz"))
    for name in (*COLUMNS, "state"):
        assert np.array_equal(getattr(again, name), getattr(branch, name)), name
    assert again.special_points == branch.special_points
    assert (again.law, again.hold, again.held, again.rod, again.ended) == (
        branch.law,
        branch.hold,
        branch.held,
        branch.rod,
        branch.ended,
    )
    assert again.options == branch.options
    assert (again.trivial is None) == (branch.trivial is None)
    for mine, theirs in zip(again.solutions.unknowns, branch.solutions.unknowns, strict=True):
        assert np.array_equal(mine, theirs)


def test_a_loaded_branch_goes_on(branch: po.Branch, tmp_path: Path) -> None:
    part = branch[: len(branch) // 2]
    again = po.Branch.load(part.save(tmp_path / "part.npz"))
    more = po.follow(again, hold=branch.hold, steps=3)
    assert more.A[0] == pytest.approx(part.A[-1], abs=1e-9)
    assert (more.A[1] - more.A[0]) * (part.A[-1] - part.A[-2]) > 0
    assert again[3].alpha1 == part[3].alpha1


def test_csv_has_a_line_for_each_point(branch: po.Branch, tmp_path: Path) -> None:
    lines = branch.to_csv(tmp_path / "branch.csv").read_text(encoding="utf-8").splitlines()
    data = [line for line in lines if not line.startswith("#")]
    assert len(data) == len(branch) + 1
    assert ("[Pa]" in data[0]) == (branch.rod is not None)


@pytest.mark.parametrize("content", [b"", b"not an archive", b"PK\x03\x04 broken", b"\x80\x04pickle"])
def test_files_that_are_no_branch(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(content)
    with pytest.raises(po.InvalidInput) as caught:
        po.Branch.load(path)
    assert "\n" not in str(caught.value)


def test_an_equilibrium_file_is_no_branch(tmp_path: Path) -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.8)
    with pytest.raises(po.InvalidInput):
        po.Branch.load(eq.save(tmp_path / "eq.npz"))


def test_an_unwritable_folder_is_said(branch: po.Branch, tmp_path: Path) -> None:
    with pytest.raises(po.InvalidInput):
        branch.save(tmp_path / "missing" / "deep" / "branch.npz" / "x.npz" / "\0")
