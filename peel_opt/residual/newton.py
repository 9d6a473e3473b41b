"""Newton on the discretised (12) bordered by the equations of a question.

The usual unknowns hold p as alpha1/A, its distance from T0, which suits the branch from T on.  A slender
rod comes down to a millionth of T0, of which 1 - p/T0 keeps ten digits, and beside the least pressure
the length answers to every one of them.  Where the bond has let the tip go, nothing but p acts on it:
with alpha/A among the unknowns instead no larger term hides it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeGuard

import numpy as np

from ..base.threads import heard
from .closures import Closing, chart, parameters
from .discretisation import Discretisation, Profile
from .linear import Linearised, closed_system
from .spectral import Spectral, SpectralDiscretisation

#: Solves a factorised system for one or more right sides.
Solver = Callable[[np.ndarray], np.ndarray]

#: From unknowns to the equations and the means to factorise their Jacobian.
Linearisation = Callable[[np.ndarray], tuple[np.ndarray, Callable[[], Solver]]]

#: Updates below this size leave the Jacobian as it is: with the factors kept, the next update
#: is still smaller by about this factor, at a fifth of the price.
CHORD = 1e-5

#: Factors are renewed when an update is not smaller than this share of the one before.
CONTRACTION = 0.1

#: Change of the Jacobian, as a share, up to which its factors serve for that of the solution, and size of an
#: update from which on the next one shows it.
SERVES, ROUGH = 2e-4, 1e-8

#: Share of its tolerance below which an update that is foretold is not computed.
AHEAD = 0.1

#: Updates below this size go on: beside the least pressure, a double root, each is half of the one before.
HALVING = 1e-3


@dataclass(frozen=True, eq=False)
class Correction:
    """Outcome of a Newton correction.

    ``step`` is the size of the last update relative to the unknowns, ``update`` that update
    itself: once converged, what rounding leaves.  ``drift`` says how much the Jacobian has changed since
    its factors were taken, as a share; where that is little, ``last`` is where they were.
    """

    x: np.ndarray
    converged: bool
    iterations: int
    step: float
    update: np.ndarray
    drift: float = 0.0
    last: Linearised | None = None


@dataclass(frozen=True, eq=False)
class SolvedState:
    """A converged solution for the given numbers, on its mesh."""

    problem: Discretisation
    correction: Correction
    given: tuple[Closing, ...]

    @property
    def place(self) -> np.ndarray:
        """Coordinates of the arclength, shape (4,)."""
        return chart(self.correction.x[self.problem.tail])[0]

    @cached_property
    def profile(self) -> Profile:
        """The fields, sampled."""
        return self.problem.profile(self.correction.x)

    @cached_property
    def linearised(self) -> Linearised:
        """The problem linearised here, with the factors of the correction where they still serve."""
        return Linearised(self.problem, self.correction.x, self.given, self.correction.last)


def correct(
    problem: Discretisation, x: np.ndarray, closing: Sequence[Closing], *, chord: float = CHORD
) -> Correction:
    """Solve R(x) = 0 together with closures from the guess ``x``.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray, shape (n,)
    closing : sequence of Closure and Plane
        The further equations on the scalars, compiled with the residual.
    chord : float
        Updates below this size leave the Jacobian as it is.

    Returns
    -------
    Correction
        ``converged`` is False if the updates did not shrink; nothing is raised.
    """
    closing, given = tuple(closing), parameters(closing)
    closed = closed_system(problem, tuple(closure.kind for closure in closing))
    last = Linearised(problem, x, closing)

    def linearise(x: np.ndarray) -> tuple[np.ndarray, Callable[[], Solver]]:
        nonlocal last
        last = Linearised(problem, x, closing)
        return last.equations, lambda: last.factors.solve

    def values(x: np.ndarray) -> np.ndarray:
        return closed.equations(x, given)[0]

    found = newton(linearise, x, _block_scale(problem, x), equations=values, chord=chord)
    return replace(found, last=last) if found.drift <= SERVES else found


def newton(
    linearise: Linearisation,
    x: np.ndarray,
    scale: np.ndarray,
    *,
    tol: float = 1e-11,
    max_iterations: int = 12,
    equations: Callable[[np.ndarray], np.ndarray] | None = None,
    chord: float = CHORD,
) -> Correction:
    """Newton's method for a square system.

    Parameters
    ----------
    linearise : callable
    x : ndarray, shape (n,)
    scale : ndarray, shape (n,)
        Sizes by which updates are measured.
    tol : float
        Largest scaled update at which to stop; also where rounding lets it get no smaller.
    max_iterations : int
    equations : callable, optional
        The equations alone.  With them, the last updates reuse the factors at hand.
    chord : float
        Updates below this size do.
    """
    previous, step, update, drift = np.inf, np.inf, np.zeros_like(x), 0.0
    solve: Solver | None = None
    for iteration in range(1, max_iterations + 1):
        kept = equations is not None and step < min(chord, CONTRACTION * previous)
        try:
            if kept:
                assert equations is not None
                values = equations(x)
            else:
                values, factorise = linearise(x)
            if not float(np.abs(values).max()) < math.inf:  # also where it is not a number
                return Correction(x, False, iteration, np.inf, update)
            if not kept:
                solve, drift = factorise(), 0.0
            assert solve is not None
            update = solve(-values)
        except (np.linalg.LinAlgError, RuntimeError, ValueError):
            heard.check()  # CasADi may have met an interrupt
            return Correction(x, False, iteration, np.inf, update)
        previous, step = step, float((np.abs(update) / scale).max())
        if kept and previous > ROUGH:  # below, what rounding leaves does not shrink
            drift = max(drift, 2.0 * step / previous)
        if not step <= 1e3:  # also where it is not a number
            return Correction(x, False, iteration, step, update)
        x = x + update
        # Rounding ends it, or a root that is nearly double, where each step changes all of the Jacobian.
        stuck = not kept and tol <= step < 1e4 * tol and step > 0.5 * previous
        if step < tol or stuck:
            return Correction(x, True, iteration, step, update, np.inf if stuck else drift)
        if kept and previous > ROUGH and drift * step < AHEAD * tol:
            # The factors leave that share of each update to the next.
            return Correction(x, True, iteration, drift * step, drift * update, drift)
    return Correction(x, False, max_iterations, step, update)


def _block_scale(problem: Discretisation, x: np.ndarray) -> np.ndarray:
    """Size of each unknown's block: its fields together, every scalar for itself."""
    scale = 1.0 + np.abs(x)
    for block in problem.blocks:
        if block.stop > block.start:
            scale[block] = scale[block].max()
    return scale


def sharper(problem: Discretisation) -> SpectralDiscretisation | None:
    """Return the same problem with alpha/A among the unknowns; None where that gains nothing."""
    tip = problem.phases[0]
    if not _is_spectral(problem) or problem.settings.low_pressure:
        return None
    return problem.with_form(low_pressure=True) if tip.lets_go and tip.lost is not None else None


def _is_spectral(problem: Discretisation) -> TypeGuard[SpectralDiscretisation]:
    """Whether it is the paper's scene in the spectral form; other scenes have their own unknowns."""
    return isinstance(problem, SpectralDiscretisation) and isinstance(problem.settings, Spectral)


def usual(problem: Discretisation, x: np.ndarray) -> tuple[Discretisation, np.ndarray]:
    """Return a solution in the usual unknowns."""
    if not _is_spectral(problem) or not problem.settings.low_pressure:
        return problem, x
    there = problem.with_form(low_pressure=False)
    return there, problem.in_form(x, there)


def correct_sharply(problem: Discretisation, x: np.ndarray, closing: Sequence[Closing]) -> Correction | None:
    """Correct with alpha/A among the unknowns; the outcome is in the usual ones, None where that fails."""
    other = sharper(problem)
    if other is None:
        return None
    assert isinstance(problem, SpectralDiscretisation)
    found = correct(other, problem.in_form(x, other), closing)
    if not found.converged and found.step < HALVING:
        found = correct(other, found.x, closing)
    if not found.converged:
        return None
    there, before = (other.in_form(each, problem) for each in (found.x, found.x - found.update))
    return Correction(there, True, found.iterations, found.step, there - before)
