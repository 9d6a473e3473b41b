"""Branches as diagrams: any two of their columns, with stability, special points and spurious parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes

from ..base.errors import InvalidInput
from ..equilibria.branch import Branch
from ..equilibria.branch_parts import Trivial
from ..model.labels import special_kind
from .dispatch import drawn_by
from .mpl import draw_panel
from .panels import Axis, Line, Mark, Panel, room
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


#: What is said before the symbol of some of them.
WORDS = {"lam": "", "alpha1": "extra pressure", "length": "detached length", "pressure": "pressure"}

#: Readings of stability, as `diagram_panel` takes them.
AT_PRESSURE, AT_LENGTH = "at fixed $p$", r"at fixed $\bar s$, by the potential (35)"

#: How far along the curve its bend is looked at, in sizes of the picture.
_LOOK = 0.04

#: Decades that a branch spans along an axis that is made logarithmic.
DECADES = 2

#: Room around a branch, as a share of it.
_MARGIN = 0.1


@drawn_by.register
def _draw_branch(
    branch: Branch,
    ax: Axes | None = None,
    x: str | None = None,
    y: str | None = None,
    *,
    log: bool | None = None,
) -> Axes:
    """Draw a branch as `plot_branch` does, its stability computed."""
    return plot_branch(branch.with_stability(), ax, x, y, log=log)


def plot_branch(
    branch: Branch,
    ax: Axes | None = None,
    x: str | None = None,
    y: str | None = None,
    *,
    legend: bool = True,
    log: bool | None = None,
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
    log : bool, optional
        Whether both axes are logarithmic.  Default: each along which all values are positive and
        span `DECADES` decades or more.

    Returns
    -------
    Axes

    Raises
    ------
    InvalidInput
        If the branch is empty, a column has no such name or no finite value, or there is no
        logarithm of some.
    """
    panel = diagram_panel(branch, x, y)
    return draw_panel(_with_scales(panel, log), ax, legend=legend)


def _with_scales(panel: Panel, log: bool | None) -> Panel:
    """Return a picture with logarithmic axes where these are wanted, or worth it."""

    def scaled(axis: Axis, side: str) -> Axis:
        values = np.concatenate([getattr(line, side) for line in panel.lines])
        values = values[np.isfinite(values)]
        low, high = float(values.min()), float(values.max())
        if log and low <= 0.0:
            raise InvalidInput(
                f"{axis.label} goes down to {low:.4g}, of which there is no logarithm.",
                remedy="Leave log= out, or choose other columns.",
            )
        wide = low > 0.0 and high >= 10.0**DECADES * low
        if not (wide if log is None else log):
            return axis
        pad = (high / low) ** _MARGIN
        return Axis(axis.label, low / pad, high * pad, log=True)

    return replace(panel, x=scaled(panel.x, "x"), y=scaled(panel.y, "y"))


def diagram_panel(
    branch: Branch,
    x: str | None = None,
    y: str | None = None,
    *,
    stable: Sequence[bool | None] | None = None,
    reading: str = AT_PRESSURE,
) -> Panel:
    """Return the picture of a branch: see `plot_branch`.

    Parameters
    ----------
    branch : Branch
    x, y : str, optional
    stable : sequence of bool or None, optional
        Whether each point is stable, None where that is not known; by default as the branch says.
    reading : str
        Under which control.

    Returns
    -------
    Panel

    Raises
    ------
    InvalidInput
        If the branch is empty, or a column has no such name or no finite value.
    """
    if not len(branch):
        raise InvalidInput("this branch has no points to draw.")
    if stable is None:
        unstable = branch.unstable
        stable = [None] * len(branch) if unstable is None else [not u for u in unstable.tolist()]
    if branch.arclength[0] > branch.arclength[-1]:
        # In one direction always, so that dashes and numbers do not depend on how it was walked.
        branch, stable = branch[::-1], stable[::-1]
    names, units = _axes(branch, x, y)
    across, up = coordinates(branch, x, y)
    trivial = branch.trivial if names == ("lam", "alpha1") else None
    lines = [] if trivial is None else [*_straight(trivial, reading)]
    for rows, is_stable, spurious in _runs(branch, stable):
        look, label, full = _look(stable, is_stable, spurious, reading)
        lines.append(Line(look, across[rows], up[rows], label, full))
    marks = [] if trivial is None else [*_other_transitions(branch, trivial)]
    return Panel(
        Axis(_axis(names[0], units[0]), *room(np.concatenate([line.x for line in lines]), _MARGIN)),
        Axis(_axis(names[1], units[1]), *room(np.concatenate([line.y for line in lines]), _MARGIN)),
        tuple(lines),
        (*marks, *_marks(branch, across, up)),
    )


def coordinates(branch: Branch, x: str | None = None, y: str | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return where the points of a branch are in its picture."""
    across, up = (_column(branch, name) / unit.size for name, unit in zip(*_axes(branch, x, y), strict=True))
    return across, up


def place(branch: Branch, x: float, y: float) -> tuple[float, float]:
    """Return where (x, y), values of the usual columns, are in the picture of a branch."""
    across, up = _axes(branch, None, None)[1]
    return x / across.size, y / up.size


def _axes(branch: Branch, x: str | None, y: str | None) -> tuple[tuple[str, str], list[AxisUnit]]:
    default = ("lam", "alpha1") if branch.rod is None else ("length", "pressure")
    names = (x or default[0], y or default[1])
    return names, [_unit(branch, name) for name in names]


def _numbers(letters: list[str]) -> list[int]:
    """Count the points of each letter; 0 where there is one only."""
    total, seen = Counter(letters), Counter[str]()
    numbers = []
    for letter in letters:
        seen[letter] += 1
        numbers.append(seen[letter] if total[letter] > 1 else 0)
    return numbers


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
    symbol = unit.axis(label.strip("$")) if unit.name else label
    return f"{WORDS.get(name, '')} {symbol}".lstrip()


def _runs(branch: Branch, stable: Sequence[bool | None]) -> Iterator[tuple[np.ndarray, bool | None, bool]]:
    """Pieces of one look: their rows, whether they are stable (None if unknown) and spurious.

    A stretch between two points that differ takes the look of the one that is no special
    point, since there the look changes.
    """
    special = {p.index for p in branch.special_points}
    spurious = branch.spurious

    def look(i: int, j: int) -> tuple[bool | None, bool]:
        decisive = [k for k in (i, j) if k not in special] or [i, j]
        known = [stable[k] for k in decisive]
        return None if None in known else all(known), bool(spurious[decisive].any())

    for piece in branch.pieces:
        rows = np.arange(len(branch))[piece]
        if len(rows) == 1:
            yield rows, *look(rows[0], rows[0])
            continue
        looks = [look(i, j) for i, j in pairwise(rows.tolist())]
        cuts = [0, *(k for k in range(1, len(looks)) if looks[k] != looks[k - 1]), len(looks)]
        for a, b in pairwise(cuts):
            yield rows[a : b + 1], *looks[a]


def _look(
    known: Sequence[bool | None], stable: bool | None, spurious: bool, reading: str
) -> tuple[str, str, str]:
    """Look, label and full label of a piece."""
    word = {None: "", True: "stable", False: "unstable"}[stable]
    if spurious:
        name = "spurious, $y < 0$"
        return (f"spurious-{word}", name, f"{name}, {word} {reading}") if word else ("spurious", name, name)
    if word:
        return word, word, f"detached, {word} {reading}"
    if any(each is not None for each in known):
        return "unknown", "not computed", "detached, stability not computed"
    return "branch", "detached", "detached"


def _straight(trivial: Trivial, reading: str) -> Iterator[Line]:
    """The straight rod; at fixed length it is stable up to T."""
    label = "straight rod"
    if reading == AT_PRESSURE:
        yield Line("straight", trivial.lam, trivial.alpha1, label)
        return
    ends = float(trivial.lam.min()), float(trivial.lam.max())
    for look, low, high in (
        ("straight", ends[0], min(ends[1], 0.0)),
        ("straight-unstable", max(ends[0], 0.0), ends[1]),
    ):
        if low < high:
            yield Line(look, np.array([low, high]), np.zeros(2), label if look == "straight" else "")


def _other_transitions(branch: Branch, trivial: Trivial) -> Iterator[Mark]:
    """Where other branches leave the straight rod; T itself is marked with the branch."""
    on_branch = [p.lam for p in branch.special("BP")]
    for point in trivial.special_points:
        if all(abs(point.lam - lam) > 1e-6 * (1.0 + abs(lam)) for lam in on_branch):
            letter, words = special_kind("BP")
            yield Mark("BP", point.lam, 0.0, words, letter, away=(-0.4, 0.9))


def _marks(branch: Branch, across: np.ndarray, up: np.ndarray) -> Iterator[Mark]:
    points = sorted(branch.special_points, key=lambda p: p.index)
    named = [special_kind(point.kind) for point in points]
    for point, (letter, words), number in zip(points, named, _numbers([n for n, _ in named]), strict=True):
        i = point.index
        if np.isfinite([across[i], up[i]]).all():
            yield Mark(
                point.kind,
                float(across[i]),
                float(up[i]),
                typeset(words),
                letter,
                number,
                _outward(across, up, i),
            )


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
