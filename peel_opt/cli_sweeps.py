"""The commands over many rods: ``peel-opt sweep`` and ``peel-opt uncertainty``."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .cli_common import FAILED, OK, AddCommand, complain, say, tolerance
from .errors import InvalidInput

if TYPE_CHECKING:
    from .rod import Rod

#: Flags that describe the rod and the question: the name in Python, and an example.
MATERIAL = {"k": "bending_stiffness", "T0": "adhesion_strength", "y0": "adhesion_range"}
GIVEN = ("pressure", "length")

RANGES = """\
A VALUE is one number, a list A,B,C, or a range FROM:TO:COUNT, FROM:TO:COUNT:log:
  peel-opt sweep --ratio 0.5:10:50:log --pressure-ratio 0.2:0.9:20 --out results/sweep
  peel-opt sweep --card problems/aortic_flap.toml --length "1.5:3 mm:40"
  peel-opt sweep --k "23 uN m" --T0 "100:200 kPa:11" --y0 "0.73 mm" --pressure "60 kPa,70 kPa"
  peel-opt sweep --beta0 2,4 --lam=-0.05:3:50
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
    rod = sub.add_argument_group("rod", "--k, --T0 and --y0, or --ratio, or --card and what differs from it")
    rod.add_argument("--k", metavar="VALUE", help="bending stiffness, such as '23 uN m'")
    rod.add_argument("--T0", metavar="VALUE", help="adhesion strength, such as '100:200 kPa:11'")
    rod.add_argument("--y0", metavar="VALUE", help="adhesion range, such as '0.73 mm'")
    rod.add_argument("--ratio", metavar="VALUE", help="eta/y0 alone")
    rod.add_argument("--card", metavar="CARD", help="the rod of a problem card")
    asked = sub.add_argument_group("question", "one of")
    for name, example in (("pressure", "20 kPa:100 kPa:9"), ("length", "1.5:3 mm:40")):
        asked.add_argument(f"--{name}", metavar="VALUE", help=f"such as '{example}'")
        asked.add_argument(f"--{name}-ratio", metavar="VALUE", help=f"{_RATIOS[name]}, such as 0.2:0.9:20")
    asked.add_argument("--beta0", metavar="VALUE", help="the paper's groups: with --lam or --beta1")
    asked.add_argument("--lam", metavar="VALUE", help="a range that begins with a minus: --lam=-0.05:3:50")
    asked.add_argument("--beta1", metavar="VALUE")
    sub.add_argument("--zip", action="store_true", help="take the lists as columns, not all combinations")
    sub.add_argument("--law", help="auto, linear or cohesive")
    sub.add_argument("--state", help="unfolded, middle, lower or folded")
    sub.add_argument("--method", help="auto, series, spectral, collocation or shooting")
    sub.add_argument("--tol", type=tolerance, help="largest error of a certified answer (1e-8)")
    sub.add_argument("--workers", type=int, metavar="N", help="processes; 1 for none")
    sub.add_argument("--out", metavar="DIR", help="write sweep.csv, .npz, .png and the journal here")
    sub.add_argument("--resume", action="store_true", help="go on with the journal under --out")
    sub.add_argument("--netcdf", action="store_true", help="also write sweep.nc under --out")
    sub.add_argument("--no-plot", action="store_true", help="no picture under --out")


SPREADS = """\
A spread follows its value: a standard deviation "+- 10 %" or "+- 2 uN m", by default of a normal
distribution; "+- 10 % lognormal"; "+- 10 % uniform" and "20 uN m .. 26 uN m" for even ones:
  peel-opt uncertainty --k "23 uN m +- 10 %" --T0 "140 kPa +- 5 %" --y0 "0.73 mm" --pressure "60 kPa"
  peel-opt uncertainty --card problems/office_tape.toml --k "+- 20 % lognormal" --length "0.9 mm +- 10 um"
Without a pressure or a length: the readhesion pressure and the length at the Maxwell point.
"""


def _add_uncertainty(command: AddCommand) -> None:
    sub = command("uncertainty", "how uncertain an answer is whose inputs are", _uncertainty)
    sub.formatter_class = argparse.RawDescriptionHelpFormatter
    sub.epilog = SPREADS
    rod = sub.add_argument_group("rod", "--k, --T0 and --y0, or --card; spreads alone with --card")
    for flag, example in (("k", "23 uN m +- 10 %"), ("T0", "140 kPa +- 5 %"), ("y0", "0.7 mm .. 0.8 mm")):
        rod.add_argument(f"--{flag}", metavar="VALUE", help=f"such as '{example}'".replace("%", "%%"))
    rod.add_argument("--card", metavar="CARD", help="the rod of a problem card")
    sub.add_argument("--pressure", metavar="VALUE", help="for the length; such as '60 kPa +- 2 kPa'")
    sub.add_argument("--length", metavar="VALUE", help="for the pressure; such as '1.9 mm +- 50 um'")
    sub.add_argument(
        "--of", nargs="+", metavar="NAME", help="pressure, length, readhesion_pressure, maxwell_length"
    )
    sub.add_argument("--samples", type=int, default=256, metavar="N", help="a power of 2 (256)")
    sub.add_argument("--seed", type=int, default=0, help="of the samples (0)")
    sub.add_argument("--no-indices", action="store_true", help="no Sobol indices: a fraction of the work")
    sub.add_argument("--law", help="auto, linear or cohesive")
    sub.add_argument("--state", help="unfolded, middle, lower or folded")
    sub.add_argument("--tol", type=tolerance, help="largest error of a certified answer (1e-8)")
    sub.add_argument("--workers", type=int, metavar="N", help="processes; 1 for none")
    sub.add_argument("--json", action="store_true", help="print one JSON document")
    sub.add_argument("--out", metavar="DIR", help="also write samples.csv and a picture of each number here")
    sub.add_argument("--no-plot", action="store_true", help="no pictures under --out")


_RATIOS = {"pressure": "p/T0", "length": "sbar/eta"}


def _uncertainty(arguments: argparse.Namespace) -> int:
    """Propagate, print and write; samples without an answer are part of the result."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # as for a sweep
    from .report import as_json, make_folder

    rod, given, spread = _uncertain(arguments)
    folder = None if arguments.out is None else make_folder(arguments.out)
    from .propagation import uncertainty

    names = ("of", "law", "state", "tol", "workers", "samples", "seed")
    options: dict[str, Any] = {
        name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None
    } | given
    found = uncertainty(rod, spread, indices=not arguments.no_indices, **options)
    say(as_json(found.record()) if arguments.json else repr(found))
    if folder is not None:
        say(str(found.to_csv(folder / "samples.csv")))
        for name in found.quantities if not arguments.no_plot else ():
            say(str(_drawn(found.plot(of=name), folder / f"{name}.png")))
    return OK


def _uncertain(arguments: argparse.Namespace) -> tuple[Rod, dict[str, float], dict[str, str]]:
    """Return the nominal rod, what is given, and the spreads as texts."""
    from .propagation_inputs import KINDS, middle, split
    from .quantities import NUMBER, parse
    from .rod import Rod

    base = _card_rod(arguments.card)
    numbers: dict[str, float] = {}
    spread: dict[str, str] = {}
    plain = base is not None and base.dimensionless
    for flag, name in (*MATERIAL.items(), *((name, name) for name in GIVEN)):
        text = getattr(arguments, flag)
        if text is None:
            continue
        value, around = split(text)
        kind = NUMBER if plain else KINDS[name]
        if value:
            numbers[name] = parse(f"--{flag}", value, kind)
        elif ".." in around:
            numbers[name] = middle(f"--{flag}", around, kind)
        if around:
            spread[name] = around
    given = {name: numbers.pop(name) for name in GIVEN if name in numbers}
    if missing := [name for name in MATERIAL.values() if name not in numbers and base is None]:
        raise InvalidInput(f"the rod lacks {' and '.join(missing)}.", remedy="Give values, or --card.")
    if lost := [name for name in spread if name in GIVEN and name not in given]:
        raise InvalidInput(f"--{lost[0]} has a spread but no value.")
    rod = Rod(*(numbers[name] if name in numbers else getattr(base, name) for name in MATERIAL.values()))
    return rod, given, spread


def _sweep(arguments: argparse.Namespace) -> int:
    """Answer all points, write what came of them and say how many have no answer."""
    # Before NumPy is imported: threads of BLAS only disturb such small systems.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    folder = _folder(arguments)
    from .sweep_files import csv_text
    from .sweeping import sweep

    axes, rod = _axes(arguments)
    names = ("law", "state", "method", "tol", "workers")
    options: dict[str, Any] = {
        name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None
    }
    journal = None if folder is None else folder / "sweep.journal"
    found = sweep(axes, rod=rod, zipped=arguments.zip, journal=journal, **options)
    if folder is None:
        say(csv_text(found).rstrip("\n"))
    else:
        say(repr(found))
        for path in _written(found, folder, arguments):
            say(str(path))
    if found.certified.all():
        return OK
    complain(found.summary())
    return FAILED


def _folder(arguments: argparse.Namespace) -> Path | None:
    """Return the folder to write to; a journal there is taken up only on request."""
    if arguments.out is None:
        if arguments.resume or arguments.netcdf:
            raise InvalidInput("--resume and --netcdf need --out DIR.")
        return None
    from .report import make_folder

    folder = make_folder(arguments.out)
    if (folder / "sweep.journal").exists() and not arguments.resume:
        raise InvalidInput(
            f"{str(folder)!r} holds the journal of a sweep already.",
            remedy="Go on with it by --resume, or name another folder.",
        )
    return folder


def _written(found: Any, folder: Path, arguments: argparse.Namespace) -> list[Path]:
    paths = [found.to_csv(folder / "sweep.csv"), found.save(folder / "sweep.npz")]
    if arguments.netcdf:
        paths.append(found.to_netcdf(folder / "sweep.nc"))
    if not arguments.no_plot and len(found.shape) <= 2:
        try:
            paths.append(_drawn(found.plot(), folder / "sweep.png"))
        except InvalidInput as error:  # too few answers for level lines: the numbers stand
            complain(error)
    return paths


def _drawn(ax: Any, path: Path) -> Path:
    from .plots import save_figure

    return save_figure(ax.figure, path, dpi=130.0)


def _axes(arguments: argparse.Namespace) -> tuple[dict[str, Any], Rod | None]:
    """Return the axes in the order of the options above, and the rod they start from."""
    from .quantities import LENGTH, NUMBER, PRESSURE, STIFFNESS
    from .sweep_ranges import parse_range

    rod = _card_rod(arguments.card)
    own_units = rod is not None and not any(getattr(arguments, flag) is not None for flag in MATERIAL)
    lengths = {"eta": rod.eta, "y0": rod.adhesion_range} if rod is not None and own_units else {}
    pressures = {"T0": rod.adhesion_strength} if rod is not None and own_units else {}
    plain = rod is not None and rod.dimensionless
    kinds = {"k": STIFFNESS, "T0": PRESSURE, "y0": LENGTH, "pressure": PRESSURE, "length": LENGTH}
    own = {"pressure": pressures, "length": lengths}
    axes: dict[str, Any] = {}
    for flag in (*MATERIAL, "ratio", "beta0", "beta1", "lam", *_GIVEN_FLAGS):
        text = getattr(arguments, flag)
        if text is not None:
            kind = NUMBER if plain else kinds.get(flag, NUMBER)
            signed = flag in ("beta0", "lam") or flag.startswith("pressure")
            shown = "--" + flag.replace("_", "-")
            axes[MATERIAL.get(flag, flag)] = parse_range(shown, text, kind, own=own.get(flag), signed=signed)
    if not axes:
        raise InvalidInput("give a rod and a question, at least one of them with several values.")
    return axes, rod


_GIVEN_FLAGS = tuple(f"{name}{ending}" for name in GIVEN for ending in ("", "_ratio"))


def _card_rod(path: str | None) -> Rod | None:
    if path is None:
        return None
    from .cards import load_card

    rod = load_card(path).rod()
    if rod is None:
        raise InvalidInput(f"card {path!r} has no [rod].")
    return rod
