"""From a start on the right branch to a certified number: solve, estimate, refine.

Where the mesh resolves the shape, one residual on a finer mesh says how far that mesh would move
the solution, which is its error; it is solved again only where this misses the tolerance.
Elsewhere the answered number is solved for on two meshes, and their difference, divided by what
the refinement is sure to have gained, is the error of the finer one.  To either come what rounding
leaves of the last Newton update and what the rounding of the given numbers does through the
condition of the question.  Two meshes may agree in one number by chance, where the error of the
coarser changes sign, but not in all of them: the difference is taken in every scalar, each
weighted with how far the same residues would move the answer.

What is reported of the solution then are its certificate, its flags, and under which law it holds.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..base.errors import InvalidInput, NotConverged
from ..base.threads import one_thread
from ..model.bond import LINEAR, CohesiveLaw
from ..model.equations import Scalars
from ..residual import programme
from ..residual.accuracy import (
    HEIGHT_NOISE,
    SAFE,
    Response,
    can_estimate,
    certificate,
    refinement,
    response,
)
from ..residual.closures import Closing
from ..residual.collocation import Collocation
from ..residual.discretisation import Discretisation, Phases, Profile, Transcription
from ..residual.linear import Linearised
from ..residual.newton import Correction, SolvedState, correct, correct_sharply, sharper, usual
from ..residual.phases import holds_its_tip, layout
from ..residual.programme import Ipopt
from ..residual.shape import Solution
from ..residual.shooting import Shooting
from ..residual.spectral import Spectral, SpectralDiscretisation
from .closed_form import closed_form
from .question import Question
from .result import Equilibrium, Stats, verdict

#: How often a mesh may be refined before the tolerance counts as out of reach.
MOST_REFINEMENTS = 5

#: A certificate that a refinement leaves larger than this share of it is at its end.
HARDLY = 0.5

#: A first-order change of the unknowns larger than this share of them is no measure of the error yet.
LINEAR_RANGE = 1e-4

#: No refinement is believed to gain more.
MOST_GAIN = 1e4

#: Relative distance within which a state of the series is the one a profile shows.
SAME = 1e-4

ANOTHER = "Try method='spectral', which has no such limits."


@dataclass(frozen=True)
class Method:
    """What to solve with: rungs of a ladder, from the cheapest to the last resort.

    Parameters
    ----------
    transcription : Transcription or None
        None for the closed form alone.
    ipopt : Ipopt or None
        Solve the first mesh as an NLP with these options; by Newton alone if None.
    adaptive : bool
        Refine until the error meets ``tol``.  If False the answer is the one on the given
        mesh, and one refinement serves to estimate its error.
    series : tuple of int
        Orders of the closed form to try before any mesh.
    fallback : Method or None
        What to solve with where the transcription fails or misses ``tol``.
    """

    transcription: Transcription | None
    ipopt: Ipopt | None = None
    adaptive: bool = True
    series: tuple[int, ...] = ()
    fallback: Method | None = None

    @cached_property
    def on_meshes(self) -> Method:
        """The same without the closed form."""
        return replace(self, series=())


METHODS = {
    "series": Method(None, series=(12, 24, 40)),
    "spectral": Method(Spectral()),
    "collocation": Method(Collocation()),
    "shooting": Method(Shooting(), Ipopt()),
}
# Order 40 takes longer to set up than a walk along the branch.
METHODS["auto"] = Method(Spectral(), series=(12, 24), fallback=METHODS["collocation"])


def as_method(method: str | Method | Transcription) -> Method:
    """Return the method a caller named or configured."""
    if isinstance(method, Method):
        return method
    if isinstance(method, str) and method in METHODS:
        return METHODS[method]
    if isinstance(method, Shooting):
        return Method(method, Ipopt(), adaptive=False)
    if isinstance(method, Transcription):
        return Method(method, adaptive=False)
    raise InvalidInput(
        f"unknown method {method!r}.",
        remedy=f"Choose one of {', '.join(sorted(METHODS))}, or pass a configured transcription.",
    )


@dataclass(frozen=True, eq=False)
class Answer:
    """A solution with the error of its answered number, and what is known of it besides."""

    problem: Discretisation
    x: np.ndarray
    error: float
    stats: Stats
    sampled: Profile | None = None
    missed: float | None = None

    @cached_property
    def profile(self) -> Profile:
        """The fields, sampled."""
        return self.problem.profile(self.x) if self.sampled is None else self.sampled

    def certificate(self, law: CohesiveLaw) -> float:
        """How far it misses the equation that it was not solved with."""
        return certificate(law, self.profile, self.problem.phases[0]) if self.missed is None else self.missed


@dataclass(frozen=True, eq=False)
class _Started:
    """A question with the state it means: the profile to start from, in the phases of its law.

    ``solution`` is there where the profile is of a solution of this very question, ``mesh`` where it is
    of a solution of any.
    """

    posed: Question
    profile: Profile
    phases: Phases
    tol: float
    solution: SolvedState | None = None
    mesh: Transcription | None = None


@one_thread
def solve_to_tolerance(posed: Question, start: Profile | SolvedState, method: Method, tol: float) -> Answer:
    """Answer for the state that a profile shows, or that a walk has landed at, starting from it.

    Raises
    ------
    NotConverged
        If IPOPT or Newton fails.
    """
    mesh = None
    if isinstance(start, SolvedState):
        mesh = start.problem.settings
        if start.given == posed.given:
            return _climb(_Started(posed, start.profile, start.problem.phases, tol, start, mesh), method)
        start = start.profile
    law = posed.effective_law
    plan = layout(law, start, tip_free=not holds_its_tip(law, start))
    return _climb(_Started(posed, start.rephased(plan.breaks), plan.phases, tol, mesh=mesh), method)


def _climb(started: _Started, method: Method) -> Answer:
    """Answer by the first rung of a method that meets the tolerance, or by the best."""
    if method.series:
        try:
            return _summed(started, method.series)
        except NotConverged:
            if method.transcription is None:
                raise
    if method.fallback is None:
        return _on_meshes(started, method)
    try:
        first = _on_meshes(started, method)
    except NotConverged:
        return _climb(started, method.fallback)

    def missing(solved: Answer) -> float:
        return max(solved.error, solved.certificate(started.posed.effective_law))

    if missing(first) <= started.tol:
        return first
    try:
        second = _climb(started, method.fallback)
    except NotConverged:
        return first
    return min(first, second, key=missing)


def _summed(started: _Started, orders: tuple[int, ...]) -> Answer:
    """Answer by the series, if one of its states is the one of the profile."""
    law = started.posed.effective_law
    if not law.falls_straight or started.phases != law.pieces[:1]:
        raise NotConverged("the series needs the linear law and a shape within y0.", remedy=ANOTHER)
    posed, s = started.posed, started.profile.scalars
    state, reason = "spurious" if s.alpha1 > 0.0 else "lower", ""
    for wanted in (state, "middle"):
        try:
            found = closed_form(posed, wanted, orders, started.tol)
        except NotConverged as error:
            reason = reason or str(error)
            continue
        was = posed.read(s)
        if abs(posed.read(found.problem.scalars(found.x)) - was) < SAME * (1.0 + abs(was)):
            return Answer(found.problem, found.x, found.error, found.stats)
    raise NotConverged(reason or "the series has no such state.", remedy=ANOTHER)


def _on_meshes(started: _Started, method: Method) -> Answer:
    """Answer on finer and finer meshes, until error and certificate meet the tolerance.

    What rounding has ended is not refined more than once.
    """
    began = time.perf_counter()
    read, law = started.posed.read, started.posed.effective_law
    rungs = [_first_solve(started, method)]
    done: list[_Solved] = []
    looks, before, missed = 0, 0.0, math.inf
    while True:
        chosen = rungs[-1] if method.adaptive else rungs[0]
        at, form = chosen.solution.linearised, chosen.problem.form
        finer = _finer_scalars(at) if can_estimate(chosen.transcription) else None
        looks += finer is not None
        if finer is None and len(rungs) == 1:
            rungs.append(_refined_solve(started, chosen))
            continue
        own = response(at, chosen.correction.update, read)
        looks += 1
        if own.unsettled > HARDLY * started.tol and not chosen.settled:
            rungs[rungs.index(chosen)] = _settled(started, chosen)
            continue
        estimates = []
        if finer is not None:
            difference = _difference(at.tail, finer, own, read, form)
            estimates.append((SAFE * difference, difference))
        if len(rungs) > 1:
            coarse, fine = rungs[-2:]
            difference = _difference(coarse.scalars, fine.scalars, own, read, form)
            # No refinement gains more than the order: a smaller difference is luck.
            difference = max(difference, before / coarse.transcription.most_gain)
            sure = coarse.transcription.gain_at(coarse.problem, coarse.correction.x)
            gain = _gain(sure, difference, before)
            before = difference
            left = difference / (gain - 1.0) if gain > 1.0 else math.inf
            estimates.append((left * (1.0 if method.adaptive else gain), difference))
        mesh, difference = min(estimates)
        error = mesh + own.rounding
        by_rounding = error > started.tol and own.rounding > min(difference, started.tol)
        digits = _with_low_pressure(started, chosen) if by_rounding else None
        if digits is not None:
            done, rungs, before, missed = done + rungs, [digits], 0.0, math.inf
            continue
        missed, last = certificate(law, chosen.profile, started.phases[0]), missed
        if not method.adaptive or len(rungs) > MOST_REFINEMENTS:
            break
        exact = missed <= started.tol or missed > HARDLY * last
        ended = difference <= own.rounding and len(rungs) > 1
        if (error <= started.tol or ended) and exact:
            break
        rungs.append(_refined_solve(started, chosen))
    stats = Stats(
        method=repr(chosen.transcription),
        seconds=time.perf_counter() - began,
        iterations=sum(solved.iterations for solved in done + rungs),
        evaluations=sum(solved.evaluations for solved in done + rungs) + looks,
        unknowns=rungs[-1].problem.size,
        refinements=len(done + rungs) - 1,
        condition=own.condition,
    )
    problem, x = usual(chosen.problem, chosen.correction.x)
    if problem is not chosen.problem:
        return Answer(problem, x, error, stats)
    return Answer(problem, x, error, stats, chosen.profile, missed)


def _with_low_pressure(started: _Started, solved: _Solved) -> _Solved | None:
    """Solve again with all digits of a low pressure, where a length is asked; None where it gains nothing."""
    problem = sharper(solved.problem) if started.posed.asked == "length_ratio" else None
    if problem is None:
        return None
    assert isinstance(solved.problem, SpectralDiscretisation)
    start = solved.problem.in_form(solved.correction.x, problem)
    return _newton_solve(started, problem.settings, start)


def _finer_scalars(at: Linearised) -> np.ndarray | None:
    """Return the scalars that the next mesh would have, by one residual there; None where it says little."""
    step = refinement(at)
    if not float(np.abs(step).max()) < LINEAR_RANGE * (1.0 + float(np.abs(at.x).max())):
        return None
    return at.tail + step[at.problem.tail]


def _difference(
    a: np.ndarray, b: np.ndarray, own: Response, read: Callable[[Scalars], float], form: type[Scalars]
) -> float:
    """Return how far two solutions are apart in the answer: the largest that any scalar speaks of."""
    answers = [read(form.of_unknowns(*unknowns.tolist())) for unknowns in (a, b)]
    return max(abs(answers[1] - answers[0]), float((own.leverage * np.abs(b - a)).max()))


def _gain(sure: float, difference: float, before: float) -> float:
    """Factor by which the last refinement shrank the error: what is sure, or what was seen.

    Two differences show what one refinement gained; the next gains no less once a method
    converges.  A tenth of it is believed, since a difference may be small by chance.
    """
    seen = 0.1 * before / difference if difference > 0.0 else 0.0
    return min(max(sure, seen), MOST_GAIN)


@dataclass(frozen=True, eq=False)
class _Solved:
    """A converged solution on one mesh, and what it took."""

    transcription: Transcription
    solution: SolvedState
    iterations: int
    evaluations: int
    settled: bool = False

    @property
    def problem(self) -> Discretisation:
        return self.solution.problem

    @property
    def correction(self) -> Correction:
        return self.solution.correction

    @property
    def scalars(self) -> np.ndarray:
        return self.correction.x[self.problem.tail]

    @property
    def profile(self) -> Profile:
        return self.solution.profile


def _first_solve(started: _Started, method: Method) -> _Solved:
    """Solve on the method's own mesh: by IPOPT and a closing Newton step, or by Newton alone."""
    assert method.transcription is not None
    if method.ipopt is None:
        # On a coarser mesh than it was found on, a state may be another.
        mesh = (
            started.mesh
            if started.mesh is not None and _serves(started.mesh, method)
            else method.transcription
        )
        if started.solution is not None and mesh == started.mesh:
            return _Solved(mesh, started.solution, 0, 0)
        return _newton_solve(started, mesh, mesh.discretise(started.phases).pack(started.profile))
    problem, given = method.transcription.discretise(started.phases), started.posed.given
    solved = programme.solve(problem, problem.pack(started.profile), given, method.ipopt)
    if not solved.solved:
        raise NotConverged(
            f"IPOPT stopped with {solved.status} after {solved.iterations} iterations"
            f" on {method.transcription!r} with {problem.size} unknowns.",
            remedy="Try a finer mesh, or method='spectral'.",
        )
    correction = _corrected(problem, solved.x, given)
    iterations = solved.iterations + correction.iterations
    evaluations = solved.evaluations + correction.iterations
    return _Solved(method.transcription, SolvedState(problem, correction, given), iterations, evaluations)


def _serves(mesh: Transcription, method: Method) -> bool:
    """Whether a solution on a mesh is as good as one on the method's own, to start from."""
    own = method.transcription
    if isinstance(mesh, Spectral) and isinstance(own, Spectral) and method.adaptive:
        return mesh.elements == own.elements and mesh.nodes >= own.nodes
    return mesh == own


def _refined_solve(started: _Started, solved: _Solved) -> _Solved:
    """Solve on the next finer mesh, from a solution."""
    finer = solved.transcription.refined()
    start = solved.problem.prolonged(solved.correction.x, finer.discretise(started.phases))
    return _newton_solve(started, finer, start)


def _settled(started: _Started, solved: _Solved) -> _Solved:
    """Correct a solution once more: its last update was small among its unknowns, not in the answer."""
    again = _newton_solve(started, solved.transcription, solved.correction.x)
    iterations, evaluations = solved.iterations + again.iterations, solved.evaluations + again.evaluations
    return replace(again, iterations=iterations, evaluations=evaluations, settled=True)


def _newton_solve(started: _Started, transcription: Transcription, start: np.ndarray) -> _Solved:
    problem, given = transcription.discretise(started.phases), started.posed.given
    correction = _corrected(problem, start, given)
    # Each iteration evaluates the equations once.
    taken = correction.iterations
    return _Solved(transcription, SolvedState(problem, correction, given), taken, taken)


def _corrected(problem: Discretisation, start: np.ndarray, given: tuple[Closing, ...]) -> Correction:
    result = correct(problem, start, given)
    if not result.converged:
        result = correct_sharply(problem, start, given) or result
    if not result.converged:
        raise NotConverged(
            f"Newton's method did not converge on {problem.size} unknowns"
            f" (last relative update {result.step:.1e}).",
            remedy="Try method='spectral', or a finer mesh.",
        )
    return result


class Effort(NamedTuple):
    """What an answer took before it was solved for: when it was begun, and points of a branch on the way."""

    began: float
    walked: int


def certify(
    posed: Question, state: str, solved: Answer, tol: float, before: Effort | None = None
) -> Equilibrium:
    """Turn a solution into an `Equilibrium` with its certificate and flags."""
    problem, x = solved.problem, solved.x
    effective = posed.effective_law
    s = problem.scalars(x)
    profile = solved.profile
    least_angle, most_angle, lowest, highest = (
        float(s.A * end) for k in (0, 4) for end in _ends(profile.values[:, :, k], s.A)
    )
    tip, size = float(s.A * profile.values[0, 0, 4]), max(highest, -lowest)
    opened = s.beta1 / s.beta0 * highest if s.beta0 else 0.0  # u = y/y0
    noise = HEIGHT_NOISE
    if problem.phases[0].lost is None:
        # A tip that is held to the plate has no height: what it has is the error of all heights.
        noise = max(noise, min(abs(tip) / size, tol))
    within = opened <= 1.0 + HEIGHT_NOISE
    source = Solution(problem, x, effective)
    present = {
        "y > y0": opened > effective.holds_to + HEIGHT_NOISE,
        "p < 0": s.alpha < 0.0,
        "y < 0": lowest < -noise * size,
        "alpha1 > 0": s.alpha1 > 0.0,
        "overhang": max(most_angle, -least_angle) > 0.5 * math.pi,
        "tip on plate": abs(tip) <= noise * size,
        "self-contact": most_angle - least_angle > math.pi and source.shape().crosses_itself(),
    }
    missed = solved.certificate(effective)
    stats = solved.stats
    if before is not None:
        stats = replace(stats, path_points=before.walked, seconds=time.perf_counter() - before.began)
    return Equilibrium(
        rod=posed.rod,
        law=effective.name if posed.law is not None or not within else LINEAR.name,
        **({"beta0": s.beta0, "lam": s.lam} | posed.as_given),
        alpha1=s.alpha1,
        answered=posed.asked,
        error=solved.error,
        certificate=missed,
        tol=tol,
        state=state,
        status=verdict(solved.error, missed, tol),
        flags=tuple(name for name, is_so in present.items() if is_so),
        stats=stats,
        source=source,
    )


def _ends(values: np.ndarray, factor: float) -> tuple[float, float]:
    """The values that are least and largest once multiplied by a factor."""
    low, high = float(values.min()), float(values.max())
    return (low, high) if factor >= 0.0 else (high, low)
