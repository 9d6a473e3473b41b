"""Measurements: pairs of detached length and pressure, and shapes of the lifted rod."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.arrays import unmasked
from ...base.checks import flag, listed, positive
from ...base.errors import InvalidInput
from ...base.units import in_si
from ...model.labels import OBSERVABLE, known_state

#: Least and largest standard deviation of a number, as a share of it.
SHARES = (1e-12, 1e6)

#: Share of a number that its standard deviation is taken to be where nobody says, before residuals do.
ALIKE = 0.01

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
        Standard deviations [m], [Pa].  With one of the two, the other number is taken as exact; with both,
        both variables have errors.  With neither all numbers count alike, relative to their size, and the
        residuals of the fit say how much they scatter, as in `scipy.optimize.curve_fit`.
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
        differ, or a state is unknown.

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
        single = self.state is None or isinstance(self.state, str)
        states = [self.state] * count if single else listed("state", self.state)
        if len(states) != count:
            raise InvalidInput(f"{len(states)} states are given for {count} lengths.")
        checked = tuple(_state(s, name) for s, name in zip(states, names, strict=True))
        object.__setattr__(self, "state", checked)

    def __len__(self) -> int:
        return len(self.length)

    @property
    def says_sd(self) -> bool:
        """Whether any number has a standard deviation."""
        return self.length_sd is not None or self.pressure_sd is not None

    def observations(self) -> list[Observation]:
        """Return one observation for each row; without standard deviations all have the same share."""
        columns = (self.length_sd, self.pressure_sd)
        if not self.says_sd:
            columns = (ALIKE * self.length, ALIKE * self.pressure)
        sds = [[None] * len(self) if column is None else [float(v) for v in column] for column in columns]
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
    sd : float or array_like, shape (n,), optional
        Standard deviation of a point, the same in x and y [m].  Without one all points count alike, and the
        residuals say how much they scatter.
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
    sd: Any = None
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
        if self.sd is not None:
            object.__setattr__(self, "sd", _column("sd", self.sd, "m", names))
            _require_meaning("sd", self.sd, np.full(len(names), self._size), names)
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

    @property
    def _size(self) -> float:
        return float(np.abs([self.x, self.y]).max(initial=0.0))

    @property
    def says_sd(self) -> bool:
        """Whether its points have a standard deviation."""
        return self.sd is not None

    def observations(self) -> list[Observation]:
        """Return the one observation that this is; without standard deviation a share of its size."""
        sd = np.full(len(self), ALIKE * self._size) if self.sd is None else self.sd
        points = np.column_stack([self.x, self.y, sd])
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

    def scaled(self, factor: float) -> Observation:
        """Return the same with all standard deviations times a factor."""
        length_sd, pressure_sd = (
            None if sd is None else factor * sd for sd in (self.length_sd, self.pressure_sd)
        )
        points = None if self.points is None else self.points * [1.0, 1.0, factor]
        return replace(self, length_sd=length_sd, pressure_sd=pressure_sd, points=points)

    def role(self, name: str) -> str:
        """What a number is to the fit: "exact", "measured" or "unknown"."""
        if getattr(self, name) is None:
            return "unknown"
        return "exact" if getattr(self, f"{name}_sd") is None else "measured"

    def is_known_by_length(self, sigma: float, P: float, rates: np.ndarray) -> bool:
        """Whether a fitted state is asked for by its length, and not by its pressure.

        By the number that changes more along the branch, where ``rates`` are those of sbar/eta and p/T0,
        unless the other one was exact.
        """
        exact = [name for name in ("length", "pressure") if self.role(name) == "exact"]
        if len(exact) == 1:
            return exact == ["length"]
        return bool(abs(rates[0]) / sigma > abs(rates[1]) / max(abs(P), 1e-300))

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
    """Return all observations of a fit, in the order of the data; see `parts_of`."""
    found = [observation for part in parts_of(data) for observation in part.observations()]
    if not found:
        raise InvalidInput("there is nothing to fit: the data are empty.")
    return found


def says_sd(data: Data) -> bool:
    """Return whether measurements have standard deviations, all or none.

    Raises
    ------
    InvalidInput
        If some of them have.
    """
    said = {part.says_sd for part in parts_of(data)}
    if len(said) > 1:
        raise InvalidInput(
            "some of the data have standard deviations and some have none: nothing weighs them together.",
            remedy="Give all of them one, or none.",
        )
    return said != {False}


def parts_of(data: Data) -> Sequence[Measurements | MeasuredShape]:
    """Return the parts of the data.

    Raises
    ------
    InvalidInput
        If ``data`` is no measurement.
    """
    several = [data] if isinstance(data, (Measurements, MeasuredShape)) else data
    if not isinstance(several, Sequence) or not all(
        isinstance(part, (Measurements, MeasuredShape)) for part in several
    ):
        raise InvalidInput(
            f"data must be Measurements, a MeasuredShape, or a list of them, got {type(data).__name__}.",
            remedy="Read a CSV file with po.read_measurements.",
        )
    return several


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
        column = np.array(unmasked(values), dtype=float)
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
