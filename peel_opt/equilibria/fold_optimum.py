"""The fold as an optimum: the least lambda at which a detached equilibrium exists."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base.checks import known_beta0, positive
from ..base.errors import NoEquilibrium, NotConverged
from ..continuation.primary import primary_branch
from ..model.bond import LINEAR
from ..residual import programme
from ..residual.closures import Closure
from ..residual.discretisation import Transcription, require_transcription
from ..residual.shooting import Shooting

#: The last beta0 at which the branch through T has a fold, where the fold curve turns.
LAST_FOLD = 37.546


@dataclass(frozen=True)
class FoldOptimum:
    """The fold in lambda at one beta0, found as a minimum."""

    beta0: float
    lam: float
    alpha1: float
    iterations: int


def least_lambda(beta0: float, *, transcription: Transcription | None = None) -> FoldOptimum:
    """Minimise lambda over all detached equilibria at fixed beta0, by IPOPT.

    The constraints are the discretised (12) with the amplitude divided out, so that the
    straight rod, which exists at every lambda, is not among the candidates.  The start is a
    state walked to beside the fold, not the fold located on the branch.

    Parameters
    ----------
    beta0 : float
    transcription : Transcription, optional
        Default: multiple shooting with 24 intervals.

    Returns
    -------
    FoldOptimum

    Raises
    ------
    OutOfRange
        For a beta0 next to zero, or far above the last fold.
    NoEquilibrium
        If the branch through T has no fold at this beta0 (above 37.546).
    NotConverged
        If IPOPT fails.
    """
    sigma = math.cbrt(positive("beta0", known_beta0(beta0)))
    branch = primary_branch(LINEAR, Closure("length", sigma))
    fold = branch.continue_to("LP-lambda")
    if fold is None:
        if beta0 < LAST_FOLD:
            raise NotConverged(f"the fold in lambda at beta0 = {beta0:g} was not reached ({branch.ended}).")
        raise NoEquilibrium(
            f"at beta0 = {beta0:g} the branch through T has no fold in lambda.",
            remedy=f"Folds exist up to beta0 = {LAST_FOLD}; see fold_curve.",
            nearest=LAST_FOLD,
        )
    # At small beta0 the fold is so near to T that the first step of the walk is past it.
    walked = [p for p in branch.points if p.arclength > 0.0]
    start = ([p for p in walked if p.arclength < fold.point.arclength] or walked[:1])[-1]
    mesh = Shooting(intervals=24) if transcription is None else require_transcription(transcription)
    problem = mesh.discretise(LINEAR.pieces)
    solution = programme.minimise_lambda(problem, problem.pack(start.profile), Closure("length", sigma))
    if not solution.solved:
        raise NotConverged(
            f"IPOPT stopped with {solution.status} while minimising lambda at beta0 = {beta0:g}.",
            remedy="Try a finer transcription.",
        )
    s = problem.scalars(solution.x)
    return FoldOptimum(s.beta0, s.lam, s.alpha1, solution.iterations)
