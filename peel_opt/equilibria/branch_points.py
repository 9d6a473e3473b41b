"""Points of a branch as what was solved, and as equilibria."""

from __future__ import annotations

import ast
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ..base.errors import InvalidInput
from ..base.threads import one_thread
from ..continuation.points import Point
from ..model.bond import CohesiveLaw
from ..model.law_samples import agree
from ..model.named_laws import law_named
from ..model.scene import Scene
from ..residual.closures import chart
from ..residual.collocation import Collocation
from ..residual.discretisation import Discretisation, Transcription, held
from ..residual.linear import Linearised, gradient
from ..residual.shooting import Shooting
from ..residual.spectral import Spectral
from .branch_parts import FIRST
from .methods import Answer, certify
from .question import Question
from .result import Equilibrium, Stats
from .scenes import solve

if TYPE_CHECKING:
    from .branch import Branch

Taken = TypeVar("Taken", bound="Branch")

_TRANSCRIPTIONS: dict[str, type[Transcription]] = {c.__name__: c for c in (Spectral, Collocation, Shooting)}

#: Why a branch that was read from a file may have no states.
NO_SCENE = "the file of this branch does not hold its scene, of which a part is code of your own."


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


def under_law(branch: Taken, law: CohesiveLaw) -> Taken:
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


def equilibrium_at(branch: Branch, i: int) -> Equilibrium:
    """Return the `Equilibrium` at a point of a branch.

    Its error is that of alpha1 at its beta0 and lambda, of a rod that of p/T0 at its length: the
    distance from the branch times what the answer makes of it, which has no bound at a fold.  Its
    ``tol`` is that of the trace, carried to the answer in the same way.  That of a scene is solved for
    anew, at the length of the point.

    Raises
    ------
    InvalidInput
        If the branch carries no solutions, or was read from a file that does not hold its scene.
    """
    if isinstance(branch.scene, Scene):
        length, pressure = float(branch.length[i]), float(branch.pressure[i])
        return solve(branch.scene, free="pressure", length=length, near=pressure)
    if branch.scene is not None:
        raise InvalidInput(NO_SCENE, remedy="Trace the scene again.")
    problem, x = discretised(branch, i)
    if branch.rod is None:
        posed = Question.at_groups(law_of(branch), float(branch.beta0[i]), float(branch.lam[i]))
    else:
        posed = Question.at(branch.rod, law_of(branch), "length", float(branch.length_ratio[i]))
    assert branch.solutions is not None  # or it would not be discretised
    response = _response(posed, problem, x, branch.solutions.tangents[i])
    stats = Stats(method=branch.solutions.transcription, unknowns=problem.size)
    solved = Answer(problem, x, float(branch.error[i]) * response, stats)
    tol = float(branch.options.get("tol", 1e-8)) * response
    return certify(posed, str(branch.state[i]), solved, tol)


def _response(posed: Question, problem: Discretisation, x: np.ndarray, tangent: np.ndarray) -> float:
    """Largest error of an answer for each unit of distance from the branch.

    A point that is off by d in the scalars answers for numbers that are off too: the answer at the
    given ones is off by (grad a - sum r_j grad g_j) d, with r_j = da/dg_j.
    """
    at = Linearised.at(problem, x, *posed.given)
    wanted = gradient(posed.read, at.tail)
    with one_thread:
        left = wanted - at.adjoint(wanted)[-len(at.border) :] @ at.border
    # At T, where A = 0, the metric does not see m, and neither does the answer.
    return float(np.linalg.norm(np.linalg.lstsq(chart(at.tail)[1].T, left)[0]))
