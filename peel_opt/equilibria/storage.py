"""What an equilibrium says of itself, and how its files are read back.

Files hold the shape in the paper's scaled variables, from which `Equilibrium` derives everything
else, so that what is read is what was written to the last bit.  A CSV holds much twice, for
everybody else, and is refused where it contradicts itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.records import Column, Table, array, entries, titled
from ..model.law_samples import samples
from ..model.named_laws import law_named
from ..model.rod import Rod, Units, rod_from
from ..residual.shape import Shape, Solution

if TYPE_CHECKING:
    from ..model.scene import Scene
    from .result import Equilibrium

#: How far a number may lie from what follows from others: powers and roots round as the machine does.
SAME = 1e-12
#: The same of eta/y0, which is held only as well as the solver holds what it is given.
SAME_RATIO = 1e-9

#: Numbers of an equilibrium that are stored; all others follow from them.
_FLOATS = ("beta0", "lam", "alpha1", "error", "certificate", "tol")
_TEXTS = ("law", "answered", "state", "status", "message")

#: Names of the scaled shape in a table, and their units; theta is the same in both units.
_SCALED = {
    "xi": ("s/sbar", ""),
    "x": ("x/sbar", ""),
    "y": ("y/sbar", ""),
    "theta": ("theta", "rad"),
    "curvature": ("curvature*sbar", ""),
    "Nx": ("Nx*sbar^2/k", ""),
    "Ny": ("Ny*sbar^2/k", ""),
}


def equilibrium_record(eq: Equilibrium) -> dict[str, Any]:
    """Return all numbers of an equilibrium, named as its attributes, with the unit in the key.

    Without a rod, lengths are in units of sbar and pressures in k/sbar^3; for a rod known by
    its ratio alone, in its eta and T0.
    """
    units = Units.of(eq.rod)
    has_shape = eq.shape.xi.size > 0
    record: dict[str, Any] = {
        f"pressure [{units.pressure}]": float(eq.pressure),
        f"length [{units.length}]": float(eq.length),
        "pressure_ratio": float(eq.pressure_ratio),
        "length_ratio": float(eq.length_ratio),
        "ratio": float(eq.ratio),
        "beta0": float(eq.beta0),
        "beta1": float(eq.beta1),
        "lam": float(eq.lam),
        "alpha": float(eq.alpha),
        "alpha1": float(eq.alpha1),
        "tip_angle [rad]": eq.tip_angle if has_shape else float("nan"),
        f"tip_height [{units.length}]": eq.tip_height if has_shape else float("nan"),
        "answered": eq.answered,
        "error": float(eq.error),
        "certificate": float(eq.certificate),
        "tol": float(eq.tol),
        "law": eq.law,
        "state": eq.state,
        "status": eq.status,
        "valid": bool(eq.valid),
        "flags": list(eq.flags),
        "message": eq.message,
    }
    return record | units.rod(eq.rod) | _stats(eq)


def equilibrium_head(eq: Equilibrium) -> dict[str, Any]:
    """Return everything that restores an equilibrium beside its shape, ready for JSON."""
    head: dict[str, Any] = {"points": len(eq.shape.xi)}
    head |= {name: float(getattr(eq, name)) for name in _FLOATS}
    head |= {name: getattr(eq, name) for name in _TEXTS}
    head |= {"flags": list(eq.flags), "given": eq.given}
    if own := own_samples(eq):
        head["law_samples"] = list(own)
    if eq.scene is not None:
        head |= {**scene_head(eq.scene), "scene_numbers": eq.numbers, "unit": eq.unit}
    return head | Units.of(eq.rod).rod(eq.rod) | _stats(eq)


def scene_head(scene: Scene | str) -> dict[str, Any]:
    """Return a scene in words, and what it is made of where none of its parts is the reader's own."""
    if isinstance(scene, str):
        return {"scene": scene}
    from ..model.scene_record import record_of, words_of  # which takes long to import

    record = record_of(scene)
    return {"scene": words_of(scene)} | ({} if record is None else {"scene_parts": record})


def scene_from(head: Mapping[str, Any], rod: Rod | None) -> Scene | str | None:
    """Return the scene that `scene_head` was made of, or what it was called."""
    if "scene_parts" in head and rod is not None:
        from ..model.scene_record import scene_of

        return scene_of(entries(head, dict, "scene_parts")["scene_parts"], rod)
    return str(entries(head, str, "scene")["scene"]) if "scene" in head else None


def own_samples(eq: Equilibrium) -> tuple[float, ...]:
    """Return samples of the law, where its name does not say which it is."""
    if not isinstance(eq.source, Solution) or law_named(eq.law) is not None:
        return eq.law_samples
    return samples(eq.source.law)


def equilibrium_table(eq: Equilibrium, head: Mapping[str, Any]) -> Table:
    """Return the shape, with a rod in its units first and scaled next, under all numbers."""
    derived = {key: value for key, value in equilibrium_record(eq).items() if key not in head}
    scaled = {name: Column(getattr(eq.shape, key), unit) for key, (name, unit) in _SCALED.items()}
    return Table([*head.items(), *derived.items()], _in_units(eq) | scaled)


def _in_units(eq: Equilibrium) -> dict[str, Column]:
    """Return the shape in the units of the rod, without theta; nothing without one."""
    if eq.rod is None:
        return {}
    units = Units.of(eq.rod)
    named = dict.fromkeys("sxy", units.length) | {"curvature": f"1/{units.length}"}
    named |= {"Nx": units.force, "Ny": units.force}
    return {name: Column(getattr(eq, name), unit) for name, unit in named.items()}


def _stats(eq: Equilibrium) -> dict[str, Any]:
    return {
        # NumPy's scalars are no numbers to JSON.
        f"stats.{key}{' [s]' * (key == 'seconds')}": value.item() if isinstance(value, np.generic) else value
        for key, value in asdict(eq.stats).items()
    }


def stats_from(head: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Return the numbers of how an answer was computed, by these names."""
    named = {key.split(" [")[0]: value for key, value in head.items()}
    return {name: named[f"stats.{name}"] for name in names}


def shape_arrays(shape: Shape) -> dict[str, np.ndarray]:
    """Return the arrays of a shape by name."""
    return {f.name: np.asarray(getattr(shape, f.name), float) for f in fields(Shape)}


def scaled_arrays(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the arrays of the shape from the columns of a CSV."""
    titles = {key: titled(*named) for key, named in _SCALED.items()}
    for title in titles.values():
        if title not in columns:
            raise ValueError(f"it has no column {title!r}")
    return {key: columns[title] for key, title in titles.items()}


def equilibrium_parts(head: dict[str, Any], arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """Return what an equilibrium is made of, without its stats."""
    shape = Shape(**{f.name: array(arrays, f.name, "f", (head["points"],)) for f in fields(Shape)})
    given = head.get("given", {})  # which files of earlier versions do not have
    flags = head["flags"]
    if not isinstance(flags, list) or not all(isinstance(flag, str) for flag in flags):
        raise ValueError("flags are no texts")
    own = head.get("law_samples", [])  # likewise
    numbers_of_scene = head.get("scene_numbers", {})
    if not isinstance(numbers_of_scene, dict) or not all(
        isinstance(value, float) for value in numbers_of_scene.values()
    ):
        raise ValueError("scene_numbers holds no numbers")
    if not isinstance(own, list) or not all(isinstance(value, float) for value in own):
        raise ValueError("law_samples holds no numbers")
    if not isinstance(given, dict) or not all(isinstance(value, float) for value in given.values()):
        raise ValueError("given holds no numbers")
    numbers = entries(head, float, *_FLOATS) | entries(head, str, *_TEXTS)
    told: dict[str, Any] = {"flags": tuple(flags), "given": given, "law_samples": tuple(own)}
    rod = rod_from(head)
    if "scene" in head:
        told |= {"scene": scene_from(head, rod), "numbers": numbers_of_scene, **entries(head, float, "unit")}
    return {"rod": rod, "source": shape, **told, **numbers}


def require_agreement(eq: Equilibrium, head: dict[str, Any], columns: dict[str, np.ndarray]) -> None:
    """Raise if what a file says twice is not the same, as in a CSV that was edited in part."""
    derived: dict[str, Any] = equilibrium_record(eq) | Table((), _in_units(eq)).titled
    if eq.rod is not None and math.isfinite(eq.ratio) and not _agree(eq.rod.ratio, eq.ratio, SAME_RATIO):
        raise ValueError(f"its rod has eta/y0 = {eq.rod.ratio!r}, its equilibrium {eq.ratio!r}")
    if math.isfinite(eq.alpha1):
        # What was given stands for what follows from the groups, and must not hide that it does not.
        bare = replace(eq, given={})
        for key, value in eq.given.items():  # of a question that was added, no other number tells
            if hasattr(bare, key) and not _agree(value, getattr(bare, key), SAME_RATIO):
                raise ValueError(f"its given {key!r} is not what follows from its other numbers")
    for key, stored in (head | columns).items():
        if key in derived and not _agree(stored, derived[key]):
            raise ValueError(f"its {key!r} is not what follows from its other numbers")
    if eq.scene is not None and not isinstance(eq.scene, str):
        sizes = {name: kind.size(eq.scene.rod) for name, kind in eq.scene.dimensions.items()}
        for name, value in eq.scene.numbers.items():
            if name != eq.answered and not _agree(eq.numbers.get(name), value * sizes[name]):
                raise ValueError(f"its {name!r} is not what its scene is made of")
    if eq.certified and not max(eq.error, eq.certificate) <= eq.tol:
        raise ValueError("it calls itself certified, with an error or a certificate above its tol")


def _agree(stored: Any, derived: Any, within: float = SAME) -> bool:
    """Whether two numbers, or all of two arrays, are one but for rounding; other values if they are equal."""
    if isinstance(derived, bool | str | list) or not isinstance(stored, int | float | np.ndarray):
        return bool(stored == derived)
    if np.shape(stored) != np.shape(derived):
        return False
    known = np.asarray(derived, float)
    size = np.max(np.abs(known), where=np.isfinite(known), initial=0.0)
    return bool(np.allclose(stored, known, rtol=0.0, atol=within * size, equal_nan=True))
