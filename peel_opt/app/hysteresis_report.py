"""Hysteresis loops for people and for programs: a table of jumps, JSON, and files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.lambda_loop import HysteresisLoop
from ..analysis.loops import KIND
from ..analysis.pressure_loop import PressureLoop
from ..base.files import save_arrays
from ..base.records import Schema, Table, write_table
from ..base.units import display
from ..model.rod import Rod, Units
from .report import aligned, describe_rod, save_picture, settled, slug

AnyLoop = HysteresisLoop | PressureLoop

SCHEMA = Schema("peel_opt hysteresis", 1)

#: What the rod does at a jump.
JUMPS = {"up": "peels off", "down": "re-adheres"}


def loop_table(loop: AnyLoop) -> str:
    """Return what was swept, the jumps, and the area they enclose."""
    if isinstance(loop, PressureLoop):
        title = f"loop in the pressure, law (8), delay convention, {KIND}, {describe_rod(loop.rod)}"
        rows, area = _pressure_rows(loop), _pressure_area(loop)
    else:
        states = "solved states" if loop.source == "solver" else f"normal form: {loop.source}"
        title = f"loop in lambda, linear law, {loop.convention} convention, {states}, {KIND}"
        title += f", beta0 = {loop.beta0:g}"
        rows = [["jump", "what", "lambda", "alpha1 before", "alpha1 after"]]
        for jump in loop.jumps:
            values = (settled(v) for v in (jump.lam, jump.alpha1_before, jump.alpha1_after))
            rows.append([jump.direction, JUMPS[jump.direction], *values])
        area = f"{loop.area:.{loop.area_digits}g} (lambda times alpha1, no unit)"
    table = aligned(rows) if loop.jumps else "no jumps: the detached state grows out of the straight rod"
    lines = [title, "", table, "", f"area: {area}", f"states: {', '.join(loop.visited)}"]
    if (error := _largest_error(loop)) is not None:
        lines.append(f"error of the solved states up to {error:.1e}")
    return "\n".join([*lines, loop.not_computed] if loop.not_computed else lines)


def _pressure_rows(loop: PressureLoop) -> list[list[str]]:
    """Rows of the table of jumps: with units, unless the rod has only its own."""
    T0, eta = loop.rod.adhesion_strength, loop.rod.eta
    units = not loop.rod.dimensionless
    rows = [["jump", "what", *(["pressure", "length before", "length after"] if units else [])]]
    rows[0] += ["p/T0", "sbar/eta before", "sbar/eta after"]
    for jump in loop.jumps:
        lengths = (jump.length_before, jump.length_after)
        cells = [jump.direction, JUMPS[jump.direction]]
        if units:
            cells += [display(jump.pressure, "Pa", 8), *(display(v, "m", 8) if v else "0 m" for v in lengths)]
        rows.append([*cells, settled(jump.pressure / T0), *(settled(v / eta) for v in lengths)])
    return rows


def _pressure_area(loop: PressureLoop) -> str:
    digits = loop.area_digits
    scaled = f"{loop.area / (loop.rod.adhesion_strength * loop.rod.eta):.{digits}g} T0 eta"
    return scaled if loop.rod.dimensionless else f"{display(loop.area, 'Pa m', min(digits, 8))} = {scaled}"


def loop_record(loop: AnyLoop) -> dict[str, Any]:
    """Return a loop without its states as plain data, with units in the keys."""
    if isinstance(loop, PressureLoop):
        units = Units.of(loop.rod)
        T0, eta = loop.rod.adhesion_strength, loop.rod.eta
        head: dict[str, Any] = {"swept": "pressure", "law": "cohesive", "convention": "delay"}
        head |= {"source": "solver", **units.rod(loop.rod)}
        jumps = [
            {
                "direction": jump.direction,
                f"pressure [{units.pressure}]": jump.pressure,
                f"length_before [{units.length}]": jump.length_before,
                f"length_after [{units.length}]": jump.length_after,
                "pressure_ratio": jump.pressure / T0,
                "length_ratio_before": jump.length_before / eta,
                "length_ratio_after": jump.length_after / eta,
                "lam": jump.lam,
                "alpha1": jump.alpha1,
            }
            for jump in loop.jumps
        ]
        area = f"area [{units.pressure} {units.length}]"
        head |= {area: loop.area, "area_ratio": loop.area / (T0 * eta)}
        head |= {"area_ratio_error": loop.area_error / (T0 * eta)}
    else:
        head = {"swept": "lambda", "law": "linear", "convention": loop.convention}
        head |= {"source": loop.source, "beta0": loop.beta0}
        names = ("direction", "lam", "alpha1_before", "alpha1_after")
        jumps = [{name: getattr(jump, name) for name in names} for jump in loop.jumps]
        head |= {"area": loop.area, "area_error": None if np.isnan(loop.area_error) else loop.area_error}
    head |= {"kind": KIND, "jumps": jumps, "states": list(loop.visited), "error": _largest_error(loop)}
    return head | {"not_computed": loop.not_computed}


def write_loop(loop: AnyLoop, folder: Path, name: str, *, picture: bool = True) -> list[Path]:
    """Write NPZ, CSV and a picture under a name; return the files.

    Both tables have one row for each state in the order of the sweeps, which "leg" names; the
    rows of "between" are the unfolded states of a rod, which the loop does not visit.

    Raises
    ------
    InvalidInput
        If a file cannot be written.
    """
    head = SCHEMA.stamped(loop_record(loop))
    table = Table(head.items(), loop.columns)
    files = [
        save_arrays(folder / f"{name}.npz", head, table.titled),
        write_table(table, folder / f"{name}.csv"),
    ]
    if picture:
        files.append(save_picture(loop, folder / f"{name}.png"))
    return files


def loop_stem(rod: Rod | None, beta0: float | None, convention: str | None, form: str | None) -> str:
    """Return the name of the files of a loop: what is swept, and how it is read."""
    if rod is None:
        source = "" if form in (None, "solver") else f"-{form}"
        return slug(f"hysteresis-beta0-{beta0:.6g}-{convention or 'delay'}{source}")
    return slug(f"hysteresis-ratio-{rod.ratio:.6g}") if rod.dimensionless else "hysteresis-rod"


def _largest_error(loop: AnyLoop) -> float | None:
    """Return the largest error of a visited state; None where they come from a normal form."""
    error = float(max(loop.up.error.max(), loop.down.error.max()))
    return None if np.isnan(error) else error
