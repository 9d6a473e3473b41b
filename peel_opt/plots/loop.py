"""Hysteresis loops: both sweeps, their jumps, and the states between that neither visits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from ..analysis.lambda_loop import HysteresisLoop
from ..analysis.loops import Loop
from ..analysis.pressure_loop import PressureLoop
from ..base.units import digits_left
from .dispatch import drawn_by
from .mpl import draw_panel
from .panels import Axis, Line, Mark, Panel, room
from .words import AxisUnit, length_unit, pressure_unit

#: Digits of the area in a title.
_DIGITS = 5

CONVENTIONS = {"delay": "delay", "maxwell": "Maxwell"}

#: Room around a loop, as a share of it.
_MARGIN = 0.06


@drawn_by.register
def plot_loop(loop: HysteresisLoop, ax: Axes | None = None) -> Axes:
    """Draw a loop in the (lambda, alpha1) plane: both sweeps, and the jumps as arrow heads.

    Parameters
    ----------
    loop : HysteresisLoop
    ax : Axes, optional
        Without it a figure is made that needs no display.

    Returns
    -------
    Axes
    """
    return draw_panel(lambda_panel(loop), ax, height=4.4)


@drawn_by.register
def plot_pressure_loop(loop: PressureLoop, ax: Axes | None = None) -> Axes:
    """Draw the loop of a rod in the (pressure, length) plane, with the unfolded states between.

    Parameters
    ----------
    loop : PressureLoop
    ax : Axes, optional
        Without it a figure is made that needs no display.

    Returns
    -------
    Axes
    """
    panel = pressure_panel(loop)
    return draw_panel(panel, ax, height=4.4, columns=3)


def lambda_panel(loop: HysteresisLoop, between: tuple[np.ndarray, np.ndarray] | None = None) -> Panel:
    """Return the picture of a loop at fixed beta0.

    Parameters
    ----------
    loop : HysteresisLoop
    between : tuple of ndarray, optional
        (lambda, alpha1) of the states that are not visited; by default the middle ones of its branch.
    """
    if between is None and loop.branch is not None:
        inside = loop.branch.state == "middle"
        between = loop.branch.lam[inside], loop.branch.alpha1[inside]
    solved = "solved states" if loop.source == "solver" else f"{loop.source}"
    title = (
        rf"$\beta_0 = {loop.beta0:g}$, {CONVENTIONS[loop.convention]} convention, {solved};"
        f" area {area_of(loop, 1.0)}"
    )
    one = AxisUnit(1.0, "")
    axes = r"$\lambda = \beta_1 - \pi^4$", r"extra pressure $\alpha_1$"
    return _panel(loop, between, (one, one), axes, r"$\lambda$", title)


def pressure_panel(loop: PressureLoop) -> Panel:
    """Return the picture of the loop of a rod, in its units."""
    pressure = pressure_unit(loop.rod, loop.rod.adhesion_strength)
    length = length_unit(loop.rod, float(loop.down.length.max()))
    units = loop.rod.adhesion_strength * loop.rod.eta
    axes = f"pressure {pressure.axis('p')}", f"detached length {length.axis(chr(92) + 'bar s')}"
    between = loop.between.pressure / pressure.size, loop.between.length / length.size
    title = (
        rf"$\eta/y_0 = {loop.rod.ratio:.4g}$; area {area_of(loop, units)} $T_0\,\eta$;"
        " quasi-static, jumps are no motion"
    )
    return _panel(loop, between, (pressure, length), axes, "$p$", title)


def area_of(loop: Loop[Any, Any], unit: float) -> str:
    """Return the area in a unit, to the digits that its error leaves, five at most."""
    area, error = loop.area / unit, loop.area_error / unit
    if not area:
        return "0"
    return f"{area:.{digits_left(area, error, _DIGITS) if np.isfinite(error) else 4}g}"


def _panel(
    loop: Loop[Any, Any],
    between: tuple[np.ndarray, np.ndarray] | None,
    units: tuple[AxisUnit, AxisUnit],
    axes: tuple[str, str],
    swept: str,
    title: str,
) -> Panel:
    up, down = (
        (sweep.swept / units[0].size, sweep.response / units[1].size) for sweep in (loop.up, loop.down)
    )
    lines = [] if between is None else [Line("between", *between, "not visited")]
    lines += [Line("up", *up, f"{swept} rising"), Line("down", *down, f"{swept} falling")]
    return Panel(
        Axis(axes[0], *room(np.concatenate([up[0], down[0]]), _MARGIN)),
        Axis(axes[1], *room(np.concatenate([up[1], down[1]]), _MARGIN)),
        tuple(lines),
        tuple(_jumps(loop, units, swept)),
        title=title,
    )


def _jumps(loop: Loop[Any, Any], units: tuple[AxisUnit, AxisUnit], swept: str) -> Iterator[Mark]:
    """An arrow head on each jump."""
    for jump in loop.jumps:
        word = "peels" if jump.direction == "up" else "readheres"
        points = "up" if jump.after > jump.before else "down"
        # Short of the middle, where the head of a jump back on the same way would hide it.
        at, middle = jump.swept / units[0].size, (0.6 * jump.before + 0.4 * jump.after) / units[1].size
        meaning = {"peels": "peels off", "readheres": "re-adheres"}[word] + f" at {swept} = {at:.4g}"
        yield Mark(f"{word}-{points}", at, middle, meaning, listed=False)
