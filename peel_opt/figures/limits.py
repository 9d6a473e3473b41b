"""Charts beyond the paper: the minimum pressure, and the fold with its turn and its cusp."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..closures import Closure
from ..cohesion import COHESIVE
from ..fold_curves import fold_curve
from ..plots import style
from ..primary import primary_branch


def minimum_pressure(ratio: float) -> float:
    """Return P_min of a rod, from the walk along its branch."""
    branch = primary_branch(COHESIVE, Closure("ratio", ratio))
    branch.extend(lambda _: branch.fold("LP-pressure") is not None)
    fold = branch.fold("LP-pressure")
    assert fold is not None
    return fold.point.scalars.pressure_ratio


def figure_p_min(points: int = 60) -> Figure:
    """P_min against eta/y0, with its asymptotes on both sides."""
    fig = Figure(figsize=(6.4, 4.4), layout="constrained")
    ax = fig.add_subplot()
    ratios = np.geomspace(0.005, 3000.0, points)
    least = np.array([minimum_pressure(float(r)) for r in ratios])
    stiff, soft = ratios[ratios > 0.3], ratios[ratios < 0.6]
    ax.loglog(ratios, least, color=style.ADHESION, linewidth=2.0, label=r"$p_\min/T_0$, law (8)")
    ax.loglog(
        stiff, (4 * stiff) ** -1.5, linestyle=(0, (5, 2)), color=style.PRESSURE, label=r"$(y_0/4\eta)^{3/2}$"
    )
    ax.loglog(
        soft,
        1 - 1.022 * soft,
        linestyle=":",
        color=style.RANGE,
        linewidth=1.8,
        label=r"$1 - 1.022\,\eta/y_0$",
    )
    ax.set_xlabel(r"$\eta/y_0$")
    ax.set_ylabel(r"$p_\min/T_0$")
    ax.set_ylim(least[-1] / 2.0, 2.0)
    ax.legend(frameon=False)
    return fig


def figure_fold_curve() -> Figure:
    """The fold in lambda over beta0: not single-valued between its cusp and its turn."""
    fig = Figure(figsize=(6.4, 4.4), layout="constrained")
    ax = fig.add_subplot()
    curve = fold_curve((0.1, 60.0), points=160)
    for axes, size in ((ax, 1.8), (inset := ax.inset_axes((0.12, 0.10, 0.46, 0.44)), 1.5)):
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
