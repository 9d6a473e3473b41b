"""Which gap the identity leaves the tip of a rod, where it knows it without a solution.

Under a uniform pressure, a weight, a moment and a natural curvature, on a plate or a circle, nothing but the
gap g of the tip is in it,

    p (g - kw g^2/2) - w g + k (kappa(0) - kw)^2 / 2 = Phi(g) + G0,

and where no gap satisfies it there is no equilibrium, of any length.
"""

from __future__ import annotations

import math
from itertools import pairwise

from .bond import Affine
from .loads import Pressure, Weight
from .mixed_bonds import LINE, Opening
from .scene import Scene
from .tips import TipLoad

#: Width, as a share, to which the pressure is found beyond which there is no gap.
NARROW = 1e-12


def excess_over_gaps(scene: Scene, pressure: float) -> tuple[float, float] | None:
    """Return the least and the largest excess of what is put in over what the bond takes, at any gap.

    Parameters
    ----------
    scene : Scene
    pressure : float
        p/T0.

    Returns
    -------
    tuple of float, or None
        Both over T0 eta, infinite ones included; a tip has a gap only if zero lies between them.  None where
        the identity knows more than the gap, or where the flat rod is an equilibrium.
    """
    if not _knows_the_gap(scene):
        return None
    q = scene.numbers
    stored = 0.5 * scene.imposed_curvature**2 - q.get("line_energy", 0.0)
    if stored == 0.0:
        return None
    kw = float(scene.wall.curvature_of(q))
    pushed = pressure - q.get("weight", 0.0) * math.cos(q.get("tilt", 0.0))
    highest = 1.0 / kw if kw > 0.0 else math.inf  # the centre of a circle is nowhere further from it
    found = [stored]
    for start, stop, traction, slope, work in _pieces(scene):
        # On a piece Phi = work + traction (g - start) + slope (g - start)^2 / 2.
        linear = pushed * (1.0 - kw * start) - traction
        square = -0.5 * (pushed * kw + slope)
        first = pushed * (start - 0.5 * kw * start**2) + stored - work
        width = min(stop, highest) - start
        if width <= 0.0:
            break
        places = [width] if math.isfinite(width) else []
        if square and 0.0 < (turn := -0.5 * linear / square) < width:
            places.append(turn)
        found += [first + linear * at + square * at**2 for at in places]
        if not places or math.isinf(width):
            found.append(math.copysign(math.inf, square or linear) if square or linear else first)
    return min(found), max(found)


def last_pressure(scene: Scene, pressure: float) -> float:
    """Return the p/T0 nearest to one without a gap at which there is one.

    The excess grows with the pressure at every gap: where it is too large everywhere the pressure has to
    fall, where it is too small to rise.
    """

    def none(p: float) -> bool:
        bounds = excess_over_gaps(scene, p)
        assert bounds is not None
        return not bounds[0] <= 0.0 <= bounds[1]

    bounds = excess_over_gaps(scene, pressure)
    assert bounds is not None
    without, step = pressure, -1.0 if bounds[0] > 0.0 else 1.0
    there = without + step
    while none(there):
        without, step = there, 2.0 * step
        there = without + step
    while abs(there - without) > NARROW * max(1.0, abs(there)):
        middle = 0.5 * (there + without)
        there, without = (there, middle) if none(middle) else (middle, without)
    return there if abs(there) > 2.0 * NARROW else 0.0


def _knows_the_gap(scene: Scene) -> bool:
    """Whether the gap of the tip is all that the identity has."""
    q = scene.numbers
    others = any(q.get(name) for name in ("force", "unbonded")) or scene.stretch is not None
    tilted = abs(q.get("weight", 0.0) * math.sin(q.get("tilt", 0.0))) > 0.0
    if others or tilted or not isinstance(scene.tip, TipLoad) or not scene.has_identity:
        return False
    uniform = all(
        type(load) is Weight or (type(load) is Pressure and load.profile is None and load.until is None)
        for load in scene.loads
    )
    bond = scene.bond
    straight = isinstance(bond, Opening) and all(isinstance(piece.drop, Affine) for piece in bond.law.pieces)
    return uniform and (bond is LINE or straight)


def _pieces(scene: Scene) -> list[tuple[float, float, float, float, float]]:
    """Start and end of each piece of the law; where it starts its traction, its slope and the work."""
    if scene.bond is LINE:
        return [(0.0, math.inf, 0.0, 0.0, 0.0)]
    law, r = scene.bond.law, scene.rod.ratio
    found = []
    for piece, (start, stop) in zip(law.pieces, pairwise((0.0, *law.kinks, math.inf)), strict=True):
        assert isinstance(piece.drop, Affine)
        traction = 1.0 - float(piece.drop(start))
        work = law.separation_work(start) / r
        found.append((start / r, stop / r, traction, -piece.drop.slope * r, work))
    return found
