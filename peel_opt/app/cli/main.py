"""The command line: ``peel-opt run CARD...``, and the commands for one question.

Only the standard library is imported here, so that ``--help`` answers at once.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr
from typing import TYPE_CHECKING, Any

from ... import __version__
from ...base.errors import CardWarning, InvalidInput, PeelOptError
from . import curves, explore, flaws, measurements, motions, new, peels, precision, sweeps
from .common import (
    FAILED,
    INTERRUPTED,
    OK,
    WRONG_INPUT,
    answer_options,
    chosen,
    complain,
    output_options,
    rod_options,
    say,
    say_written,
    shown_units,
    subject_from,
    units_option,
)
from .files import Files, out_files

if TYPE_CHECKING:
    from ..calibration_cards import CalibrationCard
    from ..cards import Card
    from ..report import Answered

EPILOG = """\
exit codes: 0 answered, 1 a question has no answer, 2 wrong input, 130 interrupted

examples:
  peel-opt pressure --length "1.9 mm" --k "23 uN m" --T0 "140 kPa" --y0 "0.73 mm"
  peel-opt length --pressure "0.4 T0" --ratio 0.566
  peel-opt length --pressure "45 cmH2O" --E "3 GPa" --thickness "1 mil" --nu 0.4 --T0 "9 kPa" --y0 "0.1 mm"
  peel-opt new tape.toml --kind sheet
  peel-opt flaw --card problems/office_tape.toml --pressure "0.2 MPa"
  peel-opt peel --pull "6 N/25 mm" --angle "180 deg"
  peel-opt solve --card problems/peel_test.toml --free force --length "12 mm"
  peel-opt run problems/*.toml --out results
  peel-opt trace --beta0 4 --lam -1 3
  peel-opt hysteresis --card problems/office_tape.toml
  peel-opt snap problems/aortic_flap.toml --drag "20 kPa s/m" --out results
  peel-opt history problems/flap_reloaded.toml --out results
  peel-opt sweep --ratio 0.5:10:5 --pressure-ratio 0.5:0.9:5 --out results/sweep
  peel-opt uncertainty --card problems/aortic_flap.toml --length "1.9 mm" --T0 "+- 10 %"
  peel-opt calibrate problems/calibrate_flap.toml
  peel-opt tradeoff --beta0 4 --lam 1
  peel-opt explore problems/office_tape.toml
  peel-opt figures 5 8 --out figures
"""

#: A value that argparse may take for an option: "-5e-1" (before Python 3.14), "-0.05:3:50", "-inf".
_NEGATIVE = re.compile(r"-(?:\.?\d|inf|nan).*", re.IGNORECASE | re.DOTALL)
#: An option and the first of its numbers in one word: "--lam=-5e-1".
_JOINED = re.compile(r"(--[a-zA-Z][\w-]*)=([-+]?(?:\.?\d|inf|nan).*)", re.IGNORECASE | re.DOTALL)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    if sys.stderr is None:  # it is closed: print and argparse would take stdout instead
        with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stderr(nowhere):
            return main(argv)
    # A terminal that lacks a letter of a title shows its code instead of failing.
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    words = sys.argv[1:] if argv is None else argv
    try:
        arguments = _parsed(words or ["--help"])
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else WRONG_INPUT
    try:
        with _drawing(arguments), _warning_in_one_line():
            code: int = arguments.command(arguments)
    except PeelOptError as error:
        complain(error)
        return WRONG_INPUT if isinstance(error, InvalidInput) else FAILED
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED
    return code


@contextmanager
def _warning_in_one_line() -> Iterator[None]:
    """Say what a card lacks as the command line says everything, once for each card."""
    said: set[str] = set()

    def say_once(message: Warning | str, category: type[Warning], *place: Any, **further: Any) -> None:
        if not issubclass(category, CardWarning):
            shown_otherwise(message, category, *place, **further)
        elif str(message) not in said:
            said.add(str(message))
            complain(f"warning: {message}")

    with warnings.catch_warnings():
        shown_otherwise = warnings.showwarning
        warnings.showwarning = say_once
        warnings.filterwarnings("always", category=CardWarning)
        yield


@contextmanager
def _drawing(arguments: argparse.Namespace) -> Iterator[None]:
    """Let pictures depend on no setting of Matplotlib that this machine cannot follow.

    They need no backend, and under a wrong name of one Matplotlib cannot even be imported; texts
    are set by Matplotlib itself where there is no LaTeX.
    """
    named = os.environ.pop("MPLBACKEND", None)
    try:
        if getattr(arguments, "out", None) and not getattr(arguments, "no_plot", False):
            import matplotlib as mpl

            from ...plots.axes import apart_from_pyplot

            with apart_from_pyplot(), mpl.rc_context({} if shutil.which("latex") else {"text.usetex": False}):
                yield
        else:
            yield
    finally:
        if named is not None:
            os.environ["MPLBACKEND"] = named


def _parsed(argv: Sequence[str]) -> argparse.Namespace:
    """Read the command line; a word that begins like a negative number is a value, never an option.

    What begins with a space is no option to argparse, so these words get one on their way in.
    """
    words: list[str] = []
    for word in argv:
        joined = _JOINED.fullmatch(word)
        words += joined.groups() if joined else (word,)
    arguments = _parser().parse_args([f" {word}" if _NEGATIVE.fullmatch(word) else word for word in words])
    arguments.line = shlex.join(["peel-opt", *argv])
    for name, value in vars(arguments).items():
        setattr(arguments, name, [*map(_plain, value)] if isinstance(value, list) else _plain(value))
    return arguments


def _plain(value: Any) -> Any:
    """Return a value of the command line as it was typed."""
    padded = isinstance(value, str) and value.startswith(" ") and _NEGATIVE.fullmatch(value[1:])
    return value[1:] if padded else value


def _run(arguments: argparse.Namespace) -> int:
    """Answer all questions of some cards; a calibration card asks for a fit."""
    from ...base.progress import progress
    from ..any_card import load_any
    from ..cards import Card
    from ..report import as_json, as_record, heading, summary_stem, table, write_summary

    # All cards are read before the first is answered: mistakes show at once.
    cards = [(path, load_any(path)) for path in arguments.cards]
    for path, card in cards:
        if not isinstance(card, Card) and chosen(arguments, "method", "tol"):
            raise InvalidInput(f"{path!r} is a calibration, which takes neither --method nor --tol.")
    shown = shown_units(arguments)
    files, names = _card_files(arguments, cards)
    answered: list[tuple[str, Answered]] = []
    code, documents = OK, []
    # Elsewhere the answers themselves say how far it is.
    with progress("card", len(cards), None if arguments.json else False) as step:
        for number, (path, card) in enumerate(cards):
            if not isinstance(card, Card):
                from .measurements import fit_card

                fit_code, document = fit_card(path, card, arguments, before="\n" if number else "")
                code = max(code, fit_code)
                documents.append(document)
                step()
                continue
            answers = card.ask(method=arguments.method, tol=arguments.tol)
            answered += [(path, one) for one in answers]
            for stem, (_, found) in zip(names[number], answers, strict=True):
                if not isinstance(found, PeelOptError):
                    files.add(found, stem)
            if files:
                write_summary(answered, files.folder / f"{summary_stem(arguments.cards)}.csv")
            for label, found in answers:
                if isinstance(found, PeelOptError):
                    complain(f"{path}: {label}: {found}")
                    code = max(code, WRONG_INPUT if isinstance(found, InvalidInput) else FAILED)
            if arguments.json:
                records = [as_record(label, found) for label, found in answers]
                documents.append({"card": path, "title": card.title, "answers": records})
            else:
                say(("\n" if number else "") + heading(card, path, shown) + "\n\n" + table(answers, shown))
            step()
    if arguments.json:
        say(as_json({"cards": documents}))
    say_written(files, arguments)
    return code


def _card_files(
    arguments: argparse.Namespace, cards: Sequence[tuple[str, Card | CalibrationCard]]
) -> tuple[Files, list[list[str]]]:
    """Claim the files of all questions, and of the table of them; return their names by card."""
    from ..cards import Card
    from ..report import stems, summary_stem

    files = out_files(arguments)
    asked = [
        (path, [(card.problem, q.asked) for q in card.questions], card.labels())
        for path, card in cards
        if isinstance(card, Card)
    ]
    names = stems([(path, labels) for path, _, labels in asked])
    if asked:
        for (_, questions, _), found in zip(asked, names, strict=True):
            for question, stem in zip(questions, found, strict=True):
                files.claim_kinds(question, stem)
        files.claim([questions for _, questions, _ in asked], f"{summary_stem(arguments.cards)}.csv")
    in_order = iter(names)
    return files, [next(in_order) if isinstance(card, Card) else [] for _, card in cards]


def _ask(arguments: argparse.Namespace) -> int:
    """Answer one question about one rod, or about the scene of a card."""
    from ..cards import as_question
    from ..report import as_json, as_record, sheet, stems

    question, subject = as_question(**chosen(arguments, *arguments.asks)), subject_from(arguments)
    label, ask, shown = question.label(subject), question.pose(subject), shown_units(arguments)
    files, ((stem,),) = out_files(arguments), stems([(arguments.card or "", [label])])
    files.claim_kinds((subject, question.asked), stem)
    try:
        found = ask()
    except PeelOptError as error:
        if arguments.json and not isinstance(error, InvalidInput):
            say(as_json(as_record(label, error)))
        raise
    files.add(found, stem)
    say(as_json(as_record(label, found)) if arguments.json else sheet(label, found, shown))
    say_written(files, arguments)
    return OK


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="peel-opt",
        description="Equilibria of a rod peeled off a plate by pressure, each with its certificate.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, text: str, function: Any) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text, allow_abbrev=False)
        sub.set_defaults(command=function)
        return sub

    files = "NPZ, CSV and a picture of each answer"
    run = command("run", "answer the questions of problem cards", _run)
    run.add_argument("cards", nargs="+", metavar="CARD", help="a TOML file such as those in problems/")
    answer_options(run, "method")
    units_option(run)
    output_options(run, files)

    for asked, given, text, example in (
        ("pressure", "length", "the pressure that holds a detached length", "1.9 mm"),
        ("length", "pressure", "the detached length that a pressure holds", "60 kPa"),
    ):
        sub = command(asked, text, _ask)
        sub.set_defaults(asks=(given, "law", "state", "near", "tol", "method"))
        sub.add_argument(f"--{given}", required=True, metavar="VALUE", help=f"such as '{example}'")
        rod_options(sub)
        sub.add_argument("--near", metavar="VALUE", help=f"pick the state with the nearest {asked}")
        answer_options(sub, "law", "state", "method")
        units_option(sub)
        output_options(sub, files)
    solve = command("solve", "the one number of a card's scene that is left free", _ask)
    solve.set_defaults(asks=("free", "pressure", "length", "state", "near", "tol"))
    solve.add_argument("--free", required=True, metavar="NAME", help="such as force, weight or length")
    for given in ("pressure", "length"):
        solve.add_argument(f"--{given}", metavar="VALUE", help="what is given; without a pressure, none")
    rod_options(solve)
    solve.add_argument("--near", metavar="VALUE", help="pick the state in which it is nearest to this")
    answer_options(solve, "state")
    units_option(solve)
    output_options(solve, files)
    for module in (new, flaws, peels, curves, motions, measurements, sweeps, precision, explore):
        module.add_commands(command)
    return parser
