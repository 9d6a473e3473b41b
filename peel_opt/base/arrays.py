"""Arrays: taken from callers, handed out so that they do not change, printed in a line."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from .units import in_si

#: Distance from 1 to the next double: what the last place of a number is worth, relative to it.
EPS = float(np.finfo(float).eps)


def floats(name: str, value: Any, unit: str = "") -> np.ndarray:
    """Return an array of floats of what a caller gave, a quantity in this SI unit."""
    return np.asarray(unmasked(in_si(name, value, unit)), float)


def unmasked(values: Any) -> Any:
    """Return a masked array with NaN for what is masked, anything else as it is.

    NumPy takes what lies under the mask for a number.

    Examples
    --------
    >>> unmasked(np.ma.array([1.0, 2.0], mask=[False, True])).tolist()
    [1.0, nan]
    """
    return np.ma.filled(values.astype(float), np.nan) if np.ma.isMaskedArray(values) else values


def read_only(values: Any) -> np.ndarray:
    """Return values as an array that cannot be written to; one that is so already is not copied.

    Examples
    --------
    >>> read_only([1.0, 2.0]).flags.writeable
    False
    """
    if isinstance(values, np.ndarray) and not values.flags.writeable and values.base is None:
        return values
    array = np.array(values)
    array.flags.writeable = False
    return array


class Columns:
    """A dataclass of arrays whose repr has a line for each: how many values, and from where to where."""

    def __repr__(self) -> str:
        named = [(f.name, getattr(self, f.name)) for f in fields(self) if f.repr]  # type: ignore[arg-type]
        lines = [f"{name}: {brief(value)}" for name, value in named]
        tree = [f"{'└─' if line is lines[-1] else '├─'} {line}" for line in lines]
        return "\n".join([type(self).__name__, *tree])


def brief(value: Any) -> str:
    """Return a value in a few words, an array by its size and its ends.

    Examples
    --------
    >>> brief(np.array([3.0, 1.0, np.nan]))
    '3 values, 1 to 3, some nan'
    """
    if not isinstance(value, np.ndarray):
        return f"{value:.6g}" if isinstance(value, float) else repr(value)
    if not value.ndim:
        return brief(value.item())
    size = f"{'x'.join(map(str, value.shape))} values"
    if value.dtype.kind not in "fiu":
        return f"{size}, {', '.join(map(str, np.unique(value)[:6]))}" if value.size else size
    known = value[np.isfinite(value)] if value.dtype.kind == "f" else value
    ends = f", {known.min() + 0.0:.6g} to {known.max() + 0.0:.6g}" if known.size else ""
    return f"{size}{ends}{', some nan' if known.size < value.size else ''}"
