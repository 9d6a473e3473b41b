"""A run on a mesh that is fixed in the rod: with contact, bonds that remember, and pressures that change.

The mesh is as long as the motion needs: it grows ahead of the front.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..base.errors import OutOfRange
from .acting import PRESSURE_ALONE
from .chain import Chain
from .memory import Memory
from .moments import (
    AHEAD,
    BLOCK,
    LONGEST,
    Lift,
    Moment,
    Pacer,
    Pressure,
    Spent,
    begun,
    let_go,
    moving,
    spent,
)
from .readings import Recorder, at_rest_in, lying, tail
from .run import Posture, Setting, Told, Track, Until

#: Link lengths over eta, and angles [rad] that a link turns in a step, of the two resolutions.
LINKS, TURNS = (0.05, 0.025), (0.05, 0.025)

#: Nodes times steps after which a run is given up, of the two resolutions: some ten and thirty seconds.
MOST = (6e5, 2e6)

#: Heights, over that of the top, to which a tip is lifted one after the other that a mesh holds down.
LIFTS = (0.02, 0.04, 0.08, 0.16)

#: Links that are left ahead of the front at the end of the rod.
END = 2.0


def run_on_mesh(
    setting: Setting, start: Posture, until: Until, *, resolution: int = 0, told: Told | None = None
) -> Track:
    """Compute a run on a fixed mesh, as `Tier` says.

    A tip that has landed slides into the state in which it just touches the plate, which is unstable: on the
    mesh it is held there by the bond of its last half link.  It is given a small lift, and a larger one where
    it does not rise by itself; where it rises and lands again, it would go on to do so.  What the lift takes
    counts as work.
    """
    chain = chain_of(setting, resolution)
    return carried(
        chain,
        begun(chain, start, setting.length),
        lambda _: setting.pressure,
        until,
        turn=TURNS[resolution],
        most=MOST[resolution],
        length=setting.length,
        told=told,
    ).track


def chain_of(setting: Setting, resolution: int) -> Chain:
    """Return the mesh of a run at one of two resolutions."""
    memory = Memory(setting.law, setting.ratio, setting.bond)
    return Chain(LINKS[resolution], memory, setting.mass, setting.drag, loads=setting.loads)


class Carried(NamedTuple):
    """A run, and the moment it ended at."""

    track: Track
    last: Moment


def carried(
    chain: Chain,
    at: Moment,
    pressure: Pressure,
    until: Until,
    *,
    turn: float,
    most: float = np.inf,
    length: float = np.inf,
    longest: float = LONGEST,
    told: Told | None = None,
) -> Carried:
    """Carry a rod on from a moment, under a pressure that may change: for ``most`` nodes times steps."""
    kept = Recorder(chain)
    at = moving(chain, at, pressure(at.t))
    kept.add(at, pressure(at.t), Spent())
    kept.happened("start")
    pacer = Pacer(turn, longest)
    outcome, lift, lifts, moved = "not settled", None, 0, 0
    while outcome == "not settled" and at.t < until.time:
        if (moved := moved + len(at.u)) > most:
            kept.happened("given up")
            break
        end = min(lift.end, until.time) if lift else until.time
        before, at = at, pacer.taken(chain, at, end, pressure, lift)
        held = chain if lift is None else replace(chain, tip_at=float(at.y[0]))
        kept.add(at, pressure(at.t), spent(held, before, at, pressure), held)
        if told is not None:
            told(at.t)
        front = kept.rows[-1][1]
        _require_held(chain, at, pressure(at.t), front)
        if length - front < END * chain.h:
            outcome = "end of rod"
            kept.happened(outcome)
        elif not at.y.any() and (until.arrest or not _may_open(chain, at)):
            outcome = "closes"
        elif lift is not None:
            if at.t >= lift.end:
                lift, at = None, let_go(at)
                pacer.begins()
                kept.happened("lift")
        elif lying(at).size and not lying(before).size:
            rose = kept.rose
            outcome, lifts = _beyond(rose, until), 0 if rose else lifts
            kept.landed(before, at)
        elif lifts < len(LIFTS) and _stuck(kept, at, until):
            lift = Lift(at.t, LIFTS[lifts] * float(at.y.max()))
            at, lifts = replace(at, dt=np.inf), lifts + 1
            pacer.begins()
        elif until.arrest and kept.at_rest(at):
            outcome = at_rest_in(chain, at)
            kept.happened("arrest")
        elif until.arrest and kept.repeats():
            outcome = "flapping"
        at = _reaching(chain, at, front, length)
    if outcome == "not settled" and at.t >= until.time:
        kept.happened("time")
    return Carried(kept.track(outcome), at)


def _reaching(chain: Chain, at: Moment, front: float, length: float) -> Moment:
    """Return a rod with enough of it ahead of its front, as far as there is any."""
    meshed = len(at.u) * chain.h
    if front + AHEAD <= meshed or meshed >= length:
        return at
    return at.longer(chain, max(round(min(BLOCK, length - meshed) / chain.h), 1))


def _may_open(chain: Chain, at: Moment) -> bool:
    """Whether a rod that lies flat may be lifted again: part of it is not glued, or pulled more."""
    loads, flat = chain.loads, np.zeros(len(at.u))
    holds = chain.glued(len(flat)) * chain.memory.holding(flat, at.open_to)[0]
    held = chain.share(len(flat)) * chain.memory.pull(flat)[0]
    pulled = loads.tip_curvature > 0.0 or loads.tip_force[1] > 0.0 or chain.asks_front
    return bool(np.any(holds < held)) or pulled


def _require_held(chain: Chain, at: Moment, pressure: float, front: float) -> None:
    """Raise where what acts on the attached rod, up to its end, is more than its bond."""
    if chain.loads is PRESSURE_ALONE:  # which was asked before
        return
    across = np.stack(chain.normals(at.u))[:, -1]
    lift = float(across @ chain.acted(at.u, pressure, at.front).force[:, -1])
    if lift >= 1.0:
        raise OutOfRange(
            f"at t = {at.t:.6g} tau the front has come to {front:.6g} eta, where the attached rod is pulled"
            f" off with {lift:.6g} T0: from there on the bond fails everywhere at once, and no front runs"
            " that is local.",
            remedy="Ask for a lower pressure, or for a time before.",
        )


def _stuck(kept: Recorder, at: Moment, until: Until) -> bool:
    """Whether it is the mesh that holds a tip down: it is at rest, or has lain there for long alone.

    It is not the bond that does where there is none, nor where the plate presses by more than it pulls.
    """
    chain = kept.chain
    if tail(at) != 1 or not chain.glued(1)[0] or chain.pressed(at.u)[0] > chain.memory.pull(at.y[:1])[0][0]:
        return False
    return kept.at_rest(at) if until.arrest else kept.lain(at)


def _beyond(rose: bool, until: Until) -> str:
    """Say what follows from a landing, of a tip that has been lifted and rose or not."""
    if until.contact:
        return "contact"
    return "flapping" if rose and until.arrest else "not settled"
