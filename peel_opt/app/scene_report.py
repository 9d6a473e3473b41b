"""Scenes and flaws in words, and their numbers with units."""

from __future__ import annotations

import math
import re
from typing import Any

from ..analysis.unbonded import FlawLimit
from ..base.units import ANGLE, CURVATURE, ShownUnits, display
from ..equilibria.result import Equilibrium
from ..model.blister import Blister
from ..model.dimension import LENGTH, Dimension
from ..model.labels import CERTIFIED
from ..model.loads import Pressure
from ..model.mixed_bonds import LINE, Opening, ShearSprings
from ..model.rod import Rod, Units
from ..model.scene import Scene
from ..model.tips import Contact

#: As many digits as the default tolerance guarantees.
DIGITS = 8


def describe_scene(scene: Scene, shown: ShownUnits | None = None) -> str:
    """Return in one line what acts on the rod of a scene: kinds in words, then its numbers."""
    rod, q, words = scene.rod, scene.numbers, []
    if isinstance(scene, Blister):
        words.append("half of a strip between two edges")
    profiles = [load.profile for load in scene.loads if isinstance(load, Pressure) and load.profile]
    words += [f"pressure profile {_in_words(profile)}" for profile in profiles]
    if kw := q.get("curvature"):
        words.append(f"wall {'inside' if kw > 0.0 else 'outside'} a circle of radius")
        words[-1] += f" {quantity(rod, rod.eta / abs(kw), LENGTH, 4, shown)}"
    if isinstance(scene.tip, Contact):
        words.append("tip resting on the wall")
    if scene.bond is LINE:
        words.append("held by the line energy of its front alone")
    elif not isinstance(scene.bond, Opening):
        hard = isinstance(scene.bond, ShearSprings) and not scene.bond.softening
        words.append(f"bond {_in_words(scene.bond)}{' that do not soften' * hard}")
    if scene.bond is not LINE and scene.layer is None and scene.law != "auto":
        words.append(f"{scene.bond.name} law")
    kinds = scene.dimensions
    given = {name: value * kinds[name].size(rod) for name, value in q.items() if value}
    words += [f"{name} = {quantity(rod, value, kinds[name], 6, shown)}" for name, value in given.items()]
    return ", ".join(words) or "as in the paper"


def _in_words(part: object) -> str:
    """Return what a part of a scene is called: "shear springs"."""
    return re.sub(r"(?<=.)([A-Z])", r" \1", type(part).__name__).lower()


def found_numbers(eq: Equilibrium) -> dict[str, tuple[float, Dimension]]:
    """Return the numbers of a scene that were not given but found, with what they measure."""
    if not isinstance(eq.scene, Scene):
        return {}
    kinds = eq.scene.dimensions | eq.scene.readings
    names = ([eq.answered] if eq.answered in eq.numbers else []) + list(eq.scene.readings)
    return {name: (eq.numbers[name], kinds[name]) for name in names}


def quantity(
    rod: Rod,
    value: float,
    dimension: Dimension,
    digits: int = DIGITS,
    shown: ShownUnits | None = None,
) -> str:
    """Return a number of a scene with its unit; an angle of a rod with units in degrees."""
    if rod.dimensionless or not dimension.unit:
        return f"{value:.{digits}g} {dimension.unit_of(rod)}".rstrip()
    if shown and dimension.unit in shown:
        return display(value, dimension.unit, digits, shown)
    if dimension.unit == ANGLE.si:
        return f"{math.degrees(value):.{digits}g} deg"
    if dimension.unit == CURVATURE.si:  # which has no prefixes
        return f"{value:.{digits}g} {dimension.unit}"
    return display(value, dimension.unit, digits)


def flaw_cells(limit: FlawLimit, shown: ShownUnits | None = None) -> dict[str, str]:
    """Return what a reader wants to know of the snap of a flaw, as texts by title."""
    found: dict[str, str] = {}
    if not limit.rod.dimensionless:
        found = {
            "pressure": display(limit.pressure, "Pa", DIGITS, shown),
            "length": display(limit.length, "m", DIGITS, shown),
        }
    flaw = quantity(limit.rod, limit.flaw, LENGTH, shown=shown)
    return found | {
        "with": f"flaw = {flaw}",
        "p/T0": number(limit.pressure_ratio),
        "sbar/eta": number(limit.length / limit.rod.eta),
        "state": "snap",
        "law": limit.law,
        "status": CERTIFIED,
        "error": f"{limit.error:.1e}",
        "certificate": f"{limit.certificate:.1e}",
        "flags": "-",
    }


def scene_record(eq: Equilibrium) -> dict[str, Any]:
    """Return the numbers of a scene, given and found, with units in the keys."""
    if not isinstance(eq.scene, Scene):
        return {}
    kinds = eq.scene.dimensions | eq.scene.readings
    units = {name: kinds[name].unit_of(eq.scene.rod) for name in eq.numbers}
    numbers = {f"{name} [{unit}]" if (unit := units[name]) else name: v for name, v in eq.numbers.items()}
    return {"scene": describe_scene(eq.scene), **numbers}


def flaw_record(limit: FlawLimit) -> dict[str, Any]:
    """Return the snap of a flaw as plain data, with units in the keys."""
    units = Units.of(limit.rod)
    named = {"pressure": units.pressure, "flaw": units.length, "length": units.length, "tip_angle": "rad"}
    record: dict[str, Any] = {f"{name} [{unit}]": getattr(limit, name) for name, unit in named.items()}
    record |= {
        name: getattr(limit, name) for name in ("pressure_ratio", "flaw_ratio", "error", "certificate")
    }
    return record | {"law": limit.law, "status": CERTIFIED, "flags": []} | units.rod(limit.rod)


def number(value: float) -> str:
    """Write a pure number; one that does not exist as a dash."""
    return f"{value:.{DIGITS}g}" if math.isfinite(value) else "-"
