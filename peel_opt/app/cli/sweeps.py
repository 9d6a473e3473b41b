"""The commands over many rods: ``peel-opt sweep`` and ``peel-opt uncertainty``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.errors import InvalidInput
from .common import (
    FAILED,
    MATERIAL,
    OK,
    SHEETS,
    AddCommand,
    answer_options,
    card_subject,
    chosen,
    complain,
    material_of,
    output_options,
    rod_options,
    say,
    say_written,
)
from .files import Files, named, out_files
from .material_of_many import sheet_axes, uncertain_rod

if TYPE_CHECKING:
    from ...base.units import Kind
    from ...model.rod import Rod
    from ...model.scene import Scene

#: Flags of what is given.
GIVEN = ("pressure", "length")
GIVEN_OR_FLAW = (*GIVEN, "flaw")

RANGES = """\
A VALUE is one number, a list "A, B, C", or a range FROM:TO:COUNT, FROM:TO:COUNT:log:
  peel-opt sweep --ratio 0.5:10:50:log --pressure-ratio 0.2:0.9:20 --out results/sweep
  peel-opt sweep --card problems/aortic_flap.toml --length "1.5:3 mm:40"
  peel-opt sweep --k "23 uN m" --T0 "100:200 kPa:11" --y0 "0.73 mm" --pressure "60 kPa,70 kPa"
  peel-opt sweep --beta0 "2, 4" --lam -0.05:3:50
A card with a [scene] is swept too, and every number of it may vary:
  peel-opt sweep --card problems/tape_in_stream.toml --axis "unbonded=0.2:0.8 mm:4" --pressure "20 kPa"
An interrupted sweep goes on with the same command and --resume.
exit codes: 0 all answered, 1 some points have no answer, 2 wrong input, 130 interrupted
"""


def add_commands(command: AddCommand) -> None:
    """Add ``sweep`` and ``uncertainty`` to the command line."""
    _add_sweep(command)
    _add_uncertainty(command)


def _add_sweep(command: AddCommand) -> None:
    sub = command("sweep", "one question over a grid of rods, pressures or lengths", _sweep)
    sub.formatter_class = argparse.RawDescriptionHelpFormatter
    sub.epilog = RANGES
    rod_options(
        sub,
        f"{SHEETS}, and what differs from a card",
        examples=("23 uN m", "100:200 kPa:11", "0.73 mm"),
        ratio="eta/y0 alone, with --pressure-ratio or --length-ratio",
    )
    asked = sub.add_argument_group("question", "one of")
    for name, example, ratio, ratios in (
        ("pressure", "20 kPa:100 kPa:9", "p/T0", "0.2:0.9:20"),
        ("length", "1.5:3 mm:40", "sbar/eta", "2:5:20"),
    ):
        asked.add_argument(f"--{name}", metavar="VALUE", help=f"such as '{example}'")
        asked.add_argument(f"--{name}-ratio", metavar="VALUE", help=f"{ratio}, such as {ratios}")
    asked.add_argument("--beta0", metavar="VALUE", help="the paper's groups: with --lam or --beta1")
    asked.add_argument("--lam", metavar="VALUE", help="lambda = beta1 - pi^4, such as -0.05:3:50")
    asked.add_argument("--beta1", metavar="VALUE", help="beta1 itself")
    sub.add_argument(
        "--axis",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a number of the card's [scene], such as 'unbonded=0.2:0.8 mm:4'; may be repeated",
    )
    sub.add_argument("--zip", action="store_true", help="take the lists as columns, not all combinations")
    _work_options(sub)
    output_options(sub, "sweep.csv, sweep.npz (sweep-CARD.csv ..), a picture and the journal")
    sub.add_argument("--resume", action="store_true", help="go on with the journal under --out")
    sub.add_argument("--netcdf", action="store_true", help="also write sweep.nc under --out")


SPREADS = """\
A spread follows its value: a standard deviation "+- 10 %" or "+- 2 uN m", by default of a normal
distribution; "+- 10 % lognormal"; "+- 10 % uniform" and "20 uN m .. 26 uN m" for even ones:
  peel-opt uncertainty --k "23 uN m +- 10 %" --T0 "140 kPa +- 5 %" --y0 "0.73 mm" --pressure "60 kPa"
  peel-opt uncertainty --card problems/office_tape.toml --k "+- 20 % lognormal" --length "0.9 mm +- 10 um"
Numbers of a card's [scene] may be uncertain, too:
  peel-opt uncertainty --card problems/tape_in_stream.toml --spread "unbonded=+- 10 %" --pressure "20 kPa"
  peel-opt uncertainty --E "1.5 GPa +- 10 %" --thickness "40 um +- 2 um" --nu 0.4 --T0 "0.5 MPa" \\
      --work "100 J/m^2 +- 15 %" --pressure "200 kPa" --correlation "E,thickness=-0.4"
Without a pressure or a length, of a rod: the readhesion pressure and the length at the Maxwell point.
"""


def _add_uncertainty(command: AddCommand) -> None:
    sub = command("uncertainty", "how uncertain an answer is whose inputs are", _uncertainty)
    sub.formatter_class = argparse.RawDescriptionHelpFormatter
    sub.epilog = SPREADS
    rod_options(
        sub,
        f"{SHEETS}; spreads alone with --card",
        examples=("23 uN m +- 10 %", "140 kPa +- 5 %", "0.7 mm .. 0.8 mm"),
        ratio="",
    )
    sub.add_argument(
        "--spread",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a number of the card's [scene], such as 'unbonded=0.5 mm +- 10 %%'; may be repeated",
    )
    sub.add_argument("--pressure", metavar="VALUE", help="for the length; such as '60 kPa +- 2 kPa'")
    sub.add_argument("--length", metavar="VALUE", help="for the pressure; such as '1.9 mm +- 50 um'")
    sub.add_argument(
        "--flaw", metavar="VALUE", help="never glued, for its safe pressure; such as '0.5 mm +- 10 %%'"
    )
    sub.add_argument(
        "--of",
        nargs="+",
        metavar="NAME",
        help="pressure, length, critical_flaw (at a pressure), safe_pressure (of a flaw),"
        " readhesion_pressure, maxwell_length, critical_length",
    )
    sub.add_argument(
        "--hold",
        metavar="NAME",
        help="work_of_separation: it stays where --T0 is uncertain, and --y0 follows",
    )
    sub.add_argument(
        "--correlation",
        metavar="NAME,NAME=VALUE",
        action="append",
        default=[],
        help="of two inputs, such as 'E,thickness=-0.4'; may be repeated",
    )
    sub.add_argument("--samples", type=int, default=256, metavar="N", help="a power of 2 (256)")
    sub.add_argument("--seed", type=int, default=0, help="of the samples (0)")
    sub.add_argument("--no-indices", action="store_true", help="no Sobol indices: a fraction of the work")
    _work_options(sub)
    output_options(sub, "samples.csv (samples-CARD.csv) and a picture of each number")


def _work_options(sub: argparse.ArgumentParser) -> None:
    """Add how the points are answered, and by whom."""
    answer_options(sub, "law", "state", "method")
    sub.add_argument("--workers", type=int, metavar="N", help="processes; 1 for none (one a core, if long)")


def _uncertainty(arguments: argparse.Namespace) -> int:
    """Propagate, print and write; that some samples have no answer is part of the result."""
    from ...studies.uncertainty.flaws_of_many import SNAPS_AT
    from ...studies.uncertainty.limits_of_many import CRITICAL_LENGTH, LIMITS
    from ...studies.uncertainty.run import uncertainty
    from ..report import as_json

    subject, given, spread = _uncertain(arguments)
    files = out_files(arguments)
    correlations = _correlations(arguments.correlation)
    asked = {"rod": subject, "given": given, "spread": spread, "correlations": repr(correlations)}
    asked |= chosen(arguments, "law", "state", "hold")
    stem = named("samples", arguments)
    every = (*GIVEN, *SNAPS_AT, *LIMITS, CRITICAL_LENGTH)
    pictures = [named(name, arguments) + ".png" for name in every if files.pictures]
    files.claim({"uncertainty": asked}, f"{stem}.csv", *pictures)
    names = ("of", "hold", "law", "state", "method", "tol", "workers", "samples", "seed")
    options = chosen(arguments, *names) | given
    indices = not arguments.no_indices
    found = uncertainty(subject, spread, indices=indices, correlations=correlations, **options)
    say(as_json(found.record()) if arguments.json else repr(found))
    if files:
        found.to_csv(files.folder / f"{stem}.csv")
        for name in found.quantities if files.pictures else ():
            _draw(partial(found.plot, of=name), files.folder / f"{named(name, arguments)}.png")
    say_written(files, arguments)
    if any(not number.found.size for number in found.quantities.values()):
        complain("no sample has an answer")
        return FAILED
    return OK


def _correlations(texts: list[str]) -> dict[tuple[str, str], float] | None:
    """Return correlations by pairs of names, which may be those of the options."""
    from ...base.checks import parse
    from ...base.units import NUMBER

    found = {}
    for pair, equals, value in (text.partition("=") for text in texts):
        names = [MATERIAL.get(name.strip(), name.strip()) for name in pair.split(",")]
        if not equals or len(names) != 2:
            raise InvalidInput(
                f"--correlation {pair}{equals}{value} names no two inputs.", remedy="Write E,thickness=-0.4."
            )
        found[names[0], names[1]] = parse(f"--correlation {pair}", value.strip(), NUMBER, signed=True)
    return found or None


def _uncertain(arguments: argparse.Namespace) -> tuple[Rod | Scene, dict[str, float], dict[str, str]]:
    """Return the nominal rod or scene, what is given, and the spreads as texts."""
    from ...base.units import NUMBER
    from ...model.scene import Scene
    from ...studies.uncertainty.inputs import KINDS
    from ..card_tables import own_units

    card = None if arguments.card is None else card_subject(arguments.card)
    base = card.rod if isinstance(card, Scene) else card
    plain = base is not None and base.dimensionless
    rod, spread = uncertain_rod(arguments, base)
    given: dict[str, float] = {}
    for name in GIVEN_OR_FLAW:
        if (text := getattr(arguments, name)) is None:
            continue
        kind, own = NUMBER if plain else KINDS[name], own_units(rod, KINDS[name].si)
        value, around = _centre(f"--{name}", text, kind, own)
        given |= {} if value is None else {name: value}
        spread |= {name: around} if around else {}
    subject = _scene_values(card, rod, arguments.spread, spread)
    if lost := [name for name in spread if name in GIVEN_OR_FLAW and name not in given]:
        raise InvalidInput(f"--{lost[0]} has a spread but no value.")
    if not spread:
        raise InvalidInput(
            "nothing is uncertain.", remedy="A spread follows its value: --k '23 uN m +- 10 %'."
        )
    return subject, given, spread


def _scene_values(
    card: Rod | Scene | None, rod: Rod, texts: list[str], spread: dict[str, str]
) -> Rod | Scene:
    """Return the rod, or the scene of a card with it and with numbers of its own; note their spreads."""
    from ...model.renumbered import renumbered
    from ...model.scene import Scene

    given = _of_the_scene("--spread", card, texts)
    if not isinstance(card, Scene):
        return rod
    numbers: dict[str, float] = {}
    for name, (text, kind, own) in given.items():
        value, around = _centre(f"--spread {name}", text, kind, own, signed=True)
        numbers |= {} if value is None else {name: value}
        spread |= {name: around} if around else {}
    return renumbered(card, numbers, rod)


def _centre(
    flag: str, text: str, kind: Kind, own: dict[str, float], *, signed: bool = False
) -> tuple[float | None, str]:
    """Return the value of a text, or the middle of its range, and its spread; None where it has no value."""
    from ...base.checks import parse
    from ...studies.uncertainty.inputs import middle, split

    value, around = split(text)
    if value:
        return parse(flag, value, kind, own=own, signed=signed), around
    return middle(flag, around, kind, signed=signed) if ".." in around else None, around


def _sweep(arguments: argparse.Namespace) -> int:
    """Answer all points, write what came of them and say how many have no answer."""
    from ...studies.sweep.run import sweep
    from ..report import as_json

    axes, subject = _axes(arguments)
    stem = named("sweep", arguments)
    files = _files(arguments, stem)
    asked = {"axes": axes, "rod": subject, "zip": arguments.zip} | chosen(arguments, "law", "state")
    files.claim_kinds({"sweep": asked}, stem, "csv npz nc" if arguments.netcdf else "csv npz")
    options = chosen(arguments, "law", "state", "method", "tol", "workers")
    journal = files.folder / f"{stem}.journal" if files else None
    found = sweep(axes, rod=subject, zipped=arguments.zip, journal=journal, **options)
    if arguments.json:
        say(as_json(found.record()))
    else:
        say(repr(found) if files else found.csv_text().rstrip("\n"))
    if files:
        _write(found, files.folder / stem, arguments)
    say_written(files, arguments)
    if found.certified.all():
        return OK
    complain(found.summary())
    return FAILED


def _files(arguments: argparse.Namespace, stem: str) -> Files:
    """Return the files to write; a journal among them is taken up only on request."""
    from ...base.records import require_netcdf

    if arguments.out is None and (arguments.resume or arguments.netcdf):
        raise InvalidInput("--resume and --netcdf need --out DIR.")
    if arguments.netcdf:
        require_netcdf()
    files = out_files(arguments)
    if files and (files.folder / f"{stem}.journal").exists() and not arguments.resume:
        raise InvalidInput(
            f"{str(files.folder)!r} holds the journal of a sweep already.",
            remedy="Go on with it by --resume, or name another folder.",
        )
    return files


def _write(found: Any, path: Path, arguments: argparse.Namespace) -> None:
    """Write what was found under a path that has no suffix yet."""
    found.to_csv(f"{path}.csv")
    found.save(f"{path}.npz")
    if arguments.netcdf:
        found.to_netcdf(f"{path}.nc")
    if not arguments.no_plot and len(found.shape) <= 2:
        _draw(found.plot, Path(f"{path}.png"))


def _draw(plot: Callable[[], Any], path: Path) -> None:
    """Write a picture, or say why there is none: the numbers stand."""
    from ...plots import save_figure

    try:
        ax = plot()
    except InvalidInput as error:  # too few answers for level lines, or for a distribution
        complain(error)
        return
    save_figure(ax.figure, path, dpi=130.0)


def _axes(arguments: argparse.Namespace) -> tuple[dict[str, Any], Rod | Scene | None]:
    """Return the axes in the order of the options above, and the rod or the scene they start from."""
    from ...base.units import LENGTH, NUMBER, PRESSURE, STIFFNESS
    from ...model.scene import Scene
    from ...studies.sweep.ranges import parse_range
    from ..card_tables import own_units

    subject = None if arguments.card is None else card_subject(arguments.card)
    rod = subject.rod if isinstance(subject, Scene) else subject
    plain = rod is not None and rod.dimensionless
    kinds = {"k": STIFFNESS, "T0": PRESSURE, "y0": LENGTH, "pressure": PRESSURE, "length": LENGTH}
    # A rod that varies has no units of its own.
    fixed = None if material_of(arguments) else rod
    axes: dict[str, Any] = sheet_axes(arguments)
    bond = ("T0", "y0") if arguments.work is None else ()
    for flag in ("k", *bond, "ratio", "beta0", "beta1", "lam", *_GIVEN_FLAGS):
        text = getattr(arguments, flag)
        if text is not None:
            kind = NUMBER if plain else kinds.get(flag, NUMBER)
            signed = flag in ("beta0", "lam") or flag.startswith("pressure")
            shown = "--" + flag.replace("_", "-")
            own = own_units(fixed, kinds[flag].si) if fixed is not None and flag in GIVEN else None
            axes[MATERIAL.get(flag, flag)] = parse_range(shown, text, kind, own=own, signed=signed)
    axes |= _scene_axes(subject, arguments.axis)
    if not axes:
        raise InvalidInput("give a rod and a question, at least one of them with several values.")
    return axes, subject


def _scene_axes(subject: Rod | Scene | None, texts: list[str]) -> dict[str, Any]:
    """Return the axes that are numbers of a scene."""
    from ...studies.sweep.ranges import parse_range

    return {
        name: parse_range(f"--axis {name}", text, kind, own=own, signed=True)
        for name, (text, kind, own) in _of_the_scene("--axis", subject, texts).items()
    }


def _of_the_scene(
    flag: str, subject: Rod | Scene | None, texts: list[str]
) -> dict[str, tuple[str, Kind, dict[str, float]]]:
    """Return what NAME=VALUE texts say of numbers of a scene: value, its kind, and the units of the rod."""
    from ...model.scene import Scene
    from ..card_tables import own_units
    from ..scene_table import kind_of

    if not texts:
        return {}
    if not isinstance(subject, Scene):
        raise InvalidInput(f"{flag} names a number of a scene.", remedy="Give a --card that has a [scene].")
    found: dict[str, tuple[str, Kind, dict[str, float]]] = {}
    for name, equals, value in (text.partition("=") for text in texts):
        if not equals or (name := name.strip()) not in subject.dimensions:
            raise InvalidInput(
                f"{flag} {name}{equals}{value} names no number of the scene.",
                remedy=f"Write NAME=VALUE with one of {', '.join(subject.dimensions) or 'none'}; a number"
                " that is zero must stand on the card, with any size.",
            )
        if name in found:
            raise InvalidInput(f"{flag} {name} is given twice.")
        dimension, rod = subject.dimensions[name], subject.rod
        found[name] = value, kind_of(rod, dimension), own_units(rod, dimension.unit)
    return found


_GIVEN_FLAGS = tuple(f"{name}{ending}" for name in GIVEN for ending in ("", "_ratio"))
