"""An edge without glue, for people and for programs: which is critical, what is safe, when it closes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..analysis.flaws import PressureLimit
from ..analysis.unbonded import FlawLimit, safe_pressure
from ..base.errors import NoEquilibrium, PeelOptError
from ..base.units import ShownUnits
from ..model.dimension import LENGTH, TRACTION
from ..model.labels import CERTIFIED
from ..model.rod import Rod, Units
from .report import aligned, as_record, describe_rod, write_rows
from .scene_report import quantity

#: Lengths without glue over eta of a chart.
CHARTED = (0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)


def limits_of(rod: Rod, flaws: Sequence[float] = CHARTED, law: str = "auto") -> list[FlawLimit]:
    """Return where edges snap, given over eta in rising order, up to those that grow stably instead."""
    found: list[FlawLimit] = []
    for flaw in flaws:
        try:
            found.append(safe_pressure(rod, rod.length(flaw), law=law))
        except NoEquilibrium:
            break
    return found


def flaw_table(
    rod: Rod,
    asked: Sequence[tuple[str, FlawLimit]],
    least: PressureLimit | PeelOptError,
    chart: Sequence[FlawLimit],
    shown: ShownUnits | None = None,
) -> str:
    """Return what was asked of edges without glue, the limits of the rod, and a chart in numbers."""
    lines = [describe_rod(rod, shown), ""]
    rows = []
    for label, limit in asked:
        flaw = quantity(rod, limit.flaw, LENGTH, shown=shown)
        pressure = quantity(rod, limit.pressure, TRACTION, shown=shown)
        rows.append([label, f"an edge without glue on {flaw} snaps at {pressure}; a shorter one holds"])
        rows.append(["", f"error {limit.error:.1e}, certificate {limit.certificate:.1e}"])
    top = quantity(rod, rod.adhesion_strength, TRACTION, shown=shown)
    rows.append(["bond strength", f"from T0 = {top} on every edge snaps"])
    if isinstance(least, PeelOptError):
        rows.append(["re-adhesion", str(least)])
    else:
        bottom = quantity(rod, least.pressure, TRACTION, shown=shown)
        rows.append(["re-adhesion", f"below p_min = {bottom} every lifted edge closes, if its bond heals"])
    lines.append(aligned(rows))
    if chart:
        head = ["length without glue", "snaps at", "p/T0", "error"]
        body = [
            [
                quantity(rod, limit.flaw, LENGTH, 6, shown),
                quantity(rod, limit.pressure, TRACTION, 6, shown),
                f"{limit.pressure_ratio:.6f}",
                f"{limit.error:.1e}",
            ]
            for limit in chart
        ]
        lines += ["", aligned([head, *body])]
    return "\n".join(lines)


def flaws_record(
    asked: Sequence[tuple[str, FlawLimit]],
    rod: Rod,
    least: PressureLimit | PeelOptError,
    chart: Sequence[FlawLimit],
) -> dict[str, Any]:
    """Return the same as plain data, with units in the keys."""
    unit = Units.of(rod).pressure
    if isinstance(least, PeelOptError):
        closing: dict[str, Any] = {"status": least.status, "message": str(least)}
    else:
        closing = {f"pressure [{unit}]": least.pressure, "pressure_ratio": least.pressure_ratio}
        closing |= {"error": least.error, "status": CERTIFIED}
    return {
        "kind": "flaw",
        **Units.of(rod).rod(rod),
        "answers": [as_record(label, limit) for label, limit in asked],
        "readhesion": closing,
        "chart": [as_record("", limit) for limit in chart],
    }


def write_chart(chart: Sequence[FlawLimit], rod: Rod, path: Path, *, picture: bool) -> None:
    """Write a chart of flaws as CSV, and as a picture where two edges snap; the path has no suffix yet.

    Raises
    ------
    InvalidInput
        If a file cannot be written.
    """
    rows = [as_record("", limit) for limit in chart]
    columns = [key for key in (rows[0] if rows else {}) if key not in ("question", "flags")]
    write_rows(rows, columns, path.with_name(f"{path.name}.csv"))
    if picture and len(chart) > 1:
        from ..plots import plot_safe_pressures, save_figure

        figure: Any = plot_safe_pressures(rod, chart).figure
        save_figure(figure, path.with_name(f"{path.name}.png"))
