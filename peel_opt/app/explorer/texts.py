"""The texts of the page as markup; whatever comes from people or cards is escaped."""

from __future__ import annotations

import html
import math
import textwrap

from bokeh.models import Div

from . import look
from .film import Film
from .screen import Screen


def text_box(name: str, role: str) -> Div:
    """Return an empty text that screen readers follow."""
    box = Div(
        text="",
        name=name,
        sizing_mode="stretch_width",
        styles={"font-size": look.FONT, "color": look.INK, "line-height": "1.3"},
    )
    if "html_attributes" in Div.properties():  # since Bokeh 3.6: screen readers hear of changes
        box.html_attributes = {"role": role, "aria-live": "polite"}
    return box


def headline(screen: Screen) -> str:
    """Return the answer with its error, and what kind of state it is."""
    answer = screen.answer
    words = html.escape(screen.state.words)
    if answer is None:
        said = "adhered" if screen.state.label == "adhered" else "no such state"
        said = "being solved:" if screen.solving else f"{said} at"
        return f'<span style="font-size:17px"><b>{said}</b> {words}</span>'
    numbers = ", ".join(f"{html.escape(n)} = {html.escape(v)}" for n, v in answer.numbers)
    verdict = "certified" if answer.certified else "not certified"
    return (
        f'<span style="font-size:17px"><b>{html.escape(answer.headline)}</b> at {words}</span><br>'
        f'<span style="font-size:12px">{html.escape(answer.label)} state, {html.escape(answer.law)} law,'
        f" {verdict} (certificate {answer.certificate:.0e}); {numbers}</span>"
    )


def film_headline(film: Film) -> str:
    """Return what becomes of a rod that lets go, and how far to trust the film."""
    return (
        f'<span style="font-size:17px"><b>{html.escape(film.headline)}</b></span><br>'
        f'<span style="font-size:12px">{html.escape(film.details)}</span>'
    )


def running(done: int, total: int) -> str:
    """Return how far a motion is computed."""
    return (
        f'<label>computing the motion <progress value="{done}" max="{total}">{done} of {total}</progress>'
        "</label>"
    )


def _time(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "-"
    if seconds >= 1.0:
        return f"{seconds:.1f} s"
    if seconds < 1e-4:
        return "< 0.1 ms"
    return f"{1e3 * seconds:.0f} ms" if seconds >= 0.01 else f"{1e3 * seconds:.1f} ms"


def wrapped(text: str) -> str:
    """Return a text in lines that fit into a panel."""
    return "\n".join(textwrap.wrap(text, 40))


def notes(screen: Screen, messages: tuple[str, ...]) -> str:
    """Return what must be said: messages and missing states first, then warnings."""
    urgent = [*messages, *([screen.message] if screen.message else [])]
    calm = [*screen.warnings, *([] if screen.sweep is None else [screen.sweep.note])]
    lines = [f'<b style="color:{look.REFUSED}">{html.escape(text)}</b>' for text in urgent]
    return "<br>".join([*lines, *(html.escape(text) for text in calm)])


def doing(what: str) -> str:
    """Return what is computed now; it appears only where that takes a while."""
    return f'<span class="doing">{html.escape(what)} …</span>'


def costs(screen: Screen, doing: str) -> str:
    """Return what the picture cost and how far to trust it, part by part."""
    kind = "Full picture" if screen.full else "Quick picture"
    rows = "".join(
        f'<tr><td title="{html.escape(part.method)}">{html.escape(part.name)}</td>'
        f'<td style="white-space:nowrap">{_time(part.seconds)}</td><td>'
        f"{html.escape(part.error)}</td></tr>"
        for part in screen.parts
    )
    how = "; ".join(f"{part.name} by {part.method}" for part in screen.parts)
    return (
        f"<b>{kind} in {_time(screen.seconds)}</b>{doing}"
        '<table style="border-spacing:6px 1px; margin-left:-6px"><thead><tr style="text-align:left">'
        f"<th></th><th>time</th><th>error</th></tr></thead><tbody>{rows}</tbody></table>"
        f'<span style="color:{look.FAINT}; font-size:12px">{html.escape(how)}.</span>'
    )
