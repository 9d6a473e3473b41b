"""Solutions at pressures far below T0, with the digits that 1 - p/T0 has lost.

The usual unknowns hold p as alpha1/A, its distance from T0, which suits the branch from T on.  A slender
rod comes down to a millionth of T0, of which 1 - p/T0 keeps ten digits, and beside the least pressure
the length answers to every one of them.  Where the bond has let the tip go, nothing but p acts on it:
with alpha/A among the unknowns instead no larger term hides it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeGuard

import numpy as np

from .closures import Closing
from .discretisation import Discretisation
from .newton import Correction, correct
from .spectral import Spectral, SpectralDiscretisation

#: Updates below this size go on: beside the least pressure, a double root, each is half of the one before.
HALVING = 1e-3


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
