"""The command line: ``peel-opt run CARD...``, ``peel-opt pressure``, ``peel-opt length``.

Only the standard library is imported here, so that ``--help`` answers at once.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import __version__
from .errors import InvalidInput, PeelOptError

if TYPE_CHECKING:
    from .report import Folder
    from .rod import Rod

OK, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

EPILOG = """\
exit codes: 0 answered, 1 a question has no answer, 2 wrong input, 130 interrupted

examples:
  peel-opt pressure --length "1.9 mm" --k "23 uN m" --T0 "140 kPa" --y0 "0.73 mm"
  peel-opt length --pressure "0.4 T0" --ratio 0.566
  peel-opt run problems/*.toml --out results
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code."""
    # A terminal that lacks a letter of a title shows its code instead of failing.
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        arguments = _parser().parse_args(argv)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else WRONG_INPUT
    try:
        code: int = arguments.command(arguments)
    except PeelOptError as error:
        _complain(error)
        return WRONG_INPUT if isinstance(error, InvalidInput) else FAILED
    except KeyboardInterrupt:
        _complain("interrupted")
        return INTERRUPTED
    return code


def _run(arguments: argparse.Namespace) -> int:
    """Answer all questions of some cards."""
    from .cards import load_card
    from .report import as_json, as_record, heading, table

    # All cards are read before the first is answered: mistakes show at once.
    cards = [(path, load_card(path)) for path in arguments.cards]
    folder = _folder(arguments)
    code, documents = OK, []
    with _progress(len(cards)) as progress:
        for number, (path, card) in enumerate(cards):
            answers = card.ask(method=arguments.method, tol=arguments.tol)
            if folder is not None:
                folder.add(path, answers)
            progress.clear()
            for label, found in answers:
                if isinstance(found, PeelOptError):
                    _complain(f"{path}: {label}: {found}")
                    code = max(code, WRONG_INPUT if isinstance(found, InvalidInput) else FAILED)
            if arguments.json:
                records = [as_record(label, found) for label, found in answers]
                documents.append({"card": path, "title": card.title, "answers": records})
            else:
                _say(("\n" if number else "") + heading(card, path) + "\n\n" + table(answers))
            progress.update()
    if arguments.json:
        _say(as_json({"cards": documents}))
    return code


def _ask(arguments: argparse.Namespace) -> int:
    """Answer one question about one rod."""
    from .cards import as_question
    from .report import as_json, as_record, sheet

    names = (arguments.given, "law", "state", "near", "tol", "method")
    given = {name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None}
    question, rod = as_question(**given), _rod(arguments)
    label, ask = question.label(rod), question.pose(rod)
    folder = _folder(arguments)
    try:
        found = ask()
    except PeelOptError as error:
        if arguments.json and not isinstance(error, InvalidInput):
            _say(as_json(as_record(label, error)))
        raise
    if folder is not None:
        folder.add("", [(label, found)])
    _say(as_json(as_record(label, found)) if arguments.json else sheet(label, found))
    return OK


def _rod(arguments: argparse.Namespace) -> Rod:
    """Return the rod that the options describe, in one of three ways."""
    from .quantities import LENGTH, NUMBER, PRESSURE, STIFFNESS, parse
    from .rod import Rod

    numbers = {"--k": arguments.k, "--T0": arguments.T0, "--y0": arguments.y0}
    given = [flag for flag, value in numbers.items() if value is not None]
    ways = (bool(given), arguments.ratio is not None, arguments.card is not None)
    if sum(ways) != 1:
        raise InvalidInput("give the rod by --k, --T0 and --y0, or by --ratio, or by --card.")
    if arguments.card is not None:
        from .cards import load_card

        rod = load_card(arguments.card).rod()
        if rod is None:
            raise InvalidInput(f"card {arguments.card!r} has no [rod].")
        return rod
    if arguments.ratio is not None:
        return Rod.from_ratio(parse("--ratio", arguments.ratio, NUMBER))
    if missing := [flag for flag in numbers if flag not in given]:
        raise InvalidInput(f"a rod needs {' and '.join(missing)} too.")
    kinds = (STIFFNESS, PRESSURE, LENGTH)
    return Rod(*(parse(flag, text, kind) for (flag, text), kind in zip(numbers.items(), kinds, strict=True)))


def _folder(arguments: argparse.Namespace) -> Folder | None:
    from .report import Folder

    return None if arguments.out is None else Folder(arguments.out, pictures=not arguments.no_plot)


def _progress(total: int) -> Any:
    """Return a bar on stderr, shown for several cards and to people only."""
    from tqdm import tqdm

    return tqdm(total=total, unit="card", leave=False, disable=total < 2 or not sys.stderr.isatty())


def _say(text: str) -> None:
    """Print a result; if nobody reads any more, the work and its files go on in silence."""
    try:
        print(text, flush=True)
    except OSError as error:
        # What is still in the buffer must not raise once more when Python ends.
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - lives as long as the process
        if not isinstance(error, BrokenPipeError):
            raise InvalidInput(f"cannot print the result: {error.strerror}.") from error


def _complain(text: object) -> None:
    print(f"peel-opt: {' '.join(str(text).split())}", file=sys.stderr)


def _tolerance(text: str) -> float:
    value = float(text)
    if not 0.0 < value < 1.0:
        raise argparse.ArgumentTypeError(f"must lie between 0 and 1, got {text}")
    return value


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

    def common(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--method", help="auto, shooting or spectral")
        sub.add_argument("--tol", type=_tolerance, help="largest error of a certified answer (1e-8)")
        sub.add_argument("--json", action="store_true", help="print one JSON document")
        sub.add_argument("--out", metavar="DIR", help="also write NPZ, CSV and a picture of each answer here")
        sub.add_argument("--no-plot", action="store_true", help="no pictures under --out")

    run = command("run", "answer the questions of problem cards", _run)
    run.add_argument("cards", nargs="+", metavar="CARD", help="a TOML file such as those in problems/")
    common(run)

    for asked, given, text, example in (
        ("pressure", "length", "the pressure that holds a detached length", "1.9 mm"),
        ("length", "pressure", "the detached length that a pressure holds", "60 kPa"),
    ):
        sub = command(asked, text, _ask)
        sub.set_defaults(given=given)
        sub.add_argument(f"--{given}", required=True, metavar="VALUE", help=f"such as '{example}'")
        rod = sub.add_argument_group("rod", "--k, --T0 and --y0, or --ratio, or --card")
        rod.add_argument("--k", metavar="VALUE", help="bending stiffness, such as '23 uN m'")
        rod.add_argument("--T0", metavar="VALUE", help="adhesion strength, such as '140 kPa'")
        rod.add_argument("--y0", metavar="VALUE", help="adhesion range, such as '0.73 mm'")
        rod.add_argument(
            "--ratio", metavar="R", help="eta/y0 alone; lengths are then in eta, pressures in T0"
        )
        rod.add_argument("--card", metavar="CARD", help="the rod of a problem card")
        sub.add_argument("--law", help="auto, linear or cohesive")
        sub.add_argument("--state", help="unfolded, middle, lower or folded")
        sub.add_argument("--near", metavar="VALUE", help=f"pick the state with the nearest {asked}")
        common(sub)
    return parser
