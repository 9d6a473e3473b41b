"""Figures on disk."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.errors import InvalidInput
from ..base.files import as_path, make_folder, write_bytes
from .axes import apart_from_pyplot

#: By suffix: what keeps the date out, so that the same picture is the same file.
FORMATS: dict[str, dict[str, Any]] = {
    ".png": {},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}


def picture_file(path: str | Path) -> Path:
    """Return where a figure goes, in a folder that exists now: to be called before any work is done.

    Raises
    ------
    InvalidInput
        If the suffix names none of the formats, or the folder cannot be made.
    """
    _suffix(as_path(path))
    make_folder(as_path(path).parent)
    return as_path(path)


def save_figure(fig: Figure, path: str | Path, *, dpi: float = 200.0) -> Path:
    """Write a figure as PNG, SVG or PDF; an interrupted write leaves what was there before.

    Parameters
    ----------
    fig : Figure
    path : str or Path
        Its suffix chooses the format.
    dpi : float, optional
        Dots per inch of a PNG.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        If the suffix names none of the formats, or the file cannot be written.
    """
    path = as_path(path)
    suffix = _suffix(path)
    # Pictured in memory: on a full disk the backends fail in ways that do not say so.
    drawn = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "peel_opt", "pdf.fonttype": 42}):
        fig.savefig(drawn, format=suffix[1:], dpi=dpi, bbox_inches="tight", metadata=FORMATS[suffix])
    return write_bytes(path, drawn.getvalue())


def png(plot: Callable[[], Axes], *, dpi: float = 100.0) -> bytes:
    """Return a picture as a page shows it: the figure of the axes that ``plot`` returns, kept from pyplot."""
    with apart_from_pyplot():
        figure = plot().get_figure()
    while not isinstance(figure, Figure):
        assert figure is not None
        figure = figure.figure
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=dpi, bbox_inches="tight")
    return drawn.getvalue()


def _suffix(path: Path) -> str:
    """Return the suffix that names one of the formats."""
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise InvalidInput(
            f"cannot tell the format of a figure from {path.name!r}.",
            remedy=f"End the name in one of {', '.join(FORMATS)}.",
        )
    return suffix
