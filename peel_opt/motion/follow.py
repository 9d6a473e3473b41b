"""A run through contact: the front tracked up to where the tip comes low, and a fixed mesh from there on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .arc import Arc
from .mesh import run_on_mesh
from .run import Posture, Setting, Told, Track, Until
from .trajectory import Ledger, TipPath

#: Height of what comes down, as a share of its greatest, at which the mesh takes over.
LOW = 0.8


def beyond_contact(
    setting: Setting, first: Track, until: Until, *, resolution: int = 0, told: Told | None = None
) -> Track:
    """Carry a run of a rod without mass, which ended as it came down, on through that on a mesh."""
    low = _clearance(first, Arc(setting.loads.wall_curvature))
    i = int(np.flatnonzero(low >= LOW * low.max())[-1])
    s = first.fraction * first.front[i]
    start = Posture(s, first.theta[i], np.zeros_like(s), float(first.t[i]))
    then = run_on_mesh(setting, start, until, resolution=resolution, told=told)

    def both(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.concatenate([a[: i + 1], b[1:]])

    before, after, at = first.energy, then.energy, first.t[i]
    spent = (after.work + before.work[i], after.drag + before.drag[i], after.bond_loss + before.bond_loss[i])
    energy = Ledger(after.kinetic, after.bending, after.separation, *spent)
    return replace(
        then,
        t=both(first.t, then.t),
        front=both(first.front, then.front),
        identity=both(first.identity, then.identity),
        x=both(first.x, then.x),
        y=both(first.y, then.y),
        theta=both(first.theta, then.theta),
        tip=TipPath(*(both(a, b) for a, b in zip(first.tip, then.tip, strict=True))),
        energy=Ledger(*(both(a, b) for a, b in zip(before, energy, strict=True))),
        events=(*(e for e in first.events if e.t <= at), *(e for e in then.events if e.kind != "start")),
    )


def _clearance(run: Track, arc: Arc) -> np.ndarray:
    """Return the height at every time of the tip, or of the lowest point between it and the front, (n,)."""
    heights = arc.above(run.x, run.y).gap
    inside = heights[:, 1:-1]
    dips = (inside <= heights[:, :-2]) & (inside < heights[:, 2:])
    lowest = np.where(dips, inside, np.inf).min(axis=1)
    return np.asarray(np.minimum(run.tip.y, lowest))
