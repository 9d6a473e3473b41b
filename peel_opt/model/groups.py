"""The groups (10), (11) of the paper, and what they are for a rod: one algebra for numbers and arrays."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

#: beta1 at the transition T, equation (18) with n = 1.
PI4 = math.pi**4

#: A number, an array or a CasADi expression.
N = TypeVar("N")


class Groups(Generic[N]):
    """What follows from beta0, lambda and alpha1, which a subclass has."""

    if TYPE_CHECKING:

        @property
        def beta0(self) -> N:
            """(sbar/eta)^3, equation (11)."""

        @property
        def lam(self) -> N:
            """beta1 - pi^4."""

        @property
        def alpha1(self) -> N:
            """Extra pressure alpha - beta0."""

    @property
    def beta1(self) -> N:
        """(sbar/eta)^3 sbar/y0 = pi^4 + lambda, equation (11)."""
        known: Any = self.lam
        value: N = known + PI4
        return value

    @property
    def alpha(self) -> N:
        """Scaled pressure sbar^3 p / k, equation (10)."""
        known: Any = self.beta0
        value: N = known + self.alpha1
        return value

    @property
    def pressure_ratio(self) -> N:
        """P = p/T0 = alpha/beta0; nan at beta0 = 0."""
        value: N = 1.0 + over(self.alpha1, self.beta0, math.nan)
        return value

    @property
    def length_ratio(self) -> N:
        """sbar/eta; nan at beta0 = 0 of a single state."""
        beta0: Any = self.beta0
        root: Any = np.cbrt(beta0) if isinstance(beta0, np.ndarray) else math.cbrt(beta0) or math.nan
        value: N = root
        return value

    @property
    def ratio(self) -> N:
        """r = eta/y0 = beta1 / beta0^(4/3); infinite at beta0 = 0."""
        beta0: Any = self.beta0
        value: N = over(self.beta1, beta0 ** (4 / 3), math.inf)
        return value


class AmplitudeGroups(Groups[N]):
    """The same from A, m = alpha1/A, sigma = sbar/eta and lambda."""

    if TYPE_CHECKING:

        @property
        def A(self) -> N:
            """Amplitude, minus the tip angle [rad]."""

        @property
        def m(self) -> N:
            """alpha1 / A."""

        @property
        def sigma(self) -> N:
            """sbar/eta."""

    @property
    def beta0(self) -> N:
        """(sbar/eta)^3, equation (11)."""
        sigma: Any = self.sigma
        value: N = sigma**3
        return value

    @property
    def alpha1(self) -> N:
        """Extra pressure alpha - beta0."""
        m: Any = self.m
        value: N = m * self.A
        return value

    @property
    def length_ratio(self) -> N:
        """sbar/eta."""
        return self.sigma

    @property
    def ratio(self) -> N:
        """r = eta/y0 = beta1 / sigma^4; infinite at beta0 = 0."""
        sigma: Any = self.sigma
        value: N = over(self.beta1, sigma**4, math.inf)
        return value


def over(a: Any, b: Any, otherwise: float) -> Any:
    """Return a/b, and ``otherwise`` where b = 0."""
    if isinstance(b, np.ndarray):
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(b == 0.0, otherwise, a / b)
    return otherwise if isinstance(b, (float, complex)) and b == 0.0 else a / b
