"""Every method at the ends of its range: ``python -m benchmarks.extremes [--points N] [--plot] [--page]``.

A seeded scan over (eta/y0, p/T0), over (beta0, beta1) under law (8) and under the linear law, and
over lambda down to 1e-8.  Each method answers each question with a certificate, or refuses it
with an error that has a name; that two of them contradict each other is the one outcome that
must not happen, and makes the exit code 1.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from statistics import median

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before NumPy: threads only disturb such small systems

import numpy as np

from peel_opt.plots import save_figure
from peel_opt.plots.figures.method_map import draw, scan_groups, scan_rods, scan_transition
from peel_opt.studies.tradeoff.compare import METHODS, Compared

DOCS = Path(__file__).parent.parent / "docs"
PICTURE, PAGE = DOCS / "img" / "method_map.png", DOCS / "extremes.md"

#: Between these lines of the page stands what the scan prints.
MARKS = ("<!-- scan -->", "<!-- end of scan -->")


def summary(title: str, scan: Sequence[Compared]) -> str:
    """One line for each method: what it answered, in what time, and how it refused the rest."""
    lines = [f"{title}: {len(scan)} questions", f"  {'method':<12}certified  median ms  unknowns  refused"]
    for method in METHODS:
        attempts = [place.by(method) for place in scan]
        good = [a for a in attempts if a.certified]
        refused = Counter(a.status for a in attempts if not a.certified)
        why = ", ".join(f"{n} {status}" for status, n in sorted(refused.items())) or "-"
        ms = f"{1e3 * median(a.seconds for a in good):9.2f}" if good else f"{'-':>9}"
        sizes = [round(a.unknowns) for a in good]
        size = f"{min(sizes)}-{max(sizes)}" if sizes else "-"
        lines.append(f"  {method:<12}{len(good):>9}  {ms}  {size:>8}  {why}")
    conditions = [a.condition for place in scan for a in place.attempts if a.certified]
    if conditions:
        lines.append(f"  largest condition of a certified answer: {max(conditions):.1e}")
    return "\n".join(lines)


def growth(scan: Sequence[Compared], method: str) -> float:
    """Exponent of beta1 in the unknowns of a method, by least squares beyond beta1 = 1000."""
    tried = [place.by(method) for place in scan]
    found = [(a.beta1, a.unknowns) for a in tried if a.certified and a.beta1 > 1e3]
    x, y = np.log(np.array(found)).T
    return float(np.polyfit(x, y, 1)[0])


def wrong(scan: Sequence[Compared]) -> list[str]:
    """Contradictions, in words."""
    return [
        f"WRONG at ({place.x!r}, {place.y!r}): {a.method} {a.answer!r} +- {a.error:.1e},"
        f" {b.method} {b.answer!r} +- {b.error:.1e}"
        for place in scan
        for a, b in place.contradictions
    ]


def renewed(page: str, scan: str) -> str:
    """Return the page with what the scan printed in its place."""
    before, rest = page.split(MARKS[0])
    _, after = rest.split(MARKS[1])
    return f"{before}{MARKS[0]}\n```text\n{scan}\n```\n{MARKS[1]}{after}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Scan, print, and judge."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=400, help="questions in each plane (400)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plot", action="store_true", help=f"also draw docs/img/{PICTURE.name}")
    parser.add_argument("--page", action="store_true", help=f"also renew the numbers in docs/{PAGE.name}")
    options = parser.parse_args(arguments)
    began = time.perf_counter()
    rods = scan_rods(options.points, options.seed)
    groups = scan_groups(options.points, options.seed)
    linear = scan_groups(options.points, options.seed, law="linear")
    transition = scan_transition(options.points, options.seed)
    lines, mistakes = [], []
    for title, scan in (
        ("length at given pressure, law (8)", rods),
        ("alpha1 at given groups, law (8)", groups),
        ("alpha1 at given groups, linear law", linear),
        ("alpha1 about the transition, linear law", transition),
    ):
        lines += [summary(title, scan), ""]
        mistakes += wrong(scan)
    for method in ("spectral", "collocation", "shooting"):
        lines.append(
            f"unknowns of {method} under law (8) grow like beta1^{growth([*rods, *groups], method):.3f}"
        )
    lines += [*mistakes, f"{len(mistakes)} contradictions; {time.perf_counter() - began:.0f} s"]
    print(*lines, sep="\n")
    if options.plot:
        save_figure(draw(rods, groups), PICTURE, dpi=110)
    if options.page:
        PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8"), "\n".join(lines)), encoding="utf-8")
    return 1 if mistakes else 0


if __name__ == "__main__":
    sys.exit(main())
