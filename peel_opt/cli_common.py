"""What the commands of the command line share; imports no more than the standard library."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .errors import InvalidInput

if TYPE_CHECKING:
    from .rod import Rod

OK, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

#: Adds a command: name, what it does, function.
AddCommand = Callable[[str, str, Any], argparse.ArgumentParser]


def rod_options(sub: argparse.ArgumentParser) -> None:
    """Add the three ways to describe a rod."""
    rod = sub.add_argument_group("rod", "--k, --T0 and --y0, or --ratio, or --card")
    rod.add_argument("--k", metavar="VALUE", help="bending stiffness, such as '23 uN m'")
    rod.add_argument("--T0", metavar="VALUE", help="adhesion strength, such as '140 kPa'")
    rod.add_argument("--y0", metavar="VALUE", help="adhesion range, such as '0.73 mm'")
    rod.add_argument("--ratio", metavar="R", help="eta/y0 alone; lengths are then in eta, pressures in T0")
    rod.add_argument("--card", metavar="CARD", help="the rod of a problem card")


def has_rod(arguments: argparse.Namespace) -> bool:
    """Whether any of the options of `rod_options` is given."""
    options = (arguments.k, arguments.T0, arguments.y0, arguments.ratio, arguments.card)
    return any(value is not None for value in options)


def rod_from(arguments: argparse.Namespace) -> Rod:
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


def say(text: str) -> None:
    """Print a result; if nobody reads any more, the work and its files go on in silence."""
    try:
        print(text, flush=True)
    except OSError as error:
        # What is still in the buffer must not raise once more when Python ends.
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - lives as long as the process
        if not isinstance(error, BrokenPipeError):
            raise InvalidInput(f"cannot print the result: {error.strerror}.") from error


def complain(text: object) -> None:
    """Say on stderr, in one line, what went wrong."""
    print(f"peel-opt: {' '.join(str(text).split())}", file=sys.stderr)


def tolerance(text: str) -> float:
    """Read the value of --tol."""
    value = float(text)
    if not 0.0 < value < 1.0:
        raise argparse.ArgumentTypeError(f"must lie between 0 and 1, got {text}")
    return value
