"""What the explorer says: the answer in numbers, and where a picture leaves its range."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...analysis.maxwell import TURN
from ...base.units import display_with_error, told_apart
from ...continuation.landing import UNFINISHED
from ...equilibria.question import answering
from ...equilibria.result import Equilibrium
from ...model.labels import FLAGS
from ...plots.words import plain, symbol, typeset
from .curves import Curve
from .potential import Landscape
from .state import State

#: What to do about a flag, where something can be done.
ADVICE = {"y > y0": " Try law (8)."}

OFF_BRANCH = "This state is not on the branch that leaves T."


@dataclass(frozen=True)
class AnswerText:
    """The answered state in numbers and words."""

    headline: str
    numbers: tuple[tuple[str, str], ...]
    label: str
    law: str
    certified: bool
    error: float
    certificate: float


#: Share of the state's alpha1 by which the potential may miss it without a word.
_OFF = 0.02


def answer_of(eq: Equilibrium) -> AnswerText:
    """Return the answer in numbers, with the units of its rod."""
    written = symbol(eq.answered)
    if eq.rod is not None and not eq.rod.dimensionless:
        asked = answering(eq.answered).asked
        value, error = (asked.from_ratio(eq.rod, number) for number in (eq.answer, eq.error))
        headline = f"{written.partition('/')[0]} = {display_with_error(value, error, asked.dimension.unit)}"
    else:
        headline = f"{written} = {eq.answer:.{_digits(eq)}g} ± {eq.error:.0e}"
    # The groups are the paper's, of its own scene.
    pairs = [("β₀", eq.beta0), ("λ", eq.lam), ("α₁", eq.alpha1)] if eq.scene is None else []
    if eq.beta0:
        pairs += [("p/T₀", eq.pressure_ratio), ("s̄/η", eq.length_ratio), ("η/y₀", eq.ratio)]
    return AnswerText(
        headline=headline,
        numbers=tuple((name, f"{value:.6g}") for name, value in pairs),
        label=eq.state,
        law=eq.law,
        certified=eq.certified,
        error=eq.error,
        certificate=eq.certificate,
    )


def why_no_branch(beta0: float, full: bool) -> str:
    """Say why the potential does not come from a solved branch."""
    if beta0 >= TURN:
        mine, last = told_apart(beta0, TURN)
        return f"β₀ = {mine} is above {last}: the branch from T has no fold there."
    return "No solved branch round its fold is known here." if full else "A solved one comes at rest."


def _digits(eq: Equilibrium) -> int:
    """As many digits as the error leaves, 12 at most."""
    if not math.isfinite(eq.error):
        return 2
    if not eq.answer or not eq.error:
        return 12
    return min(max(math.floor(math.log10(abs(eq.answer) / eq.error)) + 1, 2), 12)


def flags_said(eq: Equilibrium | None) -> list[str]:
    """Return what is the matter with a state."""
    flags = eq.flags if eq else ()
    return [f"{plain(typeset(FLAGS[flag]))}.{ADVICE.get(flag, '')}" for flag in flags if flag in FLAGS]


def warnings_of(
    state: State, eq: Equilibrium | None, curve: Curve, land: Landscape | None, off: float, full: bool
) -> tuple[str, ...]:
    """Return what must be said beside the pictures."""
    said = flags_said(eq)
    if eq is not None and eq.state == "other":
        said.append(OFF_BRANCH)
    beta0 = state.beta0 if state.given == "groups" else (eq.beta0 if eq else 0.0)
    if land is not None and land.source.startswith("normal form"):
        said.append(f"The potential is that of the normal form (33). {why_no_branch(beta0, full)}")
    elif land is not None and land.missing:
        missing = " and ".join(land.missing)
        said.append(f"Not on this potential: {missing}; the branch it comes from is not known that far.")
    elif land is not None and eq is not None and math.isfinite(off) and off > _OFF * abs(eq.alpha1):
        said.append(f"The ball is not at a critical point: the potential misses the solved α₁ by {off:.2g}.")
    if not curve.ended:
        branch = curve.branch
        last = float(branch.pressure_ratio[-1])
        where = f"to p/T₀ = {last:.3g}" if branch.rod is not None else f"to λ = {float(branch.lam[-1]):.3g}"
        said.append(f"The branch is drawn {where} so far; the rest comes when the slider rests.")
    elif curve.ended in UNFINISHED:
        said.append("The branch was followed only this far.")
    if state.given != "groups" and curve.branch.index is None and full:
        said.append("Stability of the folded part is not computed at this accuracy.")
    return tuple(said)
