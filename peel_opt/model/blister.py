"""A blister: a strip between two edges that lifts in its middle."""

from __future__ import annotations

from dataclasses import dataclass

from ..base.errors import InvalidInput
from .scene import Scene
from .tips import FREE, Middle


@dataclass(frozen=True)
class Blister(Scene):
    """Half of a strip that is symmetric about its middle, on a flat plate.

    s runs from the middle, where theta = 0 and N_y = 0, to one edge; the detached length is half of the
    strip's, and what acts on this half acts on the other as its mirror image.  A strip lifts only if it has
    some length to spare, so one of ``roller``, ``slack`` and ``stretch`` is given; the latter two may be
    both.  A constant natural curvature does nothing to it, and its tip is its middle.

    Parameters
    ----------
    rod, loads, unbonded, line_energy, glued_strain
        As in `Scene`; ``unbonded`` counts from the middle.
    law : CohesiveLaw, Bond or str
        As in `Scene`; but where the strip stretches "auto" is "none", the clamped blister of fracture
        mechanics that its line energy alone holds.
    roller : float, optional
        The axial force N_x [N/m] in the middle, compression positive, of a strip whose ends slide in
        freely (0) or are pushed in.  The flat strip is an equilibrium; it is left at
        sbar = 3.9266 (k y0/T0)^(1/4) under p = T0 if the force is zero.
    slack : float, optional
        Length d [m] that half of the strip has more than the plate under it: x(sbar) - x(0) = sbar - d.
        It stays as the front moves; the axial force follows ("thrust" among the numbers of an answer).
    stretch : float, optional
        EA [N/m] of a strip that stretches between clamped edges; needs a ``line_energy``.

    Raises
    ------
    InvalidInput
        If there is nothing that the strip could lift with, or two things.
    """

    roller: float | None = None
    slack: float | None = None

    def __post_init__(self) -> None:
        slack = self.slack
        if self.stretch is not None:
            slack = slack if slack is not None or self.roller is not None else 0.0
            if isinstance(self.law, str) and self.law == "auto":
                object.__setattr__(self, "law", "none")
        elif slack is None and self.roller is None:
            raise InvalidInput(
                "a blister takes one of roller=, slack= and stretch=.",
                remedy="A strip that cannot stretch and has neither stays flat for ever, at any pressure.",
            )
        elif slack == 0.0:
            raise InvalidInput(
                "a blister that cannot stretch and has no slack stays flat for ever, at any pressure.",
                remedy="Give a positive slack=, roller= for ends that may slide in, or stretch=.",
            )
        middle = Middle(self.roller, slack)
        if self.tip not in (FREE, middle):
            raise InvalidInput("the tip of a blister is its middle.", remedy="Leave out tip=.")
        object.__setattr__(self, "tip", middle)
        super().__post_init__()
