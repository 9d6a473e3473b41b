"""The command ``peel-opt tradeoff``: time against error."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import Any

from ...base.errors import InvalidInput, PeelOptError
from .common import (
    FAILED,
    OK,
    AddCommand,
    by_beta0,
    chosen,
    complain,
    output_options,
    rod_options,
    say,
    say_written,
    subject_from,
    tolerance,
)
from .files import named, out_files

#: A question's label, and the question.
_Posed = tuple[str, Callable[..., Any]]


def add_commands(command: AddCommand) -> None:
    """Add ``tradeoff`` to the command line."""
    sub = command("tradeoff", "what each method takes and what it gives, on one question", _tradeoff)
    sub.add_argument(
        "--beta0", type=float, metavar="B", help="the paper's groups: beta0, with --lam or --beta1"
    )
    second = sub.add_mutually_exclusive_group()
    second.add_argument("--lam", type=float, metavar="L", help="lambda = beta1 - pi^4 (with --beta0)")
    second.add_argument("--beta1", type=float, metavar="B", help="beta1 itself (with --beta0)")
    rod_options(sub)
    given = sub.add_mutually_exclusive_group()
    given.add_argument("--length", metavar="VALUE", help="a rod's detached length, such as '1.9 mm'")
    given.add_argument("--pressure", metavar="VALUE", help="the pressure on it, such as '60 kPa'")
    sub.add_argument("--law", help="auto, linear or cohesive")
    sub.add_argument("--state", help="unfolded, middle, lower or folded")
    sub.add_argument(
        "--methods", nargs="+", metavar="M", help="series, spectral, collocation, shooting, solve_bvp"
    )
    sub.add_argument("--tols", nargs="+", type=tolerance, metavar="T", help="tolerances (1e-3 to 1e-11)")
    sub.add_argument(
        "--repeats", type=int, metavar="N", help="timed calls of each, after one that is not (5)"
    )
    output_options(sub, "NPZ, CSV and a picture of each table")


def _tradeoff(arguments: argparse.Namespace) -> int:
    """Measure the methods on each question, print the tables, and write them."""
    options = chosen(arguments, "methods", "tols", "repeats")
    questions = _questions(arguments)

    from ...studies.tradeoff.run import tradeoff
    from ..report import as_json

    files, stems = out_files(arguments), []
    for number, (label, ask) in enumerate(questions, 1):
        stem = named("tradeoff" if len(questions) == 1 else f"tradeoff-{number}", arguments)
        about = (label, ask.args) if isinstance(ask, partial) else label
        stems.append(files.claim_kinds(about, stem))
    code, documents = OK, []
    for number, (label, ask) in enumerate(questions, 1):
        try:
            table = tradeoff(ask, **options)
        except PeelOptError as error:
            # Options that mean nothing mean nothing for the other questions either.
            if len(questions) == 1 or isinstance(error, InvalidInput):
                raise
            complain(f"{label}: {error}")
            code = FAILED
            continue
        files.add(table, stems[number - 1], title=label)
        if arguments.json:
            documents.append({"question": label, **table.record()})
        else:
            say(("\n" if number > 1 else "") + f"{label}\n\n{table!r}")
    if arguments.json:
        say(as_json({"tables": documents}))
    say_written(files, arguments)
    return code


def _questions(arguments: argparse.Namespace) -> list[_Posed]:
    """Return the question of the flags, or those of a card."""
    in_groups = by_beta0(arguments)
    if in_groups == (arguments.lam is None and arguments.beta1 is None):
        raise InvalidInput("--beta0 goes with either --lam or --beta1, and they with it.")
    asked = chosen(arguments, "length", "pressure", "law", "state")
    given = [name for name in ("length", "pressure") if name in asked]
    if given and in_groups:
        raise InvalidInput(f"--{given[0]} is about a rod, not about --beta0.")

    from ..cards import as_question, load_card

    if in_groups:
        from ..card_tables import GroupsTable

        # What of it can be meant is checked by the question itself.
        groups = GroupsTable.model_construct(beta0=arguments.beta0, lam=arguments.lam, beta1=arguments.beta1)
        question = as_question(**asked)
        return [(question.label(groups), question.pose(groups))]
    if given:
        question, subject = as_question(**asked), subject_from(arguments)
        return [(question.label(subject), question.pose(subject))]
    if arguments.card is None:
        raise InvalidInput("give --length or --pressure; only a card brings its own questions.")
    if asked:
        raise InvalidInput(
            f"--{next(iter(asked))} goes with --length or --pressure, not with a card's own questions."
        )
    rod_ways = (arguments.k, arguments.T0, arguments.y0, arguments.ratio)
    if any(value is not None for value in rod_ways):
        subject_from(arguments)  # says that a card and another rod exclude each other
    card = load_card(arguments.card)
    named = list(zip(card.labels(), card.questions, strict=True))
    posed: list[_Posed] = [
        (label, question.pose(card.problem)) for label, question in named if not question.is_of_a_flaw
    ]
    for label, _ in (pair for pair in named if pair[1].is_of_a_flaw):
        complain(f"{label}: left out, for a snap is found in one way only")
    if not posed:
        raise InvalidInput(f"card {arguments.card!r} has no question that several methods answer.")
    return posed
