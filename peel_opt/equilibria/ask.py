"""The questions: pressure given length, length given pressure, and the paper's dual problem."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..base.checks import positive
from ..base.errors import NotCertified, NotConverged, PeelOptError
from ..base.threads import one_thread
from ..model.bond import CohesiveLaw
from ..model.rod import Rod
from ..residual.discretisation import Transcription
from ..residual.newton import SolvedState
from .closed_form import closed_form
from .methods import Answer, Effort, Method, as_method, certify, solve_to_tolerance
from .question import Question, about_a_rod
from .result import Equilibrium
from .select import THROUGH, SelectionWalk, far_from, select
from .unfolded import seeded

if TYPE_CHECKING:
    from ..model.scene import Scene

#: Share of its size by which an answer may differ, beyond its error, from that of the walk.
FAITHFUL = 0.05


def pressure_given_length(
    rod: Rod | Scene,
    length: float,
    *,
    law: str | CohesiveLaw = "auto",
    state: str | None = None,
    near: float | Equilibrium | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    throw: bool = True,
) -> Equilibrium:
    """Pressure that holds a detached length in equilibrium.

    Parameters
    ----------
    rod : Rod or Scene
        A scene that is not the paper's has its own law, is solved in the spectral form, and may be "lifted".
    length : float
        Detached length sbar [m].
    law : {"auto", "linear", "cohesive"} or CohesiveLaw
        "auto" is law (8): reported as "linear" where the whole shape stays within y0 and
        the two agree exactly.
    state : {"unfolded", "middle", "lower", "folded"}, optional
        Default: the unfolded state of lowest pressure.
    near : float or Equilibrium, optional
        Pick the state whose pressure [Pa] is nearest.
    method : str, Method or Transcription
        "series", "spectral", "collocation" or "shooting" (multiple shooting by IPOPT); "auto"
        takes the cheapest that meets ``tol``.  A configured object such as
        ``Shooting(intervals=24, integrator="rk4")`` is used as it is.
    tol : float
        Largest error of p/T0, and largest certificate, of a certified answer.
    throw : bool
        If False, a failure comes back as an `Equilibrium` whose ``status`` and ``message`` tell.

    Returns
    -------
    Equilibrium

    Raises
    ------
    InvalidInput
        If an argument cannot be meant.
    NoEquilibrium
        If no such state has this length; ``nearest`` is a length [m] that has one.
    AmbiguousState
        If several states fit and ``near`` is not given.
    OutOfRange, NotConverged, NotCertified
        If the answer is out of reach.

    Examples
    --------
    >>> rod = Rod.from_ratio(1.0)
    >>> round(pressure_given_length(rod, 3.2).pressure_ratio, 7)
    0.3687926
    """
    return ask_about(
        rod, "length", length, law=law, state=state, near=near, method=method, tol=tol, throw=throw
    )


def length_given_pressure(
    rod: Rod | Scene,
    pressure: float,
    *,
    law: str | CohesiveLaw = "auto",
    state: str | None = None,
    near: float | Equilibrium | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    throw: bool = True,
) -> Equilibrium:
    """Detached length that a pressure holds in equilibrium.

    The length is free and closed by the Weierstrass-Erdmann condition theta'(sbar) = 0, (49).

    Parameters
    ----------
    rod : Rod or Scene
    pressure : float
        p [Pa], between the minimum pressure of the rod and T0.
    law, method, throw
        As in `pressure_given_length`.
    state : {"unfolded", "middle", "lower", "folded"}, optional
        Default: the unfolded state, which is unique.
    near : float or Equilibrium, optional
        Pick the state whose length [m] is nearest.
    tol : float
        Largest error of sbar/eta, and largest certificate, of a certified answer.

    Returns
    -------
    Equilibrium

    Raises
    ------
    InvalidInput, NoEquilibrium, AmbiguousState, OutOfRange, NotConverged, NotCertified
        As in `pressure_given_length`; ``nearest`` is a pressure [Pa].

    Examples
    --------
    >>> round(length_given_pressure(Rod.from_ratio(1.0), 0.8).length_ratio, 9)
    3.036804006
    """
    return ask_about(
        rod, "pressure", pressure, law=law, state=state, near=near, method=method, tol=tol, throw=throw
    )


def equilibrium(
    *,
    beta0: float,
    lam: float | None = None,
    beta1: float | None = None,
    law: str | CohesiveLaw = "linear",
    state: str | None = None,
    near: float | Equilibrium | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    throw: bool = True,
) -> Equilibrium:
    """Solve the paper's dual problem: alpha1 at given (beta0, lambda) or (beta0, beta1).

    Parameters
    ----------
    beta0 : float
        (sbar/eta)^3 >= 0; at 0 only the linear law has a meaning.
    lam, beta1 : float
        One of them; beta1 = pi^4 + lam > 0.  Near T give ``lam``: beta1 has lost its digits.
    law : {"linear", "cohesive", "auto"} or CohesiveLaw
    state : {"unfolded", "middle", "lower", "folded", "spurious"}, optional
        Labels are those of the rod r = beta1/beta0^(4/3); "spurious" is alpha1 > 0.
        Default: the unfolded state of lowest pressure.
    near : float or Equilibrium, optional
        Pick the state whose alpha1 is nearest.
    method, throw
        As in `pressure_given_length`.
    tol : float
        Largest error of alpha1, and largest certificate, of a certified answer.

    Returns
    -------
    Equilibrium
        Without a rod: lengths in units of sbar, forces in k/sbar^2.

    Raises
    ------
    InvalidInput, NoEquilibrium, AmbiguousState, OutOfRange, NotConverged, NotCertified
        As in `pressure_given_length`; ``nearest`` is a value of lambda.

    Examples
    --------
    >>> round(equilibrium(beta0=4, lam=1.0).alpha1, 8)
    -4.43540699
    """

    def ask() -> Equilibrium:
        question = Question.of_groups(beta0, lam, beta1, law=law, state=state, near=near)
        return solve_question(question, method, tol)

    return _guarded(ask, None, "alpha1", tol, throw)


def ask_about(
    subject: Rod | Scene,
    given: str,
    value: float,
    *,
    law: str | CohesiveLaw = "auto",
    state: str | None = None,
    near: float | Equilibrium | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    throw: bool = True,
) -> Equilibrium:
    """Answer what a number asks for that is given of a rod or of a scene, one of `ASKS`.

    Parameters
    ----------
    subject : Rod or Scene
        The paper's scene is its rod.
    given : str
        "length", "pressure" or, of a rod, another key of `ASKS`.
    value : float
        In the rod's units.
    law, state, near, method, tol, throw
        As in `pressure_given_length`; ``near`` in the units of what is asked for.

    Returns
    -------
    Equilibrium
    """
    asked = about_a_rod(given).asked

    def ask() -> Equilibrium:
        rod: Any = subject
        bond = law
        if not isinstance(subject, Rod):  # for which nothing of scenes is loaded
            from ..model.scene import Scene
            from .scenes import plain_law, refuse_options, solve

            if isinstance(subject, Scene):
                refuse_options(law=law)
                if not subject.is_plain:
                    beside: Any = getattr(near, asked.name) if isinstance(near, Equilibrium) else near
                    options: dict[str, Any] = {given: value, "state": state, "near": beside}
                    return solve(subject, free=asked.name, method=method, tol=tol, **options)
                rod, bond = subject.rod, plain_law(subject)
        question = Question.of_rod(rod, given, value, law=bond, state=state, near=near)
        return solve_question(question, method, tol)

    return _guarded(ask, subject, asked.attribute, tol, throw)


def _guarded(
    ask: Callable[[], Equilibrium], subject: object, asked: str, tol: float, throw: bool
) -> Equilibrium:
    try:
        return ask()
    except PeelOptError as error:
        if throw:
            raise
        rod: Any = getattr(subject, "rod", subject)
        return Equilibrium.nothing(rod, asked, tol, error.status, str(error))


@one_thread
def solve_question(
    question: Question,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    search: SelectionWalk = THROUGH,
) -> Equilibrium:
    """Find the state a question means, solve for it and certify the answer.

    Raises
    ------
    NoEquilibrium, AmbiguousState, OutOfRange, NotConverged, NotCertified
        As `pressure_given_length`.
    """
    began, method, tol = time.perf_counter(), as_method(method), positive("tol", tol)
    if method.series and question.near is None and question.state != "folded":
        summed = None if question.leaves else _summed(question, method, tol, began)
        if summed is not None:
            return summed
        if method.transcription is not None:
            method = method.on_meshes
    chosen, spacing, walked = seeded(question) or select(question, search)
    found = solve_from(chosen.solution, question, chosen.state, method, tol, spacing, Effort(began, walked))
    return require_certified(question, found)


def solve_from(
    start: SolvedState,
    question: Question,
    state: str,
    method: Method,
    tol: float,
    spacing: float = math.inf,
    before: Effort | None = None,
) -> Equilibrium:
    """Solve for the state that a question means from a solution of it on another mesh.

    Parameters
    ----------
    start : SolvedState
    question : Question
    state : str
        Its label.
    method : Method
    tol : float
    spacing : float
        How far off the answer of the next state is.
    before : Effort, optional
        What it took to come to the start.

    Returns
    -------
    Equilibrium
        Certified or not.

    Raises
    ------
    NotConverged
        If the method fails, or leaves the state.
    """
    solved = solve_to_tolerance(question, start, method, tol)
    result = certify(question, state, solved, tol, before)
    own = question.read(start.profile.scalars)
    jumped = abs(result.answer - own) > min(0.25 * spacing, FAITHFUL * (1.0 + abs(own)) + result.error)
    if jumped:
        raise NotConverged(
            f"{question.words}: {result.stats.method} left the {state} state it was started at.",
            remedy="Try method='spectral' or a finer mesh; near a fold, a given number further from it.",
        )
    if question.near is None:
        return result
    return replace(result, flags=result.flags + far_from(question.near, result.answer))


def require_certified(question: Question, found: Equilibrium) -> Equilibrium:
    """Return an answer that is certified.

    Raises
    ------
    NotCertified
        If it is not.
    """
    if found.certified:
        return found
    raise NotCertified(
        f"{question.words}: found {question.asked} = {found.answer:.8g}, but its error"
        f" {found.error:.1e} or its certificate {found.certificate:.1e} exceeds tol = {found.tol:.1e}"
        f" (condition of the question {found.stats.condition:.1e}).",
        remedy="Give a larger tol or a finer method; near a fold the question itself loses digits.",
        candidates=(found,),
    )


def _summed(question: Question, method: Method, tol: float, began: float) -> Equilibrium | None:
    """Answer in closed form, without a walk; None where that is out of reach."""
    for order in method.series:
        state = question.state or "unfolded"
        try:
            found = closed_form(question, state, (order,), tol)
        except NotConverged:
            continue
        solved = Answer(found.problem, found.x, found.error, found.stats)
        result = certify(question, found.state, solved, tol, Effort(began, 0))
        if result.certified and question.fits(found.state):
            return result
    return None
