"""Measurements from CSV files and data frames, with the units in the header.

::

    # lines above the header that begin with a hash are comments
    length [mm], pressure [kPa], pressure_sd [kPa], state
    1.90, 67.1, 0.5, lower

Cells are separated by commas, semicolons or tabs; a cell in double quotes may hold them and line breaks
(RFC 4180).  Numbers have a decimal point, or, where commas do not separate cells, a decimal comma.  Units
stand in the header, in brackets, or in a row of their own below it.  Lines above the header, as testing
machines write them, and columns of other names are not read; what was read is said by `Measurements.read`.
Below the header too a line that begins with a hash is a comment, unless the first column is text, where
it is a row.
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

from ...base.checks import parse
from ...base.errors import InvalidInput
from ...base.files import as_path, read_file
from ...base.units import LENGTH, PRESSURE, Kind
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

#: A name and its unit, in brackets of either kind.
_TITLE = re.compile(r"\s*([^\[\]()]*?)\s*(?:[\[(]\s*([^\[\]]*?)\s*[\])])?\s*")

#: A number with a comma, and one whose comma may separate thousands.
_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")

#: What may separate cells, in words.
SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}

#: Lines among which the header is looked for.
MOST_ABOVE = 200


def read_measurements(
    path: str | Path | Any,
    *,
    length_sd: float | None = None,
    pressure_sd: float | None = None,
    state: str | None = None,
) -> Measurements:
    r"""Read pairs of length and pressure.

    Parameters
    ----------
    path : str, Path or pandas.DataFrame
        CSV, as spreadsheets and testing machines write it, or a data frame with such titles: the columns
        ``length [unit]``, ``pressure [unit]`` and, as far as they are
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
    return Measurements(
        table.columns["length"], table.columns["pressure"], names=table.rows, read=table.read, **columns
    )


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
    """Columns in SI units, the names of the rows, and what was read, in words."""

    name: str
    columns: dict[str, Any]
    rows: tuple[str, ...]
    read: str


@dataclass(frozen=True)
class _Records:
    """Rows of cells with the place of each, and what they come from, in words."""

    name: str
    rows: list[tuple[str, list[str]]]
    source: str
    decimal_comma: bool = False


def _read(given: Any, known: dict[str, Kind | None], needed: tuple[str, ...]) -> _Table:
    frame = hasattr(given, "itertuples") and hasattr(given, "columns")
    found = _from_frame(given) if frame else _from_file(given, known, needed)
    name = found.name
    if not found.rows:
        raise InvalidInput(f"{name} is empty.", remedy=REMEDY)
    first, header = found.rows[0]
    body = found.rows[1:]
    given_units = _units_below(header, body[0][1] if body else [], known)
    if given_units is not None:
        header, body = given_units, body[1:]
    titles = _header(first, header, known, needed)
    names = [title for title, _ in titles if title]
    columns: dict[str, Any] = {title: [] for title in names}
    rows = []
    for place, cells in body:
        # Where the first column holds numbers no row begins with a hash; a note may.
        if known.get(titles[0][0], LENGTH) is not None and cells[0].startswith("#"):
            continue
        rows.append(place)
        if len(cells) != len(titles):
            raise InvalidInput(
                f"{place}: {len(cells)} cells for {len(titles)} columns.",
                remedy="Numbers have a decimal point where commas separate cells.",
            )
        for (title, scale), cell in zip(titles, cells, strict=True):
            if not title:
                continue
            here = f"{place}, column {title!r}"
            if known[title] is None:
                columns[title].append(cell)
            else:
                number = _number(_pointed(cell, here) if found.decimal_comma else cell, here, title)
                columns[title].append(number * scale)
            if title == "state" and cell:
                known_state(cell, among=OBSERVABLE, place=f"{here}: ")
    if not rows:
        raise InvalidInput(f"{name} has a header and no rows.")
    _shares_to_numbers(columns, titles)
    others = [cell for cell, (title, _) in zip(header, titles, strict=True) if not title and cell]
    used = [cell for cell, (title, _) in zip(header, titles, strict=True) if title]
    words = f"{len(rows)} rows of {found.source}, header in {first}: {', '.join(used)}"
    left = f"; not read: {', '.join(others)}" if others else ""
    return _Table(
        name, columns, tuple(place.replace(name, name.strip("'"), 1) for place in rows), words + left
    )


def _shares_to_numbers(columns: dict[str, Any], titles: list[tuple[str, float]]) -> None:
    """Multiply percentages, of which the scale is negative, by the numbers beside them."""
    for title, scale in titles:
        if scale < 0.0:
            base = np.array(columns[title.removesuffix("_sd")])
            columns[title] = list(-np.array(columns[title]) * base)


#: What to do where a file cannot be meant.
REMEDY = "Write CSV with the units in the header; problems/calibrate_flap.csv is an example."


def _from_frame(frame: Any) -> _Records:
    """Return the rows of a `pandas.DataFrame`, numbers with all their digits and what is missing as empty."""
    header = [str(title).strip() for title in frame.columns]
    rows = [("its titles", header)]
    for label, row in zip(frame.index, frame.itertuples(index=False), strict=True):
        # What is missing is not equal to itself, or not of any value.
        cells = ["" if value is None or str(value) in ("nan", "NaT", "<NA>") else str(value) for value in row]
        rows.append((f"row {label!r}", [cell.strip() for cell in cells]))
    return _Records("the data frame", rows, "a data frame")


def _from_file(path: str | Path, known: dict[str, Kind | None], needed: tuple[str, ...]) -> _Records:
    name = as_path(path).name
    text, coding = read_file(path, _decoded, "CSV", REMEDY, MOST_BYTES)
    if "\0" in text:
        raise InvalidInput(f"{name!r} is no text: it holds NUL bytes.", remedy=REMEDY)
    # Without translation: CR, LF and both end a line, and nothing else does.
    lines = list(io.StringIO(text, newline=""))
    first, separator = _place_of_header(lines, known, needed)
    records = [
        (f"{name!r}, line {number}", cells) for number, cells in _records(lines, first, separator, name)
    ]
    comma = _has_decimal_commas(records[1:], separator)
    words = f"{name!r} ({coding}, cells separated by {SEPARATORS[separator]}"
    return _Records(repr(name), records, f"{words}, decimal comma)" if comma else f"{words})", comma)


def _decoded(data: bytes) -> tuple[str, str]:
    """Return a text and its coding: UTF-16 by its mark, UTF-8, or else what spreadsheets write on Windows."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16"), "UTF-16"
    try:
        return data.decode("utf-8-sig"), "UTF-8"
    except UnicodeDecodeError:
        return data.decode("cp1252"), "cp1252"


def _place_of_header(
    lines: list[str], known: dict[str, Kind | None], needed: tuple[str, ...]
) -> tuple[int, str]:
    """Return how many lines stand above the header, and what separates its cells.

    The header is the first line with all names that are needed; without one, the first that is no comment.
    """
    filled = [i for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
    for i in filled[:MOST_ABOVE]:
        for separator in SEPARATORS:
            names = {_named(cell)[0] for cell in lines[i].split(separator)}
            if names.issuperset(needed):
                return i, separator
    return (filled[0] if filled else len(lines)), ","


def _records(lines: list[str], skipped: int, separator: str, name: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the header and every row that is not blank as cells, with the line on which they begin."""
    reader = csv.reader(lines[skipped:], delimiter=separator, skipinitialspace=True, strict=True)
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
        if any(cells) or (len(cells) > 1 and separator == ","):
            yield number, cells


def _named(cell: str) -> tuple[str, str]:
    """Return the name and the unit in a title; names are known in any case of letters."""
    match = _TITLE.fullmatch(cell.strip().strip('"'))
    name, unit = (match.group(1), match.group(2) or "") if match else (cell, "")
    return re.sub(r"[\s-]+", "_", name.strip()).lower(), unit.strip()


def _units_below(header: list[str], below: list[str], known: dict[str, Kind | None]) -> list[str] | None:
    """Return the header with the units of a row below it; None if that row is none of units."""
    bare = [known.get(_named(cell)[0]) is not None and not _named(cell)[1] for cell in header]
    if not any(bare) or len(below) != len(header):
        return None
    units = [cell.strip("[]() ") for cell in below]
    if any(needs and _is_no_unit(unit) for needs, unit in zip(bare, units, strict=True)):
        return None
    return [
        f"{cell} [{unit}]" if needs else cell for cell, unit, needs in zip(header, units, bare, strict=True)
    ]


def _is_no_unit(cell: str) -> bool:
    return not cell or cell[0] in "+-.,0123456789"


def _has_decimal_commas(records: list[tuple[str, list[str]]], separator: str) -> bool:
    """Return whether the numbers of a file have decimal commas.

    Raises
    ------
    InvalidInput
        If the commas could as well separate thousands.
    """
    if separator == ",":
        return False
    commas = [(place, cell) for place, cells in records for cell in cells if _COMMA.fullmatch(cell)]
    if separator == "\t" and commas and all(_THOUSANDS.fullmatch(cell) for _, cell in commas):
        place, cell = commas[0]
        raise InvalidInput(
            f"{place}: {cell!r} may be a decimal comma or a separator of thousands.",
            remedy="Write numbers with a decimal point and without separators of thousands.",
        )
    return bool(commas)


def _pointed(cell: str, place: str) -> str:
    """Return a number with a decimal point in place of a decimal comma."""
    if "." in cell:
        raise InvalidInput(
            f"{place}: {cell!r} has a point, and other numbers of the file a decimal comma.",
            remedy="Write all numbers in one way, without separators of thousands.",
        )
    return cell.replace(",", ".")


def _header(
    place: str, header: list[str], known: dict[str, Kind | None], needed: tuple[str, ...]
) -> list[tuple[str, float]]:
    """Return the names of the columns and the SI values of their units; no name for one that is not read."""
    complete = {_named(cell)[0] for cell in header}.issuperset(needed)
    titles = [_title(cell, known, place, complete) for cell in header]
    names = [title for title, _ in titles if title]
    for title in needed:
        if title not in names:
            raise InvalidInput(f"{place}: column {title!r} is missing.", remedy=REMEDY)
    if repeated := [title for title in names if names.count(title) > 1]:
        raise InvalidInput(f"{place}: column {repeated[0]!r} comes twice.")
    return titles


def _title(cell: str, known: dict[str, Kind | None], place: str, complete: bool) -> tuple[str, float]:
    """Name of a column and the SI value of its unit; a percentage is -0.01."""
    name, unit = _named(cell)
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.8 if complete else 0.6)
        if complete and not near:
            return "", 1.0
        meant = f"Did you mean {near[0]!r}?" if near else f"Known are {', '.join(known)}."
        raise InvalidInput(f"{place}: unknown column {cell!r}.", remedy=meant)
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
