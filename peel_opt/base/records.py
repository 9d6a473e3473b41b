"""Records: what a result says of itself once, and the files of every kind that are made from it.

A result declares its head, which is plain data, and the arrays from which it is restored bit for
bit; and a table for everybody else, columns with their units under notes that say what they are.
No file holds code, and none is believed unread: kinds and shapes are checked on the way back.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from types import UnionType
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from .drawing import Shown
from .errors import MissingExtra
from .files import MOST_BYTES, csv_text, read_file, require_schema, save_arrays, unpack, write_bytes

#: How to get what labelled arrays and data frames need.
INSTALL = "Install it with: pip install 'peel_opt[xarray]'"
INSTALL_PANDAS = "Install it with: pip install 'peel_opt[pandas]'"

#: What an array of a file may hold, in words.
_KINDS = {"f": "numbers", "i": "whole numbers", "U": "texts"}


class Column(NamedTuple):
    """Values of one thing, and their unit, empty if there is none."""

    values: np.ndarray
    unit: str = ""


class Table(NamedTuple):
    """Columns by name under notes, of which a key may come more than once."""

    notes: Iterable[tuple[str, Any]]
    columns: Mapping[str, Column]

    @property
    def titled(self) -> dict[str, np.ndarray]:
        """The columns by title, flat."""
        return {titled(name, unit): values.ravel() for name, (values, unit) in self.columns.items()}

    @property
    def text(self) -> str:
        """As CSV."""
        return csv_text(self.notes, self.titled)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """As plain data, one row a point."""
        columns = self.titled
        cells = zip(*(values.tolist() for values in columns.values()), strict=True)
        return [dict(zip(columns, row, strict=True)) for row in cells]


def write_table(table: Table, path: str | Path) -> Path:
    """Write a table as CSV.

    Raises
    ------
    InvalidInput
        If the path cannot be written, or a note is not plain.
    """
    return write_bytes(path, table.text.encode())


def titled(name: str, unit: str) -> str:
    """Return the name of a number with its unit, if it has one.

    Examples
    --------
    >>> titled("pressure", "Pa")
    'pressure [Pa]'
    """
    return f"{name} [{unit}]" if unit else name


@dataclass(frozen=True)
class Schema:
    """What the files of a result are called, and how large they may be.

    Parameters
    ----------
    name : str
        "peel_opt" and the kind of the result.
    version : int
        Of the files that are written; those since ``oldest`` are read.
    oldest : int
    largest : int
        Bytes, packed or not.
    """

    name: str
    version: int
    oldest: int = 1
    largest: int = MOST_BYTES

    @property
    def kind(self) -> str:
        """The kind of the result, in a word."""
        return self.name.split(" ", 1)[1]

    def stamped(self, head: Mapping[str, Any]) -> dict[str, Any]:
        """Return a head that says of which schema it is."""
        return {"schema": self.name, "schema_version": self.version, **head}

    def require(self, head: dict[str, Any]) -> None:
        """Raise unless a file says that it has this schema, in a version that is read."""
        stated = head["schema_version"]
        known = isinstance(stated, int) and self.oldest <= stated <= self.version
        require_schema(head, self.name, stated if known else self.version)


class Tabled(Shown, ABC):
    """A result that is a table to others: a CSV file, a data frame, labelled arrays, rows in a notebook."""

    @abstractmethod
    def _table(self) -> Table:
        """Return what others read."""

    def _rows_shown(self) -> list[dict[str, Any]]:
        return self._table().rows

    def to_csv(self, path: str | Path) -> Path:
        """Write one line a point with all digits, units in the titles, what it is in lines with "#".

        Parameters
        ----------
        path : str or Path

        Returns
        -------
        Path

        Raises
        ------
        InvalidInput
            If the path cannot be written.
        """
        return write_table(self._table(), path)

    def csv_text(self) -> str:
        """Return what `to_csv` writes.

        Returns
        -------
        str
        """
        return self._table().text

    def to_dataframe(self) -> Any:
        """Return the columns of `to_csv` as a `pandas.DataFrame`, units in the names, notes in ``attrs``.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        MissingExtra
            If pandas is not installed.
        """
        return data_frame(self._table())

    def to_xarray(self) -> Any:
        """Return the columns of `to_csv` as an `xarray.Dataset` with units as attributes.

        Returns
        -------
        xarray.Dataset
            Its sides are those of the arrays: "point" of a curve, "dim_0", "dim_1", ... of a grid.

        Raises
        ------
        MissingExtra
            If xarray is not installed.
        """
        table = self._table()
        columns = {name: (_sides(column.values), column) for name, column in table.columns.items()}
        return dataset(columns, {}, about(table))


class Stored(Tabled):
    """A result that is written to files, whole or not at all, and read back bit for bit."""

    schema: ClassVar[Schema]

    @abstractmethod
    def _head(self) -> dict[str, Any]:
        """Return all that is no array: plain data, units in the keys."""

    @abstractmethod
    def _arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays, from which and the head the result is restored."""

    @classmethod
    @abstractmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Self:
        """Return the result, or raise what is wrong."""

    def save(self, path: str | Path) -> Path:
        """Write an NPZ file that `load` restores bit for bit.

        Parameters
        ----------
        path : str or Path
            In a folder that exists; a regular file there is replaced at the end.

        Returns
        -------
        Path

        Raises
        ------
        InvalidInput
            If the path cannot be written.
        """
        return save_arrays(path, self.schema.stamped(self._head()), self._arrays())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what was written.

        Parameters
        ----------
        path : str or Path

        Returns
        -------
        Self

        Raises
        ------
        InvalidInput
            If the file cannot be read, is damaged, of a later version, or is not such a file.
        """
        remedy = f"Read files that {cls.__name__} wrote."
        return read_file(path, cls._read, cls.schema.kind, remedy, cls.schema.largest)

    @classmethod
    def _read(cls, data: bytes) -> Self:
        head, arrays = unpack(data, cls.schema.largest)
        cls.schema.require(head)
        return cls._restored(head, arrays)


# --- reading without belief --------------------------------------------------------------------


def entries(head: Mapping[str, Any], kind: type | UnionType, *names: str) -> dict[str, Any]:
    """Return entries of a head that must all be texts, numbers or tables."""
    words: dict[Any, str] = {str: "text", dict: "table"}
    for name in names:
        if not isinstance(head[name], kind):
            raise ValueError(f"{name} is no {words.get(kind, 'number')}")
    return {name: head[name] for name in names}


def array(
    arrays: Mapping[str, np.ndarray], name: str, kind: str = "f", shape: tuple[int, ...] | None = None
) -> np.ndarray:
    """Return an array of floats, whole numbers or texts ("f", "i", "U") of a shape; without one, a list."""
    found = arrays[name]
    right = found.dtype.kind == kind and (kind != "f" or found.dtype == np.float64)
    if not right or (found.ndim != 1 if shape is None else found.shape != shape):
        size = "its" if shape is None else "x".join(map(str, shape))
        raise ValueError(f"{name} does not hold {size} {_KINDS[kind]}")
    return found


def read_csv(data: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the notes and the columns of numbers of a CSV that begins with its schema.

    An editor may have given it other line ends, a mark before it or blank lines after.
    """
    text = data.decode("utf-8-sig").replace("\r\n", "\n")
    lines = text.rstrip().split("\n")
    if not text.startswith("# schema = ") or not text.endswith("\n"):
        raise ValueError("it has no header, or ends in the middle of a line")
    notes = [line[2:].partition(" = ") for line in lines if line.startswith("# ")]
    titles = lines[len(notes)].split(",") if len(lines) > len(notes) else []
    rows = [[float(cell) for cell in line.split(",")] for line in lines[len(notes) + 1 :]]
    if any(len(row) != len(titles) for row in rows):
        raise ValueError("its rows do not have one length")
    columns = np.array(rows, float).reshape(len(rows), len(titles)).T
    head = {key: json.loads(value) for key, _, value in notes}
    return head, {title: column.copy() for title, column in zip(titles, columns, strict=True)}


# --- labelled arrays -----------------------------------------------------------------------------

#: Columns with the names of their sides.
Labelled = Mapping[str, tuple[tuple[str, ...], Column]]


def dataset(variables: Labelled, coordinates: Labelled, about: Mapping[str, Any]) -> Any:
    """Return columns as an `xarray.Dataset`, with units and what it is ``about`` as attributes.

    Raises
    ------
    MissingExtra
        If xarray is not installed.
    """
    try:
        import xarray
    except ImportError as error:
        raise MissingExtra("labelled arrays need xarray.", remedy=INSTALL) from error

    def variable(dims: tuple[str, ...], column: Column) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
        # Texts as objects: the form in which NetCDF keeps them and gives them back.
        values = column.values.astype(object) if column.values.dtype.kind == "U" else column.values
        return dims, values, {"units": column.unit} if column.unit else {}

    inside, along = ({k: variable(*v) for k, v in named.items()} for named in (variables, coordinates))
    return xarray.Dataset(inside, along, dict(about))


def about(table: Table) -> dict[str, Any]:
    """Return the notes of a table as attributes, numbers and texts; a line each where a key comes again."""
    found: dict[str, Any] = {}
    for key, value in table.notes:
        if value is None:
            continue
        plain = isinstance(value, str | int | float) and not isinstance(value, bool)
        text = value if plain else json.dumps(value, allow_nan=True)
        found[key] = f"{found[key]}\n{text}" if key in found else text
    return found


def data_frame(table: Table) -> Any:
    """Return a table as a `pandas.DataFrame`.

    Raises
    ------
    MissingExtra
        If pandas is not installed.
    """
    try:
        import pandas
    except ImportError as error:
        raise MissingExtra("data frames need pandas.", remedy=INSTALL_PANDAS) from error
    frame = pandas.DataFrame(table.titled)
    frame.attrs.update(about(table))
    return frame


def _sides(values: np.ndarray) -> tuple[str, ...]:
    return ("point",) if values.ndim == 1 else tuple(f"dim_{i}" for i in range(values.ndim))


def require_netcdf() -> None:
    """Raise `MissingExtra` where `write_netcdf` could not: better said before a computation than after."""
    for name in ("xarray", "h5netcdf"):
        try:
            import_module(name)
        except ImportError as error:
            raise MissingExtra(f"NetCDF needs {name}.", remedy=INSTALL) from error


def write_netcdf(data: Any, path: str | Path) -> Path:
    """Write an `xarray.Dataset` as NetCDF 4, whole or not at all.

    Raises
    ------
    InvalidInput
        If the path cannot be written.
    MissingExtra
        If xarray or h5netcdf is not installed.
    """
    require_netcdf()
    with TemporaryDirectory() as folder:
        draft = Path(folder) / "data.nc"
        data.to_netcdf(draft, engine="h5netcdf")
        content = draft.read_bytes()
    return write_bytes(path, content)
