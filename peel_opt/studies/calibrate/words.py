"""What the data determine, what they do not, and what else a reader must know, in plain words.

The singular value decomposition of the weighted Jacobian in logarithms gives products of powers
k^a T0^b y0^c and how well each is known, independently of each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...model.labels import UNFOLDED, fits
from .covariance import singular
from .curve import fitted_curve
from .pairs import Pairs, scales

if TYPE_CHECKING:
    from .result import Calibration, Fit

SYMBOLS = ("k", "T0", "y0")

#: Standard deviation of a logarithm from which a combination counts as not determined.
LOOSE = 0.5

#: Cosine of the angle from which a combination goes by a name.
SAME = 0.998

#: Products of powers that mean something, by their exponents (of k, T0, y0).
NAMED = {
    "the critical length pi (k y0/T0)^(1/4)": (0.25, -0.25, 0.25),
    "the elasto-adhesion length (k/T0)^(1/3)": (1.0 / 3.0, -1.0 / 3.0, 0.0),
    "the work of separation T0 y0/2": (0.0, 1.0, 1.0),
    "the ratio eta/y0": (1.0 / 3.0, -1.0 / 3.0, -1.0),
    "the length (k/(T0 y0))^(1/2)": (0.5, -0.5, -0.5),
}

#: Share of a direction from which a number is named in it.
SHOWN = 0.2


@dataclass(frozen=True)
class Direction:
    """A combination of the free numbers, and how well the data know it.

    Parameters
    ----------
    shares : dict of str to float
        The numbers that have a part in it; the largest is 1 in size.
    sd : float
        Standard deviation, of logarithms or relative to the sizes at the start; infinite if nothing is known.
    """

    shares: dict[str, float]
    sd: float

    @classmethod
    def of(cls, names: Sequence[str], row: np.ndarray, sd: float) -> Direction:
        """Return a direction of length 1 by its largest part."""
        largest = float(row[np.argmax(np.abs(row))])
        named = {n: float(share) / largest for n, share in zip(names, row, strict=True) if abs(share) > SHOWN}
        return cls(named, sd / abs(largest))

    @property
    def names(self) -> tuple[str, ...]:
        """The numbers that have a part in it."""
        return tuple(self.shares)

    @property
    def determined(self) -> bool:
        """Whether it is known to better than a factor exp(0.5)."""
        return self.sd < LOOSE

    def __str__(self) -> str:
        known = f"to {100.0 * self.sd:.2g} %" if math.isfinite(self.sd) else "not at all"
        parts = [name if share == 1.0 else f"{share:+.2g} {name}" for name, share in self.shares.items()]
        return f"{' '.join(sorted(parts, key=lambda part: part[0] in '+-'))} ({known})"


@dataclass(frozen=True)
class Combination:
    """A product of powers of the material numbers, and how well the data know it.

    Parameters
    ----------
    exponents : tuple of float
        Of k, T0 and y0; the largest is 1 in size, or those of a named product.
    sd : float
        Standard deviation of its logarithm; infinite if the data say nothing.
    name : str
        What it is, if it is something.
    close : str
        What it is close to.
    """

    exponents: tuple[float, float, float]
    sd: float
    name: str = ""
    close: str = ""

    @property
    def determined(self) -> bool:
        """Whether it is known to better than a factor exp(0.5)."""
        return self.sd < LOOSE

    @property
    def formula(self) -> str:
        """Powers of the material numbers, such as "k^0.25 T0^-0.25 y0^0.25"."""
        powers = [(s, e) for s, e in zip(SYMBOLS, self.exponents, strict=True) if abs(e) > 0.005]
        return " ".join(s if abs(e - 1.0) < 0.005 else f"{s}^{e:.2g}" for s, e in powers)

    @property
    def precision(self) -> str:
        """How well it is known, in words."""
        if not math.isfinite(self.sd):
            return "not at all"
        if self.sd < 0.1:
            return f"to {100.0 * self.sd:.2g} %"
        return f"to a factor {math.exp(min(self.sd, 50.0)):.3g}"

    def __str__(self) -> str:
        return f"{self.words} ({self.precision})"

    @property
    def words(self) -> str:
        """Its name or its formula."""
        return self.name or f"{self.formula}{self.close}"


def combinations(jacobian: np.ndarray, free: np.ndarray) -> tuple[Combination, ...]:
    """Return independent combinations of the free material numbers, the best known first.

    Parameters
    ----------
    jacobian : ndarray, shape (rows, free)
        Residuals in standard deviations by logarithms.
    free : ndarray of bool, shape (3,)
    """
    sizes, vt, seen = singular(jacobian)
    sds = np.where(seen, 1.0 / np.where(seen, sizes, 1.0), math.inf)
    return tuple(_named(i, vt, sds, free) for i in range(len(vt)))


def _named(i: int, directions: np.ndarray, sds: np.ndarray, free: np.ndarray) -> Combination:
    """Scale a direction to a product with a name, or to a largest exponent of 1.

    ``sds`` belong to directions of length 1.
    """
    exponents, sd = np.zeros(3), float(sds[i])
    exponents[free] = directions[i]
    close = ""
    if free.sum() > 1:
        for name, powers in NAMED.items():
            target = np.where(free, powers, 0.0)
            # With numbers known, two names may leave the same direction: the whole one counts.
            if np.count_nonzero(target) != np.count_nonzero(powers):
                continue
            length = float(np.linalg.norm(target))
            shares = np.abs(directions @ target[free])
            shares[shares < 1e-12 * length] = 0.0
            own = float(np.linalg.norm(np.where(shares > 0.0, shares * sds, 0.0)))
            # A name is no better known than its share of what is not known lets it be.
            if shares[i] > SAME * length:
                if own < 1.5 * sd * length:
                    a, b, c = (float(v) for v in target)
                    return Combination((a, b, c), own, name)
                close = f", close to {name}"
    largest = exponents[np.argmax(np.abs(exponents))]
    a, b, c = (float(v) for v in exponents / largest)
    return Combination((a, b, c), sd / abs(float(largest)), close=close)


def undetermined_words(found: tuple[Combination, ...]) -> str:
    """Return the warning that some combination is not determined; empty if all are."""
    loose = [c for c in found if not c.determined]
    if not loose:
        return ""
    firm = [c for c in found if c.determined]
    known = f" They do determine {', '.join(map(str, firm))}." if firm else ""
    how = "not at all" if not math.isfinite(loose[-1].sd) else f"only {loose[-1].precision}"
    return (
        f"the data do not tell the free numbers apart: {loose[-1].words} is known {how}."
        f"{known} Fix a number that is known from elsewhere, or measure over a wider range of pressure."
    )


# --- warnings ----------------------------------------------------------------------------------

#: Residual, in standard deviations, from which a point is looked for on other states.
FAR = 4.0

#: Share of that residual below which it is one of another state.
NEARER = 0.25

#: Weight of a robust loss below which a point is named.
OUTLIER = 0.3

#: Chances of a chi-square as large, or as small, below which it is said.
RARE = 1e-3

#: Standard deviation of a logarithm from which it is no longer near a linear problem.
CURVED = 0.15


def warnings_of(fit: Calibration) -> tuple[str, ...]:
    """Return what a reader must know before believing a fit, in plain words."""
    found = [undetermined_words(fit.combinations)]
    if fit.fitted.held:
        found.append("what the data do not determine was held near the start of the fit.")
    found += _tips(fit)
    found += [goodness(fit), *_states(fit), *far_points(fit).values()]
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
        for i, observation in enumerate(fit.observations)
        if observation.points is not None and fit.problem.picture(i, fit.fitted).beyond_tip > observation.tip
    ]


def goodness(fit: Fit) -> str:
    """Return what chi-square says of the model and the standard deviations; empty if nothing is wrong."""
    if fit.degrees == 0:
        return "there are as many data as free numbers: nothing tells whether the model holds."
    if fit.loss != "least-squares" or fit.scaled is not None:
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
    seen = fit.problem.seen(fit.fitted)
    for observation, eq, one in zip(fit.observations, fit.equilibria, seen, strict=True):
        if not fits(eq.state, observation.state):
            found.append(
                f"{observation.name} is fitted on the {eq.state} state, not the {observation.state} one:"
                " it lies past the end of that part of the branch."
            )
        if one.at_T:
            found.append(
                f"{observation.name} is fitted at T itself: no detached state has a pressure above the T0 of"
                f" {fit.rod.adhesion_strength:.6g} Pa."
            )
        if not eq.valid:
            found.append(
                f"{observation.name} is fitted to a state that is not physical: {', '.join(eq.flags)}."
            )
    return found


def far_points(fit: Calibration) -> dict[int, str]:
    """Name points far off by their numbers, and the other state on which they would lie."""
    found, elsewhere = {}, _other_states(fit)
    for i, (observation, r, weights) in enumerate(
        zip(fit.observations, fit.residuals, fit.weights, strict=True)
    ):
        size = float(np.linalg.norm(r))
        if i in elsewhere:
            found[i] = (
                f"{observation.name} contradicts the {observation.state} branch by {size:.1f} sd and lies"
                f" on the {elsewhere[i]} one. If it was seen there, give it state='{elsewhere[i]}'."
            )
        elif fit.loss != "least-squares" and weights.min() < OUTLIER:
            found[i] = (
                f"{observation.name} counts as an outlier: {size:.1f} sd off the fit to the others, weight"
                f" {weights.min():.2g}."
            )
    return found


def _other_states(fit: Calibration) -> dict[int, str]:
    """Names of the states on which pairs that are far off lie much nearer, by the number of each."""
    sizes = np.array([np.linalg.norm(r) for r in fit.residuals])
    far = [i for i in np.flatnonzero(sizes > FAR) if fit.observations[i].points is None]
    if not far:
        return {}
    curve, scale, found = fitted_curve(fit), scales(fit.fitted.q)[0], {}
    for i in far:
        seen = fit.observations[i]
        others = ("folded",) if seen.state != "folded" else UNFOLDED
        gaps = curve.nearest(Pairs.of([replace(seen, state=state) for state in others]), scale)[1] ** 0.5
        gap, state = min(zip(np.nan_to_num(gaps, nan=np.inf), others, strict=True))
        if gap < NEARER * sizes[i]:
            found[int(i)] = state
    return found
