"""The commands that follow a rod in time: ``peel-opt snap`` and ``peel-opt history``."""

from __future__ import annotations

import argparse
from typing import Any

from ...base.errors import InvalidInput
from .common import OK, AddCommand, output_options, rod_options, say, say_written, subject_from
from .files import named, out_files


def add_commands(command: AddCommand) -> None:
    """Add ``snap`` and ``history`` to the command line."""
    snap = command("snap", "what a rod does after it let go, up to where it comes to rest", _snap)
    snap.add_argument("subject", nargs="?", metavar="CARD", help="a problem card, in the place of --card")
    snap.add_argument("--pressure", metavar="P", help="held, such as '300 mmHg'; that of the card's question")
    snap.add_argument("--flaw", metavar="L", help="detached length at the start, not the unfolded state")
    snap.add_argument("--mass", metavar="M", help="per area, such as '0.7 kg/m^2' (that of the card, or 0)")
    snap.add_argument("--drag", metavar="C", help="force per area and speed, such as '20 kPa s/m'")
    snap.add_argument("--bond", choices=("reversible", "damage", "no_rebond"), help="on the way back")
    snap.add_argument("--until", metavar="WHEN", help="arrest, contact or a time such as '5 ms' (arrest)")
    snap.add_argument("--rod-length", metavar="L", help="of the whole rod (long enough)")
    snap.add_argument("--film", action="store_true", help="also write a film under --out")
    rod_options(snap)
    output_options(snap, "NPZ, CSV and a picture")
    history = command("history", "what a rod does under the pressure of a card as it changes", _history)
    history.add_argument("card", metavar="CARD", help="a problem card with a [history]")
    output_options(history, "NPZ, CSV and a picture")


def _snap(arguments: argparse.Namespace) -> int:
    """Follow a rod, print its moments and what they are worth, and write the motion."""
    if arguments.subject is not None:
        if arguments.card is not None:
            raise InvalidInput("give the card once.")
        arguments.card = arguments.subject
    if arguments.film and arguments.out is None:
        raise InvalidInput("a film goes under --out DIR.")
    from ...motion.acting import loads_on

    rod = subject_from(arguments)
    loads_on(rod)  # what is not computed of a scene is said first
    options = _options(arguments, rod)

    from ...motion.snap import snap
    from ..motion_report import motion_record, motion_table
    from ..report import as_json

    files, stem = out_files(arguments), named("snap", arguments)
    kinds = "npz csv gif" if arguments.film else "npz csv"
    files.claim_kinds({"snap": {"rod": rod, **options}}, stem, kinds)
    moved = snap(rod, **options)
    files.add(moved, stem)
    if arguments.film:
        moved.film(files.folder / f"{stem}.gif")
    say(as_json(motion_record(moved)) if arguments.json else motion_table(moved))
    say_written(files, arguments)
    return OK


def _history(arguments: argparse.Namespace) -> int:
    """Follow the rod of a card, print where its front went, and write the history."""
    from ..cards import load_card

    card = load_card(arguments.card)
    rod = card.rod()
    if card.history is None or rod is None or card.rod_table is None:
        raise InvalidInput(
            f"card {arguments.card!r} has no [history].",
            remedy='Add one: times = [0, 60, 200], pressures = ["0.5 T0", "0.5 T0", "0.1 T0"].',
        )
    drag = card.rod_table.drag
    asked = card.history.asked(rod, drag)
    subject = card.scene() or rod

    from ...motion.history import history
    from ..motion_report import history_record, history_table
    from ..report import as_json

    files, stem = out_files(arguments), named("history", arguments)
    files.claim_kinds({"history": {"rod": subject, "drag": drag, **asked}}, stem)
    run = history(subject, drag=drag, **asked)
    files.add(run, stem)
    say(as_json(history_record(run)) if arguments.json else history_table(run))
    say_written(files, arguments)
    return OK


def _options(arguments: argparse.Namespace, subject: Any) -> dict[str, Any]:
    """Return what was asked, in the units of the rod; what the options do not say, the card may."""
    from ...base.checks import parse
    from ...base.units import DRAG, LENGTH, MASS, NUMBER, PRESSURE, TIME
    from ..card_tables import own_units
    from ..cards import load_card

    rod = getattr(subject, "rod", subject)
    card = None if arguments.card is None else load_card(arguments.card)
    options: dict[str, Any] = {} if card is None or card.rod_table is None else card.rod_table.resistance()
    given = {"flaw": LENGTH, "rod_length": LENGTH, "mass": MASS, "drag": DRAG, "pressure": PRESSURE}
    for name, kind in given.items():
        if (text := getattr(arguments, name)) is not None:
            measured = NUMBER if rod.dimensionless else kind
            flag = f"--{name.replace('_', '-')}"
            options[name] = parse(
                flag, text, measured, own=own_units(rod, kind.si), signed=name in ("mass", "drag")
            )
    if "pressure" not in options:
        asked = [] if card is None else [q.pressure_of(rod) for q in card.questions]
        options["pressure"] = next((p for p in asked if p is not None), None)
        if options["pressure"] is None:
            raise InvalidInput("give the --pressure that is held.")
    if arguments.bond is not None:
        options["bond"] = arguments.bond
    if arguments.until in ("arrest", "contact"):
        options["until"] = arguments.until
    elif arguments.until is not None:
        seconds = not rod.dimensionless and options.get("drag") is not None
        options["until"] = parse("--until", arguments.until, TIME if seconds else NUMBER)
    return options
