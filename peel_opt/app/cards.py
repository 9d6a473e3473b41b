"""Problem cards: a rod, its sources and the questions about it, as data in a TOML file.

::

    title = "Office tape"

    [rod]                                   # a number without a unit is in SI units
    youngs_modulus = "1.5 GPa"              # or bending_stiffness = "9.5 uN m"
    thickness = "40 um"
    poisson_ratio = 0.4
    adhesion_strength = "0.5 MPa"           # two of three: T0, adhesion_range = y0, G = T0 y0 / 2
    work_of_separation = "100 J/m^2"
    mass_per_area = "50 g/m^2"              # of a motion, if it is known: the mass of the rod and of what
    drag = "2 kPa s/m"                      # it carries along, and force per area and speed

    [sources]                               # where each number of [rod] was read ...
    thickness = "data sheet"

    [estimates]                             # ... or how it was estimated: every one of them
    poisson_ratio = "usual for polymers"    # (and the other three)

    [[questions]]
    pressure = "0.2 MPa"                    # or pressure_ratio = 0.4: asks for the length
    [[questions]]
    length = "0.9 mm"                       # or length_ratio = 3.4: asks for the pressure
    state = "lower"                         # also law, near, tol, method and name

What acts on the rod beside a uniform pressure, or in its place, stands under ``[scene]``; see
`scene_table`.  Any of its numbers may be what a question asks for::

    [scene]
    angle = "90 deg"                        # of a pull at the tip

    [[questions]]
    free = "force"
    length = "12 mm"                        # and pressure = ..., if there is one
    [[questions]]
    flaw = "0.5 mm"                         # asks for the safe pressure; free = "flaw" for the critical one

How the pressure changes in time stands under ``[history]``, which ``peel-opt history`` follows::

    [history]
    times = ["0 s", "2 s", "20 s"]          # numbers in c eta/T0 where [rod] has no drag
    pressures = ["0.5 T0", "0.5 T0", "0 Pa"]
    bond = "damage"                         # or "no_rebond"; "reversible" if not given

A rod may be known by its ratio alone, ``[rod] ratio = 0.566``, or the paper's groups take its
place, ``[groups] beta0 = 53.16, beta1 = 113.1``.  In questions the rod's ``y0``, ``eta`` and
``T0`` are units too: ``length = "5.664 y0"``.
"""

from __future__ import annotations

import difflib
import tomllib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, Field, ValidationError, model_validator

from ..base.errors import CardError, InvalidInput, PeelOptError
from ..base.files import as_path
from ..model.rod import Rod
from ..model.scene import Scene
from .card_tables import CardTable, GroupsTable, RodTable
from .history_table import HistoryTable
from .questions import Answer, Posed, Problem, QuestionTable
from .scene_table import SET, SceneTable

#: A card is a page of text; what is longer was not meant to be one.
MOST_BYTES = 1_000_000


class SourcedCard(CardTable):
    """What cards of every kind say: what they are about, and where the numbers of their rod are from.

    Parameters
    ----------
    title : str
    note : str
        What a reader must know about the answers.
    sources, estimates : dict of str
        By field of the rod: where it was read, or how it was estimated.
    """

    #: Its tables by their headers.
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {}

    title: str
    note: str = ""
    sources: dict[str, str] = Field(default_factory=dict)
    estimates: dict[str, str] = Field(default_factory=dict)

    @classmethod
    def checked(cls, path: str | Path, content: dict[str, Any]) -> Self:
        """Return what `read_card` returned as a card, or say in one line what is wrong with it.

        Raises
        ------
        CardError
            If it does not mean anything.
        """
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            raise CardError(f"card {str(path)!r}: {explain(error, cls)}") from error

    def require_sources(self, given: set[str], needed: set[str], why: str = "") -> None:
        """Refuse sources of what is not given, and numbers that need one, ``why`` says why, and have none.

        Raises
        ------
        InvalidInput
            Naming the first of them.
        """
        for key in (*self.sources, *self.estimates):
            if key not in given:
                raise InvalidInput(f"[sources] or [estimates] names {key!r}, which the card does not give.")
        if both := sorted(set(self.sources) & set(self.estimates)):
            raise InvalidInput(f"{both[0]} stands in both [sources] and [estimates].")
        if bare := sorted(needed - set(self.sources) - set(self.estimates)):
            raise InvalidInput(
                f"{bare[0]}{why} has neither a source nor an estimate.",
                remedy=f"Say under [sources] where it was read, or under [estimates] how it was guessed"
                f" ({len(bare)} missing).",
            )


class Card(SourcedCard):
    """A problem: a rod or the paper's groups, where its numbers are from, and questions.

    Parameters
    ----------
    rod_table, groups : RodTable or GroupsTable
        One of them.
    scene_table : SceneTable, optional
        What acts on the rod.
    history : HistoryTable, optional
        How the pressure changes in time.
    questions : tuple of QuestionTable
    """

    tables: ClassVar = {
        "rod": RodTable,
        "scene": SceneTable,
        "groups": GroupsTable,
        "questions": QuestionTable,
        "history": HistoryTable,
    }

    rod_table: RodTable | None = Field(default=None, alias="rod")
    scene_table: SceneTable | None = Field(default=None, alias="scene")
    groups: GroupsTable | None = None
    history: HistoryTable | None = None
    questions: tuple[QuestionTable, ...] = ()

    def rod(self) -> Rod | None:
        """Return the rod; None for a card in the paper's groups."""
        return None if self.rod_table is None else self.rod_table.rod()

    def scene(self) -> Scene | None:
        """Return the rod with what acts on it; None where the card names nothing."""
        rod = self.rod()
        return None if rod is None or self.scene_table is None else self.scene_table.scene(rod)

    @property
    def problem(self) -> Problem:
        """The rod, the scene or the groups that all questions are about."""
        problem = self.scene() or self.rod() or self.groups
        assert problem is not None
        return problem

    def labels(self) -> list[str]:
        """Return one name for each question, no two the same."""
        labels = [question.label(self.problem) for question in self.questions]
        repeated = Counter(labels)
        taken = {text for text in labels if repeated[text] == 1}
        named = []
        for n, text in enumerate(labels, 1):
            name = text
            while repeated[text] > 1 and name in taken | {text}:
                name = f"{name} ({n})"
            taken.add(name)
            named.append(name)
        return named

    def pose(self) -> Posed:
        """Return the card's one question as a call that takes ``method`` and ``tol``.

        Raises
        ------
        InvalidInput
            If the card has not exactly one question.
        """
        if len(self.questions) != 1:
            raise InvalidInput(
                f"the card has {len(self.questions)} questions, not one.",
                remedy="Pass card.questions[i].pose(card.problem).",
            )
        return self.questions[0].pose(self.problem)

    def ask(
        self, *, method: str | None = None, tol: float | None = None
    ) -> list[tuple[str, Answer | PeelOptError]]:
        """Answer every question; what fails does not keep the others from their answers.

        Parameters
        ----------
        method, tol : optional
            Replace those of the questions.

        Returns
        -------
        list of (str, Answer or PeelOptError)
            The label of each question and its answer, or the error that tells why there is none.
        """
        other = {key: value for key, value in (("method", method), ("tol", tol)) if value is not None}
        answers: list[tuple[str, Answer | PeelOptError]] = []
        for label, question in zip(self.labels(), self.questions, strict=True):
            try:
                answers.append((label, question.model_copy(update=other).pose(self.problem)()))
            except PeelOptError as error:
                answers.append((label, error))
        return answers

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        if (self.rod_table is None) == (self.groups is None):
            raise InvalidInput("a card needs either a [rod] or [groups], and not both.")
        if not self.questions:
            raise InvalidInput("a card needs at least one entry under [[questions]].")
        given = set((self.rod_table or self.groups or self).model_fields_set)
        in_si = self.rod_table is not None and self.rod_table.ratio is None
        if self.scene_table is not None:
            if self.rod_table is None:
                raise InvalidInput("[scene] is of a rod, and this card has [groups].")
            try:
                self.scene()
            except InvalidInput as error:
                raise InvalidInput(f"[scene]: {error}") from error
            given |= self.scene_table.given
        self.require_sources(given, given - set(SET) if in_si else set())
        if self.history is not None:
            if self.rod_table is None or self.scene_table is not None:
                raise InvalidInput("[history] is of a [rod] alone: a uniform pressure that changes.")
            try:
                self.history.asked(self.rod_table.rod(), self.rod_table.drag)
            except InvalidInput as error:
                raise InvalidInput(f"[history]: {error}") from error
        for number, question in enumerate(self.questions, 1):
            try:
                question.pose(self.problem)
            except InvalidInput as error:
                raise InvalidInput(f"[[questions]] no. {number}: {error}") from error
        return self


def load_card(path: str | Path) -> Card:
    """Read and check a problem card.

    Parameters
    ----------
    path : str or Path
        A TOML file in UTF-8.

    Returns
    -------
    Card

    Raises
    ------
    CardError
        If the file cannot be read or does not mean anything, in one line.
    """
    content = read_card(path)
    if is_calibration(content):
        raise CardError(f"card {str(path)!r} is a calibration.", remedy="Fit it with peel-opt calibrate.")
    return Card.checked(path, content)


def is_calibration(content: dict[str, Any]) -> bool:
    """Whether what `read_card` returned is a calibration card, which asks for a fit."""
    return "calibration" in content


def read_card(path: str | Path) -> dict[str, Any]:
    """Return the tables of a card of any kind, unchecked.

    Raises
    ------
    CardError
        If the file cannot be read or is no TOML text, in one line.
    """
    shown = str(path)
    try:
        with open(as_path(path), "rb") as file:
            data = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        raise CardError(
            f"cannot read card {shown!r}: {getattr(error, 'strerror', None) or error}."
        ) from error
    if len(data) > MOST_BYTES:
        raise CardError(f"card {shown!r} is larger than {MOST_BYTES // 1000} kB; cards are short texts.")
    if not data.strip():
        raise CardError(f"card {shown!r} is empty.", remedy="See problems/ for examples.")
    try:
        if b"\0" in data:
            raise ValueError("it holds NUL bytes")
        # Editors on Windows put a mark before the first character.
        return tomllib.loads(data.decode("utf-8-sig"))
    except RecursionError as error:
        raise CardError(f"card {shown!r} is nested too deeply.") from error
    except UnicodeDecodeError as error:
        raise CardError(f"card {shown!r} is no UTF-8 text (byte {error.start}).") from error
    except ValueError as error:
        raise CardError(f"card {shown!r} is no TOML text: {_one_line(error)}.") from error


def as_question(**fields: Any) -> QuestionTable:
    """Return a question outside any card, or say in one line what is wrong with it."""
    try:
        return QuestionTable(**fields)
    except ValidationError as error:
        raise InvalidInput(explain(error)) from error


def explain(error: ValidationError, card: type[SourcedCard] = Card) -> str:
    """Return the first complaint in the words of a kind of card, and how many more there are."""
    complaints = error.errors(include_url=False)
    # A misspelt key explains what is missing, not the other way round.
    complaints.sort(key=lambda details: details["type"] != "extra_forbidden")
    more = f" ({len(complaints) - 1} more to come.)" if len(complaints) > 1 else ""
    first: dict[str, Any] = complaints[0]  # type: ignore[assignment]
    path = (first["loc"] or ("",))[:-1]
    table = card.tables.get(str(path[0]), card) if path else card
    return _complaint(first, [field.alias or name for name, field in table.model_fields.items()]) + more


def _complaint(details: dict[str, Any], keys: list[str]) -> str:
    *path, last = details["loc"] or ("",)
    if details["type"] == "extra_forbidden":
        near = difflib.get_close_matches(str(last), keys, n=1, cutoff=0.5)
        meant = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(keys)}."
        return f"unknown key {str(last)!r}{_table(path, ' in ')}; {meant}"
    own_words = details.get("ctx", {}).get("error")
    if isinstance(own_words, InvalidInput):
        # They name the field themselves, unless they are about a table as a whole.
        place = details["loc"] if not path or isinstance(last, int) else path
        return f"{_table(place)}{': ' if place else ''}{_one_line(own_words)}"
    if details["type"] == "missing":
        return f"{last!r} is missing{_table(path, ' in ')}."
    words = details["msg"][0].lower() + details["msg"][1:]
    return f"{last}{_table(path, ' in ')}: {words}, got {_shortened(details['input'])}."


def _table(path: Any, before: str = "") -> str:
    """Return the header of a table as it stands in the card."""
    if not path:
        return ""
    name, *rest = path
    return (
        f"{before}[[{name}]] no. {rest[0] + 1}" if rest and isinstance(rest[0], int) else f"{before}[{name}]"
    )


def _shortened(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
