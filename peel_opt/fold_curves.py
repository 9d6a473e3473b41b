"""The fold in lambda as a curve over beta0, through its turn and its cusp.

At a fold of the branch at fixed beta0 the linearised system has a null vector with no
component in sigma and lambda.  Equilibrium and null vector together,

    R(x) = 0,   R_x(x) v = 0,   v_sigma = v_lambda = 0,   v_A = 1,

are one equation short of square: a smooth curve, also where its picture in the
(beta0, lambda) plane turns round or has a cusp.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from .arclength import chart
from .checks import positive
from .closures import Closure
from .cohesion import LINEAR
from .continuation import FOLD_WIDTH, StepControl
from .elastica import PI4
from .errors import InvalidInput, NotConverged
from .newton import newton
from .primary import PrimaryBranch, primary_branch
from .transcription import Spectral
from .transcription.base import Discretisation

#: Nodes that give the fold to rounding for beta0 up to 100 (measured: 24 and 36 agree to 1e-12).
MESH = Spectral(nodes=24)


@dataclass(frozen=True)
class CurvePoint:
    """A special point of a fold curve: "turn" of beta0 or "cusp".

    ``bracket`` are the arclengths between which it lies.
    """

    kind: str
    status: str
    bracket: tuple[float, float]
    index: int
    beta0: float
    lam: float
    alpha1: float


@dataclass(frozen=True, eq=False)
class FoldCurve:
    """Folds in lambda at fixed beta0, which are the folds in length of rods.

    Arrays have shape (n,) and follow the curve; beta0 is not monotone along it.

    Parameters
    ----------
    arclength, A, m, sigma, lam : ndarray
    error : ndarray
        Distance of each point from the fold on a finer mesh, in the metric of the arclength.
    special_points : tuple of CurvePoint
    """

    arclength: np.ndarray
    A: np.ndarray
    m: np.ndarray
    sigma: np.ndarray
    lam: np.ndarray
    error: np.ndarray
    special_points: tuple[CurvePoint, ...]
    unknowns: tuple[np.ndarray, ...] = field(repr=False, default=())

    @property
    def beta0(self) -> np.ndarray:
        """(sbar/eta)^3."""
        return self.sigma**3

    @property
    def alpha1(self) -> np.ndarray:
        """Extra pressure at the fold."""
        return self.m * self.A

    @property
    def pressure_ratio(self) -> np.ndarray:
        """p/T0 at the fold."""
        return 1.0 + self.alpha1 / self.beta0

    @property
    def ratio(self) -> np.ndarray:
        """eta/y0 of the rod whose length folds there."""
        return (self.lam + PI4) / self.sigma**4

    def __len__(self) -> int:
        return len(self.lam)

    def at(self, beta0: float) -> np.ndarray:
        """All fold values of lambda at one beta0, solved for, in order along the curve."""
        gap = self.beta0 - positive("beta0", beta0)
        problem, found = _fold_problem(MESH), []
        for i in np.flatnonzero((gap[:-1] * gap[1:] < 0.0) | (gap[:-1] == 0.0)):
            share = gap[i] / (gap[i] - gap[i + 1])
            start = (1.0 - share) * self.unknowns[i] + share * self.unknowns[i + 1]
            solved = problem.at(start, math.cbrt(beta0))
            if solved is None:
                raise NotConverged(
                    f"the fold at beta0 = {beta0:g} did not converge.", remedy="Give more points."
                )
            found.append(solved[-1])
        return np.array(found)

    def __repr__(self) -> str:
        lines = [f"FoldCurve of {len(self)} points, beta0 {self.beta0.min():.6g} to {self.beta0.max():.6g}"]
        lines += [
            f"├─ {p.kind}: beta0 = {p.beta0:.9g}, lambda = {p.lam:.9g}, alpha1 = {p.alpha1:.9g} ({p.status})"
            for p in self.special_points
        ]
        return "\n".join([*lines, f"└─ error up to {self.error.max():.1e}"])


def fold_curve(beta0: tuple[float, float] = (0.1, 100.0), *, points: int = 80) -> FoldCurve:
    """Follow the fold in lambda over beta0 under the linear law.

    Parameters
    ----------
    beta0 : tuple of float
        From (below 36, where the fold is unique) and to, both positive.
    points : int
        About how many; the step adapts.

    Returns
    -------
    FoldCurve

    Raises
    ------
    InvalidInput
        If the range is not one.
    NotConverged
        If the curve cannot be followed to its end.

    Examples
    --------
    >>> curve = fold_curve((1, 50))
    >>> [(p.kind, round(p.beta0, 3)) for p in curve.special_points]
    [('turn', 37.546), ('cusp', 36.115)]
    """
    low, high = (positive("beta0", value) for value in beta0)
    if not low < min(high, 36.0):
        raise InvalidInput(f"beta0 must start below 36 and rise, got ({low:g}, {high:g}).")
    problem = _fold_problem(MESH)
    start = problem.point(problem.from_branch(low), np.array([0.0, 0.0, 0.0, 1.0]), 0.0)
    length = math.asinh(math.cbrt(high)) - math.asinh(math.cbrt(low)) + 6.0
    control = StepControl(first=0.01, largest=length / points)
    walked: list[_CurveStep] = []
    special: list[tuple[str, _CurveStep, tuple[float, float]]] = []
    for there in problem.walk(start, control):
        if walked:
            special += problem.located(walked[-1], there)
        if there.sigma > math.cbrt(high):
            walked.append(problem.end(walked[-1], there, math.cbrt(high)))
            break
        walked.append(there)
        if len(walked) > 20 * points:
            raise NotConverged(f"the fold curve did not reach beta0 = {high:g}.", remedy="Give more points.")
    every = sorted(walked + [s for _, s, _ in special], key=lambda s: s.arclength)
    place = {id(s): i for i, s in enumerate(every)}
    A, m, sigma, lam = np.array([s.z[-4:] for s in every]).T
    finer = _fold_problem(MESH.refined())
    return FoldCurve(
        np.array([s.arclength for s in every]),
        A,
        m,
        sigma,
        lam,
        error=np.array([problem.distance(s, finer) for s in every]),
        special_points=tuple(
            CurvePoint(kind, _status(bracket), bracket, place[id(s)], s.sigma**3, s.z[-1], s.z[-4] * s.z[-3])
            for kind, s, bracket in special
        ),
        unknowns=tuple(s.z for s in every),
    )


def _status(bracket: tuple[float, float]) -> str:
    return "located" if bracket[1] - bracket[0] <= 10.0 * FOLD_WIDTH else "bracketed"


@dataclass(frozen=True, eq=False)
class _CurveStep:
    """A point of the curve: unknowns z = (v without its known entries, x), and the tangent."""

    z: np.ndarray
    tangent: np.ndarray
    arclength: float

    @property
    def sigma(self) -> float:
        return float(self.z[-2])


class _FoldProblem:
    """Equilibrium and null vector together, for one phase of the linear law."""

    def __init__(self, mesh: Spectral) -> None:
        self.problem: Discretisation = mesh.discretise(LINEAR.pieces)

    @cached_property
    def linearised(self) -> ca.Function:
        """Compiled z -> (F, dF/dz)."""
        n, x = self.problem.size, self.problem.x
        free = ca.MX.sym("v", n - 3)
        # v in the order of x: fields, A, m, sigma, lambda.
        v = ca.vertcat(free[: n - 4], 1.0, free[n - 4], 0.0, 0.0)
        residual = self.problem.expression
        equations = ca.vertcat(residual, ca.jtimes(residual, x, v))
        z = ca.vertcat(free, x)
        parts = [ca.jacobian(equations, free), ca.jacobian(equations, x)]
        function = ca.Function("fold", [free, x], [equations, ca.horzcat(*parts)])
        whole = ca.MX.sym("z", z.numel())
        return ca.Function("fold", [whole], function(whole[: n - 3], whole[n - 3 :]))

    def from_branch(self, beta0: float) -> np.ndarray:
        """Return the fold of the branch at ``beta0``, from the walk along it."""
        branch: PrimaryBranch = primary_branch(LINEAR, Closure("length", math.cbrt(beta0)))
        branch.extend(lambda _: branch.fold("LP-lambda") is not None)
        fold = branch.fold("LP-lambda")
        if fold is None:
            raise NotConverged(f"no fold in lambda was found at beta0 = {beta0:g}.", remedy="Start lower.")
        point = fold.point
        here = point.problem
        n = self.problem.size
        x = self.problem.pack(point.profile)
        # The null vector is the tangent of the branch; carry it over as a difference of profiles.
        h = 1e-6
        ahead = self.problem.pack(here.profile(point.x + h * point.tangent))
        v = (ahead - x) / h
        v = v / v[n - 4]
        z = np.concatenate([v[: n - 4], v[n - 3 : n - 2], x])
        corrected = self.at(z, float(x[-2]))
        if corrected is None:
            raise NotConverged(f"the fold at beta0 = {beta0:g} did not converge.", remedy="Start elsewhere.")
        return corrected

    def at(self, z: np.ndarray, sigma: float) -> np.ndarray | None:
        """Correct a guess to the fold at a given sigma; None on failure."""
        return self._correct(z, lambda s: (np.array([s[2] - sigma]), np.array([[0.0, 0.0, 1.0, 0.0]])))

    def end(self, here: _CurveStep, beyond: _CurveStep, sigma: float) -> _CurveStep:
        """Return the point between two neighbours that has a given sigma."""
        share = (sigma - here.sigma) / (beyond.sigma - here.sigma)
        z = self.at((1.0 - share) * here.z + share * beyond.z, sigma)
        if z is None:
            raise NotConverged(f"no landing on beta0 = {sigma**3:g}.", remedy="Give more points.")
        arclength = (1.0 - share) * here.arclength + share * beyond.arclength
        return self.point(z, _direction(here), arclength)

    def _correct(self, z: np.ndarray, row: object) -> np.ndarray | None:
        scale = 1.0 + np.abs(z)

        def linearise(z: np.ndarray) -> tuple[np.ndarray, object]:
            equations, jacobian = (part.full() for part in self.linearised(z))
            value, gradient = row(z[-4:])  # type: ignore[operator]
            matrix = np.vstack([jacobian, np.zeros((1, len(z)))])
            matrix[-1, -4:] = gradient
            return np.concatenate([equations.ravel(), value]), lambda: lambda b: np.linalg.solve(matrix, b)

        result = newton(linearise, z, scale)  # type: ignore[arg-type]
        return result.x if result.converged else None

    def point(self, z: np.ndarray, forward: np.ndarray, arclength: float) -> _CurveStep:
        """Return the point with its unit tangent on the side of the direction ``forward``."""
        _, jacobian = (part.full() for part in self.linearised(z))
        _, gradient = chart(z[-4:])
        matrix = np.vstack([jacobian, np.zeros((1, len(z)))])
        matrix[-1, -4:] = forward @ gradient
        right = np.zeros(len(z))
        right[-1] = 1.0
        tangent = np.linalg.solve(matrix, right)
        return _CurveStep(z, tangent / np.linalg.norm(gradient @ tangent[-4:]), arclength)

    def step(self, here: _CurveStep, ds: float) -> _CurveStep | None:
        """Advance by ``ds``; None if the corrector fails."""
        origin, gradient = chart(here.z[-4:])
        direction = gradient @ here.tangent[-4:]

        def plane(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            value, slope = chart(s)
            return np.array([direction @ (value - origin) - ds]), (direction @ slope)[None, :]

        z = self._correct(here.z + ds * here.tangent, plane)
        return None if z is None else self.point(z, direction, here.arclength + ds)

    def walk(self, start: _CurveStep, control: StepControl) -> Iterator[_CurveStep]:
        """Yield points from ``start`` on, until the step falls below its floor."""
        here, ds = start, control.first
        yield here
        while ds > control.smallest:
            there = self.step(here, ds)
            if there is None or float(_direction(here) @ _direction(there)) < control.turn:
                ds *= 0.5
                continue
            ds = min(1.5 * ds, control.largest)
            here = there
            yield here

    def located(
        self, here: _CurveStep, there: _CurveStep
    ) -> list[tuple[str, _CurveStep, tuple[float, float]]]:
        """Find where beta0 turns round between two neighbours; at a cusp lambda turns there too."""
        if here.tangent[-2] * there.tangent[-2] >= 0.0:
            return []
        low, high = here, there
        while high.arclength - low.arclength > FOLD_WIDTH:
            share = low.tangent[-2] / (low.tangent[-2] - high.tangent[-2])
            middle = self.step(low, (high.arclength - low.arclength) * min(max(share, 0.05), 0.95))
            if middle is None:
                break
            low, high = (middle, high) if middle.tangent[-2] * low.tangent[-2] > 0 else (low, middle)
        kind = "cusp" if abs(low.tangent[-1]) < 1e-6 * PI4 else "turn"
        return [(kind, low, (low.arclength, high.arclength))]

    def distance(self, step: _CurveStep, finer: _FoldProblem) -> float:
        """Distance of a point from the fold on a finer mesh, at the same A."""
        n, fine = self.problem.size, finer.problem
        x = fine.pack(self.problem.profile(step.z[n - 3 :]))
        v = np.zeros(n)
        v[: n - 4], v[n - 4], v[n - 3] = step.z[: n - 4], 1.0, step.z[n - 4]
        h = 1e-6
        ahead = fine.pack(self.problem.profile(step.z[n - 3 :] + h * v))
        w = (ahead - x) / h
        k = fine.size
        z = np.concatenate([w[: k - 4], w[k - 3 : k - 2], x])
        origin, gradient = chart(step.z[-4:])
        direction = gradient @ step.tangent[-4:]

        def plane(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            value, slope = chart(s)
            return np.array([direction @ (value - origin)]), (direction @ slope)[None, :]

        found = finer._correct(z, plane)
        return math.inf if found is None else float(np.linalg.norm(chart(found[-4:])[0] - origin))


def _direction(step: _CurveStep) -> np.ndarray:
    return chart(step.z[-4:])[1] @ step.tangent[-4:]


@lru_cache(maxsize=4)
def _fold_problem(mesh: Spectral) -> _FoldProblem:
    return _FoldProblem(mesh)
