"""`equilibria`: every state that can be found for one question."""

from __future__ import annotations

from dataclasses import replace

from ..base.checks import known_beta0, positive
from ..base.errors import InvalidInput, NotCertified, NotConverged, OutOfRange
from ..base.progress import progress
from ..base.threads import one_thread
from ..model.bond import CohesiveLaw
from ..model.labels import DISQUALIFYING, UNFOLDED
from ..model.rod import Rod, require_ratio
from ..model.scene import Scene
from ..residual.discretisation import Transcription
from .methods import Method, as_method, certify, solve_to_tolerance
from .question import Question, rod_questions
from .result import Equilibrium
from .scenes import plain_law, refuse_options, scene_method, states_of_scene
from .search import FoundState, StateSearch, close
from .states import States

#: Beyond these the grid is far too coarse.
MOST_GAMMA, MOST_PRESSURE = 60.0, 20.0

#: Relative distance in answer and tip angle within which two solutions are one.
SAME = 1e-6


@one_thread
def equilibria(
    rod: Rod | Scene | None = None,
    *,
    pressure: float | None = None,
    length: float | None = None,
    beta0: float | None = None,
    lam: float | None = None,
    beta1: float | None = None,
    law: str | CohesiveLaw | None = None,
    method: str | Method | Transcription = "spectral",
    tol: float = 1e-8,
) -> States:
    """Return every equilibrium that can be found for a question, labelled and certified.

    The states on the rod's primary branch are read off it, completely.  Others are searched for up
    to bounds that the result names (``searched``); of what lies beyond them it says nothing.

    Given the pressure, p y_tip = Phi(y_tip) gives the height of the tip, and the reaction of the plate
    at the detachment point is all that is left to scan.  The scan is refined until every place where a
    rod has the height of its tip can be followed from reaction to reaction, so that all states are
    found up to the length in ``searched``: 2.5 times the longest of the primary branch at this pressure, 1.2
    times the longest at any, or the length beyond which doubles do not tell the rods apart.
    It takes about a second, and half a second more for each long state: many of a rod with eta >> y0.

    Given the length, a grid over tip angle and pressure of rods shot from the free tip is searched, under
    the linear law and law (8).  That finds what is not finer than the grid, in up to some seconds.

    Parameters
    ----------
    rod : Rod or Scene, optional
        Of a scene that is not the paper's: the states on its branches, as far as these were followed.
    pressure, length : float, optional
        What is given of the rod [Pa, m]; one of them.
    beta0, lam, beta1 : float, optional
        The paper's groups instead: beta0 > 0 and one of the others.
    law : str or CohesiveLaw, optional
        Default: law (8) for a rod, the linear law in the groups.
    method, tol
        As for `pressure_given_length`.

    Returns
    -------
    list of Equilibrium
        With an attribute ``searched``: p/T0, sbar/eta, and reactions at the edge or tip angles within
        which states off the primary branch were looked for; None where only the branch is followed.
        Sorted by p/T0, at one pressure by length.  ``state`` is "middle", "lower" or "folded"
        on the primary branch, where one that is not certified to ``tol`` is listed with that
        ``status``; "spurious" for alpha1 > 0 or y < 0, else "other".  A state whose
        tip is held down to the plate carries the flag "tip on plate"; its certificate is
        |p y_tip - Phi(y_tip)| / (T0 y0), which says less than the usual one.

    Raises
    ------
    InvalidInput
        If the arguments do not form a question.
    OutOfRange
        If a search would take minutes and find little: a rod, length or pressure far off.

    Examples
    --------
    >>> [eq.state for eq in equilibria(Rod.from_ratio(1.0), length=3.05) if eq.valid]
    ['lower', 'middle']
    """
    numbers = {"pressure": pressure, "length": length, "beta0": beta0, "lam": lam, "beta1": beta1}
    if isinstance(rod, Scene) and not rod.is_plain:
        return _of_scene(rod, law, method, positive("tol", tol), numbers)
    if isinstance(rod, Scene):
        refuse_options(law="auto" if law is None else law)
        law, rod = plain_law(rod), rod.rod
    question = _question(rod, law, numbers)
    search = _search(question)
    _require_range(search)
    chosen = as_method(method)
    tol = positive("tol", tol)
    results: list[Equilibrium] = []
    states, searched = search.run()
    different = _distinct(states)
    with progress("state", len(different)) as step:
        for found in different:
            solved = _solved(question, found, chosen, tol)
            if solved is None and searched is not None:
                searched = searched.short_of(found.profile.scalars.sigma)
            if solved is not None and not any(_same(solved, other) for other in results):
                results.append(solved)
            step()
    ordered = sorted(results, key=lambda eq: (eq.pressure_ratio, eq.length_ratio, eq.tip_angle))
    return States(ordered, searched)


def _of_scene(
    scene: Scene,
    law: object,
    method: str | Method | Transcription,
    tol: float,
    numbers: dict[str, float | None],
) -> States:
    """Return the states on the branches of a scene."""
    refuse_options(law="auto" if law is None else law)
    given = {name: value for name, value in numbers.items() if value is not None}
    if len(given) != 1 or not given.keys() <= {"pressure", "length"}:
        raise InvalidInput("give one of pressure and length with a scene.")
    ((name, value),) = given.items()
    found = states_of_scene(scene, name, value, tol, scene_method(method))
    return States(sorted(found, key=lambda eq: (eq.pressure_ratio, eq.length_ratio, eq.tip_angle)))


def _question(rod: Rod | None, law: str | CohesiveLaw | None, numbers: dict[str, float | None]) -> Question:
    """Pose the question that a rod, or none, and some numbers make."""
    given = {name: value for name, value in numbers.items() if value is not None}
    if rod is None and set(given) in ({"beta0", "lam"}, {"beta0", "beta1"}):
        beta0 = positive("beta0", known_beta0(given["beta0"]))
        named = "linear" if law is None else law
        return Question.of_groups(beta0, given.get("lam"), given.get("beta1"), law=named)
    if rod is None or len(given) != 1 or not given.keys() <= rod_questions().keys():
        raise InvalidInput("give a rod with pressure or length, or beta0 with lam or beta1.")
    ((name, value),) = given.items()
    return Question.of_rod(rod, name, value, law="auto" if law is None else law)


def _search(question: Question) -> StateSearch:
    """Return the search for all states of a question."""
    return StateSearch(question.effective_law, question.ratio, question.target)


def _require_range(search: StateSearch) -> None:
    """Raise where the search would take minutes and prove nothing."""
    require_ratio(search.ratio)
    if search.given.kind == "length" and search.gamma > MOST_GAMMA:
        raise OutOfRange(
            f"sbar/eta = {search.given.value:.4g} is too long to look for all states (beta1^(1/4) ="
            f" {search.gamma:.3g}, at most {MOST_GAMMA:g}).",
            remedy="Ask for one state with pressure_given_length.",
        )
    if search.given.kind == "pressure" and not abs(search.given.value) <= MOST_PRESSURE:
        raise OutOfRange(
            f"p/T0 = {search.given.value:.4g} is too far from 1 to look for all states.",
            remedy=f"Stay within {MOST_PRESSURE:g} of zero.",
        )


def _distinct(found: list[FoundState]) -> list[FoundState]:
    """Keep the first of all that coincide; those of the primary branch come first."""
    kept: list[FoundState] = []
    for state in found:
        if not any(close(state.profile, other.profile) for other in kept):
            kept.append(state)
    return kept


def _same(a: Equilibrium, b: Equilibrium) -> bool:
    gap = abs(a.answer - b.answer) + abs(a.tip_angle - b.tip_angle)
    return gap < SAME * (1.0 + abs(a.answer))


def _solved(question: Question, found: FoundState, method: Method, tol: float) -> Equilibrium | None:
    """Solve with the method asked for; None where a state off the primary branch is not certified."""
    try:
        solved = solve_to_tolerance(question, found.solution, method, tol)
    except (NotConverged, NotCertified):
        return None
    eq = certify(question, found.state, solved, tol)
    if not eq.certified:
        return eq if found.state in (*UNFOLDED, "folded") else None
    physical = found.state not in ("other", "spurious") or not any(f in eq.flags for f in DISQUALIFYING[2:4])
    return eq if physical else replace(eq, state="spurious")
