"""Answers for people and for programs: text, JSON, and files of their own."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import unicodedata
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ..analysis.loading import loading_curve
from ..analysis.unbonded import FlawLimit
from ..base.errors import PeelOptError
from ..base.files import write_bytes
from ..base.units import ShownUnits, display
from ..equilibria.result import Equilibrium
from ..model.named_laws import law_named
from ..model.rod import Rod
from ..model.scene import Scene
from .card_tables import one_line
from .cards import Card
from .questions import Answer
from .scene_report import (
    DIGITS,
    describe_scene,
    flaw_cells,
    flaw_record,
    found_numbers,
    number,
    quantity,
    scene_record,
)

#: A question's label and what came of it.
Answered = tuple[str, Answer | PeelOptError]


def describe_rod(rod: Rod, shown: ShownUnits | None = None) -> str:
    """Return the rod in one line, with units unless it has only its own."""
    if rod.dimensionless:
        return f"eta/y0 = {rod.ratio:.6g}"
    named = (
        ("k", rod.bending_stiffness, "N m"),
        ("T0", rod.adhesion_strength, "Pa"),
        ("y0", rod.adhesion_range, "m"),
        ("eta", rod.eta, "m"),
    )
    values = [f"{symbol} = {display(value, unit, 4, shown)}" for symbol, value, unit in named]
    return ", ".join([*values, f"eta/y0 = {rod.ratio:.4g}"])


def cells(found: Answer, shown: ShownUnits | None = None) -> dict[str, str]:
    """Return what a reader wants to know of an answer, as texts by title."""
    return flaw_cells(found, shown) if isinstance(found, FlawLimit) else _cells_of_a_state(found, shown)


def _cells_of_a_state(eq: Equilibrium, shown: ShownUnits | None) -> dict[str, str]:
    found: dict[str, str] = {}
    if eq.rod is None:
        found |= {"alpha": number(eq.alpha), "alpha1": number(eq.alpha1), "beta0": f"{eq.beta0:g}"}
        found |= {"lambda": f"{eq.lam:g}"}
    elif not eq.rod.dimensionless:
        found |= {"pressure": display(eq.pressure, "Pa", DIGITS, shown)}
        found |= {"length": display(eq.length, "m", DIGITS, shown)}
    if eq.rod is not None and (own := found_numbers(eq)):
        found["with"] = ", ".join(
            f"{name} = {quantity(eq.rod, *value, shown=shown)}" for name, value in own.items()
        )
    return found | {
        "p/T0": number(eq.pressure_ratio),
        "sbar/eta": number(eq.length_ratio),
        "state": eq.state,
        "law": eq.law,
        "status": eq.status,
        "error": f"{eq.error:.1e}",
        "certificate": f"{eq.certificate:.1e}",
        "flags": ", ".join(eq.flags) or "-",
    }


def table(answers: Sequence[Answered], shown: ShownUnits | None = None) -> str:
    """Return one line for each question; the error column belongs to p/T0, sbar/eta or alpha1."""
    rows: list[dict[str, str]] = [
        {"question": label}
        | ({"status": found.status, "flags": "-"} if isinstance(found, PeelOptError) else cells(found, shown))
        for label, found in answers
    ]
    fullest = max(rows, key=len)
    titles = list(fullest)  # it has the titles of all others, in order
    return aligned([titles] + [[row.get(title, "-") for title in titles] for row in rows])


def aligned(lines: Sequence[Sequence[str]]) -> str:
    """Return rows of texts as columns that start below each other."""
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return "\n".join(
        "  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def settled(value: float) -> str:
    """Write a number of a curve, of which rounding near zero is left out."""
    return f"{0.0 if abs(value) < 1e-12 else value:.10g}"


def sheet(label: str, answer: Answer, shown: ShownUnits | None = None) -> str:
    """Return one answer, a line for each number."""
    found = {} if answer.rod is None else {"rod": describe_rod(answer.rod, shown)}
    if isinstance(answer, Equilibrium) and isinstance(answer.scene, Scene):
        found["scene"] = describe_scene(answer.scene, shown)
    found |= cells(answer, shown)
    width = max(map(len, found))
    return "\n".join([label, *(f"  {title.ljust(width)}  {text}" for title, text in found.items())])


def heading(card: Card, path: str, shown: ShownUnits | None = None) -> str:
    """Return what the answers of a card are about, and what its numbers rest on."""
    lines = [f"{one_line(card.title)}  ({path})"]
    rod, scene = card.rod(), card.scene()
    if rod is not None:
        lines.append(f"  {describe_rod(rod, shown)}")
    if scene is not None:
        lines.append(f"  scene: {describe_scene(scene, shown)}")
    for word, fields in (("sourced", card.sources), ("estimated", card.estimates)):
        if fields:
            lines.append(f"  {word}: {', '.join(fields)}")
    if card.source:
        others = "others from" if card.sources or card.estimates else "all numbers from"
        lines.append(f"  {others}: {one_line(card.source)}")
    if card.unsourced:
        lines.append(f"  without a source: {', '.join(card.unsourced)}")
    if card.bare:
        lines.append(f"  numbers without a unit are in SI: {', '.join(card.bare)}")
    if card.note:
        lines.append(f"  note: {one_line(card.note)}")
    return "\n".join(lines)


def as_record(label: str, found: Answer | PeelOptError) -> dict[str, Any]:
    """Return an answer, or why there is none, as plain data."""
    if isinstance(found, Equilibrium):
        return {"question": label, **found.summary(), **scene_record(found)}
    if isinstance(found, FlawLimit):
        return {"question": label, **flaw_record(found)}
    return {"question": label, "status": found.status, "message": str(found), "nearest": found.nearest}


def as_json(document: Any) -> str:
    """Return data as JSON in ASCII; NaN and infinity, which JSON lacks, become null."""
    return json.dumps(_without_nan(document), indent=2, allow_nan=False)


def stems(cards: Sequence[tuple[str, Sequence[str]]]) -> list[list[str]]:
    """Return one name for the files of each answer, by card and label, no two the same.

    Examples
    --------
    >>> stems([("problems/a.toml", ["length at 60 kPa", "length at 60 kPa!", "summary"])])
    [['a-length-at-60-kpa', 'a-length-at-60-kpa-2', 'a-summary-2']]
    """
    taken = {summary_stem([card]) for card, _ in cards} | {"summary"}
    found: list[list[str]] = []
    for card, labels in cards:
        found.append([])
        for label in labels:
            name = wanted = f"{slug(Path(card).stem)}-{slug(label)}" if card else slug(label)
            count = 1
            while name in taken:
                count += 1
                name = f"{wanted}-{count}"
            taken.add(name)
            found[-1].append(name)
    return found


def summary_stem(cards: Sequence[str]) -> str:
    """Return the name of the table of all answers: that of the card, if there is one card only."""
    return f"{slug(Path(cards[0]).stem)}-summary" if len(cards) == 1 else "summary"


def write_result(result: Any, folder: Path, stem: str, *, picture: bool = True, title: str = "") -> None:
    """Write NPZ, CSV and a picture of a result that is `Stored`; of a flaw, how it opens up to its snap.

    Raises
    ------
    InvalidInput
        If a file cannot be written.
    """
    if isinstance(result, FlawLimit):
        result = loading_curve(result.rod, result.flaw, law=law_named(result.law) or "auto")
    result.save(folder / f"{stem}.npz")
    result.to_csv(folder / f"{stem}.csv")
    if picture:
        save_picture(result, folder / f"{stem}.png", title)


def save_picture(result: Any, path: Path, title: str = "") -> Path:
    """Write what a result plots, under a title if there is one."""
    from ..plots import save_figure

    figure = result.plot().figure
    if title:
        figure.suptitle(title, fontsize="medium")
    return save_figure(figure, path)


def write_summary(answers: Sequence[tuple[str, Answered]], path: Path) -> None:
    """Write a table with one line for each question, of the cards named before them.

    Raises
    ------
    InvalidInput
        If the file cannot be written.
    """
    rows: list[dict[str, Any]] = [{"card": card, **as_record(*answered)} for card, answered in answers]
    columns = list(dict.fromkeys(["card", "question", "status", *(key for row in rows for key in row)]))
    joined = (row | {"flags": ", ".join(row["flags"])} if "flags" in row else row for row in rows)
    write_rows(joined, columns, path)


def write_rows(rows: Iterable[dict[str, Any]], columns: Sequence[str], path: Path) -> None:
    """Write some columns of rows as CSV, empty where a row has none.

    Raises
    ------
    InvalidInput
        If the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n", extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    # The name of a card may hold bytes that are no text: they are shown by their codes.
    write_bytes(path, text.getvalue().encode("utf-8", "backslashreplace"))


def slug(text: str) -> str:
    """Return a text as part of a file name that is safe everywhere.

    Examples
    --------
    >>> slug("../Length at 60 kPa")
    'length-at-60-kpa'
    """
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9.]+", "-", plain)[:60].strip("-.") or "answer"


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
