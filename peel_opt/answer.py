"""From a start on the right branch to a certified number: solve, refine, estimate.

The answered number is solved for on successively finer meshes.  The difference between two
meshes, divided by what the refinement is sure to have gained, is the error of the finer one;
to it come what rounding leaves of the last Newton update and what the rounding of the given
numbers does through the condition of the question.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from . import nlp
from .closures import Closure, sensitivity_to_given
from .elastica import PI4, Scalars
from .errors import InvalidInput, NotConverged
from .newton import Correction, correct
from .nlp import Ipopt
from .result import Stats
from .transcription import Collocation, Shooting, Spectral
from .transcription.base import Discretisation, Phases, Profile, Transcription

EPS = float(np.finfo(float).eps)

#: How often a mesh may be refined before the tolerance counts as out of reach.
MOST_REFINEMENTS = 5


@dataclass(frozen=True)
class Method:
    """A transcription, how its equations are solved first, and whether it may refine.

    Parameters
    ----------
    transcription : Transcription
    ipopt : Ipopt or None
        Solve the first mesh as an NLP with these options; by Newton alone if None.
    adaptive : bool
        Refine until the error meets ``tol``.  If False the answer is the one on the given
        mesh, and one refinement serves to estimate its error.
    """

    transcription: Transcription
    ipopt: Ipopt | None = None
    adaptive: bool = True


METHODS = {
    "shooting": Method(Shooting(), Ipopt()),
    "spectral": Method(Spectral()),
    "collocation": Method(Collocation()),
}
METHODS["auto"] = METHODS["shooting"]


def as_method(method: str | Method | Transcription) -> Method:
    """Return the method a caller named or configured."""
    if isinstance(method, Method):
        return method
    if isinstance(method, Shooting):
        return Method(method, Ipopt(), adaptive=False)
    if isinstance(method, Transcription):
        return Method(method, adaptive=False)
    if isinstance(method, str) and method in METHODS:
        return METHODS[method]
    raise InvalidInput(
        f"unknown method {method!r}.",
        remedy=f"Choose one of {', '.join(sorted(METHODS))}, or pass a configured transcription.",
    )


#: The answered number as a function of the scalars.
ANSWERS = {
    "pressure_ratio": lambda s: s.pressure_ratio,
    "length_ratio": lambda s: s.sigma,
    "alpha1": lambda s: s.alpha1,
}


@dataclass(frozen=True, eq=False)
class Answer:
    """A solution with the error of its answered number."""

    problem: Discretisation
    x: np.ndarray
    error: float
    stats: Stats


class _Read(Protocol):
    def __call__(self, scalars: Scalars) -> float: ...


def answer(
    profile: Profile,
    phases: Phases,
    given: tuple[Closure, Closure],
    asked: str,
    method: Method,
    tol: float,
) -> Answer:
    """Solve for the number ``asked``, starting from a profile with these phases.

    Raises
    ------
    NotConverged
        If IPOPT or Newton fails.
    """
    began = time.perf_counter()
    read = ANSWERS[asked]
    coarse = _first_solve(method, phases, profile, given)
    iterations = coarse.iterations
    refinements = 0
    while True:
        refinements += 1
        fine = _newton_solve(coarse.transcription.refined(), phases, coarse.profile, given)
        iterations += fine.iterations
        difference = abs(read(fine.scalars) - read(coarse.scalars))
        gain = coarse.transcription.sure_gain
        chosen = fine if method.adaptive else coarse
        error = difference / (gain - 1.0) * (1.0 if method.adaptive else gain)
        noise, condition = _noise(chosen, given, read)
        if not method.adaptive or error + noise <= tol:
            break
        if difference <= noise or refinements == MOST_REFINEMENTS:
            break
        coarse = fine
    stats = Stats(
        method=repr(chosen.transcription),
        seconds=time.perf_counter() - began,
        iterations=iterations,
        unknowns=fine.problem.size,
        refinements=refinements,
        condition=condition,
    )
    return Answer(chosen.problem, chosen.correction.x, error + noise, stats)


@dataclass(frozen=True, eq=False)
class _Solved:
    """A converged solution on one mesh."""

    transcription: Transcription
    problem: Discretisation
    correction: Correction
    iterations: int

    @property
    def scalars(self) -> Scalars:
        return self.problem.scalars(self.correction.x)

    @cached_property
    def profile(self) -> Profile:
        return self.problem.profile(self.correction.x)


def _first_solve(method: Method, phases: Phases, profile: Profile, given: tuple[Closure, ...]) -> _Solved:
    """Solve on the method's own mesh: by IPOPT and a closing Newton step, or by Newton alone."""
    if method.ipopt is None:
        return _newton_solve(method.transcription, phases, profile, given)
    problem = method.transcription.discretise(phases)
    programme = nlp.solve(problem, problem.pack(profile), given, method.ipopt)
    if not programme.solved:
        raise NotConverged(
            f"IPOPT stopped with {programme.status} after {programme.iterations} iterations"
            f" on {method.transcription!r} with {problem.size} unknowns.",
            remedy="Try a finer mesh, or method='spectral'.",
        )
    correction = _corrected(problem, programme.x, given)
    return _Solved(method.transcription, problem, correction, programme.iterations + correction.iterations)


def _newton_solve(
    transcription: Transcription, phases: Phases, profile: Profile, given: tuple[Closure, ...]
) -> _Solved:
    problem = transcription.discretise(phases)
    correction = _corrected(problem, problem.pack(profile), given)
    return _Solved(transcription, problem, correction, correction.iterations)


def _corrected(problem: Discretisation, start: np.ndarray, given: tuple[Closure, ...]) -> Correction:
    result = correct(problem, start, given)
    if not result.converged:
        raise NotConverged(
            f"Newton's method did not converge on {problem.size} unknowns"
            f" (last relative update {result.step:.1e}).",
            remedy="Try method='spectral', or a finer mesh.",
        )
    return result


def _noise(solved: _Solved, given: tuple[Closure, ...], read: _Read) -> tuple[float, float]:
    """Return what rounding does to the answer, and the condition of the question.

    The condition is the largest derivative of the answer with respect to a given number
    other than the rod's.
    """
    result = solved.correction
    assert result.solve is not None
    n, k = solved.problem.size, len(given)
    right = np.zeros((n, k))
    right[n - k :] = -sensitivity_to_given(given, result.x[-4:])
    responses = result.solve(right)[-4:]
    gradient = _gradient(read, result.x[-4:])
    derivatives = np.abs(gradient @ responses)
    update = abs(float(gradient @ result.update[-4:]))
    # p/T0 enters as 1 - p/T0 and lambda as pi^4 + lambda: their rounding is that of the larger.
    terms = {"pressure": 1.0, "lam": PI4}
    sizes = np.array([max(abs(c.value), terms.get(c.kind, 0.0)) for c in given])
    noise = 4.0 * update + 2.0 * EPS * (abs(read(solved.scalars)) + float(derivatives @ sizes))
    asked = [d for d, c in zip(derivatives, given, strict=True) if c.kind != "ratio"]
    return noise, float(max(asked))


def _gradient(read: _Read, scalars: np.ndarray) -> np.ndarray:
    """Gradient of the answered number, by complex steps."""
    h = 1e-30
    return np.array([read(Scalars(*(scalars + 1j * h * e))).imag / h for e in np.eye(4)])
