"""How uncertain a given number is: standard deviations, ranges and distributions, with units.

::

    0.1e-6                       standard deviation of a normal distribution, in SI units
    (2.0e-5, 2.6e-5)             evenly between two values
    "10 %", "2 uN m"             standard deviation, relative or with its unit
    "10 % lognormal"             the same mean and standard deviation, never negative
    "10 % uniform"               evenly within 10 per cent on both sides
    "20 uN m .. 26 uN m"         evenly between two values
    scipy.stats.gamma(4, ...)    any frozen distribution of SciPy
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from .checks import positive
from .errors import InvalidInput
from .quantities import LENGTH, NUMBER, PRESSURE, STIFFNESS, Kind, parse

#: What each input measures.
KINDS = {
    "bending_stiffness": STIFFNESS,
    "adhesion_strength": PRESSURE,
    "adhesion_range": LENGTH,
    "pressure": PRESSURE,
    "length": LENGTH,
}

SHAPES = ("normal", "lognormal", "uniform")

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
    """

    name: str
    nominal: float
    distribution: Any
    words: str

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


def spread_of(name: str, given: Any, nominal: float, *, plain: bool = False) -> Spread:
    """Return the distribution that a caller described in one of the forms above.

    Parameters
    ----------
    name : str
        One of `KINDS`.
    given : float, pair of float, str or frozen distribution
    nominal : float
        The value itself [SI].
    plain : bool
        Whether texts have no units, as for a rod known by its ratio alone.

    Raises
    ------
    InvalidInput
        If it has none of these forms.
    """
    if isinstance(given, str):
        return _from_text(name, given, nominal, NUMBER if plain else KINDS[name])
    if hasattr(given, "ppf") and hasattr(given, "std"):
        sd = float(given.std())
        if not (math.isfinite(sd) and sd > 0.0 and math.isfinite(float(given.mean()))):
            raise InvalidInput(
                f"the distribution of {name} has no finite mean and standard deviation above 0."
            )
        family = getattr(getattr(given, "dist", None), "name", type(given).__name__)
        return Spread(name, nominal, given, str(family))
    if isinstance(given, tuple | list | np.ndarray):
        if len(given) != 2:
            raise InvalidInput(f"the range of {name} must be two numbers, from and to, got {given!r}.")
        low, high = (positive(name, _plain(value)) for value in given)
        return _between(name, low, high, nominal)
    return _about(name, nominal, positive(f"the standard deviation of {name}", _plain(given)), "normal")


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def split(text: str) -> tuple[str, str]:
    """Cut "23 uN m +- 10 %" into value and spread; either may be empty.

    A range "20 uN m .. 26 uN m" is a spread, whose value is its middle.
    """
    value, sign, spread = text.replace("±", "+-").partition("+-")
    if not sign and ".." in value:
        return "", value.strip()
    return value.strip(), spread.strip()


def middle(name: str, text: str, kind: Kind) -> float:
    """Return the middle of a range "20 uN m .. 26 uN m"."""
    low, _, high = text.partition("..")
    return 0.5 * (parse(name, low.strip(), kind) + parse(name, high.strip(), kind))


def _from_text(name: str, text: str, nominal: float, kind: Kind) -> Spread:
    match = _SHAPED.fullmatch(text.strip())
    assert match is not None
    amount, shape = match.group(1).strip(), match.group(2) or "normal"
    if ".." in amount:
        first, _, last = amount.partition("..")
        return _between(name, parse(name, first.strip(), kind), parse(name, last.strip(), kind), nominal)
    label = f"the spread of {name}"
    if amount.endswith("%"):
        return _about(name, nominal, 0.01 * nominal * parse(label, amount[:-1].strip(), NUMBER), shape)
    return _about(name, nominal, parse(label, amount, kind), shape)


def _about(name: str, nominal: float, amount: float, shape: str) -> Spread:
    if shape == "normal":
        return Spread(name, nominal, stats.norm(nominal, amount), shape)
    if shape == "uniform":
        return Spread(name, nominal, stats.uniform(nominal - amount, 2.0 * amount), shape)
    width = math.sqrt(math.log1p((amount / nominal) ** 2))
    return Spread(name, nominal, stats.lognorm(width, scale=nominal * math.exp(-0.5 * width**2)), shape)


def _between(name: str, low: float, high: float, nominal: float) -> Spread:
    if not low < high:
        raise InvalidInput(f"the range of {name} must rise, got {low:g} to {high:g}.")
    return Spread(name, nominal, stats.uniform(low, high - low), "uniform")
