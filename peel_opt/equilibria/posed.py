"""A question as it is solved: two closures under a law, and the number they answer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ..base.checks import finite, positive
from ..base.errors import InvalidInput
from ..model.bond import COHESIVE, LINEAR, CohesiveLaw
from ..model.equations import Scalars
from ..model.groups import PI4
from ..model.rod import Rod
from ..residual.closures import Closure

#: The answered number as a function of the scalars.
ANSWERS: dict[str, Callable[[Scalars], float]] = {
    "pressure_ratio": lambda s: s.pressure_ratio,
    "length_ratio": lambda s: s.sigma,
    "alpha1": lambda s: s.alpha1,
}


@dataclass(frozen=True)
class Posed:
    """A question in dimensionless form.

    Parameters
    ----------
    rod : Rod or None
    law : CohesiveLaw or None
        None for "auto": law (8), named "linear" where the whole shape stays within y0.
    asked : {"pressure_ratio", "length_ratio", "alpha1"}
    given : tuple of Closure
        What closes (12) with (14).
    """

    rod: Rod | None
    law: CohesiveLaw | None
    asked: str
    given: tuple[Closure, Closure]

    @classmethod
    def at_length(cls, rod: Rod, law: CohesiveLaw | None, sigma: float) -> Posed:
        """Return the pressure of a rod at sbar/eta = ``sigma``."""
        return cls(rod, law, "pressure_ratio", (Closure("ratio", rod.ratio), Closure("length", sigma)))

    @classmethod
    def at_pressure(cls, rod: Rod, law: CohesiveLaw | None, P: float) -> Posed:
        """Return the length of a rod at p/T0 = ``P``."""
        return cls(rod, law, "length_ratio", (Closure("ratio", rod.ratio), Closure("pressure", P)))

    @classmethod
    def at_groups(cls, law: CohesiveLaw | None, beta0: float, lam: float) -> Posed:
        """Return the paper's dual problem, alpha1 at (beta0, lambda)."""
        return cls(None, law, "alpha1", (Closure("length", math.cbrt(beta0)), Closure("lam", lam)))

    @property
    def effective_law(self) -> CohesiveLaw:
        """The law that is solved with."""
        return COHESIVE if self.law is None else self.law

    @property
    def ratio(self) -> float:
        """eta/y0; infinite at beta0 = 0."""
        first, second = self.given
        if first.kind == "ratio":
            return first.value
        return (PI4 + second.value) / first.value**4 if first.value > 0.0 else math.inf

    @property
    def given_name(self) -> str:
        """What the caller calls the given number."""
        return {"pressure_ratio": "length", "length_ratio": "pressure", "alpha1": "lambda"}[self.asked]

    def read(self, scalars: Scalars) -> float:
        """Return the answered number of a solution; of complex scalars if they are."""
        return ANSWERS[self.asked](scalars)


def known_law(law: str | CohesiveLaw) -> CohesiveLaw | None:
    """Return the law a caller named or made; None for "auto"."""
    named: dict[object, CohesiveLaw | None] = {"auto": None, "linear": LINEAR, "cohesive": COHESIVE}
    if isinstance(law, CohesiveLaw):
        return law
    if not isinstance(law, str) or law not in named:
        raise InvalidInput(
            f"unknown law {law!r}.",
            remedy=f"Choose one of {', '.join(map(str, named))} or pass a CohesiveLaw.",
        )
    return named[law]


def known_lambda(lam: float | None, beta1: float | None) -> float:
    """Return lambda > -pi^4 from whichever of the two a caller gave."""
    if (lam is None) == (beta1 is None):
        raise InvalidInput("give either lam or beta1, and not both.")
    shift = finite("lam", lam) if lam is not None else positive("beta1", beta1) - PI4
    if shift <= -PI4:
        raise InvalidInput(f"beta1 = pi^4 + lam must be positive, got lam = {shift:g}.")
    return shift
