"""A scene as plain data, and back, and what tells it from every other.

The data are the names of its parts and the fields they were made with.

A file holds no code.  A part or a law of the reader's own is code, and so is a profile that is a function:
of a scene with one of them there is no record, and its files say in words what it was.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import casadi as ca

from . import loads, profiles, tips, walls
from .blister import Blister
from .bond import CohesiveLaw
from .law_samples import texts
from .layer import ElasticLayer
from .mixed_bonds import EffectiveOpening, ShearSprings
from .named_laws import law_named
from .place import Place
from .rod import Rod
from .scene import Scene

#: What scenes are made of, by name.
PARTS: dict[str, type[Any]] = {
    kind.__name__: kind
    for kind in (
        loads.Pressure,
        loads.Weight,
        loads.SkinFriction,
        loads.Drag,
        profiles.Linear,
        profiles.Exponential,
        profiles.Mixed,
        profiles.Jet,
        profiles.Height,
        walls.Flat,
        walls.Circle,
        tips.TipLoad,
        tips.Free,
        tips.Contact,
        EffectiveOpening,
        ShearSprings,
        ElasticLayer,
    )
}

#: A scene and half of a strip, whose tip is its middle.
KINDS: dict[str, type[Scene]] = {"Scene": Scene, "Blister": Blister}

#: What the name of a law stands under.
LAW = "CohesiveLaw"

#: Where an object lies in memory, which says nothing about it.
_ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")


def words_of(scene: Scene) -> str:
    """Return a scene in words, the same in every process."""
    return _ADDRESS.sub("", repr(scene))


def identity_of(scene: Scene) -> list[str]:
    """Return a scene as texts: its parts in words, loads and wall as expressions, its law by its values.

    A function of the reader's own is known by what it computes, whatever it is called and wherever it stands.
    """
    symbols = {name: ca.SX.sym(name) for name in ("s", "sbar", "theta", "x", "y", "slip", "strain")}
    numbers = {name: ca.SX.sym(name) for name in (*scene.numbers, "pressure", "ratio")}
    computed = []
    for past in (frozenset[str](), frozenset(scene.breaks)):
        at = Place(**symbols, past=past)
        found = [ca.SX(part) for part in (*scene.load(at, numbers), *scene.wall.gap(at, numbers))]
        both = ca.Function("scene", [*symbols.values(), *numbers.values()], found)
        computed.append(both.serialize())
    return [words_of(scene), *computed, *texts(scene.bond.law)]


def record_of(scene: Scene) -> dict[str, Any] | None:
    """Return a scene as plain data, without its rod; None where a part of it is the reader's own.

    Examples
    --------
    >>> from peel_opt import Circle, Rod, Scene
    >>> record_of(Scene(Rod.from_ratio(1.0), wall=Circle(-0.1)))["wall"]
    {'kind': 'Circle', 'curvature': -0.1}
    """
    kind = next((name for name, known in KINDS.items() if type(scene) is known), None)
    if kind is None:
        return None
    try:
        return {"kind": kind} | {name: _plain(getattr(scene, name)) for name in _own(KINDS[kind])}
    except TypeError:
        return None


def scene_of(record: Mapping[str, Any], rod: Rod) -> Scene:
    """Return the scene of a rod that a record is of.

    Raises
    ------
    ValueError
        If it is no such record.
    InvalidInput
        If there is no such scene.
    """
    kind = KINDS.get(str(record.get("kind")))
    if kind is None or set(record) != {"kind", *_own(kind)}:
        raise ValueError("scene_parts are those of no scene")
    scene = kind(rod, **{name: _made(record[name]) for name in _own(kind)})
    if not all(math.isfinite(value) for value in scene.numbers.values()):
        raise ValueError("a number of its scene is not finite")
    return scene


def _own(kind: type[Any]) -> list[str]:
    """Return the fields that a part, or a scene beside its rod, is made with."""
    left_out = {"rod", "tip"} if kind is Blister else {"rod"}
    return [f.name for f in fields(kind) if f.init and f.name not in left_out]


def _plain(value: Any) -> Any:
    """Return a number, text or part of a scene as plain data.

    Raises
    ------
    TypeError
        If it is the reader's own.
    """
    if isinstance(value, CohesiveLaw):
        if law_named(value.name) != value:
            raise TypeError("a law of the reader's own")
        return {"kind": LAW, "name": value.name}
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    name = type(value).__name__
    if PARTS.get(name) is not type(value):
        raise TypeError("a part of the reader's own")
    return {"kind": name} | {field: _plain(getattr(value, field)) for field in _own(type(value))}


def _made(value: Any) -> Any:
    """Return what `_plain` was given."""
    if isinstance(value, list):
        return tuple(_made(part) for part in value)
    if not isinstance(value, dict):
        return value
    kind = str(value.get("kind"))
    if kind == LAW:
        law = law_named(str(value["name"]))
        if law is None:
            raise ValueError(f"there is no law {value['name']!r}")
        return law
    made = PARTS.get(kind)
    if made is None or set(value) != {"kind", *_own(made)}:
        raise ValueError(f"there is no such part of a scene: {kind!r:.40}")
    return made(**{name: _made(value[name]) for name in _own(made)})
