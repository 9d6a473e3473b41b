"""The equations of a fold in lambda: an equilibrium together with its null vector.

At a fold of the branch at fixed beta0 the linearised system has a null vector with no
component in sigma and lambda.  Equilibrium and null vector together,

    R(x) = 0,   R_x(x) v = 0,   v_sigma = v_lambda = 0,   v_A = 1,

are one equation short of square: a smooth curve, also where its picture in the
(beta0, lambda) plane turns round or has a cusp.  They have the form of a discretised (12) with
the null vector as further fields, so that the walk and the searches of `continuation` serve
for the folds too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np

from ..base.errors import NotConverged
from ..base.threads import one_thread
from ..model.bond import LINEAR, CohesiveLaw
from ..residual.closures import Closure, Plane
from ..residual.discretisation import Discretisation, Phases, Profile, Transcription
from ..residual.linear import Linearised
from ..residual.meshes import GROUPS
from ..residual.spectral import Spectral, SpectralDiscretisation
from .family import Family
from .points import Point, place_of
from .primary import primary_branch

#: Entries of the null vector that are known: its size, and what stays given at the fold.
NULL_VECTOR = {"A": 1.0, "sigma": 0.0, "lam": 0.0}


class FoldSystem(Discretisation):
    """Equilibrium and null vector for one phase of the linear law.

    Unknowns are v without its known entries, and then x.
    """

    def __init__(self, equilibrium: SpectralDiscretisation) -> None:
        self.equilibrium = equilibrium
        self.known = {equilibrium.column(name): value for name, value in NULL_VECTOR.items()}
        self.free = [i for i in range(equilibrium.size) if i not in self.known]
        super().__init__(equilibrium.phases, len(self.free) + equilibrium.tail.start)

    def residual_expression(self) -> ca.MX:
        """R(x) and R_x(x) v; unlike R itself one entry fewer than unknowns, not two."""
        base = self.equilibrium
        v = ca.MX.zeros(base.size)
        v[self.free] = self.x[: len(self.free)]
        for column, value in self.known.items():
            v[column] = value
        both = ca.vertcat(base.expression, ca.jtimes(base.expression, base.x, v))
        whole = ca.Function("fold", [base.x, self.x], [both])
        expression: ca.MX = whole(self._state, self.x)
        return expression

    def sample_expression(self, zeta: np.ndarray) -> ca.MX:
        """Fields of the equilibrium."""
        return self.equilibrium.sampler(zeta).function(self._state)

    @one_thread
    def pack_fields(self, profile: Profile) -> np.ndarray:
        """Null vector and fields of a profile that is near a fold."""
        x, s = self.equilibrium.pack(profile), profile.scalars
        # At a fold lambda rests along the branch at this beta0.
        held = Closure("length", s.sigma), Closure("amplitude", s.A)
        along = Linearised.at(self.equilibrium, x, *held).response()[:, 1]
        return np.concatenate([along[self.free], x[: self.equilibrium.tail.start]])

    @property
    def _state(self) -> ca.MX:
        return self.x[len(self.free) :]


@dataclass(frozen=True)
class FoldEquations(Transcription):
    """A transcription of (12) with the equations of a fold added."""

    mesh: Spectral = GROUPS

    def gain_at(self, problem: FoldSystem, x: np.ndarray) -> float:
        """That of the mesh, for the equilibrium."""
        return self.mesh.gain_at(problem.equilibrium, x[len(problem.free) :])

    def discretise(self, phases: Phases) -> FoldSystem:
        """Return the compiled system for one phase."""
        return _discretise(self, phases)

    def refined(self) -> FoldEquations:
        """Return the same on a finer mesh."""
        return replace(self, mesh=self.mesh.refined())


@lru_cache(maxsize=16)
def _discretise(settings: FoldEquations, phases: Phases) -> FoldSystem:
    return FoldSystem(settings.mesh.discretise(phases))


#: What a family without a closure has in its place.
NO_CLOSURE = Closure("none", math.nan)


@dataclass(frozen=True)
class FoldFamily(Family):
    """The folds over beta0.  They are a curve without any closure: the null vector is one."""

    law: CohesiveLaw = LINEAR
    transcription: Transcription = FoldEquations()
    closure: Closure = NO_CLOSURE

    @property
    def system(self) -> Discretisation:
        """The discretised equations."""
        return self.transcription.discretise(self.law.pieces)

    @property
    def closures(self) -> tuple[Closure, ...]:
        """None."""
        return ()

    def errors(self, points: Sequence[Point]) -> np.ndarray:
        """Distance of each point from the curve on the refined mesh, in the metric of the arclength."""
        finer = replace(self, transcription=self.transcription.refined())
        found = [finer.solve(p.profile, Plane.across(p.place, p.direction)) for p in points]
        errors = [
            math.inf
            if f is None
            else self.transcription.whole_error(p.problem, p.x, float(np.linalg.norm(place_of(*f) - p.place)))
            for p, f in zip(points, found, strict=True)
        ]
        return np.array(errors)

    def start(self, beta0: float) -> Point:
        """Return the fold of the branch through T at ``beta0``; from there the curve goes up in lambda.

        Raises
        ------
        NotConverged
            If that branch has no fold, or the fold does not satisfy the equations.
        """
        sigma = Closure("length", math.cbrt(beta0))
        branch = primary_branch(self.law, sigma)
        fold = branch.continue_to("LP-lambda")
        solved = self.solve(fold.point.profile, sigma) if fold is not None else None
        if solved is None:
            raise NotConverged(
                f"no fold in lambda was found at beta0 = {beta0:g}.", remedy="Start elsewhere."
            )
        problem, result = solved
        return self.point(problem, result.x, np.array([0.0, 0.0, 0.0, 1.0]), 0.0, result.iterations)
