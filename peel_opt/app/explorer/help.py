"""What the page says about itself: its title, a sentence for each panel, what the letters mean."""

from __future__ import annotations

import html

from bokeh.models import Div, InlineStyleSheet

from ...model.labels import SPECIAL_KINDS
from ...plots.potential import NAMED
from ...plots.words import plain, typeset
from . import look

TITLE = "A rod on a sticky plate"

PURPOSE = (
    "Pressure lifts the end of a rod that is bonded to a plate. Choose the rod and the load: the four panels"
    " show one state, the orange dot, in four ways."
)

#: A sentence for each panel, by the name of its figure.
CAPTIONS = {
    "rod": "The shape of the rod and what acts on it; y₀ is how far above the plate the bond reaches.",
    "diagram": "All states along the branch: solid where stable, dashed where not. Click one to see it.",
    "potential": "A state is where the curve is level. A ball stays in a valley and rolls off a hilltop.",
    "motion": "The detached length, and where the tip is, as the rod moves.",
    "ledger": "The work of the pressure since the start, and what has become of it; the parts add up to it.",
    "loop": "A cycle of the load: the rod snaps off at one value and back at another. Play the sweep.",
}


#: What is said otherwise on a page that was computed beforehand.
WRITTEN_PURPOSE = (
    "Pressure lifts the end of a rod that is bonded to a plate. Choose a problem and move along its branch:"
    " the four panels show one state, the orange dot, in four ways."
)
_LOOP = "A cycle of the load: the rod snaps off at one value and back at another."
WRITTEN_CAPTIONS = CAPTIONS | {"loop": _LOOP}


def letters() -> dict[str, str]:
    """Return the letters of the panels, with what each means."""
    named = {SPECIAL_KINDS["BP"].letter: f"transition: {SPECIAL_KINDS['BP'].words}"}
    named |= {letter: meaning for letter, _, meaning in NAMED.values()}
    kinds = (SPECIAL_KINDS[kind] for kind in ("y=y0", "LP-pressure", "contact", "self-contact"))
    named |= {kind.letter: kind.words for kind in kinds}
    named["P"] += ": the least that holds the rod off; of one that is lifted from rest, first the most"
    return {letter: plain(typeset(meaning)) for letter, meaning in named.items()}


def header(purpose: str) -> Div:
    """Return the title of the page, what it is for, and the letters, which open when asked for."""
    rows = "".join(
        f"<div><dt>{html.escape(letter)}</dt><dd>{html.escape(meaning)}</dd></div>"
        for letter, meaning in letters().items()
    )
    return Div(
        text=f"<h1>{TITLE}</h1><p>{purpose}</p><details><summary>Letters in the panels: "
        f"{' '.join(letters())}</summary><dl>{rows}</dl></details>",
        name="header",
        sizing_mode="stretch_width",
        stylesheets=[InlineStyleSheet(css=look.HEADER)],
    )


def caption(name: str, text: str) -> Div:
    """Return the sentence that stands under a panel."""
    return Div(text=text, name=f"caption-{name}", stylesheets=[InlineStyleSheet(css=look.CAPTION)])
