"""The command about peel tests: ``peel-opt peel``."""

from __future__ import annotations

import argparse
import math
from typing import Any

from ...base.errors import InvalidInput, NoEquilibrium
from .common import (
    OK,
    SHEETS,
    AddCommand,
    chosen,
    describes_rod,
    law_option,
    material_of,
    output_options,
    rod_from,
    rod_options,
    say,
    say_written,
    shown_units,
    units_option,
)
from .files import named, out_files


def add_commands(command: AddCommand) -> None:
    """Add ``peel`` to the command line."""
    peel = command(
        "peel", "force and angle of a peel test into work and back, and where a peel begins", _peel
    )
    peel.add_argument(
        "--pull", metavar="F", help="force over the width, such as '6 N/25 mm': asks for the work"
    )
    peel.add_argument("--angle", metavar="PHI", required=True, help="of the peel, such as '180 deg'")
    peel.add_argument("--arm", metavar="L", help="length that was never glued, where a peel begins (0)")
    rod_options(peel, f"--work alone for its force; where a peel begins needs {SHEETS}")
    law_option(peel)
    units_option(peel)
    output_options(peel, "the state in which the peel begins (NPZ, CSV and a picture)")


def _peel(arguments: argparse.Namespace) -> int:
    """Take a force to a work or a work to a force; for a rod, say where its peel begins."""
    from ...analysis.peel import energy_release_rate, peel_force
    from ...base.checks import parse
    from ...base.units import ANGLE, LINE_FORCE, WORK
    from ..peel_report import peel_record, peel_table
    from ..report import as_json

    shown, phi = shown_units(arguments), parse("--angle", arguments.angle, ANGLE)
    unnamed = arguments.ratio is None and arguments.card is None
    alone = unnamed and material_of(arguments).keys() == {"work"}
    if arguments.pull is not None:
        if describes_rod(arguments) or arguments.arm is not None:
            raise InvalidInput("--pull asks for the work: give no rod, no --work and no --arm beside it.")
        force = parse("--pull", arguments.pull, LINE_FORCE)
        work = energy_release_rate(force, phi)
    elif alone:
        work = parse("--work", arguments.work, WORK)
        force = peel_force(work, phi)
    else:
        return _begin(arguments, phi)
    if arguments.out is not None or arguments.arm is not None:
        raise InvalidInput("where a peel begins needs a rod: give its stiffness and bond, or --card.")
    document = peel_record(force, phi, work)
    say(as_json(document) if arguments.json else peel_table(force, phi, work, shown))
    return OK


def _begin(arguments: argparse.Namespace, phi: float) -> int:
    """Say how a rod peels on a long arm, and where it begins."""
    from ...analysis.peel import initiation_force, peel_force
    from ...base.checks import parse
    from ...base.units import LENGTH, NUMBER
    from ...equilibria.scenes import solve
    from ...model.scene import Scene
    from ...model.tips import TipLoad
    from ..card_tables import own_units
    from ..peel_report import begin_record, begin_table
    from ..report import as_json

    rod, shown = rod_from(arguments), shown_units(arguments)
    kind, own = NUMBER if rod.dimensionless else LENGTH, own_units(rod, "m")
    arm = 0.0 if arguments.arm is None else parse("--arm", arguments.arm, kind, own=own, signed=True)
    law: dict[str, Any] = chosen(arguments, "law")
    steady = peel_force(rod.work_of_separation, phi)
    files, stem = out_files(arguments), named("peel", arguments)
    files.claim_kinds({"peel": {"rod": rod, "angle": phi, "arm": arm, **law}}, stem)
    peak = None
    try:
        if phi < math.pi:
            peak = initiation_force(rod, phi, arm, **law)
    except NoEquilibrium:
        pass  # the steady force is the largest
    if peak is not None and files:
        scene = Scene(rod, tip=TipLoad(angle=phi), unbonded=arm, **law)
        files.add(solve(scene, free="force", length=peak.length, near=peak.force), stem)
    if arguments.json:
        say(as_json(begin_record(rod, phi, steady, peak)))
    else:
        say(begin_table(rod, phi, steady, peak, shown))
    say_written(files, arguments)
    return OK
