"""Sensitivities of a scene: its free number by everything else, through one solve of the linearised residual.

With v the solution of J^T v = df/dx, where J is the residual of the scene bordered by what is given,

    df = - v . (R_q dq + E_given d(given)),

with q all known numbers of the scene over their units of T0 and eta.  As eta = (k/T0)^(1/3), the same
gradient has the derivatives by k, T0 and y0.
"""

from __future__ import annotations

import numpy as np

from ..base.errors import AtFold
from ..base.threads import one_thread
from ..equilibria.result import Equilibrium
from ..equilibria.scene_question import COMMON, SceneQuestion
from ..model.dimension import RATIO_POWERS
from ..model.rod import MATERIAL, UNITS
from ..model.scene import Scene
from ..residual.linear import Linearised
from ..residual.scene_spectral import SceneDiscretisation
from ..residual.shape import Solution
from ..residual.solved_again import solved_again
from .derivatives import Sensitivities
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
    return _in_units(eq, question, fine, errors)


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
    return rates | dict(zip((c.kind for c in question.closures), by_given.tolist(), strict=True))


def _in_units(
    eq: Equilibrium, question: SceneQuestion, rates: dict[str, float], errors: dict[str, float]
) -> Sensitivities:
    """Chain rule: value = U F(r, q), with q = v/U_q, where U and U_q are powers of T0 and eta."""
    scene, rod = question.scene, question.scene.rod
    own = {name: scene.numbers[name] for name in scene.numbers if name != question.free} | question.given
    kinds = {name: COMMON.get(name) or scene.dimensions[name] for name in own}
    material = np.array([getattr(rod, name) for name in MATERIAL])
    U, F = question.dimension.size(rod), eq.answer
    # d log / d log k, T0, y0 of what the value is made of.
    response = {"ratio": rod.ratio * RATIO_POWERS} | {name: -own[name] * kinds[name].powers for name in own}
    slopes = U * (F * question.dimension.powers + sum(rates[n] * part for n, part in response.items()))
    doubts = U * sum(errors[name] * np.abs(part) for name, part in response.items())
    sizes = {name: kind.size(rod) for name, kind in kinds.items()}
    named = dict.fromkeys(MATERIAL, "") if rod.dimensionless else dict(UNITS)
    return Sensitivities(
        of=question.free,
        value=U * F,
        parameters=dict(zip(MATERIAL, material.tolist(), strict=True))
        | {name: value * sizes[name] for name, value in own.items()},
        derivatives=dict(zip(MATERIAL, (slopes / material).tolist(), strict=True))
        | {name: U * rates[name] / size for name, size in sizes.items()},
        errors=dict(zip(MATERIAL, (doubts / material).tolist(), strict=True))
        | {name: U * errors[name] / size for name, size in sizes.items()},
        dimensionless=rates,
        units=named
        | {name: kind.unit_of(rod) for name, kind in kinds.items()}
        | {question.free: question.dimension.unit_of(rod)},
    )


def _at_fold(question: SceneQuestion) -> AtFold:
    return AtFold(
        f"{question.words}: what is given turns round at this equilibrium, and the {question.free} has no"
        " derivative there.",
        remedy="Differentiate at another state, or leave another number free.",
    )
