"""Steps in time of an implicit residual R(u, u', u'') = 0: Radau IIA with five stages, order nine.

R may have algebraic rows and no u''.  SciPy integrates no such systems, and IDAS, whose interface in
CasADi takes u' for algebraic unknowns, repeats a step of six on a residual of this kind and begins at
order one after every event.  Collocation is one formula for both forms: with D the derivative of the
interpolant through the start and the stages, u' = D u and u'' = D u'.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import lu_factor, lu_solve

from ..base.errors import NotConverged

#: Stages: the cost of an error of 1e-9 is least with about five.
STAGES = 5

#: Corrections of a step before it is tried shorter.
MOST_CORRECTIONS = 12

#: Times by which a step may grow or shrink, and its share of what its error allows.
GROWTH, SHRINKAGE, SAFETY = 2.0, 0.25, 0.85

#: Share of the error of a step that its equations may be left with, the ratio of two corrections from which
#: the derivatives are taken anew, and the correction from which a step is tried shorter.
CONVERGED, SLOW, FARTHEST = 0.01, 0.2, 3.0

#: Ratio of two corrections, the second by new derivatives, and the largest of them, from which on all that is
#: left may be rounding, and how much more than that the interpolant may be in error.
STAYS, ROUNDED, ABOVE = 2.0, 1e-7, 4.0

#: What a coefficient that vanishes is taken for.
TINY = 1e-30

#: Shortest step, of the one that was tried first.
SHORTEST = 1e-9


class Linearisation(Protocol):
    """A residual and its derivatives."""

    @property
    def residual(self) -> np.ndarray:
        """What must vanish."""

    @property
    def by_state(self) -> np.ndarray:
        """Its derivative by u."""

    @property
    def by_rate(self) -> np.ndarray:
        """By u'."""

    @property
    def by_second(self) -> np.ndarray:
        """By u''."""


class System(Protocol):
    """What is integrated: all stages of a step together, (stages, n)."""

    def residual(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> np.ndarray:
        """R(u, u', u'')."""

    def balance(self, u: np.ndarray, z: np.ndarray, a: np.ndarray) -> Linearisation:
        """R with its derivatives."""

    def felt(self, change: np.ndarray) -> np.ndarray:
        """What of a change of unknowns, (..., n), counts as error, (..., m)."""


@dataclass(frozen=True)
class RadauTableau:
    """Radau IIA on [0, 1]."""

    stages: int

    @cached_property
    def nodes(self) -> np.ndarray:
        """0, and the zeros of P_s - P_(s-1), of which the last is 1."""
        series = np.zeros(self.stages + 1)
        series[-2:] = -1.0, 1.0
        return np.append(0.0, 0.5 * (1.0 + np.sort(legendre.legroots(series).real)))

    @cached_property
    def differences(self) -> np.ndarray:
        """From values at the stages less that at the start to derivatives at the stages."""
        matrix = self.derivatives(self.nodes[1:])
        return np.asarray(matrix[:, 1:])

    @cached_property
    def to_series(self) -> np.ndarray:
        """From values at the nodes to Legendre coefficients."""
        inverse: np.ndarray = np.linalg.inv(legendre.legvander(2.0 * self.nodes - 1.0, self.stages))
        return inverse

    def weights(self, where: np.ndarray) -> np.ndarray:
        """From values at the nodes to those of the interpolant."""
        values: np.ndarray = legendre.legvander(2.0 * where - 1.0, self.stages) @ self.to_series
        return values

    def derivatives(self, where: np.ndarray) -> np.ndarray:
        """From values at the nodes to derivatives of the interpolant."""
        series = legendre.legder(self.to_series, axis=0) * 2.0
        values: np.ndarray = legendre.legvander(2.0 * where - 1.0, self.stages - 1) @ series
        return values

    @cached_property
    def at_start(self) -> np.ndarray:
        """From values at the nodes to the derivative at 0."""
        return self.derivatives(np.zeros(1))[0]

    @cached_property
    def primitives(self) -> np.ndarray:
        """From values at the stages to Legendre coefficients of the integral of their interpolant from 0."""
        inside = legendre.legvander(2.0 * self.nodes[1:] - 1.0, self.stages - 1)
        return np.asarray(legendre.legint(np.linalg.inv(inside), lbnd=-1, axis=0) * 0.5)

    def integrals(self, where: np.ndarray) -> np.ndarray:
        """From values at the stages to integrals of their interpolant from 0."""
        values: np.ndarray = legendre.legvander(2.0 * where - 1.0, self.stages) @ self.primitives
        return values


@lru_cache(maxsize=8)
def tableau(stages: int) -> RadauTableau:
    """Return the formula of so many stages."""
    return RadauTableau(stages)


class Step(NamedTuple):
    """One step: its times, unknowns and rates at the start and at the stages, (stages + 1, n).

    With the error of its interpolant, and what rounding leaves of its equations where that shows.
    """

    start: float
    length: float
    u: np.ndarray
    z: np.ndarray
    error: float
    rounding: float

    @property
    def stop(self) -> float:
        """Its last time."""
        return self.start + self.length

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return unknowns and rates at times, (times, n) each, by the interpolants of both."""
        matrix = tableau(len(self.u) - 1).weights((t - self.start) / self.length)
        return matrix @ self.u, matrix @ self.z


@dataclass
class Integrator:
    """Radau IIA with steps as long as the interpolant may be in error.

    Parameters
    ----------
    system : System
    mass : bool
        Whether u'' is in R; else the rates at the start of a step do not matter.
    tol : float
        Largest error that is felt, of the interpolant.
    """

    system: System
    mass: bool
    tol: float
    stages: int = STAGES

    def advance(
        self, t: float, u: np.ndarray, z: np.ndarray, h: float, before: Step | None = None
    ) -> tuple[Step, float]:
        """Take a step of at most ``h``, and return it with the length of the next one.

        Raises
        ------
        NotConverged
            If no step is short enough.
        """
        shortest = SHORTEST * max(h, 1e-3)
        while h > shortest:
            taken = self.step(t, u, z, h, before)
            if taken is None:
                h *= SHRINKAGE
                continue
            power = 1.0 / (self.stages + 1)
            tol = max(self.tol, ABOVE * taken.rounding)
            factor = SAFETY * (tol / max(taken.error, TINY)) ** power
            if taken.error <= tol:
                if before is not None:  # where steps get shorter they go on to
                    trend = h / before.length * (before.error / max(taken.error, TINY)) ** power
                    factor *= min(trend, 1.0)
                return taken, h * min(max(factor, SHRINKAGE), GROWTH)
            h *= max(min(factor, 1.0), SHRINKAGE)
        raise NotConverged(f"the motion could not be carried on at t = {t:.6g}.")

    def step(self, t: float, u: np.ndarray, z: np.ndarray, h: float, before: Step | None) -> Step | None:
        """Return one step of a length, or None if its equations were not solved."""
        rule = tableau(self.stages)
        D = rule.differences / h
        stages = u + h * rule.nodes[1:, None] * z if before is None else before.at(t + h * rule.nodes[1:])[0]
        rates, seconds = self._rates(D, u, z, stages)
        factors, last, rounding, was_fresh = None, np.inf, 0.0, False
        for _ in range(MOST_CORRECTIONS):
            fresh = factors is None
            if factors is None:
                residual, factors = self._linearised(D, stages, rates, seconds)
            else:
                residual = self.system.residual(stages, rates, seconds)
            change = lu_solve(factors, -residual.ravel(), check_finite=False).reshape(stages.shape)
            stages = stages + change
            rates, seconds = self._rates(D, u, z, stages)
            size = float(np.abs(self.system.felt(change)).max())
            if size <= CONVERGED * self.tol:
                break
            if fresh and SLOW * last < size < min(STAYS * last, ROUNDED):
                rounding = size
                break
            if not size < FARTHEST or (fresh and was_fresh and size > last):
                return None
            # The front hangs on a small difference: where the derivatives are old it converges slowly.
            factors = factors if size < SLOW * last or last == np.inf else None
            last, was_fresh = size, fresh
        else:
            return None
        whole = np.vstack([u, stages])
        series = np.abs(self.system.felt(rule.to_series @ whole)).max(axis=1)
        # The interpolant lacks the next coefficient, which the last two foretell.
        error = float(series[-1] * min(1.0, series[-1] / max(series[-2], TINY)))
        start = z if self.mass else rule.at_start @ whole / h
        return Step(t, h, whole, np.vstack([start, rates]), error, rounding)

    def _linearised(
        self, D: np.ndarray, stages: np.ndarray, rates: np.ndarray, seconds: np.ndarray
    ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Return the residual at the stages and the factors of its derivative by all of them."""
        at = self.system.balance(stages, rates, seconds)
        whole = D[:, None, :, None] * at.by_rate[:, :, None, :]
        if self.mass:
            whole += (D @ D)[:, None, :, None] * at.by_second[:, :, None, :]
        own = np.arange(self.stages)
        whole[own, :, own, :] += at.by_state
        factors = lu_factor(whole.reshape(stages.size, -1), overwrite_a=True, check_finite=False)
        return at.residual, factors

    def _rates(
        self, D: np.ndarray, u: np.ndarray, z: np.ndarray, stages: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        rates = D @ (stages - u)
        return rates, D @ (rates - z) if self.mass else np.zeros_like(rates)
