"""`write_page`: the explorer as one file, computed beforehand, that works wherever it is opened.

BokehJS, styles, script and all pictures are in it; a policy in its head forbids it to ask anything of
any host.  The same problem gives the same bytes.
"""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ... import __version__
from ...base.errors import InvalidInput, MissingExtra, NoEquilibrium
from ...base.files import atomic_write
from ...base.progress import progress
from ...base.units import display
from .precomputed import Relative, SliderPlace, places, relatives, solved, with_own
from .screen import Screen
from .state import State

#: Places along each branch.
POINTS = 48

#: Nothing is loaded and nothing is sent: what the page needs is in it.  BokehJS compiles the scripts.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline';"
    " img-src data: blob:; font-src data:; form-action 'none'; base-uri 'none'"
)

TEMPLATE = (
    '{% block preamble %}<meta http-equiv="Content-Security-Policy" content="' + POLICY + '">{% endblock %}'
)

_COUNTED = re.compile(r'"id":"(p\d+)"')

#: How Bokeh names models, by counting, and places in the page, by drawing lots.
_RANDOM = re.compile(r"""(?<=["'])(?:p\d+|[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12})(?=["'])""")


@dataclass
class Tally:
    """How far the pictures of a page are to be trusted."""

    asked: int = 0
    shown: int = 0
    certified: int = 0
    error: float = 0.0
    certificate: float = 0.0
    own: bool = False  # the state that was asked for is among them

    def add(self, scene: Screen | None) -> None:
        """Count a place, solved or not."""
        self.asked += 1
        if scene is None or scene.answer is None:
            return
        self.shown += 1
        self.certified += scene.answer.certified
        self.error = max(self.error, scene.answer.error)
        self.certificate = max(self.certificate, scene.answer.certificate)


def write_page(
    path: str | Path,
    state: State | None = None,
    *,
    values: Sequence[float] | None = None,
    points: int = POINTS,
) -> Path:
    """Write a page with rod, diagram, potential and loop, linked by a slider along the branch.

    Parameters
    ----------
    path : str or Path
        Ends in ".html"; a file there is replaced once the page is complete.
    state : State, optional
        What the page shows at first.  Everything is solved to the accuracy "standard".
    values : sequence of float, optional
        The beta0, or the eta/y0 of a rod, to choose from besides that of ``state``; a few around it
        without them.
    points : int, optional
        Most places along each branch.

    Returns
    -------
    Path

    Raises
    ------
    MissingExtra
        If Bokeh is not installed.
    InvalidInput
        If the file cannot be written, or ``values`` or ``points`` cannot be meant.
    NoEquilibrium
        If no place of the branches has an answer.

    Examples
    --------
    >>> write_page("flap.html", State(beta0=4.0, lam=-0.2))  # doctest: +SKIP
    """
    path = Path(path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise InvalidInput(f"a page is written to a file whose name ends in .html, got {path.name!r}.")
    if not 2 <= points <= 400:
        raise InvalidInput(f"a branch is shown at 2 to 400 places, got {points}.")
    try:
        import bokeh  # noqa: F401
    except ImportError as error:
        raise MissingExtra(
            "a page needs Bokeh, which is not installed.",
            remedy="Install it with: pip install 'peel_opt[explore]'",
        ) from error
    problems = relatives(state or State(), values)
    # The file is opened first: where it cannot be written, nothing is computed.
    return atomic_write(path, lambda file: file.write(_page(problems, points).encode()))


def _page(problems: tuple[Relative, ...], points: int) -> str:
    """Compute everything and return the page."""
    from .export_page import ExportPage

    page, tally = ExportPage(), Tally()
    planned: list[tuple[Relative, tuple[SliderPlace, ...], int]] = []
    for problem in problems:
        found = places(problem.state, points)
        start = 0
        if problem.asked:
            found, start, tally.own = with_own(found, problem.state)
        planned.append((problem, found, start))
    total = sum(len(found) for _, found, _ in planned)
    with progress("picture", total) as step:
        for problem, found, start in planned:
            first = None
            for number, place in enumerate(found):
                scene = solved(place)
                tally.add(scene)
                step()
                if scene is None:
                    continue
                at = page.take(scene)
                if problem.asked and (number <= start or first is None):
                    first = at
            page.close(problem.name, first)
    if not tally.shown:
        raise NoEquilibrium("none of the states along the branch could be solved, so there is no page.")
    return _as_html(page.finish(_words(problems), _caption(problems, tally)))


def _as_html(doc: Any) -> str:
    """Return a document as one page; names that Bokeh draws or counts are numbered anew."""
    from bokeh.embed import file_html
    from bokeh.resources import Resources

    text = file_html(
        doc, Resources(mode="inline", minified=True), template=TEMPLATE, suppress_callback_warning=True
    )
    counted = set(_COUNTED.findall(text))
    seen: dict[str, str] = {}

    def renamed(found: re.Match[str]) -> str:
        name = found[0]
        if name.startswith("p") and name not in counted:
            return name
        return seen.setdefault(name, f"m{len(seen)}")

    return _RANDOM.sub(renamed, text)


def _words(problems: tuple[Relative, ...]) -> str:
    """What the buttons choose."""
    state = problems[0].state
    if state.given == "groups":
        return "β₀ = (s̄/η)³"
    return "η/y₀" if state.units == "groups" else "η/y₀ (y₀)"


def _caption(problems: tuple[Relative, ...], tally: Tally) -> str:
    """What is shown, how far to trust it, and what made it, as markup."""
    state = next(p.state for p in problems if p.asked)
    law = "Linear law (Fig 2b)" if state.law == "linear" else "Law (8)"
    if state.given == "groups":
        what = "The paper's groups; the slider runs along the detached branch at fixed β₀, from T"
    elif state.units == "SI":
        numbers = ", ".join(
            f"{n} = {html.escape(display(v, u, 4))}"
            for n, v, u in (("k", state.k, "N m"), ("T₀", state.T0, "Pa"), ("y₀", state.y0, "m"))
        )
        what = f"A rod with {numbers}; the others differ in y₀. The slider runs along its branch, from T"
    else:
        what = "A rod, lengths in η, pressures in T₀; the slider runs along its branch, from T"
    left_out = tally.asked - tally.shown
    absent = f" The state asked for, {state.words} ({state.label}), is not on this branch."
    lines = [
        f"{what}. {law}, {state.convention} convention of the loop."
        + ("" if tally.own else html.escape(absent)),
        f"{tally.shown} states, solved beforehand by method “auto” to 1e-8: {tally.certified} certified,"
        f" largest error {tally.error:.0e}, largest certificate {tally.certificate:.0e}."
        + (f" {left_out} more had no answer and are left out." if left_out else ""),
        "Pictures hold 7 digits, the line on top all that are certain.",
        f"peel_opt {html.escape(__version__)}, “peel-opt explore --export”. Nothing is loaded or sent.",
    ]
    return "<br>".join(lines)
