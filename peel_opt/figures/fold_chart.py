"""A chart beyond the paper: the fold over beta0, with its turn and its cusp."""

from __future__ import annotations

from matplotlib.figure import Figure

from ..fold_curves import fold_curve
from ..plots import style


def figure_fold_curve(points: int = 160) -> Figure:
    """The fold in lambda over beta0: not single-valued between its cusp and its turn."""
    fig = Figure(figsize=(6.4, 4.4), layout="constrained")
    ax = fig.add_subplot()
    curve = fold_curve((0.1, 60.0), points=points)
    for axes, size in ((ax, 1.8), (inset := ax.inset_axes((0.10, 0.10, 0.38, 0.44)), 1.5)):
        axes.plot(curve.beta0, curve.lam, color=style.ADHESION, linewidth=size)
        for point in curve.special_points:
            axes.plot([point.beta0], [point.lam], "o" if point.kind == "turn" else "D", color=style.WARNING)
    for point in curve.special_points:
        inset.annotate(
            rf"{point.kind}, $\beta_0 = {point.beta0:.4f}$",
            (point.beta0, point.lam),
            (-6, 6) if point.kind == "turn" else (6, -9),
            textcoords="offset points",
            fontsize=7,
            ha="right" if point.kind == "turn" else "left",
        )
    inset.set(xlim=(35.0, 38.2), ylim=(-62.0, -34.0))
    inset.tick_params(labelsize=7)
    ax.indicate_inset_zoom(inset, edgecolor=style.PLATE)
    ax.set_xlabel(r"$\beta_0$")
    ax.set_ylabel(r"$\lambda_F$")
    return fig
