"""Questions as equations on the scalars: what is given closes the residual of (12).

(12) with (14) leaves two of its scalars open.  "Pressure at given length" fixes the rod's
ratio and sbar, "length at given pressure" the ratio and p, the paper's dual problem beta0
and lambda; with the length open, theta'(1) = 0 in (14) is the Weierstrass-Erdmann
condition (49).

The length along a branch is measured in the scalars only,

    d(length)^2 = |d(A, alpha1/(1+beta0), asinh(lambda/pi^4), asinh(sigma))|^2,

so that it depends neither on the mesh nor on the method nor on the phases.  A plane across a branch, in
these coordinates, closes it as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from ..base.errors import InvalidInput
from ..model.equations import Scalars, symbolic
from ..model.groups import PI4
from .compiled import Compiled


def coordinates(s: Scalars) -> Any:
    """Coordinates in which the length of a branch is Euclidean, as a CasADi expression."""
    return ca.vertcat(s.A, s.alpha1 / (1.0 + s.beta0), ca.asinh(s.lam / PI4), ca.asinh(s.sigma))


def _chart_function() -> ca.Function:
    s, scalars = symbolic()
    values = coordinates(scalars)
    return ca.Function("chart", [s], [values, ca.densify(ca.jacobian(values, s))])


_CHART = Compiled(_chart_function())


def chart(scalars: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates in which the length of a branch is measured, and their gradient."""
    value, gradient = _CHART(scalars)
    return value, gradient


def charts(scalars: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`chart` of many scalars, one in each row: shapes (n, 4) and (n, 4, scalars)."""
    values, gradients = _CHART.many(scalars)
    return values, gradients


#: Each closure as an expression that vanishes, of the scalars and the given numbers.
EQUATIONS: dict[str, Callable[..., Any]] = {
    "ratio": lambda s, r: s.lam + PI4 - r * s.sigma**4,  # r = eta/y0
    "length": lambda s, sigma: s.sigma - sigma,  # sbar/eta
    "pressure": lambda s, P: s.less_pressure(P),  # p/T0
    "lam": lambda s, lam: s.lam - lam,
    "alpha1": lambda s, alpha1: s.alpha1 - alpha1,
    "amplitude": lambda s, A: s.A - A,  # minus the tip angle
    "plane": lambda s, offset, *normal: ca.dot(ca.vertcat(*normal), coordinates(s)) - offset,
}

#: Size of their terms, where these are products and powers of the scalars.
TERMS: dict[str, Callable[[Scalars, Any], Any]] = {
    "ratio": lambda s, r: abs(s.lam) + PI4 + r * s.sigma**4,
    "pressure": lambda s, P: s.pressure_terms(P),
    "alpha1": lambda s, alpha1: abs(s.alpha1) + abs(alpha1),
}

#: The number that the equation of a closure gives, where it is of interest by itself.
READINGS: dict[str, Callable[[Scalars], Any]] = {
    "ratio": lambda s: s.ratio,
    "length": lambda s: s.sigma,
    "pressure": lambda s: s.pressure_ratio,
    "lam": lambda s: s.lam,
    "alpha1": lambda s: s.alpha1,
}

#: What each closure gives, as its equation writes it.
SYMBOLS = {
    "ratio": "eta/y0",
    "length": "sbar/eta",
    "pressure": "p/T0",
    "lam": "lambda",
    "alpha1": "alpha1",
    "amplitude": "minus the tip angle",
}

#: Closures that give one of the scalars itself.
OF_A_SCALAR = {"amplitude": "A", "length": "sigma", "lam": "lam"}

#: How many numbers a closure takes, where it is not one.
TAKES = {"plane": 5}


@dataclass(frozen=True)
class Closure:
    """One given number: a key of `EQUATIONS` and its value."""

    kind: str
    value: float

    @property
    def parameters(self) -> tuple[float, ...]:
        """The given numbers of the equation."""
        return (self.value,)

    def __str__(self) -> str:
        return f"{SYMBOLS[self.kind]} = {self.value:.9g}"


@dataclass(frozen=True)
class Plane:
    """A plane across a branch, in the coordinates of the arclength."""

    offset: float
    normal: tuple[float, ...]

    kind: ClassVar[str] = "plane"

    @classmethod
    def across(cls, place: np.ndarray, direction: np.ndarray, distance: float = 0.0) -> Self:
        """Return the plane normal to the unit vector ``direction``, at a distance from a place."""
        return cls(float(direction @ place) + distance, tuple(direction.tolist()))

    @classmethod
    def facing(cls, direction: np.ndarray) -> Self:
        """Return the plane through the origin with this normal: what goes on along it moves off."""
        return cls(0.0, tuple(direction.tolist()))

    @property
    def parameters(self) -> tuple[float, ...]:
        """The given numbers of the equation."""
        return (self.offset, *self.normal)


#: What may close the residual.
Closing = Closure | Plane


def parameters(closing: Sequence[Closing]) -> np.ndarray:
    """The given numbers of some closures, one after the other."""
    return np.array([number for closure in closing for number in closure.parameters])


def symbols(kinds: Sequence[str]) -> ca.SX:
    """Return symbols for the given numbers of some closures."""
    return ca.SX.sym("given", sum(TAKES.get(kind, 1) for kind in kinds))


def equations(kinds: Sequence[str], scalars: Scalars, given: Any) -> Any:
    """Return the closures of these kinds as a column of expressions that vanish."""
    numbers = iter(ca.vertsplit(given))
    return ca.vertcat(
        *(EQUATIONS[kind](scalars, *(next(numbers) for _ in range(TAKES.get(kind, 1)))) for kind in kinds)
    )


@lru_cache(maxsize=64)
def _compiled(kinds: tuple[str, ...], form: type[Scalars] = Scalars) -> Compiled:
    (s, scalars), given = symbolic(form), symbols(kinds)
    values = equations(kinds, scalars, given)
    gradients = (ca.densify(ca.jacobian(values, v)) for v in (s, given))
    return Compiled(ca.Function("closures", [s, given], [values, *gradients]))


def miss(closing: Closing, scalars: np.ndarray) -> float:
    """By how much some scalars miss a closure; of either sign."""
    return float(_compiled((closing.kind,))(scalars, parameters((closing,)))[0][0])


def misses(closure: Closure, scalars: np.ndarray) -> np.ndarray:
    """By how much many scalars, one in each row, miss a closure."""
    return np.asarray(EQUATIONS[closure.kind](Scalars(*scalars.T), closure.value), dtype=float)


def derivatives(
    closing: Sequence[Closing], scalars: np.ndarray, form: type[Scalars] = Scalars
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the closures by what stands for the scalars and by the given numbers, a row for each."""
    compiled = _compiled(tuple(c.kind for c in closing), form)  # type: ignore[arg-type]  # a class is hashable
    _, *gradients = compiled(scalars, parameters(closing))
    by_scalars, by_given = (gradient.reshape(len(closing), -1, order="F") for gradient in gradients)
    return by_scalars, by_given


#: Closures by the public name of what they hold fixed, and back.
HOLDS = {
    "ratio": "ratio",
    "beta0": "length",
    "pressure_ratio": "pressure",
    "lam": "lam",
    "alpha1": "alpha1",
    "tip_angle": "amplitude",
}


def closure_for(hold: str, value: float) -> Closure:
    """Return the closure that holds a quantity, by its public name, at a value."""
    if hold not in HOLDS:
        raise InvalidInput(f"cannot hold {hold!r} fixed.", remedy=f"Choose one of {', '.join(HOLDS)}.")
    if hold == "beta0":
        return Closure("length", math.cbrt(value))
    return Closure(HOLDS[hold], -value if hold == "tip_angle" else value)


def held_value(closure: Closure, hold: str) -> float:
    """Return the value of the held quantity, by its public name."""
    if hold == "beta0":
        return _shortest_cube(closure.value)
    return -closure.value if hold == "tip_angle" else closure.value


def _shortest_cube(root: float) -> float:
    """Return the shortest number with this cube root: 4, not 4.000000000000001."""
    rounded = (float(f"{root**3:.{digits}g}") for digits in range(1, 17))
    return next((value for value in rounded if math.cbrt(value) == root), root**3)
