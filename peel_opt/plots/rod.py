"""Equilibria as pictures: one rod with the forces on it, or several shapes over each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from ..base.errors import InvalidInput
from ..equilibria.result import Equilibrium
from . import style
from .axes import axes_or
from .dispatch import draw
from .forces import Arrows, Forces, forces_on
from .frame import Scene, add_legend, dress, own_axes, stage
from .words import AxisUnit, length_unit, load, title, warnings_of


@draw.register
def plot_equilibrium(eq: Equilibrium, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw a rod in its true shape with the plate, the range of the adhesion and the forces.

    Pressure stands normal to the rod, adhesion is vertical and as long as its traction; where
    the linear law pushes, beyond y0, the rod is dashed and the arrows are hollow.  A shape too
    flat to be read gets a larger vertical scale, which the label of the axis states.

    Parameters
    ----------
    eq : Equilibrium
    ax : Axes, optional
        Without it a figure is made that needs no display.
    legend : bool, optional
        Whether to explain lines and arrows.

    Returns
    -------
    Axes

    Raises
    ------
    InvalidInput
        If nothing was found that could be drawn.
    """
    _require_shape(eq)
    unit = length_unit(eq.rod, eq.length)
    x, y = eq.x / unit.size, eq.y / unit.size
    scene = stage(x, y, _range(eq, unit))
    forces = forces_on(eq, x, y, scene.stretch, scene.arrow)
    ax = axes_or(ax, lambda: own_axes(scene))
    corners = np.concatenate(
        [
            np.stack([x, y], axis=-1),
            *(a.corners for a in (forces.pressure, forces.adhesion, forces.repulsion)),
        ]
    )
    dress(ax, scene, unit, corners)
    _draw_rod(ax, scene, x, y, _beyond(eq, y, scene))
    _draw_forces(ax, forces, eq.alpha)
    _caption(ax, eq)
    if legend:
        add_legend(ax, columns=2)
    return ax


def plot_family(
    equilibria: Sequence[Equilibrium],
    ax: Axes | None = None,
    *,
    labels: Sequence[str] | None = None,
    legend: bool = True,
) -> Axes:
    """Draw the shapes of several equilibria over one plate.

    Parameters
    ----------
    equilibria : sequence of Equilibrium
        All with rods or all without; lengths are then metres or each rod's own sbar.
    ax : Axes, optional
        Without it a figure is made that needs no display.
    labels : sequence of str, optional
        One for each shape; by default its pressure.
    legend : bool, optional
        Whether to name the shapes.

    Returns
    -------
    Axes

    Raises
    ------
    InvalidInput
        If there is nothing to draw, units are mixed, or labels do not match.
    """
    family = list(equilibria)
    names = _names(family) if labels is None else list(labels)
    if not family or len(names) != len(family):
        raise InvalidInput(f"a family needs shapes and a label for each, got {len(family)} and {len(names)}.")
    for eq in family:
        _require_shape(eq)
    if len({eq.rod is None for eq in family}) > 1:
        raise InvalidInput("some of the equilibria have a rod, some have not: their lengths differ in unit.")
    unit = length_unit(family[0].rod, max(eq.length for eq in family))
    shapes = [(eq.x / unit.size, eq.y / unit.size) for eq in family]
    ranges = [_range(eq, unit) for eq in family]
    x, y = (np.concatenate(parts) for parts in zip(*shapes, strict=True))
    shared = ranges[0] if all(np.allclose(r or 0.0, ranges[0] or 0.0) for r in ranges) else None
    scene = stage(x, y, shared)
    ax = axes_or(ax, lambda: own_axes(scene))
    dress(ax, scene, unit, np.stack([x, y], axis=-1))
    ax.plot([0.0, scene.right], [0.0, 0.0], color=style.ROD, linewidth=style.ROD_WIDTH, zorder=3)
    for (xs, ys), name, shade in zip(shapes, names, style.family_colours(len(family)), strict=True):
        (line,) = ax.plot(xs, ys, color=shade, linewidth=2.0, zorder=4, label=name)
        line.set_gid("rod")
        ax.plot(xs[:1], ys[:1], "o", color=shade, markersize=4.5, zorder=5)
    if legend:
        add_legend(ax, columns=2 if len(family) in (2, 4) else 3)
    return ax


def _names(family: list[Equilibrium]) -> list[str]:
    """Return the load of each shape, with the state where one load holds several."""
    loads = [load(eq) for eq in family]
    return [p if loads.count(p) == 1 else f"{p}, {eq.state}" for p, eq in zip(loads, family, strict=True)]


def _require_shape(eq: Equilibrium) -> None:
    if not eq.shape.x.size:
        raise InvalidInput(
            f"there is no shape to draw: status {eq.status!r}. {eq.message}".strip(),
            remedy="Draw only equilibria that were found.",
        )


def _range(eq: Equilibrium, unit: AxisUnit) -> float | None:
    """Return y0 in the coordinates of the axes; at beta0 = 0 the law has no range."""
    if eq.rod is not None:
        return eq.rod.adhesion_range / unit.size
    return eq.beta0 / eq.beta1 if eq.beta0 > 0.0 else None


def _beyond(eq: Equilibrium, y: np.ndarray, scene: Scene) -> float | None:
    """Return the height above which the law is used beyond its range, if the rod goes there."""
    if eq.law == "linear" and scene.y0 is not None and y.max() > scene.y0 * (1.0 + 1e-9):
        return scene.y0
    return None


def _draw_rod(ax: Axes, scene: Scene, x: np.ndarray, y: np.ndarray, limit: float | None) -> None:
    def draw(xs: np.ndarray, ys: np.ndarray, gid: str, label: str, dashes: str | tuple = "-") -> None:
        (line,) = ax.plot(
            xs,
            ys,
            color=style.ROD,
            linewidth=style.ROD_WIDTH,
            linestyle=dashes,
            solid_capstyle="butt",
            label=label,
            zorder=4,
        )
        line.set_gid(gid)

    draw(np.array([0.0, scene.right]), np.zeros(2), "attached", "_attached")
    if limit is None:
        draw(x, y, "rod", "_rod")
    else:
        x, y = _split(x, y, limit)
        draw(np.where(y <= limit, x, np.nan), y, "rod", "_rod")
        draw(
            np.where(y >= limit, x, np.nan),
            y,
            "rod-beyond-y0",
            "$y > y_0$, out of range",
            (0, (2.2, 1.1)),
        )
    for i, face, gid, label in (
        (0, "white", "tip", "free tip $s = 0$"),
        (-1, style.ROD, "detachment", r"detachment $s = \bar s$"),
    ):
        (mark,) = ax.plot(
            x[i : i + 1] if i == 0 else x[-1:],
            y[:1] if i == 0 else y[-1:],
            linestyle="none",
            marker="o",
            markersize=6.0,
            markerfacecolor=face,
            markeredgecolor=style.ROD,
            markeredgewidth=1.3,
            label=label,
            zorder=6,
            clip_on=False,
        )
        mark.set_gid(gid)


def _split(x: np.ndarray, y: np.ndarray, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Add to a polyline the points where it crosses ``level``."""
    crossing = np.flatnonzero((y[:-1] - level) * (y[1:] - level) < 0.0)
    part = (level - y[crossing]) / (y[crossing + 1] - y[crossing])
    at = x[crossing] + part * (x[crossing + 1] - x[crossing])
    return np.insert(x, crossing + 1, at), np.insert(y, crossing + 1, level)


def _draw_forces(ax: Axes, forces: Forces, alpha: float) -> None:
    scaled = f" (arrows × {forces.magnified:g})" if forces.magnified != 1.0 else ""
    _quiver(ax, forces.pressure, "pressure", f"pressure $p${scaled}", style.PRESSURE, visible=alpha != 0.0)
    _quiver(ax, forces.adhesion, "adhesion", r"adhesion $T_0\,\tau(y/y_0)$", style.ADHESION)
    _quiver(ax, forces.repulsion, "repulsion", "repulsion, not physical", style.WARNING, hollow=True)


def _quiver(
    ax: Axes,
    arrows: Arrows,
    gid: str,
    label: str,
    colour: str,
    *,
    hollow: bool = False,
    visible: bool = True,
) -> None:
    if not arrows.x.size or not visible:
        return
    drawn = ax.quiver(
        arrows.x,
        arrows.y,
        arrows.u,
        arrows.v,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        facecolor="white" if hollow else colour,
        edgecolor=colour,
        linewidth=0.8 if hollow else 0.0,
        path_effects=[withStroke(linewidth=2.4, foreground="white")] if hollow else None,
        zorder=5 if hollow else 3,
        **style.ARROW,
    )
    drawn.set_gid(gid)
    # A quiver has no entry of its own in a legend.
    ax.add_line(
        Line2D(
            [],
            [],
            linestyle="none",
            marker=r"$\Rightarrow$" if hollow else r"$\rightarrow$",
            markersize=13.0,
            markeredgewidth=0.2,
            color=colour,
            label=label,
        )
    )


def _caption(ax: Axes, eq: Equilibrium) -> None:
    """Put the numbers above the picture, and under them in another colour what to beware of."""
    warnings = warnings_of(eq.flags)
    line = 1.35 * style.SMALL
    ax.set_title(title(eq), loc="left", fontsize=style.SMALL, pad=6.0 + line * len(warnings))
    if warnings:
        note = ax.annotate(
            "\n".join(warnings),
            xy=(0.0, 1.0),
            xycoords="axes fraction",
            xytext=(0.0, 5.0),
            textcoords="offset points",
            va="bottom",
            fontsize=style.SMALL,
            color=style.WARNING,
        )
        note.set_gid("flags")
