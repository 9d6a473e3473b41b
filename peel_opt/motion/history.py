"""A rod under a pressure that changes: loaded, unloaded and loaded again, by a bond that heals or not."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from ..base.arrays import floats
from ..base.checks import finite, positive
from ..base.drawing import Pictured, draw
from ..base.errors import InvalidInput, OutOfRange
from ..base.progress import Progress
from ..base.progress import progress as telling
from ..base.records import Schema, Stored, Table, array, entries
from ..base.threads import one_thread
from ..model.bond import CohesiveLaw
from ..model.rod import Rod, Units
from ..model.scene import Scene
from .departure import require_attached
from .mesh import TURNS, carried, chain_of
from .moments import LONGEST, begun
from .rates import resistance
from .run import PARTS, Posture, Setting, Track, Until, in_parts
from .subject import Subject, lengthened, subject_of
from .tiers import apart_in_time
from .trajectory import (
    BONDS,
    Happening,
    Ledger,
    TipPath,
    columns,
    lines,
    lived_through,
    moved_in,
    of_a_scene,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..equilibria.branch import Branch

#: Length over that of the unfolded state at the first pressure with which a history begins.
OPENED = 1.01

#: Least number of steps of a history.
STEPS = 200


@dataclass(frozen=True, eq=False, repr=False)
class History(Pictured, Stored):
    """What a rod did under a pressure that changed, in the units of the rod.

    Parameters
    ----------
    rod : Rod
    law, bond : str
        Name of the cohesive law, and what it does on the way back.
    t, pressure, front : ndarray, shape (n,)
        Times in ``time_unit``, p [Pa] and detached length [m], of which an edge without glue is always a
        part; with damage the furthest front reached.
    tip : TipPath
        Height [m], place [m] and angle [rad] of the tip, each (n,).
    energy : Ledger
        Energies per width [J/m], each (n,).
    certificate : ndarray, shape (n,)
        By how much the identity of the motion is missed at every step, over T0 eta.
    events : tuple of Happening
    outcome : str
        "closes" where the rod lay down, "end of rod" where it ran out, "not settled" at its end.
    error : float
        Largest difference of the fronts of two meshes over eta, at times that differ by ``time_error`` at
        most; a run that has ended keeps its last front.
    time_unit : str
    flags : tuple of str
        "damage close to T0": under damage the soft zone ahead of the front creeps; quote no length.
    scene : Scene or str or None
        What acts on the rod beside or in the place of a uniform pressure, as `Snap` has it.
    time_error : float
        Largest difference of the times at which two meshes pass the same tip angle, in ``time_unit``: of when
        a jump begins; nan of a file that does not say it.
    """

    rod: Rod
    law: str
    bond: str
    t: np.ndarray
    pressure: np.ndarray
    front: np.ndarray
    tip: TipPath
    energy: Ledger
    certificate: np.ndarray
    events: tuple[Happening, ...]
    outcome: str
    error: float
    time_unit: str
    flags: tuple[str, ...] = ()
    scene: Scene | str | None = None
    time_error: float = math.nan

    schema: ClassVar[Schema] = Schema("peel_opt history", 2)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def dissipated(self) -> np.ndarray:
        """Energy per width [J/m] that drag and bond have taken since the start."""
        taken: np.ndarray = self.energy.drag + self.energy.bond_loss - self.energy.bond_loss[0]
        return taken

    def plot(
        self,
        ax: Axes | None = None,
        *,
        branch: Branch | None = None,
        legend: bool = True,
        title: str | None = None,
    ) -> Axes:
        """Draw the load path, over the equilibria of the rod if they are given.

        Parameters
        ----------
        ax : Axes, optional
            Without it front, pressure and dissipated energy against time stand beside the path.
        branch : Branch, optional
            Of the same rod or scene, from `peel_opt.trace`.
        legend : bool, optional
        title : str, optional

        Returns
        -------
        Axes
            Those of the path: detached length against pressure.

        Raises
        ------
        InvalidInput
            If the branch is of another rod or scene.
        """
        return draw(self, ax, branch=branch, legend=legend, title=title)

    def _head(self) -> dict[str, Any]:
        names = ("law", "bond", "outcome", "error", "time_error", "time_unit")
        own = {name: getattr(self, name) for name in names}
        told = {"events": [list(event) for event in self.events], "flags": list(self.flags)}
        return {**own, **told, **moved_in(self)}

    def _arrays(self) -> dict[str, np.ndarray]:
        return lines(self) | {"pressure": self.pressure}

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Self:
        own = lived_through(head, arrays) | entries(head, str, "time_unit")
        if "time_error" in head:  # which files of version 1 do not have
            own |= entries(head, float | int, "time_error")
        flags = tuple(head["flags"])
        if not set(flags) <= {CREEPING}:
            raise ValueError("it has a flag that is not known")
        return cls(pressure=array(arrays, "pressure", "f", own["t"].shape), flags=flags, **own)

    def _table(self) -> Table:
        return Table(self.schema.stamped(self._head()).items(), columns(self, self.pressure))

    def __repr__(self) -> str:
        units = Units.of(self.rod)
        flags = f", flags: {', '.join(self.flags)}" if self.flags else ""
        last = f"sbar = {self.front[-1]:.6g} {units.length} at p = {self.pressure[-1]:.6g} {units.pressure}"
        steps = f"{len(self)} steps, error {self.error:.1e}"
        return f"History({self.bond} bond{of_a_scene(self)}: {self.outcome}, {last}; {steps}{flags})"


#: p/T0 above which damage creeps ahead of the front, and the flag that says so.
CREEPS, CREEPING = 0.95, "damage close to T0"


@one_thread
def history(
    rod: Rod | Scene,
    *,
    pressure: Callable[[float], float] | tuple[Sequence[float], Sequence[float]],
    duration: float | None = None,
    bond: str = "reversible",
    law: str | CohesiveLaw = "auto",
    drag: float | None = None,
    rod_length: float | None = None,
    progress: Progress = None,
) -> History:
    """Follow a rod without mass while its pressure changes.

    It begins 1 % longer than the unfolded state at the first pressure, and so with a snap; in a scene in the
    lifted state, where there is one: an edge without glue lies flat at p = 0.  A history is
    quasi-static where the pressure changes slowly beside c eta/T0: halve its rate to see.  A fold in pressure
    is passed with a delay of about the rate to the power 2/3.

    Parameters
    ----------
    rod : Rod or Scene
        A scene of those that `snap` takes.
    pressure : callable or (times, pressures)
        p [Pa] as a function of time, or points that are joined by straight lines, numbers or with units.
        Not negative, and throughout such that the attached rod bears it: a uniform one is below T0.
    duration : float, optional
        In the unit of time; needed with a function.
    bond : {"reversible", "damage", "no_rebond"}
    law : str or CohesiveLaw
        As in `length_given_pressure`; a scene has its own.
    drag : float, optional
        Force per area and speed [Pa s/m].  Without it times are in c eta/T0.
    rod_length : float, optional
        Of the whole rod [m]; long enough if not given, on a circle once around it.
    progress : None, bool or callable
        By default a bar on stderr after a second, if that is a terminal.

    Returns
    -------
    History

    Raises
    ------
    InvalidInput
        If the pressures cannot be meant, or the motion of a scene is not computed.
    OutOfRange
        If the pressure reaches T0, with what else pulls on the attached rod, or falls below zero.
    NoEquilibrium
        If the first pressure holds neither a lifted nor an unfolded state.
    NotConverged
        If the motion could not be carried on.

    Examples
    --------
    >>> loop = history(Rod.from_ratio(1.0), pressure=([0, 60, 200], [0.5, 0.5, 0.3]), bond="damage")
    >>> loop.outcome, round(float(loop.front[-1]), 1)
    ('not settled', 5.3)
    """
    subject = subject_of(rod, law)
    rod = subject.rod
    if bond not in BONDS:
        raise InvalidInput(f"unknown bond {bond!r}.", remedy=f"Choose one of {', '.join(BONDS)}.")
    _, c = resistance(rod, 0.0, drag)
    unit = c * rod.eta / rod.adhesion_strength
    in_seconds = drag is not None and not rod.dimensionless
    given, looks = _ramp(rod, pressure, duration, unit, "s" if in_seconds else "")
    posture, end = _begun(subject, given(0.0)), float(looks[-1])
    load = _borne(subject, given, float(posture.s[-1]))
    for t in looks:
        load(float(t))
    longest = subject.longest(rod_length)
    setting = Setting(rod.ratio, subject.bond_law, load(0.0), 0.0, 1.0, bond, longest, subject.loads)
    require_attached(posture, setting)
    until = Until(end, contact=False, arrest=False)
    runs = []
    with telling("part", PARTS, progress) as step, in_parts(step, end) as told:
        for resolution, turn in enumerate(TURNS):
            chain = chain_of(setting, resolution)
            at, longest_step = begun(chain, posture, longest), min(LONGEST, end / STEPS)
            run = carried(chain, at, load, until, turn=turn, length=longest, longest=longest_step, told=told)
            runs.append(run.track)
    return _in_units(subject, setting, load, runs, unit, drag)


def _begun(subject: Subject, P: float) -> Posture:
    """Return where a history begins at p/T0: in the lifted state, else 1 % beyond where a snap begins."""
    pressure = subject.rod.pressure(P)
    if (lifted := subject.lifted(pressure)) is not None:
        return lifted
    start = subject.unstable(pressure)
    return start.posture if start.state is None else lengthened(start.posture, OPENED * start.posture.s[-1])


def _ramp(
    rod: Rod, pressure: object, duration: float | None, unit: float, named: str
) -> tuple[Callable[[float], float], np.ndarray]:
    """Return p/T0 as a function of time over its unit, whose name it may have, and times to look at it.

    The last of these is the end of the history.
    """
    T0, pressures_in = rod.adhesion_strength, "" if rod.dimensionless else "Pa"
    if callable(pressure):
        if duration is None:
            raise InvalidInput("a pressure that is a function of time needs a duration.")
        end, given = positive("duration", duration, named) / unit, pressure

        def load(t: float) -> float:
            return finite("pressure", given(t * unit), pressures_in) / T0

        return load, np.linspace(0.0, end, STEPS + 1)
    if not isinstance(pressure, Sequence) or len(pressure) != 2 or duration is not None:
        raise InvalidInput("pressure must be a function with a duration, or (times, pressures).")
    try:
        times, pressures = (
            floats("times", pressure[0], named),
            floats("pressures", pressure[1], pressures_in),
        )
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"times and pressures of a history must be numbers: {error}.") from error
    if (
        times.ndim != 1
        or times.shape != pressures.shape
        or len(times) < 2
        or times[0] != 0.0
        or not np.all(np.diff(times) > 0.0)
        or not math.isfinite(times[-1])
    ):
        raise InvalidInput("times of a history must begin at 0 and increase, with a pressure for each.")
    for pressure_then in pressures:
        finite("pressure", pressure_then)
    return lambda t: float(np.interp(t * unit, times, pressures)) / T0, times / unit


def _borne(subject: Subject, load: Callable[[float], float], sbar: float) -> Callable[[float], float]:
    """Return a load that raises where a history cannot have it, with the front at ``sbar`` at first.

    What depends on where the front is, is known on the way only.
    """
    everywhere = not subject.loads.feels & {"s", "sbar"}

    def borne(t: float) -> float:
        P = load(t)
        if subject.scene is None:
            return _below_T0(P)
        if P < 0.0:
            raise OutOfRange(f"the pressures of a history are not negative, got p/T0 = {P:.4g}.")
        if t == 0.0 or everywhere:
            subject.require_holds(subject.rod.pressure(P), sbar)
        return P

    return borne


def _below_T0(P: float) -> float:
    """Return p/T0, which a history has between 0 and 1 at every time it comes to."""
    if not 0.0 <= P < 1.0:
        raise OutOfRange(
            f"the pressures of a history lie between 0 and T0, got p/T0 = {P:.4g}: from T0 on the bond fails"
            " everywhere at once."
        )
    return P


def _in_units(
    subject: Subject,
    setting: Setting,
    load: Callable[[float], float],
    runs: list[Track],
    unit: float,
    drag: float | None,
) -> History:
    """Return the finer of two runs as a result, with what they differ by."""
    # An edge that was never glued is detached, also where it lies flat.
    coarse, fine = (replace(run, front=np.maximum(run.front, subject.loads.unbonded)) for run in runs)
    error, shift = apart_in_time(coarse, fine)
    rod = subject.rod
    eta, energy = rod.eta, rod.adhesion_strength * rod.eta**2
    P = np.array([load(t) for t in fine.t])
    if subject.scene is not None:  # a load may grow along the rod
        for pressure, front in zip(P * rod.adhesion_strength, fine.front, strict=True):
            subject.require_holds(pressure, float(front))
    creeps = setting.bond == "damage" and float(P.max()) > CREEPS
    own = "c eta/T0" if drag is None else "tau" if rod.dimensionless else "s"
    return History(
        rod,
        setting.law.name,
        setting.bond,
        t=fine.t * unit,
        pressure=P * rod.adhesion_strength,
        front=fine.front * eta,
        tip=TipPath(fine.tip.y * eta, fine.tip.x * eta, fine.tip.angle),
        energy=Ledger(*(part * energy for part in fine.energy)),
        certificate=fine.identity,
        events=tuple(
            Happening(
                e.kind, e.t * unit, max(e.front, subject.loads.unbonded) * eta, e.y * eta, e.x * eta, e.angle
            )
            for e in fine.events
        ),
        outcome=fine.outcome,
        error=error,
        time_unit=own,
        flags=(CREEPING,) if creeps else (),
        scene=subject.scene,
        time_error=shift * unit,
    )
