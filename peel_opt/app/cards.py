"""Problem cards: a rod, its sources and the questions about it, as data in a TOML file.

Tables, keys, units and defaults are those of the models here and in `card_tables`, `scene_table`,
`history_table` and `questions`; `card_page` makes docs/cards.md of them, `card_templates` first cards.
"""

from __future__ import annotations

import difflib
import tomllib
import warnings
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, Field, PrivateAttr, ValidationError, model_validator

from ..base.errors import CardError, CardWarning, InvalidInput, PeelOptError
from ..base.files import as_path
from ..equilibria.scenes import refuse_options
from ..model.rod import Rod
from ..model.scene import Scene
from ..motion.acting import loads_on
from .bare_numbers import bare_numbers
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
    source : str
        Where all numbers are from that are named neither in ``sources`` nor in ``estimates``.
    sources, estimates : dict of str
        By field of the rod: where it was read, or how it was estimated.
    """

    #: Its tables by their headers.
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {}

    _bare: tuple[str, ...] = PrivateAttr(())

    title: str = Field(description="what the card is about")
    note: str = Field("", description="what a reader must know about the answers")
    source: str = Field("", description="where all numbers are from that have no line of their own below")
    sources: dict[str, str] = Field(default_factory=dict, description="by key: where a number was read")
    estimates: dict[str, str] = Field(default_factory=dict, description="by key: how a number was estimated")

    @classmethod
    def checked(cls, path: str | Path, content: dict[str, Any]) -> Self:
        """Return what `read_card` returned as a card, or say in one line what is wrong with it.

        Raises
        ------
        CardError
            If it does not mean anything.

        Warns
        -----
        CardWarning
            If it does not say where its numbers are from.
        """
        try:
            card = cls.model_validate(content)
        except ValidationError as error:
            raise CardError(f"card {str(path)!r}: {explain(error, cls)}") from error
        card._bare = bare_numbers(content, cls.tables)
        if lost := card.unsourced:
            warnings.warn(
                f"card {str(path)!r} does not say where {', '.join(lost)} {'is' if len(lost) == 1 else 'are'}"
                ' from: give a source = "..." for all, or name each under [sources] or [estimates].',
                CardWarning,
                stacklevel=3,  # who loads it
            )
        return card

    @property
    def bare(self) -> tuple[str, ...]:
        """The numbers that stand on the card without a unit, with the SI unit that they are taken in."""
        return self._bare

    @property
    def given(self) -> set[str]:
        """Names of all numbers that the card gives."""
        raise NotImplementedError

    @property
    def _read_somewhere(self) -> set[str]:
        """Names of the numbers that must be from somewhere."""
        raise NotImplementedError

    @property
    def unsourced(self) -> tuple[str, ...]:
        """Names of the numbers of which nothing says where they were read, or how they were estimated."""
        named = set(self.sources) | set(self.estimates)
        return () if self.source.strip() else tuple(sorted(self._read_somewhere - named))

    def require_sources_of_what_is_given(self) -> None:
        """Refuse sources of other numbers, and two of one.

        Raises
        ------
        InvalidInput
            Naming the first of them.
        """
        for key in (*self.sources, *self.estimates):
            if key not in self.given:
                raise InvalidInput(f"[sources] or [estimates] names {key!r}, which the card does not give.")
        if both := sorted(set(self.sources) & set(self.estimates)):
            raise InvalidInput(f"{both[0]} stands in both [sources] and [estimates].")


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
    questions: tuple[QuestionTable, ...] = ()
    history: HistoryTable | None = None

    @property
    def given(self) -> set[str]:
        """Names of all numbers of its rod or groups, and of its scene."""
        scene = set() if self.scene_table is None else self.scene_table.given
        return set((self.rod_table or self.groups or self).model_fields_set) | scene

    @property
    def _read_somewhere(self) -> set[str]:
        in_si = self.rod_table is not None and self.rod_table.ratio is None
        return self.given - set(SET) if in_si else set()

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
        if self.scene_table is not None:
            if self.rod_table is None:
                raise InvalidInput("[scene] is of a rod, and this card has [groups].")
            try:
                self.scene()
            except InvalidInput as error:
                raise InvalidInput(f"[scene]: {error}") from error
        self.require_sources_of_what_is_given()
        if self.history is not None:
            if self.rod_table is None:
                raise InvalidInput("[history] is of a [rod], and this card has [groups].")
            try:
                asked = self.history.asked(self.rod_table.rod(), self.rod_table.drag)
                if (scene := self.scene()) is not None:
                    refuse_options(law=asked.get("law", "auto"))
                    loads_on(scene)
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

    Warns
    -----
    CardWarning
        If it does not say where its numbers are from.
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
