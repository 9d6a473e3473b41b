"""Write the work-precision report of four scenes: ``python -m benchmarks.scenes``."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from matplotlib.figure import Figure as Canvas

import peel_opt as po
from peel_opt.studies.tradeoff.run import tradeoff

SCENES = {
    "near the transition: r = 1, P = 1 - 1e-6": partial(
        po.length_given_pressure, po.Rod.from_ratio(1.0), 1.0 - 1e-6
    ),
    "Fig 10a: beta0 = 53.16, beta1 = 113.1": partial(po.equilibrium, beta0=53.16, beta1=113.1),
    "law (8): r = 1, P = 0.2": partial(po.length_given_pressure, po.Rod.from_ratio(1.0), 0.2),
    "stiff end: r = 0.05, P = 0.96": partial(po.length_given_pressure, po.Rod.from_ratio(0.05), 0.96),
}

DOCS = Path(__file__).parent.parent / "docs"


def main() -> None:
    """Measure, and write the tables and the picture."""
    canvas = Canvas(figsize=(9.0, 7.0), layout="constrained")
    lines = [
        "# Work and precision of four scenes",
        "",
        "Written by `python -m benchmarks.scenes`: milliseconds are medians of five calls on one core,",
        "true errors are against a spectral solve with 54 and 81 nodes a phase. `solve_bvp` is SciPy's,",
        "with the Jacobian by hand, started from the solution. iter: steps of Newton's method and of IPOPT,",
        "on all meshes; size: unknowns of the finest; evals: evaluations of the equations, with or without",
        "their Jacobian.",
        "",
        "![True error against time, four scenes](img/work_precision.png)",
    ]
    for ax, (title, ask) in zip(canvas.subplots(2, 2).flat, SCENES.items(), strict=True):
        table = tradeoff(ask)
        table.plot(ax).set_title(title, fontsize="medium")
        lines += ["", f"## {title[0].upper()}{title[1:]}", "", "```text", repr(table), "```"]
    (DOCS / "img").mkdir(parents=True, exist_ok=True)
    canvas.savefig(DOCS / "img" / "work_precision.png", dpi=110)
    (DOCS / "work_precision.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
