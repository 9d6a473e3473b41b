"""`equilibria`: every state that can be found for one question."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ..base.checks import finite, known_beta0, positive
from ..base.errors import InvalidInput, NotCertified, NotConverged, OutOfRange
from ..base.progress import progress
from ..base.threads import one_thread
from ..model.bond import CohesiveLaw
from ..model.labels import DISQUALIFYING, UNFOLDED
from ..model.rod import RATIOS, Rod, require_ratio, require_rod
from ..residual.discretisation import Transcription
from .certify import report
from .methods import Method, answer, as_method
from .posed import Posed, known_lambda, known_law
from .result import Equilibrium
from .search import FoundState, StateSearch, close
from .states import States

#: Beyond these the grid is far too coarse.
MOST_GAMMA, MOST_PRESSURE = 60.0, 20.0

#: Relative distance in answer and tip angle within which two solutions are one.
SAME = 1e-6


@one_thread
def equilibria(
    rod: Rod | None = None,
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
    rod : Rod, optional
        With ``pressure`` [Pa] or ``length`` [m].
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
    ask = _ask(rod, law, numbers)
    _require_range(ask)
    chosen = as_method(method)
    tol = positive("tol", tol)
    results: list[Equilibrium] = []
    states, searched = ask.search.run()
    different = _distinct(states)
    with progress("state", len(different)) as step:
        for found in different:
            solved = _solved(ask, found, chosen, tol)
            if solved is None and searched is not None:
                searched = searched.short_of(found.profile.scalars.sigma)
            if solved is not None and not any(_same(solved, other) for other in results):
                results.append(replace(solved, **ask.as_given))
            step()
    ordered = sorted(results, key=lambda eq: (eq.pressure_ratio, eq.length_ratio, eq.tip_angle))
    return States(ordered, searched)


@dataclass(frozen=True)
class _Ask:
    """A question about all states, and the search that answers it."""

    posed: Posed
    search: StateSearch
    as_given: dict[str, Any]


def _ask(rod: Rod | None, law: str | CohesiveLaw | None, numbers: dict[str, float | None]) -> _Ask:
    """Pose the question that a rod, or none, and some numbers make."""
    given = {name: value for name, value in numbers.items() if value is not None}
    questions = ({"beta0", "lam"}, {"beta0", "beta1"}) if rod is None else ({"pressure"}, {"length"})
    if set(given) not in questions:
        raise InvalidInput("give a rod with pressure or length, or beta0 with lam or beta1.")
    if rod is None:
        named = known_law("linear" if law is None else law)
        beta0 = positive("beta0", known_beta0(given["beta0"]))
        posed = Posed.at_groups(named, beta0, known_lambda(given.get("lam"), given.get("beta1")))
        exact = {"beta1": finite("beta1", given["beta1"])} if "beta1" in given else {}
        search = StateSearch(posed.effective_law, posed.ratio, posed.given[0])
        return _Ask(posed, search, {"beta0": beta0, "lam": posed.given[1].value, "given": exact})
    named, rod = known_law("auto" if law is None else law), require_rod(rod, RATIOS)
    if "length" in given:
        posed = Posed.at_length(rod, named, rod.length_ratio(given["length"]))
    else:
        posed = Posed.at_pressure(rod, named, rod.pressure_ratio(given["pressure"]))
    ((name, number),) = given.items()
    unit = "" if rod.dimensionless else "m" if name == "length" else "Pa"
    exact = {name: finite(name, number, unit), f"{name}_ratio": posed.given[1].value}
    return _Ask(posed, StateSearch(posed.effective_law, posed.ratio, posed.given[1]), {"given": exact})


def _require_range(ask: _Ask) -> None:
    """Raise where the search would take minutes and prove nothing."""
    require_ratio(ask.posed.ratio)
    if ask.search.given.kind == "length" and ask.search.gamma > MOST_GAMMA:
        raise OutOfRange(
            f"sbar/eta = {ask.search.given.value:.4g} is too long to look for all states (beta1^(1/4) ="
            f" {ask.search.gamma:.3g}, at most {MOST_GAMMA:g}).",
            remedy="Ask for one state with pressure_given_length.",
        )
    if ask.search.given.kind == "pressure" and not abs(ask.search.given.value) <= MOST_PRESSURE:
        raise OutOfRange(
            f"p/T0 = {ask.search.given.value:.4g} is too far from 1 to look for all states.",
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


def _solved(ask: _Ask, found: FoundState, method: Method, tol: float) -> Equilibrium | None:
    """Solve with the method asked for; None where a state off the primary branch is not certified."""
    try:
        solved = answer(ask.posed, found.landed, method, tol)
    except (NotConverged, NotCertified):
        return None
    eq = report(ask.posed, found.state, solved, tol)
    if not eq.certified:
        return eq if found.state in (*UNFOLDED, "folded") else None
    physical = found.state not in ("other", "spurious") or not any(f in eq.flags for f in DISQUALIFYING[2:4])
    return eq if physical else replace(eq, state="spurious")
