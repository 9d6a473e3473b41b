"""Measurements: pairs of detached length and pressure, and shapes of the lifted rod."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...base.checks import flag, listed, positive
from ...base.errors import InvalidInput
from ...base.units import in_si
from ...model.labels import OBSERVABLE, known_state

#: Least and largest standard deviation of a number, as a share of it.
SHARES = (1e-12, 1e6)

#: What an array of objects may hold that would become a float, and is no number.
NO_NUMBERS = (bool, np.bool_, str, bytes, np.datetime64, np.timedelta64)


@dataclass(frozen=True, eq=False)
class Measurements:
    """Pairs of detached length and pressure.

    Parameters
    ----------
    length : array_like, shape (n,)
        Detached lengths sbar [m].  All numbers may be pint quantities of any unit.
    pressure : array_like, shape (n,)
        Pressures [Pa].
    length_sd, pressure_sd : float or array_like, shape (n,), optional
        Standard deviations [m], [Pa].  A number without one is taken as exact, so at least one
        of the two is needed; with both, both variables have errors.
    state : str or sequence of str, optional
        "unfolded", "middle", "lower" or "folded", for all pairs or each.  Default: unfolded.
    names : sequence of str, optional
        How messages call the rows; "row 1", "row 2", ... by default.
    read : str, optional
        What was read from a file, in words.

    Raises
    ------
    InvalidInput
        If a value is missing, not finite or not positive, naming its row; if numbers of rows
        differ, a state is unknown, or nothing has a standard deviation.

    Examples
    --------
    >>> data = Measurements([1.9e-3, 2.4e-3], [67.1e3, 46.2e3], pressure_sd=500.0)
    >>> len(data)
    2
    """

    length: Any
    pressure: Any
    length_sd: Any = None
    pressure_sd: Any = None
    state: str | Sequence[str | None] | None = None
    names: Sequence[str] = ()
    read: str = ""

    def __post_init__(self) -> None:
        for field, unit in (("length", "m"), ("pressure", "Pa"), ("length_sd", "m"), ("pressure_sd", "Pa")):
            object.__setattr__(self, field, in_si(field, getattr(self, field), unit))
        count = _count("length", self.length)
        names = tuple(map(str, listed("names", self.names))) or tuple(f"row {i}" for i in range(1, count + 1))
        if len(names) != count:
            raise InvalidInput(f"{len(names)} names are given for {count} lengths.")
        object.__setattr__(self, "names", names)
        for field, unit in (("length", "m"), ("pressure", "Pa")):
            object.__setattr__(self, field, _column(field, getattr(self, field), unit, names))
            sd = getattr(self, f"{field}_sd")
            if sd is not None:
                spread = _column(f"{field}_sd", sd, unit, names)
                _require_meaning(f"{field}_sd", spread, getattr(self, field), names)
                object.__setattr__(self, f"{field}_sd", spread)
        if self.length_sd is None and self.pressure_sd is None:
            raise InvalidInput(
                "neither the lengths nor the pressures have a standard deviation.",
                remedy="Give pressure_sd=, length_sd= or both: they weigh the rows.",
            )
        single = self.state is None or isinstance(self.state, str)
        states = [self.state] * count if single else listed("state", self.state)
        if len(states) != count:
            raise InvalidInput(f"{len(states)} states are given for {count} lengths.")
        checked = tuple(_state(s, name) for s, name in zip(states, names, strict=True))
        object.__setattr__(self, "state", checked)

    def __len__(self) -> int:
        return len(self.length)

    def observations(self) -> list[Observation]:
        """Return one observation for each row."""
        sds = [
            [None] * len(self) if column is None else [float(v) for v in column]
            for column in (self.length_sd, self.pressure_sd)
        ]
        assert self.state is not None
        return [
            Observation(name, float(length), float(pressure), length_sd, pressure_sd, state)
            for name, length, pressure, length_sd, pressure_sd, state in zip(
                self.names, self.length, self.pressure, *sds, self.state, strict=True
            )
        ]


@dataclass(frozen=True, eq=False)
class MeasuredShape:
    """Points of the lifted rod, as read off a picture.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        Along the plate, the attached part at larger x, and above it [m]; quantities as above.
    sd : float or array_like, shape (n,)
        Standard deviation of a point, the same in x and y [m].
    pressure, length : float, optional
        What is known besides: p [Pa], sbar [m]; at least one of them.
    pressure_sd, length_sd : float, optional
        Their standard deviations; without one a number is taken as exact.
    state : str, optional
        As in `Measurements`.
    free_origin : bool
        Whether the x of the detachment point is unknown.  If False, x = 0 is there.
    tip : bool
        Whether the first point is the free tip.  If False, every point may be anywhere on the rod.
    name : str

    Raises
    ------
    InvalidInput
        If a value is missing or cannot be meant, naming the point.
    """

    x: Any
    y: Any
    sd: Any
    pressure: float | None = None
    length: float | None = None
    pressure_sd: float | None = None
    length_sd: float | None = None
    state: str | None = None
    free_origin: bool = False
    tip: bool = False
    name: str = "shape"

    def __post_init__(self) -> None:
        for field in ("free_origin", "tip"):
            # They are counted with: a number or a text would change the degrees of freedom.
            object.__setattr__(self, field, flag(f"{field} of {self.name}", getattr(self, field)))
        for field in ("x", "y", "sd", "pressure", "length", "pressure_sd", "length_sd"):
            unit = "Pa" if field.startswith("pressure") else "m"
            object.__setattr__(self, field, in_si(f"{field} of {self.name}", getattr(self, field), unit))
        names = tuple(f"{self.name}, point {i}" for i in range(1, _count("x", self.x) + 1))
        if not names:
            raise InvalidInput(f"{self.name} has no points.", remedy="Leave out a shape that was not seen.")
        for field in ("x", "y"):
            object.__setattr__(self, field, _column(field, getattr(self, field), "m", names, signed=True))
        object.__setattr__(self, "sd", _column("sd", self.sd, "m", names))
        size = float(np.abs([self.x, self.y]).max(initial=0.0))
        _require_meaning("sd", self.sd, np.full(len(names), size), names)
        for field, unit in (("pressure", "Pa"), ("length", "m")):
            for key in (field, f"{field}_sd"):
                if getattr(self, key) is not None:
                    object.__setattr__(self, key, positive(f"{key} of {self.name}", getattr(self, key), unit))
            value, sd = getattr(self, field), getattr(self, f"{field}_sd")
            if value is None and sd is not None:
                raise InvalidInput(f"{self.name} has a {field}_sd but no {field}.")
            if sd is not None:
                _require_meaning(f"{field}_sd", np.array([sd]), np.array([value]), (self.name,))
        if self.pressure is None and self.length is None:
            raise InvalidInput(
                f"{self.name} has neither a pressure nor a length.",
                remedy="Give what was held while it was seen.",
            )
        object.__setattr__(self, "state", _state(self.state, self.name))

    def __len__(self) -> int:
        return len(self.x)

    def observations(self) -> list[Observation]:
        """Return the one observation that this is."""
        points = np.column_stack([self.x, self.y, self.sd])
        sds, how = (self.length_sd, self.pressure_sd), (self.free_origin, self.tip)
        return [Observation(self.name, self.length, self.pressure, *sds, self.state, points, *how)]


#: What `calibrate` takes.
Data = Measurements | MeasuredShape | Sequence[Measurements | MeasuredShape]


@dataclass(frozen=True, eq=False)
class Observation:
    """One equilibrium that was seen, in SI units; None where nothing is known.

    ``points`` has columns x, y, sd; ``state`` is None until somebody says which.
    """

    name: str
    length: float | None
    pressure: float | None
    length_sd: float | None
    pressure_sd: float | None
    state: str | None = None
    points: np.ndarray | None = None
    free_origin: bool = False
    tip: bool = False

    def role(self, name: str) -> str:
        """What a number is to the fit: "exact", "measured" or "unknown"."""
        if getattr(self, name) is None:
            return "unknown"
        return "exact" if getattr(self, f"{name}_sd") is None else "measured"

    @property
    def degrees(self) -> int:
        """Measured numbers less unknowns of its own: what it contributes to the degrees of freedom."""
        roles = [self.role(name) for name in ("length", "pressure")]
        points = 0 if self.points is None else len(self.points) + self.tip
        # Given the rod, one number determines the equilibrium.
        return points - self.free_origin + roles.count("measured") + roles.count("exact") - 1

    @property
    def measured(self) -> np.ndarray:
        """Which of its rows are measured: length, pressure, then x and y of every point."""
        numbers = [self.role(name) == "measured" for name in ("length", "pressure")]
        points = 0 if self.points is None else len(self.points)
        return np.array(numbers + [True, True] * points)


def observations(data: Data) -> list[Observation]:
    """Return all observations of a fit, in the order of the data.

    Raises
    ------
    InvalidInput
        If ``data`` is no measurement, or there is none in it.
    """
    several = [data] if isinstance(data, (Measurements, MeasuredShape)) else data
    if not isinstance(several, Sequence) or not all(
        isinstance(part, (Measurements, MeasuredShape)) for part in several
    ):
        raise InvalidInput(
            f"data must be Measurements, a MeasuredShape, or a list of them, got {type(data).__name__}.",
            remedy="Read a CSV file with po.read_measurements.",
        )
    found = [observation for part in several for observation in part.observations()]
    if not found:
        raise InvalidInput("there is nothing to fit: the data are empty.")
    return found


def _require_meaning(name: str, spread: np.ndarray, values: np.ndarray, rows: Sequence[str]) -> None:
    """Refuse standard deviations below rounding, and those of numbers that say nothing."""
    for row, sd, value in zip(rows, spread, values, strict=True):
        if not SHARES[0] * value <= sd <= SHARES[1] * value:
            word = "below the rounding of" if sd < value else "too large to mean anything for"
            raise InvalidInput(
                f"{name} = {sd:g} in {row} is {word} a number of {value:g}.",
                remedy="Leave the standard deviation out of what is exact, and the row out if it is unknown.",
            )


def _count(name: str, values: Any) -> int:
    try:
        shape = np.asarray(values).shape
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"{name} must be a list of numbers, got lists in it.") from error
    if len(shape) != 1:
        raise InvalidInput(f"{name} must be a list of numbers, got an array of shape {shape}.")
    return int(shape[0])


def _column(name: str, values: Any, unit: str, rows: Sequence[str], *, signed: bool = False) -> np.ndarray:
    """Return finite floats, one for each row, or name the row that is wrong."""
    try:
        # Before any conversion, which drops imaginary parts and counts days.
        plain = np.asarray(values)
        objects = plain.ravel() if plain.dtype.kind == "O" else ()
        if plain.dtype.kind not in "iufO" or any(isinstance(v, NO_NUMBERS) for v in objects):
            raise TypeError(f"got {values!r:.60}")
        # A masked value is a missing one.
        given = np.ma.filled(values.astype(float), math.nan) if np.ma.isMaskedArray(values) else values
        column = np.array(given, dtype=float)
    except (OverflowError, TypeError, ValueError) as error:
        raise InvalidInput(f"{name} [{unit}] must hold numbers only: {error}.") from error
    if column.ndim == 0:
        column = np.full(len(rows), float(column))
    if column.shape != (len(rows),):
        raise InvalidInput(f"{name} has {column.size} values for {len(rows)} rows.")
    for row, value in zip(rows, column, strict=True):
        if math.isnan(value):
            raise InvalidInput(
                f"{name} [{unit}] is missing in {row}.", remedy="Leave the row out, or fill it in."
            )
        if not math.isfinite(value) or (value <= 0.0 and not signed):
            wanted = "finite" if signed else "finite and positive"
            raise InvalidInput(f"{name} [{unit}] must be {wanted}, got {value:g} in {row}.")
    column.setflags(write=False)
    return column


def _state(state: str | None, row: str) -> str | None:
    return known_state(state, among=OBSERVABLE, place=f"{row}: ")
