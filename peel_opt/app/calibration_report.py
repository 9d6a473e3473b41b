"""Fits for people and for programs: a table, JSON, CSV and a picture."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import NotConverged
from ..base.units import display
from ..studies.calibrate.profile import BetterFit
from ..studies.calibrate.record import Intervals
from ..studies.calibrate.result import Fit
from ..studies.calibrate.scene_fit import SceneCalibration
from .card_tables import one_line
from .report import aligned, describe_rod, slug
from .scene_report import describe_scene

if TYPE_CHECKING:
    from .calibration_cards import CalibrationCard


def heading(card: CalibrationCard, path: str) -> str:
    """Return what is fitted to what, and what it rests on."""
    files = [*(t.file for t in card.pairs), *(t.file for t in card.shapes)]
    lines = [f"{one_line(card.title)}  ({path})", f"  data: {', '.join(map(one_line, files))}"]
    lines.append(f"  free: {', '.join(card.calibration.free)}; loss: {card.calibration.loss}")
    if card.bare:
        lines.append(f"  numbers without a unit are in SI: {', '.join(card.bare)}")
    if card.note:
        lines.append(f"  note: {one_line(card.note)}")
    return "\n".join(lines)


def fit_table(fit: Fit, level: float, intervals: Intervals) -> str:
    """Return estimates with their intervals, correlation, chi-square and warnings."""
    rows = [["number", "estimate", "+-", f"{100 * level:g} % interval", "correlation"]]
    for i, (name, value) in enumerate(fit.estimates.items()):
        unit = fit.units[name]
        low, high, how = intervals[name]
        others = [f"{fit.correlation[i, j]:+.3f}" for j in range(len(fit.free)) if j != i]
        rows.append(
            [
                name,
                display(value, unit, 6),
                display(fit.sd[name], unit, 2),
                f"{display(low, unit, 5)} to {display(high, unit, 5)} ({how})",
                " ".join(others) or "-",
            ]
        )
    freedom = f"chi-square {fit.chi2:.4g} for {fit.degrees} degrees of freedom"
    lines = [
        aligned(rows),
        "",
        f"rod: {describe_rod(fit.rod)}",
        *([f"scene: {describe_scene(fit.scene)}"] if isinstance(fit, SceneCalibration) else []),
        freedom + (f" (p = {fit.p_value:.3g})" if math.isfinite(fit.p_value) else ""),
        *([fit.scatter] if fit.scatter else []),
        f"determined: {'; '.join(fit.determined)}",
        f"{len(fit.observations)} states certified, fitted and certified ones agree to {fit.consistency:.1e}",
        "",
        observation_table(fit),
    ]
    lines += [f"warning: {warning}" for warning in fit.warnings]
    return "\n".join(lines)


def intervals_of(fit: Fit, level: float) -> Intervals:
    """Return the interval of every number: from the covariance where no profile can be had."""
    found = {}
    for name in fit.free:
        how = "profile" if fit.has_profile else "covariance"
        try:
            low, high = fit.interval(name, level=level)
        except NotConverged as error:
            better = isinstance(error, BetterFit)
            how = f"covariance; the profile {'finds a better fit' if better else 'fails'}"
            low, high = fit.interval(name, level=level, method="covariance")
        found[name] = low, high, how
    return found


def observation_table(fit: Fit) -> str:
    """Return one line for each observation: measured, fitted, residuals in standard deviations."""
    rows = [["observation", "length", "fitted", "pressure", "fitted", "state", "residual [sd]"]]
    for observation, eq, r in zip(fit.observations, fit.equilibria, fit.residuals, strict=True):
        length = "-" if observation.length is None else display(observation.length, "m", 5)
        pressure = "-" if observation.pressure is None else display(observation.pressure, "Pa", 5)
        if observation.points is None:
            sizes = " ".join(f"{v:+.2f}" for v in r)
        else:
            sizes = f"{len(observation.points)} points, rms {np.sqrt(np.mean(r**2)):.2f}"
        cells = [
            observation.name,
            length,
            display(eq.length, "m", 5),
            pressure,
            display(eq.pressure, "Pa", 5),
        ]
        rows.append([*cells, eq.state, sizes])
    return aligned(rows)


def write_fit(fit: Fit, folder: Path, name: str, record: dict[str, Any], *, picture: bool = True) -> None:
    """Write CSV, a record as JSON and a picture of a fit, named after its card."""
    from ..base.files import write_bytes
    from .report import as_json

    stem = slug(name)
    fit.to_csv(folder / f"{stem}.csv")
    write_bytes(folder / f"{stem}.json", f"{as_json(record)}\n".encode())
    if picture:
        from ..plots import save_figure
        from ..plots.fit import fit_figure

        save_figure(fit_figure(fit), folder / f"{stem}.png")
