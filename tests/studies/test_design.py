"""Designs against what the public calls say of them, and against forward searches."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import peel_opt as po
from peel_opt.studies.design.material import material

from ..rods import FLAP

FILM = {
    "youngs_modulus": "0.6 MPa",
    "poisson_ratio": 0.5,
    "adhesion_strength": "140.1 kPa",
    "work_of_separation": "5.1 mJ/cm^2",
}


def film(thickness: float, strength: float = 140.1e3) -> po.Rod:
    return po.Rod(0.6e6 * thickness**3 / 9.0, strength, 2.0 * 51.0 / strength)


# ---------------------------------------------------------------------------------- square problems


def test_stiffness_for_a_maxwell_length() -> None:
    found = po.design(FLAP, free="bending_stiffness", targets=po.Target("maxwell_length", equal="2 mm"))

    def miss(log_k: float) -> float:
        rod = replace(FLAP, bending_stiffness=math.exp(log_k))
        return po.maxwell_length(rod.ratio, "branch") * rod.adhesion_range - 2e-3

    assert found.rod.bending_stiffness == pytest.approx(math.exp(brentq(miss, -11, -9, xtol=1e-12)), rel=1e-8)
    assert found.achieved[0].value == pytest.approx(2e-3, rel=1e-8)
    assert found.achieved[0].error < 1e-8 * 2e-3
    assert (found.rod.adhesion_strength, found.rod.adhesion_range) == pytest.approx(
        (140e3, 0.73e-3), rel=1e-12
    )
    # The multiplier is the inverse of the elasticity of what was asked for.
    forward = po.sensitivities(found.rod, "maxwell_length").elasticities["bending_stiffness"]
    assert found.elasticities["maxwell_length"] == pytest.approx(1.0 / forward, rel=1e-6)


def test_stiffness_for_a_pressure() -> None:
    target = po.Target("pressure", equal="60 kPa", length="1.9 mm")
    found = po.design(FLAP, free="bending_stiffness", targets=target)
    eq = po.pressure_given_length(found.rod, 1.9e-3)
    assert eq.pressure == pytest.approx(60e3, rel=1e-8)
    assert eq.state == "lower"
    forward = po.sensitivities(eq).elasticities["bending_stiffness"]
    assert found.elasticities[target.label] == pytest.approx(1.0 / forward, rel=1e-6)
    assert found.others == ()


def test_range_for_a_readhesion_pressure() -> None:
    target = po.Target("readhesion_pressure", equal=20e3)
    found = po.design(FLAP, free="adhesion_range", targets=target)
    assert po.readhesion_pressure(found.rod).pressure == pytest.approx(20e3, rel=1e-7)
    forward = po.sensitivities(found.rod, "readhesion_pressure").elasticities["adhesion_range"]
    assert found.elasticities[target.label] == pytest.approx(1.0 / forward, rel=1e-6)


def test_a_design_under_another_law() -> None:
    target = po.Target("pressure", equal="70 kPa", length="1.9 mm")
    free = {"bending_stiffness": (1.5e-5, 4e-5)}
    found = po.design(FLAP, free=free, targets=target, law=po.exponential())
    eq = po.pressure_given_length(found.rod, 1.9e-3, law=po.exponential())
    assert eq.pressure == pytest.approx(70e3, rel=1e-8)
    forward = po.sensitivities(eq).elasticities["bending_stiffness"]
    assert found.elasticities[target.label] == pytest.approx(1.0 / forward, rel=1e-6)


@pytest.mark.parametrize(
    ("words", "free", "target"),
    [
        ("belongs to law", "work_of_separation", po.Target("readhesion_pressure", equal=2e4)),
        ("Maxwell length belongs", "bending_stiffness", po.Target("maxwell_length", equal=2e-3)),
    ],
)
def test_what_belongs_to_law_8_alone(words: str, free: str, target: po.Target) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        po.design(FLAP, free=free, targets=target, law=po.exponential())


def test_two_numbers_for_two_targets() -> None:
    targets = [
        po.Target("maxwell_length", equal="2 mm"),
        po.Target("length", equal="2.05 mm", pressure="60 kPa"),
    ]
    found = po.design(FLAP, free=("bending_stiffness", "adhesion_range"), targets=targets)
    rod = found.rod
    assert po.maxwell_length(rod.ratio, "branch") * rod.adhesion_range == pytest.approx(2e-3, rel=1e-7)
    assert po.length_given_pressure(rod, 60e3).length == pytest.approx(2.05e-3, rel=1e-7)


def test_two_stiffnesses_share_a_length() -> None:
    """At fixed pressure the length has a minimum over the stiffness: both sides are designs."""
    soft = replace(FLAP, bending_stiffness=4.2e-6)
    target = po.Target("length", equal=1.1515e-3, pressure="60 kPa")
    found = po.design(soft, free={"bending_stiffness": (4.05e-6, 5e-6)}, targets=target)
    rods = (found.rod, *found.others)
    assert len(rods) == 2
    for rod in rods:
        assert po.length_given_pressure(rod, 60e3).length == pytest.approx(1.1515e-3, rel=1e-7)
    assert rods[0].bending_stiffness < 4.2522e-6 < rods[1].bending_stiffness


def test_both_sides_are_seen_within_bounds_of_many_decades() -> None:
    """One of the two lies beside the end of its state, where the pressure turns steeply."""
    target = po.Target("pressure", equal="60 kPa", length="1.9 mm")
    found = po.design(FLAP, free="adhesion_strength", targets=target)
    strengths = [rod.adhesion_strength for rod in (found.rod, *found.others)]
    assert strengths == pytest.approx([101621.18, 231170.69], rel=1e-6)  # the nearest to 140 kPa first
    for strength in strengths:
        rod = replace(FLAP, adhesion_strength=strength)
        assert po.pressure_given_length(rod, 1.9e-3).pressure == pytest.approx(60e3, rel=1e-6)


# ---------------------------------------------------------------------------------- optima


def test_thinnest_film_for_a_length() -> None:
    target = po.Target("length", at_least="2 mm", pressure="60 kPa")
    found = po.design(FILM, free={"thickness": ("0.75 mm", "5 mm")}, targets=target, minimise="thickness")
    by_hand = brentq(lambda h: po.held_length(film(h), 60e3).length - 2e-3, 0.75e-3, 1e-3, xtol=1e-13)
    assert found.free["thickness"] == pytest.approx(by_hand, rel=1e-7)
    assert found.rod.bending_stiffness == pytest.approx(film(by_hand).bending_stiffness, rel=1e-6)
    assert found.binding == (target.label,)
    assert found.settled
    assert found.iterations > 0
    # Ask for 1 % more: the film gets thicker by what the multiplier says.
    more = po.Target("length", at_least=2.02e-3, pressure="60 kPa")
    again = po.design(FILM, free={"thickness": ("0.75 mm", "5 mm")}, targets=more, minimise="thickness")
    rate = math.log(again.free["thickness"] / found.free["thickness"]) / math.log(1.01)
    assert found.elasticities[target.label] == pytest.approx(rate, rel=1e-2)


def test_both_bounds_of_one_number() -> None:
    """ "At least" and "at most" share a label: what binds keeps its elasticity."""
    targets = [
        po.Target("readhesion_pressure", at_least="20 kPa"),
        po.Target("readhesion_pressure", at_most="30 kPa"),
    ]
    free = {"adhesion_range": (5e-4, 1e-3)}
    found = po.design(FLAP, free=free, targets=targets, minimise="adhesion_range")
    forward = po.sensitivities(found.rod, "readhesion_pressure").elasticities["adhesion_range"]
    assert found.elasticities == {"readhesion_pressure": pytest.approx(1.0 / forward, rel=1e-5)}
    assert repr(found).count(", d log") == 1


def test_targets_that_exclude_each_other() -> None:
    targets = [
        po.Target("readhesion_pressure", at_least="30 kPa"),
        po.Target("readhesion_pressure", at_most="20 kPa"),
    ]
    with pytest.raises(po.Infeasible, match="exclude each other"):
        po.design(FLAP, free="bending_stiffness", targets=targets, minimise="bending_stiffness")


@pytest.mark.parametrize("ratio", [0.01, 0.02])
@pytest.mark.parametrize("upper", [100.0, 1.01])
def test_a_target_that_hardly_moves_with_what_is_free(ratio: float, upper: float) -> None:
    """The elasticity is in the hundreds: a low price would buy stiffness with the target."""
    rod = po.Rod((1e-3 * ratio) ** 3 * 1e5, 1e5, 1e-3)
    stiffness, least = rod.bending_stiffness, po.readhesion_pressure(rod).pressure
    target = po.Target("readhesion_pressure", at_least=least)
    free = {"bending_stiffness": (0.3 * stiffness, upper * stiffness)}
    found = po.design(rod, free=free, targets=target, maximise="bending_stiffness")
    forward = po.sensitivities(rod, "readhesion_pressure").elasticities["bending_stiffness"]
    assert abs(1.0 / forward) > 100.0
    # The pressure is met to 1e-8, the stiffness to that times the elasticity.
    assert found.rod.bending_stiffness == pytest.approx(stiffness, rel=1e-8 / abs(forward))
    assert found.elasticities[target.label] == pytest.approx(1.0 / forward, rel=1e-4)
    assert found.settled
    with pytest.raises(po.Infeasible, match="bending_stiffness at its lower bound"):
        po.design(
            rod,
            free={"bending_stiffness": (1.1 * stiffness, 2.0 * stiffness)},
            targets=target,
            maximise="bending_stiffness",
        )


@pytest.mark.slow
def test_two_free_numbers_and_a_bound() -> None:
    targets = [
        po.Target("length", at_least="2 mm", pressure="60 kPa"),
        po.Target("readhesion_pressure", at_least="15 kPa"),
    ]
    free = {"thickness": ("0.7 mm", "2 mm"), "adhesion_strength": ("100 kPa", "200 kPa")}
    found = po.design(FILM, free=free, targets=targets, maximise="thickness")
    assert found.settled
    assert po.held_length(found.rod, 60e3).length >= 2e-3 * (1 - 1e-7)
    assert po.readhesion_pressure(found.rod).pressure >= 15e3 * (1 - 1e-7)
    # A film a little thicker heals too late at any strength within the bounds.
    for strength in np.linspace(100e3, 200e3, 5):
        thicker = film(found.free["thickness"] * 1.002, float(strength))
        assert po.readhesion_pressure(thicker).pressure < 15e3


@pytest.mark.slow
def test_along_a_flat_valley() -> None:
    targets = [
        po.Target("length", at_least="2 mm", pressure="60 kPa"),
        po.Target("readhesion_pressure", at_most="20 kPa"),
    ]
    free = {"thickness": ("0.1 mm", "5 mm"), "adhesion_strength": ("50 kPa", "400 kPa")}
    found = po.design(FILM, free=free, targets=targets, minimise="thickness")
    # The readhesion pressure hardly depends on T0 at given work: the least is where T0 = p.
    assert found.free["thickness"] == pytest.approx(0.82434e-3, rel=1e-4)
    assert found.free["adhesion_strength"] == pytest.approx(60e3, rel=1e-3)


# ---------------------------------------------------------------------------------- what does not exist


def test_a_bound_that_binds() -> None:
    target = po.Target("readhesion_pressure", at_least="130 kPa")
    with pytest.raises(po.Infeasible, match="thickness at its lower bound") as caught:
        po.design(FILM, free={"thickness": ("0.1 mm", "5 mm")}, targets=target, maximise="thickness")
    assert caught.value.nearest == pytest.approx(po.readhesion_pressure(film(0.1e-3)).pressure, rel=1e-6)
    (closest,) = caught.value.candidates
    assert closest.bending_stiffness == pytest.approx(film(0.1e-3).bending_stiffness, rel=1e-6)


def test_a_length_below_its_minimum() -> None:
    target = po.Target("length", at_most="1 mm", pressure="60 kPa")
    with pytest.raises(po.Infeasible, match=r"closest reachable is 1\.15052 mm") as caught:
        po.design(FLAP, free="bending_stiffness", targets=target, maximise="bending_stiffness")
    lengths = [
        po.length_given_pressure(replace(FLAP, bending_stiffness=k), 60e3).length
        for k in np.linspace(4.23e-6, 4.33e-6, 21)
    ]
    assert caught.value.nearest is not None
    assert min(lengths) * (1 - 1e-4) < caught.value.nearest <= min(lengths) * (1 + 1e-9)


@pytest.mark.slow
def test_two_targets_against_each_other() -> None:
    """The Maxwell length is a little shorter than what p = 0.43 T0 holds, at any ratio."""
    targets = [
        po.Target("maxwell_length", equal="2 mm"),
        po.Target("length", equal="1.95 mm", pressure="60 kPa"),
    ]
    with pytest.raises(po.Infeasible, match="beyond which no branch is walked") as caught:
        po.design(FLAP, free=("bending_stiffness", "adhesion_range"), targets=targets)
    assert caught.value.nearest is not None
    assert abs(math.log(caught.value.nearest / 1.95e-3)) < 0.04


def test_no_such_state_anywhere() -> None:
    with pytest.raises(po.Infeasible, match="no Maxwell point for eta/y0 below"):
        po.design(
            FLAP,
            free={"bending_stiffness": ("1e-9 N m", "1e-6 N m")},
            targets=po.Target("maxwell_length", equal="2 mm"),
        )


# ---------------------------------------------------------------------------------- what cannot be meant

LENGTH = po.Target("maxwell_length", equal="2 mm")
REFUSED: list[tuple[str, Callable[[], Any]]] = [
    ("cannot be free", lambda: po.design(FLAP, free="colour", targets=LENGTH)),
    ("needs a free number", lambda: po.design(FLAP, free=(), targets=LENGTH)),
    ("at least one Target", lambda: po.design(FLAP, free="bending_stiffness", targets=[])),
    ("not free", lambda: po.design(FLAP, free="bending_stiffness", targets=LENGTH, minimise="thickness")),
    ("leave a choice", lambda: po.design(FLAP, free=("bending_stiffness", "adhesion_range"), targets=LENGTH)),
    (
        "need as many",
        lambda: po.design(
            FLAP, free="bending_stiffness", targets=[LENGTH, po.Target("pressure", equal=1, length=1)]
        ),
    ),
    (
        "not both",
        lambda: po.design(
            FLAP,
            free="bending_stiffness",
            targets=LENGTH,
            minimise="bending_stiffness",
            maximise="bending_stiffness",
        ),
    ),
    (
        "must be below the upper",
        lambda: po.design(FLAP, free={"bending_stiffness": (2e-5, 1e-5)}, targets=LENGTH),
    ),
    ("must be two", lambda: po.design(FLAP, free={"bending_stiffness": (2e-5,)}, targets=LENGTH)),  # type: ignore[dict-item]
    ("without bounds", lambda: po.design(FILM, free="thickness", targets=LENGTH)),
    ("needs bending_stiffness", lambda: po.design(FLAP, free={"thickness": (1e-4, 1e-3)}, targets=LENGTH)),
    ("unknown material number", lambda: po.design({"k": 1.0}, free="bending_stiffness", targets=LENGTH)),
    (
        "needs two of",
        lambda: po.design({"bending_stiffness": 1e-5}, free="bending_stiffness", targets=LENGTH),
    ),
    ("poisson_ratio must", lambda: material({**FILM, "poisson_ratio": 0.6}, {"thickness": (1e-4, 1e-3)})),
    ("free must be names", lambda: po.design(FLAP, free=None, targets=LENGTH)),  # type: ignore[arg-type]
    ("must be a Rod", lambda: po.design(None, free="thickness", targets=LENGTH)),  # type: ignore[arg-type]
    ("one Target", lambda: po.design(FLAP, free="bending_stiffness", targets=None)),  # type: ignore[arg-type]
    ("tol must lie", lambda: po.design(FLAP, free="bending_stiffness", targets=LENGTH, tol=1e-15)),
    (
        "in the same sense",
        lambda: po.design(FLAP, free=("bending_stiffness", "adhesion_range"), targets=[LENGTH, LENGTH]),
    ),
    ("needs a unit", lambda: po.Target("maxwell_length", equal="2")),
    ("unknown target", lambda: po.Target("strength", equal="2 Pa")),
    ("unknown target", lambda: po.Target("critical_flaw", at_least="2 mm", pressure="60 kPa")),
    ("needs one of equal", lambda: po.Target("maxwell_length")),
    ("needs one of equal", lambda: po.Target("maxwell_length", equal=1.0, at_most=2.0)),
    ("needs pressure=", lambda: po.Target("length", equal="1 mm")),
    ("takes no length=", lambda: po.Target("maxwell_length", equal="1 mm", length="1 mm")),
]


@pytest.mark.parametrize(("words", "call"), REFUSED, ids=[words for words, _ in REFUSED])
def test_refusals_name_the_field(words: str, call: Callable[[], Any]) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        call()


def test_material_numbers_follow_from_each_other() -> None:
    z = np.log([0.7e-3, 5e-4])
    bounds = {"thickness": (1e-4, 1e-2), "adhesion_range": (1e-4, 1e-2)}
    stuff = material({"youngs_modulus": "0.6 MPa", "poisson_ratio": 0.5, "work_of_separation": 51.0}, bounds)
    rod = stuff.rod(z)
    assert rod.bending_stiffness == pytest.approx(0.6e6 * 0.7e-3**3 / 9.0, rel=1e-12)
    assert rod.work_of_separation == pytest.approx(51.0, rel=1e-12)
    assert rod.adhesion_range == pytest.approx(5e-4, rel=1e-12)
    constant, slopes = stuff.log_ratio
    assert math.exp(constant + slopes @ z) == pytest.approx(rod.ratio, rel=1e-12)


def test_a_rod_gives_its_work_of_separation_free() -> None:
    stuff = material(FLAP, "work_of_separation")
    assert stuff.start is not None
    rod = stuff.rod(stuff.start)
    assert rod.adhesion_range == pytest.approx(FLAP.adhesion_range, rel=1e-12)
