"""Sensitivities of a scene: its free number by everything else, through one solve of the linearised residual.

With v the solution of J^T v = df/dx, where J is the residual of the scene bordered by what is given,

    df = - v . (R_q dq + E_given d(given)),

with q all known numbers of the scene over their units of T0 and eta.
"""

from __future__ import annotations

import numpy as np

from ..base.errors import AtFold
from ..base.threads import one_thread
from ..equilibria.result import Equilibrium
from ..equilibria.scene_question import COMMON, SceneQuestion
from ..model.scene import Scene
from ..residual.linear import Linearised
from ..residual.scene_spectral import SceneDiscretisation
from ..residual.shape import Solution
from ..residual.solved_again import solved_again
from .derivatives import Sensitivities, in_units
from .surface import UNKNOWN

#: Times the difference of two meshes that is reported, and what one solve loses to rounding, relatively.
SAFE, ROUNDING = 4.0, 1e-12


@one_thread
def sensitivities_of_scene(eq: Equilibrium) -> Sensitivities:
    """Differentiate the free number of a scene by the rod, by all numbers of the scene and by what was given.

    Raises
    ------
    AtFold
        If what was given turns round there.
    NotConverged
        If the state cannot be solved again on a finer mesh.
    """
    assert isinstance(eq.scene, Scene)
    assert isinstance(eq.source, Solution)
    free = {"pressure_ratio": "pressure", "length_ratio": "length"}.get(eq.answered, eq.answered)
    given = {name: eq.given[f"{name}_ratio"] for name in COMMON if name != free}
    question = SceneQuestion(eq.scene, free, given)
    coarse = _gradient(question, eq.source.problem, eq.source.x)
    fine = _gradient(question, *solved_again(eq.source.problem, eq.source.x, eq.asked_at))
    size = max(abs(rate) for rate in fine.values())
    errors = {name: SAFE * abs(rate - coarse[name]) + ROUNDING * size for name, rate in fine.items()}
    if not max(errors.values()) <= UNKNOWN * size:
        raise _at_fold(question)
    rod, own, kinds = eq.scene.rod, eq.scene.numbers | given, eq.scene.dimensions | COMMON
    on = {name: (kinds[name], own[name] * kinds[name].size(rod)) for name in fine if name != "ratio"}
    value = question.dimension, eq.answer
    return in_units(rod, free, value, on, fine, np.array([errors[name] for name in fine]))


def _gradient(question: SceneQuestion, problem: object, x: np.ndarray) -> dict[str, float]:
    """Return the derivatives of the free number by "ratio", the numbers of the scene and what is given."""
    assert isinstance(problem, SceneDiscretisation)
    at = Linearised.at(problem, x, *question.closures)
    try:
        adjoint = at.factors.solve(question.weights(problem, x), transposed=True)
    except (np.linalg.LinAlgError, RuntimeError):
        raise _at_fold(question) from None
    closures = len(question.closures)
    by_given = -adjoint[-closures:] @ at.by_given
    by_numbers = -adjoint[:-closures] @ problem.by_numbers(x)
    found = dict(zip(problem.settings.given, by_numbers.tolist(), strict=True))
    rates = {name: found[name] for name in question.scene.numbers if name != question.free}
    ratio, *given = zip((c.kind for c in question.closures), by_given.tolist(), strict=True)
    return dict([ratio]) | rates | dict(given)


def _at_fold(question: SceneQuestion) -> AtFold:
    return AtFold(
        f"{question.words}: what is given turns round at this equilibrium, and the {question.free} has no"
        " derivative there.",
        remedy="Differentiate at another state, or leave another number free.",
    )
