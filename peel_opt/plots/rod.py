"""Equilibria as pictures: one rod with the forces on it, or several shapes over each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ..base.errors import InvalidInput
from ..equilibria.result import Equilibrium
from ..model.mixed_bonds import LINE
from ..model.rod import Rod
from .dispatch import drawn_by
from .forces import ForceArrows, forces_on
from .frame import Frame, stage
from .mpl import draw_panel
from .panels import Arrows, Line, Mark, Panel
from .scene import scene_panel
from .words import AxisUnit, length_unit, load, title, warnings_of


@drawn_by.register
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
    return draw_panel(rod_panel(eq), ax, legend=legend)


def rod_panel(eq: Equilibrium) -> Panel:
    """Return the picture of a rod: see `plot_equilibrium`.

    Parameters
    ----------
    eq : Equilibrium

    Returns
    -------
    Panel

    Raises
    ------
    InvalidInput
        If nothing was found that could be drawn.
    """
    _require_shape(eq)
    unit = length_unit(eq.rod, eq.length)
    if eq.scene is not None:
        return scene_panel(eq, _range(eq, unit))
    x, y = eq.x / unit.size, eq.y / unit.size
    frame = stage(x, y, _range(eq, unit))
    forces = forces_on(eq, x, y, frame.stretch, frame.arrow)
    scaled = f" (× {forces.magnified:g})", f" (arrows × {forces.magnified:g})"
    short, full = scaled if forces.magnified != 1.0 else ("", "")
    drawn = (
        (forces.pressure, "pressure", f"pressure $p${short}", f"pressure $p${full}"),
        (forces.adhesion, "adhesion", "adhesion $f$", r"adhesion $T_0\,\tau(y/y_0)$"),
        (forces.repulsion, "repulsion", "repulsion", "repulsion, not physical"),
    )
    shown = [entry for entry in drawn if entry[0].x.size and (entry[1] != "pressure" or eq.alpha != 0.0)]
    corners = np.concatenate([np.stack([x, y], axis=-1), *(force.corners for force, *_ in drawn)])
    across, up = frame.axes(unit, corners)
    ends = ((0, "tip", "free tip $s = 0$"), (-1, "detachment", r"detachment $s = \bar s$"))
    return Panel(
        across,
        up,
        (_attached(frame), *_rod(x, y, _beyond(eq, y, frame))),
        tuple(Mark(look, float(x[i]), float(y[i]), meaning) for i, look, meaning in ends),
        tuple(_arrows(*entry) for entry in shown),
        title(eq),
        tuple(warnings_of(eq.flags)),
        ground=frame.ground,
    )


def adhered_panel(rod: Rod | None, length: float) -> Panel:
    """Return the picture of the straight rod, ``length`` being what was detached."""
    unit = length_unit(rod, length)
    ends = np.array([-length / unit.size, 0.0])
    y0 = None if rod is None else rod.adhesion_range / unit.size
    frame = stage(np.array([*ends, 0.2 * -ends[0]]), np.array([0.0, 0.0, 0.3 * -ends[0]]), y0)
    across, up = frame.axes(unit, np.array([[ends[0], 0.0]]))
    lines = (_attached(frame), Line("rod", ends, np.zeros(2)))
    return Panel(across, up, lines, title="adhered", ground=frame.ground)


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
    frame = stage(x, y, shared)
    looks = [f"family {i}/{len(family)}" for i in range(len(family))]
    lines = [Line(k, *shape, name) for k, shape, name in zip(looks, shapes, names, strict=True)]
    tips = [
        Mark("member", float(xs[0]), float(ys[0]), "", of=k, listed=False)
        for k, (xs, ys) in zip(looks, shapes, strict=True)
    ]
    panel = Panel(
        *frame.axes(unit, np.stack([x, y], axis=-1)),
        (_attached(frame), *lines),
        tuple(tips),
        ground=frame.ground,
    )
    columns = 2 if len(family) in (2, 4) else 3
    return draw_panel(panel, ax, legend=legend, columns=columns)


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
    """Return y0 in the coordinates of the axes; at beta0 = 0, and without a law, there is no range."""
    if eq.law == LINE.name:
        return None
    if eq.rod is not None:
        return eq.rod.adhesion_range / unit.size
    return eq.beta0 / eq.beta1 if eq.beta0 > 0.0 else None


def _beyond(eq: Equilibrium, y: np.ndarray, frame: Frame) -> float | None:
    """Return the height above which the law is used beyond its range, if the rod goes there."""
    if eq.law == "linear" and frame.y0 is not None and y.max() > frame.y0 * (1.0 + 1e-9):
        return frame.y0
    return None


def _attached(frame: Frame) -> Line:
    # Beyond the frame, since a page may show more than it.
    return Line("attached", np.array([0.0, frame.right + 10.0 * frame.width]), np.zeros(2))


def _rod(x: np.ndarray, y: np.ndarray, limit: float | None) -> tuple[Line, ...]:
    """The detached part; what is above a limit apart."""
    if limit is None:
        return (Line("rod", x, y),)
    crossing = np.flatnonzero((y[:-1] - limit) * (y[1:] - limit) < 0.0)
    part = (limit - y[crossing]) / (y[crossing + 1] - y[crossing])
    at = x[crossing] + part * (x[crossing + 1] - x[crossing])
    x, y = np.insert(x, crossing + 1, at), np.insert(y, crossing + 1, limit)
    return (
        Line("rod", np.where(y <= limit, x, np.nan), y),
        Line("rod-beyond-y0", np.where(y >= limit, x, np.nan), y, "$y > y_0$", "$y > y_0$, out of range"),
    )


def _arrows(force: ForceArrows, look: str, label: str, full: str) -> Arrows:
    return Arrows(look, force.x, force.y, force.x + force.u, force.y + force.v, label, full)
