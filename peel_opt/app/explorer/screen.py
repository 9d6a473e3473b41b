"""`Screen`: the four linked panels of a `State`, what each cost, and what must be said about them."""

from __future__ import annotations

from dataclasses import dataclass

from ...equilibria.result import Equilibrium
from ...plots.panels import Panel
from ...plots.words import symbol
from .curves import Curve
from .loops import LoopSweep
from .state import State
from .words import AnswerText


@dataclass(frozen=True)
class Part:
    """What one part of the picture cost, and how far to trust it.

    ``error`` is the estimate in words, with what it is the error of; ``seconds`` the time of the
    computation, also where its result was remembered from before.
    """

    name: str
    method: str
    seconds: float
    error: str


@dataclass(frozen=True, eq=False)
class Screen:
    """Everything on the screen.

    Parameters
    ----------
    state : State
    full : bool
        Whether it was solved and traced to the accuracy asked for; otherwise it is what could be
        had while a slider moved.
    answer : AnswerText or None
    rod : Panel or None
        None where the state does not exist.
    diagram, potential, loop : Panel or None
    sweep : LoopSweep or None
        The loop itself.
    headings : dict of str
        Of "diagram", "potential" and "loop".
    solving : bool
        Whether the state is still looked for, so that nothing is said of it.
    message : str
        That the state does not exist, and what does; empty if all is well.
    warnings : tuple of str
        Where a picture leaves its range.
    nearest : State or None
        The nearest state that exists, where this one does not.
    no_loop, no_potential, no_diagram : str
        Why there is none.
    parts : tuple of Part
        What each panel cost and how far to trust it.
    seconds : float
        Time it took to compute all of it.
    equilibrium : Equilibrium or None
        The answer itself.
    curve : Curve or None
        The branch that the diagram shows, where it is that of the state.
    off_branch : float
        Distance of the state from it, in shares of the picture; NaN where there is no state.
    """

    state: State
    full: bool
    answer: AnswerText | None
    rod: Panel | None
    diagram: Panel | None
    potential: Panel | None
    loop: Panel | None
    sweep: LoopSweep | None
    headings: dict[str, str]
    message: str
    warnings: tuple[str, ...]
    nearest: State | None
    no_loop: str
    no_potential: str
    parts: tuple[Part, ...]
    seconds: float
    equilibrium: Equilibrium | None
    curve: Curve | None
    off_branch: float
    no_diagram: str = ""
    solving: bool = False


def error_of(eq: Equilibrium | None) -> str:
    """Return the error of an answer in words, with what it is the error of."""
    if eq is None:
        return "-"
    return f"{eq.error:.0e} in {symbol(eq.answered)}"
