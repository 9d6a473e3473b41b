"""Ranges on the command line: ``0.5:10:50``, ``20 kPa:100 kPa:9:log``, ``0.5,1,2``, ``60 kPa``."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from .errors import InvalidInput
from .quantities import Kind, parse

FORM = "Ranges are FROM:TO:COUNT or FROM:TO:COUNT:log, lists A,B,C; with units as in '20 kPa:100 kPa:9'."

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
    >>> from peel_opt.quantities import PRESSURE
    >>> parse_range("--pressure", "20:100 kPa:3", PRESSURE).tolist()
    [20000.0, 60000.0, 100000.0]
    """

    def value(part: str, unit: str = "") -> float:
        bare = (match := _UNIT.fullmatch(part)) is not None and not match.group(1)
        return parse(name, f"{part} {unit}".strip() if bare else part.strip(), kind, own=own, signed=signed)

    if ":" in text:
        return _between(name, text, value)
    parts = text.split(",")
    unit = _unit(parts[-1])
    values = [value(part, unit) for part in parts]
    return values[0] if len(values) == 1 else np.array(values)


def _between(name: str, text: str, value: object) -> np.ndarray:
    parts = [part.strip() for part in text.split(":")]
    if len(parts) not in (3, 4) or parts[3:] not in ([], ["log"], ["lin"]):
        raise InvalidInput(f"{name} cannot be read: {text!r}.", remedy=FORM)
    assert callable(value)
    low, high = value(parts[0], _unit(parts[1])), value(parts[1])
    if not re.fullmatch(r"\d{1,7}", parts[2]) or int(parts[2]) < 2:
        raise InvalidInput(f"{name} needs a whole number of at least 2 as its count, got {parts[2]!r}.")
    if parts[3:] == ["log"]:
        if not low > 0.0 < high:
            raise InvalidInput(f"{name} cannot be spaced logarithmically from {low:g} to {high:g}.")
        return np.geomspace(low, high, int(parts[2]))
    return np.linspace(low, high, int(parts[2]))


def _unit(text: str) -> str:
    match = _UNIT.fullmatch(text)
    return match.group(1) if match else ""
