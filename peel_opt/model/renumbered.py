"""A scene with other numbers, by the names that it has for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from ..base.errors import InvalidInput
from .rod import Rod
from .scene import OWN, Scene
from .tips import FREE, Middle


def renumbered(scene: Scene, numbers: Mapping[str, float], rod: Rod | None = None) -> Scene:
    """Return the same scene with some of its numbers replaced.

    Parameters
    ----------
    scene : Scene
    numbers : mapping of str to float
        By the names that ``solve`` frees them by, in the units of the rod.
    rod : Rod, optional
        In place of its own; what is not among the numbers stays as it is in the units of both.

    Raises
    ------
    InvalidInput
        If the scene has no such number, or the new one is none that it may have.
    """
    if strange := [name for name in numbers if name not in scene.numbers]:
        raise InvalidInput(
            f"{strange[0]!r} is no number of this scene.",
            remedy=f"It has {', '.join(scene.numbers) or 'none'}; name a load in the scene, with any size.",
        )
    own: dict[str, Any] = {name: value for name, value in numbers.items() if name in OWN}
    parts: dict[str, Any] = {"loads": scene.loads, "wall": scene.wall, "tip": scene.tip, "law": scene.law}
    for name in numbers.keys() - own.keys():
        value = float(numbers[name])
        parts["loads"] = tuple(_with(load, name, value) for load in parts["loads"])
        parts |= {kind: _with(parts[kind], name, value) for kind in ("wall", "tip", "law")}
    if isinstance(scene.tip, Middle):  # which a blister makes of its own numbers
        own |= {kind: getattr(parts["tip"], kind) for kind in ("roller", "slack") if hasattr(scene, kind)}
        parts["tip"] = FREE
    return replace(scene, rod=scene.rod if rod is None else rod, **parts, **own)


def _with(part: Any, name: str, value: float) -> Any:
    """Return a part of a scene with one of its numbers replaced, if it has one of that name."""
    has = getattr(part, "numbers", None)
    if has is None or name not in has():
        return part
    if has()[name] == value:
        return part
    for field in fields(part) if is_dataclass(part) else ():
        inner = getattr(part, field.name)
        if not field.init:
            continue
        if isinstance(inner, int | float) and inner == has()[name]:
            changed = replace(part, **{field.name: value})
        elif hasattr(inner, "numbers"):
            changed = replace(part, **{field.name: _with(inner, name, value)})
        else:
            continue
        if changed.numbers() == has() | {name: value}:
            return changed
    raise InvalidInput(
        f"{type(part).__name__} does not say which of its fields {name!r} is.",
        remedy="Make it a frozen dataclass whose field is that number.",
    )
