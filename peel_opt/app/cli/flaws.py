"""The command about edges without glue: ``peel-opt flaw``."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ...base.errors import InvalidInput
from .common import (
    OK,
    AddCommand,
    chosen,
    law_option,
    output_options,
    refuse_scene,
    rod_options,
    say,
    say_written,
    shown_units,
    subject_from,
    units_option,
)
from .files import named, out_files

if TYPE_CHECKING:
    from ...model.rod import Rod


def add_commands(command: AddCommand) -> None:
    """Add ``flaw`` to the command line."""
    flaw = command("flaw", "the flaw that is critical, the pressure that is safe, and when it closes", _flaw)
    flaw.add_argument("--pressure", metavar="P", help="asks for the critical flaw; such as '60 kPa'")
    flaw.add_argument("--flaw", metavar="L", help="length without glue: its safe pressure; such as '0.5 mm'")
    flaw.add_argument("--chart", action="store_true", help="of many lengths, also without --out")
    rod_options(flaw)
    law_option(flaw)
    units_option(flaw)
    output_options(flaw, "how the edge opens, and a chart of safe pressures,")


def _flaw(arguments: argparse.Namespace) -> int:
    """Say what edges without glue do, and write how the one that was asked about opens, and a chart."""
    from ...analysis.flaws import readhesion_pressure
    from ...analysis.unbonded import FlawLimit
    from ...base.errors import PeelOptError
    from ..cards import as_question
    from ..flaw_report import flaw_table, flaws_record, limits_of, write_chart
    from ..report import as_json

    rod, shown, law = _rod(arguments), shown_units(arguments), chosen(arguments, "law")
    questions: list[dict[str, Any]] = []
    if arguments.flaw is not None:
        questions.append({"flaw": arguments.flaw})
    if arguments.pressure is not None:
        questions.append({"free": "flaw", "pressure": arguments.pressure})
    if arguments.out is not None and len(questions) > 1:
        raise InvalidInput("files are of one question: give --pressure or --flaw with --out, not both.")
    posed = [as_question(**question, **law) for question in questions]
    labels, asks = [q.label(rod) for q in posed], [q.pose(rod) for q in posed]
    charted = arguments.chart or arguments.out is not None or not asks

    files, stem = out_files(arguments), named("flaw", arguments)
    asked = {"flaw": {"rod": rod, "questions": questions, **law}}
    if asks:
        files.claim_kinds(asked, stem)
    files.claim(asked, f"{stem}-chart.csv", *([f"{stem}-chart.png"] if files.pictures else []))
    found: list[tuple[str, FlawLimit]] = []
    for label, ask in zip(labels, asks, strict=True):
        limit = ask()
        assert isinstance(limit, FlawLimit)
        found.append((label, limit))
    try:
        least: Any = readhesion_pressure(rod, **law)
    except PeelOptError as error:
        least = error
    chart = limits_of(rod, **law) if charted else []
    for _, limit in found:
        files.add(limit, stem)
    if files:
        write_chart(chart, rod, files.folder / f"{stem}-chart", picture=files.pictures)
    if arguments.json:
        say(as_json(flaws_record(found, rod, least, chart)))
    else:
        say(flaw_table(rod, found, least, chart, shown))
    say_written(files, arguments)
    return OK


def _rod(arguments: argparse.Namespace) -> Rod:
    """Return the rod that is described, or that of a card whose scene is an edge without glue."""
    from ...model.scene import Scene

    subject = subject_from(arguments)
    if isinstance(subject, Scene) and subject.law == "auto" and replace(subject, unbonded=0.0).is_plain:
        return subject.rod
    refuse_scene(subject, arguments.card)
    assert not isinstance(subject, Scene)
    return subject
