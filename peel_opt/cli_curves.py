"""The commands that compute curves: ``peel-opt trace`` and ``peel-opt figures``."""

from __future__ import annotations

import argparse
from typing import Any

from .cli_common import OK, AddCommand, has_rod, rod_from, rod_options, say, tolerance
from .errors import InvalidInput


def add_commands(command: AddCommand) -> None:
    """Add ``trace`` and ``figures`` to the command line."""
    trace = command("trace", "a whole branch of equilibria with its special points", _trace)
    trace.add_argument("--beta0", type=float, metavar="B", help="trace at this beta0 instead of for a rod")
    trace.add_argument(
        "--lam", nargs=2, type=float, metavar=("LO", "HI"), help="window of lambda (with --beta0)"
    )
    rod_options(trace)
    trace.add_argument("--law", help="linear or cohesive")
    trace.add_argument("--mode", type=int, default=1, help="2, 3, ... for the branches from (mode pi)^4")
    trace.add_argument("--points", type=int, metavar="N", help="least number of points (128)")
    trace.add_argument("--tol", type=tolerance, help="largest error of a point (1e-10)")
    trace.add_argument("--json", action="store_true", help="print one JSON document")
    trace.add_argument("--out", metavar="DIR", help="also write NPZ, CSV and a picture here")
    trace.add_argument("--no-plot", action="store_true", help="no picture under --out")

    figures = command("figures", "the figures of the paper, recomputed, and charts beyond them", _figures)
    figures.add_argument("names", nargs="*", metavar="N", help="4 to 10, p-min, fold-curve; by default all")
    figures.add_argument("--out", metavar="DIR", default="figures", help="where PDF and PNG go (figures)")
    figures.add_argument("--points", type=int, metavar="N", help="points on each curve")


def _trace(arguments: argparse.Namespace) -> int:
    """Trace a branch, print its special points, and write it."""
    if (arguments.beta0 is not None) == has_rod(arguments):
        raise InvalidInput("give either --beta0, or a rod by --k, --T0 and --y0, --ratio or --card.")
    if arguments.lam is not None and arguments.beta0 is None:
        raise InvalidInput(
            "--lam is the window of a branch at fixed --beta0; a rod's branch is traced whole."
        )
    names = ("law", "mode", "points", "tol")
    options: dict[str, Any] = {
        name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None
    }
    if arguments.beta0 is not None:
        options["beta0"] = arguments.beta0
        if arguments.lam is not None:
            options["lam"] = tuple(arguments.lam)
    else:
        options["rod"] = rod_from(arguments)

    from .branch_report import branch_record, special_table, write_branch
    from .report import as_json, make_folder

    # Known before any work is done.
    folder = None if arguments.out is None else make_folder(arguments.out)
    from .tracing import trace

    branch = trace(**options)
    if folder is not None:
        branch = write_branch(branch, folder, picture=not arguments.no_plot)
    say(as_json(branch_record(branch)) if arguments.json else special_table(branch))
    return OK


def _figures(arguments: argparse.Namespace) -> int:
    """Write figures and say where they are."""
    from .figures import make

    for path in make(arguments.names, arguments.out, points=arguments.points):
        say(str(path))
    return OK
