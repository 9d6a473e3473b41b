"""A sweep as a picture: curves over one axis, curves or level lines over two."""

from __future__ import annotations

import re

import numpy as np
from matplotlib.axes import Axes

from ..base.errors import InvalidInput
from ..studies.sweep.table import Sweep
from . import style
from .axes import axes_or, own_axes
from .diagram import LABELS
from .dispatch import drawn_by
from .legible import contrast, paper
from .mpl import finish
from .words import AxisUnit, axis_unit, prefixed

#: Up to so many values of one axis are drawn as curves, more as level lines.
MOST_CURVES = 7

#: Number of bands between level lines.
BANDS = 12

#: An axis of positive values, the largest so many times the least, is logarithmic.
WIDE = 10.0

_SYMBOLS = LABELS | {
    "bending_stiffness": "$k$",
    "adhesion_strength": "$T_0$",
    "adhesion_range": "$y_0$",
    "condition": "condition of the question",
}


@drawn_by.register
def plot_sweep(sweep: Sweep, ax: Axes | None = None, *, column: str | None = None) -> Axes:
    """Draw a column of a sweep with one or two axes.

    Parameters
    ----------
    sweep : Sweep
        A list of points is drawn over its first column.
    ax : Axes, optional
    column : str, optional
        A number of the answers; by default the answered one.

    Returns
    -------
    Axes
        With units in every label.  Points without an answer are marked: by crosses at the
        foot of curves, as a hatched area among level lines.

    Raises
    ------
    InvalidInput
        If there are more than two axes, or the column holds no numbers.
    """
    column = sweep.asked if column is None else column
    values = np.asarray(sweep[column])
    if values.dtype.kind != "f":
        raise InvalidInput(f"the column {column!r} holds texts, which cannot be drawn.")
    if len(sweep.shape) > 2:
        raise InvalidInput(
            f"a sweep over {len(sweep.shape)} axes cannot be drawn.",
            remedy="Hold all but two of them, or use to_xarray() and select.",
        )
    ax = axes_or(ax, own_axes(6.4, 4.4))
    if len(sweep.shape) == 1:
        _curves(sweep, ax, column, values[None, :], next(iter(sweep.axes)), None)
    else:
        first, second = sweep.axes
        if len(sweep.axes[first]) <= MOST_CURVES:
            _curves(sweep, ax, column, values, second, first)
        elif len(sweep.axes[second]) <= MOST_CURVES:
            _curves(sweep, ax, column, values.T, first, second)
        else:
            _levels(sweep, ax, column, values, first, second)
    shared = [_named(sweep, name, np.array(value)) for name, value in sweep.fixed.items()]
    hatched = ["hatched: no answer"] if ax.collections and not np.isfinite(values).all() else []
    ax.set_title("; ".join([*shared, sweep.summary(), *hatched]), fontsize=style.SMALL, loc="left")
    ax.spines[["top", "right"]].set_visible(False)
    return finish(ax, columns=3)


def _curves(sweep: Sweep, ax: Axes, column: str, rows: np.ndarray, along: str, by: str | None) -> None:
    x = _scaled(sweep, along, sweep.axes[along])
    order = np.argsort(x, kind="stable")
    for row, colour, name in zip(rows, style.family_colours(len(rows)), _names(sweep, by), strict=True):
        y = _scaled(sweep, column, row, rows)
        ax.plot(x[order], y[order], ".-", color=colour, label=name)
        if (missing := ~np.isfinite(y)).any():
            foot = np.zeros(int(missing.sum()))
            ax.plot(
                x[missing],
                foot,
                "x",
                color=colour,
                transform=ax.get_xaxis_transform(),
                clip_on=False,
                zorder=3,
            )
    if not np.isfinite(rows).all():
        ax.plot([], [], "kx", label="no answer")
    _set_axis(sweep, ax, "x", along)
    ax.set_ylabel(_label(sweep, column, rows))
    ax.margins(y=0.08)


def _levels(sweep: Sweep, ax: Axes, column: str, values: np.ndarray, first: str, second: str) -> None:
    x, y = (_scaled(sweep, name, sweep.axes[name]) for name in (first, second))
    # Lines between neighbours of a grid mean something only where the neighbours lie side by side.
    columns, rows = (np.argsort(side, kind="stable") for side in (x, y))
    x, y = x[columns], y[rows]
    z = np.ma.masked_invalid(_scaled(sweep, column, values).T[np.ix_(rows, columns)])
    if z.count() < 4:
        raise InvalidInput("too few points of the sweep have an answer to draw level lines.")
    ground = paper(ax)
    dark = contrast(ground, "white") > contrast(ground, "black")
    ax.set_facecolor("0.15" if dark else "0.93")
    bands = ax.contourf(x, y, z, BANDS, cmap=style.FAMILY_COLOURMAP)
    lines = ax.contour(x, y, z, bands.levels, colors="white", linewidths=0.6)
    ax.clabel(lines, np.asarray(lines.levels)[1:-1:2], fontsize=style.SMALL - 1.0, fmt="%g")
    assert ax.figure is not None
    ax.figure.colorbar(bands, ax=ax, label=_label(sweep, column, values))
    if np.ma.getmaskarray(z).any():
        lost = np.ma.getmaskarray(z).astype(float)
        hatched = ax.contourf(x, y, lost, [0.5, 1.5], colors="none", hatches=["///"])
        hatched.set_edgecolor("0.6" if dark else "black")
        hatched.set_linewidth(0.0)
    _set_axis(sweep, ax, "x", first)
    _set_axis(sweep, ax, "y", second)


def _symbol(name: str) -> str:
    """Return what a column is called in a picture; numbers of a scene have their own names."""
    return _SYMBOLS.get(name, rf"$\mathrm{{{name.replace('_', chr(92) + ' ')}}}$")


def _names(sweep: Sweep, by: str | None) -> list[str | None]:
    if by is None:
        return [None]
    return [_named(sweep, by, value, sweep.axes[by]) for value in sweep.axes[by]]


def _named(sweep: Sweep, name: str, value: np.ndarray, all_values: np.ndarray | None = None) -> str:
    """Return "symbol = value unit"."""
    unit = _unit(sweep, name, value if all_values is None else all_values)
    symbol = f"{_symbol(name)[:-1]}/{unit.name}$" if unit.is_symbol else _symbol(name)
    suffix = "" if unit.is_symbol or not unit.name else f" {unit.name}"
    return f"{symbol} = {value / unit.size:.4g}{suffix}"


def _set_axis(sweep: Sweep, ax: Axes, side: str, name: str) -> None:
    values = sweep.axes[name]
    ax.set(**{f"{side}label": _label(sweep, name, values)})
    if values.min() > 0.0 and values.max() >= WIDE * values.min():
        ax.set(**{f"{side}scale": "log"})


def _unit(sweep: Sweep, name: str, values: np.ndarray) -> AxisUnit:
    """Return the unit in which a column is drawn: SI with a prefix, the rod's own, or none."""
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    unit = sweep.unit(name)
    if name in sweep.scene_units:
        return _unit_in_scene(unit, largest)
    return axis_unit(unit, largest) if unit else AxisUnit(1.0, "")


def _unit_in_scene(unit: str, largest: float) -> AxisUnit:
    """Return the unit in which a number of a scene is drawn: a product of T0 and eta, or SI."""
    if re.match(r"T0|eta", unit):
        powers = re.sub(r"\^(-?\d+)", r"^{\1}", unit.replace("T0", "T_0").replace("eta", r"\eta"))
        return AxisUnit(1.0, f"({powers})" if " " in unit else powers, is_symbol=True)
    takes_prefix = unit[:1].isupper() or unit == "m"
    return prefixed(largest, unit) if takes_prefix else AxisUnit(1.0, unit)


def _scaled(sweep: Sweep, name: str, values: np.ndarray, all_values: np.ndarray | None = None) -> np.ndarray:
    return values / _unit(sweep, name, values if all_values is None else all_values).size


def _label(sweep: Sweep, name: str, values: np.ndarray) -> str:
    unit, symbol = _unit(sweep, name, values), _symbol(name)
    return unit.axis(symbol.strip("$")) if unit.name else symbol
