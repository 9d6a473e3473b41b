"""A design problem: what is free, what is wanted, and what is to be least."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from ...base.checks import positive
from ...base.errors import Infeasible, InvalidInput
from ...equilibria.question import known_law
from ...model.bond import COHESIVE, CohesiveLaw
from ...model.rod import Rod
from .material import Free, Material, material
from .targets import Target

#: What a public call can be met to, and what is still to meet a target.
LEAST_TOL, LARGEST_TOL = 1e-9, 1e-2


@dataclass(frozen=True, eq=False)
class DesignProblem:
    """A design problem in terms of the logarithms of the free numbers.

    Parameters
    ----------
    material : Material
    targets : tuple of Target
    law : str or CohesiveLaw
    objective : ndarray, shape (m,)
        Weights of the logarithms in what is minimised.
    of : str
        The free number that is minimised or maximised; the first one if nothing is.
    square : bool
        Whether there are as many targets to be met exactly as free numbers, and no others.
    tol : float
        Logarithm by which a target may be missed.
    """

    material: Material
    targets: tuple[Target, ...]
    law: str | CohesiveLaw
    objective: np.ndarray
    of: str
    square: bool
    tol: float

    @classmethod
    def posed(
        cls,
        known: Rod | Mapping[str, object],
        free: Free,
        targets: Target | Sequence[Target],
        minimise: str | None,
        maximise: str | None,
        law: str | CohesiveLaw,
        tol: float,
    ) -> Self:
        """Check that the question determines an answer.

        Raises
        ------
        InvalidInput
            If it does not.
        Infeasible
            If the targets exclude each other.
        """
        stuff = material(known, free)
        several = isinstance(targets, Sequence) and not isinstance(targets, str)
        wanted = (targets,) if isinstance(targets, Target) else tuple(targets) if several else ()
        if not wanted or not all(isinstance(t, Target) for t in wanted):
            raise InvalidInput(
                "a design needs at least one Target.", remedy='Target("maxwell_length", equal="2 mm").'
            )
        if minimise is not None and maximise is not None:
            raise InvalidInput("give minimise or maximise, not both.")
        of = minimise or maximise
        if of is not None and of not in stuff.free:
            raise InvalidInput(f"{of!r} is not free.", remedy=f"Free are {', '.join(stuff.free)}.")
        if len({(t.quantity, t.given, t.sense) for t in wanted}) < len(wanted):
            raise InvalidInput(
                "two targets set the same number in the same sense.", remedy="Leave the weaker one out."
            )
        if not LEAST_TOL <= positive("tol", tol) <= LARGEST_TOL:
            raise InvalidInput(f"tol must lie between {LEAST_TOL:g} and {LARGEST_TOL:g}, got {tol:g}.")
        equal = sum(t.sense == "equal" for t in wanted)
        if equal > len(stuff.free):
            raise InvalidInput(f"{equal} targets to be met exactly need as many free numbers.")
        square = equal == len(stuff.free) == len(wanted)
        if of is None and not square:
            raise InvalidInput(
                f"{len(stuff.free)} free numbers and {equal} targets to be met exactly leave a choice.",
                remedy="Say which free number to minimise= or maximise=.",
            )
        bond = known_law(law) or COHESIVE
        if not (bond.falls_straight and bond.branch_ends):
            _require_meaning(stuff, known, wanted)
        if any(_exclude(a, b) for a in wanted for b in wanted):
            raise Infeasible(
                f"the targets exclude each other: {'; '.join(map(repr, wanted))}.",
                remedy="Relax or drop one of them.",
            )
        of = of or stuff.free[0]
        objective = np.array([float(name == of) for name in stuff.free]) * (-1.0 if maximise else 1.0)
        return cls(stuff, wanted, law, objective, of, square, float(tol))


def _require_meaning(stuff: Material, known: Rod | Mapping[str, object], targets: Sequence[Target]) -> None:
    """Refuse what is defined by law (8) alone, where the law is another."""
    if "work_of_separation" in stuff.free or (isinstance(known, Mapping) and "work_of_separation" in known):
        raise InvalidInput(
            "work_of_separation is T0 y0 / 2, which belongs to law (8).",
            remedy="Give adhesion_strength and adhesion_range.",
        )
    if any(t.quantity == "maxwell_length" for t in targets):
        raise InvalidInput("the Maxwell length belongs to law (8).", remedy="Leave out law=.")


def _exclude(a: Target, b: Target) -> bool:
    """Whether a bounds the quantity of b from below, above what b allows."""
    same = a.quantity == b.quantity and a.given == b.given
    return same and a.sense != "at_most" and b.sense != "at_least" and a.value > b.value
