"""Figure 3: the three kinds of solution of the linear law: shapes, forces, and what of the law acts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...equilibria.ask import equilibrium, pressure_given_length
from ...equilibria.result import Equilibrium
from ...model.bond import COHESIVE, LINEAR
from ...model.rod import Rod
from .. import plot_equilibrium, style
from . import look

BETA0 = 4.0


@dataclass(frozen=True)
class Row:
    """A row of the figure.

    Parameters
    ----------
    lam : lambda at beta0 = 4
    state : its state there
    verdict : what it is worth
    """

    lam: float
    state: str
    verdict: str


KINDS = (
    Row(-0.24, "lower", "acceptable: $0 \\leq y \\leq y_0$"),
    Row(0.25, "lower", "not physical: $y > y_0$ near the tip"),
    Row(0.25, "spurious", "not physical: $y < 0$"),
)


def figure_3(points: int = 200) -> Figure:
    """One solved state of each kind: its shape with the forces, and the stretch of the law it uses."""
    figure = look.new_figure(9.0, 9.6)
    rows = figure.subplots(3, 2, width_ratios=(1.65, 1.0))
    for i, (kind, (left, right)) in enumerate(zip(KINDS, rows, strict=True)):
        eq = solved(kind)
        plot_equilibrium(eq, left, legend=False)
        left.set_anchor("W")
        drawn = f"({'ace'[i]})  {kind.verdict}{_magnified(left)}"
        left.set_title(f"{drawn}\n{_numbers(eq)}", loc="left", fontsize=look.SMALL)
        for note in left.texts:
            if note.get_gid() == "flags":
                note.remove()  # the title says it
        _law(right, eq, points, f"({'bdf'[i]})")
    _explain(rows)
    look.footnote(
        figure,
        rf"Linear law at $\beta_0 = {BETA0:g}$.  Under law (8) a rod like (c), of the same length, has"
        f" $p/T_0 = {under_law_8(solved(KINDS[1])):.6f}$;\nlike (e) there is none, since the plate is rigid.",
    )
    return figure


def solved(kind: Row) -> Equilibrium:
    """Return the equilibrium of a row."""
    return equilibrium(beta0=BETA0, lam=kind.lam, state=kind.state)


def under_law_8(eq: Equilibrium) -> float:
    """Return p/T0 of a rod with the same groups under law (8)."""
    return pressure_given_length(Rod.from_ratio(eq.ratio), eq.length_ratio).pressure_ratio


def _numbers(eq: Equilibrium) -> str:
    tip = eq.y[0] * eq.beta1 / eq.beta0
    return (
        rf"$\lambda = {eq.lam:g}$, $\alpha_1 = {eq.alpha1:.6f}$, $p/T_0 = {eq.pressure_ratio:.6f}$,"
        rf" $y_\mathrm{{tip}}/y_0 = {tip:.6f}$"
    )


def _magnified(ax: Axes) -> str:
    """Say how much longer than adhesion of the same size the pressure of a panel is drawn, if it is."""
    (name,) = (n for n in ax.get_legend_handles_labels()[1] if n.startswith("pressure"))
    scale = name.split("$")[-1]
    return f"; pressure{scale}" if scale else ""


def _law(ax: Axes, eq: Equilibrium, points: int, letter: str) -> None:
    """Adhesive force against height: the linear law, law (8), and what the state uses of it."""
    u = np.linspace(-0.75, 2.1, points)
    ax.plot(
        u, [-LINEAR.traction(v) for v in u], color=style.PLATE, linewidth=1.2, label="linear law, Fig. 2b"
    )
    positive = u[u > 0.0]
    ax.plot(
        positive,
        [-COHESIVE.traction(v) for v in positive],
        color=style.ROD,
        linewidth=1.0,
        linestyle=":",
        label="law (8), $y > 0$",
    )
    heights = eq.y * eq.beta1 / eq.beta0
    used = np.linspace(float(heights.min()), float(heights.max()), points)
    force = np.array([-LINEAR.traction(v) for v in used])
    pulls = (used > -1e-9) & (used < 1.0 + 1e-9)
    for where, colour, name, dashes in (
        (pulls, style.ADHESION, "in use", "-"),
        (~pulls, style.WARNING, "in use, not physical", (0, (1.6, 0.8))),
    ):
        if where.any():
            ax.plot(
                used,
                np.where(where, force, np.nan),
                color=colour,
                linewidth=4.0,
                linestyle=dashes,
                label=name,
            )
    ax.plot(
        heights[0], -LINEAR.traction(float(heights[0])), "o", color="white", markeredgecolor="black", zorder=6
    )
    ax.axhline(0.0, color=style.PLATE, linewidth=0.7, zorder=0)
    ax.axvline(0.0, color=style.PLATE, linewidth=0.7, zorder=0)
    ax.set_xlim(-0.75, 2.1)
    look.tidy(ax, "$y/y_0$", "$f/T_0$", letter)


def _explain(rows: np.ndarray) -> None:
    """Explain the arrows under the left panels and the lines under the right ones, each kind once."""
    for column in (0, 1):
        found = {
            name.split(" (arrows")[0]: handle
            for ax in rows[:, column]
            for handle, name in zip(*ax.get_legend_handles_labels(), strict=True)
        }
        look.legend(
            rows[2][column],
            handles=list(found.values()),
            labels=list(found),
            loc="upper left",
            bbox_to_anchor=(0.0, -0.28),
            ncol=2 if column == 0 else 1,
        )
