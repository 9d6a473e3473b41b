"""Measurements from CSV files, with the units in the header.

::

    # lines above the header that begin with a hash are comments
    length [mm], pressure [kPa], pressure_sd [kPa], state
    1.90, 67.1, 0.5, lower

Cells are separated by commas; numbers have a decimal point; a cell in double quotes may hold commas and
line breaks (RFC 4180).  Below the header too a line that begins with a hash is a comment, unless the
first column is text, where it is a row.
"""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InvalidInput
from ...base.files import as_path, read_file
from ...base.units import LENGTH, PRESSURE, Kind, parse
from ...model.labels import OBSERVABLE, known_state
from .data import MeasuredShape, Measurements

#: Columns of a file of pairs and of a file of points, by what they measure; None for text.
PAIRS: dict[str, Kind | None] = {
    "length": LENGTH,
    "pressure": PRESSURE,
    "length_sd": LENGTH,
    "pressure_sd": PRESSURE,
    "state": None,
    "note": None,
}
POINTS: dict[str, Kind | None] = {"x": LENGTH, "y": LENGTH, "sd": LENGTH, "note": None}

#: No table of measurements by hand is larger.
MOST_BYTES = 5_000_000

_TITLE = re.compile(r"\s*([^\[\]]*?)\s*(?:\[\s*([^\[\]]*?)\s*\])?\s*")


def read_measurements(
    path: str | Path,
    *,
    length_sd: float | None = None,
    pressure_sd: float | None = None,
    state: str | None = None,
) -> Measurements:
    r"""Read pairs of length and pressure.

    Parameters
    ----------
    path : str or Path
        CSV with the columns ``length [unit]``, ``pressure [unit]`` and, as far as they are
        known, ``length_sd [unit]``, ``pressure_sd [unit]`` and ``state``.  The unit of a standard
        deviation may be ``%``, of the number beside it.  A column ``note`` is not read.
    length_sd, pressure_sd : float, optional
        Standard deviations [m], [Pa] of all rows, for files without the column.
    state : str, optional
        Of all rows, for files without the column.

    Returns
    -------
    Measurements

    Raises
    ------
    InvalidInput
        With the line and the column of what cannot be meant.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "pairs.csv"
    >>> _ = path.write_text("length [mm], pressure [kPa], pressure_sd [%]\n1.9, 67.1, 1\n")
    >>> float(read_measurements(path).pressure[0])
    67100.0
    """
    table = _read(path, PAIRS, ("length", "pressure"))
    columns: dict[str, Any] = {"length_sd": length_sd, "pressure_sd": pressure_sd, "state": state}
    for name in ("length_sd", "pressure_sd", "state"):
        if name in table.columns:
            if columns[name] is not None:
                raise InvalidInput(f"{table.name} has a column {name!r}, and {name} is given besides.")
            columns[name] = table.columns[name]
    if isinstance(columns["state"], list):
        columns["state"] = [text or None for text in columns["state"]]
    return Measurements(table.columns["length"], table.columns["pressure"], names=table.rows, **columns)


def read_shape(path: str | Path, *, sd: float | None = None, **known: Any) -> MeasuredShape:
    """Read the points of a shape.

    Parameters
    ----------
    path : str or Path
        CSV with the columns ``x [unit]``, ``y [unit]`` and, if it is not given, ``sd [unit]``.
    sd : float, optional
        Standard deviation of all points [m].
    **known
        Further fields of `MeasuredShape`: ``pressure``, ``length``, ...

    Returns
    -------
    MeasuredShape

    Raises
    ------
    InvalidInput
        With the line and the column of what cannot be meant.
    """
    table = _read(path, POINTS, ("x", "y"))
    if ("sd" in table.columns) == (sd is not None):
        raise InvalidInput(f"{table.name} needs a column 'sd', or sd= for all points, and not both.")
    spread = table.columns.get("sd", sd)
    known.setdefault("name", as_path(path).stem)
    return MeasuredShape(table.columns["x"], table.columns["y"], spread, **known)


@dataclass(frozen=True, eq=False)
class _Table:
    """Columns in SI units, and the names of the rows."""

    name: str
    columns: dict[str, Any]
    rows: tuple[str, ...]


def _read(path: str | Path, known: dict[str, Kind | None], needed: tuple[str, ...]) -> _Table:
    name = as_path(path).name
    remedy = "Write CSV with commas in UTF-8; problems/calibrate_flap.csv is an example."
    text = read_file(path, lambda data: data.decode("utf-8-sig"), "CSV", remedy, MOST_BYTES)
    if "\0" in text:
        raise InvalidInput(f"{name!r} is no text: it holds NUL bytes.", remedy=remedy)
    records = _records(text, name)
    first, header = next(records, (0, []))
    if not header:
        raise InvalidInput(f"{name!r} is empty.", remedy=remedy)
    titles = _header(first, header, known, needed, name, remedy)
    names = [title for title, _ in titles]
    columns: dict[str, Any] = {title: [] for title in names}
    rows = []
    for number, cells in records:
        # Where the first column holds numbers no row begins with a hash; a note may.
        if known[names[0]] is not None and cells[0].startswith("#"):
            continue
        rows.append(f"{name}, line {number}")
        if len(cells) != len(titles):
            raise InvalidInput(
                f"{name!r}, line {number}: {len(cells)} cells for {len(titles)} columns.",
                remedy="Numbers have a decimal point, and commas separate cells.",
            )
        for (title, scale), cell in zip(titles, cells, strict=True):
            place = f"{name!r}, line {number}, column {title!r}"
            columns[title].append(cell if known[title] is None else _number(cell, place, title) * scale)
            if title == "state" and cell:
                known_state(cell, among=OBSERVABLE, place=f"{place}: ")
    if not rows:
        raise InvalidInput(f"{name!r} has a header and no rows.")
    for title, scale in titles:
        if scale < 0.0:  # a percentage
            base = np.array(columns[title.removesuffix("_sd")])
            columns[title] = list(-np.array(columns[title]) * base)
    return _Table(name, columns, tuple(rows))


def _records(text: str, name: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the header and every row that is not blank as cells, with the line on which they begin."""
    # Without translation: CR, LF and both end a line, and nothing else does.
    lines = list(io.StringIO(text, newline=""))
    skipped = 0
    for line in lines:
        if line.strip() and not line.lstrip().startswith("#"):
            break
        skipped += 1
    reader = csv.reader(lines[skipped:], skipinitialspace=True, strict=True)
    while True:
        number = skipped + reader.line_num + 1
        try:
            cells = [cell.strip() for cell in next(reader)]
        except StopIteration:
            return
        except csv.Error as error:  # a quote without an end, a cell beyond the limit of the module
            raise InvalidInput(
                f"{name!r}, line {number}: {error}.", remedy="Shorten the cell, or close its quote."
            ) from error
        if any(cells) or len(cells) > 1:
            yield number, cells


def _header(
    first: int,
    header: list[str],
    known: dict[str, Kind | None],
    needed: tuple[str, ...],
    name: str,
    remedy: str,
) -> list[tuple[str, float]]:
    """Return the names of the columns and the SI values of their units."""
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        raise InvalidInput(f"{name!r}, line {first}: cells must be separated by commas.", remedy=remedy)
    titles = [_title(cell, known, name, first) for cell in header]
    names = [title for title, _ in titles]
    for title in needed:
        if title not in names:
            raise InvalidInput(f"{name!r}, line {first}: column {title!r} is missing.", remedy=remedy)
    if repeated := [title for title in names if names.count(title) > 1]:
        raise InvalidInput(f"{name!r}, line {first}: column {repeated[0]!r} comes twice.")
    return titles


def _title(cell: str, known: dict[str, Kind | None], file: str, line: int) -> tuple[str, float]:
    """Name of a column and the SI value of its unit; a percentage is -0.01."""
    match = _TITLE.fullmatch(cell)
    name, unit = (match.group(1), match.group(2)) if match else (cell, None)
    place = f"{file!r}, line {line}"
    if name not in known:
        near = difflib.get_close_matches(name.lower(), known, n=1, cutoff=0.6)
        meant = f"Did you mean {near[0]!r}?" if near else f"Known are {', '.join(known)}."
        raise InvalidInput(f"{place}: unknown column {name!r}.", remedy=meant)
    kind = known[name]
    if kind is None:
        return name, 1.0
    if not unit:
        raise InvalidInput(
            f"{place}: column {name!r} needs a unit in brackets.",
            remedy=f"Write '{name} [{kind.examples[1]}]'.",
        )
    if unit == "%" and name in ("length_sd", "pressure_sd"):
        return name, -0.01
    return name, parse(f"{place}: column {name!r}", f"1 {unit}", kind)


def _number(cell: str, place: str, title: str) -> float:
    if not cell:
        raise InvalidInput(f"{place}: the cell is empty.", remedy="Leave the row out, or fill it in.")
    try:
        value = float(cell)
    except ValueError as error:
        raise InvalidInput(f"{place}: {cell!r} is no number.", remedy="Units stand in the header.") from error
    if not math.isfinite(value):
        raise InvalidInput(
            f"{place}: {cell!r} is no finite number.", remedy="Leave the row out, or fill it in."
        )
    if value <= 0.0 and title not in ("x", "y"):
        raise InvalidInput(f"{place}: must be positive, got {value:g}.")
    return value
