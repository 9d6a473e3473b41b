"""The axes a picture is drawn into: those of the caller, if they can be drawn into, or new ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from ..base.errors import InvalidInput


def axes_or(ax: object, make: Callable[[], Axes]) -> Axes:
    """Return the axes of a caller, or what ``make`` returns where there are none.

    Raises
    ------
    InvalidInput
        If they cannot be drawn into.
    """
    return make() if ax is None else require_axes(ax)


def require_axes(ax: object, name: str = "ax") -> Axes:
    """Return Matplotlib's axes with straight coordinates, or say what was given in their place.

    Raises
    ------
    InvalidInput
        If it is anything else.
    """
    if isinstance(ax, np.ndarray | list | tuple):
        raise InvalidInput(f"{name} must be one Axes, got {np.size(ax)} of them.", remedy="Give one, ax[0].")
    if isinstance(ax, FigureBase):
        raise InvalidInput(f"{name} must be an Axes, got a figure.", remedy="Give figure.add_subplot().")
    if not isinstance(ax, Axes):
        raise InvalidInput(f"{name} must be an Axes of Matplotlib, got {type(ax).__name__}.")
    if ax.name != "rectilinear":
        raise InvalidInput(
            f"{name} must have straight coordinates, got the projection {ax.name!r}.",
            remedy="Make it without projection=.",
        )
    return ax
