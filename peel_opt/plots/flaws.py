"""Flaws: which edge without glue is safe, how it opens, and which unfolded flap is in equilibrium."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ..analysis.loading import LoadingCurve
from ..analysis.unbonded import FlawLimit
from ..base.errors import InvalidInput
from ..equilibria.branch import Branch
from ..model.rod import Rod, require_rod
from . import style
from .axes import axes_or, own_axes
from .dispatch import drawn_by
from .mpl import finish
from .words import length_unit, pressure_unit

#: Ratio of the longest to the shortest length above which axes are logarithmic.
WIDE = 20.0


def plot_held_lengths(branch: Branch, ax: Axes | None = None) -> Axes:
    """Draw the unfolded flaps of a rod that are in equilibrium, and the pressures between which they are.

    Nothing holds them there, since they are unstable at fixed pressure, and their length contains the
    cohesive zone: the chart does not say which flaw is safe.

    Parameters
    ----------
    branch : Branch
        Of a rod, from `peel_opt.trace`; its unfolded part is drawn.
    ax : Axes, optional

    Returns
    -------
    Axes
        Detached length [rod's unit] against pressure.

    Raises
    ------
    InvalidInput
        If the branch is not that of a rod from T to its minimum pressure.
    """
    if branch.rod is None or not branch.special("LP-pressure") or not np.any(branch.state == "middle"):
        raise InvalidInput("a chart of held lengths needs the branch of a rod past its minimum pressure.")
    ax = axes_or(ax, own_axes(6.0, 4.2))
    least = branch.special("LP-pressure")[0].index
    rod, unfolded = branch.rod, slice(0, least + 1)
    lengths = length_unit(rod, float(branch.length[unfolded].max()))
    pressures = pressure_unit(rod, rod.adhesion_strength)
    x, y = branch.length[unfolded] / lengths.size, branch.pressure[unfolded] / pressures.size
    top, bottom = rod.adhesion_strength / pressures.size, float(y[-1])
    logarithmic = x.max() > WIDE * x.min()
    left, right = (x.min() / 5.0, 2.0 * x.max()) if logarithmic else (0.0, 1.15 * x.max())
    floor, ceiling = (bottom / 5.0, 4.0 * top) if logarithmic else (0.0, 1.12 * top)
    if logarithmic:
        ax.set(xscale="log", yscale="log")

    def between(a: float, b: float) -> float:
        return float(np.sqrt(a * b)) if logarithmic else 0.5 * (a + b)

    ax.axhspan(top, ceiling, color=style.PRESSURE, alpha=0.30, linewidth=0)
    ax.axhspan(floor, bottom, color=style.ADHESION, alpha=0.30, linewidth=0)
    ax.plot(x, y, color=style.ROD, linewidth=style.ROD_WIDTH, linestyle=(0, (4.0, 1.8)))
    ax.plot([x[0]], [y[0]], "o", color=style.ROD)
    ax.plot([x[-1]], [y[-1]], "D", color=style.WARNING)
    ax.set(xlim=(left, right), ylim=(floor, ceiling))
    ax.set_xlabel(lengths.axis(r"\bar s"))
    ax.set_ylabel(pressures.axis("p"))
    middle = between(left, right)
    texts = [
        (middle, between(top, ceiling), r"the bond itself fails, $p \geq T_0$"),
        (middle, between(floor, bottom), r"no such equilibrium, $p < p_{\min}$"),
    ]
    for where, height, text in texts:
        ax.text(where, height, text, ha="center", va="center", fontsize=style.SMALL)
    ax.set_title(
        rf"$\eta/y_0 = {rod.ratio:.4g}$; dashed: the flap in equilibrium, which nothing holds there",
        fontsize=style.SMALL,
        loc="left",
    )
    return finish(ax)


@drawn_by.register
def plot_loading_curve(curve: LoadingCurve, ax: Axes | None = None) -> Axes:
    """Draw how an edge without glue opens.

    Parameters
    ----------
    curve : LoadingCurve
    ax : Axes, optional

    Returns
    -------
    Axes
        Pressure against detached length, in the rod's units.
    """
    ax = axes_or(ax, own_axes(5.0, 3.6))
    lengths = length_unit(curve.rod, float(curve.length.max()))
    pressures = pressure_unit(curve.rod, float(curve.pressure.max()))
    x, y = curve.length / lengths.size, curve.pressure / pressures.size
    ax.plot(x, y, color=style.ROD, linewidth=style.ROD_WIDTH)
    ax.plot(x[-1:], y[-1:], "D", color=style.WARNING if curve.ended == "snap" else style.ROD)
    ax.set_xlabel(lengths.axis(r"\bar s"))
    ax.set_ylabel(pressures.axis("p"))
    unit = f"${lengths.name}$" if lengths.is_symbol else lengths.name
    ends = "diamond: it snaps" if curve.ended == "snap" else "it grows stably"
    ax.set_title(
        f"edge without glue on {curve.flaw / lengths.size:.4g} {unit}; {ends}",
        fontsize=style.SMALL,
        loc="left",
    )
    return finish(ax)


def plot_safe_pressures(rod: Rod, limits: Sequence[FlawLimit], ax: Axes | None = None) -> Axes:
    """Draw the pressure at which an edge without glue snaps against its length: below the line it holds.

    Parameters
    ----------
    rod : Rod
    limits : sequence of FlawLimit
        Of that rod, from `peel_opt.safe_pressure`, two or more.
    ax : Axes, optional

    Returns
    -------
    Axes
        Pressure against length without glue, in the rod's units.

    Raises
    ------
    InvalidInput
        If there are fewer than two.
    """
    require_rod(rod)
    if len(limits) < 2 or not all(isinstance(limit, FlawLimit) for limit in limits):
        raise InvalidInput(
            "a chart of flaws needs two or more limits.", remedy="Call safe_pressure for each."
        )
    ax = axes_or(ax, own_axes(5.0, 3.6))
    ordered = sorted(limits, key=lambda limit: limit.flaw)
    flaws, snaps = (np.array([getattr(limit, name) for limit in ordered]) for name in ("flaw", "pressure"))
    lengths, pressures = length_unit(rod, float(flaws.max())), pressure_unit(rod, rod.adhesion_strength)
    top = rod.adhesion_strength / pressures.size
    x, y = flaws / lengths.size, snaps / pressures.size
    ax.axhspan(top, 1.12 * top, color=style.PRESSURE, alpha=0.30, linewidth=0)
    ax.fill_between(x, y, color=style.ADHESION, alpha=0.30, linewidth=0)
    ax.plot(x, y, color=style.ROD, linewidth=style.ROD_WIDTH)
    ax.set(xlim=(0.0, 1.02 * x.max()), ylim=(0.0, 1.12 * top))
    ax.set_xlabel(lengths.axis("a"))
    ax.set_ylabel(pressures.axis("p"))
    ax.text(
        0.5 * x.max(),
        1.06 * top,
        r"the bond itself fails, $p \geq T_0$",
        ha="center",
        va="center",
        fontsize=style.SMALL,
    )
    ax.set_title(
        rf"$\eta/y_0 = {rod.ratio:.4g}$; above the line an edge without glue on $a$ snaps",
        fontsize=style.SMALL,
        loc="left",
    )
    return finish(ax)
