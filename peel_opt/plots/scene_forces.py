"""What acts on the rod of a scene, as arrows: every load, the bond, and what is done to the tip."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..equilibria.result import Equilibrium
from ..model.dimension import Dimension
from ..model.loads import Load, Pressure, SkinFriction
from ..model.place import Place
from ..model.scene import Scene
from .forces import COUNT, FAINT, ForceArrows, magnification

#: How the arrows of a load of each kind look; of a reader's own "load".
LOOKS = {
    "Pressure": "pressure",
    "Weight": "weight",
    "SkinFriction": "friction",
    "Drag": "drag",
}

#: Distance of friction from the rod along which it runs, over the longest arrow.
BESIDE = 0.22


#: Gap over y0 at the front, where a slip has no direction.
CLOSED = 1e-12


@dataclass(frozen=True)
class Acting:
    """A force per length along the rod, over T0, in its parts.

    Parameters
    ----------
    look, name : str
    parts : ndarray, shape (n, 4)
        Along the normal and the tangent of the rod, and along x and y.
    """

    look: str
    name: str
    parts: np.ndarray

    @cached_property
    def largest(self) -> float:
        """Its largest size."""
        n, t, x, y = self.parts.T
        # Up to which the parts may add, whatever the inclination.
        return float((np.hypot(n, t) + np.hypot(x, y)).max())


@dataclass(frozen=True)
class Drawn:
    """Arrows of one kind, and how much longer they are drawn than those of the bond."""

    look: str
    name: str
    arrows: ForceArrows
    times: float


def kinds_of(scene: Scene) -> dict[str, Dimension]:
    """Return what all numbers of a state of a scene measure, those that follow among them."""
    return scene.dimensions | scene.readings


def numbers_of(eq: Equilibrium, scene: Scene) -> dict[str, float]:
    """Return the numbers of a state of a scene over their units of T0 and eta."""
    kinds = kinds_of(scene)
    own = {name: value / kinds[name].size(scene.rod) for name, value in eq.numbers.items()}
    return {**own, "pressure": eq.pressure_ratio, "ratio": scene.rod.ratio}


def places(eq: Equilibrium, scene: Scene) -> list[Place]:
    """Return the places of all points of a shape."""
    q, shape, sigma = numbers_of(eq, scene), eq.shape, eq.length_ratio
    thrust = (shape.Nx * np.cos(shape.theta) + shape.Ny * np.sin(shape.theta)) / sigma**2
    strain = np.broadcast_to(scene.strain(thrust, q), thrust.shape)
    found = []
    for xi, x, y, theta, eps in zip(shape.xi, shape.x, shape.y, shape.theta, strain, strict=True):
        s, at = float(xi * sigma), float(x * sigma)
        past = frozenset(name for name in scene.breaks if q[name] <= s)
        slip = at - s + sigma
        found.append(Place(s, sigma, float(theta), at, float(y * sigma), slip, past, float(eps)))
    return found


def acting_on(eq: Equilibrium, scene: Scene) -> list[Acting]:
    """Return all forces per length on the detached rod, that of the bond first."""
    q, there = numbers_of(eq, scene), places(eq, scene)
    held = [_bond(scene, at, q) for at in there]
    found = [Acting("adhesion", "adhesion", np.array(held))]
    for load in scene.loads:
        if not (isinstance(load, Pressure) and eq.pressure_ratio == 0.0):
            parts = np.array([[float(part) for part in load.force(at, q)] for at in there])
            found.append(Acting(LOOKS.get(type(load).__name__, "load"), _name(load), parts))
    return [force for force in found if force.largest > 0.0]


def _bond(scene: Scene, at: Place, q: dict[str, float]) -> tuple[float, float, float, float]:
    """Return what the bond does at a place."""
    if "unbonded" in scene.breaks and "unbonded" not in at.past:
        return 0.0, 0.0, 0.0, 0.0
    gap, nx, ny = (float(part) for part in scene.wall.gap(at, q))
    opened, slipped = (gap * q["ratio"], at.slip * q["ratio"]) if gap > 0.0 else (CLOSED, 0.0)
    opening, pieces = float(scene.bond.opening(opened, slipped, q)), scene.bond.law.pieces
    piece = next((p for p in pieces if opening < p.stop), pieces[-1])
    lost, shear = (float(part) for part in scene.bond.tractions(piece, opened, slipped, q))
    return 0.0, 0.0, (lost - 1.0) * nx - shear, (lost - 1.0) * ny


def _name(load: Load) -> str:
    """Return what a load is called, a pressure with its profile."""
    if isinstance(load, Pressure):
        profile = "" if load.profile is None else f", {type(load.profile).__name__.lower()} profile"
        return f"pressure $p${profile}"
    return "friction" if isinstance(load, SkinFriction) else type(load).__name__.lower()


def drawn_along(
    eq: Equilibrium, forces: list[Acting], x: np.ndarray, y: np.ndarray, stretch: float, longest: float
) -> list[Drawn]:
    """Place the arrows of forces per length on a rod drawn through (x, y).

    Those that are small beside the largest are drawn to a scale of their own.

    Parameters
    ----------
    eq : Equilibrium
    forces : list of Acting
    x, y : array, shape (n,)
        The shape in the coordinates of the axes.
    stretch : float
        How many times the vertical scale is the horizontal one.
    longest : float
        Length of an arrow of the largest force, on the horizontal scale.
    """
    run = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), stretch * np.diff(y)))])
    turned = np.unwrap(np.arctan2(stretch * np.sin(eq.theta), np.cos(eq.theta)))
    unit = max((force.largest for force in forces), default=1.0)
    found = []
    for k, force in enumerate(forces):
        # Each kind between the stations of the others, so that they do not hide each other.
        stations = run[-1] * (np.arange(COUNT) + (k + 0.5) / len(forces)) / COUNT
        n, t, across, up = (np.interp(stations, run, part) for part in force.parts.T)
        angle, share = np.interp(stations, run, turned), force.largest / unit
        times = magnification(share)
        size = longest / unit * times
        u = size * (-n * np.sin(angle) + t * np.cos(angle) + across)
        v = size * (n * np.cos(angle) + t * np.sin(angle) + up)
        beside = BESIDE * longest if force.look == "friction" else 0.0
        foot_x = np.interp(stations, run, x) + beside * np.sin(angle)
        foot_y = np.interp(stations, run, y) - beside * np.cos(angle) / stretch
        arrows = ForceArrows(foot_x, foot_y, u, v / stretch)
        seen = np.hypot(u, v) > FAINT * longest
        found.append(Drawn(force.look, force.name, arrows.pick(seen), times))
    return [drawn for drawn in found if drawn.arrows.x.size]
