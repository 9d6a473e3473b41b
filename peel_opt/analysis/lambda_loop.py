"""A hysteresis loop in lambda at fixed beta0: its two sweeps, its jumps and its area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..base.drawing import Pictured
from ..base.records import Column
from ..equilibria.branch import Branch
from .loops import Jump, Loop, VisitedStates
from .potential import EffectivePotential, Level

Convention = Literal["delay", "maxwell"]

NOT_COMPUTED = (
    "A jump joins two equilibria at one lambda.  How the rod moves from one to the other"
    " (inertia, the air under it, what it touches) is not computed here; `peel_opt.snap` follows a rod."
)

#: Extra pressure, label, error and row of a state.
State = tuple[float, str, float, int]


class LambdaJump(Jump):
    """A jump between two states at one lambda."""

    @property
    def lam(self) -> float:
        """Value beta1 - pi^4 at which it jumps."""
        return self.swept

    @property
    def alpha1_before(self) -> float:
        """Extra pressure before the jump; 0 for the straight rod."""
        return self.before

    @property
    def alpha1_after(self) -> float:
        """Extra pressure after it."""
        return self.after


class LambdaSweep(VisitedStates):
    """States in the order in which a sweep of lambda visits them."""

    @property
    def lam(self) -> np.ndarray:
        """Values beta1 - pi^4."""
        return self.swept

    @property
    def alpha1(self) -> np.ndarray:
        """Extra pressures; 0 for the straight rod."""
        return self.response


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class HysteresisLoop(Loop[LambdaSweep, LambdaJump], Pictured):
    """A loop in lambda at fixed beta0; quasi-static, with a reversible bond.

    Beside what every `Loop` has; the area is that in the (lambda, alpha1) plane, and at beta0 = 0
    there are no jumps.

    Parameters
    ----------
    beta0 : float
    convention : {"delay", "maxwell"}
    source : str
        "solver", or the kind of the normal form.
    """

    beta0: float
    convention: Convention
    source: str

    @property
    def plane(self) -> dict[str, Column]:
        """Lambda and alpha1."""
        return {name: Column(self.joined(name)) for name in ("lam", "alpha1")}

    def __repr__(self) -> str:
        jumps = [
            f"{jump.direction:<4} at lambda = {jump.lam:.9g}: alpha1 {jump.alpha1_before:.9g}"
            f" to {jump.alpha1_after:.9g}"
            for jump in self.jumps
        ]
        return self.tree(
            f"HysteresisLoop at beta0 = {self.beta0:.6g}, {self.convention} convention, {self.source}",
            jumps or ["no jumps: the detached state grows out of the straight rod at lambda = 0"],
            f"{self.area:.{self.area_digits}g}",
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

    def held(values: np.ndarray) -> LambdaSweep:
        visits = [(float(v), *detached[float(v)]) for v in values if float(v) in detached]
        return LambdaSweep(*(np.array(column) for column in zip(*visits, strict=True)))

    upwards = LambdaSweep.adhered(grid[grid <= up]).then(held(grid[grid >= up]))
    downwards = held(grid[grid >= down][::-1]).then(LambdaSweep.adhered(grid[grid <= down][::-1]))
    jumps: tuple[LambdaJump, ...] = ()
    area = error = 0.0
    if beta0 > 0.0:
        peeled, lost = detached[up][0], detached[down][0]
        jumps = (LambdaJump("up", up, 0.0, peeled), LambdaJump("down", down, lost, 0.0))
        assert potential is not None
        area, error = potential.area(*levels(potential, convention))
    return HysteresisLoop(
        beta0=beta0,
        convention=convention,
        source=source,
        up=upwards,
        down=downwards,
        jumps=jumps,
        area=area,
        area_error=error,
        not_computed=NOT_COMPUTED if jumps else "",
        branch=branch,
    )


def levels(potential: EffectivePotential, convention: Convention) -> tuple[Level, Level]:
    """Return where a loop jumps down and where it jumps up."""
    if convention == "maxwell":
        return potential.maxwell(), potential.maxwell()
    return potential.fold(), potential.delay()


def loop_along(
    potential: EffectivePotential,
    convention: Convention,
    source: str,
    window: tuple[float, float],
    points: int = 41,
) -> HysteresisLoop:
    """Return the loop through the states of a potential's own curve: nothing is solved for.

    Parameters
    ----------
    potential : EffectivePotential
        At beta0 > 0.
    convention : {"delay", "maxwell"}
    source : str
        What the curve is, "quadrature of a trace" or "normal form".
    window : tuple of float
        From where to where lambda is swept; it must hold the fold and 0.
    points : int
        States on the detached branch, evenly spread in alpha1, and on the straight rod below it.

    Returns
    -------
    HysteresisLoop

    Raises
    ------
    NoEquilibrium
        If the curve has no fold, or is not known far enough past it.
    """
    fold = potential.fold()
    lost, peels = levels(potential, convention)
    last = potential.alpha1(window[1])
    end = float(last[0]) if last.size and last[0] < peels.alpha1 else potential.domain[0]
    places = np.unique([*np.linspace(end, fold.alpha1, points), peels.alpha1])
    held = dict(zip(map(float, potential.curve(places)), map(float, places), strict=True))
    # Both ends of the jumps as they are named, not as the curve gives them back.
    held = {lam: alpha1 for lam, alpha1 in held.items() if alpha1 not in (fold.alpha1, peels.alpha1)}
    held |= {fold.lam: fold.alpha1, peels.lam: peels.alpha1}
    grid = np.unique([*np.linspace(window[0], lost.lam, points), *held])

    def solved(value: float) -> State:
        return held[value], "lower", np.nan, -1

    ends = lost.lam, peels.lam
    return loop_from_states(potential.beta0, convention, source, grid, ends, solved, potential, None)
