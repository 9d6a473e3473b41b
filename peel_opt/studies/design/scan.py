"""Where the search for a design starts: a scan over the bounds, and what it says.

Along one free number the scan is as fine near the given rod as it is wide over the bounds, and
finer where a target is nearly met, so that two designs that lie close together are both seen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...model.rod import RATIOS
from .blocks import Block, block_at
from .material import Material
from .targets import Requirement, shortfall

#: Designs looked at: along one free number, near its start besides, and over several.
SCAN, SCAN_NEARBY, SCAN_OF_SEVERAL = 17, 13, 24

#: How far from the start "near" is, as a logarithm.
NEARBY = math.log(10.0)

#: Times the steps beside a target that is nearly met are halved.
MOST_HALVINGS = 8


@dataclass(frozen=True, eq=False)
class Candidate:
    """A scanned design on which all requirements have a value."""

    z: np.ndarray
    blocks: tuple[Block, ...]

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the blocks stand for."""
        return tuple(b.requirement for b in self.blocks)

    def alike(self, other: Candidate) -> bool:
        """Whether both have the same equations: the same phases of the law."""
        return [b.structure for b in self.blocks] == [b.structure for b in other.blocks]

    @property
    def missed(self) -> float:
        """Sum of what the requirements miss."""
        return math.fsum(shortfall(b.requirement.sense, b.value, b.requirement.value) for b in self.blocks)

    @property
    def gap(self) -> float:
        """Logarithm by which the single requirement is exceeded."""
        (block,) = self.blocks
        return math.log(block.value / block.requirement.value)


def samples(material: Material) -> list[np.ndarray]:
    """Return designs within the bounds whose branch can be walked; the given one first."""
    low, high = material.lower, material.upper
    start = material.start
    first = [] if start is None or not material.in_range(start) else [start]
    if len(low) > 1:
        from scipy.stats.qmc import Halton

        points = Halton(len(low), scramble=False).random(64 * SCAN_OF_SEVERAL)
        grid = [z for p in points if material.in_range(z := low + (high - low) * p)]
        return first + grid[:SCAN_OF_SEVERAL]
    ends = _walkable(material, float(low[0]), float(high[0]))
    if ends is None:
        return first
    places = set(np.linspace(*ends, SCAN).tolist())
    if first:
        near = float(first[0][0]) + np.linspace(-NEARBY, NEARBY, SCAN_NEARBY)
        places |= {z for z in near.tolist() if ends[0] < z < ends[1]} - {float(first[0][0])}
    return first + [np.array([z]) for z in sorted(places)]


def _walkable(material: Material, low: float, high: float) -> tuple[float, float] | None:
    """Part of an interval of one logarithm where eta/y0 is in range."""
    constant, (slope,) = material.log_ratio
    if slope:
        a, b = sorted((math.log(r) - constant) / slope for r in RATIOS)
        inside = 1e-9 * (b - a)
        low, high = max(low, a + inside), min(high, b - inside)
    elif not material.in_range(np.array([low])):
        return None
    return (low, high) if low < high else None


def candidate(material: Material, z: np.ndarray, requirements: Sequence[Requirement]) -> Candidate | None:
    """Return a design with its requirements solved for; None if one has no value there."""
    rod, blocks = material.rod(z), []
    for requirement in requirements:
        block = block_at(rod, requirement)
        if block is None:
            return None
        blocks.append(block)
    return Candidate(z, tuple(blocks))


def brackets(
    material: Material, places: Sequence[np.ndarray], candidates: Sequence[Candidate]
) -> list[tuple[Candidate, Candidate]]:
    """Return neighbours along one free number between which its single target is met.

    Parameters
    ----------
    material : Material
    places : sequence of ndarray, shape (1,)
        The samples, those without a value too.
    candidates : sequence of Candidate
        Those with a value, at least one.
    """
    row: list[tuple[float, Candidate | None]] = [(float(c.z[0]), c) for c in candidates]
    row += [(z, None) for z in {float(z[0]) for z in places} - {z for z, _ in row}]
    for _ in range(MOST_HALVINGS):
        row.sort(key=lambda item: item[0])
        around = [None, *(c for _, c in row), None]
        finer = [
            0.5 * (row[i][0] + row[i + 1][0])
            for i in range(len(row) - 1)
            if _may_hide(*around[i : i + 4])  # the two, and their neighbours
        ]
        row += [(z, candidate(material, np.array([z]), candidates[0].requirements)) for z in finer]
    row.sort(key=lambda item: item[0])
    pairs = ((a, b) for (_, a), (_, b) in pairwise(row))
    return [
        (a, b)
        for a, b in pairs
        if a is not None and b is not None and a.gap * b.gap <= 0.0 and b.z[0] > a.z[0]
    ]


def _may_hide(
    before: Candidate | None, left: Candidate | None, right: Candidate | None, after: Candidate | None
) -> bool:
    """Whether the target may be met between two samples that do not show it.

    That is beside a dip, and where the state comes to an end: at a fold its value turns steeply.
    """
    if left is None or right is None:
        return left is not right
    if left.gap * right.gap <= 0.0:
        return False
    lowest, beyond = (left, before) if abs(left.gap) <= abs(right.gap) else (right, after)
    return beyond is None or (lowest.gap * beyond.gap > 0.0 and abs(beyond.gap) >= abs(lowest.gap))
