"""Figures 7 and 9: the effective potential, and the detached length at its Maxwell point."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ...analysis.design_relations import maxwell_length
from ...analysis.normal_form import NormalForm
from .. import style
from ..potential import plot_potential
from . import look

BETA0 = 4.0


def figure_7() -> Figure:
    """Effective potential (35) at beta0 = 4, by the paper's coefficients and the exact ones."""
    figure = look.new_figure(10.0, 4.4)
    forms = {"the paper's coefficients": NormalForm.paper(), "exact coefficients": NormalForm.exact()}
    for ax, (name, form) in zip(figure.subplots(1, 2, sharey=True), forms.items(), strict=True):
        plot_potential(form.at(BETA0), ax=ax)
        where = rf"$\beta_0 = {BETA0:g}$, {name}: $a_1 = {form.a1:.6g}$, $a_2 = {form.a2:.6g}$"
        look.tidy(ax, title=where)
    look.footnote(
        figure, "A convention, not an energy: a positive factor in (33) moves $\\lambda_M$, not $\\lambda_F$."
    )
    return figure


def figure_9(points: int = 60) -> Figure:
    """sbar_M against eta: (42) in the paper's range and the traced Maxwell points, over y0 and over eta."""
    figure = look.new_figure(10.0, 4.4)
    ratios = np.linspace(0.05, 2.0, points)
    paper, traced = (maxwell_length(ratios, source) for source in ("paper", "branch"))
    critical = np.pi * ratios**0.75
    left, right = figure.subplots(1, 2)
    for ax, unit in ((left, 1.0), (right, ratios)):
        ax.plot(ratios, paper / unit, label="(42), the paper's numbers", **look.PAPER_LINE)
        ax.plot(ratios, traced / unit, color=style.ADHESION, linewidth=2.0, label="traced branches")
        name = r"$\bar s_c = \pi (k y_0/T_0)^{1/4}$, (20)"
        ax.plot(ratios, critical / unit, color=look.STRAIGHT, linewidth=1.0, linestyle=":", label=name)
    right.set_ylim(2.2, 5.2)
    look.tidy(left, r"$\eta/y_0$", r"$\bar s_M/y_0$", "as in the paper")
    look.tidy(right, r"$\eta/y_0$", r"$\bar s_M/\eta$", r"over $\eta$: level if $\bar s_M \propto \eta$")
    look.legend(left, loc="upper left")
    first = float(ratios[np.isfinite(traced)][0])
    look.footnote(
        figure,
        rf"Traced from $\eta/y_0 = {first:.2f}$ on: below about 0.50 the branch at fixed $\beta_0$"
        " has no fold, and no Maxwell point.",
    )
    return figure
