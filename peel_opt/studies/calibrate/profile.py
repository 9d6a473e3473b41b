"""Profile likelihood: one number held, the others fitted again."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...base.arrays import Columns
from ...base.checks import positive, whole
from ...base.errors import InvalidInput, NotConverged
from ...model.rod import MATERIAL
from .problem import Fitted, watched
from .search import BETTER

if TYPE_CHECKING:
    from .result import Calibration, Fit

#: Furthest end of an interval, as a logarithm: a factor 10^4.
FURTHEST = math.log(1e4)

#: Relative error of its distance from the estimate at which the end of an interval counts as found.
FOUND = 1e-3

#: Share of the way to a limit at which it counts as reached.
NEARLY = 0.98

#: Least level of an interval: below it, rounding decides about its ends.
LEAST_LEVEL = 1e-6

#: Share of chi-square to which two fits of the same numbers agree.
ROUNDING = 1e-6

#: Most points of a profile: each is a fit.
MOST_POINTS = 1000

#: Least share of a step that is tried before a value counts as out of reach.
LEAST_SHARE = 1.0 / 64.0


class BetterFit(NotConverged):
    """A profile came below the fit it starts from, which then is no minimum to measure from."""


@dataclass(frozen=True, eq=False, repr=False)
class LikelihoodProfile(Columns):
    """A profile likelihood.

    Parameters
    ----------
    name : str
    values : ndarray, shape (n,)
        Of the number, in SI units.
    deviance : ndarray, shape (n,)
        Increase of chi-square over the best fit, the other numbers fitted again.
    others : dict of str to ndarray, shape (n,)
        Those numbers, in SI units.
    """

    name: str
    values: np.ndarray
    deviance: np.ndarray
    others: dict[str, np.ndarray]


def profile(fit: Calibration, index: int, points: int, width: float) -> LikelihoodProfile:
    """Return the profile of a free number, see `Calibration.profile`."""
    points, width = whole("points", points, 3, MOST_POINTS), positive("width", width)
    place = MATERIAL.index(fit.free[index])
    spread = fit.relative_sd(fit.free[index])
    if not math.isfinite(spread) or fit.fitted.held:
        raise InvalidInput(
            f"the data say too little about {fit.free[index]}: its likelihood is flat.",
            remedy="Read the warnings of the fit.",
        )
    offsets = np.linspace(-1.0, 1.0, points) * min(width * spread, FURTHEST)
    found: dict[float, Fitted] = {}
    with watched(fit.problem) as problem:
        seen = replace(fit, problem=problem)
        for side in (offsets[offsets >= 0.0], offsets[offsets <= 0.0][::-1]):
            at = fit.fitted
            for offset in side:
                at = _held(seen, at, place, fit.fitted.q[place] + float(offset))
                found[float(offset)] = at
    ordered = [found[float(offset)] for offset in offsets]
    numbers = {name: np.exp([f.q[i] for f in ordered]) for i, name in enumerate(MATERIAL)}
    return LikelihoodProfile(
        name=fit.free[index],
        values=numbers[fit.free[index]],
        deviance=np.array([f.deviance - fit.deviance for f in ordered]),
        others={name: numbers[name] for name in fit.free if name != fit.free[index]},
    )


def interval(fit: Calibration, index: int, level: float, method: str | None) -> tuple[float, float]:
    """Return an interval of confidence, see `Calibration.interval`."""
    z, robust, name = quantile(fit, level, method), fit.loss != "least-squares", fit.free[index]
    estimate, spread = fit.estimates[name], fit.relative_sd(name)
    if robust or method == "covariance" or fit.fitted.held:
        if not math.isfinite(spread * z):
            return 0.0, math.inf
        return estimate * math.exp(-z * spread), estimate * math.exp(z * spread)
    with watched(fit.problem) as problem:
        seen = replace(fit, problem=problem)
        ends = [_end(seen, index, side, z) for side in (-1.0, 1.0)]
    low, high = (estimate * math.exp(end) if end is not None else None for end in ends)
    return (0.0 if low is None else low), (math.inf if high is None else high)


def quantile(fit: Fit, level: float, method: str | None) -> float:
    """Return how many standard deviations wide each side of an interval is.

    Raises
    ------
    InvalidInput
        If level or method cannot be meant.
    """
    from scipy.special import ndtri, stdtrit

    require_level(level)
    if method not in (None, "profile", "covariance"):
        raise InvalidInput(f"unknown method {method!r}.", remedy="Choose profile or covariance.")
    if fit.loss == "least-squares":
        if fit.scaled is not None:  # the residuals tell their own scatter, the fewer the worse
            return float(stdtrit(fit.degrees, 0.5 + 0.5 * level))
        return float(ndtri(0.5 + 0.5 * level))
    # A robust loss is no likelihood.
    if method == "profile":
        raise InvalidInput("a robust loss has no likelihood to profile.", remedy="Use method='covariance'.")
    # Its covariance comes from the residuals themselves: few of them tell it badly.
    return float(stdtrit(fit.degrees, 0.5 + 0.5 * level)) if fit.degrees else math.inf


def require_level(level: float) -> None:
    """Refuse what is no chance, and one so small that its interval is the estimate.

    Raises
    ------
    InvalidInput
        If it is no number from `LEAST_LEVEL` to below 1.
    """
    if not LEAST_LEVEL <= positive("level", level) < 1.0:
        raise InvalidInput(f"level must lie between {LEAST_LEVEL:g} and 1, got {level:g}.")


def _end(fit: Calibration, index: int, side: float, target: float) -> float | None:
    """Distance in the logarithm at which the root of the increased deviance meets ``target``.

    None if the likelihood does not fall so far within a factor 10^4.
    """
    place = MATERIAL.index(fit.free[index])
    spread = fit.relative_sd(fit.free[index])
    if not math.isfinite(spread):
        return None
    centre, furthest = fit.fitted.q[place], _furthest(fit, place, side)
    known = {0.0: (fit.fitted, -target)}

    def left(distance: float) -> float:
        """How far the root is above the target at a distance, from the fit known nearest to it."""
        if distance not in known:
            at = known[min(known, key=lambda other: abs(other - distance))][0]
            there = _held(fit, at, place, centre + side * distance)
            known[distance] = there, math.sqrt(max(there.deviance - fit.deviance, 0.0)) - target
        return known[distance][1]

    distance = met(left, target * spread, furthest)
    if distance is None:
        return None if furthest == FURTHEST else side * furthest
    return side * distance


def met(left: Callable[[float], float], first: float, furthest: float) -> float | None:
    """Return the distance at which a nearly linear function comes up to zero; None if it does not.

    Bracketed by growing steps, of which ``first`` is foretold, it takes two or three values.
    """
    from scipy.optimize import brentq

    inside, step = 0.0, min(first, 0.5)
    while True:
        # A number with a limit is looked for up to just before it.
        outside = min(inside + step, NEARLY * furthest)
        if left(outside) >= 0.0:
            return float(brentq(left, inside, outside, xtol=1e-300, rtol=FOUND))
        if outside >= NEARLY * furthest:
            return None
        slope = (left(outside) - left(inside)) / (outside - inside)
        inside, step = outside, 2.0 * step + 0.5
        if slope > 1e-6:
            step = min(-1.2 * left(outside) / slope, step)


def _furthest(fit: Calibration, place: int, side: float) -> float:
    """How far a logarithm may go: no detached state has a pressure above T0."""
    exact = [o.pressure for o in fit.observations if o.role("pressure") == "exact" and o.pressure]
    if MATERIAL[place] == "adhesion_strength" and side < 0.0 and exact:
        return math.log(fit.rod.adhesion_strength / max(exact))
    return FURTHEST


def _held(fit: Calibration, at: Fitted, place: int, value: float) -> Fitted:
    """Fit with one logarithm at a value, by shorter steps where it does not go at once."""
    free = fit.problem.free.copy()
    free[place] = False
    problem = replace(fit.problem, free=free)
    # The other numbers follow as far as the covariance tells.
    own, follow = fit.free.index(MATERIAL[place]), np.zeros(3)
    follow[fit.problem.free] = np.nan_to_num(fit.log_covariance[own] / fit.log_covariance[own, own])
    begin = float(at.q[place])
    reached, share = 0.0, 1.0
    while reached < 1.0:
        q = at.q + (begin + min(1.0, reached + share) * (value - begin) - at.q[place]) * follow
        trial = problem.minimised(replace(at, q=q, directions=np.eye(int(free.sum()))))
        if trial is None:
            share *= 0.5
            if share < LEAST_SHARE:
                raise NotConverged(
                    f"the fit with {MATERIAL[place]} held {value - fit.fitted.q[place]:+.3g} in its"
                    " logarithm away from the best one does not converge.",
                    remedy="Ask for a narrower profile, or use the covariance.",
                )
            continue
        at, reached = trial, min(1.0, reached + share)
    if at.deviance < fit.deviance - max(BETTER, ROUNDING * fit.deviance):
        raise BetterFit(
            f"a better fit was found on the way: with {MATERIAL[place]} held"
            f" {value - fit.fitted.q[place]:+.3g} in its logarithm away, chi-square is"
            f" {at.deviance:.6g}, not {fit.deviance:.6g}.",
            remedy="Fit again from a rod nearer to it, or fix a number that is known.",
        )
    return at
