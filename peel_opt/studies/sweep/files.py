"""Sweeps on disk and as labelled arrays: NPZ bit for bit, CSV, xarray and NetCDF."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ...base.errors import MissingExtra
from ...base.files import atomic_write, read_file, require_schema, unpack
from ...model.rod import Rod, Units
from .answers import NUMBERS, TEXTS
from .table import Sweep

SCHEMA = "peel_opt sweep"
SCHEMA_VERSION = 1

#: More than the largest sweep.
LARGEST = 8_000_000_000

INSTALL = "Install it with: pip install 'peel_opt[xarray]'"


def save_sweep(sweep: Sweep, path: str | Path) -> Path:
    """Write a sweep as NPZ: its arrays, and one JSON text with the rest."""
    arrays: dict[str, Any] = {f"axis.{name}": values for name, values in sweep.axes.items()}
    arrays |= sweep.values
    text = np.array(json.dumps(_head(sweep)))
    return atomic_write(path, lambda file: np.savez_compressed(file, metadata=text, **arrays))


def load_sweep(path: str | Path) -> Sweep:
    """Read what `save_sweep` wrote.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is damaged, or is not such a file.
    """
    return read_file(
        path,
        lambda data: _restore(*unpack(data, LARGEST)),
        "sweep",
        "Read files that Sweep.save wrote.",
        LARGEST,
    )


def write_csv(sweep: Sweep, path: str | Path) -> Path:
    """Write a sweep as CSV, one line a point."""
    return atomic_write(path, lambda file: file.write(csv_text(sweep).encode()))


def csv_text(sweep: Sweep) -> str:
    """Return the CSV text: what all points share as comments, then the columns with their units."""
    text = io.StringIO()
    text.writelines(f"# {key} = {json.dumps(value)}\n" for key, value in _shared(sweep).items())
    columns = _titled(sweep)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def sweep_record(sweep: Sweep) -> dict[str, Any]:
    """Return a sweep as plain data with units in the keys: what all points share, and the points."""
    columns = _titled(sweep)
    points = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return _shared(sweep) | {"summary": sweep.summary(), "points": points}


def _shared(sweep: Sweep) -> dict[str, Any]:
    shared = {"asked": sweep.asked, **{sweep.title(k): v for k, v in sweep.fixed.items()}, **sweep.options}
    return shared if sweep.rod is None else shared | Units.of(sweep.rod).rod(sweep.rod)


def _titled(sweep: Sweep) -> dict[str, list[Any]]:
    return {sweep.title(name): sweep[name].ravel().tolist() for name in (*sweep.axes, *sweep.columns)}


def as_dataset(sweep: Sweep) -> Any:
    """Return a sweep as an `xarray.Dataset`.

    Raises
    ------
    MissingExtra
        If xarray is not installed.
    """
    try:
        import xarray
    except ImportError as error:
        raise MissingExtra("labelled arrays need xarray.", remedy=INSTALL) from error

    def about(name: str) -> dict[str, str]:
        unit = sweep.unit(name)
        return {"units": unit} if unit else {}

    coordinates = {
        name: (sweep.dims if sweep.zipped else (name,), values, about(name))
        for name, values in sweep.axes.items()
    }
    # Texts as objects: the form in which NetCDF keeps them and gives them back.
    variables = {
        name: (
            sweep.dims,
            sweep.values[name].astype(object) if name in TEXTS else sweep.values[name],
            about(name),
        )
        for name in sweep.columns
    }
    shared = {name: (value, about(name)) for name, value in sweep.fixed.items()}
    fixed = {name: ((), value, attributes) for name, (value, attributes) in shared.items()}
    attributes = {"asked": sweep.asked, "arithmetic": sweep.arithmetic, **sweep.options}
    if sweep.rod is not None:
        attributes |= {"rod": repr(sweep.rod)}
    return xarray.Dataset(variables, coordinates | fixed, attributes)


def require_netcdf() -> None:
    """Raise `MissingExtra` where `write_netcdf` could not: better said before a sweep than after."""
    for name in ("xarray", "h5netcdf"):
        try:
            import_module(name)
        except ImportError as error:
            raise MissingExtra(f"NetCDF needs {name}.", remedy=INSTALL) from error


def write_netcdf(sweep: Sweep, path: str | Path) -> Path:
    """Write a sweep as NetCDF 4.

    Raises
    ------
    MissingExtra
        If xarray or h5netcdf is not installed.
    """
    require_netcdf()
    dataset = as_dataset(sweep)
    with TemporaryDirectory() as folder:
        draft = Path(folder) / "sweep.nc"
        dataset.to_netcdf(draft, engine="h5netcdf")
        content = draft.read_bytes()
    return atomic_write(path, lambda file: file.write(content))


def _head(sweep: Sweep) -> dict[str, Any]:
    """Return all that is no array; numbers survive JSON bit for bit."""
    return {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "axes": list(sweep.axes),
        "fixed": sweep.fixed,
        "rod": None if sweep.rod is None else asdict(sweep.rod),
        "zipped": sweep.zipped,
        "asked": sweep.asked,
        "units": None if sweep.units is None else asdict(sweep.units),
        "options": sweep.options,
        "arithmetic": sweep.arithmetic,
    }


def _restore(head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Sweep:
    require_schema(head, SCHEMA, SCHEMA_VERSION)
    axes = {name: arrays[f"axis.{name}"] for name in head["axes"]}
    sizes = [len(values) for values in axes.values()]
    shape = tuple(sizes[:1] if head["zipped"] else sizes)
    for name, values in axes.items():
        if values.dtype != np.float64 or values.ndim != 1 or (head["zipped"] and len(values) != shape[0]):
            raise ValueError(f"the axis {name} does not hold its numbers")
    for name in (*NUMBERS, *TEXTS):
        if arrays[name].shape != shape or (arrays[name].dtype.kind != ("U" if name in TEXTS else "f")):
            raise ValueError(f"{name} does not have shape {shape}")
    return Sweep(
        axes=axes,
        fixed={str(name): float(value) for name, value in head["fixed"].items()},
        rod=None if head["rod"] is None else Rod(**head["rod"]),
        zipped=bool(head["zipped"]),
        asked=str(head["asked"]),
        units=None if head["units"] is None else Units(**head["units"]),
        options={str(name): str(value) for name, value in head["options"].items()},
        arithmetic=str(head["arithmetic"]),
        values={name: arrays[name] for name in (*NUMBERS, *TEXTS)},
    )
