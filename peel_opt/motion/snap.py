"""What a rod does after it let go: asked in its own units, and run at two resolutions for the error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from ..base.checks import finite, positive
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged, OutOfRange
from ..base.progress import Progress
from ..base.progress import progress as telling
from ..base.threads import one_thread
from ..equilibria.ask import length_given_pressure
from ..equilibria.result import Equilibrium
from ..model.bond import CohesiveLaw
from ..model.rod import Rod, Units
from ..model.scene import Scene
from .acting import loads_on
from .departure import departure, held_at, require_attached, stretched
from .rates import resistance
from .run import PARTS, Posture, Setting, Told, Track, Until, in_parts
from .subject import Subject, lengthened, subject_of
from .tiers import MESHED, OPENED, best
from .trajectory import BONDS, NEAR, SCENE_RESTS, Happening, Ledger, Snap, TipPath, rest_of_scene

#: Longest run, over the unit of time, of a rod that is followed until it rests.
LONGEST = 3000.0

#: How far from the folded equilibrium a rod at rest may be, over eta, beside its error.
APART = 1e-5

#: A likely end of a run that starts from a nudge, over the time in which that grows by e.
LIKELY = 25.0


@one_thread
def snap(
    rod: Rod | Scene,
    pressure: float,
    *,
    flaw: float | None = None,
    start: Equilibrium | None = None,
    mass: float = 0.0,
    drag: float | None = None,
    bond: str = "reversible",
    law: str | CohesiveLaw = "auto",
    until: str | float = "arrest",
    rod_length: float | None = None,
    progress: Progress = None,
) -> Snap:
    """Follow a rod from the moment it lets go to where it comes to rest.

    The pressure is held, and all else that acts in a scene.  Up to contact the front is tracked; from there
    on, for bonds that do not heal, and where the front is lost or takes too many steps, a fixed mesh takes
    over, which knows some four digits.

    Without ``flaw`` and ``start`` the motion begins just off the unfolded state, which
    has one direction in which it grows: the snap along it is one orbit for a rod, a pressure and what
    resists.  The time that it takes to leave is that of the nudge; those between events are the rod's.
    A tip that has landed slides into the state that just touches the plate, and is given a small lift there.
    A run that takes more steps than one may is "not settled", with "given up" as its last event.

    In a scene a pressure above what holds an edge without glue leaves no unfolded state: the motion begins in
    the state in which the edge snaps, let go at the higher pressure.

    Parameters
    ----------
    rod : Rod or Scene
        A scene under a law in the gap alone: with any loads, an edge without glue, a free or loaded
        tip, a natural curvature; on a curved wall under a uniform pressure.
    pressure : float
        p [Pa]; the attached rod must bear it, with what else pulls on it: a uniform one is below T0.
    flaw : float, optional
        Detached length [m] at the start, in the shape of the unfolded state; shorter than that state it
        closes, or settles in the lifted state of its scene.  The bond along it heals if the rod lies down.
    start : Equilibrium, optional
        The state it is in before; one of another pressure or of another scene is let go as it is.
    mass : float
        Per area [kg/m^2].
    drag : float, optional
        Force per area and speed [Pa s/m], the same in all directions.  It sets the time: without it times
        are in c eta/T0, and a rod in SI units must not have a mass.  1 for a rod without units.
    bond : {"reversible", "damage", "no_rebond"}
        What a bond does on the way back.  One that does not heal begins 1 % longer than the unfolded state.
    law : str or CohesiveLaw
        As in `length_given_pressure`; a scene has its own.
    until : {"arrest", "contact"}, float or str
        When to stop: at rest, at the first touch of the plate, or at a time.
    rod_length : float, optional
        Of the whole rod [m]; long enough if not given, on a circle once around it.
    progress : None, bool or callable
        By default a bar on stderr after a second, if that is a terminal.

    Returns
    -------
    Snap

    Raises
    ------
    InvalidInput
        If an argument cannot be meant: a negative drag, mass and drag both zero, a scene whose motion is not
        computed, a rod that is no longer than what is detached at the start.
    OutOfRange
        From T0 on, where nothing attached is in equilibrium; and where a rod with mass comes down on the
        plate and the motion goes on: the `Snap` up to there is among the ``candidates`` of the error.
    NoEquilibrium
        If the pressure holds no unfolded state to begin with; an edge without glue may grow stably.
    NotConverged
        If the motion could not be carried on.

    Examples
    --------
    >>> snapped = snap(Rod.from_ratio(0.3), 0.9)
    >>> snapped.outcome, round(float(snapped.front[-1]), 5)
    ('folded', 3.03684)
    """
    asked = _asked(rod, pressure, mass, drag, bond, law, rod_length)
    posture, growth = _begun(asked, flaw, start)
    require_attached(posture, asked.setting)
    limit = _until(until, asked)
    with _telling(growth, limit, progress) as told:
        fine, error, time_error = best(asked.setting, posture, limit, told)
    found = _in_units(asked, fine, growth, error, time_error)
    if found.outcome in SCENE_RESTS and bond == "reversible":
        found = _resting(asked, fine, found)
    if fine.outcome == "contact" and until != "contact":
        units = Units.of(asked.rod)
        raise OutOfRange(
            f"the rod came down on the plate at t = {found.t[-1]:.6g} {found.time_unit}, with"
            f" sbar = {found.front[-1]:.6g} {units.length}: what follows depends on how it bounces.",
            remedy='Ask until="contact" for the motion up to there.',
            candidates=(found,),
        )
    return found


@dataclass(frozen=True)
class _Asked:
    """What was asked, and how it is posed for a run; ``unit`` is the unit of time."""

    subject: Subject
    pressure: float
    mass: float
    drag: float | None
    unit: float
    setting: Setting

    @property
    def rod(self) -> Rod:
        """The rod that moves."""
        return self.subject.rod


def _asked(
    subject: Rod | Scene,
    pressure: float,
    mass: float,
    drag: float | None,
    bond: str,
    law: str | CohesiveLaw,
    rod_length: float | None,
) -> _Asked:
    """Check what was asked and put it in units of eta, T0 and the time of the run."""
    what = subject_of(subject, law)
    rod = what.rod
    if bond not in BONDS:
        raise InvalidInput(f"unknown bond {bond!r}.", remedy=f"Choose one of {', '.join(BONDS)}.")
    pressure = finite("pressure", pressure, "" if rod.dimensionless else "Pa")
    rho, c = resistance(rod, mass, drag)
    scale = rod.eta / rod.adhesion_strength
    unit = math.sqrt(rho * scale) if rho else c * scale
    length = what.longest(rod_length)
    setting = Setting(
        rod.ratio,
        what.bond_law,
        rod.pressure_ratio(pressure),
        1.0 if rho else 0.0,
        c * scale / unit if rho else 1.0,
        bond,
        length,
        what.loads,
    )
    given = None if drag is None and not rod.dimensionless else c
    return _Asked(what, pressure, rho, given, unit, setting)


def _begun(asked: _Asked, flaw: float | None, start: Equilibrium | None) -> tuple[Posture, float]:
    """Return where the run begins, and the rate at which it leaves, nan if from no state."""
    if flaw is not None and start is not None:
        raise InvalidInput("a motion begins at a flaw or at a state, not at both.")
    if start is not None:
        _require_state_of(asked.rod, start)
        asked.subject.require_holds(asked.pressure, start.length_ratio)
        _require_edge_in(asked, "start", start.length_ratio)
        if start.pressure_ratio != asked.setting.pressure or start.scene != asked.subject.scene:
            return stretched(start, start.length_ratio), math.nan
        left = departure(asked.setting, start)
        return left.posture, left.growth
    begin = asked.subject.unstable(asked.pressure)
    if flaw is not None:
        length = asked.rod.length_ratio(flaw)
        _require_edge_in(asked, "flaw", length)
        return lengthened(begin.posture, length), math.nan
    if begin.state is None:
        return begin.posture, math.nan
    if asked.setting.bond != "reversible":
        return lengthened(begin.posture, OPENED * begin.state.length_ratio), math.nan
    left = departure(asked.setting, begin.state)
    return left.posture, left.growth


def _require_state_of(rod: Rod, start: object) -> None:
    """Raise unless something is a state of a rod that may be let go."""
    if not isinstance(start, Equilibrium) or start.rod != rod:
        raise InvalidInput(f"start must be an Equilibrium of this rod, got {start!r:.60}.")
    if isinstance(start.scene, str):
        raise InvalidInput(
            "start is a state of a scene of which a file has the words alone.", remedy="Solve for it again."
        )
    if start.scene is not None:
        loads_on(start.scene)


def _require_edge_in(asked: _Asked, named: str, length: float) -> None:
    """Raise unless an edge without glue is a part of what is detached at the start."""
    if length < (bare := asked.setting.loads.unbonded):
        units, rod = Units.of(asked.rod), asked.rod
        raise InvalidInput(
            f"{named} has {rod.length(length):.6g} {units.length} detached, less than the edge that was never"
            f" glued, {rod.length(bare):.6g} {units.length}, which is always a part of it.",
            remedy="Begin with more.",
        )


def _until(until: str | float, asked: _Asked) -> Until:
    if until in ("arrest", "contact"):
        return Until(LONGEST, contact=until == "contact", arrest=True)
    in_seconds = asked.drag is not None and not asked.rod.dimensionless
    if isinstance(until, str) and not (in_seconds and until[:1].isdecimal()):
        raise InvalidInput(
            f'until must be "arrest", "contact" or a time, got {until!r}.',
            remedy="" if in_seconds else "Without drag times are plain numbers, in c eta/T0.",
        )
    time = positive("until", until, "s" if in_seconds else "")
    return Until(time / asked.unit, contact=False, arrest=False)


@contextmanager
def _telling(growth: float, until: Until, told: Progress) -> Iterator[Told]:
    """Tell how far a run is on the way to its likely end: the growth from a nudge, and as long again."""
    likely = until.time if math.isnan(growth) else min(until.time, LIKELY / growth)
    with telling("part", PARTS, told) as step, in_parts(step, likely) as reached:
        yield reached


def _in_units(asked: _Asked, run: Track, growth: float, error: float, time_error: float) -> Snap:
    """Return a run as a result in the units of its rod."""
    rod, unit = asked.rod, asked.unit
    eta, energy = rod.eta, rod.adhesion_strength * rod.eta**2

    def event(e: Happening) -> Happening:
        return Happening(e.kind, e.t * unit, e.front * eta, e.y * eta, e.x * eta, e.angle)

    return Snap(
        rod,
        law=asked.setting.law.name,
        bond=asked.setting.bond,
        pressure=asked.pressure,
        mass=asked.mass,
        drag=asked.drag,
        growth_rate=growth / unit,
        t=run.t * unit,
        front=run.front * eta,
        tip=TipPath(run.tip.y * eta, run.tip.x * eta, run.tip.angle),
        fraction=run.fraction,
        x=run.x * eta,
        y=run.y * eta,
        theta=run.theta,
        energy=Ledger(*(part * energy for part in run.energy)),
        certificate=run.identity,
        events=tuple(event(e) for e in run.events),
        outcome=run.outcome,
        error=error,
        time_error=time_error * unit,
        scene=asked.subject.scene,
    )


def _resting(asked: _Asked, run: Track, found: Snap) -> Snap:
    """Return a motion that came to rest, called as the equilibrium that is known otherwise to be there.

    That may not be on the branch that states are known of, but must then be one of the moving rod itself.
    Close to T0 a mesh cannot tell what is slow from what is at rest.

    Raises
    ------
    NotConverged
        If there is none where the rod stands still, as far as that is known.
    """
    front, resolved, subject = float(run.front[-1]), found.error < MESHED, asked.subject
    apart = max(APART if resolved else NEAR, 2.0 * found.error)
    try:
        known = _known_rest(asked, found.front[-1])
    except (NoEquilibrium, NotConverged):  # on the branch that is followed
        known = None
    if known is not None and abs(known.length_ratio - front) <= apart:
        named = "folded" if known.state == "folded" else "standing"
        # Both resolutions stand still as far from it.
        found = replace(found, error=max(found.error, _left(run, known, asked.rod)))
        return found if subject.scene is None else replace(found, outcome=named)
    last = Posture(run.fraction * front, run.theta[-1], np.zeros_like(run.fraction))
    own = held_at(asked.setting, last)
    if own is not None and abs(own - front) <= apart:
        return found
    if not resolved:
        return replace(found, outcome="not settled")
    nearest = "" if known is None else f": the nearest has {known.length_ratio:.8g}"
    raise NotConverged(f"the rod came to rest at sbar/eta = {front:.8g}, where no equilibrium is{nearest}.")


def _left(run: Track, rest: Equilibrium, rod: Rod) -> float:
    """Return how far from its rest a rod is that stands still, over eta; its tip on a plate alone."""
    off = abs(float(run.front[-1]) - rest.length_ratio)
    flat = not isinstance(rest.scene, Scene) or rest.scene.is_flat
    return max(off, abs(float(run.tip.y[-1]) - rod.length_ratio(rest.tip_height))) if flat else off


def _known_rest(asked: _Asked, length: float) -> Equilibrium:
    """Return the equilibrium that is known to be nearest to where a rod rests, with a length [m]."""
    subject = asked.subject
    if subject.scene is not None:
        return rest_of_scene(subject.scene, asked.pressure, length)
    return length_given_pressure(asked.rod, asked.pressure, law=subject.law, state="folded", near=length)
