"""Branches for people and for programs: a table of special points, and JSON."""

from __future__ import annotations

from typing import Any

from ..base.units import display
from ..equilibria.branch import Branch
from ..model.labels import special_kind
from ..model.rod import Rod, Units
from ..model.scene import Scene
from .report import aligned, describe_rod, settled, slug
from .scene_report import describe_scene


def special_table(branch: Branch) -> str:
    """Return what the branch is, its special points in order, and how far to trust them."""
    rod = branch.rod
    held = f"{branch.hold} = {branch.held:.10g}" if rod is None else describe_rod(rod)
    lines = [f"branch of {len(branch)} points, {branch.law} law, {held}"]
    if isinstance(branch.scene, Scene):
        lines.append(f"scene: {describe_scene(branch.scene)}")
    lines.append("")
    rows = [["kind", "what", *_titles(branch), "status"]]
    for point in branch.special_points:
        cells = [point.kind, special_kind(point.kind).words]
        if rod is not None and not rod.dimensionless:
            cells += [display(point.pressure, "Pa", 8), display(point.length, "m", 8)]
        values = (point.pressure_ratio, point.length_ratio, point.lam, point.alpha1)
        cells += [settled(v) for v in values]
        rows.append([*cells, point.status])
    lines.append(aligned(rows))
    ended = f"ended: {branch.ended}; error up to {branch.error.max():.1e}"
    return "\n".join([*lines, "", f"{ended}, certificate up to {branch.certificate.max():.1e}"])


def _titles(branch: Branch) -> list[str]:
    units = ["pressure", "length"] if branch.rod is not None and not branch.rod.dimensionless else []
    return [*units, "p/T0", "sbar/eta", "lambda", "alpha1"]


def branch_record(branch: Branch) -> dict[str, Any]:
    """Return a branch without its points as plain data, with units in the keys."""
    special = branch.special_points
    points = [point.numbers | {"bracket": list(point.bracket)} | point.in_units for point in special]
    return {
        "points": len(branch),
        "law": branch.law,
        "hold": branch.hold,
        "held": branch.held,
        **Units.of(branch.rod).rod(branch.rod),
        "ended": branch.ended,
        "error": float(branch.error.max()),
        "certificate": float(branch.certificate.max()),
        "options": branch.options,
        "special_points": points,
    }


def branch_stem(rod: Rod | None, beta0: float | None, mode: int = 1) -> str:
    """Return the name of the files of a branch: what is held, and which branch if not the first."""
    held = f"beta0-{beta0:.6g}" if rod is None else f"ratio-{rod.ratio:.6g}" if rod.dimensionless else "rod"
    return slug(f"branch-{held}" if mode == 1 else f"branch-{held}-mode-{mode}")
