"""`Sweep`: what came of a sweep, as labelled arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.drawing import Pictured, draw
from ...base.errors import InvalidInput
from ...base.records import (
    Column,
    Schema,
    Stored,
    Table,
    array,
    dataset,
    require_netcdf,
    titled,
    write_netcdf,
)
from ...model.labels import CERTIFIED, counted
from ...model.rod import MATERIAL, Rod, Units
from .answers import NUMBERS, TEXTS
from .plan import given_among

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Bytes of a file: more than the largest sweep.
LARGEST = 8_000_000_000


@dataclass(frozen=True, eq=False)
class Sweep(Pictured, Stored):
    """Answers over a grid or a list of points.

    Every number and text of the answers is an array of the shape ``shape``, read as
    ``sweep["pressure"]``; so are the axes and the fixed numbers.  Where there is no answer
    the numbers are NaN and ``status`` and ``message`` say why.

    Parameters
    ----------
    axes : dict of str to ndarray
        The values of each axis.
    fixed : dict of str to float
        Numbers that are the same at all points.
    rod : Rod or None
        Where the other material numbers come from.
    zipped : bool
        Whether the axes are columns of a list of points.
    asked : str
        The answered number.
    units : Units or None
        Of pressures and lengths; None if there are ratios or the paper's groups only.
    options : dict of str to str
        Law, state, tol and method; a scene in words.
    arithmetic : str
        Under which the bits were computed; sweeps with the same one agree in all bits.
    values : dict of str to ndarray
        The numbers and texts of the answers, each of shape ``shape``.
    scene_units : dict of str to str
        Units of the numbers of a scene among the axes and the fixed numbers.
    """

    schema = Schema("peel_opt sweep", 1, largest=LARGEST)

    axes: dict[str, np.ndarray]
    fixed: dict[str, float]
    rod: Rod | None
    zipped: bool
    asked: str
    units: Units | None
    options: dict[str, str]
    arithmetic: str
    values: dict[str, np.ndarray]
    scene_units: dict[str, str] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, ...]:
        """One side an axis; the length of the list if zipped."""
        return self.values["status"].shape

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the sides of the arrays."""
        return ("point",) if self.zipped else tuple(self.axes)

    def __len__(self) -> int:
        return self.values["status"].size

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a number or text of the answers, an axis or a fixed number, at every point."""
        if name in self.axes:
            if self.zipped:
                return self.axes[name]
            side = list(self.axes).index(name)
            along = [1] * len(self.axes)
            along[side] = -1
            return np.broadcast_to(self.axes[name].reshape(along), self.shape)
        if name in self.values:
            return self.values[name]
        if name in self.fixed:
            return np.full(self.shape, self.fixed[name])
        there = dict.fromkeys([*self.axes, *self.fixed, *self.values])
        raise InvalidInput(f"a sweep has no column {name!r}.", remedy=f"It has {', '.join(there)}.")

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the answers' columns, without those that stand among the axes."""
        absolute = () if self.units is not None else ("pressure", "length")
        return tuple(
            name
            for name in (*NUMBERS, *TEXTS)
            if name not in self.axes and name not in self.fixed and name not in absolute
        )

    @property
    def certified(self) -> np.ndarray:
        """Where there is an answer, of shape ``shape``."""
        return self.values["status"] == CERTIFIED

    @property
    def failures(self) -> list[dict[str, Any]]:
        """Points without an answer: their numbers, ``status``, ``message`` and ``nearest``."""
        names = (*self.axes, *self.fixed, "status", "message", "nearest")
        columns = {name: self[name].ravel() for name in names}
        return [
            {name: column[i].item() for name, column in columns.items()}
            for i in np.flatnonzero(~self.certified.ravel())
        ]

    def unit(self, name: str) -> str:
        """Return the unit of a column, empty if it has none."""
        units = self.units
        if name in self.scene_units:
            return self.scene_units[name]
        if name == "nearest":
            return self.unit(_given(self))
        return "" if units is None else units.of_number(name)

    def title(self, name: str) -> str:
        """Return the name of a column with its unit."""
        return titled(name, self.unit(name))

    # --- out ------------------------------------------------------------------------------

    def record(self) -> dict[str, Any]:
        """Return plain data with units in the keys: what all points share, and the points."""
        return self._shared() | {"summary": self.summary(), "points": self._table().rows}

    def _column(self, name: str, values: np.ndarray) -> Column:
        return Column(values, self.unit(name))

    def _table(self) -> Table:
        columns = {name: self._column(name, self[name]) for name in (*self.axes, *self.columns)}
        return Table(self._shared().items(), columns)

    def _shared(self) -> dict[str, Any]:
        """Return what all points share, with units in the keys."""
        fixed = {self.title(name): value for name, value in self.fixed.items()}
        return {"asked": self.asked, **fixed, **self.options, **Units.of(self.rod).rod(self.rod)}

    def _arrays(self) -> dict[str, np.ndarray]:
        return {f"axis.{name}": values for name, values in self.axes.items()} | self.values

    def _head(self) -> dict[str, Any]:
        return {
            "axes": list(self.axes),
            "fixed": self.fixed,
            "rod": None if self.rod is None else {name: getattr(self.rod, name) for name in MATERIAL},
            "zipped": self.zipped,
            "asked": self.asked,
            "units": None if self.units is None else asdict(self.units),
            "options": self.options,
            "arithmetic": self.arithmetic,
            "scene_units": self.scene_units,
        }

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Sweep:
        axes = {name: array(arrays, f"axis.{name}") for name in head["axes"]}
        sizes = tuple(len(values) for values in axes.values())
        if head["zipped"] and len(set(sizes)) != 1:
            raise ValueError("its axes are no columns of one list")
        shape = sizes[:1] if head["zipped"] else sizes
        values = {name: array(arrays, name, "f", shape) for name in NUMBERS}
        return cls(
            axes=axes,
            fixed={str(name): float(value) for name, value in head["fixed"].items()},
            rod=None if head["rod"] is None else Rod(**head["rod"]),
            zipped=bool(head["zipped"]),
            asked=str(head["asked"]),
            units=None if head["units"] is None else Units(**head["units"]),
            options={str(name): str(value) for name, value in head["options"].items()},
            arithmetic=str(head["arithmetic"]),
            values=values | {name: array(arrays, name, "U", shape) for name in TEXTS},
            scene_units={str(name): str(unit) for name, unit in head.get("scene_units", {}).items()},
        )

    def to_xarray(self) -> Any:
        """Return an `xarray.Dataset` with the axes as coordinates and units as attributes.

        Raises
        ------
        MissingExtra
            If xarray is not installed.
        """
        along = {name: self.dims if self.zipped else (name,) for name in self.axes}
        coordinates = {name: (along[name], self._column(name, v)) for name, v in self.axes.items()}
        coordinates |= {name: ((), self._column(name, np.array(v))) for name, v in self.fixed.items()}
        variables = {name: (self.dims, self._column(name, self.values[name])) for name in self.columns}
        about = {"asked": self.asked, "arithmetic": self.arithmetic, **self.options}
        return dataset(variables, coordinates, about if self.rod is None else about | {"rod": repr(self.rod)})

    def to_netcdf(self, path: str | Path) -> Path:
        """Write `to_xarray` as NetCDF.

        Raises
        ------
        MissingExtra
            If xarray or h5netcdf is not installed.
        """
        require_netcdf()
        return write_netcdf(self.to_xarray(), path)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        column: str | None = None,
        legend: bool = True,
        title: str | None = None,
    ) -> Axes:
        """Draw the answered number, or another column, over one or two axes; return the axes."""
        return draw(self, ax, column=column, legend=legend, title=title)

    def summary(self) -> str:
        """Return how many points have an answer, and why the others have none."""
        return counted(self.values["status"], " points")

    def __repr__(self) -> str:
        sides = " x ".join(map(str, self.shape))
        lines = [f"Sweep of {self.asked} over {sides} points: {self.summary()}"]
        lines += [f"├─ {self.title(name)} {_span(values)}" for name, values in self.axes.items()]
        lines += [f"├─ {self.title(name)} = {value:.6g}" for name, value in self.fixed.items()]
        if self.rod is not None:
            lines.append(f"├─ {self.rod!r}")
        lines.append("└─ " + ", ".join(f"{name} {value}" for name, value in self.options.items()))
        return "\n".join(lines)


def _given(sweep: Sweep) -> str:
    """Return the given number of the question."""
    return given_among({*sweep.axes, *sweep.fixed})


def _span(values: Iterable[float]) -> str:
    array = np.asarray(values)
    if len(array) == 1:
        return f"= {array[0]:.6g}, the only value"
    return f"{array.min():.6g} to {array.max():.6g}, {len(array)} values"
