"""Numbers with units: "140 kPa", "35.5 eV", "100 gf/in" into SI, and back for people."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from .checks import finite, positive
from .errors import InvalidInput

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Kind:
    """What a quantity measures: its SI unit, and the units to name in a message."""

    si: str
    examples: tuple[str, ...]


PRESSURE = Kind("Pa", ("Pa", "kPa", "MPa", "GPa", "bar", "psi", "mmHg"))
LENGTH = Kind("m", ("m", "mm", "um", "nm", "in"))
STIFFNESS = Kind("N m", ("N m", "uN m", "mN mm", "J", "eV"))
WORK = Kind("J/m^2", ("J/m^2", "mJ/cm^2", "N/m", "N/25 mm", "gf/in", "lbf/in"))
NUMBER = Kind("", ())

_NUMBER = r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|(?:nan|inf(?:inity)?)\b)"
_QUANTITY = re.compile(rf"({_NUMBER})\s*(.*)", re.IGNORECASE)
#: One factor of a unit: an operator, a count below a slash ("N/25 mm"), a name, an exponent.
_FACTOR = re.compile(
    r"\s*(?:(/)\s*(\d{1,4}(?!\d))?|[*·])?\s*"
    r"([^\W\d_²³]+(?:_[^\W\d_²³]+)*)"
    r"(?:(?:\s*(?:\*\*|\^)\s*)?(-?\d)(?!\d)|([²³]))?"
)
_SUPERSCRIPTS = {"²": 2, "³": 3}

_PREFIXES = {-18: "a", -15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}


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
    >>> parse("adhesion_strength", "140 kPa", PRESSURE)
    140000.0
    """
    own = own or {}
    check = finite if signed else positive
    if not isinstance(value, str):
        if isinstance(value, int) and abs(value) > 10**300:
            value = math.inf  # which the check refuses; as a float it would overflow
        return check(name, value, kind.si)
    match = _QUANTITY.fullmatch(value.strip())
    if match is None:
        raise InvalidInput(f"{name} must be a number with a unit, got {value!r}.", remedy=_wanted(kind, own))
    number, unit = match.groups()
    if not unit:
        if kind.si:
            raise InvalidInput(f"{name} needs a unit, got {value!r}.", remedy=_wanted(kind, own))
        return check(name, float(number), kind.si)
    return check(name, float(number) * _scale(name, unit, kind, own), kind.si)


def display(value: float, unit: str, digits: int = 6) -> str:
    """Write an SI value with an engineering prefix, in ASCII: 1.79810 mm, 60.0000 kPa.

    Examples
    --------
    >>> display(6e4, "Pa")
    '60.0000 kPa'
    """
    number, power = _engineering(value, digits)
    return f"{number} {_PREFIXES.get(power, '')}{unit}"


def display_with_error(value: float, error: float, unit: str, digits: int = 6) -> str:
    """Write an SI value and its error in the same unit: 1.79810 mm ± 2e-09 mm.

    Examples
    --------
    >>> display_with_error(6e4, 3e-7, "Pa")
    '60.0000 kPa ± 3e-10 kPa'
    """
    number, power = _engineering(value, digits)
    full = f"{_PREFIXES.get(power, '')}{unit}"
    return f"{number} {full} ± {error / 10.0**power:.0e} {full}"


def _engineering(value: float, digits: int) -> tuple[str, int]:
    """Return a number as text, and the power of ten of the prefix that goes with it."""
    if not math.isfinite(value):
        return f"{value}", 0
    # Rounded first: 999.9999 Pa shown with four digits is 1.000 kPa.
    rounded = float(f"{value:.{digits - 1}e}")
    power = 3 * math.floor(math.log10(abs(rounded)) / 3 + 1e-12) if rounded else 0
    if power not in _PREFIXES:
        return f"{value:.{digits - 1}e}", 0
    scaled = rounded / 10.0**power
    decimals = max(digits - 1 - math.floor(math.log10(abs(scaled)) + 1e-12), 0) if scaled else digits - 1
    return f"{scaled:.{decimals}f}", power


def _scale(name: str, unit: str, kind: Kind, own: Mapping[str, float]) -> float:
    """Return the SI value of a unit expression that must measure ``kind``."""
    if unit in own:
        return own[unit]
    if not kind.si:
        raise InvalidInput(f"{name} cannot have a unit such as {unit!r} here.", remedy=_wanted(kind, own))
    quantity = _unit(name, unit, kind, own)
    wanted = _unit(name, kind.si, kind, own)
    if quantity.dimensionality != wanted.dimensionality:
        raise InvalidInput(f"{name} cannot be measured in {unit!r}.", remedy=_wanted(kind, own))
    return float((quantity / wanted).to_base_units().magnitude)


def _unit(name: str, text: str, kind: Kind, own: Mapping[str, float]) -> Any:
    """Return a unit expression as a pint quantity.

    Factors are read here, so that the culprit can be named, and so that a text is never
    evaluated: ``9**9**9`` would take for ever.
    """
    import pint

    registry = _registry()
    product, position = registry.Quantity(1.0), 0
    while position < len(text):
        factor = _FACTOR.match(text, position) if position < 60 else None
        if factor is None:
            raise InvalidInput(
                f"{name} has a unit that cannot be read: {text[:60]!r}.", remedy=_wanted(kind, own)
            )
        operator, count, symbol, exponent, superscript = factor.groups()
        power = int(exponent) if exponent else _SUPERSCRIPTS.get(superscript, 1)
        try:
            part = registry.Quantity(float(count or 1), registry.parse_units(symbol) ** power)
            product = product / part if operator == "/" else product * part
        except (pint.PintError, ArithmeticError, ValueError, AttributeError) as error:
            raise InvalidInput(
                f"{name} has an unknown unit {symbol!r}{_meant(symbol, own)}", remedy=_wanted(kind, own)
            ) from error
        position = factor.end()
    return product


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def _meant(symbol: str, own: Mapping[str, float]) -> str:
    """End a message with the nearest known unit."""
    kinds = (PRESSURE, LENGTH, STIFFNESS, WORK)
    names = [*own, *(n for kind in kinds for unit in kind.examples for n in re.findall(r"[A-Za-z]+", unit))]
    lowered = {known.lower(): known for known in reversed(names)}
    nearest = difflib.get_close_matches(symbol.lower(), lowered, n=1, cutoff=0.5)
    return f"; did you mean {lowered[nearest[0]]!r}?" if nearest else "."


def _wanted(kind: Kind, own: Mapping[str, float]) -> str:
    units = (*kind.examples, *own)
    return f"Accepted are units such as {', '.join(units)}." if units else "Give a number."
