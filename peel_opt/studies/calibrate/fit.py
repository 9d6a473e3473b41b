"""`calibrate`: material numbers from measured pressures, lengths and shapes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import overload

import numpy as np

from ...base.checks import flag, positive
from ...base.errors import InvalidInput, PeelOptError
from ...equilibria.question import known_law
from ...equilibria.scenes import plain_law, refuse_options
from ...model.bond import COHESIVE, CohesiveLaw
from ...model.labels import OBSERVABLE, known_state
from ...model.rod import MATERIAL, UNITS, Rod
from ...model.scene import Scene
from ...residual.meshes import FITTED
from .chart import Chart
from .covariance import singular
from .data import Data, Observation, observations, says_sd
from .problem import Problem, watched
from .result import Calibration, Fit
from .scene_fit import SceneCalibration, fit_scene
from .search import best
from .start import coarse_rods
from .words import RARE, combinations, far_points, warnings_of

#: Losses by name.
LOSSES = ("least-squares", "pseudo-huber")

#: Scale of the pseudo-Huber loss that tells outliers from the rest, in standard deviations.
ROBUST = 1.5

#: Standard deviations above a known T0 from which a measured pressure is none of a rod that has it.
ABOVE = 10.0

#: Least scale of standard deviations of a share: what is fitted closer is fitted to rounding.
LEAST_SCATTER = 1e-6

#: Share to which chi-square must fall for other states to be the better reading of the data.
MUCH_LESS = 0.2


@overload
def calibrate(
    data: Data,
    *,
    free: Sequence[str] = ...,
    rod: Scene,
    state: str | None = ...,
    loss: str = ...,
    loss_scale: float = ...,
    law: str | CohesiveLaw = ...,
    absolute_sd: bool | None = ...,
) -> Calibration | SceneCalibration: ...
@overload
def calibrate(
    data: Data,
    *,
    free: Sequence[str] = ...,
    rod: Rod | Mapping[str, float] | None = ...,
    state: str | None = ...,
    loss: str = ...,
    loss_scale: float = ...,
    law: str | CohesiveLaw = ...,
    absolute_sd: bool | None = ...,
) -> Calibration: ...
def calibrate(
    data: Data,
    *,
    free: Sequence[str] = MATERIAL,
    rod: Rod | Scene | Mapping[str, float] | None = None,
    state: str | None = None,
    loss: str = "least-squares",
    loss_scale: float = 1.5,
    law: str | CohesiveLaw = "auto",
    absolute_sd: bool | None = None,
) -> Calibration | SceneCalibration:
    """Fit material numbers, or those of a scene, to measurements, every observation with a state of its own.

    Parameters
    ----------
    data : Measurements, MeasuredShape, or a list of them
    free : sequence of str
        Which of "bending_stiffness", "adhesion_strength" and "adhesion_range" to fit; of a scene also
        any of its numbers, by the names that `solve` frees them by.
    rod : Rod, Scene or mapping of str to float, optional
        The numbers that are known, in SI units, and of a `Rod` or a `Scene` also where to start.  Needed
        unless all three are free.  A scene is fitted to pairs of length and pressure.
    state : {"unfolded", "middle", "lower", "folded"}, optional
        Of all measurements that do not say.  Those of a scene are lifted or unfolded by default.
    loss : {"least-squares", "pseudo-huber"}
        How much a residual costs: half its square, or ``loss_scale**2 (sqrt(1 + (r/loss_scale)^2) - 1)``,
        which lets outliers pull with a bounded force.
    loss_scale : float
        In standard deviations.
    law : {"auto", "cohesive", "linear"} or CohesiveLaw
        Of the bond, with a traction that falls from u = 0 on; "auto" is law (8).  A scene has its own.
    absolute_sd : bool, optional
        Whether the standard deviations of the data are meant as they are.  If False they only weigh, and
        are scaled such that chi-square is the number of degrees of freedom, as in
        `scipy.optimize.curve_fit` with ``absolute_sigma=False``.  Default: True if the data have them.

    Returns
    -------
    Calibration or SceneCalibration
        Estimates, covariance, residuals, warnings; ``warnings`` says what the data cannot tell.

    Raises
    ------
    InvalidInput
        If there are fewer data than free numbers, a known number is missing, or an option or a
        value cannot be meant.
    NotConverged
        If no start leads to a fit.
    OutOfRange
        If the fitted rod has an eta/y0 this version is not tested for.
    NotCertified
        If the fitted states are not those that the public functions find for the fitted rod.

    Examples
    --------
    >>> import peel_opt as po
    >>> rod = po.Rod(2.3e-5, 140e3, 0.73e-3)
    >>> lengths = [1.8e-3, 2.0e-3, 2.3e-3]
    >>> pressures = [po.pressure_given_length(rod, length).pressure for length in lengths]
    >>> data = po.Measurements(lengths, pressures, pressure_sd=500.0)
    >>> fit = po.calibrate(data, free=["adhesion_strength", "adhesion_range"], rod=rod)
    >>> round(fit.rod.adhesion_strength)
    140000
    """
    scene = rod if isinstance(rod, Scene) else None
    if scene is not None:
        refuse_options(law=law)
        if scene.is_plain:
            rod, law, scene = scene.rod, plain_law(scene), None
    known_state(state, among=OBSERVABLE if scene is None else ("lifted", *OBSERVABLE))
    if loss not in LOSSES:
        raise InvalidInput(f"unknown loss {loss!r}.", remedy=f"Choose one of {', '.join(LOSSES)}.")
    scale = positive("loss_scale", loss_scale)
    delta = scale if loss == "pseudo-huber" else None
    absolute = _absolute(data, absolute_sd, delta)
    if scene is not None:
        several = _names(free)
        seen = [replace(o, state=o.state or state) for o in observations(data)]
        _require_enough(seen, len(several), absolute=absolute)
        of_scene = fit_scene(scene, seen, several, delta)
        if absolute:
            return of_scene
        scale = _scatter(of_scene)
        again = fit_scene(of_scene.scene, [o.scaled(scale) for o in seen], several, delta)
        return replace(again, scaled=scale)
    assert not isinstance(rod, Scene)
    seen = [replace(o, state=o.state or state or "unfolded") for o in observations(data)]
    mask = _mask(free)
    known = _known(rod, mask)
    chart = Chart(known_law(law) or COHESIVE, FITTED[0].nodes)
    _require_enough(seen, int(mask.sum()), absolute=absolute)
    _require_reach(seen, known)
    empty = Problem(seen, mask, delta, chart)
    with watched(empty) as problem:
        result = _fit(seen, known, rod, problem)
        elsewhere: tuple[str, ...] = ()
        if not absolute:
            elsewhere = _contradictions(result, known)
            scale = _scatter(result)
            seen = [o.scaled(scale) for o in seen]
            result = replace(_fit(seen, known, result.rod, problem), scaled=scale)
        found = warnings_of(result) + elsewhere
        if loss == "least-squares" and result.degrees > 0 and result.p_value < RARE:
            found += _contradictions(result, known)
    return replace(result, problem=replace(result.problem, watch=empty.watch), warnings=found)


def _absolute(data: Data, wanted: bool | None, delta: float | None) -> bool:
    """Return whether the standard deviations of the data are meant as they are."""
    said = says_sd(data)
    absolute = said if wanted is None else flag("absolute_sd", wanted)
    if absolute and not said:
        raise InvalidInput(
            "the data have no standard deviations that could be meant as they are.",
            remedy="Give pressure_sd=, length_sd= or both, or leave out absolute_sd.",
        )
    if not absolute and delta is not None:
        raise InvalidInput(
            "a robust loss has its scale in standard deviations, which the data do not say.",
            remedy="Give pressure_sd=, length_sd= or both, and not absolute_sd=False.",
        )
    return absolute


def _scatter(fit: Fit) -> float:
    """Return by how much residuals exceed the standard deviations, root mean square a degree of freedom."""
    return max(math.sqrt(fit.chi2 / fit.degrees), LEAST_SCATTER)


def _fit(
    seen: Sequence[Observation], known: Mapping[str, float], rod: object, problem: Problem
) -> Calibration:
    """Fit and describe, without warnings."""
    mask, delta = problem.free, problem.delta
    chosen = best(seen, known, rod, replace(problem, observations=seen))
    problem, fitted = chosen.problem, chosen.fitted
    model = problem.linear_model(fitted)
    return Calibration(
        rod=fitted.rod,
        free=tuple(name for name, yes in zip(MATERIAL, mask, strict=True) if yes),
        log_covariance=model.covariance(sandwich=delta is not None),
        deviance=fitted.deviance,
        degrees=sum(o.degrees for o in seen) - int(mask.sum()),
        combinations=combinations(model.jacobian, mask),
        singular_values=singular(model.jacobian)[0],
        observations=tuple(seen),
        residuals=tuple(model.residuals),
        weights=tuple(model.weights),
        equilibria=tuple(chosen.equilibria),
        consistency=chosen.consistency,
        loss=LOSSES[delta is not None],
        loss_scale=delta,
        iterations=fitted.iterations,
        problem=problem,
        fitted=fitted,
    )


def _contradictions(fit: Calibration, known: Mapping[str, float]) -> tuple[str, ...]:
    """Say whether a bad fit is one of states on another part of the branch than was said.

    All of them folded is one thing to try; a robust fit shows the few that are not like the rest.
    """
    seen = fit.observations
    if not any(o.state == "unfolded" for o in seen):
        return ()
    law = fit.problem.chart.law
    problem = replace(fit.problem, chart=Chart(law, FITTED[0].nodes))
    turned = [replace(o, state="folded") if o.state == "unfolded" else o for o in seen]
    (as_seen, *_), as_turned = (coarse_rods(part, known, law, 1) for part in (seen, turned))
    for misfit, start in as_turned:  # none where no rod has folded states under this law
        try:
            folded = _fit(turned, known, start, problem) if misfit < 0.5 * as_seen[0] else None
        except PeelOptError:
            break  # then they are not folded
        if folded is not None and folded.chi2 < MUCH_LESS * fit.chi2:
            return (
                "the data contradict the unfolded branch: with all of them on the folded one chi-square"
                f" falls from {fit.chi2:.4g} to {folded.chi2:.4g}. If the rod was folded back over itself,"
                " say state='folded'.",
            )
    try:
        robust = _fit(seen, known, fit.rod, replace(problem, delta=ROBUST))
    except PeelOptError:
        return ()
    said = far_points(fit)
    return tuple(words for i, words in far_points(robust).items() if i not in said)


def _names(free: Sequence[str]) -> list[str]:
    """Return the names of the free numbers, each once."""
    if not isinstance(free, Iterable):
        raise InvalidInput(f"free must be a list of names, got {free!r}.")
    names = [free] if isinstance(free, str) else list(dict.fromkeys(free))
    if not names:
        raise InvalidInput("nothing is free.", remedy=f"Name some of {', '.join(MATERIAL)} in free=.")
    return names


def _mask(free: Sequence[str]) -> np.ndarray:
    names = _names(free)
    if unknown := [name for name in names if name not in MATERIAL]:
        raise InvalidInput(
            f"unknown free number {unknown[0]!r}.", remedy=f"Choose among {', '.join(MATERIAL)}."
        )
    return np.array([name in names for name in MATERIAL])


def _known(rod: Rod | Mapping[str, float] | None, mask: np.ndarray) -> dict[str, float]:
    """Return the numbers that are not free."""
    if rod is not None and not isinstance(rod, (Rod, Mapping)):
        raise InvalidInput(f"rod must be a Rod or a mapping of known numbers, got {rod!r}.")
    if isinstance(rod, Rod):
        numbers = {name: getattr(rod, name) for name in MATERIAL}
    else:
        numbers = {name: positive(name, value, UNITS.get(name, "")) for name, value in (rod or {}).items()}
    if unknown := sorted(set(numbers) - set(MATERIAL)):
        raise InvalidInput(
            f"unknown material number {unknown[0]!r}.", remedy=f"Choose among {', '.join(MATERIAL)}."
        )
    known = {
        name: numbers[name] for name, yes in zip(MATERIAL, mask, strict=True) if not yes and name in numbers
    }
    if missing := [n for n, yes in zip(MATERIAL, mask, strict=True) if not yes and n not in known]:
        raise InvalidInput(
            f"{missing[0]} is neither free nor known.", remedy="Name it in free=, or give it in rod=."
        )
    return known


def _require_enough(seen: Sequence[Observation], need: int, *, absolute: bool) -> None:
    have = sum(o.degrees for o in seen)
    if have == need and not absolute:
        raise InvalidInput(
            f"{have} independent data for {need} free numbers leave no residuals, which alone could say how"
            " much data without standard deviations scatter.",
            remedy="Give pressure_sd=, length_sd= or both, or measure more.",
        )
    if have < need:
        raise InvalidInput(
            f"{have} independent data cannot determine {need} free numbers.",
            remedy="Measure more points, or fix numbers that are known: a pair counts once, a shape as"
            " many times as it has points.",
        )


def _require_reach(seen: Sequence[Observation], known: Mapping[str, float]) -> None:
    """No detached state has a pressure above T0: an exact one is refused, measured ones if none is below."""
    T0 = known.get("adhesion_strength", math.inf)
    for o in seen:
        if o.role("pressure") == "exact" and o.pressure is not None and o.pressure >= T0:
            raise InvalidInput(
                f"{o.name}: the pressure, {o.pressure:g} Pa, is not below the known adhesion_strength,"
                f" {T0:g} Pa: no detached state has it.",
                remedy="Check units, free adhesion_strength, or give the pressure a standard deviation.",
            )
    least = min((o.pressure or 0.0) - ABOVE * (o.pressure_sd or 0.0) for o in seen)
    if least > T0:
        raise InvalidInput(
            f"all pressures are more than {ABOVE:g} standard deviations above the known adhesion_strength,"
            f" {T0:g} Pa: no detached state has any of them.",
            remedy="Check units, or free adhesion_strength.",
        )
