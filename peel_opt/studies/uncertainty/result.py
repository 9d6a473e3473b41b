"""What is known of a number whose inputs are uncertain."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.arrays import Columns
from ...base.drawing import Pictured, draw
from ...base.errors import InvalidInput
from ...base.records import Column, Table, Tabled
from ...base.units import display
from .fates import FATES
from .inputs import Spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Share of the standard deviation by which the linearised samples may miss the true ones.
LINEAR_ENOUGH = 0.1

#: Half width of an interval of a Sobol index above which more samples are recommended.
SHARP_ENOUGH = 0.2


@dataclass(frozen=True, eq=False, repr=False)
class SobolIndices(Columns):
    """Which input causes how much of the variance, with 95 % bootstrap intervals.

    Parameters
    ----------
    inputs : tuple of str
    first, total : ndarray, shape (inputs,)
        Share caused by an input alone, and together with others.
    first_interval, total_interval : ndarray, shape (inputs, 2)
        From and to.
    size : int
        Base samples; the number of answers behind the indices is ``size`` (inputs + 2).
    """

    inputs: tuple[str, ...]
    first: np.ndarray
    total: np.ndarray
    first_interval: np.ndarray
    total_interval: np.ndarray
    size: int

    @property
    def width(self) -> float:
        """Half width of the widest interval."""
        both = np.concatenate([self.first_interval, self.total_interval])
        return float(0.5 * np.max(both[:, 1] - both[:, 0]))

    @property
    def statement(self) -> str:
        """What is to be said about the convergence of the indices."""
        words = f"Sobol indices within {self.width:.2g} (95 % bootstrap, {self.size} base samples)"
        return words if self.width <= SHARP_ENOUGH else f"{words}: not sharp, take more samples"


@dataclass(frozen=True, eq=False, repr=False)
class Propagated(Columns):
    """One number and how uncertain it is, by linearisation and by sampling.

    Parameters
    ----------
    name, unit : str
    nominal : float
        At the nominal inputs.
    derivatives : dict of float
        d number / d input at the nominal inputs, exact; empty if they are infinite there.
    linear_mean, linear_sd : float
        Of the linearised number.
    values : ndarray, shape (samples,)
        The number at the samples, NaN where there is none.
    linear_values : ndarray, shape (samples,)
        The linearised number at the same samples.
    reasons : dict of int
        How many samples have no answer, by status.
    error : float
        Largest error of a sampled number.
    indices : SobolIndices or None
        None unless asked for and every sample has an answer, the mixed ones of the indices too.
    unmixed : int
        How many of the mixed samples have no answer.
    fates : dict of int
        What becomes of the samples that have no answer, as far as that is known: how many "re-adhere",
        "break off", "grow stably" or "make no rod", in words in `FATES`.
    correlated : bool
        Whether the inputs depend on each other: then no share of the variance is that of one input.
    """

    name: str
    unit: str
    nominal: float
    derivatives: dict[str, float]
    linear_mean: float
    linear_sd: float
    values: np.ndarray
    linear_values: np.ndarray
    reasons: dict[str, int]
    error: float
    indices: SobolIndices | None
    unmixed: int = 0
    fates: dict[str, int] = field(default_factory=dict)
    correlated: bool = False

    @property
    def found(self) -> np.ndarray:
        """The sampled numbers that exist."""
        return self.values[np.isfinite(self.values)]

    @property
    def mean(self) -> float:
        """Mean of the samples that have an answer; NaN if none has."""
        return float(np.mean(self.found)) if self.found.size else math.nan

    @property
    def sd(self) -> float:
        """Standard deviation of the samples that have an answer."""
        return float(np.std(self.found, ddof=1)) if self.found.size > 1 else math.nan

    def quantile(self, share: float) -> float:
        """Return the number below which this share of the answered samples lies."""
        if not 0.0 <= share <= 1.0:
            raise InvalidInput(f"a share lies between 0 and 1, got {share!r}.")
        return float(np.quantile(self.found, share)) if self.found.size else math.nan

    @property
    def failed(self) -> float:
        """Share of the samples that have no answer."""
        return 1.0 - self.found.size / self.values.size

    @property
    def nonlinearity(self) -> float:
        """How far the linearised samples miss the true ones, root mean square over the linear sd."""
        if not self.found.size or not 0.0 < self.linear_sd < math.inf:
            return math.inf
        miss = (self.values - self.linear_values)[np.isfinite(self.values)]
        return float(np.sqrt(np.mean(miss**2)) / self.linear_sd)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader of the numbers must know."""
        words = []
        if self.failed:
            listed = ", ".join(self._left_out)
            words.append(
                f"{percent(self.failed)} of {self.values.size} samples have no answer ({listed});"
                " mean, sd and quantiles are those of the others, and there are no Sobol indices"
            )
        elif self.unmixed:
            words.append(f"no Sobol indices: {self.unmixed} of the samples mixed for them have no answer")
        if not math.isfinite(self.linear_sd):
            words.append("the nominal state lies at a fold: derivatives are infinite, trust the samples")
        elif self.error > LINEAR_ENOUGH * self.linear_sd:
            words.append(
                f"the samples have errors of up to {self.shown(self.error)} of their own, which is not small"
                " beside the sd; trust the linear estimate"
            )
        elif self.found.size and self.nonlinearity > LINEAR_ENOUGH:
            words.append(
                "linear and sampled disagree: at the samples the linearised number is off by"
                f" {percent(self.nonlinearity)} of its sd; trust the samples"
            )
        if self.indices is not None and self.indices.width > SHARP_ENOUGH:
            words.append(self.indices.statement)
        return tuple(words)

    @property
    def _left_out(self) -> list[str]:
        """How many samples have no answer, and what becomes of them."""
        known = [f"{count} {fate}: {FATES[fate]}" for fate, count in self.fates.items()]
        statuses = [f"{count} {status}" for status, count in self.reasons.items()]
        left = sum(self.reasons.values()) - sum(self.fates.values())
        if not known:
            return statuses
        return [*known, f"{left} others of {' and '.join(statuses)}"] if left else known

    def record(self) -> dict[str, Any]:
        """Return the results as plain data."""
        shares = {f"{share:g}": self.quantile(share) for share in (0.025, 0.16, 0.5, 0.84, 0.975)}
        record: dict[str, Any] = {
            "name": self.name,
            "unit": self.unit,
            "nominal": self.nominal,
            "linear": {"mean": self.linear_mean, "sd": self.linear_sd, "derivatives": self.derivatives},
            "sampled": {"mean": self.mean, "sd": self.sd, "quantiles": shares, "samples": self.values.size},
            "failed": dict(self.reasons),
            "fates": dict(self.fates),
            "nonlinearity": self.nonlinearity,
            "error": self.error,
            "warnings": list(self.warnings),
        }
        if self.indices is not None:
            record["sobol"] = {
                name: {
                    "first": float(self.indices.first[i]),
                    "first_interval": self.indices.first_interval[i].tolist(),
                    "total": float(self.indices.total[i]),
                    "total_interval": self.indices.total_interval[i].tolist(),
                }
                for i, name in enumerate(self.indices.inputs)
            }
        return record

    def shown(self, value: float) -> str:
        """Return a value with its unit."""
        return with_unit(value, self.unit)

    def __str__(self) -> str:
        between = f"{self.shown(self.quantile(0.025))} to {self.shown(self.quantile(0.975))}"
        lines = [
            f"{self.name}: {self.shown(self.nominal)} at the nominal inputs",
            f"  linear   {self.shown(self.linear_mean)} +- {self.shown(self.linear_sd)}",
            f"  sampled  {self.shown(self.mean)} +- {self.shown(self.sd)}, 95 % from {between}",
        ]
        if self.indices is not None:
            lines.append(f"  {self.indices.statement}")
            for i, name in enumerate(self.indices.inputs):
                low, high = self.indices.total_interval[i]
                lines.append(
                    f"    {name:<18} first {self.indices.first[i]:6.3f}  total {self.indices.total[i]:6.3f}"
                    f"  ({low:.3f} to {high:.3f})"
                )
        if self.correlated:
            lines.append("  no Sobol indices: the inputs are correlated")
        return "\n".join([*lines, *(f"  WARNING: {words}" for words in self.warnings)])


@dataclass(frozen=True, eq=False)
class Uncertainty(Pictured, Tabled):
    """Numbers of a rod whose inputs are uncertain.

    Parameters
    ----------
    inputs : dict of Spread
    quantities : dict of Propagated
    samples : dict of ndarray
        The sampled inputs [SI]; those that are certain are left out.
    missing : dict of str
        Why the nominal rod has no such number, for those that are given by default.
    correlations : ndarray, shape (inputs, inputs), or None
        Of the inputs; None where they are independent of each other.
    """

    inputs: dict[str, Spread]
    quantities: dict[str, Propagated]
    samples: dict[str, np.ndarray]
    missing: dict[str, str] = field(default_factory=dict)
    correlations: np.ndarray | None = None

    def __getitem__(self, name: str) -> Propagated:
        try:
            return self.quantities[name]
        except KeyError:
            reason = self.missing.get(name, f"only {', '.join(self.quantities)}.")
            raise InvalidInput(f"no {name!r} here: {reason}") from None

    def record(self) -> dict[str, Any]:
        """Return inputs and results as plain data."""
        inputs = {
            name: {
                "unit": s.unit,
                "nominal": s.nominal,
                "mean": s.mean,
                "sd": s.sd,
                "distribution": s.words,
            }
            for name, s in self.inputs.items()
        }
        results = [found.record() for found in self.quantities.values()]
        record = {"inputs": inputs, "results": results, "missing": self.missing}
        if self.correlations is not None:
            record["correlations"] = [{"inputs": [a, b], "value": rho} for a, b, rho in self._pairs]
        return record

    @property
    def _pairs(self) -> list[tuple[str, str, float]]:
        """The inputs that are correlated."""
        if self.correlations is None:
            return []
        names = list(self.inputs)
        pairs = zip(*np.nonzero(np.tril(self.correlations, -1)), strict=True)
        return [(names[j], names[i], float(self.correlations[i, j])) for i, j in pairs]

    def _table(self) -> Table:
        """One line a sample: the inputs and the numbers, in SI units or those of the rod."""
        columns = {name: Column(values, self.inputs[name].unit) for name, values in self.samples.items()}
        columns |= {found.name: Column(found.values, found.unit) for found in self.quantities.values()}
        return Table((), columns)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        of: str | None = None,
        legend: bool = True,
        title: str | None = None,
    ) -> Axes:
        """Draw the samples of one number, and the normal distribution of the linear estimate."""
        return draw(self[of or next(iter(self.quantities))], ax, legend=legend, title=title)

    def __repr__(self) -> str:
        lines = [
            f"{s.name}: {s.words}, mean {with_unit(s.mean, s.unit)}, sd {with_unit(s.sd, s.unit)}"
            f" ({percent(s.sd / abs(s.nominal))} of the nominal value)"
            for s in self.inputs.values()
        ]
        lines += (f"correlation of {a} and {b}: {rho:.4g}" for a, b, rho in self._pairs)
        lines += (str(found) for found in self.quantities.values())
        return "\n".join([*lines, *(f"{name}: none, {reason}" for name, reason in self.missing.items())])


def with_unit(value: float, unit: str) -> str:
    """Return a value with its unit, an SI unit with a prefix."""
    return display(value, unit, 5) if unit in ("Pa", "m", "N m") else f"{value:.5g} {unit}".strip()


def percent(share: float) -> str:
    """Return a share in per cent, two digits or all before the point."""
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.0f} %"
