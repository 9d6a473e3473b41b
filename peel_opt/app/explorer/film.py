"""The film of a snap: the motion that a state makes when it lets go, and its moments."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.errors import InvalidInput
from ...equilibria.result import Equilibrium
from ...model.labels import UNFOLDED
from ...motion.snap import snap
from ...motion.trajectory import OUTCOMES, Snap
from ...plots.motion_panels import MotionPanels, seen
from ...plots.words import plain
from . import moves
from .state import State

#: Moments of a film.
FRAMES = 120


def film_of(state: State, eq: Equilibrium | None, told: Callable[[int, int | None], object]) -> Film:
    """Let a state go, and follow it to where it comes to rest; seconds, as a rule.

    Parameters
    ----------
    state : State
    eq : Equilibrium or None
        Its answer.
    told : callable
        Told how far it is, in parts of how many; what it raises ends the motion.

    Raises
    ------
    PeelOptError
        If nothing snaps there, in the words of `peel_opt.snap`, or no motion is computed of it.
    """
    if state.given == "groups":
        state = moves.asked(state, "pressure", eq)
    if state.law == "linear" and eq is not None and "y > y0" in eq.flags:
        raise InvalidInput(
            "the linear law has no end at y0, where a rod that lets go leaves its bond.",
            remedy="Choose law (8).",
        )
    rod, scene = state.rod, state.rods_scene
    assert rod is not None  # the groups were left
    pressure = state.pressure if eq is None else rod.pressure(eq.pressure_ratio)
    start = None if eq is None or eq.state in UNFOLDED else eq
    return Film(state, snap(scene or rod, pressure, start=start, progress=told))


@dataclass(frozen=True, eq=False)
class Film:
    """A motion and the pictures of its moments.

    Parameters
    ----------
    state : State
        What let go.
    motion : Snap
    """

    state: State
    motion: Snap

    @cached_property
    def panels(self) -> MotionPanels:
        """Its pictures."""
        return MotionPanels(self.motion)

    @cached_property
    def times(self) -> np.ndarray:
        """The times of its moments, (FRAMES,)."""
        return np.linspace(*seen(self.motion), FRAMES)

    def front(self, t: float) -> float:
        """Return the detached length at a time, in the units of the rod."""
        return float(np.interp(t, self.motion.t, self.motion.front))

    @property
    def headline(self) -> str:
        """What moves, and what becomes of it."""
        return f"{plain(self.panels.asked)}: {OUTCOMES[self.motion.outcome]}"

    @property
    def details(self) -> str:
        """How it was computed, and how far to trust it."""
        motion = self.motion
        unit = {"s": "s", "tau": "τ"}.get(motion.time_unit, "c η/T₀")
        missed = float(np.abs(motion.certificate).max())
        times = "" if math.isnan(motion.time_error) else f", {motion.time_error:.0e} {unit} in times"
        return (
            f"{len(motion)} steps, {motion.law} law, with drag, without mass; error {motion.error:.0e} η"
            f" in front and tip{times}; certificate {missed:.0e}"
        )
