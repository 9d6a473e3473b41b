"""Scenes as plain data, through JSON and back."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import pytest

import peel_opt as po
from peel_opt.model.loads import Force, Load
from peel_opt.model.mixed_bonds import Bond, LineBond, Opening
from peel_opt.model.named_laws import exponential, trapezoidal
from peel_opt.model.place import Place
from peel_opt.model.profiles import Distribution, Given
from peel_opt.model.scene_record import PARTS, record_of, scene_of, words_of
from peel_opt.model.tips import Contact, Free, Middle, TipLoad
from peel_opt.model.walls import Wall

from ..rods import FLAP

STORED = {
    "every load": po.Scene(
        FLAP,
        [
            po.Pressure(po.profiles.linear(0.1), dead=1 / 3, until=0.9e-3),
            po.Weight(0.1, 0.2),
            po.SkinFriction(traction=-0.3),
            po.Drag(0.7),
        ],
        tip=po.TipLoad(0.1, 2.0 / 3.0, -1e-7),
        natural_curvature=1 / 7,
        unbonded=1e-4,
        line_energy=0.3,
    ),
    "share": po.Scene(FLAP, [po.SkinFriction(share=0.1), po.Pressure(po.profiles.exponential(1e-3))]),
    "stream": po.Scene(FLAP, [po.Pressure(po.profiles.mixed(0.1))], law=exponential()),
    "jet": po.Scene(FLAP, [po.Pressure(po.profiles.jet())], law=trapezoidal(0.1)),
    "layer of fluid": po.Scene(FLAP, [po.Pressure(po.profiles.height(1e-3))], law="linear"),
    "artery": po.Scene(FLAP, wall=po.Circle(100.0 / 3.0), tip=po.Contact()),
    "opening": po.Scene(FLAP, law=po.EffectiveOpening(0.3, law=exponential())),
    "springs": po.Scene(FLAP, law=po.ShearSprings(1e9 / 3.0, softening=False)),
    "elastic layer": po.Scene(FLAP, law=po.ElasticLayer(1e12 / 3.0)),
    "stretching": po.Scene(FLAP, stretch=2e5, line_energy=20.0, glued_strain=1e-3),
    "capillary": po.Scene(FLAP, law="none", line_energy=0.1),
    "blister": po.Blister(FLAP, slack=0.05e-3),
    "rollers": po.Blister(FLAP, roller=0.0, loads=[po.Weight(1.0)]),
    "film": po.Blister(FLAP, stretch=2e5, line_energy=20.0),
    "another law": po.Scene(FLAP, law=po.CohesiveLaw(lambda u: ca.exp(-u)), unbonded=1e-4),
}


@dataclass(frozen=True)
class Wind(Load):
    """A load of the reader's own, which is no profile."""

    keeps_flat = True

    def numbers(self) -> dict[str, float]:
        return {}

    def force(self, at: Place, q: Any) -> Any:
        return Force(x=0.1)

    def work(self, at: Place, q: Any) -> Any:
        return 0.0


OF_THE_READERS_OWN = {
    "profile": po.Scene(FLAP, [po.Pressure(lambda at: 1.0 + at.xi)]),
    "law": STORED.pop("another law"),
    "load": po.Scene(FLAP, [Wind()]),
}


def through_json(scene: po.Scene) -> po.Scene:
    return scene_of(json.loads(json.dumps(record_of(scene))), scene.rod)


@pytest.mark.parametrize("name", STORED)
def test_a_scene_comes_back_bit_for_bit(name: str) -> None:
    scene = STORED[name]
    back = through_json(scene)
    assert type(back) is type(scene)
    assert back == scene
    assert repr(back) == repr(scene)
    assert back.form == scene.form
    assert back.numbers == scene.numbers


def test_no_part_of_a_scene_is_forgotten() -> None:
    """All parts of the package are stored, and each is above; a law and a middle are known by other means."""
    own = [kind for base in (Load, Wall, Bond, Distribution) for kind in base.__subclasses__()]
    own = [kind for kind in own if kind.__module__.startswith("peel_opt.")]
    assert {*own, TipLoad, Free, Contact} - {Opening, LineBond, Given, Middle} == set(PARTS.values())
    every = json.dumps([record_of(scene) for scene in STORED.values()])
    assert not [name for name in PARTS if f'"{name}"' not in every]


@pytest.mark.parametrize("name", OF_THE_READERS_OWN)
def test_what_is_the_readers_own_has_words_only(name: str) -> None:
    scene = OF_THE_READERS_OWN[name]
    assert record_of(scene) is None
    assert words_of(scene).startswith("Scene(rod=Rod(k=2.3e-05 N m")
    assert " at 0x" not in words_of(scene)


@pytest.mark.parametrize(
    "change",
    [
        {"kind": "Rod"},
        {"wall": {"kind": "Path", "curvature": 1.0}},
        {"wall": {"kind": "Circle", "curvature": 1.0, "more": 1.0}},
        {"wall": {"kind": "Circle", "curvature": float("nan")}},
        {"loads": [{"kind": "Weight", "w": "much", "tilt": 0.0}]},
        {
            "loads": [
                {
                    "kind": "Pressure",
                    "profile": {"kind": "Linear", "c": float("inf")},
                    "dead": 0,
                    "until": None,
                }
            ]
        },
        {"law": {"kind": "CohesiveLaw", "name": "mine"}},
        {"more": 1.0},
    ],
)
def test_nothing_else_is_believed(change: dict[str, Any]) -> None:
    record = record_of(po.Scene(FLAP))
    assert record is not None
    with pytest.raises((ValueError, TypeError, po.InvalidInput)):
        scene_of(record | change, FLAP)


def test_a_scene_that_is_none_is_refused() -> None:
    record = record_of(STORED["film"])
    assert record is not None
    with pytest.raises(po.InvalidInput, match="stays flat"):
        scene_of(record | {"stretch": None, "line_energy": 0.0}, FLAP)
    assert scene_of(record, replace(FLAP, adhesion_strength=1e5)).rod.adhesion_strength == 1e5
