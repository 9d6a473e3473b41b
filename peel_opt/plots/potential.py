"""The effective potential (35) at one beta0, at several values of lambda: Fig 7."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from ..analysis.potential import EffectivePotential, Level
from ..base.units import digits_left
from .mpl import draw_panel
from .panels import Axis, Line, Mark, Panel

#: Points of a curve.
_POINTS = 321

#: The landing of the delay is in the picture unless it is this many times deeper than all else.
_DEEPEST = 3.0

#: Letters of the three values of lambda, their names in a legend, and what they mean.
NAMED = {
    "fold": ("F", "fold", "fold: the detached minimum appears"),
    "maxwell": ("M", "Maxwell", "Maxwell: both minima are equally deep"),
    "delay": ("D", "delay", r"delay: the adhered minimum is lost at $\lambda = 0$"),
}


def plot_potential(
    potential: EffectivePotential, lam: Sequence[float] | None = None, ax: Axes | None = None
) -> Axes:
    """Draw U_e(alpha1) at some values of lambda with its critical points marked, as in Fig 7.

    Parameters
    ----------
    potential : EffectivePotential
        Such as ``NormalForm.paper().at(4.0)``.
    lam : sequence of float, optional
        Default: below the fold, at the fold, at the Maxwell point, and towards zero from there;
        at beta0 = 4 they are those of Fig 7, -0.4, lambda_F, lambda_M and -0.1.
    ax : Axes, optional
        Without it a figure is made that needs no display.

    Returns
    -------
    Axes
    """
    return draw_panel(family_panel(potential, lam), ax, height=4.4)


def family_panel(potential: EffectivePotential, lam: Sequence[float] | None = None) -> Panel:
    """Return the picture of a potential at some values of lambda: see `plot_potential`."""
    values = _values(potential) if lam is None else [(float(value), f"{value:.4g}") for value in lam]
    lowest = min(float(x) for value, _ in values for x in [0.0, *potential.alpha1(value)])
    span = max(-lowest, 1e-3)
    x = _places(potential, -1.22 * span, 0.32 * span)
    lines, marks, listed = [Line("zero", x[[0, -1]], np.zeros(2))], [], set[str]()
    for i, (value, name) in enumerate(values):
        look = f"curve {i}/{len(values)}"
        lines.append(Line(look, x, potential(x, value), rf"$\lambda = {name}$"))
        for point in potential.critical_points(value):
            marks.append(
                Mark(
                    point.kind,
                    point.alpha1,
                    point.potential,
                    point.kind,
                    of=look,
                    listed=point.kind not in listed,
                )
            )
            listed.add(point.kind)
    heights = [mark.y for mark in marks]
    low, high = _heights(heights, 0.45, 0.75)
    title = rf"$\beta_0 = {potential.beta0:g}$"
    return _panel(x, low, high, lines, marks, title=title)


def named_panel(
    potential: EffectivePotential,
    lam: float,
    named: Mapping[str, Level],
    alpha1: float | None = None,
) -> Panel:
    """Return the picture of a potential at ``lam`` and at those of fold, Maxwell point and delay.

    Parameters
    ----------
    potential : EffectivePotential
    lam : float
    named : mapping
        Of "fold", "maxwell" and "delay", those that are known.
    alpha1 : float, optional
        Where the state is.
    """
    roots = [x for x in (0.0, *potential.alpha1(lam)) if np.isfinite(x)]
    ends = [*roots, *(level.alpha1 for level in named.values()), *([] if alpha1 is None else [alpha1])]
    span = max(max(ends) - min(ends), 1e-3)
    x = _places(potential, min(ends) - 0.22 * span, max(ends) + 0.3 * span)
    lines = [
        Line(name, x, potential(x, level.lam), f"{NAMED[name][1]} {_digits(level)}".rstrip())
        for name, level in named.items()
    ]
    lines.append(Line("current", x, potential(x, lam), rf"$\lambda = {lam:.4g}$"))
    here = None
    heights = [0.0, *(float(potential(v, lam)) for v in roots if v <= 0.0)]
    if alpha1 is not None and potential.domain[0] <= alpha1 <= potential.domain[1]:
        here = (alpha1, float(potential(alpha1, lam)))
        heights.append(here[1])
    points = {name: float(potential(level.alpha1, level.lam)) for name, level in named.items()}
    heights += [y for name, y in points.items() if name != "delay"]
    if "delay" in points and abs(points["delay"]) < _DEEPEST * np.ptp(heights):
        heights.append(points["delay"])
    low, high = _heights(heights, 0.3, 0.45)
    marks = []
    for name, y in points.items():
        letter, _, meaning = NAMED[name]
        # The landing of the delay may be far below the wells that are looked at.
        letter, shown = (letter, y) if y >= low else (f"{letter}↓", low + 0.04 * (high - low))
        marks.append(Mark(name, named[name].alpha1, shown, meaning, letter))
    return _panel(x, low, high, lines, marks, here=here)


def _panel(
    x: np.ndarray,
    low: float,
    high: float,
    lines: list[Line],
    marks: list[Mark],
    *,
    title: str = "",
    here: tuple[float, float] | None = None,
) -> Panel:
    return Panel(
        Axis(r"extra pressure $\alpha_1$", float(x[0]), float(x[-1])),
        Axis("effective potential $U_e$", low, high),
        tuple(lines),
        tuple(marks),
        title=title,
        here=here,
    )


def _places(potential: EffectivePotential, low: float, high: float) -> np.ndarray:
    """Extra pressures of a curve, where the potential is known."""
    return np.linspace(max(low, potential.domain[0]), min(high, potential.domain[1]), _POINTS)


def _heights(values: list[float], below: float, above: float) -> tuple[float, float]:
    """Range of heights, with room in shares of its size."""
    size = max(max(values) - min(values), 1e-12)
    return min(values) - below * size, max(values) + above * size


def _values(potential: EffectivePotential) -> list[tuple[float, str]]:
    """The four values of Fig 7, in units of the fold's, with the names of the two that have one."""
    fold, maxwell = potential.fold()[0], potential.maxwell()[0]
    if potential.beta0 == 0.0:
        return [(value, f"{value:g}") for value in (-0.4, 0.0, 0.4)]
    scale = (potential.beta0 / 4.0) ** 2
    low, high = -0.4 * scale, -0.1 * scale
    return [
        (low, f"{low:.4g}"),
        (fold, rf"\lambda_F = {fold:.4g}"),
        (maxwell, rf"\lambda_M = {maxwell:.4g}"),
        (high, f"{high:.4g}"),
    ]


def _digits(level: Level) -> str:
    """A named lambda to the digits that its error leaves, four at most; nothing where it is 0."""
    if not level.lam:
        return ""
    return f"{level.lam:.{digits_left(level.lam, level.error, 4)}g}"
