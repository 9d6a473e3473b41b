"""Figures 4, 5 and 6: extra pressure against lambda at fixed beta0."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...analysis.normal_form import NormalForm
from ...equilibria.branch import Branch
from ...equilibria.result import Equilibrium
from ...equilibria.trace import trace
from .. import style
from . import look

LAM, ALPHA1 = r"$\lambda = \beta_1 - \pi^4$", r"$\alpha_1$"
DIFFERENCE = r"$\lambda$ of (33) $-\ \lambda$"

#: Blue, orange and green as in the paper, in shades that colour-blind readers can tell apart.
FIGURE_4_COLOURS = {0.0: "#0072B2", 2.0: "#E69F00", 4.0: "#009E73"}

#: Lines that tell them apart in grey.
FIGURE_4_LINES: dict[float, Any] = {0.0: "-", 2.0: (0, (7.0, 1.5)), 4.0: (0, (3.0, 1.2, 1.0, 1.2))}

LOWER, MIDDLE = style.ADHESION, style.RANGE
INSET_LAM = 0.25
_NOTE: dict[str, Any] = {"fontsize": look.SMALL, "color": look.NOTE}


def figure_4(points: int = 160) -> Figure:
    """Bifurcation diagram for beta0 = 0, 2 and 4, traced, with the normal form (33) over it."""
    figure = look.new_figure(8.6, 4.9)
    main, beside = figure.subplots(1, 2, width_ratios=(3.0, 1.0), sharey=True)
    window = (-0.5, 1.0)
    main.plot(window, (0.0, 0.0), color=look.STRAIGHT, linewidth=1.2, label="straight rod, every $\\beta_0$")
    for beta0, colour in FIGURE_4_COLOURS.items():
        branch = trace(beta0=beta0, lam=window, points=points)
        below, above = branch.alpha1 <= 0.0, branch.alpha1 >= 0.0
        main.plot(
            _only(branch.lam, below),
            branch.alpha1,
            color=colour,
            linewidth=2.6,
            label=rf"$\beta_0 = {beta0:g}$",
        )
        main.plot(_only(branch.lam, above), branch.alpha1, color=colour, linewidth=1.6, alpha=0.55)
        alpha1, lam, _ = _normal_form(branch)
        label = "(33), $a_1 = -7.29$, $a_2 = 0.696$" if beta0 == 4.0 else None
        main.plot(lam, alpha1, color="black", linewidth=0.9, linestyle=(0, (4.0, 2.5)), zorder=5, label=label)
        beside.plot(lam - branch.lam, alpha1, color=colour, linewidth=1.6, linestyle=FIGURE_4_LINES[beta0])
        _name(main, branch, rf"$\beta_0 = {beta0:g}$", colour)
        for fold in branch.special("LP-lambda"):
            main.plot(
                fold.lam, fold.alpha1, "s", color=colour, markeredgecolor="white", markersize=6, zorder=6
            )
            main.text(
                -0.48,
                2.5 - 0.16 * beta0,
                rf"F at $\beta_0 = {beta0:g}$: ${fold.lam:.9f}$, ${fold.alpha1:.9f}$",
                fontsize=look.SMALL,
                color=colour,
            )
    _mark_transition(main)
    main.text(
        0.99, 0.545, r"pale: $\alpha_1 > 0$, $y < 0$, spurious", transform=main.transAxes, ha="right", **_NOTE
    )
    main.set_xlim(*window)
    beside.axvline(0.0, color=look.STRAIGHT, linewidth=0.8)
    look.tidy(main, LAM, ALPHA1)
    look.tidy(beside, DIFFERENCE, "", r"at equal $\alpha_1$")
    look.legend(main, loc="lower left")
    look.footnote(
        figure,
        r"Curves for the three $\beta_0$ of the caption of Fig. 4; its text speaks of $\beta_0 = 0$ and 4.",
    )
    return figure


def figure_5(points: int = 160) -> Figure:
    """Extra pressure for beta0 = 0 and 4: all of the branch against (33), with shapes at 0.25."""
    figure = look.new_figure(8.6, 9.2)
    rows = figure.subplots(2, 2, width_ratios=(3.0, 1.0))
    for (main, beside), beta0, letter in zip(rows, (0.0, 4.0), "ab", strict=True):
        branch = trace(beta0=beta0, lam=(-1.0, 1.0), points=points, at={"lam": [INSET_LAM]})
        _diagram(main, beside, branch, f"({letter})  ")
        _insets(main, branch)
    handles, names = rows[1][0].get_legend_handles_labels()
    look.legend(
        rows[0][0],
        handles=handles,
        labels=names,
        loc="upper right",
        bbox_to_anchor=(1.0, 0.5),
        labelspacing=0.25,
    )
    look.footnote(figure, _REMARK)
    return figure


def figure_6(points: int = 160) -> Figure:
    """Extra pressure for beta0 = 10: all of the branch against (33)."""
    figure = look.new_figure(8.6, 4.9)
    main, beside = figure.subplots(1, 2, width_ratios=(3.0, 1.0))
    _diagram(main, beside, trace(beta0=10.0, lam=(-2.5, 1.5), points=points), "")
    look.legend(main, loc="lower left")
    look.footnote(figure, _REMARK)
    return figure


_REMARK = (
    "F, T: fold and transition.  Below Y the tip is higher than $y_0$, where the linear law pushes:\n"
    "these are solutions of (12), not of law (8)."
)


def _diagram(main: Axes, beside: Axes, branch: Branch, letter: str) -> None:
    """Draw a branch by its parts, (33) over it, and beside it how far (33) is off."""
    beta0 = branch.held
    assert branch.trivial is not None
    main.plot(
        branch.trivial.lam, branch.trivial.alpha1, color=look.STRAIGHT, linewidth=1.2, label="straight rod"
    )
    folds = branch.special("LP-lambda")
    bend = folds[0].alpha1 if folds else 0.0
    parts: list[tuple[str, np.ndarray, str, Any]] = [
        ("spurious, $y < 0$", branch.alpha1 >= 0.0, look.SPURIOUS, "-"),
        ("middle, traced", (branch.alpha1 <= 0.0) & (branch.alpha1 >= bend), MIDDLE, (0, (1.6, 0.5))),
        ("lower, traced", branch.alpha1 <= bend, LOWER, "-"),
    ]
    for name, rows, colour, line in parts:
        if np.count_nonzero(rows) > 1:
            main.plot(
                _only(branch.lam, rows),
                branch.alpha1,
                color=colour,
                linestyle=line,
                linewidth=2.8,
                label=name,
            )
    alpha1, lam, exact = _normal_form(branch)
    main.plot(lam, alpha1, label="(33), the paper's numbers", **look.PAPER_LINE)
    beside.plot(lam - branch.lam, alpha1, label="the paper's", **look.PAPER_LINE)
    beside.plot(exact - branch.lam, alpha1, color="black", linewidth=1.3, label=r"exact, $\beta_0 \to 0$")
    beside.axvline(0.0, color=look.STRAIGHT, linewidth=0.8)
    for fold in folds:
        paper = NormalForm.paper().fold(beta0)
        main.plot(fold.lam, fold.alpha1, "s", color="black", markersize=5.5, zorder=6)
        main.annotate(
            f"F  (${fold.lam:.8f}$, ${fold.alpha1:.8f}$)\n(34): (${paper[0]:.4f}$, ${paper[1]:.4f}$)",
            (fold.lam, fold.alpha1),
            xytext=(12.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize=look.SMALL,
        )
    for edge in branch.special("y=y0"):
        main.plot(edge.lam, edge.alpha1, "^", color="black", markersize=5.5, zorder=6)
        main.annotate(
            r"Y  $y_\mathrm{tip} = y_0$, $p = T_0/2$",
            (edge.lam, edge.alpha1),
            xytext=(-9.0, -4.0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=look.SMALL,
        )
    _mark_transition(main)
    look.tidy(main, LAM, ALPHA1, rf"{letter}$\beta_0 = {beta0:g}$, {len(branch)} points")
    look.tidy(beside, DIFFERENCE, "", r"at equal $\alpha_1$")
    beside.sharey(main)
    beside.tick_params(labelleft=False)
    beside.locator_params(axis="x", nbins=3)
    where = {"loc": "center right", "bbox_to_anchor": (1.05, 0.36)} if beta0 < 9.0 else {"loc": "lower right"}
    look.legend(beside, handlelength=1.8, **where)


def _name(ax: Axes, branch: Branch, text: str, colour: str) -> None:
    """Write the name of a branch on its lower part, where the branches are far apart."""
    low = np.flatnonzero(branch.alpha1 < 0.0)
    i = low[np.argmin(np.abs(branch.lam[low] - 0.62) + (branch.lam[low] < 0.0))]
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
    ax.text(
        branch.lam[i], branch.alpha1[i], text, color=colour, fontsize=look.SMALL, ha="center", va="center",
        bbox=box, zorder=7,
    )  # fmt: skip


def _normal_form(branch: Branch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Extra pressures of a branch, and lambda there by (33) with the paper's and the exact numbers."""
    forms = (NormalForm.paper(), NormalForm.exact())
    paper, exact = (form.lam(branch.alpha1, branch.held) for form in forms)
    return branch.alpha1, paper, exact


def _insets(main: Axes, branch: Branch) -> None:
    """Draw the shapes at lambda = 0.25 in corners that the branch leaves empty."""
    rows = np.flatnonzero(np.abs(branch.lam - INSET_LAM) < 1e-9)
    for i in rows:
        low = branch.alpha1[i] < 0.0
        main.plot(branch.lam[i], branch.alpha1[i], "o", color="black", markersize=5.0, zorder=6)
        box = main.inset_axes((0.03, 0.09 if low else 0.76, 0.33, 0.19))
        _shape(box, branch[int(i)], f"$\\lambda = {INSET_LAM}$, $\\alpha_1 = {branch.alpha1[i]:.4f}$")


def _shape(box: Axes, eq: Equilibrium, title: str) -> None:
    box.plot(eq.x, eq.y, color=style.ROD, linewidth=1.8)
    box.plot([0.0, 0.25], [0.0, 0.0], color=style.ROD, linewidth=1.8)
    box.plot(eq.x[0], eq.y[0], "o", color="white", markeredgecolor=style.ROD, markersize=4.0)
    box.axhline(0.0, color=style.PLATE, linewidth=0.7, zorder=0)
    high = float(np.abs(eq.y).max())
    if eq.beta0 > 0.0 and eq.alpha1 < 0.0:
        box.axhline(eq.beta0 / eq.beta1, color=style.RANGE, linewidth=1.0, linestyle=":")
    box.set_ylim(-0.25 * high, 1.25 * high) if eq.y[0] > 0 else box.set_ylim(-1.25 * high, 0.25 * high)
    box.set_xlim(-1.06, 0.25)
    box.set_title(title, fontsize=look.SMALL - 0.5, pad=2.0)
    box.tick_params(labelsize=look.SMALL - 2.0, length=2.0)
    box.locator_params(nbins=3)
    box.yaxis.tick_right()
    box.spines[["top", "left"]].set_visible(False)
    box.text(1.14, 0.5, r"$y/\bar s$", transform=box.transAxes, fontsize=look.SMALL - 1.0, ha="left")


def _mark_transition(ax: Axes) -> None:
    ax.plot(0.0, 0.0, "o", color="white", markeredgecolor="black", markersize=6, zorder=6)
    ax.annotate("T", (0.0, 0.0), xytext=(-6.0, 6.0), textcoords="offset points", ha="right")


def _only(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the values of some rows, nan elsewhere, so that a line breaks there."""
    return np.where(rows, values, np.nan)
