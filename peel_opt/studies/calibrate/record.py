"""A fit as plain data, with units in the keys, and as a table of its observations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.records import Column, Table, titled
from ...model.rod import UNITS

if TYPE_CHECKING:
    from .result import Fit

#: Interval of a number, and what it is from.
Intervals = dict[str, tuple[float, float, str]]


def fit_record(fit: Fit, level: float | None = None, intervals: Intervals | None = None) -> dict[str, Any]:
    """Return a fit as plain data, with units in the keys; with ``intervals`` of a ``level``, those too."""
    record: dict[str, Any] = {"status": "fitted", "free": list(fit.free)}
    for name, value in fit.estimates.items():
        unit = fit.units[name]
        record[titled(name, unit)] = value
        record[titled(f"{name}_sd", unit)] = fit.sd[name]
        if intervals is not None:
            *ends, how = intervals[name]
            record[titled(f"{name}_interval", unit)] = ends
            record[f"{name}_interval_method"] = how
    if level is not None:
        record["level"] = level
    record |= {f"rod.{name} [{UNITS[name]}]": float(getattr(fit.rod, name)) for name in UNITS}
    record |= {
        **fit.covariances(),
        "correlation": fit.correlation.tolist(),
        "chi2": fit.chi2,
        "deviance": fit.deviance,
        "degrees": fit.degrees,
        "p_value": fit.p_value,
        "loss": fit.loss,
        "loss_scale": fit.loss_scale,
        "scaled": fit.scaled,
        "singular_values": fit.singular_values.tolist(),
        "combinations": fit.determined,
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


def fit_columns(fit: Fit) -> Table:
    """Return one row for each observation, under the numbers of the fit."""
    record = fit_record(fit)
    del record["observations"]

    def column(values: list[Any], unit: str = "") -> Column:
        return Column(np.array([math.nan if v is None else v for v in values], float), unit)

    seen, equilibria = fit.observations, fit.equilibria
    columns = {
        "observation": Column(np.array([o.name for o in seen])),
        "state": Column(np.array([eq.state for eq in equilibria])),
        "length": column([o.length for o in seen], "m"),
        "length_sd": column([o.length_sd for o in seen], "m"),
        "fitted length": column([eq.length for eq in equilibria], "m"),
        "pressure": column([o.pressure for o in seen], "Pa"),
        "pressure_sd": column([o.pressure_sd for o in seen], "Pa"),
        "fitted pressure": column([eq.pressure for eq in equilibria], "Pa"),
        "points": Column(np.array([0 if o.points is None else len(o.points) for o in seen])),
        "rms residual": column([float(np.sqrt(np.mean(r**2))) for r in fit.residuals], "sd"),
        "certificate": column([eq.certificate for eq in equilibria]),
    }
    return Table(record.items(), columns)
