"""A run before contact: the front and the kinks of the bond are followed as moving ends of smooth pieces."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from ..base.errors import NotConverged
from .departure import leaves
from .flap import Flap, Phase, Reading
from .layout import along, excesses, laid_out, shapes_of, through
from .radau import Integrator, Step, tableau
from .run import Posture, Setting, Told, Track, Until
from .trajectory import Happening, Ledger, TipPath

#: Degree of the polynomials of a phase, and largest error of an angle or a length over eta that a step may
#: have, by resolution.
MESHES = ((25, 1e-8), (31, 1e-9), (43, 1e-9), (60, 1e-9))

#: By how much the identity may be missed, over T0 eta, before a run is given up: its front is not resolved;
#: and by how much in what was resolved of it.
LOST, RESOLVED = 1e-3, 1e-5

#: First step, over the time unit, at the start and after an event.
FIRST, AFTER = 0.1, 0.01

#: Time that passes first in new phases, over the time unit.
RELAXED = 1e-7

#: Fastest point, eta per time unit, of a rod that is at rest, and by what it must have been faster before: an
#: unstable state may be left as slowly.
REST, SLOWED = 1e-8, 1e3

#: Tip angle [rad] from which on a rod at rest is folded.
FOLDED = -0.5 * math.pi

#: Height of a tip over eta that is on the plate.
LANDED = 1e-6

#: How far a motion that repeats itself may still be from its cycle, over eta, and over the width of that.
ROUND, NARROW = 2e-4, 1e-2

#: Where within a step states are stored beside its end, and the angles that are named, every so many rad.
BETWEEN = np.array([0.25, 0.5, 0.75, 1.0])
ANGLES = 0.5

#: s/sbar of the points of a stored shape.
FRACTIONS = np.linspace(0.0, 1.0, 101)

#: Steps after which a run is given up: one that settles fast takes a hundred or two.
MOST_STEPS = 800

#: Steps that pass at least so much time, over the time unit; else the front is not resolved.
STALLED, PASSED = 100, 1e-4

#: Shortest detached length over eta that is still followed as it closes.
CLOSED = 0.2

#: Shortest one beyond an edge that was never glued.
EDGE = 5e-3


@dataclass(eq=False)
class _Log:
    """What a run has been through so far."""

    times: list[np.ndarray] = field(default_factory=list)
    readings: list[np.ndarray] = field(default_factory=list)
    shapes: list[np.ndarray] = field(default_factory=list)
    events: list[Happening] = field(default_factory=list)
    spent: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def store(self, t: np.ndarray, reading: Reading, shapes: np.ndarray, spent: np.ndarray) -> None:
        """Keep states, with the work and the drag since the last that were kept."""
        self.times.append(t)
        numbers = (reading.front, *reading.tip, *reading[2:-1], *(self.spent + spent).T)  # but the speed
        self.readings.append(np.stack(numbers, axis=-1))
        self.shapes.append(shapes)
        self.spent = self.spent + spent[-1]

    def name(self, kind: str, t: float, front: float, tip: TipPath) -> None:
        """Keep a moment with a name."""
        self.events.append(Happening(kind, t, front, float(tip.y), float(tip.x), float(tip.angle)))


def track(
    setting: Setting, start: Posture, until: Until, *, resolution: int = 0, told: Told | None = None
) -> Track:
    """Return a run up to contact, by front tracking: a `Tier`.

    Raises
    ------
    NotConverged
        If the front is lost, with what was resolved of the run among the ``candidates``.
    """
    log = _Log()
    try:
        return _tracked(log, setting, start, until, resolution, told)
    except NotConverged as lost:
        lost.candidates = _resolved(log)
        raise


def _tracked(
    log: _Log, setting: Setting, start: Posture, until: Until, resolution: int, told: Told | None
) -> Track:
    """Run, and keep the states in a log."""
    degree, tol = MESHES[resolution]
    flap, u, z = laid_out(setting, degree, float(start.s[-1]), *through(start))
    t, (_, u, z) = start.t, _relaxed(flap, start.t, u, z, tol)
    h, before, first = FIRST, None, flap.tip(u).angle
    _keep(log, flap, np.array([t]), u[None], z[None], np.zeros((1, 2)))
    log.name("start", t, float(u[flap.lengths].sum()), flap.tip(u))
    times, fastest = deque([t], maxlen=STALLED), 0.0
    for _ in range(MOST_STEPS):
        system = Integrator(flap, bool(setting.mass), tol)
        step, h = system.advance(t, u, z, min(h, until.time - t), before)
        ending = _earliest(flap, step, setting)
        if ending is not None:
            kind, when = ending
            taken = system.step(t, u, z, when - t, before) if when > t else None
            if taken is None:
                raise NotConverged(f"the motion could not be carried on to t = {when:.6g}, where: {kind}.")
            step = taken
        reading = _record(log, flap, step)
        t, u, z, before = step.stop, step.u[-1], step.z[-1], step
        times.append(t)
        if told is not None:
            told(t)
        front, tip = float(reading.front[-1]), flap.tip(u)
        if np.abs(reading.identity).max() > LOST or (len(times) == STALLED and t - times[0] < PASSED):
            raise NotConverged(
                f"from t = {t:.6g}, sbar/eta = {front:.6g} on the moving rod is not resolved.",
                remedy="Give a rod_length or a time at which to stop before, or a lower pressure.",
            )
        kind = "" if ending is None else ending[0]
        if kind == "phases":
            visited = flap.phases
            flap, u, z = _in_new_phases(flap, u, z, degree)
            if until.arc and comes_down(flap.phases):
                return _finished(log, "arc")
            t, u, z = _relaxed(flap, t, u, z, tol)
            h, before = step.length if flap.phases == visited else min(AFTER, step.length), None
            continue
        fastest = max(fastest, float(reading.speed.max()))
        if not kind and until.arrest and reading.speed[-1] < min(REST, fastest / SLOWED):
            kind = "arrest" if tip.angle < FOLDED or not leaves(flap, u) else ""
        if not kind and until.arrest and goes_round(log.events):
            kind = "cycle"
        if not kind and t >= until.time:
            kind = "time"
        if kind:
            if kind == "closes" and setting.loads.unbonded:
                raise NotConverged(
                    f"at t = {t:.6g} the front has come back to the edge that was never glued."
                )
            log.name({"closes": "contact", "cycle": "time"}.get(kind, kind), t, front, tip)
            return _finished(log, _outcome(kind, tip, float(first)))
    raise NotConverged(
        f"{MOST_STEPS} steps came to no end, at t = {t:.6g}.", remedy="Ask for a time, or with drag."
    )


def _relaxed(
    flap: Flap, t: float, u: np.ndarray, z: np.ndarray, tol: float
) -> tuple[float, np.ndarray, np.ndarray]:
    """Let a time pass in which only the modes of short phases move: the rates are then those of motion."""
    step, _ = Integrator(flap, bool(flap.setting.mass), tol).advance(t, u, z, RELAXED)
    return step.stop, step.u[-1], step.z[-1]


def _in_new_phases(
    flap: Flap, u: np.ndarray, z: np.ndarray, degree: int
) -> tuple[Flap, np.ndarray, np.ndarray]:
    """Return the same flap in the phases that it now visits."""
    here = along(flap, u, z)
    sbar = float(u[flap.lengths].sum())

    def theta(s: np.ndarray) -> np.ndarray:
        return here(s)[:, 0]

    def spin(s: np.ndarray) -> np.ndarray:
        return here(s)[:, 3]

    return laid_out(flap.setting, degree, sbar, theta, spin if flap.setting.mass else None)


def _outcome(kind: str, tip: TipPath, first: float) -> str:
    """Return in what a run ends that was ended by some event."""
    if kind == "contact" and tip.y < LANDED and abs(tip.angle) < max(abs(first), 0.5 * math.pi):
        return "closes"
    rest = "folded" if tip.angle < FOLDED else "standing"
    return {"time": "not settled", "cycle": "flapping", "arrest": rest}.get(kind, kind)


def goes_round(events: list[Happening]) -> bool:
    """Whether the motion is as good as on its cycle, by where the tip passes an angle in one direction.

    What two passages differ by shrinks from one to the next, in the end by the same factor: the distance that
    is left is the rest of a geometric series.  It must be small beside the width of the cycle, or the motion
    might go round a place of rest that it comes nearer to.
    """
    passed = [e for e in events if e.kind == "angle"]
    if not passed:
        return False
    same = [e for e in passed if abs(e.angle - passed[-1].angle) < 0.5 * ANGLES]
    if len(same) < 5:
        return False
    places = np.array([(e.front, e.x, e.y) for e in same[-5:]])
    # Between two passages in the same direction there is one in the other.
    width, now, before = (np.abs(places[i] - places[j]).max() for i, j in ((4, 3), (4, 2), (2, 0)))
    left = now**2 / (before - now) if now < before else math.inf
    return bool(left < min(ROUND, NARROW * width))


def _earliest(flap: Flap, step: Step, setting: Setting) -> tuple[str, float] | None:
    """Return what first ends the smooth motion within a step, and when."""

    def beyond(states: np.ndarray) -> list[dict[str, float]]:
        """By how much, for everything that ends it: a run is there where one gets positive."""
        closed = CLOSED if not setting.loads.unbonded else setting.loads.unbonded + EDGE
        changes, looks = bool(setting.law.kinks or setting.loads.breaks), []
        for u, found in zip(states, excesses(flap, states), strict=True):
            length = float(u[flap.lengths].sum())
            ends = {"contact": found.sunk, "closes": closed - length, "end of rod": length - setting.length}
            looks.append(ends | ({"phases": found.most} if changes else {}))
        return looks

    times = step.start + step.length * np.append(0.0, BETWEEN)
    looks = beyond(step.at(times)[0])
    found = []
    for kind in looks[0]:
        turns = (i for i in range(len(BETWEEN)) if looks[i][kind] <= 0.0 < looks[i + 1][kind])
        if (i := next(turns, None)) is not None:
            when = _vanishing(step, lambda u, kind=kind: beyond(u[None])[0][kind], times[i], times[i + 1])  # type: ignore[misc]
            found.append((when, kind))
    if not found:
        return None
    when, kind = min(found)
    return kind, when


def _vanishing(step: Step, sign: Callable[[np.ndarray], float], early: float, late: float) -> float:
    """Return when a function of the unknowns changes its sign within a step."""
    return float(brentq(lambda t: sign(step.at(np.array([t]))[0][0]), early, late, xtol=1e-13))


def _record(log: _Log, flap: Flap, step: Step) -> Reading:
    """Keep the states within a step and at its end, and the angles that its tip passes."""
    rule = tableau(len(step.u) - 1)
    spent = step.length * rule.integrals(BETWEEN) @ flap.powers(step.u[1:], step.z[1:])
    times = step.start + step.length * BETWEEN
    states = step.at(np.append(step.start, times))
    last = _keep(log, flap, times, states[0][1:], states[1][1:], spent)

    angles = states[0][:, 0]
    for (early, before), (late, after) in pairwise(zip(np.append(step.start, times), angles, strict=True)):
        low, high = sorted((before, after))
        for passed in ANGLES * np.arange(math.ceil(low / ANGLES), math.floor(high / ANGLES) + 1):
            if before != passed:
                t = _vanishing(step, lambda u, passed=passed: float(u[0] - passed), early, late)  # type: ignore[misc]
                u = step.at(np.array([t]))[0][0]
                log.name("angle", t, float(u[flap.lengths].sum()), flap.tip(u))
    return last


def _keep(log: _Log, flap: Flap, t: np.ndarray, u: np.ndarray, z: np.ndarray, spent: np.ndarray) -> Reading:
    """Keep states, and return what they hold."""
    reading = flap.read(u, z if flap.setting.mass else flap.rate(u))
    log.store(t, reading, shapes_of(flap, u, FRACTIONS), spent)
    return reading


def comes_down(phases: tuple[Phase, ...]) -> bool:
    """Whether an arc between tip and front is lower than what is on both sides of it."""
    pieces = [phase.piece for phase in phases if phase.piece is not None]
    return any(left > here < right for left, here, right in zip(pieces, pieces[1:], pieces[2:], strict=False))


def _resolved(log: _Log) -> tuple[Track, ...]:
    """Return the part of a run that was resolved before its front was lost, if there is any."""
    if not log.times:
        return ()
    run = _finished(log, "not settled")
    known = int(np.argmax(np.append(np.abs(run.identity) > RESOLVED, True)))
    return (run.until(known),) if known > 1 else ()


def _finished(log: _Log, outcome: str) -> Track:
    theta, x, y = np.moveaxis(np.concatenate(log.shapes), -1, 0)
    # The tip is the tip: its rounding is that of a number, and not of an interpolation.
    front, *tip, kinetic, bending, separation, identity, work, drag = np.concatenate(log.readings).T
    return Track(
        t=np.concatenate(log.times),
        front=front,
        tip=TipPath(*tip),
        fraction=FRACTIONS,
        x=x,
        y=y,
        theta=theta,
        energy=Ledger(kinetic, bending, separation, work, drag, np.zeros_like(work)),
        identity=identity,
        events=tuple(log.events),
        outcome=outcome,
    )
