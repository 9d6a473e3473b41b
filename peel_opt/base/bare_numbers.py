"""Single numbers without a unit, checked."""

from __future__ import annotations

import math
from decimal import Decimal
from numbers import Real
from typing import Any

from .errors import InvalidInput


def bare_number(name: str, value: Any, unit: str, *, minimum: float, strict: bool) -> float:
    """Return a value as a finite float above a minimum, or say which field is wrong.

    Parameters
    ----------
    name : str
        The field, named in every message.
    value : object
        A number of any kind, in ``unit``.
    unit : str
        Named beside the field; empty for a plain number.
    minimum : float
    strict : bool
        Whether the minimum itself is refused.

    Raises
    ------
    InvalidInput
    """
    label = f"{name} [{unit}]" if unit else name
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        value = value.item()  # the one number of an array without axes
    if isinstance(value, bool) or not isinstance(value, Real | Decimal):
        raise InvalidInput(
            f"{label} must be a number, got {value!r}.",
            remedy="One with a unit may be a text such as '1.9 mm', or a quantity of pint." if unit else "",
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
