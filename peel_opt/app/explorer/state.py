"""`State`: everything the explorer shows follows from it; it travels as a link and as a card."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, get_args
from urllib.parse import parse_qs, urlencode

from ...base.checks import parse
from ...base.errors import InvalidInput, OutOfRange
from ...base.units import LENGTH, NUMBER, PRESSURE, STIFFNESS, Kind, display, told_apart
from ...equilibria.question import ASKS, Asks, Question
from ...model.groups import PI4
from ...model.labels import STATES
from ...model.rod import RATIOS, Rod, require_ratio
from ...plots.words import symbol

Units = Literal["groups", "SI"]
Given = Literal["groups", "length", "pressure"]
Law = Literal["linear", "cohesive"]
Convention = Literal["delay", "maxwell"]
Accuracy = Literal["sketch", "draft", "standard", "reference"]

#: Method and tolerance of each accuracy, as a card names them.
METHODS: dict[str, tuple[str, float]] = {
    "sketch": ("spectral", 1e-2),
    "draft": ("spectral", 1e-4),
    "standard": ("auto", 1e-8),
    "reference": ("shooting", 1e-8),
}

#: What may be chosen, by field.
CHOICES: dict[str, tuple[str, ...]] = {
    "units": get_args(Units),
    "given": get_args(Given),
    "law": get_args(Law),
    "convention": get_args(Convention),
    "accuracy": get_args(Accuracy),
    "label": (*STATES, "adhered"),
}

#: Numbers beyond these are not meant; far inside them an error says what exists instead.
_LIMITS = {"beta0": (0.0, 1e5), "lam": (-PI4, 1e7), "ratio": RATIOS}

#: Numbers in the rod's own units: what they measure, and whether zero and below are allowed.
_KINDS: dict[str, tuple[Kind, bool]] = {
    "k": (STIFFNESS, False),
    "T0": (PRESSURE, False),
    "y0": (LENGTH, False),
    "length": (LENGTH, False),
    "pressure": (PRESSURE, True),
    "ratio": (NUMBER, False),
    "beta0": (NUMBER, True),
    "lam": (NUMBER, True),
    "near": (NUMBER, True),
}

#: How fields are called in front of people.
NAMES = {"lam": "lambda", "ratio": "eta/y0", "label": "state"}

_LONGEST = 40  # characters of a wrong value that are quoted


@dataclass(frozen=True)
class State:
    """What the explorer looks at.

    Parameters
    ----------
    units : {"groups", "SI"}
        The paper's groups, or a rod with its three material numbers.
    given : {"groups", "length", "pressure"}
        What the question gives: beta0 and lambda, or for a rod its detached length or the pressure.
        In SI units it is one of the last two.
    ratio : float
        eta/y0 of the rod, where ``units`` is "groups".
    k, T0, y0 : float
        Bending stiffness [N m], adhesion strength [Pa] and range [m], where ``units`` is "SI".
    beta0, lam : float
        The paper's groups, where they are given.
    length, pressure : float
        In SI units, or in eta and T0 where ``units`` is "groups".
    law : {"linear", "cohesive"}
        The law of Fig 2b without an end, or law (8).
    convention : {"delay", "maxwell"}
        When the loop in lambda gives up a state; a rod under a pressure has the delay only.
    accuracy : {"sketch", "draft", "standard", "reference"}
    label : str
        Which state is meant: "unfolded" for the default one, "adhered" for the straight rod.
    near : float or None
        Picks the state by its answer: alpha1, pressure or length, in the units of those.

    Raises
    ------
    InvalidInput, OutOfRange
        If a field cannot be meant.
    """

    units: Units = "groups"
    given: Given = "groups"
    ratio: float = 1.0
    k: float = 2.3e-5
    T0: float = 140e3
    y0: float = 0.73e-3
    beta0: float = 4.0
    lam: float = -0.23
    length: float = 3.2
    pressure: float = 0.5
    law: Law = "linear"
    convention: Convention = "delay"
    accuracy: Accuracy = "standard"
    label: str = "unfolded"
    near: float | None = None

    def __post_init__(self) -> None:
        for name, known in CHOICES.items():
            if getattr(self, name) not in known:
                raise InvalidInput(
                    f"{NAMES.get(name, name)} cannot be {_quoted(getattr(self, name))}.",
                    remedy=f"Choose one of {', '.join(known)}.",
                )
        for name, (kind, signed) in _KINDS.items():
            value = getattr(self, name)
            if name == "near" and value is None:
                continue
            checked = parse(NAMES.get(name, name), value, kind, signed=signed)
            low, high = _LIMITS.get(name, (-1e15, 1e15))
            if not low <= checked <= high:
                end = low if checked < low else high
                mine, last = told_apart(checked, end)
                side = "below" if checked < low else "above"
                raise OutOfRange(
                    f"{NAMES.get(name, name)} = {mine} is outside {low:.4g} to {high:.4g}"
                    + (f": {side} {last}." if abs(checked - end) < 1e-3 * abs(end) else ".")
                )
            object.__setattr__(self, name, checked)
        if self.lam <= -PI4:
            raise OutOfRange("lambda must be above -pi^4, where beta1 is zero.")
        if self.units == "SI" and self.given == "groups":
            raise InvalidInput(
                "a rod in SI units is asked for its pressure or its length: its groups follow from them.",
                remedy="Give the length or the pressure, or switch to the paper's groups.",
            )
        if self.beta0 == 0.0 and self.given == "groups" and self.law != "linear":
            raise InvalidInput(
                "beta0 = 0 has no strength, hence no cohesive law.", remedy="Use the linear law."
            )
        if self.units == "SI":
            require_ratio(Rod(self.k, self.T0, self.y0).ratio)

    # --- what it means --------------------------------------------------------------------

    @property
    def rod(self) -> Rod | None:
        """The rod, in SI units or its own; None where the groups are given."""
        if self.given == "groups":
            return None
        if self.units == "SI":
            return Rod(self.k, self.T0, self.y0)
        return Rod.from_ratio(self.ratio)

    @property
    def field(self) -> str:
        """Which of the fields is the given number."""
        return "lam" if self.given == "groups" else self.given

    @property
    def asks(self) -> Asks:
        """What is given, and what is asked for."""
        return ASKS[self.field]

    @property
    def value(self) -> float:
        """The given number: lambda, length or pressure, in its unit."""
        return float(getattr(self, self.field))

    @property
    def named_law(self) -> str:
        """The law as the questions of this package take it.

        "auto" is law (8), called linear where the rod stays within y0 and the two agree.
        """
        return "linear" if self.law == "linear" else "auto"

    @property
    def question(self) -> Question:
        """The question whose answer the page shows; of the adhered rod there is none."""
        law, label = self.named_law, None if self.label == "unfolded" else self.label
        rod = self.rod
        if rod is None:
            return Question.of_groups(self.beta0, self.lam, law=law, state=label, near=self.near)
        return Question.of_rod(rod, self.given, self.value, law=law, state=label, near=self.near)

    @property
    def words(self) -> str:
        """The question in a few words."""
        if self.given == "groups":
            return f"β₀ = {self.beta0:.5g}, λ = {self.lam:.5g}"
        if self.units == "SI":
            number = display(self.value, self.asks.given.unit, 4)
            return f"{self.asks.given.name} {number}, η/y₀ = {self.effective_ratio:.4g}"
        return f"{symbol(self.asks.given.attribute)} = {self.value:.5g}, η/y₀ = {self.ratio:.4g}"

    @property
    def effective_ratio(self) -> float:
        """eta/y0 of the rod, or that which the groups imply; infinite at beta0 = 0."""
        rod = self.rod
        if rod is not None:
            return rod.ratio
        return (PI4 + self.lam) / self.beta0 ** (4 / 3) if self.beta0 else math.inf

    # --- changes --------------------------------------------------------------------------

    def changed(self, **values: Any) -> State:
        """Return the state with other values.

        ``near`` belongs to the numbers it was chosen at and goes with them, the label with the problem.
        """
        if values.keys() & {"units", "given", "law"}:
            values = {"label": "unfolded", **values}
        if values.keys() - {"accuracy", "convention"}:
            values = {"near": None, **values}
        return replace(self, **values)

    def at(self, value: float) -> State:
        """Return the state with another value of the given number."""
        return self.changed(**{self.field: value})

    def typed(self, name: str, text: str) -> State:
        """Return the state with a number as somebody typed it: "1.9 mm", "0.4 T0", "3.2".

        Raises
        ------
        InvalidInput, OutOfRange
            In one line, with the name of the field.
        """
        if name not in _KINDS or name == "near":
            raise InvalidInput(f"there is no number called {_quoted(name)}.")
        text = text.strip()
        if len(text) > _LONGEST:
            raise InvalidInput(f"{NAMES.get(name, name)} cannot be {_quoted(text)}.")
        kind, signed = _KINDS[name]
        own: dict[str, float] = {}
        if self.units == "groups":
            kind = NUMBER
        elif name in ("length", "pressure"):
            rod = Rod(self.k, self.T0, self.y0)
            own = (
                {"eta": rod.eta, "y0": rod.adhesion_range}
                if name == "length"
                else {"T0": rod.adhesion_strength}
            )
        return self.changed(**{name: parse(NAMES.get(name, name), text, kind, own=own, signed=signed)})

    def switched(self, units: str) -> State:
        """Return the state in other units, at the same p/T0 and sbar/eta."""
        if units == self.units:
            return self
        was = Rod(self.k, self.T0, self.y0) if self.units == "SI" else Rod.from_ratio(self.ratio)
        sigma, P = self.length / was.eta, self.pressure / was.adhesion_strength
        if units == "SI":
            rod = Rod(self.k, self.T0, self.y0)
            given = "length" if self.given == "groups" else self.given
            return self.changed(
                units="SI", given=given, law="cohesive", length=rod.length(sigma), pressure=rod.pressure(P)
            )
        return self.changed(units=units, ratio=was.ratio, length=sigma, pressure=P)

    def asking(self, given: str) -> State:
        """Return the state with another question about the same problem."""
        if given == self.given:
            return self
        # Each problem has its own law by default, as everywhere in this package.
        law = "linear" if given == "groups" else "cohesive"
        if given != "groups" and self.given != "groups":
            law = self.law
        return self.changed(given=given, law=law)

    # --- links ----------------------------------------------------------------------------

    def to_query(self) -> str:
        """Return the state as a query string, which `from_query` reads back exactly."""
        default = asdict(State())
        mine = {name: value for name, value in asdict(self).items() if value != default[name]}
        return urlencode({name: repr(v) if isinstance(v, float) else v for name, v in mine.items()})

    @classmethod
    def from_query(cls, query: str | Mapping[str, Sequence[bytes | str]]) -> tuple[State, tuple[str, ...]]:
        """Read a query string; what cannot be meant is left out, with a message for each.

        Parameters
        ----------
        query : str or mapping
            "beta0=4&lam=-0.2", or names with the values a server has split off already.

        Returns
        -------
        State, tuple of str
        """
        if isinstance(query, str):
            given: Mapping[str, Sequence[bytes | str]] = parse_qs(query.lstrip("?"), keep_blank_values=True)
        else:
            given = query
        known = {f.name for f in fields(cls)}
        values: dict[str, Any] = {}
        messages = []
        for name, texts in given.items():
            text = texts[0] if texts else ""
            text = text.decode("utf-8", "replace") if isinstance(text, bytes) else text
            if name not in known:
                messages.append(f"The link names {_quoted(name)}, which is not known.")
                continue
            if len(texts) > 1:
                messages.append(f"The link gives {name} {len(texts)} times; the first is used.")
            try:
                value = text if name in CHOICES else _plain(name, text)
                # A rod in SI units cannot be asked for groups, whatever else is in the link.
                alone: dict[str, Any] = {"given": "length"} if (name, value) == ("units", "SI") else {}
                cls(**{**alone, name: value})
            except (InvalidInput, OutOfRange) as error:
                messages.append(f"In the link: {error}")
                continue
            values[name] = value
        try:
            return cls(**values), tuple(messages)
        except (InvalidInput, OutOfRange) as error:
            return cls(), (*messages, f"In the link: {error}")


def _plain(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidInput(f"{NAMES.get(name, name)} must be a finite number, got {_quoted(text)}.")
    return value


def _quoted(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
