"""Cards to begin with: one of each kind, whose comments are what the models say of their keys."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic.fields import FieldInfo

from ..analysis.flaws import readhesion_pressure
from ..base.checks import parse
from ..base.units import NUMBER, display
from ..equilibria.answers import answers
from ..equilibria.ask import length_given_pressure
from ..model.rod import Rod
from .calibration_cards import CalibrationCard
from .card_tables import RodTable
from .cards import Card, SourcedCard
from .scene_table import MEASURES, SET

#: What stands under [estimates] where a number was not given.
EXAMPLE = "an example of peel-opt new: put your number here"

#: Where comments begin, if the line is not longer.
COLUMN = 34

#: Example data of a calibration: pressures from T0 (0) to the least one (1), and made-up errors over their
#: standard deviations, of the length and of the pressure.
_MEASURED = (
    (0.1, 0.6, -0.8),
    (0.25, -1.1, 0.3),
    (0.4, 0.4, 1.0),
    (0.55, 0.9, -0.4),
    (0.7, -0.5, -0.9),
    (0.85, 0.2, 0.7),
)

#: Their standard deviations, relative.
_SD = 0.005

#: Numbers of a bond, two of which say the third.
_BONDS = ("adhesion_strength", "work_of_separation", "adhesion_range")

#: Keys whose numbers have no unit.
_PLAIN = ("poisson_ratio", "ratio", "beta0", "lam")

#: Keys of a table with their values.
Table = dict[str, Any]

_BOND: Table = {"adhesion_strength": "140 kPa", "adhesion_range": "0.73 mm"}
_ROD: Table = {"bending_stiffness": "23 uN m", **_BOND}
_STRIP: Table = {"youngs_modulus": "1.5 GPa", "thickness": "40 um", "poisson_ratio": 0.4}
_SHEET: Table = {**_STRIP, "adhesion_strength": "0.5 MPa", "work_of_separation": "100 J/m^2"}
_MOTION: Table = {"mass_per_area": "50 g/m^2", "drag": "2 kPa s/m"}
_HELD: dict[str, Table] = {
    "length that a pressure holds": {"pressure": "{pressure}"},
    "pressure that holds a length": {"length": "{length}"},
}
_MORE: Table = {"state": "lower", "tol": 1e-10}


@dataclass(frozen=True)
class Template:
    """A kind of card.

    Parameters
    ----------
    about : str
        What is in it, in words.
    title : str
    tables : dict of dict
        Keys of each table with the values of an example; the first has the numbers that a user gives.
    asks : dict of dict
        The questions, by name.  In them and in the tables ``{pressure}`` stands for one under which the
        rod has an unfolded state, ``{length}`` for its length there, ``{flaw}`` for a tenth of that.
    choices : dict of dict
        Keys that may be added to a table, or to the first question; they stand there as comments.
    """

    about: str
    title: str
    tables: Mapping[str, Table]
    asks: Mapping[str, Table] = field(default_factory=dict)
    choices: Mapping[str, Table] = field(default_factory=dict)

    @property
    def card(self) -> type[SourcedCard]:
        """The model that reads it."""
        return CalibrationCard if "calibration" in self.tables else Card

    @property
    def first(self) -> str:
        """The table whose numbers a user gives."""
        return next(iter(self.tables))

    @property
    def takes(self) -> tuple[str, ...]:
        """Keys of the numbers that a user may give."""
        example = self.tables[self.first]
        of_a_rod = (*_STRIP, "bending_stiffness", *_BONDS)
        return of_a_rod if set(example) & set(of_a_rod) else tuple(example)

    def fields(self, table: str) -> dict[str, FieldInfo]:
        """Return the keys that may stand in a table."""
        return self.card.tables[table].model_fields

    def rod(self, given: Mapping[str, str] | None = None) -> Rod | None:
        """Return the rod of the card, with numbers as they were typed; None for the paper's groups.

        Raises
        ------
        InvalidInput
            If the numbers make no rod.
        """
        return None if self.first == "groups" else RodTable.of(self.numbers(given or {})).rod()

    def numbers(self, given: Mapping[str, str]) -> Table:
        """Return the numbers of the first table: those that were typed, and what they lack of the example.

        A stiffness may take the place of a sheet, or the other way round, and the bond is any two numbers.
        """
        typed = {key: _as_typed(text, key) for key, text in given.items()}
        whole = self.tables[self.first] | (_STRIP if set(_STRIP) & set(typed) else {})
        unused = set(_STRIP) - set(typed) if "bending_stiffness" in typed else set()
        if set(_STRIP) & set(typed):
            unused.add("bending_stiffness")
        bond = sorted((key for key in _BONDS if key in whole | typed), key=lambda key: key not in typed)
        whole = {key: value for key, value in whole.items() if key not in {*unused, *bond[2:]}} | typed
        return {key: whole[key] for key in self.fields(self.first) if key in whole}

    def text(
        self,
        given: Mapping[str, str] | None = None,
        asked: Mapping[str, str] | None = None,
        *,
        title: str = "",
        source: str = "",
        data: str = "",
    ) -> str:
        """Return the card.

        Parameters
        ----------
        given : mapping
            Numbers in the place of those of the example, by key, as they were typed.
        asked : mapping
            What is given in questions in the place of those of the example, by key; a question each.
        title, source : str
        data : str
            Name of the file with the data of a calibration.

        Raises
        ------
        InvalidInput
            If the numbers make no rod.
        """
        given = given or {}
        words = _values(self.rod(given)) | {"data": data}
        lines = [
            "# Made by peel-opt new. A number without a unit is in SI units; docs/cards.md has all keys.",
            "",
            f"title = {_toml(title or self.title)}",
            '# note = "what a reader must know about the answers"',
            f"source = {_toml(source)}" if source else '# source = "where the numbers below are from"',
        ]
        for name in self.tables:
            table = self.numbers(given) if name == self.first else self.tables[name]
            several = name in ("pairs", "shapes")
            lines += ["", f"[[{name}]]" if several else f"[{name}]", *self._lines(name, table, words)]
            lines += (f"# {line}" for line in self._lines(name, self.choices.get(name, {}), words))
        if examples := self._examples(given):
            lines += ["", "[estimates]", *(f"{key} = {_toml(EXAMPLE)}" for key in examples)]
        questions = [{key: value} for key, value in (asked or {}).items()]
        questions = questions or [{"name": name, **ask} for name, ask in self.asks.items()]
        more = self.choices.get("questions", {})
        for question in questions:
            lines += ["", "[[questions]]", *self._lines("questions", question, words)]
            if "flaw" not in question:
                lines += (f"# {line}" for line in self._lines("questions", more, words))
            more = {}
        return "\n".join(lines) + "\n"

    def data(self, given: Mapping[str, str] | None = None) -> str:
        """Return the example data of a calibration, rounded states of its rod; empty for other cards."""
        if self.card is Card:
            return ""
        rod = self.rod(given)
        assert rod is not None
        low = readhesion_pressure(rod).pressure / rod.adhesion_strength
        shares = [1.0 - x * (1.0 - low) for x, _, _ in _MEASURED]
        found = answers(ratio=rod.ratio, pressure_ratio=shares)
        rows = [
            "# An example, states of the rod in the card with made-up errors: put your measurements here."
        ]
        rows.append("length [m], length_sd [m], pressure [Pa], pressure_sd [Pa]")
        for (_, dl, dp), P, sigma in zip(_MEASURED, shares, found.length_ratio, strict=True):
            cells = (sigma * rod.eta, dl), (P * rod.adhesion_strength, dp)
            rows.append(", ".join(f"{v * (1.0 + _SD * miss):.4g}, {v * _SD:.2g}" for v, miss in cells))
        return "\n".join(rows) + "\n"

    def _examples(self, given: Mapping[str, str]) -> list[str]:
        """Return the keys of numbers that are from nowhere else."""
        if self.first == "groups" or "ratio" in self.tables[self.first]:
            return []
        fitted = self.tables.get("calibration", {}).get("free", ())
        scene = [key for key in self.tables.get("scene", {}) if key in MEASURES and key not in SET]
        return [key for key in (*self.numbers(given), *scene) if key not in given and key not in fitted]

    def _lines(self, name: str, table: Table, words: Mapping[str, Any]) -> Iterator[str]:
        for key, value in table.items():
            text = f"{key} = {_toml(_filled(value, words))}"
            said = self.fields(name)[key].description if key != "name" else ""
            yield f"{text.ljust(COLUMN - 2)}  # {said}" if said else text


def _values(rod: Rod | None) -> dict[str, Any]:
    """Return what stands for a pressure, a length and a flaw of a rod: texts with units, if it has any."""
    if rod is None:
        return {}
    least = readhesion_pressure(rod).pressure
    pressure = _rounded(0.5 * (least + rod.adhesion_strength), up=False)
    length = _rounded(length_given_pressure(rod, pressure).length, up=True)
    units = {"pressure": (pressure, "Pa"), "length": (length, "m"), "flaw": (0.1 * length, "m")}
    return {n: float(f"{v:.3g}") if rod.dimensionless else display(v, u, 3) for n, (v, u) in units.items()}


def _rounded(value: float, *, up: bool) -> float:
    """Return a number with three digits that is not above it, or not below."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return (math.ceil if up else math.floor)(value / step) * step


def _as_typed(text: str, key: str) -> Any:
    """Return a number as the card is to have it: a text with its unit, or plain where the key has none."""
    return parse(key, text, NUMBER, signed=True) if key in _PLAIN else text


def _filled(value: Any, words: Mapping[str, Any]) -> Any:
    """Return a value with the words in braces replaced; where it is nothing else, by what they stand for."""
    if isinstance(value, list):
        return [_filled(one, words) for one in value]
    return words.get(value[1:-1], value) if isinstance(value, str) and value.startswith("{") else value


def _toml(value: Any) -> str:
    """Return a value as TOML has it, which for texts, numbers and lists of them is JSON."""
    return json.dumps(value, ensure_ascii=False)


#: The kinds of cards by name.
TEMPLATES = {
    "rod": Template(
        "a rod by its stiffness and bond",
        "A rod and its bond",
        {"rod": _ROD},
        _HELD | {"pressure that is safe for a flaw": {"flaw": "{flaw}"}},
        {"rod": _MOTION, "questions": _MORE},
    ),
    "sheet": Template(
        "a rod that is cut from a sheet: modulus, thickness, strength and work of separation of its bond",
        "A strip of a sheet",
        {"rod": _SHEET},
        _HELD | {"pressure that is safe for a flaw": {"flaw": "{flaw}"}},
        {"rod": _MOTION, "questions": _MORE},
    ),
    "ratio": Template(
        "a rod by eta/y0 alone: lengths in eta, pressures in T0",
        "A rod known by its ratio",
        {"rod": {"ratio": 1.0}},
        _HELD,
        {"questions": _MORE},
    ),
    "groups": Template(
        "the paper's groups, in which alpha1 is asked for",
        "A state in the paper's groups",
        {"groups": {"beta0": 4.0, "lam": -0.25}},
        {"alpha1": {}},
    ),
    "peel": Template(
        "a peel test: a strip that is pulled at its tip",
        "A peel test",
        {"rod": _SHEET, "scene": {"angle": "90 deg"}},
        {"force on a long arm": {"free": "force", "length": "10 eta"}},
        {"scene": {"unbonded": "0.5 eta"}, "questions": {"pressure": "0 Pa", "near": "0.1 G"}},
    ),
    "scene": Template(
        "a rod with more than a pressure: friction of a stream, and what else may act on it",
        "A strip in a stream",
        {"rod": _SHEET, "scene": {"friction": "0.001 T0"}},
        {
            "length that a pressure holds": {"pressure": "{pressure}"},
            "friction that holds a length": {
                "free": "friction",
                "pressure": "{pressure}",
                "length": "{length}",
                "near": "0 Pa",
            },
        },
        {
            "scene": {
                "profile": "mixed",
                "mix": 0.3,
                "weight": "2 Pa",
                "curvature": "0.05 1/mm",
                "unbonded": "0.1 mm",
            }
        },
    ),
    "blister": Template(
        "half of a strip between two edges, which lifts in its middle",
        "A blister",
        {"rod": _SHEET, "scene": {"blister": True, "slack": "0.1 eta"}},
        {"length that a pressure holds": {"pressure": "{pressure}"}},
        {"scene": {"stretch": "60 kN/m", "line_energy": "1 J/m^2"}},
    ),
    "history": Template(
        "a pressure that changes in time, which `peel-opt history` follows",
        "A rod that is loaded and let down",
        {
            "rod": _ROD,
            "history": {
                "times": [0, 60, 400],
                "pressures": ["{pressure}", "{pressure}", "0 Pa"],
                "bond": "damage",
            },
        },
        {"length that a pressure holds": {"pressure": "{pressure}"}},
    ),
    "calibration": Template(
        "a fit of the bond to measured lengths and pressures, with a file of example data beside it",
        "A bond from pressures and lengths",
        {
            "rod": _ROD,
            "calibration": {"free": ["adhesion_strength", "adhesion_range"], "level": 0.95},
            "pairs": {"file": "{data}"},
        },
    ),
}
