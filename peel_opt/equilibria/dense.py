"""The shape of an equilibrium at any place: piecewise as the rod is, with an error of its own.

Between two breaks, where the bond changes its piece, all fields are smooth; at a break the fourth
derivative of theta jumps.  So each stretch has splines of its own, which no kink spoils.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.arrays import EPS, Columns, floats
from ..base.errors import InvalidInput, OutOfRange
from ..model.named_laws import law_named
from ..model.rod import Units
from ..model.stretch import past_of
from ..residual.accuracy import SAFE
from ..residual.closures import Closure
from ..residual.newton import correct
from ..residual.shape import DENSE_POINTS, Shape, Solution, sample_shape

if TYPE_CHECKING:
    from .result import Equilibrium

#: Degree of the splines, and how many times smaller their error is on half the step; half of that is sure.
DEGREE, GAIN = 7, 2.0**4

#: Fields of a shape that are functions of the place.
FIELDS = tuple(f.name for f in fields(Shape) if f.name != "xi")

#: Powers of sbar in their units, where there are any.
POWERS = {"x": 1, "y": 1, "curvature": -1, "Nx": -2, "Ny": -2}

#: Relative distance beyond both ends that is put down to rounding.
ROUNDING = 8.0 * EPS


@dataclass(frozen=True, eq=False, repr=False)
class ShapeAt(Columns):
    """The shape at some places; all arrays have the shape of these.

    Parameters
    ----------
    s : ndarray
        Arc length from the free tip [m].
    x : ndarray
        Along the plate from the detachment point [m].
    y : ndarray
        Height above the plate [m].
    theta : ndarray
        Angle of the tangent to the plate [rad].
    curvature : ndarray
        theta' [1/m].
    Nx, Ny : ndarray
        Reaction force along the plate and normal to it [N/m].
    """

    s: np.ndarray
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    curvature: np.ndarray
    Nx: np.ndarray
    Ny: np.ndarray


class Splines:
    """Fields of a shape in the paper's variables, by splines on each of its stretches.

    Parameters
    ----------
    shape : Shape
    step : int
        Use every so many-th sample.

    Raises
    ------
    InvalidInput
        If the samples are not those of whole stretches.
    """

    def __init__(self, shape: Shape, step: int = 1) -> None:
        count, rest = divmod(len(shape.xi) - 1, DENSE_POINTS - 1)
        if rest:
            raise InvalidInput("the samples of the shape are not those of its stretches.")
        self.shape, self.step = shape, step
        #: Rows of the samples at which stretches begin and end.
        self.edges = np.arange(count + 1) * (DENSE_POINTS - 1)
        self._made: dict[int, Any] = {}

    def at(self, xi: np.ndarray) -> dict[str, np.ndarray]:
        """Return all fields at some places."""
        owner = np.searchsorted(self.shape.xi[self.edges[1:-1]], xi, side="right")
        out = np.empty((*np.shape(xi), len(FIELDS)))
        for number in np.unique(owner).tolist():
            mine = owner == number
            out[mine] = self._spline(number)(xi[mine])
        return dict(zip(FIELDS, np.moveaxis(out, -1, 0), strict=True))

    def _spline(self, number: int) -> Any:
        """Return the spline of all fields on a stretch."""
        if number not in self._made:
            from scipy.interpolate import make_interp_spline

            a, b = self.edges[number : number + 2]
            chosen = slice(a, b + 1, self.step)
            values = np.stack([getattr(self.shape, name)[chosen] for name in FIELDS], axis=-1)
            self._made[number] = make_interp_spline(self.shape.xi[chosen], values, k=DEGREE)
        return self._made[number]

    def difference(self, other: Splines, xi: np.ndarray, longer: float = 1.0) -> float:
        """Return the largest difference of a field from another shape's, of a rod so many times longer."""
        a, b = self.at(xi), other.at(np.minimum(xi / longer, 1.0))
        return max(float(np.max(np.abs(a[n] - longer ** POWERS.get(n, 0) * b[n]))) for n in FIELDS)


class DenseShape:
    """The shape of an equilibrium as a function of the place, ``eq.sol(s)``, like that of `solve_bvp`.

    Parameters
    ----------
    eq : Equilibrium

    Raises
    ------
    InvalidInput
        If it has no shape.

    Examples
    --------
    >>> from peel_opt import Rod, length_given_pressure
    >>> eq = length_given_pressure(Rod.from_ratio(1.0), 0.3)
    >>> [round(float(s / eq.length), 5) for s in eq.sol.breaks]
    [0.0, 0.25838, 1.0]
    >>> [round(float(eq.sol(s).y), 9) for s in eq.sol.free[0]]  # p y_tip = T0 y0/2; y0
    [1.666666667, 1.0]
    """

    def __init__(self, eq: Equilibrium) -> None:
        if eq.shape.xi.size == 0:
            raise InvalidInput(f"there is no shape: {eq.status}.", remedy=eq.message)
        self._eq, self._splines = eq, Splines(eq.shape)

    @property
    def breaks(self) -> np.ndarray:
        """Where stretches begin and end, from the tip to the detachment point [m]."""
        return self._eq.shape.xi[self._splines.edges] * self._eq.length

    @cached_property
    def free(self) -> tuple[tuple[float, float], ...] | None:
        """The stretches that feel no traction, from and to [m]: beyond y0, or never glued.

        None where that is not known: of a state read from a file under a law of the reader's own, or in a
        scene.
        """
        let_go = self._let_go()
        if let_go is None:
            return None
        ends = self.breaks.tolist()
        return tuple((a, b) for a, b, free in zip(ends, ends[1:], let_go, strict=False) if free)

    @cached_property
    def error(self) -> float:
        """Largest error of a field: lengths over sbar, forces over k/sbar^2, curvature times sbar.

        That of the mesh, by solving again on a finer one, and that of the splines.  Not a number where the
        shape was read from a file, which does not know its mesh.
        """
        return self._mesh_error() + self._spline_error()

    def __call__(self, s: Any) -> ShapeAt:
        """Return the shape at arc lengths from the free tip.

        Parameters
        ----------
        s : float, array_like or str
            From 0 to the detached length, in the rod's units [m], or with one, as "0.4 mm".

        Returns
        -------
        ShapeAt

        Raises
        ------
        OutOfRange
            If a place is not on the detached part: beyond it the rod lies on the plate.
        """
        eq = self._eq
        unit = "" if eq.rod is None or eq.rod.dimensionless else "m"
        try:
            places = floats("s", s, unit)
        except (TypeError, ValueError) as error:
            raise InvalidInput(f"s must be numbers, got {s!r:.60}.") from error
        if not np.isfinite(places).all():
            raise InvalidInput("s must be finite.")
        xi = places / eq.length
        wrong = ~((xi >= -ROUNDING) & (xi <= 1.0 + ROUNDING))
        if wrong.any():
            value = float(places[wrong].flat[0])
            shown = f"{eq.length:.6g} {Units.of(eq.rod).length}"
            raise OutOfRange(
                f"s = {value:.6g} is not on the detached part, from 0 at the tip to {shown}.",
                nearest=0.0 if value < 0.0 else eq.length,
            )
        scaled = self._splines.at(np.clip(xi, 0.0, 1.0))
        force = 1.0 if eq.rod is None else eq.rod.force(1.0, eq.length)
        sizes = dict.fromkeys("xy", eq.length) | {"curvature": 1.0 / eq.length, "Nx": force, "Ny": force}
        in_units = {name: (value * sizes.get(name, 1.0))[()] for name, value in scaled.items()}
        return ShapeAt(places[()], **in_units)

    def __repr__(self) -> str:
        unit = Units.of(self._eq.rod).length
        ends = ", ".join(f"{place:.6g}" for place in self.breaks)
        return f"DenseShape(s from tip to detachment [{unit}]; stretches {ends})"

    def _spline_error(self) -> float:
        """What half as many samples make of those between, over what half the step gains."""
        shape, edges = self._eq.shape, self._splines.edges
        between = shape.xi[np.setdiff1d(np.arange(len(shape.xi)), edges)]
        return self._splines.difference(Splines(shape, step=2), between) / GAIN

    def _mesh_error(self) -> float:
        """How far the shape is from that on the refined mesh, and what of that is left."""
        eq, source = self._eq, self._eq.source
        if not isinstance(source, Solution):
            return math.nan
        problem, x = source.problem.without_points(source.x)
        settings = problem.settings
        if settings is None:
            return math.nan
        mesh = settings.refined()
        if math.isfinite(settings.most_gain):  # where the order does not show yet, one step says too little
            mesh = mesh.refined()
        finer = mesh.discretise(problem.phases)
        s = problem.scalars(x)
        held = Closure("length", s.sigma) if eq.rod is None else Closure("ratio", eq.rod.ratio)
        solved = correct(finer, problem.prolonged(x, finer), (held, *eq.asked_at))
        if not solved.converged:
            return math.inf
        there = Splines(sample_shape(finer, solved.x))
        longer = finer.scalars(solved.x).sigma / s.sigma if s.sigma else 1.0
        difference = self._splines.difference(there, eq.shape.xi, longer)
        return SAFE * float(settings.whole_error(problem, x, difference))

    def _let_go(self) -> list[bool] | None:
        """Whether there is traction on each stretch; None where that is not known."""
        eq, source = self._eq, self._eq.source
        if isinstance(source, Solution):
            problem, _ = source.problem.without_points(source.x)
            edge = bool(getattr(eq.scene, "unbonded", 0.0))
            return [p.lets_go or (edge and "unbonded" not in past_of(p)) for p in problem.phases]
        law = law_named(eq.law)
        if law is None or eq.scene is not None:
            return None
        middles = self._splines.edges[:-1] + (DENSE_POINTS - 1) // 2
        heights = eq.shape.y[middles] * (eq.beta1 / eq.beta0 if eq.beta0 else 0.0)
        owner = [sum(u >= piece.start for piece in law.pieces) - 1 for u in heights]
        return [law.pieces[i].lets_go for i in owner]
