"""Sensitivities: how an answer moves with the rod's material numbers and with what was given.

All of the problem is two numbers, P = f(eta/y0, sbar/eta); `surface` differentiates f exactly and the
chain rule does the rest.
"""

from __future__ import annotations

import numpy as np

from ..base.errors import InvalidInput
from ..equilibria.question import ASKS, answering, known_law
from ..equilibria.result import Equilibrium
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.rod import Rod
from ..residual.scene_spectral import SceneDiscretisation
from ..residual.shape import Solution
from .derivatives import Sensitivities, in_units
from .limits import LIMITS
from .scene_sensitivities import sensitivities_of_scene
from .surface import Gradient, gradient


def sensitivities(
    subject: Equilibrium | Rod, of: str | None = None, *, law: str | CohesiveLaw = "auto"
) -> Sensitivities:
    """Differentiate an equilibrium, or a limit of a rod, with respect to all it depends on.

    Exact derivatives of the discretised problem by the implicit function theorem, on meshes
    refined until two agree; results of every method and law are taken alike.  The free number of a
    scene is differentiated by the rod's numbers, by all that the scene names and by what was given.

    Parameters
    ----------
    subject : Equilibrium or Rod
        What was answered, or a rod with ``of``.
    of : str, optional
        For a rod: "readhesion_pressure", "least_length" or "longest_length" (the folds of its
        branch), or "maxwell_length".
    law : str or CohesiveLaw
        For a rod: the law of its bond, default law (8).  An equilibrium brings its own.

    Returns
    -------
    Sensitivities

    Raises
    ------
    AtFold
        If the given number turns round at this equilibrium: the derivatives are infinite there.
    NoEquilibrium
        If the rod has no such limit.
    InvalidInput
        If the limit is not defined under this law, or the equilibrium comes from a file, which
        keeps its shape only.
    NotConverged
        If the solution is lost on a finer mesh.

    Examples
    --------
    >>> from peel_opt import Rod, pressure_given_length
    >>> rod = Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
    >>> round(sensitivities(pressure_given_length(rod, length=1.9e-3)).elasticities["length"], 6)
    -3.203367
    """
    if isinstance(subject, Rod):
        if not isinstance(of, str) or of not in LIMITS:
            raise InvalidInput(
                f"sensitivities of a rod need a number to differentiate, got {of!r}.",
                remedy=f"Give of= one of {', '.join(map(repr, LIMITS))}, or an equilibrium.",
            )
        limit = LIMITS[of]
        found = limit.differentiate(subject.ratio, known_law(law) or COHESIVE)
        value = ASKS[limit.kind].given.dimension, found.value
        return in_units(subject, of, value, {}, {"ratio": float(found.derivatives[0])}, found.errors)
    if of is not None:
        raise InvalidInput(f"of={of!r} belongs to a rod; an equilibrium has one answer.")
    if law != "auto":
        raise InvalidInput("law= belongs to a rod; an equilibrium has its own law.")
    if not isinstance(subject, Equilibrium):
        raise InvalidInput(f"sensitivities need an equilibrium or a rod, got {type(subject).__name__}.")
    if subject.message:
        raise InvalidInput(
            f"there is no equilibrium to differentiate ({subject.status}): {subject.message}",
            remedy="Leave out throw=False to have this as an error of its own type.",
        )
    if not isinstance(subject.source, Solution):
        raise InvalidInput(
            "this equilibrium carries no discrete solution to differentiate.",
            remedy="Compute it again; files and other processes keep the shape only.",
        )
    if isinstance(subject.source.problem, SceneDiscretisation):
        return sensitivities_of_scene(subject)
    asks = answering(subject.answered, subject.given)
    found = gradient(subject.source, (asks.held, asks.given), asks.asked.read)
    if subject.rod is None:
        return _of_groups(subject, found)
    name = asks.given.name
    held = subject.given[name] if name in subject.given else getattr(subject, name)
    rates = dict(zip(("ratio", asks.given.attribute), found.derivatives.tolist(), strict=True))
    value, on = (asks.asked.dimension, found.value), {name: (asks.given.dimension, held)}
    return in_units(subject.rod, asks.asked.name, value, on, rates, found.errors)


def _of_groups(eq: Equilibrium, found: Gradient) -> Sensitivities:
    """d alpha1 by beta0 and lambda; at beta0 = 0 the gradient has it by beta0 already."""
    per_beta0 = 1.0 / (3.0 * found.given[0] ** 2) if eq.beta0 else 1.0
    scale = np.array([per_beta0, 1.0])
    names = ("beta0", "lam")
    derivatives = dict(zip(names, (scale * found.derivatives).tolist(), strict=True))
    errors = dict(zip(names, (scale * found.errors).tolist(), strict=True))
    parameters = {"beta0": eq.beta0, "lam": eq.lam}
    units = dict.fromkeys((*names, "alpha1"), "")
    return Sensitivities("alpha1", found.value, parameters, derivatives, errors, dict(derivatives), units)
