"""`Calibration`: fitted material numbers, how sure they are, and what the data cannot tell."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.drawing import Pictured, draw
from ...base.errors import InvalidInput
from ...base.records import Table, Tabled
from ...equilibria.result import Equilibrium
from ...model.bond import CohesiveLaw, as_asked
from ...model.rod import UNITS, Rod
from .covariance import chance
from .data import Observation
from .problem import Fitted, Problem
from .profile import LikelihoodProfile, interval, profile
from .record import fit_columns, fit_record
from .words import Combination, Direction

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Fit(Pictured, Tabled):
    """A fit to measurements, as far as it is the same for a rod and for a scene.

    Parameters
    ----------
    rod : Rod
        With the fitted numbers.
    free : tuple of str
        The numbers that were fitted, in the order of the covariance.
    deviance : float
        Chi-square; with a robust loss, the sum of what the residuals cost.
    degrees : int
        Degrees of freedom: independent data less free numbers.
    singular_values : ndarray, shape (free,)
        Of the weighted Jacobian in logarithms, or whatever the coordinates of the fit are.
    observations : tuple of Observation
    residuals : tuple of ndarray
        Of each observation, in standard deviations: length, pressure, then x and y of points.
    weights : tuple of ndarray
        What a robust loss leaves of the weight of each pair or point; 1 for least squares.
    equilibria : tuple of Equilibrium
        The fitted state of each observation, solved again by the ordinary functions and certified.
    consistency : float
        Largest difference (p/T0 or sbar/eta) between a fitted state and that certified one.
    loss : str
    loss_scale : float or None
    iterations : int
        Rods that were tried.
    warnings : tuple of str
        What a reader must know before believing the numbers.
    scaled : float or None
        By how much the standard deviations of the data were multiplied such that chi-square is the number of
        degrees of freedom; those of ``observations`` are the result.  None where they are meant as they are.
    """

    rod: Rod
    free: tuple[str, ...]
    deviance: float
    degrees: int
    singular_values: np.ndarray
    observations: tuple[Observation, ...]
    residuals: tuple[np.ndarray, ...]
    weights: tuple[np.ndarray, ...]
    equilibria: tuple[Equilibrium, ...]
    consistency: float
    loss: str
    loss_scale: float | None
    iterations: int
    warnings: tuple[str, ...] = ()
    scaled: float | None = None

    @property
    @abstractmethod
    def estimates(self) -> dict[str, float]:
        """The fitted numbers, in SI units."""

    @property
    @abstractmethod
    def units(self) -> dict[str, str]:
        """Their units."""

    @property
    @abstractmethod
    def covariance(self) -> np.ndarray:
        """Covariance in SI units, to first order, shape (free, free)."""

    @property
    @abstractmethod
    def known(self) -> Sequence[Combination | Direction]:
        """Combinations of the free numbers that the data know independently, the best first."""

    @property
    def identifiable(self) -> bool:
        """Whether the data determine every free number."""
        return all(combination.determined for combination in self.known)

    @property
    @abstractmethod
    def has_profile(self) -> bool:
        """Whether there is a likelihood with a maximum: a robust loss is none, and a flat one has none."""

    @property
    def determined(self) -> list[str]:
        """What the data know of the free numbers, in words."""
        return [str(combination) for combination in self.known]

    @abstractmethod
    def interval(self, name: str, *, level: float = 0.95, method: str | None = None) -> tuple[float, float]:
        """Interval of confidence of a free number, in SI units."""

    @abstractmethod
    def covariances(self) -> dict[str, Any]:
        """Return what the record has of covariances, plain data by name."""

    @property
    def chi2(self) -> float:
        """Sum of squared residuals in standard deviations."""
        return float(sum(r @ r for r in self.residuals))

    @property
    def p_value(self) -> float:
        """Chance of a larger chi-square if model and standard deviations hold.

        Not a number without freedom, or where the residuals themselves say the standard deviations.
        """
        known = self.degrees > 0 and self.scaled is None
        return chance(self.chi2, self.degrees) if known else math.nan

    @property
    def sd(self) -> dict[str, float]:
        """Standard deviations, in SI units, to first order."""
        return dict(zip(self.free, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def correlation(self) -> np.ndarray:
        """Correlation of the free numbers, to first order, shape (free, free); nan where nothing is known."""
        sd = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore"):
            found: np.ndarray = self.covariance / np.outer(sd, sd)
        np.fill_diagonal(found, 1.0)
        return found

    @property
    def scatter(self) -> str:
        """What the residuals say of the standard deviations, where the data do not; empty where they do."""
        if self.scaled is None:
            return ""
        spreads = {
            "lengths": [o.length_sd / o.length for o in self.observations if o.length_sd and o.length],
            "pressures": [
                o.pressure_sd / o.pressure for o in self.observations if o.pressure_sd and o.pressure
            ],
        }
        points = [float(np.median(o.points[:, 2])) for o in self.observations if o.points is not None]
        parts = [
            f"{100.0 * float(np.median(shares)):.2g} % of {name}"
            for name, shares in spreads.items()
            if shares
        ]
        parts += [f"{1e6 * float(np.median(points)):.2g} um of points"] if points else []
        return f"standard deviations are those of the residuals: {', '.join(parts)}"

    def _index(self, name: str) -> int:
        if name not in self.free:
            raise InvalidInput(f"{name!r} was not fitted.", remedy=f"Fitted are {', '.join(self.free)}.")
        return self.free.index(name)

    @property
    def largest(self) -> tuple[str, float]:
        """The observation with the largest residual, and that in standard deviations."""
        sizes = [float(np.abs(r).max(initial=0.0)) for r in self.residuals]
        worst = int(np.argmax(sizes))
        return self.observations[worst].name, sizes[worst]

    # --- out ------------------------------------------------------------------------------

    def plot(
        self,
        ax: Axes | None = None,
        residuals: Axes | None = None,
        *,
        legend: bool = True,
        title: str | None = None,
    ) -> Axes:
        """Draw measurements, the fitted branch with its band, and residuals; return the axes."""
        return draw(self, ax, residuals=residuals, legend=legend, title=title)

    def summary(self) -> dict[str, Any]:
        """All numbers as plain data, with units in the keys."""
        return fit_record(self)

    def _table(self) -> Table:
        """Observations, fitted values and residuals, the numbers above them."""
        return fit_columns(self)

    def __repr__(self) -> str:
        numbers = ", ".join(
            f"{name} = {value:.6g} +- {self.sd[name]:.2g} {self.units[name]}".rstrip()
            for name, value in self.estimates.items()
        )
        text = (
            f"{type(self).__name__}({numbers}; chi2 = {self.chi2:.4g} for {self.degrees} degrees of freedom,"
            f" {len(self.observations)} observations, consistent to {self.consistency:.1e})"
        )
        text += f"\n  {self.scatter}" * bool(self.scatter)
        return "\n".join([text, *(f"  warning: {warning}" for warning in self.warnings)])


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Calibration(Fit):
    """A fit of material numbers to measurements.

    Parameters
    ----------
    rod, free, deviance, degrees, singular_values, observations, residuals, weights, equilibria, consistency
        As in `Fit`.
    loss, loss_scale, iterations, warnings
        As in `Fit`.
    log_covariance : ndarray, shape (free, free)
        Of the logarithms of the free numbers.
    combinations : tuple of Combination
        Products of powers of the free numbers that the data know independently, best first.
    """

    log_covariance: np.ndarray
    combinations: tuple[Combination, ...]
    problem: Problem = field(repr=False)
    fitted: Fitted = field(repr=False)

    @property
    def estimates(self) -> dict[str, float]:
        """The fitted numbers, in SI units."""
        return {name: float(getattr(self.rod, name)) for name in self.free}

    @property
    def units(self) -> dict[str, str]:
        """Their units."""
        return {name: UNITS[name] for name in self.free}

    @property
    def covariance(self) -> np.ndarray:
        """Covariance in SI units, to first order, shape (free, free)."""
        values = np.array(list(self.estimates.values()))
        return self.log_covariance * np.outer(values, values)

    def relative_sd(self, name: str) -> float:
        """Standard deviation of the logarithm of a free number."""
        i = self._index(name)
        return float(math.sqrt(self.log_covariance[i, i]))

    @property
    def known(self) -> tuple[Combination, ...]:
        """The combinations, as every fit has them."""
        return self.combinations

    @property
    def origins(self) -> tuple[float | None, ...]:
        """x of the detachment point of each shape [m], 0 unless it was free.

        In the order of the observations, since shapes may share a name; None for pairs.
        """
        return tuple(
            None if o.points is None else float(x)
            for o, x in zip(self.observations, self.fitted.origins, strict=True)
        )

    @property
    def law(self) -> str | CohesiveLaw:
        """The law of the fit, as the public functions take it."""
        return as_asked(self.problem.chart.law)

    @property
    def has_profile(self) -> bool:
        """Whether there is a likelihood with a maximum: a robust loss is none, and a flat one has none."""
        return self.loss == "least-squares" and not self.fitted.held

    # --- beyond the covariance -----------------------------------------------------------

    def profile(self, name: str, *, points: int = 11, width: float = 3.0) -> LikelihoodProfile:
        """Profile likelihood of a free number: the other numbers fitted again at each value.

        Parameters
        ----------
        name : str
        points : int
            3 to 1000.
        width : float
            Half width, in standard deviations of the covariance.

        Raises
        ------
        InvalidInput
            If the number was not fitted, or points or width cannot be meant.
        NotConverged
            If a value on the way cannot be fitted, or is fitted better than the fit itself.
        """
        return profile(self, self._index(name), points, width)

    def interval(self, name: str, *, level: float = 0.95, method: str | None = None) -> tuple[float, float]:
        """Interval of confidence of a free number, in SI units.

        Parameters
        ----------
        name : str
        level : float
        method : {"profile", "covariance"}, optional
            From the profile likelihood, or from the covariance of the logarithms.  Default: the
            profile; with a robust loss, which is no likelihood, the covariance and Student's t.

        Returns
        -------
        tuple of float
            0 or infinity for an end that the data do not set.

        Raises
        ------
        InvalidInput
            If the number was not fitted, or level or method cannot be meant.
        NotConverged
            If a fit on the way to an end of the profile fails, or is better than the fit itself.
        """
        return interval(self, self._index(name), level, method)

    def covariances(self) -> dict[str, Any]:
        """Return what the record has of covariances, plain data by name."""
        return {"log_covariance": self.log_covariance.tolist()}
