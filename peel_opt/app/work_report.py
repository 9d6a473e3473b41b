"""Work-precision tables as files and as plain data."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..base.files import read_file, require_schema, save_arrays, unpack, write_csv
from ..studies.tradeoff.run import Work, WorkPrecision

SCHEMA = "peel_opt work-precision"
SCHEMA_VERSION = 1

#: Columns that are words.
_TEXTS = ("method", "status")

#: Columns that have a unit; errors are of the answered number, which has none.
_UNITS = {"seconds": "s"}


def save_work(table: WorkPrecision, path: str | Path) -> Path:
    """Write rows and reference as NPZ.

    Raises
    ------
    InvalidInput
        If the path cannot be written.
    """
    return save_arrays(
        path, {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, **_head(table)}, _columns(table)
    )


def load_work(path: str | Path) -> WorkPrecision:
    """Read what `save_work` wrote.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is damaged, of a later version, or is not such a file.
    """
    remedy = "Read files that WorkPrecision.save wrote."
    return read_file(path, lambda data: _restore(*unpack(data)), "work-precision", remedy)


def work_record(table: WorkPrecision) -> dict[str, Any]:
    """Return a table as plain data."""
    return {**_head(table), "rows": [asdict(row) for row in table.rows]}


def write_work(table: WorkPrecision, title: str, folder: Path, stem: str, *, picture: bool = True) -> None:
    """Write NPZ, CSV and a picture with this title."""
    table.save(folder / f"{stem}.npz")
    table.to_csv(folder / f"{stem}.csv")
    if picture:
        from ..plots import save_figure

        figure = table.plot().figure
        assert isinstance(figure, Figure)
        figure.suptitle(title, fontsize="medium")
        save_figure(figure, folder / f"{stem}.png")


def write_work_csv(table: WorkPrecision, path: str | Path) -> Path:
    """Write one line a row, the reference above them.

    Raises
    ------
    InvalidInput
        If the path cannot be written.
    """
    titled = {
        f"{name} [{_UNITS[name]}]" if name in _UNITS else name: c for name, c in _columns(table).items()
    }
    return write_csv(path, _head(table).items(), titled)


def _head(table: WorkPrecision) -> dict[str, Any]:
    return {
        "answered": table.answered,
        "reference": table.reference,
        "reference_error": table.reference_error,
    }


def _columns(table: WorkPrecision) -> dict[str, np.ndarray]:
    return {
        f.name: np.array(
            [getattr(row, f.name) for row in table.rows], dtype=str if f.name in _TEXTS else float
        )
        for f in fields(Work)
    }


def _restore(head: dict[str, Any], columns: dict[str, np.ndarray]) -> WorkPrecision:
    require_schema(head, SCHEMA, SCHEMA_VERSION)
    for f in fields(Work):
        column = columns[f.name]
        if column.ndim != 1 or column.dtype.kind != ("U" if f.name in _TEXTS else "f"):
            raise ValueError(f"{f.name} is no column of {'words' if f.name in _TEXTS else 'numbers'}")
    numbers = [head[name] for name in ("reference", "reference_error")]
    if not isinstance(head["answered"], str) or not all(isinstance(n, float) for n in numbers):
        raise ValueError("it has no reference")
    cells = zip(*(columns[f.name].tolist() for f in fields(Work)), strict=True)
    return WorkPrecision(tuple(Work(*row) for row in cells), head["answered"], *numbers)
