"""A run through contact: the front tracked up to where the rod comes low, and a fixed mesh from there on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .arc import Arc
from .mesh import run_on_mesh
from .run import Posture, Setting, Told, Track, Until
from .trajectory import Ledger, TipPath

#: Height of what comes down, as a share of its greatest, at which the mesh takes over.
LOW = 0.8

#: Share of the time of a run whose front was lost after which it does.
SOON = 0.95


def taken_over(setting: Setting, run: Track) -> int:
    """Return the state of a tracked run at which a mesh takes over: some time before its end.

    That is before something comes down, or if the front was lost, before it gets hard to follow.
    """
    share = SOON if run.events[-1].kind == "given up" else 1.0
    low = _clearance(run, Arc(setting.loads.wall_curvature))[
        run.t <= run.t[0] + share * (run.t[-1] - run.t[0])
    ]
    return int(np.flatnonzero(low >= LOW * low.max())[-1])


def posture_of(run: Track, at: int) -> Posture:
    """Return one of the states of a run of a rod without mass as where another begins."""
    s = run.fraction * run.front[at]
    return Posture(s, run.theta[at], np.zeros_like(s), float(run.t[at]))


def beyond(
    setting: Setting, first: Track, at: int, until: Until, *, resolution: int = 0, told: Told | None = None
) -> Track:
    """Carry a run of a rod without mass on from one of its states, through contact on a mesh."""
    start = posture_of(first, at)
    return joined(first, at, run_on_mesh(setting, start, until, resolution=resolution, told=told))


def joined(first: Track, at: int, then: Track) -> Track:
    """Return a run up to one of its states, and another from there on."""

    def both(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.concatenate([a[: at + 1], b[1:]])

    before, after, t = first.energy, then.energy, first.t[at]
    spent = (
        after.work + before.work[at],
        after.drag + before.drag[at],
        after.bond_loss + before.bond_loss[at],
    )
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
        events=(
            *(e for e in first.events if e.t <= t),
            *(e for e in then.events if e.kind != "start"),
        ),
    )


def _clearance(run: Track, arc: Arc) -> np.ndarray:
    """Return the height at every time of the tip, or of the lowest point between it and the front, (n,)."""
    heights = arc.above(run.x, run.y).gap
    inside = heights[:, 1:-1]
    dips = (inside <= heights[:, :-2]) & (inside < heights[:, 2:])
    lowest = np.where(dips, inside, np.inf).min(axis=1)
    return np.asarray(np.minimum(run.tip.y, lowest))
