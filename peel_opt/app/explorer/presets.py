"""Problems to begin with: the paper's figures, and the rods of the cards in ``problems/``."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from ...base.errors import PeelOptError
from .state import State
from .state_cards import from_card

#: States of the paper's figures, at their beta0.
FIGURES = {
    "Figure 3 (a): acceptable, 0 ≤ y ≤ y₀": State(beta0=4.0, lam=-0.24, label="lower"),
    "Figure 3 (c): y > y₀ near the tip": State(beta0=4.0, lam=0.25, label="lower"),
    "Figure 3 (e): y < 0": State(beta0=4.0, lam=0.25, label="spurious"),
    "Figure 5 (a): β₀ = 0": State(beta0=0.0, lam=0.25),
    "Figures 5 (b), 7: β₀ = 4": State(beta0=4.0, lam=-0.1),
    "Figure 6: β₀ = 10": State(beta0=10.0, lam=-1.0),
}

#: A rod with eta/y0 = 1 in each scene.
ROD = State(given="pressure", law="cohesive")
SCENES = {
    "An edge never glued, of 0.5 η": ROD.staged("flaw"),
    "Outside a cylinder of radius 10 η": ROD.staged("wall"),
    "Inside a pipe of radius 10 η": ROD.changed(scene="wall", curvature=0.1),
    "Pulled straight up at the tip": ROD.staged("force"),
    "Under its weight": ROD.staged("weight"),
    "Dragged along the plate": ROD.staged("drag"),
}

#: Where the cards are: in an installed package, or beside it where it is worked on.
_FOLDERS = tuple(folder / "problems" for folder in Path(__file__).parents[2:4])


@lru_cache(maxsize=1)
def presets() -> dict[str, dict[str, State]]:
    """Return states to begin with, by name, in groups with a heading.

    A card that the explorer cannot show, such as one with measurements, is left out.
    """
    from ..cards import load_card

    cards: dict[str, State] = {}
    for path in next((sorted(folder.glob("*.toml")) for folder in _FOLDERS if folder.is_dir()), []):
        try:
            card = load_card(path)
            cards[card.title or path.stem] = from_card(card)
        except PeelOptError:
            continue
    return {"Figures of the paper": FIGURES, "Scenes": SCENES, "Cards of problems/": cards}


def begun(name: str, state: State) -> State | None:
    """Return the state of a name, with convention and accuracy as they are; None if there is none."""
    found = next((group[name] for group in presets().values() if name in group), None)
    return None if found is None else _like(found, state)


def name_of(state: State) -> str:
    """Return the name whose state this is; "" where it has been moved away from all."""
    named = {name: each for group in presets().values() for name, each in group.items()}
    return next((name for name, each in named.items() if _like(each, state) == state), "")


def _like(preset: State, state: State) -> State:
    return replace(preset, convention=state.convention, accuracy=state.accuracy)
