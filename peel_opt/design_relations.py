"""Design relations (37) to (42): what the normal form says about a real rod.

They are closed formulas for the linear law.  Below p = T0/2 the tip has left the cohesive zone
and they describe no rod under law (8); so the plateau (41) and the profiles (38) for eta/y0
below about 0.3 are figures of the paper, not predictions.
"""

from __future__ import annotations

import math
from typing import Any, Literal, Protocol

import numpy as np

from .elastica import PI4
from .errors import InvalidInput
from .landau import NormalForm
from .rod import Rod

Source = Literal["paper", "exact", "fit", "branch"]

#: The Maxwell point needs the fold at fixed beta0, which the branch from T has up to
#: beta0 = 37.546; there eta/y0 on the Maxwell curve has come down to this.
LEAST_RATIO = 0.499


class CurveLike(Protocol):
    """A curve of Maxwell points: arrays beta0 and lambda."""

    @property
    def beta0(self) -> np.ndarray:
        """(sbar/eta)^3."""

    @property
    def lam(self) -> np.ndarray:
        """lambda_M."""


def equation_of_state(rod: Rod, pressure: Any, length: Any, form: NormalForm | None = None) -> np.ndarray:
    """Left side of (37) [Pa^3]; it vanishes on the detached branch and at p = T0."""
    form, sigma = _quadratic(form), _length_ratio(rod, length)
    T0 = rod.adhesion_strength
    excess = np.asarray(pressure, float) - T0
    return excess**3 + form.a2 * T0 * excess**2 + form.a1 * _scaled_lambda(rod.ratio, sigma) * T0**2 * excess


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


def maxwell_pressure(rod: Rod, form: NormalForm | None = None) -> float:
    """p_M [Pa] of (40)."""
    return rod.adhesion_strength * (1.0 - 2.0 * _quadratic(form).a2 / 3.0)


def plateau_pressure(rod: Rod, form: NormalForm | None = None) -> float:
    """p_infinity [Pa] of (41): the limit of (38), of no solution of (12)."""
    return rod.adhesion_strength * (1.0 - _quadratic(form).a2)


def maxwell_length(
    ratio: Any, source: Source = "exact", *, form: NormalForm | None = None, curve: CurveLike | None = None
) -> Any:
    """Return the detached length at the Maxwell point over y0, sbar_M/y0, against eta/y0 (Fig 9).

    Parameters
    ----------
    ratio : float or array_like
        eta/y0.
    source : {"paper", "exact", "fit", "branch"}
        Coefficients in (42): the paper's, the exact ones, those of ``form``; or the Maxwell
        points of traced branches in ``curve``.
    form : NormalForm, optional
        For "fit": a form made by `NormalForm.fit`.
    curve : object with arrays beta0 and lam, optional
        For "branch": the Maxwell curve.

    Returns
    -------
    float or ndarray
        NaN where ``curve`` does not reach; `maxwell_note` says why, and flags the values that
        (42) has where there is no Maxwell point.
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
    if source == "branch":
        if curve is None:
            raise InvalidInput(
                "source='branch' needs the Maxwell points.", remedy="Pass curve= with arrays beta0 and lam."
            )
        return _on_curve(r, curve)
    if source == "fit" and form is None:
        raise InvalidInput("source='fit' needs a fitted form.", remedy="Pass form=NormalForm.fit(branch).")
    if source not in ("paper", "exact", "fit"):
        raise InvalidInput(f"source must be 'paper', 'exact', 'fit' or 'branch', got {source!r}.")
    chosen = {"paper": NormalForm.paper, "exact": NormalForm.exact}
    return _on_normal_form(r, _quadratic(form if source == "fit" else chosen[source]()))


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
    """Interpolate a Maxwell curve in log sigma against log r, as far as r falls with beta0."""
    from scipy.interpolate import make_interp_spline

    beta0, lam = np.asarray(curve.beta0, float), np.asarray(curve.lam, float)
    good = np.isfinite(beta0) & np.isfinite(lam) & (beta0 > 0.0)
    beta0, first = np.unique(beta0[good], return_index=True)
    log_r = np.log((PI4 + lam[good][first]) / beta0 ** (4 / 3))
    falling = np.cumprod(np.append(True, np.diff(log_r) < 0.0)).astype(bool)
    if np.count_nonzero(falling) < 4:
        raise InvalidInput(
            f"a Maxwell curve needs four points with beta0 > 0, got {np.count_nonzero(falling)}."
        )
    x, y = log_r[falling][::-1], np.log(beta0[falling])[::-1] / 3.0
    spline = make_interp_spline(x, y, k=3)
    wanted = np.log(r)
    inside = (wanted >= x[0]) & (wanted <= x[-1])
    sigma, slope = np.exp(spline(wanted)), spline.derivative()(wanted)
    return np.where(inside, sigma, np.nan), np.where(inside, slope, np.nan)


def _shaped(ratio: Any, function: Any) -> Any:
    """Apply to a checked array of ratios and give back a float for a number."""
    r = np.asarray(ratio, float)
    if not (np.isfinite(r).all() and (r > 0.0).all()):
        raise InvalidInput(f"ratio must be finite and positive, got {ratio!r}.")
    values = function(np.atleast_1d(r)).reshape(r.shape)
    return float(values) if r.ndim == 0 else values


def _length_ratio(rod: Rod, length: Any) -> np.ndarray:
    sigma = np.asarray(length, float) / rod.eta
    if not (np.isfinite(sigma).all() and (sigma > 0.0).all()):
        raise InvalidInput(f"length [m] must be finite and positive, got {length!r}.")
    return sigma


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
