"""What the figures have in common: colours by what a curve is, axes, notes."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from .. import style

PAPER = style.PRESSURE
LINEAR = style.ADHESION
COHESIVE = style.ROD
SPURIOUS = "#ADADAD"
STRAIGHT = "#6E6E6E"
NOTE = "#404040"

#: The paper's formula, wherever it is drawn.
PAPER_LINE: dict[str, Any] = {"color": PAPER, "linewidth": 1.3, "linestyle": (0, (4.0, 1.6)), "zorder": 5}

SMALL = style.SMALL - 0.5


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure that needs no display."""
    return Figure(figsize=(width, height), layout="constrained")


def tidy(ax: Axes, x: str = "", y: str = "", title: str = "") -> None:
    """Label axes and leave out the frame where there is no scale."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(labelsize=SMALL)
    if x:
        ax.set_xlabel(x)
    if y:
        ax.set_ylabel(y)
    if title:
        ax.set_title(title, loc="left", fontsize=style.SMALL + 0.5)


def footnote(figure: Figure | SubFigure, text: str) -> None:
    """Put a remark under a figure, where the layout makes room for it."""
    figure.supxlabel(text, x=0.01, ha="left", fontsize=SMALL, color=NOTE)


def legend(ax: Axes, **where: Any) -> None:
    """Explain the curves inside the axes."""
    options = {"loc": "best", "frameon": False, "fontsize": SMALL, "handlelength": 2.6} | where
    ax.legend(**options)
