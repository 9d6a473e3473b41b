"""Results draw and show themselves without knowing how: the one door from a result to its picture."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any

from .errors import PeelOptError

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


#: Rows of a table that are shown from its beginning, and as many from its end.
FEW = 5


class Shown:
    """What shows itself where it is looked at, in a notebook: its words, and what there is besides."""

    def _rows_shown(self) -> list[dict[str, Any]]:
        """Return what is shown as a table, one row a line, units in the keys."""
        return []

    def _repr_html_(self) -> str:
        # Colours are left to the page, so that it can be read on a dark one.
        words = f'<pre style="white-space:pre-wrap">{escape(repr(self))}</pre>'
        return words + _html_table(self._rows_shown())


class Pictured(Shown):
    """What has a picture, which is shown too."""

    def plot(self, ax: Axes | None = None, *, legend: bool = True, title: str | None = None) -> Axes:
        """Draw it.

        Parameters
        ----------
        ax : Axes, optional
            Default: those of a new figure, which is one of pyplot's where pyplot is in use, so that a
            notebook shows it below the cell; elsewhere it needs no display.
        legend : bool, optional
            Whether lines and marks are explained, below the picture.
        title : str, optional
            In place of the title that the picture has.

        Returns
        -------
        Axes
        """
        return draw(self, ax, legend=legend, title=title)

    def _repr_png_(self) -> bytes | None:
        try:
            png: bytes = import_module("peel_opt.plots").png(self.plot)
        except PeelOptError:
            return None  # nothing was found that could be drawn; the words say so
        return png

    def _repr_html_(self) -> str:
        return _with_picture(super()._repr_html_(), self._repr_png_())

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        """Return all forms at once, for which the picture is drawn once."""
        png = self._repr_png_()
        shown = {"text/plain": repr(self), "text/html": _with_picture(super()._repr_html_(), png)}
        return shown if png is None else shown | {"image/png": png}


def _with_picture(html: str, png: bytes | None) -> str:
    if png is None:
        return html
    return f'{html}<img alt="picture" src="data:image/png;base64,{b64encode(png).decode()}">'


def _html_table(rows: list[dict[str, Any]]) -> str:
    """Return a table, the middle of a long one left out."""
    if not rows:
        return ""
    titles = list(rows[0])
    head = "".join(f"<th>{escape(title)}</th>" for title in titles)
    lines = [f"<tr>{head}</tr>"]
    long = len(rows) > 2 * FEW
    lines += [_html_row(row) for row in (rows[:FEW] if long else rows)]
    if long:
        left = f"{len(rows) - 2 * FEW} rows more"
        lines.append(f'<tr><td colspan="{len(titles)}">{left}</td></tr>')
        lines += [_html_row(row) for row in rows[-FEW:]]
    return f"<table>{''.join(lines)}</table>"


def _html_row(row: dict[str, Any]) -> str:
    cells = (f"{value:.6g}" if isinstance(value, float) else str(value) for value in row.values())
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
