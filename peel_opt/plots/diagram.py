"""Branches as diagrams: any two of their columns, with stability, special points and spurious parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.errors import InvalidInput
from ..equilibria.branch import Branch
from ..equilibria.branch_parts import SpecialPoint
from ..model.labels import special_kind
from . import style
from .axes import axes_or
from .dispatch import draw
from .frame import add_legend
from .words import AxisUnit, length_unit, pressure_unit, typeset

#: What can be drawn, and how it is written on an axis.  Those in `_LENGTHS` and `_PRESSURES`
#: have the rod's units.
LABELS = {
    "lam": r"$\lambda$",
    "alpha1": r"$\alpha_1$",
    "alpha": r"$\alpha$",
    "beta0": r"$\beta_0$",
    "beta1": r"$\beta_1$",
    "pressure_ratio": r"$p/T_0$",
    "length_ratio": r"$\bar s/\eta$",
    "ratio": r"$\eta/y_0$",
    "tip_angle": r"tip angle $\theta(0)$ [rad]",
    "tip_height": r"$y_\mathrm{tip}$",
    "pressure": "$p$",
    "length": r"$\bar s$",
    "arclength": "length along the branch",
    "error": "estimated error",
    "certificate": "certificate",
    "iterations": "Newton iterations",
    "index": "unstable directions",
}
_LENGTHS, _PRESSURES = ("length", "tip_height"), ("pressure",)


#: Marker and colour of special points by their kind, and those of all others.
MARKERS = {
    "BP": ("o", style.ROD),
    "LP-lambda": ("s", style.PRESSURE),
    "LP-length": ("s", style.PRESSURE),
    "LP-pressure": ("D", style.WARNING),
    "y=y0": ("^", style.RANGE),
    "contact": ("X", style.ROD),
}
_OTHER = ("v", style.ROD)

BRANCH, SPURIOUS, STRAIGHT = style.ADHESION, "#ADADAD", "#6E6E6E"
DASHES = (0, (4.0, 1.8))
_LETTER_GAP = 8.0  # points
#: How far along the curve its bend is looked at, in sizes of the picture.
_LOOK = 0.04


@draw.register
def _draw_branch(
    branch: Branch, ax: Axes | None = None, x: str | None = None, y: str | None = None, *, legend: bool = True
) -> Axes:
    """Draw a branch as `plot_branch` does, its stability computed."""
    return plot_branch(branch.with_stability(), ax, x, y, legend=legend)


def plot_branch(
    branch: Branch,
    ax: Axes | None = None,
    x: str | None = None,
    y: str | None = None,
    *,
    legend: bool = True,
) -> Axes:
    """Draw a branch as a curve in the plane of two of its columns.

    Stable parts are solid and unstable ones dashed where the index of the branch is known;
    otherwise all is solid.  Spurious parts are grey.  Special points have a marker for their
    kind and a letter, numbered along the branch where there are several of a letter.

    Parameters
    ----------
    branch : Branch
    ax : Axes, optional
        Without it a figure is made that needs no display.
    x, y : str, optional
        Names of columns, such as "length_ratio"; by default (lam, alpha1), with the straight
        rod, at fixed beta0, and (length, pressure) for a rod.
    legend : bool, optional
        Whether to explain lines and markers.

    Returns
    -------
    Axes

    Raises
    ------
    InvalidInput
        If the branch is empty, or a column has no such name or no finite value.
    """
    if not len(branch):
        raise InvalidInput("this branch has no points to draw.")
    if branch.arclength[0] > branch.arclength[-1]:
        # In one direction always, so that dashes and numbers do not depend on how it was walked.
        branch = branch[::-1]
    default = ("lam", "alpha1") if branch.rod is None else ("length", "pressure")
    names = (x or default[0], y or default[1])
    units = [_unit(branch, name) for name in names]
    across, up = (_column(branch, name) / unit.size for name, unit in zip(names, units, strict=True))
    ax = axes_or(ax, _own_axes)
    if names == ("lam", "alpha1") and branch.trivial is not None:
        _draw_straight(ax, branch)
    for rows, stable, spurious in _runs(branch):
        (line,) = ax.plot(
            across[rows],
            up[rows],
            color=SPURIOUS if spurious else BRANCH,
            linewidth=1.4 if spurious else 2.0,
            linestyle=DASHES if stable is False else "-",
            dash_capstyle="butt",
            label=_unique(ax, _words(stable, spurious)),
            zorder=2 if spurious else 3,
        )
        line.set_gid("spurious" if spurious else "branch")
    _mark_points(ax, branch, across, up)
    ax.set_xlabel(_axis(names[0], units[0]))
    ax.set_ylabel(_axis(names[1], units[1]))
    ax.spines[["top", "right"]].set_visible(False)
    ax.margins(0.08)
    if legend:
        add_legend(ax, columns=2)
    return ax


def _letters(points: list[SpecialPoint]) -> list[str]:
    letters = [special_kind(point.kind).letter for point in points]
    total, seen = Counter(letters), Counter[str]()
    named = []
    for letter in letters:
        seen[letter] += 1
        named.append(f"{letter}$_{seen[letter]}$" if total[letter] > 1 else letter)
    return named


def _unit(branch: Branch, name: str) -> AxisUnit:
    if name not in LABELS:
        raise InvalidInput(f"a branch has no column {name!r}.", remedy=f"Choose one of {', '.join(LABELS)}.")
    values = _column(branch, name)
    if name in _LENGTHS and branch.rod is not None:
        return length_unit(branch.rod, float(np.nanmax(np.abs(values))))
    if name in _PRESSURES and branch.rod is not None:
        return pressure_unit(branch.rod, float(np.nanmax(np.abs(values))))
    if name in _LENGTHS:
        return AxisUnit(1.0, "y_0" if name == "tip_height" else r"\eta", is_symbol=True)
    return AxisUnit(1.0, "")


def _column(branch: Branch, name: str) -> np.ndarray:
    values = getattr(branch, name)
    if values is None or not np.isfinite(np.asarray(values, float)).any():
        why = "has not been computed" if values is None else "has no finite value"
        raise InvalidInput(
            f"{name} {why} on this branch.", remedy="Draw other columns, such as lam and alpha1."
        )
    return np.asarray(values, float)


def _axis(name: str, unit: AxisUnit) -> str:
    label = LABELS[name]
    if name == "pressure" and not unit.name:
        return LABELS["alpha"]
    return unit.axis(label.strip("$")) if unit.name else label


def _own_axes() -> Axes:
    """Return axes in a figure of their own; pyplot never knows it."""
    axes: Axes = Figure(figsize=(6.4, 4.8), layout="constrained").add_subplot()
    return axes


def _runs(branch: Branch) -> Iterator[tuple[np.ndarray, bool | None, bool]]:
    """Pieces of one look: their rows, whether they are stable (None if unknown) and spurious.

    A stretch between two points that differ takes the look of the one that is no special
    point, since there the look changes.
    """
    special = {p.index for p in branch.special_points}
    unstable = branch.unstable
    spurious = branch.spurious

    def look(i: int, j: int) -> tuple[bool | None, bool]:
        decisive = [k for k in (i, j) if k not in special] or [i, j]
        stable = None if unstable is None else not unstable[decisive].any()
        return stable, bool(spurious[decisive].any())

    for piece in branch.pieces:
        rows = np.arange(len(branch))[piece]
        if len(rows) == 1:
            yield rows, *look(rows[0], rows[0])
            continue
        looks = [look(i, j) for i, j in pairwise(rows.tolist())]
        cuts = [0, *(k for k in range(1, len(looks)) if looks[k] != looks[k - 1]), len(looks)]
        for a, b in pairwise(cuts):
            yield rows[a : b + 1], *looks[a]


def _words(stable: bool | None, spurious: bool) -> str:
    name = "spurious, $y < 0$" if spurious else "detached"
    return name + {None: "", True: ", stable at fixed $p$", False: ", unstable at fixed $p$"}[stable]


def _unique(ax: Axes, label: str) -> str:
    """Return a label, hidden from the legend where it is in it already."""
    return f"_{label}" if label in ax.get_legend_handles_labels()[1] else label


def _draw_straight(ax: Axes, branch: Branch) -> None:
    assert branch.trivial is not None
    lam = branch.trivial.lam
    (line,) = ax.plot(
        lam, branch.trivial.alpha1, color=STRAIGHT, linewidth=1.2, label=_unique(ax, "straight rod"), zorder=1
    )
    line.set_gid("straight")
    on_branch = [p.lam for p in branch.special("BP")]
    for point in branch.trivial.special_points:
        # T itself is marked with the branch.
        if all(abs(point.lam - lam) > 1e-6 * (1.0 + abs(lam)) for lam in on_branch):
            _draw_mark(ax, "BP", point.lam, 0.0)


def _mark_points(ax: Axes, branch: Branch, across: np.ndarray, up: np.ndarray) -> None:
    points = sorted(branch.special_points, key=lambda p: p.index)
    for point, letter in zip(points, _letters(points), strict=True):
        i = point.index
        if not np.isfinite([across[i], up[i]]).all():
            continue
        _draw_mark(ax, point.kind, across[i], up[i])
        dx, dy = _outward(across, up, i)
        text = ax.annotate(
            letter,
            xy=(across[i], up[i]),
            xytext=(_LETTER_GAP * dx, _LETTER_GAP * dy),
            textcoords="offset points",
            ha="center" if abs(dx) < 0.4 else ("left" if dx > 0 else "right"),
            va="center" if abs(dy) < 0.4 else ("bottom" if dy > 0 else "top"),
            fontsize=style.SMALL + 1.0,
            color=MARKERS.get(point.kind, _OTHER)[1],
            zorder=7,
        )
        text.set_gid(f"letter:{point.kind}")


def _draw_mark(ax: Axes, kind: str, x: float, y: float) -> None:
    (letter, words), (marker, colour) = special_kind(kind), MARKERS.get(kind, _OTHER)
    (drawn,) = ax.plot(
        [x],
        [y],
        linestyle="none",
        marker=marker,
        markersize=6.0,
        markerfacecolor="white" if marker == "o" else colour,
        markeredgecolor=colour if marker == "o" else "white",
        markeredgewidth=1.3 if marker == "o" else 0.6,
        label=_unique(ax, f"{letter}: {typeset(words)}"),
        zorder=6,
        clip_on=False,
    )
    drawn.set_gid(f"mark:{letter}")


def _outward(across: np.ndarray, up: np.ndarray, i: int) -> tuple[float, float]:
    """Unit vector, as the eye sees it, to the outer side of the bend at a point.

    At the end of the branch it goes on in its direction; where there is no bend, to the upper left.
    """
    finite = np.flatnonzero(np.isfinite(across) & np.isfinite(up))
    size = [np.ptp(v[finite]) or 1.0 for v in (across, up)]
    seen = np.column_stack([across[finite] / size[0], up[finite] / size[1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(seen, axis=0).T))])
    here = along[np.searchsorted(finite, i)]

    def at(distance: float) -> np.ndarray:
        return np.array([np.interp(here + distance, along, v) for v in seen.T])

    ahead, back = at(_LOOK) - at(0.0), at(-_LOOK) - at(0.0)
    if not ahead.any() or not back.any():
        away = -(ahead + back)
    else:
        tangent = ahead - back
        away = np.array([-tangent[1], tangent[0]])
        bend = float(away @ (ahead + back))
        outer = -bend if abs(bend) > 0.02 * float(away @ away) else away[1] - 0.5 * away[0]
        away = away * (1.0 if outer >= 0.0 else -1.0)
    length = float(np.hypot(*away))
    return (float(away[0] / length), float(away[1] / length)) if length else (0.7, 0.7)
