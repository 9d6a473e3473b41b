"""Time against error, as a picture."""

from __future__ import annotations

import math

from matplotlib.axes import Axes

from ..studies.tradeoff.table import WorkPrecision
from . import style
from .axes import axes_or, own_axes
from .dispatch import drawn_by
from .mpl import finish
from .words import ANSWERS

#: Colour and marker of each method, in every picture that tells them apart.
METHOD_STYLES = {
    "series": (style.RANGE, "o"),
    "spectral": (style.ADHESION, "s"),
    "collocation": (style.PRESSURE, "D"),
    "shooting": (style.WARNING, "^"),
    "solve_bvp": (style.PLATE, "v"),
    "auto": (style.ROD, "P"),
}

#: For methods a caller configured.
_OTHERS = (("#56B4E9", "X"), ("#E69F00", "*"), ("#F0E442", "p"))

#: What no answer in double precision is better than.
_LEAST = 1e-16


@drawn_by.register
def plot_work(table: WorkPrecision, ax: Axes | None = None) -> Axes:
    """Draw true error against milliseconds, both logarithmic; return the axes.

    Below the grey line errors are those of the reference, and are drawn on it.
    """
    ax = axes_or(ax, own_axes(6.4, 4.8))
    least = max(table.reference_error, _LEAST)
    others = 0
    for method in table.methods:
        if method in METHOD_STYLES:
            colour, marker = METHOD_STYLES[method]
        else:
            colour, marker = _OTHERS[others % len(_OTHERS)]
            others += 1
        points = [
            (1e3 * row.seconds, max(row.true_error, least))
            for row in table.of(method)
            if math.isfinite(row.true_error)
        ]
        if points:
            ms, error = zip(*sorted(points), strict=True)
            ax.plot(ms, error, color=colour, marker=marker, markersize=5, label=method, linewidth=1.0)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.axhline(least, color=style.PLATE, linewidth=0.8, linestyle=":", zorder=0)
    ax.set_xlabel("time of one answer [ms]")
    ax.set_ylabel(f"true error of {ANSWERS.get(table.answered, table.answered)}")
    return finish(ax, columns=3)
