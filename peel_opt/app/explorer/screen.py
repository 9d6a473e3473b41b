"""`Screen`: the four linked panels of a `State`, what each cost, and what must be said about them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from ...equilibria.result import Equilibrium
from ...plots.loop import CONVENTIONS, area_of
from ...plots.panels import Panel
from ...plots.words import plain, symbol
from .answers import Found
from .curves import Curve
from .loops import LoopSweep
from .state import Convention, State
from .words import AnswerText, answer_of


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
    found : Found
        What the question came to.
    seconds : float
        Time it took to compute all of it.
    rod : Panel or None
        None where the state does not exist.
    curve : Curve or None
        The branch that the diagram shows, where it is that of the state.
    diagram, potential : Panel or None
    reading : str
        Under which control the diagram reads stability.
    here : tuple of float or None
        Where the state is on the diagram.
    off_branch : float
        Distance of the state from the branch, in shares of the picture; NaN where there is no state.
    swept : LoopSweep or str
        The loop, or why there is none.
    convention : {"delay", "maxwell"}
        Of the loop.
    potential_by : str
        What the potential comes from.
    potential_part : Part or None
        What it cost.
    no_potential, no_diagram : str
        Why there is none.
    warnings : tuple of str
        Where a picture leaves its range.
    solving : bool
        Whether the state is still looked for, so that nothing is said of it.
    """

    state: State
    full: bool
    found: Found
    seconds: float
    rod: Panel | None
    curve: Curve | None
    diagram: Panel | None
    reading: str
    here: tuple[float, float] | None
    off_branch: float
    swept: LoopSweep | str
    convention: Convention = "delay"
    potential: Panel | None = None
    potential_by: str = ""
    potential_part: Part | None = None
    no_potential: str = ""
    no_diagram: str = ""
    warnings: tuple[str, ...] = ()
    solving: bool = False

    @property
    def equilibrium(self) -> Equilibrium | None:
        """The answer itself."""
        return self.found.equilibrium

    @property
    def answer(self) -> AnswerText | None:
        """The answer in words."""
        return None if self.equilibrium is None else answer_of(self.equilibrium)

    @property
    def message(self) -> str:
        """That the state does not exist, and what does; empty if all is well."""
        return self.found.message

    @property
    def nearest(self) -> State | None:
        """The nearest state that exists, where this one does not."""
        return self.found.nearest

    @property
    def sweep(self) -> LoopSweep | None:
        """The loop itself."""
        return None if isinstance(self.swept, str) else self.swept

    @property
    def no_loop(self) -> str:
        """Why there is none."""
        return self.swept if isinstance(self.swept, str) else ""

    @cached_property
    def loop(self) -> Panel | None:
        """Its picture; the axes of a loop in the pressure are those of the diagram, exchanged."""
        if self.sweep is None:
            return None
        turned = self.state.rod is not None and self.here is not None
        return replace(self.sweep.panel, here=self.here[::-1] if turned and self.here else self.here)

    @cached_property
    def headings(self) -> dict[str, str]:
        """Of "diagram", "potential" and "loop"."""
        found = {
            "diagram": f"Bifurcation diagram, stability {plain(self.reading)}",
            "potential": f"Effective potential (35){self.potential_by}",
            "loop": "Hysteresis loop",
        }
        if self.sweep is not None:
            own = self.state.rod
            unit = 1.0 if own is None else own.adhesion_strength * own.eta
            area = f"{area_of(self.sweep.loop, unit)}{' T₀ η' if own else ''}"
            found["loop"] += f", {CONVENTIONS[self.convention]}, area {area}"
        return found

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """What each panel cost and how far to trust it."""
        eq, curve = self.equilibrium, self.curve
        found = [Part("state", eq.stats.method if eq else "none", self.found.seconds, _error_of(eq))]
        if curve is not None:
            estimate = "about " if curve.method.startswith("quick") else ""
            error = f"{estimate}{curve.error:.0e} in arclength"
            found.append(Part("diagram", curve.method, curve.seconds, error))
        return (*found, *([] if self.potential_part is None else [self.potential_part]))


def _error_of(eq: Equilibrium | None) -> str:
    """Return the error of an answer in words, with what it is the error of."""
    if eq is None:
        return "-"
    return f"{eq.error:.0e} in {symbol(eq.answered)}"
