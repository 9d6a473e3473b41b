"""Material numbers of a design, known or free, as logarithms that are affine in the free ones.

k = E h^3 / (12 (1 - nu^2)) and G = T0 y0 / 2 are products of powers, so that

    (log k, log T0, log y0) = offset + matrix z,    z = log of the free numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.checks import finite, parse
from ...base.errors import InvalidInput
from ...base.units import LENGTH, PRESSURE, STIFFNESS, WORK, Kind, display
from ...model.rod import MATERIAL, RATIOS, Rod, refuse_scene

#: The numbers that may be known or free, and what they measure.
NUMBERS: dict[str, Kind] = {
    "bending_stiffness": STIFFNESS,
    "youngs_modulus": PRESSURE,
    "thickness": LENGTH,
    "adhesion_strength": PRESSURE,
    "adhesion_range": LENGTH,
    "work_of_separation": WORK,
}

#: How far a bound that is not given lies from the start, or from the other bound.
FAR = 1e6

#: What may be free: one name, some, or each with its bounds.
Free = str | Sequence[str] | Mapping[str, tuple[object, object] | None]


@dataclass(frozen=True, eq=False)
class Material:
    """A rod as a function of its free numbers.

    Parameters
    ----------
    free : tuple of str
    lower, upper : ndarray, shape (m,)
        Bounds of the logarithms.
    start : ndarray or None
        Logarithms of the values that came with the free numbers, if all did.
    offset, matrix : ndarray, shapes (3,) and (3, m)
        Of log k, log T0 and log y0.
    """

    free: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    start: np.ndarray | None
    offset: np.ndarray
    matrix: np.ndarray

    def rod(self, z: np.ndarray) -> Rod:
        """Return the rod at some logarithms of the free numbers."""
        return Rod(*(math.exp(v) for v in self.offset + self.matrix @ z))

    def values(self, z: np.ndarray) -> dict[str, float]:
        """Return the free numbers [SI]."""
        return {name: math.exp(v) for name, v in zip(self.free, z, strict=True)}

    @property
    def log_ratio(self) -> tuple[float, np.ndarray]:
        """Constant and slopes of log(eta/y0)."""
        weights = np.array([1.0, -1.0, -3.0]) / 3.0
        return float(weights @ self.offset), weights @ self.matrix

    def in_range(self, z: np.ndarray) -> bool:
        """Whether eta/y0 is where the branch can be walked."""
        constant, slopes = self.log_ratio
        low, high = RATIOS
        return math.log(low) <= constant + slopes @ z <= math.log(high)

    def shown(self, name: str, value: float) -> str:
        """Write a free number with its unit."""
        return display(value, NUMBERS[name].si, 5)


def material(known: Rod | Mapping[str, object], free: Free) -> Material:
    """Read what is known and what is free.

    Raises
    ------
    InvalidInput
        If a name is unknown, a number is missing or given twice, or bounds are not bounds.
    """
    bounds = _bounds(free)
    values, poisson = _known(known)
    for name in bounds:
        if name not in NUMBERS:
            raise InvalidInput(f"{name!r} cannot be free.", remedy=f"Choose among {', '.join(NUMBERS)}.")
    starts = {name: values.pop(name) for name in bounds if name in values}
    names = tuple(bounds)
    if isinstance(known, Rod):
        _replace_derived(values, starts, names)
    limits = np.array([_limits(name, bounds[name], starts.get(name)) for name in names])
    logs = {name: _constant(value, len(names)) for name, value in values.items()}
    logs |= {name: np.eye(len(names) + 1)[1 + i] for i, name in enumerate(names)}
    rows = np.array([_stiffness(logs, poisson), *_bond(logs)])
    start = None
    if len(starts) == len(names):
        start = np.clip([math.log(starts[name]) for name in names], limits[:, 0], limits[:, 1])
    return Material(names, limits[:, 0], limits[:, 1], start, rows[:, 0], rows[:, 1:])


def _bounds(free: Free) -> dict[str, tuple[object, object] | None]:
    if isinstance(free, str):
        free = (free,)
    if not isinstance(free, Iterable) or not getattr(free, "shape", (1,)):
        raise InvalidInput(f"free must be names of material numbers, got {free!r}.")
    names = list(free)
    if not all(isinstance(name, str) for name in names):
        raise InvalidInput(f"free must be names of material numbers, got {free!r:.60}.")
    bounds = dict(free) if isinstance(free, Mapping) else dict.fromkeys(names, None)
    if not bounds:
        raise InvalidInput("a design needs a free number.", remedy=f"Choose among {', '.join(NUMBERS)}.")
    return bounds


def _known(known: Rod | Mapping[str, object]) -> tuple[dict[str, float], float | None]:
    refuse_scene(known)
    if isinstance(known, Rod):
        return {name: float(getattr(known, name)) for name in MATERIAL}, None
    if not isinstance(known, Mapping):
        raise InvalidInput(f"what is known must be a Rod or a mapping of material numbers, got {known!r}.")
    unknown = set(known) - set(NUMBERS) - {"poisson_ratio"}
    if unknown:
        raise InvalidInput(
            f"unknown material number {min(unknown)!r}.",
            remedy=f"Known are {', '.join(NUMBERS)} and poisson_ratio.",
        )
    values = {name: parse(name, value, NUMBERS[name]) for name, value in known.items() if name in NUMBERS}
    if "poisson_ratio" not in known:
        return values, None
    poisson = finite("poisson_ratio", known["poisson_ratio"])
    if not -1.0 < poisson <= 0.5:
        raise InvalidInput(f"poisson_ratio must lie above -1 and up to 0.5, got {poisson:g}.")
    return values, poisson


def _replace_derived(values: dict[str, float], starts: dict[str, float], free: tuple[str, ...]) -> None:
    """Let a free work of separation take the place of the rod's own range."""
    if "work_of_separation" in free and "adhesion_range" in values and "adhesion_strength" in values:
        starts["work_of_separation"] = 0.5 * values["adhesion_strength"] * values.pop("adhesion_range")


def _limits(name: str, bounds: tuple[object, object] | None, start: float | None) -> tuple[float, float]:
    """Logarithms of the bounds of a free number."""
    try:
        low, high = (None, None) if bounds is None else bounds
    except (OverflowError, TypeError, ValueError) as error:
        raise InvalidInput(f"bounds of {name} must be two, got {bounds!r}.") from error
    least = None if low is None else parse(f"lower bound of {name}", low, NUMBERS[name])
    most = None if high is None else parse(f"upper bound of {name}", high, NUMBERS[name])
    if least is None and most is None and start is None:
        raise InvalidInput(
            f"{name} is free without bounds and without a value to start from.",
            remedy=f"Give free={{{name!r}: (lower, upper)}}.",
        )
    if least is None:
        least = min(v for v in (start, most) if v is not None) / FAR
    if most is None:
        most = max(v for v in (start, least if low is not None else None) if v is not None) * FAR
    if not least < most:
        raise InvalidInput(f"the lower bound of {name}, {least:g}, must be below the upper, {most:g}.")
    return math.log(least), math.log(most)


def _constant(value: float, count: int) -> np.ndarray:
    return np.concatenate([[math.log(value)], np.zeros(count)])


def _stiffness(logs: dict[str, np.ndarray], poisson: float | None) -> np.ndarray:
    """Return log k as (constant, slopes)."""
    strip = {"youngs_modulus", "thickness"}
    given = set(logs) & {"bending_stiffness", *strip}
    if given == {"bending_stiffness"} and poisson is None:
        return logs["bending_stiffness"]
    if given != strip or poisson is None:
        raise InvalidInput(
            "a design needs bending_stiffness, or youngs_modulus, thickness and poisson_ratio, known or free;"
            f" got {', '.join(sorted(given)) or 'none'}{' and poisson_ratio' if poisson is not None else ''}."
        )
    plate = _constant(12.0 * (1.0 - poisson**2), len(logs["thickness"]) - 1)
    return logs["youngs_modulus"] + 3.0 * logs["thickness"] - plate


def _bond(logs: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return log T0 and log y0 as (constant, slopes)."""
    given = set(logs) & {"adhesion_strength", "adhesion_range", "work_of_separation"}
    if len(given) != 2:
        raise InvalidInput(
            "a design needs two of adhesion_strength, adhesion_range and work_of_separation, known or free;"
            f" got {', '.join(sorted(given)) or 'none'}."
        )
    twice = None
    if "work_of_separation" in given:
        work = logs["work_of_separation"]
        twice = work + _constant(2.0, len(work) - 1)
    T0 = logs.get("adhesion_strength")
    y0 = logs.get("adhesion_range")
    if T0 is None:
        assert twice is not None
        assert y0 is not None
        T0 = twice - y0
    if y0 is None:
        assert twice is not None
        y0 = twice - T0
    return T0, y0
