"""Rods of the commands over many: options of the material, with spreads or with several values."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ...base.errors import InvalidInput
from .common import MATERIAL, SHEET, material_of, rod_of_material

if TYPE_CHECKING:
    from ...model.rod import Rod


def uncertain_rod(arguments: argparse.Namespace, base: Rod | None) -> tuple[Rod, dict[str, str]]:
    """Return the nominal rod that the options describe, and their spreads, by the names in Python.

    Parameters
    ----------
    arguments : argparse.Namespace
    base : Rod, optional
        That of a card, whose numbers stand where an option has none.
    """
    from ...base.units import NUMBER
    from ...studies.uncertainty.inputs import KINDS, middle, split

    plain = base is not None and base.dimensionless
    texts, spread = {}, {}
    for flag, text in material_of(arguments).items():
        name = MATERIAL[flag]
        kind = NUMBER if plain else KINDS[name]
        value, around = split(text)
        if ".." in around and not value:
            value = f"{middle(f'--{flag}', around, kind, signed=flag == 'nu')!r} {kind.si}".strip()
        if value:
            texts[flag] = value
        if around:
            spread[name] = around
    return _of(texts, base), spread


def _of(texts: Mapping[str, str], base: Rod | None) -> Rod:
    """Return the rod of some options; what they leave open is that of another."""
    from ...base.checks import parse
    from ...base.units import NUMBER
    from ...model.rod import Rod

    if base is None:
        return rod_of_material(dict(texts))
    if not texts:
        return base
    if base.dimensionless:
        if strange := [f"--{flag}" for flag in texts if flag in SHEET]:
            raise InvalidInput(f"{strange[0]} says nothing of a rod that is known by its ratio alone.")
        own = {MATERIAL[flag]: parse(f"--{flag}", text, NUMBER) for flag, text in texts.items()}
        return Rod(*(own.get(name, getattr(base, name)) for name in list(MATERIAL.values())[:3]))
    missing: dict[str, float] = {}
    if not texts.keys() & {"k", "E", "thickness", "nu"}:
        missing["k"] = base.bending_stiffness
    elif "k" not in texts and base.sheet is not None:
        missing |= {flag: getattr(base.sheet, MATERIAL[flag]) for flag in ("E", "thickness", "nu")}
    bond = texts.keys() & {"T0", "y0", "work"}
    # Of a rod with another strength the range stays, as it does where the work is another.
    left = {"T0"} if len(bond) == 1 and "T0" not in bond else {"y0"} if bond == {"T0"} else {"T0", "y0"}
    missing |= {flag: getattr(base, MATERIAL[flag]) for flag in left if len(bond) < 2}
    named = {
        flag: f"{value!r} {_UNITS[flag]}".strip() for flag, value in missing.items() if flag not in texts
    }
    made = rod_of_material({**named, **texts})
    if "k" in missing and made.bending_stiffness == base.bending_stiffness:
        made = Rod(base.bending_stiffness, made.adhesion_strength, made.adhesion_range, sheet=base.sheet)
    return made


#: SI units of the options.
_UNITS = {"k": "N m", "T0": "Pa", "y0": "m", "E": "Pa", "thickness": "m", "nu": "", "work": "J/m^2"}


def sheet_axes(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return k and y0 or T0 as axes, where the rod is given by a sheet or by its work of separation.

    One of the options may have several values, each of which makes a rod.
    """
    import numpy as np

    from ...studies.sweep.ranges import parse_range
    from ...studies.uncertainty.inputs import KINDS

    given = material_of(arguments)
    sheet = [flag for flag in ("E", "thickness", "nu") if flag in given]
    axes: dict[str, Any] = {}
    for flags, others, made in (
        (sheet, {"T0": "1 Pa", "y0": "1 m"}, "bending_stiffness"),
        ([f for f in ("T0", "y0", "work") if f in given] if "work" in given else [], {"k": "1 N m"}, ""),
    ):
        if not flags:
            continue
        own = {
            flag: parse_range(f"--{flag}", given[flag], KINDS[MATERIAL[flag]], signed=flag == "nu")
            for flag in flags
        }
        several = [flag for flag, values in own.items() if np.ndim(values)]
        if len(several) > 1:
            raise InvalidInput(
                f"--{several[0]} and --{several[1]} have several values, and make one number of the rod.",
                remedy="Vary one of them, or --k, --T0 and --y0.",
            )
        count = len(own[several[0]]) if several else 1  # type: ignore[arg-type]
        rods = [
            rod_of_material(
                others
                | {
                    f: f"{float(np.atleast_1d(v)[i % np.size(v)])!r} {_UNITS[f]}".strip()
                    for f, v in own.items()
                }
            )
            for i in range(count)
        ]
        for name in [made] if made else ["adhesion_strength", "adhesion_range"]:
            values = np.array([getattr(rod, name) for rod in rods])
            axes[name] = values if np.ptp(values) else float(values[0])
    if sum(np.ndim(axes.get(name, 0.0)) for name in ("adhesion_strength", "adhesion_range")) > 1:
        raise InvalidInput(
            "--T0 of several values beside --work changes the range with the strength.",
            remedy="Sweep from Python with zipped=True, or give --y0.",
        )
    return axes
