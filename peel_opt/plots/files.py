"""Figures on disk."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from ..base.errors import InvalidInput
from ..base.files import as_path, atomic_write

#: By suffix: what keeps the date out, so that the same picture is the same file.
FORMATS: dict[str, dict[str, Any]] = {
    ".png": {},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
}


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
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise InvalidInput(
            f"cannot tell the format of a figure from {path.name!r}.",
            remedy=f"End the name in one of {', '.join(FORMATS)}.",
        )

    # Drawn in memory: on a full disk the backends fail in ways that do not say so.
    drawn = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "peel_opt", "pdf.fonttype": 42}):
        fig.savefig(drawn, format=suffix[1:], dpi=dpi, bbox_inches="tight", metadata=FORMATS[suffix])
    return atomic_write(path, lambda file: file.write(drawn.getvalue()))
