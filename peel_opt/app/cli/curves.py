"""The commands that compute curves: ``peel-opt trace``, ``hysteresis`` and ``figures``."""

from __future__ import annotations

import argparse
from typing import Any

from ...base.errors import InvalidInput
from .common import (
    FAILED,
    OK,
    AddCommand,
    answer_options,
    by_beta0,
    chosen,
    complain,
    force_option,
    output_options,
    rod_options,
    say,
    say_written,
    subject_from,
)
from .files import Files, named, out_files

#: What `peel_opt.plots.figures` draws.
NAMES = "3 to 10, p-min, held-lengths, fold-curve, method-map, work-precision"

#: What is written of a curve.
FILES = "NPZ, CSV and a picture"

#: Where the states of a loop at fixed beta0 come from: "solver", or the normal form of this name.
FORMS = ("solver", "paper", "exact", "uniform")


def add_commands(command: AddCommand) -> None:
    """Add ``trace``, ``hysteresis`` and ``figures`` to the command line."""
    trace = command("trace", "a whole branch of equilibria with its special points", _trace)
    trace.add_argument("--beta0", type=float, metavar="B", help="trace at this beta0 instead of for a rod")
    trace.add_argument(
        "--lam", nargs=2, type=float, metavar=("LO", "HI"), help="window of lambda (with --beta0)"
    )
    rod_options(trace)
    trace.add_argument("--mode", type=int, default=1, help="2, 3, ... for the branches from (mode pi)^4")
    trace.add_argument("--points", type=int, metavar="N", help="least number of points (128)")
    answer_options(trace, "law", tol="largest error of a point (1e-10)")
    output_options(trace, FILES)

    loop = command("hysteresis", "what a rod does when the load is swept up and back down", _hysteresis)
    loop.add_argument("--beta0", type=float, metavar="B", help="sweep lambda at this beta0, not a rod's p")
    loop.add_argument("--lam", nargs=2, type=float, metavar=("LO", "HI"), help="what is swept (with --beta0)")
    rod_options(loop)
    loop.add_argument("--convention", choices=("delay", "maxwell"), help="when a state is given up (delay)")
    loop.add_argument("--form", choices=FORMS, help="solve for the states, or read them off a normal form")
    loop.add_argument("--points", type=int, metavar="N", help="values of the swept number each way (41)")
    answer_options(loop, tol="largest error of a solved state (1e-10; of a rod 1e-8)")
    output_options(loop, FILES)

    figures = command("figures", "the figures of the paper, recomputed, and charts beyond them", _figures)
    figures.add_argument("names", nargs="*", metavar="N", help=f"of {NAMES}; by default all")
    figures.add_argument("--out", metavar="DIR", default="figures", help="where PDF and PNG go (figures)")
    figures.add_argument("--points", type=int, metavar="N", help="points on each curve")
    force_option(figures)


def _asked(arguments: argparse.Namespace, names: tuple[str, ...], whole: str) -> dict[str, Any]:
    """Return the options that are given, with what they are about: --beta0, a rod, or the scene of a card."""
    options = chosen(arguments, *names)
    if not by_beta0(arguments):
        if arguments.lam is not None:
            raise InvalidInput(f"--lam goes with a fixed --beta0; {whole}.")
        return options | {"rod": subject_from(arguments)}
    if arguments.lam is not None:
        options["lam"] = tuple(arguments.lam)
    return options | {"beta0": arguments.beta0}


def _trace(arguments: argparse.Namespace) -> int:
    """Trace a branch, print its special points, and write it."""
    options = _asked(arguments, ("law", "mode", "points", "tol"), "a rod's branch is traced whole")

    from ...continuation.landing import UNFINISHED
    from ...equilibria.trace import trace
    from ..branch_report import branch_record, branch_stem, special_table
    from ..report import as_json

    files = out_files(arguments)
    if arguments.card:
        stem = named("branch", arguments)
    else:
        stem = branch_stem(options.get("rod"), options.get("beta0"), arguments.mode)
    stem = _claimed(files, "trace", options, stem)
    branch = trace(**options)
    if files and files.pictures:
        branch = branch.with_stability()  # the picture shows it, and then it is stored too
    files.add(branch, stem)
    say(as_json(branch_record(branch)) if arguments.json else special_table(branch))
    say_written(files, arguments)
    if branch.ended in UNFINISHED:
        complain(f"the branch goes on where its walk ended ({branch.ended})")
        return FAILED
    return OK


def _hysteresis(arguments: argparse.Namespace) -> int:
    """Sweep a load up and down, print the jumps and the area, and write the states."""
    names = ("convention", "points", "tol")
    options = _asked(arguments, names, "a rod is swept from below its least pressure to T0")
    if arguments.form not in (None, "solver"):
        if arguments.tol is not None:
            raise InvalidInput(f"--tol is about solved states; the normal form {arguments.form!r} has none.")
        from ...analysis.normal_form import NormalForm

        options["form"] = getattr(NormalForm, arguments.form)()

    from ...analysis.hysteresis import hysteresis
    from ..hysteresis_report import loop_record, loop_stem, loop_table, write_loop
    from ..report import as_json

    files = out_files(arguments)
    if arguments.card:
        stem = named("hysteresis", arguments)
    else:
        stem = loop_stem(options.get("rod"), options.get("beta0"), arguments.convention, arguments.form)
    _claimed(files, "hysteresis", options | {"form": arguments.form}, stem)
    loop = hysteresis(**options)
    if files:
        write_loop(loop, files.folder, stem, picture=files.pictures)
    say(as_json(loop_record(loop)) if arguments.json else loop_table(loop))
    say_written(files, arguments)
    return OK


def _claimed(files: Files, command: str, options: dict[str, Any], stem: str) -> str:
    """Claim the files of a curve, whichever way it is computed; return their name."""
    asked = {name: value for name, value in options.items() if name not in ("points", "tol")}
    return files.claim_kinds({command: asked}, stem)


def _figures(arguments: argparse.Namespace) -> int:
    """Write figures and say where they are."""
    from ...plots.figures import FORMATS, make, stems

    files = out_files(arguments)
    for stem in stems(arguments.names):
        files.claim({"figure": stem}, *(f"{stem}.{form}" for form in FORMATS))
    for path in make(arguments.names, arguments.out, points=arguments.points):
        say(str(path))
    return OK
