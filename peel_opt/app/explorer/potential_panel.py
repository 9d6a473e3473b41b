"""The effective potential (35) with fold, Maxwell point and delay, and the ball that is the state."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass

import numpy as np

from ...analysis.branch_potential import branch_potential, points_potential
from ...analysis.normal_form import NormalForm
from ...analysis.potential import EffectivePotential, Level
from ...base.errors import InvalidInput, NoEquilibrium, NotConverged
from ...base.units import digits_left
from ...continuation.family import Family
from ...continuation.points import Point
from ...equilibria.trace import landings
from ...model.bond import COHESIVE
from ...residual.closures import Closure
from ...residual.meshes import PATH
from .curves import Curve
from .panels import Axis, Line, Mark, PotentialPanel

#: Points of a curve.
_POINTS = 161

#: The landing of the delay is in the picture unless it is this many times deeper than all else.
_DEEPEST = 3.0

#: Half the width of the ball, as a share of the picture's.
_HIDDEN = 0.02

WORDS = {"fold": "fold", "maxwell": "Maxwell", "delay": "delay"}

#: Letters of the three values of lambda, and what they mean.
NAMED = {
    "fold": ("F", "fold: the detached minimum appears"),
    "maxwell": ("M", "Maxwell: both minima are equally deep"),
    "delay": ("D", "delay: the adhered minimum is lost at λ = 0"),
}


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
            solved = curve.origin
            if isinstance(solved, tuple):
                potential = _of_walk(beta0, solved, curve.law)
            else:
                potential = branch_potential(solved)
            source = f"quadrature of the {curve.method}"
        except InvalidInput:
            potential = None
    if potential is None:
        potential, source = NormalForm.exact().at(beta0), "normal form (33)"
    named, missing = {}, []
    for name in NAMED:
        try:
            named[name] = getattr(potential, name)()
        except NoEquilibrium:
            missing.append(name)
    return Landscape(potential, source, named, tuple(missing))


def _of_walk(beta0: float, points: tuple[Point, ...], law: str) -> EffectivePotential:
    """Potential of a quick walk; under law (8) it takes a point where the tip passes y0, at p = T0/2, too."""
    kinks: list[Point] = []
    if law == COHESIVE.name:
        family = Family(COHESIVE, PATH, Closure("length", math.cbrt(beta0)))
        with contextlib.suppress(NotConverged):
            kinks = landings(family, list(points), "alpha1", -0.5 * beta0)[:1]
    after = next((i for i, p in enumerate(points) if p.scalars.alpha1 < -0.5 * beta0), len(points))
    return points_potential(beta0, [*points[:after], *kinks, *points[after:]], kinks)


def potential_panel(found: Landscape, lam: float, alpha1: float | None) -> PotentialPanel:
    """Return the picture at ``lam``, with the ball at ``alpha1``."""
    potential, named = found.potential, found.named
    roots = [x for x in (0.0, *potential.alpha1(lam)) if np.isfinite(x)]
    places = [*roots, *(x for _, x in named.values()), *([] if alpha1 is None else [alpha1])]
    span = max(max(places) - min(places), 1e-3)
    low = max(min(places) - 0.22 * span, potential.domain[0])
    high = min(max(places) + 0.3 * span, potential.domain[1])
    x = np.linspace(low, high, _POINTS)
    lines = [
        Line(name, x, np.asarray(potential(x, level.lam)), f"{WORDS[name]} {_digits(level)}".rstrip())
        for name, level in named.items()
    ]
    lines.append(Line("current", x, np.asarray(potential(x, lam)), f"λ = {lam:.4g}"))
    heights = [0.0, *(float(potential(v, lam)) for v in roots if v <= 0.0)]
    if alpha1 is not None and potential.domain[0] <= alpha1 <= potential.domain[1]:
        heights.append(float(potential(alpha1, lam)))
    points = {name: (at, float(potential(at, value))) for name, (value, at) in named.items()}
    heights += [y for name, (_, y) in points.items() if name != "delay"]
    if "delay" in points and abs(points["delay"][1]) < _DEEPEST * np.ptp(heights):
        heights.append(points["delay"][1])
    size = max(np.ptp(heights), 1e-12)
    bottom, top = min(heights) - 0.3 * size, max(heights) + 0.45 * size
    marks = []
    for name, (at, y) in points.items():
        letter, meaning = NAMED[name]
        below = y < bottom
        # The landing of the delay may be far below the wells that are looked at.
        marks.append(
            Mark(name, letter + ("↓" if below else ""), at, bottom + 0.04 * size if below else y, meaning)
        )
    ball = None
    if alpha1 is not None and potential.domain[0] <= alpha1 <= potential.domain[1]:
        ball = (alpha1, float(potential(alpha1, lam)))
    return PotentialPanel(
        Axis("extra pressure α₁", low, high),
        Axis("effective potential Uₑ", bottom, top),
        tuple(lines),
        tuple(marks),
        ball,
        found.source,
    )


def _digits(level: Level) -> str:
    """A named lambda to the digits that its error leaves, four at most; nothing where it is 0."""
    if not level.lam:
        return ""
    return f"{level.lam:.{digits_left(level.lam, level.error, 4)}g}"


def too_far(panel: PotentialPanel, off: float) -> bool:
    """Whether a potential misses the state by more than the ball hides."""
    return math.isfinite(off) and off > _HIDDEN * (panel.x.high - panel.x.low)


def off_by(found: Landscape, lam: float, alpha1: float) -> float:
    """Distance from a solved state to the nearest critical point of the potential at its lambda."""
    places = np.array([0.0, *found.potential.alpha1(lam)])
    return float(np.abs(places - alpha1).min())
