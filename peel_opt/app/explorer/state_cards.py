"""States from problem cards, and back as cards that `peel-opt run` answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...base.errors import InvalidInput
from ...equilibria.question import rod_questions
from ...model.groups import PI4
from .state import METHODS, State

if TYPE_CHECKING:
    from ..cards import Card

#: Where the numbers of a rod come from that somebody typed.
TYPED = "set in peel-opt explore"


def to_card(state: State) -> str:
    """Return a card (TOML) whose only question has the state as its answer.

    Raises
    ------
    InvalidInput
        For the adhered rod, about which there is no question.
    """
    if state.label == "adhered":
        raise InvalidInput(
            "the adhered rod is straight: there is no question about it.",
            remedy="Pick a detached state, then take the card.",
        )
    method, tol = METHODS[state.accuracy]
    lines = ['title = "A state of the explorer"', ""]
    if state.given == "groups":
        lines += ["[groups]", f"beta0 = {state.beta0!r}", f"lam = {state.lam!r}", "", "[[questions]]"]
    elif state.units == "SI":
        numbers = {"bending_stiffness": state.k, "adhesion_strength": state.T0, "adhesion_range": state.y0}
        units = ("N m", "Pa", "m")
        lines += ["[rod]", *(f"{n} = {v!r}  # {u}" for (n, v), u in zip(numbers.items(), units, strict=True))]
        lines += ["", "[estimates]", *(f'{n} = "{TYPED}"' for n in numbers)]
        lines += ["", "[[questions]]", f"{state.given} = {state.value!r}  # {state.asks.given.unit}"]
    else:
        lines += ["[rod]", f"ratio = {state.ratio!r}", "", "[[questions]]"]
        lines.append(f"{state.given} = {state.value!r}  # in units of {state.asks.given.own}")
    lines.append(f'law = "{state.named_law}"')
    if state.label != "unfolded":
        lines.append(f'state = "{state.label}"')
    if state.near is not None:
        lines.append(f"near = {state.near!r}")
    return "\n".join([*lines, f'method = "{method}"', f"tol = {tol!r}", ""])


def from_card(card: Card) -> State:
    """Return the state that answers the first question of a card.

    Raises
    ------
    InvalidInput, OutOfRange
        If the card lies outside what the explorer shows.
    """
    question = card.questions[0]
    if card.scene_table is not None or question.flaw is not None or question.free is not None:
        raise InvalidInput(
            "the explorer shows the paper's scene only, and this card asks about another, or about a flaw.",
            remedy="Answer it with peel-opt run.",
        )
    posed = question.pose(card.problem)
    given: dict[str, Any] = dict(posed.keywords)
    rod = card.rod()
    law = "linear" if given.get("law", "linear" if rod is None else "auto") == "linear" else "cohesive"
    common: dict[str, Any] = {"law": law, "label": given.get("state") or "unfolded", "near": given["near"]}
    if rod is None:
        lam = given["lam"] if given["lam"] is not None else given["beta1"] - PI4
        return State(beta0=given["beta0"], lam=lam, **common)
    asked = next(name for name in rod_questions() if question.given.startswith(name))
    start = (
        State(ratio=rod.ratio)
        if rod.dimensionless
        else State(
            units="SI",
            given="length",
            k=rod.bending_stiffness,
            T0=rod.adhesion_strength,
            y0=rod.adhesion_range,
        )
    )
    # The number that is not given starts at a state that exists.
    unit = rod
    both = {"length": unit.length(1.01 * unit.critical_length / unit.eta), "pressure": unit.pressure(0.5)}
    both[asked] = posed.args[-1]
    return start.changed(given=asked, **both, **common)
