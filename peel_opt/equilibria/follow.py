"""Continuation from any equilibrium, holding any one quantity: an iterator that keeps its points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from ..base.checks import positive, whole
from ..base.errors import InvalidInput, NoEquilibrium, NotConverged
from ..base.threads import one_thread
from ..continuation.family import Family, StepControl
from ..continuation.landing import asked_at, require_met, with_asked
from ..continuation.points import Point, arclength_between
from ..continuation.primary import primary_branch
from ..continuation.special import BRANCH_POINT, CONTACT, EVENTS, FOLDS, Located, locate, located, tip
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.equations import Scalars
from ..model.law_samples import agree
from ..model.named_laws import law_named
from ..residual.closures import chart, closure_for
from ..residual.discretisation import PROFILE_POINTS, Profile, Transcription, chebyshev, require_transcription
from ..residual.meshes import FOLLOWED
from ..residual.phases import holds_its_tip
from ..residual.shape import Solution
from .assembly import WalkedSide, assemble, require_identity
from .branch import Branch
from .branch_points import discretised, law_of, under_law
from .question import known_law
from .result import Equilibrium

#: Height of a tip over the amplitude, and share of T0 above T0, that are put down to rounding.
LIFTED = 1e-9


class Walk(Iterator[Scalars]):
    """A walk along a curve of equilibria on which one quantity stays the same.

    The walk goes on through T, where the straight rod branches off, and ends where the tip comes
    down on the plate.  Iterating takes a step and returns the four scalars there; what has been
    walked is kept, so that an interrupted walk loses nothing: `branch` turns it into a `Branch` at
    any time.

    Parameters
    ----------
    start : Equilibrium or Branch
        A branch is continued from its last point in its own direction.
    hold : {"ratio", "beta0", "pressure_ratio", "lam", "alpha1", "tip_angle"}
        What stays the same, at its value at the start.
    direction : {1, -1}
        1 towards a steeper tip, where ``start`` is an equilibrium.
    law : CohesiveLaw, optional
        Needed where the start was computed with a law of the user's own.
    step : StepControl, optional
    transcription : Transcription, optional

    Raises
    ------
    InvalidInput
        If the start carries no shape, or the quantity cannot be held.
    NoEquilibrium
        If the start is a branch that ended at the contact.
    NotConverged
        If the start is not on a branch to the accuracy of the transcription.

    Examples
    --------
    >>> from itertools import islice
    >>> from peel_opt import equilibrium
    >>> walk = Walk(equilibrium(beta0=4, lam=1.0), hold="pressure_ratio")
    >>> len({round(s.pressure_ratio, 9) for s in islice(walk, 5)})
    1
    """

    def __init__(
        self,
        start: Equilibrium | Branch,
        *,
        hold: str,
        direction: int = 1,
        law: str | CohesiveLaw | None = None,
        step: StepControl | None = None,
        transcription: Transcription | None = None,
    ) -> None:
        if direction not in (1, -1):
            raise InvalidInput(f"direction must be 1 or -1, got {direction!r}.")
        if law is not None and not isinstance(law, CohesiveLaw):
            law = known_law(law) or COHESIVE
        if step is not None and not isinstance(step, StepControl):
            raise InvalidInput(f"step must be a StepControl, got {step!r:.60}.")
        if not isinstance(start, Equilibrium | Branch):
            raise InvalidInput(f"a walk starts at an Equilibrium or a Branch, got {start!r:.60}.")
        if isinstance(start, Equilibrium):
            start.require_papers_scene("follow")
        if isinstance(start, Branch) and law is not None:
            start = under_law(start, law)
        self.rod = start.rod if hold == "ratio" else None  # else the rod changes along the walk
        if isinstance(start, Branch) and start.hold == hold and _is_contact(start):
            raise NoEquilibrium(
                "the branch ended at the contact: beyond it the tip would be under the plate.",
                remedy="Follow from one of its points instead, as branch[i].",
            )
        chosen = law or _law_of(start)
        if isinstance(start, Equilibrium) and start.law_samples and not agree(chosen, start.law_samples):
            raise InvalidInput(
                f"the equilibrium was computed with another law than this {chosen.name!r}.",
                remedy=f"Give the {start.law!r} it was computed with, with the same kinks and formulas.",
            )
        profile, forward = _start_of(start)
        value = held_at(profile.scalars, hold)
        mesh = FOLLOWED if transcription is None else require_transcription(transcription)
        tip_free = not holds_its_tip(chosen, profile)
        self.family = Family(chosen, mesh, closure_for(hold, value), tip_free=tip_free)
        anchor = "length_ratio" if hold != "beta0" else "tip_angle"
        solved = None
        for name in (anchor, "tip_angle", "length_ratio"):
            if solved is None and name != hold:
                solved = self.family.solve(profile, _closure(name, held_at(profile.scalars, name)))
        if solved is None:
            raise NotConverged(
                "the start did not converge on this transcription.", remedy="Give it more nodes."
            )
        problem, result = solved
        where = direction * np.array([1.0, 0.3, 0.2, 0.1]) if forward is None else forward
        self.points: list[Point] = []
        self.ended = ""
        first = self.family.point(problem, result.x, where, 0.0, result.iterations)
        self._steps = self.family.walk(first, step or StepControl())
        self._contact: Located | None = None

    def __next__(self) -> Scalars:
        point = next(self._steps, None) if not self.ended else None
        if point is None:
            self.ended = self.ended or "stalled"
            raise StopIteration
        if self.points and self.family.tip_free and tip(self.points[-1]) > LIFTED > -LIFTED > tip(point):
            self._contact = located(self.family, self.points[-1], point, *CONTACT)
            point, self.ended = self._contact.point, "contact"
        self.points.append(point)
        return point.scalars

    def branch(self, at: Mapping[str, Sequence[float]] | None = None) -> Branch:
        """Return what has been walked as a `Branch`, with points at asked-for values."""
        if not self.points:
            next(self, None)
        monitors = (BRANCH_POINT, *FOLDS[self.family.closure.kind])
        if self.points[0].scalars.sigma > 0.0:
            monitors += tuple(EVENTS)
        found = locate(self.family, self.points, monitors)
        if self._contact is not None:
            found.append(self._contact)
        asked = asked_at(at)
        points, specials, met = with_asked(self.family, self.points, found, asked)
        require_met(asked, met, self.ended or "limit")
        labels = labels_on_branch(self.family, points)
        part = WalkedSide(self.family, points, specials, labels.__getitem__, self.ended or "limit")
        return assemble([part], self.rod, part.ended, {})


def labels_on_branch(family: Family, points: Sequence[Point]) -> dict[float, str]:
    """Name the states along a curve, by arclength, as on the branch from T.

    They have the names that `trace` gives them where the curve is the one it traces: of one rod, or
    at one beta0.  All others are "other", and "spurious" those that a plate forbids.
    """
    above = {p.arclength: p.scalars.alpha1 > LIFTED * (1.0 + p.scalars.beta0) for p in points}
    labels = {arclength: "spurious" if is_above else "other" for arclength, is_above in above.items()}
    if family.closure.kind not in ("ratio", "length"):
        return labels
    furthest = max(p.scalars.A for p in points)
    branch = primary_branch(family.law, family.closure)
    branch.extend(lambda last: furthest < last.scalars.A)
    for point in points:
        for here, there in pairwise(branch.points):
            if point.scalars.A >= -LIFTED and family.between(here, there, point.place):
                place = arclength_between(here, there, point.place)
                labels[point.arclength] = branch.state_at(place)
                break
    return labels


@one_thread
def follow(
    start: Equilibrium | Branch,
    *,
    hold: str,
    steps: int = 100,
    until: Callable[[Scalars], bool] | None = None,
    at: Mapping[str, Sequence[float]] | None = None,
    tol: float = 1e-6,
    **options: Any,
) -> Branch:
    """Follow a curve of equilibria for some steps, or until a condition is met.

    Parameters
    ----------
    start, hold, **options
        As for `Walk`.
    steps : int
        At most so many.
    until : callable, optional
        Stop after the first point where it is true of the scalars.
    at : dict, optional
        Values at which points must lie exactly.
    tol : float
        Largest error of a point, in the metric of the arclength.

    Raises
    ------
    InvalidInput
        If an argument cannot be meant.
    NoEquilibrium
        If the start is a branch that ended at the contact, or a branch that is walked to its end does
        not take a value of ``at``.
    NotConverged
        If a point is less accurate than that, or a value of ``at`` is not met in so many steps; a
        `Walk` keeps all points and says their errors.

    Returns
    -------
    Branch
        A restarted branch begins with the last point of the one it continues.
    """
    steps, tol = whole("steps", steps, 1), positive("tol", tol)
    if until is not None and not callable(until):
        raise InvalidInput(f"until must be a function of the scalars, got {until!r:.60}.")
    asked_at(at)  # before anything is walked
    walk = Walk(start, hold=hold, **options)
    for count, scalars in enumerate(walk):
        if count >= steps or (until is not None and count > 0 and until(scalars)):
            break
    branch = walk.branch(at)
    if not branch.error.max() <= tol:
        raise NotConverged(
            f"the branch is accurate to {branch.error.max():.1e} only, asked for {tol:.1e}.",
            remedy="Give fewer steps, or a finer mesh: transcription=Spectral(nodes=48).",
        )
    require_identity(branch, tol)
    return branch


def held_at(s: Scalars, hold: str) -> float:
    """Value of a quantity, by its public name."""
    values = {
        "ratio": lambda: s.ratio,
        "beta0": lambda: s.beta0,
        "length_ratio": lambda: s.sigma,
        "pressure_ratio": lambda: s.pressure_ratio,
        "lam": lambda: s.lam,
        "alpha1": lambda: s.alpha1,
        "tip_angle": lambda: -s.A,
    }
    if not isinstance(hold, str) or hold not in values:
        raise InvalidInput(f"cannot hold {hold!r} fixed.", remedy=f"Choose one of {', '.join(values)}.")
    return float(values[hold]())


def _closure(name: str, value: float) -> Any:
    return closure_for("beta0", value**3) if name == "length_ratio" else closure_for(name, value)


def _is_contact(branch: Branch) -> bool:
    return any(p.index == len(branch) - 1 for p in branch.special("contact"))


def _law_of(start: Equilibrium | Branch) -> CohesiveLaw:
    if isinstance(start, Branch):
        return law_of(start)
    if isinstance(start.source, Solution):
        return start.source.law  # the name may be "linear" where the shape stays within y0
    named = law_named(start.law)
    if named is None:
        raise InvalidInput(f"the law {start.law!r} must be given with law=.")
    return named


def _start_of(start: Equilibrium | Branch) -> tuple[Profile, np.ndarray | None]:
    """Return a profile to start from, and the direction of a branch at its end."""
    if isinstance(start, Branch):
        problem, x = discretised(start, len(start) - 1)
        assert start.solutions is not None
        forward = chart(x[problem.tail])[1] @ start.solutions.tangents[-1][problem.tail]
        return problem.profile(x), forward
    shape = start.shape
    if shape.xi.size == 0 or shape.theta[0] == 0.0:
        raise InvalidInput("a walk starts from an equilibrium that has been found.")
    A = -float(shape.theta[0])
    fields = np.stack([shape.theta, shape.curvature, shape.Nx, shape.Ny, shape.y], axis=-1) / A
    values = CubicSpline(shape.xi, fields)(chebyshev(PROFILE_POINTS)[0])
    scalars = Scalars(A, start.alpha1 / A, float(np.cbrt(start.beta0)), start.lam)
    return Profile(np.ones(1), values[None], scalars), None
