"""What a reader must know before believing a fit, in plain words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...base.errors import AmbiguousState, PeelOptError
from ...equilibria.ask import length_given_pressure, pressure_given_length
from ...equilibria.result import Equilibrium
from ...model.rod import Rod
from .data import Observation
from .identifiability import undetermined_words
from .start import fits

if TYPE_CHECKING:
    from .result import Calibration

#: Residual, in standard deviations, from which a point is looked for on other states.
FAR = 4.0

#: Weight of a robust loss below which a point is named.
OUTLIER = 0.3

#: Tip angle [rad] below which a state counts as T itself.
AT_TRANSITION = 1e-5

#: Chances of a chi-square as large, or as small, below which it is said.
RARE = 1e-3

#: Standard deviation of a logarithm from which it is no longer near a linear problem.
CURVED = 0.15


def warnings_of(fit: Calibration) -> tuple[str, ...]:
    """Return what a reader must know before believing a fit, in plain words."""
    found = [undetermined_words(fit.combinations)]
    if fit.problem.ridge:
        found.append("what the data do not determine was held near the start of the fit.")
    found += _tips(fit)
    found += [_goodness(fit), *_states(fit), *far_points(fit)]
    curved = [name for name in fit.free if CURVED < fit.relative_sd(name) < np.inf]
    if curved and not found[0]:
        found.append(
            f"{', '.join(curved)}: the uncertainty is so large that the covariance is a rough guide."
            " Use the interval of the profile likelihood."
        )
    return tuple(text for text in found if text)


def _tips(fit: Calibration) -> list[str]:
    """Say where a point beyond the tip sets the length, which it would not from the other side."""
    return [
        f"{observation.name}: a point lies beyond the fitted tip and holds it there, from one side only."
        " Use the interval of the profile likelihood, or say tip=True if the first point is the tip."
        for observation, signature in zip(fit.observations, fit.fitted.blocks.signatures, strict=True)
        if signature.at_tip > observation.tip
    ]


def _goodness(fit: Calibration) -> str:
    if fit.degrees == 0:
        return "there are as many data as free numbers: nothing tells whether the model holds."
    if fit.loss != "least-squares":
        return ""
    if fit.p_value < RARE:
        return (
            f"chi-square is {fit.deviance:.4g} for {fit.degrees} degrees of freedom"
            f" (p = {fit.p_value:.1e}): the residuals are larger than the standard deviations allow, so the"
            " covariance is too small."
            f" The largest is {fit.largest[1]:.1f} sd, {fit.largest[0]}."
        )
    if 1.0 - fit.p_value < RARE:
        return (
            f"chi-square is {fit.deviance:.4g} for {fit.degrees} degrees of freedom: the standard"
            " deviations look too large, and with them the covariance."
        )
    return ""


def _states(fit: Calibration) -> list[str]:
    """Say which states are not those asked for, or not physical."""
    found = []
    for observation, eq in zip(fit.observations, fit.equilibria, strict=True):
        if not fits(eq.state, observation.state):
            found.append(
                f"{observation.name} is fitted on the {eq.state} state, not the {observation.state} one:"
                " it lies past the end of that part of the branch."
            )
        if abs(eq.tip_angle) < AT_TRANSITION:
            found.append(f"{observation.name} is fitted at T itself: its pressure is above the fitted T0.")
        if not eq.valid:
            found.append(
                f"{observation.name} is fitted to a state that is not physical: {', '.join(eq.flags)}."
            )
    return found


def far_points(fit: Calibration) -> list[str]:
    """Name points far off, and the other state on which they would lie."""
    found = []
    for observation, r, weights in zip(fit.observations, fit.residuals, fit.weights, strict=True):
        size = float(np.linalg.norm(r))
        other = _other_state(fit.rod, observation, size) if observation.points is None and size > FAR else ""
        if not other and fit.loss != "least-squares" and weights.min() < OUTLIER:
            found.append(
                f"{observation.name} counts as an outlier: {size:.1f} sd off the fit to the others, weight"
                f" {weights.min():.2g}."
            )
        if other:
            found.append(
                f"{observation.name} contradicts the {observation.state} branch by {size:.1f} sd and lies"
                f" on the {other} one. If it was seen there, give it state='{other}'."
            )
    return found


def _other_state(rod: Rod, observation: Observation, size: float) -> str:
    """Name of the state on which a pair lies much nearer, empty if there is none."""
    assert observation.length is not None
    assert observation.pressure is not None
    best, name = 0.25 * size, ""
    others = ("folded",) if observation.state != "folded" else ("lower", "middle")
    for state in others:
        gaps = []
        for by_length in (True, False):
            try:
                if by_length and observation.pressure_sd:
                    eq = _held(rod, observation.length, state, observation.pressure)
                    gaps.append(abs(eq.pressure - observation.pressure) / observation.pressure_sd)
                if not by_length and observation.length_sd:
                    eq = length_given_pressure(
                        rod, observation.pressure, state=state, near=observation.length
                    )
                    gaps.append(abs(eq.length - observation.length) / observation.length_sd)
            except PeelOptError:
                continue
        if min(gaps, default=np.inf) < best:
            best, name = min(gaps), state
    return name


def _held(rod: Rod, length: float, state: str, pressure: float) -> Equilibrium:
    """Equilibrium of a length on a state; ``near``, which walks elsewhere too, only where two have it."""
    try:
        return pressure_given_length(rod, length, state=state)
    except AmbiguousState:
        return pressure_given_length(rod, length, state=state, near=pressure)
