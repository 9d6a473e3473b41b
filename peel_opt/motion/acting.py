"""What acts on a moving rod beside drag, mass and bond: the loads of a scene, and what its wall is like.

A natural curvature kappa_n of all the rod bends the attached part as well: it is the moment -k kappa_n
at the tip and nothing else.  Loads count places from the front, as in equilibrium: a pressure that is a
function of ``place.x`` moves along with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import casadi as ca
import numpy as np

from ..base.errors import InvalidInput
from ..model.mixed_bonds import Opening
from ..model.place import Place
from ..model.rod import Rod
from ..model.scene import Scene
from ..model.tips import Free, Middle, TipLoad

#: The material points that lie between a place and the tip.
Past = frozenset[str]


class Acted(NamedTuple):
    """Forces per length over T0, and what they change by.

    Parameters
    ----------
    force : ndarray, shape (2, ...)
        Along x and y.
    by_theta : ndarray, shape (2, ...)
    by_place : ndarray, shape (4, 2, ...), or None
        By x, y, s and sbar; None where a load feels nothing but its angle.
    """

    force: np.ndarray
    by_theta: np.ndarray
    by_place: np.ndarray | None


class Loads:
    """The paper's load: a uniform pressure under a rod whose tip is free.

    Attributes
    ----------
    breaks : tuple of (str, float)
        Material points at which a load or the bond begins or ends, with their s, from the tip on.
    ends : tuple of (str, float)
        Those of them at which a load changes.
    feels : frozenset of str
        Of x, y, s and sbar what some load changes with.
    unbonded : float
        Length from the tip that was never glued.
    tip_force : tuple of float
        Along x and y.
    moment, natural_curvature, wall_curvature : float
        Of the tip, anticlockwise; of the rod; of the wall.
    """

    breaks: tuple[tuple[str, float], ...] = ()
    ends: tuple[tuple[str, float], ...] = ()
    feels: frozenset[str] = frozenset()
    unbonded: float = 0.0
    tip_force: tuple[float, float] = (0.0, 0.0)
    moment: float = 0.0
    natural_curvature: float = 0.0
    wall_curvature: float = 0.0

    @property
    def tip_curvature(self) -> float:
        """theta'(0), times eta, of an angle that counts from where the rod lay."""
        return self.natural_curvature - self.moment - self.wall_curvature

    def at(
        self,
        pressure: float,
        theta: np.ndarray,
        x: np.ndarray,
        y: np.ndarray,
        s: np.ndarray,
        sbar: np.ndarray,
        past: Past = frozenset(),
    ) -> Acted:
        """Return the forces at places, in units of T0 and eta; all arrays of one shape (...).

        Parameters
        ----------
        pressure : float
            p/T0.
        theta, x, y, s : ndarray
            Angle, place along the plate from where the tip was stuck, height, and arc length from the tip.
        sbar : ndarray
            Detached length.
        past : frozenset of str
            Names of the breaks between these places and the tip.
        """
        sine, cosine = np.sin(theta), np.cos(theta)
        return Acted(pressure * np.stack([-sine, cosine]), -pressure * np.stack([cosine, sine]), None)

    def at_tip(self, theta: np.ndarray) -> np.ndarray:
        """Return what the tip has in the identity: theta'(0)^2 / 2 + F.(e_x - t)."""
        Fx, Fy = self.tip_force
        pulled: np.ndarray = 2.0 * Fx * np.sin(0.5 * theta) ** 2 - Fy * np.sin(theta)
        return pulled + 0.5 * self.tip_curvature**2

    def lift(self, pressure: float, sbar: float) -> float:
        """Return by what the attached rod is pulled off at the front, over T0."""
        past = frozenset(name for name, s in self.breaks if s < sbar)
        theta, x, y = np.array([0.0]), np.array([sbar]), np.array([0.0])
        return float(self.at(pressure, theta, x, y, x, x, past).force[1, 0])


@dataclass(frozen=True, eq=False)
class SceneLoads(Loads):
    """What acts on the rod of a scene.

    Parameters
    ----------
    scene : Scene
        Of those that `loads_on` lets through.
    """

    scene: Scene

    @cached_property
    def breaks(self) -> tuple[tuple[str, float], ...]:  # type: ignore[override]
        """Material points, with their s, from the tip on."""
        numbers = self.scene.numbers
        return tuple(
            sorted(((name, numbers[name]) for name in self.scene.breaks), key=lambda point: point[1])
        )

    @cached_property
    def ends(self) -> tuple[tuple[str, float], ...]:  # type: ignore[override]
        """Those of the material points at which a load changes."""
        written = [self._forces(past, 1).serialize() for past in self._pasts]
        return tuple(point for point, (a, b) in zip(self.breaks, pairwise(written), strict=True) if a != b)

    @cached_property
    def feels(self) -> frozenset[str]:  # type: ignore[override]
        """Of x, y, s and sbar what some load changes with."""
        felt = [self._forces(past, 1).which_depends("at", ["force"], 1, False) for past in self._pasts]
        names = ("theta", "x", "y", "s", "sbar")
        return frozenset(name for name, *by in zip(names, *felt, strict=True) if any(by)) - {"theta"}

    @property
    def _pasts(self) -> list[Past]:
        """What lies between the tip and a place, from the tip on."""
        names = [name for name, _ in self.breaks]
        return [Past(names[:i]) for i in range(len(names) + 1)]

    @cached_property
    def unbonded(self) -> float:  # type: ignore[override]
        """Length from the tip that was never glued."""
        return self.scene.numbers.get("unbonded", 0.0)

    @cached_property
    def tip_force(self) -> tuple[float, float]:  # type: ignore[override]
        """Along x and y."""
        tip = self.scene.tip
        if isinstance(tip, Free) or not isinstance(tip, TipLoad):
            return 0.0, 0.0
        x, y = tip.pull(self.scene.numbers)
        return float(x), float(y)

    @cached_property
    def moment(self) -> float:  # type: ignore[override]
        """Of the tip, anticlockwise."""
        return self.scene.numbers.get("moment", 0.0)

    @cached_property
    def natural_curvature(self) -> float:  # type: ignore[override]
        """Of the rod."""
        return self.scene.numbers.get("natural_curvature", 0.0)

    @cached_property
    def wall_curvature(self) -> float:  # type: ignore[override]
        """Of the wall."""
        return self.scene.wall_curvature

    def at(
        self,
        pressure: float,
        theta: np.ndarray,
        x: np.ndarray,
        y: np.ndarray,
        s: np.ndarray,
        sbar: np.ndarray,
        past: Past = frozenset(),
    ) -> Acted:
        """Return the forces at places, and all that they change by."""
        places = np.empty((5, *theta.shape))
        places[0], places[1], places[2], places[3], places[4] = theta, x, y, s, sbar
        places = places.reshape(5, -1)
        many = past, places.shape[1]
        if many not in self._known:
            self._known[many] = _Along(self._forces(*many), many[1])
        found = self._known[many](places, pressure).reshape(6, 2, *theta.shape)
        return Acted(found[0], found[1], found[2:] if self.feels else None)

    @cached_property
    def _known(self) -> dict[tuple[Past, int], _Along]:
        return {}

    def _forces(self, past: Past, n: int) -> ca.Function:
        """Force at n places, (n, 5) as in `at`: along x and y, (n, 2)."""
        at, pressure = ca.MX.sym("at", n, 5), ca.MX.sym("pressure")
        theta, x, y, s, sbar = ca.horzsplit(at)
        place = Place(s, sbar, theta, x - sbar, y, slip=x - s, past=past)
        numbers = {**self.scene.numbers, "pressure": pressure, "ratio": self.scene.rod.ratio}
        push = self.scene.load(place, numbers)
        sine, cosine = ca.sin(theta), ca.cos(theta)
        fx = -push.normal * sine + push.tangential * cosine + push.x
        fy = push.normal * cosine + push.tangential * sine + push.y
        return ca.Function("acting", [at, pressure], [ca.horzcat(fx, fy)], ["at", "pressure"], ["force"])


class _Along:
    """Forces at n places and what they change by, on arrays as they lie in memory.

    To hand arrays over takes CasADi longer than to compute.
    """

    def __init__(self, forces: ca.Function, n: int) -> None:
        at, pressure = ca.MX.sym("at", n, 5), ca.MX.sym("pressure")
        (force,), by = forces.call([at, pressure], True), []  # inlined
        for i in range(5):  # each force is that of its own place
            along = ca.MX(n, 5)
            along[:, i] = 1.0
            by.append(ca.jtimes(force, at, along))
        both = ca.Function("along", [at, pressure], [ca.densify(ca.cse(ca.horzcat(force, *by)))])
        self.places, self.pressure, self.found = np.zeros((5, n)), np.zeros(1), np.zeros((12, n))
        self.buffer, self.evaluate = both.buffer()
        self.buffer.set_arg(0, self.places.reshape(-1).data)
        self.buffer.set_arg(1, self.pressure.data)
        self.buffer.set_res(0, self.found.reshape(-1).data)

    def __call__(self, places: np.ndarray, pressure: float) -> np.ndarray:
        """Return the forces and their derivatives, (12, n), at places, (5, n)."""
        self.places[:], self.pressure[:] = places, pressure
        self.evaluate()
        return self.found.copy()


#: What acts in the paper's scene.
PRESSURE_ALONE = Loads()


def loads_on(subject: Rod | Scene) -> Loads:
    """Return what acts on a rod or on that of a scene.

    Raises
    ------
    InvalidInput
        If a part of the scene is one whose motion is not computed.
    """
    if not isinstance(subject, Scene) or subject.is_plain:
        return PRESSURE_ALONE
    left_out = {
        "a rod on a curved wall under more than a uniform pressure": not subject.has_identity,
        "the middle of a strip": isinstance(subject.tip, Middle),
        "a rod that stretches": subject.stretch is not None,
        "a front with a line energy": bool(subject.line_energy),
        "an elastic layer, or a bond that resists sliding": not isinstance(subject.bond, Opening),
    }
    if found := [name for name, here in left_out.items() if here]:
        raise InvalidInput(
            f"the motion of {', or of '.join(found)} is not computed.",
            remedy="The rate at which it leaves an equilibrium is: po.growth_rate(eq).",
        )
    return SceneLoads(subject)
