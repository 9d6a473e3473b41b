"""The effective potential (Fig 7) and hysteresis loops."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.lambda_loop import HysteresisLoop
from ..analysis.potential import EffectivePotential
from ..analysis.pressure_loop import PressureLoop
from . import style
from .axes import axes_or
from .dispatch import draw

#: Lines of neighbouring curves, which differ in grey too.
LINES: tuple[Any, ...] = ("-", (0, (6.0, 1.5)), (0, (4.0, 1.2, 1.0, 1.2)), (0, (1.4, 1.0)))

#: Markers by kind of critical point, and whether they are filled.
MARKERS = {"minimum": ("o", True), "maximum": ("o", False), "inflection": ("s", False)}


def plot_potential(
    potential: EffectivePotential, lam: Sequence[float] | None = None, ax: Axes | None = None
) -> Axes:
    """Draw U_e(alpha1) at some values of lambda with its critical points marked, as in Fig 7.

    Parameters
    ----------
    potential : EffectivePotential
        Such as ``NormalForm.paper().at(4.0)``.
    lam : sequence of float, optional
        Default: below the fold, at the fold, at the Maxwell point, and towards zero from there;
        at beta0 = 4 they are those of Fig 7, -0.4, lambda_F, lambda_M and -0.1.
    ax : Axes, optional
        Without it a figure is made that needs no display.

    Returns
    -------
    Axes
    """
    ax = axes_or(ax, _own_axes)
    named = _named(potential) if lam is None else [(float(value), f"{value:.4g}") for value in lam]
    lowest = min(float(x) for value, _ in named for x in [0.0, *potential.alpha1(value)])
    span = max(-lowest, 1e-3)
    x = np.linspace(max(-1.22 * span, potential.domain[0]), min(0.32 * span, potential.domain[1]), 401)
    curves = [potential(x, value) for value, _ in named]
    marks = [potential.critical_points(value) for value, _ in named]
    looks = zip(style.family_colours(len(named)), cycle(LINES))
    for curve, points, (_, name), (shade, line) in zip(curves, marks, named, looks, strict=True):
        ax.plot(x, curve, color=shade, linestyle=line, linewidth=1.8, label=rf"$\lambda = {name}$")
        for point in points:
            marker, filled = MARKERS[point.kind]
            ax.plot(
                point.alpha1,
                point.potential,
                marker,
                color=shade,
                markerfacecolor=shade if filled else "white",
                markersize=6,
                zorder=5,
            )
    heights = [point.potential for points in marks for point in points]
    size = max(max(heights) - min(heights), 1e-300)
    ax.set_ylim(min(heights) - 0.45 * size, max(heights) + 0.75 * size)
    ax.set_xlim(x[0], x[-1])
    ax.axhline(0.0, color=style.PLATE, linewidth=0.8, zorder=0)
    ax.set_xlabel(r"extra pressure $\alpha_1$")
    ax.set_ylabel(r"effective potential $U_e$")
    ax.set_title(rf"$\beta_0 = {potential.beta0:g}$", fontsize=style.SMALL, loc="left")
    for marker, filled, text in (("o", True, "minimum"), ("o", False, "maximum"), ("s", False, "inflection")):
        face = "black" if filled else "white"
        ax.plot([], [], marker, color="black", markerfacecolor=face, markersize=6, label=text)
    _tidy(ax)
    return ax


@draw.register
def plot_loop(loop: HysteresisLoop, ax: Axes | None = None) -> Axes:
    """Draw a loop in the (lambda, alpha1) plane: both sweeps, and the jumps as arrows.

    Parameters
    ----------
    loop : HysteresisLoop
    ax : Axes, optional
        Without it a figure is made that needs no display.

    Returns
    -------
    Axes
    """
    ax = axes_or(ax, _own_axes)
    if loop.branch is not None:
        inside = loop.branch.state == "middle"
        _unvisited(ax, loop.branch.lam[inside], loop.branch.alpha1[inside], "middle branch")
    up, down = ((sweep.lam, sweep.alpha1) for sweep in (loop.up, loop.down))
    _sweeps(ax, up, down, r"$\lambda$")
    for jump in loop.jumps:
        _arrow(ax, jump.direction, (jump.lam, jump.alpha1_before), (jump.lam, jump.alpha1_after))
    ax.set_xlabel(r"$\lambda = \beta_1 - \pi^4$")
    ax.set_ylabel(r"extra pressure $\alpha_1$")
    states = "solved states" if loop.source == "solver" else f"normal form: {loop.source}"
    ax.set_title(
        rf"$\beta_0 = {loop.beta0:g}$, {loop.convention} convention, {states}; area {loop.area:.4g}",
        fontsize=style.SMALL,
        loc="left",
    )
    _tidy(ax, loc="lower left")
    return ax


@draw.register
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
    ax = axes_or(ax, _own_axes)
    T0, eta = loop.rod.adhesion_strength, loop.rod.eta
    _unvisited(ax, loop.between.pressure / T0, loop.between.length / eta, "unfolded states")
    up, down = ((sweep.pressure / T0, sweep.length / eta) for sweep in (loop.up, loop.down))
    _sweeps(ax, up, down, r"$p$")
    for jump in loop.jumps:
        here, there = ((jump.pressure / T0, v / eta) for v in (jump.length_before, jump.length_after))
        _arrow(ax, jump.direction, here, there)
    ax.set_xlabel(r"pressure $p/T_0$")
    ax.set_ylabel(r"detached length $\bar s/\eta$")
    ax.set_title(
        rf"$\eta/y_0 = {loop.rod.ratio:.4g}$; what happens in a jump is not computed",
        fontsize=style.SMALL,
        loc="left",
    )
    _tidy(ax, loc="center", bbox_to_anchor=(0.5, 0.25))
    return ax


def _named(potential: EffectivePotential) -> list[tuple[float, str]]:
    """The four values of Fig 7, in units of the fold's, with the names of the two that have one."""
    fold, maxwell = potential.fold()[0], potential.maxwell()[0]
    if potential.beta0 == 0.0:
        return [(value, f"{value:g}") for value in (-0.4, 0.0, 0.4)]
    scale = (potential.beta0 / 4.0) ** 2
    low, high = -0.4 * scale, -0.1 * scale
    return [
        (low, f"{low:.4g}"),
        (fold, rf"\lambda_F = {fold:.4g}"),
        (maxwell, rf"\lambda_M = {maxwell:.4g}"),
        (high, f"{high:.4g}"),
    ]


def _unvisited(ax: Axes, x: np.ndarray, y: np.ndarray, label: str) -> None:
    """States between the two of a jump, which no sweep visits."""
    ax.plot(x, y, "--", color=style.PLATE, linewidth=1.4, label=label)


def _sweeps(
    ax: Axes, up: tuple[np.ndarray, np.ndarray], down: tuple[np.ndarray, np.ndarray], swept: str
) -> None:
    """Both sweeps: up as line with open circles, down as line with dots, so that overlaps show."""
    ax.plot(*up, "o-", color=style.PRESSURE, markerfacecolor="white", markersize=5, label=f"{swept} rising")
    ax.plot(*down, ".-", color=style.ADHESION, markersize=4, linewidth=1.0, label=f"{swept} falling")


def _arrow(
    ax: Axes, direction: Literal["up", "down"], here: tuple[float, float], there: tuple[float, float]
) -> None:
    """An arrow head in the middle of a jump."""
    shade = style.PRESSURE if direction == "up" else style.ADHESION
    middle = (0.5 * (here[0] + there[0]), 0.5 * (here[1] + there[1]))
    start = (0.45 * there[0] + 0.55 * here[0], 0.45 * there[1] + 0.55 * here[1])
    ax.annotate(
        "",
        xy=middle,
        xytext=start,
        arrowprops={"arrowstyle": "-|>", "color": shade, "mutation_scale": 18, "linewidth": 0.0},
    )


def _own_axes() -> Axes:
    return Figure(figsize=(6.4, 4.4), layout="constrained").subplots()


def _tidy(ax: Axes, **where: Any) -> None:
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, fontsize=style.SMALL, **where)
