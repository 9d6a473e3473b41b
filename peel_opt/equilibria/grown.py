"""How far a flap grows at a pressure when its bond does not heal."""

from __future__ import annotations

import time

from ..base.checks import positive
from ..base.errors import NoEquilibrium, NotConverged
from ..base.threads import one_thread
from ..continuation.unhealed import unhealed_branch
from ..model.bond import CohesiveLaw
from ..model.rod import Rod
from .ask import require_certified, solve_from
from .methods import METHODS, Effort
from .question import Question
from .result import Equilibrium


@one_thread
def grown_flap(
    rod: Rod, pressure: float, *, law: str | CohesiveLaw = "auto", tol: float = 1e-8
) -> Equilibrium:
    """Flap whose front is about to go on, of a bond that stays open once it has opened.

    Its tip, which the bond has let go, stands at p y_tip = G, the work of separation, at every pressure.  At
    that pressure a flap shorter than this but longer than the unfolded state grows; a longer one is frozen
    for ever.  The length falls as the pressure rises: it is on unloading that a flap goes on, up to
    `largest_flap`.

    Parameters
    ----------
    rod : Rod
    pressure : float
        p [Pa], from the minimum pressure of the rod on.
    law : str or CohesiveLaw
        One that lets go at a finite opening; as in `length_given_pressure`.
    tol : float
        Largest error of sbar/eta, and largest certificate, of a certified answer.

    Returns
    -------
    Equilibrium
        With ``state`` "grown"; its ``length`` [m] is what is asked for.

    Raises
    ------
    InvalidInput, OutOfRange
        As `length_given_pressure`.
    NoEquilibrium
        Below the minimum pressure, where no flap begins to grow; where the whole flap has come down into the
        range of its bond, so that its length depends on how it was damaged; above T0.
    NotConverged, NotCertified
        If the answer is out of reach.

    Examples
    --------
    >>> round(grown_flap(Rod.from_ratio(1.0), 0.2).length_ratio, 6)
    5.387418
    """
    began, tol = time.perf_counter(), positive("tol", tol)
    question = Question.of_rod(rod, "pressure", pressure, law=law)
    branch = unhealed_branch(question.effective_law, question.path)
    first, last = (branch.points[i].scalars.pressure_ratio for i in (0, -1))
    P = question.target.value
    found = branch.candidates(question.target)
    reason = ""
    if first > P:
        reason = "below the minimum pressure no flap begins to grow"
    elif P > 1.0:
        reason = "above T0 no rod stays attached"
    elif not found and branch.ended == "within reach":
        reason = "the whole flap has come down into the range of its bond"
    if reason:
        nearest = question.in_units(min(max(P, first), last, 1.0))
        raise NoEquilibrium(
            f"{question.words}: {reason}; the nearest pressure that has one: {question.named(nearest)}.",
            nearest=nearest,
        )
    if not found:
        raise NotConverged(
            f"{question.words}: growing flaps could be followed to p/T0 = {last:.4g} only.",
            remedy="Ask at a lower pressure.",
        )
    before = Effort(began, len(branch.points))
    result = solve_from(found[0].solution, question, found[0].state, METHODS["spectral"], tol, before=before)
    return require_certified(question, result)
