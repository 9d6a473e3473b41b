"""Flaps of a bond that does not heal: what has let go feels the pressure alone, however low it comes down.

Along these states only the rod ahead of where the opening first reaches the range of the law is bonded.  By
the first integrals of (12) they all have p y_tip = G, the work of separation, at whatever height their tip
is.  The curve leaves the primary branch at the minimum pressure, where a flap can first grow on.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

from ..base.errors import NoEquilibrium
from ..model.bond import CohesiveLaw
from ..residual.closures import Closing, Closure
from ..residual.discretisation import Discretisation, Phases, Profile, Transcription
from ..residual.meshes import PATH
from ..residual.newton import Correction, correct
from ..residual.phases import Layout, kink_crossings
from .family import Family, is_flat
from .goal import minimum_pressure
from .points import Point
from .primary import Candidate, PrimaryBranch, crossings, primary_branch
from .special import LENGTH, Located, locate

#: Points after which a walk is given up.
LONGEST = 200

#: p/T0 up to which the states are followed: above T0 no rod stays attached.
HIGHEST = 1.0

#: Share of the rod below which the part that has let go has come down to nothing.
VANISHING = 1e-3


@dataclass(frozen=True)
class UnhealedFamily(Family):
    """The flaps of one rod whose bond, once fully open, stays open."""

    def phases_of(self, profile: Profile) -> Layout:
        """Read the phases off the heights between the front and where they first leave the law's range."""
        where = {before: xi for xi, _, before in kink_crossings(self.law, profile)}
        pieces = tuple(replace(piece, for_good=piece.lets_go) for piece in self.law.pieces)
        order = range(len(pieces) - 1, -1, -1)
        # Of several passages of a kink, the one nearest to the front counts: the rod beyond has been open.
        breaks = tuple(where[i] for i in order if i < len(pieces) - 1 and i in where)
        return Layout(tuple(pieces[i] for i in order), breaks)

    def solve(self, profile: Profile, other: Closing) -> tuple[Discretisation, Correction] | None:
        """Correct from a profile, in the phases that it has between its front and its first opening."""
        plan = self.phases_of(profile) if self.suits(profile) else None
        if plan is None or len(plan.breaks) + 1 < len(plan.phases):
            return None  # it does not open so far
        problem = self.transcription.discretise(plan.phases)
        result = correct(problem, problem.pack(profile.rephased(plan.breaks)), (*self.closures, other))
        if not result.converged:
            return None
        found = problem.profile(result.x)
        return (problem, result) if self.suits(found) and is_flat(found) else None

    def suits(self, profile: Profile, problem: Discretisation | None = None) -> bool:
        """Whether every phase has a length; which they are does not change."""
        return bool((profile.lengths > 0.0).all())

    def merged(self, profile: Profile, phases: Phases) -> Profile | None:
        """No phase ends: None."""
        return None


@dataclass(eq=False)
class UnhealedBranch:
    """The growing flaps of one rod, from its minimum pressure on.

    They are followed up to T0, or to where all of the flap has come down into the range of its bond again:
    beyond, it matters which of it has been open.

    Parameters
    ----------
    primary : PrimaryBranch
        On the mesh that these are to be walked on.

    Attributes
    ----------
    points : list of Point
    fold : Located or None
        Where the length is greatest.
    ended : {"T0", "within reach", "stalled"}

    Raises
    ------
    NoEquilibrium
        If no state of the rod has let go of its tip at the minimum pressure.
    NotConverged
        If the minimum pressure was not reached.
    """

    primary: PrimaryBranch
    points: list[Point] = field(default_factory=list)
    fold: Located | None = None
    ended: str = "stalled"

    def __post_init__(self) -> None:
        own = self.primary.family
        self.family = UnhealedFamily(own.law, own.transcription, own.closure)
        first = minimum_pressure(self.primary).point
        if not first.problem.phases[0].lets_go:
            P = first.scalars.pressure_ratio
            raise NoEquilibrium(
                f"at eta/y0 = {own.closure.value:.4g} no equilibrium opens law {own.law.name!r} fully before"
                f" the minimum pressure p/T0 = {P:.4g}: how far a flap goes depends on how it was damaged.",
                remedy="Follow its motion, or ask for a rod of larger eta/y0.",
            )
        # From here on what is open stays open: the same equations, of pieces that say so.
        problem = own.transcription.discretise(self.family.phases_of(first.profile).phases)
        for point in self.family.walk(
            self.family.point(problem, first.x, first.direction, 0.0, first.iterations)
        ):
            if self.points and self.fold is None:
                found = locate(self.family, (self.points[-1], point), (LENGTH,))
                self.fold = found[0] if found else None
            self.points.append(point)
            if point.scalars.pressure_ratio > HIGHEST:
                self.ended = "T0"
            elif point.profile.lengths[0] < VANISHING:
                self.ended = "within reach"
            if self.ended != "stalled" or len(self.points) > LONGEST:
                break

    def candidates(self, given: Closure) -> list[Candidate]:
        """All states at a closure."""
        return crossings(self.family, self.points, given, lambda _: "grown")


@lru_cache(maxsize=64)
def unhealed_branch(law: CohesiveLaw, closure: Closure, mesh: Transcription = PATH) -> UnhealedBranch:
    """Return the remembered growing flaps of a rod on a mesh."""
    primary = primary_branch(law, closure) if mesh == PATH else PrimaryBranch(Family(law, mesh, closure))
    return UnhealedBranch(primary)
