"""The axes a picture is drawn into: those of the caller, if they can be drawn into, or new ones."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase

from ..base.errors import InvalidInput

#: Whether figures are kept from pyplot though it is in use.
_APART: ContextVar[bool] = ContextVar("apart", default=False)


def own_figure(width: float, height: float) -> Figure:
    """Return a figure for one picture [inches].

    Where pyplot is in use it is one of pyplot's, which a notebook shows below the cell and
    ``plt.show()`` in a window; elsewhere it needs no display.
    """
    how: dict[str, Any] = {"figsize": (width, height), "layout": "constrained"}
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is None or _APART.get():
        return Figure(**how)
    figure: Figure = pyplot.figure(**how)
    return figure


@contextmanager
def apart_from_pyplot() -> Iterator[None]:
    """Keep figures made inside from pyplot: for pictures that are shown in another way, or written."""
    before = _APART.set(True)
    try:
        yield
    finally:
        _APART.reset(before)


def own_axes(width: float, height: float) -> Callable[[], Axes]:
    """Return what makes the axes of a figure of one picture [inches]."""
    return lambda: own_figure(width, height).add_subplot()


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
