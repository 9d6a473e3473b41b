"""The branch of a scene as a `Branch`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..base.errors import InvalidInput, NotConverged
from ..continuation.fill import filled, point_errors
from ..continuation.points import Point
from ..continuation.scene_family import SceneBranch, SceneFamily, beside_contact, entered_branch
from ..continuation.special import EVENTS, locate
from ..model.scene import Scene
from ..residual.closures import Closure
from ..residual.discretisation import Discretisation
from ..residual.meshes import SCENES_TRACED
from ..residual.scene_spectral import SceneSpectral
from .assembly import WalkedSide, columns_of, special_points_of
from .branch import Branch

#: Detached length, over that of the plain rod's transition, beyond which a branch is not traced: where a load
#: dies out as the rod turns it goes on for ever.
FAR = 12.0

#: Points, at least, of a branch that is cut off where the finest mesh does not resolve it.
FEWEST = 8

#: Least amplitude of a point, and least gap of a folded tip as a share of the largest: in those beside a
#: rest or a contact rounding hides what a mesh does.
LEAST, NEAREST = 1e-5, 1e-5


@dataclass(frozen=True, eq=False, repr=False)
class SceneTrace(Branch):
    """The branch of a scene, from its small states or its transition on, with what was solved.

    Parameters
    ----------
    family : SceneFamily or None
    points : tuple of Point
        What was solved; with the family missing where the branch came from another process.
    """

    family: SceneFamily | None = field(default=None, repr=False)
    points: tuple[Point, ...] = field(default=(), repr=False)

    @property
    def carries_solutions(self) -> bool:
        """Whether it has what was solved at its points."""
        return self.family is not None

    def solution_at(self, i: int) -> tuple[Discretisation, np.ndarray]:
        """Return the discrete problem of a point and its solution."""
        if self.family is None:
            raise InvalidInput("this branch carries no solutions.", remedy="Trace it again.")
        return self.points[i].problem, self.points[i].x

    def _selected(self, rows: np.ndarray, cuts: tuple[int, ...]) -> SceneTrace:
        chosen = super()._selected(rows, cuts)
        assert isinstance(chosen, SceneTrace)
        return replace(chosen, points=tuple(self.points[i] for i in rows) if self.points else ())

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"family": None, "points": ()}  # compiled functions do not travel


def trace_scene(
    scene: Scene,
    points: int,
    tol: float,
    others: Sequence[object] = (),
    until: Callable[[SceneBranch], float] = lambda _: math.inf,
) -> SceneTrace:
    """Trace the branch of a scene; see `trace`, whose ``others`` a scene does not take.

    Parameters
    ----------
    scene, points, tol
        As in `trace`.
    others : sequence of object
        None, all of them.
    until : callable
        The arclength beyond which what was walked is left out.

    Returns
    -------
    SceneTrace
        It has ``ended`` "far" where its length is `FAR` times that of a plain rod's transition, and
        "unresolved" where the finest mesh is not accurate to ``tol`` beyond.

    Raises
    ------
    InvalidInput
        If one of the others is given, or the amplitude of the branch is not the angle of its tip.
    NotConverged
        If the branch cannot be entered, or is not accurate to ``tol`` where it begins.
    """
    if any(other is not None for other in others):
        raise InvalidInput("trace takes points= and tol= for a scene.", remedy="Give the scene its law=.")
    ratio = Closure("ratio", scene.rod.ratio)
    for mesh in SCENES_TRACED:
        family = SceneFamily(scene.bond.law, SceneSpectral(scene, mesh), ratio)
        walked = entered_branch(family)
        last, ended = until(walked), walked.ends[1]
        if (far := _far(walked)) < last:
            last, ended = far, "far"
        along = _filled(walked, points, last)
        errors = point_errors(family, along)
        resolved = errors.total <= tol + 4.0 * float(errors.rounding.max())
        if resolved.all():
            break
    options = {"points": points, "tol": tol, "scene": repr(scene)}
    if not resolved.all():
        kept = int(np.argmin(resolved))
        if kept < FEWEST:
            raise NotConverged(
                f"the branch of the scene is accurate to {errors.total[: FEWEST + 1].max():.1e} only where it"
                f" begins, asked for {tol:.1e}.",
                remedy="Give a larger tol.",
            )
        along, last, ended = along[:kept], along[kept - 1].arclength, "unresolved"
    return _assembled(walked, along, errors.total[: len(along)], options, last, ended)


def _tip_angles(scene: Scene, points: list[Point]) -> np.ndarray:
    """Return theta at the tip of each point, zero at the middle of a strip."""
    numbers = scene.numbers
    _, start = scene.tip_start(1.0, 1.0, numbers)
    kw = float(scene.wall.curvature_of(numbers))
    return np.array([start * p.scalars.A - kw * p.scalars.sigma for p in points])


def _tip_heights(points: list[Point]) -> np.ndarray:
    """Return y/y0 of the tip of each point, whatever its bond sees of it."""
    return np.array([p.scalars.height(p.profile.values[0, 0, 4]) for p in points])


def _far(walked: SceneBranch) -> float:
    """Return the arclength from which on a branch is too long to be traced."""
    longest = FAR * math.pi * walked.family.closure.value**-0.25
    return next((p.arclength for p in walked.points if p.scalars.sigma > longest), math.inf)


def _filled(walked: SceneBranch, points: int, last: float) -> list[Point]:
    """Return the points of a branch with others between them."""
    known = (p for p in walked.points if p.scalars.A >= LEAST and p.arclength <= last)
    seen = [p for p in known if not beside_contact(p, NEAREST)]
    span = seen[-1].arclength - seen[0].arclength
    return filled(walked.family, seen, span / (points - 1))


def _assembled(
    walked: SceneBranch,
    along: list[Point],
    errors: np.ndarray,
    options: dict[str, Any],
    last: float,
    ended: str,
) -> SceneTrace:
    family = walked.family
    folds = [f for f in walked.folds if f.point.scalars.A >= LEAST and f.point.arclength <= last]
    specials = [*folds, *locate(family, along, EVENTS)]
    known = {id(p) for p in along}
    added = [s.point for s in specials if id(s.point) not in known]
    every = sorted([*along, *added], key=lambda p: p.arclength)
    own = dict(zip(map(id, along), errors, strict=True))
    if added:
        own |= dict(zip(map(id, added), point_errors(family, added).total, strict=True))
    total = np.array([own[id(p)] for p in every])
    part = WalkedSide(family, every, specials, walked.state_at, ended)
    scene = family.scene
    return SceneTrace(
        law=scene.bond.name,
        hold="ratio",
        held=scene.rod.ratio,
        rod=scene.rod,
        **columns_of(every, family) | {"tip_u": _tip_heights(every)},
        arclength=np.array([p.arclength for p in every]),
        error=total,
        state=np.array([walked.state_at(p.arclength) for p in every]),
        special_points=special_points_of([part], [(part, p) for p in every], total),
        ended=ended,
        options=options,
        scene=scene,
        angle=_tip_angles(scene, every),
        family=family,
        points=tuple(every),
    )
