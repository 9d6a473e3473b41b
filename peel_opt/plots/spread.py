"""The distribution of an uncertain number: samples, their density, quantiles, the linear estimate."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from scipy import stats

from ..base.errors import InvalidInput
from ..studies.uncertainty.result import LINEAR_ENOUGH, Propagated, percent
from . import style
from .axes import axes_or, own_axes
from .dispatch import drawn_by
from .mpl import finish
from .words import axis_unit

SYMBOLS = {
    "pressure": "p",
    "length": r"\bar s",
    "readhesion_pressure": r"p_{\min}",
    "maxwell_length": r"\bar s_M",
    "critical_length": r"\bar s_c",
    "critical_flaw": "a",
    "safe_pressure": r"p_{\max}",
}

#: Points on a curve, and how far beyond the samples it is drawn, in their range.
POINTS, BEYOND = 400, 0.06


@drawn_by.register
def plot_spread(found: Propagated, ax: Axes | None = None) -> Axes:
    """Draw histogram and density of the samples, the linear estimate over them, and quantiles.

    Parameters
    ----------
    found : Propagated
    ax : Axes, optional

    Returns
    -------
    Axes
        The number in its unit against probability per unit.

    Raises
    ------
    InvalidInput
        If fewer than two samples have an answer.
    """
    values = found.found
    if values.size < 2 or np.ptp(values) == 0.0:
        raise InvalidInput(f"too few samples of {found.name} have an answer to draw their distribution.")
    ax = axes_or(ax, own_axes(6.4, 4.2))
    unit = axis_unit(found.unit, float(np.abs(values).max()))
    values = values / unit.size
    bins = min(60, max(12, round(math.sqrt(values.size))))
    ax.hist(values, bins=bins, density=True, color=style.ROD, alpha=0.18, label=f"{values.size} samples")
    low, high = values.min(), values.max()
    x = np.linspace(low - BEYOND * (high - low), high + BEYOND * (high - low), POINTS)
    ax.plot(x, stats.gaussian_kde(values)(x), color=style.ROD, linewidth=1.8, label="their density")
    if math.isfinite(found.linear_sd) and found.linear_sd > 0.0:
        mean, sd = found.linear_mean / unit.size, found.linear_sd / unit.size
        linear = stats.norm(mean, sd).pdf(x)
        ax.plot(x, linear, "--", color=style.PRESSURE, linewidth=1.8, label="linear estimate")
    ax.set_ylim(0.0, 1.14 * ax.get_ylim()[1])  # room for the names of the quantiles
    for share, words in ((0.025, "2.5 %"), (0.5, "50 %"), (0.975, "97.5 %")):
        place = found.quantile(share) / unit.size
        ax.axvline(place, color=style.ADHESION, linewidth=1.0, linestyle=":")
        ax.text(
            place,
            1.0,
            f" {words}",
            rotation=90,
            ha="right",
            va="top",
            color=style.ADHESION,
            fontsize=style.SMALL,
            transform=ax.get_xaxis_transform(),
        )
    ax.set_xlabel(unit.axis(SYMBOLS[found.name]))
    ax.set_ylabel("probability density" if unit.is_symbol else f"probability per {unit.name}")
    ax.set_title("\n".join(_lines(found)), fontsize=style.SMALL, loc="left")
    ax.spines[["top", "right"]].set_visible(False)
    return finish(ax, columns=3)


def _lines(found: Propagated) -> list[str]:
    lines = [
        f"sampled {found.shown(found.mean)} ± {found.shown(found.sd)};"
        f" linear {found.shown(found.linear_mean)} ± {found.shown(found.linear_sd)}"
    ]
    if found.failed:
        lines.append(f"{percent(found.failed)} of the samples have no answer and are not shown")
        if found.fates:
            each = (f"{percent(n / found.values.size)} {fate}" for fate, n in found.fates.items())
            lines[-1] += f":\n{', '.join(each)}"
    if not math.isfinite(found.linear_sd):
        lines.append("the nominal state lies at a fold: there is no linear estimate")
    elif found.nonlinearity > LINEAR_ENOUGH:
        lines.append(f"linear and sampled disagree by {percent(found.nonlinearity)} of the linear sd")
    return lines
