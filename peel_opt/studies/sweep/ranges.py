"""Ranges on the command line: ``0.5:10:50``, ``20 kPa:100 kPa:9:log``, ``0.5,1,2``, ``60 kPa``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from ...base.checks import parse, whole
from ...base.errors import InvalidInput
from ...base.units import Kind
from .plan import MOST_POINTS

FORM = "Ranges are FROM:TO:COUNT or FROM:TO:COUNT:log, lists A, B, C; with units as in '20 kPa:100 kPa:9'."

#: Two numbers, or one with a decimal comma, or with one between its thousands.
_ONE_OR_TWO = re.compile(r"\s*([-+]?\d+),(\d+(?:e[-+]?\d+)?|\d{3}\.\d*)(?![\d.])([^,:]*)", re.IGNORECASE)

#: The number at the head of a quantity; what follows is its unit.
_UNIT = re.compile(r"\s*[-+]?[\d.]+(?:e[-+]?\d+)?\s*(.*)", re.IGNORECASE)


def parse_range(
    name: str, text: str, kind: Kind, *, own: Mapping[str, float] | None = None, signed: bool = False
) -> np.ndarray | float:
    """Return the values of a range or a list, or the one value of a single number, in SI units.

    Raises
    ------
    InvalidInput
        If it has another form, a wrong unit, or an end that cannot be meant.

    Examples
    --------
    >>> from peel_opt.base.units import PRESSURE
    >>> parse_range("--pressure", "20:100 kPa:3", PRESSURE).tolist()
    [20000.0, 60000.0, 100000.0]
    """
    if match := _ONE_OR_TWO.fullmatch(text):
        first, second, unit = match.groups()
        one = f"{first}{second}" if "." in second else f"{first}.{second}"
        raise InvalidInput(
            f"{name} may mean one number or two: {one}{unit}, or {first}{unit} and {second}{unit}.",
            remedy=f"Numbers have a decimal point; write the list with a space: '{first}, {second}{unit}'.",
        )
    if ":" not in text:
        parts = text.split(",")
        bare = [not _unit(part) for part in parts[:-1]]
        if any(bare) and not all(bare):
            raise InvalidInput(
                f"{name} has numbers with and without a unit: {text!r}.",
                remedy="Numbers have a decimal point; the unit stands at the last of a list, or at each.",
            )
        values = parse_together(name, parts, kind, own=own, signed=signed)
        return values[0] if len(values) == 1 else np.array(values)
    parts = [part.strip() for part in text.split(":")]
    if len(parts) not in (3, 4) or parts[3:] not in ([], ["log"], ["lin"]):
        raise InvalidInput(f"{name} cannot be read: {text!r}.", remedy=FORM)
    low, high = parse_together(name, parts[:2], kind, own=own, signed=signed)
    if not re.fullmatch(r"\d{1,20}", parts[2], re.ASCII):
        raise InvalidInput(f"{name} needs a whole number as its count, got {parts[2]!r}.", remedy=FORM)
    count = whole(f"{name}, the count", int(parts[2]), 2, MOST_POINTS)
    if parts[3:] == ["log"]:
        if not low > 0.0 < high:
            raise InvalidInput(f"{name} cannot be spaced logarithmically from {low:g} to {high:g}.")
        return np.geomspace(low, high, count)
    return np.linspace(low, high, count)


def parse_together(
    name: str,
    parts: Sequence[str],
    kind: Kind,
    *,
    own: Mapping[str, float] | None = None,
    signed: bool = False,
) -> list[float]:
    """Return numbers in SI units; those without a unit have that of the last.

    Raises
    ------
    InvalidInput
        If one of them cannot be meant.

    Examples
    --------
    >>> from peel_opt.base.units import LENGTH
    >>> parse_together("--y0", ["7", "8 m"], LENGTH)
    [7.0, 8.0]
    """
    last = _unit(parts[-1])
    return [
        parse(name, part.strip() if _unit(part) else f"{part} {last}".strip(), kind, own=own, signed=signed)
        for part in parts
    ]


def _unit(text: str) -> str:
    """Return what follows the number, the text itself if it begins with none."""
    match = _UNIT.fullmatch(text)
    return match.group(1).strip() if match else text
