"""The minimum pressure of a rod against eta/y0, which the paper does not have."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ...continuation.goal import minimum_pressure
from ...continuation.primary import primary_branch
from ...model.bond import COHESIVE
from ...model.rod import RATIOS
from ...residual.closures import Closure
from .. import style
from . import look

_SMALL_PRINT: dict[str, Any] = {"fontsize": look.SMALL, "color": style.RANGE, "ha": "right", "va": "bottom"}

#: 1 - P_min tends to this times eta/y0.
SMALL_SLOPE = 1.022


def least_pressure(ratio: float) -> float:
    """Return p/T0 at the minimum pressure of a rod under law (8)."""
    fold = minimum_pressure(primary_branch(COHESIVE, Closure("ratio", ratio)))
    return float(fold.point.scalars.pressure_ratio)


def slender(ratio: np.ndarray) -> np.ndarray:
    """P_min of a rod whose eta is much longer than y0: (y0/(4 eta))^(3/2)."""
    return np.asarray((4.0 * ratio) ** -1.5)


def figure_p_min(points: int = 90) -> Figure:
    """Minimum pressure and its distance from T0 over six decades, with both asymptotes."""
    ratio = np.geomspace(*RATIOS, points)
    least = np.array([least_pressure(float(r)) for r in ratio])
    figure = look.new_figure(11.0, 4.4)
    left, middle, right = figure.subplots(1, 3)

    left.loglog(ratio, least, color=look.COHESIVE, linewidth=2.2, label="law (8)")
    far = ratio > 0.1
    left.loglog(ratio[far], slender(ratio[far]), label=r"$(y_0/4\eta)^{3/2}$", **look.PAPER_LINE)
    at_one = least_pressure(1.0)
    left.plot(1.0, at_one, "D", color="black", markersize=5, zorder=6)
    left.annotate(
        f"{at_one:.9f}\nat $\\eta = y_0$",
        (1.0, at_one),
        (7, 1),
        textcoords="offset points",
        fontsize=look.SMALL,
    )
    left.axhline(0.5, color=style.RANGE, linewidth=0.9, linestyle=":")
    left.text(ratio[-1], 0.55, "$T_0/2$: below, the tip is above $y_0$", **_SMALL_PRINT)
    look.tidy(left, r"$\eta/y_0$", r"$P_\mathrm{min} = p_\mathrm{min}/T_0$", "minimum pressure")
    look.legend(left, loc="lower left")

    near = ratio < 3.0
    middle.loglog(ratio, 1.0 - least, color=look.COHESIVE, linewidth=2.2, label="law (8)")
    middle.loglog(
        ratio[near], SMALL_SLOPE * ratio[near], label=rf"${SMALL_SLOPE}\,\eta/y_0$", **look.PAPER_LINE
    )
    middle.set_ylim(top=3.0)
    look.tidy(middle, r"$\eta/y_0$", r"$1 - P_\mathrm{min}$", "its distance from $T_0$")
    look.legend(middle, loc="lower right")

    right.loglog(
        ratio, np.abs(least / slender(ratio) - 1.0), color=look.LINEAR, label=r"of $(y_0/4\eta)^{3/2}$"
    )
    right.loglog(
        ratio,
        np.abs((1.0 - least) / (SMALL_SLOPE * ratio) - 1.0),
        color=look.PAPER,
        linestyle="--",
        label=rf"of ${SMALL_SLOPE}\,\eta/y_0$",
    )
    right.set_ylim(1e-7, 3.0)
    look.tidy(right, r"$\eta/y_0$", "relative deviation", "how far the asymptotes are off")
    look.legend(right, loc="lower left")
    return figure
