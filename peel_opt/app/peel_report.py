"""A peel test for people and for programs."""

from __future__ import annotations

import math
from typing import Any

from ..analysis.peel import PeelPeak
from ..base.units import ShownUnits, display
from ..model.dimension import ENERGY, FORCE, LENGTH
from ..model.labels import CERTIFIED
from ..model.rod import Rod, Units
from .report import aligned, describe_rod
from .scene_report import DIGITS, quantity


def _factor(phi: float) -> str:
    """Return the factor of the angle in words: "1 - cos 180 deg = 2"."""
    return f"1 - cos {math.degrees(phi):.6g} deg = {2.0 * math.sin(0.5 * phi) ** 2:.6g}"


def peel_table(force: float, phi: float, work: float, shown: ShownUnits | None = None) -> str:
    """Return the force and the work of a peel on a long arm."""
    return aligned(
        [
            ["force", display(force, "N/m", DIGITS, shown)],
            ["work", display(work, "J/m^2", DIGITS, shown)],
            ["G = F (1 - cos phi)", f"{_factor(phi)}, on a long arm that neither stretches nor yields"],
        ]
    )


def peel_record(force: float, phi: float, work: float) -> dict[str, Any]:
    """Return the same as plain data, with units in the keys."""
    return {"kind": "peel", "force [N/m]": force, "angle [rad]": phi, "work [J/m^2]": work}


def begin_table(
    rod: Rod, phi: float, steady: float, peak: PeelPeak | None, shown: ShownUnits | None = None
) -> str:
    """Return how a rod peels on a long arm, and where a peel begins."""
    rows = [
        ["work", quantity(rod, rod.work_of_separation, ENERGY, shown=shown)],
        ["force on a long arm", f"{quantity(rod, steady, FORCE, shown=shown)}, {_factor(phi)}"],
    ]
    if peak is None:
        flat = (
            "pulled in line the flat rod stays flat" if phi >= math.pi else "no peak above the steady force"
        )
        rows.append(["where it begins", flat])
        return f"{describe_rod(rod, shown)}\n\n{aligned(rows)}"
    rows += [
        ["force as it begins", quantity(rod, peak.force, FORCE, shown=shown)],
        ["arm", quantity(rod, peak.arm, LENGTH, shown=shown)],
        ["detached length there", quantity(rod, peak.length, LENGTH, shown=shown)],
        ["error of F/(T0 eta)", f"{peak.error:.1e}, certificate {peak.certificate:.1e}"],
    ]
    return f"{describe_rod(rod, shown)}\n\n{aligned(rows)}"


def begin_record(rod: Rod, phi: float, steady: float, peak: PeelPeak | None) -> dict[str, Any]:
    """Return the same as plain data, with units in the keys; null where there is no peak."""
    units = Units.of(rod)
    record: dict[str, Any] = {"kind": "peel", **units.rod(rod), "angle [rad]": phi}
    record |= {f"long_arm_force [{units.force}]": steady}
    if peak is None:
        return record | {"initiation": None}
    own = {f"force [{units.force}]": peak.force, f"arm [{units.length}]": peak.arm}
    own |= {f"length [{units.length}]": peak.length, "tip_angle [rad]": peak.tip_angle}
    own |= {"force_ratio": peak.force_ratio, "error": peak.error, "certificate": peak.certificate}
    return record | {"initiation": own | {"law": peak.law, "status": CERTIFIED}}
