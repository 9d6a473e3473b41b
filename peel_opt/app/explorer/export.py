"""`write_page`: the explorer as one file, computed beforehand, that works wherever it is opened.

BokehJS, styles, script and all pictures are in it; a policy in its head forbids it to ask anything of
any host.  The same problem gives the same bytes.
"""

from __future__ import annotations

import html
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import __version__
from ...base.errors import InvalidInput, MissingExtra, NoEquilibrium, PeelOptError
from ...base.files import atomic_write
from ...base.progress import progress
from ...base.units import display
from . import look
from .precomputed import Relative, SliderPlace, beginnings, places, relatives, solved, with_own
from .presets import presets
from .setups import SETUPS
from .state import State

if TYPE_CHECKING:
    from .export_page import Chosen

#: Places along each branch, and along that of a problem to begin with.
POINTS, PRESET_POINTS = 48, 12

#: Nothing is loaded and nothing is sent: what the page needs is in it.  BokehJS compiles the scripts.
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline';"
    " img-src data: blob:; font-src data:; form-action 'none'; base-uri 'none'"
)

TEMPLATE = (
    '{% block preamble %}<meta http-equiv="Content-Security-Policy" content="'
    + POLICY
    + f'">{look.VIEWPORT}{{% endblock %}}'
)

_COUNTED = re.compile(r'"id":"(p\d+)"')

#: How Bokeh names models, by counting, and places in the page, by drawing lots.
_RANDOM = re.compile(r"""(?<=["'])(?:p\d+|[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12})(?=["'])""")


def write_page(
    path: str | Path,
    state: State | None = None,
    *,
    values: Sequence[float] | None = None,
    points: int = POINTS,
    begin: Mapping[str, Mapping[str, State]] | None = None,
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
    begin : mapping, optional
        Further problems by heading and name, each at `PRESET_POINTS` places at most, or ``points`` if that is
        less; without it those that the explorer begins with, and none if it is empty.

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
    start = state or State()
    known = presets() if begin is None else begin
    problems = (*relatives(start, values), *beginnings(start, known))
    # The file is opened first: where it cannot be written, nothing is computed.
    return atomic_write(path, lambda file: file.write(_page(problems, points).encode()))


def _page(problems: tuple[Relative, ...], points: int) -> str:
    """Compute everything and return the page."""
    from .export_page import Chosen, document

    planned, own = [], False
    for problem in problems:
        found, at, is_own = _planned(problem, points)
        planned.append((found, at))
        own |= problem.asked and is_own
    asked, shown = sum(len(found) for found, _ in planned), []
    with progress("picture", asked) as step:
        for problem, (found, at) in zip(problems, planned, strict=True):
            numbered = []
            for number, place in enumerate(found):
                numbered.append((number, solved(place)))
                step()
            there = [(number, screen) for number, screen in numbered if screen is not None]
            # It opens at the state asked for, or as little before it as there is one.
            opens = max(sum(number <= at for number, _ in there) - 1, 0)
            screens = [screen for _, screen in there]
            if there:
                shown.append(Chosen(problem.name, screens, opens, problem.asked, problem.heading))
    if not any(not chosen.heading for chosen in shown):
        raise NoEquilibrium("none of the states along the branch could be solved, so there is no page.")
    state = next(p.state for p in problems if p.asked)
    return _as_html(document(shown, _words(state), _caption(state, shown, asked, own)))


def _planned(problem: Relative, points: int) -> tuple[tuple[SliderPlace, ...], int, bool]:
    """Return the places of a problem, the one at which it opens, and whether that is its own state.

    A problem to begin with whose state is not on the branch is left out: another would be shown in its name.
    """
    if not problem.heading:
        found = places(problem.state, points)
        return with_own(found, problem.state) if problem.asked else (found, 0, False)
    try:
        found = places(problem.state, min(points, PRESET_POINTS))
    except PeelOptError:
        return (), 0, False
    found, at, is_own = with_own(found, problem.state)
    return (found, at, True) if is_own else ((), 0, False)


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


def _words(state: State) -> str:
    """What the buttons choose."""
    if state.rods_scene is not None:
        return SETUPS[state.scene].words
    if state.given == "groups":
        return "β₀ = (s̄/η)³"
    return "η/y₀" if state.units == "groups" else "η/y₀ (y₀)"


def _caption(state: State, shown: Sequence[Chosen], asked: int, own: bool) -> str:
    """What is shown, how far to trust it, and what made it, as markup.

    ``asked`` counts the places that were looked for; ``own`` is whether the state asked for is among them.
    """
    answers = [screen.answer for chosen in shown for screen in chosen.screens if screen.answer is not None]
    certified = sum(answer.certified for answer in answers)
    error, certificate = (max(getattr(a, name) for a in answers) for name in ("error", "certificate"))
    law = "Linear law (Fig 2b)" if state.law == "linear" else "Law (8)"
    if state.rods_scene is not None:
        what = f"A rod with {html.escape(state.words)}; the slider runs along the branch of its scene"
    elif state.given == "groups":
        what = "The paper's groups; the slider runs along the detached branch at fixed β₀, from T"
    elif state.units == "SI":
        numbers = ", ".join(
            f"{n} = {html.escape(display(v, u, 4))}"
            for n, v, u in (("k", state.k, "N m"), ("T₀", state.T0, "Pa"), ("y₀", state.y0, "m"))
        )
        what = f"A rod with {numbers}; the others differ in y₀. The slider runs along its branch, from T"
    else:
        what = "A rod, lengths in η, pressures in T₀; the slider runs along its branch, from T"
    left_out = asked - len(answers)
    absent = f" The state asked for, {state.words} ({state.label}), is not on this branch."
    lines = [
        f"{what}. {law}, {state.convention} convention of the loop." + ("" if own else html.escape(absent)),
        f"{len(answers)} states, solved beforehand by method “auto” to 1e-8: {certified} certified,"
        f" largest error {error:.0e}, largest certificate {certificate:.0e}."
        + (f" {left_out} more had no answer and are left out." if left_out else ""),
        "Pictures hold 7 digits, the line on top all that are certain.",
        f"peel_opt {html.escape(__version__)}, “peel-opt explore --export”. Nothing is loaded or sent.",
    ]
    return "<br>".join(lines)
