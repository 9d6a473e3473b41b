"""How an edge that was never glued opens: its pressure against its detached length, from rest to the snap."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

import numpy as np

from ..base.checks import whole
from ..base.drawing import Pictured
from ..base.errors import NoEquilibrium, NotConverged
from ..base.records import Column, Schema, Stored, Table, array, entries
from ..base.threads import one_thread
from ..continuation.scene_family import SceneBranch
from ..model.bond import CohesiveLaw
from ..model.rod import Rod, Units, rod_from
from ..model.scene import Scene
from ..residual.closures import Closure
from ..residual.discretisation import Profile
from ..residual.meshes import SNAPS
from ..residual.scene_spectral import SceneDiscretisation
from .unbonded import flawed, loaded, loading, snap_of, touching_stretch

#: Why an edge that does not snap is not followed further, in words.
ENDS = {
    "strength": ", where the bond itself fails",
    "contact": ", where its tip comes back to the plate",
}


@dataclass(frozen=True, eq=False)
class LoadingCurve(Pictured, Stored):
    """The states of an edge without glue as the pressure rises, in the units of its rod.

    Parameters
    ----------
    rod : Rod
    flaw : float
        Length without glue [m].
    ended : str
        "snap", where the last point is the maximum of the pressure, beyond which there is no state to go on
        to.  Otherwise the edge grows stably to the last point: "strength", where p = T0 and the bond itself
        fails; "contact", where its tip comes back to the plate; or what kept it from being
        followed further.
    pressure, length, tip_angle, tip_height : ndarray, shape (n,)
        p [Pa], detached length [m], theta at the tip [rad] and its height [m], in order from rest on.
    error : ndarray, shape (n,)
        Largest error of p/T0, sbar/eta and y_tip/eta at the tip angle of the point.
    certificate : ndarray, shape (n,)
        By how much the identity p y_tip = Phi(y(a)) is missed, over T0 eta.
    """

    rod: Rod
    flaw: float
    ended: str
    pressure: np.ndarray
    length: np.ndarray
    tip_angle: np.ndarray
    tip_height: np.ndarray
    error: np.ndarray
    certificate: np.ndarray

    schema: ClassVar[Schema] = Schema("peel_opt loading", 1)

    def __len__(self) -> int:
        return len(self.pressure)

    @property
    def outcome(self) -> str:
        """What becomes of the edge, in words."""
        unit = Units.of(self.rod)
        where = f"p = {self.pressure[-1]:.6g} {unit.pressure}, sbar = {self.length[-1]:.6g} {unit.length}"
        if self.ended == "snap":
            return f"snaps at {where}"
        return f"grows stably up to {where}{ENDS.get(self.ended, f' ({self.ended})')}"

    def _head(self) -> dict[str, Any]:
        return {"flaw": self.flaw, "ended": self.ended, **Units.of(self.rod).rod(self.rod)}

    def _arrays(self) -> dict[str, np.ndarray]:
        return {name: getattr(self, name) for name in ARRAYS}

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Self:
        rod, shape = rod_from(head), array(arrays, "pressure").shape
        if rod is None:
            raise ValueError("it has no rod")
        own: dict[str, Any] = {**entries(head, float | int, "flaw"), **entries(head, str, "ended")}
        own |= {name: array(arrays, name, "f", shape) for name in ARRAYS}
        return cls(rod, **own)

    def _table(self) -> Table:
        units = Units.of(self.rod)
        named = {"pressure": units.pressure, "length": units.length, "tip_angle": "rad"}
        named |= {"tip_height": units.length, "error": "", "certificate": ""}
        columns = {name: Column(getattr(self, name), unit) for name, unit in named.items()}
        return Table(self.schema.stamped(self._head()).items(), columns)

    def __repr__(self) -> str:
        flaw = f"{self.flaw:.6g} {Units.of(self.rod).length}"
        return f"LoadingCurve of {len(self)} points: an edge without glue on {flaw} {self.outcome}"


#: By how much the last state of a curve is short of the pressure at which the tip comes down, as a share of
#: it: there it would be a crossing.
SHORT_OF_TOUCH = 3e-4

#: Steps in pressure from where a walk stopped short of it.
STEPS = 24

#: Its columns.
ARRAYS = tuple(f.name for f in fields(LoadingCurve) if f.type == "np.ndarray")


@one_thread
def loading_curve(
    rod: Rod, flaw: float, *, law: str | CohesiveLaw = "auto", points: int = 40
) -> LoadingCurve:
    """Follow an edge without glue as the pressure under it rises, from rest to where it snaps.

    The points are evenly spaced in the square root of the tip angle, with which the front begins to move;
    in the tip angle the states are smooth also at the snap.

    Parameters
    ----------
    rod : Rod
    flaw : float
        Length a from the tip that was never glued [m].
    law : str or CohesiveLaw
        As in `length_given_pressure`.
    points : int
        How many, at rest and at the end included.

    Returns
    -------
    LoadingCurve

    Raises
    ------
    NotConverged
        If the states of this edge could not be followed so far.

    Examples
    --------
    >>> loading_curve(Rod.from_ratio(1.0), 1.0).outcome
    'snaps at p = 0.353551 T0, sbar = 2.86679 eta'
    """
    scene, points = flawed(rod, flaw, law), whole("points", points, 2)
    branch = loading(scene, SNAPS[0])
    try:
        last, ended = snap_of(branch, scene).point.profile, "snap"
    except NoEquilibrium:
        last, ended = _end(branch)
    end = last.scalars.A
    angles = end * np.linspace(0.0, 1.0, points)[1:] ** 2
    rows = [_solved(scene, _start(branch, A), Closure("amplitude", A)) for A in angles[:-1]]
    # Where the tip comes down its angle stands nearly still, and the pressure tells the states apart.
    down = ended == "contact"
    at_end = Closure("pressure", _pressed_down(scene)) if down else Closure("amplitude", end)
    rows.append(_solved(scene, _towards(scene, last, at_end) if down else last, at_end))
    rest = (0.0, scene.numbers["unbonded"], 0.0, 0.0, 0.0, 0.0)
    P, sigma, A, y, error, certificate = np.array([rest, *rows]).T
    return LoadingCurve(
        rod,
        flaw=rod.length(scene.numbers["unbonded"]),
        ended=ended,
        pressure=rod.adhesion_strength * P,
        length=rod.eta * sigma,
        tip_angle=0.0 - A,
        tip_height=rod.eta * y,
        error=error,
        certificate=certificate,
    )


def _end(branch: SceneBranch) -> tuple[Profile, str]:
    """Return the last state of an edge that grows stably, and what ends its growth.

    A walk may step over the place where the tip comes down, and stop beyond or short of it.
    """
    down = _pressed_down(branch.family.scene)
    with suppress(NotConverged):
        if found := branch.candidates(Closure("pressure", min(down, 1.0))):
            return found[0].profile, "contact" if down < 1.0 else "strength"
    last = branch.points[-1]
    if math.pi < last.scalars.A:  # before it the tip has come down
        last = next((p for p in branch.points[::-1] if p.scalars.pressure_ratio < down), last)
        return last.profile, "contact"
    return last.profile, branch.ends[1]


def _pressed_down(scene: Scene) -> float:
    """Return the p/T0 up to which an edge is followed that grows until its tip comes down."""
    return float((1.0 - SHORT_OF_TOUCH) * (touching_stretch() / scene.numbers["unbonded"]) ** 3)


def _towards(scene: Scene, start: Profile, end: Closure) -> Profile:
    """Return a state nearer to a pressure, in steps; that itself if it is not far."""
    family, profile = loaded(scene, SNAPS[0]), start
    share = end.value / start.scalars.pressure_ratio
    for P in end.value * share ** np.linspace(-1.0, 0.0, STEPS + 1)[1:-1]:
        solved = family.solve(profile, Closure("pressure", float(P)))
        if solved is not None:
            profile = solved[0].profile(solved[1].x)
    return profile


def _start(branch: SceneBranch, A: float) -> Profile:
    """Return the first state of a branch with a tip angle."""
    return branch.candidates(Closure("amplitude", A))[0].profile


def _solved(scene: Scene, start: Profile, held: Closure) -> tuple[float, ...]:
    """Return p/T0, sbar/eta, A, y_tip/eta, error and certificate of the state at an angle or a pressure."""
    found = []
    for mesh in SNAPS:
        solved = loaded(scene, mesh).solve(start, held)
        if solved is None:
            raise NotConverged(
                f"the state at a tip angle of {-start.scalars.A:.4g} rad was lost.",
                remedy="Give another number of points.",
            )
        problem, x = solved[0], solved[1].x
        assert isinstance(problem, SceneDiscretisation)
        s, (tip, _, _) = problem.scalars(x), problem.ends(x)
        found.append(np.array([s.pressure_ratio, s.sigma, tip.y, s.A]))
        missed = problem.certificate(x)
    P, sigma, y, A = (float(v) for v in found[-1])
    return P, sigma, A, y, float(np.abs(found[-1] - found[0]).max()), missed
