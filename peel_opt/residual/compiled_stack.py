"""States of any layout as a stack: the compiled spectral form in the place of `Stack`.

What NumPy does for all states of a simple layout at once, the compiled residual does here for one after the
other; the algebra is that of the stack in both.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np

from ..model.equations import SCALARS, Scalars
from .discretisation import Discretisation, Phases
from .linear import closed_system
from .spectral import Spectral, SpectralDiscretisation
from .stack import TAIL, Stack, serves, stack_of


class CompiledStack:
    """(12) for many states at once, in the unknowns of the discretised problem itself.

    Parameters
    ----------
    settings : Spectral
    phases : tuple of Piece
    """

    #: There is no arc without unknowns.
    free = 0

    def __init__(self, settings: Spectral, phases: Phases) -> None:
        self.settings, self.phases = settings, phases
        self._problem = settings.discretise(phases)
        self.nodes, self.size = self._problem.field_count, self._problem.size
        #: Unknowns that the shape depends on beside the scalars.
        self.shape = self.size - len(SCALARS)
        #: Which equation is the identity; none where the tip is held.
        self.identity_row = self._problem.identity_row

    @classmethod
    @lru_cache(maxsize=16)
    def of(cls, settings: Spectral, phases: Phases) -> CompiledStack:
        """Return the stack of a mesh and a layout, remembered."""
        return cls(settings, phases)

    def scalars(self, x: np.ndarray) -> Scalars:
        """The four scalars of states, each an array."""
        return Scalars(*np.ascontiguousarray(x[:, TAIL].T))

    def shares(self, x: np.ndarray) -> np.ndarray:
        """Share of the length that is an arc without unknowns: none."""
        return np.zeros(len(x))

    def ends(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Y at the tip and Theta at the plate."""
        Y, Theta = np.array([self._problem.profile(row).ends for row in x]).T
        return Y, Theta

    def spread(self, x: np.ndarray) -> np.ndarray:
        """Unknowns of the same states as ``settings.discretise(phases)`` has them: these."""
        return x

    def spread_rates(self, x: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Directions of change of states as those of what `spread` makes of them: these."""
        return rates

    def gathered(self, x: np.ndarray) -> np.ndarray:
        """Unknowns here of states that are `spread`: these."""
        return x

    @cached_property
    def finer(self) -> CompiledStack:
        """The same on the next finer mesh."""
        return CompiledStack.of(self.settings.refined(), self.phases)

    def prolonged(self, x: np.ndarray) -> np.ndarray:
        """Return the same states on the next finer mesh."""
        return self._problem.prolonged(x, self.finer._problem)

    def restricted(self, residual: np.ndarray) -> np.ndarray:
        """Return a residual on the next finer mesh as the equations of this one."""
        return self._problem.restricted(residual, self.finer._problem)

    def equations(self, x: np.ndarray, kinds: Sequence[str], given: np.ndarray) -> np.ndarray:
        """Residual of every state with the closures of a question below it, shape (states, size)."""
        return closed_system(self._problem, tuple(kinds)).equations.many(x, given)[0]

    def linearise(
        self, x: np.ndarray, kinds: Sequence[str], given: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """`equations` and their Jacobian, shape (states, size, size)."""
        values, jacobian = closed_system(self._problem, tuple(kinds)).system.many(x, given)
        return values, jacobian


#: What Newton's method for many states works on.
AnyStack = Stack | CompiledStack


def stacked(problem: Discretisation, kinds: tuple[str, ...]) -> AnyStack | None:
    """Return the stack of the states of a problem; None where its matrices are not dense.

    Parameters
    ----------
    problem : Discretisation
    kinds : tuple of str
        Of the closures.
    """
    if not isinstance(problem, SpectralDiscretisation) or not isinstance(problem.settings, Spectral):
        return None
    if problem.settings.low_pressure or problem.settings.free_arc:
        return None
    if serves(problem.phases):
        return stack_of(problem.settings, problem.phases)
    dense = closed_system(problem, kinds).pattern is None
    return CompiledStack.of(problem.settings, problem.phases) if dense else None
