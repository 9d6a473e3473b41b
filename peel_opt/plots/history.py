"""Loading histories: the load path over the equilibria, and where front, pressure and energy went in time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ..equilibria.branch import Branch
from ..motion.history import History
from . import style
from .axes import axes_or, own_axes, own_figure, require_axes
from .dispatch import drawn_by
from .motion import plot_equilibria
from .motion_panels import LOST, bracketed, energy_unit, scene_words
from .mpl import finish
from .words import axis_unit, length_unit, pressure_unit


@drawn_by.register
def plot_history(run: History, ax: Axes | None = None, *, branch: Branch | None = None) -> Axes:
    """Draw the path of a load, with what happens in time beside it where no axes are given.

    Parameters
    ----------
    run : History
    ax : Axes, optional
    branch : Branch, optional
        Equilibria of the same rod or scene, to be drawn under the path.

    Returns
    -------
    Axes
        Detached length against pressure, in the rod's units.

    Raises
    ------
    InvalidInput
        If the branch is of another rod or scene.
    """
    if ax is None:
        figure = own_figure(10.0, 6.4)
        panels = figure.subplot_mosaic([["path", "load"], ["path", "front"], ["path", "spent"]])
        _plot_load(run, panels["load"])
        _plot_front(run, panels["front"])
        plot_spent(run, panels["spent"])
        for name in ("load", "front"):
            panels[name].set_xlabel("")
        ax = panels["path"]
    require_axes(ax)
    longest = float(run.front.max() if branch is None else max(run.front.max(), np.max(branch.length)))
    lengths = length_unit(run.rod, longest)
    pressures = pressure_unit(run.rod, run.rod.adhesion_strength)
    if branch is not None:
        plot_equilibria(ax, branch, run, pressures, lengths)
    p, front = run.pressure / pressures.size, run.front / lengths.size
    ax.plot(p, front, color=style.PRESSURE, linewidth=1.8, label=f"{run.bond} bond")
    ax.plot(p[0], front[0], "o", color=style.PRESSURE, markerfacecolor="white")
    ax.plot(p[-1], front[-1], "D", color=style.PRESSURE)
    ax.set_xlabel(pressures.axis("p"))
    ax.set_ylabel(lengths.axis(r"\bar s"))
    ends = f"circle: where it starts; diamond: {run.outcome}{scene_words(run)}"
    ax.set_title(ends, fontsize=style.SMALL, loc="left")
    return finish(ax, columns=3)


def plot_spent(run: History, ax: Axes | None = None) -> Axes:
    """Draw what a history dissipates against time, as areas: what drag takes, and the bond on top of it.

    Parameters
    ----------
    run : History
    ax : Axes, optional

    Returns
    -------
    Axes
        Energies per width, in the rod's units.
    """
    ax = axes_or(ax, own_axes(6.0, 3.8))
    energies, below = energy_unit(run), np.zeros(len(run))
    for name, (look, _, label) in LOST.items():
        colour = style.STROKES[look].colour
        taken = getattr(run.energy, name)
        above = below + (taken - taken[0]) / energies.size
        ax.fill_between(_along(run, ax), below, above, color=colour, alpha=0.5, linewidth=0.0, label=label)
        below = above
    ax.set_ylim(0.0, None)
    ax.set_ylabel(bracketed("dissipated", energies))
    return finish(ax, columns=3)


def _plot_load(run: History, ax: Axes) -> None:
    pressures = pressure_unit(run.rod, run.rod.adhesion_strength)
    ax.plot(_along(run, ax), run.pressure / pressures.size, color=style.PRESSURE, linewidth=1.6)
    ax.set_ylim(0.0, None)
    ax.set_ylabel(pressures.axis("p"))


def _plot_front(run: History, ax: Axes) -> None:
    lengths = length_unit(run.rod, float(run.front.max()))
    ax.plot(_along(run, ax), run.front / lengths.size, color=style.ROD, linewidth=1.6)
    ax.set_ylabel(lengths.axis(r"\bar s"))


def _along(run: History, ax: Axes) -> np.ndarray:
    """Return the times of a history in the unit of the axis, which is named on it."""
    times = axis_unit(run.time_unit, float(run.t[-1]))
    ax.set_xlim(0.0, float(run.t[-1]) / times.size)
    ax.set_xlabel(times.axis("t"))
    return run.t / times.size
