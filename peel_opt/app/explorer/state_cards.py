"""States from problem cards, and back as cards that `peel-opt run` answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...base.errors import InvalidInput
from ...equilibria.question import rod_questions
from ...model.groups import PI4
from ...model.rod import Rod
from ..scene_table import SET
from .setups import SETUPS, setup_of
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
        lines += _scene_table(state)
        own = () if state.rods_scene is None else SETUPS[state.scene].numbers
        sourced = [*numbers, *(each.name for each in own if each.name not in SET)]
        lines += ["", "[estimates]", *(f'{n} = "{TYPED}"' for n in sourced)]
        lines += [
            "",
            "[[questions]]",
            f"{state.given} = {state.value!r}  # {state.asks.given.dimension.unit}",
        ]
    else:
        lines += ["[rod]", f"ratio = {state.ratio!r}", *_scene_table(state), "", "[[questions]]"]
        unit = state.asks.given.dimension.unit_of(Rod.from_ratio(state.ratio))
        lines.append(f"{state.given} = {state.value!r}  # in units of {unit}")
    if state.rods_scene is None:  # which has its own law
        lines.append(f'law = "{state.named_law}"')
    if state.label != "unfolded":
        lines.append(f'state = "{state.label}"')
    if state.near is not None:
        lines.append(f"near = {state.near!r}")
    return "\n".join([*lines, f'method = "{method}"', f"tol = {tol!r}", ""])


def _scene_table(state: State) -> list[str]:
    """Return the lines of ``[scene]``."""
    rod = state.rod
    if rod is None or state.rods_scene is None:
        return []
    numbers = [
        f"{each.name} = {getattr(state, each.name)!r}  # {each.dimension.unit_of(rod)}"
        for each in SETUPS[state.scene].numbers
    ]
    return ["", "[scene]", f'law = "{state.named_law}"', *numbers]


def from_card(card: Card) -> State:
    """Return the state that answers the first question of a card about an equilibrium.

    Raises
    ------
    InvalidInput, OutOfRange
        If the card lies outside what the explorer shows.
    """
    scene = card.scene()
    found = None if scene is None else setup_of(scene)
    asked_of_states = (q for q in card.questions if q.flaw is None and q.free is None)
    question = next(asked_of_states, None)
    if question is None or (scene is not None and found is None):
        raise InvalidInput(
            "the explorer shows the length at a pressure, or the pressure at a length, and beside the"
            " pressure a flaw, a wall, a force on the tip, a weight or drag alone; this card asks for more.",
            remedy="Answer it with peel-opt run.",
        )
    posed = question.pose(card.problem)
    given: dict[str, Any] = dict(posed.keywords)
    rod = card.rod()
    default = "linear" if rod is None else "auto"
    law = given.get("law", default) if scene is None else scene.law
    law = "linear" if law == "linear" or getattr(law, "name", "") == "linear" else "cohesive"
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
    if found is not None:
        common |= {"scene": found[0], **found[1]}
    return start.changed(given=asked, **both, **common)
