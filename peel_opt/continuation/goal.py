"""How far along a branch to look, and what is found there or not: said once."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from ..base.errors import NoEquilibrium, NotConverged
from ..model.groups import PI4
from ..residual.closures import READINGS, Closure
from .primary import PrimaryBranch
from .special import Located

#: Points of a branch without an end (the linear law's) to look at when all states are wanted.
ENDLESS = 200

#: Share of pi^4 down to which lambda is followed: a branch without a fold comes ever nearer to -pi^4.
LOWEST = 0.999


@dataclass(frozen=True)
class Goal:
    """What is looked for along a branch.

    Parameters
    ----------
    target : Closure
        The given number, of a kind in `READINGS`.
    anywhere : bool
        Whether also the folded states are meant, beyond the minimum pressure.
    deadline : float
        Of ``time.perf_counter``, after which nothing is walked on.
    """

    target: Closure
    anywhere: bool = False
    deadline: float = math.inf

    def passed(self, branch: PrimaryBranch) -> bool:
        """Whether a walk has passed every state that may be meant."""
        s, target = branch.points[-1].scalars, self.target
        reached = READINGS[target.kind](s)
        if target.kind == "lam":
            return left_for_good(branch, (target.value, target.value))
        if branch.side < 0:
            return len(branch.points) > 1 and reached > target.value
        # p may fall for ever while the length grows.
        endless = not branch.family.law.branch_ends and len(branch.points) > ENDLESS
        if self.anywhere:
            return endless
        if branch.fold("LP-pressure") is not None:
            return True
        if target.kind == "pressure":
            return reached < target.value
        return s.pressure_ratio < 0.0 and reached > target.value if target.kind == "length" else endless

    def walk(self, branch: PrimaryBranch, enough: Callable[[], bool] | None = None) -> None:
        """Walk on until it has, or until ``enough`` is true, or until the time is up."""
        far = enough or (lambda: self.passed(branch))
        branch.extend(lambda _: far() or time.perf_counter() > self.deadline)

    def cut_short(self, branch: PrimaryBranch) -> bool:
        """Whether the time was up before a walk had passed every state that may be meant."""
        return not branch.ended and not self.passed(branch)


def left_for_good(branch: PrimaryBranch, window: tuple[float, float]) -> bool:
    """Whether a walk is past the upper border of a window of lambda, or past the lower one for good.

    It comes back over the lower one where it has a fold still to turn at.
    """
    low, high = window
    if len(branch.points) < 2:
        return False
    before, lam = (p.scalars.lam for p in branch.points[-2:])
    if lam > high:
        return lam > before  # what begins above the window may come down to it
    return lam < -LOWEST * PI4 or (bool(branch.folds) and lam < min(low, before))


def below_zero(branch: PrimaryBranch) -> bool:
    """Whether a rod's branch has reached p < 0 under a law that lets it, where it may have no end."""
    return not branch.family.law.branch_ends and branch.points[-1].scalars.pressure_ratio < 0.0


def minimum_pressure(branch: PrimaryBranch) -> Located:
    """Walk a rod's branch to its first fold in pressure.

    Raises
    ------
    NoEquilibrium
        If the branch ends without one.
    NotConverged
        If the walk stalls before.
    """
    fold = branch.continue_to("LP-pressure")
    if fold is not None:
        return fold
    ratio, law = branch.family.closure.value, branch.family.law
    if branch.ended == "contact":
        raise NoEquilibrium(
            f"under law {law.name!r} the branch at eta/y0 = {ratio:.4g} has no minimum of the pressure.",
            remedy="Law (8) has one.",
        )
    raise NotConverged(
        f"the minimum pressure at eta/y0 = {ratio:.4g} was not reached.",
        remedy="Check that the ratio lies between 0.005 and 3000; laws other than (8) may have none.",
    )
