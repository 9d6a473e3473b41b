"""A state that was solved, once more on a finer mesh."""

from __future__ import annotations

import numpy as np

from ..base.errors import NotConverged
from .closures import Closure
from .discretisation import Discretisation
from .meshes import FINER
from .newton import correct
from .scene_spectral import SceneTranscription
from .spectral import Spectral

#: How far a state may be, relative to its size, from itself on a finer mesh.
APART = 0.1


def solved_again(
    problem: Discretisation, x: np.ndarray, given: tuple[Closure, ...]
) -> tuple[Discretisation, np.ndarray]:
    """Return the same state on a finer mesh, which tells the error of what is read off it.

    Parameters
    ----------
    problem : Discretisation
    x : ndarray
    given : tuple of Closure
        What it was asked at, beside the rod; without it, or at a fold of it, the tip angle or the length
        is held.

    Raises
    ------
    NotConverged
        If there is none beside it.
    """
    s, own = problem.scalars(x), problem.settings
    mesh = own.refined() if isinstance(own, Spectral | SceneTranscription) else FINER
    finer = mesh.discretise(problem.phases)
    rod = Closure("ratio", s.ratio) if s.sigma else Closure("length", 0.0)
    start = problem.prolonged(x, finer)
    # At a fold another number is regular; which one, the state decides.
    others = [(*given[:-1], Closure(*held)) for held in (("amplitude", s.A), ("length", s.sigma))]
    for closing in (given, *others) if given else others:
        found = correct(finer, start, (rod, *closing))
        here, there = x[problem.tail], found.x[finer.tail]
        if found.converged and np.max(np.abs(there - here) / (1.0 + np.abs(here))) < APART:
            return finer, found.x
    raise NotConverged(
        "the state could not be solved again on a finer mesh, to tell the error of what is read off it.",
        remedy="Compute it with a finer method or a smaller tol.",
    )
