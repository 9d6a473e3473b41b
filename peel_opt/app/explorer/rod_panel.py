"""The rod in its true shape, with plate, y0 and the forces on it."""

from __future__ import annotations

import numpy as np

from ...equilibria.result import Equilibrium
from ...model.rod import Rod
from .panels import Arrows, Axis, Line, RodPanel

#: Every third point of the shape is drawn: a line through some 35 per phase shows no corner.
_EVERY = 3


def rod_panel(eq: Equilibrium) -> RodPanel:
    """Return the picture of an equilibrium.

    Parameters
    ----------
    eq : Equilibrium
        One that was found.
    """
    from ...plots.forces import forces_on
    from ...plots.frame import stage
    from ...plots.words import length_unit

    unit = length_unit(eq.rod, eq.length)
    x, y = eq.x / unit.size, eq.y / unit.size
    y0 = None
    if eq.beta0:
        y0 = eq.length * eq.beta0 / eq.beta1 / unit.size  # y0/sbar = beta0/beta1
    scene = stage(x, y, y0)
    forces = forces_on(eq, x, y, scene.stretch, scene.arrow)
    arrows = []
    named = (
        ("pressure", forces.pressure, "pressure p" if eq.alpha >= 0.0 else "suction p < 0"),
        ("adhesion", forces.adhesion, "adhesion f"),
        ("repulsion", forces.repulsion, "push"),
    )
    corners = [np.stack([x, y], axis=-1)]
    for look, drawn, label in named:
        if drawn.x.size:
            scale = f" (× {forces.magnified:g})" if look == "pressure" and forces.magnified != 1.0 else ""
            heads = drawn.x + drawn.u, drawn.y + drawn.v
            arrows.append(Arrows(look, drawn.x, drawn.y, *heads, label + scale))
            corners.append(drawn.corners)
    low, high = (edge(np.concatenate(corners), axis=0) for edge in (np.min, np.max))
    pad = 0.03 * scene.width
    bottom = min(low[1] - pad / scene.stretch, -scene.plate_depth)
    across, up = _labels(unit.name, unit.is_symbol)
    if scene.stretch != 1.0:
        up += f", scale × {scene.stretch:g}"
    return RodPanel(
        x=Axis(across, float(min(low[0], scene.left) - pad), float(scene.right)),
        y=Axis(up, float(bottom), float(max(high[1], scene.height) + pad / scene.stretch)),
        stretch=scene.stretch,
        lines=_rod_lines(eq, x, y, y0),
        arrows=tuple(arrows),
        y0=y0,
        shows_y0=scene.shows_range,
    )


def adhered_panel(rod: Rod | None, length: float) -> RodPanel:
    """Return the picture of the straight rod, ``length`` being what was detached."""
    from ...plots.words import length_unit

    unit = length_unit(rod, length)
    span = length / unit.size
    across, up = _labels(unit.name, unit.is_symbol)
    y0 = None if rod is None else rod.adhesion_range / unit.size
    shows = y0 is not None and y0 < 0.5 * span
    line = Line("rod", np.array([-span, 0.3 * span]), np.zeros(2), "rod")
    return RodPanel(
        Axis(across, -1.05 * span, 0.32 * span),
        Axis(up, -0.12 * span, 0.6 * span),
        1.0,
        (line,),
        (),
        y0,
        shows,
    )


def _labels(name: str, is_symbol: bool) -> tuple[str, str]:
    name = name.replace(r"\bar s", "s̄").replace(r"\eta", "η")
    return (f"x/{name}", f"y/{name}") if is_symbol else (f"x [{name}]", f"y [{name}]")


def _rod_lines(eq: Equilibrium, x: np.ndarray, y: np.ndarray, y0: float | None) -> tuple[Line, ...]:
    """The rod and its attached part; in pieces where the law is left."""
    attached = Line("rod", np.array([x[-1], x[-1] + 10.0 * (abs(x).max() + 1.0)]), np.zeros(2))
    rows = np.unique([*range(0, len(x), _EVERY), len(x) - 1])
    outside = np.zeros(len(x), bool)
    if "y > y0" in eq.flags and y0 is not None:
        outside = y > y0
        changes = np.flatnonzero(outside[1:] != outside[:-1])
        rows = np.unique([*rows, *changes, *(changes + 1)])
    lines, start = [], 0
    picked = outside[rows]
    for i in range(1, len(rows) + 1):
        if i == len(rows) or picked[i] != picked[start]:
            piece = rows[start : min(i + 1, len(rows))]
            look = "beyond" if picked[start] else "rod"
            lines.append(Line(look, x[piece], y[piece], "rod" if look == "rod" else "beyond y₀"))
            start = i
    return (*lines, attached)
