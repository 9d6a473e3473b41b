"""Fits for people and for programs: a table, JSON, CSV and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import NotConverged
from ..base.files import write_csv
from ..base.units import display
from ..model.rod import UNITS
from ..studies.calibrate.profile import BetterFit
from ..studies.calibrate.result import Calibration
from .report import aligned, describe_rod, slug
from .tables import one_line

if TYPE_CHECKING:
    from .calibration_cards import CalibrationCard


def heading(card: CalibrationCard, path: str) -> str:
    """Return what is fitted to what, and what it rests on."""
    files = [*(t.file for t in card.pairs), *(t.file for t in card.shapes)]
    lines = [f"{one_line(card.title)}  ({path})", f"  data: {', '.join(map(one_line, files))}"]
    lines.append(f"  free: {', '.join(card.calibration.free)}; loss: {card.calibration.loss}")
    if card.note:
        lines.append(f"  note: {one_line(card.note)}")
    return "\n".join(lines)


#: Interval of a number, and what it is from.
Intervals = dict[str, tuple[float, float, str]]


def fit_table(fit: Calibration, level: float, intervals: Intervals) -> str:
    """Return estimates with their intervals, correlation, chi-square and warnings."""
    rows = [["number", "estimate", "+-", f"{100 * level:g} % interval", "correlation"]]
    for i, (name, value) in enumerate(fit.estimates.items()):
        unit = UNITS[name]
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
        freedom + (f" (p = {fit.p_value:.3g})" if fit.degrees else ""),
        f"determined: {'; '.join(map(str, fit.combinations))}",
        f"{len(fit.observations)} states certified, fitted and certified ones agree to {fit.consistency:.1e}",
        "",
        observation_table(fit),
    ]
    lines += [f"warning: {warning}" for warning in fit.warnings]
    return "\n".join(lines)


def intervals_of(fit: Calibration, level: float) -> Intervals:
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


def observation_table(fit: Calibration) -> str:
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


def fit_record(
    fit: Calibration, level: float | None = None, intervals: Intervals | None = None
) -> dict[str, Any]:
    """Return a fit as plain data, with units in the keys; with ``intervals`` of a ``level``, those too."""
    record: dict[str, Any] = {"status": "fitted", "free": list(fit.free)}
    for name, value in fit.estimates.items():
        unit = UNITS[name]
        record[f"{name} [{unit}]"] = value
        record[f"{name}_sd [{unit}]"] = fit.sd[name]
        if intervals is not None:
            *ends, how = intervals[name]
            record[f"{name}_interval [{unit}]"] = ends
            record[f"{name}_interval_method"] = how
    if level is not None:
        record["level"] = level
    record |= {f"rod.{name} [{UNITS[name]}]": float(getattr(fit.rod, name)) for name in UNITS}
    record |= {
        "log_covariance": fit.log_covariance.tolist(),
        "correlation": fit.correlation.tolist(),
        "chi2": fit.chi2,
        "deviance": fit.deviance,
        "degrees": fit.degrees,
        "p_value": fit.p_value,
        "loss": fit.loss,
        "loss_scale": fit.loss_scale,
        "singular_values": fit.singular_values.tolist(),
        "combinations": [str(c) for c in fit.combinations],
        "identifiable": fit.identifiable,
        "consistency": fit.consistency,
        "iterations": fit.iterations,
        "warnings": list(fit.warnings),
        "observations": [
            {
                "name": observation.name,
                "state": eq.state,
                "length [m]": eq.length,
                "pressure [Pa]": eq.pressure,
                "error": eq.error,
                "certificate": eq.certificate,
                "status": eq.status,
                "residuals [sd]": r.tolist(),
            }
            for observation, eq, r in zip(fit.observations, fit.equilibria, fit.residuals, strict=True)
        ],
    }
    return record


def write_fit_csv(fit: Calibration, path: str | Path) -> Path:
    """Write one row for each observation; the numbers of the fit as comments above.

    Raises
    ------
    InvalidInput
        If the path cannot be written.
    """
    record = fit_record(fit)
    del record["observations"]
    nan = float("nan")

    def column(values: list[Any]) -> np.ndarray:
        return np.array([nan if v is None else v for v in values], float)

    seen, equilibria = fit.observations, fit.equilibria
    columns = {
        "observation": np.array([o.name for o in seen]),
        "state": np.array([eq.state for eq in equilibria]),
        "length [m]": column([o.length for o in seen]),
        "length_sd [m]": column([o.length_sd for o in seen]),
        "fitted length [m]": column([eq.length for eq in equilibria]),
        "pressure [Pa]": column([o.pressure for o in seen]),
        "pressure_sd [Pa]": column([o.pressure_sd for o in seen]),
        "fitted pressure [Pa]": column([eq.pressure for eq in equilibria]),
        "points": np.array([0 if o.points is None else len(o.points) for o in seen]),
        "rms residual [sd]": column([float(np.sqrt(np.mean(r**2))) for r in fit.residuals]),
        "certificate": column([eq.certificate for eq in equilibria]),
    }
    return write_csv(path, record.items(), columns)


def write_fit(
    fit: Calibration, folder: Path, name: str, record: dict[str, Any], *, picture: bool = True
) -> None:
    """Write CSV, a record as JSON and a picture of a fit, named after its card."""
    from ..base.files import atomic_write
    from .report import as_json

    stem = slug(name)
    fit.to_csv(folder / f"{stem}.csv")
    text = as_json(record) + "\n"
    atomic_write(folder / f"{stem}.json", lambda file: file.write(text.encode()))
    if picture:
        from ..plots import save_figure
        from ..plots.fit import fit_figure

        save_figure(fit_figure(fit), folder / f"{stem}.png")
