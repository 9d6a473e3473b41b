"""From walked points to a `Branch`: numbers, errors, special points."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from ..base.errors import NotConverged
from ..continuation.family import Family
from ..continuation.fill import point_errors
from ..continuation.points import Point, scalars_of
from ..continuation.special import BRANCH_POINT, Located, place_error
from ..model.equations import Scalars
from ..model.rod import Rod
from ..residual.closures import HOLDS, held_value
from .branch import Branch
from .branch_parts import FIRST, Solutions, SpecialPoint

#: Errors of a point by which its certificate may miss zero.
IDENTITY = 100.0


@dataclass(frozen=True, eq=False)
class WalkedSide:
    """One walked side of a branch.

    Parameters
    ----------
    family : Family
    points : list of Point
    specials : list of Located
    label : callable
        Name of the state at an arclength.
    ended : str
    sign : {1, -1}
        -1 for a side that is walked against the direction of the branch.
    """

    family: Family
    points: list[Point]
    specials: list[Located]
    label: Callable[[float], str]
    ended: str
    sign: int = 1


def assemble(parts: Sequence[WalkedSide], rod: Rod | None, ended: str, options: dict[str, object]) -> Branch:
    """Join walked parts into one branch: those with sign -1 reversed, last first, then the others.

    The two sides of a branch share the point they start at.
    """
    against = [part for part in parts if part.sign < 0]
    along = [part for part in parts if part.sign > 0]
    ordered: list[tuple[WalkedSide, Point]] = []
    for part in reversed(against):
        shared = part.points[0].arclength == 0.0 and along and along[0].points[0].arclength == 0.0
        ordered += [(part, p) for p in reversed(part.points[bool(shared) :])]
    ordered += [(part, p) for part in along for p in part.points]
    family = parts[-1].family
    points = [p for _, p in ordered]
    hold = next(name for name, kind in HOLDS.items() if kind == family.closure.kind)
    error = point_errors(family, points).total
    starts = [piece.start for piece in family.law.pieces]
    return Branch(
        law=family.law.name,
        hold=hold,
        held=held_value(family.closure, hold),
        rod=rod,
        **columns_of(points, family),
        arclength=np.array([part.sign * p.arclength for part, p in ordered]),
        error=error,
        state=np.array([part.label(p.arclength) for part, p in ordered]),
        special_points=special_points_of(parts, ordered, error),
        ended=ended,
        options=dict(options),
        solutions=Solutions(
            transcription=repr(family.transcription),
            phases=tuple(
                "".join(chr(FIRST + starts.index(q.start)) for q in p.problem.phases) for p in points
            ),
            unknowns=tuple(p.x for p in points),
            tangents=tuple(p.tangent for p in points),
            law=family.law,
            mesh=family.transcription,
        ),
    )


def columns_of(points: Sequence[Point], family: Family) -> dict[str, Any]:
    """Numbers of each point."""
    s = scalars_of(points)
    tips = np.array([p.ends[0] for p in points])
    return {
        "A": s.A,
        "m": s.m,
        "sigma": s.sigma,
        "lam": s.lam,
        "tip_u": s.height(tips) if s.beta0.all() else np.full(len(points), math.nan),
        "certificate": family.certificates(points),
        "iterations": np.array([p.iterations for p in points]),
    }


def special_points_of(
    parts: Sequence[WalkedSide], ordered: list[tuple[WalkedSide, Point]], errors: np.ndarray
) -> tuple[SpecialPoint, ...]:
    """Describe all special points in the order of the branch."""
    place = {id(p): i for i, (_, p) in enumerate(ordered)}

    def described(s: Located, error: float) -> SpecialPoint:
        return describe(s.kind, s.status, s.bracket, place[id(s.point)], s.point.scalars, error)

    specials = [(part, s) for part in parts for s in part.specials]
    kind, tip_angle = BRANCH_POINT
    # A tip angle that is zero exactly is at its place, if only the mesh resolves it.
    starts = (
        (part, Located(kind, p, (0.0, 0.0), tip_angle, 0.0 if p.errors else math.nan))
        for part, p in ordered
        if p.scalars.A == 0.0
    )
    found = [
        described(s, float(errors[place[id(s.point)]]) + place_error(part.family, s))
        for part, s in [*specials, *islice(starts, 1)]
    ]
    return tuple(sorted(found, key=lambda p: p.index))


def describe(
    kind: str,
    status: str,
    bracket: tuple[float, float],
    index: int,
    s: Scalars,
    error: float = math.inf,
) -> SpecialPoint:
    """Return a special point with the numbers of its solution."""
    P = s.pressure_ratio if s.beta0 else math.nan
    return SpecialPoint(kind, status, bracket, index, s.beta0, s.lam, s.alpha1, P, s.sigma, error)


def require_identity(branch: Branch, within: float) -> None:
    """Raise where a point is no solution under its law, whatever two meshes agree on."""
    # The metric holds alpha1/(1 + beta0), the certificate p/T0; the tip height has an error too,
    # which grows with it.
    scale = np.divide(1.0 + branch.beta0, branch.beta0, out=np.ones(len(branch)), where=branch.beta0 > 0.0)
    size = scale * np.fmax(1.0, np.abs(branch.pressure_ratio))  # which is no number at beta0 = 0
    misses = ~(branch.certificate <= IDENTITY * within * size)  # also what is not a number
    if np.any(misses):
        i = int(np.argmax(np.where(misses, branch.certificate, 0.0)))
        raise NotConverged(
            f"at p/T0 = {branch.pressure_ratio[i]:.6g}, tip angle {branch.tip_angle[i]:.4g}, the branch"
            f" leaves the plate at an angle, or misses p = Phi(y_tip)/y_tip, by {branch.certificate[i]:.1e},"
            " though two meshes agree.",
            remedy="Trace it with more points, or with a finer mesh.",
        )
