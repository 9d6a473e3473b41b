"""Answers in closed form: the uniform series, where it converges and the rod stays within y0.

One scalar equation in alpha1 (or in sbar, at given pressure) takes the place of the
boundary-value problem.  No walk along the branch is needed: at fixed beta0 the branch from T
is a curve lambda(alpha1), so its slope at a root says whether that is the middle or the lower
state.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..base.arrays import EPS
from ..base.errors import NotConverged
from ..model.groups import PI4
from ..model.series_curve import SeriesCurve, curve
from ..residual.closures import Closure
from ..residual.discretisation import Discretisation
from ..residual.meshes import SUMMED
from .question import Question
from .result import Stats

#: Up to here the branch from T at fixed beta0 has one fold, and the series converges on all of
#: 0 > a > -0.7; the cusp of the fold curve is at 36.115.
MOST_BETA0 = 36.0

#: Relative error of alpha1 up to which a root counts as separate from the fold.
SEPARATE = 1e-3

MOST_ITERATIONS = 30

OUTSIDE = "there p/T0 is not in [1/2, 1], and the shape is not within y0."


class Root(NamedTuple):
    """A point of the curve, the error of its answer, and what the answer owes to the given numbers."""

    alpha1: float
    sigma: float
    lam: float
    state: str
    error: float
    condition: float
    iterations: int


@dataclass(frozen=True, eq=False)
class ClosedForm:
    """An answer of the series, in the unknowns of the spectral form."""

    problem: Discretisation
    x: np.ndarray
    state: str
    error: float
    stats: Stats


def closed_form(posed: Question, state: str, orders: tuple[int, ...], tol: float) -> ClosedForm:
    """Answer by the lowest of ``orders`` that meets ``tol``.

    Parameters
    ----------
    posed : Question
    state : {"lower", "middle", "spurious", "unfolded"}
        Which root; at given pressure there is only one.

    Raises
    ------
    NotConverged
        With the reason, where the series is out of its reach.
    """
    began, law = time.perf_counter(), posed.effective_law
    if not law.falls_straight:
        raise NotConverged(f"the series knows the linear law only, not {law.name!r}.")
    if posed.leaves:
        raise NotConverged(OUTSIDE)
    reason = ""
    for order in orders:
        try:
            root = _root(curve(order), posed.given, state)
        except NotConverged as error:
            reason = str(error)
            continue
        beta0 = root.sigma**3
        if not law.is_linear and (2.0 * root.alpha1 < -beta0 or root.alpha1 > 0.0):
            raise NotConverged(OUTSIDE)
        if root.error <= tol:
            break
        reason = f"its error is {root.error:.1e}, above tol = {tol:.1e}."
    else:
        raise NotConverged(f"the series of order {orders[-1]} does not reach this state: {reason}")
    stats = Stats(
        method=f"series(order={order})",
        seconds=time.perf_counter() - began,
        iterations=root.iterations,
        evaluations=root.iterations,
        unknowns=1,
        condition=root.condition,
    )
    problem = SUMMED.discretise(law.pieces[:1])
    x = curve(order).unknowns(root.alpha1, root.sigma, root.lam)
    return ClosedForm(problem, x, root.state, root.error, stats)


def _label(slope: float, alpha1: float) -> str:
    """State of a root from the slope of lambda(alpha1) there."""
    if alpha1 > 0.0:
        return "spurious"
    return "middle" if slope > 0.0 else "lower"


@np.errstate(over="ignore", invalid="ignore")  # far out the terms overflow, which the error says
def _root(sums: SeriesCurve, given: tuple[Closure, Closure], state: str) -> Root:
    first, second = given
    if second.kind == "pressure":
        return _at_pressure(sums, first.value, second.value)
    if second.kind == "length":
        sigma = second.value
        if sigma > MOST_BETA0:  # whose powers are no numbers any more
            raise NotConverged(f"the series does not reach to sbar/eta = {sigma:.4g}.")
        lam = first.value * sigma**4 - PI4
        return _at_length(sums, sigma, lam, state, ratio=first.value)
    if (first.kind, second.kind) == ("length", "lam"):
        return _at_length(sums, first.value, second.value, state)
    raise NotConverged(f"the series does not answer with {first.kind} and {second.kind} given.")


def _at_pressure(sums: SeriesCurve, ratio: float, P: float) -> Root:
    """Solve ratio sigma^4 = pi^4 + lambda(a sigma^3, sigma^3) at a = P - 1."""
    if P >= 1.0:
        raise NotConverged("there is no detached state at this pressure.")
    a, sigma = P - 1.0, math.pi * ratio**-0.25
    step = 0.0
    for iteration in range(1, MOST_ITERATIONS + 1):  # noqa: B007 - counted for the report
        beta0 = sigma**3
        if beta0 > MOST_BETA0:
            raise NotConverged(f"beta0 = {beta0:.3g} is beyond its convergence.")
        lam, by_alpha1, by_beta0 = sums(a * beta0, beta0)
        slope = 4.0 * ratio * sigma**3 - 3.0 * sigma**2 * (a * by_alpha1 + by_beta0)
        before, step = step, (ratio * sigma**4 - PI4 - lam) / slope
        if not (slope > 0.0 and abs(step) < 0.5 * sigma):
            raise NotConverged("its Newton iteration fails.")
        sigma -= step
        if _next_step(step, before) < EPS * sigma or abs(step) < 1e-14 * sigma:
            break
    else:
        raise NotConverged("its Newton iteration does not end.")
    beta0 = sigma**3
    value = sums(a * beta0, beta0)
    response = abs(beta0 * value.by_alpha1 / slope)
    by_ratio = sigma**4 / slope
    rounding = EPS * (4.0 * (PI4 + ratio * sigma**4) / slope + 2.0 * (sigma + response + ratio * by_ratio))
    error = sums.error(a * beta0, beta0) / slope + rounding + 2.0 * _next_step(step, before)
    return Root(a * beta0, sigma, value.lam, _label(value.by_alpha1, a), error, response, iteration)


def _at_length(sums: SeriesCurve, sigma: float, lam: float, state: str, ratio: float | None = None) -> Root:
    """Solve lambda(alpha1) = lam at fixed beta0, starting from the leading term of the series."""
    beta0 = sigma**3
    if beta0 > MOST_BETA0:
        raise NotConverged(f"beta0 = {beta0:.3g} is beyond its convergence.")
    wanted = "lower" if state == "unfolded" else state
    alpha1 = _leading_root(sums, beta0, lam, wanted)
    step = 0.0
    for iteration in range(1, MOST_ITERATIONS + 1):
        found, slope, by_beta0 = sums(alpha1, beta0)
        before, step = step, (found - lam) / slope if slope else math.inf
        if not abs(step) < 0.5 * (1.0 + abs(alpha1)):
            raise NotConverged("its Newton iteration fails.")
        alpha1 -= step
        if _next_step(step, before) < EPS * abs(alpha1) or abs(step) < 1e-14 * abs(alpha1):
            break
        if abs(step) < 1e-12 * abs(alpha1) and iteration > 8:
            break  # what rounding leaves near the fold
    else:
        raise NotConverged("its Newton iteration does not end.")
    if _label(slope, alpha1) != wanted:
        raise NotConverged(f"it finds no {wanted} state.")
    steepness = abs(slope)
    by_sigma = abs(by_beta0) * 3.0 * sigma**2 + (4.0 * ratio * sigma**3 if ratio else 0.0)
    given = (PI4 + ratio * sigma**4) * 2.0 if ratio else 2.0 * abs(lam)
    rounding = EPS * (given + 2.0 * sigma * by_sigma) / steepness + 2.0 * EPS * abs(alpha1)
    rounding += 2.0 * _next_step(step, before)
    error = sums.error(alpha1, beta0) / steepness + rounding
    if not error < SEPARATE * abs(alpha1):
        raise NotConverged("it has not converged there, or the fold is too near.")
    condition = (by_sigma if ratio else max(1.0, by_sigma)) / steepness
    if ratio:  # P = 1 + alpha1/beta0 is asked for
        return Root(alpha1, sigma, lam, wanted, error / beta0 + 2.0 * EPS, condition / beta0, iteration)
    return Root(alpha1, sigma, lam, wanted, error, condition, iteration)


def _next_step(step: float, before: float) -> float:
    """Size of the step after this one: they shrink quadratically."""
    return abs(step) * min(1.0, (step / before) ** 2) if before else abs(step)


def _leading_root(sums: SeriesCurve, beta0: float, lam: float, state: str) -> float:
    """Root of beta0^2 P_1(alpha1/beta0) = lam."""
    _, linear, square = (float(c) for c in sums.series.polynomials[0])
    b = linear * beta0
    inside = b * b + 4.0 * square * lam
    if inside <= 0.0:
        raise NotConverged("the fold is too near.")
    far = b + math.sqrt(inside)
    if far == 0.0:
        raise NotConverged("there is no detached state.")
    return -far / (2.0 * square) if state == "lower" else 2.0 * lam / far
