"""Figure 10: the two shapes at p = T0/4, recomputed at the groups that the paper prints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...base.errors import NoEquilibrium
from ...equilibria.ask import equilibrium, pressure_given_length
from ...equilibria.result import Equilibrium
from ...model.rod import Rod
from .. import style
from . import look


@dataclass(frozen=True)
class Printed:
    """A panel of the figure as it is printed.

    Parameters
    ----------
    length : sbar/y0
    beta0, beta1 : the groups
    by_form, by_solver : the two values of alpha
    """

    letter: str
    length: float
    beta0: float
    beta1: float
    by_form: float
    by_solver: float


RATIO = 0.566
PANELS = (
    Printed("a", 2.128, 53.16, 113.1, 13.29, 14.86),
    Printed("b", 5.664, 1001.6, 5670.6, 250.4, 297.6),
)


def figure_10(points: int = 400) -> Figure:
    """Both shapes in units of y0, dashed where y > y0, with the printed and the computed alpha."""
    figure = look.new_figure(11.4, 4.7)
    panels, notes = figure.subplots(2, 2, width_ratios=(1.9, 4.8), height_ratios=(3.2, 0.9))
    for ax, note, printed in zip(panels, notes, PANELS, strict=True):
        rows = _panel(ax, printed, points)
        note.axis("off")
        note.text(0.0, 1.0, "\n".join(rows), va="top", fontsize=look.SMALL, linespacing=1.45)
    look.legend(panels[0], loc="upper left", bbox_to_anchor=(0.24, 1.0))
    look.footnote(
        figure,
        "Linear law, as in the paper; where the line is dashed it pushes, and no rod under law (8) has these"
        " shapes.  Both states have $p = T_0/4$ by (38) only.",
    )
    return figure


def recomputed(printed: Printed) -> Equilibrium:
    """Return the state at the printed groups whose alpha is nearest to the printed one."""
    near = printed.by_solver - printed.beta0
    return equilibrium(beta0=printed.beta0, beta1=printed.beta1, near=near)


def under_law_8(printed: Printed) -> Equilibrium | None:
    """Return the state of law (8) with the rod and the length of a panel, if there is one."""
    rod = Rod.from_ratio(RATIO)
    try:
        return pressure_given_length(rod, printed.length / RATIO)
    except NoEquilibrium:
        return None


def _panel(ax: Axes, printed: Printed, points: int) -> tuple[str, ...]:
    eq = recomputed(printed)
    size = printed.beta1 / printed.beta0  # sbar/y0
    x, y = eq.x * size, eq.y * size
    s = np.linspace(0.0, 1.0, points)
    x, y = (np.interp(s, eq.s, v) for v in (x, y))
    inside = y <= 1.0
    ax.plot(np.where(inside, x, np.nan), y, color=style.ROD, linewidth=2.2, label="linear law")
    beyond = ~inside | np.roll(~inside, 1) | np.roll(~inside, -1)
    ax.plot(
        np.where(beyond, x, np.nan),
        y,
        color=style.ROD,
        linewidth=2.2,
        linestyle=(0, (2.2, 1.1)),
        label="linear law, $y > y_0$",
    )
    ax.plot([0.0, 0.35], [0.0, 0.0], color=style.ROD, linewidth=2.2)
    ax.plot(x[0], y[0], "o", color="white", markeredgecolor=style.ROD, markersize=5.5, zorder=5)
    other = under_law_8(printed)
    if other is None:
        verdict = "law (8): no rod of this length"
    else:
        ax.plot(
            other.x * RATIO, other.y * RATIO, color="#56B4E9", linewidth=1.8, label="law (8), same length"
        )
        verdict = rf"law (8): $p/T_0 = {other.pressure_ratio:.6f}$"
    ax.axhline(0.0, color=style.PLATE, linewidth=0.8, zorder=0)
    ax.axhline(1.0, color=style.RANGE, linewidth=1.0, linestyle=":", zorder=0)
    ax.annotate("$y_0$", (1.0, 1.0), xycoords=ax.get_yaxis_transform(), color=style.RANGE, va="center")
    ax.set_aspect("equal", anchor="NW")
    ax.set_ylim(-0.1, 1.65)
    ax.set_xlim(float(x.min()) - 0.25, max(float(x.max()) + 0.25, 0.45))
    groups = rf"$\beta_0 = {printed.beta0}$, $\beta_1 = {printed.beta1}$"
    title = rf"({printed.letter})  $\bar s = {printed.length}\,y_0$, {groups}"
    look.tidy(ax, "$x/y_0$", "$y/y_0$", title)
    return (
        rf"$\alpha$, (33) as printed: {printed.by_form:g}",
        rf"$\alpha$, solver as printed: {printed.by_solver:g}",
        rf"$\alpha$ computed here: {eq.alpha:.7f}",
        rf"hence $p/T_0 = {eq.pressure_ratio:.6f}$",
        verdict,
    )
