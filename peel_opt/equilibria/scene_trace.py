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
from ..continuation.scene_family import SceneBranch, SceneFamily, entered_branch
from ..continuation.special import EVENTS, locate
from ..model.scene import Scene
from ..model.tips import TipLoad
from ..residual.closures import Closure
from ..residual.discretisation import Discretisation
from ..residual.meshes import SCENES_TRACED
from ..residual.scene_spectral import SceneSpectral
from .assembly import WalkedSide, columns_of, special_points_of
from .branch import Branch
from .scenes import solve

#: Least amplitude of a point: in those beside a rest rounding hides what a mesh does.
LEAST = 1e-5


@dataclass(frozen=True, eq=False, repr=False)
class SceneTrace(Branch):
    """The branch of a scene, from its small states or its transition on.

    ``trace[i]`` solves for the pressure at the length of a point, as `solve` does.

    Parameters
    ----------
    scene : Scene
        What it is the branch of.
    family : SceneFamily or None
    points : tuple of Point
        What was solved; with the family missing where the branch came from another process.
    """

    scene: Scene | None = field(default=None, repr=False)
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

    def _sliced(self, which: slice) -> SceneTrace:
        sliced = super()._sliced(which)
        assert isinstance(sliced, SceneTrace)
        return replace(sliced, points=self.points[which])

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"family": None, "points": ()}  # compiled functions do not travel

    def __getitem__(self, which: int | slice) -> Any:
        if isinstance(which, slice) or self.scene is None:
            return super().__getitem__(which)
        i = range(len(self))[which]
        length, pressure = float(self.length[i]), float(self.pressure[i])
        return solve(self.scene, free="pressure", length=length, near=pressure)


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

    Raises
    ------
    InvalidInput
        If one of the others is given, or the amplitude of the branch is not the angle of its tip.
    NotConverged
        If the branch cannot be entered, or is not accurate to ``tol`` with the finest mesh.
    """
    if not isinstance(scene.tip, TipLoad):
        raise InvalidInput(
            "a branch is read by the angle of a free tip: one of a strip, or of a tip that rests on its wall,"
            " is not traced.",
            remedy="Ask for its states with solve or equilibria, one number at a time.",
        )
    if any(other is not None for other in others):
        raise InvalidInput("trace takes points= and tol= for a scene.", remedy="Give the scene its law=.")
    ratio = Closure("ratio", scene.rod.ratio)
    for mesh in SCENES_TRACED:
        family = SceneFamily(scene.bond.law, SceneSpectral(scene, mesh), ratio)
        walked = entered_branch(family)
        last = until(walked)
        along = _filled(walked, points, last)
        errors = point_errors(family, along)
        reached = float(errors.total.max())
        if reached <= tol + 4.0 * float(errors.rounding.max()):
            options = {"points": points, "tol": tol, "scene": repr(scene)}
            return _assembled(walked, along, errors.total, options, last)
    raise NotConverged(
        f"the branch of the scene is accurate to {reached:.1e} only, asked for {tol:.1e}.",
        remedy="Give a larger tol.",
    )


def _filled(walked: SceneBranch, points: int, last: float) -> list[Point]:
    """Return the points of a branch with others between them."""
    seen = [p for p in walked.points if p.scalars.A >= LEAST and p.arclength <= last]
    span = seen[-1].arclength - seen[0].arclength
    return filled(walked.family, seen, span / (points - 1))


def _assembled(
    walked: SceneBranch, along: list[Point], errors: np.ndarray, options: dict[str, Any], last: float
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
    part = WalkedSide(family, every, specials, walked.state_at, walked.ends[1])
    scene = family.scene
    return SceneTrace(
        law=scene.bond.name,
        hold="ratio",
        held=scene.rod.ratio,
        rod=scene.rod,
        **columns_of(every, family),
        arclength=np.array([p.arclength for p in every]),
        error=total,
        state=np.array([walked.state_at(p.arclength) for p in every]),
        special_points=special_points_of([part], [(part, p) for p in every], total),
        ended=walked.ends[1],
        options=options,
        scene=scene,
        family=family,
        points=tuple(every),
    )
