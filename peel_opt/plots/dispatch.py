"""Which picture belongs to which result: `draw`, the door, and behind it a function for each kind."""

from __future__ import annotations

from functools import singledispatch
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..base.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Module with the picture of each kind of result; it registers itself when one is first drawn.
PICTURES = {
    "Equilibrium": "rod",
    "Branch": "diagram",
    "HysteresisLoop": "loop",
    "PressureLoop": "loop",
    "Calibration": "fit",
    "SceneCalibration": "fit",
    "Sweep": "sweeps",
    "Propagated": "spread",
    "WorkPrecision": "work",
    "LoadingCurve": "flaws",
    "Snap": "motion",
    "History": "history",
}


@singledispatch
def drawn_by(result: object, ax: Axes | None = None, **how: Any) -> Axes:
    """Draw a result by the function registered for its kind."""
    raise InvalidInput(
        f"there is no picture of {result!r:.60}.", remedy="Draw what a call of peel_opt returned."
    )


def draw(
    result: object, ax: Axes | None = None, *, legend: bool = True, title: str | None = None, **how: Any
) -> Axes:
    """Draw a result; return the axes.

    Parameters
    ----------
    result : object
        Of one of the kinds in `PICTURES`.
    ax : Axes, optional
        Where to draw; by default a figure of its own: see `peel_opt.plots.axes.own_figure`.
    legend : bool, optional
        Whether lines and marks are explained.
    title : str, optional
        In place of the title that the picture has.
    **how
        What the picture of this kind takes: see the ``plot`` method of the result.

    Returns
    -------
    Axes

    Raises
    ------
    InvalidInput
        If there is no picture of such a thing.
    """
    name = type(result).__name__
    if name in PICTURES:
        import_module(f".{PICTURES[name]}", __package__)
    return _as_wished(drawn_by(result, ax, **how), legend, title)


def _as_wished(ax: Axes, legend: bool, title: str | None) -> Axes:
    """Take the legend away, or put another title above."""
    from .mpl import entitle

    explained = ax.get_legend()
    if not legend and explained is not None:
        explained.remove()
    if title is not None:
        entitle(ax, title)
    return ax
