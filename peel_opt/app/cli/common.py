"""What the commands of the command line share; imports no more than the standard library."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ...base.errors import InvalidInput

if TYPE_CHECKING:
    from ...base.units import ShownUnits
    from ...model.rod import Rod
    from ...model.scene import Scene
    from .files import Files

OK, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

_ANSWER = {
    "law": "auto, linear or cohesive",
    "state": "unfolded, middle, lower or folded",
    "method": "auto, series, spectral, collocation or shooting",
}

#: Words over the options of a rod that may be cut from a sheet.
SHEETS = "--k or --E, --thickness, --nu with two of --T0, --y0, --work; or --ratio, or --card"

#: How a rod is described that is cut from a sheet, beside --T0 or --y0.
SHEET = {
    "E": "Young's modulus, such as '1.5 GPa'; with --thickness and --nu in the place of --k",
    "thickness": "of the sheet, such as '40 um' or '1.6 mil'",
    "nu": "Poisson's ratio",
    "work": "of separation, such as '100 J/m^2'; in the place of one of --T0 and --y0",
}

#: What the options of a rod are called in Python.
MATERIAL = {
    "k": "bending_stiffness",
    "T0": "adhesion_strength",
    "y0": "adhesion_range",
    "E": "youngs_modulus",
    "thickness": "thickness",
    "nu": "poisson_ratio",
    "work": "work_of_separation",
}

#: Adds a command: name, what it does, function.
AddCommand = Callable[[str, str, Any], argparse.ArgumentParser]


def rod_options(
    sub: argparse.ArgumentParser,
    ways: str = SHEETS,
    *,
    examples: tuple[str, str, str] = ("23 uN m", "140 kPa", "0.73 mm"),
    ratio: str = "eta/y0 alone; lengths are then in eta, pressures in T0",
) -> None:
    """Add the ways to describe a rod; without words about it, none by its ratio."""
    rod = sub.add_argument_group("rod", ways)
    named = zip(
        ("k", "T0", "y0"), ("bending stiffness", "adhesion strength", "adhesion range"), examples, strict=True
    )
    for flag, words, example in named:
        about = f"{words}, such as '{example}'".replace("%", "%%")
        rod.add_argument(f"--{flag}", metavar="VALUE", help=about)
    for flag, about in SHEET.items():
        rod.add_argument(f"--{flag}", metavar="VALUE", help=about)
    if ratio:
        rod.add_argument("--ratio", metavar="VALUE", help=ratio)
    rod.add_argument("--card", metavar="CARD", help="the rod of a problem card")


def law_option(sub: argparse.ArgumentParser) -> None:
    """Add --law alone: what is read off the states has an error, but no tolerance of its own."""
    sub.add_argument("--law", help=_ANSWER["law"])


def answer_options(
    sub: argparse.ArgumentParser, *names: str, tol: str = "largest error of a certified answer (1e-8)"
) -> None:
    """Add some of --law, --state and --method, and --tol: how a question is answered."""
    for name in names:
        sub.add_argument(f"--{name}", help=_ANSWER[name])
    sub.add_argument("--tol", type=tolerance, help=tol)


def units_option(sub: argparse.ArgumentParser) -> None:
    """Add --units, in which a table is printed."""
    sub.add_argument("--units", metavar="UNITS", help="of what is printed, such as 'mmHg,mm' (SI)")


def output_options(sub: argparse.ArgumentParser, files: str) -> None:
    """Add the options that say where the result goes."""
    sub.add_argument("--json", action="store_true", help="print one JSON document")
    sub.add_argument("--out", metavar="DIR", help=f"also write {files} here")
    sub.add_argument("--no-plot", action="store_true", help="no pictures under --out")
    force_option(sub)


def force_option(sub: argparse.ArgumentParser) -> None:
    """Add --force, which replaces what another command wrote."""
    sub.add_argument("--force", action="store_true", help="replace files of another rod or question")


def shown_units(arguments: argparse.Namespace) -> ShownUnits:
    """Return the units that are asked for by --units.

    Raises
    ------
    InvalidInput
        If they are none, or a document is asked for, which is in SI units.
    """
    from ...base.units import shown_units as read

    if arguments.units is None:
        return read("--units", "")
    if arguments.json:
        raise InvalidInput("--units is of what is printed for people; --json has its own, in its keys.")
    return read("--units", arguments.units)


def chosen(arguments: argparse.Namespace, *names: str) -> dict[str, Any]:
    """Return those of the options that are given."""
    values = {name: getattr(arguments, name) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def by_beta0(arguments: argparse.Namespace) -> bool:
    """Return whether a question is about --beta0, or else about a rod."""
    if (arguments.beta0 is not None) == describes_rod(arguments):
        raise InvalidInput(f"give either --beta0, or a rod {_WAYS}.")
    return arguments.beta0 is not None


def rod_from(arguments: argparse.Namespace) -> Rod:
    """Return the rod that the options describe, in one of three ways; with nothing that acts on it."""
    subject = subject_from(arguments)
    refuse_scene(subject, arguments.card)
    return subject  # type: ignore[return-value]


def subject_from(arguments: argparse.Namespace) -> Rod | Scene:
    """Return the rod that the options describe, or the scene of a card."""
    ways = (material_of(arguments), arguments.ratio is not None, arguments.card is not None)
    if sum(map(bool, ways)) != 1:
        raise InvalidInput(f"give the rod {_WAYS}.")
    if arguments.card is not None:
        return card_subject(arguments.card)
    if arguments.ratio is not None:
        from ...base.checks import parse
        from ...base.units import NUMBER
        from ...model.rod import Rod

        return Rod.from_ratio(parse("--ratio", arguments.ratio, NUMBER))
    return rod_of_material(material_of(arguments))


#: The ways to describe a rod.
_WAYS = "by --k, --T0 and --y0, or by --ratio, or by --card"


def describes_rod(arguments: argparse.Namespace) -> bool:
    """Return whether any of the options says something of a rod."""
    return bool(material_of(arguments)) or arguments.ratio is not None or arguments.card is not None


def material_of(arguments: argparse.Namespace) -> dict[str, str]:
    """Return what is given of the material of a rod, by option."""
    values = {name: getattr(arguments, name, None) for name in ("k", "T0", "y0", *SHEET)}
    return {name: value for name, value in values.items() if value is not None}


def rod_of_material(given: dict[str, str]) -> Rod:
    """Return the rod that its material makes: a stiffness or a sheet, and two of T0, y0 and the work."""
    from ...base.checks import parse
    from ...base.units import LENGTH, NUMBER, PRESSURE, STIFFNESS, WORK
    from ..card_tables import RodTable

    stiffness = given.keys() & {"k", "E", "thickness", "nu"}
    bond = given.keys() & {"T0", "y0", "work"}
    if "k" in stiffness and len(stiffness) > 1:
        raise InvalidInput(
            f"--k is given, and {_flags(stiffness - {'k'})} too.", remedy="Give one or the other."
        )
    if len(bond) > 2:
        raise InvalidInput("--T0, --y0 and --work are given: two of them say the third, T0 y0 / 2 = work.")
    missing = [f"--{n}" for n in ("E", "thickness", "nu") if n not in stiffness] if stiffness - {"k"} else []
    if not stiffness:
        missing = ["--k"]
    missing += [f"--{name}" for name in ("T0", "y0") if name not in bond][: 2 - len(bond)]
    if missing:
        raise InvalidInput(f"a rod needs {' and '.join(missing)} too.")
    kinds = {"k": STIFFNESS, "T0": PRESSURE, "y0": LENGTH}
    kinds |= {"E": PRESSURE, "thickness": LENGTH, "nu": NUMBER, "work": WORK}
    numbers = {
        MATERIAL[name]: parse(f"--{name}", text, kinds[name], signed=name == "nu")
        for name, text in given.items()
    }
    return RodTable.of(numbers).rod()


def _flags(names: set[str]) -> str:
    return " and ".join(f"--{name}" for name in ("E", "thickness", "nu") if name in names)


def refuse_scene(subject: object, path: str | None) -> None:
    """Raise where a card says what acts on its rod, which a command does not take."""
    from ...model.scene import Scene

    if isinstance(subject, Scene):
        raise InvalidInput(
            f"card {path!r} has a [scene], which this command does not cover.",
            remedy="Ask about it with peel-opt run, pressure, length, solve, trace, hysteresis, sweep,"
            " uncertainty or tradeoff.",
        )


def card_subject(path: str) -> Rod | Scene:
    """Return the rod of a problem card, or what acts on it besides."""
    from ..cards import load_card

    card = load_card(path)
    rod = card.rod()
    if rod is None:
        raise InvalidInput(f"card {path!r} has no [rod].")
    return card.scene() or rod


def say(text: str) -> None:
    """Print a result; if nobody reads any more, the work and its files go on in silence."""
    try:
        print(text, flush=True)
    except OSError as error:
        # What is still in the buffer must not raise once more when Python ends.
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - lives as long as the process
        if not isinstance(error, BrokenPipeError):
            raise InvalidInput(f"cannot print the result: {error.strerror}.") from error


def say_written(files: Files, arguments: argparse.Namespace) -> None:
    """Say which files were written: after the result, or beside it where that is one document."""
    if not files.claimed:
        return
    if arguments.json:
        print(files.said(), file=sys.stderr)
    else:
        say(f"\n{files.said()}")


def complain(text: object) -> None:
    """Say on stderr, in one line, what went wrong."""
    print(f"peel-opt: {' '.join(str(text).split())}", file=sys.stderr)


def tolerance(text: str) -> float:
    """Read the value of --tol."""
    value = float(text)
    if not 0.0 < value < 1.0:
        raise argparse.ArgumentTypeError(f"must lie between 0 and 1, got {text.strip()}")
    return value
