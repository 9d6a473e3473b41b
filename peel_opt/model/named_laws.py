"""Cohesive laws beyond the paper's two, ready to use."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from ..base.checks import positive
from ..base.errors import InvalidInput
from .bond import COHESIVE, LINEAR, Affine, CohesiveLaw, named


@dataclass(frozen=True)
class _Exponential:
    """exp(-u), or its drop 1 - exp(-u)."""

    dropped: bool
    plain: ClassVar[bool] = True

    def __call__(self, u: Any) -> Any:
        import casadi as ca

        return -ca.expm1(-u) if self.dropped else ca.exp(-u)


def exponential() -> CohesiveLaw:
    """tau = exp(-u): no kink, the same initial slope as law (8), work 1 - exp(-u).

    Returns
    -------
    CohesiveLaw

    Examples
    --------
    >>> round(exponential().tip_height(0.5), 4)  # p y_tip = T0 y0 (1 - exp(-y_tip/y0))
    1.5936
    """
    law = CohesiveLaw(_Exponential(False), drop=_Exponential(True), work=_exponential_work)
    return named(law, "exponential")


def _exponential_work(u: float) -> float:
    return -math.expm1(-u)


def trapezoidal(plateau: float) -> CohesiveLaw:
    """tau = 1 up to u = ``plateau`` < 1, then a straight line to 0 at u = 1.

    With no slope at u = 0 there is no transition T: the critical length is infinite.

    Parameters
    ----------
    plateau : float
        Where the plateau ends, over y0; between 0 and 1.

    Returns
    -------
    CohesiveLaw

    Raises
    ------
    InvalidInput
        If the plateau is not between 0 and 1.
    """
    plateau = positive("plateau", plateau)
    if not plateau < 1.0:
        raise InvalidInput(f"plateau must lie between 0 and 1, got {plateau:g}.")
    slope = 1.0 / (1.0 - plateau)
    law = CohesiveLaw(
        (Affine(1.0, 0.0), Affine(slope, -slope), Affine(0.0, 0.0)),
        (plateau, 1.0),
        drop=(Affine(0.0, 0.0), Affine(-plateau * slope, slope), Affine(1.0, 0.0)),
    )
    return named(law, f"trapezoidal({float(plateau)!r})")


def law_named(name: str) -> CohesiveLaw | None:
    """Return the law of the package with this name; None if there is none.

    Examples
    --------
    >>> law_named("trapezoidal(0.25)") == trapezoidal(0.25)
    True
    """
    for law in (LINEAR, COHESIVE):
        if name == law.name:
            return law
    if name == "exponential":
        return exponential()
    head, _, rest = name.partition("(")
    if head != "trapezoidal" or not rest.endswith(")"):
        return None
    try:
        return trapezoidal(float(rest[:-1]))
    except ValueError:  # no number, or none between 0 and 1
        return None
