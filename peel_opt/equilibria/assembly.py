"""From walked points to a `Branch` and back: numbers, errors, special points, shapes."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice
from typing import Any

import numpy as np

from ..base.errors import InvalidInput, NotConverged
from ..base.threads import one_thread
from ..continuation.family import Family
from ..continuation.fill import point_errors
from ..continuation.points import Point
from ..continuation.special import BRANCH_POINT, Located, place_error
from ..model.bond import CohesiveLaw
from ..model.equations import Scalars
from ..model.law_samples import agree
from ..model.named_laws import law_named
from ..model.rod import Rod
from ..residual.arclength import chart
from ..residual.certificate import certificate
from ..residual.closures import HOLDS, held_value, rows
from ..residual.discretisation import Discretisation, Transcription, held
from ..residual.rounding import adjoint, scalar_gradient
from ..residual.transcriptions import Collocation, Shooting, Spectral
from .branch import Branch
from .branch_parts import Solutions, SpecialPoint
from .certify import report
from .methods import Answer
from .posed import Posed
from .result import Equilibrium, Stats

#: Errors of a point by which its certificate may miss zero.
IDENTITY = 100.0


@dataclass(frozen=True, eq=False)
class Part:
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


def assemble(parts: Sequence[Part], rod: Rod | None, ended: str, options: dict[str, object]) -> Branch:
    """Join walked parts into one branch: those with sign -1 reversed, last first, then the others.

    The two sides of a branch share the point they start at.
    """
    against = [part for part in parts if part.sign < 0]
    along = [part for part in parts if part.sign > 0]
    ordered: list[tuple[Part, Point]] = []
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
        **_columns(points, family),
        arclength=np.array([part.sign * p.arclength for part, p in ordered]),
        error=error,
        state=np.array([part.label(p.arclength) for part, p in ordered]),
        special_points=_special_points(parts, ordered, error),
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


def _columns(points: Sequence[Point], family: Family) -> dict[str, Any]:
    """Numbers of each point."""
    scalars = [p.scalars for p in points]
    tips = [s.A * p.profile.values[0, 0, 4] for s, p in zip(scalars, points, strict=True)]
    over = [s.beta1 / s.beta0 if s.beta0 else math.nan for s in scalars]
    return {
        "A": np.array([s.A for s in scalars]),
        "m": np.array([s.m for s in scalars]),
        "sigma": np.array([s.sigma for s in scalars]),
        "lam": np.array([s.lam for s in scalars]),
        "tip_u": np.array(tips) * np.array(over),
        "certificate": np.array(
            [certificate(family.law, p.profile, tip_free=family.tip_free) for p in points]
        ),
        "iterations": np.array([p.iterations for p in points]),
    }


def _special_points(
    parts: Sequence[Part], ordered: list[tuple[Part, Point]], errors: np.ndarray
) -> tuple[SpecialPoint, ...]:
    """Describe all special points in the order of the branch."""
    place = {id(p): i for i, (_, p) in enumerate(ordered)}

    def described(s: Located, error: float) -> SpecialPoint:
        return describe(s.kind, s.status, s.bracket, place[id(s.point)], s.point.scalars, error)

    specials = [(part, s) for part in parts for s in part.specials]
    kind, tip_angle = BRANCH_POINT
    starts = ((part, Located(kind, p, (0.0, 0.0), tip_angle)) for part, p in ordered if p.scalars.A == 0.0)
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


#: How pieces of a law are counted in texts: from "0" on, through ASCII.
FIRST = ord("0")

_TRANSCRIPTIONS: dict[str, type[Transcription]] = {c.__name__: c for c in (Spectral, Collocation, Shooting)}


def law_of(branch: Branch) -> CohesiveLaw:
    """Return the law a branch was traced with.

    Raises
    ------
    InvalidInput
        If the branch comes from a file and the law was the user's own.
    """
    if branch.solutions is not None and branch.solutions.law is not None:
        return branch.solutions.law
    named = law_named(branch.law)
    if named is None or not _may_be(named, branch):
        raise InvalidInput(
            f"the law {branch.law!r} is not stored with its branch.",
            remedy="Read the branch with Branch.load(path, law=...), or trace it again.",
        )
    return named


def under_law(branch: Branch, law: CohesiveLaw) -> Branch:
    """Return a branch that was read from a file with the law it was traced with.

    Raises
    ------
    InvalidInput
        If it was traced with another law.
    """
    if branch.solutions is None or branch.solutions.law is not None:
        return branch
    if not _may_be(law, branch):
        raise InvalidInput(
            f"the branch was traced with another law than this {law.name!r}.",
            remedy=f"Give the {branch.law!r} it was traced with, with the same kinks and formulas.",
        )
    return replace(branch, solutions=replace(branch.solutions, law=law))


def _may_be(law: CohesiveLaw, branch: Branch) -> bool:
    """Whether a branch may have been traced with a law, by what its file says of it."""
    if branch.solutions is None:
        return law.name == branch.law
    if stored := branch.solutions.law_samples:
        return agree(law, stored)
    visited = max((ord(digit) - FIRST for phases in branch.solutions.phases for digit in phases), default=0)
    return law.name == branch.law and visited < len(law.pieces)


def tip_is_free(branch: Branch) -> bool:
    """Whether the tip leaves the plate along a branch; along those of even modes it stays there."""
    return int(branch.options.get("mode", 1)) % 2 == 1


def discretised(branch: Branch, i: int) -> tuple[Discretisation, np.ndarray]:
    """Return the discrete problem and its solution at a point of a branch."""
    if branch.solutions is None:
        raise InvalidInput("this branch carries no solutions.", remedy="Trace it again.")
    pieces = law_of(branch).pieces
    phases = tuple(pieces[ord(digit) - FIRST] for digit in branch.solutions.phases[i])
    if not tip_is_free(branch):
        phases = held(phases)
    return transcription_of(branch).discretise(phases), branch.solutions.unknowns[i]


def walked(branch: Branch) -> list[Point]:
    """Return the points of a branch as those of a walk."""
    pairs = [discretised(branch, i) for i in range(len(branch))]
    assert branch.solutions is not None
    together = zip(pairs, branch.solutions.tangents, branch.arclength.tolist(), strict=True)
    return [Point(problem, x, tangent, arclength, 0) for (problem, x), tangent, arclength in together]


def transcription_of(branch: Branch) -> Transcription:
    """Return the transcription a branch was traced with.

    Raises
    ------
    InvalidInput
        If the branch comes from a file and the transcription was the user's own.
    """
    if branch.solutions is None:
        raise InvalidInput("this branch carries no solutions.", remedy="Trace it again.")
    return branch.solutions.mesh or _transcription_from(branch.solutions.transcription)


@lru_cache(maxsize=32)
def _transcription_from(text: str) -> Transcription:
    """Read a transcription back from its ``repr``, without evaluating it."""
    try:
        call = ast.parse(text, mode="eval").body
        assert isinstance(call, ast.Call)
        assert isinstance(call.func, ast.Name)
        settings = {str(k.arg): ast.literal_eval(k.value) for k in call.keywords}
        return _TRANSCRIPTIONS[call.func.id](**settings)
    except (SyntaxError, AssertionError, KeyError, TypeError, ValueError) as error:
        raise InvalidInput(
            f"the transcription {text!r} is none of the package's, and not stored with its branch.",
            remedy="Trace it again.",
        ) from error


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


def equilibrium_at(branch: Branch, i: int) -> Equilibrium:
    """Return the `Equilibrium` at a point of a branch.

    Its error is that of alpha1 at its beta0 and lambda, of a rod that of p/T0 at its length: the
    distance from the branch times what the answer makes of it, which has no bound at a fold.  Its
    ``tol`` is that of the trace, carried to the answer in the same way.
    """
    problem, x = discretised(branch, i)
    if branch.rod is None:
        posed = Posed.at_groups(law_of(branch), float(branch.beta0[i]), float(branch.lam[i]))
    else:
        posed = Posed.at_length(branch.rod, law_of(branch), float(branch.length_ratio[i]))
    assert branch.solutions is not None  # or it would not be discretised
    response = _response(posed, problem, x, branch.solutions.tangents[i])
    stats = Stats(method=branch.solutions.transcription, unknowns=problem.size)
    solved = Answer(problem, x, float(branch.error[i]) * response, stats)
    tol = float(branch.options.get("tol", 1e-8)) * response
    return report(posed, str(branch.state[i]), solved, tol)


def _response(posed: Posed, problem: Discretisation, x: np.ndarray, tangent: np.ndarray) -> float:
    """Largest error of an answer for each unit of distance from the branch.

    A point that is off by d in the scalars answers for numbers that are off too: the answer at the
    given ones is off by (grad a - sum r_j grad g_j) d, with r_j = da/dg_j.
    """
    wanted = scalar_gradient(posed.read, x[-4:])
    _, given = rows(*posed.given)(x[-4:])
    _, jacobian = problem.linearise(x)
    gradient = np.zeros(len(x))
    gradient[-4:] = wanted
    with one_thread:
        response, _ = adjoint(jacobian, given, gradient, x)
    left = wanted - response[-2:] @ given
    # At T, where A = 0, the metric does not see m, and neither does the answer.
    return float(np.linalg.norm(np.linalg.lstsq(chart(x[-4:])[1].T, left)[0]))
