"""What is drawn as a table: CSV text with the units in its header."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

from ...plots.words import plain
from .screen import Screen

COLUMNS = ("panel", "series", "x", "y", "x_quantity", "y_quantity")

Row = tuple[str, str, float, float, str, str]


def screen_csv(screen: Screen) -> str:
    """Return everything drawn as CSV: one row for each point, under comments that say what it is.

    Parameters
    ----------
    screen : Screen

    Returns
    -------
    str
        Comment lines start with "#"; the columns are those of `COLUMNS`.  Arrows are rows "tail" and
        "head" in turn.
    """
    text = io.StringIO()
    text.write(f"# peel_opt explore: {screen.state.words}\n")
    text.write(f"# link: ?{screen.state.to_query()}\n")
    if screen.answer is not None:
        kind = "certified" if screen.answer.certified else "not certified"
        text.write(f"# {screen.answer.headline} ({screen.answer.label}, {screen.answer.law} law, {kind})\n")
    if screen.message:
        text.write(f"# {screen.message}\n")
    for part in screen.parts:
        text.write(f"# {part.name}: {part.method}, {part.seconds:.3g} s, error {part.error}\n")
    for warning in screen.warnings:
        text.write(f"# warning: {warning}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(_rows(screen))
    return text.getvalue()


def _rows(screen: Screen) -> Iterator[Row]:
    panels = (
        ("rod", screen.rod),
        ("diagram", screen.diagram),
        ("potential", screen.potential),
        ("loop", screen.loop),
    )
    for name, panel in panels:
        if panel is None:
            continue
        quantities = plain(panel.x.label), plain(panel.y.label)
        for line in panel.lines:
            yield from (
                (name, line.look, float(x), float(y), *quantities)
                for x, y in zip(line.x, line.y, strict=True)
            )
        for mark in panel.marks:
            yield name, f"mark {plain(mark.text)} {mark.look}", mark.x, mark.y, *quantities
        if panel.here is not None:
            yield name, "state", *panel.here, *quantities
        for arrows in panel.arrows:
            for x0, y0, x1, y1 in zip(arrows.x0, arrows.y0, arrows.x1, arrows.y1, strict=True):
                yield name, f"{arrows.look} tail", float(x0), float(y0), *quantities
                yield name, f"{arrows.look} head", float(x1), float(y1), *quantities
