"""A rod in motion as pictures: its shape at a moment, front and tip against time, the ledger of energies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..model.scene import Scene
from ..motion.history import History
from ..motion.trajectory import Snap
from .frame import Frame, stage
from .panels import Axis, Line, Mark, Panel, room
from .scene import in_words
from .walls import ROUND, solid, walls
from .words import AxisUnit, axis_unit, length_unit, prefixed, quantity

#: Change of the tip angle [rad] by which a motion has begun, and to which it is over, on a picture.
SEEN = 0.02

#: Looks of the lines of each picture, for a pen that must know before.
LENGTHS = ("tip-y", "tip-x", "front")
LEDGER = ("zero", "bond-loss", "drag-loss", "kinetic", "bending", "separation", "work")

#: Entries of the ledger, with the look of each and what it is called: what is stored, what is lost.
STORED = {name: (name, name, name) for name in ("bending", "separation", "kinetic")}
LOST = {"drag": ("drag-loss", "drag", "lost to drag"), "bond_loss": ("bond-loss", "bond", "lost to the bond")}

#: Height of a picture in which y0 is named, over y0.
_NAMED = 1.1

#: Where an axis of times ends, over the last time that is seen.
_BEYOND = 1.02

#: Room around the lines, as a share of them.
_MARGIN = 0.06


def seen(motion: Snap) -> tuple[float, float]:
    """Return when a motion is seen: not the first of its growth, nor the last of its settling."""
    angle, t = motion.tip.angle, motion.t
    begun = int(np.argmax(np.abs(angle - angle[0]) > SEEN))
    moving = np.flatnonzero(np.abs(angle - angle[-1]) > SEEN)
    over = int(moving[-1]) + 1 if moving.size else len(t) - 1
    return (float(t[max(begun - 1, 0)]), float(t[over])) if over > begun else (float(t[0]), float(t[-1]))


@dataclass(frozen=True, eq=False)
class MotionPanels:
    """The pictures of a motion; times on their axes count from where it is seen to begin.

    Parameters
    ----------
    motion : Snap
    """

    motion: Snap

    @cached_property
    def lengths_in(self) -> AxisUnit:
        """The unit of lengths."""
        return length_unit(self.motion.rod, float(self.motion.front.max()))

    @cached_property
    def times_in(self) -> AxisUnit:
        """The unit of times."""
        begin, end = seen(self.motion)
        return axis_unit(self.motion.time_unit, end - begin)

    @cached_property
    def title(self) -> str:
        """What moves, and what becomes of it."""
        return f"{self._held}: {self.motion.outcome}{scene_words(self.motion)}"

    @cached_property
    def asked(self) -> str:
        """What moves."""
        return self._held + scene_words(self.motion)

    @property
    def _held(self) -> str:
        """Under which pressure, in short."""
        motion, rod = self.motion, self.motion.rod
        load = rf"$p/T_0 = {motion.pressure:.4g}$" if rod.dimensionless else f"$p$ = {_pascal(motion)}"
        return rf"{load}, $\eta/y_0 = {rod.ratio:.4g}$, {motion.bond} bond"

    def time_of(self, t: float) -> float:
        """Return where a time of the motion is on the axes."""
        return (t - seen(self.motion)[0]) / self.times_in.size

    def here(self, t: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return where a moment is among the lengths, by its front, and in the ledger, by the work."""
        motion, at = self.motion, self.time_of(t)
        front = float(np.interp(t, motion.t, motion.front)) / self.lengths_in.size
        return (at, front), (at, float(np.interp(t, motion.t, motion.energy.work)) / self._energies_in.size)

    # --- the rod ------------------------------------------------------------------------------

    @cached_property
    def _frame(self) -> Frame:
        size, motion = self.lengths_in.size, self.motion
        x, y = np.append(motion.x, motion.front.max()), np.append(motion.y, 0.0)
        frame = stage(x / size, y / size, motion.rod.adhesion_range / size)
        return replace(frame, stretch=1.0) if abs(self.bent) * frame.width > ROUND else frame

    @property
    def bent(self) -> float:
        """Curvature of the wall in the coordinates of the axes."""
        scene = self.motion.scene
        if not isinstance(scene, Scene):
            return 0.0
        return scene.wall_curvature * self.lengths_in.size / scene.rod.eta

    @cached_property
    def _axes(self) -> tuple[Axis, Axis]:
        size, motion = self.lengths_in.size, self.motion
        corners = np.column_stack([motion.x.ravel(), motion.y.ravel()]) / size
        if self._frame.shows_range:  # with room for its name
            corners = np.append(corners, [[0.0, _NAMED * motion.rod.adhesion_range / size]], axis=0)
        return self._frame.axes(self.lengths_in, corners)

    def rod(self, t: float) -> Panel:
        """Return the picture of the rod at a time, with room for all of its motion."""
        size, pose = self.lengths_in.size, self.motion.shape(t)
        x, y = pose.x / size, pose.y / size
        front = float(x[-1]), float(pose.s[-1]) / size
        under_rod = walls(self._frame, self.bent, self.lengths_in, self.motion.rod, front=front)
        ground = self._frame.ground
        if self.bent:
            behind = solid(under_rod[0], self._frame, self.bent)
            ground = replace(ground, y0=None, shows_y0=False, solid=behind)
        lines = (*under_rod, Line("rod", x, y))
        ends = ((0, "tip", "free tip $s = 0$"), (-1, "detachment", r"detachment $s = \bar s$"))
        marks = tuple(Mark(look, float(x[i]), float(y[i]), meaning) for i, look, meaning in ends)
        return Panel(*self._axes, lines, marks, title=self.title, ground=ground)

    # --- against time ---------------------------------------------------------------------------

    @cached_property
    def _times(self) -> np.ndarray:
        return (self.motion.t - seen(self.motion)[0]) / self.times_in.size

    @cached_property
    def _across(self) -> Axis:
        return Axis(self.times_in.axis("t"), 0.0, _BEYOND * self.time_of(seen(self.motion)[1]))

    @cached_property
    def lengths(self) -> Panel:
        """Front and tip against time; named moments are marked on the front."""
        motion, unit, t = self.motion, self.lengths_in, self._times
        drawn = (
            ("front", motion.front, r"front $\bar s$"),
            ("tip-x", motion.tip.x, "tip $x$"),
            ("tip-y", motion.tip.y, "tip $y$"),
        )
        lines = tuple(Line(look, t, values / unit.size, label) for look, values, label in drawn)
        named = [(e.kind, self.time_of(e.t), e.front / unit.size) for e in motion.events]
        marks = [
            Mark("event", at, front, kind, kind, away=(-0.7, 0.7), listed=False)
            for kind, at, front in named
            if kind not in ("angle", "start") and 0.0 <= at <= self._across.high
        ]
        low = min(0.0, *(float(line.y.min()) for line in lines))
        high = max(float(line.y.max()) for line in lines)
        return Panel(
            self._across,
            Axis(bracketed("length", unit), low, high + _MARGIN * (high - low)),
            lines,
            tuple(marks),
            title=self.title,
        )

    @cached_property
    def _energies_in(self) -> AxisUnit:
        return energy_unit(self.motion)

    @property
    def _work(self) -> str:
        """What does the work, in words."""
        return "work of the pressure" if self.motion.scene is None else "work of all loads"

    @cached_property
    def ledger(self) -> Panel:
        """Where the work of the loads goes, since the start: what is stored, what is lost."""
        ledger, t, unit = self.motion.energy, self._times, self._energies_in
        of = {name: getattr(ledger, name) for name in (*STORED, *LOST)}
        entries = [(of[name] - of[name][0], *words) for name, words in STORED.items()]
        entries += [(of[name], *words) for name, words in LOST.items()]
        lines = [
            Line(look, t, values / unit.size, label, full)
            for values, look, label, full in entries
            if np.any(values)
        ]
        lines.append(Line("work", t, ledger.work / unit.size, "work", self._work))
        ends = room(np.concatenate([line.y for line in lines]), _MARGIN)
        zero = Line("zero", np.array([self._across.low, self._across.high]), np.zeros(2))
        return Panel(self._across, Axis(bracketed("energy since the start", unit), *ends), (zero, *lines))


def scene_words(motion: Snap | History) -> str:
    """Return what acts beside the pressure, on a line of its own; nothing in the paper's scene."""
    scene = motion.scene
    if not isinstance(scene, Scene):
        return "" if scene is None else "\nin a scene"
    sizes = {name: kind.size(scene.rod) for name, kind in scene.dimensions.items()}
    numbers = {name: value * sizes[name] for name, value in scene.numbers.items()}
    return "\n" + (", ".join(in_words(scene, numbers)) or "in a scene")


def energy_unit(motion: Snap | History) -> AxisUnit:
    """Return the unit in which a picture shows the energies of a rod in time."""
    if motion.rod.dimensionless:
        return AxisUnit(1.0, r"T_0\eta^2", is_symbol=True)
    return prefixed(float(np.abs(motion.energy.work).max()), "J/m")


def bracketed(words: str, unit: AxisUnit) -> str:
    """Return the label of an axis that shows what words say."""
    return f"{words} [${unit.name}$]" if unit.is_symbol else f"{words} [{unit.name}]"


def _pascal(motion: Snap) -> str:
    return quantity(motion.pressure, "Pa")
