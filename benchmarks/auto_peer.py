"""The beta0 = 4 diagram by AUTO-07p, beside `trace`; needs ``pip install 'peel_opt[peers]'`` and gfortran.

(12) with (14) is written as a user of AUTO would: five fields, six boundary conditions, lambda
and alpha1 free.  One run along the straight rod locates the branch point, and one from there in
each direction locates the fold.  ``bifpy`` turns the equations into Fortran with their exact
Jacobian and links them to AUTO; AUTO's own time is the one it prints, what is around it is
reported apart.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import peel_opt as po
from peel_opt.model.groups import PI4

from .figures import Figure, milliseconds

BETA0 = 4.0
WINDOW = 3.0

#: Intervals and collocation points of AUTO's mesh: its defaults.
INTERVALS, DEGREE = 20, 4

#: AUTO's largest steps: as long as it likes, and short enough for as many points as `trace` gives.
STRIDES = {"its own steps": 0.5, "steps as short as ours": 0.08}


@dataclass(frozen=True)
class AutoDiagram:
    """What AUTO returned for the window |lambda| <= 3.

    Parameters
    ----------
    branch_point, fold : float
        Values of lambda.
    fold_alpha1 : float
    ends : tuple of (float, float)
        lambda near 3, where AUTO stops, and alpha1 there; detached first.
    points : int
        On the two halves of the detached branch.
    seconds : float
        AUTO's own, of all three runs; medians.
    around : float
        Of the first time: tracing the equations, compiling, linking, processes, reading files.
    """

    branch_point: float
    fold: float
    fold_alpha1: float
    ends: tuple[tuple[float, float], tuple[float, float]]
    points: int
    seconds: float
    around: float


def missing() -> str:
    """Why AUTO cannot take part here; empty if it can."""
    if find_spec("bifpy") is None:
        return "bifpy is not installed"
    return "" if shutil.which("gfortran") else "gfortran is not installed"


def slope(u: Sequence[Any], parameters: Sequence[Any]) -> list[Any]:
    """(12) for (theta, theta', N_x, N_y, y), d/dxi."""
    theta, K, Nx, Ny, y = (u[i] for i in range(5))
    lam, alpha1 = parameters[0], parameters[1]
    sine, cosine = np.sin(theta), np.cos(theta)
    load = (BETA0 + alpha1) * cosine - BETA0 + (PI4 + lam) * y
    return [K, Ny * cosine - Nx * sine, -(BETA0 + alpha1) * sine, load, sine]


def ends(tip: Sequence[Any], root: Sequence[Any], parameters: Sequence[Any]) -> list[Any]:
    """(14) as residuals."""
    return [tip[1], tip[2], tip[3], root[0], root[1], root[4]]


def straight(u: list[Any], parameters: list[Any], xi: float) -> None:
    """Set the straight rod at the lower end of the window."""
    u[:5] = [0.0] * 5
    parameters[0], parameters[1] = -WINDOW, 0.0


def diagram(stride: float = 0.5, repeats: int = 9) -> AutoDiagram:
    """Compute the diagram; ``stride`` is the largest step, measured as AUTO does."""
    from bifpy import auto

    settings = {
        "ips": auto.IPS_GENERAL_BVP,
        "ndim": 5,
        "npar": 2,
        "nbc": 6,
        "ntst": INTERVALS,
        "ncol": DEGREE,
        "nmx": 1000,
        "npr": 0,
        "isp": 2,
        "itmx": 12,
        "itnw": 7,  # steps grow sooner than by default: fewer points
        "jac": 1,
        "ds": min(0.1, stride),
        "dsmin": 1e-6,
        "dsmax": stride,
        "rl0": -WINDOW,
        "rl1": 1.5 * WINDOW,
        "epsl": 1e-9,
        "epsu": 1e-9,
        "epss": 1e-7,
    }
    exact = auto.AUTO_JACOBIAN
    common = {
        "icu": [1, 2],
        "bcnd": ends,
        "jac": exact,
        "bcnd_jac": exact,
        "uzstop": {1: WINDOW},
        "transpile": True,
        "keep_output": True,
    }
    runs = [_timed(partial(auto.run, slope, straight, settings, **common), repeats)]
    branch_point = _point(runs[0].result, auto.PointType.BRANCH_POINT)
    for sign in (-1.0, 1.0):
        turned = {**settings, "ds": sign * settings["ds"]}
        call = partial(auto.restart, slope, turned, branch_point, isw=-1, **common)
        runs.append(_timed(call, repeats))
    detached, spurious = sorted(runs[1:], key=lambda run: _last(run.result)[1])
    fold = _point(detached.result, auto.PointType.FOLD)
    return AutoDiagram(
        branch_point=float(branch_point.parameters[0]),
        fold=float(fold.parameters[0]),
        fold_alpha1=float(fold.parameters[1]),
        ends=(_last(detached.result), _last(spurious.result)),
        points=sum(len(branch.points) for run in runs[1:] for branch in run.result.branches),
        seconds=sum(run.seconds for run in runs),
        around=sum(run.around for run in runs),
    )


@dataclass(frozen=True)
class _Run:
    result: Any
    seconds: float
    around: float


def _timed(call: Callable[[], Any], repeats: int) -> _Run:
    """Run AUTO once through bifpy, then its executable alone for its own time."""
    began = time.perf_counter()
    result = call()
    whole = time.perf_counter() - began
    folder = Path(result.output_directory)
    try:
        seconds = median(_own_seconds(folder) for _ in range(repeats))
    finally:
        shutil.rmtree(folder)
    return _Run(result, seconds, whole - seconds)


def _own_seconds(folder: Path) -> float:
    """Run the executable in its folder again and return the time that AUTO prints."""
    done = subprocess.run([folder / "model_exe"], cwd=folder, capture_output=True, text=True, check=True)
    found = re.search(r"Total Time\s+(\S+)", done.stdout)
    assert found is not None, "AUTO prints its time at the end of a run"
    return float(found[1])


def _point(result: Any, kind: Any) -> Any:
    return next(p for branch in result.branches for p in branch.points if p.point_type is kind)


def _last(result: Any) -> tuple[float, float]:
    parameters = result.branches[-1].points[-1].parameters
    return float(parameters[0]), float(parameters[1])


def figures() -> list[Figure]:
    """All of this module; one line that says why where AUTO cannot take part."""
    if reason := missing():
        return [Figure("(g) AUTO-07p", float("nan"), "", note=f"skipped: {reason}")]
    ours = po.trace(beta0=BETA0, lam=(-WINDOW, WINDOW))
    own = milliseconds(partial(po.trace, beta0=BETA0, lam=(-WINDOW, WINDOW)), repeats=9)
    fold = ours.special("LP-lambda")[0]
    lines = [Figure("(g) trace(beta0=4, lam=(-3, 3))", own, "ms", note=f"{len(ours.lam)} points")]
    for words, stride in STRIDES.items():
        auto = diagram(stride)
        apart = max(
            abs(alpha1 - po.equilibrium(beta0=BETA0, lam=lam, state=state).alpha1)
            for (lam, alpha1), state in zip(auto.ends, ("lower", "spurious"), strict=True)
        )
        note = (
            f"{auto.points} points, {1e3 * auto.around:.0f} ms around it, branch point at"
            f" {auto.branch_point:.0e}, fold {auto.fold - fold.lam:+.0e} from ours, ends within {apart:.0e}"
        )
        lines.append(Figure(f"(g) AUTO-07p, {words}", 1e3 * auto.seconds, "ms", note=note))
    return lines
