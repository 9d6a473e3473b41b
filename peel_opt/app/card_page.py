"""The page about the format of cards, docs/cards.md, made from the models that read them.

``python -m peel_opt.app.card_page docs/cards.md`` writes it; a test compares it with the file.
"""

from __future__ import annotations

import sys
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from ..base.units import KINDS, Kind
from .bare_numbers import noted_kind
from .calibration_cards import CalibrationCard
from .card_templates import TEMPLATES
from .cards import Card, SourcedCard
from .scene_table import BONDS, MEASURES, PROFILES, SET, SceneTable

HEAD = """\
# Cards

A card is a TOML file with a rod, where its numbers are from, and questions about it. `peel-opt run CARD`
answers them, every command takes its rod by `--card CARD`, and `po.load_card(path)` reads it in Python.
`python -m peel_opt.app.card_page docs/cards.md` makes this page from the models that read cards.

## A card to begin with

```sh
peel-opt new tape.toml --kind sheet
peel-opt run tape.toml
```

The first writes the card below, the second answers it. At a terminal `new` asks for the numbers. Elsewhere,
or with `--examples`, options give them, such as `--E "1.5 GPa" --thickness "40 um"`, and the questions, such
as `--pressure "0.2 MPa"`. What is not given is an example and says so. Questions that are not given suit the
rod. A file that is there stays, unless `--force` is given.

"""

KINDS_OF_CARDS = """
| `--kind` | what is in it |
|---|---|
"""

VALUES = """
## Numbers and units

A number is a text with its unit, `"140 kPa"`. **A plain number, without quotes, is in the SI unit of its
key**, which the tables below name; the heading of the answers lists such numbers. All units of the command
line can be used, among them those of the trades ([command_line.md](command_line.md#units)). In questions,
scenes and histories the rod's own `T0`, `eta` and `y0` are units too: `length = "5.664 y0"`. Of a rod known
by its `ratio` alone lengths are plain numbers in eta, and pressures in T0. An unknown key is an error that
names the one that was meant.

## Where numbers are from

Each number of a rod with units, and of its scene, should have a line under `[sources]`, where it was read, or
under `[estimates]`, how it was guessed. One line `source = "..."` at the top covers all that have none of
their own. What is missing is a warning, and the card is answered: the heading of its answers names the
numbers without a source, the command line says so on stderr, and `po.load_card` warns with `po.CardWarning`.
What somebody sets ({set}) needs none, nor do `ratio` and `[groups]`.

## Problem cards
"""

CALIBRATIONS = """
## Calibration cards

A card with a table `[calibration]` asks for a fit to files beside it, which `peel-opt run` and
`peel-opt calibrate` do. What the files hold: [calibration.md](calibration.md). Its `title`, `note`, `source`,
`[rod]`, `[scene]`, `[sources]` and `[estimates]` are those of problem cards; numbers of the rod and the
scene that are fitted are where the fit begins, and need no source. A scene is fitted to pairs.
"""

#: What stands over the keys of a table.
ABOUT = {
    "": "At the top of the file, before any table; `[sources]` and `[estimates]` are tables.",
    "rod": "Stiffness and bond, or `ratio` alone. A card has this table or `[groups]`.",
    "groups": "The paper's groups in the place of a rod; its one question may be an empty table.",
    "scene": "What acts on the rod beside a uniform pressure, or in its place"
    " ([scenes.md](scenes.md#on-a-card)).\nAny of its numbers may be what a question asks for."
    " Some keys go with a word:\n{words}.",
    "questions": "One table for each question: one of the given numbers, or what is `free` of a scene and\n"
    "what is given beside it.",
    "history": "How the pressure changes in time, which `peel-opt history` follows ([motion.md](motion.md)).",
    "calibration": "What is fitted.",
    "pairs": "One table for each file of lengths and pressures.",
    "shapes": "One table for each file of points of a rod.",
}


def page() -> str:
    """Return the page in Markdown."""
    begin = [HEAD, f"```toml\n{TEMPLATES['sheet'].text()}```\n", KINDS_OF_CARDS]
    kinds = [f"| `{name}` | {kind.about} |\n" for name, kind in TEMPLATES.items()]
    values = VALUES.format(set=", ".join(f"`{name}`" for name in SET))
    common = {"title", "note", "source", "sources", "estimates", "rod", "scene"}
    fits = _sections(CalibrationCard, but=common)
    return "".join([*begin, *kinds, values, *_sections(Card), CALIBRATIONS, *fits])


def _sections(card: type[SourcedCard], but: Container[str] = ()) -> Iterator[str]:
    """Yield a section for what stands at the top of a card, and for each of its tables."""
    keys = {field.alias or name: field for name, field in card.model_fields.items()}
    top = {key: field for key, field in keys.items() if key not in card.tables and key not in but}
    if top:
        yield f"\n### {', '.join(top)}\n\n{ABOUT['']}\n\n{_table(top, card)}"
    for key, table in card.tables.items():
        if key not in but:
            header = f"[[{key}]]" if get_origin(keys[key].annotation) is tuple else f"[{key}]"
            yield f"\n### `{header}`\n\n{ABOUT[key].format(words=_words())}\n\n"
            yield _table(table.model_fields, table)


def _words() -> str:
    """Return which numbers of a scene go with which word."""
    pairs = {
        n: f'{w} = "{k}"' for w, kinds in (("profile", PROFILES), ("bond", BONDS)) for k, n in kinds.items()
    }
    return ",\n".join(f"`{number}` with `{word}`" for number, word in pairs.items() if number)


def _table(fields: Mapping[str, FieldInfo], table: type[BaseModel]) -> str:
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for key, field in fields.items():
        default = "required" if field.is_required() else _shown(field.get_default(call_default_factory=True))
        rows.append(f"| `{key}` | {_value(key, field, table)} | {default} | {field.description} |")
    return "\n".join(rows) + "\n"


def _shown(default: Any) -> str:
    if default in (None, "", {}, ()):
        return "-"
    if isinstance(default, tuple):
        return ", ".join(f"`{one}`" for one in default)
    return f"`{str(default).lower() if isinstance(default, bool) else default}`"


def _value(name: str, field: FieldInfo, table: type[BaseModel]) -> str:
    """Return what may stand behind a key: a unit, words to choose from, or another kind of value."""
    kind, plain = _kind(name, field, table), _plain(field.annotation)
    if kind is not None:
        several = get_origin(plain) is tuple
        return f"{'list of numbers' if several else 'number'}{f' [{kind.si}]' if kind.si else ''}"
    if get_origin(plain) is Literal:
        return ", ".join(f"`{word}`" for word in get_args(plain))
    if get_origin(plain) is dict:
        return "a table of texts"
    named = {str: "text", bool: "`true` or `false`", Any: "number"}
    return named.get(plain, "list of names")


def _kind(name: str, field: FieldInfo, table: type[BaseModel]) -> Kind | None:
    """Return what a number measures; None if it is none, or if that depends on the question."""
    if table is SceneTable:
        return KINDS[MEASURES[name].unit] if name in MEASURES else None
    return noted_kind(field)


def _plain(annotation: Any) -> Any:
    """Return a type without None and without what is noted beside it."""
    for arg in get_args(annotation):
        if get_origin(annotation) is Annotated or type(None) in get_args(annotation):
            return _plain(arg)
    return annotation


def main(argv: list[str]) -> None:
    """Write the page to the file that is named."""
    (path,) = argv
    Path(path).write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
