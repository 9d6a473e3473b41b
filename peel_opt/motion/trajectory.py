"""The motion of a rod that let go, as a result: front, tip, shapes, energies, and where it ended."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..base.checks import finite
from ..base.drawing import Pictured, film
from ..base.errors import InvalidInput, PeelOptError
from ..base.progress import Progress
from ..base.records import Column, Schema, Stored, Table, array, entries
from ..equilibria.ask import length_given_pressure
from ..equilibria.result import Equilibrium
from ..equilibria.scenes import solve
from ..equilibria.storage import scene_from, scene_head
from ..equilibria.tip_on_plate import flat_fold, touching
from ..model.bond import CohesiveLaw
from ..model.named_laws import law_named
from ..model.rod import Rod, Units, rod_from
from ..model.scene import Scene

#: What a bond does when a point that was open comes back: heals, heals as far as it was not damaged, or
#: heals unless it was fully open.
BONDS = ("reversible", "damage", "no_rebond")

#: How a motion may end, and what that means.
OUTCOMES = {
    "folded": "the rod comes to rest in its folded equilibrium",
    "standing": "the rod comes to rest in a stable equilibrium that is not folded: lifted, or held upright",
    "touching": "the rod comes to rest with its tip, or a point behind it, just touching the plate",
    "flapping": "the tip goes up and down over and over, as a rule down to the plate",
    "flat fold": "the rod comes to rest in a loop with the rest of it lying upside down on the plate",
    "closes": "the start was below the unstable state: the rod lies down and heals",
    "held": "the rod comes to rest in an unfolded equilibrium, kept there by a bond that does not heal",
    "contact": "the rod came down on the plate, with its tip or before it, and was followed no further",
    "end of rod": "nothing is left to peel",
    "not settled": "the time, or the steps that a run may take, were up before the rod came to rest",
}

#: What a moment of a motion may be named for.
HAPPENINGS = ("start", "angle", "lift", "contact", "arrest", "end of rod", "time", "given up")


#: How far, over eta, a rod at rest may be from the equilibrium that it rests in, beside its error.
NEAR = 1e-3


def _folded(rod: Rod, pressure: float, law: CohesiveLaw) -> Equilibrium:
    return length_given_pressure(rod, pressure, law=law, state="folded")


#: The equilibria that a motion may come to rest in, by its outcome.
RESTS: dict[str, Callable[[Rod, float, CohesiveLaw], Equilibrium]] = {
    "folded": _folded,
    "touching": lambda rod, pressure, law: touching(rod, pressure, law=law),
    "flat fold": lambda rod, pressure, law: flat_fold(rod, pressure, law=law),
}


#: Those of a scene.
SCENE_RESTS = ("folded", "standing")


def rest_of_scene(scene: Scene, pressure: float, length: float) -> Equilibrium:
    """Return the equilibrium of a scene at a pressure [Pa] whose detached length [m] is nearest to one."""
    return solve(scene, free="length", pressure=pressure, near=length)


class TipPath(NamedTuple):
    """The free end: its height, its place along the plate from where it was stuck, and its angle [rad]."""

    y: np.ndarray
    x: np.ndarray
    angle: np.ndarray


class Ledger(NamedTuple):
    """Energies per width in the order of the balance: the first three, drag and bond loss are what work paid.

    kinetic + bending + separation rise by work - drag - bond_loss.
    """

    kinetic: np.ndarray
    bending: np.ndarray
    separation: np.ndarray
    work: np.ndarray
    drag: np.ndarray
    bond_loss: np.ndarray

    @property
    def defect(self) -> np.ndarray:
        """By how much the balance is missed since the start."""
        stored = self.kinetic + self.bending + self.separation
        missed: np.ndarray = stored - stored[0] - (self.work - self.work[0])
        return missed + self.drag - self.drag[0] + self.bond_loss - self.bond_loss[0]


class Happening(NamedTuple):
    """A moment of a motion: what happened, when, and where front and tip were."""

    kind: str
    t: float
    front: float
    y: float
    x: float
    angle: float


class Pose(NamedTuple):
    """The detached part at a time: arc length from the tip, place, height and angle, each (m,)."""

    s: np.ndarray
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray


@dataclass(frozen=True, eq=False, repr=False)
class Snap(Pictured, Stored):
    """The motion of a rod after it let go, in the units of its rod.

    Parameters
    ----------
    rod : Rod
    law, bond : str
        Name of the cohesive law, and what it does on the way back, one of `BONDS`.
    pressure : float
        p [Pa].
    mass : float
        Per area [kg/m^2].
    drag : float or None
        Force per area and speed [Pa s/m]; None if it was not given: times are then in c eta/T0.
    growth_rate : float
        Of the first departure from the unstable state, per unit of time; nan if it did not start there.
    t : ndarray, shape (n,)
        Times of the stored steps, in `time_unit`.
    front : ndarray, shape (n,)
        Detached length sbar [m].
    tip : TipPath
        Height [m], place along the plate [m] and angle [rad] of the tip, each (n,).
    fraction : ndarray, shape (m,)
        s/sbar of the points of the stored shapes, 0 at the tip.
    x, y, theta : ndarray, shape (n, m)
        The shapes: place along the plate from where the tip was stuck [m], height [m], angle [rad].
    energy : Ledger
        Energies per width [J/m], each (n,).
    certificate : ndarray, shape (n,)
        By how much the identity p y_tip - Phi(y_tip) = int (rho r_tt + c r_t).(e_x - t) ds is missed at every
        step, over T0 eta.
    events : tuple of Happening
        Moments with a name, in the order of time.
    outcome : str
        One of `OUTCOMES`.
    error : float
        Largest error of front and tip over eta, at one tip angle, from a second resolution.
    time_error : float
        That of the times between events, in `time_unit`; nan where there are no two to compare.
    scene : Scene or str or None
        What acts on the rod, if that is not the paper's uniform pressure; in words where it was read from a
        file and has parts or functions of the reader's own, which no file holds.
    """

    rod: Rod
    law: str
    bond: str
    pressure: float
    mass: float
    drag: float | None
    growth_rate: float
    t: np.ndarray
    front: np.ndarray
    tip: TipPath
    fraction: np.ndarray
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    energy: Ledger
    certificate: np.ndarray
    events: tuple[Happening, ...]
    outcome: str
    error: float
    time_error: float
    scene: Scene | str | None = None

    schema: ClassVar[Schema] = Schema("peel_opt snap", 2)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def time_unit(self) -> str:
        """What times are in: seconds; for a rod without units the tau of its mass and drag."""
        if self.drag is None:
            return "c eta/T0"
        return "tau" if self.rod.dimensionless else "s"

    @property
    def drag_time(self) -> float:
        """c eta/T0 in `time_unit`, in which drag moves the rod by its own size."""
        return 1.0 if self.drag is None else self.drag * self.rod.eta / self.rod.adhesion_strength

    @property
    def inertial_time(self) -> float:
        """sqrt(rho eta/T0) in `time_unit`, in which the rod would move by its own size without drag."""
        return math.sqrt(self.mass * self.rod.eta / self.rod.adhesion_strength)

    @property
    def speed(self) -> np.ndarray:
        """Of the front, length per `time_unit`, (n,)."""
        slopes: np.ndarray = np.gradient(self.front, self.t)
        return slopes

    @cached_property
    def arrest(self) -> Equilibrium | None:
        """The certified equilibrium that it came to rest in; None where it is none of those that are known.

        A motion with a bond that does not heal may stop at a length that no equilibrium has for itself.  Of
        a scene those are known that are folded or stand, not those with the tip on the plate.
        """
        try:
            found = self._rest()
        except PeelOptError:
            return None
        if found is None:
            return None
        apart = abs(found.length - self.front[-1]) / self.rod.eta
        if self.outcome == "flat fold":  # whose tail is not a part of the equilibrium
            apart = abs(self.tip.angle[-1] - found.tip_angle)
        return found if apart < max(2.0 * self.error, NEAR) else None

    def _rest(self) -> Equilibrium | None:
        """Return the equilibrium of its outcome, wherever that is."""
        if isinstance(self.scene, Scene):
            known = self.outcome in SCENE_RESTS
            return rest_of_scene(self.scene, self.pressure, float(self.front[-1])) if known else None
        law = None if self.scene is not None else law_named(self.law)
        if law is None or self.outcome not in RESTS:
            return None
        return RESTS[self.outcome](self.rod, self.pressure, law)

    def event(self, kind: str) -> Happening:
        """Return the first moment of a kind.

        Parameters
        ----------
        kind : str
            One of `HAPPENINGS`.

        Returns
        -------
        Happening

        Raises
        ------
        InvalidInput
            If there is none; the message names those that there are.
        """
        for event in self.events:
            if event.kind == kind:
                return event
        raise InvalidInput(
            f"nothing of the kind {kind!r} happened in this motion.",
            remedy=f"There are {', '.join(sorted({event.kind for event in self.events}))}.",
        )

    def shape(self, t: float) -> Pose:
        """Return the shape at a time, between stored steps by monotone cubics.

        Parameters
        ----------
        t : float
            Within the motion, in `time_unit`.

        Returns
        -------
        Pose
            Arc length from the tip, place, height [m] and angle [rad].

        Raises
        ------
        InvalidInput
            If the motion does not cover that time.
        """
        t = finite("t", t)
        if not self.t[0] <= t <= self.t[-1]:
            raise InvalidInput(
                f"t = {t:.6g} {self.time_unit} is outside the motion, which is known from {self.t[0]:.6g} to"
                f" {self.t[-1]:.6g}."
            )
        front, x, y, theta = (between(t) for between in self._between)
        return Pose(front * self.fraction, x, y, theta)

    @cached_property
    def _between(self) -> list[Any]:
        with np.errstate(over="ignore"):  # of one over a slope, where nothing moves
            return [PchipInterpolator(self.t, values) for values in (self.front, self.x, self.y, self.theta)]

    def film(self, path: str | Path, *, frames: int = 60, fps: int = 25, progress: Progress = None) -> Path:
        """Write a film of the rod, with front, tip and ledger beside it.

        Parameters
        ----------
        path : str or Path
            Its suffix chooses: .gif, .html, or .mp4, which needs the program ffmpeg.
        frames : int
        fps : int
            Frames per second.
        progress : None, bool or callable
            By default a bar on stderr after a second, if that is a terminal.

        Returns
        -------
        Path

        Raises
        ------
        InvalidInput
            If the suffix names no film, or the file cannot be written.
        MissingExtra
            If ffmpeg is needed and absent.
        """
        return film(self, path, frames=frames, fps=fps, progress=progress)

    def _head(self) -> dict[str, Any]:
        names = ("law", "bond", "pressure", "mass", "drag", "growth_rate", "outcome", "error", "time_error")
        events = [list(event) for event in self.events]
        own = {name: getattr(self, name) for name in names}
        return {**own, "events": events, **moved_in(self)}

    def _arrays(self) -> dict[str, np.ndarray]:
        return lines(self) | {name: getattr(self, name) for name in (*SHAPES, "fraction")}

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Self:
        fraction = array(arrays, "fraction")
        own = lived_through(head, arrays)
        own |= entries(head, float | int, "pressure", "mass", "growth_rate", "time_error")
        own |= entries(head, float | int | None, "drag")
        own |= {name: array(arrays, name, "f", (len(own["t"]), *fraction.shape)) for name in SHAPES}
        return cls(fraction=fraction, **own)

    def _table(self) -> Table:
        return Table(self.schema.stamped(self._head()).items(), columns(self))

    def __repr__(self) -> str:
        units = Units.of(self.rod)
        return (
            f"Snap{of_a_scene(self)} at {self.pressure:.6g} {units.pressure}, {self.bond} bond:"
            f" {self.outcome} after {self.t[-1] - self.t[0]:.6g} {self.time_unit},"
            f" sbar = {self.front[-1]:.6g} {units.length};"
            f" {len(self)} steps, error {self.error:.1e}, certificate {np.abs(self.certificate).max():.1e}"
        )


# --- files of what a rod lived through -----------------------------------------------------------

#: Arrays of one number and of one shape a step, and the names of tip and energies in a file.
LINES = ("t", "front", "certificate")
SHAPES = ("x", "y", "theta")
TIP = ("tip_y", "tip_x", "tip_angle")
ENERGIES = ("kinetic", "bending", "separation", "work", "drag", "bond_loss")


class Lived(Protocol):
    """What every rod in time has: where front and tip were, and where its energies went."""

    @property
    def rod(self) -> Rod:
        """The rod that moves."""

    @property
    def scene(self) -> Scene | str | None:
        """What acts on it."""

    @property
    def t(self) -> np.ndarray:
        """Times."""

    @property
    def front(self) -> np.ndarray:
        """Detached length."""

    @property
    def certificate(self) -> np.ndarray:
        """How far the identity is missed."""

    @property
    def tip(self) -> TipPath:
        """Where the free end was."""

    @property
    def energy(self) -> Ledger:
        """Where the work went."""

    @property
    def time_unit(self) -> str:
        """What times are in."""


def moved_in(lived: Lived) -> dict[str, Any]:
    """Return the rod that moves and what acts on it, as the head of a file holds them."""
    scene = {} if lived.scene is None else scene_head(lived.scene)
    return Units.of(lived.rod).rod(lived.rod) | scene


def of_a_scene(lived: Lived) -> str:
    """Return what is said of a rod on which something acts that is not in the paper."""
    return "" if lived.scene is None else " of a scene"


def lines(lived: Lived) -> dict[str, np.ndarray]:
    """Return the arrays of one number a step, as a file holds them."""
    parts = {name: getattr(lived, name) for name in LINES}
    parts |= dict(zip(TIP, lived.tip, strict=True))
    return parts | dict(zip(ENERGIES, lived.energy, strict=True))


def columns(lived: Lived, pressure: np.ndarray | None = None) -> dict[str, Column]:
    """Return them with their units, as a table shows them, with a pressure that changed after the times."""
    units = Units.of(lived.rod)
    energy = "T0 eta^2" if lived.rod.dimensionless else "J/m"
    shown = {"t": Column(lived.t, lived.time_unit)}
    if pressure is not None:
        shown["pressure"] = Column(pressure, units.pressure)
    shown["front"] = Column(lived.front, units.length)
    shown["tip height"] = Column(lived.tip.y, units.length)
    shown["tip place"] = Column(lived.tip.x, units.length)
    shown["tip angle"] = Column(lived.tip.angle, "rad")
    named = zip(ENERGIES, lived.energy, strict=True)
    shown |= {name.replace("_", " "): Column(values, energy) for name, values in named}
    return shown | {"certificate": Column(lived.certificate)}


def lived_through(head: dict[str, Any], arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """Return what a snap and a history share, by its names, from a file; or raise what is wrong."""
    rod, many = rod_from(head), array(arrays, "t").shape
    if rod is None:
        raise ValueError("it has no rod")
    own: dict[str, Any] = entries(head, str, "law", "bond", "outcome")
    own |= entries(head, float | int, "error")
    if own["bond"] not in BONDS or own["outcome"] not in OUTCOMES:
        raise ValueError("it has a bond or an outcome that is not known")
    own |= {name: array(arrays, name, "f", many) for name in LINES}
    tip = TipPath(*(array(arrays, name, "f", many) for name in TIP))
    energy = Ledger(*(array(arrays, name, "f", many) for name in ENERGIES))
    events = tuple(_happening(row) for row in head["events"])
    scene = scene_from(head, rod)  # which files of version 1 do not have
    return {"rod": rod, "scene": scene, "tip": tip, "energy": energy, "events": events, **own}


def _happening(row: Sequence[Any]) -> Happening:
    kind, *numbers = row
    if kind not in HAPPENINGS or len(numbers) != 5:
        raise ValueError("it has an event that cannot be read")
    return Happening(kind, *(float(number) for number in numbers))
