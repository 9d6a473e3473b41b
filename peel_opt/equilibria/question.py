"""A question: what is asked, what is given, of which rod or groups, under which law, and of which state.

What a given number asks for stands in one table, `ASKS`; everything that asks looks there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from ..base.checks import finite, known_beta0, positive
from ..base.errors import InvalidInput
from ..base.units import told_apart
from ..continuation.goal import Goal
from ..model import dimension
from ..model.bond import COHESIVE, LINEAR, CohesiveLaw
from ..model.dimension import NUMBER, TRACTION, Dimension
from ..model.equations import Scalars
from ..model.groups import PI4
from ..model.labels import UNFOLDED, fits, known_state
from ..model.rod import RATIOS, Rod, require_ratio, require_rod
from ..residual.closures import READINGS, Closure
from .result import Equilibrium


@dataclass(frozen=True)
class Measure:
    """A number that is given or asked for.

    Parameters
    ----------
    name : str
        What callers call it: a parameter of calls, and the attribute of an `Equilibrium` that has it in
        the units of the rod.
    attribute : str
        That of an `Equilibrium` which has it without a unit.
    kind : str
        Its closure, a key of `EQUATIONS` and of `READINGS`.
    symbol : str
        What the dimensionless number is written as.
    dimension : Dimension
        What the other one measures.
    to_ratio : callable
        From a rod and the number in its units to the dimensionless one.
    """

    name: str
    attribute: str
    kind: str
    symbol: str = ""
    dimension: Dimension = NUMBER
    to_ratio: Callable[[Rod, float], float] = lambda _, value: value

    def from_ratio(self, rod: Rod, ratio: float) -> float:
        """Return a dimensionless number in the units of a rod."""
        return ratio * self.dimension.size(rod)

    def read(self, scalars: Scalars) -> Any:
        """Return its dimensionless value: a float, or complex or an expression if the scalars are."""
        return READINGS[self.kind](scalars)

    def unit_of(self, rod: Rod) -> str:
        """Return the SI unit, empty where the rod has none."""
        return "" if rod.dimensionless else self.dimension.unit

    def worded(self, rod: Rod, ratio: float) -> str:
        """Name a value, in the rod's units if it has any."""
        if rod.dimensionless:
            return f"{self.symbol} = {ratio:.6g}"
        value, unit = self.from_ratio(rod, ratio), self.dimension.unit
        return f"{self.name} {value:.6g} {unit} ({self.symbol} = {ratio:.6g})"


PRESSURE = Measure("pressure", "pressure_ratio", "pressure", "p/T0", TRACTION, Rod.pressure_ratio)
LENGTH = Measure("length", "length_ratio", "length", "sbar/eta", dimension.LENGTH, Rod.length_ratio)
ALPHA1 = Measure("alpha1", "alpha1", "alpha1")
LAMBDA = Measure("lambda", "lam", "lam")
RATIO = Measure("ratio", "ratio", "ratio")


class Asks(NamedTuple):
    """A kind of question: the number that is given, beside the rod or beta0, and that asked for."""

    given: Measure
    asked: Measure

    @property
    def beside(self) -> str:
        """What callers call that which is given besides."""
        return "beta0" if self.given is LAMBDA else "ratio"

    @property
    def held(self) -> Measure:
        """What is given besides: the rod, or beta0^(1/3)."""
        return LENGTH if self.given is LAMBDA else RATIO


#: What is asked for where a number of this name is given; lam and beta1 beside beta0, others of a rod.
ASKS: dict[str, Asks] = {
    "pressure": Asks(PRESSURE, LENGTH),
    "length": Asks(LENGTH, PRESSURE),
    "lam": Asks(LAMBDA, ALPHA1),
    "beta1": Asks(LAMBDA, ALPHA1),
}


def rod_questions() -> dict[str, Asks]:
    """Return those of `ASKS` that are about a rod."""
    return {name: asks for name, asks in ASKS.items() if asks.held is RATIO}


def about_a_rod(given: str) -> Asks:
    """Return what a number of this name asks for that is given of a rod.

    Raises
    ------
    InvalidInput
        If that is no question.
    """
    asks = ASKS.get(given)
    if asks is None or asks.held is not RATIO:
        known = " or ".join(rod_questions())
        raise InvalidInput(f"{given!r} given of a rod is no question.", remedy=f"Give {known}.")
    return asks


def answering(attribute: str, given: Container[str] = ()) -> Asks:
    """Return the kind of question whose answer is an attribute of an `Equilibrium`.

    Where there are several, that whose given number is among the names ``given``, or the first.
    """
    kinds = [asks for asks in ASKS.values() if asks.asked.attribute == attribute]
    named = (asks for asks in kinds if asks.given.name in given)
    return next(named, kinds[0])


@dataclass(frozen=True)
class Question:
    """A question in dimensionless form, and how its numbers were given.

    Parameters
    ----------
    asks : Asks
    given : tuple of Closure
        What closes (12) with (14): a rod's ratio or beta0^(1/3), and the given number.
    rod : Rod or None
    law : CohesiveLaw or None
        None for "auto": law (8), named "linear" where the whole shape stays within y0.
    state : str or None
        The label of the state that is meant.
    near : float or None
        Value of the answer, dimensionless, to which the state should be nearest.
    exact : dict of float
        The numbers as they were given, by the attributes of an `Equilibrium` that repeat them.
    """

    asks: Asks
    given: tuple[Closure, Closure]
    rod: Rod | None = None
    law: CohesiveLaw | None = None
    state: str | None = None
    near: float | None = None
    exact: dict[str, float] = field(default_factory=dict, compare=False)

    # --- how it is made -----------------------------------------------------------------

    @classmethod
    def at(cls, rod: Rod, law: CohesiveLaw | None, given: str, ratio: float) -> Question:
        """Return the question about a rod at a given number, dimensionless."""
        asks = ASKS[given]
        return cls(asks, (Closure("ratio", rod.ratio), Closure(asks.given.kind, ratio)), rod, law)

    @classmethod
    def at_groups(cls, law: CohesiveLaw | None, beta0: float, lam: float) -> Question:
        """Return the paper's dual problem, alpha1 at (beta0, lambda)."""
        return cls(ASKS["lam"], (Closure("length", math.cbrt(beta0)), Closure("lam", lam)), None, law)

    @classmethod
    def of_rod(
        cls,
        rod: Rod,
        given: str,
        value: float,
        *,
        law: str | CohesiveLaw = "auto",
        state: str | None = None,
        near: float | Equilibrium | None = None,
    ) -> Question:
        """Return the question about a rod of which a number is given, all in the rod's units.

        Raises
        ------
        InvalidInput
            If an argument cannot be meant.
        OutOfRange
            If eta/y0 is far off.
        """
        asks, rod = about_a_rod(given), require_rod(rod, RATIOS)
        ratio = asks.given.to_ratio(rod, value)
        exact = {given: finite(given, value, asks.given.unit_of(rod)), asks.given.attribute: ratio}
        closures = (Closure("ratio", rod.ratio), Closure(asks.given.kind, ratio))
        label = state if state is None else known_state(state)
        sought = _sought(near, asks.asked, lambda wanted: asks.asked.to_ratio(rod, wanted))
        return cls(asks, closures, rod, known_law(law), label, sought, exact)

    @classmethod
    def of_groups(
        cls,
        beta0: float,
        lam: float | None = None,
        beta1: float | None = None,
        *,
        law: str | CohesiveLaw = "linear",
        state: str | None = None,
        near: float | Equilibrium | None = None,
    ) -> Question:
        """Return the question about the paper's groups.

        Raises
        ------
        InvalidInput
            If an argument cannot be meant.
        """
        held, shift = known_beta0(beta0), known_lambda(lam, beta1)
        posed = cls.at_groups(known_law(law), held, shift)
        if held == 0.0 and not posed.effective_law.is_affine:
            raise InvalidInput(
                "beta0 = 0 has no strength, hence no cohesive law.", remedy="Use law='linear'."
            )
        exact = {"beta0": held, "lam": shift}
        if beta1 is not None:
            exact["beta1"] = finite("beta1", beta1)
        label = state if state is None else known_state(state)
        sought = _sought(near, ALPHA1, lambda wanted: finite("near", wanted))
        return replace(posed, state=label, near=sought, exact=exact)

    # --- what it says -------------------------------------------------------------------

    @property
    def effective_law(self) -> CohesiveLaw:
        """The law that is solved with."""
        return COHESIVE if self.law is None else self.law

    @property
    def asked(self) -> str:
        """The attribute of an `Equilibrium` that is asked for."""
        return self.asks.asked.attribute

    def read(self, scalars: Scalars) -> Any:
        """Return the answered number of a solution, as `Measure.read` does."""
        return self.asks.asked.read(scalars)

    @property
    def ratio(self) -> float:
        """eta/y0; infinite at beta0 = 0."""
        first, second = self.given
        if first.kind == "ratio":
            return first.value
        return (PI4 + second.value) / first.value**4 if first.value > 0.0 else math.inf

    @property
    def path(self) -> Closure:
        """What stays fixed along the branch that holds the answers: a rod's ratio, or beta0 = 0."""
        first = self.given[0]
        if first.kind == "ratio":
            require_ratio(first.value)
            return first
        return Closure("ratio", self.ratio) if first.value else first

    @property
    def target(self) -> Closure:
        """What is looked for along that branch."""
        first, second = self.given
        return first if first.kind == "length" and first.value else second

    @property
    def goal(self) -> Goal:
        """How far along that branch the states that are meant may lie."""
        return Goal(self.target, anywhere=self.state == "folded" or self.near is not None)

    @property
    def words(self) -> str:
        """What is given, in a few words."""
        first, second = self.given
        if self.rod is None:
            return f"beta0 = {self.exact.get('beta0', first.value**3):.6g}, lambda = {second.value:.6g}"
        return self.asks.given.worded(self.rod, second.value)

    def in_units(self, value: float) -> float:
        """Return a value of the given number as the caller would give it."""
        return value if self.rod is None else self.asks.given.from_ratio(self.rod, value)

    def named(self, value: float) -> str:
        """Return a value of the given number, in the caller's units, with its unit."""
        return self._with_unit(f"{value:.8g}")

    def beside_what_is_asked(self, value: float) -> str:
        """Return such a value, in the caller's units, in digits that tell it from the one that was given.

        Empty where it is the same.
        """
        asked = self.in_units(self.given[1].value)
        if math.isclose(value, asked, rel_tol=SAME):
            return ""
        return self._with_unit(told_apart(value, asked, digits=8)[0])

    def _with_unit(self, text: str) -> str:
        unit = "" if self.rod is None else self.asks.given.unit_of(self.rod)
        return f"{text} {unit}".rstrip()

    def fits(self, label: str) -> bool:
        """Whether a state with this label is meant."""
        if self.state is None:
            return self.near is not None or label in UNFOLDED
        return fits(label, self.state)

    @property
    def as_given(self) -> dict[str, Any]:
        """Fields of an answer that repeat what was given, unchanged to the last bit."""
        if self.rod is not None or not self.exact:
            return {"given": self.exact}
        groups = dict(self.exact)
        return {"beta0": groups.pop("beta0"), "lam": groups.pop("lam"), "given": groups}

    @property
    def leaves(self) -> bool:
        """Whether what is given says that the tip has left the first piece of one of the paper's laws."""
        given = self.given[1]
        off = given.kind == "pressure" and not 0.5 <= given.value <= 1.0
        return off and not self.effective_law.is_linear


#: Relative difference within which a number that has an answer is the one asked for: it is rounded to that.
SAME = 1e-12


def _sought(
    near: float | Equilibrium | None, asked: Measure, scale: Callable[[float], float]
) -> float | None:
    if near is None:
        return None
    return float(getattr(near, asked.attribute)) if isinstance(near, Equilibrium) else scale(near)


#: Laws by the names that callers have for them; "auto" is law (8).
LAWS: dict[str, CohesiveLaw | None] = {"auto": None, "linear": LINEAR, "cohesive": COHESIVE}


def known_law(law: str | CohesiveLaw) -> CohesiveLaw | None:
    """Return the law a caller named or made; None for "auto"."""
    if isinstance(law, CohesiveLaw):
        return law
    if not isinstance(law, str) or law not in LAWS:
        raise InvalidInput(
            f"unknown law {law!r}.",
            remedy=f"Choose one of {', '.join(LAWS)} or pass a CohesiveLaw.",
        )
    return LAWS[law]


def known_lambda(lam: float | None, beta1: float | None) -> float:
    """Return lambda > -pi^4 from whichever of the two a caller gave."""
    if (lam is None) == (beta1 is None):
        raise InvalidInput("give either lam or beta1, and not both.")
    shift = finite("lam", lam) if lam is not None else positive("beta1", beta1) - PI4
    if shift <= -PI4:
        raise InvalidInput(f"beta1 = pi^4 + lam must be positive, got lam = {shift:g}.")
    return shift
