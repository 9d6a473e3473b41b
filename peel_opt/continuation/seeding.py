"""Makes the file of seeds: ``python -m peel_opt.continuation.seeding``.

Every rod of the grid is walked along its primary branch once, and landed on at the tip angles of the
grid.  What is kept are Chebyshev coefficients in single precision.  A minute, and needed again only
when the unknowns of a state change; a test makes a part of it anew and compares.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from ..base.files import atomic_write
from ..base.progress import progress
from ..model.bond import COHESIVE
from ..residual.closures import Closure
from ..residual.meshes import PATH
from ..residual.newton import SolvedState
from ..residual.stack import stack_of
from .primary import PrimaryBranch, primary_branch
from .seeds import CHARTS, FILE, FOLDED, LAST_ANGLE, LEAVES, packed

#: Share of the way to y0 up to which the folded states with a free arc are charted: where the tip of a rod
#: is back at y0 just as it points along the plate, another phase begins, and they have a corner.
CHARTED = 0.85

#: Rods and states along each chart.
GRID = {
    "whole": (20, 16),
    "within": (22, 14),
    "beyond": (34, 28),
    "folded": (20, 16),
    "returning": (34, 20),
}


def states(name: str, place: float, shares: Iterable[float]) -> np.ndarray:
    """Return the states of one rod of a chart at shares of its way, as `packed` numbers."""
    phases, _ = CHARTS[name]
    ratio = ratio_at(name, place)
    branch = primary_branch(COHESIVE, Closure("ratio", ratio))
    minimum = branch.continue_to("LP-pressure")
    assert minimum is not None
    amplitudes = _amplitudes(name, branch, minimum.point.scalars.A)
    found = []
    for share in shares:
        landed = _state(branch, Closure("amplitude", amplitudes(share)))
        met, x = len(landed.problem.phases), landed.correction.x
        if met != len(phases):
            raise RuntimeError(f"a state of the chart {name!r} has {met} phases")
        found.append(x)
    stack = stack_of(PATH, phases)
    return packed(stack, np.array(found)[:, -stack.size :], folded=name in FOLDED)


def _amplitudes(name: str, branch: PrimaryBranch, least: float) -> Callable[[float], float]:
    """From a share of a chart's way to the tip angle of a rod, whose pressure is least at ``least``."""
    if name in FOLDED:
        branch.extend(lambda _: False)
    if name in ("whole", "folded"):
        first, last = (0.0, least) if name == "whole" else (least, branch.points[-1].scalars.A)
    else:
        leaves, returns = (
            state.problem.scalars(state.correction.x).A
            for state in (_state(branch, Closure("pressure", 0.5), which) for which in (0, -1))
        )
        ends = {"within": (0.0, leaves), "beyond": (leaves, least), "returning": (least, returns)}
        first, last = ends[name]
    # The states of a compliant rod crowd at T, those of a stiff one where the tip leaves y0 and returns.
    origins = {"whole": branch.family.closure.value**0.75, "beyond": 0.0, "returning": -LAST_ANGLE}
    origin = origins.get(name, math.inf)
    if origin == math.inf:
        return lambda share: first + share * (last - first)
    way = (last + origin) / (first + origin)
    whole = CHARTED if name == "returning" else 1.0
    return lambda share: (first + origin) * way ** (whole * share) - origin


def _state(branch: PrimaryBranch, given: Closure, which: int = 0) -> SolvedState:
    """Return the first state of a branch at a number, or the last, on the mesh of the seeds."""
    landed = branch.candidates(given)[which].solution
    if landed.problem.settings != PATH:
        raise RuntimeError(f"walks are on {landed.problem.settings}")
    return landed


def ratio_at(name: str, place: float) -> float:
    """The rod at a place of a chart: `place_of` backwards."""
    _, (low, high) = CHARTS[name]
    return low * (high / low) ** (place if low < LEAVES else place * place)


def coefficients(values: np.ndarray) -> np.ndarray:
    """Chebyshev coefficients along the first two axes of values at `nodes`."""
    for axis, count in enumerate(values.shape[:2]):
        basis = chebyshev.chebvander(2.0 * nodes(count) - 1.0, count - 1)
        to_series = 2.0 / count * basis.T
        to_series[0] *= 0.5
        values = np.moveaxis(np.tensordot(to_series, values, (1, axis)), 0, axis)
    return values


def nodes(count: int) -> np.ndarray:
    """Chebyshev nodes between 0 and 1, the ends left out: there a free arc has no length, or A none."""
    return 0.5 * (1.0 - np.cos(np.pi * (np.arange(count) + 0.5) / count))


def main(arguments: list[str] | None = None) -> int:
    """Make all charts and write them."""
    parser = argparse.ArgumentParser(prog="python -m peel_opt.continuation.seeding", description=__doc__)
    parser.add_argument("file", nargs="?", type=Path, default=Path(__file__).with_name(FILE))
    path = parser.parse_args(arguments).file
    made: dict[str, Any] = {}
    with progress("rod", sum(rods for rods, _ in GRID.values())) as step:
        for name, (rods, along) in GRID.items():
            rows = []
            for place in nodes(rods):
                rows.append(states(name, float(place), nodes(along)))
                step()
            made[name] = coefficients(np.array(rows)).astype(np.float32)
    atomic_write(path, lambda file: np.savez(file, **made))
    return 0


if __name__ == "__main__":
    sys.exit(main())
