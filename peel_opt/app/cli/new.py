"""The command ``peel-opt new``: a card to begin with."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ...base.errors import InvalidInput
from .common import OK, AddCommand, chosen, say

if TYPE_CHECKING:
    from ..card_templates import Template

#: Options by the key of a card that they give.
KEYS = {
    "bending_stiffness": ("k", "bending stiffness, such as '23 uN m'"),
    "youngs_modulus": ("E", "Young's modulus of a sheet, such as '1.5 GPa'"),
    "thickness": ("thickness", "of a sheet, such as '40 um'"),
    "poisson_ratio": ("nu", "Poisson's ratio of a sheet"),
    "adhesion_strength": ("T0", "adhesion strength, such as '140 kPa'"),
    "adhesion_range": ("y0", "adhesion range, such as '0.73 mm'"),
    "work_of_separation": ("work", "of separation, such as '100 J/m^2'"),
    "ratio": ("ratio", "eta/y0 alone"),
    "beta0": ("beta0", "of the paper's groups"),
    "lam": ("lam", "of the paper's groups"),
}

#: What the kind of a card is called; the same names as `peel_opt.app.card_templates.TEMPLATES`.
KINDS = ("rod", "sheet", "ratio", "groups", "peel", "scene", "blister", "history", "calibration")


def add_commands(command: AddCommand) -> None:
    """Add ``new`` to the command line."""
    new = command("new", "write a problem card to begin with; at a terminal, ask for its numbers", _new)
    new.add_argument("card", metavar="CARD", help="the file, such as tape.toml")
    new.add_argument("--kind", choices=KINDS, help="what the card is about (sheet, or what the numbers say)")
    new.add_argument("--title", metavar="TEXT", help="what the rod is")
    new.add_argument("--source", metavar="TEXT", help="where the numbers are from")
    numbers = new.add_argument_group("numbers", "in the place of examples")
    for flag, about in KEYS.values():
        numbers.add_argument(f"--{flag}", metavar="VALUE", help=about)
    asked = new.add_argument_group("questions", "in the place of some that suit the rod")
    asked.add_argument("--pressure", metavar="VALUE", help="asks for the length")
    asked.add_argument("--length", metavar="VALUE", help="asks for the pressure")
    asked.add_argument("--flaw", metavar="VALUE", help="asks for the pressure that is safe")
    new.add_argument("--examples", action="store_true", help="ask for nothing, at a terminal as well")
    new.add_argument("--force", action="store_true", help="replace a card that is there")


def _new(arguments: argparse.Namespace) -> int:
    """Write a card that can be answered as it is."""
    import tomllib

    from ...base.files import as_path, make_folder, write_bytes
    from ...base.progress import at_terminal
    from ..calibration_cards import CalibrationCard
    from ..card_templates import TEMPLATES

    path = as_path(arguments.card)
    files = [path]
    given = {key: getattr(arguments, flag) for key, (flag, _) in KEYS.items()}
    given = {key: text for key, text in given.items() if text is not None}
    asks = not arguments.examples and at_terminal(sys.stdin) and at_terminal(sys.stdout)
    kind = arguments.kind or _kind_of(given) or (_asked_kind() if asks else "sheet")
    template = TEMPLATES[kind]
    for key in given:
        if key not in template.takes:
            raise InvalidInput(f"a card of kind {kind} takes no --{KEYS[key][0]}.")
    if template.card is CalibrationCard:
        files.append(path.with_suffix(".csv"))
        if files[1] == path:
            raise InvalidInput(
                "the card of a calibration has its data beside it in a .csv file: name it .toml."
            )
    for file in files:
        _require_new(file, force=arguments.force)
    title, source = arguments.title or "", arguments.source or ""
    if asks:
        title = title or _asked("title", template.title) or template.title
        given |= _asked_numbers(template, given)
        source = source or _asked("where the numbers are from", "nowhere yet")
    questions = chosen(arguments, "pressure", "length", "flaw")
    if questions and not template.asks:
        raise InvalidInput(f"a card of kind {kind} takes no --{next(iter(questions))}.")
    text = template.text(given, questions, title=title, source=source, data=files[-1].name)
    try:
        contents = [content.encode() for content in (text, template.data(given))]
    except UnicodeEncodeError as error:
        raise InvalidInput("--title, --source or a number holds bytes that are no text.") from error
    template.card.checked(path, tomllib.loads(text))
    make_folder(path.parent)
    for file, content in zip(files, contents, strict=False):
        write_bytes(file, content)
    line = shlex.join(["peel-opt", "run", str(path)])
    say(f"wrote {', '.join(map(str, files))}; answer it with: {line}")
    return OK


def _require_new(path: Path, *, force: bool) -> None:
    if path.exists() and not force:
        raise InvalidInput(
            f"{str(path)!r} is there already.", remedy="Name another file, or replace it by --force."
        )


def _kind_of(given: dict[str, str]) -> str:
    """Return the plainest kind of card that the numbers are about; empty if there are none."""
    for kind, keys in (("ratio", {"ratio"}), ("groups", {"beta0", "lam"}), ("rod", {"bending_stiffness"})):
        if keys & set(given):
            return kind
    return "sheet" if given else ""


def _asked_kind() -> str:
    from ..card_templates import TEMPLATES

    say("\n".join(f"  {name:<12} {template.about}" for name, template in TEMPLATES.items()))
    while (kind := _asked("kind", "sheet") or "sheet") not in TEMPLATES:
        say(f"There is no kind {kind!r}.")
    return kind


def _asked_numbers(template: Template, given: dict[str, str]) -> dict[str, str]:
    """Ask for the numbers that are not given; what is left empty stays an example."""
    from ..card_tables import CardTable

    table: type[CardTable] = template.card.tables[template.first]  # type: ignore[assignment]
    found: dict[str, str] = {}
    for key, example in template.numbers(given).items():
        about = str(table.model_fields[key].description).partition(";")[0]
        while key not in given and (text := _asked(f"{key}, {about}", f"{example}, an example")):
            try:
                template.rod(given | found | {key: text})
            except InvalidInput as error:
                say(str(error))
            else:
                found[key] = text
                break
    return found


def _asked(what: str, else_: str) -> str:
    """Ask at the terminal; return an empty text for what is left to ``else_``."""
    try:
        return input(f"{what} [{else_}]: ").strip()
    except EOFError as error:
        raise KeyboardInterrupt from error
