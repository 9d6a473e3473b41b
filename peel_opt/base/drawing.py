"""Results draw themselves without knowing how: the one door from a result to its picture."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes


def draw(result: object, ax: Axes | None = None, **how: Any) -> Axes:
    """Draw a result as `peel_opt.plots` knows to, which is imported here and no sooner."""
    axes: Axes = import_module("peel_opt.plots").draw(result, ax, **how)
    return axes


def film(result: object, path: str | Path, **how: Any) -> Path:
    """Write a film of a result as `peel_opt.plots` knows to."""
    written: Path = import_module("peel_opt.plots").film(result, path, **how)
    return written
