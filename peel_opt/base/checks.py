"""What callers give: checks of single values, units taken off, with messages that name the field."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from decimal import Decimal
from numbers import Integral, Real
from typing import Any

import numpy as np

from .errors import InvalidInput, OutOfRange
from .units import Kind, in_si, read_text

#: Beyond these, powers of beta0 soon are no numbers any more, and no rod is there.
BETA0 = (1e-12, 1e12)

#: A count beyond this is a slip of the pen.
MOST = 100_000


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


def turned(name: str, value: object) -> float:
    """Return an angle [rad] of a turn at most; a larger one is a number of degrees without its unit.

    Examples
    --------
    >>> turned("angle", "90 deg") == 0.5 * math.pi
    True
    """
    angle = finite(name, value, "rad")
    if abs(angle) > 2.0 * math.pi:
        raise InvalidInput(
            f"{name} = {angle:g} rad is more than a turn.", remedy=f"Write '{angle:g} deg' for degrees."
        )
    return angle


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


def parse(
    name: str,
    value: object,
    kind: Kind,
    *,
    own: Mapping[str, float] | None = None,
    signed: bool = False,
) -> float:
    """Return a quantity in SI units.

    Parameters
    ----------
    name : str
        The field, named in every message.
    value : str or float
        Text with a number and a unit, or a number, which is one in SI units.
    kind : Kind
        What it must measure.
    own : mapping, optional
        Further units and their SI values, such as a rod's ``{"y0": 7.3e-4}``.
    signed : bool
        Whether zero and negative values are accepted.

    Raises
    ------
    InvalidInput
        If it is no number, has no or another unit, or is not finite and positive.

    Examples
    --------
    >>> from peel_opt.base.units import PRESSURE
    >>> parse("adhesion_strength", "140 kPa", PRESSURE)
    140000.0
    """
    number = read_text(name, value, kind, own or {}) if isinstance(value, str) else value
    least = -math.inf if signed else 0.0
    return _checked(name, number, kind.si, minimum=least, strict=True)


def _checked(name: str, value: Any, unit: str, *, minimum: float, strict: bool) -> float:
    if type(value) is not float:
        value = in_si(name, value, unit)
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
