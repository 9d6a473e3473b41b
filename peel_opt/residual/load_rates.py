"""How the loads on a rod change with a small motion of it, as the motions need them.

Everything is in the paper's scaling: lengths over sbar, forces over k/sbar^2, loads over k/sbar^3.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import casadi as ca
import numpy as np

from ..model.bond import Piece
from ..model.equations import Scalars
from ..model.stretch import shared_kink
from .discretisation import Discretisation

#: A jump of the load over T0 up to here is rounding.
NO_JUMP = 1e-9


@dataclass(frozen=True, eq=False)
class Switch:
    """A place of the rod, moving with its shape, where the load jumps.

    Parameters
    ----------
    phase : int
        The phase that ends there.
    jump : ndarray, shape (2,)
        The load before it less that after it, along x and y.
    rates : ndarray, shape (3,)
        Derivatives of what decides on the place by theta, x and y.
    slope : float
        Its derivative along the rod, by xi.
    """

    phase: int
    jump: np.ndarray
    rates: np.ndarray
    slope: float


@dataclass(frozen=True, eq=False)
class Stretching:
    """What a rod that stretches has more.

    Parameters
    ----------
    stiffness : float
        EA over k/sbar^2.
    strain : ndarray, shape (n,)
    by_strain : ndarray, shape (n, 2)
        Rates of the load by the strain.
    parted : float
        Strain at the edge less that at which the rod is glued.
    load : float
        The load at the edge along x.
    """

    stiffness: float
    strain: np.ndarray
    by_strain: np.ndarray
    parted: float
    load: float


@dataclass(frozen=True, eq=False)
class LoadRates:
    """A state and the derivatives of its loads, at the same local coordinates of every phase.

    Parameters
    ----------
    theta, nx, ny : ndarray, shape (n,)
    by_theta : ndarray, shape (n, 2)
        Rates of the load by theta, along x and y.
    by_place : ndarray, shape (n, 2, 2)
        Rates of the load by x and y, the last axis.
    by_length : ndarray or None, shape (n, 2)
        Rates by the detached length at a material point, of a load that stretches with it.
    switches : tuple of Switch
    holds : tuple of ndarray, each of shape (k, 3)
        The kinds of motions: what vanishes at the tip in each of them, rows in (theta, x, y) there.
        The volume under the rod changes in those of the first kind only.
    tip : ndarray, shape (2, 2)
        Rates of the force on the tip by its place.
    curl : float
        theta'(1) less that of the wall, not zero if the front itself has an energy.
    bend : float
        theta''(1).
    encloses : bool
        Whether the pressure is what holds the volume under the rod: uniform and normal to it, alone.
    stretching : Stretching or None
    attached : ndarray, shape (m,)
        Lengths of the stretches of the attached rod that move with it on a layer; their places follow.
    front : Switch or None
        Where the detached rod ends on a layer.
    """

    theta: np.ndarray
    nx: np.ndarray
    ny: np.ndarray
    by_theta: np.ndarray
    by_place: np.ndarray
    by_length: np.ndarray | None = None
    switches: tuple[Switch, ...] = ()
    holds: tuple[np.ndarray, ...] = (np.zeros((0, 3)),)
    tip: np.ndarray | None = None
    curl: float = 0.0
    bend: float = 0.0
    encloses: bool = True
    stretching: Stretching | None = None
    attached: np.ndarray = field(default_factory=lambda: np.zeros(0))
    front: Switch | None = None


def plain_load_rates(problem: Discretisation, x: np.ndarray, zeta: np.ndarray) -> LoadRates:
    """Return those of a uniform pressure under a rod on a plate: it turns with the rod, the bond softens."""
    s, points = problem.scalars(x), len(zeta)
    theta, nx, ny, Y = (problem.sampler(zeta)(x)[0] * s.A)[:, [0, 2, 3, 4]].T
    softening = [_softening(p, s, Y[j * points : (j + 1) * points]) for j, p in enumerate(problem.phases)]
    by_place = np.zeros((len(theta), 2, 2))
    by_place[:, 1, 1] = np.concatenate(softening)
    angles = problem.sampler(np.ones(1))(x)[0][:-1, 0] * s.A
    switches = [
        Switch(j, np.array([0.0, jump]), np.array([0.0, 0.0, 1.0]), float(np.sin(angle)))
        for j, (pair, angle) in enumerate(zip(pairwise(problem.phases), angles, strict=True))
        if (jump := s.beta0 * _jump(*pair)) != 0.0
    ]
    turning = -s.alpha * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    return LoadRates(theta, nx, ny, turning, by_place, switches=tuple(switches))


def _softening(piece: Piece, scalars: Scalars, y: np.ndarray) -> np.ndarray:
    """-d f/d y of the bond in scaled variables: beta1 under the linear law, 0 on a free arc."""
    u = ca.SX.sym("u")
    drop = piece.drop(u)
    slope = ca.Function("slope", [u], [ca.jacobian(drop, u) if isinstance(drop, ca.SX) else ca.SX(0)])
    heights = scalars.beta1 / scalars.beta0 * y if scalars.beta0 else y
    return scalars.beta1 * np.array([float(slope(v)) for v in heights])


def _jump(before: Piece, after: Piece) -> float:
    """Return what is left of the traction over T0 where one phase ends, less what holds in the next."""
    kink = shared_kink(before, after)
    jump = float(before.drop(kink)) - float(after.drop(kink))
    return jump if abs(jump) > NO_JUMP else 0.0
