"""A chart beyond the paper: the fold over beta0, with its turn and its cusp."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ...analysis.normal_form import NormalForm
from ...equilibria.fold_curve import fold_curve
from .. import style
from . import look

END = 60.0


def figure_fold_curve(points: int = 500) -> Figure:
    """The fold in lambda over beta0: not single-valued between its cusp and its turn."""
    figure = look.new_figure(7.2, 4.8)
    ax = figure.add_subplot()
    curve = fold_curve((0.1, END), points=points)
    cusp = next(p.index for p in curve.special_points if p.kind == "cusp")
    beta0 = np.linspace(0.0, END, 200)
    ax.plot(beta0, NormalForm.paper().fold(beta0)[0], label="(34), the paper's numbers", **look.PAPER_LINE)
    inset = ax.inset_axes((0.12, 0.09, 0.36, 0.46))
    for axes, size in ((ax, 2.0), (inset, 1.6)):
        for part, line, name in (
            (slice(0, cusp + 1), "-", "fold, from T to the cusp"),
            (slice(cusp, None), (0, (1.6, 0.8)), "second fold, from the cusp on"),
        ):
            axes.plot(
                curve.beta0[part],
                curve.lam[part],
                color=style.ADHESION,
                linewidth=size,
                linestyle=line,
                label=name,
            )
        for point in curve.special_points:
            marker = "o" if point.kind == "turn" else "D"
            axes.plot([point.beta0], [point.lam], marker, color=style.WARNING, zorder=5)
    for point in curve.special_points:
        inset.annotate(
            f"{point.kind}\n$\\beta_0 = {point.beta0:.4f}$\n$\\eta/y_0 = {curve.ratio[point.index]:.5f}$",
            (point.beta0, point.lam),
            (-8, 4) if point.kind == "turn" else (46, -9),
            textcoords="offset points",
            fontsize=look.SMALL - 1.5,
            ha="right" if point.kind == "turn" else "left",
            va="center",
        )
    inset.set(xlim=(35.6, 38.0), ylim=(-64.0, -37.0))
    inset.tick_params(labelsize=look.SMALL - 1.5)
    ax.indicate_inset_zoom(inset, edgecolor=style.PLATE)
    ax.set_ylim(-78.0, 6.0)
    look.tidy(ax, r"$\beta_0$", r"$\lambda_F$")
    look.legend(ax, loc="upper right", bbox_to_anchor=(0.9, 1.0))
    return figure
