"""Numbers with units: "140 kPa", "35.5 eV", "100 gf/in" into SI, and back for people."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Context, Decimal, localcontext
from functools import lru_cache
from typing import Any

import numpy as np

from .errors import InvalidInput


@dataclass(frozen=True)
class Kind:
    """What a quantity measures: its SI unit, and the units to name in a message."""

    si: str
    examples: tuple[str, ...]


PRESSURE = Kind("Pa", ("Pa", "kPa", "MPa", "GPa", "bar", "psi", "mmHg", "cmH2O"))
LENGTH = Kind("m", ("m", "mm", "um", "nm", "in", "mil"))
STIFFNESS = Kind("N m", ("N m", "uN m", "mN mm", "J", "eV"))
WORK = Kind("J/m^2", ("J/m^2", "mJ/cm^2", "N/m", "N/25 mm", "gf/in", "lbf/in"))
LINE_FORCE = Kind("N/m", ("N/m", "N/25 mm", "gf/in", "lbf/in"))
LINE_MOMENT = Kind("N", ("N", "mN", "N mm/mm"))
CURVATURE = Kind("1/m", ("1/m", "1/mm"))
FOUNDATION = Kind("Pa/m", ("Pa/m", "MPa/mm", "GPa/m"))
ANGLE = Kind("rad", ("deg", "rad"))
MASS = Kind("kg/m^2", ("kg/m^2", "g/m^2", "mg/cm^2"))
DRAG = Kind("Pa s/m", ("Pa s/m", "kPa s/m", "Pa s/mm"))
TIME = Kind("s", ("s", "ms", "us", "ns"))
NUMBER = Kind("", ())

#: What can be measured here, by its SI unit.
KINDS = {
    kind.si: kind
    for kind in (
        PRESSURE,
        LENGTH,
        STIFFNESS,
        WORK,
        LINE_FORCE,
        LINE_MOMENT,
        CURVATURE,
        FOUNDATION,
        ANGLE,
        MASS,
        DRAG,
        TIME,
        NUMBER,
    )
}

_NUMBER = r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|(?:nan|inf(?:inity)?)\b)"
_QUANTITY = re.compile(rf"({_NUMBER})\s*(.*)", re.IGNORECASE)
#: Digits with something between them that separates thousands, or stands for a point.
_SEPARATED = re.compile(r"[-+]?\d+(?:,\d+|[.'’_\s]\d{3}(?!\d))+(?:[.,]\d+)?")
#: A factor of a unit: an operator, a count below a slash ("N/25.4 mm"), a name, an exponent; or brackets.
_FACTOR = re.compile(
    r"\s*(/|\*)?\s*(?:\(([^()]+)\)|"
    r"(\d{1,4}(?:\.\d{1,4})?(?![\d.]))?\s*"
    r"([A-Za-z]+H2O|[^\W\d_]+(?:_[^\W\d_]+)*)"
    r"(?:\s*(?:\*\*|\^))?\s*(-?\d(?!\d))?)"
)
_RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_SIGNS = str.maketrans({"−": "-", "·": "*", "⋅": "*", "∙": "*", "×": "*", "₂": "2", "°": "deg"})

#: Units of the trade that pint does not know, or not by this name.
_DEFINITIONS = (
    "@alias torr = Torr",
    "pound_force_per_square_foot = force_pound / foot ** 2 = psf",
    "pound_force_per_inch = force_pound / inch = pli",
)
#: What pint takes for something else: its mil is an angle.
_MEANT = {"mil": "thou", "mils": "thou"}
#: Masses that are said where the force of their weight is meant.
_FORCES = {"oz": "ozf", "lb": "lbf", "lbs": "lbf", "g": "gf", "kg": "kgf"}
#: What is written in one word or with a space, and how it is read.
_SPELLINGS = (
    (re.compile(r"\b(mm|cm|m|in|ft)[\s_-]*(Hg|H2O)\b"), r"\1\2"),
    (re.compile(r"\b([pnuµμmkM]?N)([nuµμmc]?m)\b"), r"\1 \2"),
    (re.compile(r"(?<=[^\W\d_])[-.](?=[^\W\d_])"), "*"),
    (re.compile(r"^1\s*/"), "/"),
)

#: Decimal arithmetic, whatever a caller has set: 0.07 mm is 7e-5 m to the last bit.
_EXACT = Context(prec=40, traps=[])

_PREFIXES = {-18: "a", -15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}


def in_si(name: str, value: Any, unit: str = "") -> Any:
    """Return texts with units and quantities of pint, of any registry, as plain numbers; the rest as it is.

    NumPy takes the bare magnitude of a quantity: 1.9 mm would become 1.9 m.

    Parameters
    ----------
    name : str
        The argument, named in the message.
    value : object
        A number, a text such as "1.9 mm" or an array, with or without a unit, or a list of them.
    unit : str
        The SI unit; empty for a plain number, for which no text is read.

    Raises
    ------
    InvalidInput
        If the unit is missing or another, or one of a library other than pint.

    Examples
    --------
    >>> in_si("length", ["1.9 mm", 2.0e-3], "m")
    [0.0019, 0.002]
    >>> import pint
    >>> in_si("length", [1.9, 2.0] * pint.UnitRegistry().mm, "m").round(6).tolist()
    [0.0019, 0.002]
    """
    if isinstance(value, list | tuple):
        bare = [in_si(name, item, unit) for item in value]
        return value if all(a is b for a, b in zip(bare, value, strict=True)) else bare
    if isinstance(value, str):
        return read_text(name, value, KINDS[unit], {}) if unit else value
    if unit and getattr(value, "dtype", None) is not None and value.dtype.kind in "UO":
        items = [in_si(name, item, unit) for item in np.ravel(value)]
        return np.reshape(np.array(items), np.shape(value))
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


def read_text(name: str, value: str, kind: Kind, own: Mapping[str, float]) -> float:
    """Return the number and unit of a text in SI units, finite or not."""
    text = value.strip().translate(_SIGNS)
    match = _QUANTITY.fullmatch(text)
    if match is None:
        wanted = "a number with a unit" if kind.si else "a number"
        raise InvalidInput(f"{name} must be {wanted}, got {value!r}.", remedy=_wanted(kind, own))
    if separated := _SEPARATED.match(text):
        _refuse_separators(name, separated.group())
    number, unit = match.groups()
    if not unit and kind.si:
        raise InvalidInput(f"{name} needs a unit, got {value!r}.", remedy=_wanted(kind, own))
    if not unit or unit in own:
        return float(number) * own.get(unit, 1.0)
    with localcontext(_EXACT):
        return float(Decimal(number) * _scale(name, unit, kind, own))


def unit_in(text: object) -> str:
    """Return the unit of a text that `parse` reads; none of a plain number.

    Examples
    --------
    >>> unit_in("1427 cmH2O")
    'cmH2O'
    """
    match = _QUANTITY.fullmatch(text.strip().translate(_SIGNS)) if isinstance(text, str) else None
    return match.group(2) if match else ""


def _refuse_separators(name: str, digits: str) -> None:
    """Raise if a number has a decimal comma or separates thousands."""
    parts = re.split(r"[.,'’_\s]+", digits)
    if "," not in digits and len(parts) == 2 and "." in digits:
        return
    whole, point = "".join(parts), f"{''.join(parts[:-1])}.{parts[-1]}"
    signs = set(re.findall(r"[.,'’_\s]", digits))
    if digits.count(",") == 1 and len(parts) == 2:
        either = len(parts[1]) == 3
        words = "a comma, decimal or of thousands" if either else "a decimal comma"
        write = f"{point} or {whole}" if either else point
    else:
        # The last sign, if it is another than those before it.
        decimal = len(signs) > 1 and re.findall(r"[.,'’_\s]", digits)[-1] in ",."
        words, write = "separators of thousands", point if decimal else whole
    raise InvalidInput(f"{name} has {words}, got {digits!r}.", remedy=f"Write {write}.")


#: Units to show values in, by the SI unit of what they measure: the name and its SI value.
ShownUnits = Mapping[str, tuple[str, float]]


def shown_units(name: str, text: str) -> ShownUnits:
    """Read the units that values are to be shown in, of a list such as "mmHg,mm".

    Parameters
    ----------
    name : str
        The option, named in every message.
    text : str

    Returns
    -------
    mapping of str to (str, float)

    Raises
    ------
    InvalidInput
        If one of them measures nothing here.

    Examples
    --------
    >>> sorted(shown_units("--units", "kPa, mm"))
    ['Pa', 'm']
    """
    found: dict[str, tuple[str, float]] = {}
    for unit in filter(None, map(str.strip, text.split(","))):
        refused: list[InvalidInput] = []
        for si in filter(None, KINDS):
            try:
                found[si] = unit, read_text(name, f"1 {unit}", KINDS[si], {})
            except InvalidInput as error:
                refused.append(error)
        if len(refused) == len(KINDS) - 1:
            raise refused[0]
    return found


def display(value: float, unit: str, digits: int = 6, shown: ShownUnits | None = None) -> str:
    """Write an SI value with an engineering prefix, in ASCII: 1.79810 mm, 60.0000 kPa.

    Parameters
    ----------
    value : float
    unit : str
        Its SI unit.
    digits : int
    shown : mapping, optional
        Units in the place of SI, from `shown_units`.

    Examples
    --------
    >>> display(6e4, "Pa")
    '60.0000 kPa'
    >>> display(6e4, "Pa", shown=shown_units("--units", "mmHg"))
    '450.037 mmHg'
    """
    if shown and unit in shown:
        name, size = shown[unit]
        return f"{value / size:#.{digits}g} {name}".replace(". ", " ")
    number, power = _engineering(value, digits)
    return f"{number} {_PREFIXES.get(power, '')}{unit}"


def display_with_error(value: float, error: float, unit: str) -> str:
    """Write an SI value and its error in the same unit: 1.79810 mm ± 2e-09 mm.

    Examples
    --------
    >>> display_with_error(6e4, 3e-7, "Pa")
    '60.0000 kPa ± 3e-10 kPa'
    """
    number, power = _engineering(value, 6)
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


def _scale(name: str, unit: str, kind: Kind, own: Mapping[str, float]) -> Decimal:
    """Return the SI value of a unit expression that must measure ``kind``."""
    if not kind.si:
        raise InvalidInput(f"{name} cannot have a unit such as {unit!r} here.", remedy=_wanted(kind, own))
    quantity = _unit(name, _spelled(unit), kind, own)
    wanted = _unit(name, _spelled(kind.si), kind, own)
    if quantity.dimensionality != wanted.dimensionality:
        weighed = quantity * _unit(name, "m/s^2", kind, own)
        masses = [word for word in re.findall(r"[A-Za-z]+", unit) if word in _FORCES]
        if masses and weighed.dimensionality == wanted.dimensionality:
            force = re.sub(rf"\b{masses[0]}\b", _FORCES[masses[0]], unit)
            raise InvalidInput(
                f"{name} cannot be measured in {unit!r}: {masses[0]!r} is a mass.",
                remedy=f"Its weight is {_FORCES[masses[0]]!r}; if that is meant, write {force!r}.",
            )
        raise InvalidInput(f"{name} cannot be measured in {unit!r}.", remedy=_wanted(kind, own))
    scale: Decimal = (quantity / wanted).to_base_units().magnitude
    return scale


def _spelled(unit: str) -> str:
    """Return a unit expression in plain signs: "kN·m⁻²" as "kN*m-2", "mm Hg" as "mmHg"."""
    unit = re.sub(r"[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", lambda raised: f"^{raised.group().translate(_RAISED)}", unit)
    for written, read in _SPELLINGS:
        unit = written.sub(read, unit)
    return unit


def _unit(name: str, text: str, kind: Kind, own: Mapping[str, float], *, count: bool = False) -> Any:
    """Return a unit expression as a pint quantity; ``count``: it may begin with a number.

    Factors are read here, so that the culprit can be named, and so that a text is never
    evaluated: ``9**9**9`` would take for ever.
    """
    import pint

    registry = _registry()
    product, position = registry.Quantity(Decimal(1)), 0
    while position < len(text):
        factor = _FACTOR.match(text, position) if position < 60 else None
        counted = count and position == 0  # "/(25 mm)"
        if factor is None or (factor[3] and factor[1] != "/" and not counted):
            raise InvalidInput(
                f"{name} has a unit that cannot be read: {text[:60]!r}.", remedy=_wanted(kind, own)
            )
        operator, inner, number, symbol, exponent = factor.groups()
        if number and not float(number):
            raise InvalidInput(f"{name} has a unit with a count of 0: {text[:60]!r}.")
        try:
            if inner is not None:
                part = _unit(name, inner, kind, own, count=True)
            else:
                unit = registry.parse_units(_MEANT.get(symbol, symbol)) ** int(exponent or 1)
                part = registry.Quantity(Decimal(number or 1), unit)
            product = product / part if operator == "/" else product * part
        except InvalidInput:
            raise
        except (pint.PintError, ArithmeticError, ValueError, AttributeError) as error:
            raise InvalidInput(
                f"{name} has an unknown unit {symbol!r}{_meant(symbol, own)}", remedy=_wanted(kind, own)
            ) from error
        position = factor.end()
    return product


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(non_int_type=Decimal)
    for definition in _DEFINITIONS:
        registry.define(definition)
    return registry


def _meant(symbol: str, own: Mapping[str, float]) -> str:
    """End a message with the nearest known unit."""
    names = [
        *own,
        *(
            n
            for kind in KINDS.values()
            for unit in kind.examples
            for n in re.findall(r"[A-Za-z]+(?:2O)?", unit)
        ),
    ]
    lowered = {known.lower(): known for known in reversed(names)}
    nearest = difflib.get_close_matches(symbol.lower(), lowered, n=1, cutoff=0.5)
    return f"; did you mean {lowered[nearest[0]]!r}?" if nearest else "."


def _wanted(kind: Kind, own: Mapping[str, float]) -> str:
    units = (*kind.examples, *own)
    return f"Accepted are units such as {', '.join(units)}." if units else ""


def told_apart(value: float, bound: float, digits: int = 4) -> tuple[str, str]:
    """Return two numbers in as many digits as it takes to see that they differ, four at least."""
    for many in range(digits, 18):
        texts = f"{value:.{many}g}", f"{bound:.{many}g}"
        if texts[0] != texts[1]:
            break
    return texts


def digits_left(value: float, error: float, most: int) -> int:
    """Return how many digits of a value its error leaves, from 1 to ``most``; all without an error."""
    if not error > 0.0:
        return most
    if abs(value) <= error:
        return 1
    return min(max(math.floor(math.log10(abs(value) / error)), 1), most)
