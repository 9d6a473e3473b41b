"""Which picture belongs to which result: `draw`, with one function registered for each kind."""

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
    "Sweep": "sweeps",
    "Propagated": "spread",
    "WorkPrecision": "work",
    "LoadingCurve": "flaws",
    "Snap": "motion",
    "History": "history",
}


@singledispatch
def draw(result: object, ax: Axes | None = None, **how: Any) -> Axes:
    """Draw a result; return the axes.

    Parameters
    ----------
    result : object
        Of one of the kinds in `PICTURES`.
    ax : Axes, optional
        Where to draw; by default a figure of its own, which needs no display.
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
        picture = draw.dispatch(type(result))
        if picture is not draw.dispatch(object):
            return picture(result, ax, **how)
    raise InvalidInput(
        f"there is no picture of {result!r:.60}.", remedy="Draw what a call of peel_opt returned."
    )
