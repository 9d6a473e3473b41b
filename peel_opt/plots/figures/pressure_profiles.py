"""Figure 8: pressure against detached length, by the normal form (38), the linear law and law (8)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...analysis.design_relations import fold_pressure, pressure_profile
from ...analysis.normal_form import NormalForm
from ...continuation.family import Family, StepControl
from ...continuation.primary import PrimaryBranch
from ...equilibria.branch import Branch
from ...equilibria.trace import trace
from ...model.bond import LINEAR
from ...model.rod import Rod
from ...residual.closures import Closure
from ...residual.meshes import PATH
from .. import style
from . import look

#: What the panels say in which (38) has nothing to do with the branch.
_NO_SOLUTION = (
    "No solution of (12) lies on (38) here:\nthe branch turns at $P_\\mathrm{min}$ and ends where\n"
    "the tip touches the plate ($\\times$), with $y < y_0$."
)
_WARNING: dict[str, Any] = {"fontsize": look.SMALL, "color": look.PAPER}

RATIOS = (0.1, 0.2, 0.5, 1.0, 2.0)

#: Length up to which each panel is drawn, over the longest one that law (8) allows.
_ROOM = 1.35


def figure_8(points: int = 160) -> Figure:
    """Pressure profiles for eta/y0 = 0.1, 0.2, 0.5, 1 and 2, each in a panel, and together as printed."""
    figure = look.new_figure(11.0, 7.2)
    panels = figure.subplots(2, 3).ravel()
    traced = {}
    for ax, ratio in zip(panels, RATIOS, strict=False):
        branch = traced[ratio] = trace(Rod.from_ratio(ratio), points=points)
        _panel(ax, ratio, branch, points)
    look.legend(panels[3], loc="upper right")
    _as_printed(panels[5], traced)
    look.footnote(
        figure,
        "(38) with the paper's numbers.  From T down to $p = T_0/2$ (dotted) the two laws are the same;"
        " below, the tip is higher than $y_0$, where the linear law pushes.\n"
        "The plateau $p/T_0 = 0.30$ of (41) lies on no branch.",
    )
    return figure


def linear_profile(ratio: float, longest: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return sbar/eta and p/T0 along a rod's branch under the linear law, up to a length.

    For eta/y0 above 0.4319 that branch has no end: it passes through p = 0 and goes on.
    """
    family = Family(LINEAR, PATH, Closure("ratio", ratio))
    walk = PrimaryBranch(family, control=StepControl(largest=step))
    walk.extend(lambda p: p.scalars.sigma > longest or p.scalars.pressure_ratio < 0.0)
    scalars = [p.scalars for p in walk.points]
    return np.array([s.sigma for s in scalars]), np.array([s.pressure_ratio for s in scalars])


def _panel(ax: Axes, ratio: float, branch: Branch, points: int) -> None:
    longest = _ROOM * float(branch.length_ratio.max())
    rod = Rod.from_ratio(ratio)
    over_y0 = ratio * branch.length_ratio
    ax.plot(over_y0, branch.pressure_ratio, color=look.COHESIVE, linewidth=2.4, label="law (8)", zorder=3)
    sigma, pressure = linear_profile(ratio, longest, 16.0 / points)
    ax.plot(ratio * sigma, pressure, color="#56B4E9", linewidth=1.5, label="linear law", zorder=4)
    sigma = _from_fold(rod, longest, points)
    ax.plot(ratio * sigma, pressure_profile(rod, sigma, NormalForm.paper()), label="(38)", **look.PAPER_LINE)

    fold = NormalForm.paper()
    ax.plot(
        ratio * sigma[0],
        fold_pressure(rod, fold),
        "s",
        markersize=5,
        color=look.PAPER,
        zorder=6,
        label="F by (34)",
    )
    (least,) = branch.special("LP-pressure")
    bends = [b for b in branch.special("LP-length") if b.index < least.index]
    for points_, marker, label in ((bends[:1], "s", "$P_F$"), ([least], "D", r"$P_\mathrm{min}$")):
        for p in points_:
            at = (ratio * p.length_ratio, p.pressure_ratio)
            ax.plot(
                *at, marker, color="black", markersize=5.5, markeredgecolor="white", zorder=7, label=label
            )
    for kind, marker in (("BP", "o"), ("contact", "X")):
        for p in branch.special(kind):
            ax.plot(
                ratio * p.length_ratio,
                1.0,
                marker,
                color="white",
                markeredgecolor="black",
                markersize=5.5,
                zorder=7,
            )
            if kind == "BP":
                ax.annotate("T", (ratio * p.length_ratio, 1.0), (5, 3), textcoords="offset points")
    ax.axhline(0.5, color=style.RANGE, linewidth=0.9, linestyle=":", zorder=1)
    ax.set_xlim(0.85 * float(over_y0.min()), ratio * longest)
    ax.set_ylim(-0.04, 1.07)
    if not bends:
        ax.text(0.97, 0.22, _NO_SOLUTION, transform=ax.transAxes, ha="right", va="top", **_WARNING)
    found = [f"$P_F = {b.pressure_ratio:.6f}$,  " for b in bends[:1]]
    found.append(rf"$P_\mathrm{{min}} = {least.pressure_ratio:.6f}$")
    ax.set_title("".join(found), loc="right", fontsize=look.SMALL)
    look.tidy(ax, r"$\bar s/y_0$", r"$p/T_0$", rf"$\eta/y_0 = {ratio:g}$")


def _from_fold(rod: Rod, longest: float, points: int) -> np.ndarray:
    """Lengths sbar/eta from the fold of (34) on; rod in units of eta."""
    sigma = np.linspace(1.0, longest, 4001)
    known = np.isfinite(pressure_profile(rod, sigma, NormalForm.paper()))
    return np.linspace(float(sigma[known][0]), longest, 2 * points)


def _as_printed(ax: Axes, traced: dict[float, Branch]) -> None:
    """All ratios together: law (8), and (38) in the same colour."""
    for (ratio, branch), colour in zip(traced.items(), style.family_colours(len(traced)), strict=True):
        longest = 12.0 / ratio
        ax.plot(
            ratio * branch.length_ratio,
            branch.pressure_ratio,
            color=colour,
            linewidth=1.8,
        )
        at_T = ratio * float(branch.length_ratio[0])
        name = rf"$\eta/y_0 = {ratio:g}$" if ratio == RATIOS[0] else f"{ratio:g}"
        ax.annotate(name, (at_T, 1.0), (0, 5), textcoords="offset points", ha="center", fontsize=look.SMALL)
        rod = Rod.from_ratio(ratio)
        sigma = _from_fold(rod, longest, 400)
        ax.plot(
            ratio * sigma,
            pressure_profile(rod, sigma, NormalForm.paper()),
            color=colour,
            linewidth=1.1,
            linestyle=(0, (4.0, 1.6)),
        )
    ax.set_xscale("log")
    ax.set_xlim(0.25, 12.0)
    ax.set_xticks([0.3, 1.0, 3.0, 10.0], ["0.3", "1", "3", "10"])
    ax.set_ylim(-0.33, 1.12)
    look.tidy(ax, r"$\bar s/y_0$", r"$p/T_0$", "together: law (8) solid, (38) dashed")
