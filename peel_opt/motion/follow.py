"""A run through contact: the front tracked up to where the tip comes low, and a fixed mesh from there on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .mesh import run_on_mesh
from .run import Posture, Setting, Told, Track, Until
from .trajectory import Ledger, TipPath

#: Height of a tip on its way down, as a share of its greatest, at which the mesh takes over.
LOW = 0.8


def beyond_contact(
    setting: Setting, first: Track, until: Until, *, resolution: int = 0, told: Told | None = None
) -> Track:
    """Carry a run of a rod without mass, which ended as its tip came down, on through that on a mesh."""
    i = int(np.flatnonzero(first.tip.y >= LOW * first.tip.y.max())[-1])
    s = first.fraction * first.front[i]
    low = Posture(s, first.theta[i], np.zeros_like(s), float(first.t[i]))
    then = run_on_mesh(setting, low, until, resolution=resolution, told=told)

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
