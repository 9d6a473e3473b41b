"""An independent check of a state: integrate from its tip, and see by how much the edge is missed.

The equations are those of the scene, but nothing else is shared with the discretisations: SciPy's
DOP853 marches from the tip, stops wherever the bond changes its piece or a material point is passed,
and carries the work of the loads along.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.errors import InvalidInput, NotConverged
from ..model.place import Numbers, Place
from ..model.scene import Scene

#: Tolerances of the integration, relative and absolute.
RTOL, ATOL = 1e-13, 1e-15

#: Changes of the piece of the law beyond which the march is lost.
MOST_SWITCHES = 40

#: Distance past a switch, as a share of the detached length, at which events are watched again.
PAST = 1e-9


@dataclass(frozen=True)
class Tip:
    """The tip of a state: inclination, position from the detachment point, forces, curvature."""

    theta: float
    x: float
    y: float
    Nx: float = 0.0
    Ny: float = 0.0
    curvature: float = 0.0


@dataclass(frozen=True)
class March:
    """Where an integration from the tip has ended.

    Parameters
    ----------
    theta, curvature, x, y : float
        By how much (14) is missed at the edge: inclination, theta' less that of the front, position.
    Nx, Ny : float
        The forces handed to the attached rod.
    identity : float
        By how much the identity is missed.
    switches : tuple of float
        Arc lengths at which the bond changes its piece.
    """

    theta: float
    curvature: float
    x: float
    y: float
    Nx: float
    Ny: float
    identity: float
    switches: tuple[float, ...]

    @property
    def missed(self) -> float:
        """The largest of what is missed at the edge."""
        return max(abs(v) for v in (self.theta, self.curvature, self.x, self.y))


def march(scene: Scene, q: Numbers, sbar: float, tip: Tip) -> March:
    """Integrate the equations of a scene from the tip to the detachment point.

    Parameters
    ----------
    scene : Scene
    q : mapping
        All its numbers, "pressure" and "ratio" among them, over their units of T0 and eta.
    sbar : float
        Detached length over eta.
    tip : Tip

    Raises
    ------
    InvalidInput
        If the rod lies on an elastic layer, on which an integration away from the front explodes.
    NotConverged
        If the integration fails, or changes its piece of the law without end.
    """
    if scene.layer is not None:
        raise InvalidInput("the attached rod on an elastic layer is not marched over.")
    law = scene.bond.law
    slip = tip.x + sbar * (1.0 + q.get("glued_strain", 0.0))
    state = np.array([tip.theta, tip.curvature, tip.Nx, tip.Ny, tip.x, tip.y, slip, 0.0])
    breaks = sorted((float(q[name]), name) for name in scene.breaks if q[name] < sbar)
    start = _place(scene, q, 0.0, sbar, state, frozenset())
    piece, s, past, switches = law.piece_at(float(scene.opening(start, q))), 0.0, frozenset[str](), []
    first = start
    while s < sbar:
        stop, name = next(((b, n) for b, n in breaks if n not in past), (sbar, ""))
        s, state, passed = _segment(scene, q, sbar, state, (s, stop), past, piece)
        if passed:
            piece += passed
            switches.append(s)
            if len(switches) > MOST_SWITCHES:
                raise NotConverged(f"the bond changes its piece more than {MOST_SWITCHES} times.")
        elif name:
            past |= {name}
            if name == "unbonded":
                first = _place(scene, q, s, sbar, state, past)
                piece = law.piece_at(float(scene.opening(first, q)))
    theta, curvature, Nx, Ny, x, y, _, work = (float(v) for v in state)
    missed = scene.identity(start, first, work, tip.curvature, q) if scene.has_identity else float("nan")
    front = float(scene.front_curvature(Nx, q))
    return March(theta, curvature - front, x, y, Nx, Ny, missed, tuple(switches))


def _place(scene: Scene, q: Numbers, s: float, sbar: float, state: np.ndarray, past: frozenset[str]) -> Place:
    theta, _, Nx, Ny, x, y, slip = state[:7].tolist()
    thrust = Nx * math.cos(theta) + Ny * math.sin(theta)
    return Place(s, sbar, theta, x, y, slip, past, float(scene.strain(thrust, q)))


def _segment(
    scene: Scene,
    q: Numbers,
    sbar: float,
    state: np.ndarray,
    span: tuple[float, float],
    past: frozenset[str],
    piece: int,
) -> tuple[float, np.ndarray, int]:
    """Integrate to the end of a span, or to where the opening leaves the piece, and say to which side."""
    from scipy.integrate import solve_ivp

    law, bonded = scene.bond.law, not scene.unbonded or "unbonded" in past

    def rates(s: float, z: np.ndarray) -> list[float]:
        at = _place(scene, q, s, sbar, z, past)
        fx, fy = scene.per_length(at, law.pieces[piece], q)
        theta, _, Nx, Ny = z[:4]
        sine, cosine, half = np.sin(theta), np.cos(theta), np.sin(0.5 * theta)
        L, glued = 1.0 + at.strain, q.get("glued_strain", 0.0)
        slip = at.strain * cosine - glued - 2.0 * half * half
        bend = L * (Ny * cosine - Nx * sine)
        return [z[1], bend, float(fx), float(fy), L * cosine, L * sine, slip, float(scene.work(at, q))]

    def leaves(kink: float, direction: int) -> Callable[[float, np.ndarray], float]:
        def excess(s: float, z: np.ndarray) -> float:
            if s < span[0] + PAST * sbar:  # it has just come from there
                return -float(direction)
            return float(scene.opening(_place(scene, q, s, sbar, z, past), q)) - kink

        excess.terminal, excess.direction = True, direction  # type: ignore[attr-defined]
        return excess

    sides = [(law.kinks[piece - 1], -1)] if piece else []
    sides += [(law.kinks[piece], 1)] if piece < len(law.kinks) else []
    events = [leaves(kink, side) for kink, side in sides] if bonded else []
    found = solve_ivp(rates, span, state, method="DOP853", rtol=RTOL, atol=ATOL, events=events or None)
    if found.status < 0:
        raise NotConverged(f"the integration from the tip failed: {found.message}")
    passed = next((side for (_, side), t in zip(sides, found.t_events or (), strict=False) if t.size), 0)
    return float(found.t[-1]), found.y[:, -1], passed
