"""A fit: measurements with error bars, the fitted branch with its band, residuals below."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..model.rod import UNITS
from ..studies.calibrate.result import Calibration, Fit
from .axes import own_figure, require_axes
from .dispatch import drawn_by
from .mpl import finish
from .style import PRESSURE, ROD, SMALL
from .words import length_unit, pressure_unit, quantity

#: Half width of the band, in standard deviations.
BAND = 1.96


def fit_figure(fit: Fit) -> Figure:
    """Return a figure with the fit above its residuals; shapes stand beside."""
    shapes = any(o.points is not None for o in fit.observations)
    figure = own_figure(10.5 if shapes else 6.4, 6.0)
    columns = figure.subplots(2, 2 if shapes else 1, gridspec_kw={"height_ratios": [3, 1]}, squeeze=False)
    plot_fit(fit, columns[0, 0], columns[1, 0])
    if not any("measured" in (o.role("length"), o.role("pressure")) for o in fit.observations):
        columns[1, 0].clear()
        columns[1, 0].set_axis_off()
    if isinstance(fit, Calibration) and shapes:
        plot_shapes(fit, columns[0, 1])
        _shape_residuals(fit, columns[1, 1])
    return figure


@drawn_by.register
def plot_fit(fit: Fit, ax: Axes | None = None, residuals: Axes | None = None) -> Axes:
    """Draw measured pressures against lengths and the fitted branch through them.

    Parameters
    ----------
    fit : Fit
    ax, residuals : Axes, optional
        Of the fit and of its residuals; without both, those of a figure of their own.

    Returns
    -------
    Axes
        Of the fit.
    """
    if ax is None:
        figure = own_figure(6.4, 6.0)
        ax, own = figure.subplots(2, 1, gridspec_kw={"height_ratios": [3, 1]})
        residuals = own if residuals is None else residuals
    ax = require_axes(ax)
    if residuals is not None:
        require_axes(residuals, "residuals")
    seen = fit.observations
    lengths = [
        o.length if o.length is not None else eq.length for o, eq in zip(seen, fit.equilibria, strict=True)
    ]
    pressures = [
        o.pressure if o.pressure is not None else eq.pressure
        for o, eq in zip(seen, fit.equilibria, strict=True)
    ]
    x, y = length_unit(fit.rod, max(lengths)), pressure_unit(fit.rod, max(pressures))
    curve, normal_sd = _band(fit)
    across = np.array([x.size, y.size])
    drawn = curve / across
    # The window: measurements and fitted states with room around, so that a far end of the branch
    # does not press them together.
    low, high = _window(np.array(lengths) / x.size), _window(np.array(pressures) / y.size)
    if normal_sd is not None:
        corners = np.vstack([drawn + BAND * normal_sd / across, (drawn - BAND * normal_sd / across)[::-1]])
        ax.fill(
            corners[:, 0],
            corners[:, 1],
            color=PRESSURE,
            alpha=0.22,
            linewidth=0,
            label="95 % band of the fit",
        )
    ax.plot(drawn[:, 0], drawn[:, 1], color=PRESSURE, linewidth=1.6, label="fitted branch")
    for o, eq in zip(seen, fit.equilibria, strict=True):
        here = (
            (eq.length if o.length is None else o.length) / x.size,
            (eq.pressure if o.pressure is None else o.pressure) / y.size,
        )
        ax.errorbar(
            *here,
            xerr=None if o.length_sd is None else o.length_sd / x.size,
            yerr=None if o.pressure_sd is None else o.pressure_sd / y.size,
            fmt="o" if o.points is None else "s",
            color=ROD,
            markersize=4,
            elinewidth=1,
            capsize=2,
            markerfacecolor=ROD if o.points is None else "white",
            zorder=3,
        )
    if any(o.points is None for o in seen):
        ax.plot([], [], "o", color=ROD, markersize=4, label="measured, with one sd")
    if any(o.points is not None for o in seen):
        ax.plot([], [], "s", color=ROD, markerfacecolor="white", markersize=4, label="fitted to a shape")
    ax.set_xlim(*low)
    ax.set_ylim(*high)
    ax.set_xlabel(x.axis(r"\bar s"))
    ax.set_ylabel(y.axis("p"))
    freedom = f"$\\chi^2$ = {fit.chi2:.3g} for {fit.degrees} degrees of freedom"
    ax.set_title(f"{_numbers(fit)}\n{freedom}", fontsize=SMALL, loc="left")
    if residuals is not None:
        _pair_residuals(fit, residuals, np.array(pressures) / y.size, y.axis("p"))
    return finish(ax)


def _band(fit: Fit) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the fitted branch and the standard deviation across it."""
    from ..studies.calibrate.curve import band
    from ..studies.calibrate.scene_fit import SceneCalibration, scene_band

    if isinstance(fit, SceneCalibration):
        return scene_band(fit)
    assert isinstance(fit, Calibration)
    return band(fit)


def _numbers(fit: Fit) -> str:
    """Estimates in a line, with prefixes."""
    symbols = dict(zip(UNITS, ("$k$", "$T_0$", "$y_0$"), strict=True))
    words = []
    for name, value in fit.estimates.items():
        sd = fit.sd[name]
        spread = f"{100.0 * sd / abs(value):.2g} %" if value else f"{sd:.2g} {fit.units[name]}".rstrip()
        known = symbols.get(name, name.replace("_", " "))
        words.append(f"{known} = {quantity(value, fit.units[name])} ± {spread}")
    return ",  ".join(words)


def _window(values: np.ndarray) -> tuple[float, float]:
    room = 0.25 * max(float(np.ptp(values)), 0.1 * float(values.max()))
    return max(float(values.min()) - room, 0.0), float(values.max()) + room


def _pair_residuals(fit: Fit, ax: Axes, pressures: np.ndarray, label: str) -> None:
    """Residuals of lengths and pressures in standard deviations, against the pressure."""
    for column, marker, word in (("length", "D", "length"), ("pressure", "o", "pressure")):
        places, values = [], []
        for o, r, p in zip(fit.observations, fit.residuals, pressures, strict=True):
            if o.role(column) == "measured":
                places.append(p)
                values.append(r[1 if column == "pressure" and o.role("length") == "measured" else 0])
        if places:
            filled = ROD if column == "pressure" else "white"
            ax.plot(places, values, marker, color=ROD, markerfacecolor=filled, markersize=4, label=word)
    _frame_residuals(ax, "residual [sd]")
    ax.set_xlim(*_window(pressures))
    ax.set_xlabel(label)
    finish(ax)


def _frame_residuals(ax: Axes, label: str) -> None:
    ax.axhline(0.0, color="0.5", linewidth=0.8)
    ax.axhspan(-BAND, BAND, color="0.5", alpha=0.12, linewidth=0)
    low, high = ax.get_ylim()
    reach = 1.25 * max(abs(low), abs(high), BAND)
    ax.set_ylim(-reach, reach)
    ax.set_ylabel(label)


def plot_shapes(fit: Calibration, ax: Axes) -> Axes:
    """Draw measured points and the fitted shapes through them, the detachment point at x = 0."""
    shapes = [
        (o.points, eq, origin)
        for o, eq, origin in zip(fit.observations, fit.equilibria, fit.origins, strict=True)
        if o.points is not None
    ]
    ax = require_axes(ax)
    unit = length_unit(fit.rod, max(float(np.ptp(eq.x)) for _, eq, _ in shapes))
    for points, eq, origin in shapes:
        ax.plot(eq.x / unit.size, eq.y / unit.size, color=PRESSURE, linewidth=1.6)
        ax.errorbar(
            (points[:, 0] - origin) / unit.size,
            points[:, 1] / unit.size,
            xerr=points[:, 2] / unit.size,
            yerr=points[:, 2] / unit.size,
            fmt="o",
            color=ROD,
            markersize=2.5,
            elinewidth=0.7,
        )
    ax.axhline(0.0, color="0.6", linewidth=1.5)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel(unit.axis("x"))
    ax.set_ylabel(unit.axis("y"))
    ax.set_title("fitted shapes", fontsize=SMALL)
    return ax


def _shape_residuals(fit: Fit, ax: Axes) -> None:
    """Distances of measured points from the fitted shapes, in standard deviations."""
    for o, r in zip(fit.observations, fit.residuals, strict=True):
        if o.points is not None:
            distances = np.linalg.norm(r[len(r) - 2 * len(o.points) :].reshape(-1, 2), axis=1)
            ax.plot(np.arange(1, len(distances) + 1), distances, "o", markersize=3, label=o.name)
    ax.axhspan(0.0, BAND, color="0.5", alpha=0.12, linewidth=0)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("point, from the tip")
    ax.set_ylabel("distance [sd]")
    finish(ax)
