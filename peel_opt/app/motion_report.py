"""A motion for people and for programs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.units import display
from ..model.rod import Units
from ..model.scene import Scene
from ..motion.history import History
from ..motion.trajectory import OUTCOMES, Snap
from .report import aligned, describe_rod
from .scene_report import describe_scene

#: Moments of a history that its table shows.
ROWS = 13


def motion_table(moved: Snap) -> str:
    """Return the moments of a motion, where it ended, and how far to trust it."""
    rows = [["moment", "time", "sbar", "tip x", "tip y", "tip angle"]]
    for event in moved.events:
        lengths = (_length(moved, value) for value in (event.front, event.x, event.y))
        rows.append([event.kind, _time(moved, event.t), *lengths, f"{event.angle:.6f} rad"])
    lines = [
        *_moved(moved),
        "",
        aligned(rows),
        "",
        f"{moved.outcome}: {OUTCOMES[moved.outcome]}",
        f"front and tip are known to {moved.error:.1e} eta{_times(moved)}; certificate"
        f" {np.abs(moved.certificate).max():.1e}",
    ]
    if moved.events[-1].kind == "given up":
        lines.append("It was given up there: ask --until a time before, or give a --rod-length.")
    if np.isfinite(moved.growth_rate):
        lines.append(
            f"it leaves the unfolded state at a rate of {moved.growth_rate:.6g} {_per(moved.time_unit)}"
        )
    if moved.time_unit == "c eta/T0":
        lines.append(
            "Drag sets the time and was not given: give --drag, and --mass if it matters, for seconds."
        )
    return "\n".join(lines)


def _times(moved: Snap) -> str:
    """Say how well the times between moments are known, where there are two to compare."""
    if math.isnan(moved.time_error):
        return ""
    return f", times between moments to {moved.time_error:.1e} {moved.time_unit}"


def history_table(run: History) -> str:
    """Return where the front of a rod was as its pressure changed, and how far to trust it."""
    units, energy = Units.of(run.rod), "T0 eta^2" if run.rod.dimensionless else "J/m"
    rows = [["time", "pressure", "sbar", "tip y", f"lost [{energy}]"]]
    for i in np.searchsorted(run.t, np.linspace(run.t[0], run.t[-1], ROWS)):
        pressure = (
            f"{run.pressure[i]:.6g} {units.pressure}"
            if run.rod.dimensionless
            else display(float(run.pressure[i]), "Pa")
        )
        lengths = (_length(run, float(value[i])) for value in (run.front, run.tip.y))
        rows.append([_time(run, float(run.t[i])), pressure, *lengths, f"{run.dissipated[i]:.6g}"])
    lines = [
        *_moved(run),
        "",
        aligned(rows),
        "",
        f"{run.bond} bond, {run.outcome}: {OUTCOMES[run.outcome]}",
        f"the front is known to {run.error:.1e} eta, times to {run.time_error:.1e} {run.time_unit};"
        f" certificate {np.abs(run.certificate).max():.1e}",
        *(f"flag: {flag}" for flag in run.flags),
    ]
    if run.time_unit == "c eta/T0":
        lines.append("Drag sets the time and was not given: give drag under [rod] for seconds.")
    return "\n".join(lines)


def _moved(moved: Snap | History) -> list[str]:
    """Return the rod, and what acts on it."""
    scene = moved.scene
    if scene is None:
        return [describe_rod(moved.rod)]
    words = describe_scene(scene) if isinstance(scene, Scene) else scene
    return [describe_rod(moved.rod), f"scene: {words}"]


def _scene_of(moved: Snap | History) -> dict[str, Any]:
    """Return the scene, as plain data has it."""
    scene = moved.scene
    if isinstance(scene, Scene):
        return {"scene": describe_scene(scene)}
    return {} if scene is None else {"scene": scene}


def history_record(run: History) -> dict[str, Any]:
    """Return a history without its steps as plain data, with units in the keys."""
    units, energy = Units.of(run.rod), "T0 eta^2" if run.rod.dimensionless else "J/m"
    return {
        "kind": "history",
        **units.rod(run.rod),
        **_scene_of(run),
        "bond": run.bond,
        "law": run.law,
        "outcome": run.outcome,
        f"t [{run.time_unit}]": float(run.t[-1]),
        f"pressure [{units.pressure}]": float(run.pressure[-1]),
        f"length [{units.length}]": float(run.front[-1]),
        f"longest [{units.length}]": float(run.front.max()),
        f"dissipated [{energy}]": float(run.dissipated[-1]),
        f"bond_loss [{energy}]": float(np.ptp(run.energy.bond_loss)),
        "error [eta]": run.error,
        f"time_error [{run.time_unit}]": run.time_error if math.isfinite(run.time_error) else None,
        "certificate": float(np.abs(run.certificate).max()),
        "flags": list(run.flags),
    }


def _per(unit: str) -> str:
    """Return the unit of a rate, by that of a time."""
    return f"1/{unit}" if unit.isalpha() else f"1/({unit})"


def _time(moved: Snap | History, t: float) -> str:
    return display(t, "s") if moved.time_unit == "s" else f"{t:.6g} {moved.time_unit}"


def _length(moved: Snap | History, value: float) -> str:
    return f"{value:.6g} eta" if moved.rod.dimensionless else display(value, "m")


def motion_record(moved: Snap) -> dict[str, Any]:
    """Return a motion without its steps as plain data, with units in the keys."""
    units, time = Units.of(moved.rod), moved.time_unit
    events = [
        {
            "kind": e.kind,
            f"t [{time}]": e.t,
            f"front [{units.length}]": e.front,
            f"tip_x [{units.length}]": e.x,
            f"tip_y [{units.length}]": e.y,
            "tip_angle [rad]": e.angle,
        }
        for e in moved.events
    ]
    numbers = (moved.growth_rate, moved.error, moved.time_error)
    growth, error, time_error = (float(v) if np.isfinite(v) else None for v in numbers)
    return {
        "kind": "snap",
        **units.rod(moved.rod),
        **_scene_of(moved),
        f"pressure [{units.pressure}]": moved.pressure,
        "bond": moved.bond,
        "law": moved.law,
        "outcome": moved.outcome,
        f"growth_rate [{_per(time)}]": growth,
        "error [eta]": error,
        f"time_error [{time}]": time_error,
        "certificate": float(np.abs(moved.certificate).max()),
        "events": events,
    }
