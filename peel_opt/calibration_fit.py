"""`calibrate`: material numbers from measured pressures, lengths and shapes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .calibration_blocks import MATERIAL
from .calibration_checks import RARE, far_points, resolved, warnings_of
from .calibration_data import STATES, Data, Observation, observations
from .calibration_identifiability import combinations
from .calibration_problem import NODES, Fitted, Placed, Posed, Problem
from .calibration_programme import FURTHEST, Solver
from .calibration_result import Calibration, chance
from .calibration_sensitivity import linear_model
from .calibration_start import coarse_rods, fits, projected
from .checks import positive
from .errors import InvalidInput, NotConverged, OutOfRange, PeelOptError
from .question import RATIOS
from .result import Equilibrium
from .rod import Rod

#: Losses by name.
LOSSES = ("least-squares", "pseudo-huber")

#: Scale of the pseudo-Huber loss that tells outliers from the rest, in standard deviations.
ROBUST = 1.5

#: Difference of chi-square, by degree of freedom, of two fits that are one.
SAME = 1e-4

#: Share to which chi-square must fall for other states to be the better reading of the data.
MUCH_LESS = 0.2

#: Chance of a larger chi-square below which other starts are tried: the fit may be another minimum.
SUSPICIOUS = 0.01

#: Largest difference of a fitted and a public answer (p/T0 or sbar/eta) that needs no finer mesh.
AGREED = 1e-8

#: Weight that holds numbers near their start where the data leave them open: one standard
#: deviation is a factor e.
RIDGE = 1.0

#: What is left to step, in standard deviations, from which a fit does not count as converged.
LEFT = 1e-3

#: The same for a fit that leaves a combination open, where less can be asked.
LEFT_HELD = 0.1


def calibrate(
    data: Data,
    *,
    free: Sequence[str] = MATERIAL,
    rod: Rod | Mapping[str, float] | None = None,
    state: str | None = None,
    loss: str = "least-squares",
    loss_scale: float = 1.5,
    solver: Solver | None = None,
) -> Calibration:
    """Fit material numbers to measurements, all equilibria and numbers in one programme.

    Parameters
    ----------
    data : Measurements, MeasuredShape, or a list of them
    free : sequence of str
        Which of "bending_stiffness", "adhesion_strength" and "adhesion_range" to fit.
    rod : Rod or mapping of str to float, optional
        The numbers that are known, in SI units, and of a `Rod` also where to start.  Needed
        unless all three are free.
    state : {"unfolded", "middle", "lower", "folded"}, optional
        Of all measurements that do not say.
    loss : {"least-squares", "pseudo-huber"}
        How much a residual costs: half its square, or ``loss_scale**2 (sqrt(1 + (r/loss_scale)^2) - 1)``,
        which lets outliers pull with a bounded force.
    loss_scale : float
        In standard deviations.
    solver : Solver, optional
        Options of IPOPT.

    Returns
    -------
    Calibration
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
    if state is not None and state not in STATES:
        raise InvalidInput(f"unknown state {state!r}.", remedy=f"Choose one of {', '.join(STATES)}.")
    seen = [replace(o, state=o.state or state or "unfolded") for o in observations(data)]
    mask = _mask(free)
    known = _known(rod, mask)
    if loss not in LOSSES:
        raise InvalidInput(f"unknown loss {loss!r}.", remedy=f"Choose one of {', '.join(LOSSES)}.")
    delta = positive("loss_scale", loss_scale) if loss == "pseudo-huber" else None
    _require_enough(seen, mask)
    problem = Problem([], 1.0, mask, delta, solver=solver or Solver())
    result = _fit(seen, known, rod, problem)
    found = warnings_of(result)
    if loss == "least-squares" and result.degrees > 0 and result.p_value < RARE:
        found += _contradictions(result, known)
    return replace(result, warnings=found)


def _fit(
    seen: Sequence[Observation], known: Mapping[str, float], rod: object, problem: Problem
) -> Calibration:
    """Fit and describe, without warnings."""
    mask, delta = problem.free, problem.delta
    chosen = _best(seen, known, rod, problem)
    problem, fitted = chosen.problem, chosen.fitted
    model = linear_model(fitted.posed, mask, delta)
    return Calibration(
        rod=rod_at(chosen.reference, fitted.q),
        free=tuple(name for name, yes in zip(MATERIAL, mask, strict=True) if yes),
        log_covariance=model.covariance(sandwich=delta is not None),
        deviance=fitted.deviance,
        degrees=sum(o.degrees for o in seen) - int(mask.sum()),
        combinations=combinations(model.jacobian, mask),
        singular_values=np.linalg.svd(model.jacobian, compute_uv=False),
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
        reference=chosen.reference,
    )


def _contradictions(fit: Calibration, known: Mapping[str, float]) -> tuple[str, ...]:
    """Say whether a bad fit is one of states on another part of the branch than was said.

    All of them folded is one thing to try; a robust fit shows the few that are not like the rest.
    """
    seen = fit.observations
    if not any(o.state == "unfolded" for o in seen):
        return ()
    problem = replace(fit.problem, observations=[], nodes=NODES[0], ridge=0.0)
    turned = [replace(o, state="folded") if o.state == "unfolded" else o for o in seen]
    (as_seen, _), (as_turned, start) = (coarse_rods(part, known, 1)[0] for part in (seen, turned))
    try:
        folded = _fit(turned, known, start, problem) if as_turned < 0.5 * as_seen else None
        if folded is not None and folded.chi2 < MUCH_LESS * fit.chi2:
            return (
                "the data contradict the unfolded branch: with all of them on the folded one chi-square"
                f" falls from {fit.chi2:.4g} to {folded.chi2:.4g}. If the rod was folded back over itself,"
                " say state='folded'.",
            )
    except PeelOptError:
        pass  # then they are not folded
    try:
        robust = _fit(seen, known, fit.rod, replace(problem, delta=ROBUST))
    except PeelOptError:
        return ()
    return tuple(far_points(robust))


def rod_at(reference: Rod, q: np.ndarray) -> Rod:
    """Return the rod whose numbers are exp(q) times those of a reference."""
    return Rod(*(getattr(reference, name) * math.exp(v) for name, v in zip(MATERIAL, q, strict=True)))


def _mask(free: Sequence[str]) -> np.ndarray:
    names = [free] if isinstance(free, str) else list(free)
    if unknown := [name for name in names if name not in MATERIAL]:
        raise InvalidInput(
            f"unknown free number {unknown[0]!r}.", remedy=f"Choose among {', '.join(MATERIAL)}."
        )
    if not names:
        raise InvalidInput("nothing is free.", remedy=f"Name some of {', '.join(MATERIAL)} in free=.")
    return np.array([name in names for name in MATERIAL])


def _known(rod: Rod | Mapping[str, float] | None, mask: np.ndarray) -> dict[str, float]:
    """Return the numbers that are not free."""
    if isinstance(rod, Rod):
        numbers = {name: getattr(rod, name) for name in MATERIAL}
    else:
        numbers = {name: positive(name, value) for name, value in (rod or {}).items()}
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


def _require_enough(seen: Sequence[Observation], mask: np.ndarray) -> None:
    have, need = sum(o.degrees for o in seen), int(mask.sum())
    if have < need:
        raise InvalidInput(
            f"{have} independent data cannot determine {need} free numbers.",
            remedy="Measure more points, or fix numbers that are known: a pair counts once, a shape as"
            " many times as it has points.",
        )


@dataclass(frozen=True, eq=False)
class _Trial:
    """A fit from one start, its states solved again."""

    reference: Rod
    problem: Problem
    fitted: Fitted
    equilibria: list[Equilibrium]
    consistency: float

    @property
    def strayed(self) -> int:
        """How many states are not those that were observed."""
        pairs = zip(self.problem.observations, self.equilibria, strict=True)
        return sum(not fits(eq.state, observation.state) for observation, eq in pairs)


def _best(seen: Sequence[Observation], known: Mapping[str, float], rod: object, problem: Problem) -> _Trial:
    """Fit from the rod given, and from those of a search where that fails or fits badly."""
    degrees = sum(o.degrees for o in seen) - int(problem.free.sum())
    found: list[_Trial] = []
    reason = "there is none to try."
    for start in _starts(seen, known, rod):
        try:
            found.append(_trial(start, seen, problem))
        except PeelOptError as error:
            reason = str(error)
            continue
        likely = degrees == 0 or chance(found[-1].fitted.deviance, degrees) > SUSPICIOUS
        if likely and not found[-1].strayed:
            return found[-1]
        if len(found) > 1 and abs(found[-1].fitted.deviance - found[-2].fitted.deviance) < SAME * degrees:
            break  # two starts lead to one fit
    if not found:
        raise NotConverged(
            f"no start leads to a fit of {len(seen)} observations. The last one: {reason}",
            remedy="Check units and states (state='folded' for a rod folded back over itself), give a rod to"
            " start from, or give lengths a standard deviation: near a fold no exact length may exist.",
        )
    return min(found, key=lambda trial: (trial.strayed, trial.fitted.deviance))


def _starts(seen: Sequence[Observation], known: Mapping[str, float], rod: object) -> Iterator[Rod]:
    """Yield the rod given, then those of a search, which is not made if nobody asks."""
    if isinstance(rod, Rod):
        yield rod
    yield from (start for _, start in coarse_rods(seen, known))


def _trial(start: Rod, seen: Sequence[Observation], problem: Problem) -> _Trial:
    """Fit from one rod."""
    _require_range(start)
    own = [o.scaled(start.eta, start.adhesion_strength) for o in seen]
    places = [Placed(projected(start, o)) for o in seen]
    problem, fitted = _attempt(replace(problem, observations=own, ratio=start.ratio), places)
    if fitted is None:
        raise NotConverged(f"IPOPT does not converge from {start!r}.")
    if np.any(np.abs(fitted.q) > 0.99 * FURTHEST):
        raise NotConverged(f"from {start!r} a number runs away.", remedy="The data do not bound it.")
    model = linear_model(fitted.posed, problem.free, problem.delta)
    left = model.left(fitted.q[problem.free], problem.ridge)
    if left > (LEFT_HELD if problem.ridge else LEFT):
        raise NotConverged(f"from {start!r} the fit stops {left:.1e} standard deviations before its minimum.")
    return _refined(problem, fitted, start)


def _attempt(problem: Problem, places: Sequence[Placed]) -> tuple[Problem, Fitted | None]:
    """Solve as it stands, held near the start where the data leave a combination open.

    A combination that the data do not see is no place to go to: a solver wanders along it until
    it meets something else.
    """
    q = np.zeros(3)
    held = replace(problem, ridge=RIDGE)
    if not _leaves_open(problem, problem.pose(q, places)):
        fitted = problem.solve(q, places)
        if fitted is not None:
            return problem, fitted
    near = held.solve(q, places) or held.by_homotopy(q, places)
    if near is None:
        return problem, problem.by_homotopy(q, places)
    if _leaves_open(problem, near.posed):
        return held, near
    fitted = problem.solve(near.q, near.posed.placed())
    return problem, fitted or problem.by_homotopy(q, places)


def _leaves_open(problem: Problem, posed: Posed) -> bool:
    """Whether the data do not determine some combination, to first order at these states."""
    model = linear_model(posed, problem.free, problem.delta)
    return not all(c.determined for c in combinations(model.jacobian, problem.free))


def _require_range(rod: Rod) -> None:
    low, high = RATIOS
    if not low <= rod.ratio <= high:
        raise OutOfRange(
            f"eta/y0 = {rod.ratio:.4g} is outside [{low:g}, {high:g}].",
            remedy="Check that no two material numbers are swapped or in the wrong unit.",
        )


def _refined(problem: Problem, fitted: Fitted, reference: Rod) -> _Trial:
    """Solve on finer meshes until the public functions agree with the fitted states."""
    best: _Trial | None = None
    failure: PeelOptError | None = None
    for nodes in NODES:
        if nodes > problem.nodes:
            finer = replace(problem, nodes=nodes)
            again = finer.solve(fitted.q, fitted.posed.placed())
            if again is None:
                break
            problem, fitted = finer, again
        rod = rod_at(reference, fitted.q)
        _require_range(rod)
        try:
            equilibria, consistency = resolved(problem, fitted, rod)
        except PeelOptError as error:
            failure = error
            continue
        best = _Trial(reference, problem, fitted, equilibria, consistency)
        if consistency <= AGREED:
            break
    if best is None:
        raise failure or NotConverged("the fit was lost on a finer mesh.", remedy="Give a rod to start from.")
    return best
