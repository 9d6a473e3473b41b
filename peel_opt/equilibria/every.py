"""`equilibria`: every state that can be found for one question."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from ..base.checks import finite, known_beta0, positive
from ..base.errors import InvalidInput, NotCertified, NotConverged, OutOfRange
from ..base.threads import one_thread
from ..continuation.family import Family
from ..continuation.points import Point
from ..continuation.primary import UNFOLDED, Candidate, PrimaryBranch, crossings, primary_branch
from ..continuation.tip_scan import STEEPEST, TipShooting, starts_at_length, starts_at_pressure
from ..model.bond import COHESIVE, LINEAR, CohesiveLaw
from ..model.rod import RATIOS, Rod, require_ratio, require_rod
from ..residual.closures import Closure
from ..residual.discretisation import Profile, Transcription
from ..residual.transcriptions import Spectral
from .certify import report
from .methods import Method, answer, as_method
from .posed import Posed, known_lambda, known_law
from .result import DISQUALIFYING, Equilibrium
from .states import Searched, States

#: Mesh on which starts are corrected and walked from.
SEARCH = Spectral(nodes=24)

#: Range of p/T0 that is searched, for questions at a given length.
PRESSURES = (-2.0, 5.0)

#: The least p/T0 searched under law (8), whose tip then is 250 y0 high.
LOWEST = 0.002

#: Share of the longest state of the primary branch up to which lengths are searched at a given pressure.
BEYOND = 1.2

#: Above this gamma = beta1^(1/4) shapes part so fast that a grid misses some, and the states
#: found are followed through other rods at the same length for more.
EASY_GAMMA = 6.0

#: Points walked in each direction for that, and states after which it ends.
DETOUR, MOST_STATES = 30, 40

#: Beyond these the grid is far too coarse.
MOST_GAMMA, MOST_PRESSURE = 60.0, 20.0

#: Relative distance in answer and tip angle within which two solutions are one.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class _Found:
    """A solution and the name of its family."""

    profile: Profile
    state: str


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

    The states on the rod's primary branch are read off it, completely.  Off it, a grid of
    shapes shot from the free tip is searched, up to bounds that the result names (``searched``):
    given the pressure, over tip angle and length, given the length, over tip angle and pressure.
    That finds what lies within its bounds and is not finer than the grid; of what lies beyond it
    says nothing.  It takes from half a second to some seconds.

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
        With an attribute ``searched``: the tip angles, p/T0 and sbar/eta within which states off
        the primary branch were looked for; None under laws for which only the branch is followed.
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
    for found in _distinct(_search(ask)):
        solved = _solved(ask, found, chosen, tol)
        if solved is not None and not any(_same(solved, other) for other in results):
            results.append(replace(solved, **ask.as_given))
    ordered = sorted(results, key=lambda eq: (eq.pressure_ratio, eq.length_ratio, eq.tip_angle))
    return States(ordered, _searched(ask))


@dataclass(frozen=True)
class _Ask:
    """A question about all states, and what is searched for them."""

    posed: Posed
    target: Closure
    as_given: dict[str, Any]

    @property
    def law(self) -> CohesiveLaw:
        """The law that is solved with."""
        return self.posed.effective_law

    @property
    def fixed(self) -> Closure:
        """What is fixed along the rod's branch."""
        return Closure("ratio", self.posed.ratio)

    @property
    def gamma(self) -> float:
        """beta1^(1/4) at a given length: how fast shapes part."""
        return math.exp(0.25 * math.log(self.posed.ratio)) * self.target.value


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
        return _Ask(posed, posed.given[0], {"beta0": beta0, "lam": posed.given[1].value, "given": exact})
    named, rod = known_law("auto" if law is None else law), require_rod(rod, RATIOS)
    if "length" in given:
        posed = Posed.at_length(rod, named, rod.length_ratio(given["length"]))
    else:
        posed = Posed.at_pressure(rod, named, rod.pressure_ratio(given["pressure"]))
    ((name, number),) = given.items()
    exact = {name: finite(name, number), f"{name}_ratio": posed.given[1].value}
    return _Ask(posed, posed.given[1], {"given": exact})


def _require_range(ask: _Ask) -> None:
    """Raise where the search would take minutes and prove nothing."""
    require_ratio(ask.posed.ratio)
    if ask.target.kind == "length" and ask.gamma > MOST_GAMMA:
        raise OutOfRange(
            f"sbar/eta = {ask.target.value:.4g} is too long to look for all states (beta1^(1/4) ="
            f" {ask.gamma:.3g}, at most {MOST_GAMMA:g}).",
            remedy="Ask for one state with pressure_given_length.",
        )
    if ask.target.kind == "pressure" and not abs(ask.target.value) <= MOST_PRESSURE:
        raise OutOfRange(
            f"p/T0 = {ask.target.value:.4g} is too far from 1 to look for all states.",
            remedy=f"Stay within {MOST_PRESSURE:g} of zero.",
        )


def _search(ask: _Ask) -> list[_Found]:
    """States of the primary branch first, then what the search from the tip finds."""
    found = _on_primary_branch(ask)
    for touching in (False, True):
        if ask.law not in (LINEAR, COHESIVE):
            break  # the search from the tip knows these two
        shooting = TipShooting(ask.law, ask.posed.ratio, touching)
        label = _label if not touching else (lambda _: "other")
        found += [_Found(p, label(p)) for p in _corrected(ask, _starts(ask, shooting))]
    if ask.target.kind == "length" and ask.gamma > EASY_GAMMA:
        found = _with_detours(ask, found)
    return found


def _on_primary_branch(ask: _Ask) -> list[_Found]:
    found = []
    for side in (1, -1):
        branch = primary_branch(ask.law, ask.fixed, side)
        branch.extend(partial(_past, branch, ask.target))
        for candidate in branch.candidates(ask.target):
            try:
                found.append(_Found(candidate.profile, candidate.state))
            except NotConverged:
                continue  # near the end of the branch; the search from the tip has another chance
    return found


def _past(branch: PrimaryBranch, target: Closure, last: Point) -> bool:
    """Whether an endless side of the branch has been walked far enough."""
    s, side = last.scalars, branch.side
    endless = side < 0 or branch.family.law == LINEAR
    if not endless or len(branch.points) < 2:
        return False
    if target.kind == "length":
        beyond = s.sigma > target.value and not PRESSURES[0] < s.pressure_ratio < PRESSURES[1]
    else:
        beyond = s.pressure_ratio > target.value if side < 0 else s.pressure_ratio < target.value
    return beyond or len(branch.points) > 200


def _starts(ask: _Ask, shooting: TipShooting) -> list[Profile]:
    bounds = _bounds(ask)
    if ask.target.kind == "length":
        return starts_at_length(shooting, ask.target.value, bounds.pressure_ratios)
    return starts_at_pressure(shooting, ask.target.value, bounds.length_ratios[1])


def _searched(ask: _Ask) -> Searched | None:
    return _bounds(ask) if ask.law in (LINEAR, COHESIVE) else None


def _bounds(ask: _Ask) -> Searched:
    """Bounds of the search; lengths go beyond those of the primary branch, which has been walked."""
    angles, given = (-STEEPEST, STEEPEST), ask.target.value
    if ask.target.kind == "length":
        lowest = PRESSURES[0] if ask.law == LINEAR else LOWEST
        return Searched(angles, (lowest, PRESSURES[1]), (given, given))
    points = primary_branch(ask.law, ask.fixed).points
    return Searched(angles, (given, given), (0.0, BEYOND * max(p.scalars.sigma for p in points)))


def _corrected(ask: _Ask, starts: list[Profile]) -> list[Profile]:
    family = Family(ask.law, SEARCH, ask.fixed, tip_free=False)
    solved = (family.solve(start, ask.target) for start in starts)
    return [problem.profile(result.x) for problem, result in (s for s in solved if s is not None)]


def _label(profile: Profile) -> str:
    return "spurious" if profile.scalars.alpha1 > 0.0 else "other"


def _with_detours(ask: _Ask, found: list[_Found]) -> list[_Found]:
    """Follow each state through other rods at the same length, for states the grid missed."""
    isolength = Family(ask.law, SEARCH, ask.target, tip_free=False)
    queue, every = list(found), list(found)
    while queue and len(every) < MOST_STATES:
        state = queue.pop(0)
        for candidate in _met_again(isolength, state.profile, ask.fixed):
            try:
                profile = candidate.profile
            except NotConverged:
                continue
            if not any(_close(profile, other.profile) for other in every):
                new = _Found(profile, _label(profile))
                every.append(new)
                queue.append(new)
    return every


def _met_again(family: Family, profile: Profile, ratio: Closure) -> list[Candidate]:
    """Places where a walk at fixed length comes back to the rod."""
    solved = family.solve(profile, ratio)
    if solved is None:
        return []
    met: list[Candidate] = []
    for sign in (1.0, -1.0):
        forward = sign * np.array([1.0, 0.3, 0.2, 0.1])
        start = family.point(solved[0], solved[1].x, forward, 0.0, solved[1].iterations)
        points = list(islice(family.walk(start), DETOUR))
        met += crossings(family, points[1:], ratio, lambda _: "other")
    return met


def _distinct(found: list[_Found]) -> list[_Found]:
    """Keep the first of all that coincide; those of the primary branch come first."""
    kept: list[_Found] = []
    for state in found:
        if not any(_close(state.profile, other.profile) for other in kept):
            kept.append(state)
    return kept


def _close(a: Profile, b: Profile) -> bool:
    gap = abs(a.scalars.alpha - b.scalars.alpha) + abs(a.scalars.A - b.scalars.A)
    return gap < 1e-5 * (1.0 + abs(a.scalars.alpha))


def _same(a: Equilibrium, b: Equilibrium) -> bool:
    gap = abs(a.answer - b.answer) + abs(a.tip_angle - b.tip_angle)
    return gap < SAME * (1.0 + abs(a.answer))


def _solved(ask: _Ask, found: _Found, method: Method, tol: float) -> Equilibrium | None:
    """Solve with the method asked for; None where a state off the primary branch is not certified."""
    try:
        solved = answer(ask.posed, found.profile, method, tol)
    except (NotConverged, NotCertified):
        return None
    eq = report(ask.posed, found.state, solved, tol)
    if not eq.certified:
        return eq if found.state in (*UNFOLDED, "folded") else None
    physical = found.state not in ("other", "spurious") or not any(f in eq.flags for f in DISQUALIFYING[2:4])
    return eq if physical else replace(eq, state="spurious")
