"""A chart beyond the paper: held lengths of a rod with eta near y0 and of a long one."""

from __future__ import annotations

from matplotlib.figure import Figure

from ...equilibria.trace import trace
from ...model.rod import Rod
from .. import plot_held_lengths
from . import look

#: k [N m], T0 [Pa], y0 [m] by what the rod is.
RODS = {
    "flap of aortic media": (2.3e-5, 140e3, 0.73e-3),
    "silicon beam on a wafer": (1.1e-7, 0.89e6, 2e-8),
}


def figure_held_lengths(points: int = 60) -> Figure:
    """Pressure against the length of the flap in equilibrium, for two rods."""
    figure = look.new_figure(10.4, 4.4)
    for ax, (name, numbers) in zip(figure.subplots(1, 2), RODS.items(), strict=True):
        rod = Rod(*numbers)
        plot_held_lengths(trace(rod, points=points, tol=1e-7), ax)
        look.tidy(ax, title=rf"{name}, $\eta/y_0 = {float(f'{rod.ratio:.3g}'):g}$")
    look.footnote(
        figure,
        "Law (8).  Dashed: unfolded flap in equilibrium, which nothing holds there; its length contains the"
        " cohesive zone in it.  Dot: T.  Diamond: least pressure of the branch.",
    )
    return figure
