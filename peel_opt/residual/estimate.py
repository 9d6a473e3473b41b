"""The error of a discrete solution from one residual on a finer mesh, without a second solve.

What a finer mesh would change of a solution is, to first order, a step of Newton's method there.
Its right side is the residual of the prolonged solution, and its matrix on the smooth functions
that matter is that of the mesh at hand: the residual is restricted to it and sent through the
factors that are there already.  Weighted with the adjoint of the answer this is |w R_fine|; the
step has it for every scalar at once.

At 16 nodes, refined to 24, this is 0.65 to 1.3 times the true error of an answer, in the median 0.9;
what the finer mesh does not see either makes it too low.  At 8 to 12 nodes it may be a hundred
times too low.
"""

from __future__ import annotations

import numpy as np

from .discretisation import Transcription
from .linear import Linearised
from .spectral import Spectral, SpectralDiscretisation

#: Fewer nodes need not resolve a shape, nor see that they do not.
RESOLVING = 16

#: How much larger than the estimate an error may be, with room to spare.
SAFE = 2.5


def can_estimate(transcription: Transcription | None) -> bool:
    """Whether one residual tells the error of solutions of a transcription."""
    return isinstance(transcription, Spectral) and transcription.nodes >= RESOLVING


def defect(problem: SpectralDiscretisation, x: np.ndarray) -> np.ndarray:
    """Residual of a solution on the refined mesh, as the equations of its own mesh.

    Parameters
    ----------
    problem : SpectralDiscretisation
    x : ndarray, shape (n,) or (k, n)
        A solution, or a stack of them.

    Returns
    -------
    ndarray, shape (n - 2,) or (k, n - 2)
        The two closures of a question are left out: they hold on every mesh.
    """
    finer = problem.settings.refined().discretise(problem.phases)
    there = problem.prolonged(x, finer)
    return problem.restricted(finer.residual(there) if x.ndim == 1 else finer.residuals(there), finer)


def refinement(at: Linearised) -> np.ndarray:
    """First-order change of a solution's unknowns by the refined mesh.

    Parameters
    ----------
    at : Linearised
        The solution, closed by what is given, of a transcription that `can_estimate`.

    Returns
    -------
    ndarray, shape (n,)
    """
    assert isinstance(at.problem, SpectralDiscretisation)
    missed = np.concatenate([defect(at.problem, at.x), np.zeros(len(at.closing))])
    return at.factors.solve(-missed)
