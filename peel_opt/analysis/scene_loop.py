"""The loop of a scene in the pressure: from rest to its snap, or from T, and back from folded states.

A rod that is lifted from the start follows its lifted states up to the maximum of the pressure, the
snap, and jumps to the folded state there.  On the way down it is folded to the least pressure of the
branch and jumps back to its lifted state, or to the attached rod where the branch begins at T.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.errors import InvalidInput, NoEquilibrium
from ..continuation.scene_family import SceneBranch
from ..equilibria.result import Equilibrium
from ..equilibria.scene_trace import SceneTrace, trace_scene
from ..equilibria.scenes import solve
from ..model.rod import require_rod
from ..model.scene import Scene
from ..model.tips import TipLoad
from .loops import Direction
from .pressure_loop import PressureJump, PressureLoop, PressureSweep, area_along

#: Points of the branch of a loop.
POINTS = 160

#: Height of the tip, as a share of the largest, and distance of p/T0 at which it has come down on its wall.
DOWN = 1e-4

#: Points nearest to T through which the pressure there is found, and share by which it may lie beyond them.
NEAREST, SETTLED = 4, 1e-2

NOT_COMPUTED = (
    "Not computed here: the motion in a jump, and whether the rod settles in the state it jumps to, which"
    " stability tells for small motions only."
)


def sweep_scene(scene: Scene, points: int, tol: float) -> PressureLoop:
    """Sweep the pressure on a scene up to where it snaps or leaves T, and back; every state is solved for.

    Raises
    ------
    InvalidInput
        If the tip is not a free or a loaded one.
    NoEquilibrium
        If there is no snap, no way back, or no folded state to jump to: such a scene has no loop.
    """
    if not isinstance(scene.tip, TipLoad):
        raise InvalidInput(
            "a loop is that of a rod with a free or a loaded tip.",
            remedy="Ask for the states of a strip, or of a tip on its wall, with solve.",
        )
    return loop_of_scene(scene, trace_scene(scene, POINTS, tol, until=_enough), points)


def _enough(walked: SceneBranch) -> float:
    """Arclength by which a folded rod bears the pressure at which it peels."""
    peels = walked.family.loading(walked.snap.point if walked.snap else walked.points[0])
    above = (
        p.arclength
        for p in walked.points
        if walked.state_at(p.arclength) == "folded" and walked.family.loading(p) > peels
    )
    return next(above, math.inf)


def loop_of_scene(scene: Scene, branch: SceneTrace, points: int) -> PressureLoop:
    """Return the loop along a traced branch of a scene; beside its points two states are solved for."""
    P, rod = branch.pressure_ratio, scene.rod
    turns = [p.index for p in branch.special("LP-pressure")]
    snap = _snap(branch, turns)
    least = _least(branch, turns, snap)
    low, peeled = float(P[least]), float(P[snap]) if snap else _at_transition(branch)
    folded = _folded(branch, least, peeled)
    end = int(folded[-1])
    # A branch may end just there, with the tip coming down.
    down = end == len(P) - 1
    top = _rows(branch, np.array([end])) if down else _of(_solved(scene, branch, peeled, end))
    far = rod.length_ratio(float(top.length[0]))
    area, error = _area(np.append(P[folded], peeled), np.append(branch.sigma[folded], far), low)
    T0, eta, before, back = rod.adhesion_strength, rod.eta, 0.0, 0.0
    if snap:
        visited = np.flatnonzero(P[: snap + 1] > low)
        rest = _solved(scene, branch, low, int(visited[0]) - 1)
        before, back = float(branch.sigma[snap]), rest.length_ratio
        own, of_own = _area(np.append(low, P[visited]), np.append(back, branch.sigma[visited]), peeled)
        area, error = area - own, error + of_own
        lifted = _rows(branch, _thinned(np.arange(snap + 1), points), "lifted")
        closed = _of(rest).then(_rows(branch, _thinned(np.arange(visited[0]), points)[::-1]))
    else:
        below = np.linspace(0.5 * low, low, max(points // 4, 2))
        lifted = PressureSweep.adhered(np.array([*below, peeled]) * T0)
        closed = PressureSweep.adhered(below[::-1] * T0)
    jumps = (
        _jump(branch, "up", peeled, (before, far), end),
        _jump(branch, "down", low, (float(branch.sigma[least]), back), least),
    )
    return PressureLoop(
        rod=rod,
        up=lifted.then(top),
        down=top.then(_rows(branch, _thinned(folded, points)[::-1], "folded")).then(closed),
        between=_rows(branch, _thinned(np.arange(snap, least + 1), points)[::-1]),
        jumps=jumps,
        area=area * T0 * eta,
        area_error=error * T0 * eta,
        not_computed=NOT_COMPUTED,
        branch=branch,
    )


def _snap(branch: SceneTrace, turns: list[int]) -> int:
    """Row of the snap of a rod that is lifted from the start; 0 where it begins at T."""
    if branch.state[0] != "lifted":
        return 0
    if not turns:
        raise NoEquilibrium(
            "this scene has no loop: its rod does not snap, but grows stably as far as it was followed"
            f" (p/T0 up to {branch.pressure_ratio.max():.6g}, {branch.ended}).",
            remedy="Its states are those of trace.",
        )
    return turns[0]


def _least(branch: SceneTrace, turns: list[int], snap: int) -> int:
    """Row of the least pressure, at which a folded rod comes back."""
    P = branch.pressure_ratio
    lower = [i for i in turns if i > snap and P[i] < P[i - 1]]
    if not lower or P[lower[0]] <= 0.0:
        raise NoEquilibrium(
            "this scene has no loop: without a pressure its rod stays detached"
            f" (p/T0 down to {P[snap:].min():.6g}, {branch.ended}).",
            remedy="Its states are those of trace.",
        )
    return lower[0]


def _folded(branch: SceneTrace, least: int, peeled: float) -> np.ndarray:
    """Rows of the folded states between the least pressure and the one at which the rod peels."""
    P = branch.pressure_ratio[least:]
    falls = np.flatnonzero(np.diff(P) <= 0.0)
    end = int(falls[0]) if falls.size else len(P) - 1
    if not P[end] > peeled and not _comes_down(branch, peeled):
        raise NoEquilibrium(
            f"this scene has no loop: where it peels, at p/T0 = {peeled:.6g}, there is no folded state to"
            f" jump to; they end at p/T0 = {P[end]:.6g} ({branch.ended}).",
            remedy="What its rod does there is a motion, not an equilibrium.",
        )
    return least + np.flatnonzero(P[: end + 1] < peeled)


def _comes_down(branch: SceneTrace, peeled: float) -> bool:
    """Whether the branch ends with the tip on the wall, just where the attached rod peels."""
    down = branch.tip_u[-1] < DOWN * np.abs(branch.tip_u).max()
    return bool(down and abs(branch.pressure_ratio[-1] - peeled) < DOWN)


def _at_transition(branch: SceneTrace) -> float:
    """p/T0 of the attached rod, as the tip angle vanishes.

    Raises
    ------
    NoEquilibrium
        If it grows without limit: a front with an energy is not opened at any pressure.
    """
    A, P = branch.A[:NEAREST], branch.pressure_ratio[:NEAREST]
    found = float(np.polynomial.polynomial.polyfit(A, P, 1)[0])
    if not abs(found - P[0]) <= SETTLED * abs(P[0]):
        raise NoEquilibrium(
            "this scene has no loop: the shorter the detached length, the more pressure it takes (p/T0 ="
            f" {P[0]:.4g} at sbar/eta = {branch.sigma[0]:.4g}), and none leads away from the attached rod.",
            remedy="Its states are those of trace.",
        )
    return found


def _solved(scene: Scene, branch: SceneTrace, pressure: float, row: int) -> Equilibrium:
    """Solve for the state at a pressure behind a row of the branch."""
    i = max(row, 0)
    (a, b), (there, beyond) = branch.pressure_ratio[i : i + 2], branch.sigma[i : i + 2]
    near = there + (pressure - a) / (b - a) * (beyond - there)
    rod = scene.rod
    return solve(scene, free="length", pressure=rod.pressure(pressure), near=rod.length(float(near)))


def _of(eq: Equilibrium) -> PressureSweep:
    """Return one state, which is no point of the branch."""
    return PressureSweep(
        np.array([eq.pressure]),
        np.array([eq.length]),
        np.array([eq.state]),
        np.array([eq.error]),
        np.array([-1]),
    )


def _rows(branch: SceneTrace, rows: np.ndarray, state: str = "") -> PressureSweep:
    """Return states of the branch; those at a fold, where two kinds meet, are of the kind that is visited."""
    label = np.full(len(rows), state) if state else branch.state[rows]
    return PressureSweep(branch.pressure[rows], branch.length[rows], label, branch.error[rows], rows)


def _thinned(rows: np.ndarray, points: int) -> np.ndarray:
    """Return about so many of some rows, both ends among them."""
    picked = np.linspace(0, len(rows) - 1, min(points, len(rows))).round().astype(int)
    thinned: np.ndarray = rows[np.unique(picked)]
    return thinned


def _jump(
    branch: SceneTrace, direction: Direction, pressure: float, lengths: tuple[float, float], row: int
) -> PressureJump:
    rod = require_rod(branch.rod)
    before, after = (rod.length(length) for length in lengths)
    return PressureJump(
        direction, rod.pressure(pressure), before, after, float(branch.lam[row]), float(branch.alpha1[row])
    )


def _area(P: np.ndarray, sigma: np.ndarray, fold: float) -> tuple[float, float]:
    """Integral of sbar/eta over p/T0 along states that end at a fold, and its error.

    In the root of the distance from the fold the lengths are smooth.
    """
    u = np.sqrt(np.abs(P - fold))
    order = np.argsort(u)
    return area_along(u[order], u[order] ** 2, sigma[order])
