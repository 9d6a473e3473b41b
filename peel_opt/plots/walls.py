"""The wall under a rod in pictures: a plate, or a circle through the origin with what lies behind it."""

from __future__ import annotations

import math

import numpy as np

from ..model.rod import Rod
from ..motion.arc import Arc
from .frame import Frame
from .panels import Line
from .words import AxisUnit, amount

#: Share of a radian that a wall must turn under a picture to be drawn as a circle, without another scale.
ROUND = 0.3


def walls(
    frame: Frame,
    bent: float,
    unit: AxisUnit,
    rod: Rod | None,
    *,
    left: float | None = None,
    front: tuple[float, float] = (0.0, 0.0),
) -> list[Line]:
    """Return the wall where it is no plate, where its bond ends, and the attached rod on it.

    Parameters
    ----------
    frame : Frame
    bent : float
        Curvature of the wall in the coordinates of the axes.
    unit : AxisUnit
        Of lengths.
    rod : Rod or None
    left : float or None
        Where the other end of a strip is attached.
    front : (float, float)
        x of the detachment, and how far along the wall it is from the origin.

    Returns
    -------
    list of Line
    """
    far = 10.0 * frame.width
    if not bent:
        attached = [Line("attached", np.array([front[0], frame.right + far]), np.zeros(2))]
        if left is not None:
            attached.append(Line("attached", np.array([left - frame.right - far, left]), np.zeros(2)))
        return attached
    reach = min(1.6 * frame.width, 0.98 * math.pi / abs(bent))
    along = np.linspace(-reach, reach, 401)
    x, y = Arc(bent).at(along)
    where = "inside" if bent > 0.0 else "outside"
    radius = amount(rod, unit.size / abs(bent), "m", "eta")
    lines = [Line("wall", x, y, "wall", f"wall, {where} a circle of radius {radius}")]
    if frame.shows_range and frame.y0 is not None:
        turned = along * bent
        lines.append(
            Line(
                "range",
                x - frame.y0 * np.sin(turned),
                y + frame.y0 * np.cos(turned),
                "$y_0$",
                "$y_0$ from the wall",
            )
        )
    glued = np.append(front[1], along[along > front[1]])
    return [*lines, Line("attached", *Arc(bent).at(glued))]


def solid(wall: Line, frame: Frame, bent: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the outline of what lies behind a curved wall."""
    turned = np.linspace(-1.0, 1.0, len(wall.x)) * bent * min(1.6 * frame.width, 0.98 * math.pi / abs(bent))
    depth = 0.4 * frame.width if bent > 0.0 else min(0.4 * frame.width, 0.9 / abs(bent))
    behind = wall.x + depth * np.sin(turned), wall.y - depth * np.cos(turned)
    return np.concatenate([wall.x, behind[0][::-1]]), np.concatenate([wall.y, behind[1][::-1]])
