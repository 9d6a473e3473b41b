"""A chart beyond the paper: what each method takes on this machine for the accuracy it gives."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from ...equilibria.ask import equilibrium, length_given_pressure
from ...model.rod import Rod
from ...studies.tradeoff.run import tradeoff
from . import look

TOLS = (1e-3, 1e-7, 1e-11)


def figure_work_precision(repeats: int = 3) -> Figure:
    """True error against time for a local and a global question, with so many timed calls each."""
    figure = look.new_figure(9.8, 4.4)
    questions = {
        r"$\alpha_1$ at $\beta_0 = 4$, $\lambda = 1$, linear law": partial(equilibrium, beta0=4.0, lam=1.0),
        r"$\bar s/\eta$ at $\eta = y_0$, $p = 0.2\,T_0$, law (8)": partial(
            length_given_pressure, Rod.from_ratio(1.0), 0.2
        ),
    }
    panels = figure.subplots(1, 2, sharey=True)
    for ax, (title, ask) in zip(panels, questions.items(), strict=True):
        table = tradeoff(ask, tols=TOLS, repeats=repeats)
        table.plot(ax)
        look.tidy(ax, "time of one answer [ms]", "true error", title)
        look.legend(ax, loc="upper right")
    lowest = min(
        float(np.min(line.get_ydata())) for ax in panels for line in ax.lines if len(line.get_ydata())
    )
    panels[0].set_ylim(0.2 * lowest, 1.0)
    look.footnote(
        figure,
        "Tolerances 1e-3, 1e-7 and 1e-11; medians after a warm-up.  Dotted: error of the reference, a"
        " spectral solve with 54 and\n81 nodes a phase; no error below it can be told."
        "  solve_bvp starts from the solution.",
    )
    return figure
