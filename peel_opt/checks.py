"""Checks of single numbers, with messages that name the field."""

from __future__ import annotations

import math
from numbers import Real

from .errors import InvalidInput


def positive(name: str, value: object, unit: str = "") -> float:
    """Return ``value`` as a finite positive float, or say which field is wrong."""
    return _checked(name, value, unit, minimum=0.0, strict=True)


def finite(name: str, value: object, unit: str = "") -> float:
    """Return ``value`` as a finite float, or say which field is wrong."""
    return _checked(name, value, unit, minimum=-math.inf, strict=True)


def non_negative(name: str, value: object, unit: str = "") -> float:
    """Return ``value`` as a finite float >= 0, or say which field is wrong."""
    return _checked(name, value, unit, minimum=0.0, strict=False)


def _checked(name: str, value: object, unit: str, *, minimum: float, strict: bool) -> float:
    label = f"{name} [{unit}]" if unit else name
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InvalidInput(
            f"{label} must be a number, got {value!r}.",
            remedy="Strings with units are read in problem cards and on the command line.",
        )
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InvalidInput(f"{label} must be finite, got {number}.")
    if number < minimum or (strict and number == minimum):
        wanted = "positive" if strict else "zero or positive"
        raise InvalidInput(f"{label} must be {wanted}, got {number:g}.")
    return number
