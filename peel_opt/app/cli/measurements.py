"""The commands on measurements: ``peel-opt calibrate``."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ...base.errors import InvalidInput, PeelOptError
from .common import FAILED, OK, WRONG_INPUT, AddCommand, complain, output_options, say, say_written
from .files import out_files

if TYPE_CHECKING:
    from ..calibration_cards import CalibrationCard


def add_commands(command: AddCommand) -> None:
    """Add ``calibrate`` to the command line."""
    sub = command("calibrate", "material numbers from measured pressures, lengths and shapes", _calibrate)
    sub.add_argument("card", metavar="CARD", help="a calibration card such as problems/calibrate_flap.toml")
    output_options(sub, "CSV, JSON and a picture of the fit")


def _calibrate(arguments: argparse.Namespace) -> int:
    """Fit what one card asks for."""
    from ..calibration_cards import load_calibration
    from ..report import as_json

    code, document = fit_card(arguments.card, load_calibration(arguments.card), arguments)
    if arguments.json:
        say(as_json(document))
    return code


def fit_card(
    path: str, card: CalibrationCard, arguments: argparse.Namespace, before: str = ""
) -> tuple[int, dict[str, Any]]:
    """Fit, print the table unless JSON is asked for, and write files.

    Returns
    -------
    tuple of int and dict
        The exit code, and the fit or why there is none as plain data.
    """
    from pathlib import Path

    from ...studies.calibrate.record import fit_record
    from ..calibration_report import fit_table, heading, intervals_of, write_fit
    from ..report import slug

    files = out_files(arguments)
    level = card.calibration.level
    document: dict[str, Any] = {"card": path, "title": card.title}
    try:
        files.claim_kinds(card, slug(Path(path).stem), "csv json")
        fit = card.fit(Path(path).parent)
        intervals = intervals_of(fit, level)
        record = fit_record(fit, level, intervals)
        if files:
            write_fit(fit, files.folder, Path(path).stem, record, picture=files.pictures)
        if arguments.json:
            document["calibration"] = record
        else:
            say(before + heading(card, path) + "\n\n" + fit_table(fit, level, intervals))
        say_written(files, arguments)
    except PeelOptError as error:
        complain(f"{path}: {error}")
        document["calibration"] = {"status": error.status, "message": str(error)}
        return (WRONG_INPUT if isinstance(error, InvalidInput) else FAILED), document
    return OK, document
