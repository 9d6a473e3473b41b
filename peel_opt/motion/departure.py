"""Where a motion begins: just off an unstable equilibrium, along the one direction in which it grows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from ..base.errors import InvalidInput, NoEquilibrium, NotConverged
from ..equilibria.result import Equilibrium
from ..model.scene import Scene
from ..residual.shape import Shape
from .flap import Flap
from .layout import along, laid_out, through
from .run import Posture, Setting

#: Degree of the polynomials, and points of the posture that is handed on.
DEGREE, POINTS = 30, 1201

#: Share of its angle, or of a radian, by which the tip is turned to begin with: the rest is its square.
NUDGE = 1e-4

#: Newton corrections of the state, what is left of it, and of what rounding moves, close to T0 above all.
MOST_CORRECTIONS, SETTLED, ROUNDED = 12, 1e-11, 1e-7

#: Rates above this, over the unit of time, are those of the mesh; no state leaves its place so fast.
FASTEST = 1e3


@dataclass(frozen=True, eq=False)
class Departure:
    """A posture on the way from an unstable state, and the rate at which it grows, over the unit of time."""

    posture: Posture
    growth: float


def departure(setting: Setting, eq: Equilibrium) -> Departure:
    """Return an unstable equilibrium, nudged so that its tip turns over.

    Raises
    ------
    NoEquilibrium
        If nothing grows about it.
    NotConverged
        If it could not be solved again.
    """
    flap, u = _still(setting, stretched(eq, eq.length_ratio))
    growth, mode = _growing(flap, u)
    nudge = NUDGE * min(1.0, abs(float(u[0])))
    u, z = u + nudge * mode, nudge * growth * mode
    sbar = float(u[flap.lengths].sum())
    s = 0.5 * sbar * (1.0 - np.cos(np.linspace(0.0, np.pi, POINTS)))
    theta, _, _, spin = along(flap, u, z)(s).T
    return Departure(Posture(s, theta, spin), growth)


def stretched(eq: Equilibrium, length: float) -> Posture:
    """Return the shape of an equilibrium at rest, stretched to a length over eta."""
    scene = eq.scene
    kw = scene.wall_curvature if isinstance(scene, Scene) else 0.0
    return at_rest(eq.shape, eq.length_ratio, kw, length)


def at_rest(shape: Shape, sbar: float, wall_curvature: float, length: float) -> Posture:
    """Return a shape of a length ``sbar`` at rest, stretched to another.

    Its angle counts from the direction of the wall at its front; that of a posture from where the rod lay.
    """
    s = shape.xi * length
    return Posture(s, shape.theta + wall_curvature * sbar * (1.0 - shape.xi), np.zeros_like(s))


def require_attached(start: Posture, setting: Setting) -> None:
    """Raise where a motion would begin on a rod that is no longer attached anywhere.

    Raises
    ------
    InvalidInput
    """
    if start.s[-1] >= setting.length:
        raise InvalidInput(
            f"the motion begins with {start.s[-1]:.6g} eta detached of a rod that is {setting.length:.6g} eta"
            " long: nothing is left to peel.",
            remedy="Give a longer rod_length, or leave it out.",
        )


def held_at(setting: Setting, near: Posture) -> float | None:
    """Return the detached length of the equilibrium next to a posture; None if none holds the rod."""
    try:
        flap, u = _still(setting, near)
    except NotConverged:
        return None
    rates, _ = _rates(flap, u)
    grows = rates[np.isfinite(rates) & (np.abs(rates) < FASTEST)].real.max(initial=-np.inf)
    return float(u[flap.lengths].sum()) if grows < 0.0 else None


def _still(setting: Setting, near: Posture) -> tuple[Flap, np.ndarray]:
    """Return the equilibrium of the moving rod next to a posture."""
    still = np.zeros
    flap, u, _ = laid_out(setting, DEGREE, float(near.s[-1]), *through(near))
    last = np.inf
    for _ in range(MOST_CORRECTIONS):
        at = flap.balance(u, still(flap.size), still(flap.size))
        change = np.linalg.solve(at.by_state, -at.residual)
        u = u + change
        size = float(np.abs(flap.felt(change)).max())
        if size < SETTLED or 0.5 * last < size < ROUNDED:
            return flap, u
        last = size
    raise NotConverged("the state could not be solved again as one of a moving rod.")


def leaves(flap: Flap, u: np.ndarray) -> bool:
    """Whether a rod at rest in this state would leave it by itself, falling away."""
    rates, _ = _real(*_rates(flap, u))
    return bool(np.any(rates > 0.0))


def _growing(flap: Flap, u: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the rate of the motion that grows, and its direction, of a tip that turns by -1."""
    rates, modes = _real(*_rates(flap, u))
    i = int(np.argmax(rates))
    if rates[i] <= 0.0:
        raise NoEquilibrium(
            "nothing grows about this state: it does not snap.", remedy="Start from an unfolded state."
        )
    mode = modes[:, i].real
    return float(rates[i]), -mode / mode[0]


def _rates(flap: Flap, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rates of small motions about a state, and the motions; those that are none have no rate."""
    n, still, one = flap.size, np.zeros(flap.size), np.eye(flap.size)
    at, nothing = flap.balance(u, still, still), np.zeros((flap.size, flap.size))
    first, second = at.by_state, -at.by_rate
    if flap.setting.mass:
        first = np.block([[nothing, one], [-at.by_state, -at.by_rate]])
        second = np.block([[one, nothing], [nothing, at.by_second]])
    above, modes = eig(first, second, homogeneous_eigvals=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = above[0] / above[1]
    return rates, modes[:n]


def _real(rates: np.ndarray, modes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the same with a rate of -inf for what swings or is none."""
    real = np.isfinite(rates) & (np.abs(rates.imag) <= 1e-9 * np.abs(rates)) & (rates.real < FASTEST)
    return np.where(real, rates.real, -np.inf), modes
