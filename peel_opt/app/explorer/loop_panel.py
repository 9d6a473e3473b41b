"""The hysteresis loop and its sweep: in lambda at fixed beta0, in the pressure for a rod."""

from __future__ import annotations

import numpy as np

from ...analysis.maxwell import TURN
from ...analysis.pressure_loop import folded_area
from ...base.units import digits_left, told_apart
from ...equilibria.branch import Branch
from .curves import Curve
from .diagram_panel import units
from .panels import Axis, Frame, Line, LoopPanel, Mark
from .potential_panel import Landscape
from .state import State

#: Values of the swept number on each way.
SWEEP = 40

CONVENTIONS = {"delay": "delay", "maxwell": "Maxwell"}

#: How far from a fold, relative to it, the sweep shows its last state.
OFF_FOLD = 1e-3

NOT_COMPUTED = "What the rod does within a jump is dynamics and not computed."


def lambda_loop(
    state: State, curve: Curve, found: Landscape, here: tuple[float, float] | None
) -> LoopPanel | str:
    """Return the loop at fixed beta0, or in words why there is none."""
    fold = curve.special("LP-lambda")
    if state.beta0 == 0.0:
        return "At β₀ = 0 the detached state grows out of the straight rod: no jumps, no loop."
    if fold is None:
        mine, last = told_apart(state.beta0, TURN, 5)
        return f"No loop in λ at β₀ = {mine}: the branch has no fold" + (
            f" (above β₀ = {last} none has)." if state.beta0 >= TURN else " that has been met so far."
        )
    if state.convention == "maxwell":
        if "maxwell" not in found.named:
            return "No Maxwell point is known here, hence no loop under that convention."
        up = down = found.named["maxwell"][0]
    else:
        up, down = 0.0, float(curve.lam[fold.row])
    if "delay" not in found.named:
        return "The branch is not known far enough past the fold for a loop."
    order = _lower(curve)
    lam, alpha1 = curve.lam[order], curve.alpha1[order]
    if len(lam) < 2 or lam[-1] <= up:
        return "The branch is not known far enough past the fold for a loop."
    left = min(1.6 * float(curve.lam[fold.row]), -1e-3)
    right = min(float(lam[-1]), 0.9 * abs(left))
    at = np.linspace(left, right, SWEEP)

    def held(values: np.ndarray) -> np.ndarray:
        return np.interp(values, lam, alpha1)

    rising = np.concatenate([at[at < up], [up], [up], at[at > up]])
    falling = np.concatenate([at[at > down][::-1], [down], [down], at[at < down][::-1]])
    n, m = int((at < up).sum()) + 1, int((at > down).sum()) + 1
    a_up = np.concatenate([np.zeros(n), held(rising[n:])])
    a_down = np.concatenate([held(falling[:m]), np.zeros(len(falling) - m)])
    # No solve starts at the fold itself.
    clear = np.maximum(falling, float(curve.lam[fold.row]) * (1.0 - OFF_FOLD))
    frames = [
        *_frames(rising, a_up, np.arange(len(rising)) >= n, rising, a_up, "lower"),
        *_frames(falling, a_down, np.arange(len(falling)) < m, clear, a_down, "lower"),
    ]
    middle = np.flatnonzero(curve.state == "middle")
    lines = (
        Line("between", curve.lam[middle], curve.alpha1[middle], "not visited"),
        Line("up", rising, a_up, "λ rising"),
        Line("down", falling, a_down, "λ falling"),
    )
    marks = (
        Mark("peels-down", "", up, 0.5 * (a_up[n - 1] + a_up[n]), f"peels off at λ = {up:.4g}"),
        Mark("readheres-up", "", down, 0.5 * a_down[m - 1], f"re-adheres at λ = {down:.4g}"),
    )
    if found.source.startswith("normal form"):
        # Not the branch that is drawn: the area under that, as far as a polyline knows it.
        inside = np.linspace(down, up, 201)
        area = f"about {abs(np.trapezoid(held(inside), inside)):.2g}"
    elif up > down:
        size, error = found.potential.area(found.named["fold"].alpha1, found.named["delay"].alpha1)
        area = f"{size:.{digits_left(size, error, 5)}g}"
    else:
        area = "0"
    note = (
        NOT_COMPUTED
        if up > down
        else "Under the Maxwell convention both ways are the same path. " + NOT_COMPUTED
    )
    values = np.concatenate([a_up, a_down])
    return LoopPanel(
        Axis("λ = β₁ − π⁴", *_room(at)),
        Axis("extra pressure α₁", *_room(values)),
        lines,
        marks,
        tuple(frames),
        "lam",
        here,
        f"{CONVENTIONS[state.convention]}, area {area}",
        note,
    )


def pressure_loop(state: State, curve: Curve, here: tuple[float, float] | None) -> LoopPanel | str:
    """Return the loop of a rod under a pressure, or in words why there is none."""
    rod = state.rod
    assert rod is not None
    turn, end = curve.special("LP-pressure"), curve.special("contact")
    if state.law == "linear":
        return "A rod's loop needs law (8): under the linear law its branch may have no minimum pressure."
    if turn is None or end is None:
        return "The loop needs the branch up to contact; it has not been walked that far yet."
    length, across, pressure, up_label = units(state)
    P, sigma = curve.pressure_ratio[turn.row :], curve.length_ratio[turn.row :]
    low = float(P[0])
    at = low ** (1.0 - np.linspace(0.0, 1.0, SWEEP) ** 2)  # closer together where the length turns
    folded = np.interp(at, P, sigma)
    below = np.linspace(0.4 * low, low, max(SWEEP // 4, 2))
    rising = np.concatenate([below, at, [1.0]])
    s_up = np.concatenate([np.zeros(len(rising) - 1), folded[-1:]])
    falling = np.concatenate([at[::-1], below[::-1]])
    s_down = np.concatenate([folded[::-1], np.zeros(len(below))])
    p_unit, s_unit = rod.adhesion_strength, rod.eta

    def drawn(p: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return p * p_unit / pressure, s * s_unit / length

    # No solve starts at the ends, contact and the minimum pressure.
    detached_up = np.arange(len(rising)) == len(rising) - 1
    detached_down = np.arange(len(falling)) < len(at)
    ends = low * (1.0 + OFF_FOLD), 1.0 - OFF_FOLD * (1.0 - low)
    frames = [
        *_frames(
            *drawn(rising, s_up), detached_up, np.clip(rising, 0.0, ends[1]) * p_unit, s_up * s_unit, "folded"
        ),
        *_frames(
            *drawn(falling, s_down),
            detached_down,
            np.where(detached_down, np.clip(falling, *ends), falling) * p_unit,
            s_down * s_unit,
            "folded",
        ),
    ]
    jumps = drawn(np.array([1.0, low]), 0.5 * np.array([folded[-1], folded[0]]))
    marks = (
        Mark("peels-up", "", float(jumps[0][0]), float(jumps[1][0]), "peels off at p = T₀"),
        Mark("readheres-down", "", float(jumps[0][1]), float(jumps[1][1]), f"re-adheres at p/T₀ = {low:.4g}"),
    )
    note = NOT_COMPUTED
    if state.convention == "maxwell":
        note = "A rod under a pressure has the delay convention only. " + note
    x_up, y_up = drawn(rising, s_up)
    x_down, y_down = drawn(falling, s_down)
    if isinstance(curve.origin, Branch):
        size, error = folded_area(curve.origin, turn.row)
        area = f"{size:.{digits_left(size, error, 5)}g}"
    else:
        area = f"about {abs(np.trapezoid(sigma, P)):.2g}"
    return LoopPanel(
        Axis(up_label, *_room(np.concatenate([x_up, x_down, [0.0]]))),
        Axis(across, *_room(np.concatenate([y_up, y_down]))),
        (
            Line(
                "between",
                *drawn(curve.pressure_ratio[: turn.row + 1], curve.length_ratio[: turn.row + 1]),
                "not visited",
            ),
            Line("up", x_up, y_up, "p rising"),
            Line("down", x_down, y_down, "p falling"),
        ),
        marks,
        tuple(frames),
        "pressure",
        here,
        f"delay, area {area} T₀ η",
        note,
    )


def _lower(curve: Curve) -> np.ndarray:
    """Rows of the lower branch from the fold on, by rising lambda."""
    rows = np.flatnonzero(curve.state == "lower")
    fold = curve.special("LP-lambda")
    assert fold is not None
    rows = np.unique([fold.row, *rows])
    order = rows[np.argsort(curve.lam[rows], kind="stable")]
    return order


def _frames(
    x: np.ndarray, y: np.ndarray, detached: np.ndarray, value: np.ndarray, near: np.ndarray, label: str
) -> list[Frame]:
    return [
        Frame(float(a), float(b), float(v), float(n) if d else None, label if d else "adhered")
        for a, b, d, v, n in zip(x, y, detached, value, near, strict=True)
    ]


def _room(values: np.ndarray) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    pad = 0.06 * (high - low or 1.0)
    return low - pad, high + pad
