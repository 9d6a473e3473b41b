"""What callers give as arrays, units taken off, and arrays that are handed out and must not change."""

from __future__ import annotations

from typing import Any

import numpy as np

from .errors import InvalidInput


def in_si(name: str, value: Any, unit: str = "") -> Any:
    """Return quantities of pint, of any registry, as plain numbers; what has no unit as it is.

    NumPy takes the bare magnitude of a quantity: 1.9 mm would become 1.9 m.

    Parameters
    ----------
    name : str
        The argument, named in the message.
    value : object
        A number or an array, with or without a unit, or a list of them.
    unit : str
        The SI unit; empty for a plain number.

    Raises
    ------
    InvalidInput
        If the unit is another, or one of a library other than pint.

    Examples
    --------
    >>> import pint
    >>> in_si("length", [1.9, 2.0] * pint.UnitRegistry().mm, "m").round(6).tolist()
    [0.0019, 0.002]
    """
    if isinstance(value, list | tuple):
        bare = [in_si(name, item, unit) for item in value]
        return value if all(a is b for a, b in zip(bare, value, strict=True)) else bare
    own = getattr(value, "units", getattr(value, "unit", None))
    if own is None or str(own) == unit:
        return getattr(value, "magnitude", value)
    try:
        return value.to(unit or "dimensionless").magnitude
    except AttributeError:  # no quantity of pint
        reason = "of quantities with units, only those of pint are read"
    except Exception as error:  # of the registry, whichever that is
        reason = str(error)
    raise InvalidInput(
        f"{name} cannot be taken in {str(own)!r}: {reason}.",
        remedy=f"Give it in {unit}." if unit else "It is a plain number.",
    )


def floats(name: str, value: Any, unit: str = "") -> np.ndarray:
    """Return an array of floats of what a caller gave, a quantity in this SI unit."""
    return np.asarray(in_si(name, value, unit), float)


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
