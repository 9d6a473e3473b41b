"""What tells one scene from every other, the same in every process."""

from __future__ import annotations

import casadi as ca

from .law_samples import texts
from .place import Place
from .scene import Scene
from .scene_record import words_of


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
