"""`hysteresis`: what a rod does when the load is swept up and back down.

At fixed beta0 the swept number is lambda.  The straight rod is a state for every lambda; the
detached one exists above the fold F.  When a state is lost, or given up, the rod jumps to the
other.  Under the *delay* convention it holds on as long as it can: it peels at lambda = 0 and
re-adheres at lambda_F.  Under the *Maxwell* convention both happen at lambda_M, where the
effective potential has two minima of equal depth; up and down are then the same path.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from .branch import Branch
from .checks import finite, non_negative, positive
from .effective_potential import EffectivePotential
from .elastica import PI4
from .errors import InvalidInput, NoEquilibrium, NotConverged
from .gauss import Grid
from .landau import NormalForm
from .maxwell_points import maxwell_point, walk_round_the_fold
from .pressure_loop import PressureLoop, sweep_pressure
from .rod import Rod
from .traced_potential import branch_potential
from .tracing import trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Convention = Literal["delay", "maxwell"]

#: Window of lambda swept by default, in units of -lambda_F, and at beta0 = 0.
WINDOW = (-1.3, 0.4)
WINDOW_AT_ZERO = (-0.5, 1.0)

#: Points of the traced branch below and above this beta0, where it has a corner.
_CORNER = 37.0
_POINTS, _POINTS_AT_CORNER = 128, 512

_ADHERED = "adhered"

#: Extra pressure, label, error and row of a state.
_State = tuple[float, str, float, int]


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


@dataclass(frozen=True, eq=False)
class Sweep:
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
        from .plots.potential import plot_loop

        return plot_loop(self, ax)

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


def hysteresis(
    rod: Rod | None = None,
    *,
    beta0: float | None = None,
    convention: Convention = "delay",
    form: NormalForm | None = None,
    lam: tuple[float, float] | None = None,
    points: int = 41,
    tol: float | None = None,
) -> HysteresisLoop | PressureLoop:
    """Sweep lambda at fixed beta0, or the pressure on a rod, up and back down.

    Parameters
    ----------
    rod : Rod, optional
        Sweep the pressure under law (8): see `PressureLoop`.  Either this or ``beta0``.
    beta0 : float, optional
        Sweep lambda at this beta0 >= 0 under the linear law.
    convention : {"delay", "maxwell"}
        When a state is given up; a rod under a pressure has the delay only.
    form : NormalForm, optional
        Take the states from a normal form instead of solving for them.
    lam : tuple of float, optional
        From where to where; default from 1.3 lambda_F to 0.4 abs(lambda_F).
    points : int
        Values of the swept number each way.
    tol : float
        Largest error of a solved state, in the metric of the arclength; default 1e-10 at fixed
        beta0, 1e-8 for a rod.

    Returns
    -------
    HysteresisLoop or PressureLoop

    Raises
    ------
    InvalidInput
        If the arguments do not say what to sweep, or the window does not hold the loop.
    NoEquilibrium
        If there is no fold in lambda: above beta0 = 37.5458, or where a form does not reach.
    NotConverged
        If a swept state cannot be solved for to ``tol``.

    Notes
    -----
    lambda_M depends on how (33) is written, since a positive factor moves it; the fold, the
    jump at lambda = 0 and the area under the delay convention do not.

    Examples
    --------
    >>> loop = hysteresis(beta0=4.0)
    >>> [(jump.direction, round(jump.lam, 8) + 0.0) for jump in loop.jumps]
    [('up', 0.0), ('down', -0.26900109)]
    >>> round(loop.area, 6)
    0.624881
    """
    if (rod is None) == (beta0 is None):
        raise InvalidInput("give either a rod or beta0 to sweep.")
    if convention not in ("delay", "maxwell"):
        raise InvalidInput(f"convention must be 'delay' or 'maxwell', got {convention!r}.")
    if isinstance(points, bool) or not isinstance(points, int) or points < 4:
        raise InvalidInput(f"points must be a whole number of at least 4, got {points!r}.")
    tol = positive("tol", (1e-10 if rod is None else 1e-8) if tol is None else tol)
    if rod is not None:
        if convention != "delay" or form is not None or lam is not None:
            raise InvalidInput(
                "a rod is swept in pressure, with the delay convention and no normal form.",
                remedy="Give beta0 for a loop in lambda.",
            )
        return sweep_pressure(rod, points, tol)
    assert beta0 is not None
    b0 = non_negative("beta0", beta0)
    if form is not None:
        return _of_a_form(b0, convention, form, lam, points)
    return _of_the_solver(b0, convention, lam, points, tol)


def _of_the_solver(
    beta0: float, convention: Convention, lam: tuple[float, float] | None, points: int, tol: float
) -> HysteresisLoop:
    """Solve for every swept state."""
    fold = 0.0
    if beta0 > 0.0:
        located = walk_round_the_fold(beta0).fold("LP-lambda")
        assert located is not None
        fold = located.point.scalars.lam
    window = _window(lam, fold)
    count = _POINTS if beta0 < _CORNER else _POINTS_AT_CORNER
    switch = 0.0
    if convention == "maxwell" and beta0 > 0.0:
        switch = maxwell_point(beta0)[0]
    grid = _grid(window, fold, switch, points)
    swept = [float(value) for value in grid if fold < value < window[1] and (value or beta0)]
    branch = trace(beta0=beta0, lam=window, points=count, tol=tol, at={"lam": swept})
    folds = branch.special("LP-lambda")
    if beta0 > 0.0 and not (folds and abs(folds[0].lam - fold) < _same(fold)):
        raise NotConverged(
            f"the traced branch at beta0 = {beta0:.9g} does not turn at lambda = {fold:.9g}.",
            remedy="Stay further below beta0 = 37.5458, where the branch has a corner.",
        )
    lower = np.flatnonzero(branch.state == "lower")

    def solved(value: float) -> _State:
        rows = np.array([folds[0].index]) if value == fold and folds else lower
        row = int(rows[np.argmin(np.abs(branch.lam[rows] - value))])
        if abs(branch.lam[row] - value) > _same(fold):
            raise NotConverged(
                f"no lower state was reached at beta0 = {beta0:g}, lambda = {value:.9g}.",
                remedy="Sweep a narrower window, or ask for another number of points.",
            )
        return float(branch.alpha1[row]), "lower", float(branch.error[row]), row

    potential = branch_potential(branch) if beta0 > 0.0 else None
    ends = (fold if convention == "delay" else switch, switch)
    return _loop(beta0, convention, "solver", grid, ends, solved, potential, branch)


def _of_a_form(
    beta0: float, convention: Convention, form: NormalForm, lam: tuple[float, float] | None, points: int
) -> HysteresisLoop:
    """Read the states off a normal form."""
    potential = form.at(beta0)
    fold, at_fold = potential.fold()
    switch = potential.maxwell()[0] if convention == "maxwell" else 0.0
    if convention == "delay":
        potential.delay()  # an error here says how far the form reaches
    grid = _grid(_window(lam, fold), fold, switch, points)

    def solved(value: float) -> _State:
        if value == fold and beta0 > 0.0:
            return at_fold, "lower", np.nan, -1
        below = [x for x in potential.alpha1(value) if x < at_fold]
        if not below:
            raise NoEquilibrium(
                f"the curve of this form ends before lambda = {value:.6g} at beta0 = {beta0:g}.",
                remedy="Sweep a narrower window with lam=(low, high).",
            )
        return float(below[-1]), "lower", np.nan, -1

    ends = (fold if convention == "delay" else switch, switch)
    return _loop(beta0, convention, form.kind, grid, ends, solved, potential, None)


def _window(lam: tuple[float, float] | None, fold: float) -> tuple[float, float]:
    """Return the swept window; it must hold the whole loop."""
    if lam is None:
        return (WINDOW[0] * -fold, WINDOW[1] * -fold) if fold else WINDOW_AT_ZERO
    try:
        low, high = (finite("lam", value) for value in lam)
    except TypeError as error:
        raise InvalidInput(f"lam must be two numbers, from and to, got {lam!r}.") from error
    if not (-PI4 <= low < fold <= 0.0 < high):
        raise InvalidInput(
            f"the window ({low:g}, {high:g}) of lambda does not hold the loop.",
            remedy=f"Start between -pi^4 and {fold:.6g}, the fold, and end above 0.",
        )
    return low, high


def _grid(window: tuple[float, float], fold: float, switch: float, points: int) -> np.ndarray:
    """Values swept: even, with the fold, the jumps and lambda = 0 among them."""
    return np.unique([*np.linspace(*window, points), fold, switch, 0.0])


def _same(fold: float) -> float:
    """How close two values of lambda must be to count as one."""
    return max(1e-9 * abs(fold), 1e-12)


def _loop(
    beta0: float,
    convention: Convention,
    source: str,
    grid: np.ndarray,
    ends: tuple[float, float],
    solved: Callable[[float], _State],
    potential: EffectivePotential | None,
    branch: Branch | None,
) -> HysteresisLoop:
    """Put the two sweeps together; ``ends`` are where it jumps down and up."""
    down, up = ends
    detached = {float(value): solved(float(value)) for value in grid if value >= down and (value or beta0)}

    def straight(values: np.ndarray) -> list[tuple[float, _State]]:
        return [(float(value), (0.0, _ADHERED, 0.0, -1)) for value in values]

    def held(values: np.ndarray) -> list[tuple[float, _State]]:
        return [(float(value), detached[float(value)]) for value in values if float(value) in detached]

    upwards = _sweep([*straight(grid[grid <= up]), *held(grid[grid >= up])])
    downwards = _sweep([*held(grid[grid >= down][::-1]), *straight(grid[grid <= down][::-1])])
    jumps: tuple[Jump, ...] = ()
    area = 0.0
    if beta0 > 0.0:
        peeled, lost = detached[up][0], detached[down][0]
        jumps = (Jump("up", up, 0.0, peeled), Jump("down", down, lost, 0.0))
        assert potential is not None
        area = _area(potential, lost, peeled)
    said = NOT_COMPUTED if jumps else ""
    return HysteresisLoop(beta0, convention, source, upwards, downwards, jumps, area, said, branch)


def _sweep(visits: list[tuple[float, _State]]) -> Sweep:
    lam = np.array([value for value, _ in visits])
    columns = (lam, *(np.array(column) for column in zip(*(entry for _, entry in visits), strict=True)))
    for column in columns:
        column.flags.writeable = False
    return Sweep(*columns)


def _area(potential: EffectivePotential, lost: float, peeled: float) -> float:
    """Integral of alpha1 dlambda along the lower branch between the two jumps."""
    cell = Grid.gauss(8)
    edges = np.linspace(lost, peeled, 65)
    x = edges[:-1, None] + np.diff(edges)[:, None] * cell.xi
    return abs(float((x * potential.slope(x) @ cell.weights) @ np.diff(edges)))
