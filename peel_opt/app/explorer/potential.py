"""Which effective potential belongs to a branch, and how far it is from the state."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass

import numpy as np

from ...analysis.branch_potential import branch_potential, points_potential
from ...analysis.normal_form import NormalForm
from ...analysis.potential import EffectivePotential, Level
from ...base.errors import InvalidInput, NoEquilibrium, NotConverged
from ...continuation.family import Family
from ...continuation.landing import points_at
from ...continuation.points import Point
from ...model.named_laws import law_named
from ...plots.panels import Panel
from ...plots.potential import NAMED
from ...residual.closures import Closure
from ...residual.meshes import PATH
from .curves import Curve

#: Half the width of the ball, as a share of the picture's.
_HIDDEN = 0.02


@dataclass(frozen=True, eq=False)
class Landscape:
    """A potential, where it comes from, and (lambda, alpha1) of its named points."""

    potential: EffectivePotential
    source: str
    named: dict[str, Level]
    missing: tuple[str, ...]


def landscape(beta0: float, curve: Curve | None) -> Landscape:
    """Return the potential of a curve at fixed beta0; of the normal form (33) without one."""
    potential, source = None, ""
    if curve is not None and (curve.special("LP-lambda") is not None or beta0 == 0.0):
        try:
            walk, branch = curve.walk, curve.branch
            potential = _of_walk(beta0, walk, branch.law) if walk else branch_potential(branch)
            source = f"quadrature of the {curve.method}"
        except InvalidInput:
            potential = None
    if potential is None:
        potential, source = NormalForm.exact().at(beta0), "normal form (33)"
    named, missing = {}, []
    for name in NAMED:
        try:
            named[name] = getattr(potential, name)()
        except (NoEquilibrium, NotConverged):
            missing.append(name)
    return Landscape(potential, source, named, tuple(missing))


def _of_walk(beta0: float, points: tuple[Point, ...], law: str) -> EffectivePotential:
    """Potential of a quick walk; under law (8) it takes a point where the tip passes y0, at p = T0/2, too."""
    kinks: list[Point] = []
    bond = law_named(law)
    if bond is not None and bond.kinks:
        family = Family(bond, PATH, Closure("length", math.cbrt(beta0)))
        with contextlib.suppress(NotConverged):
            kinks = points_at(family, list(points), "alpha1", -0.5 * beta0)[:1]
    after = next((i for i, p in enumerate(points) if p.scalars.alpha1 < -0.5 * beta0), len(points))
    return points_potential(beta0, [*points[:after], *kinks, *points[after:]], kinks)


def too_far(panel: Panel, off: float) -> bool:
    """Whether a potential misses the state by more than the ball hides."""
    return math.isfinite(off) and off > _HIDDEN * (panel.x.high - panel.x.low)


def off_by(found: Landscape, lam: float, alpha1: float) -> float:
    """Distance from a solved state to the nearest critical point of the potential at its lambda."""
    places = np.array([0.0, *found.potential.alpha1(lam)])
    return float(np.abs(places - alpha1).min())
