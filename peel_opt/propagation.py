"""`uncertainty`: from uncertain inputs to uncertain answers, linearised and sampled."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from .answer import Method
from .cohesion import CohesiveLaw
from .design_relations import maxwell_length
from .detachment import length_given_pressure, pressure_given_length
from .errors import AtFold, InvalidInput, NoEquilibrium, PeelOptError
from .flaws import PressureLimit, readhesion_pressure
from .implicit_derivatives import Sensitivities, sensitivities
from .propagation_inputs import Spread, spread_of
from .propagation_result import Propagated, SobolIndices, Uncertainty
from .result import Equilibrium
from .rod import Rod
from .storage import Units
from .sweep_plan import MATERIAL
from .sweeping import sweep
from .transcription.base import Transcription

#: Numbers of the rod alone.
LIMITS = ("readhesion_pressure", "maxwell_length")

#: Degrees at which a number of r alone is interpolated over the sampled range.
DEGREES = (8, 16, 32)

#: Resamples behind an interval of a Sobol index.
RESAMPLES = 400

#: Error of sbar_M/eta, relative: that of the splines through the Maxwell points.
MAXWELL_ERROR = 1e-9


def uncertainty(
    rod: Rod,
    spread: Mapping[str, Any],
    *,
    pressure: float | None = None,
    length: float | None = None,
    of: str | Sequence[str] | None = None,
    samples: int = 256,
    seed: int = 0,
    indices: bool = True,
    law: str | CohesiveLaw | None = None,
    state: str | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    journal: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: bool = True,
) -> Uncertainty:
    """Carry the uncertainty of a rod and of what is given to what is asked.

    Parameters
    ----------
    rod : Rod
        The nominal rod.
    spread : mapping
        By input, ``bending_stiffness``, ``adhesion_strength``, ``adhesion_range`` and
        ``pressure`` or ``length``: a standard deviation [SI], a pair (from, to), a text such as
        "10 %", "2 uN m", "10 % lognormal", or a frozen distribution of ``scipy.stats``.  Inputs
        are independent of each other; those not named are certain.
    pressure, length : float, optional
        What is given [Pa, m], for the other of the two.
    of : str or sequence of str, optional
        "pressure" or "length", whichever is not given; "readhesion_pressure"; "maxwell_length".
        By default the first, or without a given number the last two.
    samples : int
        A power of 2.  The distributions are those of twice as many samples.
    seed : int
        Of the scrambled Sobol sequence.
    indices : bool
        Whether to compute Sobol indices, which takes ``samples`` more answers for each input;
        with a single input there are none.
    law, state, method, tol
        As for `pressure_given_length`; the limits are those of law (8).
    journal, executor, workers, progress
        As for `sweep`, which answers the samples.

    Returns
    -------
    Uncertainty

    Raises
    ------
    InvalidInput
        If the inputs are not inputs, or have no such spread.
    PeelOptError
        If the nominal question has no answer.

    Notes
    -----
    Every sampled pressure and length is an answer like any other, certified or counted as
    missing.  The limits depend on r = eta/y0 alone in units of T0 and eta: they are
    interpolated in log r, at a degree at which two interpolants agree to ``tol``.

    Examples
    --------
    >>> rod = Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
    >>> found = uncertainty(rod, {"adhesion_strength": "5 %"}, pressure=100e3, samples=32)["length"]
    >>> round(1e6 * found.linear_sd, 1), found.failed  # in um
    (28.6, 0.0)
    """
    if isinstance(samples, bool) or not isinstance(samples, int) or samples < 2 or samples & (samples - 1):
        raise InvalidInput(f"samples must be a power of 2, got {samples!r}.")
    given = _given(pressure, length)
    nominal = {name: getattr(rod, name) for name in MATERIAL} | given
    if strange := [name for name in spread if name not in nominal]:
        raise InvalidInput(
            f"{strange[0]!r} is no input of the question.", remedy=f"Inputs are {', '.join(nominal)}."
        )
    inputs = {
        name: spread_of(name, value, nominal[name], plain=rod.dimensionless) for name, value in spread.items()
    }
    if not inputs:
        raise InvalidInput("nothing is uncertain: give the spread of at least one input.")
    wanted = _wanted(of, given)
    options = {"law": law, "state": state, "method": method, "tol": tol}
    keywords = {name: value for name, value in options.items() if value is not None}
    centres = {name: _nominal(rod, given, name, keywords) for name in wanted}
    drawn = Sample.drawn(list(inputs.values()), samples, seed, indices and len(inputs) > 1)
    running = {"journal": journal, "executor": executor, "workers": workers, "progress": progress}
    quantities = {}
    for name in wanted:
        if name in LIMITS:
            values, status, error = _limits(rod, name, drawn.points(nominal), tol)
        else:
            values, status, error = _answers(rod, drawn, given, options | running)
        quantities[name] = _propagated(name, rod, centres[name], inputs, drawn, values, status, error)
    columns = {name: drawn.inputs[: drawn.main, i] for i, name in enumerate(inputs)}
    return Uncertainty(inputs, quantities, columns)


@dataclass(frozen=True, eq=False)
class Sample:
    """Sampled inputs: two independent sets A and B, and for each input A with that column of B.

    Parameters
    ----------
    names : tuple of str
    inputs : ndarray, shape (points, names)
        A, B, then the mixed sets if there are indices.
    size : int
        Points of A.
    """

    names: tuple[str, ...]
    inputs: np.ndarray
    size: int

    @classmethod
    def drawn(cls, spreads: list[Spread], size: int, seed: int, mixed: bool) -> Sample:
        """Draw from a scrambled Sobol sequence of twice the dimension, as Saltelli does."""
        from scipy.stats import qmc

        count = len(spreads)
        shares = qmc.Sobol(d=2 * count, scramble=True, seed=np.random.default_rng(seed), bits=32).random(size)
        # The sequence may hit 0, where a normal distribution has no quantile.
        shares = np.clip(shares, 2.0**-33, 1.0 - 2.0**-33)
        columns = [spreads[i % count].quantiles(shares[:, i]) for i in range(2 * count)]
        first, second = np.stack(columns[:count], axis=1), np.stack(columns[count:], axis=1)
        sets = [first, second]
        for i in range(count if mixed else 0):
            both = first.copy()
            both[:, i] = second[:, i]
            sets.append(both)
        return cls(tuple(s.name for s in spreads), np.concatenate(sets), size)

    @property
    def main(self) -> int:
        """Points of A and B together, the ones whose distribution is reported."""
        return 2 * self.size

    def points(self, nominal: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Return every number at every point."""
        columns = {name: np.full(len(self.inputs), value) for name, value in nominal.items()}
        return columns | {name: self.inputs[:, i] for i, name in enumerate(self.names)}


def _given(pressure: float | None, length: float | None) -> dict[str, float]:
    given = {name: value for name, value in (("pressure", pressure), ("length", length)) if value is not None}
    if len(given) > 1:
        raise InvalidInput("give either the pressure or the length, and not both.")
    return given


def _wanted(of: str | Sequence[str] | None, given: Mapping[str, float]) -> tuple[str, ...]:
    asked = {"pressure": "length", "length": "pressure"}.get(next(iter(given), ""))
    known = (*((asked,) if asked else ()), *LIMITS)
    wanted = ((asked,) if asked else LIMITS) if of is None else (of,) if isinstance(of, str) else tuple(of)
    for name in wanted:
        if name not in known:
            raise InvalidInput(f"there is no {name!r} here.", remedy=f"Choose from {', '.join(known)}.")
    if not wanted:
        raise InvalidInput("nothing is asked for.", remedy=f"Choose from {', '.join(known)}.")
    return wanted


def _nominal(
    rod: Rod, given: Mapping[str, float], name: str, options: Mapping[str, Any]
) -> tuple[float, Sensitivities | None]:
    """Return a number at the nominal inputs with its derivatives, None where they are infinite."""
    if name in LIMITS:
        found = sensitivities(rod, name)
        return found.value, found
    ask: Callable[..., Equilibrium] = pressure_given_length if name == "pressure" else length_given_pressure
    eq = ask(rod, *given.values(), **options)
    try:
        return getattr(eq, name), sensitivities(eq)
    except AtFold:
        return getattr(eq, name), None


def _answers(
    rod: Rod, drawn: Sample, given: Mapping[str, float], options: Mapping[str, Any]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the answer, its status and the largest error over the samples, in the rod's units."""
    axes: dict[str, Any] = {name: drawn.inputs[:, i] for i, name in enumerate(drawn.names)}
    axes |= {name: value for name, value in given.items() if name not in axes}
    table = sweep(axes, rod=rod, zipped=True, **options)
    name = "pressure" if "length" in given else "length"
    values, ratios = table[name], table[f"{name}_ratio"]
    error = np.nanmax(table["error"] * np.abs(values / ratios), initial=0.0)
    return values, table["status"], float(error)


def _limits(
    rod: Rod, name: str, points: Mapping[str, np.ndarray], tol: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return a number of the rod alone over the samples, with its status and largest error."""
    k, T0, y0 = (points[material] for material in MATERIAL)
    status = np.full(k.shape, "certified", dtype="<U24")
    status[(k <= 0.0) | (T0 <= 0.0) | (y0 <= 0.0)] = InvalidInput.status
    sound = status == "certified"
    values = np.full(k.shape, math.nan)
    eta = np.cbrt(k[sound] / T0[sound])
    if name == "maxwell_length":
        values[sound] = y0[sound] * maxwell_length(eta / y0[sound], "branch")
        status[sound & ~np.isfinite(values)] = NoEquilibrium.status
        return values, status, MAXWELL_ERROR * float(np.nanmax(values, initial=0.0))
    ratios = eta / y0[sound]
    found, status[sound], error = interpolated(_least_pressure, ratios, tol)
    values[sound] = T0[sound] * found
    return values, status, error * float(np.max(T0[sound], initial=0.0))


def interpolated(
    limit: Callable[[float], PressureLimit], ratios: np.ndarray, tol: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return a p/T0 that depends on r = eta/y0 alone at many ratios, its status and largest error.

    Chebyshev interpolants in log r of growing degree, until the last two agree to ``tol`` at
    every ratio; where none does, each ratio is computed by itself and NaN marks what fails.
    """
    x = np.log(ratios)
    status = np.full(ratios.shape, "certified", dtype="<U24")
    before, error = None, 0.0

    def at(place: float) -> float:
        nonlocal error
        found = limit(math.exp(place))
        error = max(error, found.error)
        return found.pressure_ratio

    try:
        for degree in DEGREES:
            if degree >= ratios.size or np.ptp(x) == 0.0:
                break
            nodes = np.vectorize(at, otypes=[float])
            values = np.polynomial.Chebyshev.interpolate(nodes, degree, [x.min(), x.max()])(x)
            if before is not None and (gap := float(np.max(np.abs(values - before)))) <= tol:
                return values, status, gap + error
            before = values
    except PeelOptError:
        pass  # some ratio of the range has no such number
    values = np.full(ratios.shape, math.nan)
    for i, place in enumerate(x.tolist()):
        try:
            values[i] = at(place)
        except PeelOptError as failure:
            status[i] = failure.status
    return values, status, error


@lru_cache(maxsize=4096)
def _least_pressure(ratio: float) -> PressureLimit:
    return readhesion_pressure(Rod.from_ratio(ratio))


def _propagated(
    name: str,
    rod: Rod,
    centre: tuple[float, Sensitivities | None],
    inputs: Mapping[str, Spread],
    drawn: Sample,
    values: np.ndarray,
    status: np.ndarray,
    error: float,
) -> Propagated:
    value, slopes = centre
    main = slice(0, drawn.main)
    derivatives = {} if slopes is None else {name: slopes.derivatives.get(name, 0.0) for name in inputs}
    offsets = drawn.inputs[main] - np.array([s.nominal for s in inputs.values()])
    if slopes is None:
        linear_values, mean, sd = np.full(drawn.main, math.nan), math.nan, math.inf
    else:
        gradient = np.array(list(derivatives.values()))
        linear_values = value + offsets @ gradient
        mean = value + float(gradient @ [s.mean - s.nominal for s in inputs.values()])
        sd = math.sqrt(sum((g * s.sd) ** 2 for g, s in zip(gradient, inputs.values(), strict=True)))
    failed = Counter(status[main][~np.isfinite(values[main])].tolist())
    units = Units.of(rod)
    return Propagated(
        name=name,
        unit=units.pressure if name.endswith("pressure") else units.length,
        nominal=value,
        derivatives=derivatives,
        linear_mean=mean,
        linear_sd=sd,
        values=values[main].copy(),
        linear_values=linear_values,
        reasons=dict(sorted(failed.items())),
        error=error,
        indices=_sobol(drawn, values) if len(values) > drawn.main and np.isfinite(values).all() else None,
    )


def _sobol(drawn: Sample, values: np.ndarray) -> SobolIndices:
    """Return Sobol indices by `scipy.stats.sobol_indices`, with intervals by resampling."""
    n, count = drawn.size, len(drawn.names)
    sets = values.reshape(count + 2, n)

    def indices_of(chosen: np.ndarray) -> np.ndarray:
        from scipy.stats import sobol_indices

        functions = {"f_A": sets[:1, chosen], "f_B": sets[1:2, chosen], "f_AB": sets[2:, None, chosen]}
        found = sobol_indices(func=functions, n=n)
        return np.array([np.reshape(found.first_order, count), np.reshape(found.total_order, count)])

    rng = np.random.default_rng(n)
    resampled = np.array([indices_of(rng.integers(0, n, n)) for _ in range(RESAMPLES)])
    first, total = indices_of(np.arange(n))
    low, high = np.quantile(resampled, (0.025, 0.975), axis=0)
    intervals = np.stack([low, high], axis=-1)
    return SobolIndices(drawn.names, first, total, intervals[0], intervals[1], n)
