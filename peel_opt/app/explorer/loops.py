"""Which hysteresis loop belongs to a state, or in words why there is none, and the sweep round it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...analysis.lambda_loop import Convention, HysteresisLoop, loop_along
from ...analysis.maxwell import TURN
from ...analysis.pressure_loop import PressureLoop, loop_of_branch, swept_pressures
from ...base.errors import NoEquilibrium, NotConverged
from ...base.units import told_apart
from ...equilibria.branch import Branch
from ...plots.loop import lambda_panel, pressure_panel
from ...plots.panels import Panel
from .curves import Curve
from .potential import Landscape
from .state import State

#: Values of the swept number on each way.
SWEEP = 40

#: Window of lambda swept, in units of the fold's.
WINDOW = (1.6, -1.44)

#: How far from a fold, relative to it, the sweep shows its last state.
OFF_FOLD = 1e-3

NOT_COMPUTED = "Quasi-static: a jump is a motion, which peel_opt.snap computes."


@dataclass(frozen=True, eq=False)
class LoopSweep:
    """A loop, its picture, and what must be said about it."""

    loop: HysteresisLoop | PressureLoop
    panel: Panel
    note: str

    @property
    def frames(self) -> tuple[LoopFrame, ...]:
        """The moments of the sweep, up and then down."""
        lines = {line.look: line for line in self.panel.lines}
        down, up = sorted(jump.swept for jump in self.loop.jumps)
        # No solve starts at the fold itself, nor at contact.
        low = down + OFF_FOLD * abs(down)
        high = up - OFF_FOLD * (up - down) if isinstance(self.loop, PressureLoop) else np.inf
        found = []
        for way, sweep in (("up", self.loop.up), ("down", self.loop.down)):
            rows = zip(lines[way].x, lines[way].y, sweep.swept, sweep.response, sweep.state, strict=True)
            for x, y, value, response, label in rows:
                near = None if label == "adhered" else float(response)
                at = float(value) if near is None else float(np.clip(value, low, high))
                found.append(LoopFrame(float(x), float(y), at, near, str(label)))
        return tuple(found)


@dataclass(frozen=True)
class LoopFrame:
    """One moment of the sweep: where it is on the loop, and the state (value, near, label)."""

    x: float
    y: float
    value: float
    near: float | None
    label: str


def lambda_loop(state: State, curve: Curve, found: Landscape) -> LoopSweep | str:
    """Return the loop at fixed beta0, read off the potential, or in words why there is none."""
    if state.beta0 == 0.0:
        return "At β₀ = 0 the detached state grows out of the straight rod: no jumps, no loop."
    fold = curve.special("LP-lambda")
    if fold is None:
        mine, last = told_apart(state.beta0, TURN, 5)
        return f"No loop in λ at β₀ = {mine}: the branch has no fold" + (
            f" (above β₀ = {last} none has)." if state.beta0 >= TURN else " that has been met so far."
        )
    if state.convention == "maxwell" and "maxwell" not in found.named:
        return "No Maxwell point is known here, hence no loop under that convention."
    if "delay" not in found.named:
        return "The branch is not known far enough past the fold for a loop."
    try:
        loop, panel = _of_potential(found, state.convention, curve)
    except (NoEquilibrium, NotConverged) as error:
        return str(error)
    note = NOT_COMPUTED
    if state.convention == "maxwell":
        note = "Under the Maxwell convention both ways are the same path. " + note
    return LoopSweep(loop, panel, note)


@lru_cache(maxsize=32)
def _of_potential(found: Landscape, convention: Convention, curve: Curve) -> tuple[HysteresisLoop, Panel]:
    fold, middle = found.named["fold"].lam, curve.branch.state == "middle"
    window = (WINDOW[0] * fold, WINDOW[1] * fold)
    loop = loop_along(found.potential, convention, found.source, window, SWEEP)
    return loop, lambda_panel(loop, (curve.branch.lam[middle], curve.branch.alpha1[middle]))


def pressure_loop(state: State, curve: Curve) -> LoopSweep | str:
    """Return the loop of a rod under a pressure, through states of its branch, or why there is none."""
    if state.law == "linear":
        return "A rod's loop needs law (8): under the linear law its branch may have no minimum pressure."
    turn = curve.special("LP-pressure")
    if turn is None or curve.special("contact") is None:
        return "The loop needs the branch up to contact; it has not been walked that far yet."
    loop, panel = _of_branch(curve.branch, turn.pressure_ratio)
    note = NOT_COMPUTED
    if state.convention == "maxwell":
        note = "A rod under a pressure has the delay convention only. " + note
    return LoopSweep(loop, panel, note)


@lru_cache(maxsize=32)
def _of_branch(branch: Branch, least: float) -> tuple[PressureLoop, Panel]:
    loop = loop_of_branch(branch, swept_pressures(least, SWEEP))
    return loop, pressure_panel(loop)
