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
from ...model.scene import Scene
from ...plots.words import symbol
from ..card_tables import own_units
from .setups import SCENE_NUMBERS, SETUPS, scene_of

Units = Literal["groups", "SI"]
Given = Literal["groups", "length", "pressure"]
Law = Literal["linear", "cohesive"]
Convention = Literal["delay", "maxwell"]
Accuracy = Literal["sketch", "draft", "standard", "reference"]
SceneName = Literal["plate", "flaw", "wall", "force", "weight", "drag"]

#: States that only the plate has, and that only other scenes have.
OF_PLATE, OF_SCENES = ("spurious", "adhered"), ("lifted", "other")

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
    "scene": get_args(SceneName),
    "label": (*STATES, "adhered", *OF_SCENES),
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
} | {name: (each.kind(in_si=True), True) for name, each in SCENE_NUMBERS.items()}

#: How fields are called in front of people.
NAMES = {"lam": "lambda", "ratio": "eta/y0", "label": "state"}
NAMES |= {"unbonded": "unglued edge", "weight": "weight per area", "drag": "drag per area"}

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
    scene : {"plate", "flaw", "wall", "force", "weight", "drag"}
        What acts on a rod beside the pressure: a key of `SETUPS`.
    unbonded, curvature, force, angle, weight, drag : float
        Numbers of the scenes, in SI units, or in eta and T0 where ``units`` is "groups"; the angle in rad.

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
    scene: SceneName = "plate"
    unbonded: float = 0.0
    curvature: float = 0.0
    force: float = 0.0
    angle: float = 0.5 * math.pi
    weight: float = 0.0
    drag: float = 0.0

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
        self._require_scene()

    def _require_scene(self) -> None:
        """Raise where the scene, or one of its numbers, cannot be meant."""
        plain = self.scene == "plate"
        if not plain and self.given == "groups":
            raise InvalidInput(
                "beta0 and lambda are the paper's groups, of its own scene.",
                remedy="Give the length or the pressure, or go back to the paper's scene.",
            )
        if self.label in (OF_SCENES if plain else OF_PLATE):
            raise InvalidInput(
                f"no state of this scene is called {self.label}.",
                remedy=f"Choose one of {', '.join(self.labels)}.",
            )
        if (rod := self.rod) is None:
            return
        for each in SETUPS[self.scene].numbers:
            value, size = getattr(self, each.name), each.dimension.size(rod)
            if not each.least * size <= value <= each.most * size:
                low, high = (each.worded(rod, end * size) for end in (each.least, each.most))
                raise OutOfRange(f"the {each.words} lies between {low} and {high}.")

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
    def rods_scene(self) -> Scene | None:
        """The scene of the rod; None where it is the paper's."""
        return scene_of(self)

    @property
    def labels(self) -> tuple[str, ...]:
        """The states that the scene may have."""
        never = OF_SCENES if self.scene == "plate" else OF_PLATE
        return tuple(label for label in CHOICES["label"] if label not in never)

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
            number = display(self.value, self.asks.given.dimension.unit, 4)
            words = f"{self.asks.given.name} {number}, η/y₀ = {self.effective_ratio:.4g}"
        else:
            words = f"{symbol(self.asks.given.attribute)} = {self.value:.5g}, η/y₀ = {self.ratio:.4g}"
        rod = self.rod
        assert rod is not None  # the groups are not given
        own = (each.worded(rod, getattr(self, each.name)) for each in SETUPS[self.scene].numbers)
        return ", ".join([words, *own])

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
        if values.keys() & {"units", "given", "law", "scene"}:
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
            kind = SCENE_NUMBERS[name].kind(in_si=False) if name in SCENE_NUMBERS else NUMBER
        elif name in SCENE_NUMBERS or name in ("length", "pressure"):
            own = own_units(Rod(self.k, self.T0, self.y0), kind.si)
        return self.changed(**{name: parse(NAMES.get(name, name), text, kind, own=own, signed=signed)})

    def switched(self, units: str) -> State:
        """Return the state in other units, at the same p/T0, sbar/eta and eta/y0.

        A rod in SI units keeps its k and T0, and has the y0 that goes with them.
        """
        if units == self.units:
            return self
        was = Rod(self.k, self.T0, self.y0) if self.units == "SI" else Rod.from_ratio(self.ratio)
        sigma, P = self.length / was.eta, self.pressure / was.adhesion_strength
        own = {name: getattr(self, name) / each.dimension.size(was) for name, each in SCENE_NUMBERS.items()}
        if units == "SI":
            rod = Rod(self.k, self.T0, self.y0)
            if not math.isclose(rod.ratio, was.ratio, rel_tol=1e-12):
                rod = Rod(self.k, self.T0, rod.eta / was.ratio)
            given = "length" if self.given == "groups" else self.given
            own = {name: value * SCENE_NUMBERS[name].dimension.size(rod) for name, value in own.items()}
            lengths = {"length": rod.length(sigma), "pressure": rod.pressure(P), "y0": rod.adhesion_range}
            law = "cohesive" if self.given == "groups" else self.law
            return self.changed(units="SI", given=given, law=law, **lengths, **own)
        return self.changed(units=units, ratio=was.ratio, length=sigma, pressure=P, **own)

    def staged(self, scene: str) -> State:
        """Return the state with another scene, whose numbers begin where they are not given yet."""
        if scene == self.scene:
            return self
        setup, state = SETUPS[scene], self
        if state.given == "groups" and scene != "plate":
            state = state.asking("pressure")
        rod = state.rod
        if rod is None:
            return state.changed(scene=scene)
        begun = {
            each.name: getattr(state, each.name) or each.start * each.dimension.size(rod)
            for each in setup.numbers
        }
        return state.changed(scene=scene, **begun)

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
                alone: dict[str, Any] = {}
                if (name, value) == ("units", "SI") or name == "scene":
                    alone = {"given": "length"}
                elif name == "label" and value in OF_SCENES:
                    alone = {"given": "length", "scene": "flaw"}
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
