"""Fig 9 over five decades: the detached length at the Maxwell point, from four sources.

Usage: python examples/maxwell_length_chart.py [PICTURE]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.analysis.design_relations import LEAST_RATIO, maxwell_exponent
from peel_opt.plots import picture_file, save_figure

RATIOS = np.geomspace(0.05, 1000.0, 87)  # eta/y0

#: Colour, line style and width of each source; the first three nearly coincide.
SOURCES = {
    "paper": ("#D55E00", "-", 4.0),
    "exact": ("#56B4E9", "-", 1.8),
    "fit": ("#000000", ":", 1.2),
    "branch": ("#000000", "-", 1.6),
}


def main(picture: str | None = None) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return sbar_M/y0 and d log sbar_M / d log eta by source, and draw them."""
    if picture is not None:
        picture_file(picture)
    chart = {
        source: (po.maxwell_length(RATIOS, source), maxwell_exponent(RATIOS, source)) for source in SOURCES
    }
    if picture is not None:
        save_figure(draw(chart), picture, dpi=100)
    return chart


def draw(chart: dict[str, tuple[np.ndarray, np.ndarray]]) -> Figure:
    """Draw lengths over the critical length (20), and exponents."""
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    critical = np.pi * RATIOS**0.75  # (20) over y0
    near = (RATIOS > 0.3) & (RATIOS < 3.0)
    for source, (length, exponent) in chart.items():
        colour, line, width = SOURCES[source]
        style = {"color": colour, "linestyle": line, "linewidth": width}
        left.loglog(RATIOS, length, label=source, **style)
        middle.plot(RATIOS[near], (length / critical)[near], **style)
        right.semilogx(RATIOS, exponent, **style)
    left.set_ylabel(r"$\bar s_M / y_0$")
    middle.set_ylabel(r"$\bar s_M / \bar s_c$")
    right.set_ylabel(r"$d \log \bar s_M / d \log \eta$ at fixed $y_0$")
    right.axhline(0.75, color="0.6", linewidth=0.8)
    for ax in (left, middle, right):
        ax.set_xlabel(r"$\eta / y_0$")
        ax.axvline(LEAST_RATIO, color="0.6", linewidth=0.8, linestyle=":")
        ax.spines[["top", "right"]].set_visible(False)
    left.legend(frameon=False)
    right.set_title("dotted: no Maxwell point to the left", fontsize=9, loc="right")
    return figure


if __name__ == "__main__":
    found = main(*sys.argv[1:2])
    print("eta/y0      " + "".join(f"{source:>18s}" for source in found))
    for i in range(0, len(RATIOS), 10):
        cells = "".join(f"{length[i]:11.5g} {exponent[i]:6.4f}" for length, exponent in found.values())
        print(f"{RATIOS[i]:9.4g}   {cells}")
