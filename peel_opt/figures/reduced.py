"""Figures 7 and 9: the effective potential, and the detached length at its Maxwell point."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..design_relations import maxwell_length
from ..landau import NormalForm
from ..plots import style
from ..plots.potential import plot_potential


def figure_7(points: int = 400) -> Figure:
    """Effective potential (35) at beta0 = 4, by the paper's coefficients and the exact ones.

    ``points`` is taken for the sake of the other figures; a potential is a polynomial.
    """
    del points
    fig = Figure(figsize=(10.0, 4.2), layout="constrained")
    forms = {"paper's coefficients": NormalForm.paper(), "exact coefficients": NormalForm.exact()}
    for ax, (name, form) in zip(fig.subplots(1, 2, sharey=True), forms.items(), strict=True):
        plot_potential(form.at(4.0), ax=ax)
        ax.set_title(name, fontsize=10, loc="left")
    return fig


def figure_9(points: int = 60) -> Figure:
    """sbar_M against eta: the paper's (42) in its own range, and the traced Maxwell points."""
    fig = Figure(figsize=(6.4, 4.4), layout="constrained")
    ax = fig.add_subplot()
    ratios = np.linspace(0.05, 2.0, points)
    ax.plot(
        ratios,
        maxwell_length(ratios, "paper"),
        color=style.PRESSURE,
        linestyle=(0, (5, 2)),
        label="paper, (42)",
    )
    ax.plot(
        ratios, maxwell_length(ratios, "branch"), color=style.ADHESION, linewidth=2.0, label="traced branches"
    )
    ax.plot(
        ratios,
        np.pi * ratios**0.75,
        color=style.PLATE,
        linewidth=1.0,
        label=r"$\bar s_c = \pi (k y_0/T_0)^{1/4}$",
    )
    ax.set_xlabel(r"$\eta/y_0$")
    ax.set_ylabel(r"$\bar s_M/y_0$")
    ax.set_title(
        r"traced: none below $\eta/y_0 \approx 0.50$, where the fold is gone", fontsize=9, loc="left"
    )
    ax.legend(frameon=False)
    return fig
