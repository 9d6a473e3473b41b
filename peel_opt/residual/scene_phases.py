"""Stretches of a rod in a scene: where the bond changes its piece, and where a material point lies."""

from __future__ import annotations

import math

from ..model.bond import Piece
from ..model.stretch import Stretch
from .phases import Layout, kink_crossings
from .scene_spectral import SceneProfile

#: Share of the detached length by which a material point must be inside it to part two stretches.
INSIDE = 1e-9


def material_breaks(profile: SceneProfile) -> list[tuple[float, str]]:
    """Return the xi of the material points on the detached rod, with their names, from the tip on."""
    q, sbar = profile.numbers, profile.scalars.sigma
    found = sorted((q[name] / sbar, name) for name in profile.scene.breaks)
    return [(xi, name) for xi, name in found if xi < 1.0 - INSIDE]


def scene_layout(profile: SceneProfile) -> Layout:
    """Read the stretches of a shape off what the bond sees and where its material points are."""
    scene = profile.scene
    pieces = scene.bond.law.pieces
    crossings = kink_crossings(scene.bond.law, profile)
    events = sorted(
        [
            *((xi, after, "") for xi, _, after in crossings),
            *((xi, -1, name) for xi, name in material_breaks(profile)),
        ]
    )
    # The detachment point has u = 0: without a crossing everything is in the first piece.
    index, past, breaks = crossings[0][1] if crossings else 0, frozenset[str](), []
    sequence = [_stretch(pieces, index, past, bonded=not scene.unbonded)]
    for xi, after, name in events:
        past = past | {name} if name else past
        index = index if name else after
        bonded = not scene.unbonded or "unbonded" in past
        stretch = _stretch(pieces, index, past, bonded=bonded)
        if stretch != sequence[-1]:
            sequence.append(stretch)
            breaks.append(xi)
    return Layout(tuple(sequence), tuple(breaks))


def _stretch(pieces: tuple[Piece, ...], index: int, past: frozenset[str], *, bonded: bool) -> Stretch:
    """Return a piece of the law past some points; where nothing was glued, one without limits."""
    if bonded:
        return Stretch.of(pieces[index], past)
    return Stretch(-math.inf, math.inf, pieces[0].drop, pieces[0].lost, past=past)
