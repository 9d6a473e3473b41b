"""The unfolded state that a question means, reached from a seed instead of along its branch."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.threads import one_thread
from ..residual.discretisation import Profile
from ..residual.linear import Linearised
from ..residual.meshes import PATH
from ..residual.newton import SolvedState, correct
from ..residual.stack import TAIL
from .question import Question
from .unfolded import Many, Traits, labels, on_charts, starts, strayed


@dataclass(frozen=True)
class Seeded:
    """A state that was reached from a seed, with its label."""

    solution: SolvedState
    state: str

    @property
    def profile(self) -> Profile:
        """The solution, sampled."""
        return self.solution.profile


@one_thread
def seeded(question: Question) -> tuple[Seeded, float, int] | None:
    """Return what `select` does of the state that a question means; None where a walk has to tell.

    It takes no walk, and says nothing of other states.  Whether it finds the state does not depend on what
    was asked before.
    """
    given = np.array([[closure.value for closure in question.given]])
    many = Many(question.asks, given, question.law, question.state)
    if question.near is not None or not many.taken()[0]:
        return None
    for names, rows in on_charts(many):
        if not rows.size:
            continue
        for start in starts(many, names):
            problem = PATH.discretise(start.stack.phases)
            found = correct(problem, start.stack.spread(start.x)[0], question.given)
            if not found.converged or strayed(found.x[None, TAIL], start.x)[0]:
                return None
            solution = SolvedState(problem, found, question.given)
            fields = solution.profile.values
            seen = Traits(
                Theta=fields[:, :, 0].reshape(1, -1),
                K=fields[:, :, 1].reshape(1, -1),
                height=solution.profile.heights()[:1, 0],
                share=problem.lengths(found.x)[None, :-1],
                tail=found.x[None, TAIL],
                along=Linearised.at(problem, found.x, *question.given).response()[None, TAIL],
            )
            label = labels(many, seen, start.sure)[0]
            return (Seeded(solution, str(label)), math.inf, 0) if label else None
    return None
