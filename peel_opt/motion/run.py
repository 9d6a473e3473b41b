"""What is handed to a run of the rod in motion, and what every run hands back, whichever way it computes.

All in units of eta, T0 and the time tau of the run: sqrt(rho eta/T0) where the rod has mass, so that
its mass is 1, else c eta/T0, so that its drag is 1.  Energies are in T0 eta^2.  Arc length s runs from
the tip to the front, 0 <= s <= sbar, and x along the plate from where the tip was before it let go: an
attached point has x = s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..model.bond import CohesiveLaw
from .acting import PRESSURE_ALONE, Loads
from .trajectory import Happening, Ledger, TipPath

#: What is called with the time that a run has come to.
Told = Callable[[float], object]

#: Parts in which the way to a likely end is told.
PARTS = 100


@contextmanager
def in_parts(step: Callable[[int], object], likely: float) -> Iterator[Told]:
    """Yield what tells how far runs are on the way to their likely end, in `PARTS` steps, and tell the rest.

    A time before the last begins another run, such as that at the next resolution: how many there will be is
    not known, and each has half of what is left.
    """
    done, begun, last = 0, 0.0, -math.inf

    def reached(t: float) -> None:
        nonlocal done, begun, last
        if t < last:
            begun = done / PARTS
        last = t
        now = int(PARTS * (begun + 0.5 * (1.0 - begun) * min(t / likely, 1.0)))
        if now > done:
            step(now - done)
            done = now

    yield reached
    step(PARTS - done)


@dataclass(frozen=True)
class Setting:
    """What drives the rod and what resists.

    Parameters
    ----------
    ratio : float
        eta/y0.
    law : CohesiveLaw
    pressure : float
        p/T0, held from the start on.
    mass, drag : float
        Per area; one of them is 1, the unit of time.  The drag is a force -c r_t per length.
    bond : str
        One of `BONDS`.
    length : float
        Of the whole rod, over eta.
    loads : Loads
        What acts on it.
    """

    ratio: float
    law: CohesiveLaw
    pressure: float
    mass: float
    drag: float
    bond: str = "reversible"
    length: float = np.inf
    loads: Loads = PRESSURE_ALONE


@dataclass(frozen=True)
class Until:
    """When a run ends, if nothing that it cannot go beyond ends it before.

    Parameters
    ----------
    time : float
    contact : bool
        At the first touch of the tip on the plate.
    arrest : bool
        Where nothing moves any more.
    arc : bool
        Where an arc between tip and front has come down into the range of the bond, if the front is tracked:
        as a rule it goes on to the plate, and to see it there takes longer than all before.
    """

    time: float
    contact: bool = True
    arrest: bool = True
    arc: bool = False


@dataclass(frozen=True, eq=False)
class Posture:
    """Where a run begins: the detached part at one time.

    Parameters
    ----------
    s : ndarray, shape (m,)
        From 0 at the tip to the front.
    theta : ndarray, shape (m,)
        Angle there; zero at the front.
    spin : ndarray, shape (m,)
        Its rate at a fixed s; what a rod without mass does not remember.
    t : float
    """

    s: np.ndarray
    theta: np.ndarray
    spin: np.ndarray
    t: float = 0.0


@dataclass(frozen=True, eq=False)
class Track:
    """What a run went through.

    Parameters
    ----------
    t, front : ndarray, shape (n,)
        Times, and sbar.
    tip : TipPath
        Height, place along the plate and angle of the tip, each (n,).
    fraction : ndarray, shape (m,)
        s/sbar of the points of a shape, from 0 to 1.
    x, y, theta : ndarray, shape (n, m)
        The shapes.
    energy : Ledger
        Each column (n,); work, drag and bond loss counted from the start of the run.
    identity : ndarray, shape (n,)
        p y_tip - Phi(y_tip) - int (rho r_tt + c r_t).(e_x - t) ds, which vanishes for a true motion.
    events : tuple of Happening
        In the order of time.
    outcome : str
        One of `OUTCOMES`, or "arc".
    """

    t: np.ndarray
    front: np.ndarray
    tip: TipPath
    fraction: np.ndarray
    x: np.ndarray
    y: np.ndarray
    theta: np.ndarray
    energy: Ledger
    identity: np.ndarray
    events: tuple[Happening, ...]
    outcome: str

    def until(self, n: int) -> Track:
        """Return the first ``n`` states of it, given up there."""
        t, front, (y, x, angle) = self.t[:n], self.front[:n], (part[:n] for part in self.tip)
        last = Happening("given up", *(float(part[-1]) for part in (t, front, y, x, angle)))
        return replace(
            self,
            t=t,
            front=front,
            tip=TipPath(y, x, angle),
            x=self.x[:n],
            y=self.y[:n],
            theta=self.theta[:n],
            energy=Ledger(*(part[:n] for part in self.energy)),
            identity=self.identity[:n],
            events=(*(e for e in self.events if e.t <= last.t), last),
            outcome="not settled",
        )


class Tier(Protocol):
    """A way to compute a run: `tracking.track` up to contact, and a fixed mesh with contact."""

    def __call__(
        self, setting: Setting, start: Posture, until: Until, *, resolution: int = 0, told: Told | None = None
    ) -> Track:
        """Return the run at one of two resolutions, 0 and 1, whose difference tells the error.

        Raises
        ------
        NotConverged
            If it could not be carried on, with what was found up to there in the message.
        """
