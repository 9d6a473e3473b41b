"""Design relations (37) to (42): what the normal form says about a real rod.

They are closed formulas for the linear law.  Below p = T0/2 the tip has left the cohesive zone
and they describe no rod under law (8); so the plateau (41) and the profiles (38) for eta/y0
below about 0.3 are figures of the paper, not predictions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal, Protocol

import numpy as np
from scipy.interpolate import make_interp_spline

from ..base.errors import InvalidInput
from ..base.roots import zeros
from ..base.units import in_si
from ..equilibria.trace import trace
from ..model.groups import PI4
from ..model.rod import Rod
from .maxwell import TURN, maxwell_curve, stretched
from .normal_form import NormalForm

Source = Literal["paper", "exact", "fit", "branch"]

#: The Maxwell point needs the fold at fixed beta0, which the branch from T has up to
#: beta0 = 37.5458; there eta/y0 on the Maxwell curve has come down to this.
LEAST_RATIO = 0.4989


class CurveLike(Protocol):
    """A curve of Maxwell points: arrays beta0 and lambda."""

    @property
    def beta0(self) -> np.ndarray:
        """(sbar/eta)^3."""

    @property
    def lam(self) -> np.ndarray:
        """lambda_M."""


def pressure_profile(rod: Rod, length: Any, form: NormalForm | None = None) -> np.ndarray:
    """Pressure [Pa] on the lower branch at detached lengths [m], (38) and Fig 8.

    NaN where the length has no detached state, which is for lambda < lambda_F.
    """
    form, sigma = _quadratic(form), _length_ratio(rod, length)
    square = form.a2**2 - 4.0 * form.a1 * _scaled_lambda(rod.ratio, sigma)
    with np.errstate(invalid="ignore"):
        return rod.adhesion_strength * (1.0 - 0.5 * (form.a2 + np.sqrt(square)))


def fold_pressure(rod: Rod, form: NormalForm | None = None) -> float:
    """p_F [Pa] of (39)."""
    return rod.adhesion_strength * (1.0 - _quadratic(form).a2 / 2.0)


def maxwell_length(
    ratio: Any, source: Source = "exact", *, form: NormalForm | None = None, curve: CurveLike | None = None
) -> Any:
    """Return the detached length at the Maxwell point over y0, sbar_M/y0, against eta/y0 (Fig 9).

    Parameters
    ----------
    ratio : float or array_like
        eta/y0.
    source : {"paper", "exact", "fit", "branch"}
        Coefficients in (42): the paper's, the exact ones, those of a fit to the traced branch
        at beta0 = 4; or the Maxwell points of traced branches, which make no use of (42).
    form : NormalForm, optional
        For "fit": another form made by `NormalForm.fit`.
    curve : MaxwellCurve, optional
        For "branch": another curve than that of `maxwell_curve` over its default range, which
        takes some seconds to compute when it is first used.

    Returns
    -------
    float or ndarray
        NaN where the curve does not reach, for eta/y0 below 0.4996; `maxwell_note` says why, and
        flags the values that (42) has where there is no Maxwell point.

    Examples
    --------
    >>> round(maxwell_length(1.0, "paper"), 4), round(maxwell_length(1.0, "branch"), 4)
    (3.0426, 3.0271)
    """
    return _shaped(ratio, lambda r: r * _maxwell_sigma(r, source, form, curve)[0])


def maxwell_exponent(
    ratio: Any, source: Source = "exact", *, form: NormalForm | None = None, curve: CurveLike | None = None
) -> Any:
    """Return d log sbar_M / d log eta at fixed y0: 1 for eta << y0 under (42), 3/4 for eta >> y0."""
    return _shaped(ratio, lambda r: 1.0 + _maxwell_sigma(r, source, form, curve)[1])


def maxwell_note(
    ratio: float, source: Source = "exact", *, form: NormalForm | None = None, curve: CurveLike | None = None
) -> str:
    """Return what is to be said about `maxwell_length` at one eta/y0; empty if nothing is."""
    known = math.isfinite(maxwell_length(float(ratio), source, form=form, curve=curve))
    if ratio < LEAST_RATIO:
        reason = f"the branch from T at fixed beta0 has no Maxwell point for eta/y0 below {LEAST_RATIO:g}"
        return f"{reason}; (42) still has a root" if known else reason
    return "" if known else "the Maxwell curve given does not reach this eta/y0"


def _maxwell_sigma(
    r: np.ndarray, source: Source, form: NormalForm | None, curve: CurveLike | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return sigma_M and d log sigma_M / d log r."""
    if isinstance(source, str) and source == "branch":
        return _on_curve(r, maxwell_curve() if curve is None else curve)
    chosen: dict[str, Callable[[], NormalForm]] = {
        "paper": NormalForm.paper,
        "exact": NormalForm.exact,
        "fit": _fitted,
    }
    if not isinstance(source, str) or source not in chosen:
        raise InvalidInput(f"source must be 'paper', 'exact', 'fit' or 'branch', got {source!r}.")
    return _on_normal_form(r, _quadratic(form if source == "fit" and form is not None else chosen[source]()))


def _on_normal_form(r: np.ndarray, form: NormalForm) -> tuple[np.ndarray, np.ndarray]:
    """Root of (42): kappa q^3 + r q^2 = pi^4 with q = sigma^2.

    The left side is convex and increasing, and each term alone puts q below the start, so
    Newton's method comes down to the one positive root from any eta/y0.
    """
    kappa = -2.0 * form.a2**2 / (9.0 * form.a1)
    q = np.minimum(np.sqrt(PI4 / r), (PI4 / kappa) ** (1 / 3))
    for _ in range(50):
        step = (kappa * q**3 + r * q**2 - PI4) / (3.0 * kappa * q**2 + 2.0 * r * q)
        q = q - step
        if (np.abs(step) <= 4e-16 * q).all():
            break
    return np.sqrt(q), -0.5 * r / (3.0 * kappa * q + 2.0 * r)


def _on_curve(r: np.ndarray, curve: CurveLike) -> tuple[np.ndarray, np.ndarray]:
    """Interpolate lambda_M/beta0^2 and find the beta0 at which a rod has its Maxwell point.

    eta/y0 falls as beta0 grows along the whole curve.
    """
    beta0, first = np.unique(np.asarray(curve.beta0, float), return_index=True)
    lam = np.asarray(curve.lam, float)[first]
    good = np.isfinite(lam) & (beta0 > 0.0) & (beta0 < TURN)
    beta0, lam = beta0[good], lam[good]
    if beta0.size < 6:
        raise InvalidInput(f"a Maxwell curve needs six points with 0 < beta0 < {TURN:g}, got {beta0.size}.")
    level = make_interp_spline(stretched(beta0), lam / beta0**2, k=5)
    rate = level.derivative()

    def log_ratio(b: Any) -> Any:
        return np.log(PI4 + b * b * level(stretched(b))) - 4.0 / 3.0 * np.log(b)

    found = np.full_like(r, math.nan)
    for i, wanted in enumerate(np.log(r)):
        inside = zeros(lambda b, w=wanted: log_ratio(b) - w, beta0)  # type: ignore[misc]
        found[i] = inside[0] if inside else math.nan
    q, x_rate = level(stretched(found)), 2.0 * found / (TURN**2 - found**2)
    ratio_rate = (2.0 * found * q + found**2 * rate(stretched(found)) * x_rate) / (PI4 + found**2 * q)
    return np.cbrt(found), 1.0 / (3.0 * found * (ratio_rate - 4.0 / (3.0 * found)))


@lru_cache(maxsize=1)
def _fitted() -> NormalForm:
    """Fit to the traced branch at beta0 = 4, of which the paper's numbers are a fit too."""
    return NormalForm.fit(trace(beta0=4.0, lam=(-1.0, 3.0)))


def _shaped(ratio: Any, function: Any) -> Any:
    """Apply to a checked array of ratios and give back a float for a number."""
    r = _positive_array("ratio", ratio)
    values = function(np.atleast_1d(r)).reshape(r.shape)
    return float(values) if r.ndim == 0 else values


def _length_ratio(rod: Rod, length: Any) -> np.ndarray:
    return _positive_array("length", length, _unit(rod, "m")) / rod.eta


def _unit(rod: Rod, unit: str) -> str:
    return "" if rod.dimensionless else unit


def _positive_array(name: str, values: Any, unit: str = "") -> np.ndarray:
    bare = in_si(name, values, unit)
    try:
        array = np.asarray(bare, float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(f"{name} must be a number or an array of them, got {values!r:.60}.") from error
    if not (np.isfinite(array).all() and (array > 0.0).all()):
        raise InvalidInput(f"{name} must be finite and positive, got {values!r:.60}.")
    return array


def _scaled_lambda(r: float, sigma: np.ndarray) -> np.ndarray:
    """lambda/beta0^2, which (37) and (38) are written in."""
    return r / sigma**2 - PI4 / sigma**6


def _quadratic(form: NormalForm | None) -> NormalForm:
    form = NormalForm.exact() if form is None else form
    if form.series is not None and form.series.order > 1:
        raise InvalidInput(
            "the design relations are closed formulas of (33), not of the uniform series.",
            remedy="Use NormalForm.exact(), or the series itself at given beta0.",
        )
    if not (form.a1 < 0.0 < form.a2):
        raise InvalidInput(f"the design relations need a1 < 0 < a2, got {form.a1:g} and {form.a2:g}.")
    return form
