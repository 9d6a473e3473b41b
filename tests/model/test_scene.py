"""Scenes and their parts; their states are in the tests of `equilibria`.

Modules: `scene`, `loads`, `profiles`, `walls`, `tips`, `mixed_bonds`, `place`, `stretch`, `dimension`,
`blister`.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.dimension import Dimension
from peel_opt.model.loads import Force, Load
from peel_opt.model.place import Numbers, Place

ROD = po.Rod.from_ratio(1.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: po.Scene("rod"), "rod"),
        (lambda: po.Scene(ROD, [po.Weight(0.1), po.Weight(0.2)]), "one load of a kind"),
        (lambda: po.Scene(ROD, ["weight"]), "a load cannot be"),
        (lambda: po.TipLoad(angle=90), "angle = 90 rad is more than a turn. Write '90 deg' for degrees"),
        (lambda: po.Weight(0.1, tilt=-30.0), "Write '-30 deg'"),
        (lambda: po.Scene(ROD, wall="flat"), "wall of a scene"),
        (lambda: po.Scene(ROD, law="glue"), "law of a scene"),
        (lambda: po.Scene(ROD, unbonded=-1.0), "zero or positive"),
        (lambda: po.Scene(ROD, natural_curvature=math.nan), "finite"),
        (lambda: po.Scene(ROD, wall=po.Circle(0.1), law=po.ShearSprings(1.0)), "flat wall"),
        (
            lambda: po.Scene(ROD, natural_curvature=-0.1, tip=po.Contact(), law=po.EffectiveOpening(1.0)),
            "under a tip that is free",
        ),
        (po.SkinFriction, "one of traction= and share="),
        (lambda: po.Pressure(dead=1.5), "between 0 and 1"),
        (lambda: po.Pressure(profile=3), "profile must be"),
        (lambda: po.profiles.linear(-1.0), "above -1"),
        (lambda: po.profiles.mixed(2.0), "between 0 and 1"),
    ],
)
def test_what_cannot_be_meant_is_refused_by_name(make: Callable[[], object], words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        make()


def test_the_gap_to_a_circle_is_exact_as_its_curvature_vanishes() -> None:
    at = po.Place(0.0, 3.0, 0.0, -2.0, 0.3, 0.0)
    for kw in (1e-12, -1e-12, 0.2, -0.2):
        gap, nx, ny = po.Circle(kw).gap(at, {"curvature": kw})
        centre = np.array([0.0, 1.0 / kw])
        exact = (1.0 - abs(kw) * math.dist((-2.0, 0.3), centre)) / kw
        assert gap == pytest.approx(exact, abs=1e-3 if abs(kw) < 1e-6 else 1e-13)
        assert math.hypot(nx, ny) == pytest.approx(1.0)


def test_a_tip_whose_load_is_named_is_not_a_free_one_however_small_the_load() -> None:
    """They have other numbers, so that what is compiled for one is not taken for the other."""
    free, named = po.Scene(ROD), po.Scene(ROD, tip=po.TipLoad())
    assert free != named
    assert not free.numbers
    assert named.numbers == {"force": 0.0, "angle": 0.0, "moment": 0.0}
    elsewhere = pickle.loads(pickle.dumps(free))
    assert elsewhere == free
    assert replace(elsewhere).numbers == {}


@pytest.mark.parametrize(
    "force",
    [
        lambda at, q: Force(y=0.05 if at.theta > -0.5 else 0.0),
        lambda at, q: Force(y=math.cos(at.theta)),
        lambda at, q: Force(y=q["nothing"]),
        lambda at, q: 0.05,
    ],
)
def test_a_load_that_casadi_cannot_take_is_refused_by_its_name(force: Callable[..., Force]) -> None:
    class Own(Load):
        parameters: ClassVar[dict[str, Dimension]] = {}
        keeps_flat: ClassVar[bool] = False

        def force(self, at: Place, q: Numbers) -> Force:
            return force(at, q)

        def work(self, at: Place, q: Numbers) -> float:
            return 0.0

    with pytest.raises(po.InvalidInput, match="Own cannot be evaluated at a place"):
        po.Scene(po.Rod.from_ratio(1.0), [Own()])
