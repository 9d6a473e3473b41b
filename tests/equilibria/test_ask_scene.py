"""Calls that take a rod take a scene: as `solve` answers, and as the rod where it is the paper's.

Modules: `scene_question`.
"""

from __future__ import annotations

from typing import Any

import pytest

import peel_opt as po

ROD = po.Rod.from_ratio(1.0)
CURVED = po.Scene(ROD, natural_curvature=0.05)


def test_a_scene_is_asked_as_a_rod_is() -> None:
    there = po.length_given_pressure(CURVED, 0.8)
    assert there.length == po.solve(CURVED, free="length", pressure=0.8).length
    back = po.pressure_given_length(CURVED, there.length, state="lifted")
    assert back.pressure == pytest.approx(0.8, abs=1e-9)
    other = po.length_given_pressure(CURVED, 0.8, state="middle")
    assert other.length > 3.0 * there.length
    assert po.length_given_pressure(CURVED, 0.8, near=other).length == pytest.approx(other.length, abs=1e-9)


@pytest.mark.parametrize("law", ["auto", "linear", po.exponential()])
def test_the_papers_scene_is_answered_as_its_rod(law: Any) -> None:
    scene = po.Scene(ROD, law=law)
    own = po.length_given_pressure(ROD, 0.8, law=law, method="collocation")
    assert po.length_given_pressure(scene, 0.8, method="collocation").length == own.length
    listed = po.equilibria(ROD, pressure=0.8, law=law)
    assert [eq.length for eq in po.equilibria(scene, pressure=0.8)] == [eq.length for eq in listed]


def test_all_states_on_the_branch_of_a_scene_are_listed() -> None:
    """y_-+ of the two roots: the small lifted state and the middle one, by the identity."""
    found = po.equilibria(CURVED, pressure=0.8)
    assert [eq.state for eq in found[:2]] == ["lifted", "middle"]
    assert all(eq.certified for eq in found)
    E, slack = 0.5 * 0.05**2, 1.0 - 0.8
    roots = [slack - (slack**2 - 2.0 * E) ** 0.5, slack + (slack**2 - 2.0 * E) ** 0.5]
    assert [eq.tip_height for eq in found[:2]] == pytest.approx(roots, abs=1e-9)
    assert found.searched is None
    for eq in found:
        again = po.length_given_pressure(CURVED, 0.8, near=eq.length)
        assert again.length == pytest.approx(eq.length, abs=1e-9)


def test_states_of_one_length_are_listed_by_pressure() -> None:
    scene = po.Scene(ROD, [po.Weight(0.02)])
    found = po.equilibria(scene, length=3.05)
    assert [eq.state for eq in found][:2] == ["lower", "middle"]
    assert found[0].pressure < found[1].pressure
    # Weight is a stronger bond of the same slope: T0 -> T0 + w, y0 -> y0 (1 + w/T0), within the bond.
    mapped = po.pressure_given_length(po.Rod(1.0, 1.02, 1.02), 3.05, state="middle")
    assert found[1].pressure == pytest.approx(mapped.pressure, abs=1e-9)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"method": "series"}, "that of the plain rod"),
        ({"law": "linear"}, "its own law"),
        ({"state": "spurious"}, "unknown state"),
    ],
)
def test_what_a_scene_has_itself_is_not_given_again(given: dict[str, Any], words: str) -> None:
    for call, value in ((po.length_given_pressure, 0.8), (po.pressure_given_length, 3.0)):
        with pytest.raises(po.InvalidInput, match=words):
            call(CURVED, value, **given)
        failed = call(CURVED, value, **given, throw=False)
        assert not failed.certified
        assert words in failed.message


def test_all_states_are_asked_for_by_pressure_or_length() -> None:
    for numbers in ({}, {"pressure": 0.8, "length": 3.0}, {"beta0": 4.0, "lam": 1.0}):
        with pytest.raises(po.InvalidInput, match="one of pressure and length"):
            po.equilibria(CURVED, **numbers)
    with pytest.raises(po.InvalidInput, match="its own law"):
        po.equilibria(CURVED, pressure=0.8, law="linear")
    with pytest.raises(po.InvalidInput, match="its own law"):
        po.equilibria(po.Scene(ROD), pressure=0.8, law="linear")


def test_what_a_rod_alone_holds_is_not_asked_of_a_scene() -> None:
    for call, value in ((po.held_length, 0.5), (po.holding_pressure, 3.5)):
        for scene in (CURVED, po.Scene(ROD)):
            with pytest.raises(po.InvalidInput, match="not a scene"):
                call(scene, value)
