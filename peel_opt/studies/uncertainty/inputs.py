"""How uncertain a given number is: standard deviations, ranges and distributions, with units.

::

    0.1e-6                       standard deviation of a normal distribution, in SI units
    (2.0e-5, 2.6e-5)             evenly between two values
    "10 %", "+- 2 uN m"          standard deviation, relative or with its unit
    "10 % lognormal"             the same mean and standard deviation, never negative
    "10 % uniform"               evenly within 10 per cent on both sides
    "20 uN m .. 26 uN m"         evenly between two values
    scipy.stats.gamma(4, ...)    any frozen distribution of SciPy, of its older and newer kind
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from ...base.checks import finite, parse, positive
from ...base.errors import InvalidInput
from ...base.units import ANGLE, LENGTH, NUMBER, PRESSURE, STIFFNESS, WORK, Kind, in_si
from ...base.units import KINDS as BY_UNIT
from ...model.dimension import Dimension
from ...model.rod import SI, Rod, Units
from ..sweep.plan import si_of
from ..sweep.ranges import parse_together

#: What each input measures.
KINDS = {
    "bending_stiffness": STIFFNESS,
    "adhesion_strength": PRESSURE,
    "adhesion_range": LENGTH,
    "youngs_modulus": PRESSURE,
    "thickness": LENGTH,
    "poisson_ratio": NUMBER,
    "work_of_separation": WORK,
    "pressure": PRESSURE,
    "length": LENGTH,
    "flaw": LENGTH,
}

SHAPES = ("normal", "lognormal", "uniform")

#: A distribution wider than so many times its nominal value is a mistake, and soon overflows.
WIDEST = 1e6

#: A nominal value with less than this share of its distribution on one side is a mistake.
OUTSIDE = 1e-9

_SIGN = re.compile(r"±|\+/?-")
_RELATIVE = re.compile(rf"%\s*({'|'.join(SHAPES)})?\s*$")
_SHAPED = re.compile(rf"(.*?)(?:\s+({'|'.join(SHAPES)}))?", re.DOTALL)


@dataclass(frozen=True, eq=False)
class Spread:
    """The distribution of one input.

    Parameters
    ----------
    name : str
    nominal : float
        Where the linear estimate is taken [SI].
    distribution : frozen distribution of scipy.stats
        Of the number in SI units.
    words : str
        What kind of distribution it is.
    unit : str
        Of all of them: SI, or that of a rod known by its ratio alone.
    """

    name: str
    nominal: float
    distribution: Any
    words: str
    unit: str

    @property
    def mean(self) -> float:
        """Mean [SI]."""
        return float(self.distribution.mean())

    @property
    def sd(self) -> float:
        """Standard deviation [SI]."""
        return float(self.distribution.std())

    def quantiles(self, shares: np.ndarray) -> np.ndarray:
        """Return the values below which the given shares lie."""
        return np.asarray(self.distribution.ppf(shares), dtype=float)


@dataclass(frozen=True)
class InputUnit:
    """What an input measures.

    Parameters
    ----------
    unit : str
        In which it is given, SI or that of a rod known by its ratio alone.
    si : str
        Its SI unit; empty where it has none or the rod has no units.
    kind : Kind
        Of a text.
    signed : bool
        Whether it may be zero or negative.
    """

    unit: str
    si: str
    kind: Kind
    signed: bool = False

    @classmethod
    def of(cls, name: str, units: Units) -> InputUnit:
        """Return what one of `KINDS` measures, in the units of a rod."""
        kind = KINDS[name] if units == SI else NUMBER
        return cls(units.of_number(name), si_of(name, units), kind, signed=name == "poisson_ratio")

    @classmethod
    def in_scene(cls, dimension: Dimension, rod: Rod) -> InputUnit:
        """Return what a number of a scene measures."""
        plain = rod.dimensionless and dimension.unit != ANGLE.si
        kind = NUMBER if plain else BY_UNIT[dimension.unit]
        return cls(dimension.unit_of(rod), "" if rod.dimensionless else dimension.unit, kind, signed=True)


def spread_of(name: str, given: Any, nominal: float, measure: InputUnit | None = None) -> Spread:
    """Return the distribution that a caller described in one of the forms above.

    Parameters
    ----------
    name : str
        One of `KINDS`, or a number of a scene.
    given : float, pair of float, str or frozen distribution
    nominal : float
        The value itself [SI].
    measure : InputUnit, optional
        By default that of one of `KINDS` in SI units.

    Raises
    ------
    InvalidInput
        If it has none of these forms, or the nominal value cannot come of it.
    """
    measure = measure or InputUnit.of(name, SI)
    unit, plain = measure.unit, finite if measure.signed else positive
    if not isinstance(given, str):
        given = in_si(name, given, measure.si)
    if isinstance(given, str):
        distribution, words = _from_text(name, given, nominal, measure)
    elif hasattr(given, "ppf") and hasattr(given, "std"):
        distribution, words = given, _family(name, given)
    elif hasattr(given, "icdf") and hasattr(given, "standard_deviation"):
        distribution = _Newer(given)
        words = _family(name, distribution)
    elif isinstance(given, tuple | list | np.ndarray):
        if np.ndim(given) != 1 or len(given) != 2:
            raise InvalidInput(f"the range of {name} must be two numbers, from and to, got {given!r}.")
        low, high = (plain(name, _plain(value)) for value in given)
        distribution, words = _between(name, low, high)
    else:
        amount = positive(f"the standard deviation of {name}", _plain(given))
        distribution, words = _about(name, nominal, amount, "normal")
    spread = Spread(name, nominal, distribution, words, unit)
    low, high = spread.quantiles(np.array([OUTSIDE, 1.0 - OUTSIDE]))
    if not high - low <= WIDEST * abs(nominal) and not (measure.signed and nominal == 0.0):
        raise InvalidInput(
            f"the spread of {name}, from {low:g} to {high:g} {unit}, is beyond all measure of its nominal"
            f" {nominal:g}.",
            remedy="Numbers are in SI units.",
        )
    slack = 1e-9 * max(abs(nominal), high - low)  # the end of a range is a value of it
    if not low - slack <= nominal <= high + slack:
        raise InvalidInput(
            f"the nominal {name}, {nominal:g} {unit}, cannot come of its distribution, which lies between"
            f" {low:g} and {high:g}.",
            remedy="Numbers are in SI units.",
        )
    return spread


class _Newer:
    """A distribution of SciPy's newer kind, `scipy.stats.Normal` and those like it, with the older names."""

    def __init__(self, given: Any) -> None:
        self._given = given
        self.dist = type("Named", (), {"name": type(given).__name__.lower()})

    def ppf(self, shares: np.ndarray) -> np.ndarray:
        """Return the values below which the given shares lie."""
        return np.asarray(self._given.icdf(shares), dtype=float)

    def mean(self) -> float:
        """Mean."""
        return float(self._given.mean())

    def std(self) -> float:
        """Standard deviation."""
        return float(self._given.standard_deviation())


def _family(name: str, given: Any) -> str:
    """Return the name of a distribution of SciPy that describes one number."""
    try:
        mean, sd = float(given.mean()), float(given.std())
    except (OverflowError, TypeError, ValueError) as error:
        raise InvalidInput(f"the distribution of {name} is not that of a single number: {error}.") from error
    if not (math.isfinite(sd) and sd > 0.0 and math.isfinite(mean)):
        raise InvalidInput(f"the distribution of {name} has no finite mean and standard deviation above 0.")
    return str(getattr(getattr(given, "dist", None), "name", type(given).__name__))


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def split(text: str) -> tuple[str, str]:
    """Cut "23 uN m +- 10 %" into value and spread; either may be empty.

    A range "20 uN m .. 26 uN m" is a spread, whose value is its middle, and so is "10 %".

    Examples
    --------
    >>> split("23 uN m ± 10 %"), split("5 % lognormal")
    (('23 uN m', '10 %'), ('', '5 % lognormal'))
    """
    value, sign, spread = _SIGN.sub("+-", text).partition("+-")
    if not sign and (".." in value or _RELATIVE.search(value)):
        return "", value.strip()
    return value.strip(), spread.strip()


def middle(name: str, text: str, kind: Kind, *, signed: bool = False) -> float:
    """Return the middle of a range "20 uN m .. 26 uN m"."""
    return 0.5 * sum(_ends(name, text, kind, signed))


def _ends(name: str, text: str, kind: Kind, signed: bool = False) -> list[float]:
    """Return both ends of a range "20 uN m .. 26 uN m" or "20 .. 26 uN m"."""
    return parse_together(name, text.split("..", maxsplit=1), kind, signed=signed)


def _from_text(name: str, text: str, nominal: float, measure: InputUnit) -> tuple[Any, str]:
    value, spread = split(text)
    if value and spread:
        raise InvalidInput(
            f"the spread of {name} stands beside a value, {text!r}.", remedy=f"Its value is {nominal:g}."
        )
    match = _SHAPED.fullmatch(value or spread)
    assert match is not None
    amount, shape = match.group(1).strip(), match.group(2) or "normal"
    if ".." in amount:
        if match.group(2) in ("normal", "lognormal"):
            raise InvalidInput(f"a range of {name} is even, not {shape}.", remedy=f"Leave out {shape!r}.")
        return _between(name, *_ends(name, amount, measure.kind, measure.signed))
    label = f"the spread of {name}"
    if amount.endswith("%"):
        if nominal == 0.0:
            raise InvalidInput(f"{label} is a share of nothing: it is zero.", remedy="Give it with its unit.")
        share = 0.01 * parse(label, amount[:-1].strip(), NUMBER)
        return _about(name, nominal, share * abs(nominal), shape)
    return _about(name, nominal, parse(label, amount, measure.kind), shape)


def _about(name: str, nominal: float, amount: float, shape: str) -> tuple[Any, str]:
    if shape == "normal":
        return stats.norm(nominal, amount), shape
    if shape == "uniform":
        return stats.uniform(nominal - amount, 2.0 * amount), shape
    if nominal <= 0.0:
        raise InvalidInput(f"{name} is not positive, and cannot be lognormal.", remedy="Leave out the word.")
    width = math.sqrt(math.log1p((amount / nominal) ** 2))
    return stats.lognorm(width, scale=nominal * math.exp(-0.5 * width**2)), shape


def _between(name: str, low: float, high: float) -> tuple[Any, str]:
    if not low < high:
        raise InvalidInput(f"the range of {name} must rise, got {low:g} to {high:g}.")
    return stats.uniform(low, high - low), "uniform"
