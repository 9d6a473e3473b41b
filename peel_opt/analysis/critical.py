"""The transition of any scene that has one: where a rod that lies on its wall is left, by the linear problem.

A rod that lies on its wall has theta = kw (s - sbar) and carries what the loads put into it; small motions
of it are linear, with the rates of the loads by automatic differentiation of their parts.  They are in
equilibrium at some lengths only: there the determinant vanishes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import casadi as ca
import numpy as np

from ..base.errors import InvalidInput, NoEquilibrium
from ..base.quadrature import Grid
from ..base.threads import one_thread
from ..model.place import Place
from ..model.rod import RATIOS, Rod, require_rod
from ..model.scene import Scene
from ..model.tips import Middle

#: Gauss nodes; the difference is the error.
NODES = (24, 36)

#: Detached lengths over that of the paper's transition between which one is looked for, and how many.
SEARCHED, POINTS = (0.1, 6.0), 160

#: By how much a rod that lies on its wall may miss its equilibrium, over T0 and eta.
BALANCED = 1e-10

#: What rounding leaves of a length.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Transition:
    """Where the detached states of a scene leave the rod that lies on its wall.

    Parameters
    ----------
    length, pressure : float
        In the units of the rod.
    length_ratio, pressure_ratio : float
        sbar/eta and p/T0.
    beta0, beta1 : float
        (11) there; pi^4 for the paper's rod.
    error : float
        Absolute error of ``length_ratio``.
    """

    length: float
    pressure: float
    length_ratio: float
    pressure_ratio: float
    beta0: float
    beta1: float
    error: float


@one_thread
def critical_length(scene: Scene | Rod) -> Transition:
    """Return the detached length at which a scene is left by its detached states, by its linear problem.

    Parameters
    ----------
    scene : Scene or Rod
        One in which the attached rod is an equilibrium at some pressure, at every length.

    Returns
    -------
    Transition
        The shortest one.

    Raises
    ------
    InvalidInput
        If the rod is lifted from the start in this scene: it has no transition.
    NoEquilibrium
        If none was met up to six times the length of the plain rod's.

    Notes
    -----
    The linear problem says where states begin, not whether the flat one is stable: a tangential
    friction that follows the rod is not conservative at linear order.

    Examples
    --------
    >>> round(critical_length(Rod.from_ratio(1.0)).length, 12) == round(math.pi, 12)
    True
    """
    if isinstance(scene, Rod):
        scene = Scene(scene)
    if not isinstance(scene, Scene):
        raise InvalidInput(f"critical_length takes a Scene or a Rod, got {scene!r:.60}.")
    require_rod(scene.rod, RATIOS)
    if not scene.keeps_flat:
        raise InvalidInput(
            "this scene has no transition: the rod is lifted from the start, or never rests on its wall.",
            remedy="Ask for the states it has with solve; unfolding tells what became of the transition.",
        )
    coarse, sigma = (LinearProblem.of(scene, nodes).first_length() for nodes in NODES)
    problem, rod = LinearProblem.of(scene, NODES[1]), scene.rod
    return Transition(
        length=rod.length(sigma),
        pressure=rod.pressure(problem.pressure),
        length_ratio=sigma,
        pressure_ratio=problem.pressure,
        beta0=sigma**3,
        beta1=rod.ratio * sigma**4,
        error=abs(sigma - coarse) + ROUNDING * sigma,
    )


def without_slip(scene: Scene) -> Scene:
    """Return a scene whose bond does not resist sliding: of a rod on its wall that is of second order."""
    return replace(scene, law=scene.bond.law) if scene.bond.slips else scene


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """Small motions of a rod that lies on its wall.

    Parameters
    ----------
    scene : Scene
    pressure : float
        p/T0 at which it lies there.
    grid : Grid
    rates : casadi.Function
        From (s, sbar, theta, x, y, slip) and p/T0 to the load, shape (2,), its rates by theta, x, y and slip,
        shape (2, 4), and by the pressure, shape (2,).
    """

    scene: Scene
    pressure: float
    grid: Grid
    rates: ca.Function

    @classmethod
    def of(cls, scene: Scene, nodes: int) -> LinearProblem:
        """Return that of a scene, on so many Gauss nodes."""
        scene = without_slip(scene)
        q: dict[str, object] = {**scene.numbers, "ratio": scene.rod.ratio}
        s, sbar, theta, x, y, slip = at = [ca.SX.sym(n) for n in ("s", "sbar", "theta", "x", "y", "slip")]
        p = q["pressure"] = ca.SX.sym("p")
        (piece, *_) = scene.bond.law.pieces
        load = ca.vertcat(*scene.per_length(Place(s, sbar, theta, x, y, slip), piece, q))
        by = ca.jacobian(load, ca.vertcat(theta, x, y, slip))
        rates = ca.Function("rates", [ca.vertcat(*at), p], [load, by, ca.jacobian(load, p)])
        low, high = (float(rates(np.array([0.0, 1.0, 0, 0, 0, 0]), value)[0][1]) for value in (0.0, 1.0))
        return cls(scene, low / (low - high), Grid.gauss(nodes), rates)

    def matrix(self, sigma: float, tip: tuple[float, float] | None = None) -> np.ndarray:
        """Return the equations of small motions at a length: unknown theta'', pressure and amplitude.

        Parameters
        ----------
        sigma : float
        tip : tuple of float, optional
            theta and theta' at the tip per amplitude: -1 and 0 of a free one, 0 and -1 of a middle.

        Raises
        ------
        InvalidInput
            If the rod that lies on its wall is no equilibrium.
        """
        n, C, w = len(self.grid.xi), sigma * self.grid.from_left, sigma * self.grid.weights
        kw = float(self.scene.wall.curvature_of(self.scene.numbers))
        base = kw * sigma * (self.grid.xi - 1.0)
        cosine, sine = np.cos(base), np.sin(base)
        x, y = (C @ part - w @ part for part in (cosine, sine))
        places = np.stack([sigma * self.grid.xi, np.full(n, sigma), base, x, y, np.zeros(n)])
        load, by, by_p = (part.full() for part in self.rates.map(n)(places, self.pressure))
        by = by.reshape(2, n, 4)
        at = Place(0.0, sigma, float(base[0]), float(x[0]), float(y[0]), 0.0)
        pull = [float(v) for v in self.scene.tip_force(at, self.scene.numbers)]
        N = np.array(pull)[:, None] + load @ C.T
        if np.abs(N[1] * cosine - N[0] * sine).max() > BALANCED * (1.0 + np.abs(N).max()):
            raise InvalidInput("a rod that lies on its wall is no equilibrium of this scene.")
        middle = isinstance(self.scene.tip, Middle)
        start, bend = tip or ((0.0, -1.0) if middle else (-1.0, 0.0))
        # Columns: theta'' at the nodes, the pressure, the amplitude; theta, x and y as rows of them.
        one = np.ones((n, 1))
        curvature = np.hstack([C, 0.0 * one, bend * one])
        theta = np.hstack([np.zeros((n, n + 1)), start * one]) + C @ curvature
        ahead = C - w
        moved = (ahead @ (-sine[:, None] * theta), ahead @ (cosine[:, None] * theta))
        fields = (theta, *moved, moved[0])
        pressed = np.zeros((1, n + 2))
        pressed[0, n] = 1.0
        forces = [
            C @ (sum(by[i, :, j, None] * f for j, f in enumerate(fields)) + by_p[i][:, None] * pressed)
            for i in range(2)
        ]
        thrust = N[0] * cosine + N[1] * sine
        curl = np.hstack([np.eye(n), np.zeros((n, 2))])
        rows = curl - (cosine[:, None] * forces[1] - sine[:, None] * forces[0] - thrust[:, None] * theta)
        at_front = np.zeros((1, n + 2))
        at_front[0, :n], at_front[0, -1] = w, bend
        turned = w @ curvature
        turned[-1] += start
        return np.vstack([rows, at_front, turned[None]])

    def first_length(self) -> float:
        """Return the shortest detached length over eta at which small motions are in equilibrium.

        Raises
        ------
        NoEquilibrium
        """
        from scipy.optimize import brentq  # which takes long to import

        lengths = math.pi * self.scene.rod.ratio**-0.25 * np.geomspace(*SEARCHED, POINTS)

        def determinant(sigma: float) -> float:
            return float(np.linalg.det(self.matrix(sigma)))

        before = determinant(float(lengths[0]))
        for low, high in pairwise(lengths.tolist()):
            after = determinant(high)
            if before * after <= 0.0:
                return float(brentq(determinant, low, high, xtol=1e-15, rtol=1e-15))
            before = after
        raise NoEquilibrium(
            f"no transition was met up to sbar = {SEARCHED[1]:g} times that of the plain rod.",
            remedy="The loads along the rod may hold it down at every length.",
        )
