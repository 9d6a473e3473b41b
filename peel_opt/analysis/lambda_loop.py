"""A hysteresis loop in lambda at fixed beta0: its two sweeps, its jumps and its area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..base.arrays import Columns
from ..base.drawing import draw
from ..base.quadrature import Grid
from ..equilibria.branch import Branch
from .potential import EffectivePotential

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Convention = Literal["delay", "maxwell"]

_ADHERED = "adhered"

#: Extra pressure, label, error and row of a state.
State = tuple[float, str, float, int]


@dataclass(frozen=True)
class Jump:
    """A jump between two states at one lambda.

    Parameters
    ----------
    direction : {"up", "down"}
        "up" peels the rod off, "down" lets it re-adhere.
    lam : float
    alpha1_before, alpha1_after : float
        Extra pressures; 0 for the straight rod.
    """

    direction: Literal["up", "down"]
    lam: float
    alpha1_before: float
    alpha1_after: float

    @property
    def size(self) -> float:
        """Change of alpha1."""
        return abs(self.alpha1_after - self.alpha1_before)


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Columns):
    """States in the order in which a sweep visits them; at a jump both, at the same lambda.

    Parameters
    ----------
    lam, alpha1 : ndarray
    state : ndarray of str
        "adhered", or the label of the detached state.
    error : ndarray
        Of each solved state, in the metric of the branch; 0 for the straight rod, which is
        exact, NaN on a normal form.
    row : ndarray of int
        Position in the branch of the loop, -1 where the state is not one of its.
    """

    lam: np.ndarray
    alpha1: np.ndarray
    state: np.ndarray
    error: np.ndarray
    row: np.ndarray

    def __len__(self) -> int:
        return len(self.lam)


@dataclass(frozen=True, eq=False)
class HysteresisLoop:
    """A loop in lambda at fixed beta0.

    Parameters
    ----------
    beta0 : float
    convention : {"delay", "maxwell"}
    source : str
        "solver", or the kind of the normal form.
    up, down : Sweep
    jumps : tuple of Jump
        In the order of the loop: up, then down.  None at beta0 = 0.
    area : float
        Enclosed in the (lambda, alpha1) plane.
    not_computed : str
        What happens in a jump.
    branch : Branch or None
        The solved branch: ``branch[row]`` of a sweep is an `Equilibrium` with its shape.
    """

    beta0: float
    convention: Convention
    source: str
    up: Sweep
    down: Sweep
    jumps: tuple[Jump, ...]
    area: float
    not_computed: str = ""
    branch: Branch | None = field(default=None, repr=False)

    @property
    def visited(self) -> tuple[str, ...]:
        """Names of the states in the order of the loop, each once."""
        return tuple(dict.fromkeys([*self.up.state.tolist(), *self.down.state.tolist()]))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the loop in the (lambda, alpha1) plane; return the axes."""
        return draw(self, ax)

    def __repr__(self) -> str:
        lines = [f"HysteresisLoop at beta0 = {self.beta0:.6g}, {self.convention} convention, {self.source}"]
        lines += [
            f"├─ {jump.direction:<4} at lambda = {jump.lam:.9g}: alpha1 {jump.alpha1_before:.9g}"
            f" to {jump.alpha1_after:.9g}"
            for jump in self.jumps
        ]
        if not self.jumps:
            lines.append("├─ no jumps: the detached state grows out of the straight rod at lambda = 0")
        lines += [f"├─ states: {', '.join(self.visited)}", f"└─ area {self.area:.9g}"]
        return "\n".join(lines)


NOT_COMPUTED = (
    "A jump joins two equilibria at one lambda.  How the rod moves from one to the other"
    " (inertia, the air under it, what it touches) is not computed."
)


def loop_from_states(
    beta0: float,
    convention: Convention,
    source: str,
    grid: np.ndarray,
    ends: tuple[float, float],
    solved: Callable[[float], State],
    potential: EffectivePotential | None,
    branch: Branch | None,
) -> HysteresisLoop:
    """Put the two sweeps together; ``ends`` are where it jumps down and up."""
    down, up = ends
    detached = {float(value): solved(float(value)) for value in grid if value >= down and (value or beta0)}

    def straight(values: np.ndarray) -> list[tuple[float, State]]:
        return [(float(value), (0.0, _ADHERED, 0.0, -1)) for value in values]

    def held(values: np.ndarray) -> list[tuple[float, State]]:
        return [(float(value), detached[float(value)]) for value in values if float(value) in detached]

    upwards = _sweep([*straight(grid[grid <= up]), *held(grid[grid >= up])])
    downwards = _sweep([*held(grid[grid >= down][::-1]), *straight(grid[grid <= down][::-1])])
    jumps: tuple[Jump, ...] = ()
    area = 0.0
    if beta0 > 0.0:
        peeled, lost = detached[up][0], detached[down][0]
        jumps = (Jump("up", up, 0.0, peeled), Jump("down", down, lost, 0.0))
        assert potential is not None
        area = enclosed_area(potential, lost, peeled)
    said = NOT_COMPUTED if jumps else ""
    return HysteresisLoop(beta0, convention, source, upwards, downwards, jumps, area, said, branch)


def _sweep(visits: list[tuple[float, State]]) -> Sweep:
    lam = np.array([value for value, _ in visits])
    columns = (lam, *(np.array(column) for column in zip(*(entry for _, entry in visits), strict=True)))
    for column in columns:
        column.flags.writeable = False
    return Sweep(*columns)


def enclosed_area(potential: EffectivePotential, lost: float, peeled: float) -> float:
    """Integral of alpha1 dlambda along the lower branch between the two jumps."""
    cell = Grid.gauss(8)
    edges = np.linspace(lost, peeled, 65)
    x = edges[:-1, None] + np.diff(edges)[:, None] * cell.xi
    return abs(float((x * potential.slope(x) @ cell.weights) @ np.diff(edges)))
