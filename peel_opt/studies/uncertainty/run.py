"""`uncertainty`: from uncertain inputs to uncertain answers, linearised and sampled."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.derivatives import Sensitivities
from ...analysis.sensitivities import sensitivities
from ...base.checks import finite, flag
from ...base.errors import AtFold, InvalidInput, PeelOptError
from ...base.progress import Progress
from ...equilibria.ask import ask_rod, length_given_pressure, pressure_given_length
from ...equilibria.methods import Method
from ...equilibria.question import ASKS
from ...model.bond import CohesiveLaw
from ...model.rod import MATERIAL, Rod, Units
from ...model.scene import Scene
from ...residual.discretisation import Transcription
from ..sweep.plan import Options, settled
from ..sweep.run import sweep
from .inputs import InputUnit, Spread, spread_of
from .limits_of_many import LIMITS, limits_of
from .result import Propagated, Uncertainty
from .sample import Sample


def uncertainty(
    rod: Rod | Scene,
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
    progress: Progress = None,
) -> Uncertainty:
    """Carry the uncertainty of a rod and of what is given to what is asked.

    Parameters
    ----------
    rod : Rod or Scene
        The nominal rod, or what acts on it besides; the states of a scene are asked for at a pressure or a
        length.
    spread : mapping
        By input, ``bending_stiffness``, ``adhesion_strength``, ``adhesion_range``, ``pressure`` or
        ``length``, and any number of a scene by the name that `solve` frees it by: a standard
        deviation [SI], a pair (from, to), a text such as "10 %", "+- 2 uN m", "10 % lognormal",
        or a frozen distribution of ``scipy.stats``.
        Inputs are independent of each other; those not named are certain.
    pressure, length : float, optional
        What is given [Pa, m], for the other of the two.
    of : str or sequence of str, optional
        "pressure" or "length", whichever is not given; "readhesion_pressure"; "maxwell_length".
        By default the first, or without a given number those of the last two that the rod has.  They are
        numbers of the rod alone, and not known for a scene.
    samples : int
        A power of 2.  The distributions are those of twice as many samples.
    seed : int
        Of the scrambled Sobol sequence.
    indices : bool
        Whether to compute Sobol indices, which takes ``samples`` more answers for each input;
        with a single input there are none.
    law, state, method, tol
        As for `pressure_given_length`; the limits are those of law (8), and a scene has its own.
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
        If the nominal question has no answer; of the default limits, if neither has one.

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
    if not isinstance(rod, Rod | Scene):
        raise InvalidInput(f"rod must be a Rod or a Scene, got {rod!r:.60}.")
    subject, options = settled(rod, Options(law, state, tol, method))
    assert isinstance(subject, Rod | Scene)
    own = subject.rod if isinstance(subject, Scene) else subject
    given = _given(own, pressure, length)
    wanted = _wanted(of, given, options, () if isinstance(subject, Scene) else LIMITS)
    nominal, measures = _inputs(subject, own, given)
    if not isinstance(spread, Mapping) or not spread:
        raise InvalidInput(
            "nothing is uncertain: give the spread of at least one input.",
            remedy=f"For instance {{'{MATERIAL[0]}': '10 %'}}.",
        )
    if strange := [name for name in spread if name not in nominal]:
        raise InvalidInput(
            f"{strange[0]!r} is no input of the question.", remedy=f"Inputs are {', '.join(nominal)}."
        )
    # In the order of the inputs, whatever that of the mapping: the samples depend on it.
    inputs = {
        name: spread_of(name, spread[name], value, measures[name])
        for name, value in nominal.items()
        if name in spread
    }
    for name in wanted:
        if name in LIMITS and not inputs.keys() & set(MATERIAL):
            raise InvalidInput(f"{name} depends on nothing that is uncertain.")
    drawn = Sample.drawn(list(inputs.values()), samples, seed, flag("indices", indices) and len(inputs) > 1)
    centres: dict[str, tuple[float, Sensitivities | None]] = {}
    missing: dict[str, PeelOptError] = {}
    for name in wanted:
        try:
            centres[name] = _nominal(subject, given, name, options)
        except PeelOptError as failure:
            if of is not None or name not in LIMITS:
                raise
            missing[name] = failure  # not asked for by name: the other one stands alone
    if not centres:
        raise next(iter(missing.values()))
    running = {"journal": journal, "executor": executor, "workers": workers, "progress": progress}
    quantities = {}
    for name, centre in centres.items():
        if name in LIMITS:
            values, status, error = limits_of(name, drawn.points(nominal), tol)
        else:
            values, status, error = _answers(subject, drawn, given, options.keywords() | running)
        quantities[name] = _propagated(name, own, centre, inputs, drawn, values, status, error)
    columns = {name: drawn.inputs[: drawn.main, i] for i, name in enumerate(inputs)}
    return Uncertainty(inputs, quantities, columns, {name: str(reason) for name, reason in missing.items()})


def _inputs(
    subject: Rod | Scene, rod: Rod, given: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, InputUnit]]:
    """Return the nominal value of whatever may be uncertain, and what each measures."""
    nominal = {name: getattr(rod, name) for name in MATERIAL} | dict(given)
    measures = {name: InputUnit.of(name, Units.of(rod)) for name in nominal}
    if isinstance(subject, Scene):
        kinds = subject.dimensions
        nominal |= {name: size * kinds[name].size(rod) for name, size in subject.numbers.items()}
        measures |= {name: InputUnit.in_scene(kinds[name], rod) for name in subject.numbers}
    return nominal, measures


def _given(rod: Rod, pressure: float | None, length: float | None) -> dict[str, float]:
    given = {
        name: finite(name, value, ASKS[name].given.unit_of(rod))
        for name, value in (("pressure", pressure), ("length", length))
        if value is not None
    }
    if len(given) > 1:
        raise InvalidInput("give either the pressure or the length, and not both.")
    return given


def _wanted(
    of: str | Sequence[str] | None,
    given: Mapping[str, float],
    options: Options,
    limits_known: tuple[str, ...],
) -> tuple[str, ...]:
    """Return what is asked for: the number that is not given, or limits, which a rod alone has."""
    asked = next((ASKS[name].asked.name for name in given), None)
    known = (*((asked,) if asked else ()), *limits_known)
    if not known:
        raise InvalidInput("give a pressure or a length with a scene.")
    wanted: tuple[str, ...]
    if of is None:
        wanted = (asked,) if asked else limits_known
    elif isinstance(of, str):
        wanted = (of,)
    else:
        wanted = tuple(dict.fromkeys(of)) if isinstance(of, Sequence) else (of,)
    for name in wanted:
        if name not in known:
            raise InvalidInput(f"there is no {name!r} here.", remedy=f"Choose from {', '.join(known)}.")
    if not wanted:
        raise InvalidInput("nothing is asked for.", remedy=f"Choose from {', '.join(known)}.")
    limits = [name for name in wanted if name in LIMITS]
    if limits and (options.law not in (None, "auto", "cohesive") or options.state not in (None, "unfolded")):
        raise InvalidInput(
            f"{limits[0]} is that of unfolded states under law (8).", remedy="Leave out law and state."
        )
    return wanted


def _nominal(
    subject: Rod | Scene, given: Mapping[str, float], name: str, options: Options
) -> tuple[float, Sensitivities | None]:
    """Return a number at the nominal inputs with its derivatives, None where they are infinite."""
    if name in LIMITS:
        assert isinstance(subject, Rod)
        found = sensitivities(subject, name)
        return found.value, found
    ((known, value),) = given.items()
    if isinstance(subject, Scene):
        call = length_given_pressure if known == "pressure" else pressure_given_length
        eq = call(subject, value, **options.keywords())
    else:
        eq = ask_rod(subject, known, value, **options.keywords())
    try:
        return getattr(eq, name), sensitivities(eq)
    except AtFold:
        return getattr(eq, name), None


def _answers(
    subject: Rod | Scene, drawn: Sample, given: Mapping[str, float], options: Mapping[str, Any]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the answer, its status and the largest error over the samples, in the rod's units."""
    axes: dict[str, Any] = {name: drawn.inputs[:, i] for i, name in enumerate(drawn.names)}
    axes |= {name: value for name, value in given.items() if name not in axes}
    table = sweep(axes, rod=subject, zipped=True, **options)
    asked = ASKS[next(iter(given))].asked
    values, ratios = table[asked.name], table[asked.attribute]
    error = np.nanmax(table["error"] * np.abs(values / ratios), initial=0.0)
    return values, table["status"], float(error)


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
        sd = math.hypot(*(g * s.sd for g, s in zip(gradient, inputs.values(), strict=True)))
    failed = Counter(status[main][~np.isfinite(values[main])].tolist())
    units = Units.of(rod)
    return Propagated(
        name=name,
        unit=units.of_number("pressure" if name.endswith("pressure") else "length"),
        nominal=value,
        derivatives=derivatives,
        linear_mean=mean,
        linear_sd=sd,
        values=values[main].copy(),
        linear_values=linear_values,
        reasons=dict(sorted(failed.items())),
        error=error,
        indices=drawn.indices(values),
        unmixed=int(np.isnan(values[drawn.main :]).sum()),
    )
