"""`uncertainty`: from uncertain inputs to uncertain answers, linearised and sampled."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.sensitivities import sensitivities
from ...base.checks import finite, flag, positive
from ...base.errors import AtFold, InvalidInput, PeelOptError
from ...base.progress import Progress
from ...equilibria.ask import ask_about
from ...equilibria.methods import Method
from ...equilibria.question import ASKS
from ...model.bond import CohesiveLaw
from ...model.rod import MATERIAL, Rod, Units
from ...model.scene import Scene
from ...residual.discretisation import Transcription
from ..sweep.plan import Options, settled
from ..sweep.run import sweep
from .correlation import Scores, correlations_of
from .fates import Sampled, fates_of
from .flaws_of_many import SNAPS_AT, nominal_snap, snapping
from .inputs import InputUnit, Spread, spread_of
from .limits_of_many import CRITICAL_LENGTH, LIMITS, critical_lengths, limits_of
from .material import BOND, SHEET, Ingredients
from .result import Propagated, Uncertainty
from .sample import Sample


def uncertainty(
    rod: Rod | Scene,
    spread: Mapping[str, Any],
    *,
    pressure: float | None = None,
    length: float | None = None,
    flaw: float | None = None,
    of: str | Sequence[str] | None = None,
    correlations: Any = None,
    hold: str | None = None,
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
        By input: a standard deviation [SI], a pair (from, to), a text such as "10 %", "+- 2 uN m",
        "10 % lognormal", or a frozen distribution of ``scipy.stats``.  Inputs are ``bending_stiffness``, or
        of a rod from a sheet ``youngs_modulus``, ``thickness`` and ``poisson_ratio``; up to two of
        ``adhesion_strength``, ``adhesion_range`` and ``work_of_separation``; ``pressure``, ``length`` or
        ``flaw``; and any number of a scene by the name that `solve` frees it by.  Others are certain.
    pressure, length, flaw : float or str, optional
        What is given [Pa, m]: for the length, the pressure, or the pressure that is safe for an edge that
        was never glued.
    of : str or sequence of str, optional
        "pressure" or "length", whichever is not given; with a pressure "critical_flaw"; with a flaw
        "safe_pressure"; of the rod alone "readhesion_pressure", "maxwell_length" and "critical_length".
        By default the first, or without a given number those of the first two of the last that the rod has.
        Of a scene only the first is known.
    correlations : array_like or mapping, optional
        Pearson's, of the inputs: a matrix in the order in which ``spread`` names them, or a mapping such as
        ``{("youngs_modulus", "thickness"): 0.5}``.  By default the inputs are independent of each other.
    hold : str, optional
        One of the three numbers of the bond that stays as it is where another one is uncertain:
        "work_of_separation" holds G where the strength varies, so that the range follows.  By default the
        work follows; where it is uncertain itself, the range does.
    samples : int
        A power of 2.  The distributions are those of twice as many samples.
    seed : int
        Of the scrambled Sobol sequence.
    indices : bool
        Whether to compute Sobol indices, which takes ``samples`` more answers for each input;
        with a single input there are none, nor of correlated ones.
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
        If the inputs are not inputs, have no such spread or correlations, or say one thing twice.
    PeelOptError
        If the nominal question has no answer; of the default limits, if neither has one.

    Notes
    -----
    Every sampled pressure and length is an answer like any other, certified or counted as
    missing; ``fates`` says what becomes of those.  The limits depend on r = eta/y0 alone in units of T0
    and eta: they are interpolated in log r, at a degree at which two interpolants agree to ``tol``.  Critical
    flaws and safe pressures depend on r and what is given, and are interpolated in both, to a thousandth
    of their standard deviation.

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
    given = _given(own, pressure, length, flaw)
    wanted = _wanted(of, given, options, isinstance(subject, Rod))
    material, inputs, nominal = _uncertain(subject, own, given, spread, hold)
    for name in wanted:
        if name in (*LIMITS, CRITICAL_LENGTH) and not inputs.keys() & {*MATERIAL, *SHEET, *BOND}:
            raise InvalidInput(f"{name} depends on nothing that is uncertain.")
    matrix = correlations_of(correlations, list(spread), list(inputs))
    scores = None if matrix is None else Scores(list(inputs.values()), matrix)
    mixed = flag("indices", indices) and len(inputs) > 1 and matrix is None
    drawn = Sample.drawn(list(inputs.values()), samples, seed, mixed, scores)
    centres, missing = _centres(subject, given, wanted, options, by_default=of is None)
    running = {"journal": journal, "executor": executor, "workers": workers, "progress": progress}
    points = drawn.points(nominal)
    rods = material.numbers(points)
    quantities = {}
    for name, (value, slopes) in centres.items():
        if name == CRITICAL_LENGTH:
            answers = critical_lengths(rods)
        elif name in LIMITS:
            answers = Sampled(*limits_of(name, rods, tol))
        elif name in SNAPS_AT:
            answers = snapping(name, rods, points[SNAPS_AT[name]], progress)
        else:
            varied = {name: rods[name] for name in MATERIAL if name in material.moved_by(inputs)}
            varied |= {name: points[name] for name in inputs if name not in material.nominal}
            answers = _answers(subject, varied, given, points, options.keywords() | running)
        by_inputs = None if slopes is None else material.slopes(slopes)
        quantities[name] = _propagated(name, own, (value, by_inputs), inputs, matrix, drawn, answers)
    columns = {name: drawn.inputs[: drawn.main, i] for i, name in enumerate(inputs)}
    return Uncertainty(inputs, quantities, columns, missing, matrix)


def _uncertain(
    subject: Rod | Scene, rod: Rod, given: Mapping[str, float], spread: Mapping[str, Any], hold: str | None
) -> tuple[Ingredients, dict[str, Spread], dict[str, float]]:
    """Return what makes the rod, the uncertain inputs, and the nominal value of all.

    In the order of all inputs, whatever that of the mapping: the samples depend on it.
    """
    if not isinstance(spread, Mapping) or not spread:
        raise InvalidInput(
            "nothing is uncertain: give the spread of at least one input.",
            remedy=f"For instance {{'{MATERIAL[0]}': '10 %'}}.",
        )
    known = _known(subject, rod, given)
    if strange := [name for name in spread if name not in (*known, *SHEET)]:
        raise InvalidInput(
            f"{strange[0]!r} is no input of the question.", remedy=f"Inputs are {', '.join(known)}."
        )
    material = Ingredients.of(rod, spread.keys(), hold)
    nominal, measures = _inputs(subject, material, given)
    named = {name: value for name, value in nominal.items() if name in spread}
    inputs = {name: spread_of(name, spread[name], value, measures[name]) for name, value in named.items()}
    return material, inputs, nominal


def _centres(
    subject: Rod | Scene,
    given: Mapping[str, float],
    wanted: Sequence[str],
    options: Options,
    *,
    by_default: bool,
) -> tuple[dict[str, tuple[float, Mapping[str, float] | None]], dict[str, str]]:
    """Return the numbers at the nominal inputs, and why there are not the others, which nobody named."""
    centres: dict[str, tuple[float, Mapping[str, float] | None]] = {}
    missing: dict[str, PeelOptError] = {}
    for name in wanted:
        try:
            centres[name] = _nominal(subject, given, name, options)
        except PeelOptError as failure:
            if not by_default or name not in LIMITS:
                raise
            missing[name] = failure  # the other one stands alone
    if not centres:
        raise next(iter(missing.values()))
    return centres, {name: str(reason) for name, reason in missing.items()}


def _known(subject: Rod | Scene, rod: Rod, given: Mapping[str, float]) -> tuple[str, ...]:
    """Return the names of whatever may be uncertain."""
    sheet = SHEET if rod.sheet is not None else ()
    scene = tuple(subject.numbers) if isinstance(subject, Scene) else ()
    return (*MATERIAL, *sheet, *BOND[2:], *given, *scene)


def _inputs(
    subject: Rod | Scene, material: Ingredients, given: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, InputUnit]]:
    """Return the nominal value of whatever may be uncertain, and what each measures."""
    rod, nominal = material.rod, material.nominal | dict(given)
    measures = {name: InputUnit.of(name, Units.of(rod)) for name in nominal}
    if isinstance(subject, Scene):
        kinds = subject.dimensions
        nominal |= {name: size * kinds[name].size(rod) for name, size in subject.numbers.items()}
        measures |= {name: InputUnit.in_scene(kinds[name], rod) for name in subject.numbers}
    return nominal, measures


def _given(rod: Rod, pressure: Any, length: Any, flaw: Any) -> dict[str, float]:
    if flaw is not None:
        if pressure is not None or length is not None:
            raise InvalidInput("give one of pressure, length and flaw.")
        return {"flaw": positive("flaw", flaw, "" if rod.dimensionless else "m")}
    given = {
        name: finite(name, value, ASKS[name].given.unit_of(rod))
        for name, value in (("pressure", pressure), ("length", length))
        if value is not None
    }
    if len(given) > 1:
        raise InvalidInput("give either the pressure or the length, and not both.")
    return given


def _wanted(
    of: str | Sequence[str] | None, given: Mapping[str, float], options: Options, of_a_rod: bool
) -> tuple[str, ...]:
    """Return what is asked for: the number that is not given, or limits, which a rod alone has."""
    asked = tuple(ASKS[name].asked.name for name in given if name in ASKS)
    snaps = tuple(name for name, at in SNAPS_AT.items() if at in given) if of_a_rod else ()
    known = (*asked, *snaps, *((*LIMITS, CRITICAL_LENGTH) if of_a_rod else ()))
    if not known or not (of_a_rod or asked):
        raise InvalidInput("give a pressure or a length with a scene.")
    wanted: tuple[str, ...]
    if of is None:
        wanted = asked or snaps or LIMITS
    elif isinstance(of, str):
        wanted = (of,)
    else:
        wanted = tuple(dict.fromkeys(of)) if isinstance(of, Sequence) else (of,)
    for name in wanted:
        if of_a_rod and isinstance(name, str) and name in SNAPS_AT and name not in known:
            raise InvalidInput(f"{name} is that at a {SNAPS_AT[name]}: give it.")
        if name not in known:
            raise InvalidInput(f"there is no {name!r} here.", remedy=f"Choose from {', '.join(known)}.")
    if not wanted:
        raise InvalidInput("nothing is asked for.", remedy=f"Choose from {', '.join(known)}.")
    limits = [name for name in wanted if name not in asked]
    if limits and (options.law not in (None, "auto", "cohesive") or options.state not in (None, "unfolded")):
        raise InvalidInput(
            f"{limits[0]} is that of unfolded states under law (8).", remedy="Leave out law and state."
        )
    return wanted


def _nominal(
    subject: Rod | Scene, given: Mapping[str, float], name: str, options: Options
) -> tuple[float, Mapping[str, float] | None]:
    """Return a number at the nominal inputs, and its derivatives by k, T0, y0 and what is given.

    There are none where they are infinite.
    """
    if isinstance(subject, Rod) and name == CRITICAL_LENGTH:
        value, quarter = subject.critical_length, 0.25 * subject.critical_length
        powers = zip(MATERIAL, (1.0, -1.0, 1.0), strict=True)
        return value, {number: sign * quarter / getattr(subject, number) for number, sign in powers}
    if isinstance(subject, Rod) and name in SNAPS_AT:
        return nominal_snap(subject, name, given[SNAPS_AT[name]])
    if name in LIMITS:
        assert isinstance(subject, Rod)
        found = sensitivities(subject, name)
        return found.value, found.derivatives
    ((known, value),) = given.items()
    eq = ask_about(subject, known, value, **options.keywords())
    try:
        return getattr(eq, name), sensitivities(eq).derivatives
    except AtFold:
        return getattr(eq, name), None


def _answers(
    subject: Rod | Scene,
    varied: Mapping[str, np.ndarray],
    given: Mapping[str, float],
    points: Mapping[str, np.ndarray],
    options: Mapping[str, Any],
) -> Sampled:
    """Return the answers at the samples, in the rod's units."""
    axes: dict[str, Any] = {name: value for name, value in given.items() if name not in varied}
    table = sweep(dict(varied) | axes, rod=subject, zipped=True, **options)
    name = next(iter(given))
    asked = ASKS[name].asked
    values, ratios = table[asked.name], table[asked.attribute]
    error = np.nanmax(table["error"] * np.abs(values / ratios), initial=0.0)
    plain = options.get("law") in (None, "auto", "cohesive") and options.get("state") in (None, "unfolded")
    fates = fates_of(
        table["status"], points[name], table["nearest"], known=plain and isinstance(subject, Rod)
    )
    return Sampled(values, table["status"], float(error), fates)


def _propagated(
    name: str,
    rod: Rod,
    centre: tuple[float, Mapping[str, float] | None],
    inputs: Mapping[str, Spread],
    correlations: np.ndarray | None,
    drawn: Sample,
    answers: Sampled,
) -> Propagated:
    value, slopes = centre
    main, values = slice(0, drawn.main), answers.values
    derivatives = {} if slopes is None else {name: slopes.get(name, 0.0) for name in inputs}
    offsets = drawn.inputs[main] - np.array([s.nominal for s in inputs.values()])
    if slopes is None:
        linear_values, mean, sd = np.full(drawn.main, math.nan), math.nan, math.inf
    else:
        gradient = np.array(list(derivatives.values()))
        linear_values = value + offsets @ gradient
        mean = value + float(gradient @ [s.mean - s.nominal for s in inputs.values()])
        parts = gradient * [s.sd for s in inputs.values()]
        sd = math.hypot(*parts) if correlations is None else math.sqrt(max(parts @ correlations @ parts, 0.0))
    failed = ~np.isfinite(values[main])
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
        reasons=dict(sorted(Counter(answers.status[main][failed].tolist()).items())),
        error=answers.error,
        indices=drawn.indices(values),
        unmixed=int(np.isnan(values[drawn.main :]).sum()),
        fates=dict(Counter(fate for fate in answers.fates[main][failed].tolist() if fate)),
        correlated=correlations is not None,
    )
