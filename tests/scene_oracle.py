"""An independent look at states of scenes: their equations written out once more, from tip to front.

It shares no code with the package.  Parameters are called as in `scene_states.json`, units are k = T0 = 1:

    x' = L cos th,  y' = L sin th,  th' = kn + m,  m' = L (Ny cos th - Nx sin th),  L = 1 - (N.t)/EA,
    N' = L (p e + tau t + drag e1 + dead p e2) - w e2 + wx e1 - traction of the bond,

integrated by DOP853 with stops at every kink of the bond and at every material point.  What is missed of
th = 0, x = y = 0 and of the curvature at the front says how far a state is from being one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

RTOL, ATOL = 1e-13, 1e-15

#: Distance past a kink at which it is looked out for again.
PAST = 1e-9

PROFILES: dict[str, Callable[..., float]] = {
    "lin": lambda c, s, sbar, th, y: 1.0 + c * s / sbar,
    "exp": lambda c, s, sbar, th, y: math.exp(-s / c),
    "cos2": lambda s, sbar, th, y: math.cos(th) ** 2,
    "sin2": lambda s, sbar, th, y: math.sin(th) ** 2,
    "mixsin": lambda c, s, sbar, th, y: 1.0 - c + c * math.sin(th) ** 2,
    "y2": lambda c, s, sbar, th, y: (y / c) ** 2,
}


@dataclass(frozen=True)
class Start:
    """The tip of a state: inclination, position, forces (a reaction included), curvature."""

    theta: float
    x: float
    y: float
    Nx: float
    Ny: float
    curvature: float


@dataclass(frozen=True)
class End:
    """By how much the front is missed, and what arrives there."""

    theta: float
    x: float
    y: float
    curvature: float
    Nx: float
    Ny: float

    @property
    def missed(self) -> float:
        return max(abs(self.theta), abs(self.x), abs(self.y), abs(self.curvature))


def gap(p: dict[str, Any], x: float, y: float) -> tuple[float, float, float]:
    """Gap and normal of the wall."""
    kw = p.get("kw", 0.0)
    if not kw:
        return y, 0.0, 1.0
    cx, cy = x, y - 1.0 / kw
    rho = math.hypot(cx, cy)
    sign = math.copysign(1.0, kw)
    return (1.0 - abs(kw) * rho) / kw, -sign * cx / rho, -sign * cy / rho


def opening(p: dict[str, Any], g: float, u: float) -> float:
    """What decides on the piece of the bond."""
    return math.hypot(g, p["par"] * u) if p.get("law") == "op" else g


def bond(p: dict[str, Any], g: float, u: float, *, open_: bool) -> tuple[float, float]:
    """Traction across and along the wall; ``open_`` beyond y0."""
    y0, law, par = p["y0"], p.get("law"), p.get("par", 0.0)
    if p.get("nocoh"):
        return 0.0, 0.0
    if law == "op":
        delta = opening(p, g, u)
        t = 0.0 if open_ else 1.0 - delta / y0
        return t * g / delta, t * par**2 * u / delta
    normal = 0.0 if open_ else 1.0 - g / y0
    if law == "deg" and not open_:
        return normal - par * u**2 * (1.0 - g / y0) / y0, par * u * (1.0 - g / y0) ** 2
    if law == "K" and not open_:
        gc = 1.0 / par
        return (y0 - g) / (y0 - gc), 0.0
    return normal, par * u if law == "spr" else 0.0


def march(p: dict[str, Any], sbar: float, tip: Start) -> End:
    """Integrate a state from its tip to its front."""
    iEA, eps0 = p.get("iEA", 0.0), p.get("eps0", 0.0)
    stops = sorted({min(p[name], sbar) for name in ("sf", "a") if name in p} | {sbar})
    z = np.array([tip.theta, tip.curvature, tip.Nx, tip.Ny, tip.x, tip.y, tip.x + sbar * (1.0 + eps0)])
    s, y0 = 0.0, p["y0"]
    open_ = opening(p, gap(p, tip.x, tip.y)[0], tip.x + sbar * (1.0 + eps0)) > y0

    for stop in stops:
        while s < stop:
            wet, glued = s < p.get("sf", math.inf), s >= p.get("a", 0.0)

            def rates(
                s: float, z: np.ndarray, wet: bool = wet, glued: bool = glued, open_: bool = open_
            ) -> Any:
                th, m, Nx, Ny, x, y, u = z
                c, n = math.cos(th), math.sin(th)
                L = 1.0 - iEA * (Nx * c + Ny * n)
                name, *numbers = p.get("prof", ["lin", 0.0])
                pressure = p["p"] * PROFILES[name](*numbers, s, sbar, th, y) if wet else 0.0
                dead = p.get("dead", 0.0) * pressure
                follows = pressure - dead
                tau = p.get("tau", 0.0) + p.get("mu", 0.0) * p["p"]
                fx = L * (-follows * n + tau * c + p.get("drag", 0.0)) + p.get("wx", 0.0)
                fy = L * (follows * c + tau * n + dead) - p.get("w", 0.0)
                if glued:
                    g, nx, ny = gap(p, x, y)
                    across, along = bond(p, g, u, open_=open_)
                    fx, fy = fx - across * nx - along, fy - across * ny
                slip = L * c - 1.0 - eps0 if iEA else -2.0 * math.sin(0.5 * th) ** 2
                return [m, L * (Ny * c - Nx * n), fx, fy, L * c, L * n, slip]

            def crosses(s: float, z: np.ndarray, start: float = s, open_: bool = open_) -> float:
                if s < start + PAST:
                    return -1.0 if not open_ else 1.0
                return opening(p, gap(p, z[4], z[5])[0], z[6]) - y0

            crosses.terminal = True  # type: ignore[attr-defined]
            watched = None if not glued or p.get("nocoh") or p.get("law") == "spr" else crosses
            found = solve_ivp(rates, (s, stop), z, method="DOP853", rtol=RTOL, atol=ATOL, events=watched)
            assert found.status >= 0, found.message
            s, z = float(found.t[-1]), found.y[:, -1]
            if found.status == 1:
                open_ = not open_
        if stop == p.get("a"):
            open_ = opening(p, gap(p, z[4], z[5])[0], z[6]) > y0
    th, m, Nx, Ny, x, y, _ = z.tolist()
    held = 2.0 * p.get("G0", 0.0) - ((-iEA * Nx - eps0) ** 2 / iEA if iEA else 0.0)
    front = p.get("kw", 0.0) + math.sqrt(max(held, 0.0))
    return End(th, x, y, m - front, Nx, Ny)
