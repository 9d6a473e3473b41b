"""The picture of a scene: wall, edge without glue, every load, tip, and a strip as a whole."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..equilibria.result import Equilibrium
from ..model.scene import Scene
from ..model.tips import Contact, Middle, TipLoad
from .frame import Frame, stage
from .panels import Arrows, Line, Mark, Panel
from .scene_forces import Drawn, acting_on, drawn_along, kinds_of, numbers_of, places
from .walls import ROUND, solid, walls
from .words import amount, length_unit, quantity, title, warnings_of

#: What the picture of a rod may be made of, from the bottom to the top, for a pen that must know before.
LINES = ("range", "wall", "attached", "mirror", "rod", "unbonded", "rod-beyond-y0", "arc")
ARROWS = (
    "pressure",
    "adhesion",
    "repulsion",
    "weight",
    "friction",
    "drag",
    "load",
    "tip-force",
    "moment",
)

#: Numbers of a scene that have arrows, lines or a title of their own.
_SHOWN = {"weight", "tilt", "friction", "share", "drag", "force", "angle", "moment", "reaction", "curvature"}

#: Radius of the arc that is a moment, over the longest arrow, and the angles [rad] it runs between.
_ARC, _FROM, _TO = 0.45, 0.35 * math.pi, 1.75 * math.pi


def scene_panel(eq: Equilibrium, y0: float | None) -> Panel:
    """Return the picture of a state of a scene.

    Parameters
    ----------
    eq : Equilibrium
        It has a shape and a scene; of one in words, which a file holds, what acts is not drawn.
    y0 : float or None
        Range of the bond in the coordinates of the axes.

    Returns
    -------
    Panel
    """
    unit = length_unit(eq.rod, eq.length)
    x, y = eq.x / unit.size, eq.y / unit.size
    scene = eq.scene if isinstance(eq.scene, Scene) else None
    mirrored = scene is not None and isinstance(scene.tip, Middle)
    frame = stage(np.append(x, 2.0 * x[0] - x) if mirrored else x, np.append(y, y) if mirrored else y, y0)
    bent = eq.numbers.get("curvature", 0.0) * unit.size
    if abs(bent) * frame.width > ROUND:
        frame = replace(frame, stretch=1.0)
    under_rod = walls(frame, bent, unit, eq.rod, left=2.0 * x[0] if mirrored else None)
    rod, marks = _rod(eq, x, y, "middle" if mirrored else "free tip")
    if mirrored:
        rod.insert(0, Line("mirror", 2.0 * x[0] - x, y, "", "its mirror image"))
    at_tip, arrows = ([], []) if scene is None else _tip(eq, scene, (float(x[0]), float(y[0])), frame)
    if scene is not None:
        along = drawn_along(eq, acting_on(eq, scene), x, y, frame.stretch, frame.arrow)
        arrows = [*(_arrows(eq, each) for each in along), *arrows]
    drawn = [(line.x, line.y) for line in under_rod if line.look == "wall"]
    # Of a wall that goes on for ever only what is under the rod.
    under = [np.stack(xy, axis=-1)[(xy[0] >= frame.left) & (xy[0] <= frame.right)] for xy in drawn]
    corners = [np.stack([x, y], axis=-1), *(np.stack([a.x1, a.y1], axis=-1) for a in arrows), *under]
    corners += [np.stack([line.x, line.y], axis=-1) for line in at_tip]
    across, up = frame.axes(unit, np.concatenate(corners))
    if mirrored:
        across = replace(across, low=2.0 * float(x[0]) - across.high)
    others = [] if scene is None else _others(eq, scene)
    lost = [f"not drawn: what acts in {eq.scene}"[:100]] if scene is None else []
    ground = frame.ground
    return Panel(
        across,
        up,
        (*under_rod, *rod, *at_tip),
        tuple(marks),
        tuple(arrows),
        "\n".join([title(eq), *([", ".join(others)] if others else [])]),
        (*warnings_of(eq.flags), *lost),
        ground=replace(ground, y0=None, shows_y0=False, solid=solid(under_rod[0], frame, bent))
        if bent
        else ground,
    )


def _rod(eq: Equilibrium, x: np.ndarray, y: np.ndarray, first: str) -> tuple[list[Line], list[Mark]]:
    """Return the detached rod, what was never glued of it apart, and its ends."""
    lines, marks = [Line("rod", x, y)], [Mark("tip", float(x[0]), float(y[0]), f"{first} $s = 0$")]
    if edge := eq.numbers.get("unbonded", 0.0):
        bare = eq.s <= edge
        at = float(np.interp(edge, eq.s, x)), float(np.interp(edge, eq.s, y))
        named = f"never glued, $a$ = {amount(eq.rod, edge, 'm', 'eta')}"
        lines.append(Line("unbonded", np.append(x[bare], at[0]), np.append(y[bare], at[1]), "no glue", named))
        marks.append(Mark("glue", *at, "end of the glue $s = a$"))
    return lines, [*marks, Mark("detachment", float(x[-1]), float(y[-1]), r"detachment $s = \bar s$")]


def _arrows(eq: Equilibrium, drawn: Drawn) -> Arrows:
    numbers, rod = eq.numbers, eq.rod
    scaled = "" if drawn.times == 1.0 else f" (arrows × {drawn.times:g})"
    words = {
        "weight": f"weight $w$ = {amount(rod, numbers.get('weight', 0.0), 'Pa', 'T_0')}",
        "drag": f"drag = {amount(rod, numbers.get('drag', 0.0), 'Pa', 'T_0')}",
    }
    if "friction" in numbers:
        words["friction"] = f"friction = {amount(rod, numbers['friction'], 'Pa', 'T_0')}"
    elif "share" in numbers:
        words["friction"] = f"friction = {numbers['share']:.4g} $p$"
    full = words.get(drawn.look, drawn.name) + scaled
    a = drawn.arrows
    return Arrows(drawn.look, a.x, a.y, a.x + a.u, a.y + a.v, drawn.name, full)


def _tip(
    eq: Equilibrium, scene: Scene, at: tuple[float, float], frame: Frame
) -> tuple[list[Line], list[Arrows]]:
    """Return what is done to the tip: a force as an arrow, a moment as an arc with a head."""
    q = numbers_of(eq, scene)
    lines: list[Line] = []
    arrows: list[Arrows] = []
    loaded = isinstance(scene.tip, TipLoad | Contact)
    name = "reaction" if isinstance(scene.tip, Contact) else "force"
    if loaded and (size := eq.numbers.get(name, 0.0)):
        u, v = (float(part) for part in scene.tip_force(places(eq, scene)[0], q))
        length = frame.arrow * 1.3 / math.hypot(u, v)
        full = (
            f"{name} {'$F$' if name == 'force' else ''} = {amount(eq.rod, size, 'N/m', 'T_0 eta')}".replace(
                "  ", " "
            )
        )
        arrows.append(
            Arrows(
                "tip-force",
                np.array([at[0]]),
                np.array([at[1]]),
                np.array([at[0] + u * length]),
                np.array([at[1] + v * length / frame.stretch]),
                name,
                full,
            )
        )
    if moment := eq.numbers.get("moment", 0.0):
        angles = np.linspace(_FROM, _TO, 60)
        angles = angles if moment > 0.0 else np.pi - angles
        radius = _ARC * frame.arrow
        x, y = at[0] + radius * np.cos(angles), at[1] + radius * np.sin(angles) / frame.stretch
        full = f"moment $M$ = {amount(eq.rod, moment, 'N', 'T_0 eta^2')}"
        lines.append(Line("arc", x[:-6], y[:-6]))
        arrows.append(Arrows("moment", x[-14:-13], y[-14:-13], x[-1:], y[-1:], "moment", full))
    return lines, arrows


def _others(eq: Equilibrium, scene: Scene) -> list[str]:
    """Return the numbers of a scene that nothing in the picture shows, in words."""
    hidden = {name: value for name, value in eq.numbers.items() if name not in _SHOWN | {"unbonded"}}
    return in_words(scene, hidden)


def in_words(scene: Scene, numbers: Mapping[str, float]) -> list[str]:
    """Return numbers of a scene, in the units of its rod, in words; without those that are zero."""
    kinds, found = kinds_of(scene), []
    for name, value in numbers.items():
        if not value:
            continue
        unit = kinds[name].unit_of(scene.rod)
        if scene.rod.dimensionless or unit in ("", "1/m", "rad"):
            text = f"{value:.4g} {unit}".rstrip()
        else:
            text = quantity(value, unit)
        found.append(f"{name.replace('_', ' ')} = {text}")
    return found
