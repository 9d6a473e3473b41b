"""What callers give: units taken off, checks of single values, with messages that name the field."""

from __future__ import annotations

import math
from collections.abc import Iterable
from decimal import Decimal
from numbers import Integral, Real
from typing import Any

import numpy as np

from .errors import InvalidInput, OutOfRange

#: Beyond these, powers of beta0 soon are no numbers any more, and no rod is there.
BETA0 = (1e-12, 1e12)

#: A count beyond this is a slip of the pen.
MOST = 100_000


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


def positive(name: str, value: object, unit: str = "") -> float:
    """Return ``value`` as a finite positive float, or say which field is wrong."""
    return _checked(name, value, unit, minimum=0.0, strict=True)


def finite(name: str, value: object, unit: str = "") -> float:
    """Return ``value`` as a finite float, or say which field is wrong."""
    return _checked(name, value, unit, minimum=-math.inf, strict=True)


def listed(name: str, value: object) -> list[Any]:
    """Return a sequence of any kind but a text as a list, or say what it is instead."""
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise InvalidInput(f"{name} must be a list, got {value!r:.60}.")
    return list(value)


def pair(name: str, value: object) -> tuple[float, float]:
    """Return two finite floats, from and to, or say what is wrong with them."""
    numbers = list(value) if isinstance(value, Iterable) else []
    if len(numbers) != 2:
        raise InvalidInput(f"{name} must be two numbers, from and to, got {value!r:.60}.")
    return finite(name, numbers[0]), finite(name, numbers[1])


def flag(name: str, value: object) -> bool:
    """Return ``value`` if it is True or False: of anything else the truth is not what was meant."""
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidInput(f"{name} must be True or False, got {value!r:.60}.")
    return bool(value)


def non_negative(name: str, value: object, unit: str = "") -> float:
    """Return ``value`` as a finite float >= 0, or say which field is wrong."""
    return _checked(name, value, unit, minimum=0.0, strict=False)


def known_beta0(value: object) -> float:
    """Return the paper's beta0, zero or within `BETA0`, as a float, or say what is wrong with it."""
    number = non_negative("beta0", value)
    low, high = BETA0
    if number and not low <= number <= high:
        raise OutOfRange(f"beta0 = {number:.4g} is neither 0 nor within [{low:g}, {high:g}].")
    return number


def whole(name: str, value: object, least: int, most: int = MOST) -> int:
    """Return ``value`` as an int between two others, or say which field is wrong."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise InvalidInput(f"{name} must be a whole number of at least {least}, got {value!r}.")
    number = int(value)
    if number < least:
        raise InvalidInput(f"{name} must be a whole number of at least {least}, got {number}.")
    if number > most:
        raise InvalidInput(f"{name} must be at most {most}, got {_shortened(number)}.")
    return number


def _shortened(number: int) -> str:
    return f"{number}" if abs(number) < 10**20 else "a number of more than 20 digits"


def _checked(name: str, value: object, unit: str, *, minimum: float, strict: bool) -> float:
    label = f"{name} [{unit}]" if unit else name
    value = in_si(name, value, unit)
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        value = value.item()  # the one number of an array without axes
    if isinstance(value, bool) or not isinstance(value, Real | Decimal):
        raise InvalidInput(
            f"{label} must be a number, got {value!r}.",
            remedy="Texts with units are read in problem cards and on the command line,"
            " quantities of pint here.",
        )
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    except ValueError:  # a signalling NaN
        number = math.nan
    if not math.isfinite(number):
        raise InvalidInput(f"{label} must be finite, got {number}.")
    if number < minimum or (strict and number == minimum):
        wanted = "positive" if strict else "zero or positive"
        raise InvalidInput(f"{label} must be {wanted}, got {number:g}.")
    return number
